//! Floors to the horizon: `grazing-16` and `grazing-4096`.

use super::motion::{sway, units};
use super::quad::{lies, lying};
use super::surfaces;
use crate::colour::LEVEL_BACKGROUND;
use crate::entry::{Colours, Cover, Entry};
use crate::{MAX_EXTENT, Mesh, Pose, Vec3};

/// A floor whose far edge is 16 times as far away as its near edge.
pub const GRAZING_16: Entry<'static> = Entry {
    name: "grazing-16",
    about: "a floor to the horizon: its far edge is 16 times as far away as its near edge",
    mesh: FLOOR_16,
    colours: Colours::BUILT_IN,
    background: &LEVEL_BACKGROUND,
    cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::board).into()),
    mipmaps: false,
    pose: |tick| Pose {
        yaw: 0,
        pitch: 0,
        roll: sway(tick, 10),
        distance: FAR_16 - FLOOR_16_HALF,
    },
    tile: 0,
};

/// A floor whose far edge is 4096 times as far away as its near edge.
pub const GRAZING_4096: Entry<'static> = Entry {
    name: "grazing-4096",
    about: "a floor to the horizon: its far edge is 4096 times as far away as its near edge",
    mesh: FLOOR_4096,
    colours: Colours::BUILT_IN,
    background: &LEVEL_BACKGROUND,
    cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::plain).into()),
    mipmaps: false,
    pose: |tick| Pose {
        yaw: 0,
        pitch: 0,
        roll: sway(tick, 10),
        distance: FAR_4096 - FLOOR_4096_HALF,
    },
    tile: 0,
};

/// The distance of a floor's far edge, 16.16: the largest distance that a pose may have. The floor's centre
/// is nearer.
const FAR_16: i32 = 128 << 16;
/// The near edge is at a sixteenth of that distance, below the screen.
const FLOOR_16_HALF: i32 = (FAR_16 - FAR_16 / 16) / 2;
static FLOOR_16_VERTICES: [Vec3; 4] = lying(FLOOR_16_HALF, units(21, 4));
const FLOOR_16: Mesh<'static> = lies(&FLOOR_16_VERTICES);

const FAR_4096: i32 = 128 << 16;
const FLOOR_4096_HALF: i32 = (FAR_4096 - FAR_4096 / 4096) / 2;
static FLOOR_4096_VERTICES: [Vec3; 4] = lying(FLOOR_4096_HALF, units(3, 4));
const FLOOR_4096: Mesh<'static> = lies(&FLOOR_4096_VERTICES);
const _: () = assert!(FLOOR_16_HALF < MAX_EXTENT && FLOOR_4096_HALF < MAX_EXTENT);
