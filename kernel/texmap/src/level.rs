//! The constant-z mapper: walls and floors, where one division serves a whole span.
//!
//! Where the plane's c does not change down the columns (a wall) or along the rows (a floor), a
//! span has a single depth: u = a / c and v = b / c are linear along it, so the affine walk is
//! exact perspective. A wall whose u is constant as well (its texture stands upright) steps one
//! coordinate only. For any other plane, the exact mapper draws the columns.
//!
//! Legal input: any face. Error against the quotient of the plane's integers, clamped into the
//! texture: at most [`drift`]. Where c is not above zero, or the walk goes further than 4096
//! texels, the span is drawn exactly.

use modex::Column;

use crate::coverage::{Axis, Dropped, spans};
use crate::job::{Job, Walk};
use crate::plane::{self, Plane};
use crate::straight::Straight;
use crate::{Face, Texture, affine};

/// Returns the largest error of a coordinate at pixel `i` of a span of constant depth, 16.16. The
/// step is rounded to nearest, the start is rounded down, and the reciprocal is off by 2^-31 of its
/// value: at the 4096 texels that a walk may reach, that is 1/8 of a unit in the start and 1/8 in
/// the steps.
pub fn drift(i: u16) -> i32 {
    i32::from(i) / 2 + 3
}

/// The reciprocal of a depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reciprocal {
    /// 2^63 / c, where c is shifted to 32 bits; off by less than 2^-31 of its value, in either
    /// direction.
    factor: i128,
    shift: u32,
}

impl Reciprocal {
    /// Returns the reciprocal of c, or nothing unless c is above zero.
    pub(crate) fn new(c: i64) -> Option<Self> {
        if c <= 0 {
            return None;
        }
        let c = c as u64;
        let bits = 64 - c.leading_zeros();
        let scaled = if bits > 32 {
            c >> (bits - 32)
        } else {
            c << (32 - bits)
        };
        Some(Self {
            factor: ((1 << 63) / scaled).into(),
            shift: bits + 15,
        })
    }

    /// Returns n / c, 16.16, rounded down.
    pub(crate) fn times(self, n: i64) -> i128 {
        (i128::from(n) * self.factor) >> self.shift
    }

    /// Returns n / c, 16.16, rounded to nearest.
    fn nearest(self, n: i64) -> i128 {
        (i128::from(n) * self.factor + (1 << (self.shift - 1))) >> self.shift
    }
}

/// The forms along a span of constant depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// a and b at the first pixel, and the constant c.
    pub at: [i64; 3],
    /// The steps of a and b.
    pub step: [i64; 2],
}

impl Line {
    /// Returns the walk over `len` pixels, or nothing if c is not above zero or the walk goes out
    /// of reach.
    pub(crate) fn straight(&self, len: u16) -> Option<Straight> {
        let [a, b, c] = self.at;
        let over = Reciprocal::new(c)?;
        let at = [a, b].map(|n| i64::try_from(over.times(n)));
        let step = self.step.map(|n| i64::try_from(over.nearest(n)));
        let straight = Straight {
            at: [at[0].ok()?, at[1].ok()?],
            step: match len {
                1 => [0; 2],
                _ => [step[0].ok()?, step[1].ok()?],
            },
        };
        straight.in_reach(len).then_some(straight)
    }
}

/// A walk down a column that stays in one column of the texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wall {
    /// Coordinate across the texture, 16.16.
    pub u: i32,
    /// Coordinate down the texture at the first pixel, 16.16.
    pub v: i32,
    /// Step of `v` from a pixel to the next.
    pub dv: i32,
}

impl From<Wall> for affine::Walk {
    fn from(Wall { u, v, dv }: Wall) -> Self {
        Self { u, v, du: 0, dv }
    }
}

impl Wall {
    /// Returns the walk that starts at pixel `pixels` of this walk.
    pub(crate) fn after(self, pixels: u16) -> Self {
        Self {
            v: self.v + i32::from(pixels) * self.dv,
            ..self
        }
    }

    /// Draws a column.
    pub(crate) fn column(self, texture: &Texture<'_>, column: Column<'_>) {
        let (u, mut v) = ((self.u >> 16) as usize, self.v);
        column.fill(|| {
            let texel = texture.texel(u, (v >> 16) as usize);
            v += self.dv;
            texel
        });
    }
}

/// Returns the axis along which the plane's depth is constant, if any; columns before rows.
pub fn axis(plane: &Plane) -> Option<Axis> {
    match (plane.c.down, plane.c.right) {
        (0, _) => Some(Axis::Down),
        (_, 0) => Some(Axis::Right),
        _ => None,
    }
}

/// Passes the jobs of a face to `sink`.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no job.
pub(crate) fn jobs(
    face: &Face<'_>,
    texture: &Texture<'_>,
    mut sink: impl FnMut(Job),
) -> Result<(), Dropped> {
    let plane = face.plane();
    let level = axis(&plane);
    let axis = level.unwrap_or(Axis::Down);
    spans(axis, face.polygon, |run| {
        let job = |first: u16, len, walk| {
            Job::new(axis, run.line, run.first + first, len, face.texture, walk)
        };
        let walk = match axis {
            Axis::Down => plane::Walk::new(&plane, axis, run.line, run.first),
            Axis::Right => plane::Walk::new(&plane, axis, run.first, run.line),
        };
        let [a, b, _] = walk.step;
        let line = Line {
            at: walk.at,
            step: [a, b],
        };
        match level.and_then(|_| line.straight(run.len)) {
            Some(straight) => straight.pieces(run.len, texture.last(), |first, len, walk| {
                let affine::Walk { u, v, du, dv } = walk;
                let walk = match (axis, du) {
                    (Axis::Down, 0) => Walk::Wall(Wall { u, v, dv }),
                    _ => Walk::Affine(walk),
                };
                sink(job(first, len, walk));
            }),
            None => sink(job(0, run.len, Walk::Exact(walk))),
        }
    })
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::straight::REACH;

    #[test]
    fn a_reciprocal_is_good_for_as_far_as_walks_reach() {
        let mut random = seeded::generator();
        for _ in 0..200_000 {
            let bits = random.u32(0..54);
            let c = random.i64(1..2 << bits);
            let texels = random.i64(1..=4096);
            let n = random.i128(-i128::from(c)..=c.into()) * i128::from(texels);
            let n = n.clamp(-(1 << 62), 1 << 62) as i64;
            let over = Reciprocal::new(c).unwrap();
            // In eighths of a unit in the last place: rounding down or to nearest, plus an eighth
            // of error.
            let (eight, c) = (i128::from(n) << 19, i128::from(c));
            let off = |at: i128| 8 * at * c - eight;
            assert!((-9 * c..=c).contains(&off(over.times(n))), "{n} / {c}");
            assert!(off(over.nearest(n)).abs() <= 5 * c, "{n} / {c}");
        }
        for c in [0, -1, i64::MIN] {
            assert!(Reciprocal::new(c).is_none());
        }
    }

    #[test]
    fn a_walk_out_of_reach_is_none() {
        let far = |a, c, step, len| {
            let at = [a, 0, c];
            let step = [step, 0];
            Line { at, step }.straight(len).is_none()
        };
        let c = 1 << 40;
        assert!(!far(4096 * c, c, 0, 1) && far(4096 * c + c / 1024, c, 0, 1));
        assert!(!far(-4096 * c, c, 1024 * c, 9) && far(-4096 * c, c, 1024 * c, 10));
        assert!(far(0, c, 8193 * c, 2) && !far(0, c, 8193 * c, 1));
        // The widest forms over the least depth.
        assert!(far(1 << 61, 1, 0, 1) && far(-(1 << 61), 1, 1 << 55, 320));
        assert!(far(0, 1, i64::MAX, 2) && far(0, 1, i64::MIN, 2) && !far(0, 1, i64::MIN, 1));
        assert_eq!(REACH, 4096 << 16);
    }
}
