//! Angles and movements that the scenes share.

use crate::trig::sin;

/// A degree, as a fraction of a turn.
pub const DEGREE: u32 = ((1u64 << 32) / 360) as u32;
/// A quarter of a turn.
pub const QUARTER: u32 = 1 << 30;

/// Returns `n / d` units in 16.16.
pub const fn units(n: i32, d: i32) -> i32 {
    n * (1 << 16) / d
}

/// Returns the angle at a tick of a steady turn in 12 s.
pub const fn turn(tick: u32) -> u32 {
    tick.wrapping_mul(((1u64 << 32) / 720) as u32)
}

/// Returns the angle at a tick of a swing by up to `degrees` to either side and back in 12 s. At tick 0 the
/// swing is under way, so that nothing is level.
pub fn sway(tick: u32, degrees: u32) -> u32 {
    let sine = sin(turn(tick).wrapping_add(QUARTER / 2));
    ((sine * i64::from(degrees * DEGREE)) >> 30) as u32
}
