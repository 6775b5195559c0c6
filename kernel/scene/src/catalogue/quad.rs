//! Four-cornered faces that show a whole texture.

use super::surfaces::SIDE;
use crate::{Corner, Mesh, MeshFace, Vec3};

/// Returns a square that lies `y` below the origin and extends by `half` to either side, to the front and to
/// the back. The texture's top is far away, so that its text reads from the near edge.
pub const fn lying(half: i32, y: i32) -> [Vec3; 4] {
    [
        [-half, y, half],
        [half, y, half],
        [half, y, -half],
        [-half, y, -half],
    ]
}

/// Returns the corners of faces that show the whole texture, four vertices a face, clockwise from the
/// texture's top left.
pub const fn corners<const N: usize>() -> [Corner; N] {
    let side = (SIDE as i32) << 16;
    let places = [(0, 0), (side, 0), (side, side), (0, side)];
    let mut corners = [Corner {
        vertex: 0,
        u: 0,
        v: 0,
    }; N];
    let mut i = 0;
    while i < N {
        corners[i] = Corner {
            vertex: i as u16,
            u: places[i % 4].0,
            v: places[i % 4].1,
        };
        i += 1;
    }
    corners
}

/// Returns a face of four corners.
pub const fn face(first: u16, normal: Vec3) -> MeshFace {
    MeshFace {
        first,
        corners: 4,
        texture: 0,
        normal,
    }
}

/// One, with a normal's 14 fraction bits.
pub const ONE: i32 = 1 << 14;
pub static ONE_FACE: [Corner; 4] = corners();
static UPWARD: [MeshFace; 1] = [face(0, [0, -ONE, 0])];

pub const fn lies(vertices: &'static [Vec3]) -> Mesh<'static> {
    Mesh {
        vertices,
        corners: &ONE_FACE,
        faces: &UPWARD,
        convex: true,
    }
}
