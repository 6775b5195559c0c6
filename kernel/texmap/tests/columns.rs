//! Columns against the definitions, pixel by pixel: coverage by the row rule as it is written,
//! coordinates by the one affine map of a triangle.

use std::collections::HashMap;

use texmap::{ColumnJob, MAX_COORDINATE, Texture, Vertex, coverage};

/// The rule, word for word: inside when an odd number of edges have ymin <= yc < ymax and
/// cross yc at x <= xc.
fn inside(polygon: &[Vertex], x: i32, y: i32) -> bool {
    let (xc, yc) = (i128::from(x) * 256 + 128, i128::from(y) * 256 + 128);
    let mut odd = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (a, b) = if a.y <= b.y { (a, b) } else { (b, a) };
        let [ax, ay, bx, by] = [a.x, a.y, b.x, b.y].map(i128::from);
        if ay <= yc && yc < by && ax * (by - ay) + (bx - ax) * (yc - ay) <= xc * (by - ay) {
            odd = !odd;
        }
    }
    odd
}

fn jobs(polygon: &[Vertex], texture: &Texture<'_>) -> Vec<ColumnJob> {
    let mut jobs = Vec::new();
    coverage::columns(polygon, texture, 0, |job| jobs.push(job)).expect("legal polygon");
    jobs
}

/// Pixels of `polygon`, each with its coordinates; panics on a pixel drawn twice, outside the
/// screen, or outside the texture.
fn drawn(polygon: &[Vertex], texture: &Texture<'_>) -> HashMap<(i32, i32), (i32, i32)> {
    let (last_u, last_v) = texture.last();
    let mut pixels = HashMap::new();
    for job in jobs(polygon, texture) {
        assert!(
            job.x < 320 && job.len >= 1 && job.y + job.len <= 240,
            "{job:?}"
        );
        for i in 0..i32::from(job.len) {
            let (u, v) = (job.u + i * job.du, job.v + i * job.dv);
            assert!(
                (0..=last_u).contains(&u) && (0..=last_v).contains(&v),
                "{job:?} row {i}"
            );
            let at = (i32::from(job.x), i32::from(job.y) + i);
            assert_eq!(pixels.insert(at, (u, v)), None, "{at:?} drawn twice");
        }
    }
    pixels
}

fn vertex(random: &mut fastrand::Rng, centre: (i32, i32), spread: i32, snap: i32) -> Vertex {
    // Multiples of `snap` put vertices on pixel centres and edges on top of each other.
    let place = |random: &mut fastrand::Rng, centre: i32| {
        centre + random.i32(-spread..=spread) / snap * snap
    };
    Vertex {
        x: place(random, centre.0),
        y: place(random, centre.1),
        u: random.i32(0..=64) << 16,
        v: random.i32(0..=16) << 16,
    }
}

#[test]
fn columns_cover_what_the_rule_says() {
    let seed = fastrand::u64(..);
    println!("seed {seed}");
    let mut random = fastrand::Rng::with_seed(seed);
    let texels = [0; 64 * 16];
    let texture = Texture::new(&texels, 64, 16).unwrap();
    let mut covered = 0;
    for case in 0..20_000 {
        // The middle of the screen, its corners, and spreads from a pixel to beyond the screen.
        let centre = [(160, 120), (0, 0), (319, 239), (319, 0)][case % 4];
        let centre = (centre.0 * 256 + 128, centre.1 * 256 + 128);
        let spread = [256, 1024, 4096, 16384][case / 4 % 4];
        let snap = [1, 64, 128, 256][case / 16 % 4];
        let sides = random.usize(3..=8);
        let polygon: Vec<_> = (0..sides)
            .map(|_| vertex(&mut random, centre, spread, snap))
            .collect();
        let drawn = drawn(&polygon, &texture);
        let reach = spread / 256 + 2;
        let (cx, cy) = (centre.0 / 256, centre.1 / 256);
        for y in (cy - reach).max(0)..(cy + reach).min(240) {
            for x in (cx - reach).max(0)..(cx + reach).min(320) {
                let expected = inside(&polygon, x, y);
                covered += u64::from(expected);
                let actual = drawn.contains_key(&(x, y));
                assert_eq!(actual, expected, "({x}, {y}) of {polygon:?}");
            }
        }
    }
    assert!(
        covered > 100_000,
        "only {covered} pixels were covered at all"
    );
}

#[test]
fn the_far_corners_of_the_range_are_exact() {
    let m = MAX_COORDINATE;
    let corner = |x, y| Vertex { x, y, u: 0, v: 0 };
    let texture = Texture::new(&[0], 1, 1).unwrap();
    for polygon in [
        [corner(-m, -m), corner(m, m), corner(-m, m)],
        [corner(-m, m), corner(m, -m), corner(m, m)],
        [corner(-m, -m + 1), corner(m, m), corner(m - 1, -m)],
    ] {
        let drawn = drawn(&polygon, &texture);
        for (x, y) in (0..320).flat_map(|x| (0..240).map(move |y| (x, y))) {
            let expected = inside(&polygon, x, y);
            assert_eq!(
                drawn.contains_key(&(x, y)),
                expected,
                "({x}, {y}) of {polygon:?}"
            );
        }
    }
    let beyond = [corner(m + 1, 0), corner(0, 0), corner(0, 256)];
    let mut sink = |job| panic!("{job:?} of a polygon out of range");
    assert!(coverage::columns(&beyond, &texture, 0, &mut sink).is_err());
}

#[test]
fn a_triangle_has_its_one_affine_map() {
    let seed = fastrand::u64(..);
    println!("seed {seed}");
    let mut random = fastrand::Rng::with_seed(seed);
    let texels = [0; 64 * 16];
    let texture = Texture::new(&texels, 64, 16).unwrap();
    let mut compared = 0;
    for _ in 0..20_000 {
        let polygon: Vec<_> = (0..3)
            .map(|_| vertex(&mut random, (160 * 256, 120 * 256), 30 * 256, 1))
            .collect();
        let [a, b, c] =
            [&polygon[0], &polygon[1], &polygon[2]].map(|p| [p.x, p.y, p.u, p.v].map(i128::from));
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        for ((x, y), (u, v)) in drawn(&polygon, &texture) {
            let (dx, dy) = (
                i128::from(x) * 256 + 128 - a[0],
                i128::from(y) * 256 + 128 - a[1],
            );
            // Barycentric weights of b and c, over `area`.
            let wb = dx * (c[1] - a[1]) - dy * (c[0] - a[0]);
            let wc = dy * (b[0] - a[0]) - dx * (b[1] - a[1]);
            for (k, actual) in [(2, u), (3, v)] {
                let exact = a[k] * area + wb * (b[k] - a[k]) + wc * (c[k] - a[k]);
                let off = (i128::from(actual) * area - exact).abs();
                // 1/128 texel: 2^-8 where a texture is squeezed into a sliver, and 60 pixels of
                // step, each cut by less than 2^-16.
                assert!(off * 128 <= area.abs() << 16, "({x}, {y}) of {polygon:?}");
            }
            compared += 1;
        }
    }
    assert!(compared > 1_000_000, "only {compared} pixels were compared");
}
