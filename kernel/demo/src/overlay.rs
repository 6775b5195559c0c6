//! The overlay of a running demo: the list of keys, figures of the frames, and a hint.
//!
//! Text is white or yellow with a black outline, so that it is legible on any frame. The overlay is drawn
//! after the frame and counted separately. It is drawn plane by plane, so that all of it needs four writes to
//! Map Mask, and in columns, one span of pixels at a time. The pages know what they were drawn on, so nothing
//! else has to remember where text was written.
//!
//! The figures are those of the half second before; figures that changed with every frame would be illegible.
//! A held demo has no overlay.

use core::array;
use core::fmt::{self, Write};

use modex::{Destination, HEIGHT, Palette, WIDTH};
use protocol::{Action, TICKS_PER_SECOND};
use render::motion::TextureMotion;
use scene::font;
use texmap::{Mapper, Order};

use crate::palette::nearest;
use crate::split::{self, Split};
use crate::{KEYS, lower_mark};

/// Ticks between two updates of the figures.
const RENEWAL: u32 = 30;
/// Ticks that a hint stays on the screen.
const HINT: u32 = 300;
/// Columns from one letter to the next.
const ADVANCE: usize = font::WIDTH + 1;
/// Lines from one line of letters to the next.
const LINE: usize = font::HEIGHT + 2;
/// Distance of the text from the screen's borders, in pixels.
const MARGIN: usize = 4;

/// A colour of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ink {
    /// White.
    Plain,
    /// Yellow, for emphasis.
    Bright,
}

/// A set of pixels of a screen column, one bit each, from the top down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Column([u64; HEIGHT.div_ceil(64)]);

impl Column {
    const EMPTY: Self = Self([0; HEIGHT.div_ceil(64)]);

    fn set(&mut self, y: usize) {
        self.0[y / 64] |= 1 << (y % 64);
    }

    fn has(&self, y: usize) -> bool {
        self.0[y / 64] >> (y % 64) & 1 == 1
    }

    fn or(self, other: Self) -> Self {
        Self(array::from_fn(|i| self.0[i] | other.0[i]))
    }

    /// Returns the set extended by the pixels directly above and below each of its pixels.
    fn spread(self) -> Self {
        let word = |i: usize| self.0.get(i).copied().unwrap_or(0);
        Self(array::from_fn(|i| {
            let down = word(i) << 1 | word(i.wrapping_sub(1)) >> 63;
            let up = word(i) >> 1 | word(i + 1) << 63;
            word(i) | down | up
        }))
    }

    /// Returns the first y from `y` on whose pixel is in the set (or, if `set` is false, is not); `HEIGHT` if
    /// no pixel is.
    fn next(&self, y: usize, set: bool) -> usize {
        let mut from = y;
        while from < HEIGHT {
            let word = if set {
                self.0[from / 64]
            } else {
                !self.0[from / 64]
            };
            match (word >> (from % 64)).trailing_zeros() {
                64 => from = (from / 64 + 1) * 64,
                ahead => return (from + ahead as usize).min(HEIGHT),
            }
        }
        HEIGHT
    }

    /// Returns each span of pixels in the set: its first y, and the y after its last.
    fn runs(self) -> impl Iterator<Item = (usize, usize)> {
        let mut y = 0;
        core::iter::from_fn(move || {
            let top = self.next(y, true);
            y = self.next(top, false);
            (top < HEIGHT).then_some((top, y))
        })
    }
}

/// Text on the screen, one bit a pixel. About 20 KiB, all zeros when empty.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Writing {
    plain: [Column; WIDTH],
    bright: [Column; WIDTH],
}

impl Writing {
    /// Returns an empty screen.
    pub const fn new() -> Self {
        Self {
            plain: [Column::EMPTY; WIDTH],
            bright: [Column::EMPTY; WIDTH],
        }
    }

    /// Erases all text.
    pub fn wipe(&mut self) {
        self.plain = [Column::EMPTY; WIDTH];
        self.bright = [Column::EMPTY; WIDTH];
    }

    /// Writes a line with its top left corner at (x, y), and returns the x after its last letter. Pixels that
    /// are outside the screen, or whose outline would be, are left out.
    pub fn write(&mut self, ink: Ink, x: usize, y: usize, text: fmt::Arguments<'_>) -> usize {
        let mut pen = Pen {
            columns: match ink {
                Ink::Plain => &mut self.plain,
                Ink::Bright => &mut self.bright,
            },
            x,
            y,
        };
        // The pen never fails. A `Display` implementation may, and the text then ends where it failed.
        let _ = pen.write_fmt(text);
        pen.x
    }

    /// Draws the text with its outline.
    pub fn draw(&self, inks: &Inks, destination: &mut impl Destination) {
        let at = |x: usize| match (self.plain.get(x), self.bright.get(x)) {
            (Some(plain), Some(bright)) => plain.or(*bright),
            _ => Column::EMPTY,
        };
        for plane in 0..4 {
            destination.select(plane as u16);
            for x in (plane..WIDTH).step_by(4) {
                let around = at(x.wrapping_sub(1)).or(at(x)).or(at(x + 1)).spread();
                for (top, end) in around.runs() {
                    let mut y = top;
                    destination.lane::<{ modex::STRIDE }>(
                        x as u16,
                        top as u16,
                        (end - top) as u16,
                        |column| {
                            column.fill(|| {
                                let here = y;
                                y += 1;
                                match (self.plain[x].has(here), self.bright[x].has(here)) {
                                    (true, _) => inks.plain,
                                    (_, true) => inks.bright,
                                    _ => inks.outline,
                                }
                            });
                        },
                    );
                }
            }
        }
    }
}

/// The position of the next letter.
struct Pen<'a> {
    columns: &'a mut [Column; WIDTH],
    x: usize,
    y: usize,
}

impl Write for Pen<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for character in text.chars() {
            for (row, bits) in font::glyph(character).into_iter().enumerate() {
                for column in (0..font::WIDTH).filter(|column| bits >> column & 1 == 1) {
                    let (x, y) = (self.x + column, self.y + row);
                    if (1..WIDTH - 1).contains(&x) && (1..HEIGHT - 1).contains(&y) {
                        self.columns[x].set(y);
                    }
                }
            }
            self.x += ADVANCE;
        }
        Ok(())
    }
}

/// Palette entries for text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Inks {
    plain: u8,
    bright: u8,
    outline: u8,
}

impl Inks {
    /// Returns the entries of a palette that are nearest to white, yellow and black.
    pub fn of(palette: &Palette) -> Self {
        Self {
            plain: nearest(palette, [63, 63, 63]),
            bright: nearest(palette, [63, 58, 24]),
            outline: nearest(palette, [0, 0, 0]),
        }
    }
}

/// The figures that the overlay shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Figures {
    pub scene: &'static str,
    pub mapper: Mapper,
    pub order: Order,
    pub paused: bool,
    /// Faces of the last frame in reduced quality; `None` if reduced quality is off.
    pub lowered: Option<u32>,
    /// Pixels of the last frame.
    pub pixels: u32,
    /// Writes to Map Mask for the last frame, without its overlay.
    pub map_masks: u64,
    /// The largest error of the last frame if it was a split view, in 2^-16 texel.
    pub most: u32,
}

/// Frames since a tick, and the microseconds that they needed.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    since: u32,
    frames: u32,
    micros: u64,
}

/// What is drawn over the frames, and its timing.
#[derive(Debug)]
pub(crate) struct Overlay<'a> {
    writing: &'a mut Writing,
    inks: Inks,
    help: bool,
    info: bool,
    split: bool,
    colours: Split,
    hint: Option<u32>,
    /// The overlay text changed and must be redrawn.
    stale: bool,
    window: Window,
    /// Figures of the last complete window: tenths of a frame a second, and microseconds a frame.
    pace: Option<(u32, u32)>,
}

impl<'a> Overlay<'a> {
    /// Returns an empty overlay that uses the colours of `palette`.
    pub fn new(writing: &'a mut Writing, palette: &Palette) -> Self {
        Self {
            writing,
            inks: Inks::of(palette),
            help: false,
            info: false,
            split: false,
            colours: Split::of(palette),
            hint: None,
            stale: true,
            window: Window::default(),
            pace: None,
        }
    }

    /// Switches the overlay off.
    pub fn close(&mut self) {
        (self.help, self.info, self.split, self.hint) = (false, false, false, None);
        self.stale = true;
    }

    /// Marks the text as outdated, because the demo's state has changed.
    pub fn renew(&mut self) {
        self.stale = true;
    }

    /// Changes the palette.
    pub fn set_palette(&mut self, palette: &Palette) {
        self.inks = Inks::of(palette);
        self.colours = Split::of(palette);
    }

    /// Returns how to draw the split view, if it is on.
    pub fn split(&self) -> Option<&Split> {
        Some(&self.colours).filter(|_| self.split)
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

    /// Adds the microseconds that drawing a frame needed.
    pub fn took(&mut self, micros: u32) {
        self.window.micros += u64::from(micros);
    }

    /// Prepares the overlay for the frame of `tick`. Returns whether the overlay shows anything. `motion` is
    /// called only if needed, and measures how the visible texture moves in a tick.
    pub fn prepare(
        &mut self,
        tick: u32,
        figures: &Figures,
        motion: impl FnOnce() -> Option<TextureMotion>,
    ) -> bool {
        let ticks = tick.wrapping_sub(self.window.since);
        if ticks >= RENEWAL {
            let Window { frames, micros, .. } = self.window;
            // No pace after a long gap: the demo may just have begun.
            if frames > 0 && ticks < 100 * RENEWAL {
                let tenths = frames * 10 * TICKS_PER_SECOND / ticks;
                self.pace = Some((tenths, (micros / u64::from(frames)) as u32));
            }
            self.window = Window {
                since: tick,
                ..Window::default()
            };
            self.stale |= self.info || self.split;
        }
        self.window.frames += 1;
        if self
            .hint
            .is_some_and(|since| tick.wrapping_sub(since) >= HINT)
        {
            self.hint = None;
            self.stale = true;
        }
        if core::mem::take(&mut self.stale) {
            self.writing.wipe();
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
                    self.writing.write(Ink::Plain, x, y, format_args!("{text}"));
                }
            }
        }
        self.help || self.info || self.split || self.hint.is_some()
    }

    /// Draws the prepared overlay.
    pub fn draw(&self, destination: &mut impl Destination) {
        if let Some(split) = self.split() {
            split.draw_frame(destination);
        }
        self.writing.draw(&self.inks, destination);
    }

    fn write_help(&mut self) {
        let about = MARGIN + 6 * ADVANCE;
        for (i, key) in KEYS.iter().enumerate() {
            let y = MARGIN + i * LINE;
            self.writing
                .write(Ink::Bright, MARGIN, y, format_args!("{}", key.name));
            self.writing
                .write(Ink::Plain, about, y, format_args!("{}", key.about));
        }
    }

    fn write_labels(&mut self, figures: &Figures) {
        let Figures {
            mapper,
            most,
            lowered,
            ..
        } = figures;
        let mark = lower_mark(lowered.unwrap_or(0));
        let mut write = |ink, x, y, text: fmt::Arguments<'_>| {
            self.writing.write(ink, x, y, text);
        };
        let y = HEIGHT - MARGIN - font::HEIGHT;
        let [left, middle, right] = split::WINDOWS.map(|x| x + MARGIN);
        write(Ink::Bright, left, y, format_args!("{mapper}{mark}"));
        write(Ink::Bright, middle, y, format_args!("exact"));
        let most = Hundredths(*most);
        write(Ink::Bright, right, y, format_args!("most {most} texel"));
        let y = split::LEGEND_Y + split::LEGEND_LINES + 3;
        for (step, text) in [(1, "1/256"), (split::TEXEL, "1"), (split::STEPS - 1, "64")] {
            let begins = split::LEGEND_X + step * split::LEGEND_STEP;
            // A two-letter label ends where its step ends.
            let x = begins - ADVANCE * usize::from(text.len() == 2);
            write(Ink::Plain, x, y, format_args!("{text}"));
        }
    }

    fn write_info(&mut self, figures: &Figures, motion: Option<TextureMotion>) {
        let Figures {
            scene,
            mapper,
            order,
            paused,
            pixels,
            map_masks,
            lowered,
            ..
        } = figures;
        let (pace, writing) = (self.pace, &mut *self.writing);
        let mut y = MARGIN;
        let mut line = |ink, text: fmt::Arguments<'_>| {
            writing.write(ink, MARGIN, y, text);
            y += LINE;
        };
        line(Ink::Bright, format_args!("{scene}"));
        line(Ink::Bright, format_args!("{mapper}  {order}"));
        if let Some((tenths, micros)) = pace {
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
        line(Ink::Plain, format_args!("{map_masks} Map Masks"));
        if let Mapper::Within(tolerance) = mapper {
            line(Ink::Plain, format_args!("at most {tolerance} texel off"));
        }
        if let Some((pixels, sweet_spot)) = moved(motion, pace) {
            line(
                Ink::Plain,
                format_args!("{} pixels a frame", Hundredths(pixels)),
            );
            if let Some((least, most)) = sweet_spot {
                let (ink, verdict) = match pixels {
                    // Frames are so far apart that any motion too fast to crawl is already more than half a
                    // period.
                    _ if least > most => (Ink::Plain, ": too few frames"),
                    0 => (Ink::Plain, ""),
                    _ if pixels < least => (Ink::Plain, ": too slow"),
                    _ if pixels > most => (Ink::Plain, ": too fast"),
                    _ => (Ink::Bright, ""),
                };
                let (least, most) = (Hundredths(least), Hundredths(most));
                line(ink, format_args!("sweet spot {least} to {most}{verdict}"));
            }
        }
        match lowered {
            Some(faces) if mapper.lower().is_some() => {
                line(
                    Ink::Plain,
                    format_args!("faces in reduced quality: {faces}"),
                );
            }
            // Without this line the key would seem to have no effect.
            Some(_) => line(Ink::Plain, format_args!("nothing cheaper than {mapper}")),
            None => {}
        }
        if *paused {
            line(Ink::Bright, format_args!("paused"));
        }
    }
}

/// Returns how far the visible texture moves from one frame to the next, and the range in which the eye sees
/// that as motion (the sweet spot), in 2^-16 pixel. `None` if the frame rate is unknown.
fn moved(
    motion: Option<TextureMotion>,
    pace: Option<(u32, u32)>,
) -> Option<(u32, Option<(u32, u32)>)> {
    let (motion, (tenths, _)) = motion.zip(pace)?;
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
    use modex::PlanarBuffer;
    use scene::catalogue::CATALOGUE;
    use std::boxed::Box;
    use std::string::String;
    use std::vec::Vec;

    const INKS: Inks = Inks {
        plain: 1,
        bright: 2,
        outline: 3,
    };

    /// Checks the definition: pixels of letters have their ink, pixels around them are black, and all others
    /// are untouched.
    #[test]
    fn letters_have_an_outline_and_touch_nothing_else() {
        let mut writing = Box::new(Writing::new());
        for (x, y) in [(4, 4), (61, 60), (318, 232), (200, 239), (0, 0)] {
            writing.write(Ink::Plain, x, y, format_args!("K%"));
            writing.write(Ink::Bright, x, y.wrapping_add(9), format_args!("Z"));
        }
        let mut page = Box::new(PlanarBuffer::new());
        writing.draw(&INKS, &mut *page);
        let ink = |x: usize, y: usize| {
            let of =
                |columns: &[Column; WIDTH]| columns.get(x).is_some_and(|c| y < HEIGHT && c.has(y));
            [of(&writing.plain), of(&writing.bright)]
        };
        let mut count = [0; 4];
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let near =
                    |dx: usize, dy: usize| ink((x + dx).wrapping_sub(1), (y + dy).wrapping_sub(1));
                let around = (0..9).any(|i| near(i % 3, i / 3) != [false; 2]);
                let expected = match ink(x, y) {
                    [true, _] => 1,
                    [_, true] => 2,
                    _ if around => 3,
                    _ => 0,
                };
                assert_eq!(page.pixel(x, y), expected, "({x}, {y})");
                count[usize::from(expected)] += 1;
            }
        }
        assert!(count.iter().all(|&count| count > 30), "{count:?}");
    }

    #[test]
    fn everything_that_is_written_has_letters() {
        let mut written = String::new();
        for key in KEYS {
            written += key.name;
            written += key.about;
        }
        written += lower_mark(1);
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

    /// Reads the text from (x, y) on, up to a gap of three letters, with its ink. The text is in capitals,
    /// because small letters look the same.
    fn read(writing: &Writing, x: usize, y: usize) -> Option<(Ink, String)> {
        let letter = |columns: &[Column; WIDTH], x: usize| {
            let has = |row: usize, column: usize| columns[x + column].has(y + row);
            let glyph: font::Glyph = array::from_fn(|row| {
                let columns = (0..font::WIDTH).filter(|&column| has(row, column));
                columns.map(|column| 1 << column).sum()
            });
            (' '..='~').find(|&known| font::glyph(known) == glyph)
        };
        let inks = [(Ink::Plain, &writing.plain), (Ink::Bright, &writing.bright)];
        inks.into_iter().find_map(|(ink, columns)| {
            let letters = (x..WIDTH - ADVANCE).step_by(ADVANCE);
            let text: String = letters.map(|x| letter(columns, x).unwrap_or('?')).collect();
            // Another text may follow after the gap.
            let text = text.split("   ").next()?.trim_end();
            (!text.is_empty()).then(|| (ink, text.into()))
        })
    }

    /// Returns the lines of text from the top left down.
    fn lines(overlay: &Overlay<'_>) -> Vec<(Ink, String)> {
        let lines = (MARGIN..HEIGHT - LINE).step_by(LINE);
        lines
            .map_while(|y| read(overlay.writing, MARGIN, y))
            .collect()
    }

    const FIGURES: Figures = Figures {
        scene: "ball",
        mapper: Mapper::Exact,
        order: Order::Planes,
        paused: false,
        lowered: None,
        pixels: 12_345,
        most: 0,
        map_masks: 678,
    };

    /// A motion of 1.5 pixels a tick, a quarter of half a period.
    const MOTION: TextureMotion = TextureMotion {
        pixels: 3 << 15,
        part: 1 << 14,
    };

    fn overlay(writing: &mut Writing) -> Overlay<'_> {
        Overlay::new(writing, CATALOGUE[0].scene(&[]).palette)
    }

    /// Returns the lines of `info` after a second of frames, `every` ticks apart.
    fn info(every: u32, figures: &Figures, motion: Option<TextureMotion>) -> Vec<(Ink, String)> {
        let mut writing = Box::new(Writing::new());
        let mut overlay = overlay(&mut writing);
        overlay.act(0, Action::Info);
        for tick in (0..=60).step_by(every as usize) {
            assert!(overlay.prepare(tick, figures, || motion));
            overlay.took(2_567);
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
    fn info_tells_pace_work_and_motion() {
        let figures = [
            bright("ball"),
            bright("exact  planes"),
            plain("60.0 frames/s  2.56 ms"),
            plain("12345 pixels"),
            plain("678 Map Masks"),
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
        let says = |every, pixels, part| {
            let motion = Some(TextureMotion { pixels, part });
            info(every, &FIGURES, motion)[5..].to_vec()
        };
        assert_eq!(
            says(1, 6_560, 1 << 14)[1],
            plain("sweet spot 0.19 to 0.40: too slow")
        );
        assert_eq!(
            says(1, 3 << 15, 1 << 17)[1],
            plain("sweet spot 0.19 to 0.75: too fast")
        );
        assert_eq!(
            says(10, 3 << 15, 3 << 16)[1],
            plain("sweet spot 2.00 to 0.50: too few frames")
        );
        // Nothing moves in the texture.
        assert_eq!(says(1, 3 << 15, 0), [plain("1.50 pixels a frame")]);
    }

    #[test]
    fn info_tells_reduced_quality_tolerance_and_pause() {
        let last = |figures: Figures| info(1, &figures, None)[5..].to_vec();
        let lowered = |mapper, faces| Figures {
            mapper,
            lowered: Some(faces),
            ..FIGURES
        };
        assert_eq!(
            last(lowered(Mapper::Exact, 3)),
            [plain("faces in reduced quality: 3")]
        );
        let affine = Mapper::default();
        assert_eq!(
            last(lowered(affine, 0)),
            [plain("nothing cheaper than shifts")]
        );
        let within = Mapper::parse("within-1/4").unwrap();
        let paused = Figures {
            paused: true,
            ..lowered(within, 0)
        };
        assert_eq!(
            last(paused),
            [
                plain("at most 1/4 texel off"),
                plain("faces in reduced quality: 0"),
                bright("paused")
            ]
        );
    }

    /// The figures change twice a second, because figures that changed with every frame would be illegible.
    #[test]
    fn info_changes_twice_a_second_and_knows_no_pace_over_a_gap() {
        let mut writing = Box::new(Writing::new());
        let mut overlay = overlay(&mut writing);
        overlay.act(0, Action::Info);
        let mut pixels = |tick, pixels| {
            let figures = Figures { pixels, ..FIGURES };
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
        // A gap of 50 seconds or more gives no pace.
        assert_eq!(pixels(30 + 2999, 5)[2], plain("0.0 frames/s  0.00 ms"));
        assert_eq!(
            pixels(30 + 2999 + 3000, 6)[2..4],
            [plain("0.0 frames/s  0.00 ms"), plain("6 pixels")]
        );
    }

    #[test]
    fn help_has_a_line_for_each_key() {
        let mut writing = Box::new(Writing::new());
        let mut overlay = overlay(&mut writing);
        overlay.act(0, Action::Help);
        assert!(overlay.prepare(0, &FIGURES, || None));
        for (i, key) in KEYS.iter().enumerate() {
            let y = MARGIN + i * LINE;
            let about = read(overlay.writing, MARGIN + 6 * ADVANCE, y);
            assert_eq!(about, Some(plain(key.about)));
            let mut name = String::new();
            let letters = (MARGIN..).step_by(ADVANCE).take(key.name.len());
            for (x, letter) in letters.zip(key.name.chars()) {
                let has =
                    |row: usize, column: usize| overlay.writing.bright[x + column].has(y + row);
                let drawn = font::glyph(letter)
                    .into_iter()
                    .enumerate()
                    .all(|(row, bits)| {
                        (0..font::WIDTH).all(|column| has(row, column) == (bits >> column & 1 == 1))
                    });
                assert!(drawn, "{name}: {letter}");
                name.push(letter);
            }
        }
        overlay.act(0, Action::Help);
        assert!(!overlay.prepare(0, &FIGURES, || None));
        assert_eq!(lines(&overlay), []);
    }

    #[test]
    fn a_split_view_names_its_parts_and_a_hint_stays_five_seconds() {
        let mut writing = Box::new(Writing::new());
        let mut overlay = overlay(&mut writing);
        let bottom = HEIGHT - MARGIN - font::HEIGHT;
        overlay.act(7, Action::Hint);
        for (tick, hint) in [(7, true), (306, true), (307, false), (308, false)] {
            assert_eq!(overlay.prepare(tick, &FIGURES, || None), hint, "{tick}");
            let x = (WIDTH - 7 * ADVANCE) / 2;
            let written = read(overlay.writing, x, bottom);
            assert_eq!(written, hint.then(|| plain("H: help")), "{tick}");
        }
        overlay.act(400, Action::Split);
        let figures = Figures {
            most: 3 << 15,
            lowered: Some(1),
            ..FIGURES
        };
        assert!(overlay.prepare(400, &figures, || None));
        let texts = split::WINDOWS.map(|x| read(overlay.writing, x + MARGIN, bottom).unwrap().1);
        assert_eq!(texts, ["EXACT~", "EXACT", "MOST 1.50 TEXEL"]);
        let y = split::LEGEND_Y + split::LEGEND_LINES + 3;
        let step = |step: usize| split::LEGEND_X + step * split::LEGEND_STEP;
        let first = read(overlay.writing, step(1), y).unwrap().1;
        assert!(first.starts_with("1/256"), "{first}");
        let last = read(overlay.writing, step(split::STEPS - 1) - ADVANCE, y);
        assert_eq!(last, Some(plain("64")));
        let one = read(overlay.writing, step(split::TEXEL), y).unwrap().1;
        assert!(one.starts_with('1'), "{one}");
    }

    #[test]
    fn a_palette_has_its_nearest_to_white_yellow_and_black() {
        let inks = Inks::of(CATALOGUE[0].scene(&[]).palette);
        assert_eq!(
            inks,
            Inks {
                plain: 1,
                bright: 2,
                outline: 0
            }
        );
        let mut palette = [[30; 3]; 256];
        (palette[7], palette[255], palette[9]) = ([60, 61, 62], [3, 0, 0], [50, 50, 0]);
        assert_eq!(
            Inks::of(&palette),
            Inks {
                plain: 7,
                bright: 9,
                outline: 255
            }
        );
    }
}
