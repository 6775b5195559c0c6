//! Reads dumps on the host, checks each line, and writes them again.
//!
//! [`protocol::dump`] defines the format. The reader trusts nothing: each line must have a correct checksum
//! and the expected label, and the last line's count and checksum must match the lines before it. So a
//! missing, repeated or misplaced line is reported by its number.

use std::fmt;
use std::io::{self, Write};

use modex::Palette;
use protocol::dump::{
    COLOURS_A_LINE, DumpChecksum, Header, MAGIC, MAX_WIDTH, PLANE_BYTES, VERSION,
};
use protocol::{Content, FrameName, Lines, Motion, Word};

use crate::indexed::IndexedImage;
use system::quote::quoted;
use texmap::Mapper;

/// A dump: a VGA's palette, and the pixels of a page or of all video memory.
#[derive(Clone, PartialEq, Eq)]
pub struct Dump {
    /// The frame in the dump, and how it was drawn.
    pub header: Header<String>,
    /// The DAC's colours, 6 bits per component.
    pub palette: Palette,
    /// The pixels, row by row. For all video memory, pixel i is in plane i & 3 at address i / 4.
    pub pixels: Vec<u8>,
}

impl fmt::Debug for Dump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a dump of {:?}", self.header)
    }
}

/// The reason why a text is not a valid dump.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DumpError {
    /// The number of the invalid line, counted from 1.
    pub line: usize,
    /// What is wrong with the line.
    pub why: String,
}

impl fmt::Display for DumpError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.why)
    }
}

impl std::error::Error for DumpError {}

impl Dump {
    /// Returns a dump of an artificial frame: an example for tests and documentation. All colours differ, and
    /// equal pixels are far apart.
    pub fn example(content: Content) -> Self {
        let pixels = match content {
            Content::Page => modex::WIDTH * modex::HEIGHT,
            Content::Memory => 4 * PLANE_BYTES,
        };
        Self {
            header: Header {
                content,
                scene: "ball".into(),
                model_file: None,
                mapper: Word::new("exact"),
                frame: Some(FrameName::Number(480)),
                motion: None,
                start: 0x4B00,
                width: modex::WIDTH as u16,
                height: modex::HEIGHT as u16,
            },
            palette: std::array::from_fn(|i| [(i >> 2) as u8, (i & 0x3F) as u8, (i & 3) as u8]),
            pixels: (0..pixels).map(|i| (i % 251) as u8).collect(),
        }
    }

    /// Reads a dump from a file's bytes: lines with their checksums, ended by LF or CR LF.
    ///
    /// # Errors
    /// The first invalid line.
    pub fn read(bytes: &[u8]) -> Result<Self, DumpError> {
        let (mut lines, mut texts) = (Lines::new(), Vec::new());
        for &byte in bytes {
            let Some(line) = lines.push(byte) else {
                continue;
            };
            let text = line.map_err(|noise| noise.to_string()).and_then(|line| {
                match protocol::without_checksum(line) {
                    Ok(text) => Ok(text.to_string()),
                    Err(error) => Err(error.to_string()),
                }
            });
            // For a file of an entirely different kind, the error says that it is not a dump, not what its
            // bytes are.
            let first = texts.is_empty();
            texts.push(text.map_err(|why| DumpError {
                line: texts.len() + 1,
                why: if first { not_a_dump(&why) } else { why },
            })?);
        }
        if !bytes.is_empty() && !bytes.ends_with(b"\n") {
            return Err(DumpError {
                line: texts.len() + 1,
                why: match texts.is_empty() {
                    true => not_a_dump("the line has no end"),
                    false => "the dump is cut short: this line has no end".into(),
                },
            });
        }
        Self::from_lines(&texts)
    }

    /// Reads a dump from its lines; their checksums have been checked and removed.
    ///
    /// # Errors
    /// As [`Dump::read`].
    pub fn from_lines(lines: &[impl AsRef<str>]) -> Result<Self, DumpError> {
        let mut reader = DumpReader {
            lines: lines.iter().map(AsRef::as_ref).collect(),
            read: 0,
            whole: DumpChecksum::default(),
        };
        reader.dump().map_err(|why| DumpError {
            line: reader.read.max(1),
            why,
        })
    }

    /// Returns the dump's lines without their checksums.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        self.write_lines(|line| lines.push(line.to_string()));
        lines
    }

    /// Writes the dump as the kernel does, each line with its checksum.
    ///
    /// # Errors
    /// The writer's error.
    pub fn write(&self, mut to: impl Write) -> io::Result<()> {
        let mut outcome = Ok(());
        self.write_lines(|line| {
            let mut framed = Vec::new();
            protocol::write_line(line, |bytes| framed.extend_from_slice(bytes));
            if outcome.is_ok() {
                outcome = to.write_all(&framed);
            }
        });
        outcome
    }

    /// Returns the checksums of the dump, as the kernel sends them.
    pub fn checksums(&self) -> Vec<String> {
        let mut lines = Vec::new();
        protocol::dump::write_checksums(
            &self.header,
            &self.palette,
            |at, row| self.load(at, row),
            |line| lines.push(line.to_string()),
        );
        lines
    }

    /// Copies pixels into `row`, from address `at` on, as a read of the VGA would return them.
    fn load(&self, at: u16, row: &mut [u8]) {
        let first = match self.header.content {
            Content::Page => at.wrapping_sub(self.header.start),
            Content::Memory => at,
        };
        for (i, pixel) in row.iter_mut().enumerate() {
            // Addresses have 16 bits and wrap.
            let address = first.wrapping_add((i / 4) as u16);
            *pixel = self.pixels[4 * usize::from(address) + i % 4];
        }
    }

    fn write_lines(&self, line: impl FnMut(fmt::Arguments<'_>)) {
        protocol::dump::write(
            &self.header,
            &self.palette,
            |at, row| self.load(at, row),
            line,
        );
    }

    /// Returns the frame on the screen.
    pub fn frame(&self) -> IndexedImage {
        let Header {
            width,
            height,
            start,
            ..
        } = self.header;
        let pixels = match self.header.content {
            Content::Page => self.pixels.clone(),
            Content::Memory => {
                let mut pixels = vec![0; usize::from(width) * usize::from(height)];
                for (y, row) in (0..).zip(pixels.chunks_exact_mut(width.into())) {
                    self.load(start.wrapping_add(y * (width / 4)), row);
                }
                pixels
            }
        };
        IndexedImage {
            width: width.into(),
            height: height.into(),
            palette: self.palette.to_vec(),
            pixels,
        }
    }
}

/// The oldest version of the format that can be read.
const OLDEST: u32 = 3;

fn not_a_dump(why: &str) -> String {
    format!("not a dump: a dump begins with '{MAGIC} {VERSION}' ({why})")
}

/// Parses the lines of a dump, one after the other.
struct DumpReader<'a> {
    lines: Vec<&'a str>,
    read: usize,
    whole: DumpChecksum,
}

impl<'a> DumpReader<'a> {
    /// Returns the rest of the next line, which must begin with `label`.
    fn line(&mut self, label: &str) -> Result<&'a str, String> {
        let found = self.lines.get(self.read).copied();
        self.read += 1;
        let Some(line) = found else {
            return Err(format!("the dump is cut short: expected '{label}'"));
        };
        let rest = line
            .strip_prefix(label)
            .and_then(|rest| rest.strip_prefix(' '));
        let rest = rest.ok_or_else(|| format!("expected '{label}', found {}", quoted(line)))?;
        self.whole.add(format_args!("{line}"));
        Ok(rest)
    }

    fn dump(&mut self) -> Result<Dump, String> {
        let version = self.line(MAGIC).map_err(|why| not_a_dump(&why))?;
        let version = match version.parse() {
            Ok(version @ OLDEST..=VERSION) => version,
            _ => {
                return Err(format!(
                    "dump version {} is not supported; this program reads versions {OLDEST} to {VERSION}",
                    version
                        .parse::<u32>()
                        .map_or(quoted(version), |known| known.to_string())
                ));
            }
        };
        let header = self.header(version)?;
        let palette = self.palette()?;
        let mut pixels = Vec::with_capacity(4 * PLANE_BYTES);
        for row in header.rows() {
            let digits = self.line(&row.to_string())?;
            let before = pixels.len();
            hex(digits, &mut pixels)?;
            let found = pixels.len() - before;
            if found != row.pixels {
                return Err(format!("expected {} pixels, found {found}", row.pixels));
            }
        }
        let end = self.whole.to_string();
        let found = format!("end {}", self.line("end")?);
        if found != end {
            return Err(format!(
                "the lines before this line add up to '{end}', found {}",
                quoted(found)
            ));
        }
        if self.read < self.lines.len() {
            self.read += 1;
            return Err("expected the end of the dump, found another line".into());
        }
        Ok(Dump {
            header,
            palette,
            pixels,
        })
    }

    fn header(&mut self, version: u32) -> Result<Header<String>, String> {
        let content = match self.line("content")? {
            "page" => Content::Page,
            "memory" => Content::Memory,
            other => {
                let other = quoted(other);
                return Err(format!("expected 'page' or 'memory', found {other}"));
            }
        };
        let scene = self.line("scene")?;
        let scene =
            Word::new(scene).ok_or_else(|| format!("{} is not a scene's name", quoted(scene)))?;
        // Version 5 renamed two lines.
        let (model, frame) = match version {
            ..5 => ("pack", "picture"),
            _ => ("model", "frame"),
        };
        let model_file = match self.line(model)? {
            "none" => None,
            digits => {
                let mut checksum = Vec::new();
                hex(digits, &mut checksum)?;
                let checksum: [u8; 4] = checksum
                    .try_into()
                    .map_err(|_| "a model file's checksum has eight hex digits")?;
                Some(u32::from_be_bytes(checksum))
            }
        };
        let mapper = match self.line("mapper")? {
            "none" => None,
            name => {
                // Version 5 renamed some mappers.
                let new = Mapper::renamed(name).filter(|_| version < 5);
                let word = Word::new(new.unwrap_or(name));
                Some(word.ok_or_else(|| format!("{} is not a mapper's name", quoted(name)))?)
            }
        };
        let frame = match self.line(frame)? {
            "none" => None,
            name => Some(
                FrameName::parse(name.split(' '))
                    .ok_or_else(|| format!("{} is not a frame's name", quoted(name)))?,
            ),
        };
        // Version 3 named a mapper before the first frame, and had no line `motion`.
        let mapper = mapper.filter(|_| frame.is_some());
        let motion = match version {
            ..4 => None,
            _ => match self.line("motion")? {
                "none" => None,
                parts => Some(Motion::parse(parts.split(' ')).ok_or_else(|| {
                    format!(
                        "{} is not a motion; a motion has four hex numbers",
                        quoted(parts)
                    )
                })?),
            },
        };
        let mut start = Vec::new();
        hex(self.line("start")?, &mut start)?;
        let start: [u8; 2] = start
            .try_into()
            .map_err(|_| "a start address has four hex digits")?;
        let size = self.line("size")?;
        let sides = size.split_once(' ');
        let sides = sides.and_then(|(w, h)| Some((w.parse::<u16>().ok()?, h.parse::<u16>().ok()?)));
        let legal = |&(width, height): &(u16, u16)| {
            let (width, height) = (usize::from(width), usize::from(height));
            width > 0
                && width % 4 == 0
                && width <= MAX_WIDTH
                && height > 0
                && width / 4 * height <= PLANE_BYTES
        };
        let (width, height) = sides.filter(legal).ok_or_else(|| {
            let size = quoted(size);
            format!(
                "{size} is not a size; a size is a width, which is a multiple of 4 up to {MAX_WIDTH}, \
                 and a height"
            )
        })?;
        Ok(Header {
            content,
            scene: scene.to_string(),
            model_file,
            mapper,
            frame,
            motion,
            start: u16::from_be_bytes(start),
            width,
            height,
        })
    }

    fn palette(&mut self) -> Result<Palette, String> {
        let mut parts = Vec::with_capacity(3 * 256);
        for first in (0..256).step_by(COLOURS_A_LINE) {
            let colours = self.line(&format!("palette {first:02x}"))?;
            for colour in colours.split(' ') {
                let before = parts.len();
                hex(colour, &mut parts)?;
                if parts.len() - before != 3 || parts[before..].iter().any(|&part| part > 0x3F) {
                    let colour = quoted(colour);
                    return Err(format!(
                        "{colour} is not a colour; a colour has three parts from 00 to 3f"
                    ));
                }
            }
            let found = parts.len() / 3 - first;
            if found != COLOURS_A_LINE {
                return Err(format!("expected {COLOURS_A_LINE} colours, found {found}"));
            }
        }
        let (colours, _) = parts.as_chunks::<3>();
        colours
            .try_into()
            .map_err(|_| "a palette has 256 colours".into())
    }
}

/// Appends the bytes that the lower-case hex digits encode.
fn hex(digits: &str, bytes: &mut Vec<u8>) -> Result<(), String> {
    let nibble = |digit: u8| match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'a'..=b'f' => Some(digit - b'a' + 10),
        _ => None,
    };
    for pair in digits.as_bytes().chunks(2) {
        let byte = match *pair {
            [high, low] => nibble(high)
                .zip(nibble(low))
                .map(|(high, low)| high << 4 | low),
            _ => None,
        };
        bytes.push(
            byte.ok_or_else(|| format!("{} is not two hex digits (0 to 9, a to f)", quoted(pair)))?,
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dump() -> Dump {
        let mut dump = Dump::example(Content::Page);
        dump.header.motion = Some(Motion {
            yaw: 1,
            pitch: u32::MAX,
            roll: 0,
            distance: 0xFFFF_0000,
        });
        dump
    }

    /// Returns the lines with a new last line that matches the lines before it.
    fn ended(mut lines: Vec<String>) -> Vec<String> {
        lines.pop();
        let mut whole = DumpChecksum::default();
        for line in &lines {
            whole.add(format_args!("{line}"));
        }
        lines.push(whole.to_string());
        lines
    }

    #[test]
    fn a_header_with_a_motion_and_a_header_without_a_frame_are_read_back() {
        let mut dump = dump();
        assert_eq!(
            dump.lines()[4..7],
            [
                "mapper exact",
                "frame 480",
                "motion 00000001 ffffffff 00000000 ffff0000"
            ]
        );
        assert_eq!(Dump::from_lines(&dump.lines()).unwrap(), dump);
        let header = &mut dump.header;
        (header.mapper, header.frame, header.motion) = (None, None, None);
        assert_eq!(
            dump.lines()[4..7],
            ["mapper none", "frame none", "motion none"]
        );
        assert_eq!(Dump::from_lines(&dump.lines()).unwrap(), dump);
    }

    /// Returns the lines with the labels of versions 3 and 4.
    fn old_labels(lines: Vec<String>) -> Vec<String> {
        let old = |line: String| match line.split_once(' ') {
            Some(("model", checksum)) => format!("pack {checksum}"),
            Some(("frame", name)) => format!("picture {name}"),
            _ => line,
        };
        lines.into_iter().map(old).collect()
    }

    #[test]
    fn version_4_is_read_with_the_labels_of_version_4() {
        let mut lines = old_labels(dump().lines());
        lines[0] = format!("{MAGIC} 4");
        assert_eq!(Dump::from_lines(&ended(lines.clone())).unwrap(), dump());
        let mut renamed = lines.clone();
        renamed[4] = "mapper level".into();
        let header = Dump::from_lines(&ended(renamed)).unwrap().header;
        assert_eq!(header.mapper, Word::new("constant-z"));
        lines[0] = format!("{MAGIC} 5");
        let error = Dump::from_lines(&ended(lines)).unwrap_err();
        assert_eq!(error.line, 4);
        assert!(error.why.contains("expected 'model'"), "{error}");
    }

    #[test]
    fn version_3_is_read_as_a_dump_without_motion() {
        let mut old = dump();
        old.header.motion = None;
        let mut lines = old_labels(old.lines());
        lines[0] = format!("{MAGIC} 3");
        assert_eq!(lines.remove(6), "motion none");
        assert_eq!(Dump::from_lines(&ended(lines.clone())).unwrap(), old);
        // Version 3 named a mapper even before the first frame.
        lines[5] = "picture none".into();
        let header = Dump::from_lines(&ended(lines.clone())).unwrap().header;
        assert_eq!((header.mapper, header.frame), (None, None));
        lines[0] = format!("{MAGIC} 4");
        let error = Dump::from_lines(&ended(lines)).unwrap_err();
        assert_eq!(error.line, 7);
        assert!(error.why.contains("expected 'motion'"), "{error}");
    }

    #[test]
    fn an_unknown_version_or_a_wrong_motion_is_refused_with_its_line() {
        for (at, line, why) in [
            (0, "crystal-ball dump 2", "reads versions 3 to 5"),
            (0, "crystal-ball dump 6", "reads versions 3 to 5"),
            (0, "crystal-ball dump four", "version 'four'"),
            (6, "motion 1 2 3", "a motion has four hex numbers"),
            (6, "motion 1 2 3 -4", "a motion has four hex numbers"),
        ] {
            let mut lines = dump().lines();
            lines[at] = line.into();
            let error = Dump::from_lines(&ended(lines)).unwrap_err();
            assert_eq!(error.line, at + 1, "{error}");
            assert!(error.why.contains(why), "{line}: {error}");
        }
    }
}
