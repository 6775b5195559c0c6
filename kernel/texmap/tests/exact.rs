//! Checks the exact mapper against its definition, in integers twice as wide; and its quantised plane against
//! the exact plane. Failures that a sweep of texels finds are pasted in here.

use modex::{Destination, PlanarBuffer};
use oracle::plane::{FOCAL_LENGTH, PlaneChecker, PlaneCounts, PlaneMix, anchor};
use oracle::texel::forms;
use texmap::mappers::exact;
use texmap::plane::{Anchor, MAX_POSITION, Plane, PlaneStepper, ROUNDING, texel};
use texmap::{Axis, Quotients, Texture};

/// Cases of each mix: as many as `cargo sweep --only texels` runs in half a second.
const CASES: u64 = 1500;

#[test]
fn every_texel_is_the_floor_of_the_quotient() {
    let seed = seeded::generator().get_seed();
    let mut checker = PlaneChecker::default();
    for mix in PlaneMix::ALL {
        let (mut samples, mut clamped, mut ties) = (0, 0, 0);
        for number in 0..CASES {
            let case = mix.case(seed, number);
            let compared = checker.case(&case).unwrap_or_else(|_| {
                let small = case.shrink(&mut checker);
                let wrong = checker.case(&small).expect_err("shrinking keeps a failure");
                let from = format_args!("mix {mix:?}, seed {seed}, case {number}");
                panic!("\n{}", small.source(&wrong, from));
            });
            let PlaneCounts {
                samples: more,
                clamped: outside,
                ties: whole,
            } = compared;
            samples += more;
            clamped += outside;
            ties += whole;
        }
        println!(
            "{}: {samples} samples, {clamped} of them clamped, {ties} ties",
            mix.name()
        );
        let (seen, clamps) = (samples - clamped > samples / 20, clamped > samples / 20);
        match mix {
            PlaneMix::Ties => assert!(ties > samples / 40 && seen && clamps),
            PlaneMix::Deep | PlaneMix::Near | PlaneMix::Nearest | PlaneMix::AcrossEye => {
                assert!(seen && clamps)
            }
            PlaneMix::ThroughEye | PlaneMix::BehindEye => assert!(clamps),
        }
    }
}

/// Textures whose rows lie side by side, padded textures and tiles: each way computes its own index.
#[test]
fn every_way_reads_the_same_texel_of_every_kind_of_texture() {
    let mut random = seeded::generator();
    let texels: Vec<u8> = (0..1 << 16).map(|_| random.u8(..)).collect();
    let mut page = Box::new(PlanarBuffer::new());
    let mut inside = 0;
    for case in 0..3000 {
        let size = [random.u16(1..=256), random.u16(1..=256)];
        let [width, height] = size;
        let tile = [random.u32(0..=8), random.u32(0..=8)].map(|bits| 1u16 << bits);
        let len = |[across, down]: [u16; 2]| usize::from(across) * usize::from(down);
        let texture = match case % 3 {
            0 => Texture::new(&texels[..len(size)], width, height),
            1 => {
                let padded = Texture::padded_len(width, height);
                Texture::padded(&texels[..padded], width, height)
            }
            _ => Texture::tiled(&texels[..len(tile)], tile.into(), width, height),
        }
        .unwrap();
        let anchors = [(); 3].map(|()| anchor(&mut random, 7, 24, size.into()));
        let plane = Plane::new(&anchors, FOCAL_LENGTH);
        let (x, y) = (random.u16(0..320), random.u16(0..240));
        let len = random.u16(1..=240 - y);
        let stepper = PlaneStepper::new(&plane, Axis::Down, x, y);
        let expected: Vec<u8> = (0..len)
            .map(|i| {
                let [a, b, c] = stepper.after(i);
                inside += u32::from(a >= 0 && b >= 0 && a < 256 * c && b < 256 * c);
                let at = |n, size| i32::from(texel(n, c, size)) << 16;
                texture.at(at(a, width), at(b, height))
            })
            .collect();
        for way in Quotients::ALL {
            page.column(x, y, len, |column| {
                exact::column(&texture, stepper, way, column)
            });
            let found = (y..y + len).map(|y| page.pixel(x.into(), y.into()));
            assert!(found.eq(expected.iter().copied()), "{way:?}, case {case}");
        }
    }
    assert!(inside > 50_000, "only {inside} pixels lie inside");
}

/// Quotients a few units of the numerator away from a whole number, on either side: no guess in floating
/// point tells them apart.
#[test]
fn a_quotient_next_to_a_whole_number_is_rounded_down() {
    let mut random = seeded::generator();
    let texels: Vec<u8> = (0..1 << 16).map(|_| random.u8(..)).collect();
    let texture = Texture::new(&texels, 256, 256).unwrap();
    let mut page = Box::new(PlanarBuffer::new());
    for _ in 0..3000 {
        let bits = random.u32(4..53);
        let c = random.i64(1 << (bits - 1)..1 << bits);
        let len = random.u16(1..=100);
        // A pixel moves by one texel, so every pixel is equally far from a whole number.
        let [at, step] = {
            let mut form = || {
                let texel = random.i64(100..156);
                let off = random.i64(-2..=2);
                let down = if random.bool() { c } else { -c };
                (texel * c + off, down)
            };
            let (a, b) = (form(), form());
            [[a.0, b.0, c], [a.1, b.1, 0]]
        };
        let stepper = PlaneStepper { at, step };
        for way in Quotients::ALL {
            page.column(0, 0, len, |column| {
                exact::column(&texture, stepper, way, column)
            });
            for i in 0..len {
                let [a, b, c] = stepper.after(i);
                let at = |n| i32::from(texel(n, c, 256)) << 16;
                let found = page.pixel(0, i.into());
                assert_eq!(
                    found,
                    texture.at(at(a), at(b)),
                    "{way:?}, {stepper:?}, pixel {i}"
                );
            }
        }
    }
}

/// The plane's forms are the exact forms after one shift, with an error of at most [`ROUNDING`]. So the
/// quotient is off by at most ROUNDING (1 + u) / c', u in texels: the numerator's error, plus the
/// denominator's error times the quotient.
#[test]
fn cutting_the_plane_moves_no_form_by_more_than_its_bound() {
    let mut random = seeded::generator();
    let (mut samples, mut worst) = (0u32, 0f64);
    for _ in 0..200_000 {
        let anchors = [(); 3].map(|()| anchor(&mut random, 7, 24, (256, 256)));
        let plane = Plane::new(&anchors, FOCAL_LENGTH);
        let (x, y) = (random.u16(0..320), random.u16(0..240));
        let real = forms(&anchors, FOCAL_LENGTH, x, y);
        let cut = [plane.a, plane.b, plane.c].map(|form| i128::from(form.at(x, y)));
        let by = |shift: u32| {
            let off = |(cut, real): (&i128, &i128)| ((cut << shift) - real).abs();
            let most = i128::from(ROUNDING) << shift;
            cut.iter().zip(&real).all(|pair| off(pair) <= most)
        };
        let fits = (0..48).any(by);
        assert!(fits, "({x}, {y}) of {anchors:?}: {cut:?} of {real:?}");
        let [a, _, c] = real;
        // Where the polygon may be visible.
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
    let mut random = seeded::generator();
    for _ in 0..10_000 {
        let mut anchors = [(); 3].map(|()| anchor(&mut random, 14, 20, (256, 256)));
        // The first anchor is on a pixel's centre.
        let (x, y) = (random.u16(0..320), random.u16(0..240));
        let z = 2 * FOCAL_LENGTH * random.i32(64..8192);
        let scale = z / (2 * FOCAL_LENGTH);
        anchors[0].position = [
            (2 * i32::from(x) - 319) * scale,
            (2 * i32::from(y) - 239) * scale,
            z,
        ];
        let [a, b, c] = forms(&anchors, FOCAL_LENGTH, x, y);
        let (u, v) = (i128::from(anchors[0].u), i128::from(anchors[0].v));
        // The first point has all of the weight.
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
