//! Checks the oracle of texture coordinates against big rationals and the single affine map of a triangle, on
//! 10^5 pixels, including extremes and vertices on pixels' centres.

use num_bigint::BigInt;
use oracle::texel::{Coordinate, affine};
use texmap::{MAX_COORDINATE, Vertex};

/// Evaluates a triangle's affine map at a pixel's centre: the numerators of u and v, and their common
/// denominator. Returns `None` if the centre is not inside.
///
/// Fractions stay unreduced: reducing them took most of this test's time.
fn by_weights(triangle: &[Vertex; 3], x: i32, y: i32) -> Option<([BigInt; 2], BigInt)> {
    let centre = [x, y].map(|k| BigInt::from(i64::from(k) * 256 + 128));
    let corners = triangle.map(|at| [BigInt::from(at.x), BigInt::from(at.y)]);
    // Twice the area of a corner pair with a point.
    let area = |p: &[BigInt; 2], q: &[BigInt; 2], r: &[BigInt; 2]| {
        (&q[0] - &p[0]) * (&r[1] - &p[1]) - (&r[0] - &p[0]) * (&q[1] - &p[1])
    };
    let total = area(&corners[0], &corners[1], &corners[2]);
    let weights = [0, 1, 2].map(|i| area(&centre, &corners[(i + 1) % 3], &corners[(i + 2) % 3]));
    // A weight has the sign of the total if the centre is on the inner side of that edge.
    let outside = |weight: &BigInt| weight * &total < BigInt::ZERO;
    if total == BigInt::ZERO || weights.iter().any(outside) {
        return None;
    }
    let sum = |of: fn(&Vertex) -> i32| -> BigInt {
        weights
            .iter()
            .zip(triangle)
            .map(|(weight, at)| weight * of(at))
            .sum()
    };
    Some(([sum(|at| at.u), sum(|at| at.v)], total))
}

#[test]
fn affine_coordinates_equal_those_in_big_rationals() {
    let mut random = seeded::generator();
    let (mut compared, mut case) = (0, 0);
    while compared < seeded::cases(100_000) {
        case += 1;
        // The size of a pixel, of the screen, and of the whole range; on a grid that produces ties.
        let reach = [512, 100 * 256, MAX_COORDINATE][case % 3];
        let snap = [1, 128][case / 3 % 2];
        let mut vertex = || {
            let mut place = || random.i32(-reach..=reach) / snap * snap;
            Vertex {
                x: place(),
                y: place(),
                u: random.i32(0..=256 << 16),
                v: random.i32(0..=256 << 16),
            }
        };
        let triangle = [vertex(), vertex(), vertex()];
        let middle =
            |of: fn(&Vertex) -> i32| triangle.iter().map(|at| of(at) / 3).sum::<i32>() / 256;
        let near = (middle(|at| at.x), middle(|at| at.y));
        for (x, y) in (-2..=2).flat_map(|i| (-2..=2).map(move |j| (near.0 + i, near.1 + j))) {
            let Some((expected, denominator)) = by_weights(&triangle, x, y) else {
                continue;
            };
            // Where the triangle begins or ends at a column (its side is vertical there), no coordinates are
            // needed.
            let Some(found) = affine(&triangle, x, y) else {
                continue;
            };
            for (Coordinate { n, d }, expected) in found.into_iter().zip(expected) {
                assert_eq!(&denominator * n, expected * d, "({x}, {y}) of {triangle:?}");
            }
            compared += 1;
        }
    }
}

#[test]
fn an_error_reaches_the_neighbouring_texel_and_the_last_texel_owns_its_border() {
    let at = |n: i128| Coordinate { n: 3 * n, d: 3 };
    assert_eq!(at(5 << 16).texels(16, 8), 4..=5);
    assert_eq!(at((5 << 16) + 1000).texels(7, 8), 5..=5);
    assert_eq!(at((5 << 16) + 511).texels(7, 8), 4..=5);
    assert_eq!(at((6 << 16) - 512).texels(7, 8), 5..=6);
    assert_eq!(at((6 << 16) - 513).texels(7, 8), 5..=5);
    assert_eq!(at(8 << 16).texels(7, 8), 7..=7);
    assert_eq!(at(0).texels(7, 8), 0..=0);
}
