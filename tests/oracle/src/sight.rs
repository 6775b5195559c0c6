//! Faces in space: which lines of sight meet them, before anything is snapped or clipped.
//!
//! A ray that meets a convex face passes all its edges on the same side, which is the sign of a determinant.
//! No point is projected. Along the screen each determinant is a linear form.

use std::ops::Range;

use modex::{HEIGHT, WIDTH};
use scene::{FOCAL_LENGTH, NEAR, Vec3};

use crate::texel::{cross, dot};

/// A linear form on the screen, above zero on its inner side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct RayForm {
    /// Coefficients for the direction of twice the ray, so that they are integers.
    across: [i128; 3],
    /// The part that does not depend on the ray.
    constant: i128,
}

impl RayForm {
    fn at(&self, x: i32, y: i32) -> i128 {
        let ray = [
            2 * x - (WIDTH as i32 - 1),
            2 * y - (HEIGHT as i32 - 1),
            2 * FOCAL_LENGTH,
        ];
        dot(self.across, ray.map(i128::from)) + self.constant
    }

    /// Returns the part of a row's `columns` where the form is at least `least`. Along the row the answer
    /// changes once, from no to yes or from yes to no; a binary search finds the place.
    fn part(&self, y: i32, columns: Range<i32>, least: i128) -> Range<i32> {
        let grows = self.across[0] > 0;
        let Range { mut start, mut end } = columns;
        while start < end {
            let middle = start + (end - start) / 2;
            if (self.at(middle, y) >= least) == grows {
                end = middle;
            } else {
                start = middle + 1;
            }
        }
        match grows {
            true => start..columns.end,
            false => columns.start..start,
        }
    }

    /// Returns the distance in pixels from a pixel's centre to the line where the form is zero.
    fn distance(&self, x: i32, y: i32) -> f64 {
        let [right, down, _] = self.across.map(|k| 2.0 * k as f64);
        (self.at(x, y) as f64).abs() / right.hypot(down)
    }
}

/// A flat convex face in front of the eye or beside it, or a face that the near plane cuts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewFace {
    edges: Vec<RayForm>,
    near: RayForm,
    /// The volume of the pyramid from the eye to the face, times a constant: above zero if the front of the
    /// face is seen.
    volume: i128,
}

impl ViewFace {
    /// Returns the face with these corners in view space, each coordinate within 2^24: a determinant is below
    /// 2^61, a volume below 2^75.
    pub fn new(corners: &[Vec3]) -> Self {
        let wide = |i: usize| corners[i % corners.len()].map(i128::from);
        let normals: Vec<_> = (0..corners.len())
            .map(|i| cross(wide(i), wide(i + 1)))
            .collect();
        let normal = [0, 1, 2].map(|k| normals.iter().map(|n| n[k]).sum());
        let volume = dot(wide(0), normal);
        // A face seen from behind is walked the other way round.
        let sign = if volume < 0 { -1 } else { 1 };
        let edge = |normal: &[i128; 3]| RayForm {
            across: normal.map(|k| sign * k),
            constant: 0,
        };
        Self {
            edges: normals.iter().map(edge).collect(),
            // The ray meets the plane at z = volume / (normal . ray) times the ray's z.
            near: RayForm {
                across: normal.map(|k| -sign * i128::from(NEAR) * k),
                constant: sign * volume * i128::from(2 * FOCAL_LENGTH),
            },
            volume,
        }
    }

    /// Returns whether the eye sees the front of the face.
    pub fn looks_at_eye(&self) -> bool {
        self.volume > 0
    }

    /// Returns whether moving the corners by `by` may turn the face over, because it is nearly edge-on:
    /// compares the volume with its largest change, to first order.
    pub fn is_edge_on(&self, by: f64) -> bool {
        let length = |edge: &RayForm| {
            let [x, y, z] = edge.across.map(|k| k as f64);
            x.hypot(y).hypot(z)
        };
        (self.volume as f64).abs() <= by * self.edges.iter().map(length).sum::<f64>()
    }

    /// Returns the pixels of row `y` in `columns` whose centres' lines of sight pass between the edges, and
    /// the part of these pixels whose lines meet the face on the near plane or beyond it.
    pub fn row(&self, y: i32, columns: Range<i32>) -> (Range<i32>, Range<i32>) {
        let edges = self.edges.iter();
        let between = edges.fold(columns, |columns, edge| edge.part(y, columns, 1));
        (between.clone(), self.near.part(y, between, 0))
    }

    /// Returns the distance in pixels from a pixel's centre to the line of the nearest edge. The near plane's
    /// cut counts as an edge.
    pub fn distance(&self, x: i32, y: i32) -> f64 {
        let forms = self.edges.iter().chain([&self.near]);
        let distances = forms.map(|form| form.distance(x, y));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// Returns whether a single edge shows that no line of sight through the screen meets the face. If a
    /// linear form is nowhere above zero at the corners, it is nowhere above zero between them.
    pub fn is_beside_screen(&self) -> bool {
        let (right, bottom) = (WIDTH as i32 - 1, HEIGHT as i32 - 1);
        let corners = [(0, 0), (right, 0), (0, bottom), (right, bottom)];
        let beside =
            |form: &RayForm, most: i128| corners.iter().all(|&(x, y)| form.at(x, y) <= most);
        self.edges.iter().any(|edge| beside(edge, 0)) || beside(&self.near, -1)
    }
}
