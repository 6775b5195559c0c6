//! Faces as they are in space: which lines of sight meet them, before anything is snapped or
//! clipped.
//!
//! A ray passes each edge of a convex face on the same side if it meets the face: that is the sign
//! of a determinant. No point is projected. Along the screen each determinant is a linear form.

use std::ops::Range;

use modex::{HEIGHT, WIDTH};
use scene::{FOCAL_LENGTH, NEAR, Vec3};

use crate::texel::{cross, dot};

/// A linear form of the screen, above zero on its inner side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Form {
    /// In the direction of twice the ray, so that it is whole.
    across: [i128; 3],
    /// What does not depend on the ray.
    constant: i128,
}

impl Form {
    fn at(&self, x: i32, y: i32) -> i128 {
        let ray = [
            2 * x - (WIDTH as i32 - 1),
            2 * y - (HEIGHT as i32 - 1),
            2 * FOCAL_LENGTH,
        ];
        dot(self.across, ray.map(i128::from)) + self.constant
    }

    /// The part of a row's `columns` where the form is at least `least`. Along the row it changes
    /// from no to yes once, or from yes to no: where is found by halving.
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

    /// How far a pixel's centre is from where the form is zero, in pixels.
    fn distance(&self, x: i32, y: i32) -> f64 {
        let [right, down, _] = self.across.map(|k| 2.0 * k as f64);
        (self.at(x, y) as f64).abs() / right.hypot(down)
    }
}

/// A flat convex face before the eye, beside it, or cut by the near plane.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Face {
    edges: Vec<Form>,
    near: Form,
    /// What the volume of the face with the eye is: above zero if the face looks at the eye.
    volume: i128,
}

impl Face {
    /// The face with these corners in the viewer's space, each coordinate within 2^24: a
    /// determinant is below 2^61, a volume below 2^75.
    pub fn new(corners: &[Vec3]) -> Self {
        let wide = |i: usize| corners[i % corners.len()].map(i128::from);
        let normals: Vec<_> = (0..corners.len())
            .map(|i| cross(wide(i), wide(i + 1)))
            .collect();
        let normal = [0, 1, 2].map(|k| normals.iter().map(|n| n[k]).sum());
        let volume = dot(wide(0), normal);
        // Seen from behind, the face is walked the other way round.
        let sign = if volume < 0 { -1 } else { 1 };
        let edge = |normal: &[i128; 3]| Form {
            across: normal.map(|k| sign * k),
            constant: 0,
        };
        Self {
            edges: normals.iter().map(edge).collect(),
            // The plane is met at z = volume / (normal . ray) times the ray's z.
            near: Form {
                across: normal.map(|k| -sign * i128::from(NEAR) * k),
                constant: sign * volume * i128::from(2 * FOCAL_LENGTH),
            },
            volume,
        }
    }

    /// Whether it looks at the eye.
    pub fn looks_at_eye(&self) -> bool {
        self.volume > 0
    }

    /// Whether it is so nearly edge-on that moving its corners by as much as `by` may turn it over: by
    /// how much the volume can change then, to first order.
    pub fn is_edge_on(&self, by: f64) -> bool {
        let length = |edge: &Form| {
            let [x, y, z] = edge.across.map(|k| k as f64);
            x.hypot(y).hypot(z)
        };
        (self.volume as f64).abs() <= by * self.edges.iter().map(length).sum::<f64>()
    }

    /// The pixels of row `y`, of those in `columns`, whose centres' lines of sight pass between the
    /// edges; and those of them that meet the face beyond the near plane or on it.
    pub fn row(&self, y: i32, columns: Range<i32>) -> (Range<i32>, Range<i32>) {
        let edges = self.edges.iter();
        let between = edges.fold(columns, |columns, edge| edge.part(y, columns, 1));
        (between.clone(), self.near.part(y, between, 0))
    }

    /// How far a pixel's centre is from the line of the nearest edge, that of the near plane's cut
    /// among them, in pixels.
    pub fn distance(&self, x: i32, y: i32) -> f64 {
        let forms = self.edges.iter().chain([&self.near]);
        let distances = forms.map(|form| form.distance(x, y));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// Whether no line of sight through the screen meets it, by one edge alone: a linear form that
    /// is nowhere above zero at the corners is so nowhere between.
    pub fn is_beside_screen(&self) -> bool {
        let (right, bottom) = (WIDTH as i32 - 1, HEIGHT as i32 - 1);
        let corners = [(0, 0), (right, 0), (0, bottom), (right, bottom)];
        let beside = |form: &Form, most: i128| corners.iter().all(|&(x, y)| form.at(x, y) <= most);
        self.edges.iter().any(|edge| beside(edge, 0)) || beside(&self.near, -1)
    }
}
