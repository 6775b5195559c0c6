//! `dump`: writes frames from QEMU's VGA.

use frames::write::DumpOptions;

use crate::common::Common;
use crate::output::print_path;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- dump --frames 0..10 --out a                   ten frames of the ball
  cargo run -- dump --frame 480 --scene knot --mapper exact  a frame of the knot, into dumps/
  cargo run -- dump --frame 0 --all --out all                all of video memory, not only the page
  cargo run -- --vga cirrus dump --frames 0..10 --out b      from another display adapter
  cargo run -- dump --frame 0 --model thing.obj --texture thing.png
                                                             your own model";

/// Boots, and writes a dump and a PNG of each frame.
pub fn run(mut common: Common, frames: &DumpOptions) -> anyhow::Result<()> {
    let model = common.load_to_boot()?;
    let mut vm = common.boot(model.as_ref())?;
    frames.write(&mut vm, &common.frame_options, print_path)?;
    vm.leave()
}
