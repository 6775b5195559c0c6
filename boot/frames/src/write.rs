//! `dump` and `emulate`: pictures as files, a text dump and a PNG of each.
//!
//! The show is held anew before each picture, so a dump depends on its picture alone and not on
//! which others were asked for: the same bytes come out in any order, from either card.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{ArgAction, Args};
use link::{Command, Content, Motion, Picture};

use crate::card::Card;
use crate::look::Look;
use system::Step;
use system::{Interrupted, interrupted, write_atomically};

/// Which pictures, how much of the card, and where to.
#[derive(Args, Clone, Debug)]
pub struct Frames {
    #[command(flatten)]
    which: Which,
    /// Draw in reduced quality, as a solid that moves by so much a tick: the changes of the angles
    /// and of the distance, each in hex and modulo 2^32, as a dump's line `motion` has them
    #[arg(long, num_args = 4, value_names = ["YAW", "PITCH", "ROLL", "DISTANCE"],
        value_parser = hex, action = ArgAction::Set)]
    motion: Option<Vec<u32>>,
    /// All of video memory, 4 x 64 KiB, and not only the page on the screen
    #[arg(long)]
    all: bool,
    /// The folder to write to
    #[arg(long, value_name = "DIR", default_value = "dumps")]
    out: PathBuf,
}

#[derive(Args, Clone, Debug)]
#[group(required = true, multiple = true)]
struct Which {
    /// The frame with this number; may be given again
    #[arg(long = "frame", value_name = "N")]
    single: Vec<u32>,
    /// Frames A up to B, without B (with it: A..=B)
    #[arg(long = "frames", value_name = "A..B", value_parser = range)]
    ranges: Vec<RangeInclusive<u32>>,
    /// The solid in this pose: angles as 32-bit fractions of a turn and the distance in 16.16,
    /// each in hex, as the descriptions in tests/golden have them
    #[arg(long, num_args = 4, value_names = ["YAW", "PITCH", "ROLL", "DISTANCE"],
        value_parser = hex)]
    pose: Vec<u32>,
}

/// Reads up to eight hex digits.
fn hex(text: &str) -> Result<u32, String> {
    // `from_str_radix` would take a plus sign.
    if !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Err("a hex number has the digits 0 to 9 and a to f".into());
    }
    u32::from_str_radix(text, 16).map_err(|error| error.to_string())
}

/// Reads `A..B` or `A..=B`.
pub(crate) fn range(text: &str) -> Result<RangeInclusive<u32>, String> {
    let parts = text.split_once("..");
    let (first, last) = parts.ok_or("two frame numbers are written A..B, or A..=B")?;
    let number = |text: &str| {
        let number = text.parse::<u32>();
        number.map_err(|error| format!("'{text}' is no frame number: {error}"))
    };
    let first = number(first)?;
    let last = match last.strip_prefix('=') {
        Some(last) => Some(number(last)?),
        None => number(last)?.checked_sub(1),
    };
    last.map(|last| first..=last)
        .filter(|range| !range.is_empty())
        .ok_or_else(|| "there is no frame in it".into())
}

impl Frames {
    /// How many pictures, and each of them.
    fn pictures(&self) -> (u64, impl Iterator<Item = Picture>) {
        let Which {
            single,
            ranges,
            pose,
        } = &self.which;
        let (poses, _) = pose.as_chunks::<4>();
        let numbers = single.iter().copied();
        let frames = numbers.chain(ranges.iter().cloned().flatten());
        let poses_of = |&[yaw, pitch, roll, distance]: &[u32; 4]| Picture::Pose {
            yaw,
            pitch,
            roll,
            distance,
        };
        let in_ranges: u64 = ranges
            .iter()
            .map(|range| u64::from(range.end() - range.start()) + 1)
            .sum();
        let count = (single.len() + poses.len()) as u64 + in_ranges;
        let pictures = frames.map(Picture::Frame).chain(poses.iter().map(poses_of));
        (count, pictures)
    }

    /// The motion, if there is one.
    fn motion(&self) -> Option<Motion> {
        let &[yaw, pitch, roll, distance] = self.motion.as_deref()? else {
            return None;
        };
        Some(Motion {
            yaw,
            pitch,
            roll,
            distance,
        })
    }

    /// Has each picture shown by `card`, drawn as `look` says, and writes its dump and its PNG; `wrote` is told the path
    /// of each.
    ///
    /// # Errors
    /// When the card fails or a file can't be written; what was written before is whole.
    pub fn write(
        &self,
        card: &mut impl Card,
        look: &Look,
        mut wrote: impl FnMut(&Path) -> std::io::Result<()>,
    ) -> anyhow::Result<()> {
        std::fs::create_dir_all(&self.out)
            .with_context(|| format!("{} cannot be made", self.out.display()))?;
        let content = match self.all {
            true => Content::Memory,
            false => Content::Page,
        };
        let motion = self.motion();
        let (count, pictures) = self.pictures();
        let what = format_args!("dumping into {}", self.out.display());
        let mut step = Step::counting(what, count);
        for (done, picture) in (1..).zip(pictures) {
            if interrupted() {
                return Err(Interrupted.into());
            }
            card.show_as(look, &[])?;
            card.ask(match motion {
                Some(motion) => Command::ShowMoving(picture, motion),
                None => Command::Show(picture),
            })?;
            let dump = card.dump(content)?;
            let stem = self.out.join(stem(picture, motion, content));
            let text = stem.with_added_extension("dump");
            write_atomically(&text, |file| Ok(dump.write(std::io::BufWriter::new(file))?))?;
            let png = stem.with_added_extension("png");
            write_atomically(&png, |file| dump.picture().write_png(file))?;
            step.at(done);
            wrote(&text)?;
            wrote(&png)?;
        }
        Ok(())
    }
}

/// The name of a picture's files: numbers padded, so that a folder sorts by frame.
fn stem(picture: Picture, motion: Option<Motion>, content: Content) -> String {
    let mut name = match picture {
        Picture::Frame(frame) => format!("frame-{frame:06}"),
        Picture::Pose {
            yaw,
            pitch,
            roll,
            distance,
        } => format!("pose-{yaw:08x}-{pitch:08x}-{roll:08x}-{distance:08x}"),
    };
    if let Some(motion) = motion {
        name += &format!(" motion {motion}").replace(' ', "-");
    }
    match content {
        Content::Page => name,
        Content::Memory => name + "-all",
    }
}

#[cfg(test)]
mod tests {
    use link::dump::Header;
    use texmap::Mapper;

    use super::*;
    use crate::card::{self, Emulated};
    use crate::dump::Dump;
    use crate::look::Named;

    /// From the log of a show in reduced quality to a header, and from the header to the same bytes.
    #[test]
    fn a_frame_of_reduced_quality_is_drawn_again_from_its_header() {
        let mut memory = card::memory();
        let mut card = Emulated::new(&mut memory).unwrap();
        for line in ["scene cube", "mapper exact", "steer 5 quality", "show at 9"] {
            card.ask(Command::parse(line).unwrap()).unwrap();
        }
        let shown = card.dump(Content::Page).unwrap();
        assert_eq!(shown.header.picture, Some(Picture::Frame(9)));
        let motion = shown.header.motion.expect("it is in reduced quality");
        let Motion {
            yaw,
            pitch,
            roll,
            distance,
        } = motion;
        let folder = tempfile::tempdir().unwrap();
        let frames = |motion| Frames {
            which: Which {
                single: vec![9],
                ranges: Vec::new(),
                pose: Vec::new(),
            },
            motion,
            all: false,
            out: folder.path().into(),
        };
        let look = Look {
            scene: Some(Named("cube")),
            mapper: Mapper::parse("exact"),
            order: None,
        };
        let mut drawn = |motion| {
            let mut files = Vec::new();
            let wrote = |file: &Path| {
                files.push(file.to_path_buf());
                Ok(())
            };
            frames(motion).write(&mut card, &look, wrote).unwrap();
            Dump::read(&std::fs::read(&files[0]).unwrap()).unwrap()
        };
        let again = drawn(Some(vec![yaw, pitch, roll, distance]));
        let start = again.header.start;
        assert_eq!(
            again.header,
            Header {
                start,
                ..shown.header
            }
        );
        assert!(again.pixels == shown.pixels && again.palette == shown.palette);
        let whole = drawn(None);
        assert_eq!(whole.header.motion, None);
        assert!(whole.pixels != shown.pixels);
        // Two qualities of a frame do not overwrite each other.
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    }

    #[test]
    fn ranges_are_half_open_unless_they_say_otherwise() {
        assert_eq!(range("0..2"), Ok(0..=1));
        assert_eq!(range("7..=7"), Ok(7..=7));
        assert_eq!(range("4294967295..=4294967295"), Ok(u32::MAX..=u32::MAX));
        for (text, why) in [
            ("5", "written A..B"),
            ("..5", "no frame number"),
            ("5..", "no frame number"),
            ("0..x", "no frame number"),
            ("0..4294967296", "no frame number"),
            ("0..0", "no frame in it"),
            ("5..5", "no frame in it"),
            ("6..=5", "no frame in it"),
        ] {
            let error = range(text).unwrap_err();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
