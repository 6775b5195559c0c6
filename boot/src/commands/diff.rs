//! `diff`: compares dumps and PNGs.

use std::path::Path;
use std::process::ExitCode;

use frames::comparison::{self, Outcome};
use system::{Interrupted, say};

use crate::output::Output;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- diff a b                         two folders: files of the same name are compared
  cargo run -- diff a b --report diff.html      the same, with images of the differences
  cargo run -- diff a/frame-000000.dump a/frame-000001.dump
                                                two files";

/// Compares two files or folders. Exit code 1 means a difference and 2 an error, as for the system's `diff`.
pub fn run(a: &Path, b: &Path, report: Option<&Path>) -> anyhow::Result<ExitCode> {
    let outcome = match comparison::run(a, b, report, &mut Output) {
        Err(error) if !error.is::<Interrupted>() => {
            say(format_args!("error: {error:#}"));
            Outcome::Incomparable
        }
        outcome => outcome?,
    };
    Ok(ExitCode::from(outcome.exit_code()))
}
