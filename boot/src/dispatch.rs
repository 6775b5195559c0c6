//! From a parsed command line to its subcommand.

use std::process::ExitCode;

use setup::Options;

use crate::arguments::{BootOptions, Cli, Subcommands, ToolOptions};
use crate::commands::{
    bless, clean, diff, doctor, dump, emulate, image, qemu, record, replay, trade, watch,
};
use crate::common::Common;

/// Runs the subcommand of a command line, and returns its exit code.
///
/// # Errors
/// Whatever stops it; `main` turns the error into a message and an exit code.
pub fn run(cli: Cli) -> anyhow::Result<ExitCode> {
    let Cli {
        command,
        boot: BootOptions { headless, vga },
        frame_options,
        model,
        tools: ToolOptions { qemu, toolchain },
        qemu_arguments,
    } = cli;
    let common = Common {
        headless,
        vga,
        frame_options,
        files: model,
        options: Options {
            toolchain,
            qemu,
            window: false,
            ramdisk: None,
        },
        qemu_arguments,
    };
    match command {
        None => watch::run(common)?,
        Some(Subcommands::Doctor) => return doctor::run(common),
        Some(Subcommands::Qemu { suite }) => qemu::run(common, suite.as_deref())?,
        Some(Subcommands::Clean) => clean::run()?,
        Some(Subcommands::Dump(frames)) => dump::run(common, &frames)?,
        Some(Subcommands::Emulate(frames)) => emulate::run(&common, &frames)?,
        Some(Subcommands::Record(options)) => return record::run(common, &options),
        Some(Subcommands::Replay(options)) => replay::run(&options)?,
        Some(Subcommands::Diff { a, b, report }) => return diff::run(&a, &b, report.as_deref()),
        Some(Subcommands::Bless { folder }) => bless::run(&common, folder)?,
        Some(Subcommands::Trade(options)) => return trade::run(common, options),
        Some(Subcommands::Image { out }) => image::run(common, &out)?,
    }
    Ok(ExitCode::SUCCESS)
}
