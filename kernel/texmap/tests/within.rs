//! The mappers that keep to an error: they do, and no cheaper way of the table would have.

mod random;

use std::collections::BTreeMap;

use oracle::coverage::inside;
use random::{COLUMNS, DEEP_COLUMNS, generator, off, side};
use texmap::bounds::{Affine, Bend};
use texmap::coverage::{self, Axis};
use texmap::plane::{self, Anchor};
use texmap::runs::{Pieces, between};
use texmap::within::{Way, Within};
use texmap::{Face, Mapper, Point, Texture, Tolerance, Vertex, Walk};

const FOCAL_LENGTH: i32 = 258;

/// A face that is seen: its corners in space, and where they are on the screen.
struct Seen {
    polygon: Vec<Vertex>,
    anchors: [Anchor; 3],
}

/// A quarter of a plane, or half of one, that a rectangle of the texture lies on: small facets, walls,
/// floors to the horizon, and anything.
fn seen(random: &mut fastrand::Rng, size: (u16, u16)) -> Option<Seen> {
    let kind = random.u8(0..4);
    let (w, h) = (i32::from(size.0) << 16, i32::from(size.1) << 16);
    let mut part = |length: i32| match random.bool() {
        true => (0, length),
        false => {
            let (a, b) = (random.i32(0..=length), random.i32(0..=length));
            (a.min(b), a.max(b))
        }
    };
    let (u, v) = (part(w), part(h));
    let space = |random: &mut fastrand::Rng, reach: f64| {
        [(); 3].map(|()| (random.f64() * 2.0 - 1.0) * reach)
    };
    // Depths in units of 16.16; the nearest corner decides how much of the screen it is.
    let near = (16.0 + 4.0 * random.f64()).exp2();
    let (origin, right, down) = match kind {
        // A facet: small, as it is on a ball.
        0 => {
            let [x, y, _] = space(random, near / 2.0);
            let reach = near * (-2.0 - 4.0 * random.f64()).exp2();
            ([x, y, near], space(random, reach), space(random, reach))
        }
        // A floor or a ceiling.
        1 => {
            let y = [1.0, -1.0][random.usize(..2)] * near * (0.1 + random.f64());
            let far = near * (8.0 * random.f64()).exp2();
            let x = (random.f64() * 2.0 - 1.0) * near;
            (
                [x, y, near],
                [near * 2.0, 0.0, 0.0],
                [0.0, 0.0, far.min(1.6e7) - near],
            )
        }
        // A wall that goes away to the side.
        2 => {
            let far = near * (6.0 * random.f64()).exp2();
            let [x, y, _] = space(random, near / 2.0);
            (
                [x, y, near],
                [near * random.f64(), 0.0, far.min(1.6e7) - near],
                [0.0, near, 0.0],
            )
        }
        _ => {
            let [x, y, _] = space(random, near);
            (
                [x, y, near * 2.0],
                space(random, near * 1.9),
                space(random, near * 1.9),
            )
        }
    };
    let corner = |i: i32, j: i32| {
        let at = [0, 1, 2].map(|k| origin[k] + f64::from(i) * right[k] + f64::from(j) * down[k]);
        Anchor {
            position: at.map(|k| (k as i32).clamp(-1 << 24, 1 << 24)),
            u: [u.0, u.1][i as usize],
            v: [v.0, v.1][j as usize],
        }
    };
    let mut corners = vec![corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
    if random.bool() {
        corners.remove(random.usize(..4));
    }
    let place = |corner: &Anchor| {
        let [x, y, z] = corner.position.map(f64::from);
        let at = |k: f64, middle: f64| (256.0 * (middle + k / z * f64::from(FOCAL_LENGTH))).round();
        let (x, y) = (at(x, 160.0), at(y, 120.0));
        let limit = f64::from(texmap::MAX_COORDINATE);
        (z > 256.0 && x.abs() <= limit && y.abs() <= limit).then_some(Vertex {
            x: x as i32,
            y: y as i32,
            u: corner.u,
            v: corner.v,
        })
    };
    Some(Seen {
        polygon: corners.iter().map(place).collect::<Option<_>>()?,
        anchors: [corners[0], corners[1], corners[2]],
    })
}

/// Gives `sink` columns of faces as [`seen`] makes them, at least so many.
fn columns(
    least: u32,
    random: &mut fastrand::Rng,
    mut sink: impl FnMut(&Face<'_>, &plane::Plane, &Texture<'_>, &coverage::Run),
) {
    let texels = vec![0; 1 << 16];
    let mut count = 0;
    while count < least {
        let size = (side(random), side(random));
        let texture = &texels[..usize::from(size.0) * usize::from(size.1)];
        let texture = Texture::new(texture, size.0, size.1).unwrap();
        let Some(Seen { polygon, anchors }) = seen(random, size) else {
            continue;
        };
        let face = Face {
            polygon: &polygon,
            texture: 0,
            anchors,
            focal_length: FOCAL_LENGTH,
        };
        let plane = face.plane();
        coverage::columns(&polygon, |run| {
            sink(&face, &plane, &texture, &run);
            count += 1;
        })
        .unwrap();
    }
}

/// Which way a column went, by name.
fn name(walk: &Walk, flat: bool) -> &'static str {
    match walk {
        Walk::Affine(_) if flat => "flat",
        Walk::Affine(_) => "whole",
        Walk::Linear(_, Pieces::Of(64)) => "linear-64",
        Walk::Linear(_, Pieces::Of(32)) => "linear-32",
        Walk::Linear(_, Pieces::Of(16)) => "linear-16",
        Walk::Linear(_, Pieces::Of(8)) => "linear-8",
        Walk::Linear(_, Pieces::Of(4)) => "linear-4",
        Walk::Quadratic(_, Pieces::Whole) => "quadratic",
        Walk::Quadratic(_, Pieces::Of(32)) => "quadratic-32",
        Walk::Quadratic(_, Pieces::Of(16)) => "quadratic-16",
        Walk::Exact(_) => "exact",
        other => panic!("no way of the table: {other:?}"),
    }
}

fn within(least: u32, tolerance: &str) {
    let mut random = generator();
    let tolerance = Tolerance::parse(tolerance).unwrap();
    let mut ways = BTreeMap::new();
    let (mut worst, mut pixels, mut count, mut parts) = (0f64, 0u64, 0u32, 0u32);
    columns(least, &mut random, |face, plane, texture, run| {
        let within = Within::new(face.polygon, *plane, texture, tolerance);
        let x = run.line;
        let mut next = run.first;
        let flat = within.flat(x, run.first, run.len);
        within.parts((x, run.first), run.len, texture, &mut |y, len, walk| {
            assert_eq!(y, next, "a part begins where another ended");
            next += len;
            let forms = plane::Walk::new(plane, Axis::Down, x, y);
            let bend = Bend::new(&forms, len, texture);
            // Nothing cheaper keeps to it, by its own bound.
            let keeps = |way: Way| way.bound(&bend) <= tolerance.units();
            let cheapest = Way::ALL
                .iter()
                .copied()
                .filter(|&(way, _)| keeps(way))
                .min_by_key(|&(way, cost)| way.cost(cost, len))
                .expect("the quotients are none off")
                .0;
            let expected = match (flat, cheapest) {
                (Some(walk), _) => Walk::Affine(walk),
                (None, Way::Linear(Pieces::Whole)) => {
                    let [from, to] = bend.ends;
                    Walk::Affine(between(from, to, len - 1))
                }
                (None, Way::Linear(pieces)) => Walk::Linear(forms, pieces),
                (None, Way::Quadratic(pieces)) => Walk::Quadratic(forms, pieces),
                (None, Way::Exact) => Walk::Exact(forms),
            };
            assert_eq!(walk, expected, "{run:?} of {:?}", face.polygon);
            *ways.entry(name(&walk, flat.is_some())).or_insert(0u32) += 1;
            parts += 1;
            // And it is no further off than that; the exact coordinates are rounded down.
            let job = texmap::Job {
                axis: Axis::Down,
                x,
                y,
                len,
                texture: 0,
                walk,
            };
            let size = (texture.width(), texture.height());
            job.pixels(texture, |(_, row), coordinates| {
                let off = off(&forms, row - y, coordinates, size);
                let context = || format!("{walk:?} {run:?} of {:?}", face.polygon);
                assert!(
                    off <= f64::from(tolerance.units()),
                    "{off} at {row}: {}",
                    context()
                );
                worst = worst.max(off);
            });
        });
        assert_eq!(next, run.first + run.len, "all of the run is mapped");
        pixels += u64::from(run.len);
        count += 1;
    });
    let share = |count: u32, all: u32| f64::from(count) / f64::from(all) * 100.0;
    let list = ways
        .iter()
        .map(|(name, &n)| format!("{name} {:.1}", share(n, parts)));
    let list: Vec<_> = list.collect();
    println!(
        "within {tolerance}: {count} columns of {} pixels, worst {:.1} % of it; {parts} parts, in %: {}",
        pixels / u64::from(count),
        worst / f64::from(tolerance.units()) * 100.0,
        list.join(", ")
    );
    // Hardly any face is flat to 1/256 texel.
    let rough = tolerance >= Tolerance::parse("1/4").unwrap();
    assert!(
        (ways.contains_key("flat") || !rough) && ways.len() >= 4,
        "{ways:?}"
    );
    assert!(worst >= 0.8 * f64::from(tolerance.units()));
}

#[test]
fn every_column_keeps_to_its_error_and_none_wastes_anything() {
    for tolerance in ["1", "1/2", "1/4", "1/16", "1/256"] {
        within(COLUMNS, tolerance);
    }
}

/// `cargo test --release -p texmap --test within -- --ignored --nocapture`
#[test]
#[ignore = "a million columns for each error: a minute in a release build"]
fn every_column_of_a_million_keeps_to_its_error() {
    for tolerance in ["1", "1/2", "1/4", "1/16", "1/256"] {
        within(DEEP_COLUMNS, tolerance);
    }
}

#[test]
fn affine_columns_keep_to_their_closed_form_and_reach_it() {
    affine(COLUMNS);
}

/// `cargo test --release -p texmap --test within -- --ignored --nocapture`
#[test]
#[ignore = "a million columns: a minute in a release build"]
fn a_million_affine_columns_keep_to_their_closed_form() {
    affine(DEEP_COLUMNS);
}

fn affine(least: u32) {
    let mut random = generator();
    let (mut tightest, mut sum, mut count) = (0f64, 0f64, 0u32);
    let mut held: Option<(Vec<Vertex>, Affine, texmap::affine::Sides)> = None;
    columns(least, &mut random, |face, plane, texture, run| {
        if held
            .as_ref()
            .is_none_or(|(polygon, ..)| polygon != face.polygon)
        {
            let bounds = Affine::new(face.polygon, plane, texture);
            let sides = texmap::affine::Sides::new(face.polygon, texture, Axis::Down).unwrap();
            held = Some((face.polygon.to_vec(), bounds, sides));
        }
        let Some((_, bounds, sides)) = &held else {
            return;
        };
        let bound = f64::from(bounds.column(run));
        let forms = plane::Walk::new(plane, Axis::Down, run.line, run.first);
        let size = (texture.width(), texture.height());
        let mut error = 0f64;
        for (i, at) in (0..run.len).zip(sides.walk(run)) {
            error = error.max(off(&forms, i, at, size));
        }
        assert!(
            error <= bound + 1e-6,
            "{error} above {bound}: {run:?} of {:?}",
            face.polygon
        );
        let most = f64::from(size.0.max(size.1)) * 65536.0;
        // Far above what fixed point adds, and below what any two coordinates differ by.
        if bound > 8192.0 && bound < 0.7 * most {
            tightest = tightest.max(error / bound);
            sum += error / bound;
            count += 1;
        }
    });
    println!(
        "{:.1} % of the bound at most, {:.1} % in the mean of {count} columns",
        tightest * 100.0,
        sum / f64::from(count) * 100.0
    );
    assert!(tightest >= 0.8, "the bound is loose: {tightest}");
}

#[test]
fn names_say_the_error() {
    for name in [
        "within-1",
        "within-1/2",
        "within-1/256",
        "within-3/8",
        "within-2",
    ] {
        let mapper = Mapper::parse(name).expect("a name");
        assert_eq!(mapper.to_string(), name);
    }
    let third = Mapper::parse("within-1/3").unwrap();
    assert_eq!(Mapper::parse(&third.to_string()), Some(third));
    assert_eq!(Mapper::parse("within-2/4"), Mapper::parse("within-1/2"));
    for name in [
        "within-",
        "within-0",
        "within-1/0",
        "within-257",
        "within-1/65537",
        "within-x",
    ] {
        assert_eq!(Mapper::parse(name), None, "{name}");
    }
    for &(name, mapper, _) in Mapper::ALL {
        assert_eq!(
            (Mapper::parse(name), mapper.to_string().as_str()),
            (Some(mapper), name)
        );
    }
}

/// The faces of these tests cover the pixels that their polygons do.
#[test]
fn a_run_is_inside_its_polygon() {
    let mut random = generator();
    columns(2_000, &mut random, |face, _, _, run| {
        let points: Vec<Point> = face.polygon.iter().map(|&vertex| vertex.into()).collect();
        assert!(inside(&points, run.line.into(), run.first.into()));
    });
}

/// A sliver that faces the eye, with a texture squeezed into it: 320 texels from a pixel to the next,
/// half as many back from a row to the next. Nothing leans, so only how steep it is speaks against one map.
#[test]
fn a_sliver_with_more_texels_a_pixel_than_a_texture_has_keeps_to_its_error() {
    let texture = Texture::new(&[0; 256 * 256], 256, 256).unwrap();
    let corners = [(99, 0, 0), (102, 240, 0), (142, 240, 240), (139, 0, 240)];
    let corners = corners.map(|(x, u, v)| (x, if v == 0 { 100 } else { 180 }, u << 16, v << 16));
    // In quarters of a pixel, before the middle of the screen.
    let place = |(x, y, u, v)| Anchor {
        position: [(x - 100) * 1024, (y - 100) * 1024, FOCAL_LENGTH << 12],
        u,
        v,
    };
    let [a, b, c, _] = corners.map(place);
    let polygon = corners.map(|(x, y, u, v)| Vertex {
        x: 160 * 256 + (x - 100) * 64,
        y: 120 * 256 + (y - 100) * 64,
        u,
        v,
    });
    let face = Face {
        polygon: &polygon,
        texture: 0,
        anchors: [a, b, c],
        focal_length: FOCAL_LENGTH,
    };
    let mut pixels = 0;
    for mapper in ["within-1", "within-1/256"] {
        let jobs = Mapper::parse(mapper).unwrap().jobs(&face, &texture, |job| {
            let forms = plane::Walk::new(&face.plane(), Axis::Down, job.x, job.y);
            job.pixels(&texture, |(_, y), at| {
                let off = off(&forms, y - job.y, at, (256, 256));
                assert!(off <= 65536.0, "{off} at {y} of {job:?}");
                pixels += 1;
            });
        });
        jobs.unwrap();
    }
    assert!(pixels >= 20, "{pixels}");
}
