//! The `record` command: writes successive frames as a GIF or as a folder of PNGs.
//!
//! The demo is held and shows each frame on command, so no frame is missing on a slow machine, and every
//! recording has the same bytes. For each frame QEMU's VGA sends its checksums. If they equal the emulated
//! VGA's, the bytes count as equal, and the emulated VGA's frame is written. Otherwise QEMU's VGA sends the
//! whole dump, which occupies the serial line ten times as long.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use gif::{DisposalMethod, Encoder, Frame, Repeat};
use protocol::{Command, Content, FrameName, TICKS_PER_SECOND};

use crate::backend::{Backend, EmulatedDemo};
use crate::indexed::IndexedImage;
use crate::options::FrameOptions;
use crate::write::range;
use system::Progress;
use system::{Interrupted, interrupted, write_atomically};
use vga::widen;

/// The options of `record`: the frames, and the file or folder.
#[derive(Args, Clone, Debug)]
pub struct RecordOptions {
    /// Frames A up to B, excluding B (A..=B includes B); the ball turns once in 720 frames
    #[arg(long, value_name = "A..B", value_parser = range, default_value = "0..720")]
    frames: RangeInclusive<u32>,
    /// Record every Nth frame only; a frame is 1/60 s of the demo
    #[arg(long, value_name = "N", default_value = "3",
        value_parser = RangedU64ValueParser::<u32>::new().range(1..=600))]
    every: u32,
    /// Where to write: a GIF if the name ends in .gif, otherwise a folder of PNGs
    #[arg(long, value_name = "FILE.gif|DIR")]
    out: PathBuf,
}

/// Shortest time that a GIF's frame is shown, in 1/100 s: viewers replace a shorter time by a tenth of a
/// second.
const SHORTEST: u64 = 2;

impl RecordOptions {
    /// Checks the options before anything is set up.
    ///
    /// # Errors
    /// A file of another type than GIF, and frames that follow too fast for a GIF.
    pub fn check(&self) -> anyhow::Result<()> {
        match self.is_gif()? {
            true if centiseconds(self.every.into()) < SHORTEST => bail!(
                "--every {}: too fast for a GIF, which shows each frame for at least {SHORTEST}/100 s; \
                 give --every 2 or more, or record a folder of PNGs",
                self.every
            ),
            _ => Ok(()),
        }
    }

    fn is_gif(&self) -> anyhow::Result<bool> {
        let extension = self
            .out
            .extension()
            .map(|extension| extension.to_ascii_lowercase());
        match extension {
            Some(extension) if extension == "gif" => Ok(true),
            Some(extension) if !self.out.is_dir() => bail!(
                "--out {}: cannot record a .{}; give a name that ends in .gif, or a folder",
                self.out.display(),
                extension.display()
            ),
            _ => Ok(false),
        }
    }

    /// Records the frames of `machine`, drawn with `options`; `emulated` draws the same frames for
    /// comparison. `wrote` receives each file's path.
    ///
    /// # Errors
    /// A VGA fails or a file cannot be written. The GIF, and each PNG, is either complete or missing.
    pub fn record(
        &self,
        qemu: &mut impl Backend,
        emulated: &mut EmulatedDemo<'_>,
        options: &FrameOptions,
        mut wrote: impl FnMut(&Path) -> std::io::Result<()>,
    ) -> anyhow::Result<()> {
        let numbers = self.frames.clone().step_by(self.every as usize);
        let what = format_args!("recording into {}", self.out.display());
        let mut step = Progress::counting(what, numbers.clone().count() as u64);
        qemu.show_with(options, &[])?;
        emulated.show_with(options, &[])?;
        let mut frames = (1..).zip(numbers).map(|(done, number)| {
            if interrupted() {
                return Err(Interrupted.into());
            }
            let frame = captured(qemu, emulated, FrameName::Number(number))?;
            step.at(done);
            Ok((number, frame))
        });
        if self.is_gif()? {
            write_atomically(&self.out, |file| self.write_gif(file, frames))?;
            return Ok(wrote(&self.out)?);
        }
        std::fs::create_dir_all(&self.out)
            .with_context(|| format!("{}: the folder cannot be created", self.out.display()))?;
        frames.try_for_each(|recorded| {
            let (number, frame) = recorded?;
            let png = self.out.join(format!("frame-{number:06}.png"));
            write_atomically(&png, |file| frame.write_png(file))?;
            Ok(wrote(&png)?)
        })
    }

    fn write_gif(
        &self,
        file: &mut File,
        frames: impl Iterator<Item = anyhow::Result<(u32, IndexedImage)>>,
    ) -> anyhow::Result<()> {
        let mut to = BufWriter::new(file);
        let mut frames = frames.peekable();
        let Some(Ok((_, first))) = frames.peek() else {
            // There is no frame, or the first frame failed: no GIF to write.
            return frames.next().map_or(Ok(()), |failed| failed.map(|_| ()));
        };
        let mut gif = encoder(&mut to, first)?;
        let mut before = None;
        for (i, recorded) in (0..).zip(frames) {
            let (_, frame) = recorded?;
            // Each delay is the difference of two rounded times, so rounding errors do not add up.
            let every = u64::from(self.every);
            let delay = centiseconds((i + 1) * every) - centiseconds(i * every);
            gif.write_frame(&Frame {
                delay: delay as u16,
                ..changed(before.as_ref(), &frame)?
            })?;
            before = Some(frame);
        }
        drop(gif);
        Ok(to.flush()?)
    }
}

/// Converts ticks to 1/100 s, rounded down.
fn centiseconds(ticks: u64) -> u64 {
    ticks * 100 / u64::from(TICKS_PER_SECOND)
}

/// Shows `frame` on both VGAs, and returns the frame that QEMU's VGA holds.
fn captured(
    qemu: &mut impl Backend,
    emulated: &mut EmulatedDemo<'_>,
    frame: FrameName,
) -> anyhow::Result<IndexedImage> {
    emulated.send(Command::Show(frame))?;
    qemu.send(Command::Show(frame))?;
    let dump = emulated.dump(Content::Page)?;
    let sums = qemu.send(Command::Checksums(Content::Page))?;
    Ok(match sums == dump.checksums() {
        true => dump.frame(),
        false => qemu.dump(Content::Page)?.frame(),
    })
}

/// Returns an encoder for a GIF that has the size and the palette of `frame` and repeats for ever.
fn encoder<W: Write>(to: W, frame: &IndexedImage) -> anyhow::Result<Encoder<W>> {
    let colours: Vec<u8> = frame
        .palette
        .iter()
        .flatten()
        .map(|&part| widen(part))
        .collect();
    let (width, height) = (frame.width.try_into()?, frame.height.try_into()?);
    let mut encoder = Encoder::new(to, width, height, &colours)?;
    encoder.set_repeat(Repeat::Infinite)?;
    Ok(encoder)
}

/// Returns the GIF frame for the rectangle in which `now` differs from `before`. Equal pixels in the
/// rectangle are transparent if a palette index is left for that.
fn changed(before: Option<&IndexedImage>, now: &IndexedImage) -> anyhow::Result<Frame<'static>> {
    let width = now.width;
    let differs = |i: usize| before.is_none_or(|before| before.pixels[i] != now.pixels[i]);
    let places = (0..now.pixels.len()).filter(|&i| differs(i));
    // A GIF frame has at least one pixel: for two equal frames, the bounds become those of the first pixel.
    let (mut left, mut right, mut top, mut bottom) = (width, 1, now.height, 1);
    for i in places {
        let (x, y) = (i % width, i / width);
        (left, right) = (left.min(x), right.max(x + 1));
        (top, bottom) = (top.min(y), bottom.max(y + 1));
    }
    let (left, top) = (left.min(right - 1), top.min(bottom - 1));
    let rows = (top..bottom).flat_map(|y| (left..right).map(move |x| y * width + x));
    let mut used = [false; 256];
    for i in rows.clone().filter(|&i| differs(i)) {
        used[usize::from(now.pixels[i])] = true;
    }
    let free = used.iter().position(|used| !used).map(|free| free as u8);
    let transparent = free.filter(|_| before.is_some());
    let pixels = rows.map(|i| match transparent {
        Some(same) if !differs(i) => same,
        _ => now.pixels[i],
    });
    Ok(Frame {
        left: left.try_into()?,
        top: top.try_into()?,
        width: (right - left).try_into()?,
        height: (bottom - top).try_into()?,
        dispose: DisposalMethod::Keep,
        transparent,
        buffer: pixels.collect(),
        ..Frame::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(every: u32, out: &str) -> RecordOptions {
        RecordOptions {
            frames: 0..=1,
            every,
            out: out.into(),
        }
    }

    #[test]
    fn an_impossible_recording_is_refused_before_anything_is_set_up() {
        for (every, out) in [(2, "a.gif"), (600, "A.GIF"), (1, "folder"), (1, "/tmp")] {
            options(every, out).check().unwrap();
        }
        for (every, out, why) in [
            (1, "a.gif", "--every 1: too fast for a GIF"),
            (3, "a.mp4", "--out a.mp4: cannot record a .mp4"),
        ] {
            let error = options(every, out).check().unwrap_err().to_string();
            assert!(error.starts_with(why), "{error}");
        }
    }

    #[test]
    fn a_gif_shows_every_frame_and_has_their_total_time() {
        let mut random = seeded::generator();
        let palette: Vec<_> = (0..=255u8).map(|i| [i / 4, i % 64, i / 8]).collect();
        let mut frame = IndexedImage {
            width: 20,
            height: 14,
            palette,
            pixels: vec![7; 280],
        };
        let mut frames = vec![frame.clone(), frame.clone()];
        for _ in 0..50 {
            for _ in 0..random.usize(..30) {
                frame.pixels[random.usize(..280)] = random.u8(..);
            }
            frames.push(frame.clone());
        }
        // A frame in which every pixel changes and all 256 indices occur leaves no index for transparency.
        frame.pixels = (0..280).map(|i| (i + i / 256) as u8).collect();
        frames.push(frame);
        let mut file = tempfile::tempfile().unwrap();
        let recorded = frames.iter().cloned().map(|frame| Ok((0, frame)));
        options(2, "a.gif").write_gif(&mut file, recorded).unwrap();

        std::io::Seek::rewind(&mut file).unwrap();
        let mut decoder = gif::DecodeOptions::new();
        decoder.set_color_output(gif::ColorOutput::Indexed);
        let mut decoder = decoder.read_info(file).unwrap();
        assert_eq!(decoder.repeat(), Repeat::Infinite);
        let mut shown = vec![0; 280];
        let mut time = 0;
        for expected in &frames {
            let frame = decoder.read_next_frame().unwrap().unwrap();
            for (i, &pixel) in frame.buffer.iter().enumerate() {
                let (x, y) = (i % usize::from(frame.width), i / usize::from(frame.width));
                let place = (y + usize::from(frame.top)) * 20 + x + usize::from(frame.left);
                if Some(pixel) != frame.transparent {
                    shown[place] = pixel;
                }
            }
            assert_eq!(shown, expected.pixels);
            assert!((3..=4).contains(&frame.delay), "{}", frame.delay);
            time += frame.delay;
        }
        assert!(decoder.read_next_frame().unwrap().is_none());
        assert_eq!(u64::from(time), centiseconds(2 * frames.len() as u64));
    }
}
