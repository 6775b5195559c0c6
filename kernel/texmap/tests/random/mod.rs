//! Random columns of a texture's plane, and the expected coordinates of their pixels.

// Each test uses only a part of this module.
#![allow(dead_code)]

use texmap::PlaneStepper;

/// Columns that each default test of an error checks, for each mapper.
pub const COLUMNS: u32 = 100_000;
/// Columns that each deep test checks.
pub const DEEP_COLUMNS: u32 = 1_000_000;

/// Returns a side of a texture: powers of two and other numbers, 1, the largest.
pub fn side(random: &mut fastrand::Rng) -> u16 {
    match random.u8(0..4) {
        0 => random.u16(1..=4),
        1 => 1 << random.u16(0..=8),
        _ => random.u16(1..=256),
    }
}

/// Returns a depth ratio: 1, or above 1 by 2^-20 to 1, or from 1 to 4096. Within each range every magnitude
/// is equally likely.
fn ratio(random: &mut fastrand::Rng) -> f64 {
    match random.u8(0..4) {
        0 => 1.0,
        1 => 1.0 + (-20.0 * random.f64()).exp2(),
        _ => (12.0 * random.f64()).exp2(),
    }
}

/// Returns a coordinate at an end, inside the texture.
fn end(random: &mut fastrand::Rng, size: u16) -> f64 {
    match random.u8(0..8) {
        0 => 0.0,
        1 => size.into(),
        _ => random.f64() * f64::from(size),
    }
}

/// Returns a span of a visible face: c is above zero, and the coordinates are inside the texture, except for
/// rounding.
pub fn seen(random: &mut fastrand::Rng, len: u16, size: (u16, u16)) -> PlaneStepper {
    let ratio = ratio(random);
    let near = (20.0 + 33.0 * random.f64()).exp2() * ratio.max(1.0);
    let near = near.min(53f64.exp2());
    let mut ends = [near, near / ratio];
    if random.bool() {
        ends.reverse();
    }
    let steps = i64::from(len.max(2)) - 1;
    let mut forms = [[0; 2]; 3];
    forms[2] = ends.map(|c| (c as i64).max(1));
    for (k, size) in [size.0, size.1].into_iter().enumerate() {
        let from = end(random, size);
        let to = match random.u8(0..4) {
            // Hardly any texture.
            0 => (from + random.f64() * (-20.0 * random.f64()).exp2()).min(size.into()),
            _ => end(random, size),
        };
        forms[k] = [0, 1].map(|i| ([from, to][i] * forms[2][i] as f64) as i64);
    }
    // The rounding of the steps may leave the texture by a little.
    PlaneStepper {
        at: forms.map(|[from, _]| from),
        step: forms.map(|[from, to]| (to - from) / steps),
    }
}

/// Returns any span: outside the texture, across the horizon and behind it, and with c = 0 at a pixel.
pub fn any(random: &mut fastrand::Rng, len: u16) -> PlaneStepper {
    let value = |random: &mut fastrand::Rng, bits: u32| {
        let limit = 1i64 << random.u32(0..=bits);
        random.i64(-limit..=limit)
    };
    let steps = i64::from(len.max(2)) - 1;
    let [a, b, c] = [61, 61, 53].map(|bits| {
        let (from, to) = (value(random, bits), value(random, bits));
        (from, (to - from) / steps)
    });
    let mut stepper = PlaneStepper {
        at: [a.0, b.0, c.0],
        step: [a.1, b.1, c.1],
    };
    if random.u8(0..4) == 0 {
        // Zero at a pixel's centre.
        stepper.at[2] = -stepper.step[2] * random.i64(0..len.into());
    }
    stepper
}

/// Returns the quotient n / c in units of 2^-16 texel, clamped to a texture of `size` texels. On the horizon
/// and beyond it, the value that the quotient tends to before the horizon.
pub fn truth(n: i64, c: i64, size: u16) -> f64 {
    let last = f64::from(size) * 65536.0 - 1.0;
    match (n < 0, c > 0) {
        (true, _) => 0.0,
        (false, true) => (n as f64 / c as f64 * 65536.0).min(last),
        (false, false) => last,
    }
}

/// Returns the error of the coordinates at pixel `i` of a span: the larger of the two.
pub fn off(stepper: &PlaneStepper, i: u16, (u, v): (i32, i32), size: (u16, u16)) -> f64 {
    let [a, b, c] = stepper.after(i);
    let off = |n: i64, at: i32, size: u16| (truth(n, c, size) - f64::from(at)).abs();
    off(a, u, size.0).max(off(b, v, size.1))
}
