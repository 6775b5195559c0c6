//! The `replay` command: plays dumps or PNGs in the terminal, or lays them out on a contact sheet.

use std::fmt::Write as _;
use std::io::{IsTerminal, Write, stdout};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use console::Term;
use scene::font;

use crate::comparison::list;
use crate::difference::Capture;
use crate::indexed::IndexedImage;
use crate::rgb::RgbImage;
use system::Progress;
use system::{Interrupted, interrupted, write_atomically};
use vga::widen;

/// The options of `replay`: the frames, and how to show them.
#[derive(Args, Clone, Debug)]
pub struct ReplayOptions {
    /// Dumps, indexed PNGs, or folders of them; if a folder has a dump and a PNG of the same name, the dump
    /// is shown
    #[arg(required = true)]
    paths: Vec<PathBuf>,
    /// Write all frames to one contact sheet instead of playing them in the terminal
    #[arg(long, value_name = "FILE.png")]
    sheet: Option<PathBuf>,
    /// Frames per second in the terminal
    #[arg(long, value_name = "N", default_value = "20",
        value_parser = RangedU64ValueParser::<u32>::new().range(1..=60))]
    rate: u32,
}

/// Largest width of a sheet in pixels, without the gap at its left edge. Frames are shrunk to fit.
const SHEET_WIDTH: usize = 4096;
/// Pixels between the frames of a sheet.
const GAP: usize = 4;
/// Colours of a sheet's background, and of the names on it.
const GROUND: [u8; 3] = [24; 3];
const NAMES: [u8; 3] = [208; 3];
/// Distances in the font's pixels: from letter to letter, and the height that a frame's name occupies below
/// it.
const LETTER: usize = font::WIDTH + 1;
const LINE: usize = font::HEIGHT + 3;
/// Width of a cell in pixels for each step of the names' scale. Below a frame of 320 pixels the names have
/// twice the font's size, and 26 letters fit.
const PER_SCALE: usize = 160;

impl ReplayOptions {
    /// Plays the frames, or writes the sheet and passes its path to `wrote`.
    ///
    /// # Errors
    /// A file that is neither a dump nor a PNG, with its name; no frames; standard output that is not a
    /// terminal, or cannot be written.
    pub fn run(&self, wrote: impl FnOnce(&Path) -> std::io::Result<()>) -> anyhow::Result<()> {
        if self.sheet.is_none() && !stdout().is_terminal() {
            bail!(
                "standard output is not a terminal; give --sheet FILE.png to write a contact sheet"
            );
        }
        let files = self.files()?;
        let mut frames = Vec::new();
        let mut step = Progress::counting("reading", files.len() as u64);
        for (done, file) in (1..).zip(&files) {
            if interrupted() {
                return Err(Interrupted.into());
            }
            frames.push(Capture::read(file)?.frame().into_owned());
            step.at(done);
        }
        drop(step);
        match &self.sheet {
            Some(sheet) => {
                let laid_out = lay_out(&frames, &names(&files));
                write_atomically(sheet, |file| {
                    laid_out.write_png(std::io::BufWriter::new(file))
                })?;
                Ok(wrote(sheet)?)
            }
            None => self.play(&frames),
        }
    }

    /// Returns all files: those named directly, and those in each folder, sorted by name.
    fn files(&self) -> anyhow::Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        for path in &self.paths {
            if !path.is_dir() {
                files.push(path.clone());
                continue;
            }
            let names =
                list(path).with_context(|| format!("{}: cannot be read", path.display()))?;
            let frames = names.iter().map(|name| path.join(name));
            // A dump and a PNG of the same name are the same frame.
            files.extend(frames.filter(|file| {
                let dump = file.with_extension("dump");
                file == &dump || !names.contains(dump.file_name().unwrap_or_default())
            }));
        }
        if files.is_empty() {
            bail!("no .dump or .png file to show; give files, or folders that contain some");
        }
        Ok(files)
    }

    fn play(&self, frames: &[IndexedImage]) -> anyhow::Result<()> {
        let screen = AlternateScreen::enter()?;
        let time = Duration::from_secs(1) / self.rate;
        let mut due = Instant::now();
        loop {
            for (i, frame) in (1..).zip(frames) {
                let (rows, columns) = Term::stdout().size();
                let mut text = in_blocks(frame, columns.into(), rows.saturating_sub(1).into());
                let count = frames.len();
                let _ = write!(
                    text,
                    "{RESET}{ERASE}frame {i} of {count}; press Ctrl-C to stop"
                );
                screen.write(&text)?;
                due += time;
                while Instant::now() < due {
                    if interrupted() {
                        return Ok(());
                    }
                    let left = due.saturating_duration_since(Instant::now());
                    thread::sleep(left.min(Duration::from_millis(20)));
                }
            }
        }
    }
}

const HOME: &str = "\x1b[H";
const RESET: &str = "\x1b[0m";
const ERASE: &str = "\x1b[J";

/// The terminal's alternate screen. Dropping it restores the terminal's contents.
struct AlternateScreen;

impl AlternateScreen {
    fn enter() -> anyhow::Result<Self> {
        let this = Self;
        this.write("\x1b[?1049h\x1b[?25l\x1b[2J")?;
        Ok(this)
    }

    fn write(&self, text: &str) -> anyhow::Result<()> {
        let mut out = stdout().lock();
        let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        written.context("cannot write to the terminal")
    }
}

impl Drop for AlternateScreen {
    fn drop(&mut self) {
        // If the terminal is gone, there is nothing to restore.
        let _ = self.write("\x1b[?25h\x1b[?1049l");
    }
}

/// Returns a pixel's colour, 8 bits per component.
fn colour(frame: &IndexedImage, x: usize, y: usize) -> [u8; 3] {
    frame.palette[usize::from(frame.pixels[y * frame.width + x])].map(widen)
}

/// Shrinks a frame to `width` x `height`. Each pixel is the mean of the pixels that it replaces.
fn shrunk(frame: &IndexedImage, width: usize, height: usize) -> RgbImage {
    let mut pixels = Vec::with_capacity(width * height);
    for j in 0..height {
        for i in 0..width {
            let range = |at: usize, of: usize, all: usize| {
                let first = at * all / of;
                first..((at + 1) * all / of).max(first + 1)
            };
            let (xs, ys) = (range(i, width, frame.width), range(j, height, frame.height));
            let count = (xs.len() * ys.len()) as u32;
            let mut sum = [0u32; 3];
            for y in ys {
                for x in xs.clone() {
                    for (sum, part) in sum.iter_mut().zip(colour(frame, x, y)) {
                        *sum += u32::from(part);
                    }
                }
            }
            pixels.push(sum.map(|sum| ((sum + count / 2) / count) as u8));
        }
    }
    RgbImage {
        width,
        height,
        pixels,
    }
}

/// Returns a frame as half-block characters, two pixels each, as large as fits.
fn in_blocks(frame: &IndexedImage, columns: usize, rows: usize) -> String {
    let (columns, rows) = (columns.max(1), rows.max(1));
    // A terminal's character is about twice as high as wide, so its two halves are about square.
    let width = columns
        .min(frame.width)
        .min(2 * rows * frame.width / frame.height)
        .max(1);
    let height = (width * frame.height / frame.width).max(2) & !1;
    let small = shrunk(frame, width, height);
    let mut text = String::from(HOME);
    for pair in small.pixels.chunks_exact(2 * width) {
        let (upper, lower) = pair.split_at(width);
        for ([r, g, b], [s, h, c]) in upper.iter().zip(lower) {
            let _ = write!(text, "\x1b[38;2;{r};{g};{b};48;2;{s};{h};{c}m\u{2580}");
        }
        let _ = write!(text, "{RESET}\x1b[K\r\n");
    }
    text
}

/// Returns the names to write below the frames: the files' names, with their folders' names if the files come
/// from several folders.
fn names(files: &[PathBuf]) -> Vec<String> {
    let parent = |file: &PathBuf| file.parent().map(Path::to_owned);
    let several = files.iter().any(|file| parent(file) != parent(&files[0]));
    let name_of = |file: &PathBuf| {
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        let folder = file.parent().and_then(Path::file_name);
        match folder.filter(|_| several) {
            Some(folder) => format!("{}/{name}", folder.to_string_lossy()),
            None => name.into_owned(),
        }
    };
    files.iter().map(name_of).collect()
}

/// Shortens a name to a number of letters. The middle is cut out, because names in a folder often begin alike
/// and differ at the end.
fn cut(name: &str, letters: usize) -> String {
    const CUT: &str = "..";
    let all: Vec<char> = name.chars().collect();
    if all.len() <= letters {
        return name.into();
    }
    let Some(left) = letters.checked_sub(CUT.len()) else {
        return all[all.len() - letters..].iter().collect();
    };
    let (begin, end) = (&all[..left / 2], &all[all.len() - left.div_ceil(2)..]);
    begin
        .iter()
        .copied()
        .chain(CUT.chars())
        .chain(end.iter().copied())
        .collect()
}

/// Writes text on a sheet. The text must lie completely on the sheet.
fn write(sheet: &mut RgbImage, text: &str, left: usize, top: usize, scale: usize) {
    for (i, letter) in text.chars().enumerate() {
        let rows = font::glyph(letter);
        for (y, x) in (0..font::HEIGHT * scale)
            .flat_map(|y| (0..font::WIDTH * scale).map(move |x| (y, x)))
            .filter(|&(y, x)| rows[y / scale] >> (x / scale) & 1 == 1)
        {
            sheet.pixels[(top + y) * sheet.width + left + i * LETTER * scale + x] = NAMES;
        }
    }
}

/// Returns a sheet of all frames, row by row, with their names below.
fn lay_out(frames: &[IndexedImage], names: &[String]) -> RgbImage {
    let across = (1..).find(|n| n * n >= frames.len()).unwrap_or(1);
    let most = |of: fn(&IndexedImage) -> usize| frames.iter().map(of).max().unwrap_or(1);
    let (wide, high) = (most(|p| p.width), most(|p| p.height));
    // Full size, if it fits.
    let cell_width = wide.min((SHEET_WIDTH / across).saturating_sub(GAP)).max(1);
    let cell_height = (high * cell_width / wide).max(1);
    let down = frames.len().div_ceil(across);
    let scale = (cell_width / PER_SCALE).max(1);
    let pitch = cell_height + LINE * scale + GAP;
    let mut sheet = RgbImage {
        width: GAP + across * (cell_width + GAP),
        height: GAP + down * pitch,
        pixels: Vec::new(),
    };
    sheet.pixels = vec![GROUND; sheet.width * sheet.height];
    for (i, (frame, name)) in frames.iter().zip(names).enumerate() {
        let width = (frame.width * cell_width / wide).max(1);
        let height = (frame.height * cell_width / wide).max(1);
        let small = shrunk(frame, width, height);
        let left = GAP + i % across * (cell_width + GAP);
        let top = GAP + i / across * pitch;
        for (y, row) in (top..).zip(small.pixels.chunks_exact(width)) {
            sheet.pixels[y * sheet.width + left..][..width].copy_from_slice(row);
        }
        // The last letter needs no gap after it.
        let name = cut(name, (cell_width + scale) / (LETTER * scale));
        write(&mut sheet, &name, left, top + height + 2 * scale, scale);
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a frame whose left half is black and whose right half is white.
    fn halves(width: usize, height: usize) -> IndexedImage {
        IndexedImage {
            width,
            height,
            palette: vec![[0; 3], [63; 3]],
            pixels: (0..width * height)
                .map(|i| u8::from(i % width >= width / 2))
                .collect(),
        }
    }

    #[test]
    fn each_pixel_of_a_shrunk_frame_is_the_mean_of_the_pixels_it_replaces() {
        let frame = halves(320, 240);
        assert_eq!(shrunk(&frame, 320, 240).pixels[160], [255; 3]);
        let third = shrunk(&frame, 3, 2).pixels;
        assert_eq!([third[0][0], third[2][0]], [0, 255]);
        assert!((120..=135).contains(&third[1][0]), "{third:?}");
    }

    #[test]
    fn a_sheet_has_every_frame_with_its_name_below() {
        let frames = vec![halves(320, 240); 5];
        let names: Vec<_> = (0..5).map(|i| format!("frame-{i:06}")).collect();
        let sheet = lay_out(&frames, &names);
        assert_eq!((sheet.width, sheet.height), (3 * 324 + 4, 2 * 264 + 4));
        let white = sheet.pixels.iter().filter(|&&pixel| pixel == [255; 3]);
        assert_eq!(white.count(), 5 * 160 * 240);
        // The unused sixth place has no letters below it; every other place has some.
        let letters_below = |i: usize| {
            let rows = sheet.pixels.chunks_exact(sheet.width);
            let below = rows.skip(4 + i / 3 * 264 + 240).take(20);
            let of_frame = below.flat_map(|row| &row[4 + i % 3 * 324..][..320]);
            of_frame.filter(|&&pixel| pixel == NAMES).count()
        };
        let counts: Vec<_> = (0..6).map(letters_below).collect();
        assert!(counts[..5].iter().all(|&count| count > 400), "{counts:?}");
        assert_eq!(counts[5], 0);
        let names = vec!["a very long name".repeat(20); 400];
        let many = lay_out(&vec![halves(320, 240); 400], &names);
        assert!(many.width <= SHEET_WIDTH + GAP, "{}", many.width);
        // A frame that is smaller than a letter.
        lay_out(&[halves(4, 3)], &["name".into()]);
    }

    #[test]
    fn a_long_name_loses_its_middle_and_names_from_two_folders_include_the_folder() {
        for (name, letters, fits) in [
            ("frame-000123", 12, "frame-000123"),
            ("frame-000123", 11, "fram..00123"),
            ("frame-000123", 10, "fram..0123"),
            ("\u{e4}\u{e4}\u{e4}\u{e4}", 3, "..\u{e4}"),
            ("frame", 2, ".."),
            ("frame", 1, "e"),
            ("frame", 0, ""),
        ] {
            assert_eq!(cut(name, letters), fits);
        }
        let files = |of: &[&str]| of.iter().map(PathBuf::from).collect::<Vec<_>>();
        assert_eq!(names(&files(&["x/a.dump", "x/b.png"])), ["a", "b"]);
        assert_eq!(names(&files(&["x/a.dump", "y/a.dump"])), ["x/a", "y/a"]);
        assert_eq!(names(&files(&["a.dump", "y/a.dump"])), ["a", "y/a"]);
    }

    #[test]
    fn a_frame_in_block_characters_fits_the_terminal() {
        for (columns, rows) in [(80, 24), (400, 100), (10, 200), (1, 1), (0, 0)] {
            let text = in_blocks(&halves(320, 240), columns, rows);
            let lines: Vec<_> = text.lines().collect();
            assert!(lines.len() <= rows.max(1), "{columns} x {rows}");
            let wide = lines.iter().map(|line| line.matches('\u{2580}').count());
            assert!(wide.max() <= Some(columns.max(1)), "{columns} x {rows}");
        }
    }
}
