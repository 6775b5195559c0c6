//! `replay`: shows many frames.

use frames::replay::ReplayOptions;

use crate::output::print_path;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- replay dumps                      play a folder in the terminal
  cargo run -- replay dumps --sheet sheet.png    the whole folder on one sheet
  cargo run -- replay tests/golden --sheet goldens.png
                                                 all golden frames on one sheet";

/// Plays a folder, or makes its sheet.
pub fn run(options: &ReplayOptions) -> anyhow::Result<()> {
    options.run(print_path)
}
