//! The mappers that follow the depth: the direction in which it is constant, the axis along which it changes
//! less, and tiles. The reference is the quotient of the plane's integers at the pixel's centre, clamped to
//! the texture.

mod faces;

use texmap::mappers::{constant_z, free_direction, tiles};
use texmap::plane::{Anchor, Form, Plane};
use texmap::{Axis, Face, Job, Mapper, SpanKind, Subdivision, Texture, Vertex};

use faces::*;

const SIZE: (u16, u16) = (256, 200);
/// A quarter of a texel, 16.16: errors that do not come from fixed point.
const QUARTER: f64 = 16384.0;
const MAPPERS: [Mapper; 4] = [
    Mapper::ConstantZ,
    Mapper::FreeDirection,
    Mapper::RowOrColumn,
    Mapper::Tiles,
];

/// A visible triangle: its corners on the screen and in space.
struct Triangle {
    polygon: Vec<Vertex>,
    anchors: [Anchor; 3],
}

impl Triangle {
    /// Returns a triangle with these corners: pixels from the screen's centre, and depths, 16.16.
    fn new(corners: [(f64, f64, i32); 3], texture: [(i32, i32); 3]) -> Self {
        let anchors = [0, 1, 2].map(|i| {
            let ((x, y, z), (u, v)) = (corners[i], texture[i]);
            let at = |pixels: f64| (pixels * f64::from(z) / f64::from(FOCAL_LENGTH)).round() as i32;
            Anchor {
                position: [at(x), at(y), z],
                u,
                v,
            }
        });
        Self::seen(anchors)
    }

    fn seen(anchors: [Anchor; 3]) -> Self {
        let corner = |Anchor { position, u, v }: Anchor| {
            let [x, y, z] = position.map(f64::from);
            let at = |k: f64, middle: f64| {
                ((middle + k * f64::from(FOCAL_LENGTH) / z) * 256.0).round() as i32
            };
            Vertex {
                x: at(x, 160.0),
                y: at(y, 120.0),
                u,
                v,
            }
        };
        let polygon = anchors.into_iter().map(corner).collect();
        Self { polygon, anchors }
    }

    /// Returns the triangle's plane seen through two rectangles, joined by a side that the outline follows
    /// there and back. The columns between have no pixel, and where the rectangles face each other, rows have
    /// two spans.
    fn through_windows(mut self, random: &mut fastrand::Rng) -> Self {
        let (x, y) = (random.i32(0..150), random.i32(0..100));
        let (gap, tall) = (random.i32(1..40), random.i32(40..100));
        let windows = [(x, y), (x + 100 + gap, y + random.i32(0..100))];
        let corners = windows.map(|(x, y)| {
            [(0, 0), (100, 0), (100, tall), (0, tall), (0, 0)].map(|(dx, dy)| Vertex {
                x: (x + dx) * 256,
                y: (y + dy) * 256,
                u: 0,
                v: 0,
            })
        });
        self.polygon = corners.concat();
        self
    }

    /// Returns a triangle anywhere on the screen and a little beyond, with a depth ratio of up to
    /// 2^`octaves`.
    fn any(random: &mut fastrand::Rng, octaves: f64) -> Self {
        let corner = |random: &mut fastrand::Rng| {
            let at = |random: &mut fastrand::Rng, reach: i32| f64::from(random.i32(-reach..=reach));
            let z = 2f64.powf(17.0 + octaves * random.f64());
            (at(random, 220), at(random, 170), z as i32)
        };
        let corners = [(); 3].map(|()| corner(random));
        Self::new(corners, texture(random))
    }

    fn face(&self) -> Face<'_> {
        Face {
            polygon: &self.polygon,
            texture: 0,
            anchors: self.anchors,
            focal_length: FOCAL_LENGTH,
        }
    }
}

fn texture(random: &mut fastrand::Rng) -> [(i32, i32); 3] {
    let (w, h) = (i32::from(SIZE.0) << 16, i32::from(SIZE.1) << 16);
    [(); 3].map(|()| (random.i32(0..=w), random.i32(0..=h)))
}

fn at(form: &Form, x: f64, y: f64) -> f64 {
    form.origin as f64 + form.right as f64 * x + form.down as f64 * y
}

/// Returns u or v at any point of the screen, 16.16, not clamped; `None` where the plane is not visible.
fn quotient(plane: &Plane, k: usize, x: f64, y: f64) -> Option<f64> {
    let c = at(&plane.c, x, y);
    let n = at([&plane.a, &plane.b][k], x, y);
    (c > 0.0).then(|| n / c * 65536.0)
}

/// Compares the coordinates of every pixel of a face with the exact coordinates. `bound` returns the largest
/// allowed error for u or v (0 or 1), at a pixel and its number in its job, if a limit exists. Returns the
/// number of pixels, and the worst error as a fraction of its bound, among bounds of at least `least`.
fn compare(
    mapper: Mapper,
    least: f64,
    triangle: &Triangle,
    bound: impl Fn(&Plane, &Job, usize, (u16, u16), u16) -> Option<f64>,
) -> (u64, f64) {
    let texels = [0; 256 * 200];
    let texture = Texture::new(&texels, SIZE.0, SIZE.1).unwrap();
    let face = triangle.face();
    let plane = face.plane();
    let (mut pixels, mut worst) = (0, 0f64);
    let last = texture.last();
    for job in jobs(mapper, &face, &texture) {
        let mut i = 0;
        job.pixels(&texture, |(x, y), (u, v)| {
            for (k, actual, last) in [(0, u, last.0), (1, v, last.1)] {
                let exact = quotient(&plane, k, x.into(), y.into());
                let bound = bound(&plane, &job, k, (x, y), i);
                if let (Some(exact), Some(bound)) = (exact, bound) {
                    let off = (f64::from(actual) - exact.clamp(0.0, last.into())).abs();
                    assert!(
                        off <= bound,
                        "{mapper} ({x}, {y}): off by {off} of {bound}: {job:?}, {:?}",
                        triangle.anchors
                    );
                    if bound >= least {
                        worst = worst.max(off / bound);
                    }
                    pixels += 1;
                }
            }
            i += 1;
        });
    }
    (pixels, worst)
}

/// Returns a triangle in a wall, with a side straight down in space, or in a floor, with a side straight
/// across.
fn constant_z_triangle(random: &mut fastrand::Rng, wall: bool, upright: bool) -> Triangle {
    let mut triangle = Triangle::any(random, 3.0);
    let [a, b, _] = &mut triangle.anchors;
    b.position = a.position;
    b.position[usize::from(wall)] += random.i32(1..1 << 17);
    if upright {
        (a.u, a.v) = (b.u, b.v);
        a.v = random.i32(0..=i32::from(SIZE.1) << 16);
    }
    Triangle::seen(triangle.anchors)
}

#[test]
fn a_wall_and_a_floor_are_exact_but_for_drift() {
    let mut random = seeded::generator();
    let (mut pixels, mut walls, mut affine, mut exact, mut worst) = (0, 0, 0, 0, 0f64);
    for case in 0..seeded::cases(240) {
        let (wall, upright) = (case % 2 == 0, case % 3 == 0);
        let mut triangle = constant_z_triangle(&mut random, wall, upright);
        if case % 5 == 0 {
            triangle = triangle.through_windows(&mut random);
        }
        let expected = if wall { Axis::Down } else { Axis::Right };
        assert_eq!(constant_z::axis(&triangle.face().plane()), Some(expected));
        let texels = [0; 256 * 200];
        let texture = Texture::new(&texels, SIZE.0, SIZE.1).unwrap();
        for job in jobs(Mapper::ConstantZ, &triangle.face(), &texture) {
            assert_eq!(job.axis, expected);
            match job.kind {
                SpanKind::Upright(_) => walls += 1,
                SpanKind::Affine(stepper) => {
                    affine += 1;
                    assert!(!(wall && upright), "{stepper:?} steps both");
                }
                // A window may show points beyond the horizon.
                _ => exact += u32::from(case % 5 != 0),
            }
        }
        let (more, most) = compare(Mapper::ConstantZ, 20.0, &triangle, |_, _, _, (x, y), _| {
            // A span's pixels are counted before it is cut: never more than this.
            Some(f64::from(constant_z::drift(if wall { y } else { x })))
        });
        (pixels, worst) = (pixels + more, worst.max(most));
    }
    println!("{pixels} coordinates, {worst:.3} of the bound at worst");
    println!("{walls} walls, {affine} affine and {exact} exact spans");
    if seeded::is_whole() {
        assert!(pixels > 500_000 && worst > 0.8 && walls > 2_000 && affine > 5_000);
        // The exact mapper draws hardly any of a wall's visible spans.
        assert!(exact < affine / 100);
    }
}

#[test]
fn where_no_depth_is_constant_level_is_exact() {
    let mut random = seeded::generator();
    let texels = texels(SIZE.0, SIZE.1);
    let texture = Texture::padded(&texels, SIZE.0, SIZE.1).unwrap();
    let mut planes = 0;
    for _ in 0..50 {
        let triangle = Triangle::any(&mut random, 3.0);
        if constant_z::axis(&triangle.face().plane()).is_none() {
            let level = jobs(Mapper::ConstantZ, &triangle.face(), &texture);
            assert_eq!(level, jobs(Mapper::Exact, &triangle.face(), &texture));
            planes += 1;
        }
    }
    assert!(planes > 40);
}

/// Returns how far u or v moves when the point moves by [`free_direction::LARGEST_DISTANCE`] across the line.
fn across(plane: &Plane, axis: Axis, k: usize, (x, y): (u16, u16)) -> Option<f64> {
    let (x, y) = (f64::from(x), f64::from(y));
    let here = quotient(plane, k, x, y)?;
    let moved = |by: f64| match axis {
        Axis::Right => quotient(plane, k, x, y + by),
        Axis::Down => quotient(plane, k, x + by, y),
    };
    let distance = f64::from(free_direction::LARGEST_DISTANCE) / 16384.0;
    let [one, other] = [moved(-distance)?, moved(distance)?];
    Some((one - here).abs().max((other - here).abs()))
}

#[test]
fn the_free_direction_is_off_by_half_a_pixel_across_at_most_and_by_that_somewhere() {
    let mut random = seeded::generator();
    let (mut pixels, mut worst, mut ways) = (0, [0f64; 2], [0; 4]);
    for case in 0..seeded::cases(160) {
        let mut triangle = Triangle::any(&mut random, [0.1, 1.0, 4.0][case % 3]);
        if case % 5 == 0 {
            triangle = triangle.through_windows(&mut random);
        }
        let plane = triangle.face().plane();
        let right = plane.c.right.abs() < plane.c.down.abs();
        let axis = if right { Axis::Right } else { Axis::Down };
        let falls = (plane.c.right < 0) == (plane.c.down < 0);
        ways[2 * usize::from(right) + usize::from(falls)] += 1;
        let (more, most) = compare(
            Mapper::FreeDirection,
            QUARTER,
            &triangle,
            |plane, job, k, at, _| match job.kind {
                SpanKind::FreeDirection(_) => {
                    assert_eq!(job.axis, axis);
                    Some(across(plane, axis, k, at)? + f64::from(constant_z::drift(320)))
                }
                _ => Some(1.0),
            },
        );
        let worst = &mut worst[usize::from(right)];
        (pixels, *worst) = (pixels + more, worst.max(most));
    }
    println!("{pixels} coordinates, {worst:.3?} of the bound at worst; {ways:?}");
    if seeded::is_whole() {
        assert!(pixels > 1_000_000 && worst.iter().all(|&worst| worst > 0.8));
        assert!(ways.iter().all(|&ways| ways > 10));
    }
}

/// Along a line of constant depth the only error is the half pixel across it, so a line along rows or columns
/// has no error but drift.
#[test]
fn a_free_line_without_slope_goes_through_the_centres() {
    let mut random = seeded::generator();
    for case in 0..100 {
        let triangle = constant_z_triangle(&mut random, case % 2 == 0, false);
        compare(
            Mapper::FreeDirection,
            QUARTER,
            &triangle,
            |_, _, _, _, _| Some(f64::from(constant_z::drift(320))),
        );
    }
}

/// Returns the error of linear interpolation between two points whose depth ratio is r:
/// |du| (sqrt r - 1)/(sqrt r + 1).
fn linear(plane: &Plane, k: usize, (x, y): (f64, f64), (to_x, to_y): (f64, f64)) -> Option<f64> {
    let du = quotient(plane, k, to_x, to_y)? - quotient(plane, k, x, y)?;
    let (c, to_c) = (at(&plane.c, x, y), at(&plane.c, to_x, to_y));
    let root = (c.max(to_c) / c.min(to_c)).sqrt();
    Some(du.abs() * (root - 1.0) / (root + 1.0))
}

#[test]
fn tiles_are_off_by_what_their_edge_and_their_column_are_and_by_that_somewhere() {
    let mut random = seeded::generator();
    let (mut pixels, mut affine, mut exact, mut worst) = (0, 0, 0, 0f64);
    for case in 0..seeded::cases(160) {
        // Without a change of depth, the only error is that of fixed point.
        let mut triangle = Triangle::any(&mut random, [0.0, 1.0, 3.0, 6.0][case % 4]);
        if case % 5 == 0 {
            triangle = triangle.through_windows(&mut random);
        }
        let texels = [0; 256 * 200];
        let texture = Texture::new(&texels, SIZE.0, SIZE.1).unwrap();
        for job in jobs(Mapper::Tiles, &triangle.face(), &texture) {
            assert_eq!(job.y / tiles::SIDE, (job.y + job.len - 1) / tiles::SIDE);
            match job.kind {
                SpanKind::Affine(_) => affine += u32::from(job.len),
                _ => exact += u32::from(job.len),
            }
        }
        let (more, most) = compare(
            Mapper::Tiles,
            QUARTER,
            &triangle,
            |plane, job, k, (x, y), _| {
                if !matches!(job.kind, SpanKind::Affine(_)) {
                    return Some(1.0);
                }
                let side = f64::from(tiles::SIDE);
                let [left, top] = [x, y].map(|k| f64::from(k / tiles::SIDE) * side);
                let (right, bottom) = (left + side, top + side);
                let corners = [(left, top), (right, top), (left, bottom), (right, bottom)];
                let depths = corners.map(|(x, y)| at(&plane.c, x, y));
                let most = tiles::MOST_DEPTH as f64;
                assert!(
                    depths
                        .iter()
                        .all(|c| depths.iter().all(|of| *c < most * of))
                );
                let x = f64::from(x);
                let above = linear(plane, k, (left, top), (right, top))?;
                let below = linear(plane, k, (left, bottom), (right, bottom))?;
                let column = linear(plane, k, (x, top), (x, bottom))?;
                Some(above.max(below) + column + f64::from(tiles::DRIFT))
            },
        );
        (pixels, worst) = (pixels + more, worst.max(most));
    }
    println!(
        "{pixels} coordinates, {worst:.3} of the bound at worst; {affine} pixels affine, {exact} exact"
    );
    assert!(
        !seeded::is_whole() || pixels > 1_000_000 && worst > 0.8 && exact > 1_000 && exact < affine
    );
}

#[test]
fn nearer_goes_the_way_in_which_depth_changes_less() {
    let mut random = seeded::generator();
    let texels = texels(SIZE.0, SIZE.1);
    let texture = Texture::padded(&texels, SIZE.0, SIZE.1).unwrap();
    let mut ways = [0; 2];
    for _ in 0..200 {
        let triangle = Triangle::any(&mut random, 2.0);
        let face = triangle.face();
        let c = face.plane().c;
        let rows = c.right.abs() < c.down.abs();
        ways[usize::from(rows)] += 1;
        for job in jobs(Mapper::RowOrColumn, &face, &texture) {
            assert_eq!(job.axis == Axis::Right, rows);
            let SpanKind::Linear(stepper, Subdivision::Of(16)) = job.kind else {
                panic!("{job:?}");
            };
            let step = if rows { c.right } else { c.down };
            assert_eq!((stepper.at[2], stepper.step[2]), (c.at(job.x, job.y), step));
        }
    }
    assert!(ways.iter().all(|&ways| ways > 40), "{ways:?}");
}

/// Any polygon with any plane, visible or not: no fault, each pixel once, every texel inside the texture.
#[test]
fn whatever_the_plane_is_coverage_stays_and_every_texel_is_inside() {
    let mut random = seeded::generator();
    let mut pixels = 0;
    for case in 0..seeded::cases(500) {
        let size = [(1, 1), (256, 256), (256, 1), (3, 100)][case % 4];
        let texels = texels(size.0, size.1);
        let texture = Texture::padded(&texels, size.0, size.1).unwrap();
        let sides = random.usize(0..=16);
        let polygon = polygon(&mut random, sides, size);
        let face = Face {
            polygon: &polygon,
            texture: 0,
            anchors: anchors(&mut random, size),
            focal_length: random.i32(1..1024),
        };
        for mapper in MAPPERS {
            pixels += check_pixels(mapper, &face, &texture);
        }
    }
    println!("{pixels} pixels");
    assert!(!seeded::is_whole() || pixels > 1_000_000);
}

/// The horizon through the centre of the frame, and the plane seen from behind.
#[test]
fn on_the_horizon_and_beyond_it_nothing_is_at_fault() {
    let screen = [(0, 0), (320, 0), (320, 240), (0, 240)].map(|(x, y)| Vertex {
        x: x * 256,
        y: y * 256,
        u: 0,
        v: 0,
    });
    let texels = texels(256, 200);
    let texture = Texture::padded(&texels, 256, 200).unwrap();
    for turn in 0..16 {
        let (sin, cos) = (f64::from(turn) * std::f64::consts::TAU / 16.0).sin_cos();
        let point = |along: f64, depth: f64| {
            let (x, y) = (along * cos - sin, along * sin + cos);
            [x * 65536.0, y * 65536.0, depth * 65536.0].map(|k| k as i32)
        };
        for sign in [1.0, -1.0] {
            let anchors = [(0.0, 1.0, 0, 0), (1.0, 1.0, 256, 0), (0.0, 4.0, 0, 200)].map(
                |(along, depth, u, v): (f64, f64, i32, i32)| Anchor {
                    position: point(along, sign * depth),
                    u: u << 16,
                    v: v << 16,
                },
            );
            let face = Face {
                polygon: &screen,
                texture: 0,
                anchors,
                focal_length: FOCAL_LENGTH,
            };
            let c = face.plane().c;
            let corners = [(0, 0), (319, 0), (0, 239), (319, 239)].map(|(x, y)| c.at(x, y) > 0);
            assert!(corners.contains(&true) && corners.contains(&false));
            for mapper in MAPPERS {
                assert_eq!(check_pixels(mapper, &face, &texture), 320 * 240);
            }
        }
    }
}

#[test]
fn plane_by_plane_they_draw_what_they_draw_polygon_by_polygon() {
    let mut random = seeded::generator();
    let texels = texels(SIZE.0, SIZE.1);
    let texture = Texture::padded(&texels, SIZE.0, SIZE.1).unwrap();
    for case in 0..seeded::cases(30) {
        let triangle = match case % 3 {
            0 => constant_z_triangle(&mut random, case % 2 == 0, case % 4 < 2),
            _ => Triangle::any(&mut random, 3.0),
        };
        for mapper in MAPPERS {
            check_drawing(mapper, &triangle.face(), &texture);
        }
        let polygon = polygon(&mut random, 3 + case % 9, SIZE);
        let face = Face {
            polygon: &polygon,
            ..triangle.face()
        };
        for mapper in MAPPERS {
            check_drawing(mapper, &face, &texture);
        }
    }
}
