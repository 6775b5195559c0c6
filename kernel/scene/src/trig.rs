//! Sine and cosine of angles given as 32-bit fractions of a turn.
//!
//! The functions use polynomials, not a table: a pose needs only six values. The turn is folded into an
//! eighth. There the Taylor series to the ninth power (sine) and the tenth (cosine) have an error below
//! 1.8e-9, two units of the result's 30 fraction bits; rounding adds as much again. Folding makes the quarter
//! turns exact and keeps the four quadrants mirror images, so a solid turned by 90 degrees is the same solid.

/// One, with the 30 fraction bits of every result here.
pub const ONE_Q30: i64 = 1 << 30;

const QUARTER: u32 = 1 << 30;
const EIGHTH: u32 = 1 << 29;
/// pi / 2, a quarter turn in radians, 61 fraction bits.
const HALF_PI_Q61: i128 = 3_622_009_729_038_561_421;

/// Returns the sine of `angle` / 2^32 turns, 30 fraction bits, -2^30 to 2^30.
pub const fn sin(angle: u32) -> i64 {
    cos(angle.wrapping_sub(QUARTER))
}

/// Returns the cosine of `angle` / 2^32 turns, 30 fraction bits, -2^30 to 2^30.
pub const fn cos(angle: u32) -> i64 {
    // cos is even: fold the second half of the turn onto the first, then into a quarter.
    let half = if angle >> 31 == 1 {
        angle.wrapping_neg()
    } else {
        angle
    };
    if half > QUARTER {
        -first_quarter_cos((1 << 31) - half)
    } else {
        first_quarter_cos(half)
    }
}

const fn first_quarter_cos(angle: u32) -> i64 {
    if angle <= EIGHTH {
        cos_series(radians(angle))
    } else {
        sin_series(radians(QUARTER - angle))
    }
}

/// Converts an angle of up to an eighth of a turn to radians with 30 fraction bits.
const fn radians(angle: u32) -> i64 {
    // angle / 2^30 quarter turns x pi/2: 30 + 61 fraction bits, rounded to 30.
    ((angle as i128 * HALF_PI_Q61 + (1 << 60)) >> 61) as i64
}

/// Returns 1 - x^2/2 (1 - x^2/12 (1 - x^2/30 (1 - x^2/56))), by Horner.
const fn cos_series(x: i64) -> i64 {
    let x2 = mul(x, x);
    let mut sum = ONE_Q30 - x2 / 90;
    sum = ONE_Q30 - mul(x2, sum) / 56;
    sum = ONE_Q30 - mul(x2, sum) / 30;
    sum = ONE_Q30 - mul(x2, sum) / 12;
    ONE_Q30 - mul(x2, sum) / 2
}

/// Returns x (1 - x^2/6 (1 - x^2/20 (1 - x^2/42 (1 - x^2/72)))), by Horner.
const fn sin_series(x: i64) -> i64 {
    let x2 = mul(x, x);
    let mut sum = ONE_Q30 - x2 / 72;
    sum = ONE_Q30 - mul(x2, sum) / 42;
    sum = ONE_Q30 - mul(x2, sum) / 20;
    sum = ONE_Q30 - mul(x2, sum) / 6;
    mul(x, sum)
}

/// Returns the product of two numbers with 30 fraction bits, rounded; either is at most 2 in size.
pub(crate) const fn mul(a: i64, b: i64) -> i64 {
    (a * b + (1 << 29)) >> 30
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn within_four_units_of_the_truth() {
        extern crate std;
        let mut worst = 0f64;
        for i in 0..=200_000u64 {
            let angle = (i * 21_474) as u32;
            let turn = f64::from(angle) / 4_294_967_296.0 * std::f64::consts::TAU;
            for (actual, exact) in [(sin(angle), turn.sin()), (cos(angle), turn.cos())] {
                worst = worst.max((actual as f64 - exact * ONE_Q30 as f64).abs());
            }
        }
        assert!(worst < 4.0, "off by {worst} units of 2^-30");
    }

    #[test]
    fn quarter_turns_are_exact_and_quadrants_mirror() {
        for (quarters, (s, c)) in (0..).zip([(0, 1), (1, 0), (0, -1), (-1, 0)]) {
            let angle = quarters * QUARTER;
            assert_eq!((sin(angle), cos(angle)), (s * ONE_Q30, c * ONE_Q30));
        }
        for i in 0..1000u32 {
            let angle = i.wrapping_mul(0x9E37_79B9);
            assert_eq!(sin(angle), -sin(angle.wrapping_neg()));
            assert_eq!(cos(angle), cos(angle.wrapping_neg()));
            assert_eq!(sin(angle.wrapping_add(QUARTER)), cos(angle));
            assert_eq!(cos(angle.wrapping_add(1 << 31)), -cos(angle));
        }
    }
}
