//! The sweep of the renderer against the oracle: `cargo sweep`.

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
use oracle::{plane, solid};

/// Compares the renderer with the oracle on random cases that are likely to fail: polygons in both scans,
/// texels of the exact mapper, solids in any pose. Or on all triangles of a small world. Exit code 0: equal;
/// 1: different, with a test to paste; 2: wrong usage; 130: interrupted.
#[derive(Parser)]
#[command(name = "cargo sweep")]
struct Arguments {
    /// Stop after this many seconds [default: 60, without --cases]
    #[arg(long)]
    seconds: Option<u64>,
    /// Stop after this many minutes
    #[arg(long, conflicts_with = "seconds")]
    minutes: Option<u64>,
    /// Stop after this many cases of each mix (solids: every 50th case only)
    #[arg(long)]
    cases: Option<u64>,
    /// Repeat the cases of this seed [default: a fresh seed]
    #[arg(long, conflicts_with = "small_world")]
    seed: Option<u64>,
    /// Start with this case, where a sweep of the same seed ended
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Only the mixes whose names in the table contain this: "texels", "solids: cube"; repeatable
    #[arg(long, value_name = "TEXT", conflicts_with = "small_world")]
    only: Vec<String>,
    /// Every triangle on a lattice of 16 x 16, all 16.7 million; the lattice's step is 128/256 pixel or as
    /// given
    #[arg(long, value_name = "STEP", num_args = 0..=1, default_missing_value = "128",
          value_parser = step)]
    small_world: Option<i32>,
}

fn step(text: &str) -> Result<i32, String> {
    let step = text.parse().ok().filter(|step| STEPS.contains(step));
    step.ok_or_else(|| format!("the step is one of {STEPS:?}"))
}

/// Cases of each mix between two checks of the clock: a fraction of a second.
const ROUND: u64 = 1000;

/// A solid needs as much time as some hundred polygons. With every 50th case only, solids, texels and
/// polygons get about a third of the time each.
const SOLIDS: u64 = 50;

/// Interval between progress reports without a terminal.
const SILENCE: Duration = Duration::from_secs(10);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Results of a mix.
#[derive(Clone, Copy, Default)]
struct Tally {
    tried: u64,
    polygons: u64,
    pixels: u64,
    failed: u64,
}

/// Further results of the solids.
#[derive(Default)]
struct Solids {
    /// Pixels seen from outside.
    outside: u64,
    compared: solid::Compared,
}

/// A kind of case. A sweep alternates between all kinds.
#[derive(Clone, Copy)]
enum Kind {
    Polygons(Mix),
    Texels(plane::Mix),
    Solids(solid::Mix),
    SmallWorld(i32),
}

impl Kind {
    /// All mixes.
    fn mixes() -> impl Iterator<Item = Self> {
        let polygons = Mix::ALL.map(Self::Polygons);
        let texels = plane::Mix::ALL.map(Self::Texels);
        let solids = solid::Mix::ALL.map(Self::Solids);
        polygons.into_iter().chain(texels).chain(solids)
    }

    fn name(self) -> String {
        match self {
            Self::Polygons(mix) => format!("polygons: {}", mix.name()),
            Self::Texels(mix) => format!("texels: {}", mix.name()),
            Self::Solids(mix) => format!("solids: {}", mix.name()),
            Self::SmallWorld(_) => "the small world".to_owned(),
        }
    }

    /// Runs every Nth case only.
    fn stride(self) -> u64 {
        match self {
            Self::Solids(_) => SOLIDS,
            _ => 1,
        }
    }

    /// The case, if this kind consists of polygons.
    fn polygons(self, seed: u64, number: u64) -> Option<Case> {
        match self {
            Self::Polygons(mix) => Some(mix.case(seed, number)),
            Self::SmallWorld(step) => Some(Case {
                polygons: vec![triangle(step, number as u32).to_vec()],
                outline: None,
            }),
            _ => None,
        }
    }
}

/// The checkers of each kind of case.
#[derive(Default)]
struct Checkers {
    polygons: Checker,
    texels: plane::Checker,
    solids: solid::Checker,
    /// The solids' further results so far.
    seen: Solids,
}

impl Checkers {
    /// Checks a case; returns `None` if it fails.
    fn try_case(&mut self, kind: Kind, seed: u64, number: u64) -> Option<Tally> {
        let tally = |polygons, pixels| Tally {
            polygons,
            pixels,
            ..Tally::default()
        };
        match kind {
            Kind::Polygons(_) | Kind::SmallWorld(_) => {
                let case = kind.polygons(seed, number)?;
                let pixels = self.polygons.case(&case).ok()?;
                Some(tally(case.polygons.len() as u64, pixels))
            }
            Kind::Texels(mix) => {
                let compared = self.texels.case(&mix.case(seed, number)).ok()?;
                Some(tally(1, compared.samples))
            }
            Kind::Solids(mix) => {
                let case = mix.case(seed, number);
                let compared = self.solids.case(&case).ok()?;
                if case.eye == solid::Eye::Outside {
                    self.seen.outside += compared.pixels;
                }
                self.seen.compared += compared;
                Some(tally(compared.faces, compared.pixels))
            }
        }
    }

    /// The source of a test with a failed case.
    fn source(&mut self, kind: Kind, seed: u64, number: u64, from: &str) -> String {
        const FAILS: &str = "a case fails again";
        match kind {
            Kind::Polygons(_) | Kind::SmallWorld(_) => {
                let case = kind.polygons(seed, number).expect("polygons");
                let small = shrink(&mut self.polygons, &case);
                let wrong = self.polygons.case(&small).expect_err(FAILS);
                source(&small, &wrong, from)
            }
            Kind::Texels(mix) => {
                let small = mix.case(seed, number).shrink(&mut self.texels);
                let wrong = self.texels.case(&small).expect_err(FAILS);
                small.source(&wrong, from)
            }
            Kind::Solids(mix) => {
                let case = mix.case(seed, number);
                let wrong = self.solids.case(&case).expect_err(FAILS);
                case.source(&wrong, from)
            }
        }
    }
}

/// The kinds of a sweep, and how to repeat it.
struct Plan {
    kinds: Vec<Kind>,
    seed: u64,
    /// The options that repeat the same cases.
    options: String,
    /// One more than the last case.
    last: u64,
}

impl Plan {
    fn new(arguments: &Arguments) -> Result<Self, String> {
        if let Some(step) = arguments.small_world {
            return Ok(Self {
                kinds: vec![Kind::SmallWorld(step)],
                seed: 0,
                options: format!("--small-world {step}"),
                last: u64::from(TRIANGLES),
            });
        }
        let named = |text: &String| Kind::mixes().any(|kind| kind.name().contains(text));
        if let Some(text) = arguments.only.iter().find(|text| !named(text)) {
            let names: Vec<_> = Kind::mixes().map(Kind::name).collect();
            let names = names.join("\n  ");
            return Err(format!(
                "no mix has {text:?} in its name; these are\n  {names}"
            ));
        }
        let only = &arguments.only;
        let wanted = |kind: &Kind| {
            let name = kind.name();
            only.is_empty() || only.iter().any(|text| name.contains(text))
        };
        let seed = arguments.seed.unwrap_or_else(|| fastrand::u64(..));
        let only: String = only
            .iter()
            .map(|text| format!(" --only {text:?}"))
            .collect();
        Ok(Self {
            kinds: Kind::mixes().filter(wanted).collect(),
            seed,
            options: format!("--seed {seed}{only}"),
            last: u64::MAX,
        })
    }

    /// Names a case so that it can be repeated.
    fn told(&self, kind: Kind, number: u64) -> String {
        let name = kind.name();
        match kind {
            Kind::SmallWorld(_) => format!("cargo sweep {}: case {number}", self.options),
            _ => format!("cargo sweep --seed {}: {name}, case {number}", self.seed),
        }
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let plan = match Plan::new(&arguments) {
        Ok(plan) => plan,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(2);
        }
    };
    // No second Ctrl-C is needed: a round lasts a fraction of a second.
    if let Err(error) = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed)) {
        eprintln!("Ctrl-C will lose the figures: {error}");
    }
    println!("cargo sweep {}", plan.options);
    sweep(&plan, &arguments)
}

fn sweep(plan: &Plan, arguments: &Arguments) -> ExitCode {
    let end = arguments.cases.map_or(plan.last, |cases| {
        arguments.from.saturating_add(cases).min(plan.last)
    });
    let seconds = arguments
        .minutes
        .map(|minutes| minutes * 60)
        .or(arguments.seconds);
    let limit = seconds
        .or((end == u64::MAX).then_some(60))
        .map(Duration::from_secs);
    let begun = Instant::now();
    let mut progress = Progress::new(limit, arguments.from, end);
    let mut tallies = vec![Tally::default(); plan.kinds.len()];
    let mut failures = Vec::new();
    let mut checkers = Checkers::default();
    let mut number = arguments.from;
    while number < end && failures.is_empty() {
        let round = number..number.saturating_add(ROUND).min(end);
        for (&kind, tally) in plan.kinds.iter().zip(&mut tallies) {
            for number in round.clone() {
                if number % kind.stride() != 0 {
                    continue;
                }
                tally.tried += 1;
                if let Some(more) = checkers.try_case(kind, plan.seed, number) {
                    tally.polygons += more.polygons;
                    tally.pixels += more.pixels;
                    continue;
                }
                tally.failed += 1;
                // The first failure of a mix is enough.
                if tally.failed == 1 {
                    let from = plan.told(kind, number);
                    failures.push(checkers.source(kind, plan.seed, number, &from));
                }
            }
        }
        number = round.end;
        progress.at(number, begun.elapsed());
        let late = limit.is_some_and(|limit| begun.elapsed() >= limit);
        if late || INTERRUPTED.load(Ordering::Relaxed) {
            break;
        }
    }
    drop(progress);
    print(&plan.kinds, &tallies, begun.elapsed());
    checkers.seen.print();
    if !failures.is_empty() {
        for failure in failures {
            print!("\n{failure}");
        }
        return ExitCode::from(1);
    }
    if number < plan.last {
        println!(
            "continue with: cargo sweep {} --from {number}",
            plan.options
        );
    }
    match INTERRUPTED.load(Ordering::Relaxed) {
        true => ExitCode::from(130),
        false => ExitCode::SUCCESS,
    }
}

fn print(kinds: &[Kind], tallies: &[Tally], took: Duration) {
    let mut sum = Tally::default();
    println!(
        "{:35} {:>10} {:>11} {:>14} {:>7}",
        "", "tried", "polygons", "pixels", "failed"
    );
    let line = |name: &str, tally: &Tally| {
        let Tally {
            tried,
            polygons,
            pixels,
            failed,
        } = tally;
        println!("{name:35} {tried:10} {polygons:11} {pixels:14} {failed:7}");
    };
    for (kind, tally) in kinds.iter().zip(tallies) {
        line(&kind.name(), tally);
        sum.tried += tally.tried;
        sum.polygons += tally.polygons;
        sum.pixels += tally.pixels;
        sum.failed += tally.failed;
    }
    line("all", &sum);
    println!("in {:.1} s", took.as_secs_f64());
}

impl Solids {
    /// Prints results that are not failures.
    fn print(&self) {
        let Self { outside, compared } = self;
        if *outside > 0 {
            println!(
                "{} of {outside} pixels seen from outside lie in a fold: two facets have them, since \
                 rounding turned one over at the silhouette",
                compared.folds
            );
        }
        if compared.changed > 0 {
            let [near, guard] = compared.cut;
            println!(
                "{} pixels lie across a true edge, by {:.5} pixel at most; {near} faces seen were cut by \
                 the near plane, {guard} by the guard band",
                compared.changed, compared.furthest
            );
        }
    }
}

/// Reports progress on standard error: a moving line on a terminal, a line from time to time elsewhere.
struct Progress {
    from: u64,
    limit: Option<Duration>,
    said: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    fn new(limit: Option<Duration>, from: u64, end: u64) -> Self {
        if let Some(limit) = limit {
            eprintln!("at most {} s", limit.as_secs());
        }
        let bar = stderr().is_terminal().then(|| {
            let (template, length) = match (end, limit) {
                (u64::MAX, Some(limit)) => (
                    "  {wide_bar} {pos} of {len} s, {msg} cases of each",
                    limit.as_secs(),
                ),
                _ => (
                    "  {wide_bar} {pos} of {len}, {elapsed}",
                    end.saturating_sub(from),
                ),
            };
            let style = ProgressStyle::with_template(template).expect("the template is constant");
            ProgressBar::new(length).with_style(style)
        });
        let by_time = end == u64::MAX;
        Self {
            from,
            limit: limit.filter(|_| by_time),
            said: Instant::now(),
            bar,
        }
    }

    fn at(&mut self, number: u64, elapsed: Duration) {
        let done = number - self.from;
        if let Some(bar) = &self.bar {
            bar.set_message(done.to_string());
            bar.set_position(self.limit.map_or(done, |_| elapsed.as_secs()));
        } else if self.said.elapsed() >= SILENCE {
            self.said = Instant::now();
            eprintln!("  {done} cases of each in {} s", elapsed.as_secs());
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
