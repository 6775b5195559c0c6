//! Reciprocals of inverse depths: one division for both coordinates of a pixel.
//!
//! [`Reciprocal`] needs one division for the two coordinates of a place. A coordinate is off by
//! less than 2^-16 (1 + 3/128) texel, and never above the quotient. A quotient outside the texture is clamped
//! into it. On and beyond the horizon, where c is not above zero, no division happens, and the coordinate is
//! that of [`coordinate`](super::forms::coordinate).

/// 1 / c for c above zero, to 31 bits. c is a form's value, which is proportional to the inverse depth 1 / z.
#[derive(Clone, Copy, Debug)]
pub struct Reciprocal {
    /// Leading zeros of c: 64 less its bits.
    zeros: u32,
    /// 1 / c is close to value 2^(zeros - 95): 2^31 to 2^32.
    value: u64,
}

impl Reciprocal {
    /// Returns the reciprocal of `c`, 1 to 2^55, never above 1 / c: 2^63 / (h + 1), rounded down, where h is
    /// the highest 32 bits of c. `c` is a value of a form of a [`crate::Plane`] on the screen, or the sum of
    /// two.
    #[inline]
    pub fn new(c: i64) -> Self {
        let zeros = c.leading_zeros();
        let high = ((c as u64) << zeros >> 32) + 1;
        Self {
            zeros,
            value: (1 << 63) / high,
        }
    }

    /// Returns the reciprocal of `c` as 2^63 / h, rounded down: off by less than 2^-31 of its value in either
    /// direction. Returns nothing unless `c` is above zero.
    pub(crate) fn unbiased(c: i64) -> Option<Self> {
        if c <= 0 {
            return None;
        }
        let zeros = c.leading_zeros();
        let high = (c as u64) << zeros >> 32;
        Some(Self {
            zeros,
            value: (1 << 63) / high,
        })
    }

    /// Returns n / c with 16 more fraction bits than `n` has, for c of 16 to 48 bits. The result is off by
    /// 2^-31 of its value, and is rounded down.
    #[inline]
    pub(crate) fn times_signed(self, n: i64) -> i64 {
        // `% 64` lets the compiler rely on a shift below 64.
        ((i128::from(n) * i128::from(self.value)) >> ((79 - self.zeros) % 64)) as i64
    }

    /// Returns n / c, 16.16, rounded down, for any n and c.
    pub(crate) fn floor(self, n: i64) -> i128 {
        (i128::from(n) * i128::from(self.value)) >> (79 - self.zeros)
    }

    /// Returns n / c, 16.16, rounded to nearest, for any n and c.
    pub(crate) fn nearest(self, n: i64) -> i128 {
        let shift = 79 - self.zeros;
        (i128::from(n) * i128::from(self.value) + (1 << (shift - 1))) >> shift
    }

    /// Returns n / c in 16.16 for 0 <= n < 256 c: at most the quotient, and less than 1 + 3/128 units below
    /// it.
    ///
    /// For a reciprocal of [`Reciprocal::new`]. With c' = c 2^zeros / 2^32 and n' = n 2^zeros / 2^40, the
    /// quotient is 2^24 n' / c', and n' < c'. Three values are rounded down, and each rounding costs less
    /// than 2^-7 units: n' to a whole number (value / 2^39), 1 / c' to at least 1 / (c' + 1) (2^24 / c'), and
    /// the reciprocal to a whole number (n' / 2^39). Cutting off the fraction of the result then costs less
    /// than one unit.
    #[inline]
    pub fn times(self, n: i64) -> i32 {
        let high = (n as u64) << (self.zeros - 8) >> 32;
        ((high * self.value) >> 39) as i32
    }
}

/// A [`Reciprocal`] of a c from [`LargeReciprocal::LEAST`] on, with the same results bit for bit. It needs
/// one shift where [`Reciprocal`] needs two.
#[derive(Clone, Copy)]
pub(crate) struct LargeReciprocal {
    /// Number of bits of c above 24.
    down: u32,
    value: u64,
}

impl LargeReciprocal {
    pub const LEAST: i64 = 1 << 31;

    #[inline]
    pub fn new(c: i64) -> Self {
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
    pub fn times(self, n: i64) -> i32 {
        (((n as u64 >> self.down) * self.value) >> 39) as i32
    }
}

/// Returns the coordinates where the three forms have the values `forms`, clamped into a texture whose last
/// coordinates are `last`.
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

/// Returns the coordinates of [`quotients_by`], and how far the quotients lie outside the texture: in units
/// of 2^-16 texel, rounded up, at most 256 texels. c must be above zero.
#[inline]
pub(crate) fn quotients_and_excess(
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

/// Upper limit of [`ReciprocalAbove::relative_slope`]: 2^13, 32 fraction bits.
pub(crate) const MAX_SLOPE: u64 = 1 << 45;

/// 1 / c, rounded up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReciprocalAbove {
    /// Leading zeros of c: 64 less its bits.
    zeros: u32,
    /// 1 / c <= inverse 2^(zeros - 95), and the right side is too large by less than one part in 2^29.
    inverse: u64,
}

impl ReciprocalAbove {
    /// Returns 1 / c, rounded up, for the c of `reciprocal`. With h the highest 32 bits of c, the
    /// [`Reciprocal`] holds more than 2^63 / (h + 1) - 1, and 2^63 / h exceeds 2^63 / (h + 1) by
    /// less than 2. So adding three yields at least 2^63 / h.
    pub(crate) fn new(reciprocal: Reciprocal) -> Self {
        Self {
            zeros: reciprocal.zeros,
            inverse: reciprocal.value + 3,
        }
    }

    /// Returns |step| / c, 32 fraction bits, rounded up; at most [`MAX_SLOPE`].
    pub(crate) fn relative_slope(&self, step: i64) -> u64 {
        let product = u128::from(step.unsigned_abs()) * u128::from(self.inverse);
        ((product >> (63 - self.zeros)) + 1).min(MAX_SLOPE.into()) as u64
    }

    /// Returns |D| / c^2, 32 fraction bits, rounded up: too large by one part in 2^28 plus one or two units
    /// in the last place.
    pub(crate) fn texel_step(&self, d: u128) -> u64 {
        // |D| <= d 2^excess, and 1 / c^2 <= square 2^(2 zeros - 158).
        let excess = (128 - d.leading_zeros()).saturating_sub(63);
        let d = (d >> excess) + u128::from(excess > 0);
        let square = (u128::from(self.inverse) * u128::from(self.inverse)).div_ceil(1 << 32);
        // Below 2^97. A negative `bits` needs `excess` above zero, so d is at least 2^62 and the product is
        // above 2^91: shifted up, it does not fit 64 bits.
        let product = d * square;
        let bits = 126 - 2 * i64::from(self.zeros) - i64::from(excess);
        match bits {
            0.. => ((product >> bits) + 1).min(u64::MAX.into()) as u64,
            ..0 => u64::MAX,
        }
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

    #[test]
    fn an_unbiased_reciprocal_is_off_by_an_eighth_of_a_unit_within_the_reach() {
        let mut random = seeded::generator();
        for _ in 0..200_000 {
            let bits = random.u32(0..54);
            let c = random.i64(1..2 << bits);
            let texels = random.i64(1..=4096);
            let n = random.i128(-i128::from(c)..=c.into()) * i128::from(texels);
            let n = n.clamp(-(1 << 62), 1 << 62) as i64;
            let over = Reciprocal::unbiased(c).unwrap();
            // In eighths of a unit in the last place: rounding down or to nearest, plus an eighth of error.
            let (eight, c) = (i128::from(n) << 19, i128::from(c));
            let off = |at: i128| 8 * at * c - eight;
            assert!((-9 * c..=c).contains(&off(over.floor(n))), "{n} / {c}");
            assert!(off(over.nearest(n)).abs() <= 5 * c, "{n} / {c}");
        }
        for c in [0, -1, i64::MIN] {
            assert!(Reciprocal::unbiased(c).is_none());
        }
    }
}
