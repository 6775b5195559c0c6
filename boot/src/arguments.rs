//! The command line.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, CommandFactory, Parser, Subcommand};
use frames::options::FrameOptions;
use frames::write::DumpOptions;
use frames::{record, replay};
use import::Files;
use study::trade;

use crate::commands::{
    bless, clean, diff, doctor, dump, emulate, image, qemu, record as recording,
    replay as replaying, trade as trading,
};

/// Boots Crystal Ball: a textured solid that turns in VGA Mode X, on a machine without an operating system.
///
/// The first run downloads a compiler, and QEMU if it is missing, into your cache folder, and shows each
/// step. It installs nothing on the system. Press H in the window to see the keys. Close the window or press
/// Ctrl-C to end the run. Without a display the program boots without a window, and writes a PNG of the
/// running demo.
#[derive(Debug, Parser)]
#[command(version, after_help = AFTER_HELP)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Subcommands>,
    #[command(flatten)]
    pub boot: BootOptions,
    #[command(flatten)]
    pub frame_options: FrameOptions,
    #[command(flatten)]
    pub model: Files,
    #[command(flatten)]
    pub tools: ToolOptions,
    /// More arguments for QEMU; they follow `--`
    #[arg(last = true, value_name = "QEMU ARGUMENTS")]
    pub qemu_arguments: Vec<OsString>,
}

const AFTER_HELP: &str = "\
Examples (cargo passes everything after the first `--` to this program):
  cargo run                            boot and watch
  cargo run -- --headless              boot without a window and write a PNG
  cargo run -- --vga cirrus            use another display adapter
  cargo run -- --mapper exact          use another mapper (--help lists them, -h does not)
  cargo run -- -- -machine q35 -m 64   pass more arguments to QEMU
  cargo run -- --model thing.obj --texture thing.png
                                       show your own model and its texture
  cargo run -- doctor                  show what is set up, and where
  cargo run -- record --out ball.gif   record a turn of the ball as a GIF
  cargo run -- replay DIR              play a folder of dumps in the terminal
  cargo run -- diff A B                compare two dumps, PNGs or folders
  cargo run -- image --out ball.img    write the disk image, for another emulator
  cargo run --release -- trade         measure what accuracy costs: tables, plots, a page

Exit codes: 0 success; 1 set-up failed, or a file could not be read or written; 2 wrong usage;
10 panic; 11 CPU exception; 12 triple fault; 13 hang; 14 stopped in the boot loader; 15 QEMU failed;
16 serial line garbled; 17 the display adapter does not support Mode X; 130 ended by you.";

#[derive(Debug, Args)]
pub struct BootOptions {
    /// Boot without a window, write a PNG of the running demo, and print its path
    #[arg(long)]
    pub headless: bool,
    /// QEMU's display adapter: std, cirrus, vmware or virtio
    #[arg(long, value_name = "ADAPTER", default_value = "std")]
    pub vga: String,
}

#[derive(Debug, Args)]
pub struct ToolOptions {
    /// QEMU's program [default: qemu-system-x86_64 in PATH or in the cache folder]
    #[arg(long, global = true, value_name = "PATH")]
    pub qemu: Option<PathBuf>,
    /// A complete Rust toolchain with library sources, llvm-tools and rust-lld; it replaces the
    /// pinned toolchain
    #[arg(long, global = true, value_name = "DIR")]
    pub toolchain: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
pub enum Subcommands {
    /// Show what is set up, where, and what is missing; change nothing
    #[command(after_help = doctor::HELP)]
    Doctor,
    /// Print the path of the QEMU that a run uses; download QEMU first if it is missing
    #[command(after_help = qemu::HELP)]
    Qemu {
        /// Use the QEMU of this Debian suite, such as bookworm; download it into the cache folder if
        /// it is missing
        #[arg(long)]
        suite: Option<String>,
    },
    /// Remove everything that the set-up downloaded or built, and print its size
    #[command(after_help = clean::HELP)]
    Clean,
    /// Boot, show each frame, and write it as a dump (a text file of video memory) and as a PNG
    #[command(after_help = dump::HELP)]
    Dump(DumpOptions),
    /// Write the same files as `dump` from the emulated VGA, without QEMU
    #[command(after_help = emulate::HELP)]
    Emulate(DumpOptions),
    /// Record the demo as a GIF or as PNGs; a slow machine loses no frame
    #[command(after_help = recording::HELP)]
    Record(record::RecordOptions),
    /// Play dumps or PNGs in the terminal, or put them on a contact sheet
    #[command(after_help = replaying::HELP)]
    Replay(replay::ReplayOptions),
    /// Compare two dumps, two indexed PNGs, or two folders of them, and print the differences
    ///
    /// Exit codes: 0 equal; 1 different; 2 a pair could not be compared.
    #[command(after_help = diff::HELP)]
    Diff {
        /// The expected file or folder
        a: PathBuf,
        /// The file or folder to compare with it
        b: PathBuf,
        /// Also write an HTML page of the differences; its images go into a folder FILE-files beside it
        #[arg(long, value_name = "FILE.html")]
        report: Option<PathBuf>,
    },
    /// Write the emulated VGA's frames as golden frames, if QEMU's VGA shows the same frames
    #[command(after_help = bless::HELP)]
    Bless {
        /// The folder of golden frames [default: tests/golden of the workspace]
        folder: Option<PathBuf>,
    },
    /// Measure what accuracy costs: each mapper's error and time on each scene, as tables, plots
    /// and a page; needs `cargo run --release`
    #[command(after_help = trading::HELP)]
    Trade(trade::TradeOptions),
    /// Write the bootable disk image, for another emulator or a PC
    #[command(after_help = image::HELP)]
    Image {
        /// The file to write
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
}

/// Returns the command line's definition. Help lists a global option only for the subcommands that use it.
pub fn command() -> clap::Command {
    const FRAME: [&str; 3] = ["scene", "mapper", "order"];
    const MODEL: [&str; 2] = ["model", "texture"];
    const TOOLS: [&str; 2] = ["qemu", "toolchain"];
    let unused: [(&str, &[&[&str]]); 8] = [
        ("clean", &[&FRAME, &MODEL, &TOOLS]),
        ("replay", &[&FRAME, &MODEL, &TOOLS]),
        ("diff", &[&FRAME, &MODEL, &TOOLS]),
        ("doctor", &[&FRAME, &MODEL]),
        ("qemu", &[&FRAME, &MODEL]),
        ("bless", &[&FRAME, &MODEL]),
        ("image", &[&FRAME]),
        ("trade", &[&FRAME]),
    ];
    unused
        .into_iter()
        .fold(Cli::command(), |command, (name, ids)| {
            let hidden: Vec<_> = ids
                .concat()
                .into_iter()
                .filter_map(|id| {
                    command
                        .get_arguments()
                        .find(|argument| argument.get_id() == id)
                })
                .map(|argument| argument.clone().hide(true))
                .collect();
            command.mut_subcommand(name, |subcommand| subcommand.args(hidden))
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_lists_the_options_that_a_subcommand_uses_with_their_defaults() {
        let whole = command();
        let help = |name: &str| {
            let mut of = whole.clone();
            of.build();
            let of = of.find_subcommand_mut(name).unwrap();
            of.render_long_help().to_string()
        };
        for name in ["clean", "diff", "doctor"] {
            for option in ["--mapper", "--scene", "--order", "--model"] {
                assert!(!help(name).contains(option), "{name} {option}");
            }
        }
        let mapper = texmap::Mapper::default().to_string();
        for default in ["ball, or your own model", mapper.as_str(), "polygons"] {
            let shown = format!("[default: {default}]");
            assert!(help("dump").contains(&shown), "{shown}");
        }
        // The options that help hides are still accepted.
        let words = ["crystal-ball", "clean", "--mapper", "exact"];
        assert!(command().try_get_matches_from(words).is_ok());
    }

    /// Returns the commands of the examples in a help text.
    fn examples(help: &str) -> impl Iterator<Item = &str> {
        let (_, examples) = help.split_once("\nExamples").unwrap_or_default();
        let lines = examples.lines().map_while(|line| match line {
            "" => None,
            line => Some(line.trim_start()),
        });
        // The description follows two spaces.
        let commands = lines.map(|line| line.split("  ").next().unwrap_or(line));
        commands.filter(|line| line.starts_with("cargo "))
    }

    #[test]
    fn every_help_has_examples_and_every_example_is_valid() {
        let whole = command();
        for of in [&whole].into_iter().chain(whole.get_subcommands()) {
            let name = of.get_name();
            let help = of.clone().render_long_help().to_string();
            assert!(examples(&help).next().is_some(), "{name}: no examples");
            for example in examples(&help) {
                let arguments = example.split_once(" -- ").map_or("", |(_, after)| after);
                let words = ["crystal-ball"].into_iter();
                let words = words.chain(arguments.split_whitespace());
                let matches = command().try_get_matches_from(words);
                let matches = matches.unwrap_or_else(|error| panic!("{example}: {error}"));
                let of_subcommand = matches.subcommand_name() == Some(name);
                assert!(of_subcommand || name == whole.get_name(), "{example}");
            }
        }
    }
}
