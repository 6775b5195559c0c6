//! Dumps: the content of a card as text that `diff` can compare.
//!
//! ```text
//! crystal-ball dump 5
//! content page
//! scene ball
//! model none
//! mapper shifts
//! frame 480
//! motion none
//! start 4b00
//! size 320 240
//! palette 00 000000 3f3f3f ...     16 lines of 16 colours, 6 bits a part: 00 to 3f
//! line 000 b2b2b2b2 ...            a line for each scan line, two hex digits a pixel
//! end 265 lines 038ed8bb
//! ```
//!
//! Each of these lines is a line of the protocol, so it ends in a checksum. The last line contains the number
//! of lines before it and their CRC-32. Each line enters that CRC-32 without its own checksum and with an LF
//! at its end, so changes that a terminal makes to line ends do not matter.
//!
//! With `content memory` the lines are `memory 4b00 6b6b ...`: all four planes, 80 addresses a line, so that
//! a line of a page is a line of the dump. Pixel i of a line is in plane i & 3 at the line's address plus i /
//! 4; the last line has the sixteen addresses that remain.
//!
//! The model file is `none` for a built-in scene. Otherwise it is the checksum, in eight hex digits, of the
//! model file that contains the model. Dumps with different model files show different models, even though
//! their scenes have the same name.
//!
//! The header names the frame so that `scene`, `mapper` and `show` draw it again. If some of its faces were
//! drawn in reduced quality, `motion` is the [`Motion`] that decided which; otherwise it is `none`. Before
//! the first frame `mapper`, `frame` and `motion` are `none`.
//!
//! Version 4 had the words `pack` and `picture` where version 5 has `model` and `frame`. Version 3 also had
//! no line `motion`, and marked reduced quality by a `~` behind the mapper's name.
//!
//! Two dumps of the same frame on different pages differ only in their `start`.

use core::fmt;

use crate::{Checksum, Content, FrameName, Motion, Word};

/// Version of the format, in a dump's first line.
pub const VERSION: u32 = 5;
/// Start of a dump's first line; the version follows.
pub const MAGIC: &str = "crystal-ball dump";
/// Addresses in each plane.
pub const PLANE_BYTES: usize = 0x1_0000;
/// Colours in a line of the palette.
pub const COLOURS_A_LINE: usize = 16;
/// Widest frame whose lines fit [`crate::MAX_LINE`].
pub const MAX_WIDTH: usize = 320;

/// The head of a dump: what the bytes show, and where they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header<S> {
    /// How much of video memory the dump contains.
    pub content: Content,
    /// The scene's name, a word.
    pub scene: S,
    /// The checksum of the model file that contains the scene; `None` for a built-in scene.
    pub model_file: Option<u32>,
    /// The name of the mapper that drew the frame; `None` before the first frame.
    pub mapper: Option<Word>,
    /// The frame on the screen; `None` before the first frame.
    pub frame: Option<FrameName>,
    /// The motion that decided which faces are drawn in reduced quality; `None` if all faces have full
    /// quality.
    pub motion: Option<Motion>,
    /// The start address: where the displayed page begins in each plane.
    pub start: u16,
    /// Pixels in a line, a multiple of 4, at most [`MAX_WIDTH`].
    pub width: u16,
    /// Lines in a page.
    pub height: u16,
}

/// A row of a dump: its label, and where its pixels are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// The content that the row is a part of.
    pub content: Content,
    /// The number of the scan line for a page, and the address for memory.
    pub label: usize,
    /// Address of the row's first four pixels.
    pub at: u16,
    /// Pixels in the row.
    pub pixels: usize,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.content {
            Content::Page => write!(f, "line {:03}", self.label),
            Content::Memory => write!(f, "memory {:04x}", self.label),
        }
    }
}

impl<S> Header<S> {
    /// Returns the rows of the dump, in order.
    pub fn rows(&self) -> impl Iterator<Item = Row> + use<S> {
        self.rows_of(self.content)
    }

    fn rows_of(&self, content: Content) -> impl Iterator<Item = Row> + use<S> {
        let start = self.start;
        let stride = usize::from(self.width / 4).max(1);
        let rows = match content {
            Content::Page => usize::from(self.height),
            Content::Memory => PLANE_BYTES.div_ceil(stride),
        };
        (0..rows).map(move |row| {
            let offset = row * stride;
            match content {
                Content::Page => Row {
                    content,
                    label: row,
                    // The card's address counter wraps too.
                    at: start.wrapping_add(offset as u16),
                    pixels: 4 * stride,
                },
                Content::Memory => Row {
                    content,
                    label: offset,
                    at: offset as u16,
                    pixels: 4 * stride.min(PLANE_BYTES - offset),
                },
            }
        })
    }
}

/// The CRC-32 over a dump's lines. It displays as the dump's last line.
#[derive(Clone, Debug, Default)]
pub struct DumpChecksum {
    checksum: Checksum,
    lines: usize,
}

impl DumpChecksum {
    /// Adds a line's text.
    pub fn add(&mut self, line: fmt::Arguments<'_>) {
        struct Into<'a>(&'a mut Checksum);
        impl fmt::Write for Into<'_> {
            fn write_str(&mut self, text: &str) -> fmt::Result {
                self.0.add(text.as_bytes());
                Ok(())
            }
        }
        // Neither the writer nor the values that are written can fail.
        let _ = fmt::write(&mut Into(&mut self.checksum), line);
        self.checksum.add(b"\n");
        self.lines += 1;
    }
}

/// The dump's last line.
impl fmt::Display for DumpChecksum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "end {} lines {:08x}", self.lines, self.checksum.value())
    }
}

/// Writes a dump, a line at a time. `load` fills a slice with the pixels from an address on: pixel i is in
/// plane i & 3 at the address plus i / 4.
///
/// # Panics
/// If the header's width is more than [`MAX_WIDTH`].
pub fn write<S: fmt::Display>(
    header: &Header<S>,
    palette: &[[u8; 3]; 256],
    mut load: impl FnMut(u16, &mut [u8]),
    mut line: impl FnMut(fmt::Arguments<'_>),
) {
    let mut checksum = DumpChecksum::default();
    let mut write_line = |text: fmt::Arguments<'_>| {
        checksum.add(text);
        line(text);
    };
    let Header {
        content,
        scene,
        model_file,
        mapper,
        frame,
        motion,
        start,
        width,
        height,
    } = header;
    write_line(format_args!("{MAGIC} {VERSION}"));
    write_line(format_args!("content {content}"));
    write_line(format_args!("scene {scene}"));
    match model_file {
        Some(model_file) => write_line(format_args!("model {model_file:08x}")),
        None => write_line(format_args!("model none")),
    }
    write_line(format_args!("mapper {}", OrNone(mapper)));
    write_line(format_args!("frame {}", OrNone(frame)));
    write_line(format_args!("motion {}", OrNone(motion)));
    write_line(format_args!("start {start:04x}"));
    write_line(format_args!("size {width} {height}"));
    for (i, colours) in palette.chunks(COLOURS_A_LINE).enumerate() {
        let first = i * COLOURS_A_LINE;
        write_line(format_args!("palette {first:02x}{}", Colours(colours)));
    }
    let mut pixels = [0; MAX_WIDTH];
    for row in header.rows() {
        let pixels = &mut pixels[..row.pixels];
        load(row.at, pixels);
        write_line(format_args!("{row} {}", Hex(pixels)));
    }
    line(format_args!("{checksum}"));
}

/// Displays a value, or `none` if the value is missing.
#[derive(Clone, Copy, Debug)]
pub struct OrNone<'a, T>(pub &'a Option<T>);

impl<T: fmt::Display> fmt::Display for OrNone<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(value) => value.fmt(f),
            None => f.write_str("none"),
        }
    }
}

impl fmt::Display for Content {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Page => "page",
            Self::Memory => "memory",
        })
    }
}

struct Colours<'a>(&'a [[u8; 3]]);

impl fmt::Display for Colours<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0
            .iter()
            .try_for_each(|part| write!(f, " {}", Hex(part)))
    }
}

/// Displays bytes in hex, without separators.
struct Hex<'a>(&'a [u8]);

impl fmt::Display for Hex<'_> {
    /// Writes a chunk at a time: with one write for each byte, most of a dump's time would go into these
    /// writes.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const DIGITS: &[u8; 16] = b"0123456789abcdef";
        for bytes in self.0.chunks(32) {
            let mut digits = [0; 64];
            for (pair, &byte) in digits.chunks_exact_mut(2).zip(bytes) {
                pair[0] = DIGITS[usize::from(byte >> 4)];
                pair[1] = DIGITS[usize::from(byte & 15)];
            }
            let digits = &digits[..2 * bytes.len()];
            f.write_str(core::str::from_utf8(digits).map_err(|_| fmt::Error)?)?;
        }
        Ok(())
    }
}

/// Writes checksums instead of a dump: of the pixels of the displayed page, line by line; of the palette; and
/// with `content memory` of each plane.
///
/// ```text
/// page start 4b00 crc 0a0b0c0d
/// palette crc 0a0b0c0d
/// plane 0 crc 0a0b0c0d          and three more
/// ```
///
/// # Panics
/// As [`write()`].
pub fn write_checksums<S>(
    header: &Header<S>,
    palette: &[[u8; 3]; 256],
    mut load: impl FnMut(u16, &mut [u8]),
    mut line: impl FnMut(fmt::Arguments<'_>),
) {
    let mut buffer = [0; MAX_WIDTH];
    let mut page = Checksum::new();
    for row in header.rows_of(Content::Page) {
        load(row.at, &mut buffer[..row.pixels]);
        page.add(&buffer[..row.pixels]);
    }
    line(format_args!(
        "page start {:04x} crc {:08x}",
        header.start,
        page.value()
    ));
    let mut colours = Checksum::new();
    colours.add(palette.as_flattened());
    line(format_args!("palette crc {:08x}", colours.value()));
    if header.content == Content::Page {
        return;
    }
    let mut planes = [(); 4].map(|()| Checksum::new());
    for row in header.rows() {
        load(row.at, &mut buffer[..row.pixels]);
        for (plane, checksum) in planes.iter_mut().enumerate() {
            let mut bytes = [0; MAX_WIDTH / 4];
            let of_plane = buffer[..row.pixels].iter().skip(plane).step_by(4);
            for (byte, &pixel) in bytes.iter_mut().zip(of_plane) {
                *byte = pixel;
            }
            checksum.add(&bytes[..row.pixels / 4]);
        }
    }
    for (plane, checksum) in planes.iter().enumerate() {
        line(format_args!("plane {plane} crc {:08x}", checksum.value()));
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::{String, ToString};
    use std::vec::Vec;

    fn header(content: Content) -> Header<&'static str> {
        Header {
            content,
            scene: "ball",
            model_file: None,
            mapper: Word::new("exact"),
            frame: Some(FrameName::Number(u32::MAX)),
            motion: None,
            start: 0x4B00,
            width: 320,
            height: 240,
        }
    }

    fn lines(content: Content) -> Vec<String> {
        let mut lines = Vec::new();
        write(
            &header(content),
            &[[0x3F, 0, 1]; 256],
            |at, pixels| pixels.fill(at as u8),
            |line| lines.push(line.to_string()),
        );
        lines
    }

    #[test]
    fn every_line_fits_and_is_labelled() {
        for (content, rows, last) in [
            (Content::Page, 240, "line 239 "),
            (Content::Memory, 820, "memory fff0 "),
        ] {
            let lines = lines(content);
            assert_eq!(lines.len(), 9 + 16 + rows + 1);
            assert_eq!(lines[0], "crystal-ball dump 5");
            assert_eq!(lines[1], std::format!("content {content:?}").to_lowercase());
            assert_eq!(
                lines[4..7],
                ["mapper exact", "frame 4294967295", "motion none"]
            );
            assert!(lines[24].starts_with("palette f0 3f0001 3f0001"));
            assert!(lines[rows + 24].starts_with(last), "{}", lines[rows + 24]);
            let mut all = Checksum::new();
            for line in &lines[..rows + 25] {
                all.add(line.as_bytes());
                all.add(b"\n");
            }
            let end = std::format!("end {} lines {:08x}", rows + 25, all.value());
            assert_eq!(lines[rows + 25], end);
            for line in &lines {
                let mut sent = Vec::new();
                crate::write_line(format_args!("{line}"), |bytes| {
                    sent.extend_from_slice(bytes)
                });
                let sent = String::from_utf8(sent).unwrap();
                assert_eq!(
                    crate::without_checksum(sent.trim_end()),
                    Ok(line.as_str()),
                    "the line was cut"
                );
            }
        }
    }

    #[test]
    fn rows_cover_the_planes_once() {
        let mut seen = std::vec![0; 4 * PLANE_BYTES];
        for row in header(Content::Memory).rows() {
            for i in 0..row.pixels {
                seen[4 * usize::from(row.at) + i] += 1;
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
        let wrapped = Header {
            start: 0xFFF0,
            ..header(Content::Page)
        };
        assert_eq!(wrapped.rows().nth(1).unwrap().at, 0x0040);
    }

    #[test]
    fn checksums_cover_the_bytes() {
        let mut lines = Vec::new();
        let mut addresses = 0;
        write_checksums(
            &header(Content::Memory),
            &[[1, 2, 3]; 256],
            |_, pixels| {
                addresses += pixels.len() / 4;
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    *pixel = i as u8 & 3;
                }
            },
            |line| lines.push(line.to_string()),
        );
        assert_eq!(addresses, 240 * 80 + PLANE_BYTES);
        let crc = |bytes: &[u8]| {
            let mut checksum = Checksum::new();
            checksum.add(bytes);
            std::format!("{:08x}", checksum.value())
        };
        assert_eq!(
            lines[0],
            std::format!("page start 4b00 crc {}", crc(&[0, 1, 2, 3].repeat(19_200)))
        );
        assert_eq!(
            lines[1],
            std::format!("palette crc {}", crc(&[1, 2, 3].repeat(256)))
        );
        for plane in 0..4 {
            let crc = crc(&std::vec![plane as u8; PLANE_BYTES]);
            assert_eq!(lines[2 + plane], std::format!("plane {plane} crc {crc}"));
        }
    }
}
