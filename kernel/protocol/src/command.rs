//! Commands: what the host can request.

use core::fmt;

use crate::{Change, ChecksumError, without_checksum};

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
    /// `show FRAME motion MOTION`: the same in reduced quality, as for a solid with this motion per tick.
    ShowMoving(FrameName, Motion),
    /// `show at TICK`: the same with the frame that the demo's log gives for a tick. Scene, mapper and order
    /// are then those of that tick.
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
    Fail(Fault),
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

/// A setting that commands change by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// `scene`: the scene to draw. The card's mode is set again; in a running demo, only if the scene
    /// changes.
    Scene,
    /// `mapper`: the mapper of textures.
    Mapper,
    /// `order`: the order in which a frame's spans are drawn, and the memory that they are drawn in.
    Order,
}

impl Setting {
    /// All settings, with their words.
    pub const ALL: [(&'static str, Self); 3] = [
        ("scene", Self::Scene),
        ("mapper", Self::Mapper),
        ("order", Self::Order),
    ];

    /// Returns the setting with a word.
    pub fn parse(word: &str) -> Option<Self> {
        let known = Self::ALL.iter().find(|(known, _)| *known == word);
        known.map(|&(_, setting)| setting)
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = Self::ALL.iter().find(|(_, setting)| setting == self);
        f.write_str(word.map_or("", |(word, _)| word))
    }
}

/// A name that only the program can interpret.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    bytes: [u8; Self::MAX],
    len: u8,
}

impl Word {
    /// Most characters in a word.
    pub const MAX: usize = 24;

    /// Returns a word, if `text` is 1 to [`Word::MAX`] printable ASCII characters without a space.
    pub fn new(text: &str) -> Option<Self> {
        let legal = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_graphic());
        let mut bytes = [0; Self::MAX];
        bytes
            .get_mut(..text.len())
            .filter(|_| legal)?
            .copy_from_slice(text.as_bytes());
        let len = text.len() as u8;
        Some(Self { bytes, len })
    }

    /// Returns the word that `named` displays as, if that is a legal word.
    pub fn of(named: impl fmt::Display) -> Option<Self> {
        struct Text([u8; Word::MAX], usize);
        impl fmt::Write for Text {
            fn write_str(&mut self, text: &str) -> fmt::Result {
                let end = self.1 + text.len();
                let place = self.0.get_mut(self.1..end).ok_or(fmt::Error)?;
                place.copy_from_slice(text.as_bytes());
                self.1 = end;
                Ok(())
            }
        }
        let mut text = Text([0; Self::MAX], 0);
        fmt::write(&mut text, format_args!("{named}")).ok()?;
        Self::new(core::str::from_utf8(&text.0[..text.1]).ok()?)
    }

    /// Returns the word's text.
    pub fn as_str(&self) -> &str {
        // `new` has checked that the bytes are ASCII.
        core::str::from_utf8(&self.bytes[..self.len.into()]).unwrap_or_default()
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
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

impl Fault {
    /// All faults, with their names in the protocol.
    pub const ALL: [(&'static str, Self); 7] = [
        ("panic", Self::Panic),
        ("panic-in-line", Self::PanicInLine),
        ("page-fault", Self::PageFault),
        ("stack-overflow", Self::StackOverflow),
        ("triple-fault", Self::TripleFault),
        ("adapter", Self::Adapter),
        ("hang", Self::Hang),
    ];
}

/// Why a line is not a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandError<'a> {
    /// The first word is not a command.
    Unknown(&'a str),
    /// The words after the command are not legal for it.
    Arguments {
        /// The command.
        command: &'a str,
        /// The arguments that the command accepts.
        takes: &'static str,
    },
    /// The line has a checksum, which is wrong.
    Checksum(ChecksumError),
}

impl fmt::Display for CommandError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(word) => write!(
                f,
                "no command '{word}'; there are hold, run, show FRAME, show FRAME motion MOTION, show at TICK, scene NAME, \
                 mapper NAME, order NAME, steer CHANGE, steer TICK CHANGE, log, keys, dump, checksums, \
                 registers, counts, state, version, fail KIND, leave"
            ),
            Self::Arguments { command, takes } => write!(f, "'{command}' takes {takes}"),
            Self::Checksum(error) => error.fmt(f),
        }
    }
}

impl Command {
    /// Parses a command, and checks its checksum if it has one.
    ///
    /// # Errors
    /// The line is not a command.
    pub fn parse(line: &str) -> Result<Self, CommandError<'_>> {
        let text = match without_checksum(line) {
            Ok(text) => text,
            Err(ChecksumError::NoChecksum) => line,
            Err(wrong) => return Err(CommandError::Checksum(wrong)),
        };
        let mut words = text.split_ascii_whitespace();
        let command = words.next().unwrap_or("");
        let takes = |takes| CommandError::Arguments { command, takes };
        if command == "show" {
            let at = words.clone().next() == Some("at");
            let shown = match at {
                true => {
                    words.next();
                    let tick = words.next().and_then(decimal);
                    tick.filter(|_| words.next().is_none()).map(Self::ShowAt)
                }
                false => {
                    let mut motion = words.clone().skip_while(|word| *word != "motion");
                    let frame = FrameName::parse(words.take_while(|word| *word != "motion"));
                    frame.and_then(|frame| match motion.next() {
                        Some(_) => Some(Self::ShowMoving(frame, Motion::parse(motion)?)),
                        None => Some(Self::Show(frame)),
                    })
                }
            };
            return shown.ok_or(takes(
                "a frame number, 0 to 4294967295, or 'pose' and four hex numbers: \
                 yaw, pitch, roll, distance, either of them alone or followed by 'motion' and four \
                 hex numbers: what each changes by in a tick; or 'at' and a tick",
            ));
        }
        if command == "steer" {
            let tick = words.clone().next().and_then(decimal);
            if tick.is_some() {
                words.next();
            }
            let change = Change::parse(words).map(|change| Self::Steer(tick, change));
            return change.ok_or(takes(
                "an action ('keys' lists them), or scene, mapper or order and a name; \
                 for a held show a tick before it, 0 to 4294967295",
            ));
        }
        let argument = words.next();
        if words.next().is_some() {
            return Err(takes("at most one word"));
        }
        let content = || match argument {
            None => Ok(Content::Page),
            Some("all") => Ok(Content::Memory),
            Some(_) => Err(takes("nothing, or 'all'")),
        };
        if let Some(setting) = Setting::parse(command) {
            let word = argument.map(|argument| {
                Word::new(argument).ok_or(takes("nothing, or a name; alone it lists them"))
            });
            return Ok(Self::Set(setting, word.transpose()?));
        }
        let plain = match command {
            "dump" => return content().map(Self::Dump),
            "checksums" => return content().map(Self::Checksums),
            "fail" => {
                let fault = Fault::ALL.iter().find(|(name, _)| argument == Some(name));
                return fault.map(|&(_, fault)| Self::Fail(fault)).ok_or(takes(
                    "panic, panic-in-line, page-fault, stack-overflow, triple-fault, adapter or hang",
                ));
            }
            "hold" => Self::Hold,
            "run" => Self::Run,
            "log" => Self::Log,
            "keys" => Self::Keys,
            "registers" => Self::Registers,
            "counts" => Self::Counts,
            "state" => Self::State,
            "version" => Self::Version,
            "leave" => Self::Leave,
            _ => return Err(CommandError::Unknown(command)),
        };
        match argument {
            None => Ok(plain),
            Some(_) => Err(takes("nothing")),
        }
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
    fn every_command_comes_back() {
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
        let actions = Action::ALL.map(|(_, action)| Change::Act(action));
        for change in actions.into_iter().chain([mapper]) {
            commands.extend([None, Some(0), Some(u32::MAX)].map(|t| Command::Steer(t, change)));
        }
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
    fn a_word_is_what_is_displayed_if_it_is_one() {
        assert_eq!(Word::of("within-1/2"), Word::new("within-1/2"));
        assert_eq!(Word::of(format_args!("{}-{}", 1, 2)), Word::new("1-2"));
        for no_word in ["", "two words", "a-name-of-25-characters-is", "\u{e9}"] {
            assert_eq!((Word::of(no_word), Word::new(no_word)), (None, None));
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
            ("show 1 2", "a frame number"),
            ("show pose 1 2 3", "four hex numbers"),
            ("show pose 1 2 3 4 5", "four hex numbers"),
            ("show pose +1 2 3 4", "four hex numbers"),
            ("show pose 1 2 3 123456789", "four hex numbers"),
            ("show motion 1 2 3 4", "a frame number"),
            ("show 1 motion", "'motion' and four hex numbers"),
            ("show 1 motion 1 2 3", "'motion' and four hex numbers"),
            ("show 1 motion 1 2 3 4 5", "'motion' and four hex numbers"),
            ("show 1 motion 1 2 3 -4", "'motion' and four hex numbers"),
            (
                "show 1 motion 1 2 3 123456789",
                "'motion' and four hex numbers",
            ),
            ("show at 1 motion 1 2 3 4", "'at' and a tick"),
            ("show at", "'at' and a tick"),
            ("show at -1", "'at' and a tick"),
            ("show at 1 2", "'at' and a tick"),
            ("steer", "an action ('keys' lists them)"),
            ("steer 5", "an action"),
            ("steer yaw", "an action"),
            ("steer stop 5", "an action"),
            ("steer 4294967296 stop", "an action"),
            ("steer 5 mapper", "an action"),
            ("log it", "'log' takes nothing"),
            ("mapper affine exact", "at most one word"),
            ("mapper a-name-that-is-much-too-long", "nothing, or a name"),
            ("dump it", "nothing, or 'all'"),
            ("checksums all all", "at most one word"),
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
