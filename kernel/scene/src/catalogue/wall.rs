//! A wall that runs away from the viewer.

use super::motion::{DEGREE, sway, units};
use super::quad::{ONE, ONE_FACE, face};
use super::surfaces;
use crate::colour::LEVEL_BACKGROUND;
use crate::entry::{Colours, Cover, Entry};
use crate::{Mesh, MeshFace, Pose, Vec3};

/// The wall, swaying: the depth is constant down each column.
pub const WALL: Entry<'static> = Entry {
    name: "wall",
    about: "a wall that runs away from the viewer: constant depth down each column",
    mesh: MESH,
    colours: Colours::BUILT_IN,
    background: &LEVEL_BACKGROUND,
    cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::bricks).into()),
    mipmaps: false,
    pose: |tick| Pose {
        yaw: sway(tick, 12).wrapping_add(52 * DEGREE),
        pitch: 0,
        roll: 0,
        distance: units(21, 10),
    },
    tile: 0,
};

static WALL_VERTICES: [Vec3; 4] = {
    let half = units(3, 2);
    [
        [-half, -half, 0],
        [half, -half, 0],
        [half, half, 0],
        [-half, half, 0],
    ]
};
static TOWARDS: [MeshFace; 1] = [face(0, [0, 0, -ONE])];
const MESH: Mesh<'static> = Mesh {
    vertices: &WALL_VERTICES,
    corners: &ONE_FACE,
    faces: &TOWARDS,
    convex: true,
};
