//! The two clips that make vertices: the near plane, and a guard band far outside the screen.
//!
//! # Where
//!
//! Both cut in view space, before anything is rounded to the screen's grid: first the near plane, then the
//! guard band's left, right, top and bottom. Once nothing is nearer than [`NEAR`], x / z <= k is equivalent
//! to x <= k z: the guard planes are planes through the eye. A point exactly on a plane is inside. The
//! screen's own border is not one of the planes: it cuts columns and makes no vertices.
//!
//! # Why neighbours agree
//!
//! Two faces with a common edge must still have it in common after clipping, bit for bit, or pixels along it
//! are left out or written twice.
//!
//! - A crossing is computed from the edge's two end points, unmodified, *from the end inside to the end
//!   outside*, in whichever direction the face follows the edge. It is the exact point, rounded once.
//! - Each plane replaces the remaining piece of an edge by the part inside that plane. That depends on the
//!   edge's two end points only. By induction both faces keep the same piece after each plane, also where
//!   several planes cut one edge.
//! - As soon as one of a face's corners is outside any plane, all planes cut the face, in one fixed order. A
//!   crossing is rounded, and may lie outside a plane by the rounding error although no corner was outside of
//!   that plane. If a face skipped that plane, it would disagree with a face that did not. A face that is not
//!   clipped at all has no such edge: both ends of each edge are inside all planes.
//! - Texture coordinates take no part in these decisions, so a seam of the texture is no seam of the solid.
//!
//! # The arithmetic
//!
//! A corner has `FINE` more fraction bits than a vertex of the mesh: below 2^52 in size. Its height above a
//! plane is exact and below 2^68; a crossing's product stays below 2^122. A crossing is rounded to 2^-44 unit
//! (half up). On the screen that error is largest where z is least and x / z most: (258 x 256 / NEAR) (1 +
//! 128) 2^-29, less than 1/8000 of 1/256 pixel. The guard band ends on a whole number of 1/256 pixels, so
//! five such errors cannot round a vertex out of it.
//!
//! # How many corners
//!
//! A plane adds at most one corner to a convex polygon: [`MAX_CORNERS`](crate::MAX_CORNERS) of a face and a new
//! corner at each of the five planes make [`MAX_SIDES`]. (Turning rounds vertices, so a face of four or more
//! corners that is seen exactly edge-on may be bent by 2^-16 unit. Only a face of nearly `MAX_CORNERS` corners,
//! bent many times over, could get too many corners. It would be dropped and counted.)

use modex::{HEIGHT, WIDTH};
use texmap::{MAX_COORDINATE, MAX_SIDES, SUBPIXELS, Vertex};

use crate::camera::{FOCAL_LENGTH, NEAR, project, project_fine};
use crate::mesh::CLIP_PLANES;
use crate::{Corner, Vec3};

/// Fraction bits of a corner beyond the 16 of a vertex.
const FINE: u32 = 28;

/// The end of the guard band: pixels from the screen's origin, in either direction.
const GUARD: i64 = (MAX_COORDINATE / SUBPIXELS) as i64;

/// A half-space: the points whose product with `form` is at least `least`.
struct ClipPlane {
    form: [i64; 3],
    least: i64,
}

/// The clip planes, in the order in which they cut.
static CLIPS: [ClipPlane; CLIP_PLANES] = {
    const fn guard(form: [i64; 3]) -> ClipPlane {
        ClipPlane { form, least: 0 }
    }
    let focal = FOCAL_LENGTH as i64;
    let (x, y) = (WIDTH as i64 / 2, HEIGHT as i64 / 2);
    [
        ClipPlane {
            form: [0, 0, 1],
            least: NEAR as i64,
        },
        // focal x / z + centre >= -GUARD, and <= GUARD.
        guard([focal, 0, GUARD + x]),
        guard([-focal, 0, GUARD - x]),
        guard([0, focal, GUARD + y]),
        guard([0, -focal, GUARD - y]),
    ]
};

/// A vertex of the mesh in view space, shared by all faces that meet in it.
#[derive(Clone, Copy, Debug)]
pub struct ViewPoint {
    /// In view space, 16.16.
    view: Vec3,
    /// On the screen in 1/256 pixel, if the vertex is inside all planes.
    screen: (i32, i32),
    /// Bit i is set if the vertex is outside plane i.
    outside: u8,
}

impl ViewPoint {
    /// The initial value of an arena's points.
    pub const ORIGIN: Self = Self {
        view: [0; 3],
        screen: (0, 0),
        outside: 0,
    };

    /// Returns a vertex at `view`: |x| and |y| are below 2^23 (128 units), |z| below 2^24.
    pub fn new(view: Vec3) -> Self {
        let mut outside = 0;
        let wide = view.map(i64::from);
        for (i, plane) in CLIPS.iter().enumerate() {
            // Below 2^9 2^23 + 2^15.1 2^24 < 2^40.
            let height: i64 = (0..3).map(|k| plane.form[k] * wide[k]).sum();
            outside |= u8::from(height < plane.least) << i;
        }
        let screen = if outside == 0 { project(view) } else { (0, 0) };
        Self {
            view,
            screen,
            outside,
        }
    }
}

impl ViewPoint {
    /// Returns the position in view space, 16.16.
    pub fn view(&self) -> Vec3 {
        self.view
    }
}

/// A corner during clipping.
#[derive(Clone, Copy, Default)]
struct ClipCorner {
    /// In view space, 16 + FINE fraction bits.
    at: [i64; 3],
    u: i32,
    v: i32,
}

/// The part of a face that the planes have left.
struct Outline {
    corners: [ClipCorner; MAX_SIDES],
    len: usize,
}

impl Outline {
    fn new() -> Self {
        Self {
            corners: [ClipCorner::default(); MAX_SIDES],
            len: 0,
        }
    }

    /// Adds a corner, or returns `None` if the outline is full.
    fn push(&mut self, corner: ClipCorner) -> Option<()> {
        *self.corners.get_mut(self.len)? = corner;
        self.len += 1;
        Some(())
    }

    /// Returns the part inside `plane`, or `None` if it has more than [`MAX_SIDES`] corners.
    fn cut(&self, plane: &ClipPlane) -> Option<Self> {
        let mut kept = Self::new();
        let corners = &self.corners[..self.len];
        for (i, a) in corners.iter().enumerate() {
            let b = &corners[(i + 1) % corners.len()];
            let (height_a, height_b) = (plane.height(a), plane.height(b));
            if height_a >= 0 {
                kept.push(*a)?;
            }
            // An edge that only ends on the plane does not cross it.
            if height_a > 0 && height_b < 0 {
                kept.push(crossing(a, b, height_a, height_b))?;
            } else if height_a < 0 && height_b > 0 {
                kept.push(crossing(b, a, height_b, height_a))?;
            }
        }
        Some(kept)
    }
}

impl ClipPlane {
    /// Returns the distance of `corner` inside the plane, in the units of the plane's form.
    fn height(&self, corner: &ClipCorner) -> i128 {
        let product: i128 = (0..3)
            .map(|k| i128::from(self.form[k]) * i128::from(corner.at[k]))
            .sum();
        product - (i128::from(self.least) << FINE)
    }
}

/// Returns the point where the edge from the end inside to the end outside meets the plane. `above` (more
/// than 0) and `below` (less than 0) are the heights of the two ends. The point and its texture coordinates
/// lie between the two ends, so nothing needs clamping.
fn crossing(inside: &ClipCorner, outside: &ClipCorner, above: i128, below: i128) -> ClipCorner {
    let whole = above - below;
    let between = |from: i64, to: i64| {
        let part = (i128::from(to) - i128::from(from)) * above;
        from + (2 * part + whole).div_euclid(2 * whole) as i64
    };
    ClipCorner {
        at: [0, 1, 2].map(|k| between(inside.at[k], outside.at[k])),
        u: between(inside.u.into(), outside.u.into()) as i32,
        v: between(inside.v.into(), outside.v.into()) as i32,
    }
}

/// Projects a face to the screen, clipped if necessary, and returns how many vertices of `polygon` it uses:
/// fewer than 3 if nothing is visible. Returns `None` if the face needs more than [`MAX_SIDES`] vertices.
pub fn place(
    corners: &[Corner],
    points: &[ViewPoint],
    polygon: &mut [Vertex; MAX_SIDES],
) -> Option<usize> {
    let point = |corner: &Corner| &points[usize::from(corner.vertex)];
    let (mut any, mut all) = (0, u8::MAX);
    for corner in corners {
        any |= point(corner).outside;
        all &= point(corner).outside;
    }
    if all != 0 {
        return Some(0);
    }
    if any == 0 {
        for (vertex, corner) in polygon.get_mut(..corners.len())?.iter_mut().zip(corners) {
            let (x, y) = point(corner).screen;
            *vertex = Vertex {
                x,
                y,
                u: corner.u,
                v: corner.v,
            };
        }
        return Some(corners.len());
    }
    clip(corners, points, polygon)
}

/// Clips and projects a face as [`place`] does. Cold path: clipping is rare, so it stays out of the common
/// path.
#[cold]
fn clip(
    corners: &[Corner],
    points: &[ViewPoint],
    polygon: &mut [Vertex; MAX_SIDES],
) -> Option<usize> {
    let mut outline = Outline::new();
    for corner in corners {
        let view = points[usize::from(corner.vertex)].view;
        outline.push(ClipCorner {
            at: view.map(|k| i64::from(k) << FINE),
            u: corner.u,
            v: corner.v,
        })?;
    }
    for plane in &CLIPS {
        outline = outline.cut(plane)?;
    }
    let placed = &outline.corners[..outline.len];
    for (vertex, corner) in polygon.iter_mut().zip(placed) {
        let (x, y) = project_fine(corner.at);
        *vertex = Vertex {
            x,
            y,
            u: corner.u,
            v: corner.v,
        };
    }
    Some(placed.len())
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::MAX_CORNERS;
    use std::vec;
    use std::vec::Vec;
    use texmap::mappers::affine::Sides;
    use texmap::{Texture, scan};

    const SIDE: i32 = 256 << 16;

    /// Places a face with these points as corners. The texture coordinates are spread over the whole texture,
    /// and equal points get equal coordinates.
    fn placed(views: &[Vec3]) -> Vec<Vertex> {
        let points: Vec<_> = views.iter().map(|&view| ViewPoint::new(view)).collect();
        let corners: Vec<_> = (0..)
            .zip(views)
            .map(|(vertex, view)| Corner {
                vertex,
                u: view[0].wrapping_mul(40_503) & (SIDE - 1),
                v: SIDE - (view[1].wrapping_mul(30_011) & (SIDE - 1)),
            })
            .collect();
        let mut polygon = [Vertex::default(); MAX_SIDES];
        let sides = place(&corners, &points, &mut polygon).expect("too many corners");
        polygon[..sides].to_vec()
    }

    fn drawn(polygon: &[Vertex]) -> Vec<bool> {
        let texels = vec![0; 1 << 16];
        let texture = Texture::new(&texels, 256, 256).unwrap();
        let mut pixels = vec![false; WIDTH * HEIGHT];
        let legal = Sides::new(polygon, &texture, texmap::Axis::Down).and_then(|_| {
            scan::columns(polygon, |span| {
                for y in span.first..span.first + span.len {
                    pixels[usize::from(y) * WIDTH + usize::from(span.line)] ^= true;
                }
            })
        });
        legal.unwrap_or_else(|dropped| panic!("{dropped:?}: {polygon:?}"));
        pixels
    }

    /// Returns a random coordinate; every magnitude from 1 to the largest is equally likely.
    fn coordinate(random: &mut fastrand::Rng, bits: u32) -> i32 {
        let size = 1 << random.u32(0..=bits);
        random.i32(-size + 1..size)
    }

    /// Returns a random point before, behind or beside the eye, often exactly on a clip plane.
    fn view(random: &mut fastrand::Rng) -> Vec3 {
        let mut view = [23, 23, 24].map(|bits| coordinate(random, bits));
        match random.u8(0..8) {
            0 => view[2] = NEAR,
            1 => {
                let k = random.i32(1..=250);
                let [left, right, top, bottom] = [-32_927, 32_607, -32_887, 32_647].map(|n| n * k);
                view[2] = 258 * k;
                match random.u8(0..6) {
                    0 => view[0] = left,
                    1 => view[0] = right,
                    2 => view[1] = top,
                    3 => view[1] = bottom,
                    4 => (view[0], view[1]) = (left, top),
                    _ => (view[0], view[1]) = (right, bottom),
                }
            }
            2 => view[2] = NEAR + coordinate(random, 7),
            // On the screen, or near it.
            3 | 4 => {
                view[2] = random.i32(NEAR..1 << 20);
                view[0] = random.i32(-view[2]..=view[2]);
                view[1] = random.i32(-view[2]..=view[2]);
            }
            _ => {}
        }
        view
    }

    #[test]
    fn each_plane_begins_exactly_where_it_says() {
        // A point on the plane, the step outward, and the point's place on the screen.
        let most = MAX_COORDINATE;
        for (plane, at, beyond, on_screen) in [
            (0, [0, 0, NEAR], [0, 0, -1], (160 * 256, 120 * 256)),
            (1, [-32_927, 0, 258], [-1, 0, 0], (-most, 120 * 256)),
            (2, [32_607, 0, 258], [1, 0, 0], (most, 120 * 256)),
            (3, [0, -32_887, 258], [0, -1, 0], (160 * 256, -most)),
            (4, [0, 32_647, 258], [0, 1, 0], (160 * 256, most)),
            (1, [-32_927, -32_887, 258], [-1, 0, 0], (-most, -most)),
            (4, [32_607, 32_647, 258], [0, 1, 0], (most, most)),
        ] {
            let step = |sign: i32| [0, 1, 2].map(|k| at[k] + sign * beyond[k]);
            assert_eq!(ViewPoint::new(at).outside, 0, "{at:?}");
            assert_eq!(ViewPoint::new(at).screen, on_screen, "{at:?}");
            assert_eq!(ViewPoint::new(step(-1)).outside, 0, "{at:?}");
            assert_eq!(ViewPoint::new(step(1)).outside, 1 << plane, "{at:?}");
            // A triangle keeps a corner on or inside the plane; a corner outside is replaced by two. Each
            // result is legal.
            let others = [[900, 900, 2000], [-1200, 300, 2000]];
            let sides = |view| {
                let polygon = placed(&[view, others[0], others[1]]);
                drawn(&polygon);
                polygon.len()
            };
            assert_eq!([sides(at), sides(step(-1)), sides(step(1))], [3, 3, 4]);
        }
        // A face that lies in the plane is inside; a face beyond the plane vanishes.
        let near = |z| placed(&[[-9, -9, z], [9, -9, z], [9, 9, z], [-9, 9, z]]);
        assert_eq!(near(NEAR).len(), 4);
        assert_eq!(near(NEAR - 1), []);
        // A face with one corner or edge on the plane and the rest beyond encloses no pixel.
        let touching = placed(&[[0, 0, NEAR], [99, 0, 0], [0, 99, 0]]);
        assert!(touching.len() < 3, "{touching:?}");
        let touching = placed(&[[0, 0, NEAR], [99, 0, NEAR], [0, 99, 0]]);
        assert!(touching.len() < 3, "{touching:?}");
    }

    #[test]
    fn a_crossing_is_the_exact_point_rounded_with_ties_up() {
        let end = |at, u, v| ClipCorner { at, u, v };
        let (inside, outside) = (end([0, 3, 8], 0, SIDE), end([3, 0, 8], SIDE, SIDE - 3));
        // Fractions of the way: a half, a third, two thirds.
        for (above, below, at, u, v) in [
            (1, -1, [2, 2, 8], SIDE / 2, SIDE - 1),
            (1 << 67, -(1 << 67), [2, 2, 8], SIDE / 2, SIDE - 1),
            (1, -2, [1, 2, 8], SIDE / 3, SIDE - 1),
            (2, -1, [2, 1, 8], SIDE / 3 * 2 + 1, SIDE - 2),
        ] {
            let crossing = crossing(&inside, &outside, above, below);
            assert_eq!((crossing.at, crossing.u, crossing.v), (at, u, v));
        }
        // The largest values that the products have room for.
        let (far, least, most) = ((1 << 51) - 1, -(1i64 << 51), (1 << 52) - 1);
        let (inside, outside) = (end([far, least, most], 0, 0), end([-far, far, least], 0, 0));
        let height = (1i128 << 68) - 1;
        let middle = crossing(&inside, &outside, height, -height);
        assert_eq!(middle.at, [0, 0, 1 << 50]);
    }

    /// Clips the edge alone, as a face of two corners. Every face with that edge, followed in either
    /// direction, must contain the remaining piece bit for bit, texture coordinates included.
    #[test]
    fn every_face_of_an_edge_is_left_with_the_same_piece_of_it() {
        let mut random = seeded::generator();
        let (mut clipped, mut twice) = (0, 0);
        for _ in 0..seeded::cases(200_000) {
            let [a, b, c, d] = [0; 4].map(|_| view(&mut random));
            let edge = placed(&[a, b]);
            for face in [&[a, b, c][..], &[b, a, d], &[c, b, a, d]] {
                let face_placed = placed(face);
                for vertex in &edge {
                    assert!(
                        face_placed.contains(vertex),
                        "{face:?} has no {vertex:?} of {edge:?}"
                    );
                }
            }
            let [a, b] = [a, b].map(|view| ViewPoint::new(view).outside);
            clipped += u32::from(!edge.is_empty() && a | b != 0);
            twice += u32::from(!edge.is_empty() && a != 0 && b != 0);
        }
        assert!(
            !seeded::is_whole() || clipped > 20_000 && twice > 1000,
            "{clipped}, {twice}"
        );
    }

    #[test]
    fn what_is_left_is_legal_wherever_the_corners_were() {
        let mut random = seeded::generator();
        let mut most = 0;
        for _ in 0..seeded::cases(100_000) {
            // A convex face: a ring about a centre, in a random plane.
            let corners = random.usize(3..=MAX_CORNERS);
            let [middle, p, q] = [0; 3].map(|_| view(&mut random).map(|k| k / 3));
            let face: Vec<Vec3> = (0..corners)
                .map(|i| {
                    let angle = ((i as u64) << 32) / corners as u64;
                    let (s, c) = (
                        crate::trig::sin(angle as u32),
                        crate::trig::cos(angle as u32),
                    );
                    [0, 1, 2].map(|k| {
                        let turned = i64::from(p[k]) * c + i64::from(q[k]) * s;
                        middle[k] + (turned >> 30) as i32
                    })
                })
                .collect();
            let polygon = placed(&face);
            most = most.max(polygon.len());
            for vertex in &polygon {
                for k in [vertex.x, vertex.y] {
                    assert!(k.abs() <= MAX_COORDINATE, "{face:?}: {polygon:?}");
                }
                for k in [vertex.u, vertex.v] {
                    assert!((0..=SIDE).contains(&k), "{face:?}: {polygon:?}");
                }
            }
        }
        assert!(!seeded::is_whole() || most > MAX_CORNERS, "{most}");
    }

    /// Compares with lines of sight and the unrounded triangle: only a pixel within 1/128 pixel of a true
    /// edge may be on the other side. The near plane's cut counts as such an edge; the guard band makes no
    /// edge on the screen.
    #[test]
    fn clipped_triangles_cover_what_the_lines_of_sight_meet() {
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [
                a[1] * b[2] - a[2] * b[1],
                a[2] * b[0] - a[0] * b[2],
                a[0] * b[1] - a[1] * b[0],
            ]
        };
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let mut random = seeded::generator();
        let (mut seen, mut hidden, mut by_near) = (0, 0, 0);
        for _ in 0..seeded::cases(700) {
            let views = [0; 3].map(|_| view(&mut random));
            if views.iter().all(|&view| ViewPoint::new(view).outside == 0) {
                continue;
            }
            let [a, b, c] = views.map(|view| view.map(f64::from));
            let volume = dot(a, cross(b, c));
            let front = volume.signum();
            // Each form is more than 0 inside: form . (x, y, 1) + constant.
            let normals = [cross(a, b), cross(b, c), cross(c, a)];
            let mut forms = normals.map(|n| (n.map(|k| k * front), 0.0)).to_vec();
            let sum = [0, 1, 2].map(|k| normals.iter().map(|n| n[k]).sum::<f64>());
            let near = sum.map(|k| -k * front * f64::from(NEAR));
            forms.push((near, volume.abs()));
            let pixels = drawn(&placed(&views));
            for (i, &drawn) in pixels.iter().enumerate() {
                let sight = [
                    ((i % WIDTH) as f64 + 0.5 - 160.0) / 258.0,
                    ((i / WIDTH) as f64 + 0.5 - 120.0) / 258.0,
                    1.0,
                ];
                let mut inside = volume != 0.0;
                let mut beyond = false;
                let mut close = false;
                for (k, (form, constant)) in forms.iter().enumerate() {
                    let value = dot(*form, sight) + constant;
                    let margin = form[0].hypot(form[1]) / 258.0 / 128.0;
                    close |= value.abs() <= margin + 1e-9 * (value.abs() + constant.abs());
                    inside &= value > 0.0;
                    beyond |= k == 3 && value < 0.0;
                }
                if !close {
                    assert_eq!(drawn, inside, "pixel {i} of {views:?}");
                    by_near += u64::from(beyond);
                    *(if inside { &mut seen } else { &mut hidden }) += 1u64;
                }
            }
        }
        assert!(
            !seeded::is_whole() || seen > 500_000 && hidden > 500_000 && by_near > 5_000,
            "{seen}, {hidden}, {by_near}"
        );
    }

    #[test]
    fn behind_the_eye_and_edge_on_nothing_is_seen() {
        let behind = [[-500, -400, -1], [900, 100, -70_000], [0, 800, 0]];
        assert_eq!(placed(&behind), []);
        // Far to the right: removed, without a vertex.
        let to_the_right = [[1 << 23, 0, 9], [1 << 23, 99, 300], [1 << 22, -999, 500]];
        assert_eq!(placed(&to_the_right), []);
        // In a plane with the eye, from in front of it to behind it.
        for face in [
            [[-3000, 0, 5000], [3000, 0, 5000], [0, 0, -5000]],
            [[0, -3000, 5000], [0, 3000, 5000], [0, 0, -5000]],
            [[-3000, -3000, 5000], [3000, 3000, 5000], [100, 100, -5000]],
        ] {
            let polygon = placed(&face);
            assert!(polygon.len() >= 3);
            assert!(!drawn(&polygon).contains(&true), "{polygon:?}");
        }
    }
}
