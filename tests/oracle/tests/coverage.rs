//! The renderer's scans against the oracle: a few seconds of the cases that `cargo sweep` runs for a chosen
//! time. Failing cases that a sweep finds are pasted into this file.

use std::fmt::Display;

use oracle::check::{CoverageCase, CoverageChecker};
use oracle::mix::PolygonMix;
use oracle::shrink::{shrink, source};
use oracle::small_world::{STEPS, TRIANGLES, triangle};
use texmap::scan;
use texmap::{Dropped, MAX_COORDINATE, MAX_SIDES, Point};

/// The number of cases of each mix: about ten seconds in all.
const CASES: usize = 100_000;

fn polygon(points: &[(i32, i32)]) -> Vec<Point> {
    points.iter().map(|&(x, y)| Point { x, y }).collect()
}

/// Returns the number of compared pixels; panics with a test to paste.
fn check(checker: &mut CoverageChecker, case: &CoverageCase, from: impl Display) -> u64 {
    checker.case(case).unwrap_or_else(|_| {
        let small = shrink(checker, case);
        let wrong = checker.case(&small).expect_err("shrinking keeps a failure");
        panic!("\n{}", source(&small, &wrong, from));
    })
}

/// Checks [`CASES`] of each of the mixes.
fn check_mixes(mixes: impl Iterator<Item = PolygonMix>) {
    let seed = seeded::generator().get_seed();
    let mut checker = CoverageChecker::default();
    for mix in mixes {
        let mut pixels = 0;
        for number in 0..seeded::cases(CASES) as u64 {
            let from = format_args!("mix {mix:?}, seed {seed}, case {number}");
            pixels += check(&mut checker, &mix.case(seed, number), from);
        }
        println!("{}: {CASES} cases, {pixels} pixels", mix.name());
    }
}

// Two tests, so that two cores share the work.
#[test]
fn column_and_row_scans_agree_with_the_oracle_in_every_even_mix() {
    check_mixes(PolygonMix::ALL.into_iter().step_by(2));
}

#[test]
fn column_and_row_scans_agree_with_the_oracle_in_every_odd_mix() {
    check_mixes(PolygonMix::ALL.into_iter().skip(1).step_by(2));
}

#[test]
fn scans_agree_with_the_oracle_on_a_part_of_the_small_world() {
    let mut random = seeded::generator();
    let mut checker = CoverageChecker::default();
    for step in STEPS {
        for _ in 0..seeded::cases(TRIANGLES as usize / 50) {
            let number = random.u32(..TRIANGLES);
            let case = CoverageCase {
                polygons: vec![triangle(step, number).to_vec()],
                outline: None,
            };
            check(
                &mut checker,
                &case,
                format_args!("the small world: step {step}, case {number}"),
            );
        }
    }
}

#[test]
fn scans_agree_with_the_oracle_at_the_limits_of_the_coordinates() {
    let m = MAX_COORDINATE;
    let mut checker = CoverageChecker::default();
    for points in [
        [(-m, -m), (m, m), (-m, m)],
        [(-m, m), (m, -m), (m, m)],
        [(-m, -m + 1), (m, m), (m - 1, -m)],
        [(-m, 128), (m, 128), (m, 129)],
        [(128, -m), (128, m), (129, m)],
    ] {
        let case = CoverageCase {
            polygons: vec![polygon(&points)],
            outline: None,
        };
        assert!(check(&mut checker, &case, "hand") >= 2 * 240);
    }
}

#[test]
fn a_polygon_beyond_the_limits_is_dropped_and_gives_no_span() {
    let m = MAX_COORDINATE;
    let shifted = |x: i32, y: i32| polygon(&[(m + x, m + y), (0, 0), (-m - x, 256 - y)]);
    let with_sides = |n: usize| polygon(&[(0, 0), (0, 256), (256, 0)].repeat(6)[..n]);
    let mut checker = CoverageChecker::default();
    for polygon in [shifted(0, 0), with_sides(MAX_SIDES)] {
        assert!(checker.polygon(&polygon).is_ok());
    }
    let panics = |span| panic!("{span:?} of a polygon out of range");
    for (polygon, why) in [
        (shifted(1, 0), Dropped::OutOfRange),
        (shifted(0, 1), Dropped::OutOfRange),
        (with_sides(MAX_SIDES + 1), Dropped::TooManySides),
    ] {
        assert_eq!(scan::columns(&polygon, panics), Err(why));
        assert_eq!(scan::rows(&polygon, panics), Err(why));
    }
}
