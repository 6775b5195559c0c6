//! Text over a frame.
//!
//! Text is white or yellow with a black outline, so that it is legible on any frame. It is drawn plane by
//! plane, so that all of it needs four writes to Map Mask, and in columns, one span of pixels at a time.

use core::array;
use core::fmt::{self, Write};

use modex::{Destination, HEIGHT, Palette, WIDTH};
use scene::font;

use crate::palette::nearest;

/// Columns from one letter to the next.
pub(crate) const ADVANCE: usize = font::WIDTH + 1;
/// Lines from one line of letters to the next.
pub(crate) const LINE: usize = font::HEIGHT + 2;

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
struct ColumnMask([u64; HEIGHT.div_ceil(64)]);

impl ColumnMask {
    const EMPTY: Self = Self([0; HEIGHT.div_ceil(64)]);

    fn set(&mut self, y: usize) {
        self.0[y / 64] |= 1 << (y % 64);
    }

    fn has(&self, y: usize) -> bool {
        self.0[y / 64] >> (y % 64) & 1 == 1
    }

    fn union(self, other: Self) -> Self {
        Self(array::from_fn(|i| self.0[i] | other.0[i]))
    }

    /// Returns the set extended by the pixels directly above and below each of its pixels.
    fn dilate(self) -> Self {
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
    fn spans(self) -> impl Iterator<Item = (usize, usize)> {
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
pub(crate) struct TextLayer {
    plain: [ColumnMask; WIDTH],
    bright: [ColumnMask; WIDTH],
}

impl TextLayer {
    /// Returns a layer without text.
    pub const fn new() -> Self {
        Self {
            plain: [ColumnMask::EMPTY; WIDTH],
            bright: [ColumnMask::EMPTY; WIDTH],
        }
    }

    /// Erases all text.
    pub fn clear(&mut self) {
        self.plain = [ColumnMask::EMPTY; WIDTH];
        self.bright = [ColumnMask::EMPTY; WIDTH];
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
            (Some(plain), Some(bright)) => plain.union(*bright),
            _ => ColumnMask::EMPTY,
        };
        for plane in 0..4 {
            destination.select(plane as u16);
            for x in (plane..WIDTH).step_by(4) {
                let around = at(x.wrapping_sub(1)).union(at(x)).union(at(x + 1)).dilate();
                for (top, end) in around.spans() {
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
    columns: &'a mut [ColumnMask; WIDTH],
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
    pub fn new(palette: &Palette) -> Self {
        Self {
            plain: nearest(palette, [63, 63, 63]),
            bright: nearest(palette, [63, 58, 24]),
            outline: nearest(palette, [0, 0, 0]),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    extern crate std;
    use super::*;
    use modex::PlanarBuffer;
    use scene::catalogue::CATALOGUE;
    use std::boxed::Box;
    use std::string::String;

    const INKS: Inks = Inks {
        plain: 1,
        bright: 2,
        outline: 3,
    };

    /// Checks the definition: pixels of letters have their ink, pixels around them are black, and all others
    /// are untouched.
    #[test]
    fn letters_have_an_outline_and_touch_nothing_else() {
        let mut layer = Box::new(TextLayer::new());
        for (x, y) in [(4, 4), (61, 60), (318, 232), (200, 239), (0, 0)] {
            layer.write(Ink::Plain, x, y, format_args!("K%"));
            layer.write(Ink::Bright, x, y.wrapping_add(9), format_args!("Z"));
        }
        let mut page = Box::new(PlanarBuffer::new());
        layer.draw(&INKS, &mut *page);
        let ink = |x: usize, y: usize| {
            let of = |columns: &[ColumnMask; WIDTH]| {
                columns.get(x).is_some_and(|c| y < HEIGHT && c.has(y))
            };
            [of(&layer.plain), of(&layer.bright)]
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

    /// Reads the text from (x, y) on, up to a gap of three letters, with its ink. The text is in capitals,
    /// because small letters look the same.
    pub(crate) fn read(layer: &TextLayer, x: usize, y: usize) -> Option<(Ink, String)> {
        let letter = |columns: &[ColumnMask; WIDTH], x: usize| {
            let has = |row: usize, column: usize| columns[x + column].has(y + row);
            let glyph: font::Glyph = array::from_fn(|row| {
                let columns = (0..font::WIDTH).filter(|&column| has(row, column));
                columns.map(|column| 1 << column).sum()
            });
            (' '..='~').find(|&known| font::glyph(known) == glyph)
        };
        let inks = [(Ink::Plain, &layer.plain), (Ink::Bright, &layer.bright)];
        inks.into_iter().find_map(|(ink, columns)| {
            let letters = (x..WIDTH - ADVANCE).step_by(ADVANCE);
            let text: String = letters.map(|x| letter(columns, x).unwrap_or('?')).collect();
            // Another text may follow after the gap.
            let text = text.split("   ").next()?.trim_end();
            (!text.is_empty()).then(|| (ink, text.into()))
        })
    }

    #[test]
    fn inks_are_the_colours_nearest_to_white_yellow_and_black() {
        let inks = Inks::new(CATALOGUE[0].scene(&[]).palette);
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
            Inks::new(&palette),
            Inks {
                plain: 7,
                bright: 9,
                outline: 255
            }
        );
    }
}
