//! The seed and the number of cases of random tests.
//!
//! A random test calls [`generator`] once and draws everything from it. Each run has a fresh seed. If the
//! test fails, its output names the seed and the command that repeats the run.
//!
//! | variable | effect |
//! | --- | --- |
//! | `CRYSTAL_BALL_SEED` | every test uses this seed |
//! | `CRYSTAL_BALL_CASES` | no test tries more cases than this, if its number of cases may vary ([`cases`]) |
//! | `CRYSTAL_BALL_SEEDED` | a file to which each test that requests a generator adds a line with its name |
//!
//! ```
//! let mut random = seeded::generator();
//! for _ in 0..seeded::cases(100) {
//!     let number = random.u32(..1000);
//!     assert_eq!((number * number) / number.max(1), number);
//! }
//! ```
//!
//! `cargo soak` repeats the random tests of the whole workspace.
#![forbid(unsafe_code)]

use std::fmt::Write;
use std::fs::OpenOptions;
use std::io::Write as _;
use std::{env, thread};

use fastrand::Rng;

/// The variable with the seed, a decimal number below 2^64.
pub const SEED: &str = "CRYSTAL_BALL_SEED";
/// The variable with the largest number of cases, a decimal number.
pub const CASES: &str = "CRYSTAL_BALL_CASES";

/// The variable with the file that lists the random tests.
pub const LOG: &str = "CRYSTAL_BALL_SEEDED";

/// Returns the generator of a random test. Prints its seed, and the command that repeats the test with that
/// seed: the test harness shows both if the test fails.
///
/// The generator's seed is [`Rng::get_seed`], until a number is drawn.
///
/// # Panics
/// If [`SEED`] is set, but not to a number.
pub fn generator() -> Rng {
    let seed = number(SEED).unwrap_or_else(|| fastrand::u64(..));
    if let (Some(log), Some(test)) = (env::var_os(LOG), thread::current().name()) {
        let mut file = OpenOptions::new().create(true).append(true).open(&log);
        let added = file
            .as_mut()
            .map(|file| file.write_all(format!("{test}\n").as_bytes()));
        assert!(
            matches!(added, Ok(Ok(()))),
            "{LOG}: {} cannot be written",
            log.display()
        );
    }
    println!("seed {seed}; to repeat this run:\n  {}", command(seed));
    Rng::with_seed(seed)
}

/// Returns how many cases a random test tries: `usual`, or the value of [`CASES`] if that is smaller, but at
/// least 1.
///
/// # Panics
/// If [`CASES`] is set, but not to a number.
pub fn cases(usual: usize) -> usize {
    limit(usual, number(CASES))
}

/// Returns whether random tests try all of their cases. Only then may a test assert that a rare case
/// occurred, or that a result came near its bound.
pub fn is_whole() -> bool {
    env::var_os(CASES).is_none()
}

fn limit(usual: usize, max: Option<u64>) -> usize {
    let max = max.map(|max| usize::try_from(max).unwrap_or(usize::MAX));
    max.map_or(usual, |max| usual.min(max.max(1)))
}

fn number(variable: &str) -> Option<u64> {
    let value = env::var_os(variable)?;
    let number = value.to_str().and_then(|text| text.parse().ok());
    assert!(
        number.is_some(),
        "{variable}: '{}' is not a number; use 0 to {}",
        value.display(),
        u64::MAX
    );
    number
}

/// Returns the command that repeats the test of this thread.
fn command(seed: u64) -> String {
    let mut command = format!("{SEED}={seed} ");
    if let Some(cases) = number(CASES) {
        let _ = write!(command, "{CASES}={cases} ");
    }
    match (env::var("CARGO_PKG_NAME"), env::current_exe()) {
        (Ok(package), _) => {
            let _ = write!(command, "cargo test -p {package}");
        }
        // Started by hand, without Cargo.
        (Err(_), Ok(program)) => command += &program.display().to_string(),
        (Err(_), Err(_)) => {}
    }
    // The harness names a test's thread after the test. With a single thread it gives no such name.
    match thread::current().name() {
        Some("main") | None => {}
        Some(test) => {
            let _ = write!(command, " {test}");
        }
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_cases_is_limited_and_at_least_one() {
        assert_eq!(limit(100, None), 100);
        assert_eq!(limit(100, Some(20)), 20);
        assert_eq!(limit(100, Some(1000)), 100);
        assert_eq!(limit(100, Some(0)), 1);
    }

    #[test]
    fn the_command_names_seed_package_and_test() {
        let command = command(7);
        assert!(command.contains("CRYSTAL_BALL_SEED=7 "), "{command}");
        assert!(command.contains("seeded"), "{command}");
    }
}
