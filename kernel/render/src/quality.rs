//! Reduced quality: a face whose motion hides a mapper's errors is drawn by a faster mapper.
//!
//! A face that moves fast across the screen is seen for one frame in each place, so nobody sees by how much a
//! faster mapper bends its texture. A face that moves within its own plane is the exception: its texture
//! glides on unchanged, and a bend that stands still in the texture is visible.

use scene::{FOCAL_LENGTH, Orientation, Pose, Vec3};
use texmap::plane::Anchor;
use texmap::{Face, Mapper};

use crate::options::RenderOptions;

/// The motion from one pose of the solid to another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseChange {
    from: (Orientation, i32),
    to: (Orientation, i32),
}

impl PoseChange {
    pub fn new(from: &Pose, to: &Pose) -> Self {
        let [from, to] = [from, to].map(|pose| (pose.orientation(), pose.distance));
        Self { from, to }
    }

    /// Moves a point of view space. The result is off by about 2^-16 unit.
    fn point(&self, [x, y, z]: Vec3) -> Vec3 {
        let (from, to) = (&self.from, &self.to);
        let [x, y, z] = to.0.turn(from.0.turn_back([x, y, z - from.1]));
        [x, y, z + to.1]
    }

    /// Returns the anchors in the new pose.
    pub fn anchors(&self, anchors: &[Anchor; 3]) -> [Anchor; 3] {
        anchors.map(|anchor| Anchor {
            position: self.point(anchor.position),
            ..anchor
        })
    }

    /// Returns whether the motion hides a mapper's errors in a face's texture: one of the face's points moves
    /// by half a pixel or more, and the face does not move in its own plane.
    pub fn hides_errors(&self, anchors: &[Anchor; 3]) -> bool {
        let places = anchors.map(|anchor| anchor.position.map(i64::from));
        let ways = anchors.map(|anchor| {
            let to = self.point(anchor.position);
            [0, 1, 2].map(|k| i64::from(to[k]) - i64::from(anchor.position[k]))
        });
        // A point beside or behind the eye has no place on the screen, and it moves fast when it comes into
        // view.
        let moves = places.iter().zip(&ways).any(|(place, way)| {
            2 * i64::from(FOCAL_LENGTH) * way[0].abs().max(way[1].abs()) >= place[2]
        });
        let [a, b] = [1, 2].map(|i| [0, 1, 2].map(|k| places[i][k] - places[0][k]));
        let cross = [1, 2, 0].map(|i| {
            let j = (i + 1) % 3;
            a[i] * b[j] - a[j] * b[i]
        });
        // The cross product's entries are below 2^51, and below 2^24 after the shift. The square of such an
        // entry times the square of a `way`, below 2^26, then fits.
        let largest = cross
            .iter()
            .fold(0, |most, k: &i64| most.max(k.unsigned_abs()));
        let shift = (64 - largest.leading_zeros()).saturating_sub(24);
        let normal = cross.map(|k| i128::from(k >> shift));
        let dot = |a: [i128; 3], b: [i128; 3]| (0..3).map(|k| a[k] * b[k]).sum::<i128>();
        let ways = ways.map(|way| way.map(i128::from));
        let out: i128 = ways.iter().map(|&way| dot(way, normal).pow(2)).sum();
        let all: i128 = ways.iter().map(|&way| dot(way, way)).sum();
        // The sine of seven degrees is an eighth.
        moves && 64 * out > all * dot(normal, normal)
    }
}

/// Chooses the mapper of each face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MapperChoice {
    /// The mapper in full quality.
    full: Mapper,
    /// The faster mapper, and the motion that hides its errors.
    reduced: Option<(Mapper, PoseChange)>,
}

impl MapperChoice {
    /// Returns the choice of mappers for a frame of `pose`.
    pub fn new(options: &RenderOptions, pose: &Pose) -> Self {
        let next = options.next.filter(|next| next != pose);
        let reduced = options.mapper.reduced().zip(next);
        Self {
            full: options.mapper,
            reduced: reduced.map(|(reduced, next)| (reduced, PoseChange::new(pose, &next))),
        }
    }

    /// Returns the mapper for a face.
    pub fn mapper(&self, face: &Face<'_>) -> Mapper {
        match &self.reduced {
            Some((reduced, change)) if change.hides_errors(&face.anchors) => *reduced,
            _ => self.full,
        }
    }
}
