//! Checks the oracle against big rationals and against its own definition.

use num_bigint::BigInt;
use num_rational::BigRational;
use oracle::coverage::{Area, HEIGHT, Pixels, WIDTH, inside};
use oracle::mix::PolygonMix;
use texmap::{MAX_COORDINATE, Point};

/// Cases for the big numbers.
const CASES: usize = 100_000;

/// Decides by the definition again, in rationals: computes the crossing, and then compares it.
fn inside_in_rationals(polygon: &[Point], x: i32, y: i32) -> bool {
    let number = |n: i32, d: i32| BigRational::new(BigInt::from(n), BigInt::from(d));
    let half = number(1, 2);
    let (xc, yc) = (number(x, 1) + &half, number(y, 1) + &half);
    let mut odd = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let [ax, ay, bx, by] = [a.x, a.y, b.x, b.y].map(|c| number(c, 256));
        let (min, max) = if ay <= by { (&ay, &by) } else { (&by, &ay) };
        if min <= &yc && &yc < max {
            let crossing = &ax + (&bx - &ax) * (&yc - &ay) / (&by - &ay);
            odd ^= crossing <= xc;
        }
    }
    odd
}

/// Returns whether the pixel's centre is exactly on a side or a vertex.
fn ties(polygon: &[Point], x: i32, y: i32) -> bool {
    let (xc, yc) = (256 * i128::from(x) + 128, 256 * i128::from(y) + 128);
    (0..polygon.len()).any(|i| {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let [ax, ay, bx, by] = [a.x, a.y, b.x, b.y].map(i128::from);
        (bx - ax) * (yc - ay) == (xc - ax) * (by - ay)
            && (ax.min(bx)..=ax.max(bx)).contains(&xc)
            && (ay.min(by)..=ay.max(by)).contains(&yc)
    })
}

#[test]
fn the_oracle_agrees_with_big_rationals() {
    let mut random = seeded::generator();
    let seed = random.get_seed();
    let (mut tied, mut far, mut yes) = (0, 0, 0);
    for number in 0..seeded::cases(CASES) {
        let mix = PolygonMix::ALL[number % PolygonMix::ALL.len()];
        let mut case = mix.case(seed, number as u64);
        let mut polygon = case.polygons.swap_remove(0);
        // Every eighth polygon has its vertices at the limit or just inside.
        if number % 8 == 0 {
            let mut extreme =
                || random.choice([-1, 1]).unwrap() * (MAX_COORDINATE - random.i32(0..2));
            polygon.fill_with(|| Point {
                x: extreme(),
                y: extreme(),
            });
        }
        // A pixel near a vertex, preferably a tie, or any pixel.
        let near = polygon[random.usize(..polygon.len())];
        let pixel = |random: &mut fastrand::Rng| {
            let (dx, dy) = (random.i32(-2..=2), random.i32(-2..=2));
            (
                ((near.x >> 8) + dx).clamp(0, WIDTH - 1),
                ((near.y >> 8) + dy).clamp(0, HEIGHT - 1),
            )
        };
        let pixels: [_; 8] = std::array::from_fn(|_| pixel(&mut random));
        let tie = pixels.iter().find(|&&(x, y)| ties(&polygon, x, y));
        let any = (random.i32(0..WIDTH), random.i32(0..HEIGHT));
        let (x, y) = *tie.unwrap_or(if number % 16 == 0 { &any } else { &pixels[0] });
        let expected = inside_in_rationals(&polygon, x, y);
        let from = format_args!("({x}, {y}) of {polygon:?}, seed {seed}").to_string();
        assert_eq!(inside(&polygon, x, y), expected, "{from}");
        tied += usize::from(tie.is_some());
        far += usize::from(near.x.abs().max(near.y.abs()) >= MAX_COORDINATE - 1);
        yes += usize::from(expected);
    }
    println!("{CASES} cases: {tied} ties, {far} at the limit, {yes} inside");
    assert!(!seeded::is_whole() || tied > CASES / 10 && far > CASES / 10 && yes > CASES / 10);
}

#[test]
fn the_set_of_a_polygon_contains_exactly_the_pixels_inside() {
    let seed = seeded::generator().get_seed();
    let mut pixels = Pixels::default();
    for mix in PolygonMix::ALL {
        for number in 0..seeded::cases(40) as u64 {
            for polygon in mix.case(seed, number).polygons {
                let area = Area::around(&polygon);
                pixels.cover(&polygon, &area);
                for (x, y) in (0..WIDTH).flat_map(|x| (0..HEIGHT).map(move |y| (x, y))) {
                    let set = area.y.contains(&y) && pixels.contains(x, y);
                    assert_eq!(set, inside(&polygon, x, y), "({x}, {y}) of {polygon:?}");
                }
            }
        }
    }
}
