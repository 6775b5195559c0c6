//! Perspective: from the viewer's space to 1/256 pixel.

use modex::{HEIGHT, WIDTH};
use texmap::SUBPIXELS;

use crate::Vec3;

/// Pixels on the screen for one unit at distance one. The eye is at the origin and looks along
/// z; the middle of the screen is the corner between four pixels.
pub const FOCAL_LENGTH: i32 = 258;

/// Nearest z that is seen, 16.16: 1/512 unit, where the near plane cuts.
///
/// A line of sight through a pixel is at most 1.2654 times as long as its z (the screen's corner
/// is 200 pixels from its middle). So of a face whose plane is 1/404 unit or more from the eye,
/// the near plane cuts away nothing that is on the screen, and the eye may come as near as 1/256
/// unit with room for the rounding. Nearer, the face opens before the eye like a window.
pub const NEAR: i32 = 1 << 7;

/// Subpixels on the screen for one unit at distance one.
const SCALE: i64 = FOCAL_LENGTH as i64 * SUBPIXELS as i64;
/// The middle of the screen in subpixels.
const MIDDLE: (i32, i32) = (WIDTH as i32 / 2 * SUBPIXELS, HEIGHT as i32 / 2 * SUBPIXELS);

/// The screen position of a point in 16.16, rounded to 1/256 pixel (half up). The point is inside
/// the near plane and the guard band.
pub(crate) fn project(point: Vec3) -> (i32, i32) {
    let [x, y, z] = point.map(i64::from);
    let round = |n: i64| (2 * n + z).div_euclid(2 * z) as i32;
    (round(x * SCALE) + MIDDLE.0, round(y * SCALE) + MIDDLE.1)
}

/// The same for a point with more fraction bits: below 2^52 in size. With zeros for the further
/// bits it is the same position.
pub(crate) fn project_fine(point: [i64; 3]) -> (i32, i32) {
    let [x, y, z] = point.map(i128::from);
    let scale = i128::from(SCALE);
    let round = |n: i128| (2 * n + z).div_euclid(2 * z) as i32;
    (round(x * scale) + MIDDLE.0, round(y * scale) + MIDDLE.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both projections, which have to agree.
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
