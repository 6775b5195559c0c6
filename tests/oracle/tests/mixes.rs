//! Checks that each mix has the property that its name states. Only a wrong scan can show whether the mixes
//! find errors.

use oracle::mix::PolygonMix;
use texmap::{MAX_COORDINATE, MAX_SIDES, Point};

fn area(a: Point, b: Point, c: Point) -> i64 {
    let d = |a: i32, b: i32| i64::from(b) - i64::from(a);
    d(a.x, b.x) * d(a.y, c.y) - d(a.x, c.x) * d(a.y, b.y)
}

/// Returns twice the area, cut into triangles from the first vertex.
fn signed_area(p: &[Point]) -> i64 {
    p.windows(2).map(|side| area(p[0], side[0], side[1])).sum()
}

fn extent(coordinates: impl Iterator<Item = i32> + Clone) -> i32 {
    coordinates.clone().max().unwrap() - coordinates.min().unwrap()
}

fn is_on_screen(p: &Point) -> bool {
    (0..320 * 256).contains(&p.x) && (0..240 * 256).contains(&p.y)
}

fn has_named_property(mix: PolygonMix, p: &[Point]) -> bool {
    let n = p.len();
    let corner = |i: usize| [p[i], p[(i + 1) % n], p[(i + 2) % n]];
    let turns = (0..n).map(|i| {
        let [a, b, c] = corner(i);
        area(a, b, c)
    });
    match mix {
        PolygonMix::Centres => p.iter().all(|p| p.x & 255 == 128 && p.y & 255 == 128),
        PolygonMix::Borders => p.iter().all(|p| p.x & 255 == 0 || p.y & 255 == 0),
        PolygonMix::Straight => p.windows(2).all(|side| {
            let (dx, dy) = (side[1].x - side[0].x, side[1].y - side[0].y);
            dx == 0 || dy == 0 || dx.abs() == dy.abs()
        }),
        // All within 2/256 of the line through the two points that are furthest apart.
        PolygonMix::Slivers => {
            let length = |a: Point, b: Point| i64::from((b.x - a.x).abs().max((b.y - a.y).abs()));
            let pairs = p.iter().flat_map(|&a| p.iter().map(move |&b| (a, b)));
            let (a, b) = pairs.max_by_key(|&(a, b)| length(a, b)).unwrap();
            p.iter().all(|&c| area(a, b, c).abs() <= 4 * length(a, b))
        }
        PolygonMix::Flat => p.iter().all(|&c| p.iter().all(|&b| area(p[0], b, c) == 0)),
        PolygonMix::Repeated => p.iter().enumerate().any(|(i, a)| p[..i].contains(a)),
        PolygonMix::Collinear => turns.clone().any(|turn| turn == 0),
        PolygonMix::Crossing => {
            turns.clone().any(|turn| turn > 0) && turns.clone().any(|turn| turn < 0)
        }
        PolygonMix::Clockwise => signed_area(p) > 0,
        PolygonMix::Anticlockwise => signed_area(p) < 0,
        PolygonMix::Outside => p.iter().any(is_on_screen) && !p.iter().all(is_on_screen),
        PolygonMix::Far => p.iter().any(|p| p.x.abs().max(p.y.abs()) > 10_000 * 256),
        PolygonMix::Tiny => extent(p.iter().map(|p| p.x)).max(extent(p.iter().map(|p| p.y))) < 256,
        PolygonMix::Fans => n == 3,
        PolygonMix::Meshes => n <= 4,
    }
}

#[test]
fn every_polygon_of_a_mix_is_legal_and_has_the_property_in_its_name() {
    let seed = seeded::generator().get_seed();
    for mix in PolygonMix::ALL {
        let mut sides = [false; MAX_SIDES];
        for number in 0..seeded::cases(5000) as u64 {
            let case = mix.case(seed, number);
            for polygon in &case.polygons {
                sides[polygon.len()] = true;
                let legal = |p: &Point| p.x.abs().max(p.y.abs()) <= MAX_COORDINATE;
                let good = polygon.iter().all(legal) && has_named_property(mix, polygon);
                assert!(good, "{mix:?} {number}: {polygon:?}");
            }
            let many = matches!(mix, PolygonMix::Fans | PolygonMix::Meshes);
            assert_eq!(case.outline.is_some(), many, "{mix:?} {number}");
            if let Some(outline) = &case.outline {
                // The areas add up: the polygons fill the outline, and no polygon is turned over.
                let sum: i64 = case.polygons.iter().map(|p| signed_area(p).abs()).sum();
                assert_eq!(sum, signed_area(outline).abs(), "{mix:?} {number}");
            }
        }
        match mix {
            _ if !seeded::is_whole() => {}
            PolygonMix::Fans | PolygonMix::Meshes => {}
            // A triangle is convex, and a triangle with a vertex in a side has four vertices.
            PolygonMix::Crossing | PolygonMix::Collinear => {
                assert!(sides[4..=8].iter().all(|&seen| seen))
            }
            _ => assert!(sides[3..=8].iter().all(|&seen| seen), "{mix:?}"),
        }
    }
}
