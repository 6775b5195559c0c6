//! A texture's plane in space, as three linear forms of the screen.
//!
//! A polygon's texture lies in the plane P + uM + vN of the viewer's space. The ray through a
//! pixel is t d with d = (i, j, f): the pixel's place from the middle of the screen, and the focal
//! length. Where they meet, t d = P + uM + vN, and eliminating two unknowns at a time leaves
//!
//! ```text
//! u = a / c    v = b / c    a = d . (N x P)    b = d . (P x M)    c = d . (M x N)
//! ```
//!
//! which are linear in i and j. P, M and N need not be found at all. With three points V of the
//! plane and their texture coordinates, and L = d . (V' x V'') for each point and the two after it,
//! the same three forms are, but for a factor that the quotients do not see,
//!
//! ```text
//! a = sum of u L    b = sum of v L    c = sum of L
//! ```
//!
//! for L is the weight of its point where the ray meets the plane. This needs no division, and
//! nothing in it is special when the texture's own axes are.
//!
//! # The integers
//!
//! The sums are exact: below 2^92 for points within [`MAX_POSITION`]. They are then cut to 61 bits
//! once, by one shift for all nine coefficients, each rounded to nearest (half up). A form's value
//! is off by at most [`ROUNDING`] then. From here on there is no rounding: the texel *is* the floor
//! of the quotient of those integers.

use modex::{HEIGHT, WIDTH};

use crate::coverage::Axis;

/// Furthest coordinate of a point, either sign: 256 units in 16.16.
pub const MAX_POSITION: i32 = 1 << 24;
/// Largest focal length in pixels.
pub const MAX_FOCAL_LENGTH: i32 = 1 << 15;
/// Most that rounding the coefficients moves a form's value, in units of its last place: half a
/// unit for the origin, and for each step to the right and down.
pub const ROUNDING: i64 = (WIDTH + HEIGHT).div_ceil(2) as i64;

/// Bits of a form's value on the screen. A value and 256 times another's are compared, and their
/// difference fits 63 bits.
const BITS: u32 = 61;

/// A point of the plane with its place in the texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Anchor {
    /// In the viewer's space: x right, y down, z away, 16.16, within +-[`MAX_POSITION`].
    pub position: [i32; 3],
    /// Across the texture, 16.16 texels, 0 to 256.
    pub u: i32,
    /// Down the texture, 16.16 texels, 0 to 256.
    pub v: i32,
}

/// A linear form of the screen: its value at a pixel's centre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Form {
    /// At the centre of pixel (0, 0).
    pub origin: i64,
    /// From a pixel to the one right of it.
    pub right: i64,
    /// From a pixel to the one below it.
    pub down: i64,
}

impl Form {
    /// The value at the centre of a pixel of the screen.
    pub fn at(&self, x: u16, y: u16) -> i64 {
        self.origin + self.right * i64::from(x) + self.down * i64::from(y)
    }
}

/// The three forms: u = a / c and v = b / c, in texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Plane {
    /// Numerator of u.
    pub a: Form,
    /// Numerator of v.
    pub b: Form,
    /// Their denominator; above zero where the plane lies before the eye.
    pub c: Form,
}

/// The three forms of a plane along a run of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Walk {
    /// a, b and c at the first pixel's centre.
    pub at: [i64; 3],
    /// Their steps from a pixel to the next.
    pub step: [i64; 3],
}

impl Walk {
    /// Along `axis` from pixel (x, y) of the screen.
    pub fn new(plane: &Plane, axis: Axis, x: u16, y: u16) -> Self {
        let forms = [plane.a, plane.b, plane.c];
        Self {
            at: forms.map(|form| form.at(x, y)),
            step: forms.map(|form| match axis {
                Axis::Down => form.down,
                Axis::Right => form.right,
            }),
        }
    }

    /// The forms `pixels` after the first.
    pub fn after(&self, pixels: u16) -> [i64; 3] {
        [0, 1, 2].map(|k| self.at[k] + self.step[k] * i64::from(pixels))
    }

    /// The walk from pixel `pixels` of this one on, in steps of `stride` pixels.
    pub(crate) fn every(&self, stride: u16, pixels: u16) -> Self {
        Self {
            at: self.after(pixels),
            step: self.step.map(|step| step * i64::from(stride)),
        }
    }

    /// The forms here; then it is a pixel further.
    pub(crate) fn next(&mut self) -> [i64; 3] {
        let here = self.at;
        // Past the run's end at most by one: a step is below 2^55.
        self.at = self.after(1);
        here
    }
}

/// A form before it is cut: at pixel (0, 0), and the steps to the right and down.
pub(crate) type Exact = [i128; 3];

impl Plane {
    /// The plane through three points.
    ///
    /// Three points on a line, or a plane through the eye, give forms as well: what is seen of
    /// such a polygon is decided by [`texel`], as everywhere.
    ///
    /// # Panics
    /// In a build with overflow checks, if a position or the focal length is out of its range.
    pub fn new(anchors: &[Anchor; 3], focal_length: i32) -> Self {
        // Positions have 24 bits, what is made of two of them 50: only their sums need more than
        // 64.
        let [v0, v1, v2] = anchors.map(|anchor| anchor.position.map(i64::from));
        let mut weights = [cross(v1, v2), cross(v2, v0), cross(v0, v1)];
        // The sign of the volume is that of c before the eye.
        if dot(v0, weights[0]) < 0 {
            weights = weights.map(|weight| weight.map(|k| -k));
        }
        let [x, y, z] = [0, 1, 2].map(|k| weights.map(|weight| weight[k]));
        let [u, v] = [anchors.map(|a| a.u.into()), anchors.map(|a| a.v.into())];
        // c has the sixteen bits that u and v bring into a and b.
        let one = [1 << 16; 3];
        let a = [dot(u, x), dot(u, y), dot(u, z)];
        let b = [dot(v, x), dot(v, y), dot(v, z)];
        let c = [dot(one, x), dot(one, y), dot(one, z)];
        let [a_most, b_most, c_most] = [a, b, c].map(|vector| largest(vector, focal_length));
        let bits = 128 - a_most.max(b_most).max(c_most << 8).leading_zeros();
        let shift = bits.saturating_sub(BITS);
        let form = |vector| {
            let [origin, right, down] = on_screen(vector, focal_length);
            Form {
                origin: cut(origin, shift),
                right: cut(right, shift),
                down: cut(down, shift),
            }
        };
        Self {
            a: form(a),
            b: form(b),
            c: form(c),
        }
    }
}

/// The texel of a coordinate whose quotient is `n / c`: its floor, in a texture of `size` texels.
/// Outside of it the nearest; on the horizon and beyond, where c is not above zero, the one that
/// the last pixels before it come to.
///
/// `size` is at most 256, and the values are those of a [`Plane`]'s forms on the screen.
pub fn texel(n: i64, c: i64, size: u16) -> u16 {
    let size = i64::from(size);
    if n < 0 {
        0
    } else if n >= size * c {
        (size - 1) as u16
    } else {
        (n / c) as u16
    }
}

/// The coordinate n / c in a texture of `size` texels, 16.16 and rounded down, inside the texture
/// as [`texel`] is.
pub fn coordinate(n: i64, c: i64, size: u16) -> i32 {
    let last = (i64::from(size) << 16) - 1;
    if n < 0 {
        0
    } else if n >= i64::from(size) * c {
        last as i32
    } else {
        ((i128::from(n) << 16) / i128::from(c)) as i32
    }
}

fn dot(a: [i64; 3], b: [i64; 3]) -> i128 {
    let product = |k: usize| i128::from(a[k]) * i128::from(b[k]);
    product(0) + product(1) + product(2)
}

fn cross(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// `vector . d` as a form. The centre of pixel (x, y) is at (x + 1/2, y + 1/2), and the middle of
/// the screen is the corner between four pixels: twice d is whole.
#[inline(always)]
pub(crate) fn on_screen(vector: [i128; 3], focal_length: i32) -> Exact {
    let [i, j, k] = vector;
    let (left, top) = (1 - WIDTH as i128, 1 - HEIGHT as i128);
    [
        left * i + top * j + 2 * i128::from(focal_length) * k,
        2 * i,
        2 * j,
    ]
}

/// The largest magnitude of `vector . d` on the screen, that of a corner: twice it is what the
/// middle has, and what it changes by from there to the last centres.
#[inline(always)]
fn largest([i, j, k]: [i128; 3], focal_length: i32) -> u128 {
    let middle = 2 * i128::from(focal_length) * k;
    let (right, down) = ((WIDTH as i128 - 1) * i, (HEIGHT as i128 - 1) * j);
    middle.unsigned_abs() + right.unsigned_abs() + down.unsigned_abs()
}

/// `n / 2^shift`, rounded to nearest, half up; `shift` is below 64, and the compiler is told so.
#[inline(always)]
fn cut(n: i128, shift: u32) -> i64 {
    let half = (1u64 << shift) >> 1;
    ((n + i128::from(half)) >> (shift % 64)) as i64
}
