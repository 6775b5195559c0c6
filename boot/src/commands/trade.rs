//! `trade`: measures what accuracy costs.

use std::process::ExitCode;

use import::Model;
use study::trade::{self, TradeOptions};
use system::say;

use crate::common::Common;
use crate::output::print_path;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run --release -- trade                            measure everything, for some minutes
  cargo run --release -- trade --quick --host-only        a first look, without QEMU
  cargo run --release -- trade --scenes cube,tilted --mappers affine,linear-16,exact
                                                          two scenes and three mappers
  cargo run --release -- trade --model thing.obj          only your own model";

/// Measures, and writes tables, plots and a page. Returns exit code 2 in a debug build.
pub fn run(common: Common, mut options: TradeOptions) -> anyhow::Result<ExitCode> {
    if let Err(error) = trade::check_build() {
        say(format_args!("error: {error}"));
        return Ok(ExitCode::from(2));
    }
    let (scene, mapper) = (common.frame_options.scene, common.frame_options.mapper);
    options.scenes.extend(scene.map(String::from));
    options
        .mappers
        .extend(mapper.map(|mapper| mapper.to_string()));
    let model = common.load()?;
    let model_file = model.as_ref().map(Model::file);
    let page = trade::run(&options, common.options, model_file.as_ref())?;
    say("the page with the results; its tables and plots are beside it:");
    print_path(&page)?;
    Ok(ExitCode::SUCCESS)
}
