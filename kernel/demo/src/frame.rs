//! Names of frames, and the poses that they stand for.

use protocol::{FrameName, Motion};
use scene::Pose;
use scene::catalogue::Entry;

/// Returns the pose that a frame's name stands for, or `None` if its distance is out of range.
pub fn pose(scene: &Entry<'_>, frame: FrameName) -> Option<Pose> {
    match frame {
        FrameName::Number(frame) => Some(scene.pose(frame)),
        FrameName::Pose {
            yaw,
            pitch,
            roll,
            distance,
        } => {
            let distance = i32::try_from(distance).ok()?;
            (distance <= Pose::MAX_DISTANCE).then_some(Pose {
                yaw,
                pitch,
                roll,
                distance,
            })
        }
    }
}

/// Returns the name of a pose.
pub(crate) fn name(pose: &Pose) -> FrameName {
    FrameName::Pose {
        yaw: pose.yaw,
        pitch: pose.pitch,
        roll: pose.roll,
        distance: pose.distance.unsigned_abs(),
    }
}

/// Returns the pose one tick after `pose`, or `None` if its distance is out of range.
pub(crate) fn pose_after(pose: &Pose, motion: Motion) -> Option<Pose> {
    let distance = pose.distance.wrapping_add(motion.distance as i32);
    (0..=Pose::MAX_DISTANCE)
        .contains(&distance)
        .then_some(Pose {
            yaw: pose.yaw.wrapping_add(motion.yaw),
            pitch: pose.pitch.wrapping_add(motion.pitch),
            roll: pose.roll.wrapping_add(motion.roll),
            distance,
        })
}

/// Returns the motion from a pose to the pose of the next tick.
pub(crate) fn motion_between(pose: &Pose, next: &Pose) -> Motion {
    Motion {
        yaw: next.yaw.wrapping_sub(pose.yaw),
        pitch: next.pitch.wrapping_sub(pose.pitch),
        roll: next.roll.wrapping_sub(pose.roll),
        distance: next.distance.wrapping_sub(pose.distance) as u32,
    }
}
