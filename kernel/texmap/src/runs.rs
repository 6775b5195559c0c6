//! Perspective by pieces of a span: quotients at the ends of short pieces, and a polynomial
//! between.
//!
//! A span of `len` pixels has `len - 1` steps from its first pixel's centre to its last. The steps
//! are cut into pieces. Neighbouring pieces share the quotient between them, and the last piece
//! ends *on* the span's last pixel. So a span of one pixel has no piece, and nothing is divided by
//! zero.
//!
//! # A quotient
//!
//! [`Reciprocal`] needs one division for the two coordinates of a place. A coordinate is off by
//! less than 2^-16 (1 + 3/128) texel, and never above the quotient. A quotient outside the texture
//! is clamped into it. On and beyond the horizon, where c is not above zero, no division happens,
//! and the coordinate is that of [`plane::coordinate`].
//!
//! # Linear
//!
//! The step is cut towards zero. So nothing between two ends inside the texture lies outside it,
//! and no loop clamps. After n pixels the cut step is off by less than n 2^-16 texel.
//!
//! # Quadratic
//!
//! A quadratic piece passes through the quotients at both ends and at the middle. The middle may
//! lie between two pixels: the forms there are half the sum of those at the ends. Let u0, um and u1
//! be the coordinates at the start, the middle and the end, d = u1 - u0, K = 2 (u0 + u1 - 2 um),
//! and y from 0 to 1 the position within the piece. The coordinate is
//!
//! ```text
//! u0 + (d - K) y + K y^2
//! ```
//!
//! Over n steps of one pixel, the value grows by S at the first step, and S grows by T at each
//! step, with T = 2 K / n^2 and S = (d - K) / n + K / n^2. (S and T are differences, so they are
//! not the polynomial's two coefficients, which belong to infinitely small steps.) They have 48
//! fraction bits. S is off by less than 2^10 units in the last place and T by less than 2^11 / n
//! (see `share`, with |d - K| <= 2 |d| <= 2^25), and both are exact where n is a power of two. So
//! over 319 pixels the value drifts by less than 2^-26 texel. It starts half of 2^-16 higher, so
//! that cutting off the remaining bits rounds to nearest, and a drift below zero or beyond the last
//! coordinate is cut off with them.
//!
//! A quadratic may leave the interval between its ends. It stays inside if it does not turn between
//! them, that is, where |K| <= |d|: its slope is d - K at one end and d + K at the other. A piece
//! that turns is drawn as two straight halves through the same three points, and these stay inside.
//! Without clamped ends |K| / |d| is 2 (r - 1) / (r + 1), where r is the piece's depth ratio, so a
//! piece turns when r is above 3.
//!
//! [`plane::coordinate`]: crate::plane::coordinate

use core::hint::black_box;

use modex::Column;

use crate::loops::Draw;
use crate::plane::Walk;
use crate::{Texture, affine};

/// Longest span in steps, which is one less than its pixels: a row of the screen.
const MAX_STEPS: usize = modex::WIDTH - 1;
/// Longest piece of [`Pieces::Powers`].
const LONGEST_POWER: u16 = 64;

/// A way to cut a span into pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// Pieces of the given number of steps, 2 to 128, and a last piece of the steps left over.
    Of(u8),
    /// Powers of two that add up to the span's steps, at most 64 each, the longest first. Every
    /// division by a piece's length is a shift.
    Powers,
    /// A single piece: the whole span.
    Whole,
}

impl Pieces {
    /// Returns the steps of the next piece when `left` steps are left.
    #[inline]
    fn next(self, left: u16) -> u16 {
        match self {
            Self::Of(steps) => left.min(steps.into()),
            Self::Powers => match left.min(LONGEST_POWER) {
                0 => 0,
                left => 1 << left.ilog2(),
            },
            Self::Whole => left,
        }
    }

    /// Returns the steps of the longest piece in a span of `steps` steps.
    pub fn longest(self, steps: u16) -> u16 {
        self.next(steps)
    }
}

/// 1 / c for c above zero, to 31 bits.
#[derive(Clone, Copy, Debug)]
pub struct Reciprocal {
    /// Leading zeros of c: 64 less its bits.
    shift: u32,
    /// 2^63 / (h + 1), rounded down, where h is the highest 32 bits of c: 2^31 to 2^32 - 1.
    value: u64,
}

impl Reciprocal {
    /// Returns the reciprocal of `c`, 1 to 2^55: a value of a form of a [`crate::Plane`] on the
    /// screen, or the sum of two.
    #[inline]
    pub fn new(c: i64) -> Self {
        let shift = c.leading_zeros();
        let high = ((c as u64) << shift >> 32) + 1;
        Self {
            shift,
            value: (1 << 63) / high,
        }
    }

    /// Returns the leading zeros of c, and 2^63 / (h + 1) as in [`Reciprocal::new`].
    #[inline]
    pub(crate) fn parts(self) -> (u32, u64) {
        (self.shift, self.value)
    }

    /// Returns `rise` / c with 16 more fraction bits than `rise` has, for c of 16 bits or more. The
    /// result is off by 2^-31 of its value, and is rounded down.
    #[inline]
    pub(crate) fn slope(self, rise: i64) -> i64 {
        ((i128::from(rise) * i128::from(self.value)) >> ((79 - self.shift) % 64)) as i64
    }

    /// Returns n / c in 16.16 for 0 <= n < 256 c: at most the quotient, and less than 1 + 3/128
    /// units below it.
    ///
    /// With c' = c 2^shift / 2^32 and n' = n 2^shift / 2^40, the quotient is 2^24 n' / c', and n' <
    /// c'. Three values are rounded down, and each rounding costs less than 2^-7 units: n' to a
    /// whole number (value / 2^39), 1 / c' to at least 1 / (c' + 1) (2^24 / c'), and the reciprocal
    /// to a whole number (n' / 2^39). Cutting off the fraction of the result then costs less than
    /// one unit.
    #[inline]
    pub fn times(self, n: i64) -> i32 {
        let high = (n as u64) << (self.shift - 8) >> 32;
        ((high * self.value) >> 39) as i32
    }
}

/// A [`Reciprocal`] of a c from [`LargeReciprocal::LEAST`] on, with the same results bit for bit.
/// It needs one shift where [`Reciprocal`] needs two.
#[derive(Clone, Copy)]
struct LargeReciprocal {
    /// Number of bits of c above 24.
    down: u32,
    value: u64,
}

impl LargeReciprocal {
    const LEAST: i64 = 1 << 31;

    #[inline]
    fn new(c: i64) -> Self {
        // The number of the highest bit of c, in the form that the CPU returns.
        let highest = 63 ^ (c as u64 | 1).leading_zeros();
        // 32 bits, so that the compiler can see that `high` + 1 is not zero.
        let high = (c as u64 >> (highest - 31)) as u32;
        Self {
            down: highest - 23,
            value: (1 << 63) / (u64::from(high) + 1),
        }
    }

    #[inline]
    fn times(self, n: i64) -> i32 {
        (((n as u64 >> self.down) * self.value) >> 39) as i32
    }
}

/// Returns the coordinates where the three forms have the values `forms`, clamped into a texture
/// whose last coordinates are `last`.
///
/// They are off by less than 1 + 3/128 units of 2^-16 texel, and never above the quotients.
#[inline]
pub fn quotients(forms: [i64; 3], last: (i32, i32)) -> (i32, i32) {
    quotients_by(Reciprocal::new(forms[2].max(1)), forms, last)
}

/// Returns [`quotients`], from the reciprocal of c, or of 1 where c is below 1.
#[inline]
pub(crate) fn quotients_by(
    reciprocal: Reciprocal,
    [a, b, c]: [i64; 3],
    last: (i32, i32),
) -> (i32, i32) {
    let quotient = |n: i64, last: i32| {
        if n < 0 {
            0
        } else if n >= i64::from((last >> 16) + 1) * c {
            last
        } else {
            reciprocal.times(n)
        }
    };
    (quotient(a, last.0), quotient(b, last.1))
}

/// 2^48 / n, rounded down.
const INVERSES: [u64; MAX_STEPS + 1] = {
    let mut inverses = [0; MAX_STEPS + 1];
    let mut n = 1;
    while n <= MAX_STEPS {
        inverses[n] = (1 << 48) / n as u64;
        n += 1;
    }
    inverses
};

/// Returns `delta / steps`, cut towards zero; |delta| < 2^24, steps 1 to 319.
///
/// Below 2^8 steps the result is floor(delta m / 2^32), where m is the next whole number above 2^32
/// / steps. Its error is at most delta / 2^32 < 2^-8 upward, and a quotient is at least 1 / steps
/// below the next whole number.
#[inline]
pub fn over(delta: i32, steps: u16) -> i32 {
    if steps.is_power_of_two() {
        let round = (delta >> 31) & (i32::from(steps) - 1);
        return (delta + round) >> steps.trailing_zeros();
    }
    if steps > 255 {
        return delta / i32::from(steps);
    }
    let inverse = (INVERSES[usize::from(steps)] >> 16) + 1;
    let size = (u64::from(delta.unsigned_abs()) * inverse) >> 32;
    if delta < 0 {
        -(size as i32)
    } else {
        size as i32
    }
}

/// Returns `delta 2^32 / steps`, and that divided by `steps` again; |delta| < 2^27.
///
/// The inverse in the table is less than one below 2^48 / steps. So the first result is off by less
/// than 2^27 / 2^16 + 1 < 2^12, and the second by less than 2^59 / 2^48 + 2^12 / steps + 1, which
/// is below 2^13. Both are exact where `steps` is a power of two up to 2^16.
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
    bend: i64,
}

impl Path {
    /// Returns the path from `u` in constant steps of `step`, both 16.16.
    fn straight(u: i32, step: i32) -> Self {
        Self {
            at: i64::from(u) << 32,
            step: i64::from(step) << 32,
            bend: 0,
        }
    }

    /// Returns the coordinate at pixel `i`, with the polynomial evaluated from scratch, 16.16.
    fn after(&self, i: u16) -> i32 {
        let (i, pairs) = (i64::from(i), i64::from(i) * (i64::from(i) - 1) / 2);
        ((self.at + i * self.step + pairs * self.bend) >> 32) as i32
    }

    /// Returns the coordinate at the current pixel, and steps to the next pixel.
    #[inline(always)]
    fn next(&mut self) -> i64 {
        let here = self.at;
        self.at += self.step;
        self.step += self.bend;
        here
    }

    /// Returns the path that starts at pixel `i` of this path.
    fn from(&self, i: u16) -> Self {
        let pixels = i64::from(i);
        Self {
            at: self.at + pixels * self.step + pixels * (pixels - 1) / 2 * self.bend,
            step: self.step + pixels * self.bend,
            bend: self.bend,
        }
    }
}

/// Returns a coordinate over a quadratic piece: the path of its first half and of its second half,
/// and whether the piece is two straight halves. If it is not, the second path continues the first.
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
            bend: 2 * curve,
        };
        return ([path, path.from(second)], false);
    }
    let [first, last] = [middle - from, to - middle].map(|half| share(2 * half, steps).0);
    // The middle of an odd number of steps lies half a step before a pixel.
    let past = if steps % 2 == 1 { last / 2 } else { 0 };
    let halves = [(rounded(from), first), (rounded(middle) + past, last)];
    (halves.map(|(at, step)| Path { at, step, bend: 0 }), true)
}

/// A quadratic piece of a span: its pixels, and the paths of both coordinates.
#[derive(Clone, Copy, Debug, Default)]
struct Quadratic {
    pixels: u16,
    /// The pixel where the second paths begin: `pixels` if they only continue the first paths.
    second: u16,
    paths: [[Path; 2]; 2],
}

/// Cuts a span into pieces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cuts {
    walk: Walk,
    pieces: Pieces,
    last: (i32, i32),
    /// The coordinates where the next piece begins.
    here: (i32, i32),
    /// The steps left.
    left: u16,
}

/// A piece of a span: its steps, its pixels, and the coordinates at its ends.
pub(crate) struct Piece {
    steps: u16,
    pixels: u16,
    from: (i32, i32),
    to: (i32, i32),
    /// Twice the forms at the middle.
    middle: [i64; 3],
}

impl Piece {
    #[inline]
    pub(crate) fn pixels(&self) -> u16 {
        self.pixels
    }

    /// Returns the affine walk along the piece.
    #[inline]
    pub(crate) fn straight(&self) -> affine::Walk {
        between(self.from, self.to, self.steps)
    }
}

impl Cuts {
    #[inline]
    pub(crate) fn new(walk: Walk, len: u16, pieces: Pieces, texture: &Texture<'_>) -> Self {
        let last = texture.last();
        Self {
            walk,
            pieces,
            last,
            here: quotients(walk.at, last),
            left: len - 1,
        }
    }

    /// Returns the next piece. Call it only until the pieces have all of the span's pixels.
    #[inline]
    pub(crate) fn next(&mut self) -> Piece {
        let steps = self.pieces.next(self.left);
        self.left -= steps;
        let from = self.here;
        let end = self.walk.after(steps);
        let middle = [0, 1, 2].map(|k| self.walk.at[k] + end[k]);
        self.walk.at = end;
        if steps > 0 {
            self.here = quotients(end, self.last);
        }
        Piece {
            steps,
            pixels: steps + u16::from(self.left == 0),
            from,
            to: self.here,
            middle,
        }
    }

    #[inline]
    fn quadratic(&mut self) -> Quadratic {
        let piece = self.next();
        let Piece { from, to, .. } = piece;
        if piece.steps == 0 {
            let paths = [from.0, from.1].map(|u| [Path::straight(u, 0); 2]);
            return Quadratic {
                pixels: piece.pixels,
                second: piece.pixels,
                paths,
            };
        }
        let middle = quotients(piece.middle, self.last);
        let (u, broken_u) = arc([from.0, middle.0, to.0], piece.steps);
        let (v, broken_v) = arc([from.1, middle.1, to.1], piece.steps);
        Quadratic {
            pixels: piece.pixels,
            second: match broken_u || broken_v {
                true => piece.steps.div_ceil(2),
                false => piece.pixels,
            },
            paths: [u, v],
        }
    }
}

/// Draws a column that is linear in each piece. `draw` draws a piece. `draw_eights` draws pieces
/// whose pixels come in whole eights, where there are enough pieces to make it worthwhile.
#[inline(always)]
pub(crate) fn linear(
    texture: &Texture<'_>,
    walk: &Walk,
    pieces: Pieces,
    draw: Draw,
    draw_eights: impl Fn(&Texture<'_>, affine::Walk, Column<'_>),
    mut column: Column<'_>,
) {
    let (last, mut left) = (texture.last(), column.len() - 1);
    // If both ends of the span are inside the texture and in front of the eye, everything between
    // them is too.
    let [width, height] = [last.0, last.1].map(|last| i64::from(last >> 16) + 1);
    let needs_no_clamp = |[a, b, c]: [i64; 3]| a >= 0 && b >= 0 && a < width * c && b < height * c;
    if !(needs_no_clamp(walk.at) && needs_no_clamp(walk.after(left))) {
        return linear_clamped(texture, walk, pieces, draw, column);
    }
    let quotients = |[a, b, c]: [i64; 3]| {
        let over = Reciprocal::new(c);
        (over.times(a), over.times(b))
    };
    let mut at = walk.at;
    let mut here = quotients(at);
    let alike = match pieces {
        Pieces::Of(steps) => u16::from(steps),
        Pieces::Powers => LONGEST_POWER,
        Pieces::Whole => 0,
    };
    // Pieces of equally many steps, a power of two. The last piece has one pixel more, so it is not
    // among them.
    if left > alike
        && alike >= 8
        && alike.is_power_of_two()
        && at[2].min(walk.after(left + alike)[2]) >= LargeReciprocal::LEAST
        // Checked once here, so that no loop has to.
        && texture.masks().is_some()
    {
        let bits = alike.trailing_zeros();
        let all = (left - 1) >> bits << bits;
        let (pixels, rest) = column.split(all);
        let stride = walk.step.map(|step| step << bits);
        let cut = |delta: i32| {
            let up = if delta < 0 { i32::from(alike) - 1 } else { 0 };
            (delta + up) >> bits
        };
        let [mut a, mut b, mut c] = [at[0], at[1], at[2] + stride[2]];
        // Hide the division from the compiler, which would otherwise move each division to the
        // place of its use.
        let mut over = black_box(LargeReciprocal::new(c));
        for pixels in pixels.chunks(alike) {
            a += stride[0];
            b += stride[1];
            c += stride[2];
            let ((u, v), to) = (here, (over.times(a), over.times(b)));
            // The division for the next piece runs while this piece is drawn.
            over = LargeReciprocal::new(c);
            let (du, dv) = (cut(to.0 - u), cut(to.1 - v));
            draw_eights(texture, affine::Walk { u, v, du, dv }, pixels);
            here = to;
        }
        at = [a, b, c - stride[2]];
        left -= all;
        column = rest;
    }
    while !column.is_empty() {
        let steps = pieces.next(left);
        left -= steps;
        at = [0, 1, 2].map(|k| at[k] + walk.step[k] * i64::from(steps));
        let to = quotients(at);
        let (pixels, rest) = column.split(steps + u16::from(left == 0));
        draw(texture, &between(here, to, steps), pixels);
        (here, column) = (to, rest);
    }
}

/// Draws a column as [`linear`] does, where quotients may have to be clamped into the texture.
#[cold]
fn linear_clamped(
    texture: &Texture<'_>,
    walk: &Walk,
    pieces: Pieces,
    draw: Draw,
    mut column: Column<'_>,
) {
    let mut cuts = Cuts::new(*walk, column.len(), pieces, texture);
    while !column.is_empty() {
        let piece = cuts.next();
        let (pixels, rest) = column.split(piece.pixels);
        draw(texture, &piece.straight(), pixels);
        column = rest;
    }
}

/// Returns the walk of `steps` steps between two places inside the texture.
#[inline]
pub fn between(from: (i32, i32), to: (i32, i32), steps: u16) -> affine::Walk {
    let (du, dv) = match steps {
        0 => (0, 0),
        _ => (over(to.0 - from.0, steps), over(to.1 - from.1, steps)),
    };
    affine::Walk {
        u: from.0,
        v: from.1,
        du,
        dv,
    }
}

/// Draws a column of `len` pixels, quadratic in each piece.
#[inline(never)]
pub fn quadratic(
    texture: &Texture<'_>,
    walk: Walk,
    len: u16,
    pieces: Pieces,
    mut column: Column<'_>,
) {
    let mut cuts = Cuts::new(walk, len, pieces, texture);
    while !column.is_empty() {
        let piece = cuts.quadratic();
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

/// The coordinates of a plane's walk, linear or quadratic in each piece, pixel after pixel: the
/// reference implementation of `linear` and [`quadratic`], which evaluates each polynomial from
/// scratch for every pixel.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    cuts: Cuts,
    is_linear: bool,
    piece: Quadratic,
    /// Pixels of the piece that were returned.
    given: u16,
}

impl Steps {
    /// Returns the coordinates of pieces that are linear.
    pub fn linear(walk: Walk, len: u16, pieces: Pieces, texture: &Texture<'_>) -> Self {
        Self::new(walk, len, pieces, texture, true)
    }

    /// Returns the coordinates of pieces that are quadratic.
    pub fn quadratic(walk: Walk, len: u16, pieces: Pieces, texture: &Texture<'_>) -> Self {
        Self::new(walk, len, pieces, texture, false)
    }

    fn new(walk: Walk, len: u16, pieces: Pieces, texture: &Texture<'_>, is_linear: bool) -> Self {
        Self {
            cuts: Cuts::new(walk, len, pieces, texture),
            is_linear,
            piece: Quadratic::default(),
            given: 0,
        }
    }

    fn next_piece(&mut self) -> Quadratic {
        if !self.is_linear {
            return self.cuts.quadratic();
        }
        let piece = self.cuts.next();
        let steps = i32::from(piece.steps.max(1));
        let path = |from: i32, to: i32| [Path::straight(from, (to - from) / steps); 2];
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
impl Iterator for Steps {
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

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn large_reciprocals_are_reciprocals() {
        let mut random = seeded::generator();
        let mut numbers = random.fork();
        let mut compare = |c: i64| {
            let (one, other) = (Reciprocal::new(c), LargeReciprocal::new(c));
            for n in [0, 1, c, random.i64(0..256 * c), 256 * c - 1] {
                assert_eq!(one.times(n), other.times(n), "{n} / {c}");
            }
        };
        for bits in 31..55 {
            compare(1 << bits);
            compare((2 << bits) - 1);
        }
        for _ in 0..100_000 {
            let bits = numbers.u32(31..55);
            compare(numbers.i64(LargeReciprocal::LEAST..2 << bits));
        }
    }
}
