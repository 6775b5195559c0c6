//! The ball: a globe of flat facets with one texture over all of them.

use modex::HEIGHT;
use texmap::Texture;

use crate::colour::{BACKGROUND, LIGHT_TABLE, PALETTE};
use crate::entry::{Colours, Cover, Entry, MAX_TEXELS};
use crate::trig::{cos, mul, sin};
use crate::{Corner, Mesh, MeshFace, Pose, Scene, Vec3, paint};

/// Facets around: 15 degrees each, so that gold meridians lie along edges and do not kink.
const SEGMENTS: usize = 24;
/// Rings of facets from pole to pole: an odd number, so that the belt lies in the middle of a ring.
const RINGS: usize = 15;
const VERTICES: usize = (RINGS - 1) * SEGMENTS + 2;
const FACES: usize = SEGMENTS * (2 + (RINGS - 2) * 2);
const CORNERS: usize = 3 * FACES;

/// Texels across the texture: once around the ball.
pub const TEXTURE_WIDTH: u16 = paint::COLUMNS as u16;
/// Texels down the texture: from pole to pole.
pub const TEXTURE_HEIGHT: u16 = paint::ROWS as u16;
/// Texels in the texture.
pub const TEXELS: usize = TEXTURE_WIDTH as usize * TEXTURE_HEIGHT as usize;

struct Solid {
    vertices: [Vec3; VERTICES],
    corners: [Corner; CORNERS],
    faces: [MeshFace; FACES],
}

/// The compiler builds the solid: the boot image contains it, and nothing is computed at start-up.
static SOLID: Solid = build();

/// The ball.
pub const BALL: Entry<'static> = Entry {
    name: "ball",
    about: "the globe of flat facets: many small polygons, short spans",
    mesh: MESH,
    colours: Colours::BUILT_IN,
    background: &BACKGROUND,
    cover: Cover::Painted(|texels| {
        let (texels, _) = texels.split_at_mut(TEXELS);
        paint_ball(texels.try_into().expect("it was cut to TEXELS")).into()
    }),
    mipmaps: false,
    pose: Pose::at_tick,
    tile: 0,
};
const _: () = assert!(TEXELS <= MAX_TEXELS);

/// The ball's mesh.
const MESH: Mesh<'static> = Mesh {
    vertices: &SOLID.vertices,
    corners: &SOLID.corners,
    faces: &SOLID.faces,
    convex: true,
};

/// Paints the ball's texture, in full light.
pub fn paint_ball(texels: &mut [u8; TEXELS]) -> Texture<'_> {
    for (j, row) in texels
        .chunks_exact_mut(usize::from(TEXTURE_WIDTH))
        .enumerate()
    {
        for (i, texel) in row.iter_mut().enumerate() {
            // The centre of the texel: a whole turn across, half a turn down.
            let longitude = (((2 * i as u64 + 1) << 31) / u64::from(TEXTURE_WIDTH)) as u32;
            let polar = (((2 * j as u64 + 1) << 30) / u64::from(TEXTURE_HEIGHT)) as u32;
            *texel = paint::texel(longitude, polar, on_sphere(longitude, polar));
        }
    }
    Texture::new(texels, TEXTURE_WIDTH, TEXTURE_HEIGHT).expect("there are TEXELS texels")
}

/// Returns the ball in front of its background. `textures` are those that [`paint_ball`] painted.
pub fn ball<'t>(textures: &'t [Texture<'t>]) -> Scene<'static, 't> {
    const _: () = assert!(BACKGROUND.len() == HEIGHT);
    Scene {
        name: "ball",
        mesh: MESH,
        textures,
        palette: &PALETTE,
        light: &LIGHT_TABLE,
        background: &BACKGROUND,
        mipmaps: false,
    }
}

/// Returns the unit vector at a longitude (0 faces the viewer, growing to the right) and a polar angle (0 is
/// the top, half a turn the bottom), 30 fraction bits.
const fn on_sphere(longitude: u32, polar: u32) -> [i64; 3] {
    let ring = sin(polar);
    [
        mul(ring, sin(longitude)),
        -cos(polar),
        -mul(ring, cos(longitude)),
    ]
}

/// Rounds 30 fraction bits to `bits`.
const fn round(v: [i64; 3], bits: u32) -> Vec3 {
    let shift = 30 - bits;
    let half = 1 << (shift - 1);
    [
        ((v[0] + half) >> shift) as i32,
        ((v[1] + half) >> shift) as i32,
        ((v[2] + half) >> shift) as i32,
    ]
}

const fn longitude(segment: usize) -> u32 {
    ((segment as u64 * (1 << 32)) / SEGMENTS as u64) as u32
}

const fn polar(ring: usize) -> u32 {
    ((ring as u64 * (1 << 31)) / RINGS as u64) as u32
}

/// Returns the corner at ring line `ring` (0 and RINGS are the poles) and meridian `segment`. Its texture
/// coordinate u is `half` half segments: a pole uses the middle of its facet.
const fn corner(ring: usize, segment: usize, half: usize) -> Corner {
    let vertex = if ring == 0 {
        0
    } else if ring == RINGS {
        VERTICES - 1
    } else {
        1 + (ring - 1) * SEGMENTS + segment % SEGMENTS
    };
    Corner {
        vertex: vertex as u16,
        u: (((half * TEXTURE_WIDTH as usize) << 16) / (2 * SEGMENTS)) as i32,
        v: (((ring * TEXTURE_HEIGHT as usize) << 16) / RINGS) as i32,
    }
}

const fn build() -> Solid {
    let mut vertices = [[0; 3]; VERTICES];
    let mut ring = 1;
    vertices[0] = round(on_sphere(0, 0), 16);
    vertices[VERTICES - 1] = round(on_sphere(0, 1 << 31), 16);
    while ring < RINGS {
        let mut segment = 0;
        while segment < SEGMENTS {
            let point = on_sphere(longitude(segment), polar(ring));
            vertices[1 + (ring - 1) * SEGMENTS + segment] = round(point, 16);
            segment += 1;
        }
        ring += 1;
    }

    let mut corners = [corner(0, 0, 0); CORNERS];
    let empty = MeshFace {
        first: 0,
        corners: 3,
        texture: 0,
        normal: [0; 3],
    };
    let mut faces = [empty; FACES];
    let mut face = 0;
    let mut ring = 0;
    while ring < RINGS {
        let mut segment = 0;
        while segment < SEGMENTS {
            // The sphere's normal at the facet's centre: both triangles have it, so the cut between them does
            // not show in the light.
            let middle = (
                longitude(segment) / 2 + longitude_end(segment) / 2,
                polar(ring) / 2 + polar(ring + 1) / 2,
            );
            let normal = round(on_sphere(middle.0, middle.1), 14);
            let (left, centre, right) = (2 * segment, 2 * segment + 1, 2 * segment + 2);
            let (a, b, c, d) = (
                corner(ring, segment, if ring == 0 { centre } else { left }),
                corner(ring, segment + 1, right),
                corner(ring + 1, segment + 1, right),
                corner(
                    ring + 1,
                    segment,
                    if ring + 1 == RINGS { centre } else { left },
                ),
            );
            // The texture coordinates of a trapezoid with a rectangle of the texture do not fit one plane, so
            // it is cut into triangles. At a pole one of the two is empty.
            let triangles = if ring == 0 {
                [Some([a, c, d]), None]
            } else if ring + 1 == RINGS {
                [Some([a, b, d]), None]
            } else {
                [Some([a, b, c]), Some([a, c, d])]
            };
            let mut i = 0;
            while i < 2 {
                if let Some(triangle) = triangles[i] {
                    corners[3 * face] = triangle[0];
                    corners[3 * face + 1] = triangle[1];
                    corners[3 * face + 2] = triangle[2];
                    faces[face] = MeshFace {
                        first: 3 * face as u16,
                        corners: 3,
                        texture: 0,
                        normal,
                    };
                    face += 1;
                }
                i += 1;
            }
            segment += 1;
        }
        ring += 1;
    }
    assert!(face == FACES);
    Solid {
        vertices,
        corners,
        faces,
    }
}

/// Returns the meridian on the right of a segment. The last segment ends at a whole turn, which does not fit
/// 32 bits, so its meridian is one unit short.
const fn longitude_end(segment: usize) -> u32 {
    if segment + 1 == SEGMENTS {
        u32::MAX
    } else {
        longitude(segment + 1)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::collections::HashMap;
    use std::vec::Vec;

    #[test]
    fn the_ball_is_closed_and_looks_outward() {
        let mut edges = HashMap::new();
        for face in &SOLID.faces {
            let corners = &SOLID.corners[usize::from(face.first)..][..3];
            for (i, a) in corners.iter().enumerate() {
                let b = &corners[(i + 1) % 3];
                *edges.entry((a.vertex, b.vertex)).or_insert(0) += 1;
            }
            let [a, b, c] =
                [0, 1, 2].map(|i| SOLID.vertices[usize::from(corners[i].vertex)].map(i64::from));
            let (p, q) = (
                [0, 1, 2].map(|k| b[k] - a[k]),
                [0, 1, 2].map(|k| c[k] - a[k]),
            );
            let cross = [
                p[1] * q[2] - p[2] * q[1],
                p[2] * q[0] - p[0] * q[2],
                p[0] * q[1] - p[1] * q[0],
            ];
            let outward: i64 = (0..3)
                .map(|k| (cross[k] >> 8) * i64::from(face.normal[k]))
                .sum();
            // Clockwise with y down and z away: the cross product points into the solid.
            assert!(outward < 0, "{face:?} looks inward");
        }
        for (&(a, b), &count) in &edges {
            assert_eq!(count, 1, "edge {a}-{b} is walked twice");
            assert!(edges.contains_key(&(b, a)), "edge {a}-{b} has no neighbour");
        }
        assert_eq!(edges.len(), CORNERS);
    }

    #[test]
    fn neighbours_share_places_in_the_texture() {
        let mut places: HashMap<u16, Vec<(i32, i32)>> = HashMap::new();
        for corner in &SOLID.corners {
            places
                .entry(corner.vertex)
                .or_default()
                .push((corner.u, corner.v));
        }
        for (vertex, places) in places {
            let pole = vertex == 0 || usize::from(vertex) == VERTICES - 1;
            for &(u, v) in &places {
                assert_eq!(v, places[0].1);
                // The texture closes on itself: u = 0 and u = width are the same meridian.
                let width = i32::from(TEXTURE_WIDTH) << 16;
                assert!(pole || u % width == places[0].0 % width, "vertex {vertex}");
            }
        }
    }
}
