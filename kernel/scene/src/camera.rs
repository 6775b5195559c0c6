//! Perspective projection from view space to 1/256 pixel.

use modex::{HEIGHT, WIDTH};
use texmap::SUBPIXELS;

use crate::Vec3;

/// Pixels on the screen for one unit at distance one. The eye is at the origin and looks along z; the
/// screen's centre is the corner between four pixels.
pub const FOCAL_LENGTH: i32 = 258;

/// The near plane's z, 16.16: 1/512 unit, the nearest visible z.
///
/// A line of sight through a pixel is at most 1.2654 times as long as its z (the screen's corner is 200
/// pixels from its centre). So if the plane of a face is 1/404 unit or more from the eye, the near plane cuts
/// away nothing that is on the screen, and the eye may come as near as 1/256 unit with room for the rounding.
/// Nearer than that, a hole opens in the face before the eye.
pub const NEAR: i32 = 1 << 7;

/// Subpixels on the screen for one unit at distance one.
const SCALE: i64 = FOCAL_LENGTH as i64 * SUBPIXELS as i64;
/// The centre of the screen in subpixels.
const MIDDLE: (i32, i32) = (WIDTH as i32 / 2 * SUBPIXELS, HEIGHT as i32 / 2 * SUBPIXELS);

/// Returns the screen position of a point in 16.16, rounded to 1/256 pixel (half up). The point is inside the
/// near plane and the guard band.
pub(crate) fn project(point: Vec3) -> (i32, i32) {
    let [x, y, z] = point.map(i64::from);
    let round = |n: i64| (2 * n + z).div_euclid(2 * z) as i32;
    (round(x * SCALE) + MIDDLE.0, round(y * SCALE) + MIDDLE.1)
}

/// Projects a point with more fraction bits, below 2^52 in size. If the additional bits are zero, the
/// position equals that of [`project`].
pub(crate) fn project_fine(point: [i64; 3]) -> (i32, i32) {
    let [x, y, z] = point.map(i128::from);
    let scale = i128::from(SCALE);
    let round = |n: i128| (2 * n + z).div_euclid(2 * z) as i32;
    (round(x * scale) + MIDDLE.0, round(y * scale) + MIDDLE.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that both projections agree, and returns the position.
    fn both(point: Vec3) -> (i32, i32) {
        let fine = project_fine(point.map(|k| i64::from(k) << 28));
        assert_eq!(fine, project(point), "{point:?}");
        fine
    }

    #[test]
    fn the_axis_meets_the_middle_and_ties_round_up() {
        assert_eq!(both([0, 0, 3 << 16]), (160 * 256, 120 * 256));
        assert_eq!(both([0, 0, NEAR]), (160 * 256, 120 * 256));
        // One unit at distance one is FOCAL_LENGTH pixels.
        let unit = 160 * 256 + FOCAL_LENGTH * 256;
        assert_eq!(both([1 << 16, 0, 1 << 16]), (unit, 120 * 256));
        // FOCAL_LENGTH x 256 / 2^17 of 1/256 pixel is 0.504: up; less than half: down.
        assert_eq!(both([1, -1, 1 << 17]), (160 * 256 + 1, 120 * 256 - 1));
        assert_eq!(both([1, -1, 3 << 16]), (160 * 256, 120 * 256));
        // 66 048 / 132 096 is a half: up, also from below zero.
        assert_eq!(both([1, -1, 132_096]), (160 * 256 + 1, 120 * 256));
    }
}
