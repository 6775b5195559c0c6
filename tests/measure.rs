//! Runs the benchmark kernel in real QEMU, and checks the counts.

use std::fmt::Write;
use std::sync::LazyLock;

use bench::Work;
use study::measure::{self, BenchMemories, Cpu, EmulatedBenches, KernelFigures, MeasureConfig};
use texmap::{Mapper, Order};

use crate::ready::READY;

/// Returns the mappers with these names.
fn mappers(names: &[&str]) -> Vec<Mapper> {
    let named = names.iter().map(|name| Mapper::parse(name));
    named.map(|mapper| mapper.expect("a mapper")).collect()
}

/// Measures a mapper of each kind. The measurement checks that figures repeat under `-icount`, that the
/// number of pixels is equal without it, and that QEMU and the emulated VGA draw the same frames.
#[test]
fn the_benchmark_kernel_boots_and_its_figures_are_plausible() {
    LazyLock::force(&READY);
    let names = ["row-passes", "affine", "exact"];
    let measured = measure::run(&MeasureConfig {
        cpus: vec![Cpu::Baseline],
        mappers: mappers(&names),
        rounds: 1,
        ..MeasureConfig::default()
    })
    .unwrap();
    let [cpu] = &measured.cpus[..] else {
        panic!("expected the figures of one CPU model");
    };
    assert_eq!(cpu.rows.len(), names.len() * Order::ALL.len());
    assert!(!cpu.bmi2, "{} has no BMI2", cpu.cpu);
    let screen = (modex::WIDTH * modex::HEIGHT) as u64;
    for row in &cpu.rows {
        let name = format!("{} {}", row.mapper, row.order);
        let a_pixel = |work| row.cost(work).instructions_a_pixel();
        for work in [
            Work::BareRam,
            Work::BareCard,
            Work::ScreenRam,
            Work::ScreenCard,
        ] {
            assert_eq!(row.cost(work).pixels, screen, "{name}: {work}");
        }
        // A store, and a share of a counter and a branch. The share is larger for loops that are not
        // unrolled.
        for work in [Work::BareRam, Work::BareCard] {
            let bare = a_pixel(work);
            assert!((1.0..4.5).contains(&bare), "{name}: {work} {bare}");
        }
        // Eight bytes a store, with a loop iteration for each store, and more bytes than pixels.
        let present = a_pixel(Work::Present);
        assert!((0.2..8.0).contains(&present), "{name}: {present}");
        // At least texel, step and store; the reference implementations are slow, but not slower than this.
        let drawn = row.instructions_a_pixel();
        assert!((3.0..400.0).contains(&drawn), "{name}: {drawn}");
        // Each work includes the previous one.
        let parts = [
            Work::FrameFaces,
            Work::FrameJobs,
            Work::FrameDrawCard,
            Work::FrameCard,
        ];
        for pair in parts.windows(2) {
            assert!(a_pixel(pair[0]) < a_pixel(pair[1]), "{name}: {pair:?}");
        }
        // The same drawing costs the same in RAM and in video memory, apart from Map Mask.
        assert!(
            a_pixel(Work::ScreenRam) <= a_pixel(Work::ScreenCard),
            "{name}"
        );
        assert_eq!(row.spans.len(), bench::LENGTHS.len());
        for span in &row.spans {
            let length = span.length;
            assert_eq!(span.draw.pixels % u64::from(length), 0, "{name}: {length}");
            assert_eq!(span.draw.pixels, span.jobs.pixels, "{name}: {length}");
        }
        let (shortest, longest) = (
            &row.spans[0].draw,
            &row.spans[bench::LENGTHS.len() - 1].draw,
        );
        assert!(
            shortest.instructions_a_pixel() > longest.instructions_a_pixel(),
            "{name}: a span of one pixel pays for a whole set-up"
        );
        assert_eq!(row.cost(Work::FrameCard).ticks.len(), 1);
        assert_eq!(row.accesses.loads, 0, "{name} reads video memory");
    }
}

/// Also checks that each order has its characteristic counts.
#[test]
fn counters_do_not_change_what_is_drawn() {
    let mut memories = BenchMemories::default();
    let mut emulated = EmulatedBenches::new(&mut memories);
    for &(_, mapper, _) in Mapper::ALL {
        let mut pixels = Vec::new();
        for (name, order, _) in Order::ALL {
            let [plain, counted] = emulated.checksums(mapper, order).unwrap();
            assert_eq!(plain, counted, "{mapper} {name}");
            // All works but three draw.
            assert_eq!(plain.len(), Work::ALL.len() - 3, "{plain:?}");
            let accesses = emulated.accesses(mapper, order).unwrap();
            assert_eq!(accesses.flip.ports, 1, "{mapper} {name}");
            if order == Order::Buffer {
                assert_eq!(accesses.draw.map_mask, 4, "{mapper}");
                assert_eq!(accesses.erase, modex::Tally::default(), "{mapper}");
            } else {
                pixels.push(accesses.draw.bytes);
                assert_eq!(accesses.draw.bytes, accesses.draw.stores, "{mapper} {name}");
                assert_eq!(accesses.erase.map_mask, 1, "{mapper} {name}");
            }
            if order == Order::Planes {
                // Four more for each list of jobs that fills up before the frame is drawn.
                let lists = accesses.draw.map_mask / 4;
                assert_eq!(accesses.draw.map_mask % 4, 0, "{mapper}");
                assert!((1..=3).contains(&lists), "{mapper}: {lists} lists");
            }
        }
        assert_eq!(
            pixels[0], pixels[1],
            "{mapper}: as many pixels in either order"
        );
    }
}

/// Prints everything as a table:
/// `cargo test --release --test qemu -- --ignored --exact --nocapture measure::figures`.
#[test]
#[ignore = "measures for minutes; run it alone"]
fn figures() {
    LazyLock::force(&READY);
    let measured = measure::run(&MeasureConfig::default()).unwrap();
    println!("{}", table(&measured));
}

/// Instructions a pixel and ratios of times, a line for each mapper and order.
fn table(measured: &KernelFigures) -> String {
    let mut table = format!("QEMU {}\n", measured.qemu);
    for cpu in &measured.cpus {
        let bmi2 = if cpu.bmi2 { "with" } else { "without" };
        let reference = &cpu.rows[0];
        let a_pixel = |work| reference.cost(work).instructions_a_pixel();
        writeln!(
            table,
            "\n-cpu {}, {bmi2} BMI2; bare stores {:.2} instructions a pixel in RAM, {:.2} in video memory; \
             presenting {:.2}\n{:28} {:>7} {:>7} {:>7} {:>7} {:>7}  {:>6} {:>7} {:>6}  frame over bare stores / over presenting",
            cpu.cpu,
            a_pixel(Work::BareRam),
            a_pixel(Work::BareCard),
            a_pixel(Work::Present),
            "instructions a pixel",
            "jobs",
            "loop",
            "faces",
            "jobs",
            "frame",
            "ports",
            "stores",
            "erase"
        )
        .unwrap();
        for row in &cpu.rows {
            let a_pixel = |work| row.cost(work).instructions_a_pixel();
            let accesses = &row.accesses;
            writeln!(
                table,
                "{:28} {:7.2} {:7.2} {:7.2} {:7.2} {:7.2}  {:6} {:7} {:6}  {} / {}",
                format!("{} {}", row.mapper, row.order),
                a_pixel(Work::ScreenJobs),
                a_pixel(Work::ScreenRam),
                a_pixel(Work::FrameFaces),
                a_pixel(Work::FrameJobs),
                a_pixel(row.whole_frame()),
                accesses.draw.ports + accesses.erase.ports + accesses.flip.ports,
                accesses.draw.stores,
                accesses.erase.stores,
                row.frame_over_bare(),
                row.frame_over_present(),
            )
            .unwrap();
        }
    }
    table
}
