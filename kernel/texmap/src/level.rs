//! Constant depth: walls and floors, where one division serves a whole run.
//!
//! Where the plane's c does not change down the columns (a wall) or along the rows (a floor), a
//! run has one depth: u = a / c and v = b / c are linear along it, and the affine walk is the
//! perspective one. A wall whose u is constant as well (its texture stands upright) steps one
//! coordinate only. Any other plane is left to the exact mapper's columns.
//!
//! Legal input: any face. Error against the quotient of the plane's integers, clamped into the
//! texture: no more than [`drift`] says. Where c is not above zero, or the walk goes further than
//! 4096 texels, the run is exact.

use modex::Column;

use crate::coverage::{Axis, Dropped, spans};
use crate::job::{Job, Walk};
use crate::plane::{self, Plane};
use crate::straight::Straight;
use crate::{Face, Texture, affine};

/// Most that a coordinate is off at pixel `i` of a run of constant depth, 16.16: the step is
/// rounded to nearest, the start is rounded down, and the reciprocal is off by 2^-31 of itself,
/// which is an eighth at the 4096 texels that a walk may reach, in its start and in its steps.
pub fn drift(i: u16) -> i32 {
    i32::from(i) / 2 + 3
}

/// One over a depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reciprocal {
    /// 2^63 / c, c shifted to 32 bits; off by less than 2^-31 of itself, either way.
    factor: i128,
    shift: u32,
}

impl Reciprocal {
    /// Of c, if it is above zero.
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

    /// n / c, 16.16, rounded down.
    pub(crate) fn times(self, n: i64) -> i128 {
        (i128::from(n) * self.factor) >> self.shift
    }

    /// n / c, 16.16, rounded to nearest.
    fn nearest(self, n: i64) -> i128 {
        (i128::from(n) * self.factor + (1 << (self.shift - 1))) >> self.shift
    }
}

/// The forms along a run of constant depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// a and b at the first pixel, and c, which stays.
    pub at: [i64; 3],
    /// The steps of a and b.
    pub step: [i64; 2],
}

impl Line {
    /// The walk over `len` pixels, if c is above zero and the walk is not out of reach.
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

/// A walk down a column that keeps to one column of the texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wall {
    /// Across the texture, 16.16.
    pub u: i32,
    /// Down the texture, 16.16.
    pub v: i32,
    /// Its step from a pixel to the next.
    pub dv: i32,
}

impl From<Wall> for affine::Walk {
    fn from(Wall { u, v, dv }: Wall) -> Self {
        Self { u, v, du: 0, dv }
    }
}

impl Wall {
    /// The walk from pixel `pixels` on.
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

/// Along which axis the plane's depth is constant, if along one: columns before rows.
pub fn axis(plane: &Plane) -> Option<Axis> {
    match (plane.c.down, plane.c.right) {
        (0, _) => Some(Axis::Down),
        (_, 0) => Some(Axis::Right),
        _ => None,
    }
}

/// Gives `sink` the jobs of a face.
///
/// # Errors
/// A polygon outside the legal range; nothing of it was given to `sink`.
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
            // In eighths of the last place: rounded down, or to nearest, and an eighth of error.
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
