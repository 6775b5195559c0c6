//! Quadratic pieces: perspective with a parabola through three exact quotients of each piece.
//!
//! A quadratic piece passes through the quotients at both ends and at the middle. The middle may lie between
//! two pixels: the forms there are half the sum of those at the ends. Let u0, um and u1 be the coordinates at
//! the start, the middle and the end, d = u1 - u0, K = 2 (u0 + u1 - 2 um), and y from 0 to 1 the position
//! within the piece. The coordinate is
//!
//! ```text
//! u0 + (d - K) y + K y^2
//! ```
//!
//! Over n steps of one pixel, the value grows by S at the first step, and S grows by T at each step, with
//! T = 2 K / n^2 and S = (d - K) / n + K / n^2. (S and T are differences, so they are not the polynomial's
//! two coefficients, which belong to infinitely small steps.) They have 48 fraction bits. S is off by less
//! than 2^10 units in the last place and T by less than 2^11 / n (see `share`, with
//! |d - K| <= 2 |d| <= 2^25), and both are exact where n is a power of two. So over 319 pixels the value
//! drifts by less than 2^-26 texel. It starts half of 2^-16 higher, so that cutting off the remaining bits
//! rounds to nearest, and a drift below zero or beyond the last coordinate is cut off with them.
//!
//! A quadratic may leave the interval between its ends. It stays inside if it does not turn between them,
//! that is, where |K| <= |d|: its slope is d - K at one end and d + K at the other. A piece that turns is
//! drawn as two straight halves through the same three points, and these stay inside. Without clamped ends
//! |K| / |d| is 2 (r - 1) / (r + 1), where r is the piece's depth ratio, so a piece turns when r is above 3.

use modex::Column;

use super::pieces::{Cuts, INVERSES, Piece};
use crate::geometry::Texture;
use crate::plane::{PlaneStepper, Subdivision, quotients};

/// Returns `delta 2^32 / steps`, and that divided by `steps` again; |delta| < 2^27.
///
/// The inverse in the table is less than one below 2^48 / steps. So the first result is off by less than
/// 2^27 / 2^16 + 1 < 2^12, and the second by less than 2^59 / 2^48 + 2^12 / steps + 1, which is below 2^13.
/// Both are exact where `steps` is a power of two up to 2^16.
#[inline]
fn share(delta: i64, steps: u16) -> (i64, i64) {
    if steps.is_power_of_two() {
        let bits = steps.trailing_zeros();
        let once = (delta << 32) >> bits;
        return (once, once >> bits);
    }
    let inverse = i128::from(INVERSES[usize::from(steps)]);
    let once = ((i128::from(delta) * inverse) >> 16) as i64;
    (once, ((i128::from(once) * inverse) >> 48) as i64)
}

/// A coordinate that is a polynomial of the pixel, 48 fraction bits.
#[derive(Clone, Copy, Debug, Default)]
struct Path {
    at: i64,
    step: i64,
    step_change: i64,
}

impl Path {
    /// Returns the path from `u` in constant steps of `step`, both 16.16.
    fn linear(u: i32, step: i32) -> Self {
        Self {
            at: i64::from(u) << 32,
            step: i64::from(step) << 32,
            step_change: 0,
        }
    }

    /// Returns the coordinate at pixel `i`, with the polynomial evaluated from scratch, 16.16.
    fn after(&self, i: u16) -> i32 {
        let (i, pairs) = (i64::from(i), i64::from(i) * (i64::from(i) - 1) / 2);
        ((self.at + i * self.step + pairs * self.step_change) >> 32) as i32
    }

    /// Returns the coordinate at the current pixel, and steps to the next pixel.
    #[inline(always)]
    fn next(&mut self) -> i64 {
        let here = self.at;
        self.at += self.step;
        self.step += self.step_change;
        here
    }

    /// Returns the path that starts at pixel `i` of this path.
    fn from(&self, i: u16) -> Self {
        let pixels = i64::from(i);
        Self {
            at: self.at + pixels * self.step + pixels * (pixels - 1) / 2 * self.step_change,
            step: self.step + pixels * self.step_change,
            step_change: self.step_change,
        }
    }
}

/// Returns a coordinate over a quadratic piece: the path of its first half and of its second half, and
/// whether the piece is two straight halves. If it is not, the second path continues the first.
fn arc([from, middle, to]: [i32; 3], steps: u16) -> ([Path; 2], bool) {
    let [from, middle, to] = [from, middle, to].map(i64::from);
    let rounded = |u: i64| (u << 32) + (1 << 31);
    let second = steps.div_ceil(2);
    let (difference, curve) = (to - from, 2 * (from + to - 2 * middle));
    if curve.abs() <= difference.abs() {
        let (slope, _) = share(difference - curve, steps);
        let (_, curve) = share(curve, steps);
        let path = Path {
            at: rounded(from),
            step: slope + curve,
            step_change: 2 * curve,
        };
        return ([path, path.from(second)], false);
    }
    let [first, last] = [middle - from, to - middle].map(|half| share(2 * half, steps).0);
    // The middle of an odd number of steps lies half a step before a pixel.
    let past = if steps % 2 == 1 { last / 2 } else { 0 };
    let halves = [(rounded(from), first), (rounded(middle) + past, last)];
    (
        halves.map(|(at, step)| Path {
            at,
            step,
            step_change: 0,
        }),
        true,
    )
}

/// A quadratic piece of a span: its pixels, and the paths of both coordinates.
#[derive(Clone, Copy, Debug, Default)]
struct Quadratic {
    pixels: u16,
    /// The pixel where the second paths begin: `pixels` if they only continue the first paths.
    second: u16,
    paths: [[Path; 2]; 2],
}

impl Quadratic {
    /// Returns the next piece of `cuts`.
    #[inline]
    fn next(cuts: &mut Cuts) -> Self {
        let piece = cuts.next();
        let Piece { from, to, .. } = piece;
        if piece.steps == 0 {
            let paths = [from.0, from.1].map(|u| [Path::linear(u, 0); 2]);
            return Self {
                pixels: piece.pixels,
                second: piece.pixels,
                paths,
            };
        }
        let middle = quotients(piece.middle, cuts.last);
        let (u, broken_u) = arc([from.0, middle.0, to.0], piece.steps);
        let (v, broken_v) = arc([from.1, middle.1, to.1], piece.steps);
        Self {
            pixels: piece.pixels,
            second: match broken_u || broken_v {
                true => piece.steps.div_ceil(2),
                false => piece.pixels,
            },
            paths: [u, v],
        }
    }
}

/// Draws a column of `len` pixels, quadratic in each piece.
#[inline(never)]
pub fn draw(
    texture: &Texture<'_>,
    stepper: PlaneStepper,
    len: u16,
    pieces: Subdivision,
    mut column: Column<'_>,
) {
    let mut cuts = Cuts::new(stepper, len, pieces, texture);
    while !column.is_empty() {
        let piece = Quadratic::next(&mut cuts);
        let (pixels, rest) = column.split(piece.pixels);
        let (first, second) = pixels.split(piece.second);
        for (half, lane) in [first, second].into_iter().enumerate() {
            let [mut u, mut v] = [piece.paths[0][half], piece.paths[1][half]];
            lane.fill(|| {
                let (u, v) = (u.next() >> 48, v.next() >> 48);
                texture.texel(u as usize, v as usize)
            });
        }
        column = rest;
    }
}

/// The coordinates of a span, linear or quadratic in each piece, pixel after pixel: the reference
/// implementation of linear and quadratic pieces, which evaluates each polynomial from scratch for every
/// pixel.
#[derive(Clone, Copy, Debug)]
pub struct PolynomialStepper {
    cuts: Cuts,
    is_linear: bool,
    piece: Quadratic,
    /// Pixels of the piece that were returned.
    given: u16,
}

impl PolynomialStepper {
    /// Returns the coordinates of pieces that are linear.
    pub fn linear(
        stepper: PlaneStepper,
        len: u16,
        pieces: Subdivision,
        texture: &Texture<'_>,
    ) -> Self {
        Self::new(stepper, len, pieces, texture, true)
    }

    /// Returns the coordinates of pieces that are quadratic.
    pub fn quadratic(
        stepper: PlaneStepper,
        len: u16,
        pieces: Subdivision,
        texture: &Texture<'_>,
    ) -> Self {
        Self::new(stepper, len, pieces, texture, false)
    }

    fn new(
        stepper: PlaneStepper,
        len: u16,
        pieces: Subdivision,
        texture: &Texture<'_>,
        is_linear: bool,
    ) -> Self {
        Self {
            cuts: Cuts::new(stepper, len, pieces, texture),
            is_linear,
            piece: Quadratic::default(),
            given: 0,
        }
    }

    fn next_piece(&mut self) -> Quadratic {
        if !self.is_linear {
            return Quadratic::next(&mut self.cuts);
        }
        let piece = self.cuts.next();
        let steps = i32::from(piece.steps.max(1));
        let path = |from: i32, to: i32| [Path::linear(from, (to - from) / steps); 2];
        Quadratic {
            pixels: piece.pixels,
            second: piece.pixels,
            paths: [
                path(piece.from.0, piece.to.0),
                path(piece.from.1, piece.to.1),
            ],
        }
    }
}

/// Yields the coordinates. Past the span's last pixel they stay at that pixel's.
impl Iterator for PolynomialStepper {
    type Item = (i32, i32);

    fn next(&mut self) -> Option<(i32, i32)> {
        if self.given == self.piece.pixels {
            self.piece = self.next_piece();
            self.given = 0;
        }
        let i = self.given;
        self.given += 1;
        let at = |[first, second]: [Path; 2]| match i.checked_sub(self.piece.second) {
            None => first.after(i),
            Some(i) => second.after(i),
        };
        Some((at(self.piece.paths[0]), at(self.piece.paths[1])))
    }
}
