//! Perspective by spans: the drawn texels are those of [`Job::pixels`], they stay inside the texture, and
//! their error is within the bound of [`texmap::plane::bounds`].

mod random;

use modex::PlanarBuffer;
use random::{COLUMNS, DEEP_COLUMNS, any, off, seen, side};
use texmap::mappers::pieces::over;
use texmap::plane::bounds::SpanBound;
use texmap::plane::{self, Reciprocal, quotients};
use texmap::{Axis, Job, Mapper, PlaneStepper, SpanKind, Style, Subdivision, Texture};

/// The mappers that draw in pieces, by name, and some more that are not in [`Mapper::ALL`].
const MAPPERS: [(&str, Subdivision, bool); 12] = [
    ("linear-2", Subdivision::Of(2), true),
    ("linear-4", Subdivision::Of(4), true),
    ("linear-8", Subdivision::Of(8), true),
    ("linear-16", Subdivision::Of(16), true),
    ("linear-32", Subdivision::Of(32), true),
    ("linear-100", Subdivision::Of(100), true),
    ("linear-powers", Subdivision::Powers, true),
    ("linear", Subdivision::Whole, true),
    ("quadratic-16", Subdivision::Of(16), false),
    ("quadratic-32", Subdivision::Of(32), false),
    ("quadratic-17", Subdivision::Of(17), false),
    ("quadratic", Subdivision::Whole, false),
];

fn job(stepper: PlaneStepper, len: u16, (_, pieces, linear): (&str, Subdivision, bool)) -> Job {
    Job {
        axis: Axis::Down,
        x: 0,
        y: 0,
        len,
        texture: 0,
        kind: match linear {
            true => SpanKind::Linear(stepper, pieces),
            false => SpanKind::Quadratic(stepper, pieces),
        },
    }
}

fn pixels(job: &Job, texture: &Texture<'_>) -> Vec<(i32, i32)> {
    let mut pixels = Vec::new();
    job.pixels(texture, |_, at| pixels.push(at));
    pixels
}

#[test]
fn a_quotient_is_less_than_it_should_be_by_below_a_unit_and_three_128ths() {
    let mut random = seeded::generator();
    let mut most = 0f64;
    for _ in 0..seeded::cases(2_000_000) {
        let bits = random.u32(1..=55);
        let c = random.i64(1..=1 << bits);
        let n = random.i64(0..(256 * i128::from(c)).min(i64::MAX.into()) as i64);
        let quotient = i128::from(Reciprocal::new(c).times(n));
        let (n, c) = (i128::from(n) << 16, i128::from(c));
        assert!(quotient * c <= n, "{n} / {c} is above");
        assert!((n - quotient * c) * 128 < c * 131, "{n} / {c} is off");
        most = most.max((n - quotient * c) as f64 / c as f64);
    }
    println!("less by {most} units at most");
    assert!(
        !seeded::is_whole() || most > 1.0,
        "the bound is tight only if an error exceeds one unit"
    );
}

#[test]
fn a_step_is_cut_towards_zero() {
    let mut random = seeded::generator();
    for steps in 1..=319u16 {
        let largest = (1 << 24) - 1;
        let n = i32::from(steps);
        let whole = random.i32(0..largest / n) * n;
        for delta in [
            0,
            1,
            n - 1,
            n,
            largest,
            whole,
            whole + n - 1,
            random.i32(0..=largest),
        ] {
            assert_eq!(over(delta, steps), delta / n, "{delta} / {n}");
            assert_eq!(over(-delta, steps), -delta / n, "-{delta} / {n}");
        }
    }
}

#[test]
fn drawn_texels_are_those_of_the_coordinates() {
    let mut random = seeded::generator();
    let texels: Vec<u8> = (0..1 << 16).map(|_| random.u8(..)).collect();
    let (mut page, mut planes) = (PlanarBuffer::new(), PlanarBuffer::new());
    let mut compared = 0;
    for case in 0..seeded::cases(30_000) {
        let (w, h) = (side(&mut random), side(&mut random));
        let padded = random.bool();
        let texture = match padded {
            true => Texture::padded(&texels[..Texture::padded_len(w, h)], w, h),
            false => Texture::new(&texels[..usize::from(w) * usize::from(h)], w, h),
        };
        let texture = texture.unwrap();
        let axis = [Axis::Down, Axis::Right][case % 2];
        let (x, y) = (random.u16(0..320), random.u16(0..240));
        let len = random.u16(1..=[240 - y, 320 - x][case % 2]);
        let stepper = match random.u8(0..3) {
            0 => any(&mut random, len),
            _ => seen(&mut random, len, (w, h)),
        };
        let mapper = MAPPERS[random.usize(..MAPPERS.len())];
        let job = Job {
            axis,
            x,
            y,
            ..job(stepper, len, mapper)
        };
        job.draw(Style::default(), &texture, &mut page);
        for plane in 0..4 {
            job.draw_in_plane(plane, Style::default(), &texture, &mut planes);
        }
        let (last_u, last_v) = texture.last();
        job.pixels(&texture, |(x, y), (u, v)| {
            let context = || format!("{} ({x}, {y}) {job:?} on {w} x {h}", mapper.0);
            let inside = (0..=last_u).contains(&u) && (0..=last_v).contains(&v);
            assert!(inside, "({u}, {v}) {}", context());
            let [drawn, in_plane] = [&page, &planes].map(|page| page.pixel(x.into(), y.into()));
            assert_eq!(
                (drawn, in_plane),
                (texture.at(u, v), texture.at(u, v)),
                "{}",
                context()
            );
            compared += 1;
        });
    }
    println!("{compared} pixels");
    assert!(!seeded::is_whole() || compared > 1_000_000);
}

/// The first pixel of each piece, and the last pixel of the span, have the exact quotient. The loops in the
/// sources divide by end - start in one place and by end - start - 1 in another, so one of the two reaches
/// its end a pixel too soon or too late.
#[test]
fn pieces_and_the_span_end_at_exact_quotients() {
    let mut random = seeded::generator();
    let texture = Texture::new(&[0; 256 * 256], 256, 256).unwrap();
    for _ in 0..seeded::cases(5_000) {
        let len = random.u16(1..=240);
        let stepper = seen(&mut random, len, (256, 256));
        for mapper in MAPPERS {
            let Subdivision::Of(of) = mapper.1 else {
                continue;
            };
            let pixels = pixels(&job(stepper, len, mapper), &texture);
            for i in (0..len - 1).step_by(of.into()).chain([len - 1]) {
                let [a, b, c] = stepper.after(i);
                let quotient = (plane::coordinate(a, c, 256), plane::coordinate(b, c, 256));
                let is = pixels[usize::from(i)];
                let off = (is.0 - quotient.0).abs().max((is.1 - quotient.1).abs());
                // The last pixel is that many rounded steps from the piece's start.
                let drift = match i == len - 1 && mapper.2 {
                    true => i32::from(of) + 1,
                    false => 1,
                };
                assert!(
                    off <= drift,
                    "{} off by {off} at {i} of {len}, {stepper:?}",
                    mapper.0
                );
            }
        }
    }
}

/// "Zero's paradox": the horizon inside the span, and pixels beyond it.
#[test]
fn on_the_horizon_and_beyond_nothing_is_divided_by_zero() {
    let texture = Texture::new(&[0; 256 * 64], 256, 64).unwrap();
    let (last_u, last_v) = texture.last();
    let one = 1 << 20;
    for mapper in MAPPERS {
        for len in [1, 2, 3, 5, 17, 240] {
            for c in [0, -1, -one, -one * 4000] {
                for (a, u) in [
                    (-1, 0),
                    (0, last_u),
                    (1, last_u),
                    (1 << 60, last_u),
                    (-1 << 60, 0),
                ] {
                    let stepper = PlaneStepper {
                        at: [a, -a, c],
                        step: [0, 0, 0],
                    };
                    let v = if a > 0 { 0 } else { last_v };
                    for at in pixels(&job(stepper, len, mapper), &texture) {
                        assert_eq!(at, (u, v), "{} of {len}, {stepper:?}", mapper.0);
                    }
                }
            }
            // c is zero at the last pixel, and at the first, so an end of the span meets it.
            for (at, step) in [(i64::from(len - 1) * one, -one), (0, one)] {
                let stepper = PlaneStepper {
                    at: [one, one, at],
                    step: [0, 0, step],
                };
                let pixels = pixels(&job(stepper, len, mapper), &texture);
                let zero = if at == 0 { 0 } else { pixels.len() - 1 };
                let off = (pixels[zero].0 - last_u)
                    .abs()
                    .max((pixels[zero].1 - last_v).abs());
                assert!(off <= 240, "{} of {len}: {:?}", mapper.0, pixels[zero]);
            }
        }
    }
    assert_eq!(quotients([0, -1, 0], (last_u, last_v)), (last_u, 0));
}

/// A mapper's errors compared with its bound.
#[derive(Default)]
struct Errors {
    /// The largest error of spans inside the texture, in texels.
    worst: f64,
    /// The largest ratio of error to bound where the bound is the closed form: the span is inside the
    /// texture, and the bound is well below the coordinate's change.
    closed: f64,
    /// The largest ratio of all other spans.
    other: f64,
    /// The number of spans where the bound is the closed form, and the sum of their ratios.
    spans: u32,
    sum: f64,
}

/// Measures a mapper on random columns, and checks that no error exceeds its bound.
fn measure(columns: u32, mapper: (&str, Subdivision, bool), random: &mut fastrand::Rng) -> Errors {
    let texels = vec![0; 1 << 16];
    let mut errors = Errors::default();
    for _ in 0..seeded::cases(columns as usize) {
        let size = (side(random), side(random));
        let texels = &texels[..usize::from(size.0) * usize::from(size.1)];
        let texture = Texture::new(texels, size.0, size.1).unwrap();
        let len = random.u16(1..=240);
        let stepper = match random.u8(0..16) {
            0 => any(random, len),
            _ => seen(random, len, size),
        };
        let bounds = SpanBound::new(&stepper, len, &texture);
        let bound = f64::from(match mapper.2 {
            true => bounds.linear(mapper.1),
            false => bounds.quadratic(mapper.1),
        });
        let job = job(stepper, len, mapper);
        let (mut error, mut at) = (0f64, 0);
        job.pixels(&texture, |(_, i), coordinates| {
            let off = off(&stepper, i, coordinates, size);
            if off > error {
                (error, at) = (off, i);
            }
        });
        assert!(
            error <= bound + 1e-6,
            "{}: {error} at {at} of {len} is above {bound}: {stepper:?} on {size:?}, {bounds:?}",
            mapper.0
        );
        let share = error / bound;
        let inside = |[a, b, c]: [i64; 3]| {
            let [w, h] = [size.0, size.1].map(i64::from);
            c > 0 && a >= 0 && b >= 0 && a < w * c && b < h * c
        };
        if !inside(stepper.at) || !inside(stepper.after(len - 1)) {
            errors.other = errors.other.max(share);
            continue;
        }
        errors.worst = errors.worst.max(error / 65536.0);
        let [from, to] = bounds.ends;
        let change = (to.0 - from.0).abs().max((to.1 - from.1).abs());
        // Above 1/32 texel, fixed point adds at most a tenth.
        if bound > 2048.0 && bound < 0.7 * f64::from(change) {
            errors.closed = errors.closed.max(share);
            errors.spans += 1;
            errors.sum += share;
        } else {
            errors.other = errors.other.max(share);
        }
    }
    errors
}

fn measure_all(columns: u32) {
    let mut random = seeded::generator();
    let named = MAPPERS
        .iter()
        .filter(|(name, ..)| Mapper::parse(name).is_some());
    for &mapper in named {
        let Errors {
            worst,
            closed,
            other,
            spans,
            sum,
        } = measure(columns, mapper, &mut random);
        println!(
            "{:13} worst {worst:7.3} texels inside; {:5.1} % of the closed form at most, {:4.1} % in the \
             mean of {spans} spans; {:5.1} % of other bounds",
            mapper.0,
            closed * 100.0,
            sum / f64::from(spans) * 100.0,
            other * 100.0
        );
        assert!(
            !seeded::is_whole() || closed >= 0.8,
            "the bound of {} is loose: {closed}",
            mapper.0
        );
    }
}

#[test]
fn no_error_is_above_its_bound_and_the_bound_is_reached() {
    measure_all(COLUMNS);
}

/// `cargo test --release -p texmap --test pieces -- --ignored --nocapture`
#[test]
#[ignore = "a million columns for each mapper: a minute in a release build"]
fn no_error_of_a_million_columns_is_above_its_bound() {
    measure_all(DEEP_COLUMNS);
}

/// The formulas that `docs/limits.md` publishes, in floating point, for a span in front of the eye.
struct Published {
    stepper: PlaneStepper,
    len: u16,
}

impl Published {
    /// Returns du, in units of 2^-16 texel, and r - 1 over the `steps` steps at the span's far end, or over
    /// the part of them up to the fraction `part` from there.
    fn far_end(&self, steps: u16, part: f64) -> (f64, f64) {
        let all = self.len - 1;
        let [first, last] = [self.stepper.at, self.stepper.after(all)];
        let (far, near) = if first[2] < last[2] {
            (first, self.stepper.after(steps))
        } else {
            (last, self.stepper.after(all - steps))
        };
        let change = |k: usize| (near[k] as f64 - far[k] as f64) * part;
        let depth = change(2) / far[2] as f64;
        let du = [0, 1].map(|k| {
            let quotient = far[k] as f64 / far[2] as f64;
            (change(k) - quotient * change(2)) / (far[2] as f64 + change(2)) * 65536.0
        });
        (du[0].abs().max(du[1].abs()), depth)
    }

    /// Returns du (sqrt r - 1) / (sqrt r + 1).
    fn chord(&self, steps: u16, part: f64) -> f64 {
        let (du, x) = self.far_end(steps, part);
        let root = (1.0 + x).sqrt();
        du * x / (root + 1.0).powi(2)
    }

    /// Returns du r / (r - 1) max |(z - 1) (z - m) (z - r)| / (z m r) over z from 1 to r.
    fn parabola(&self, steps: u16) -> f64 {
        let (du, x) = self.far_end(steps, 1.0);
        // z = 1 + s x; the largest value lies at an s below 1/2.
        let at = |s: f64| s * (0.5 - s) * (1.0 - s) / ((1.0 + s * x) * (1.0 + x / 2.0));
        let (mut low, mut high) = (0.0, 0.5);
        for _ in 0..80 {
            let third = (high - low) / 3.0;
            match at(low + third) < at(high - third) {
                true => low += third,
                false => high -= third,
            }
        }
        du * x * x * at(low)
    }

    /// Returns the farthest that an end lies outside a texture of `size`, in units of 2^-16 texel.
    fn outside(&self, size: (u16, u16)) -> f64 {
        let mut most = 0f64;
        for [a, b, c] in [self.stepper.at, self.stepper.after(self.len - 1)] {
            for (n, size) in [(a, size.0), (b, size.1)] {
                let at = n as f64 / c as f64 * 65536.0;
                most = most.max(-at).max(at - f64::from(size) * 65536.0);
            }
        }
        most
    }

    /// Returns the largest error of the span's coordinates.
    fn error(&self, mapper: (&str, Subdivision, bool), texture: &Texture<'_>) -> f64 {
        let size = (texture.width(), texture.height());
        let mut error = 0f64;
        job(self.stepper, self.len, mapper).pixels(texture, |(_, i), at| {
            error = error.max(off(&self.stepper, i, at, size));
        });
        error
    }
}

/// Each term of the published formulas is needed: without it the formula is exceeded somewhere. For linear
/// pieces, the formula over a short last piece at the far end is not a bound.
#[test]
fn the_published_formulas_are_bounds_with_their_rounding_and_clamping() {
    let mut random = seeded::generator();
    let texels = vec![0; 1 << 16];
    let (mut short, mut rounded, mut turned, mut spans) = (0, 0, 0, 0);
    for case in 0..seeded::cases(100_000) {
        let size = (side(&mut random), side(&mut random));
        let texels = &texels[..usize::from(size.0) * usize::from(size.1)];
        let texture = Texture::new(texels, size.0, size.1).unwrap();
        let len = random.u16(2..=240);
        let stepper = seen(&mut random, len, size);
        let mapper = MAPPERS[case % MAPPERS.len()];
        let span = Published { stepper, len };
        let error = span.error(mapper, &texture);
        let longest = mapper.1.longest(len - 1);
        let (formula, allowed) = match mapper.2 {
            true => (
                span.chord(longest, 1.0),
                f64::from(longest) + 2.0 + span.outside(size),
            ),
            false => {
                let (parabola, outside) = (span.parabola(longest), span.outside(size));
                turned += u32::from(error > parabola + 4.0 + outside * 1.25);
                // Below a depth ratio of 5/2, only pieces with clamped ends turn.
                let (_, depth) = span.far_end(longest, 1.0);
                let chords = match depth > 1.5 || outside > 0.0 {
                    true => span.chord(longest, 0.5),
                    false => 0.0,
                };
                (parabola.max(chords), 4.0 + outside * 1.25)
            }
        };
        assert!(
            error <= formula + allowed + 1e-6,
            "{}: {error} above {formula} and {allowed}: {stepper:?}, {len} on {size:?}",
            mapper.0
        );
        rounded += u32::from(error > formula + 1e-6);
        if let (Subdivision::Of(of), true) = (mapper.1, mapper.2) {
            // If c falls, the piece at the far end is the last, which has the steps left over.
            let of = u16::from(of);
            let left = match (len - 1) % of {
                left @ 1.. if stepper.step[2] < 0 => left,
                _ => longest,
            };
            spans += 1;
            short += u32::from(error > span.chord(left, 1.0) + allowed);
        }
    }
    println!(
        "{rounded} spans above the bare formula, {turned} above the parabola's, {short} of {spans} above \
         that of the piece at the far end"
    );
    assert!(!seeded::is_whole() || rounded > 1000 && turned > 1000 && short > 1000);
}

/// v = 2 + 8.5 / x over x from 1 to 3, in 24 steps: the piece turns, and its two chords are off by 1.85 times
/// as much as the parabola would be.
#[test]
fn a_piece_that_turns_is_bounded_by_its_chords() {
    let texture = Texture::new(&[0; 16 * 16], 16, 16).unwrap();
    let c = 1i64 << 40;
    // x is 1 + i / 12 at pixel i.
    let stepper = PlaneStepper {
        at: [0, 2 * 12 * c + 17 * 6 * c, 12 * c],
        step: [0, 2 * c, c],
    };
    let mapper = ("quadratic-32", Subdivision::Of(32), false);
    let span = Published { stepper, len: 25 };
    let error = span.error(mapper, &texture) / 65536.0;
    let [parabola, chords] = [span.parabola(24), span.chord(24, 0.5)].map(|n| n / 65536.0);
    println!("{error} texels; parabola {parabola}, chords {chords}");
    assert!((0.393..0.395).contains(&parabola), "{parabola}");
    assert!((0.728..chords + 4.0 / 65536.0).contains(&error), "{error}");
    let bound = SpanBound::new(&stepper, 25, &texture).quadratic(mapper.1);
    assert!(error * 65536.0 <= f64::from(bound), "{error} above {bound}");
}
