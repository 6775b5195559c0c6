//! How far the approximations may be from the quotients: closed forms, in integers, rounded up.
//!
//! Along a run a coordinate is f = n / c, with n and c linear in the pixel. Its slope is -D / c^2
//! with D = n0 c1 - n1 c0 (the values at a pixel and the steps), and D is the same at every pixel
//! of the run: one number says how fast the texture passes, and c how that changes. c is large near
//! the eye. Everything happens at the end where it is small, the far one.
//!
//! # Linear
//!
//! Between exact ends over n pixels the worst error is |du| (sqrt r - 1) / (sqrt r + 1), r the
//! ratio of the end depths: f is 1 / c but for a factor and a sum, and 1 / c less its chord is
//! largest where c is the geometric mean of the ends. With c at the far end, p = |D| / c^2 (texels
//! a pixel there), x = n |c1| / c and r = 1 + x it is
//!
//! ```text
//! p n x / ((1 + x) (1 + sqrt(1 + x))^2)
//! ```
//!
//! which falls as c grows: of the pieces of a run the one at its far end is the worst, and is what
//! a bound of the run takes, as long as the run's longest.
//!
//! # Quadratic
//!
//! Through the ends and the middle it is |du| r / (r - 1) max |(z - 1) (z - m) (z - r)| / (z m r)
//! over z from 1 to r, m = (1 + r) / 2. With z = 1 + s x that is
//!
//! ```text
//! p n x^2 max s (1/2 - s) (1 - s) / ((1 + s x) (1 + x / 2) (1 + x)),  s from 0 to 1/2
//! ```
//!
//! (the other half of s has the same numerators and larger denominators). It is near p n x^2 / 20.8
//! for small x, and never above: the familiar |du| ln(r)^2 / 20.8 is no bound, for du is measured
//! between the ends and p at the far one.
//!
//! Both factors that depend on x alone are taken from tables of 1/64 up to 1 and of 16 parts of
//! every power of two from there, each with its value at the part's lower end: too large by 3 % at
//! most below 1, and above by 13 %, and 20 % for the quadratic's.
//!
//! # Chords of any length
//!
//! With c and d the depths at its ends the linear error is |D c'| n^2 / (c d (sqrt c + sqrt d)^2),
//! and a sum is no less than twice the geometric mean: it is never above
//!
//! ```text
//! |D c'| n^2 / (4 (c d)^(3/2))
//! ```
//!
//! which is too large by 3 % where one depth is twice the other. That is at most T where the mean
//! depth sqrt(c d) is at least R n^(2/3), with R^3 = |D c'| / (4 T): R is one number for a run, or
//! for many, and tells of every place how long a chord may be there (`Chords`).
//!
//! # What is rounded, and what is clamped
//!
//! Quotients are cut by less than 1 + 3/128 units of 2^-16 texel, and a linear step by less than
//! one for every pixel. Ends outside the texture are clamped: cutting a monotone f off at a level
//! moves a chord by at most what is cut off at its ends, and a quadratic by 5/4 of that, the most
//! that the three weights sum up to. Nor can the error be more than what the coordinate changes by
//! over the whole run, for both it and what stands for it are monotone in every piece. On and
//! beyond the horizon that holds no more, and the bound is the size of the texture.

use crate::coverage::Run;
use crate::plane::{Plane, Walk};
use crate::runs::{Pieces, Reciprocal, quotients_by};
use crate::{Texture, Vertex};

/// Parts of the tables below x = 1.
const FINE: usize = 64;
/// Powers of two above 1, in 16 parts each.
const OCTAVES: usize = 13;
const PARTS: usize = FINE + 16 * OCTAVES;
/// x from which on there is no part, 32 fraction bits: a depth ratio of 8193 in one piece.
const END: u64 = 1 << (32 + OCTAVES);

/// 64 x at the lower end of a part.
const fn lower_end(part: usize) -> u64 {
    if part < FINE {
        return part as u64;
    }
    let (octave, of) = ((part - FINE) / 16, (part - FINE) % 16);
    ((16 + of) as u64) << octave << 2
}

/// The part that `x` lies in; below [`END`], 32 fraction bits.
fn part(x: u64) -> usize {
    if x < 1 << 32 {
        return (x >> 26) as usize;
    }
    let octave = x.ilog2() - 32;
    FINE + 16 * octave as usize + ((x >> (octave + 28)) & 15) as usize
}

/// 1 / ((1 + x) (1 + sqrt(1 + x))^2), 60 fraction bits, rounded up.
const LINEAR: [u64; PARTS] = {
    let mut table = [0; PARTS];
    let mut part = 0;
    while part < PARTS {
        // 1 + x in 64ths, and 2^24 its root, rounded down.
        let ratio = lower_end(part) + 64;
        let root = (ratio << 42).isqrt() + (1 << 24);
        let under = ratio as u128 * root as u128 * root as u128;
        table[part] = (1u128 << (60 + 6 + 48)).div_ceil(under) as u64;
        part += 1;
    }
    table
};

/// The greatest s (1/2 - s) (1 - s) / ((1 + s x) (1 + x / 2) (1 + x)), 60 fraction bits, rounded
/// up.
const QUADRATIC: [u64; PARTS] = {
    let mut table = [0; PARTS];
    let mut part = 0;
    while part < PARTS {
        let x = lower_end(part) as u128;
        // Narrowed to a thousandth of a thousandth: around its top the function is flat, and less
        // than 2^-38 of it is missed. A last place of 2^-36 makes up for that.
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

/// That function at s / 2^20 and x / 64, 60 fraction bits.
const fn lobe(s: u128, x: u128) -> u128 {
    let over = s * ((1 << 19) - s) * ((1 << 20) - s);
    (over << 39) / (((1 << 26) + s * x) * (128 + x) * (64 + x))
}

/// What the errors of a run depend on.
#[derive(Clone, Copy, Debug)]
pub struct Bend {
    /// The coordinates of the run's two ends, as [`crate::runs::quotients`] gives them.
    pub ends: [(i32, i32); 2],
    steps: u16,
    /// p: the larger coordinate's texels a pixel at the far end, 32 fraction bits, rounded up.
    pace: u64,
    /// What c changes by in a pixel, against c at the far end, 32 fraction bits, rounded up.
    lean: u64,
    /// The most that an end is outside the texture, 2^-16 texel.
    outside: u32,
    /// What no error is above, 2^-16 texel.
    most: u32,
}

impl Bend {
    /// That of the run of `len` pixels, at least 1, along `walk`.
    pub fn new(walk: &Walk, len: u16, texture: &Texture<'_>) -> Self {
        let last = texture.last();
        let steps = len - 1;
        let (start, end) = (walk.at, walk.after(steps));
        let [first, second] = [start, end].map(|[_, _, c]| Reciprocal::new(c.max(1)));
        let ends = [(start, first), (end, second)];
        let ends = ends.map(|(forms, reciprocal)| quotients_by(reciprocal, forms, last));
        let mut bend = Self {
            ends,
            steps,
            pace: u64::MAX,
            lean: END,
            outside: 0,
            most: last.0.max(last.1) as u32 + 1,
        };
        if start[2] <= 0 || end[2] <= 0 {
            return bend;
        }
        let [from, to] = ends;
        let change = (to.0 - from.0).abs().max((to.1 - from.1).abs());
        bend.most = change as u32 + 2;
        for (forms, reciprocal) in [(start, first), (end, second)] {
            bend.outside = bend.outside.max(place(reciprocal, forms, last).1);
        }
        let [a, b, c] = [0, 1, 2].map(|k| (walk.at[k], walk.step[k]));
        let far = Above::new(if c.1 < 0 { second } else { first });
        let passes = [a, b].map(|n| passes(n, c).unsigned_abs());
        bend.pace = far.pace(passes[0].max(passes[1]));
        bend.lean = far.lean(c.1);
        bend
    }

    /// The worst error of a coordinate with linear [`Pieces`], in units of 2^-16 texel.
    pub fn linear(&self, pieces: Pieces) -> u32 {
        let steps = pieces.longest(self.steps);
        let error = self.chord(2 * u64::from(steps));
        let error = error + u64::from(self.outside) + u64::from(steps) + 2;
        error.min(self.most.into()) as u32
    }

    /// The worst error of a coordinate with quadratic [`Pieces`], in units of 2^-16 texel.
    ///
    /// Where the depth ratio of the longest piece is below 5/2, |K| is at most 6/7 |d|: only what
    /// rounds the three quotients can make a piece turn, when d is below 36 units, and then the two
    /// halves are off by 2 more at most.
    pub fn quadratic(&self, pieces: Pieces) -> u32 {
        let steps = u64::from(pieces.longest(self.steps));
        let mut error = self.curve(steps);
        if self.outside > 0 || 2 * self.lean.saturating_mul(steps).min(END) > 3 << 32 {
            error = error.max(self.chord(steps));
        }
        let error = error + u64::from(self.outside) * 5 / 4 + 4;
        error.min(self.most.into()) as u32
    }

    /// Steps from the first pixel to the last.
    pub(crate) fn steps(&self) -> u16 {
        self.steps
    }

    /// Less than the error of one chord over the whole run, not counting fixed point: with pieces
    /// of n of its steps it is at least n^2 / steps^2 of this.
    ///
    /// For p n x / (..) is n^2 times a falling function of n, and the table is too large by 13 % at
    /// most.
    pub(crate) fn chord_at_least(&self) -> u64 {
        (self.chord(2 * u64::from(self.steps)) / 8 * 7).saturating_sub(2)
    }

    /// The closed form for a chord over so many half pixels at the far end.
    fn chord(&self, halves: u64) -> u64 {
        let x = (self.lean.saturating_mul(halves)).div_ceil(2);
        self.times(halves, x, |x, part| (x * u128::from(LINEAR[part])) >> 52)
    }

    /// The closed form for a quadratic over so many pixels at the far end.
    fn curve(&self, steps: u64) -> u64 {
        let x = self.lean.saturating_mul(steps);
        self.times(2 * steps, x, |x, part| {
            ((((x * x) >> 32) + 1) * u128::from(QUADRATIC[part])) >> 52
        })
    }

    /// p n times a factor of x with 40 fraction bits, in units of 2^-16 texel, rounded up.
    fn times(&self, halves: u64, x: u64, factor: impl Fn(u128, usize) -> u128) -> u64 {
        if x >= END {
            return u32::MAX.into();
        }
        // x is rounded up; the tables fall, and want it rounded down.
        let down = x.saturating_sub((x >> 24) + halves);
        let factor = factor(x.into(), part(down)) + 1;
        let error = u128::from(self.pace) * u128::from(halves) * factor;
        ((error >> 57) + 1).min(u32::MAX.into()) as u64
    }
}

/// The coordinates of [`quotients_by`], and how far the quotients are outside the texture, in units
/// of 2^-16 texel, rounded up, 256 texels at most; c is above zero.
#[inline]
pub(crate) fn place(
    reciprocal: Reciprocal,
    [a, b, c]: [i64; 3],
    last: (i32, i32),
) -> ((i32, i32), u32) {
    let beyond = |n: i64| match n >> 8 >= c {
        true => 1 << 24,
        false => reciprocal.times(n) as u32 + 3,
    };
    let coordinate = |n: i64, last: i32| {
        let end = i64::from((last >> 16) + 1) * c;
        if n < 0 {
            (0, beyond(-n))
        } else if n >= end {
            (last, beyond(n - end))
        } else {
            (reciprocal.times(n), 0)
        }
    };
    let (u, v) = (coordinate(a, last.0), coordinate(b, last.1));
    ((u.0, v.0), u.1.max(v.1))
}

/// 1 / c, rounded up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Above {
    /// Bits that c is short of 64.
    zeros: u32,
    /// 1 / c <= inverse 2^(zeros - 95), by less than a part in 2^29.
    inverse: u64,
}

impl Above {
    /// That of the same c. With h its highest 32 bits a [`Reciprocal`] has more than
    /// 2^63 / (h + 1) - 1, and 2^63 / h is larger than 2^63 / (h + 1) by less than 2: three more is
    /// no less.
    pub(crate) fn new(reciprocal: Reciprocal) -> Self {
        let (zeros, inverse) = reciprocal.parts();
        Self {
            zeros,
            inverse: inverse + 3,
        }
    }

    /// |step| / c, 32 fraction bits, rounded up; [`END`] at most.
    pub(crate) fn lean(&self, step: i64) -> u64 {
        let product = u128::from(step.unsigned_abs()) * u128::from(self.inverse);
        ((product >> (63 - self.zeros)) + 1).min(END.into()) as u64
    }

    /// |D| / c^2, 32 fraction bits, rounded up: too large by a part in 2^28, and a last place or two.
    pub(crate) fn pace(&self, d: u128) -> u64 {
        // |D| <= d 2^excess, and 1 / c^2 <= square 2^(2 zeros - 158).
        let excess = (128 - d.leading_zeros()).saturating_sub(63);
        let d = (d >> excess) + u128::from(excess > 0);
        let square = (u128::from(self.inverse) * u128::from(self.inverse)).div_ceil(1 << 32);
        // Below 2^97. To be shifted up it would have to be above 2^91: no 64 bits hold that.
        let product = d * square;
        let bits = 126 - 2 * i64::from(self.zeros) - i64::from(excess);
        match bits {
            0.. => ((product >> bits) + 1).min(u64::MAX.into()) as u64,
            ..0 => u64::MAX,
        }
    }
}

/// Longest chord in pixels: a row of the screen.
const LONGEST: usize = modex::WIDTH - 1;

/// Where along a run chords are good enough, by their length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chords {
    /// R, rounded up, 8 fraction bits, below 2^42; in units of 2^`shift`, as all depths here.
    root: u64,
    /// What depths are cut by: the nearest has at most 32 bits then.
    shift: u32,
    /// T in units of 2^-16 texel, less two for the ends, which are rounded down.
    most: u32,
}

impl Chords {
    /// Those of runs along `walks`, all with the same c', that are to be off by `tolerance` units
    /// of 2^-16 texel at most. `near` is the largest depth that will be asked for, and above zero.
    #[inline]
    pub fn new(walks: &[Walk], near: i64, tolerance: u32) -> Self {
        let shift = 32u32.saturating_sub(near.leading_zeros());
        let most = tolerance.saturating_sub(2);
        let (mut fastest, mut step) = (0, 0);
        for walk in walks {
            let [a, b, c] = [0, 1, 2].map(|k| (walk.at[k], walk.step[k]));
            let passes = [a, b].map(|n| passes(n, c).unsigned_abs());
            fastest = passes[0].max(passes[1]).max(fastest);
            step = c.1.unsigned_abs();
        }
        // Both cut to 31 bits, and rounded up.
        let (passes, exponent) = cut(fastest);
        let (step, more) = cut(step.into());
        let product = passes * step;
        if product == 0 || most == 0 {
            // A straight run, or a tolerance that no chord keeps to.
            let root = if most == 0 { 1 << 40 } else { 0 };
            return Self { root, shift, most };
        }
        // R^3 is |D c'| 2^14 over T in these units: as 61 to 63 bits and a multiple of three.
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

    /// A depth in the units here.
    #[inline]
    pub fn cut(&self, depth: i64) -> u64 {
        (depth >> self.shift) as u64
    }

    /// R n^(2/3), rounded up.
    #[inline]
    fn mean(&self, pixels: u16) -> u64 {
        ((self.root * POWERS[usize::from(pixels)]) >> 24) + u64::from(self.root > 0)
    }

    /// Whether no depth up to `near` lets a chord be as long.
    #[inline]
    pub fn is_short_of(&self, pixels: u16, near: u64) -> bool {
        self.mean(pixels) > near
    }

    /// Whether the whole of a run may be a chord. It does not pay for steps that are cut, nor for
    /// ends that are clamped.
    #[inline]
    pub fn keep(&self, walk: &Walk, pixels: u16) -> bool {
        let (from, to) = (walk.at[2], walk.after(pixels)[2]);
        let mean = self.mean(pixels);
        let is_legal = self.most > 0 && from > 0 && to > 0;
        is_legal && mean >> 32 == 0 && self.cut(from) * self.cut(to) >= mean * mean
    }

    /// What the product of the depths at the ends of a chord over so many pixels must not be less
    /// than, `outside` being what the ends are clamped by; none is as large as [`u64::MAX`].
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

/// n^(2/3), 16 fraction bits, rounded up.
const POWERS: [u64; LONGEST + 1] = {
    let mut powers = [0; LONGEST + 1];
    let mut n = 1;
    while n <= LONGEST {
        powers[n] = root_by_bits((n as u128).pow(2) << 48);
        n += 1;
    }
    powers
};

/// The cube root of 1 to 2^66, rounded up.
const fn root_by_bits(n: u128) -> u64 {
    // The largest number whose cube is less.
    let (mut root, mut bit) = (0u64, 1 << 22);
    while bit > 0 {
        if ((root | bit) as u128).pow(3) < n {
            root |= bit;
        }
        bit >>= 1;
    }
    root + 1
}

/// No less than the cube root of `n`, 2^60 to 2^63 - 1, or of anything below n + 1; too large by a
/// part in 2000 at most.
#[inline]
fn cube_root(n: u64) -> u64 {
    const GUESSES: [u32; 64] = {
        let mut guesses = [0; 64];
        let mut part = 8;
        while part < 64 {
            // For its middle.
            guesses[part] = root_by_bits((2 * part as u128 + 1) << 56) as u32;
            part += 1;
        }
        guesses
    };
    // A step of Newton's from either side leads above it, but for what two divisions cut off.
    let guess = u64::from(GUESSES[(n >> 57) as usize & 63]);
    (2 * guess + n / (guess * guess)) / 3 + 2
}

/// A number of at most 31 bits and an exponent: no less than `n`.
#[inline]
fn cut(n: u128) -> (u64, i32) {
    let excess = (128 - n.leading_zeros()).saturating_sub(31);
    ((n >> excess) as u64 + u64::from(excess > 0), excess as i32)
}

/// n c' - n' c of two forms' values and steps.
pub(crate) fn passes(n: (i64, i64), c: (i64, i64)) -> i128 {
    i128::from(n.0) * i128::from(c.1) - i128::from(n.1) * i128::from(c.0)
}

/// What the error of the affine mapper depends on in a polygon: see [`crate::affine::Sides::walk`].
///
/// A corner's own coordinates are not quite the quotients where it is snapped to. Between two
/// corners a coordinate is a chord along the side, and down the column another chord between two of
/// those: the errors add.
#[derive(Clone, Copy, Debug)]
pub struct Affine {
    plane: Plane,
    /// The most that a coordinate is off on any side, 2^-16 texel.
    sides: u64,
    /// The size of the texture: both coordinates are inside.
    most: u64,
}

impl Affine {
    /// What fixed point may add: 2^-7 texel, most of it where a texture is squeezed into a sliver.
    const ROUNDING: u64 = 512;

    /// That of a polygon whose texture lies in `plane`.
    pub fn new(polygon: &[Vertex], plane: &Plane, texture: &Texture<'_>) -> Self {
        let (u, v) = texture.last();
        let mut affine = Self {
            plane: *plane,
            sides: 0,
            most: u.max(v) as u64 + 1,
        };
        let mut corners = 0;
        for (i, a) in polygon.iter().enumerate() {
            let b = &polygon[(i + 1) % polygon.len()];
            let (from, to) = (affine.forms(a.x, a.y), affine.forms(b.x, b.y));
            affine.sides = affine.sides.max(affine.chord(from, to));
            corners = corners.max(affine.corner(a, from));
        }
        affine.sides += corners;
        affine
    }

    /// The worst error of a coordinate in a column of the polygon, in units of 2^-16 texel.
    pub fn column(&self, run: &Run) -> u32 {
        // The crossings have 32 fraction bits, and are off by less than 2^-23: 1/256 further out
        // than they are.
        let [top, bottom] = run.between.map(|crossing| (crossing.at >> 24) as i32);
        let x = i32::from(run.line) * 256 + 128;
        let column = self.chord(self.forms(x, top - 1), self.forms(x, bottom + 2));
        (column + self.sides + Self::ROUNDING).min(self.most) as u32
    }

    /// The forms at a place in 1/256 pixel, 256 times.
    fn forms(&self, x: i32, y: i32) -> [i128; 3] {
        [self.plane.a, self.plane.b, self.plane.c].map(|form| {
            let right = i128::from(form.right) * i128::from(x - 128);
            let down = i128::from(form.down) * i128::from(y - 128);
            i128::from(form.origin) * 256 + right + down
        })
    }

    /// How far a corner's coordinates are from the quotients there.
    fn corner(&self, vertex: &Vertex, [a, b, c]: [i128; 3]) -> u64 {
        if c <= 0 {
            return self.most;
        }
        let off = |n: i128, own: i32| (i128::from(own) * c - (n << 16)).unsigned_abs() / c as u128;
        off(a, vertex.u).max(off(b, vertex.v)).min(self.most.into()) as u64 + 1
    }

    /// The closed form between two places.
    fn chord(&self, from: [i128; 3], to: [i128; 3]) -> u64 {
        // As many bits as a form has on the screen; far off it they have more.
        let size = |[a, b, c]: [i128; 3]| {
            let [a, b, c] = [a, b, c << 8].map(i128::unsigned_abs);
            a.max(b).max(c)
        };
        let excess = (128 - size(from).max(size(to)).leading_zeros()).saturating_sub(61);
        let [start, end] = [from, to].map(|forms| forms.map(|form| (form >> excess) as i64));
        let far = start[2].min(end[2]);
        // Cutting the forms moves a quotient by less than a unit as long as c has 24 bits.
        if far < 1 << 24 {
            return self.most;
        }
        let [a, b, c] = [0, 1, 2].map(|k| (start[k], end[k] - start[k]));
        let above = Above::new(Reciprocal::new(far));
        let bend = Bend {
            ends: [(0, 0); 2],
            steps: 1,
            pace: above.pace(passes(a, c).unsigned_abs().max(passes(b, c).unsigned_abs())),
            lean: above.lean(c.1),
            outside: 0,
            most: self.most as u32,
        };
        (bend.chord(2) + 2).min(self.most)
    }
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
