//! Compares the affine column loops with their reference implementation, texel by texel, and checks that they
//! write nothing outside the column.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::NonNull;

use modex::{Column, Destination, HEIGHT, Lane, PlanarBuffer, STRIDE, WIDTH};
use texmap::plane::Anchor;
use texmap::{AffineStepper, Face, Loop, Mapper, Texture, Vertex};

/// No texel has this colour: pixels that are not drawn keep it.
const UNTOUCHED: u8 = 0;

/// The loops that wrap any stepper around.
const MASKED: [Loop; 3] = [Loop::Shifts, Loop::OneAccumulator, Loop::Extract];

/// Draws a column, with tuned instructions or portably.
type Draw = fn(Loop, &Texture<'_>, AffineStepper, Column<'_>);
const DRAWS: [(&str, Draw); 2] = [("column", Loop::column), ("portable", Loop::portable)];

fn texels(random: &mut fastrand::Rng, len: usize) -> Vec<u8> {
    (0..len).map(|_| random.u8(UNTOUCHED + 1..)).collect()
}

/// Returns random texels, enough for any texture.
fn all_texels(random: &mut fastrand::Rng) -> Vec<u8> {
    texels(random, 256 * 256)
}

fn texture<'t>(texels: &'t [u8], (width, height): (u16, u16), padded: bool) -> Texture<'t> {
    if padded {
        let len = Texture::padded_len(width, height);
        Texture::padded(&texels[..len], width, height).unwrap()
    } else {
        let len = usize::from(width) * usize::from(height);
        Texture::new(&texels[..len], width, height).unwrap()
    }
}

fn side(random: &mut fastrand::Rng) -> u16 {
    match random.u8(..3) {
        0 => 1 << random.u16(0..=8),
        1 => random.u16(1..=8),
        _ => random.u16(1..=256),
    }
}

/// Returns a start and a step that stay inside `size` texels for `len` pixels. Whole texels, zero fractions,
/// borders and zero steps are more frequent than by chance.
fn legal(random: &mut fastrand::Rng, size: u16, len: u16) -> (i32, i32) {
    let last = (i32::from(size) << 16) - 1;
    let mut place = || match random.u8(..6) {
        0 => 0,
        1 => last,
        2 => random.i32(0..=last) & !0xFFFF,
        3 => random.i32(0..=last) | 0xFFFF,
        _ => random.i32(0..=last),
    };
    let (start, end) = (place(), place());
    if len == 1 {
        // This step is never used.
        return (start, random.i32(-1 << 24..1 << 24));
    }
    let step = (end - start) / i32::from(len - 1);
    match random.u8(..5) {
        0 => (start, 0),
        // Rounded towards zero, to whole texels.
        1 => (start, step / 0x1_0000 * 0x1_0000),
        // A step of one unit in the last place.
        2 => (
            start.clamp(240.min(last), (last - 240).max(0)),
            step.signum(),
        ),
        _ => (start, step),
    }
}

fn is_legal(stepper: AffineStepper, len: u16, texture: &Texture<'_>) -> bool {
    let (last_u, last_v) = texture.last();
    let inside = |at: i32, step: i32, last: i32| {
        let end = i64::from(at) + i64::from(step) * i64::from(len - 1);
        (0..=last).contains(&at) && (0..=i64::from(last)).contains(&end)
    };
    inside(stepper.u, stepper.du, last_u) && inside(stepper.v, stepper.dv, last_v)
}

fn legal_stepper(random: &mut fastrand::Rng, texture: &Texture<'_>, len: u16) -> AffineStepper {
    loop {
        let (u, du) = legal(random, texture.width(), len);
        let (v, dv) = legal(random, texture.height(), len);
        let stepper = AffineStepper { u, v, du, dv };
        if is_legal(stepper, len, texture) {
            return stepper;
        }
    }
}

/// Returns the texel of pixel `i`, from the definition; coordinates outside wrap around the padded sides.
fn texel(texture: &Texture<'_>, stepper: AffineStepper, i: usize) -> u8 {
    let at = |at: i32, step: i32| (i64::from(at) + i as i64 * i64::from(step)) >> 16;
    let (column, row) = (at(stepper.u, stepper.du), at(stepper.v, stepper.dv));
    let pitch = usize::from(texture.pitch());
    let rows = texture.texels().len() / pitch;
    let [column, row] =
        [(column, pitch), (row, rows)].map(|(n, m)| n.rem_euclid(m as i64) as usize);
    texture.texels()[row * pitch + column]
}

/// Draws a column on an untouched page and compares the whole page.
fn check(
    draw: (&str, Draw),
    by: Loop,
    texture: &Texture<'_>,
    stepper: AffineStepper,
    len: u16,
    page: &mut Page,
) {
    let Page {
        place: (x, y),
        drawn,
        expected,
    } = page;
    drawn.column(*x, *y, len, |column| draw.1(by, texture, stepper, column));
    let taken = by.effective(stepper);
    for i in 0..usize::from(len) {
        let at = (usize::from(*y) + i) * STRIDE + usize::from(*x) / 4;
        expected.planes[usize::from(*x & 3)][at] = texel(texture, taken, i);
    }
    if drawn != expected {
        let wrong = (0..WIDTH * HEIGHT)
            .map(|i| (i % WIDTH, i / WIDTH))
            .filter(|&(x, y)| drawn.pixel(x, y) != expected.pixel(x, y));
        panic!(
            "{} {by:?}, {len} pixels from ({x}, {y}), {stepper:?}, {} x {} texels, pitch {}: wrong at {:?}",
            draw.0,
            texture.width(),
            texture.height(),
            texture.pitch(),
            wrong.take(4).collect::<Vec<_>>(),
        );
    }
    let plane = usize::from(*x & 3);
    drawn.planes[plane].fill(UNTOUCHED);
    expected.planes[plane].fill(UNTOUCHED);
}

/// An untouched page, its expected result, and a column's place.
struct Page {
    place: (u16, u16),
    drawn: PlanarBuffer,
    expected: PlanarBuffer,
}

impl Page {
    fn new() -> Self {
        let untouched = PlanarBuffer {
            planes: [[UNTOUCHED; modex::PAGE_BYTES]; 4],
        };
        Self {
            place: (0, 0),
            drawn: untouched,
            expected: untouched,
        }
    }

    /// Chooses a place for a column of `len` pixels.
    fn anywhere(&mut self, random: &mut fastrand::Rng, len: u16) -> &mut Self {
        let top = random.u16(0..=HEIGHT as u16 - len);
        self.place = (random.u16(0..WIDTH as u16), top);
        self
    }
}

#[test]
fn every_loop_draws_its_clear_twin() {
    let random = &mut seeded::generator();
    let texels = all_texels(random);
    let mut page = Page::new();
    for case in 0..seeded::cases(4000) as u16 {
        // Every height once, then random heights.
        let len = if case < 240 {
            case + 1
        } else {
            random.u16(1..=240)
        };
        let size = (side(random), side(random));
        let texture = texture(&texels, size, random.bool());
        let stepper = legal_stepper(random, &texture, len);
        for by in Loop::ALL {
            for draw in DRAWS {
                check(draw, by, &texture, stepper, len, page.anywhere(random, len));
            }
        }
    }
}

/// A step with a negative whole part and a zero fraction has no carry. If whole part and fraction were one
/// number, it would seem to have a carry at every pixel.
#[test]
fn a_negative_whole_step_carries_nothing() {
    let random = &mut seeded::generator();
    let texels = all_texels(random);
    let mut page = Page::new();
    for pitch in 0..=8 {
        let texture = texture(&texels, (1 << pitch, 256), true);
        for (du, dv) in [(0, -1), (-1, 0), (-1, -1), (1, -1), (-1, 1)] {
            // The number of pixels that fit in the texture.
            let room = |step: i32, size: u16| if step == 0 { 240 } else { size.min(240) };
            let len = room(du, texture.width()).min(room(dv, texture.height()));
            let mut start = |step: i32, size: u16| {
                let texel = if step < 0 { i32::from(size) - 1 } else { 0 };
                texel << 16 | random.i32(0..1 << 16)
            };
            let mut u = start(du, texture.width());
            let mut v = start(dv, texture.height());
            for fraction in [true, false] {
                if !fraction {
                    (u, v) = (u & !0xFFFF, v & !0xFFFF);
                }
                let stepper = AffineStepper {
                    u,
                    v,
                    du: du << 16,
                    dv: dv << 16,
                };
                for by in Loop::ALL {
                    for draw in DRAWS {
                        page.place = (0, 0);
                        check(draw, by, &texture, stepper, len, &mut page);
                    }
                }
            }
        }
    }
}

#[test]
fn masked_loops_wrap_any_stepper_around_the_padding() {
    let random = &mut seeded::generator();
    let texels = all_texels(random);
    let mut page = Page::new();
    for case in 0..seeded::cases(4000) as u16 {
        let len = random.u16(1..=240);
        let size = (side(random), side(random));
        let texture = texture(&texels, size, true);
        let mut any = || match case % 4 {
            // The case of the sources: small negative steps from inside, which leave at 0.
            0 => random.i32(-0x2_0000..0x1_0000),
            1 => random.i32(-0x200..=0x200) << 16,
            2 => [i32::MIN, i32::MAX, -1, 0, 1][random.usize(..5)],
            _ => random.i32(..),
        };
        let stepper = AffineStepper {
            u: any(),
            v: any(),
            du: any(),
            dv: any(),
        };
        for by in MASKED {
            for draw in DRAWS {
                check(draw, by, &texture, stepper, len, page.anywhere(random, len));
            }
        }
    }
}

#[test]
fn a_stepper_that_leaves_the_texture_panics_before_it_reads() {
    let random = &mut seeded::generator();
    let texels = all_texels(random);
    for case in 0..seeded::cases(200) {
        let texture = texture(&texels, (side(random), side(random)), random.bool());
        let len = random.u16(2..=240);
        let mut stepper = legal_stepper(random, &texture, len);
        let (last_u, last_v) = texture.last();
        // One bit outside, at the first pixel or at the last; or far away.
        match case % 8 {
            0 => (stepper.u, stepper.du) = (-1, 1),
            1 => (stepper.u, stepper.du) = (last_u + 1, -1),
            2 => (stepper.u, stepper.du) = (i32::from(len) - 2, -1),
            3 => (stepper.u, stepper.du) = (last_u - i32::from(len) + 2, 1),
            4 => (stepper.v, stepper.dv) = (-2, 2),
            5 => (stepper.v, stepper.dv) = (last_v + 1, -2),
            6 => stepper.dv = i32::MIN,
            _ => stepper.du = i32::MAX,
        }
        for by in [
            Loop::TwoCarries,
            Loop::Packed,
            Loop::StepTable,
            Loop::AddCarry,
        ] {
            if by == Loop::AddCarry && texture.bits().is_none() {
                continue;
            }
            for (name, draw) in DRAWS {
                let mut page = PlanarBuffer::new();
                let outside = catch_unwind(AssertUnwindSafe(|| {
                    page.column(0, 0, len, |column| draw(by, &texture, stepper, column));
                }));
                assert!(outside.is_err(), "{name} {by:?} {stepper:?} {len}");
                assert!(
                    page == PlanarBuffer::new(),
                    "{name} {by:?} {stepper:?} {len}"
                );
            }
        }
    }
}

/// A packed stepper's error grows by at most one unit in the last place per pixel, and the stepper stays
/// inside the texture.
#[test]
fn a_packed_stepper_drifts_within_its_bound() {
    let random = &mut seeded::generator();
    let texels = all_texels(random);
    let mut worst = 0;
    for _ in 0..20_000 {
        let len = random.u16(1..=240);
        let texture = texture(&texels, (side(random), side(random)), false);
        let stepper = legal_stepper(random, &texture, len);
        let packed = Loop::Packed.effective(stepper);
        assert!(
            is_legal(packed, len, &texture),
            "{stepper:?} {packed:?} {len}"
        );
        assert_eq!(packed, Loop::Packed.effective(packed));
        assert_eq!((packed.u, packed.du), (stepper.u, stepper.du));
        let last = i32::from(len) - 1;
        for i in [0, last / 2, last] {
            let off = i64::from(stepper.v - packed.v)
                + i64::from(i) * (i64::from(stepper.dv) - i64::from(packed.dv));
            assert!(off.abs() <= i64::from(i) + 1, "{stepper:?} {packed:?} {i}");
            worst = worst.max(off.abs());
        }
    }
    // The stepper does drift, so the reference implementation has to know about it.
    assert!(worst > 200, "{worst}");
    for by in Loop::ALL {
        let stepper = AffineStepper {
            u: 1,
            v: 1,
            du: -1,
            dv: -1,
        };
        assert_eq!(by.effective(stepper) != stepper, by == Loop::Packed);
    }
}

/// The registers have enough spare bits for the longest possible column.
#[test]
fn the_longest_column_spills_nothing() {
    let random = &mut seeded::generator();
    let texels = all_texels(random);
    let texture = texture(&texels, (256, 256), true);
    let len = u16::MAX;
    let last = (256 << 16) - 1;
    let mut bytes = vec![UNTOUCHED; usize::from(len) * STRIDE];
    for (u, du, v, dv) in [
        (0, 0, 0, 0),
        (0xFFFF, 0, 0xFFFF, 0),
        (0, 256, last, -256),
        (last, -256, 0, 255),
        (last, 0, last, 0),
        // Only the masked loops can draw these.
        (last, -1, last, -1),
        (last, last, 0, -1),
    ] {
        let stepper = AffineStepper { u, v, du, dv };
        for by in Loop::ALL {
            if !is_legal(stepper, len, &texture) && !MASKED.contains(&by) {
                continue;
            }
            for (name, draw) in DRAWS {
                let base = NonNull::from(&mut bytes[..]).cast();
                // SAFETY: `bytes` has STRIDE bytes for every pixel, and nothing else accesses it.
                draw(by, &texture, stepper, unsafe { Lane::new(base, len) });
                let taken = by.effective(stepper);
                for i in 0..usize::from(len) {
                    let expected = texel(&texture, taken, i);
                    assert_eq!(bytes[i * STRIDE], expected, "{name} {by:?} {stepper:?} {i}");
                }
            }
        }
    }
}

#[test]
fn the_bits_of_a_texture_are_those_of_its_padded_sides() {
    let texels = [1; 256 * 256];
    for (size, padded, bits) in [
        ((1, 1), false, Some((0, 0))),
        ((64, 32), false, Some((6, 5))),
        ((64, 33), false, None),
        ((48, 32), false, None),
        ((48, 33), true, Some((6, 6))),
        ((3, 256), true, Some((2, 8))),
    ] {
        assert_eq!(texture(&texels, size, padded).bits(), bits, "{size:?}");
    }
}

#[test]
fn an_empty_column_is_not_drawn() {
    let mut byte = UNTOUCHED;
    for by in Loop::ALL {
        for (_, draw) in DRAWS {
            // SAFETY: the lane has no pixels.
            let none = unsafe { Lane::new(NonNull::from(&mut byte), 0) };
            draw(by, &Texture::DOT, AffineStepper::default(), none);
        }
    }
    assert_eq!(byte, UNTOUCHED);
}

/// Whole faces, mapped by name: a job draws the texels that `Job::pixels` yields.
#[test]
fn jobs_yield_what_every_loop_reads() {
    let random = &mut seeded::generator();
    let texels = all_texels(random);
    let mut drifted = 0;
    for _ in 0..60 {
        let texture = texture(&texels, (side(random), side(random)), random.bool());
        let polygon = [(); 3].map(|()| Vertex {
            x: random.i32(-20 * 256..340 * 256),
            y: random.i32(-20 * 256..260 * 256),
            u: random.i32(0..=i32::from(texture.width()) << 16),
            v: random.i32(0..=i32::from(texture.height()) << 16),
        });
        let face = Face {
            polygon: &polygon,
            texture: 0,
            anchors: [Anchor::default(); 3],
            focal_length: 256,
        };
        let jobs = |by| {
            let mut jobs = Vec::new();
            let mapper = Mapper::Affine(by);
            mapper.jobs(&face, &texture, |job| jobs.push(job)).unwrap();
            (mapper.style(), jobs)
        };
        let (_, clear) = jobs(Loop::Multiply);
        for by in Loop::ALL {
            let (style, jobs) = jobs(by);
            let mut page = PlanarBuffer::new();
            for job in &jobs {
                job.draw(style, &texture, &mut page);
                job.pixels(&texture, |(x, y), (u, v)| {
                    assert_eq!(
                        page.pixel(x.into(), y.into()),
                        texture.at(u, v),
                        "{by:?} {job:?}"
                    );
                });
            }
            if by == Loop::Packed {
                drifted += u32::from(jobs != clear);
            } else {
                assert_eq!(jobs, clear);
            }
        }
    }
    assert!(drifted > 0);
}

#[test]
fn extract_is_tuned_where_the_cpu_has_it() {
    #[cfg(target_arch = "x86_64")]
    assert_eq!(
        Loop::Extract.is_tuned_here(),
        std::arch::is_x86_feature_detected!("bmi2")
    );
    for by in Loop::ALL {
        if by != Loop::Extract && by != Loop::Multiply {
            assert_eq!(by.is_tuned_here(), cfg!(target_arch = "x86_64"));
        }
    }
}
