//! The two clips that make vertices: the near plane, and a guard band far outside the screen.
//!
//! # Where
//!
//! Both cut in the viewer's space, before anything is rounded to the screen's grid: first the
//! near plane, then the guard band's left, right, top and bottom. Once nothing is nearer than
//! [`NEAR`], x / z <= k is the same as x <= k z: the guard planes are planes through the eye. What
//! is exactly on a plane is inside. The screen's own border is none of them: it cuts columns.
//!
//! # Why neighbours agree
//!
//! Two faces that share an edge must go on sharing it, bit for bit, or pixels along it are left
//! out or written twice.
//!
//! - A crossing is computed from the edge's two ends as they stand, *from the end inside to the
//!   end outside*, whichever way the face walks the edge; and it is the exact point, rounded once.
//! - Each plane replaces what is left of an edge by what is inside that plane. That depends on
//!   the edge's two ends only, so by induction both faces are left with the same piece of it after
//!   each plane, also where several planes cut one edge.
//! - All planes are asked, in the one order, as soon as one of a face's corners is outside any of
//!   them. A crossing is rounded, and may come to lie by that much outside a plane that no corner
//!   was outside of; a face that skipped that plane would disagree with one that did not. A face
//!   that is not clipped at all has no such edge: both its ends are inside all planes.
//! - Places in the texture take no part in any of it, so a seam of the texture is no seam of the
//!   solid.
//!
//! # The arithmetic
//!
//! A corner has [`FINE`] more fraction bits than a vertex of the mesh: below 2^52 in size. Its
//! height above a plane is exact and below 2^68; a crossing's product stays below 2^122. A
//! crossing is rounded to 2^-44 unit (half up). On the screen that is most where z is least and
//! x / z most: (258 x 256 / NEAR) (1 + 128) 2^-29, less than 1/8000 of 1/256 pixel. The guard
//! band ends on a whole number of 1/256 pixels, so five such errors cannot round a vertex out of
//! it.
//!
//! # How many corners
//!
//! A plane adds at most one corner to a convex polygon: [`MAX_CORNERS`](crate::MAX_CORNERS) of a
//! face and [`PLANES`] new ones are [`MAX_SIDES`]. (Turning rounds vertices, so a face of four or
//! more corners that is seen exactly edge-on may be bent by 2^-16 unit; only one of nearly
//! `MAX_CORNERS` corners, bent many times over, could come to have too many. It would be dropped
//! and counted.)

use modex::{HEIGHT, WIDTH};
use texmap::{MAX_COORDINATE, MAX_SIDES, SUBPIXELS, Vertex};

use crate::camera::{FOCAL_LENGTH, NEAR, project, project_fine};
use crate::{Corner, Vec3};

/// How many planes clip.
pub(crate) const PLANES: usize = 5;

/// Fraction bits of a corner beyond the 16 of a vertex.
const FINE: u32 = 28;

/// The guard band's end: pixels from the screen's corner, either way.
const GUARD: i64 = (MAX_COORDINATE / SUBPIXELS) as i64;

/// Half a space: the points whose product with `form` is at least `least`.
struct Plane {
    form: [i64; 3],
    least: i64,
}

/// In the order in which they cut.
static CLIPS: [Plane; PLANES] = {
    const fn guard(form: [i64; 3]) -> Plane {
        Plane { form, least: 0 }
    }
    let focal = FOCAL_LENGTH as i64;
    let (x, y) = (WIDTH as i64 / 2, HEIGHT as i64 / 2);
    [
        Plane {
            form: [0, 0, 1],
            least: NEAR as i64,
        },
        // focal x / z + middle >= -GUARD, and <= GUARD.
        guard([focal, 0, GUARD + x]),
        guard([-focal, 0, GUARD - x]),
        guard([0, focal, GUARD + y]),
        guard([0, -focal, GUARD - y]),
    ]
};

/// A vertex of the mesh, ready for all faces that meet in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// In the viewer's space, 16.16.
    view: Vec3,
    /// On the screen in 1/256 pixel, if it is inside all planes.
    screen: (i32, i32),
    /// Bit i: it is outside plane i.
    outside: u8,
}

impl Point {
    /// What an arena holds before the first picture.
    pub const ORIGIN: Self = Self {
        view: [0; 3],
        screen: (0, 0),
        outside: 0,
    };

    /// A vertex in the viewer's space: |x| and |y| are below 2^23 (128 units), |z| below 2^24.
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

impl Point {
    /// In the viewer's space, 16.16.
    pub fn view(&self) -> Vec3 {
        self.view
    }
}

/// A corner between the planes.
#[derive(Clone, Copy, Default)]
struct Placed {
    /// In the viewer's space, 16 + FINE fraction bits.
    at: [i64; 3],
    u: i32,
    v: i32,
}

/// What the planes have left of a face.
struct Outline {
    corners: [Placed; MAX_SIDES],
    len: usize,
}

impl Outline {
    fn new() -> Self {
        Self {
            corners: [Placed::default(); MAX_SIDES],
            len: 0,
        }
    }

    /// Adds a corner, or nothing comes back if there is no room.
    fn push(&mut self, corner: Placed) -> Option<()> {
        *self.corners.get_mut(self.len)? = corner;
        self.len += 1;
        Some(())
    }

    /// What is inside `plane`, or nothing if it has more than [`MAX_SIDES`] corners.
    fn cut(&self, plane: &Plane) -> Option<Self> {
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

impl Plane {
    /// How far `corner` is inside, in the units of the plane's form.
    fn height(&self, corner: &Placed) -> i128 {
        let product: i128 = (0..3)
            .map(|k| i128::from(self.form[k]) * i128::from(corner.at[k]))
            .sum();
        product - (i128::from(self.least) << FINE)
    }
}

/// Where the edge from the end inside to the end outside meets the plane that they are `above`
/// (more than 0) and `below` (less than 0). All of it lies between the two ends, the place in the
/// texture too: there is nothing to clamp.
fn crossing(inside: &Placed, outside: &Placed, above: i128, below: i128) -> Placed {
    let whole = above - below;
    let between = |from: i64, to: i64| {
        let part = (i128::from(to) - i128::from(from)) * above;
        from + (2 * part + whole).div_euclid(2 * whole) as i64
    };
    Placed {
        at: [0, 1, 2].map(|k| between(inside.at[k], outside.at[k])),
        u: between(inside.u.into(), outside.u.into()) as i32,
        v: between(inside.v.into(), outside.v.into()) as i32,
    }
}

/// Puts a face on the screen, clipped if it has to be, and says how many vertices of `polygon` it
/// took: fewer than 3 if nothing is to be seen, or nothing if it would take more than there are.
pub(crate) fn place(
    corners: &[Corner],
    points: &[Point],
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

/// Rare, and kept out of the way of what is not.
#[cold]
fn clip(corners: &[Corner], points: &[Point], polygon: &mut [Vertex; MAX_SIDES]) -> Option<usize> {
    let mut outline = Outline::new();
    for corner in corners {
        let view = points[usize::from(corner.vertex)].view;
        outline.push(Placed {
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
    use texmap::affine::Sides;
    use texmap::{Texture, coverage};

    const SIDE: i32 = 256 << 16;

    /// A face of these points, placed; the corners' places in the texture are spread over all of
    /// it, the same for the same point.
    fn placed(views: &[Vec3]) -> Vec<Vertex> {
        let points: Vec<_> = views.iter().map(|&view| Point::new(view)).collect();
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
        let legal = Sides::new(polygon, &texture, coverage::Axis::Down).and_then(|_| {
            coverage::columns(polygon, |run| {
                for y in run.first..run.first + run.len {
                    pixels[usize::from(y) * WIDTH + usize::from(run.line)] ^= true;
                }
            })
        });
        legal.unwrap_or_else(|dropped| panic!("{dropped:?}: {polygon:?}"));
        pixels
    }

    /// All sizes alike, from 1 to the largest.
    fn coordinate(random: &mut fastrand::Rng, bits: u32) -> i32 {
        let size = 1 << random.u32(0..=bits);
        random.i32(-size + 1..size)
    }

    /// Before, behind and beside the eye, and often exactly on a plane.
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
            // On the screen, or not far from it.
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
        // At, inside, beyond; and where `at` is on the screen.
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
            assert_eq!(Point::new(at).outside, 0, "{at:?}");
            assert_eq!(Point::new(at).screen, on_screen, "{at:?}");
            assert_eq!(Point::new(step(-1)).outside, 0, "{at:?}");
            assert_eq!(Point::new(step(1)).outside, 1 << plane, "{at:?}");
            // A triangle with that corner keeps it, or loses it for two more; none is illegal.
            let others = [[900, 900, 2000], [-1200, 300, 2000]];
            let sides = |view| {
                let polygon = placed(&[view, others[0], others[1]]);
                drawn(&polygon);
                polygon.len()
            };
            assert_eq!([sides(at), sides(step(-1)), sides(step(1))], [3, 3, 4]);
        }
        // The whole face on the plane is inside; all of it beyond is nothing at all.
        let near = |z| placed(&[[-9, -9, z], [9, -9, z], [9, 9, z], [-9, 9, z]]);
        assert_eq!(near(NEAR).len(), 4);
        assert_eq!(near(NEAR - 1), []);
        // One corner or edge on the plane and the rest beyond encloses no pixel.
        let touching = placed(&[[0, 0, NEAR], [99, 0, 0], [0, 99, 0]]);
        assert!(touching.len() < 3, "{touching:?}");
        let touching = placed(&[[0, 0, NEAR], [99, 0, NEAR], [0, 99, 0]]);
        assert!(touching.len() < 3, "{touching:?}");
    }

    #[test]
    fn a_crossing_is_the_exact_point_rounded_with_ties_up() {
        let end = |at, u, v| Placed { at, u, v };
        let (inside, outside) = (end([0, 3, 8], 0, SIDE), end([3, 0, 8], SIDE, SIDE - 3));
        // The parts of the way: a half, a third, two thirds.
        for (above, below, at, u, v) in [
            (1, -1, [2, 2, 8], SIDE / 2, SIDE - 1),
            (1 << 67, -(1 << 67), [2, 2, 8], SIDE / 2, SIDE - 1),
            (1, -2, [1, 2, 8], SIDE / 3, SIDE - 1),
            (2, -1, [2, 1, 8], SIDE / 3 * 2 + 1, SIDE - 2),
        ] {
            let crossing = crossing(&inside, &outside, above, below);
            assert_eq!((crossing.at, crossing.u, crossing.v), (at, u, v));
        }
        // The largest that the products have room for.
        let (far, least, most) = ((1 << 51) - 1, -(1i64 << 51), (1 << 52) - 1);
        let (inside, outside) = (end([far, least, most], 0, 0), end([-far, far, least], 0, 0));
        let height = (1i128 << 68) - 1;
        let middle = crossing(&inside, &outside, height, -height);
        assert_eq!(middle.at, [0, 0, 1 << 50]);
    }

    /// The edge alone, as a face of two corners: what is left of it must stand, bit for bit and
    /// place in the texture included, in every face that has the edge, walked either way.
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
            let [a, b] = [a, b].map(|view| Point::new(view).outside);
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
            // A convex face: a ring about a middle, in a random plane.
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

    /// Against lines of sight and the unrounded triangle: only a pixel within 1/128 of a true edge
    /// may be on the other side. The near plane's cut is such an edge; the guard band makes none
    /// that is on the screen.
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
            if views.iter().all(|&view| Point::new(view).outside == 0) {
                continue;
            }
            let [a, b, c] = views.map(|view| view.map(f64::from));
            let volume = dot(a, cross(b, c));
            let front = volume.signum();
            // Each is more than 0 inside: form . (x, y, 1) + constant.
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
        // Far to one side: gone, without a vertex.
        let aside = [[1 << 23, 0, 9], [1 << 23, 99, 300], [1 << 22, -999, 500]];
        assert_eq!(placed(&aside), []);
        // In a plane with the eye, from before it to behind it.
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
