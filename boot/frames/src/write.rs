//! The `dump` and `emulate` commands: write frames as files, a text dump and a PNG of each.
//!
//! The demo is held and reset before each frame, so a dump depends only on its frame and not on the other
//! frames in the request. The bytes are the same in any order, and from either VGA.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{ArgAction, Args};
use protocol::{Command, Content, FrameName, Motion};

use crate::backend::Backend;
use crate::options::FrameOptions;
use system::Progress;
use system::{Interrupted, interrupted, write_atomically};

/// The options of `dump` and `emulate`: the frames, how much of video memory, and the folder.
#[derive(Args, Clone, Debug)]
pub struct DumpOptions {
    #[command(flatten)]
    which: FrameSelection,
    /// Draw in reduced quality, as for a solid that moves this much in one tick: the changes of yaw, pitch,
    /// roll and distance, in hex and modulo 2^32, as on the line `motion` of a dump
    #[arg(long, num_args = 4, value_names = ["YAW", "PITCH", "ROLL", "DISTANCE"],
        value_parser = hex, action = ArgAction::Set)]
    motion: Option<Vec<u32>>,
    /// Write all of video memory, 4 x 64 KiB, instead of only the page on the screen
    #[arg(long)]
    all: bool,
    /// The folder to write to
    #[arg(long, value_name = "DIR", default_value = "dumps")]
    out: PathBuf,
}

#[derive(Args, Clone, Debug)]
#[group(required = true, multiple = true)]
struct FrameSelection {
    /// The frame with this number; give the option again for more frames
    #[arg(long = "frame", value_name = "N")]
    single: Vec<u32>,
    /// Frames A up to B, excluding B (A..=B includes B)
    #[arg(long = "frames", value_name = "A..B", value_parser = range)]
    ranges: Vec<RangeInclusive<u32>>,
    /// The solid in this pose: yaw, pitch and roll as 32-bit fractions of a turn (40000000 is a quarter), and
    /// the distance in 16.16 fixed point (50000 is 5 units), all in hex
    #[arg(long, num_args = 4, value_names = ["YAW", "PITCH", "ROLL", "DISTANCE"],
        value_parser = hex)]
    pose: Vec<u32>,
}

/// Parses up to eight hex digits.
fn hex(text: &str) -> Result<u32, String> {
    // `from_str_radix` would accept a plus sign.
    if !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Err("not a hex number; its digits are 0 to 9 and a to f".into());
    }
    u32::from_str_radix(text, 16).map_err(|error| error.to_string())
}

/// Parses `A..B` or `A..=B`.
pub(crate) fn range(text: &str) -> Result<RangeInclusive<u32>, String> {
    let parts = text.split_once("..");
    let (first, last) = parts.ok_or("not a range; give two frame numbers as A..B or A..=B")?;
    let number = |text: &str| {
        let number = text.parse::<u32>();
        number.map_err(|error| format!("'{text}' is not a frame number: {error}"))
    };
    let first = number(first)?;
    let last = match last.strip_prefix('=') {
        Some(last) => Some(number(last)?),
        None => number(last)?.checked_sub(1),
    };
    last.map(|last| first..=last)
        .filter(|range| !range.is_empty())
        .ok_or_else(|| "the range has no frame; A..B excludes B, A..=B includes B".into())
}

impl DumpOptions {
    /// Returns the number of frames, and the frames.
    fn frames(&self) -> (u64, impl Iterator<Item = FrameName>) {
        let FrameSelection {
            single,
            ranges,
            pose,
        } = &self.which;
        let (poses, _) = pose.as_chunks::<4>();
        let numbers = single.iter().copied();
        let frames = numbers.chain(ranges.iter().cloned().flatten());
        let poses_of = |&[yaw, pitch, roll, distance]: &[u32; 4]| FrameName::Pose {
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
        let frames = frames
            .map(FrameName::Number)
            .chain(poses.iter().map(poses_of));
        (count, frames)
    }

    /// Returns the motion, if the user named one.
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

    /// Shows each frame on a VGA, drawn with `options`, and writes its dump and its PNG. `wrote` receives the
    /// path of each file.
    ///
    /// # Errors
    /// The VGA fails or a file cannot be written. The files written before the error are complete.
    pub fn write(
        &self,
        backend: &mut impl Backend,
        options: &FrameOptions,
        mut wrote: impl FnMut(&Path) -> std::io::Result<()>,
    ) -> anyhow::Result<()> {
        std::fs::create_dir_all(&self.out)
            .with_context(|| format!("{}: the folder cannot be created", self.out.display()))?;
        let content = match self.all {
            true => Content::Memory,
            false => Content::Page,
        };
        let motion = self.motion();
        let (count, frames) = self.frames();
        let what = format_args!("dumping into {}", self.out.display());
        let mut step = Progress::counting(what, count);
        for (done, frame) in (1..).zip(frames) {
            if interrupted() {
                return Err(Interrupted.into());
            }
            backend.show_with(options, &[])?;
            backend.send(match motion {
                Some(motion) => Command::ShowMoving(frame, motion),
                None => Command::Show(frame),
            })?;
            let dump = backend.dump(content)?;
            let stem = self.out.join(stem(frame, motion, content));
            let text = stem.with_added_extension("dump");
            write_atomically(&text, |file| Ok(dump.write(std::io::BufWriter::new(file))?))?;
            let png = stem.with_added_extension("png");
            write_atomically(&png, |file| dump.frame().write_png(file))?;
            step.at(done);
            wrote(&text)?;
            wrote(&png)?;
        }
        Ok(())
    }
}

/// Returns the name of a frame's files, without an extension. Numbers are padded, so that a folder sorts by
/// frame.
fn stem(frame: FrameName, motion: Option<Motion>, content: Content) -> String {
    let mut name = match frame {
        FrameName::Number(frame) => format!("frame-{frame:06}"),
        FrameName::Pose {
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
    use protocol::dump::Header;
    use texmap::Mapper;

    use super::*;
    use crate::backend::{self, EmulatedDemo};
    use crate::dump::Dump;

    /// Takes the motion of a frame in reduced quality from its header, and draws the same bytes again.
    #[test]
    fn a_frame_of_reduced_quality_is_drawn_again_from_its_header() {
        let mut memory = backend::memory();
        let mut demo = EmulatedDemo::new(&mut memory).unwrap();
        for line in ["scene cube", "mapper exact", "steer 5 quality", "show at 9"] {
            demo.send(Command::parse(line).unwrap()).unwrap();
        }
        let shown = demo.dump(Content::Page).unwrap();
        assert_eq!(shown.header.frame, Some(FrameName::Number(9)));
        let motion = shown
            .header
            .motion
            .expect("the frame is in reduced quality");
        let Motion {
            yaw,
            pitch,
            roll,
            distance,
        } = motion;
        let folder = tempfile::tempdir().unwrap();
        let frames = |motion| DumpOptions {
            which: FrameSelection {
                single: vec![9],
                ranges: Vec::new(),
                pose: Vec::new(),
            },
            motion,
            all: false,
            out: folder.path().into(),
        };
        let options = FrameOptions {
            scene: Some("cube"),
            mapper: Mapper::parse("exact"),
            order: None,
        };
        let mut draw = |motion| {
            let mut files = Vec::new();
            let wrote = |file: &Path| {
                files.push(file.to_path_buf());
                Ok(())
            };
            frames(motion).write(&mut demo, &options, wrote).unwrap();
            Dump::read(&std::fs::read(&files[0]).unwrap()).unwrap()
        };
        let again = draw(Some(vec![yaw, pitch, roll, distance]));
        let start = again.header.start;
        assert_eq!(
            again.header,
            Header {
                start,
                ..shown.header
            }
        );
        assert!(again.pixels == shown.pixels && again.palette == shown.palette);
        let full = draw(None);
        assert_eq!(full.header.motion, None);
        assert!(full.pixels != shown.pixels);
        // The same frame in both qualities gives different files: neither overwrites the other.
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    }

    #[test]
    fn a_range_excludes_its_end_unless_it_is_written_with_an_equals_sign() {
        assert_eq!(range("0..2"), Ok(0..=1));
        assert_eq!(range("7..=7"), Ok(7..=7));
        assert_eq!(range("4294967295..=4294967295"), Ok(u32::MAX..=u32::MAX));
        for (text, why) in [
            ("5", "as A..B"),
            ("..5", "not a frame number"),
            ("5..", "not a frame number"),
            ("0..x", "not a frame number"),
            ("0..4294967296", "not a frame number"),
            ("0..0", "the range has no frame"),
            ("5..5", "the range has no frame"),
            ("6..=5", "the range has no frame"),
        ] {
            let error = range(text).unwrap_err();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
