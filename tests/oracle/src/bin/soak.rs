//! Repeats the random tests of the whole workspace with fresh seeds, and reports failures.
//!
//! A test is random if it gets its generator from the crate `seeded`. The first round runs every test of the
//! targets whose sources name that crate; later rounds run only the tests that requested a generator.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use clap::Parser;
use serde_json::Value;

/// Repeats the random tests of the workspace with fresh seeds, and reports failures.
///
/// Each failure is printed with its output, which names the seed and the command that repeats the failure.
/// Exit codes: 0 nothing failed; 1 something failed; 2 the tests could not be run.
#[derive(Debug, Parser)]
#[command(name = "cargo soak")]
struct Arguments {
    /// Start no more rounds after this many minutes
    #[arg(long, value_name = "N", default_value = "10")]
    minutes: f64,
    /// Stop after this many rounds
    #[arg(long, value_name = "N")]
    rounds: Option<u64>,
    /// Limit the cases of each test: more rounds, with fewer cases in each
    #[arg(long, value_name = "N")]
    cases: Option<u64>,
    /// Run only the tests whose names contain this
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
}

/// Interval between progress reports.
const REPORT: Duration = Duration::from_secs(30);

/// Targets whose tests need QEMU: each runs for seconds or more.
const NEED_QEMU: [&str; 1] = ["qemu"];

/// Text that the source of every random test contains.
const CRATE: &str = "seeded::";

/// A test binary, and its random tests.
struct Target {
    name: String,
    program: PathBuf,
    /// The package's folder, where Cargo runs its tests.
    folder: PathBuf,
    package: String,
    tests: BTreeMap<String, RunCounts>,
}

/// Runs of a test, and how many of them failed.
#[derive(Clone, Copy, Default)]
struct RunCounts {
    runs: u64,
    failures: u64,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match soak(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Returns whether every test passed.
fn soak(arguments: &Arguments) -> Result<bool, String> {
    let mut targets = targets()?;
    let start = Instant::now();
    let time = Duration::try_from_secs_f64(60.0 * arguments.minutes)
        .map_err(|error| format!("--minutes {}: {error}", arguments.minutes))?;
    for target in &mut targets {
        target.round(arguments, true)?;
    }
    targets.retain(|target| !target.tests.is_empty());
    let mut rounds = 1;
    let mut reported = start;
    while start.elapsed() < time && arguments.rounds.is_none_or(|most| rounds < most) {
        for target in &mut targets {
            target.round(arguments, false)?;
        }
        rounds += 1;
        if reported.elapsed() >= REPORT {
            reported = Instant::now();
            let minutes = start.elapsed().as_secs_f64() / 60.0;
            let failures = sum(&targets).failures;
            eprintln!("round {rounds} after {minutes:.1} minutes: {failures} runs failed");
        }
    }
    for target in &targets {
        for (test, count) in &target.tests {
            let RunCounts { runs, failures } = count;
            println!("{runs:6} runs {failures:3} failed  {}: {test}", target.name);
        }
    }
    let minutes = start.elapsed().as_secs_f64() / 60.0;
    let RunCounts { runs, failures } = sum(&targets);
    println!("{rounds} rounds in {minutes:.1} minutes: {failures} of {runs} runs failed");
    Ok(failures == 0)
}

/// Returns the runs and failures of all targets.
fn sum(targets: &[Target]) -> RunCounts {
    let counts = targets.iter().flat_map(|target| target.tests.values());
    counts.fold(RunCounts::default(), |sum, count| RunCounts {
        runs: sum.runs + count.runs,
        failures: sum.failures + count.failures,
    })
}

impl Target {
    /// Runs the random tests once. The first round runs all tests, to learn which are random.
    fn round(&mut self, arguments: &Arguments, first: bool) -> Result<(), String> {
        let log = std::env::temp_dir().join(format!("soak-{}.log", std::process::id()));
        let mut command = Command::new(&self.program);
        command
            .current_dir(&self.folder)
            .env("CARGO_MANIFEST_DIR", &self.folder)
            .env("CARGO_PKG_NAME", &self.package)
            .env(seeded::LOG, &log)
            .env_remove(seeded::SEED);
        match arguments.cases {
            Some(cases) => command.env(seeded::CASES, cases.to_string()),
            None => command.env_remove(seeded::CASES),
        };
        match first {
            true => command.arg(&arguments.only),
            false => command.arg("--exact").args(self.tests.keys()),
        };
        let output = command
            .output()
            .map_err(|error| format!("{}: cannot be run: {error}", self.program.display()))?;
        let requested = fs::read_to_string(&log).unwrap_or_default();
        let _ = fs::remove_file(&log);
        let text = String::from_utf8_lossy(&output.stdout);
        let mut requested: Vec<_> = requested.lines().collect();
        requested.sort_unstable();
        // A test may request several generators.
        requested.dedup();
        for test in requested {
            let failed = text.contains(&format!("test {test} ... FAILED"));
            let count = self.tests.entry(test.into()).or_default();
            count.runs += 1;
            count.failures += u64::from(failed);
        }
        if !output.status.success() {
            println!("{}: {}\n{text}", self.name, output.status);
            println!("{}", String::from_utf8_lossy(&output.stderr));
            // No test is reported as failed, so a test ended the whole binary.
            if !text.contains("... FAILED") {
                let abort = self.tests.entry("(the binary ended)".into()).or_default();
                abort.failures += 1;
            }
        }
        Ok(())
    }
}

/// Runs Cargo and returns its output.
fn cargo(arguments: &[String]) -> Result<String, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let output = Command::new(cargo)
        .args(arguments)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("cargo: cannot be run: {error}"))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(format!(
            "`cargo {}` failed; see its messages above",
            arguments.join(" ")
        )),
    }
}

/// Builds and returns only the targets that may contain random tests.
fn targets() -> Result<Vec<Target>, String> {
    let words = |text: &str| text.split(' ').map(String::from).collect::<Vec<_>>();
    let metadata = cargo(&words("metadata --no-deps --format-version 1"))?;
    let metadata: Value = serde_json::from_str(&metadata).map_err(|error| error.to_string())?;
    let mut build = words("test --no-run --quiet --message-format=json-render-diagnostics --lib");
    let mut packages = BTreeMap::new();
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let name = package["name"].as_str().unwrap_or_default();
        for target in package["targets"].as_array().into_iter().flatten() {
            let source = target["src_path"].as_str().unwrap_or_default();
            let called = target["name"].as_str().unwrap_or_default();
            let kind = target["kind"][0].as_str().unwrap_or_default();
            let random = matches!(kind, "lib" | "test")
                && !NEED_QEMU.contains(&called)
                && names_seeded(Path::new(source));
            if !random {
                continue;
            }
            let of_package = package["id"].as_str().unwrap_or_default();
            if packages.insert(of_package.to_string(), name).is_none() {
                build.extend(["-p".into(), name.into()]);
            }
            if kind == "test" {
                build.extend(["--test".into(), called.into()]);
            }
        }
    }
    let mut targets = Vec::new();
    for line in cargo(&build)?.lines() {
        let Ok(message) = serde_json::from_str::<Value>(line) else {
            continue;
        };
        let text = |value: &Value| value.as_str().map(String::from);
        let (Some(program), Some(name), Some(source), Some(manifest), Some(package)) = (
            text(&message["executable"]),
            text(&message["target"]["name"]),
            text(&message["target"]["src_path"]),
            text(&message["manifest_path"]),
            text(&message["package_id"]),
        ) else {
            continue;
        };
        let Some(package) = packages.get(&package) else {
            continue;
        };
        if message["profile"]["test"] != true || !names_seeded(Path::new(&source)) {
            continue;
        }
        targets.push(Target {
            name: format!("{package} {name}"),
            program: program.into(),
            folder: Path::new(&manifest).with_file_name(""),
            package: package.to_string(),
            tests: BTreeMap::new(),
        });
    }
    match targets.is_empty() {
        true => Err("no target has a random test; run `cargo soak` in the workspace".into()),
        false => Ok(targets),
    }
}

/// Returns whether a target's sources name the crate `seeded`. For a library that is any file of its folder;
/// for a test, the file and its modules.
fn names_seeded(source: &Path) -> bool {
    let Some(folder) = source.parent() else {
        return false;
    };
    if folder.file_name().is_none_or(|name| name != "tests") {
        return folder_names_seeded(folder);
    }
    let text = fs::read_to_string(source).unwrap_or_default();
    let mut modules = text
        .lines()
        .filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';'));
    text.contains(CRATE)
        || modules.any(|name| {
            file_names_seeded(&folder.join(name).with_extension("rs"))
                || folder_names_seeded(&folder.join(name))
        })
}

fn file_names_seeded(file: &Path) -> bool {
    fs::read_to_string(file).is_ok_and(|text| text.contains(CRATE))
}

fn folder_names_seeded(folder: &Path) -> bool {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| entry.path())
        .any(|path| match path.is_dir() {
            true => folder_names_seeded(&path),
            false => file_names_seeded(&path),
        })
}
