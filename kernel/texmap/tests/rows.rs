//! The row mappers: three ways to reach the pixels give one frame. Also checks the error of the half steps.

mod faces;

use texmap::mappers::affine::Sides;
use texmap::scan;
use texmap::{Axis, Face, Mapper, Rows, Texture, Vertex};

use faces::*;

const ROWS: [Rows; 3] = [Rows::Multiply, Rows::Steps, Rows::Passes];

/// Port writes of the three mappers, polygon by polygon: the first two write once per pixel, and the third
/// once for each plane that a row touches.
#[test]
fn the_row_mappers_draw_the_same_bytes_by_the_writes_that_they_are_known_for() {
    let mut random = seeded::generator();
    let texels = texels(100, 64);
    let texture = Texture::padded(&texels, 100, 64).unwrap();
    let (mut one, mut begins, mut ends) = (0, [0; 4], [0; 4]);
    for case in 0..seeded::cases(60) {
        let polygon = polygon(&mut random, 3 + case % 6, (100, 64));
        let face = Face {
            polygon: &polygon,
            texture: 0,
            anchors: anchors(&mut random, (100, 64)),
            focal_length: FOCAL_LENGTH,
        };
        let mut writes = [0; 3];
        let mut pixels = 0;
        scan::rows(&polygon, |span| {
            pixels += u64::from(span.len);
            writes[2] += u64::from(span.len.min(4));
            one += u32::from(span.len == 1);
            begins[usize::from(span.first & 3)] += 1;
            ends[usize::from((span.first + span.len - 1) & 3)] += 1;
        })
        .unwrap();
        (writes[0], writes[1]) = (pixels, pixels);
        let steppers = jobs(Mapper::Rows(Rows::Steps), &face, &texture);
        for (rows, writes) in ROWS.into_iter().zip(writes) {
            let mapper = Mapper::Rows(rows);
            assert_eq!(jobs(mapper, &face, &texture), steppers);
            assert_eq!(check_pixels(mapper, &face, &texture) as u64, pixels);
            let [(stats, polygons), (_, planes)] = check_drawing(mapper, &face, &texture);
            let asked = (polygons.map_mask, polygons.ports, polygons.stores);
            assert_eq!(asked, (writes, writes, pixels), "{mapper}: {face:?}");
            let lists = u64::from(stats.full) + 1;
            assert_eq!((planes.map_mask, planes.stores), (4 * lists, pixels));
        }
    }
    println!("{one} rows of one pixel; begun in {begins:?}, ended in {ends:?}");
    assert!(!seeded::is_whole() || one > 20 && begins.iter().chain(&ends).all(|&rows| rows > 100));
}

/// A pixel, its coordinates, and its number in the span.
type Stepped = ((i64, i64), [i32; 2], u16);

/// Returns the coordinates by half steps at each pixel of a triangle, along rows or columns.
fn half_steps(polygon: &[Vertex], texture: &Texture<'_>, axis: Axis) -> Vec<Stepped> {
    let sides = Sides::new(polygon, texture, axis).unwrap();
    let mut pixels = Vec::new();
    scan::spans_and_crossings(axis, polygon, |span| {
        let stepper = sides.half_step(&span);
        for (i, (u, v)) in (0..span.len).zip(stepper) {
            let (line, at) = (i64::from(span.line), i64::from(span.first + i));
            let place = match axis {
                Axis::Down => (line, at),
                Axis::Right => (at, line),
            };
            pixels.push((place, [u, v], i));
        }
    })
    .unwrap();
    pixels
}

/// The bound is half a pixel's change of the coordinate along the span, and the step's last bit for each
/// pixel of it.
#[test]
fn half_steps_are_off_by_half_a_pixel_at_most_and_by_that_somewhere() {
    let mut random = seeded::generator();
    let texels = [0; 256 * 128];
    let texture = Texture::new(&texels, 256, 128).unwrap();
    for axis in [Axis::Right, Axis::Down] {
        let (mut compared, mut worst) = (0, 0f64);
        for case in 0..seeded::cases(400) {
            // On the screen, across its border, and far beyond.
            let spread = [20, 150, 2_000][case % 3] * 256;
            let vertex = |random: &mut fastrand::Rng| Vertex {
                x: 160 * 256 + random.i32(-spread..=spread),
                y: 120 * 256 + random.i32(-spread..=spread),
                u: random.i32(0..=256 << 16),
                v: random.i32(0..=128 << 16),
            };
            let polygon = [(); 3].map(|()| vertex(&mut random));
            let [a, b, c] = polygon.map(|p| [p.x, p.y, p.u, p.v].map(f64::from));
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
            // Slivers would show mainly the rounding of the crossings.
            if area.abs() < 65536.0 {
                continue;
            }
            for ((x, y), actual, i) in half_steps(&polygon, &texture, axis) {
                let (dx, dy) = (
                    x as f64 * 256.0 + 128.0 - a[0],
                    y as f64 * 256.0 + 128.0 - a[1],
                );
                for k in 0..2 {
                    let [p, q] = [b, c].map(|at| at[2 + k] - a[2 + k]);
                    let right = (p * (c[1] - a[1]) - q * (b[1] - a[1])) / area;
                    let down = (q * (b[0] - a[0]) - p * (c[0] - a[0])) / area;
                    let exact = a[2 + k] + right * dx + down * dy;
                    let a_pixel = 256.0 * if axis == Axis::Right { right } else { down };
                    let off = (f64::from(actual[k]) - exact).abs();
                    // The crossings' error of 2^-23 pixel is less than 2^-16 texel, except where a pixel
                    // spans a whole texture.
                    let bound = (a_pixel / 2.0).abs() * (1.0 + 1e-5) + f64::from(i) + 4.0;
                    assert!(
                        off <= bound,
                        "{axis:?} ({x}, {y}): off by {off} of {bound}: {polygon:?}"
                    );
                    if a_pixel.abs() > 65536.0 {
                        worst = worst.max(off / bound);
                    }
                }
                compared += 1;
            }
        }
        println!("{axis:?}: {compared} pixels, {worst:.3} of the bound at worst");
        assert!(!seeded::is_whole() || compared > 1_000_000 && worst > 0.8);
    }
}

/// A row whose polygon begins far off the screen has the same coordinates as the row on the screen.
#[test]
fn half_steps_lose_nothing_over_pixels_that_nobody_sees() {
    let texels = [0; 256];
    let texture = Texture::new(&texels, 256, 1).unwrap();
    // 30 000 pixels for 256 texels: rounding removes most of the step's last bit.
    let far = [
        (-29_900, 0, 0),
        (100, 0, 256),
        (100, 2, 256),
        (-29_900, 2, 0),
    ];
    let polygon = far.map(|(x, y, u)| Vertex {
        x: x * 256,
        y: y * 256,
        u: u << 16,
        v: 0,
    });
    for ((x, _), [u, _], i) in half_steps(&polygon, &texture, Axis::Right) {
        let exact = (29_900.0 + x as f64 + 0.5) * 256.0 * 65536.0 / 30_000.0;
        assert!(
            (exact - f64::from(u)).abs() <= f64::from(i) + 2.0,
            "{x}: {u} for {exact}"
        );
    }
}
