//! The exact mapper against its definition, in integers twice as wide; and its quantised plane
//! against the real one.

use modex::{Destination, PlanarBuffer};
use oracle::texel::perspective;
use texmap::coverage::Axis;
use texmap::plane::{Anchor, MAX_POSITION, Plane, ROUNDING, Walk};
use texmap::{Texture, exact};

const FOCAL_LENGTH: i32 = 258;

/// The forms at the centre of a pixel as they really are: the sums over the anchors, not cut.
fn real(anchors: &[Anchor; 3], x: u16, y: u16) -> [i128; 3] {
    let ray = [
        2 * i128::from(x) - 319,
        2 * i128::from(y) - 239,
        2 * i128::from(FOCAL_LENGTH),
    ];
    let mut forms = [0; 3];
    let mut volume = 0;
    for i in 0..3 {
        let [p, q] = [1, 2].map(|k| anchors[(i + k) % 3].position.map(i128::from));
        let normal = [0, 1, 2].map(|k| {
            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
            p[l] * q[m] - p[m] * q[l]
        });
        let dot = |v: [i128; 3]| (0..3).map(|k| v[k] * normal[k]).sum::<i128>();
        let weight = dot(ray);
        volume = dot(anchors[i].position.map(i128::from));
        for (form, factor) in
            forms
                .iter_mut()
                .zip([i128::from(anchors[i].u), i128::from(anchors[i].v), 1 << 16])
        {
            *form += factor * weight;
        }
    }
    forms.map(|form| if volume < 0 { -form } else { form })
}

/// A point that the screen, or its neighbourhood, shows.
fn anchor(random: &mut fastrand::Rng, nearest: u32, deepest: u32, (w, h): (u16, u16)) -> Anchor {
    let bits = random.u32(nearest..deepest);
    let z = random.i32(1 << bits..2 << bits).min(MAX_POSITION);
    let at = |random: &mut fastrand::Rng, reach: i64| {
        let pixel = random.i64(-reach..=reach);
        let limit = i64::from(MAX_POSITION);
        (pixel * i64::from(z) / i64::from(FOCAL_LENGTH)).clamp(-limit, limit) as i32
    };
    Anchor {
        position: [at(random, 400), at(random, 300), z],
        u: random.i32(0..=i32::from(w) << 16),
        v: random.i32(0..=i32::from(h) << 16),
    }
}

fn generator() -> fastrand::Rng {
    let seed = fastrand::u64(..);
    println!("seed {seed}");
    fastrand::Rng::with_seed(seed)
}

/// A texture whose texels tell their column, and one whose texels tell their row.
struct Axes {
    size: (u16, u16),
    texels: [Vec<u8>; 2],
}

impl Axes {
    /// A few dozen sizes: powers of two and not, single texels, the largest, any.
    fn some(random: &mut fastrand::Rng) -> Vec<Self> {
        let side = |random: &mut fastrand::Rng| match random.u8(0..4) {
            0 => random.u16(1..=4),
            1 => 1 << random.u16(0..=8),
            _ => random.u16(1..=256),
        };
        let sizes = (0..40).map(|_| (side(random), side(random)));
        let sizes = sizes.chain([(1, 1), (256, 256), (255, 1)]);
        let axes = |size: (u16, u16)| {
            let axis = |of: fn(u16, u16) -> u16| {
                let rows = (0..size.1).flat_map(|j| (0..size.0).map(move |i| of(i, j) as u8));
                rows.collect::<Vec<u8>>()
            };
            Self {
                size,
                texels: [axis(|i, _| i), axis(|_, j| j)],
            }
        };
        sizes.map(axes).collect()
    }

    /// Draws a column with each, and gives the texels by column and row.
    fn draw(
        &self,
        page: &mut PlanarBuffer,
        plane: &Plane,
        (x, y, len): (u16, u16, u16),
    ) -> [Vec<u8>; 2] {
        [&self.texels[0], &self.texels[1]].map(|texels| {
            let texture = Texture::new(texels, self.size.0, self.size.1).unwrap();
            let walk = Walk::new(plane, Axis::Down, x, y);
            page.column(x, y, len, |column| {
                exact::column(&texture, walk, len, column)
            });
            let rows = y..y + len;
            rows.map(|y| page.pixel(x.into(), y.into())).collect()
        })
    }
}

/// Compares at least so many samples with the definition; how many were clamped.
fn compare(least: u64, random: &mut fastrand::Rng) -> (u64, u64) {
    let textures = Axes::some(random);
    let mut page = PlanarBuffer::new();
    let (mut samples, mut clamped, mut case) = (0, 0, 0);
    while samples < least {
        case += 1;
        let axes = &textures[random.usize(..textures.len())];
        // From the eye to 256 units, in one polygon.
        let deepest = [24, 16, 12][case % 3];
        let mut anchors = [(); 3].map(|()| anchor(random, 7, deepest, axes.size));
        match case % 16 {
            // Through the eye, on a line, in one point.
            0 => anchors[2].position = [0; 3],
            1 => anchors[2].position = anchors[1].position,
            2 => anchors = [anchors[0]; 3],
            // Across the eye, and behind it.
            3 => anchors[0].position = anchors[0].position.map(|k| -k),
            4 => anchors
                .iter_mut()
                .for_each(|a| a.position[2] = -a.position[2]),
            _ => {}
        }
        let plane = Plane::new(&anchors, FOCAL_LENGTH);
        let (w, h) = axes.size;
        // Several columns of each plane: making one takes longer than drawing.
        for _ in 0..4 {
            let (x, y) = (random.u16(0..320), random.u16(0..240));
            let len = random.u16(1..=240 - y);
            let [us, vs] = axes.draw(&mut page, &plane, (x, y, len));
            for (y, (u, v)) in (y..).zip(us.into_iter().zip(vs)) {
                let [a, b, c] = [plane.a, plane.b, plane.c].map(|form| i128::from(form.at(x, y)));
                let texel = |n, size| perspective(n, c, size) as u8;
                let expected = (texel(a, w), texel(b, h));
                let (w, h) = (i128::from(w), i128::from(h));
                assert_eq!((u, v), expected, "({x}, {y}) of {anchors:?} on {w} x {h}");
                samples += 1;
                clamped += u64::from(a < 0 || b < 0 || a >= w * c || b >= h * c);
            }
        }
    }
    (samples, clamped)
}

#[test]
fn every_texel_is_the_floor_of_the_quotient() {
    let (samples, clamped) = compare(4_000_000, &mut generator());
    println!("{samples} samples, {clamped} of them clamped");
    assert!(clamped > samples / 20 && samples - clamped > samples / 20);
}

/// `cargo test --release -p texmap --test exact -- --ignored --nocapture`
#[test]
#[ignore = "10^9 samples: minutes, and only in a release build"]
fn every_texel_of_a_thousand_million_is_the_floor_of_the_quotient() {
    let mut random = generator();
    let (mut samples, mut clamped) = (0, 0);
    while samples < 1_000_000_000 {
        let more = compare(50_000_000, &mut random);
        (samples, clamped) = (samples + more.0, clamped + more.1);
        println!("{samples} samples, {clamped} of them clamped");
    }
}

/// The forms are the real ones, cut by one shift, and off by no more than [`ROUNDING`]. So
/// |a' / c' - a / c| is at most ROUNDING (1 + u) / c', u in texels: what the numerator is off, and
/// what the denominator is off times the quotient.
#[test]
fn cutting_the_plane_moves_no_form_by_more_than_its_bound() {
    let mut random = generator();
    let (mut samples, mut worst) = (0u32, 0f64);
    for _ in 0..200_000 {
        let anchors = [(); 3].map(|()| anchor(&mut random, 7, 24, (256, 256)));
        let plane = Plane::new(&anchors, FOCAL_LENGTH);
        let (x, y) = (random.u16(0..320), random.u16(0..240));
        let real = real(&anchors, x, y);
        let cut = [plane.a, plane.b, plane.c].map(|form| i128::from(form.at(x, y)));
        let by = |shift: u32| {
            let off = |(cut, real): (&i128, &i128)| ((cut << shift) - real).abs();
            let most = i128::from(ROUNDING) << shift;
            cut.iter().zip(&real).all(|pair| off(pair) <= most)
        };
        let fits = (0..48).any(by);
        assert!(fits, "({x}, {y}) of {anchors:?}: {cut:?} of {real:?}");
        let [a, _, c] = real;
        // Where the polygon may be seen.
        if c > 0 && (0..256 * c).contains(&a) && cut[2] > 1 << 20 {
            let off = (a as f64 / c as f64 - cut[0] as f64 / cut[2] as f64).abs();
            worst = worst.max(off);
            samples += 1;
        }
    }
    println!("{samples} samples, off by {worst:e} texel at most");
    assert!(samples > 50_000, "only {samples} samples");
}

#[test]
fn a_corner_of_the_polygon_has_its_own_coordinates() {
    let mut random = generator();
    for _ in 0..10_000 {
        let mut anchors = [(); 3].map(|()| anchor(&mut random, 14, 20, (256, 256)));
        // The first of them on a pixel's centre.
        let (x, y) = (random.u16(0..320), random.u16(0..240));
        let z = 2 * FOCAL_LENGTH * random.i32(64..8192);
        let scale = z / (2 * FOCAL_LENGTH);
        anchors[0].position = [
            (2 * i32::from(x) - 319) * scale,
            (2 * i32::from(y) - 239) * scale,
            z,
        ];
        let [a, b, c] = real(&anchors, x, y);
        let (u, v) = (i128::from(anchors[0].u), i128::from(anchors[0].v));
        // All of the weight is the first point's.
        assert_eq!((a << 16, b << 16), (u * c, v * c));
        assert!(c >= 0);
        let plane = Plane::new(&anchors, FOCAL_LENGTH);
        let [a, b, c] = [plane.a, plane.b, plane.c].map(|form| i128::from(form.at(x, y)));
        if c > 1 << 40 {
            for (n, exact) in [(a, u), (b, v)] {
                let off = ((n << 16) - exact * c).abs();
                assert!(
                    off <= i128::from(ROUNDING) * ((1 << 16) + exact),
                    "{anchors:?}"
                );
            }
        }
    }
}

#[test]
fn the_ends_of_the_range_fit() {
    let m = MAX_POSITION;
    for signs in 0..512 {
        let at = |i: i32| if signs >> i & 1 == 1 { m } else { -m };
        let anchors = [0, 3, 6].map(|i| Anchor {
            position: [at(i), at(i + 1), at(i + 2)],
            u: 256 << 16,
            v: (i % 2) << 24,
        });
        let plane = Plane::new(&anchors, texmap::plane::MAX_FOCAL_LENGTH);
        for (x, y) in [(0, 0), (319, 0), (0, 239), (319, 239)] {
            for (form, bits) in [(plane.a, 61), (plane.b, 61), (plane.c, 53)] {
                assert!(form.at(x, y).abs() <= (1 << bits) + ROUNDING);
            }
        }
    }
}
