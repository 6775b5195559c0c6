//! `doctor`: reports what is set up, and what is missing.

use std::process::ExitCode;

use crate::common::{Common, has_display};
use crate::output::Output;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- doctor                                       show what `cargo run` would use
  cargo run -- doctor --qemu /opt/bin/qemu-system-x86_64    check this QEMU";

/// Prints the report. The exit code is 1 if something is missing that a run cannot get.
pub fn run(mut common: Common) -> anyhow::Result<ExitCode> {
    common.options.window = has_display();
    let complete = setup::doctor(&common.options, &mut Output)?;
    Ok(if complete {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}
