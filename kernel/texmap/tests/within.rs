//! The mappers that keep to an error: checks that they do, and that no cheaper method of the table would keep
//! to the error.

mod random;

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use oracle::coverage::inside;
use random::{COLUMNS, DEEP_COLUMNS, off, side};
use texmap::mappers::adaptive::{AdaptivePieces, EXACT, LENGTHS, PIECE};
use texmap::mappers::affine::Sides;
use texmap::mappers::within::{ROW, Within};
use texmap::plane::bounds::SpanBound;
use texmap::plane::{Anchor, Plane};
use texmap::scan::{self, Span};
use texmap::{
    Axis, Face, Mapper, PlaneStepper, Point, SpanKind, Subdivision, Texture, Tolerance, Vertex,
};

const FOCAL_LENGTH: i32 = 258;

/// A visible face: its corners in space and on the screen.
struct Seen {
    polygon: Vec<Vertex>,
    anchors: [Anchor; 3],
}

/// Returns a face on a part of a plane, with a rectangle of the texture: small facets, walls, floors to the
/// horizon, and anything.
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
    // Depths in units of 16.16; the nearest corner decides how much of the screen the face covers.
    let near = (16.0 + 4.0 * random.f64()).exp2();
    let (origin, right, down) = match kind {
        // A facet, small as on a ball.
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
        // A wall that recedes to the side.
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

/// Passes random faces from [`seen`] to `sink` until it breaks.
fn faces(
    random: &mut fastrand::Rng,
    mut sink: impl FnMut(&Face<'_>, &Plane, &Texture<'_>) -> ControlFlow<()>,
) {
    let texels = vec![0; 1 << 16];
    loop {
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
        if sink(&face, &face.plane(), &texture).is_break() {
            return;
        }
    }
}

/// Passes at least `least` columns of such faces to `sink`.
fn columns(
    least: u32,
    random: &mut fastrand::Rng,
    mut sink: impl FnMut(&Face<'_>, &Plane, &Texture<'_>, &Span),
) {
    let mut count = 0;
    faces(random, |face, plane, texture| {
        scan::columns(face.polygon, |span| {
            sink(face, plane, texture, &span);
            count += 1;
        })
        .unwrap();
        enough(count >= least)
    });
}

fn enough(enough: bool) -> ControlFlow<()> {
    match enough {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}

/// Returns the forms along a span.
fn forms(plane: &Plane, axis: Axis, span: &Span<()>) -> PlaneStepper {
    PlaneStepper::along(plane, axis, span.line, span.first)
}

/// Returns the stepper that starts at pixel `first` of `stepper`.
fn from(stepper: &PlaneStepper, first: u16) -> PlaneStepper {
    PlaneStepper {
        at: stepper.after(first),
        ..*stepper
    }
}

/// Returns whether all of a span may be one line, by the closed form.
fn keeps(stepper: &PlaneStepper, len: u16, tolerance: Tolerance, texture: &Texture<'_>) -> bool {
    let first = AdaptivePieces::new(stepper, len, None, tolerance, texture).next();
    first.is_some_and(|piece| piece.len == len)
}

/// Checks that no cheaper method would have kept to the error by its own bound, by trying all of them. Counts
/// the pixels of each method; an adaptive span's pieces count by their lengths.
fn none_cheaper(
    stepper: &PlaneStepper,
    (len, row): (u16, Option<u16>),
    tolerance: Tolerance,
    texture: &Texture<'_>,
    mut count: impl FnMut(&'static str, u16),
) {
    let keeps = |first: u16, len: u16| keeps(&from(stepper, first), len, tolerance, texture);
    assert!(!keeps(0, len), "a line would do");
    let backward = stepper.step[2] > 0;
    // The line of `steps` steps from pixel `near` of the span, away from its near end.
    let line = |near: u16, steps: u16| match backward {
        false => keeps(near, steps + 1),
        true => keeps(near - steps, steps + 1),
    };
    let place = |done: u16| if backward { len - 1 - done } else { done };
    let mut pieces = AdaptivePieces::new(stepper, len, row, tolerance, texture);
    let mut done = 0;
    for piece in pieces.by_ref() {
        let left = len - 1 - done;
        let longer = LENGTHS
            .iter()
            .filter(|&&length| length > piece.len + 3 && length <= left);
        for &length in longer {
            assert!(
                !line(place(done), length),
                "{length} pixels in place of {piece:?} would do"
            );
        }
        count(
            if piece.len < 32 {
                "lines"
            } else {
                "long lines"
            },
            piece.len,
        );
        done += piece.len;
    }
    if let Some((_, rest, _)) = pieces.rest() {
        let shortest = LENGTHS[LENGTHS.len() - 1];
        if rest > shortest {
            assert!(
                !line(place(done), shortest),
                "a line in place of {rest} quotients"
            );
        }
        // Pixels for which a quadratic of 32 pixels would have needed three quarters of the time.
        let curves = (done..len - 1).step_by(32).filter(|&at| at + 32 < len);
        let first = |at: u16| if backward { len - 1 - at - 32 } else { at };
        let bounds = curves.map(|at| SpanBound::new(&from(stepper, first(at)), 33, texture));
        let curved =
            bounds.filter(|bound| bound.quadratic(Subdivision::Whole) <= tolerance.units());
        let curved = 32 * curved.count() as u16;
        count("exact, a curve would do", curved);
        count("exact", rest - curved);
    }
}

/// Checks that, in rows and in columns, no pixel of any face exceeds the tolerance, and that no cheaper
/// method than the chosen method would keep to it.
fn within(least: u32, tolerance: &str) {
    let least = seeded::cases(least as usize) as u32;
    let mut random = seeded::generator();
    let tolerance = Tolerance::parse(tolerance).unwrap();
    let mut ways = [BTreeMap::new(), BTreeMap::new()];
    let (mut worst, mut pixels, mut spans) = (0f64, [0u64; 2], [0; 2]);
    faces(&mut random, |face, plane, texture| {
        let within = Within::new(face.polygon, *plane, texture, tolerance);
        for axis in [Axis::Down, Axis::Right] {
            let k = usize::from(axis == Axis::Right);
            let mut kind_of = within.kinds(texture);
            scan::spans(axis, face.polygon, |span| {
                let forms = forms(plane, axis, &span);
                let kind = match axis == within.axis() {
                    true => kind_of(&span),
                    // As if rows were cheaper, or columns.
                    false => SpanKind::Adaptive(forms, tolerance),
                };
                let (x, y, row) = match axis {
                    Axis::Down => (span.line, span.first, None),
                    Axis::Right => (span.first, span.line, Some(span.first)),
                };
                let mut count = |way, pixels: u16| {
                    *ways[k].entry(way).or_insert(0u64) += u64::from(pixels);
                };
                match kind {
                    SpanKind::Affine(_) if within.map().is_some() => count("one map", span.len),
                    SpanKind::Affine(_) => count("a line", span.len),
                    SpanKind::Adaptive(..) if keeps(&forms, span.len, tolerance, texture) => {
                        count("a line", span.len);
                    }
                    SpanKind::Adaptive(..) => {
                        none_cheaper(&forms, (span.len, row), tolerance, texture, count);
                    }
                    other => panic!("no way of the table: {other:?}"),
                }
                let job = texmap::Job {
                    axis,
                    x,
                    y,
                    len: span.len,
                    texture: 0,
                    kind,
                };
                let size = (texture.width(), texture.height());
                job.pixels(texture, |(to_x, to_y), coordinates| {
                    let off = off(&forms, (to_x - x) + (to_y - y), coordinates, size);
                    let context = || format!("{kind:?} {span:?} of {:?}", face.polygon);
                    assert!(
                        off <= f64::from(tolerance.units()),
                        "{off} at {to_x}, {to_y}: {}",
                        context()
                    );
                    worst = worst.max(off);
                });
                pixels[k] += u64::from(span.len);
                spans[k] += 1;
            })
            .unwrap();
        }
        enough(spans.iter().all(|&spans| spans >= least))
    });
    if !seeded::is_whole() {
        return;
    }
    println!(
        "within {tolerance}: worst {:.1} % of it",
        worst / f64::from(tolerance.units()) * 100.0
    );
    for (k, name) in ["columns", "rows"].into_iter().enumerate() {
        let share = |(way, &of): (&&str, &u64)| {
            format!("{way} {:.1}", of as f64 / pixels[k] as f64 * 100.0)
        };
        let shares: Vec<_> = ways[k].iter().map(share).collect();
        println!(
            "  {} {name} of {} pixels; of these, in %: {}",
            spans[k],
            pixels[k] / u64::from(spans[k]),
            shares.join(", ")
        );
        for way in ["a line", "exact", "lines", "long lines"] {
            assert!(ways[k].contains_key(way), "{name}: {way}");
        }
        // So few that a separate method for curves does not pay.
        let few = if tolerance.units() >= 1 << 12 { 2 } else { 12 };
        assert!(
            ways[k]["exact, a curve would do"] * 100 <= pixels[k] * few,
            "{name}"
        );
    }
    // Hardly any face is flat to 1/256 texel.
    let rough = tolerance >= Tolerance::parse("1/4").unwrap();
    assert!(ways[0].contains_key("one map") || !rough);
    assert!(worst >= 0.8 * f64::from(tolerance.units()));
}

/// The lengths of pieces are those that pay.
#[test]
fn a_shorter_piece_would_cost_more_than_quotients() {
    let shortest = u32::from(LENGTHS[LENGTHS.len() - 1]);
    assert!(PIECE + shortest < EXACT * shortest);
    let less = shortest - 4;
    assert!(PIECE + less >= EXACT * less);
    assert!(LENGTHS.windows(2).all(|pair| pair[0] > pair[1]));
    assert!(LENGTHS.iter().all(|length| length % 4 == 0));
}

/// Returns the cost of an axis, by the pieces into which its spans are cut, in pixels of a line.
fn cost(face: &Face<'_>, axis: Axis, tolerance: Tolerance, texture: &Texture<'_>) -> u64 {
    let (plane, piece) = (
        face.plane(),
        if axis == Axis::Right {
            ROW * PIECE
        } else {
            PIECE
        },
    );
    let mut cost = 0;
    scan::spans(axis, face.polygon, |span| {
        let row = (axis == Axis::Right).then_some(span.first);
        let forms = forms(&plane, axis, &span);
        let mut pieces = AdaptivePieces::new(&forms, span.len, row, tolerance, texture);
        cost += pieces.by_ref().count() as u64 * u64::from(piece) + u64::from(span.len);
        let exact = pieces.rest().map_or(0, |(_, len, _)| u64::from(len));
        cost += exact * u64::from(EXACT - 1);
    })
    .unwrap();
    cost
}

/// The axis is chosen from a polygon's corners. Measures how close that choice comes to the cost of all
/// spans.
#[test]
fn the_chosen_axis_is_nearly_always_the_cheaper_axis() {
    let mut random = seeded::generator();
    for tolerance in ["1", "1/4", "1/16"] {
        let tolerance = Tolerance::parse(tolerance).unwrap();
        let (mut count, mut rows, mut sums) = (0, 0, [0; 3]);
        faces(&mut random, |face, plane, texture| {
            let within = Within::new(face.polygon, *plane, texture, tolerance);
            if within.map().is_none() {
                let costs =
                    [Axis::Down, Axis::Right].map(|axis| cost(face, axis, tolerance, texture));
                let is_row = within.axis() == Axis::Right;
                let all = [costs[usize::from(is_row)], costs[0].min(costs[1]), costs[0]];
                sums = [0, 1, 2].map(|k| sums[k] + all[k]);
                rows += usize::from(is_row);
                count += 1;
            }
            enough(count >= seeded::cases(3000))
        });
        if !seeded::is_whole() {
            continue;
        }
        let [taken, best, columns] = sums;
        println!(
            "within {tolerance}: rows for {rows} of {count} faces, {:.3} of what the cheaper axis of each takes; \
             columns {:.3}",
            taken as f64 / best as f64,
            columns as f64 / best as f64
        );
        assert!(taken * 100 < best * 105 && taken * 100 < columns * 95);
        assert!(rows * 20 > count && rows * 20 < count * 19);
    }
}

#[test]
fn every_span_keeps_to_its_error_at_the_least_cost() {
    for tolerance in ["1", "1/2", "1/4", "1/16", "1/256"] {
        within(COLUMNS, tolerance);
    }
}

/// `cargo test --release -p texmap --test within -- --ignored --nocapture`
#[test]
#[ignore = "a million columns and rows for each error: some minutes in a release build"]
fn every_span_of_a_million_keeps_to_its_error() {
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

/// The error bound of the affine mapper in a polygon, in units of 2^-16 texel: see [`Sides::stepper`].
///
/// A corner's own coordinates differ slightly from the quotients at the place where the corner is snapped to.
/// Between two corners a coordinate is a chord along the side, and down the column it is another chord
/// between points of two sides: these errors add up.
struct AffineBound {
    plane: Plane,
    /// The largest error of a coordinate on any side, including the corners.
    sides: f64,
    /// The size of the texture, which no error exceeds: both coordinates are inside.
    most: f64,
}

impl AffineBound {
    /// Allowance for fixed point: 2^-7 texel, most of it for a texture that is squeezed into a sliver.
    const ROUNDING: f64 = 512.0;

    fn new(polygon: &[Vertex], plane: &Plane, texture: &Texture<'_>) -> Self {
        let (u, v) = texture.last();
        let mut bound = Self {
            plane: *plane,
            sides: 0.0,
            most: f64::from(u.max(v) + 1),
        };
        let mut corners = 0f64;
        for (i, a) in polygon.iter().enumerate() {
            let b = &polygon[(i + 1) % polygon.len()];
            let (from, to) = (bound.at(a.x, a.y), bound.at(b.x, b.y));
            bound.sides = bound.sides.max(bound.chord(from, to));
            corners = corners.max(bound.corner(a, from));
        }
        bound.sides += corners;
        bound
    }

    /// Returns the bound in a column of the polygon.
    fn column(&self, span: &Span) -> f64 {
        // The crossings have 32 fraction bits and are off by less than 2^-23. These places are at least 1/256
        // pixel further out.
        let [top, bottom] = span.ends.map(|crossing| (crossing.at >> 24) as i32);
        let x = i32::from(span.line) * 256 + 128;
        let column = self.chord(self.at(x, top - 1), self.at(x, bottom + 2));
        (column + self.sides + Self::ROUNDING).min(self.most)
    }

    /// Returns the quotients and c at a place given in 1/256 pixel, or nothing on the horizon and beyond it.
    fn at(&self, x: i32, y: i32) -> Option<[f64; 3]> {
        let [a, b, c] = [self.plane.a, self.plane.b, self.plane.c].map(|form| {
            let right = i128::from(form.right) * i128::from(x - 128);
            let down = i128::from(form.down) * i128::from(y - 128);
            (i128::from(form.origin) * 256 + right + down) as f64
        });
        (c > 0.0).then_some([a / c * 65536.0, b / c * 65536.0, c])
    }

    /// Returns how far the coordinates of a corner are from the quotients there.
    fn corner(&self, vertex: &Vertex, at: Option<[f64; 3]>) -> f64 {
        at.map_or(self.most, |[u, v, _]| {
            let off = (u - f64::from(vertex.u))
                .abs()
                .max((v - f64::from(vertex.v)).abs());
            off.min(self.most) + 1.0
        })
    }

    /// Returns the closed form for a chord between two places.
    fn chord(&self, from: Option<[f64; 3]>, to: Option<[f64; 3]>) -> f64 {
        let (Some(from), Some(to)) = (from, to) else {
            return self.most;
        };
        let root = (from[2].max(to[2]) / from[2].min(to[2])).sqrt();
        let change = (to[0] - from[0]).abs().max((to[1] - from[1]).abs());
        (change * (root - 1.0) / (root + 1.0)).min(self.most)
    }
}

fn affine(least: u32) {
    let least = seeded::cases(least as usize) as u32;
    let mut random = seeded::generator();
    let (mut tightest, mut sum, mut count) = (0f64, 0f64, 0u32);
    let mut held: Option<(Vec<Vertex>, AffineBound, Sides)> = None;
    columns(least, &mut random, |face, plane, texture, span| {
        if held
            .as_ref()
            .is_none_or(|(polygon, ..)| polygon != face.polygon)
        {
            let bounds = AffineBound::new(face.polygon, plane, texture);
            let sides = Sides::new(face.polygon, texture, Axis::Down).unwrap();
            held = Some((face.polygon.to_vec(), bounds, sides));
        }
        let Some((_, bounds, sides)) = &held else {
            return;
        };
        let bound = bounds.column(span);
        let forms = PlaneStepper::along(plane, Axis::Down, span.line, span.first);
        let size = (texture.width(), texture.height());
        let mut error = 0f64;
        for (i, at) in (0..span.len).zip(sides.stepper(span)) {
            error = error.max(off(&forms, i, at, size));
        }
        assert!(
            error <= bound + 1e-6,
            "{error} above {bound}: {span:?} of {:?}",
            face.polygon
        );
        let most = f64::from(size.0.max(size.1)) * 65536.0;
        // Far above the error of fixed point, and below the difference of any two coordinates.
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
    assert!(
        !seeded::is_whole() || tightest >= 0.8,
        "the bound is loose: {tightest}"
    );
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
fn a_span_is_inside_its_polygon() {
    let mut random = seeded::generator();
    columns(2_000, &mut random, |face, _, _, span| {
        let points: Vec<Point> = face.polygon.iter().map(|&vertex| vertex.into()).collect();
        assert!(inside(&points, span.line.into(), span.first.into()));
    });
}

/// A sliver that faces the eye, with a texture squeezed into it: 320 texels from a pixel to the next, and
/// half as many back from a row to the next. The depth is constant, so only the steepness rules out a single
/// map.
#[test]
fn a_sliver_with_more_texels_a_pixel_than_a_texture_has_keeps_to_its_error() {
    let texture = Texture::new(&[0; 256 * 256], 256, 256).unwrap();
    let corners = [(99, 0, 0), (102, 240, 0), (142, 240, 240), (139, 0, 240)];
    let corners = corners.map(|(x, u, v)| (x, if v == 0 { 100 } else { 180 }, u << 16, v << 16));
    // In quarters of a pixel, relative to the centre of the screen.
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
            let forms = PlaneStepper::new(&face.plane(), job.axis, job.x, job.y);
            job.pixels(&texture, |(x, y), at| {
                let off = off(&forms, (x - job.x) + (y - job.y), at, (256, 256));
                assert!(off <= 65536.0, "{off} at {y} of {job:?}");
                pixels += 1;
            });
        });
        jobs.unwrap();
    }
    assert!(pixels >= 20, "{pixels}");
}
