//! Perspective by runs: quotients at the ends of short pieces of a run, and a polynomial between.
//!
//! A run of `len` pixels has `len - 1` steps from its first pixel's centre to its last one's. They
//! are cut into pieces; neighbours share the quotient between them, and the last piece ends *on* the
//! run's last pixel: a run of one pixel has no piece to divide by.
//!
//! # A quotient
//!
//! [`Reciprocal`] takes one division for the two coordinates of a place: off by less than
//! 2^-16 (1 + 3/128) texel, and never above. A quotient outside the texture is clamped into it; on
//! the horizon and beyond, where c is not above zero, it is not divided at all, and is what
//! [`plane::coordinate`] makes of it.
//!
//! # Linear
//!
//! The step is cut towards zero, so between two ends inside the texture nothing is outside of it, and
//! no loop clamps. After n pixels that is off by less than n 2^-16 texel.
//!
//! # Quadratic
//!
//! Through both ends and the quotient at the middle, which may lie between two pixels: there the
//! forms are half the sum of those at the ends. With d the difference of the ends, K = 2 (u0 + u1 - 2
//! um) and y from 0 to 1 it is
//!
//! ```text
//! u0 + (d - K) y + K y^2
//! ```
//!
//! Over n steps of a pixel the value grows by S, and S by T, with T = 2 K / n^2 and S = (d - K) / n +
//! K / n^2: not by the two coefficients, which are those of a step without an end. They have 48
//! fraction bits, and each is off by less than 2^13 / n last places (`share`), or by none where n is
//! a power of two: over 319 pixels the value drifts by less than 2^-26 texel. It starts half of
//! 2^-16 higher, so cutting the rest off rounds to nearest, and a drift below zero or beyond the last
//! coordinate is cut off with it.
//!
//! A quadratic may leave what its ends span. It does not where it turns nowhere between them, which is
//! where |K| <= |d|: its slope is (d - K) at one end and (d + K) at the other. A piece that turns is
//! drawn as two straight halves through the same three points, and those stay between them. Without
//! clamped ends |K| / |d| is 2 (r - 1) / (r + 1), so that happens when the depth ratio r of a piece is
//! above 3.
//!
//! [`plane::coordinate`]: crate::plane::coordinate

use core::hint::black_box;

use modex::Column;

use crate::loops::Draw;
use crate::plane::Walk;
use crate::{Texture, affine};

/// Longest run in steps, which is one less than its pixels: a row of the screen.
const MAX_STEPS: usize = modex::WIDTH - 1;
/// Longest piece of [`Pieces::Powers`].
const LONGEST_POWER: u16 = 64;

/// How a run is cut into pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// Of so many steps each, 2 to 128, and what is left over.
    Of(u8),
    /// Of the powers of two that the run's steps are the sum of, none above 64, the longest first:
    /// every division by a length is a shift.
    Powers,
    /// One: the run.
    Whole,
}

impl Pieces {
    /// The next piece's steps where `left` are left.
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

    /// The longest piece of a run of so many steps.
    pub fn longest(self, steps: u16) -> u16 {
        self.next(steps)
    }
}

/// 1 / c for c above zero, to 31 bits.
#[derive(Clone, Copy, Debug)]
pub struct Reciprocal {
    /// Bits that c is short of 64.
    shift: u32,
    /// 2^63 over c's highest 32 bits and one in their last place, rounded down: 2^31 to 2^32 - 1.
    value: u64,
}

impl Reciprocal {
    /// That of `c`, 1 to 2^55: a form of a [`crate::Plane`] on the screen, or the sum of two.
    #[inline]
    pub fn new(c: i64) -> Self {
        let shift = c.leading_zeros();
        let high = ((c as u64) << shift >> 32) + 1;
        Self {
            shift,
            value: (1 << 63) / high,
        }
    }

    /// The bits that c is short of 64, and 2^63 over its highest 32 bits as [`Reciprocal::new`] has it.
    #[inline]
    pub(crate) fn parts(self) -> (u32, u64) {
        (self.shift, self.value)
    }

    /// `rise` / c with 16 more fraction bits than `rise` has, for c of 16 bits or more. Off by 2^-31 of
    /// itself, and rounded down.
    #[inline]
    pub(crate) fn slope(self, rise: i64) -> i64 {
        ((i128::from(rise) * i128::from(self.value)) >> ((79 - self.shift) % 64)) as i64
    }

    /// n / c in 16.16 for 0 <= n < 256 c: at most the quotient, and less by below 1 + 3/128 units.
    ///
    /// With c' = c 2^shift / 2^32 and n' = n 2^shift / 2^40 the quotient is 2^24 n' / c', and n' <
    /// c'. Three things are rounded down, each worth less than 2^-7 units: n' to a whole number
    /// (value / 2^39), 1 / c' to 1 / (c' + 1) at most (2^24 / c'), and the reciprocal to a whole
    /// number (n' / 2^39). What is then cut off is less than a unit.
    #[inline]
    pub fn times(self, n: i64) -> i32 {
        let high = (n as u64) << (self.shift - 8) >> 32;
        ((high * self.value) >> 39) as i32
    }
}

/// [`Reciprocal`] where c is from [`LargeReciprocal::LEAST`] on, bit for bit: one shift does for its
/// two.
#[derive(Clone, Copy)]
struct LargeReciprocal {
    /// Bits that c has above 23.
    down: u32,
    value: u64,
}

impl LargeReciprocal {
    const LEAST: i64 = 1 << 31;

    #[inline]
    fn new(c: i64) -> Self {
        // The number of c's highest bit, as the CPU tells it.
        let highest = 63 ^ (c as u64 | 1).leading_zeros();
        // 32 bits, as the compiler has to know: one more of them is not zero.
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

/// The coordinates where the three forms have these values, clamped into a texture whose last
/// coordinates are `last`.
///
/// Off by less than 1 + 3/128 units of 2^-16 texel, and never above.
#[inline]
pub fn quotients(forms: [i64; 3], last: (i32, i32)) -> (i32, i32) {
    quotients_by(Reciprocal::new(forms[2].max(1)), forms, last)
}

/// [`quotients`] by the reciprocal of c, or of 1 where c is less.
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

/// `delta / steps`, cut towards zero; |delta| < 2^24, steps 1 to 319.
///
/// Below 2^8 steps: (delta m) / 2^32 with m the next whole number above 2^32 / steps is too large by
/// delta / 2^32 < 2^-8 at most, and a quotient is at least 1 / steps short of the next whole number.
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

/// `delta 2^32 / steps` and that over `steps` again; |delta| < 2^27.
///
/// The inverse is less than one short of 2^48 / steps. So the first is off by less than 2^27 / 2^16 + 1
/// < 2^12, and the second by less than 2^59 / 2^48 + 2^12 / steps + 1 < 2^13 at most; both are exact
/// where `steps` is a power of two up to 2^16.
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
    /// From `u`, 16.16, in steps of as much.
    fn straight(u: i32, step: i32) -> Self {
        Self {
            at: i64::from(u) << 32,
            step: i64::from(step) << 32,
            bend: 0,
        }
    }

    /// The polynomial multiplied out for pixel `i`.
    fn after(&self, i: u16) -> i32 {
        let (i, pairs) = (i64::from(i), i64::from(i) * (i64::from(i) - 1) / 2);
        ((self.at + i * self.step + pairs * self.bend) >> 32) as i32
    }

    /// The coordinate here; then it is a pixel further.
    #[inline(always)]
    fn next(&mut self) -> i64 {
        let here = self.at;
        self.at += self.step;
        self.step += self.bend;
        here
    }

    /// The path from pixel `i` on.
    fn from(&self, i: u16) -> Self {
        let pixels = i64::from(i);
        Self {
            at: self.at + pixels * self.step + pixels * (pixels - 1) / 2 * self.bend,
            step: self.step + pixels * self.bend,
            bend: self.bend,
        }
    }
}

/// A coordinate over a quadratic piece: the path of its first half, and of its second, which goes
/// on from it unless the piece is two straight halves; and whether it is.
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
    // An odd number of steps has its middle half a step before a pixel.
    let past = if steps % 2 == 1 { last / 2 } else { 0 };
    let halves = [(rounded(from), first), (rounded(middle) + past, last)];
    (halves.map(|(at, step)| Path { at, step, bend: 0 }), true)
}

/// A piece of a run: its pixels, and both coordinates' paths.
#[derive(Clone, Copy, Debug, Default)]
struct Quadratic {
    pixels: u16,
    /// Where the second paths begin: `pixels` where they only go on from the first.
    second: u16,
    paths: [[Path; 2]; 2],
}

/// What cuts a run into pieces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cuts {
    walk: Walk,
    pieces: Pieces,
    last: (i32, i32),
    /// Where the next piece begins.
    here: (i32, i32),
    /// Steps left.
    left: u16,
}

/// A piece: its steps, its pixels, and where it goes from and to.
pub(crate) struct Piece {
    steps: u16,
    pixels: u16,
    from: (i32, i32),
    to: (i32, i32),
    /// The forms in the middle, twice.
    middle: [i64; 3],
}

impl Piece {
    #[inline]
    pub(crate) fn pixels(&self) -> u16 {
        self.pixels
    }

    /// The walk along it.
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

    /// The next piece; whoever has drawn the run's pixels asks for no more.
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

/// Draws a column, linear in each piece. `draw` draws each; where one comes as often as to be worth
/// it, and has its pixels in whole eights, `draw_eights` does.
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
    // Both ends of the run are in the texture, before the eye: so is all between them.
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
    // Pieces of as many steps, a power of two, but for the last one, which has another pixel.
    if left > alike
        && alike >= 8
        && alike.is_power_of_two()
        && at[2].min(walk.after(left + alike)[2]) >= LargeReciprocal::LEAST
        // No loop needs to ask again.
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
        // Not known to be a division: the compiler would move all of them to where they are used.
        let mut over = black_box(LargeReciprocal::new(c));
        for pixels in pixels.chunks(alike) {
            a += stride[0];
            b += stride[1];
            c += stride[2];
            let ((u, v), to) = (here, (over.times(a), over.times(b)));
            // The next piece's division takes its time while this one is drawn.
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

/// The same where quotients may have to be clamped into the texture.
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

/// The walk of `steps` steps between two places inside the texture.
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
/// clear twin of `linear` and [`quadratic`], each polynomial multiplied out for every pixel.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    cuts: Cuts,
    is_linear: bool,
    piece: Quadratic,
    /// Pixels of the piece that were given.
    given: u16,
}

impl Steps {
    /// Linear in each piece.
    pub fn linear(walk: Walk, len: u16, pieces: Pieces, texture: &Texture<'_>) -> Self {
        Self::new(walk, len, pieces, texture, true)
    }

    /// Quadratic in each piece.
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

/// Past the run's last pixel it stays where that is.
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
