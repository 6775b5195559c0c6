//! The `crystal-ball` command.

mod arguments;
mod commands;
mod common;
mod dispatch;
mod output;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

use qemu::{Failure, Printed, Verdict};
use scene::catalogue::Entry;
use system::{Interrupted, say};

use arguments::Cli;
use output::Output;

fn main() -> ExitCode {
    let parsed = arguments::command().try_get_matches();
    let parsed = parsed.and_then(|matches| Cli::from_arg_matches(&matches));
    let cli = parsed.unwrap_or_else(|error| {
        let has_control = |word: OsString| word.to_string_lossy().contains(char::is_control);
        if !std::env::args_os().any(has_control) {
            error.exit();
        }
        // The message may quote an escape sequence: print it escaped, without clap's colours.
        say(&error);
        std::process::exit(error.exit_code());
    });
    // clap cannot require this of options that stand on different sides of a subcommand.
    let needs_model = match (&cli.model.texture, cli.frame_options.scene) {
        (Some(_), _) => Some("--texture"),
        (_, Some(Entry::LOADED)) => Some("--scene model"),
        _ => None,
    };
    if let Some(option) = needs_model.filter(|_| cli.model.model.is_none()) {
        let kind = clap::error::ErrorKind::MissingRequiredArgument;
        let message = format!("{option} needs a model; add --model FILE.obj");
        Cli::command().error(kind, message).exit();
    }
    system::catch_interrupts();
    match dispatch::run(cli) {
        Ok(code) => code,
        Err(error) if error.is::<Printed>() => {
            // If standard output is closed, nobody reads the list.
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
