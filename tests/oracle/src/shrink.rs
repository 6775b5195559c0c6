//! Shrinks a failing polygon, and writes it as a test to paste.

use std::fmt::{Display, Write};

use texmap::{MAX_COORDINATE, Point};

use crate::check::{CoverageCase, CoverageChecker, CoverageError};

/// Shrinks a failing case, usually to a single polygon that is as simple as it can be and still fail. If only
/// the whole case fails, the case stays as it is.
pub fn shrink(checker: &mut CoverageChecker, case: &CoverageCase) -> CoverageCase {
    let Some(failing) = case.polygons.iter().find(|p| checker.polygon(p).is_err()) else {
        return case.clone();
    };
    let mut polygon = failing.clone();
    while let Some(simpler) = simpler(&polygon)
        .into_iter()
        .find(|p| checker.polygon(p).is_err())
    {
        polygon = simpler;
    }
    CoverageCase {
        polygons: vec![polygon],
        outline: None,
    }
}

/// Returns legal polygons that are one step simpler; every chain of steps ends.
fn simpler(polygon: &[Point]) -> Vec<Vec<Point>> {
    let mut tries = Vec::new();
    for i in 0..polygon.len() {
        let mut fewer = polygon.to_vec();
        fewer.remove(i);
        tries.push(fewer);
    }
    let moved = |f: &dyn Fn(usize, Point) -> Point| -> Vec<_> {
        polygon.iter().enumerate().map(|(i, &p)| f(i, p)).collect()
    };
    for pixels in [16384, 4096, 1024, 256, 64, 16, 4, 1] {
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            tries.push(moved(&|_, Point { x, y }| Point {
                x: x + dx * pixels * 256,
                y: y + dy * pixels * 256,
            }));
        }
    }
    for only in 0..polygon.len() {
        for change in CHANGES {
            for (in_x, in_y) in [(true, true), (true, false), (false, true)] {
                tries.push(moved(&|i, Point { x, y }| Point {
                    x: if i == only && in_x { change(x) } else { x },
                    y: if i == only && in_y { change(y) } else { y },
                }));
            }
        }
    }
    let now = cost(polygon);
    tries.retain(|simpler| cost(simpler) < now && simpler.iter().all(is_legal));
    tries
}

fn is_legal(p: &Point) -> bool {
    p.x.abs().max(p.y.abs()) <= MAX_COORDINATE
}

/// Ways to simplify a coordinate.
const CHANGES: [fn(i32) -> i32; 11] = [
    |_| 0,
    |c| c / 2,
    |c| (c + 128) >> 8 << 8,
    |c| c >> 8 << 8 | 128,
    |c| (c + 32) >> 6 << 6,
    |c| (c + 8) >> 4 << 4,
    |c| (c + 1) >> 1 << 1,
    |c| c - c.signum() * 256,
    |c| c - c.signum() * 16 * 256,
    |c| c - c.signum() * 256 * 256,
    |c| c - c.signum() * 4096 * 256,
];

/// Returns the cost of a polygon, which shrinking lowers: fewer vertices first, then rounder coordinates,
/// then smaller coordinates.
fn cost(polygon: &[Point]) -> (usize, u32, i64) {
    let coordinates = || polygon.iter().flat_map(|p| [p.x, p.y]);
    let bits = coordinates().map(|c| 8 - c.trailing_zeros().min(8)).sum();
    let size = coordinates().map(|c| i64::from(c).abs()).sum();
    (polygon.len(), bits, size)
}

/// Returns the source of a test with the case, for `tests/oracle/tests/coverage.rs`; `from` says where it was
/// found.
pub fn source(case: &CoverageCase, wrong: &CoverageError, from: impl Display) -> String {
    let points = |polygon: &[Point]| {
        let point = |p: &Point| format!("({}, {})", p.x, p.y);
        let points: Vec<_> = polygon.iter().map(point).collect();
        format!("polygon(&[{}])", points.join(", "))
    };
    let mut text = format!("/// {wrong}. Found by {from}.\n#[test]\nfn found_by_a_sweep() {{\n");
    text += "    let case = CoverageCase {\n        polygons: vec![\n";
    for polygon in &case.polygons {
        let _ = writeln!(text, "            {},", points(polygon));
    }
    let outline = case.outline.as_ref();
    let outline = outline.map_or("None".to_owned(), |o| format!("Some({})", points(o)));
    let _ = write!(
        text,
        "        ],\n        outline: {outline},\n    }};\n    \
         assert_eq!(CoverageChecker::default().case(&case).err(), None);\n}}\n"
    );
    text
}
