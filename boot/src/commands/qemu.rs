//! `qemu`: prints the path of a QEMU.

use crate::common::{Common, has_display};
use crate::output::print_path;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- qemu                               the QEMU that a run uses
  cargo run -- qemu --suite bookworm-backports    another version, to test with";

/// Prints the path, and downloads QEMU first if necessary.
pub fn run(mut common: Common, suite: Option<&str>) -> anyhow::Result<()> {
    let qemu = match suite {
        Some(suite) => setup::qemu_of_suite(suite)?,
        None => {
            common.options.window = has_display();
            setup::qemu(&common.options)?
        }
    };
    Ok(print_path(&qemu.path)?)
}
