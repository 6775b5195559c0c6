//! `bless`: accepts changed golden frames.

use std::path::PathBuf;

use frames::golden;
use qemu::{Config, Vm};
use system::say;

use crate::common::Common;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- bless                write the changed frames of tests/golden; look at each before you commit
  cargo run -- bless tests/golden   the same, with the folder named";

/// Writes the PNGs of changed goldens, if QEMU's VGA shows the same frames.
pub fn run(common: &Common, folder: Option<PathBuf>) -> anyhow::Result<()> {
    let folder = folder.unwrap_or_else(crystal_ball::golden_folder);
    let report = setup::folder().join("bless").join("report.html");
    let boot = || Vm::boot(&Config::new(&setup::ready(&common.options)?));
    match golden::bless(&folder, &report, boot, Vm::leave, |line| say(line))? {
        0 => say("nothing to bless: no golden frame has changed"),
        count => say(format_args!(
            "{count} golden frames blessed in {}",
            folder.display()
        )),
    }
    Ok(())
}
