//! Position and orientation of the solid.

use crate::Vec3;
use crate::trig::{cos, mul, sin};

/// The solid's pose: three angles and a distance.
///
/// Angles are 32-bit fractions of a turn, so the step from 2^32 - 1 to 0 is as small as any other. The
/// orientation is always rebuilt from the angles and never accumulated, so nothing drifts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pose {
    /// About the solid's own axis (y), applied first.
    pub yaw: u32,
    /// About the screen's horizontal, applied second: tips the axis towards or away from the viewer.
    pub pitch: u32,
    /// About the line of sight, applied last: leans the axis to the side.
    pub roll: u32,
    /// From the eye to the solid's centre, 16.16; 0 to [`Pose::MAX_DISTANCE`].
    pub distance: i32,
}

/// A degree as a fraction of a turn.
const DEGREE: u32 = ((1u64 << 32) / 360) as u32;

impl Pose {
    /// 128 units, 16.16.
    pub const MAX_DISTANCE: i32 = 128 << 16;

    /// Ticks of a whole turn: 12 s.
    const TURN: u32 = 720;

    /// Returns the default pose at a tick: a steady turn about an axis that is tipped and leaning like a
    /// globe's.
    pub fn at_tick(tick: u32) -> Self {
        Self {
            yaw: tick
                .wrapping_mul(((1u64 << 32) / Self::TURN as u64) as u32)
                .wrapping_neg(),
            // Shows the rose on the upper pole, and still the belt.
            pitch: 28 * DEGREE,
            roll: 18 * DEGREE,
            // The silhouette's radius is 93 pixels, of 120 from the screen's centre to its edge.
            distance: 295 * (1 << 16) / 100,
        }
    }

    /// Returns the rotation of the three angles.
    pub fn orientation(&self) -> Orientation {
        let (sy, cy) = (sin(self.yaw), cos(self.yaw));
        let (sp, cp) = (sin(self.pitch), cos(self.pitch));
        let (sr, cr) = (sin(self.roll), cos(self.roll));
        // Rz(roll) Rx(pitch) Ry(yaw), written out; each entry is at most 1, except for rounding.
        let (spsy, spcy) = (mul(sp, sy), mul(sp, cy));
        Orientation {
            rows: [
                [
                    mul(cr, cy) - mul(sr, spsy),
                    -mul(sr, cp),
                    mul(cr, sy) + mul(sr, spcy),
                ],
                [
                    mul(sr, cy) + mul(cr, spsy),
                    mul(cr, cp),
                    mul(sr, sy) - mul(cr, spcy),
                ],
                [-mul(cp, sy), sp, mul(cp, cy)],
            ],
        }
    }
}

/// A rotation matrix, 30 fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orientation {
    rows: [[i64; 3]; 3],
}

impl Orientation {
    /// Turns a point or direction, rounded to nearest. The result has the same number of fraction bits.
    pub fn turn(&self, v: Vec3) -> Vec3 {
        let v = v.map(i64::from);
        self.rows.map(|row| {
            let sum = row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
            ((sum + (1 << 29)) >> 30) as i32
        })
    }

    /// Turns a direction back, from the viewer's axes to the solid's.
    pub fn turn_back(&self, v: Vec3) -> Vec3 {
        let v = v.map(i64::from);
        [0, 1, 2].map(|column| {
            let sum: i64 = (0..3).map(|row| self.rows[row][column] * v[row]).sum();
            ((sum + (1 << 29)) >> 30) as i32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_seamless_and_rigid() {
        for tick in [0, 1, 719, 1_000_000, u32::MAX] {
            let orientation = Pose::at_tick(tick).orientation();
            for (i, a) in orientation.rows.iter().enumerate() {
                for (j, b) in orientation.rows.iter().enumerate() {
                    let dot: i128 = a
                        .iter()
                        .zip(b)
                        .map(|(&a, &b)| i128::from(a) * i128::from(b))
                        .sum();
                    let expected = if i == j { 1i128 << 60 } else { 0 };
                    // Congruent within 2^-16, with a wide margin.
                    assert!(
                        (dot - expected).abs() < 1 << 36,
                        "tick {tick}, rows {i} and {j}"
                    );
                }
            }
        }
        let step = |a: u32, b: u32| Pose::at_tick(a).yaw.wrapping_sub(Pose::at_tick(b).yaw);
        assert_eq!(step(u32::MAX, 0), step(0, 1));
    }

    #[test]
    fn turning_back_undoes_a_turn() {
        let orientation = Pose::at_tick(123).orientation();
        let v = [40_000, -20_000, 7];
        let there_and_back = orientation.turn_back(orientation.turn(v));
        for (a, b) in v.iter().zip(there_and_back) {
            assert!((a - b).abs() <= 1, "{v:?} came back as {there_and_back:?}");
        }
    }
}
