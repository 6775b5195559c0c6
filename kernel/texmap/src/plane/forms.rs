//! The perspective plane: a texture's plane in space, as three linear forms of the screen.
//!
//! A polygon's texture lies in the plane P + u M + v N of the viewer's space, where P is the texture's origin
//! and M and N are its axes. The ray through a pixel is t d with d = (i, j, f): (i, j) is the pixel's
//! position relative to the middle of the screen, and f is the focal length. The ray meets the plane where
//! t d = P + u M + v N. Eliminating two unknowns at a time gives
//!
//! ```text
//! u = a / c    v = b / c    a = d . (N x P)    b = d . (P x M)    c = d . (M x N)
//! ```
//!
//! The three forms a, b and c are linear in i and j. They can be computed without P, M and N. Take three
//! points V of the plane with their texture coordinates, and for each point V let L = d . (V' x V''), where
//! V' and V'' are the two points that follow V in cyclic order. L is proportional to the weight of V at the
//! point where the ray meets the plane, so
//!
//! ```text
//! a = sum of u L    b = sum of v L    c = sum of L
//! ```
//!
//! are the same three forms up to a common factor, which cancels in the quotients. These sums need no
//! division, and texture axes in special directions need no special case.
//!
//! # The integers
//!
//! The sums are exact: below 2^92 for points within [`MAX_POSITION`]. One shift, common to all nine
//! coefficients, then reduces them to 61 bits, and each coefficient is rounded to nearest (half up). That
//! moves a form's value by at most [`ROUNDING`]. Nothing is rounded after that: the texel *is* the floor of
//! the quotient of those integers.

use modex::{HEIGHT, WIDTH};

/// Largest magnitude of a point's coordinate: 256 units in 16.16.
pub const MAX_POSITION: i32 = 1 << 24;
/// Largest focal length in pixels.
pub const MAX_FOCAL_LENGTH: i32 = 1 << 15;
/// Most that rounding the coefficients moves a form's value, in units of its last place: half a unit for the
/// origin, and half a unit for each step to the right and down.
pub const ROUNDING: i64 = (WIDTH + HEIGHT).div_ceil(2) as i64;

/// Bits of a form's value on the screen. [`texel`] compares one value with 256 times another, and the
/// difference of the two fits 63 bits.
const BITS: u32 = 61;

/// A point of the plane and its texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Anchor {
    /// Position in the viewer's space: x right, y down, z away from the eye; 16.16, within
    /// +-[`MAX_POSITION`].
    pub position: [i32; 3],
    /// Coordinate across the texture: 16.16 texels, 0 to 256.
    pub u: i32,
    /// Coordinate down the texture: 16.16 texels, 0 to 256.
    pub v: i32,
}

/// A linear form of the screen: a value at every pixel's centre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Form {
    /// Value at the centre of pixel (0, 0).
    pub origin: i64,
    /// Change from a pixel to the pixel on its right.
    pub right: i64,
    /// Change from a pixel to the pixel below it.
    pub down: i64,
}

impl Form {
    /// Returns the value at the centre of pixel (x, y) of the screen.
    pub fn at(&self, x: u16, y: u16) -> i64 {
        self.origin + self.right * i64::from(x) + self.down * i64::from(y)
    }
}

/// The three forms of a texture's plane: u = a / c and v = b / c, in texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Plane {
    /// Numerator of u.
    pub a: Form,
    /// Numerator of v.
    pub b: Form,
    /// Common denominator; above zero where the plane is in front of the eye.
    pub c: Form,
}

/// A form before it is reduced to [`BITS`]: its value at pixel (0, 0), and its steps to the right and down.
pub(crate) type WideForm = [i128; 3];

impl Plane {
    /// Returns the plane through three points.
    ///
    /// Three points on a line, or a plane through the eye, also yield forms. [`texel`] then decides what such
    /// a polygon shows, as it does everywhere.
    ///
    /// # Panics
    /// In a build with overflow checks, if a position or the focal length is out of its range.
    pub fn new(anchors: &[Anchor; 3], focal_length: i32) -> Self {
        // Positions have 24 bits and the cross products of two positions have 50: only the sums of products
        // below need more than 64.
        let [v0, v1, v2] = anchors.map(|anchor| anchor.position.map(i64::from));
        let mut weights = [cross(v1, v2), cross(v2, v0), cross(v0, v1)];
        // The sign of this volume is the sign of c in front of the eye.
        if dot(v0, weights[0]) < 0 {
            weights = weights.map(|weight| weight.map(|k| -k));
        }
        let [x, y, z] = [0, 1, 2].map(|k| weights.map(|weight| weight[k]));
        let [u, v] = [anchors.map(|a| a.u.into()), anchors.map(|a| a.v.into())];
        // c gets the same 16 fraction bits that u and v bring into a and b.
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

/// Returns the texel index of the coordinate n / c: its floor, in a texture of `size` texels.
///
/// Outside the texture, returns the nearest texel. On and beyond the horizon, where c is not above zero,
/// returns the texel that the last pixels before the horizon approach.
///
/// `size` is at most 256, and `n` and `c` are values of a [`Plane`]'s forms on the screen.
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

/// Returns the coordinate n / c in a texture of `size` texels: 16.16, rounded down, and clamped into the
/// texture as in [`texel`].
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

/// Returns `vector . d` as a form. The centre of pixel (x, y) is at (x + 1/2, y + 1/2), and the middle of the
/// screen is the corner between four pixels, so i and j are odd multiples of 1/2. The form is doubled to keep
/// it whole.
#[inline(always)]
pub(crate) fn on_screen(vector: [i128; 3], focal_length: i32) -> WideForm {
    let [i, j, k] = vector;
    let (left, top) = (1 - WIDTH as i128, 1 - HEIGHT as i128);
    [
        left * i + top * j + 2 * i128::from(focal_length) * k,
        2 * i,
        2 * j,
    ]
}

/// Returns twice the largest magnitude of `vector . d` on the screen, which a corner pixel reaches: the
/// magnitude at the middle plus the magnitudes of the changes from there to the last centres.
#[inline(always)]
fn largest([i, j, k]: [i128; 3], focal_length: i32) -> u128 {
    let middle = 2 * i128::from(focal_length) * k;
    let (right, down) = ((WIDTH as i128 - 1) * i, (HEIGHT as i128 - 1) * j);
    middle.unsigned_abs() + right.unsigned_abs() + down.unsigned_abs()
}

/// Returns `n / 2^shift`, rounded to nearest, half up. `shift` is below 64; `shift % 64` lets the compiler
/// rely on that.
#[inline(always)]
fn cut(n: i128, shift: u32) -> i64 {
    let half = (1u64 << shift) >> 1;
    ((n + i128::from(half)) >> (shift % 64)) as i64
}
