//! A square: `facing` faces the viewer, `tilted` leans.

use super::motion::{DEGREE, QUARTER, turn, units};
use super::quad::{lies, lying};
use super::surfaces;
use crate::colour::BACKGROUND;
use crate::entry::{Colours, Cover, Entry};
use crate::{Mesh, Pose, Vec3};

/// The square at one depth, turning.
pub const FACING: Entry<'static> = Entry {
    name: "facing",
    about: "a square that faces the viewer and turns: no perspective",
    mesh: SQUARE,
    colours: Colours::BUILT_IN,
    background: &BACKGROUND,
    cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::dial).into()),
    mipmaps: false,
    pose: |tick| Pose {
        yaw: turn(tick),
        pitch: QUARTER,
        roll: 0,
        distance: units(23, 10),
    },
    tile: 0,
};

/// The square at 45 degrees, turning in its plane.
pub const TILTED: Entry<'static> = Entry {
    name: "tilted",
    about: "the square at 45 degrees to the line of sight, turning in its plane",
    mesh: SQUARE,
    colours: Colours::BUILT_IN,
    background: &BACKGROUND,
    cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::board).into()),
    mipmaps: false,
    pose: |tick| Pose {
        yaw: turn(tick).wrapping_add(25 * DEGREE),
        pitch: QUARTER / 2,
        roll: 0,
        distance: units(23, 10),
    },
    tile: 0,
};

static SQUARE_VERTICES: [Vec3; 4] = lying(units(1, 1), 0);
const SQUARE: Mesh<'static> = lies(&SQUARE_VERTICES);
