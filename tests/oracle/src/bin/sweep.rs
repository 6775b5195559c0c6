//! The sweep of the renderer against the oracle: `cargo sweep`.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use oracle::check::{CoverageCase, CoverageChecker};
use oracle::mix::PolygonMix;
use oracle::plane::{PlaneChecker, PlaneMix};
use oracle::shrink::{shrink, source};
use oracle::small_world::{STEPS, TRIANGLES, triangle};
use oracle::solid::{Eye, SolidChecker, SolidCounts, SolidMix};
use system::{Interrupted, Progress, catch_interrupts, interrupted};

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
    step.ok_or_else(|| format!("the step must be {} or {}", STEPS[0], STEPS[1]))
}

/// Cases of each mix between two checks of the clock: a fraction of a second.
const ROUND: u64 = 1000;

/// A solid needs as much time as some hundred polygons. With every 50th case only, solids, texels and
/// polygons get about a third of the time each.
const SOLID_STRIDE: u64 = 50;

/// The results of a mix.
#[derive(Clone, Copy, Default)]
struct MixResults {
    tried: u64,
    polygons: u64,
    pixels: u64,
    failed: u64,
}

/// The further results of the solids.
#[derive(Default)]
struct SolidTotals {
    /// Pixels seen from outside.
    outside: u64,
    compared: SolidCounts,
}

/// A kind of case. A sweep alternates between all kinds.
#[derive(Clone, Copy)]
enum CaseKind {
    Polygons(PolygonMix),
    Texels(PlaneMix),
    Solids(SolidMix),
    SmallWorld(i32),
}

impl CaseKind {
    /// Returns all mixes.
    fn mixes() -> impl Iterator<Item = Self> {
        let polygons = PolygonMix::ALL.map(Self::Polygons);
        let texels = PlaneMix::ALL.map(Self::Texels);
        let solids = SolidMix::ALL.map(Self::Solids);
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
            Self::Solids(_) => SOLID_STRIDE,
            _ => 1,
        }
    }

    /// Returns the case, if this kind consists of polygons.
    fn polygons(self, seed: u64, number: u64) -> Option<CoverageCase> {
        match self {
            Self::Polygons(mix) => Some(mix.case(seed, number)),
            Self::SmallWorld(step) => Some(CoverageCase {
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
    polygons: CoverageChecker,
    texels: PlaneChecker,
    solids: SolidChecker,
    /// The solids' further results so far.
    solid_totals: SolidTotals,
}

impl Checkers {
    /// Checks a case; returns `None` if it fails.
    fn try_case(&mut self, kind: CaseKind, seed: u64, number: u64) -> Option<MixResults> {
        let result = |polygons, pixels| MixResults {
            polygons,
            pixels,
            ..MixResults::default()
        };
        match kind {
            CaseKind::Polygons(_) | CaseKind::SmallWorld(_) => {
                let case = kind.polygons(seed, number)?;
                let pixels = self.polygons.case(&case).ok()?;
                Some(result(case.polygons.len() as u64, pixels))
            }
            CaseKind::Texels(mix) => {
                let compared = self.texels.case(&mix.case(seed, number)).ok()?;
                Some(result(1, compared.samples))
            }
            CaseKind::Solids(mix) => {
                let case = mix.case(seed, number);
                let compared = self.solids.case(&case).ok()?;
                if case.eye == Eye::Outside {
                    self.solid_totals.outside += compared.pixels;
                }
                self.solid_totals.compared += compared;
                Some(result(compared.faces, compared.pixels))
            }
        }
    }

    /// Returns the source of a test with a failed case.
    fn source(&mut self, kind: CaseKind, seed: u64, number: u64, from: &str) -> String {
        const FAILS: &str = "a case fails again";
        match kind {
            CaseKind::Polygons(_) | CaseKind::SmallWorld(_) => {
                let case = kind.polygons(seed, number).expect("polygons");
                let small = shrink(&mut self.polygons, &case);
                let wrong = self.polygons.case(&small).expect_err(FAILS);
                source(&small, &wrong, from)
            }
            CaseKind::Texels(mix) => {
                let small = mix.case(seed, number).shrink(&mut self.texels);
                let wrong = self.texels.case(&small).expect_err(FAILS);
                small.source(&wrong, from)
            }
            CaseKind::Solids(mix) => {
                let case = mix.case(seed, number);
                let wrong = self.solids.case(&case).expect_err(FAILS);
                case.source(&wrong, from)
            }
        }
    }
}

/// The kinds of a sweep, and how to repeat it.
struct Plan {
    kinds: Vec<CaseKind>,
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
                kinds: vec![CaseKind::SmallWorld(step)],
                seed: 0,
                options: format!("--small-world {step}"),
                last: u64::from(TRIANGLES),
            });
        }
        let named = |text: &String| CaseKind::mixes().any(|kind| kind.name().contains(text));
        if let Some(text) = arguments.only.iter().find(|text| !named(text)) {
            let names: Vec<_> = CaseKind::mixes().map(CaseKind::name).collect();
            let names = names.join("\n  ");
            return Err(format!(
                "--only {text:?}: no mix has this text in its name; the mixes are\n  {names}"
            ));
        }
        let only = &arguments.only;
        let wanted = |kind: &CaseKind| {
            let name = kind.name();
            only.is_empty() || only.iter().any(|text| name.contains(text))
        };
        let seed = arguments.seed.unwrap_or_else(|| fastrand::u64(..));
        let only: String = only
            .iter()
            .map(|text| format!(" --only {text:?}"))
            .collect();
        Ok(Self {
            kinds: CaseKind::mixes().filter(wanted).collect(),
            seed,
            options: format!("--seed {seed}{only}"),
            last: u64::MAX,
        })
    }

    /// Names a case so that it can be repeated.
    fn label(&self, kind: CaseKind, number: u64) -> String {
        let name = kind.name();
        match kind {
            CaseKind::SmallWorld(_) => format!("cargo sweep {}: case {number}", self.options),
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
    catch_interrupts();
    println!("cargo sweep {}", plan.options);
    sweep(&plan, &arguments)
}

/// Announces the sweep, and returns its progress: in cases of each mix, or in seconds if only `limit` ends
/// it.
fn progress(limit: Option<Duration>, from: u64, end: u64) -> Progress {
    let seconds = limit.map_or(0, |limit| limit.as_secs());
    if end == u64::MAX {
        return Progress::counting(format!("comparing for at most {seconds} s"), seconds);
    }
    let cases = end.saturating_sub(from);
    let at_most = match limit {
        Some(_) => format!(", for at most {seconds} s"),
        None => String::new(),
    };
    Progress::counting(
        format!("comparing {cases} cases of each mix{at_most}"),
        cases,
    )
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
    let mut progress = progress(limit, arguments.from, end);
    let mut results = vec![MixResults::default(); plan.kinds.len()];
    let mut failures = Vec::new();
    let mut checkers = Checkers::default();
    let mut number = arguments.from;
    while number < end && failures.is_empty() {
        let round = number..number.saturating_add(ROUND).min(end);
        for (&kind, result) in plan.kinds.iter().zip(&mut results) {
            for number in round.clone() {
                if number % kind.stride() != 0 {
                    continue;
                }
                result.tried += 1;
                if let Some(more) = checkers.try_case(kind, plan.seed, number) {
                    result.polygons += more.polygons;
                    result.pixels += more.pixels;
                    continue;
                }
                result.failed += 1;
                // The first failure of a mix is enough.
                if result.failed == 1 {
                    let from = plan.label(kind, number);
                    failures.push(checkers.source(kind, plan.seed, number, &from));
                }
            }
        }
        number = round.end;
        progress.at(match end {
            u64::MAX => begun.elapsed().as_secs(),
            _ => number - arguments.from,
        });
        let late = limit.is_some_and(|limit| begun.elapsed() >= limit);
        if late || interrupted() {
            break;
        }
    }
    drop(progress);
    print(&plan.kinds, &results, begun.elapsed());
    checkers.solid_totals.print();
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
    match interrupted() {
        true => ExitCode::from(Interrupted::EXIT_CODE as u8),
        false => ExitCode::SUCCESS,
    }
}

/// Prints a line of results for each mix, and their sum.
fn print(kinds: &[CaseKind], results: &[MixResults], elapsed: Duration) {
    let mut sum = MixResults::default();
    println!(
        "{:35} {:>10} {:>11} {:>14} {:>7}",
        "", "tried", "polygons", "pixels", "failed"
    );
    let line = |name: &str, result: &MixResults| {
        let MixResults {
            tried,
            polygons,
            pixels,
            failed,
        } = result;
        println!("{name:35} {tried:10} {polygons:11} {pixels:14} {failed:7}");
    };
    for (kind, result) in kinds.iter().zip(results) {
        line(&kind.name(), result);
        sum.tried += result.tried;
        sum.polygons += result.polygons;
        sum.pixels += result.pixels;
        sum.failed += result.failed;
    }
    line("all", &sum);
    println!("in {:.1} s", elapsed.as_secs_f64());
}

impl SolidTotals {
    /// Prints results that are not failures.
    fn print(&self) {
        let Self { outside, compared } = self;
        if *outside > 0 {
            println!(
                "{} of {outside} pixels seen from outside lie in a fold: rounding turned a facet over at the \
                 silhouette, so two facets cover the pixel",
                compared.folds
            );
        }
        if compared.changed > 0 {
            let [near, guard] = compared.cut;
            println!(
                "{} pixels changed sides of a true edge, at most {:.5} pixel from it; the near plane cut {near} \
                 visible faces, the guard band {guard}",
                compared.changed, compared.furthest
            );
        }
    }
}
