//! The affine mapper's steppers: compares their coordinates with the single affine map of a triangle. The
//! oracle checks which pixels they cover (`tests/oracle`).

use std::collections::HashMap;

use texmap::mappers::affine::{AffineMap, Sides};
use texmap::scan::{self, Span};
use texmap::{AffineStepper, Axis, Dropped, Texture, Vertex};

/// Makes the stepper down a span.
type MakeStepper = Box<dyn Fn(&Span) -> AffineStepper>;
/// Returns the function that makes a polygon's steppers, or `None` if the rule does not apply to the polygon.
type Rule = fn(&[Vertex], &Texture<'_>) -> Option<MakeStepper>;

fn by_sides(polygon: &[Vertex], texture: &Texture<'_>) -> Option<MakeStepper> {
    let sides = Sides::new(polygon, texture, Axis::Down).expect("legal polygon");
    Some(Box::new(move |span| sides.stepper(span)))
}

fn by_half_steps(polygon: &[Vertex], texture: &Texture<'_>) -> Option<MakeStepper> {
    let sides = Sides::new(polygon, texture, Axis::Down).expect("legal polygon");
    Some(Box::new(move |span| sides.half_step(span)))
}

fn by_map(polygon: &[Vertex], texture: &Texture<'_>) -> Option<MakeStepper> {
    let map = AffineMap::new(polygon, texture)?;
    Some(Box::new(move |span| map.stepper(span)))
}

fn steppers(polygon: &[Vertex], texture: &Texture<'_>, rule: Rule) -> Vec<(Span, AffineStepper)> {
    let mut steppers = Vec::new();
    if let Some(stepper) = rule(polygon, texture) {
        scan::columns(polygon, |span| steppers.push((span, stepper(&span)))).unwrap();
    }
    steppers
}

/// Returns pixels of `polygon`, each with its coordinates; panics on a coordinate outside the texture.
fn drawn(polygon: &[Vertex], texture: &Texture<'_>, rule: Rule) -> HashMap<(i32, i32), (i32, i32)> {
    let (last_u, last_v) = texture.last();
    let mut pixels = HashMap::new();
    for (span, stepper) in steppers(polygon, texture, rule) {
        for i in 0..i32::from(span.len) {
            let (u, v) = (stepper.u + i * stepper.du, stepper.v + i * stepper.dv);
            assert!(
                (0..=last_u).contains(&u) && (0..=last_v).contains(&v),
                "{span:?} {stepper:?} row {i} of {polygon:?}"
            );
            pixels.insert((i32::from(span.line), i32::from(span.first) + i), (u, v));
        }
    }
    pixels
}

fn vertex(
    random: &mut fastrand::Rng,
    centre: (i32, i32),
    spread: i32,
    snap: i32,
    size: (u16, u16),
) -> Vertex {
    // Multiples of `snap` bring vertices onto pixel centres, and edges on top of each other.
    let place = |random: &mut fastrand::Rng, centre: i32| {
        centre + random.i32(-spread..=spread) / snap * snap
    };
    Vertex {
        x: place(random, centre.0),
        y: place(random, centre.1),
        // Whole texels, including both borders.
        u: random.i32(0..=size.0.into()) << 16,
        v: random.i32(0..=size.1.into()) << 16,
    }
}

#[test]
fn every_stepper_stays_inside_the_texture() {
    let mut random = seeded::generator();
    let texels = vec![0; 256 * 256];
    let (mut pixels, mut mapped) = (0, 0);
    for case in 0..seeded::cases(20_000) {
        // The centre of the screen, its corners, and spreads from a pixel to beyond the screen.
        let centre = [(160, 120), (0, 0), (319, 239), (319, 0)][case % 4];
        let centre = (centre.0 * 256 + 128, centre.1 * 256 + 128);
        let spread = [256, 1024, 4096, 16384][case / 4 % 4];
        let snap = [1, 64, 128, 256][case / 16 % 4];
        let sides = random.usize(3..=8);
        // The smallest texture, the largest, the narrowest, powers of two and other sizes.
        let size = [(1, 1), (256, 256), (256, 1), (1, 255), (64, 16), (3, 100)][case % 6];
        let texels = &texels[..usize::from(size.0) * usize::from(size.1)];
        let texture = Texture::new(texels, size.0, size.1).unwrap();
        let polygon: Vec<_> = (0..sides)
            .map(|_| vertex(&mut random, centre, spread, snap, size))
            .collect();
        let exact = drawn(&polygon, &texture, by_sides).len();
        assert_eq!(drawn(&polygon, &texture, by_half_steps).len(), exact);
        mapped += drawn(&polygon, &texture, by_map).len();
        pixels += exact;
    }
    let whole = seeded::is_whole();
    assert!(
        !whole || pixels > 100_000,
        "only {pixels} pixels were drawn at all"
    );
    assert!(!whole || mapped > 100_000, "only {mapped} pixels by a map");
}

#[test]
fn a_coordinate_at_the_textures_border_is_drawn_and_one_beyond_is_not() {
    let texture = Texture::new(&[0; 6], 3, 2).unwrap();
    let (u, v) = (3 << 16, 2 << 16);
    let triangle = |u, v| {
        [(0, 0, 0, 0), (0, 512, u, 0), (512, 0, 0, v)].map(|(x, y, u, v)| Vertex { x, y, u, v })
    };
    assert!(!drawn(&triangle(u, v), &texture, by_sides).is_empty());
    assert!(!drawn(&triangle(u, v), &texture, by_map).is_empty());
    for (u, v) in [(u + 1, v), (u, v + 1), (-1, v), (u, -1)] {
        let refused = Sides::new(&triangle(u, v), &texture, Axis::Down).map(|_| ());
        assert_eq!(refused, Err(Dropped::OutOfRange), "{u} {v}");
        assert!(by_map(&triangle(u, v), &texture).is_none(), "{u} {v}");
    }
}

#[test]
fn a_triangle_has_its_one_affine_map() {
    let mut random = seeded::generator();
    let texels = [0; 64 * 16];
    let texture = Texture::new(&texels, 64, 16).unwrap();
    let mut compared = [0; 2];
    for _ in 0..seeded::cases(20_000) {
        let polygon: Vec<_> = (0..3)
            .map(|_| vertex(&mut random, (160 * 256, 120 * 256), 30 * 256, 1, (64, 16)))
            .collect();
        let [a, b, c] =
            [&polygon[0], &polygon[1], &polygon[2]].map(|p| [p.x, p.y, p.u, p.v].map(i128::from));
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        let (sides, map) = (
            drawn(&polygon, &texture, by_sides),
            drawn(&polygon, &texture, by_map),
        );
        // 1/128 texel: 2^-8 where a texture is squeezed into a sliver, and 60 pixels of step, each rounded by
        // less than 2^-16. A map adds only 3 2^-16 to the steps' error.
        let steppers = sides.into_iter().map(|at| (0, at, 512));
        for (rule, ((x, y), (u, v)), bound) in steppers.chain(map.into_iter().map(|at| (1, at, 63)))
        {
            let (dx, dy) = (
                i128::from(x) * 256 + 128 - a[0],
                i128::from(y) * 256 + 128 - a[1],
            );
            // Barycentric weights of b and c, times `area`.
            let wb = dx * (c[1] - a[1]) - dy * (c[0] - a[0]);
            let wc = dy * (b[0] - a[0]) - dx * (b[1] - a[1]);
            for (k, actual) in [(2, u), (3, v)] {
                let exact = a[k] * area + wb * (b[k] - a[k]) + wc * (c[k] - a[k]);
                let off = (i128::from(actual) * area - exact).abs();
                assert!(off <= area.abs() * bound, "({x}, {y}) of {polygon:?}");
            }
            compared[rule] += 1;
        }
    }
    assert!(
        !seeded::is_whole() || compared.iter().all(|&pixels| pixels > 1_000_000),
        "only {compared:?} pixels were compared"
    );
}

/// The exact coordinates at a pixel's centre, in units of 2^-16 texel: numerators of u and v, and their
/// denominator, which is above zero.
type Fractions = ([i128; 2], i128);

/// Returns the affine map of a triangle at a pixel, by the areas opposite to its corners.
fn by_areas(triangle: &[Vertex], (x, y): (i32, i32)) -> Fractions {
    let (x, y) = (256 * x + 128, 256 * y + 128);
    let area = |[(ax, ay), (bx, by)]: [(i32, i32); 2]| {
        let [ax, ay, bx, by] = [ax - x, ay - y, bx - x, by - y].map(i128::from);
        ax * by - ay * bx
    };
    let [a, b, c] = [0, 1, 2].map(|i: usize| (triangle[i].x, triangle[i].y));
    let opposite = [area([b, c]), area([c, a]), area([a, b])];
    let all: i128 = opposite.iter().sum();
    let sum = |of: fn(&Vertex) -> i32| -> i128 {
        let weighted = triangle.iter().zip(opposite);
        weighted.map(|(at, area)| i128::from(of(at)) * area).sum()
    };
    (
        [sum(|at| at.u), sum(|at| at.v)].map(|n| n * all.signum()),
        all.abs(),
    )
}

/// Returns the coordinates that are linear along the two sides that cross a pixel's column, and between the
/// two crossings; or nothing if other than two sides cross the column.
fn by_crossings(polygon: &[Vertex], (x, y): (i32, i32)) -> Option<Fractions> {
    let (x, y) = (i128::from(x) * 256 + 128, i128::from(y) * 256 + 128);
    let mut crossings = Vec::new();
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let [a, b] = [a, b].map(|at| [at.x, at.y, at.u, at.v].map(i128::from));
        let (a, b) = if a[0] <= b[0] { (a, b) } else { (b, a) };
        if (a[0]..b[0]).contains(&x) {
            // All over the side's width.
            crossings.push((
                [1, 2, 3].map(|k| a[k] * (b[0] - x) + b[k] * (x - a[0])),
                b[0] - a[0],
            ));
        }
    }
    let [(first, width), (second, other)] = crossings[..] else {
        return None;
    };
    let [first, second] = [first.map(|n| n * other), second.map(|n| n * width)];
    let height = second[0] - first[0];
    let part = y * width * other - first[0];
    let at = |k: usize| (first[k] * height + (second[k] - first[k]) * part) * height.signum();
    // Both numerators are over width, other and height.
    Some(([at(1), at(2)], (width * other * height).abs())).filter(|_| height != 0)
}

/// Returns a polygon of `sides` sides, a few 1/256 pixel wide, whose middle is near a pixel's centre.
fn sliver(random: &mut fastrand::Rng, sides: usize, size: (u16, u16)) -> Vec<Vertex> {
    let centre = [320, 240].map(|pixels| random.i32(0..pixels) * 256 + 128);
    // From a pixel to the limit of a coordinate.
    let length = 1i64 << random.u32(6..=22);
    let way = [(); 2].map(|()| random.i64(-length..=length));
    let mut way = way.map(|way| way >> [0, 0, 6, 12][random.usize(..4)]);
    if random.u8(..8) == 0 {
        way[random.usize(..2)] = 0;
    }
    let wide = 1 << random.u32(0..=8);
    (0..sides)
        .map(|_| {
            let along = random.i64(-1024..=1024);
            let [x, y] = [0, 1].map(|k| {
                let at = centre[k] + (way[k] * along / 1024) as i32;
                at + random.i32(-wide..=wide) / random.i32(1..=4)
            });
            let side = |random: &mut fastrand::Rng, texels: u16| match random.u8(..4) {
                0 => 0,
                1 => i32::from(texels) << 16,
                _ => random.i32(0..=i32::from(texels) << 16),
            };
            let (u, v) = (side(random, size.0), side(random, size.1));
            Vertex { x, y, u, v }
        })
        .collect()
}

/// How many pixels a test compared.
#[derive(Debug, Default)]
struct Compared {
    by_map: u32,
    by_sides: u32,
    /// Pixels of [`Compared::by_sides`] whose crossings are closer than 1/128 pixel.
    close: u32,
    /// The largest error of the others.
    worst: f64,
}

impl Compared {
    /// Checks the coordinates of every pixel of `polygon` against the exact coordinates.
    fn check(&mut self, polygon: &[Vertex], texture: &Texture<'_>) {
        let exact = |at| match polygon.len() {
            3 => Some(by_areas(polygon, at)),
            _ => by_crossings(polygon, at),
        };
        for (rule, by_map) in [(by_sides as Rule, false), (by_map, true)] {
            for (span, stepper) in steppers(polygon, texture, rule) {
                let close = (span.ends[1].at - span.ends[0].at) >> 8 < 1 << 17;
                for (i, (u, v)) in (0..span.len).zip(stepper) {
                    let at = (span.line.into(), (span.first + i).into());
                    let Some((exact, under)) = exact(at) else {
                        continue;
                    };
                    assert!(under > 0, "{at:?} of {polygon:?}");
                    // In units of 2^-16 texel: the bounds of `AffineMap` and of `Sides::stepper`.
                    let bound = match (by_map, close, span.len) {
                        (true, ..) => i128::from(i) + 3,
                        (_, true, _) => 1,
                        (_, _, 1) => 296,
                        (_, _, len) => i128::from(len) + 4,
                    };
                    for (actual, exact) in [u, v].into_iter().zip(exact) {
                        let off = (i128::from(actual) * under - exact).abs();
                        assert!(
                            off <= bound * under,
                            "off by {} of {bound} at {at:?} of {polygon:?}",
                            off as f64 / under as f64
                        );
                        if !by_map && !close && span.len == 1 {
                            self.worst = self.worst.max(off as f64 / under as f64);
                        }
                    }
                    *if by_map {
                        &mut self.by_map
                    } else {
                        &mut self.by_sides
                    } += 1;
                    self.close += u32::from(close && !by_map);
                }
            }
        }
    }
}

/// Where the crossings of a column lie close together, their rounding moves a pixel's share of the distance
/// between them by much: by all of it where the distance is below 2^-23 pixel.
#[test]
fn slivers_have_the_coordinates_of_the_exact_map() {
    let mut random = seeded::generator();
    let texels = vec![0; 256 * 256];
    let texture = Texture::new(&texels, 256, 256).unwrap();
    let triangle = |corners: [(i32, i32, i32); 3]| {
        corners.map(|(x, y, u)| Vertex {
            x,
            y,
            u: u << 16,
            v: (256 - u) << 16,
        })
    };
    let mut compared = Compared::default();
    for corners in [
        // Interpolation between the rounded crossings is off by 0.011 and by 85.7 texels.
        [
            (41_093, 30_852, 0),
            (41_089, 30_849, 256),
            (41_082, 30_843, 0),
        ],
        [
            (21_571, 36_449, 256),
            (131_353, 36_520, 256),
            (103_521, 36_502, 0),
        ],
    ] {
        let before = compared.close;
        compared.check(&triangle(corners), &texture);
        assert!(compared.close > before, "{corners:?}");
    }
    for _ in 0..seeded::cases(100_000) {
        let size = [(256, 256), (256, 1), (3, 100)][random.usize(..3)];
        let texels = &texels[..usize::from(size.0) * usize::from(size.1)];
        let texture = Texture::new(texels, size.0, size.1).unwrap();
        let sides = [3, 3, 4, 5][random.usize(..4)];
        compared.check(&sliver(&mut random, sides, size), &texture);
    }
    println!("{compared:?}");
    assert!(
        !seeded::is_whole()
            || compared.by_map > 10_000 && compared.by_sides > 100_000 && compared.close > 10_000,
        "{compared:?}"
    );
}

/// No swimming: if a texture moves by 1/256 pixel, the coordinates at each pixel change by the corresponding
/// amount, within twice the mapper's error.
#[test]
fn a_small_motion_moves_no_texel_by_more_than_its_bound() {
    let mut random = seeded::generator();
    let texels = [0; 64 * 16];
    let texture = Texture::new(&texels, 64, 16).unwrap();
    let mut compared = 0;
    for case in 0..seeded::cases(5_000) {
        let triangle: Vec<_> = (0..3)
            .map(|_| vertex(&mut random, (160 * 256, 120 * 256), 60 * 256, 1, (64, 16)))
            .collect();
        let (dx, dy) = [(1, 0), (0, 1), (-1, 0), (0, -1)][case % 4];
        let moved: Vec<_> = triangle
            .iter()
            .map(|&at| Vertex {
                x: at.x + dx,
                y: at.y + dy,
                ..at
            })
            .collect();
        let [a, b, c] = [0, 1, 2].map(|i| {
            let at: &Vertex = &triangle[i];
            [at.x, at.y, at.u, at.v].map(i128::from)
        });
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        let rule = [by_sides, by_map][case / 4 % 2];
        let after = drawn(&moved, &texture, rule);
        for (at, (u, v)) in drawn(&triangle, &texture, rule) {
            let Some(&(u_after, v_after)) = after.get(&at) else {
                continue;
            };
            for (k, before, after) in [(2, u, u_after), (3, v, v_after)] {
                // The coordinate's change times `area` when the triangle moves by (dx, dy).
                let across = (b[k] - a[k]) * (c[1] - a[1]) - (c[k] - a[k]) * (b[1] - a[1]);
                let down = (c[k] - a[k]) * (b[0] - a[0]) - (b[k] - a[k]) * (c[0] - a[0]);
                let worth = -(across * i128::from(dx) + down * i128::from(dy));
                let change = i128::from(after - before) * area;
                let off = (change - worth).abs();
                assert!(off * 64 <= area.abs() << 16, "{at:?} of {triangle:?}");
            }
            compared += 1;
        }
    }
    assert!(
        !seeded::is_whole() || compared > 1_000_000,
        "only {compared} pixels were compared"
    );
}

/// The limits of the legal range: half of the texture's width per pixel, a corner as far out as allowed, a
/// tiny area. One step further out, no map exists.
#[test]
fn a_map_holds_at_the_ends_of_its_range() {
    let texels = vec![0; 256 * 256];
    let texture = Texture::new(&texels, 256, 256).unwrap();
    let (left, top) = (160 * 256 - AffineMap::REACH, 120 * 256 - AffineMap::REACH);
    let (right, bottom) = (left + 2 * AffineMap::REACH, top + 2 * AffineMap::REACH);
    let side = 256 << 16;
    let triangle =
        |corners: [(i32, i32, i32, i32); 3]| corners.map(|(x, y, u, v)| Vertex { x, y, u, v });
    let widest = [
        (left, top, 0, side),
        (right, top, side, 0),
        (left, bottom, side, side),
    ];
    let drawn = drawn(&triangle(widest), &texture, by_map);
    // The triangle's long side goes through the centre of the screen.
    assert!(drawn.len() > modex::WIDTH * modex::HEIGHT * 2 / 5);
    for corner in 0..3 {
        for (x, y) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let mut beyond = triangle(widest);
            beyond[corner].x += x;
            beyond[corner].y += y;
            let inside =
                |at: &Vertex| (left..=right).contains(&at.x) && (top..=bottom).contains(&at.y);
            let legal = beyond.iter().all(inside);
            assert_eq!(by_map(&beyond, &texture).is_some(), legal, "{beyond:?}");
        }
    }
    // 256 texels a pixel are too many, in either direction and sense.
    let steep =
        |(x, y): (i32, i32), u| triangle([(0, 0, u, 0), (x, y, side - u, 0), (y, -x, u, 0)]);
    for (x, y) in [(1, 0), (0, 1), (-1, 0), (0, -1)] {
        for u in [0, side] {
            assert!(by_map(&steep((256 * x, 256 * y), u), &texture).is_none());
            assert!(by_map(&steep((257 * x, 257 * y), u), &texture).is_some());
        }
    }
    // An empty triangle, and a polygon that is not a triangle.
    assert!(
        by_map(
            &triangle([(0, 0, 0, 0), (256, 256, 0, 0), (512, 512, 0, 0)]),
            &texture
        )
        .is_none()
    );
    let four = [Vertex::default(); 4];
    assert!(by_map(&four, &texture).is_none());
}
