//! The knot: a tube along a trefoil, which hides parts of itself.
//!
//! The curve winds on a torus, twice around its axis while three times around its tube. One direction across
//! the curve is the torus's normal, and the other lies in the torus's surface. Both are known without a
//! derivative. Both return to their start after the whole way, so the rings of the tube close without a
//! twist.

use texmap::Texture;

use super::motion::{self, DEGREE, units};
use super::surfaces::{self, SIDE, shade};
use crate::colour::BACKGROUND;
use crate::colour::Ramp::{Azure, Gold, Indigo, Pearl, Rose, Teal, Violet};
use crate::entry::{Colours, Cover, Entry, MAX_TEXELS};
use crate::noise::fractal;
use crate::trig::{cos, mul, sin};
use crate::{Corner, Mesh, MeshFace, Pose, Vec3};

/// Rings along the curve, and corners of each.
const RINGS: usize = 60;
const SIDES: usize = 8;
/// Rings to one repetition of the texture: about as far as around the tube.
const REPEAT: usize = 6;
const VERTICES: usize = RINGS * SIDES;
const FACES: usize = 2 * VERTICES;

/// In hundredths of a unit: from the torus's axis to the centre of its tube, from there to the curve, and the
/// radius of the knot's tube.
const REACH: i64 = 64;
const WINDING: i64 = 29;
const TUBE: i64 = 17;

struct Solid {
    vertices: [Vec3; VERTICES],
    corners: [Corner; 3 * FACES],
    faces: [MeshFace; FACES],
}

/// The compiler builds the solid.
static SOLID: Solid = build();

/// The knot.
pub const KNOT: Entry<'static> = Entry {
    name: "knot",
    about: "a tube tied in a trefoil knot: parts of it hide others",
    mesh: MESH,
    colours: Colours::BUILT_IN,
    background: &BACKGROUND,
    cover: Cover::Painted(|texels| paint(texels).into()),
    mipmaps: false,
    pose: |tick| Pose {
        yaw: motion::turn(tick).wrapping_mul(2).wrapping_neg(),
        pitch: (70 * DEGREE).wrapping_add(motion::turn(tick)),
        roll: 20 * DEGREE,
        distance: units(31, 10),
    },
    tile: 0,
};

/// The knot's mesh.
const MESH: Mesh<'static> = Mesh {
    vertices: &SOLID.vertices,
    corners: &SOLID.corners,
    faces: &SOLID.faces,
    convex: false,
};

/// Returns a point on the tube: the centre of its ring and the direction outward, 30 fraction bits. `along`
/// is a fraction of the whole curve, and `around` of a whole turn.
const fn place(along: u32, around: u32) -> ([i64; 3], [i64; 3]) {
    let (phi, psi) = (along.wrapping_mul(2), along.wrapping_mul(3));
    let (cos_phi, sin_phi) = (cos(phi), sin(phi));
    let (cos_psi, sin_psi) = (cos(psi), sin(psi));
    // The distance from the torus's axis, and the torus's normal: one direction across the curve.
    let reach = (REACH << 30) / 100 + WINDING * cos_psi / 100;
    let middle = [
        mul(reach, cos_phi),
        WINDING * sin_psi / 100,
        mul(reach, sin_phi),
    ];
    let normal = [mul(cos_psi, cos_phi), sin_psi, mul(cos_psi, sin_phi)];
    // The curve goes 2 reach along the axis's turn and 3 WINDING along the tube's.
    let (turn, wind) = (2 * reach, 3 * (WINDING << 30) / 100);
    // About 2^31 (2^31.1 at most); its square is below 2^63.
    let length = ((turn * turn + wind * wind) as u64).isqrt() as i64;
    let (turn, wind) = (
        ((turn as i128) << 30) / length as i128,
        ((wind as i128) << 30) / length as i128,
    );
    let (turn, wind) = (turn as i64, wind as i64);
    // Across both: `turn` of the tube's direction, minus `wind` of the axis's.
    let across = [
        mul(turn, -mul(sin_psi, cos_phi)) + mul(wind, sin_phi),
        mul(turn, cos_psi),
        mul(turn, -mul(sin_psi, sin_phi)) - mul(wind, cos_phi),
    ];
    let (c, s) = (cos(around), sin(around));
    let mut out = [0; 3];
    let mut k = 0;
    while k < 3 {
        out[k] = mul(c, normal[k]) + mul(s, across[k]);
        k += 1;
    }
    (middle, out)
}

/// Returns `i / n` of a turn.
const fn turn(i: usize, n: usize) -> u32 {
    (((i as u64) << 32) / n as u64) as u32
}

/// Rounds 30 fraction bits to `bits`.
const fn round(v: [i64; 3], bits: u32) -> Vec3 {
    let half = 1 << (29 - bits);
    [
        ((v[0] + half) >> (30 - bits)) as i32,
        ((v[1] + half) >> (30 - bits)) as i32,
        ((v[2] + half) >> (30 - bits)) as i32,
    ]
}

/// Returns the corner of ring `ring` and side `side`, with its texture coordinates counted from ring `from`.
const fn corner(ring: usize, side: usize, from: usize) -> Corner {
    Corner {
        vertex: (ring % RINGS * SIDES + side % SIDES) as u16,
        u: ((((ring - from) * SIDE) << 16) / REPEAT) as i32,
        v: (((side * SIDE) << 16) / SIDES) as i32,
    }
}

const fn build() -> Solid {
    let empty = MeshFace {
        first: 0,
        corners: 3,
        texture: 0,
        normal: [0; 3],
    };
    let mut solid = Solid {
        vertices: [[0; 3]; VERTICES],
        corners: [corner(0, 0, 0); 3 * FACES],
        faces: [empty; FACES],
    };
    let mut face = 0;
    let mut ring = 0;
    while ring < RINGS {
        let from = ring / REPEAT * REPEAT;
        let mut side = 0;
        while side < SIDES {
            let (mut point, out) = place(turn(ring, RINGS), turn(side, SIDES));
            let mut k = 0;
            while k < 3 {
                point[k] += TUBE * out[k] / 100;
                k += 1;
            }
            solid.vertices[ring * SIDES + side] = round(point, 16);
            // Both halves of a facet have the tube's normal at the facet's centre.
            let (_, out) = place(turn(2 * ring + 1, 2 * RINGS), turn(2 * side + 1, 2 * SIDES));
            let normal = round(out, 14);
            let corners = [
                corner(ring, side, from),
                corner(ring + 1, side, from),
                corner(ring + 1, side + 1, from),
                corner(ring, side + 1, from),
            ];
            let mut half = 0;
            while half < 2 {
                solid.corners[3 * face] = corners[0];
                solid.corners[3 * face + 1] = corners[1 + half];
                solid.corners[3 * face + 2] = corners[2 + half];
                solid.faces[face] = MeshFace {
                    first: 3 * face as u16,
                    normal,
                    ..empty
                };
                face += 1;
                half += 1;
            }
            side += 1;
        }
        ring += 1;
    }
    assert!(face == FACES);
    solid
}

/// Paints the tube's texture, whose opposite borders match.
fn paint(texels: &mut [u8; MAX_TEXELS]) -> Texture<'_> {
    surfaces::paint(texels, ribbon)
}

/// Returns the colour of a texel of a gold band around enamel, wound once about the tube, with pearls between
/// two wires.
fn ribbon(i: i64, j: i64) -> u8 {
    const AROUND: i64 = SIDE as i64;
    // Across the band, 0 to 255: it is wound once for each repetition.
    let across = (i + j).rem_euclid(AROUND);
    let from_band = (across - 128).abs();
    let bevel = |middle: i64, wide: i64| 17 - (middle.abs() * 9 / wide) + (middle < 0) as i64 * 3;
    match from_band {
        0..18 => {
            // Along the band, a pearl every 32 texels; the band runs along i - j.
            let along = (i - j).rem_euclid(32) - 16;
            let (x, y) = (along * 7 / 10, (across - 128) * 7 / 10);
            let radius = x * x + y * y;
            if radius < 64 {
                let light = (x + 3).pow(2) + (y + 3).pow(2);
                shade(Pearl, 22 - light / 8)
            } else if radius < 90 {
                Indigo.shade(2)
            } else {
                shade(Rose, 9 + (from_band / 4) % 2)
            }
        }
        18..30 => shade(Gold, bevel(from_band - 24, 6)),
        30..32 => Indigo.shade(2),
        _ => {
            // Enamel without a seam: noise on a separate torus.
            let angle = |k: i64| (k as u32).wrapping_mul(1 << 24);
            let reach = (5i64 << 30) / 2 + cos(angle(j));
            let on_torus = [
                mul(reach, cos(angle(i))),
                sin(angle(j)),
                mul(reach, sin(angle(i))),
            ];
            let cloud = fractal(on_torus.map(|k| (k * 3) >> 15), 4, 91);
            let hue = fractal(on_torus.map(|k| (k * 3) >> 16), 2, 33);
            let ramp = match (hue * 4) >> 16 {
                ..1 => Violet,
                1 => Indigo,
                2 => Azure,
                _ => Teal,
            };
            let edge = (from_band - 32).min(10) - 10;
            // A line of gold where the wires of the next winding would be.
            match 128 - from_band {
                ..3 => shade(Gold, 20 - (128 - from_band) * 4),
                3..5 => Indigo.shade(2),
                _ => shade(ramp, 5 + edge / 4 + ((cloud * 14) >> 16)),
            }
        }
    }
}
