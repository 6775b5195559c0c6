//! The `crystal-ball` command.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::Context;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use crystal_ball::window;
use frames::card::{self, Card, Emulated};
use frames::comparison;
use frames::golden;
use frames::look::{Look, Named};
use frames::write::Frames;
use frames::{record, replay};
use import::{Files, Model};
use link::{Action, Change, Command};
use qemu::{Config, Failure, Machine, Printed, Verdict};
use scene::catalogue::Entry;
use setup::{Options, Ready};
use study::trade;
use system::quote::printable;
use system::{Interrupted, quote, say, write_atomically};

/// How long the ball turns before its picture is taken without a display.
const WARM_UP: Duration = Duration::from_secs(1);

/// Boots Crystal Ball: a textured ball that turns in VGA Mode X, on a machine without an
/// operating system.
///
/// On first use it fetches a compiler and, where it is missing, QEMU into your cache folder, and says
/// so. It installs nothing on the system. In the window the key H tells the keys that steer it; close it or
/// type Ctrl-C to end it. Without a display it boots all the same and leaves a picture.
#[derive(Debug, Parser)]
#[command(version, after_help = AFTER_HELP)]
struct Cli {
    #[command(subcommand)]
    command: Option<Subcommands>,
    #[command(flatten)]
    boot: Boot,
    #[command(flatten)]
    look: Look,
    #[command(flatten)]
    model: Files,
    #[command(flatten)]
    tools: Tools,
    /// More arguments for QEMU, after `--`
    #[arg(last = true, value_name = "QEMU ARGUMENTS")]
    qemu_arguments: Vec<OsString>,
}

const AFTER_HELP: &str = "\
Examples (`cargo run -- ` hands on what follows):
  cargo run                            boot and watch
  cargo run -- --headless              boot without a window, leave a picture
  cargo run -- --vga cirrus            on another display adapter
  cargo run -- --mapper exact          with another mapper (--help lists them, -h does not)
  cargo run -- -- -machine q35 -m 64   with more arguments for QEMU
  cargo run -- --model thing.obj --texture thing.png
                                       with your own model and its texture
  cargo run -- doctor                  what is set up, and where
  cargo run -- record --out ball.gif   a turn of the ball as a GIF
  cargo run -- replay DIR              play a folder of dumps in the terminal
  cargo run -- diff A B                what differs in two dumps, PNGs or folders
  cargo run -- image --out ball.img    the disk image, for another emulator
  cargo run --release -- trade         what accuracy costs: tables, plots, pictures

Exit codes: 0 done; 1 set-up failed; 2 wrong usage; 10 panic; 11 CPU exception; 12 triple fault;
13 hang; 14 stopped in the boot loader; 15 QEMU failed; 16 serial line garbled;
17 the display adapter does not take Mode X; 130 ended by you.";

const DOCTOR_HELP: &str = "\
Examples:
  cargo run -- doctor                                       what `cargo run` would find here
  cargo run -- doctor --qemu /opt/bin/qemu-system-x86_64    whether this QEMU would do";

const QEMU_HELP: &str = "\
Examples:
  cargo run -- qemu                               the QEMU that a run uses
  cargo run -- qemu --suite bookworm-backports    another version, to test with";

const CLEAN_HELP: &str = "\
Examples:
  cargo run -- clean    the next run sets all of it up anew";

const DUMP_HELP: &str = "\
Examples:
  cargo run -- dump --frames 0..10 --out a                   ten pictures of the ball
  cargo run -- dump --frame 480 --scene knot --mapper exact  one of the knot, into dumps/
  cargo run -- dump --frame 0 --all --out all                all of video memory
  cargo run -- --vga cirrus dump --frames 0..10 --out b      from another display adapter
  cargo run -- dump --frame 0 --model thing.obj --texture thing.png
                                                             of your own model";

const EMULATE_HELP: &str = "\
Examples:
  cargo run -- emulate --frames 0..10 --out b                  what `dump` would write
  cargo run -- emulate --frame 0 --frame 480 --mapper affine   two pictures, into dumps/
  cargo run -- emulate --pose 40000000 0 0 50000 --scene cube  in a pose of one's own
  cargo run -- emulate --frame 8 --mapper exact --motion ffa4fa50 0 0 0
                                                               in reduced quality";

const RECORD_HELP: &str = "\
Examples:
  cargo run -- record --out ball.gif                            a whole turn of the ball, 12 s
  cargo run -- record --scene knot --every 6 --out knot.gif     ten pictures a second
  cargo run -- record --frames 0..60 --every 1 --out pictures   every frame of a second, as PNGs";

const REPLAY_HELP: &str = "\
Examples:
  cargo run -- replay dumps                      play a folder in the terminal
  cargo run -- replay dumps --sheet sheet.png    all of it on one sheet
  cargo run -- replay tests/golden --sheet goldens.png";

const DIFF_HELP: &str = "\
Examples:
  cargo run -- diff a b                         two folders, each file with its namesake
  cargo run -- diff a b --report diff.html      with pictures of what differs
  cargo run -- diff a/frame-000000.dump a/frame-000001.dump";

const BLESS_HELP: &str = "\
Examples:
  cargo run -- bless                a picture was meant to change: look at the report it names
  cargo run -- bless tests/golden   the same, the folder named";

const TRADE_HELP: &str = "\
Examples:
  cargo run --release -- trade                            all of it, in minutes
  cargo run --release -- trade --quick --host-only        a first look
  cargo run --release -- trade --scenes cube,tilted --mappers affine,linear-16,exact
                                                          some of it
  cargo run --release -- trade --model thing.obj          your own model alone";

const IMAGE_HELP: &str = "\
Examples:
  cargo run -- image --out ball.img                       the built-in scenes
  cargo run -- image --out thing.img --model thing.obj    and your own model";

#[derive(Debug, Args)]
struct Boot {
    /// Boot without a window and leave a picture
    #[arg(long)]
    headless: bool,
    /// QEMU's display adapter: std, cirrus, vmware or virtio
    #[arg(long, default_value = "std")]
    vga: String,
}

#[derive(Debug, Args)]
struct Tools {
    /// QEMU's program [default: qemu-system-x86_64 in PATH, else the cache folder's]
    #[arg(long, global = true, value_name = "PATH")]
    qemu: Option<PathBuf>,
    /// A complete Rust toolchain with library sources, llvm-tools and rust-lld, in place of the
    /// pinned one
    #[arg(long, global = true, value_name = "DIR")]
    toolchain: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Subcommands {
    /// Tell what is set up, where, and what is missing; install nothing
    #[command(after_help = DOCTOR_HELP)]
    Doctor,
    /// Print the path of the QEMU that a run uses; get one first if none is found
    #[command(after_help = QEMU_HELP)]
    Qemu {
        /// Use this Debian suite's QEMU, and unpack it into the cache folder where it is not there
        #[arg(long)]
        suite: Option<String>,
    },
    /// Remove what the set-up keeps, and say how much that was
    #[command(after_help = CLEAN_HELP)]
    Clean,
    /// Take dumps: boot, show each picture, and write what the card then holds, as text that
    /// `diff` can compare and as a PNG
    #[command(after_help = DUMP_HELP)]
    Dump(Frames),
    /// Write the same files from the emulated card alone, without QEMU
    #[command(after_help = EMULATE_HELP)]
    Emulate(Frames),
    /// Record the show: every picture that is asked for, however slow the machine is
    #[command(after_help = RECORD_HELP)]
    Record(record::Options),
    /// Look at many dumps or pictures at once: in the terminal, or as a contact sheet
    #[command(after_help = REPLAY_HELP)]
    Replay(replay::Options),
    /// Compare two dumps, two indexed PNGs, or two folders of them, and tell what differs
    ///
    /// Exit codes: 0 equal; 1 different; 2 could not compare.
    #[command(after_help = DIFF_HELP)]
    Diff {
        /// What is expected
        a: PathBuf,
        /// What is to be compared with it
        b: PathBuf,
        /// Show what differs in an HTML file, with pictures in a folder FILE-files beside it
        #[arg(long, value_name = "FILE.html")]
        report: Option<PathBuf>,
    },
    /// Make the emulated card's pictures the golden frames, where QEMU agrees; look at each first
    #[command(after_help = BLESS_HELP)]
    Bless {
        /// The golden frames' folder [default: tests/golden of the workspace]
        folder: Option<PathBuf>,
    },
    /// Measure what accuracy costs: every mapper's error and time on every scene, as tables,
    /// plots and a page; in a release build
    #[command(after_help = TRADE_HELP)]
    Trade(trade::Options),
    /// Write the bootable disk image
    #[command(after_help = IMAGE_HELP)]
    Image {
        /// The file to write
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
}

/// The command line. Options that every subcommand accepts are listed only in the help of those that use them.
fn command() -> clap::Command {
    const LOOK: [&str; 3] = ["scene", "mapper", "order"];
    const MODEL: [&str; 2] = ["model", "texture"];
    const TOOLS: [&str; 2] = ["qemu", "toolchain"];
    let unused: [(&str, &[&[&str]]); 8] = [
        ("clean", &[&LOOK, &MODEL, &TOOLS]),
        ("replay", &[&LOOK, &MODEL, &TOOLS]),
        ("diff", &[&LOOK, &MODEL, &TOOLS]),
        ("doctor", &[&LOOK, &MODEL]),
        ("qemu", &[&LOOK, &MODEL]),
        ("bless", &[&LOOK, &MODEL]),
        ("image", &[&LOOK]),
        ("trade", &[&LOOK]),
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

fn main() -> ExitCode {
    let parsed = command().try_get_matches();
    let parsed = parsed.and_then(|matches| Cli::from_arg_matches(&matches));
    let cli = parsed.unwrap_or_else(|error| {
        let obeyed = |word: OsString| word.to_string_lossy().contains(char::is_control);
        if !std::env::args_os().any(obeyed) {
            error.exit();
        }
        // The message may quote a word that a terminal obeys: print it without clap's colours.
        say(&error);
        std::process::exit(error.exit_code());
    });
    // clap cannot require it of options that stand on different sides of a subcommand.
    let needs_model = match (&cli.model.texture, cli.look.scene) {
        (Some(_), _) => Some("--texture"),
        (_, Some(Named(Entry::LOADED))) => Some("--scene model"),
        _ => None,
    };
    if let Some(option) = needs_model.filter(|_| cli.model.model.is_none()) {
        let kind = clap::error::ErrorKind::MissingRequiredArgument;
        let message = format!("{option} needs your own model: add --model FILE.obj");
        Cli::command().error(kind, message).exit();
    }
    system::catch_interrupts();
    match run(cli) {
        Ok(code) => code,
        Err(error) if error.is::<Printed>() => {
            // Standard output that cannot be written was closed: nobody reads it.
            let _ = writeln!(Output, "{error}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            let mut message = format!("error: {error:#}");
            let code = if let Some(failure) = error.downcast_ref::<Failure>() {
                if failure.verdict == Verdict::User {
                    message = failure.to_string();
                }
                failure.verdict.exit_code()
            } else if let Some(interrupted) = error.downcast_ref::<Interrupted>() {
                message = interrupted.to_string();
                Interrupted::EXIT_CODE as u8
            } else {
                1
            };
            say(message);
            ExitCode::from(code)
        }
    }
}

/// Standard output, which may be closed: what nobody reads is no error, what a full disk loses is.
struct Output;

impl Output {
    fn attempt<T>(unread: T, result: io::Result<T>) -> io::Result<T> {
        result.or_else(|error| match error.kind() {
            io::ErrorKind::BrokenPipe => Ok(unread),
            // To be written again.
            io::ErrorKind::Interrupted => Err(error),
            kind => {
                let message = format!("standard output cannot be written: {error}");
                Err(io::Error::new(kind, message))
            }
        })
    }
}

impl Write for Output {
    /// A program in a pipe gets each byte; a terminal gets no escape sequence, such as a file's name
    /// may have.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut out = io::stdout().lock();
        match std::str::from_utf8(bytes) {
            Ok(text) if out.is_terminal() => {
                let written = out.write_all(printable(text).as_bytes());
                Self::attempt(bytes.len(), written.map(|()| bytes.len()))
            }
            _ => Self::attempt(bytes.len(), out.write(bytes)),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Self::attempt((), io::stdout().flush())
    }
}

fn run(cli: Cli) -> anyhow::Result<ExitCode> {
    let mut options = Options {
        toolchain: cli.tools.toolchain,
        qemu: cli.tools.qemu,
        window: false,
        ramdisk: None,
    };
    let files = cli.model;
    match cli.command {
        Some(Subcommands::Doctor) => {
            options.window = has_display();
            let whole = setup::doctor(&options, &mut Output)?;
            return Ok(if whole {
                ExitCode::SUCCESS
            } else {
                ExitCode::FAILURE
            });
        }
        Some(Subcommands::Qemu { suite }) => {
            let qemu = match suite {
                Some(suite) => setup::qemu_of_suite(&suite)?,
                None => {
                    options.window = has_display();
                    setup::qemu(&options)?
                }
            };
            tell_path(&qemu.path)?;
        }
        Some(Subcommands::Clean) => {
            setup::clean(&mut Output)?;
        }
        Some(Subcommands::Dump(frames)) => {
            let pack = checksum(&load_to_boot(&files, &mut options)?);
            let ready = setup::ready(&options)?;
            let mut machine = Machine::boot(&Config {
                vga: cli.boot.vga,
                pack,
                arguments: cli.qemu_arguments,
                ..Config::new(&ready)
            })?;
            frames.write(&mut machine, &cli.look, tell_path)?;
            machine.leave()?;
        }
        Some(Subcommands::Emulate(frames)) => {
            let model = load(&files)?;
            let pack = model.as_ref().map(Model::pack);
            let mut memory = card::memory();
            let mut card = Emulated::with(&mut memory, pack.as_ref())?;
            frames.write(&mut card, &cli.look, tell_path)?;
        }
        Some(Subcommands::Record(recording)) => {
            if let Err(error) = recording.check() {
                say(format_args!("error: {error}"));
                return Ok(ExitCode::from(2));
            }
            let model = load_to_boot(&files, &mut options)?;
            let ready = setup::ready(&options)?;
            let mut machine = Machine::boot(&Config {
                vga: cli.boot.vga,
                pack: checksum(&model),
                arguments: cli.qemu_arguments,
                ..Config::new(&ready)
            })?;
            let pack = model.as_ref().map(Model::pack);
            let mut memory = card::memory();
            let mut emulated = Emulated::with(&mut memory, pack.as_ref())?;
            recording.record(&mut machine, &mut emulated, &cli.look, tell_path)?;
            machine.leave()?;
        }
        Some(Subcommands::Replay(replay)) => replay.run(tell_path)?,
        Some(Subcommands::Diff { a, b, report }) => return compare(&a, &b, report.as_deref()),
        Some(Subcommands::Bless { folder }) => {
            let folder = folder.unwrap_or_else(crystal_ball::golden_folder);
            let report = setup::folder().join("bless").join("report.html");
            let boot = || Machine::boot(&Config::new(&setup::ready(&options)?));
            match golden::bless(&folder, &report, boot, Machine::leave, |line| say(line))? {
                0 => say("nothing to bless: every golden frame is as it was"),
                count => say(format_args!(
                    "{count} golden frames blessed in {}",
                    folder.display()
                )),
            }
        }
        Some(Subcommands::Trade(mut trade_options)) => {
            if let Err(error) = trade::check_build() {
                say(format_args!("error: {error}"));
                return Ok(ExitCode::from(2));
            }
            let Look { scene, mapper, .. } = cli.look;
            trade_options
                .scenes
                .extend(scene.map(|scene| scene.0.into()));
            trade_options
                .mappers
                .extend(mapper.map(|mapper| mapper.to_string()));
            let model = load(&files)?;
            let pack = model.as_ref().map(Model::pack);
            let page = trade::run(&trade_options, options, pack.as_ref())?;
            say("what was found, as a page with the tables and plots beside it:");
            tell_path(&page)?;
        }
        Some(Subcommands::Image { out }) => {
            load_to_boot(&files, &mut options)?;
            write_image(&setup::image(&options)?, &out)?;
        }
        None => {
            let pack = checksum(&load_to_boot(&files, &mut options)?);
            options.window = !cli.boot.headless && has_display();
            let ready = setup::ready(&options)?;
            let config = Config {
                vga: cli.boot.vga,
                pack,
                arguments: cli.qemu_arguments,
                ..Config::new(&ready)
            };
            watch(&ready, config, cli.boot.headless, &cli.look)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Makes the user's model, if there is one, and tells what it is.
fn load(files: &Files) -> anyhow::Result<Option<Model>> {
    let model = files.load()?;
    if let (Some(model), Some(path)) = (&model, &files.model) {
        say(format_args!("{}: {model}", quote::path(path)));
    }
    Ok(model)
}

/// The same, which is to be the ramdisk of the image, too; tells what that costs.
fn load_to_boot(files: &Files, options: &mut Options) -> anyhow::Result<Option<Model>> {
    let model = load(files)?;
    if let Some(model) = &model {
        say(format_args!(
            "with its {} KiB the boot takes about {:.2} s longer",
            model.bytes.len().div_ceil(1024),
            model.boot_seconds()
        ));
        options.ramdisk = Some(model.bytes.clone());
    }
    Ok(model)
}

/// The checksum of a model's pack.
fn checksum(model: &Option<Model>) -> Option<u32> {
    model.as_ref().map(|model| model.pack().checksum())
}

/// A file was written: its path goes where the next program in a pipe reads it.
fn tell_path(path: &Path) -> io::Result<()> {
    writeln!(Output, "{}", path.display())
}

/// Whether there is a display that a window could open on.
fn has_display() -> bool {
    let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    set("DISPLAY") || set("WAYLAND_DISPLAY")
}

/// The picture of a show: of two at once that show different things each has its own.
fn picture_name(look: &Look, pack: Option<u32>) -> String {
    let mut name = String::from("picture");
    for command in look.commands() {
        if let Command::Set(_, Some(word)) = command {
            // A tolerance is a fraction.
            name += &format!("-{word}").replace('/', "_");
        }
    }
    name.extend(pack.map(|pack| format!("-{pack:08x}")));
    name + ".png"
}

/// Boots the image and lets the user watch, or takes a picture where there is nothing to watch on.
fn watch(ready: &Ready, config: Config, headless: bool, look: &Look) -> anyhow::Result<()> {
    let displays = &ready.qemu.displays;
    // GTK's scales the picture with the window only if it is told to.
    let display = [("gtk", "gtk,zoom-to-fit=on"), ("sdl", "sdl")]
        .into_iter()
        .find(|(name, _)| displays.iter().any(|display| display == name))
        .filter(|_| !headless && has_display())
        .map(|(_, display)| display);
    if display.is_none() && !headless {
        let why = if has_display() {
            "this QEMU has no window (on Debian the package qemu-system-gui brings one)"
        } else {
            "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set)"
        };
        say(format_args!("{why}: booting without a window"));
    }
    let name = picture_name(look, config.pack);
    let start = Instant::now();
    say(format_args!("booting in QEMU {}", ready.qemu.version));
    let mut machine = Machine::boot(&Config {
        display: display.unwrap_or("none").to_string(),
        ..config
    })?;
    machine.wait_until_running()?;
    if display.is_some() {
        // SDL's window follows the card's mode when QEMU next looks at the card; now it has.
        machine.screen()?;
        // Where it can't be done the window is small, as QEMU made it.
        let _ = window::enlarge(machine.process());
    }
    for command in look.commands() {
        machine.ask(command)?;
    }
    let seconds = start.elapsed().as_secs_f64();
    say(format_args!(
        "the first picture is on the screen after {seconds:.1} s"
    ));
    if display.is_some() {
        machine.ask(Command::Steer(None, Change::Act(Action::Hint)))?;
        say("H in the window tells the keys; close it or type Ctrl-C to end it");
        return machine.watch();
    }
    machine.rest(WARM_UP)?;
    let picture = setup::folder().join(name);
    let screen = machine.screen()?;
    write_atomically(&picture, |file| screen.write_png(file))?;
    machine.leave()?;
    say("a picture of the running show:");
    writeln!(Output, "{}", picture.display())?;
    Ok(())
}

/// Here 1 means that something differs: an error is 2, as for `diff` and `cmp`.
fn compare(a: &Path, b: &Path, report: Option<&Path>) -> anyhow::Result<ExitCode> {
    let outcome = match comparison::run(a, b, report, &mut Output) {
        Err(error) if !error.is::<Interrupted>() => {
            say(format_args!("error: {error:#}"));
            comparison::Outcome::Incomparable
        }
        outcome => outcome?,
    };
    Ok(ExitCode::from(outcome.exit_code()))
}

fn write_image(image: &Path, out: &Path) -> anyhow::Result<()> {
    let mut from = File::open(image).with_context(|| format!("{} is gone", image.display()))?;
    let bytes = write_atomically(out, |file| Ok(io::copy(&mut from, file)?))?;
    say(format_args!(
        "{}: {bytes} bytes; boots on a PC BIOS with a VGA",
        out.display()
    ));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_lists_what_is_used_and_its_defaults() {
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
        // Hidden, and still accepted.
        let words = ["crystal-ball", "clean", "--mapper", "exact"];
        assert!(command().try_get_matches_from(words).is_ok());
    }

    /// The commands of the examples in a help text.
    fn examples(help: &str) -> impl Iterator<Item = &str> {
        let (_, examples) = help.split_once("\nExamples").unwrap_or_default();
        let lines = examples.lines().map_while(|line| match line {
            "" => None,
            line => Some(line.trim_start()),
        });
        // What it does stands behind a gap.
        let commands = lines.map(|line| line.split("  ").next().unwrap_or(line));
        commands.filter(|line| line.starts_with("cargo "))
    }

    #[test]
    fn every_help_has_examples_that_are_taken() {
        let whole = command();
        for of in [&whole].into_iter().chain(whole.get_subcommands()) {
            let name = of.get_name();
            let help = of.clone().render_long_help().to_string();
            assert!(examples(&help).next().is_some(), "{name}: no examples");
            for example in examples(&help) {
                let arguments = example.split_once(" -- ").map_or("", |(_, after)| after);
                let words = ["crystal-ball"].into_iter();
                let words = words.chain(arguments.split_whitespace());
                let taken = command().try_get_matches_from(words);
                let taken = taken.unwrap_or_else(|error| panic!("{example}: {error}"));
                let of_subcommand = taken.subcommand_name() == Some(name);
                assert!(of_subcommand || name == whole.get_name(), "{example}");
            }
        }
    }
}
