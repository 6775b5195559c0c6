//! The ball's texture, drawn by code.

use crate::colour::SHADES;
use crate::noise::fractal;

/// The colour of the texel at a longitude, a polar angle, and its point on the unit sphere (30
/// fraction bits).
pub fn texel(longitude: u32, _polar: u32, point: [i64; 3]) -> u8 {
    let n = fractal(point.map(|c| c >> 12), 1);
    let ramp = if longitude >> 27 & 3 == 0 { 0 } else { 2 };
    (ramp * SHADES as i64 + 8 + n * 23 / 65_536) as u8
}
