//! The column loops alone: a frame of 320 columns of 200 pixels in RAM.
//!
//! `cargo bench -p texmap` prints cycles a pixel, and their ratios to the bare loop in the same order
//! and to the packed loop in x order. Compare times only within one run: each round measures all
//! loops in turn, and a row has the medians.

mod work;

use modex::PlanarBuffer;
use texmap::{Loop, Mapper, Rows};
use work::{By, Order, PIECES, PIXELS, draw, texels, texture};

/// Returns everything that is timed.
fn all() -> Vec<(By, Order)> {
    let mut all = Vec::new();
    for order in [Order::X, Order::Planes] {
        all.push((By::Bare, order));
        all.extend(Loop::ALL.map(|by| (By::Loop(by), order)));
        all.extend(PIECES.map(|length| (By::Pieces(length), order)));
        all.push((By::Quotients, order));
    }
    all.extend([Rows::Multiply, Rows::Steps, Rows::Passes].map(|rows| (By::Rows(rows), Order::X)));
    all
}

/// Returns the label of a line: the name of a mapper where one draws the frame.
fn name(by: By) -> String {
    match by {
        By::Bare => "bare load and store".into(),
        By::Loop(by) => Mapper::Affine(by).to_string(),
        By::Pieces(length) => format!("pieces of {length}"),
        By::Quotients => "quotients".into(),
        By::Rows(rows) => Mapper::Rows(rows).to_string(),
    }
}

fn main() {
    // Only `cargo bench` passes this flag; `cargo test` just builds and starts the program.
    if std::env::args().all(|arg| arg != "--bench") {
        return;
    }
    #[cfg(target_arch = "x86_64")]
    cycles::table();
    #[cfg(not(target_arch = "x86_64"))]
    println!("the time stamp counter of an x86-64 CPU is needed");
}

#[cfg(target_arch = "x86_64")]
mod cycles {
    use super::*;
    use std::arch::x86_64::{_mm_lfence, _rdtsc};

    /// The rounds are many and short, so that other programs disturb few of them.
    const ROUNDS: usize = 401;

    /// Returns the time stamp after all earlier instructions are done.
    fn now() -> u64 {
        // SAFETY: every x86-64 CPU has SSE2.
        unsafe { _mm_lfence() };
        // SAFETY: every x86-64 CPU has the counter; a system that forbids reading it would fault.
        unsafe { _rdtsc() }
    }

    /// Prints the medians of cycles per pixel, with the fastest round and the spread of the middle half.
    pub fn table() {
        let texels = texels();
        let texture = texture(&texels);
        let mut page = PlanarBuffer::new();
        let all = all();
        let mut cycles = vec![Vec::new(); all.len()];
        for _ in 0..ROUNDS {
            for (&(by, order), cycles) in all.iter().zip(&mut cycles) {
                draw(&mut page, &texture, by, order);
                let start = now();
                draw(&mut page, &texture, by, order);
                let elapsed = now() - start;
                cycles.push(elapsed as f64 / f64::from(PIXELS));
            }
        }
        for cycles in &mut cycles {
            cycles.sort_by(f64::total_cmp);
        }
        let place = |place: usize, by, order| {
            let at = all.iter().position(|&other| other == (by, order));
            at.map_or(f64::NAN, |at| cycles[at][place])
        };
        let median = |by, order| place(ROUNDS / 2, by, order);
        let packed = median(By::Loop(Loop::Packed), Order::X);
        println!(
            "\ncycles per pixel: median of {ROUNDS} rounds, fastest round, (middle half); ratio to the bare loop in the same order; packed in x order as a multiple of the median"
        );
        for (&(by, order), cycles) in all.iter().zip(&cycles) {
            let (fastest, low, middle, high) = (
                cycles[0],
                cycles[ROUNDS / 4],
                cycles[ROUNDS / 2],
                cycles[ROUNDS * 3 / 4],
            );
            println!(
                "{:<20} {:<7} {middle:5.2} {fastest:5.2} ({low:.2} to {high:.2}) {:5.2} {:5.2}{}",
                name(by),
                format!("{order:?}"),
                middle / median(By::Bare, order),
                packed / middle,
                match by {
                    By::Loop(by) if !by.is_tuned_here() => " (portable)",
                    _ => "",
                },
            );
        }
        // The costs `PIECE` and `EXACT` of `texmap::mappers::adaptive`.
        for order in [Order::X, Order::Planes] {
            let [short, long] = [PIECES[0], PIECES[PIECES.len() - 1]];
            let more = median(By::Pieces(short), order) - median(By::Pieces(long), order);
            let piece = more / (1.0 / f64::from(short) - 1.0 / f64::from(long));
            let pixel = median(By::Loop(Loop::fastest()), order);
            println!(
                "{order:?}: a piece costs {piece:.0} cycles, as many as {:.0} pixels of {}; a quotient \
                 {:.1} pixels",
                piece / pixel,
                name(By::Loop(Loop::fastest())),
                median(By::Quotients, order) / pixel,
            );
        }
        for (what, at) in [("medians", ROUNDS / 2), ("fastest", 0)] {
            let best = Loop::ALL
                .map(|by| place(at, By::Loop(by), Order::Planes))
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            println!(
                "{what}: the best loop plane by plane takes {:.2} times as long as the bare loop; \
                 packed in x order {:.2} times as long as the best, row-multiply {:.2} times",
                best / place(at, By::Bare, Order::Planes),
                place(at, By::Loop(Loop::Packed), Order::X) / best,
                place(at, By::Rows(Rows::Multiply), Order::X) / best,
            );
        }
    }
}
