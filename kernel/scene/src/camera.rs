//! Perspective: from the viewer's space to 1/256 pixel.

use modex::{HEIGHT, WIDTH};

use crate::Vec3;

/// Pixels on the screen for one unit at distance one. The eye is at the origin and looks along
/// z; the middle of the screen is the corner between four pixels.
pub const FOCAL_LENGTH: i32 = 258;

/// Nearest z that is projected, 16.16: a quarter of a unit. At it a point 128 units off the axis,
/// the furthest that is legal, is at 2^25 of 1/256 pixel: it fits 32 bits, and the mapper tells
/// that it is out of its range.
pub const NEAR: i32 = 1 << 14;

/// The screen position of a point in 16.16, rounded to 1/256 pixel (half up), or nothing if the
/// point is nearer than [`NEAR`]. |x| and |y| are at most 2^23 (128 units).
pub fn project(point: Vec3) -> Option<(i32, i32)> {
    let [x, y, z] = point.map(i64::from);
    if z < i64::from(NEAR) {
        return None;
    }
    let scale = i64::from(FOCAL_LENGTH) * 256;
    let round = |n: i64| (2 * n + z).div_euclid(2 * z) as i32;
    Some((
        round(x * scale) + WIDTH as i32 / 2 * 256,
        round(y * scale) + HEIGHT as i32 / 2 * 256,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_meets_the_middle_and_ties_round_up() {
        assert_eq!(project([0, 0, 3 << 16]), Some((160 * 256, 120 * 256)));
        assert_eq!(project([0, 0, NEAR - 1]), None);
        // One unit at distance one is FOCAL_LENGTH pixels.
        let unit = 160 * 256 + FOCAL_LENGTH * 256;
        assert_eq!(project([1 << 16, 0, 1 << 16]), Some((unit, 120 * 256)));
        // FOCAL_LENGTH x 256 / 2^17 of 1/256 pixel is 0.504: up; less than half: down.
        assert_eq!(
            project([1, -1, 1 << 17]),
            Some((160 * 256 + 1, 120 * 256 - 1))
        );
        assert_eq!(project([1, -1, 3 << 16]), Some((160 * 256, 120 * 256)));
    }
}
