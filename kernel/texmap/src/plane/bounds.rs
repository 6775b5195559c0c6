//! Error bounds of the perspective approximations against the exact quotients: closed forms, in integers,
//! rounded up.
//!
//! Along a span, a texture coordinate is f = a / c, where a and c are linear in the pixel and change by a'
//! and c' per pixel. (b / c is treated alike.) The slope of f is -D / c^2 with D = a c' - a' c, and D is the
//! same at every pixel of the span. So one number, D, says how fast the texture coordinate changes, and c
//! says how that speed varies. c is an inverse depth, so it is large near the eye: the worst error is always
//! at the end where c is small, the far end.
//!
//! # Linear
//!
//! Let a chord join exact values of f over n pixels, and let r be the ratio of the depths at its two ends.
//! The worst error is |du| (sqrt r - 1) / (sqrt r + 1), where du is the change of f between the ends: f is
//! 1 / c times a constant plus a constant, and the difference of 1 / c and its chord is largest where c is
//! the geometric mean of the ends. Now let c be its value at the far end, p = |D| / c^2 the texels per pixel
//! there, and x = n |c'| / c, so that r = 1 + x and |du| = p n / (1 + x). The error is
//!
//! ```text
//! p n x / ((1 + x) (1 + sqrt(1 + x))^2)
//! ```
//!
//! It falls as c grows, and it grows with n. So the bound of a span is that of its longest piece, placed at the
//! span's far end: over the n steps there. The piece that lies there may be the short last piece, and then a
//! longer piece next to it may be worse.
//!
//! # Quadratic
//!
//! Through the two ends and the middle, the worst error is
//! |du| r / (r - 1) max |(z - 1) (z - m) (z - r)| / (z m r) over z from 1 to r, where m = (1 + r) / 2. With
//! z = 1 + s x that is
//!
//! ```text
//! p n x^2 max s (1/2 - s) (1 - s) / ((1 + s x) (1 + x / 2) (1 + x)),  s from 0 to 1/2
//! ```
//!
//! (the other half of s has the same numerators and larger denominators). For small x this is close to
//! p n x^2 / 20.8, and it is never above that. The familiar |du| ln(r)^2 / 20.8 is not a bound, because du is
//! measured between the ends and p at the far end.
//!
//! That bounds the parabola. A piece with r above 3 turns, and two chords are drawn in place of the parabola
//! (see [`crate::mappers::quadratic`]). Their error is that of a chord over half of the piece, at its far end:
//! at r = 3 that is 1.85 times the error of the parabola, and the factor falls towards 1 as r grows. So the
//! bound is the larger of the two.
//!
//! Both formulas contain a factor that depends on x alone. These factors come from tables with 64 parts below
//! x = 1 and 16 parts in every power of two from there; each part holds the value at its lower end. The
//! tables are too large by at most 3 % below 1, and above 1 by at most 13 % (linear) and 20 % (quadratic).
//!
//! # Chords of any length
//!
//! With c and d the values of the form c at a chord's two ends, the linear error is
//! |D c'| n^2 / (c d (sqrt c + sqrt d)^2). A sum is at least twice the geometric mean, so the error is never
//! above
//!
//! ```text
//! |D c'| n^2 / (4 (c d)^(3/2))
//! ```
//!
//! which is too large by 3 % where c is twice d. It is at most a tolerance T where the geometric mean
//! sqrt(c d) is at least R n^(2/3), with R^3 = |D c'| / (4 T). R is one number for a whole span, or for many
//! spans, and gives the permitted length of a chord at every place (`Chords`).
//!
//! # What is rounded, and what is clamped
//!
//! Rounding down moves a quotient by less than 1 + 3/128 units of 2^-16 texel, and a linear step by less than
//! one unit for every pixel. Ends outside the texture are clamped. Clamping a monotone f at a level moves a
//! chord by at most the amount clamped at its ends, and a quadratic by at most 5/4 of that, the largest sum
//! of the magnitudes of its three weights. Nor can the error exceed the coordinate's change over the whole
//! span, because the coordinate and its approximation are both monotone in every piece. On and beyond the
//! horizon that argument fails, and the bound is the size of the texture.

use super::reciprocal::{
    MAX_SLOPE, Reciprocal, ReciprocalAbove, quotients_and_excess, quotients_by,
};
use super::stepper::PlaneStepper;
use super::subdivision::Subdivision;
use crate::geometry::Texture;

/// Parts of the tables below x = 1.
const FINE: usize = 64;
/// Powers of two above x = 1, with 16 parts each.
const OCTAVES: usize = 13;
const PARTS: usize = FINE + 16 * OCTAVES;
/// End of the tables: the first x without a part, 32 fraction bits. One piece has a depth ratio of 8193
/// there.
const END: u64 = 1 << (32 + OCTAVES);
const _: () = assert!(END == MAX_SLOPE);

/// Returns 64 x at the lower end of a part.
const fn lower_end(part: usize) -> u64 {
    if part < FINE {
        return part as u64;
    }
    let (octave, of) = ((part - FINE) / 16, (part - FINE) % 16);
    ((16 + of) as u64) << octave << 2
}

/// Returns the part that contains `x`; `x` has 32 fraction bits and is below [`END`].
fn part(x: u64) -> usize {
    if x < 1 << 32 {
        return (x >> 26) as usize;
    }
    let octave = x.ilog2() - 32;
    FINE + 16 * octave as usize + ((x >> (octave + 28)) & 15) as usize
}

/// 1 / ((1 + x) (1 + sqrt(1 + x))^2) for each part, 60 fraction bits, rounded up.
const LINEAR: [u64; PARTS] = {
    let mut table = [0; PARTS];
    let mut part = 0;
    while part < PARTS {
        // `ratio` is 1 + x in 64ths; `root` is 1 + sqrt(1 + x) with 24 fraction bits, rounded down.
        let ratio = lower_end(part) + 64;
        let root = (ratio << 42).isqrt() + (1 << 24);
        let under = ratio as u128 * root as u128 * root as u128;
        table[part] = (1u128 << (60 + 6 + 48)).div_ceil(under) as u64;
        part += 1;
    }
    table
};

/// The maximum over s of s (1/2 - s) (1 - s) / ((1 + s x) (1 + x / 2) (1 + x)) for each part, 60 fraction
/// bits, rounded up.
const QUADRATIC: [u64; PARTS] = {
    let mut table = [0; PARTS];
    let mut part = 0;
    while part < PARTS {
        let x = lower_end(part) as u128;
        // The search narrows s to 2^-19, about two millionths. The function is flat around its maximum, so
        // this misses less than 2^-38 of it; adding 2^-36 of it makes up for that.
        let (mut low, mut high) = (0, 1 << 19);
        while high - low > 2 {
            let third = (high - low) / 3;
            if lobe(low + third, x) < lobe(high - third, x) {
                low += third;
            } else {
                high -= third;
            }
        }
        let top = lobe(low + 1, x);
        table[part] = (top + (top >> 36) + 1) as u64;
        part += 1;
    }
    table
};

/// Returns the function of [`QUADRATIC`] at s / 2^20 and x / 64, 60 fraction bits.
const fn lobe(s: u128, x: u128) -> u128 {
    let over = s * ((1 << 19) - s) * ((1 << 20) - s);
    (over << 39) / (((1 << 26) + s * x) * (128 + x) * (64 + x))
}

/// The error bound of a span: the quantities that the closed forms depend on.
#[derive(Clone, Copy, Debug)]
pub struct SpanBound {
    /// Coordinates at the span's two ends, as [`quotients`](super::reciprocal::quotients) returns them.
    pub ends: [(i32, i32); 2],
    steps: u16,
    /// p: the change of the faster coordinate at the far end, in texels per pixel; 32 fraction bits, rounded
    /// up.
    texel_step: u64,
    /// |c'| / c at the far end: the relative change of c per pixel; 32 fraction bits, rounded up.
    relative_slope: u64,
    /// The farthest that an end lies outside the texture, in units of 2^-16 texel.
    outside: u32,
    /// An upper limit of every error, in units of 2^-16 texel.
    most: u32,
}

impl SpanBound {
    /// Returns the quantities of the span of `len` pixels, at least 1, along `stepper`.
    pub fn new(stepper: &PlaneStepper, len: u16, texture: &Texture<'_>) -> Self {
        let last = texture.last();
        let steps = len - 1;
        let (start, end) = (stepper.at, stepper.after(steps));
        let [first, second] = [start, end].map(|[_, _, c]| Reciprocal::new(c.max(1)));
        let ends = [(start, first), (end, second)];
        let ends = ends.map(|(forms, reciprocal)| quotients_by(reciprocal, forms, last));
        let mut bound = Self {
            ends,
            steps,
            texel_step: u64::MAX,
            relative_slope: END,
            outside: 0,
            most: last.0.max(last.1) as u32 + 1,
        };
        if start[2] <= 0 || end[2] <= 0 {
            return bound;
        }
        let [from, to] = ends;
        let change = (to.0 - from.0).abs().max((to.1 - from.1).abs());
        bound.most = change as u32 + 2;
        for (forms, reciprocal) in [(start, first), (end, second)] {
            bound.outside = bound
                .outside
                .max(quotients_and_excess(reciprocal, forms, last).1);
        }
        let [a, b, c] = [0, 1, 2].map(|k| (stepper.at[k], stepper.step[k]));
        let far = ReciprocalAbove::new(if c.1 < 0 { second } else { first });
        let passes = [a, b].map(|n| passes(n, c).unsigned_abs());
        bound.texel_step = far.texel_step(passes[0].max(passes[1]));
        bound.relative_slope = far.relative_slope(c.1);
        bound
    }

    /// Returns a bound of a coordinate's error with linear [`Subdivision`], in units of 2^-16 texel.
    pub fn linear(&self, pieces: Subdivision) -> u32 {
        let steps = pieces.longest(self.steps);
        let error = self.chord(2 * u64::from(steps));
        let error = error + u64::from(self.outside) + u64::from(steps) + 2;
        error.min(self.most.into()) as u32
    }

    /// Returns a bound of a coordinate's error with quadratic [`Subdivision`], in units of 2^-16 texel.
    ///
    /// A piece that turns is drawn as two chords, so this bound covers them too (see
    /// [`crate::mappers::quadratic`] for turning pieces, d and K). Where the depth ratio of the
    /// longest piece is below 5/2, |K| is at most 6/7 |d|. Then only the rounding of the three quotients can
    /// make a piece turn, and only when |d| is below 36 units; the two halves then are off by at most 2 units
    /// more.
    pub fn quadratic(&self, pieces: Subdivision) -> u32 {
        let steps = u64::from(pieces.longest(self.steps));
        let mut error = self.curve(steps);
        if self.outside > 0 || 2 * self.relative_slope.saturating_mul(steps).min(END) > 3 << 32 {
            error = error.max(self.chord(steps));
        }
        let error = error + u64::from(self.outside) * 5 / 4 + 4;
        error.min(self.most.into()) as u32
    }

    /// Returns the closed form for a chord over `halves` half pixels at the far end.
    fn chord(&self, halves: u64) -> u64 {
        let x = (self.relative_slope.saturating_mul(halves)).div_ceil(2);
        self.times(halves, x, |x, part| (x * u128::from(LINEAR[part])) >> 52)
    }

    /// Returns the closed form for a quadratic over `steps` pixels at the far end.
    fn curve(&self, steps: u64) -> u64 {
        let x = self.relative_slope.saturating_mul(steps);
        self.times(2 * steps, x, |x, part| {
            ((((x * x) >> 32) + 1) * u128::from(QUADRATIC[part])) >> 52
        })
    }

    /// Returns p n times a factor of x that has 40 fraction bits, in units of 2^-16 texel, rounded up.
    fn times(&self, halves: u64, x: u64, factor: impl Fn(u128, usize) -> u128) -> u64 {
        if x >= END {
            return u32::MAX.into();
        }
        // x is rounded up, but the tables fall with x, so look up a value that is rounded down.
        let down = x.saturating_sub((x >> 24) + halves);
        let factor = factor(x.into(), part(down)) + 1;
        let error = u128::from(self.texel_step) * u128::from(halves) * factor;
        ((error >> 57) + 1).min(u32::MAX.into()) as u64
    }
}

/// Longest chord in steps: a row of the screen.
const LONGEST: usize = modex::WIDTH - 1;

/// The inverse depths at which a chord keeps to a tolerance, for every length of the chord. They are values
/// of the form c.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chords {
    /// R, rounded up: 8 fraction bits, below 2^42, in units of 2^`shift` as all inverse depths here.
    root: u64,
    /// Bits that are cut off inverse depths, so that the largest has at most 32 bits.
    shift: u32,
    /// T in units of 2^-16 texel, less two units for the ends, which are rounded down.
    most: u32,
}

impl Chords {
    /// Returns the permitted chords of spans along `steppers`, which share one c', for an error of at most
    /// `tolerance` units of 2^-16 texel. `near` is the largest inverse depth of any later query, and is above
    /// zero.
    #[inline]
    pub fn new(steppers: &[PlaneStepper], near: i64, tolerance: u32) -> Self {
        let shift = 32u32.saturating_sub(near.leading_zeros());
        let most = tolerance.saturating_sub(2);
        let (mut fastest, mut step) = (0, 0);
        for stepper in steppers {
            let [a, b, c] = [0, 1, 2].map(|k| (stepper.at[k], stepper.step[k]));
            let passes = [a, b].map(|n| passes(n, c).unsigned_abs());
            fastest = passes[0].max(passes[1]).max(fastest);
            step = c.1.unsigned_abs();
        }
        // D and c' both as 31 bits and an exponent, rounded up.
        let (passes, exponent) = cut(fastest);
        let (step, more) = cut(step.into());
        let product = passes * step;
        if product == 0 || most == 0 {
            // The texture coordinate is linear, or no chord keeps to the tolerance.
            let root = if most == 0 { 1 << 40 } else { 0 };
            return Self { root, shift, most };
        }
        // In these units R^3 is |D c'| 2^14 / T. Make it a number of 61 to 63 bits whose exponent is a
        // multiple of three.
        let zeros = product.leading_zeros();
        let over = (product << zeros) / u64::from(most) + 1;
        let more_zeros = over.leading_zeros();
        let exponent = exponent + more + 14 - (zeros + more_zeros) as i32;
        let rest = 1 + (-1 - exponent).rem_euclid(3);
        let root = cube_root(over << more_zeros >> rest);
        let root = match (exponent + rest) / 3 + 8 - shift as i32 {
            down @ ..0 => (root >> (-down).min(63)) + 1,
            up => root << up.min(20),
        };
        Self { root, shift, most }
    }

    /// Returns an inverse depth in units of 2^`shift`, rounded down.
    #[inline]
    pub fn cut(&self, c: i64) -> u64 {
        (c >> self.shift) as u64
    }

    /// Returns R n^(2/3) for n = `pixels`, rounded up: the least geometric mean of the inverse depths at a
    /// chord's ends.
    #[inline]
    fn mean(&self, pixels: u16) -> u64 {
        ((self.root * POWERS[usize::from(pixels)]) >> 24) + u64::from(self.root > 0)
    }

    /// Returns whether no inverse depth up to `near` permits a chord over `pixels` pixels.
    #[inline]
    pub fn is_short_of(&self, pixels: u16, near: u64) -> bool {
        self.mean(pixels) > near
    }

    /// Returns whether a chord may span the whole of `pixels` pixels along `stepper`. The test leaves no room
    /// for the rounding of the steps or for clamped ends; [`Chords::least`] does.
    #[inline]
    pub fn keep(&self, stepper: &PlaneStepper, pixels: u16) -> bool {
        let (from, to) = (stepper.at[2], stepper.after(pixels)[2]);
        let mean = self.mean(pixels);
        let is_legal = self.most > 0 && from > 0 && to > 0;
        is_legal && mean >> 32 == 0 && self.cut(from) * self.cut(to) >= mean * mean
    }

    /// Returns the least product of the inverse depths at the ends of a chord over `pixels` pixels, where the
    /// ends are clamped by up to `outside` units. Returns [`u64::MAX`], which no product reaches, if no
    /// inverse depths suffice.
    #[inline]
    pub fn least(&self, pixels: u16, outside: u32) -> u64 {
        let spent = u64::from(pixels) + u64::from(outside);
        let Some(left @ 1..) = u64::from(self.most).checked_sub(spent) else {
            return u64::MAX;
        };
        let mean = self.mean(pixels);
        // The cube root of most / left is at most 1 + spent / (3 left).
        let mean = mean + (mean * spent).div_ceil(3 * left);
        match mean >> 32 {
            0 => mean * mean,
            _ => u64::MAX,
        }
    }
}

/// n^(2/3) for every n, 16 fraction bits, rounded up.
const POWERS: [u64; LONGEST + 1] = {
    let mut powers = [0; LONGEST + 1];
    let mut n = 1;
    while n <= LONGEST {
        powers[n] = root_by_bits((n as u128).pow(2) << 48);
        n += 1;
    }
    powers
};

/// Returns the cube root of `n`, 1 to 2^66, rounded up.
const fn root_by_bits(n: u128) -> u64 {
    // Find the largest number whose cube is below n.
    let (mut root, mut bit) = (0u64, 1 << 22);
    while bit > 0 {
        if ((root | bit) as u128).pow(3) < n {
            root |= bit;
        }
        bit >>= 1;
    }
    root + 1
}

/// Returns an upper bound of the cube root of every number below n + 1, for `n` from 2^60 to 2^63 - 1; too
/// large by at most one part in 2000.
#[inline]
fn cube_root(n: u64) -> u64 {
    const GUESSES: [u32; 64] = {
        let mut guesses = [0; 64];
        let mut part = 8;
        while part < 64 {
            // The root for the middle of the part.
            guesses[part] = root_by_bits((2 * part as u128 + 1) << 56) as u32;
            part += 1;
        }
        guesses
    };
    // A Newton step from either side ends at or above the root, except for what the two divisions cut off.
    let guess = u64::from(GUESSES[(n >> 57) as usize & 63]);
    (2 * guess + n / (guess * guess)) / 3 + 2
}

/// Returns a number of at most 31 bits and an exponent, together not below `n`.
#[inline]
fn cut(n: u128) -> (u64, i32) {
    let excess = (128 - n.leading_zeros()).saturating_sub(31);
    ((n >> excess) as u64 + u64::from(excess > 0), excess as i32)
}

/// Returns D = n c' - n' c, where `n` and `c` hold the values and the steps of two forms.
pub(crate) fn passes(n: (i64, i64), c: (i64, i64)) -> i128 {
    i128::from(n.0) * i128::from(c.1) - i128::from(n.1) * i128::from(c.0)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn roots_are_no_less_than_they_should_be_and_hardly_more() {
        let mut random = seeded::generator();
        let ends = [1 << 60, (1 << 63) - 1];
        let parts = (8..64).flat_map(|part| [part << 57, (part << 57) + (1 << 57) - 1]);
        let any = (0..100_000).map(|_| random.u64(1 << 60..1 << 63));
        for n in ends.into_iter().chain(parts).chain(any) {
            let root = u128::from(cube_root(n));
            assert!(root.pow(3) > n.into(), "{n}");
            let less = root - root / 2000 - 1;
            assert!(less.pow(3) < n.into(), "{n}");
        }
        for (n, &root) in POWERS.iter().enumerate().skip(1) {
            let area = (n as u128).pow(2) << 48;
            let root = u128::from(root);
            assert!(root.pow(3) >= area && (root - 1).pow(3) < area, "{n}");
        }
    }
}
