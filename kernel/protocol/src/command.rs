//! Commands: what the host can request.

use core::fmt;

use strum::{Display, EnumString, VariantArray};

use crate::{Change, ChecksumError, Setting, Word, without_checksum};

/// A command, as a line contains it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// `hold`: stop the demo, clear the pages, reset every setting, and draw only on command. From here on
    /// video memory depends on the commands alone.
    Hold,
    /// `run`: let the demo run. A demo that was held keeps its settings, and moves as its scene does.
    Run,
    /// `show FRAME`: draw a frame on the next page, flip, and answer when the flip takes effect. A running
    /// demo is stopped first and keeps its settings.
    Show(FrameName),
    /// `show FRAME motion MOTION`: do the same in reduced quality, as for a solid with this motion per tick.
    ShowMoving(FrameName, Motion),
    /// `show at TICK`: do the same with the frame that the demo's log defines for a tick. Scene, mapper and
    /// order are then those of that tick.
    ShowAt(u32),
    /// `scene NAME`, `mapper NAME`, `order NAME`: change a setting from the next frame on. Without a name:
    /// list the values, and mark the current value.
    Set(Setting, Option<Word>),
    /// `steer CHANGE`: change the running demo now. `steer TICK CHANGE`: add a change to the log of a held
    /// demo, for `show at`; ticks may not decrease.
    Steer(Option<u32>, Change),
    /// `log`: print the changes so far, as commands that a held demo accepts.
    Log,
    /// `keys`: list the keys and their actions.
    Keys,
    /// `dump` or `dump all`: print the card's content, read back from the card, in the format of
    /// [`crate::dump`].
    Dump(Content),
    /// `checksums` or `checksums all`: print the CRC-32 of the same content instead of its bytes.
    Checksums(Content),
    /// `registers`: print every register of the mode, read back from the card.
    Registers,
    /// `counts`: print the counts of the last frame, and how the demo keeps up with the ticks.
    Counts,
    /// `state`: print whether the demo runs or is held, and what is on the screen.
    State,
    /// `version`: print the versions of the program, the protocol and the dumps.
    Version,
    /// `fail KIND`: fail in the named way, to prove that the host notices.
    Fail(FailKind),
    /// `leave`: end QEMU with the code for success.
    Leave,
}

/// The name of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameName {
    /// `N`: the scene's default pose at tick N.
    Number(u32),
    /// `pose YAW PITCH ROLL DISTANCE`, each in up to eight hex digits: the angles as 32-bit fractions of a
    /// turn, the distance in 16.16.
    Pose {
        /// Turn about the solid's own axis.
        yaw: u32,
        /// Turn about the screen's horizontal axis.
        pitch: u32,
        /// Turn about the line of sight.
        roll: u32,
        /// Distance from the eye to the solid's centre.
        distance: u32,
    },
}

impl FrameName {
    /// Parses a name, as [`fmt::Display`] writes it.
    pub fn parse<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Self> {
        let frame = match words.next()? {
            "pose" => Self::Pose {
                yaw: hex(words.next()?)?,
                pitch: hex(words.next()?)?,
                roll: hex(words.next()?)?,
                distance: hex(words.next()?)?,
            },
            number => Self::Number(decimal(number)?),
        };
        words.next().is_none().then_some(frame)
    }
}

/// The change of a pose in a tick. Each part is added to the pose's part modulo 2^32, so a negative change is
/// a two's complement.
///
/// In reduced quality the motion decides which faces are drawn by a faster mapper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motion {
    /// Change of [`FrameName::Pose::yaw`], a 32-bit fraction of a turn.
    pub yaw: u32,
    /// Change of [`FrameName::Pose::pitch`].
    pub pitch: u32,
    /// Change of [`FrameName::Pose::roll`].
    pub roll: u32,
    /// Change of [`FrameName::Pose::distance`], in 16.16.
    pub distance: u32,
}

impl Motion {
    /// Parses a motion, as [`fmt::Display`] writes it: four words of up to eight hex digits.
    pub fn parse<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Self> {
        let motion = Self {
            yaw: hex(words.next()?)?,
            pitch: hex(words.next()?)?,
            roll: hex(words.next()?)?,
            distance: hex(words.next()?)?,
        };
        words.next().is_none().then_some(motion)
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            yaw,
            pitch,
            roll,
            distance,
        } = self;
        write!(f, "{yaw:08x} {pitch:08x} {roll:08x} {distance:08x}")
    }
}

/// Parses one to eight hex digits. `from_str_radix` would also accept a sign, and more digits after leading
/// zeros.
fn hex(word: &str) -> Option<u32> {
    let digits = word.len() <= 8 && word.bytes().all(|b| b.is_ascii_hexdigit());
    u32::from_str_radix(word, 16).ok().filter(|_| digits)
}

/// Parses decimal digits. `parse` would also accept a sign.
fn decimal(word: &str) -> Option<u32> {
    let digits = word.bytes().all(|b| b.is_ascii_digit());
    word.parse().ok().filter(|_| digits)
}

impl fmt::Display for FrameName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(frame) => write!(f, "{frame}"),
            Self::Pose {
                yaw,
                pitch,
                roll,
                distance,
            } => write!(f, "pose {yaw:08x} {pitch:08x} {roll:08x} {distance:08x}"),
        }
    }
}

/// How much of video memory a dump contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// The page on the screen.
    Page,
    /// All four planes, 64 KiB each.
    Memory,
}

/// A way to fail on purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Display, EnumString, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum FailKind {
    /// `panic`
    Panic,
    /// `panic-in-line`: panic in the middle of a line of an answer, with the serial line locked.
    PanicInLine,
    /// `page-fault`
    PageFault,
    /// `stack-overflow`
    StackOverflow,
    /// `triple-fault`
    TripleFault,
    /// `adapter`: fail as if the display adapter did not support Mode X.
    Adapter,
    /// `hang`
    Hang,
}

impl FailKind {
    /// All kinds.
    pub const ALL: &'static [Self] = Self::VARIANTS;
}

/// Each command's first word, and its usage as an error message prints it.
///
/// Kept by hand, because the second column is prose. A test checks that each command is here.
const USAGE: &[(&str, &str)] = &[
    ("hold", "'hold'"),
    ("run", "'run'"),
    (
        "show",
        "'show FRAME', 'show FRAME motion MOTION' or 'show at TICK'; FRAME is a number, 0 to 4294967295, \
         or 'pose' and four hex numbers: yaw, pitch, roll, distance; MOTION is four hex numbers: the \
         change of each in a tick; TICK is 0 to 4294967295",
    ),
    ("scene", "'scene' to list the scenes, or 'scene NAME'"),
    ("mapper", "'mapper' to list the mappers, or 'mapper NAME'"),
    ("order", "'order' to list the orders, or 'order NAME'"),
    (
        "steer",
        "'steer CHANGE' while the demo is running, or 'steer TICK CHANGE' while it is held; CHANGE is an \
         action ('keys' lists them), or scene, mapper or order and a name; TICK is 0 to 4294967295",
    ),
    ("log", "'log'"),
    ("keys", "'keys'"),
    ("dump", "'dump' or 'dump all'"),
    ("checksums", "'checksums' or 'checksums all'"),
    ("registers", "'registers'"),
    ("counts", "'counts'"),
    ("state", "'state'"),
    ("version", "'version'"),
    (
        "fail",
        "'fail KIND'; KIND is panic, panic-in-line, page-fault, stack-overflow, triple-fault, adapter or \
         hang",
    ),
    ("leave", "'leave'"),
];

/// Returns the usage of a command, or `None` if no command begins with `word`.
fn usage(word: &str) -> Option<&'static str> {
    let command = USAGE.iter().find(|(known, _)| *known == word);
    command.map(|&(_, usage)| usage)
}

/// The reason why a line is not a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandError<'a> {
    /// No command begins with this word.
    Unknown(&'a str),
    /// The words after this command are not legal for it.
    Arguments(&'a str),
    /// The line has a checksum, which is wrong.
    Checksum(ChecksumError),
}

impl fmt::Display for CommandError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(word) => {
                write!(f, "unknown command '{word}'; the commands are")?;
                for (i, (command, _)) in USAGE.iter().enumerate() {
                    write!(f, "{} {command}", if i == 0 { "" } else { "," })?;
                }
                Ok(())
            }
            Self::Arguments(command) => {
                let usage = usage(command).unwrap_or("");
                write!(f, "the arguments of '{command}' are wrong; use {usage}")
            }
            Self::Checksum(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for CommandError<'_> {}

impl Command {
    /// Parses a command, and checks its checksum if it has one.
    ///
    /// # Errors
    /// If the line is not a command.
    pub fn parse(line: &str) -> Result<Self, CommandError<'_>> {
        let text = match without_checksum(line) {
            Ok(text) => text,
            Err(ChecksumError::NoChecksum) => line,
            Err(wrong) => return Err(CommandError::Checksum(wrong)),
        };
        let mut words = text.split_ascii_whitespace();
        let command = words.next().unwrap_or("");
        usage(command).ok_or(CommandError::Unknown(command))?;
        let parsed = match command {
            "show" => Self::parse_show(words),
            "steer" => Self::parse_steer(words),
            _ => Self::parse_short(command, words.next()).filter(|_| words.next().is_none()),
        };
        parsed.ok_or(CommandError::Arguments(command))
    }

    /// Parses the words after `show`.
    fn parse_show<'a>(mut words: impl Iterator<Item = &'a str> + Clone) -> Option<Self> {
        if words.clone().next() == Some("at") {
            let tick = words.nth(1).and_then(decimal)?;
            return words.next().is_none().then_some(Self::ShowAt(tick));
        }
        let mut motion = words.clone().skip_while(|word| *word != "motion");
        let frame = FrameName::parse(words.take_while(|word| *word != "motion"))?;
        Some(match motion.next() {
            Some(_) => Self::ShowMoving(frame, Motion::parse(motion)?),
            None => Self::Show(frame),
        })
    }

    /// Parses the words after `steer`.
    fn parse_steer<'a>(mut words: impl Iterator<Item = &'a str> + Clone) -> Option<Self> {
        let tick = words.clone().next().and_then(decimal);
        if tick.is_some() {
            words.next();
        }
        Some(Self::Steer(tick, Change::parse(words)?))
    }

    /// Parses a command that has at most one argument.
    fn parse_short(command: &str, argument: Option<&str>) -> Option<Self> {
        if let Ok(setting) = command.parse() {
            return Some(match argument {
                Some(name) => Self::Set(setting, Some(Word::new(name)?)),
                None => Self::Set(setting, None),
            });
        }
        Some(match (command, argument) {
            ("hold", None) => Self::Hold,
            ("run", None) => Self::Run,
            ("log", None) => Self::Log,
            ("keys", None) => Self::Keys,
            ("dump", None) => Self::Dump(Content::Page),
            ("dump", Some("all")) => Self::Dump(Content::Memory),
            ("checksums", None) => Self::Checksums(Content::Page),
            ("checksums", Some("all")) => Self::Checksums(Content::Memory),
            ("registers", None) => Self::Registers,
            ("counts", None) => Self::Counts,
            ("state", None) => Self::State,
            ("version", None) => Self::Version,
            ("fail", Some(kind)) => Self::Fail(kind.parse().ok()?),
            ("leave", None) => Self::Leave,
            _ => return None,
        })
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hold => f.write_str("hold"),
            Self::Run => f.write_str("run"),
            Self::Show(frame) => write!(f, "show {frame}"),
            Self::ShowMoving(frame, motion) => write!(f, "show {frame} motion {motion}"),
            Self::ShowAt(tick) => write!(f, "show at {tick}"),
            Self::Steer(None, change) => write!(f, "steer {change}"),
            Self::Steer(Some(tick), change) => write!(f, "steer {tick} {change}"),
            Self::Log => f.write_str("log"),
            Self::Keys => f.write_str("keys"),
            Self::Set(setting, None) => write!(f, "{setting}"),
            Self::Set(setting, Some(word)) => write!(f, "{setting} {word}"),
            Self::Dump(Content::Page) => f.write_str("dump"),
            Self::Dump(Content::Memory) => f.write_str("dump all"),
            Self::Checksums(Content::Page) => f.write_str("checksums"),
            Self::Checksums(Content::Memory) => f.write_str("checksums all"),
            Self::Registers => f.write_str("registers"),
            Self::Counts => f.write_str("counts"),
            Self::State => f.write_str("state"),
            Self::Version => f.write_str("version"),
            Self::Fail(kind) => write!(f, "fail {kind}"),
            Self::Leave => f.write_str("leave"),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::Action;
    use std::string::ToString;
    use std::vec::Vec;

    const MOTION: Motion = Motion {
        yaw: 5,
        pitch: u32::MAX,
        roll: 0,
        distance: 0xFFFF_0000,
    };

    #[test]
    fn every_command_is_parsed_from_its_text_and_has_a_usage() {
        let mut commands = std::vec![
            Command::Hold,
            Command::Run,
            Command::Show(FrameName::Number(0)),
            Command::Show(FrameName::Number(u32::MAX)),
            Command::Show(FrameName::Pose {
                yaw: u32::MAX,
                pitch: 0,
                roll: 0x0123_abcd,
                distance: 1,
            }),
            Command::ShowMoving(FrameName::Number(7), MOTION),
            Command::ShowMoving(
                FrameName::Pose {
                    yaw: 1,
                    pitch: 2,
                    roll: 3,
                    distance: 4,
                },
                MOTION,
            ),
            Command::ShowAt(0),
            Command::ShowAt(u32::MAX),
            Command::Set(Setting::Mapper, None),
            Command::Set(Setting::Order, Word::new("planes")),
            Command::Set(Setting::Mapper, Word::new("within-1/256")),
            Command::Dump(Content::Page),
            Command::Dump(Content::Memory),
            Command::Checksums(Content::Page),
            Command::Checksums(Content::Memory),
            Command::Log,
            Command::Keys,
            Command::Registers,
            Command::Counts,
            Command::State,
            Command::Version,
            Command::Leave,
        ];
        let mapper = Change::Set(Setting::Mapper, Word::new("within-1/256").unwrap());
        let actions = Action::ALL.iter().copied().map(Change::Act);
        for change in actions.chain([mapper]) {
            commands.extend([None, Some(0), Some(u32::MAX)].map(|t| Command::Steer(t, change)));
        }
        commands.extend(FailKind::ALL.iter().copied().map(Command::Fail));
        for command in commands {
            let mut framed = Vec::new();
            crate::write_line(format_args!("{command}"), |b| framed.extend_from_slice(b));
            let framed = std::str::from_utf8(&framed).unwrap().trim_end();
            let text = command.to_string();
            assert_eq!(Command::parse(&text), Ok(command));
            assert!(usage(text.split(' ').next().unwrap()).is_some(), "{text}");
            assert_eq!(Command::parse(framed), Ok(command));
        }
        for kind in FailKind::ALL {
            assert!(usage("fail").unwrap().contains(&kind.to_string()), "{kind}");
        }
    }

    #[test]
    fn a_word_has_the_displayed_text_if_that_is_legal() {
        assert_eq!(Word::of("within-1/2"), Word::new("within-1/2"));
        assert_eq!(Word::of(format_args!("{}-{}", 1, 2)), Word::new("1-2"));
        for illegal in ["", "two words", "a-name-of-25-characters-is", "\u{e9}"] {
            assert_eq!((Word::of(illegal), Word::new(illegal)), (None, None));
        }
    }

    #[test]
    fn an_error_names_the_wrong_word_or_the_usage() {
        for line in ["", "shew 1"] {
            let error = Command::parse(line).unwrap_err();
            assert!(matches!(error, CommandError::Unknown(word) if line.starts_with(word)));
            let text = error.to_string();
            assert!(
                text.ends_with(
                    "the commands are hold, run, show, scene, mapper, order, steer, log, \
                keys, dump, checksums, registers, counts, state, version, fail, leave"
                ),
                "{text}"
            );
        }
        for (line, usage) in [
            ("show", "'show FRAME', "),
            ("show -1", "'show FRAME', "),
            ("show +1", "'show FRAME', "),
            ("show 4294967296", "'show FRAME', "),
            ("show 1 2", "'show FRAME', "),
            ("show pose 1 2 3", "'show FRAME', "),
            ("show pose 1 2 3 4 5", "'show FRAME', "),
            ("show pose +1 2 3 4", "'show FRAME', "),
            ("show pose 1 2 3 123456789", "'show FRAME', "),
            ("show motion 1 2 3 4", "'show FRAME', "),
            ("show 1 motion", "'show FRAME', "),
            ("show 1 motion 1 2 3", "'show FRAME', "),
            ("show 1 motion 1 2 3 4 5", "'show FRAME', "),
            ("show 1 motion 1 2 3 -4", "'show FRAME', "),
            ("show 1 motion 1 2 3 123456789", "'show FRAME', "),
            ("show at 1 motion 1 2 3 4", "'show FRAME', "),
            ("show at", "'show FRAME', "),
            ("show at -1", "'show FRAME', "),
            ("show at 1 2", "'show FRAME', "),
            ("steer", "'steer CHANGE' "),
            ("steer 5", "'steer CHANGE' "),
            ("steer yaw", "'steer CHANGE' "),
            ("steer stop 5", "'steer CHANGE' "),
            ("steer 4294967296 stop", "'steer CHANGE' "),
            ("steer 5 mapper", "'steer CHANGE' "),
            ("log it", "'log'"),
            ("mapper affine exact", "'mapper' to list the mappers, "),
            (
                "mapper a-name-that-is-much-too-long",
                "'mapper' to list the mappers, ",
            ),
            ("dump it", "'dump' or 'dump all'"),
            ("checksums all all", "'checksums' or 'checksums all'"),
            ("hold on", "'hold'"),
            ("fail", "'fail KIND'; KIND is panic, "),
            ("fail me", "'fail KIND'; KIND is panic, "),
        ] {
            let command = line.split(' ').next().unwrap();
            let error = Command::parse(line).unwrap_err();
            assert_eq!(error, CommandError::Arguments(command), "{line:?}");
            let text = error.to_string();
            let start = std::format!("the arguments of '{command}' are wrong; use {usage}");
            assert!(text.starts_with(&start), "{line:?}: {text}");
        }
        let error = Command::parse("hold *00000000").unwrap_err();
        assert!(matches!(error, CommandError::Checksum(_)), "{error}");
    }
}
