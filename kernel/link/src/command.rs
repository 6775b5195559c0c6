//! What the host can ask.

use core::fmt;

use crate::{FrameError, unframe};

/// A command, as it stands on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `hold`: stop the show, clear the pages, and draw only what is asked for. From here on the
    /// picture memory depends on the commands alone.
    Hold,
    /// `run`: let the show run.
    Run,
    /// `show N`: draw picture N on the next page, flip, and answer when the flip holds. A show
    /// that runs is held first.
    Show(u32),
    /// `registers`: every register of the mode, read back.
    Registers,
    /// `counts`: what the last picture took, and how the show keeps its pace.
    Counts,
    /// `fail KIND`: break in the way that is named, to prove that the host notices.
    Fail(Fault),
    /// `leave`: end QEMU with the code for success.
    Leave,
}

/// A way to break.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// `panic`
    Panic,
    /// `panic-in-line`: in the middle of a line of an answer, with the serial line locked.
    PanicInLine,
    /// `page-fault`
    PageFault,
    /// `stack-overflow`
    StackOverflow,
    /// `triple-fault`
    TripleFault,
    /// `hang`
    Hang,
}

impl Fault {
    /// Every fault with its name on the line.
    pub const ALL: [(&'static str, Self); 6] = [
        ("panic", Self::Panic),
        ("panic-in-line", Self::PanicInLine),
        ("page-fault", Self::PageFault),
        ("stack-overflow", Self::StackOverflow),
        ("triple-fault", Self::TripleFault),
        ("hang", Self::Hang),
    ];
}

/// Why a line is not a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandError<'a> {
    /// The first word is none of the commands.
    Unknown(&'a str),
    /// The words after the command are not what it takes.
    Arguments {
        /// The command.
        command: &'a str,
        /// What it takes.
        takes: &'static str,
    },
    /// The line has a checksum, and it is wrong.
    Checksum(FrameError),
}

impl fmt::Display for CommandError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(word) => write!(
                f,
                "no command '{word}'; there are hold, run, show N, registers, counts, fail KIND, leave"
            ),
            Self::Arguments { command, takes } => write!(f, "'{command}' takes {takes}"),
            Self::Checksum(error) => error.fmt(f),
        }
    }
}

impl Command {
    /// Reads a command, its checksum checked if it has one.
    ///
    /// # Errors
    /// A line that is none.
    pub fn parse(line: &str) -> Result<Self, CommandError<'_>> {
        let text = match unframe(line) {
            Ok(text) => text,
            Err(FrameError::NoChecksum) => line,
            Err(wrong) => return Err(CommandError::Checksum(wrong)),
        };
        let mut words = text.split_ascii_whitespace();
        let command = words.next().unwrap_or("");
        let argument = words.next();
        let error = |takes| Err(CommandError::Arguments { command, takes });
        if words.next().is_some() {
            return error("at most one word");
        }
        let plain = match command {
            "hold" => Self::Hold,
            "run" => Self::Run,
            "registers" => Self::Registers,
            "counts" => Self::Counts,
            "leave" => Self::Leave,
            "show" => {
                // `parse` would take a leading plus sign.
                let number = argument.filter(|a| a.bytes().all(|b| b.is_ascii_digit()));
                return match number.and_then(|a| a.parse().ok()) {
                    Some(frame) => Ok(Self::Show(frame)),
                    None => error("a frame number, 0 to 4294967295"),
                };
            }
            "fail" => {
                let fault = Fault::ALL.iter().find(|(name, _)| argument == Some(name));
                return match fault {
                    Some(&(_, fault)) => Ok(Self::Fail(fault)),
                    None => error(
                        "panic, panic-in-line, page-fault, stack-overflow, triple-fault or hang",
                    ),
                };
            }
            _ => return Err(CommandError::Unknown(command)),
        };
        if argument.is_some() {
            return error("nothing");
        }
        Ok(plain)
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hold => f.write_str("hold"),
            Self::Run => f.write_str("run"),
            Self::Show(frame) => write!(f, "show {frame}"),
            Self::Registers => f.write_str("registers"),
            Self::Counts => f.write_str("counts"),
            Self::Fail(fault) => {
                let name = Fault::ALL.iter().find(|(_, f)| f == fault);
                write!(f, "fail {}", name.map_or("", |(name, _)| name))
            }
            Self::Leave => f.write_str("leave"),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;
    use std::vec::Vec;

    #[test]
    fn every_command_comes_back() {
        let mut commands = std::vec![
            Command::Hold,
            Command::Run,
            Command::Show(0),
            Command::Show(u32::MAX),
            Command::Registers,
            Command::Counts,
            Command::Leave,
        ];
        commands.extend(Fault::ALL.map(|(_, fault)| Command::Fail(fault)));
        for command in commands {
            let mut framed = Vec::new();
            crate::write_line(format_args!("{command}"), |b| framed.extend_from_slice(b));
            let framed = std::str::from_utf8(&framed).unwrap().trim_end();
            assert_eq!(Command::parse(&command.to_string()), Ok(command));
            assert_eq!(Command::parse(framed), Ok(command));
        }
    }

    #[test]
    fn what_is_no_command_is_named() {
        for (line, reason) in [
            ("", "no command ''"),
            ("shew 1", "no command 'shew'"),
            ("show", "a frame number"),
            ("show -1", "a frame number"),
            ("show +1", "a frame number"),
            ("show 4294967296", "a frame number"),
            ("show 1 2", "at most one word"),
            ("hold on", "'hold' takes nothing"),
            ("fail", "panic, panic-in-line"),
            ("fail me", "panic, panic-in-line"),
            ("hold *00000000", "says checksum 00000000"),
        ] {
            let error = Command::parse(line).unwrap_err().to_string();
            assert!(error.contains(reason), "{line:?}: {error}");
        }
    }
}
