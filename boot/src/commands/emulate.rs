//! `emulate`: writes frames from the emulated VGA.

use frames::backend::{self, EmulatedDemo};
use frames::write::DumpOptions;
use import::Model;

use crate::common::Common;
use crate::output::print_path;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- emulate --frames 0..10 --out b                  the same files as `dump` with --out b
  cargo run -- emulate --frame 0 --frame 480 --mapper affine   two frames, into dumps/
  cargo run -- emulate --pose 40000000 0 0 50000 --scene cube  a pose of your choice
  cargo run -- emulate --frame 8 --mapper exact --motion ffa4fa50 0 0 0
                                                               a frame in reduced quality";

/// Writes a dump and a PNG of each frame.
pub fn run(common: &Common, frames: &DumpOptions) -> anyhow::Result<()> {
    let model = common.load()?;
    let model_file = model.as_ref().map(Model::file);
    let mut memory = backend::memory();
    let mut demo = EmulatedDemo::with(&mut memory, model_file.as_ref())?;
    frames.write(&mut demo, &common.frame_options, print_path)
}
