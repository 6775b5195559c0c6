//! The sweep of the renderer's coverage against the oracle: `cargo sweep`.

use std::io::{IsTerminal, stderr};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use oracle::check::{Case, Checker};
use oracle::mix::Mix;
use oracle::shrink::{shrink, source};
use oracle::small_world::{STEPS, TRIANGLES, triangle};

/// Compares the column scan, the row scan and the oracle on random polygons, or on all of a
/// small world. Exit code 0: equal; 1: not, with a test to paste; 130: interrupted.
#[derive(Parser)]
#[command(name = "cargo sweep")]
struct Arguments {
    /// Stop after this many seconds [default: 60, without --cases]
    #[arg(long)]
    seconds: Option<u64>,
    /// Stop after this many minutes
    #[arg(long, conflicts_with = "seconds")]
    minutes: Option<u64>,
    /// Stop after this many cases of each mix
    #[arg(long)]
    cases: Option<u64>,
    /// Make the same polygons again [default: a fresh one]
    #[arg(long, conflicts_with = "small_world")]
    seed: Option<u64>,
    /// Begin with this case, where a sweep of the same seed ended
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Every triangle on a lattice of 16 x 16, all 16.7 million, with a step of 128/256 pixel
    /// or as given
    #[arg(long, value_name = "STEP", num_args = 0..=1, default_missing_value = "128",
          value_parser = step)]
    small_world: Option<i32>,
}

fn step(text: &str) -> Result<i32, String> {
    let step = text.parse().ok().filter(|step| STEPS.contains(step));
    step.ok_or_else(|| format!("the step is one of {STEPS:?}"))
}

/// Cases between two looks at the clock, of each mix.
const ROUND: u64 = 1000;

/// Without a terminal: how often it is told how far the sweep is.
const SILENCE: Duration = Duration::from_secs(10);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// What was done of a mix.
#[derive(Clone, Copy, Default)]
struct Tally {
    tried: u64,
    polygons: u64,
    pixels: u64,
    failed: u64,
}

/// The kinds of cases that a sweep goes through side by side.
enum Cases {
    Mixes(u64),
    SmallWorld(i32),
}

impl Cases {
    fn names(&self) -> Vec<&'static str> {
        match self {
            Self::Mixes(_) => Mix::ALL.map(Mix::name).into(),
            Self::SmallWorld(_) => vec!["the small world"],
        }
    }

    fn case(&self, kind: usize, number: u64) -> Case {
        match self {
            Self::Mixes(seed) => Mix::ALL[kind].case(*seed, number),
            Self::SmallWorld(step) => Case {
                polygons: vec![triangle(*step, number as u32).to_vec()],
                outline: None,
            },
        }
    }

    /// The options that make the same cases again.
    fn options(&self) -> String {
        match self {
            Self::Mixes(seed) => format!("--seed {seed}"),
            Self::SmallWorld(step) => format!("--small-world {step}"),
        }
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let cases = match arguments.small_world {
        Some(step) => Cases::SmallWorld(step),
        None => Cases::Mixes(arguments.seed.unwrap_or_else(|| fastrand::u64(..))),
    };
    // A second Ctrl-C is not needed: a round takes a fraction of a second.
    if let Err(error) = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed)) {
        eprintln!("Ctrl-C will lose the figures: {error}");
    }
    println!("cargo sweep {}", cases.options());
    sweep(&cases, &arguments)
}

fn sweep(cases: &Cases, arguments: &Arguments) -> ExitCode {
    let last = match cases {
        Cases::Mixes(_) => u64::MAX,
        Cases::SmallWorld(_) => u64::from(TRIANGLES),
    };
    let end = arguments
        .cases
        .map_or(last, |cases| arguments.from.saturating_add(cases).min(last));
    let seconds = arguments
        .minutes
        .map(|minutes| minutes * 60)
        .or(arguments.seconds);
    let limit = seconds
        .or((end == u64::MAX).then_some(60))
        .map(Duration::from_secs);
    let begun = Instant::now();
    let mut progress = Progress::new(limit, arguments.from, end);
    let names = cases.names();
    let mut tallies = vec![Tally::default(); names.len()];
    let mut failures = Vec::new();
    let mut checker = Checker::default();
    let mut number = arguments.from;
    while number < end && failures.is_empty() {
        let round = number..number.saturating_add(ROUND).min(end);
        for (kind, tally) in tallies.iter_mut().enumerate() {
            for number in round.clone() {
                let case = cases.case(kind, number);
                tally.tried += 1;
                tally.polygons += case.polygons.len() as u64;
                match checker.case(&case) {
                    Ok(pixels) => tally.pixels += pixels,
                    Err(_) => {
                        tally.failed += 1;
                        // One of a mix is enough to look at.
                        if tally.failed == 1 {
                            let small = shrink(&mut checker, &case);
                            let wrong = checker.case(&small).expect_err("it still fails");
                            let from = format!("{}, case {number}", names[kind]);
                            let from = format!("cargo sweep {}: {from}", cases.options());
                            failures.push(source(&small, &wrong, from));
                        }
                    }
                }
            }
        }
        number = round.end;
        progress.at(number);
        let late = limit.is_some_and(|limit| begun.elapsed() >= limit);
        if late || INTERRUPTED.load(Ordering::Relaxed) {
            break;
        }
    }
    drop(progress);
    print(&names, &tallies, begun.elapsed());
    if !failures.is_empty() {
        for failure in failures {
            print!("\n{failure}");
        }
        return ExitCode::from(1);
    }
    if number < last {
        println!(
            "continue with: cargo sweep {} --from {number}",
            cases.options()
        );
    }
    match INTERRUPTED.load(Ordering::Relaxed) {
        true => ExitCode::from(130),
        false => ExitCode::SUCCESS,
    }
}

fn print(names: &[&str], tallies: &[Tally], took: Duration) {
    let mut sum = Tally::default();
    println!(
        "{:26} {:>11} {:>11} {:>14} {:>7}",
        "", "tried", "polygons", "pixels", "failed"
    );
    let line = |name: &str, tally: &Tally| {
        let Tally {
            tried,
            polygons,
            pixels,
            failed,
        } = tally;
        println!("{name:26} {tried:11} {polygons:11} {pixels:14} {failed:7}");
    };
    for (name, tally) in names.iter().zip(tallies) {
        line(name, tally);
        sum.tried += tally.tried;
        sum.polygons += tally.polygons;
        sum.pixels += tally.pixels;
        sum.failed += tally.failed;
    }
    line("all", &sum);
    println!("in {:.1} s", took.as_secs_f64());
}

/// Tells on standard error how far it is: on a terminal by a moving line, elsewhere now and then.
struct Progress {
    from: u64,
    said: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    fn new(limit: Option<Duration>, from: u64, end: u64) -> Self {
        if let Some(limit) = limit {
            eprintln!("at most {} s", limit.as_secs());
        }
        let bar = stderr().is_terminal().then(|| {
            let (template, length) = match end {
                u64::MAX => ("  {spinner} {pos} cases of each mix, {elapsed}", 0),
                _ => (
                    "  {wide_bar} {pos} of {len}, {elapsed}",
                    end.saturating_sub(from),
                ),
            };
            let style = ProgressStyle::with_template(template).expect("the template is constant");
            ProgressBar::new(length).with_style(style)
        });
        Self {
            from,
            said: Instant::now(),
            bar,
        }
    }

    fn at(&mut self, number: u64) {
        let done = number - self.from;
        if let Some(bar) = &self.bar {
            bar.tick();
            bar.set_position(done);
        } else if self.said.elapsed() >= SILENCE {
            self.said = Instant::now();
            eprintln!("  {done} cases of each");
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
