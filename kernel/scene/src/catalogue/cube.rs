//! A crate that tumbles and comes close to the eye.

use super::motion::{DEGREE, turn, units};
use super::quad::{ONE, corners, face};
use super::surfaces;
use crate::colour::BACKGROUND;
use crate::entry::{Colours, Cover, Entry};
use crate::trig::sin;
use crate::{Corner, Mesh, MeshFace, Pose, Vec3};

/// The crate.
pub const CUBE: Entry<'static> = Entry {
    name: "cube",
    about: "a crate that tumbles and comes close to the eye",
    mesh: MESH,
    colours: Colours::BUILT_IN,
    background: &BACKGROUND,
    cover: Cover::Painted(|texels| surfaces::paint(texels, surfaces::crate_side).into()),
    mipmaps: false,
    pose: |tick| Pose {
        yaw: turn(tick).wrapping_add(35 * DEGREE),
        pitch: turn(tick / 2).wrapping_add(30 * DEGREE),
        roll: turn(tick / 3),
        // 2.25 to 4.25 units: its corners are 1.73 from the centre.
        distance: units(13, 4) - (sin(turn(tick)) >> 14) as i32,
    },
    tile: 0,
};

/// Four vertices a side: front, right, back, left, top, bottom, each clockwise from its texture's top left as
/// seen from outside.
#[rustfmt::skip]
static CUBE_VERTICES: [Vec3; 24] = {
    const A: i32 = -units(1, 1);
    const B: i32 = units(1, 1);
    [
        [A, A, A], [B, A, A], [B, B, A], [A, B, A],
        [B, A, A], [B, A, B], [B, B, B], [B, B, A],
        [B, A, B], [A, A, B], [A, B, B], [B, B, B],
        [A, A, B], [A, A, A], [A, B, A], [A, B, B],
        [A, A, B], [B, A, B], [B, A, A], [A, A, A],
        [A, B, A], [B, B, A], [B, B, B], [A, B, B],
    ]
};
static CUBE_CORNERS: [Corner; 24] = corners();
static CUBE_FACES: [MeshFace; 6] = [
    face(0, [0, 0, -ONE]),
    face(4, [ONE, 0, 0]),
    face(8, [0, 0, ONE]),
    face(12, [-ONE, 0, 0]),
    face(16, [0, -ONE, 0]),
    face(20, [0, ONE, 0]),
];
const MESH: Mesh<'static> = Mesh {
    vertices: &CUBE_VERTICES,
    corners: &CUBE_CORNERS,
    faces: &CUBE_FACES,
    convex: true,
};

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn the_crate_is_closed_and_looks_outward() {
        let mut edges = HashMap::new();
        for face in MESH.faces {
            let corners = &MESH.corners[usize::from(face.first)..][..4];
            let places = [0, 1, 2, 3].map(|i| MESH.vertices[usize::from(corners[i].vertex)]);
            for i in 0..4 {
                *edges.entry((places[i], places[(i + 1) % 4])).or_insert(0) += 1;
            }
            // The face lies one unit out along its normal.
            for place in places {
                let out: i32 = (0..3)
                    .map(|k| (place[k] >> 2) * (face.normal[k] >> 14))
                    .sum();
                assert_eq!(out, ONE);
            }
        }
        let both = |(a, b)| edges.get(&(b, a)) == Some(&1);
        assert!(edges.iter().all(|(&edge, &count)| count == 1 && both(edge)));
    }
}
