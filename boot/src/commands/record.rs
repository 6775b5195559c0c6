//! `record`: writes an animation.

use std::process::ExitCode;

use frames::backend::{self, EmulatedDemo};
use frames::record::RecordOptions;
use import::Model;
use system::say;

use crate::common::Common;
use crate::output::print_path;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- record --out ball.gif                            a whole turn of the ball, 12 s
  cargo run -- record --scene knot --every 6 --out knot.gif     ten frames a second
  cargo run -- record --frames 0..60 --every 1 --out frames     every frame of a second, as PNGs";

/// Boots, and records what QEMU's VGA holds. Returns exit code 2 for wrong options.
pub fn run(mut common: Common, options: &RecordOptions) -> anyhow::Result<ExitCode> {
    if let Err(error) = options.check() {
        say(format_args!("error: {error}"));
        return Ok(ExitCode::from(2));
    }
    let model = common.load_to_boot()?;
    let mut vm = common.boot(model.as_ref())?;
    let model_file = model.as_ref().map(Model::file);
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::with(&mut memory, model_file.as_ref())?;
    options.record(&mut vm, &mut emulated, &common.frame_options, print_path)?;
    vm.leave()?;
    Ok(ExitCode::SUCCESS)
}
