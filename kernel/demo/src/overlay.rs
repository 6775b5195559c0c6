//! The overlay of a running demo: the list of keys, figures of the frames, and a hint.
//!
//! The overlay is drawn after the frame and counted separately. Each page records where it was drawn on, so
//! no other code has to remember where text was written.
//!
//! The figures are those of the half second before; figures that changed with every frame would be illegible.
//! A held demo has no overlay.

use core::fmt;

use modex::{Destination, HEIGHT, Palette, WIDTH};
use protocol::{Action, TICKS_PER_SECOND};
use render::motion::TextureMotion;
use scene::font;
use texmap::{Mapper, Order};

use crate::KEYS;
use crate::split::{self, SplitView};
use crate::text::{ADVANCE, Ink, Inks, LINE, TextLayer};

/// Ticks between two updates of the figures.
const UPDATE_TICKS: u32 = 30;
/// Ticks that a hint stays on the screen.
const HINT_TICKS: u32 = 300;
/// Distance of the text from the screen's borders, in pixels.
const MARGIN: usize = 4;

/// The figures of a frame that the overlay shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameStatistics {
    pub scene: &'static str,
    pub mapper: Mapper,
    pub order: Order,
    pub paused: bool,
    /// Faces of the last frame in reduced quality; `None` if reduced quality is off.
    pub reduced_faces: Option<u32>,
    /// Pixels of the last frame.
    pub pixels: u32,
    /// Writes to Map Mask for the last frame, without its overlay.
    pub map_masks: u64,
    /// The largest error of the last frame if it was a split view, in 2^-16 texel.
    pub largest_error: u32,
}

/// A measuring interval: the frames since a tick, and the microseconds that drawing them lasted.
#[derive(Clone, Copy, Debug, Default)]
struct Interval {
    since: u32,
    frames: u32,
    micros: u64,
}

/// How fast frames were drawn in the last complete interval.
#[derive(Clone, Copy, Debug)]
struct Rate {
    /// Tenths of a frame a second.
    tenths: u32,
    /// Microseconds a frame.
    micros: u32,
}

/// The overlay that is drawn over the frames, and its timing.
#[derive(Debug)]
pub(crate) struct Overlay<'a> {
    layer: &'a mut TextLayer,
    inks: Inks,
    help: bool,
    info: bool,
    split: bool,
    split_view: SplitView,
    hint: Option<u32>,
    /// The overlay text changed and must be redrawn.
    stale: bool,
    interval: Interval,
    rate: Option<Rate>,
}

impl<'a> Overlay<'a> {
    /// Returns an empty overlay that uses the colours of `palette`.
    pub fn new(layer: &'a mut TextLayer, palette: &Palette) -> Self {
        Self {
            layer,
            inks: Inks::new(palette),
            help: false,
            info: false,
            split: false,
            split_view: SplitView::new(palette),
            hint: None,
            stale: true,
            interval: Interval::default(),
            rate: None,
        }
    }

    /// Switches the overlay off.
    pub fn close(&mut self) {
        (self.help, self.info, self.split, self.hint) = (false, false, false, None);
        self.stale = true;
    }

    /// Marks the text as outdated, because the demo's state has changed.
    pub fn invalidate(&mut self) {
        self.stale = true;
    }

    /// Changes the palette.
    pub fn set_palette(&mut self, palette: &Palette) {
        self.inks = Inks::new(palette);
        self.split_view = SplitView::new(palette);
    }

    /// Returns how to draw the split view, if it is on.
    pub fn split(&self) -> Option<&SplitView> {
        Some(&self.split_view).filter(|_| self.split)
    }

    /// Handles an action of the overlay; ignores all other actions.
    pub fn act(&mut self, tick: u32, action: Action) {
        match action {
            Action::Help => self.help = !self.help,
            Action::Info => self.info = !self.info,
            Action::Split => self.split = !self.split,
            Action::Hint => self.hint = Some(tick),
            _ => return,
        }
        self.stale = true;
    }

    /// Adds the duration of drawing a frame, in microseconds.
    pub fn add_frame_time(&mut self, micros: u32) {
        self.interval.micros += u64::from(micros);
    }

    /// Prepares the overlay for the frame of `tick`. Returns whether the overlay shows anything. `motion` is
    /// called only if needed, and measures how the visible texture moves in a tick.
    pub fn prepare(
        &mut self,
        tick: u32,
        figures: &FrameStatistics,
        motion: impl FnOnce() -> Option<TextureMotion>,
    ) -> bool {
        let ticks = tick.wrapping_sub(self.interval.since);
        if ticks >= UPDATE_TICKS {
            let Interval { frames, micros, .. } = self.interval;
            // Show no rate after a long gap: the demo may just have begun.
            if frames > 0 && ticks < 100 * UPDATE_TICKS {
                let tenths = frames * 10 * TICKS_PER_SECOND / ticks;
                self.rate = Some(Rate {
                    tenths,
                    micros: (micros / u64::from(frames)) as u32,
                });
            }
            self.interval = Interval {
                since: tick,
                ..Interval::default()
            };
            self.stale |= self.info || self.split;
        }
        self.interval.frames += 1;
        if self
            .hint
            .is_some_and(|since| tick.wrapping_sub(since) >= HINT_TICKS)
        {
            self.hint = None;
            self.stale = true;
        }
        if core::mem::take(&mut self.stale) {
            self.layer.clear();
            if self.help {
                self.write_help();
            } else {
                if self.split {
                    self.write_labels(figures);
                }
                if self.info {
                    self.write_info(figures, motion());
                }
                if self.hint.is_some() && !self.split {
                    let text = "H: help";
                    let x = (WIDTH - text.len() * ADVANCE) / 2;
                    let y = HEIGHT - MARGIN - font::HEIGHT;
                    self.layer.write(Ink::Plain, x, y, format_args!("{text}"));
                }
            }
        }
        self.help || self.info || self.split || self.hint.is_some()
    }

    /// Draws the prepared overlay.
    pub fn draw(&self, destination: &mut impl Destination) {
        if let Some(split) = self.split() {
            split.draw_bars_and_legend(destination);
        }
        self.layer.draw(&self.inks, destination);
    }

    fn write_help(&mut self) {
        let description = MARGIN + 6 * ADVANCE;
        for (i, key) in KEYS.iter().enumerate() {
            let y = MARGIN + i * LINE;
            self.layer
                .write(Ink::Bright, MARGIN, y, format_args!("{}", key.name));
            self.layer
                .write(Ink::Plain, description, y, format_args!("{}", key.about));
        }
    }

    fn write_labels(&mut self, figures: &FrameStatistics) {
        let mut write = |ink, x, y, text: fmt::Arguments<'_>| {
            self.layer.write(ink, x, y, text);
        };
        let y = HEIGHT - MARGIN - font::HEIGHT;
        let [left, middle, right] = split::PANELS.map(|x| x + MARGIN);
        if figures.reduced_faces.is_some_and(|faces| faces > 0) {
            write(Ink::Plain, left, y - LINE, format_args!("reduced quality"));
        }
        write(Ink::Bright, left, y, format_args!("{}", figures.mapper));
        write(Ink::Bright, middle, y, format_args!("exact"));
        let largest = Hundredths(figures.largest_error);
        write(Ink::Bright, right, y, format_args!("max {largest} texel"));
        let y = split::LEGEND_Y + split::LEGEND_LINES + 3;
        for (step, label) in [(1, "1/256"), (split::TEXEL, "1"), (split::STEPS - 1, "64")] {
            let begins = split::LEGEND_X + step * split::LEGEND_STEP;
            // A two-letter label ends where its step ends.
            let x = begins - ADVANCE * usize::from(label.len() == 2);
            write(Ink::Plain, x, y, format_args!("{label}"));
        }
    }

    fn write_info(&mut self, figures: &FrameStatistics, motion: Option<TextureMotion>) {
        let FrameStatistics {
            scene,
            mapper,
            order,
            paused,
            pixels,
            map_masks,
            reduced_faces,
            ..
        } = figures;
        let (rate, layer) = (self.rate, &mut *self.layer);
        let mut y = MARGIN;
        let mut line = |ink, text: fmt::Arguments<'_>| {
            layer.write(ink, MARGIN, y, text);
            y += LINE;
        };
        line(Ink::Bright, format_args!("{scene}"));
        line(Ink::Bright, format_args!("{mapper}  {order}"));
        if let Some(Rate { tenths, micros }) = rate {
            line(
                Ink::Plain,
                format_args!(
                    "{}.{} frames/s  {}.{:02} ms",
                    tenths / 10,
                    tenths % 10,
                    micros / 1000,
                    micros / 10 % 100
                ),
            );
        }
        line(Ink::Plain, format_args!("{pixels} pixels"));
        line(Ink::Plain, format_args!("{map_masks} Map Mask writes"));
        if let Mapper::Within(tolerance) = mapper {
            line(Ink::Plain, format_args!("error up to {tolerance} texel"));
        }
        if let Some((pixels, sweet_spot)) = moved(motion, rate) {
            line(
                Ink::Plain,
                format_args!("{} pixels a frame", Hundredths(pixels)),
            );
            if let Some((slowest, fastest)) = sweet_spot {
                let (ink, verdict) = match pixels {
                    // Frames are so far apart that any motion too fast to crawl is already more than half a
                    // period.
                    _ if slowest > fastest => (Ink::Plain, ": too few frames"),
                    0 => (Ink::Plain, ""),
                    _ if pixels < slowest => (Ink::Plain, ": too slow"),
                    _ if pixels > fastest => (Ink::Plain, ": too fast"),
                    _ => (Ink::Bright, ""),
                };
                let (slowest, fastest) = (Hundredths(slowest), Hundredths(fastest));
                line(
                    ink,
                    format_args!("sweet spot {slowest} to {fastest}{verdict}"),
                );
            }
        }
        match reduced_faces {
            Some(faces) if mapper.reduced().is_some() => {
                line(
                    Ink::Plain,
                    format_args!("faces in reduced quality: {faces}"),
                );
            }
            // Without this line the key would seem to have no effect.
            Some(_) => line(Ink::Plain, format_args!("{mapper} has no reduced quality")),
            None => {}
        }
        if *paused {
            line(Ink::Bright, format_args!("paused"));
        }
    }
}

/// Returns how far the visible texture moves from one frame to the next, and the range in which the eye sees
/// that as motion (the sweet spot), in 2^-16 pixel. `None` if the frame rate is unknown.
fn moved(motion: Option<TextureMotion>, rate: Option<Rate>) -> Option<(u32, Option<(u32, u32)>)> {
    let (motion, Rate { tenths, .. }) = motion.zip(rate)?;
    // Ticks a frame, 16.16.
    let ticks = ((10 * TICKS_PER_SECOND) << 16).checked_div(tenths)?;
    let pixels = (u64::from(motion.pixels) * u64::from(ticks)) >> 16;
    let pixels = u32::try_from(pixels).unwrap_or(u32::MAX);
    Some((pixels, motion.sweet_spot(ticks, TICKS_PER_SECOND)))
}

/// A number with 16 fraction bits, displayed with two decimals, rounded down.
struct Hundredths(u32);

impl fmt::Display for Hundredths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hundredths = (u64::from(self.0) * 100) >> 16;
        write!(f, "{}.{:02}", hundredths / 100, hundredths % 100)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::text::tests::read;
    use scene::catalogue::CATALOGUE;
    use std::boxed::Box;
    use std::string::String;
    use std::vec::Vec;

    #[test]
    fn every_character_of_the_overlay_has_a_glyph() {
        let mut written = String::new();
        for key in KEYS {
            written += key.name;
            written += key.about;
        }
        written.extend(CATALOGUE.iter().map(|entry| entry.name));
        written.extend(Mapper::ALL.iter().map(|(name, ..)| *name));
        written.extend(Order::ALL.iter().map(|(name, ..)| *name));
        for character in written.chars().filter(|character| *character != ' ') {
            assert_ne!(font::glyph(character), [0; font::HEIGHT], "{character}");
        }
        let longest = KEYS.iter().map(|key| key.about.len()).max().unwrap();
        assert!(MARGIN + (6 + longest) * ADVANCE < WIDTH, "{longest}");
        assert!(MARGIN + KEYS.len() * LINE < HEIGHT);
    }

    /// Returns the lines of text from the top left down.
    fn lines(overlay: &Overlay<'_>) -> Vec<(Ink, String)> {
        let lines = (MARGIN..HEIGHT - LINE).step_by(LINE);
        lines
            .map_while(|y| read(overlay.layer, MARGIN, y))
            .collect()
    }

    const FIGURES: FrameStatistics = FrameStatistics {
        scene: "ball",
        mapper: Mapper::Exact,
        order: Order::Planes,
        paused: false,
        reduced_faces: None,
        pixels: 12_345,
        largest_error: 0,
        map_masks: 678,
    };

    /// A motion of 1.5 pixels a tick, a quarter of half a period.
    const MOTION: TextureMotion = TextureMotion {
        pixels: 3 << 15,
        part: 1 << 14,
    };

    fn overlay(layer: &mut TextLayer) -> Overlay<'_> {
        Overlay::new(layer, CATALOGUE[0].scene(&[]).palette)
    }

    /// Returns the lines of `info` after a second of frames, `every` ticks apart.
    fn info(
        every: u32,
        figures: &FrameStatistics,
        motion: Option<TextureMotion>,
    ) -> Vec<(Ink, String)> {
        let mut layer = Box::new(TextLayer::new());
        let mut overlay = overlay(&mut layer);
        overlay.act(0, Action::Info);
        for tick in (0..=60).step_by(every as usize) {
            assert!(overlay.prepare(tick, figures, || motion));
            overlay.add_frame_time(2_567);
        }
        lines(&overlay)
    }

    fn plain(text: &str) -> (Ink, String) {
        (Ink::Plain, text.to_uppercase())
    }

    fn bright(text: &str) -> (Ink, String) {
        (Ink::Bright, text.to_uppercase())
    }

    #[test]
    fn info_shows_rate_work_and_motion() {
        let figures = [
            bright("ball"),
            bright("exact  planes"),
            plain("60.0 frames/s  2.56 ms"),
            plain("12345 pixels"),
            plain("678 Map Mask writes"),
        ];
        assert_eq!(info(1, &FIGURES, None), figures);
        let moves = [
            plain("1.50 pixels a frame"),
            bright("sweet spot 0.19 to 6.00"),
        ];
        assert_eq!(info(1, &FIGURES, Some(MOTION))[5..], moves);
        // Four ticks a frame: four times the motion, and the lower end is four times as large.
        let slow = info(4, &FIGURES, Some(MOTION));
        assert_eq!(slow[2], plain("15.0 frames/s  2.56 ms"));
        let moves = [
            plain("6.00 pixels a frame"),
            bright("sweet spot 0.79 to 6.00"),
        ];
        assert_eq!(slow[5..], moves);
    }

    #[test]
    fn info_says_whether_the_motion_is_in_the_sweet_spot() {
        let verdict = |every, pixels, part| {
            let motion = Some(TextureMotion { pixels, part });
            info(every, &FIGURES, motion)[5..].to_vec()
        };
        assert_eq!(
            verdict(1, 6_560, 1 << 14)[1],
            plain("sweet spot 0.19 to 0.40: too slow")
        );
        assert_eq!(
            verdict(1, 3 << 15, 1 << 17)[1],
            plain("sweet spot 0.19 to 0.75: too fast")
        );
        assert_eq!(
            verdict(10, 3 << 15, 3 << 16)[1],
            plain("sweet spot 2.00 to 0.50: too few frames")
        );
        // Both ends of the sweet spot belong to it, also where they are equal.
        assert_eq!(
            verdict(1, 13_107, 1 << 16)[1],
            bright("sweet spot 0.19 to 0.19")
        );
        // Nothing moves in the texture.
        assert_eq!(verdict(1, 3 << 15, 0), [plain("1.50 pixels a frame")]);
    }

    #[test]
    fn info_shows_reduced_quality_tolerance_and_pause() {
        let last = |figures: FrameStatistics| info(1, &figures, None)[5..].to_vec();
        let reduced = |mapper, faces| FrameStatistics {
            mapper,
            reduced_faces: Some(faces),
            ..FIGURES
        };
        assert_eq!(
            last(reduced(Mapper::Exact, 3)),
            [plain("faces in reduced quality: 3")]
        );
        let affine = Mapper::default();
        assert_eq!(
            last(reduced(affine, 0)),
            [plain("shifts has no reduced quality")]
        );
        let within = Mapper::parse("within-1/4").unwrap();
        let paused = FrameStatistics {
            paused: true,
            ..reduced(within, 0)
        };
        assert_eq!(
            last(paused),
            [
                plain("error up to 1/4 texel"),
                plain("faces in reduced quality: 0"),
                bright("paused")
            ]
        );
    }

    /// The figures change twice a second, because figures that changed with every frame would be illegible.
    #[test]
    fn info_changes_twice_a_second_and_has_no_rate_after_a_gap() {
        let mut layer = Box::new(TextLayer::new());
        let mut overlay = overlay(&mut layer);
        overlay.act(0, Action::Info);
        let mut pixels = |tick, pixels| {
            let figures = FrameStatistics { pixels, ..FIGURES };
            overlay.prepare(tick, &figures, || None);
            lines(&overlay)
        };
        assert_eq!(pixels(0, 1)[2], plain("1 pixels"));
        assert_eq!(pixels(29, 2)[2], plain("1 pixels"));
        assert_eq!(
            pixels(30, 3)[2..4],
            [plain("4.0 frames/s  0.00 ms"), plain("3 pixels")]
        );
        assert_eq!(pixels(59, 4)[3], plain("3 pixels"));
        // A gap of 50 seconds or more gives no rate.
        assert_eq!(pixels(30 + 2999, 5)[2], plain("0.0 frames/s  0.00 ms"));
        assert_eq!(
            pixels(30 + 2999 + 3000, 6)[2..4],
            [plain("0.0 frames/s  0.00 ms"), plain("6 pixels")]
        );
    }

    #[test]
    fn help_has_a_line_for_each_key() {
        let mut layer = Box::new(TextLayer::new());
        let mut overlay = overlay(&mut layer);
        overlay.act(0, Action::Help);
        assert!(overlay.prepare(0, &FIGURES, || None));
        for (i, key) in KEYS.iter().enumerate() {
            let y = MARGIN + i * LINE;
            let description = read(overlay.layer, MARGIN + 6 * ADVANCE, y);
            assert_eq!(description, Some(plain(key.about)));
            assert_eq!(read(overlay.layer, MARGIN, y), Some(bright(key.name)));
        }
        overlay.act(0, Action::Help);
        assert!(!overlay.prepare(0, &FIGURES, || None));
        assert_eq!(lines(&overlay), []);
    }

    #[test]
    fn a_split_view_has_labels_and_a_hint_stays_five_seconds() {
        let mut layer = Box::new(TextLayer::new());
        let mut overlay = overlay(&mut layer);
        let bottom = HEIGHT - MARGIN - font::HEIGHT;
        overlay.act(7, Action::Hint);
        for (tick, hint) in [(7, true), (306, true), (307, false), (308, false)] {
            assert_eq!(overlay.prepare(tick, &FIGURES, || None), hint, "{tick}");
            let x = (WIDTH - 7 * ADVANCE) / 2;
            let written = read(overlay.layer, x, bottom);
            assert_eq!(written, hint.then(|| plain("H: help")), "{tick}");
        }
        overlay.act(400, Action::Split);
        let figures = FrameStatistics {
            largest_error: 3 << 15,
            reduced_faces: Some(1),
            ..FIGURES
        };
        assert!(overlay.prepare(400, &figures, || None));
        let texts = split::PANELS.map(|x| read(overlay.layer, x + MARGIN, bottom).unwrap().1);
        assert_eq!(texts, ["EXACT", "EXACT", "MAX 1.50 TEXEL"]);
        let above = read(overlay.layer, split::PANELS[0] + MARGIN, bottom - LINE);
        assert_eq!(above, Some(plain("reduced quality")));
        let y = split::LEGEND_Y + split::LEGEND_LINES + 3;
        let step = |step: usize| split::LEGEND_X + step * split::LEGEND_STEP;
        let first = read(overlay.layer, step(1), y).unwrap().1;
        assert!(first.starts_with("1/256"), "{first}");
        let last = read(overlay.layer, step(split::STEPS - 1) - ADVANCE, y);
        assert_eq!(last, Some(plain("64")));
        let one = read(overlay.layer, step(split::TEXEL), y).unwrap().1;
        assert!(one.starts_with('1'), "{one}");
    }
}
