//! The corridor: two walls and a floor that go on to the horizon.
//!
//! Its textures are tiled: a tile is one unit wide, and a face has several. Faces on both sides of every edge
//! meet at the same points (the floor meets the walls at their feet), so no T-junction leaves a pixel out.
//! Faces are short near the eye and long far away; each uses the mipmap that fits it.

use texmap::Texture;

use super::motion::{sway, units};
use super::surfaces::{part, shade};
use crate::colour::LEVEL_BACKGROUND;
use crate::colour::Ramp::{Azure, Gold, Indigo, Pearl, Rose, Teal, Violet};
use crate::entry::{Colours, Cover, Entry, MAX_TEXELS, Textures};
use crate::noise::{fractal, hash};
use crate::{Corner, Mesh, MeshFace, Pose, Vec3};

/// Texels along each side of a tile.
const TILE: u16 = 64;
/// Most tiles of a face along the corridor: as many as the longest texture has.
const LONGEST: i32 = Texture::MAX_SIDE as i32 / TILE as i32;

/// Where faces meet, in units along the corridor; the eye is at -3 to -2.
const STATIONS: [i32; 24] = [
    -4, -3, -2, -1, 0, 1, 2, 3, 4, 6, 8, 10, 12, 16, 20, 24, 28, 32, 36, 40, 44, 48, 52, 56,
];
const SEGMENTS: usize = STATIONS.len() - 1;
const FACES: usize = 3 * SEGMENTS;

/// Half the width, and the heights of the floor and of the walls' top relative to the eye (y down), 16.16.
const SIDE: i32 = 1 << 16;
const FLOOR: i32 = 3 << 14;
const TOP: i32 = FLOOR - (2 << 16);

struct Solid {
    vertices: [Vec3; 4 * STATIONS.len()],
    corners: [Corner; 4 * FACES],
    faces: [MeshFace; FACES],
}

static SOLID: Solid = build();

/// A walk between two walls.
pub const CORRIDOR: Entry<'static> = Entry {
    name: "corridor",
    about: "a walk between two walls: tiled textures, a mipmap for each face",
    mesh: MESH,
    colours: Colours::BUILT_IN,
    background: &LEVEL_BACKGROUND,
    cover: Cover::Painted(paint),
    mipmaps: true,
    pose: stroll,
    tile: STEP,
};

/// The same walk without mipmaps.
pub const MOIRE: Entry<'static> = Entry {
    name: "moire",
    about: "the same walk without mipmaps: what is far away shimmers",
    mesh: MESH,
    colours: Colours::BUILT_IN,
    background: &LEVEL_BACKGROUND,
    cover: Cover::Painted(paint),
    mipmaps: false,
    pose: stroll,
    tile: STEP,
};

/// A tile of the corridor's floor and walls, 16.16 units.
const STEP: i32 = 1 << 16;

/// Returns the pose at a tick: one tile forward in three quarters of a second, with a look to either side.
/// The motion is seamless, since all tiles are alike.
fn stroll(tick: u32) -> Pose {
    const TICKS: u32 = 45;
    Pose {
        yaw: sway(tick, 9),
        pitch: 0,
        roll: sway(tick.wrapping_mul(2), 1),
        distance: units(3, 1) - (tick % TICKS) as i32 * STEP / TICKS as i32,
    }
}

/// The corridor's mesh: textures 0 and 1 are those of [`paint`].
const MESH: Mesh<'static> = Mesh {
    vertices: &SOLID.vertices,
    corners: &SOLID.corners,
    faces: &SOLID.faces,
    // The inside of a convex solid hides nothing either.
    convex: true,
};

/// Builds the corridor. Each station has four vertices: left and right on the floor, left and right at the
/// top.
const fn build() -> Solid {
    let empty = Corner {
        vertex: 0,
        u: 0,
        v: 0,
    };
    let mut solid = Solid {
        vertices: [[0; 3]; 4 * STATIONS.len()],
        corners: [empty; 4 * FACES],
        faces: [MeshFace {
            first: 0,
            corners: 4,
            texture: 0,
            normal: [0; 3],
        }; FACES],
    };
    let mut station = 0;
    while station < STATIONS.len() {
        let z = STATIONS[station] << 16;
        solid.vertices[4 * station] = [-SIDE, FLOOR, z];
        solid.vertices[4 * station + 1] = [SIDE, FLOOR, z];
        solid.vertices[4 * station + 2] = [-SIDE, TOP, z];
        solid.vertices[4 * station + 3] = [SIDE, TOP, z];
        station += 1;
    }
    const ONE: i32 = 1 << 14;
    let mut segment = 0;
    while segment < SEGMENTS {
        let tiles = STATIONS[segment + 1] - STATIONS[segment];
        assert!(tiles <= LONGEST);
        let (along, two) = ((tiles * (TILE as i32)) << 16, (2 * TILE as i32) << 16);
        let (near, far) = (4 * segment as u16, 4 * segment as u16 + 4);
        // Clockwise as seen from inside the corridor, with their texture coordinates.
        let faces = [
            (
                0,
                [0, -ONE, 0],
                [
                    (far, 0, 0),
                    (far + 1, two, 0),
                    (near + 1, two, along),
                    (near, 0, along),
                ],
            ),
            (
                1,
                [ONE, 0, 0],
                [
                    (near + 2, 0, 0),
                    (far + 2, along, 0),
                    (far, along, two),
                    (near, 0, two),
                ],
            ),
            (
                1,
                [-ONE, 0, 0],
                [
                    (far + 3, along, 0),
                    (near + 3, 0, 0),
                    (near + 1, 0, two),
                    (far + 1, along, two),
                ],
            ),
        ];
        let mut i = 0;
        while i < 3 {
            let (texture, normal, corners) = faces[i];
            let face = 3 * segment + i;
            let mut k = 0;
            while k < 4 {
                let (vertex, u, v) = corners[k];
                solid.corners[4 * face + k] = Corner { vertex, u, v };
                k += 1;
            }
            solid.faces[face] = MeshFace {
                first: 4 * face as u16,
                corners: 4,
                texture,
                normal,
            };
            i += 1;
        }
        segment += 1;
    }
    solid
}

/// Paints the tile of the floor and the tile of the walls.
fn paint(texels: &mut [u8; MAX_TEXELS]) -> Textures<'_> {
    const LEN: usize = TILE as usize * TILE as usize;
    let (floor, rest) = texels.split_at_mut(LEN);
    let (wall, _) = rest.split_at_mut(LEN);
    let tile = |texels: &mut [u8], texel: fn(i64, i64) -> u8| {
        for (j, row) in texels.chunks_exact_mut(TILE.into()).enumerate() {
            for (i, colour) in row.iter_mut().enumerate() {
                *colour = texel(i as i64, j as i64);
            }
        }
    };
    tile(floor, slabs);
    tile(wall, courses);
    let most = Texture::MAX_SIDE;
    let tiled = |texels, width, height| {
        let texture = Texture::tiled(texels, (TILE, TILE), width, height);
        texture.expect("there are TILE x TILE texels")
    };
    [tiled(floor, 2 * TILE, most), tiled(wall, most, 2 * TILE)].into()
}

/// Returns the colour of a texel of marble slabs, dark and light, with gold lines between them and a diamond
/// where four of them meet.
fn slabs(i: i64, j: i64) -> u8 {
    const HALF: i64 = TILE as i64 / 2;
    let from_line = |k: i64| (k % HALF).min(HALF - 1 - k % HALF);
    let (x, y) = (from_line(i), from_line(j));
    if x + y < 7 {
        return match x + y {
            6 => Indigo.shade(2),
            near => shade(Gold, 21 - near * 2),
        };
    }
    if x == 0 || y == 0 {
        return shade(Gold, 11);
    }
    let light = (i / HALF + j / HALF) % 2 == 0;
    // Veins where noise crosses its middle. Each slab is cut from its own block.
    let block = [i / HALF * 97 + 5, j / HALF * 89 + 3];
    let at = [(i + block[0]) << 12, (j + block[1]) << 12, 0];
    let vein = (2 * fractal(at, 4, 61) - (1 << 16)).abs();
    let cloud = part(fractal(at, 3, 67), 4);
    match (light, vein) {
        (true, ..4000) => shade(Violet, 13),
        (true, _) => shade(Pearl, 15 + cloud),
        (false, ..4000) => shade(Teal, 13),
        (false, _) => shade(Indigo, 4 + cloud),
    }
}

/// Returns the colour of a texel of courses of stone, each offset by half a stone from the course below, and
/// a frieze.
fn courses(i: i64, j: i64) -> u8 {
    const COURSE: i64 = 16;
    let (course, y) = (j / COURSE, j % COURSE);
    if course == 0 {
        // Gold above and below, enamel lozenges between.
        let (x, middle) = ((i % 16 - 8).abs(), (y - 8).abs());
        return match (middle, x + middle) {
            (7.., _) => shade(Gold, 18 - (middle - 7) * 8 + i64::from(y < 8) * 3),
            (_, ..6) if i / 16 % 2 == 0 => shade(Rose, 16 - x - middle),
            (_, ..6) => shade(Azure, 16 - x - middle),
            (_, 6) => shade(Gold, 14),
            _ => Indigo.shade(3),
        };
    }
    let x = (i + course % 2 * 16).rem_euclid(TILE as i64);
    let (stone, x) = (x / 32, x % 32);
    if x == 0 || y == 0 {
        return Indigo.shade(3);
    }
    // Light from the upper left on each stone's edge.
    let edge = i64::from(x == 1 || y == 1) * 4 - i64::from(x == 31 || y == 15) * 4;
    let own = part(hash([stone, course, 5], 71), 5);
    let grain = part(hash([i, j, 9], 73), 3);
    let ramp = match hash([stone, course, 7], 79) % 5 {
        0 => Rose,
        1 => Teal,
        _ => Violet,
    };
    shade(ramp, 8 + own + grain + edge)
}
