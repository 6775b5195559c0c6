//! Reads dumps on the host, checks each line, and writes them again.
//!
//! [`protocol::dump`] defines the format. The reader trusts nothing: each line must have a correct checksum and
//! the expected label, and the last line's count and checksum must match the lines before it. So a missing,
//! repeated or misplaced line is reported by its number.

use std::fmt;
use std::io::{self, Write};

use modex::Palette;
use protocol::dump::{COLOURS_A_LINE, Header, MAGIC, MAX_WIDTH, PLANE_BYTES, VERSION, Whole};
use protocol::{Content, FrameName, Lines, Motion, Word};

use crate::indexed::Indexed;
use system::quote::quoted;
use texmap::Mapper;

/// The contents of a VGA: its palette, and the pixels of a page or of all video memory.
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

/// Why a text is not a valid dump.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoDump {
    /// The number of the invalid line, counted from 1.
    pub line: usize,
    /// What is wrong with the line.
    pub why: String,
}

impl fmt::Display for NoDump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.why)
    }
}

impl std::error::Error for NoDump {}

impl Dump {
    /// Reads a dump from a file's bytes: lines with their checksums, ended by LF or CR LF.
    ///
    /// # Errors
    /// The first invalid line.
    pub fn read(bytes: &[u8]) -> Result<Self, NoDump> {
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
            texts.push(text.map_err(|why| NoDump {
                line: texts.len() + 1,
                why: if first { no_dump(&why) } else { why },
            })?);
        }
        if !bytes.is_empty() && !bytes.ends_with(b"\n") {
            return Err(NoDump {
                line: texts.len() + 1,
                why: match texts.is_empty() {
                    true => no_dump("it has no end"),
                    false => "it is cut short: the line has no end".into(),
                },
            });
        }
        Self::from_lines(&texts)
    }

    /// Reads a dump from its lines; their checksums have been checked and removed.
    ///
    /// # Errors
    /// As [`Dump::read`].
    pub fn from_lines(lines: &[impl AsRef<str>]) -> Result<Self, NoDump> {
        let mut reader = Reader {
            lines: lines.iter().map(AsRef::as_ref).collect(),
            read: 0,
            whole: Whole::default(),
        };
        reader.dump().map_err(|why| NoDump {
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
    pub fn frame(&self) -> Indexed {
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
        Indexed {
            width: width.into(),
            height: height.into(),
            palette: self.palette.to_vec(),
            pixels,
        }
    }
}

/// The oldest version of the format that can be read.
const OLDEST: u32 = 3;

fn no_dump(why: &str) -> String {
    format!("it is no dump: it does not begin with '{MAGIC} {VERSION}' ({why})")
}

/// Parses the lines of a dump, one after the other.
struct Reader<'a> {
    lines: Vec<&'a str>,
    read: usize,
    whole: Whole,
}

impl<'a> Reader<'a> {
    /// Returns the rest of the next line, which must begin with `label`.
    fn line(&mut self, label: &str) -> Result<&'a str, String> {
        let found = self.lines.get(self.read).copied();
        self.read += 1;
        let Some(line) = found else {
            return Err(format!("it is cut short: '{label}' should come here"));
        };
        let rest = line
            .strip_prefix(label)
            .and_then(|rest| rest.strip_prefix(' '));
        let rest = rest.ok_or_else(|| format!("{} stands where '{label}' should", quoted(line)))?;
        self.whole.add(format_args!("{line}"));
        Ok(rest)
    }

    fn dump(&mut self) -> Result<Dump, String> {
        let version = self.line(MAGIC).map_err(|why| no_dump(&why))?;
        let version = match version.parse() {
            Ok(version @ OLDEST..=VERSION) => version,
            _ => {
                return Err(format!(
                    "it is a dump of version {}; this program reads versions {OLDEST} to {VERSION}",
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
            let there = pixels.len() - before;
            if there != row.pixels {
                return Err(format!("it has {there} pixels, not {}", row.pixels));
            }
        }
        let end = self.whole.to_string();
        let said = self.line("end")?;
        if format!("end {said}") != end {
            return Err(format!(
                "it ends in {}, but the lines before it make '{end}'",
                quoted(said)
            ));
        }
        if self.read < self.lines.len() {
            self.read += 1;
            return Err("there is more after the dump's end".into());
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
                return Err(format!("content is 'page' or 'memory', not {other}"));
            }
        };
        let scene = self.line("scene")?;
        let scene = Word::new(scene).ok_or_else(|| format!("{} is no scene", quoted(scene)))?;
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
                    .map_err(|_| "a model file's checksum has eight digits")?;
                Some(u32::from_be_bytes(checksum))
            }
        };
        let mapper = match self.line("mapper")? {
            "none" => None,
            // Version 5 renamed some mappers.
            old if version < 5 && Mapper::renamed(old).is_some() => {
                Mapper::renamed(old).and_then(Word::new)
            }
            name => Some(Word::new(name).ok_or_else(|| format!("{} is no mapper", quoted(name)))?),
        };
        let frame = match self.line(frame)? {
            "none" => None,
            name => Some(
                FrameName::parse(name.split(' '))
                    .ok_or_else(|| format!("{} is no frame", quoted(name)))?,
            ),
        };
        // Version 3 named a mapper before the first frame, and had no line `motion`.
        let mapper = mapper.filter(|_| frame.is_some());
        let motion = match version {
            ..4 => None,
            _ => match self.line("motion")? {
                "none" => None,
                parts => Some(Motion::parse(parts.split(' ')).ok_or_else(|| {
                    format!("{} is no motion: it has four hex numbers", quoted(parts))
                })?),
            },
        };
        let mut start = Vec::new();
        hex(self.line("start")?, &mut start)?;
        let start: [u8; 2] = start
            .try_into()
            .map_err(|_| "a start address has four digits")?;
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
            format!("{size} is no size: a width in fours up to {MAX_WIDTH}, and a height")
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
                    return Err(format!("{colour} is no colour: three parts of 00 to 3f"));
                }
            }
            let there = parts.len() / 3 - first;
            if there != COLOURS_A_LINE {
                return Err(format!("it has {there} colours, not {COLOURS_A_LINE}"));
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
            byte.ok_or_else(|| format!("{} is no pair of digits 0 to 9 and a to f", quoted(pair)))?,
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dump() -> Dump {
        Dump {
            header: Header {
                content: Content::Page,
                scene: "cube".into(),
                model_file: None,
                mapper: Word::new("exact"),
                frame: Some(FrameName::Number(7)),
                motion: Some(Motion {
                    yaw: 1,
                    pitch: u32::MAX,
                    roll: 0,
                    distance: 0xFFFF_0000,
                }),
                start: 0,
                width: 320,
                height: 240,
            },
            palette: [[1, 2, 3]; 256],
            pixels: vec![7; 320 * 240],
        }
    }

    /// Returns the lines with a new last line that matches the lines before it.
    fn ended(mut lines: Vec<String>) -> Vec<String> {
        lines.pop();
        let mut whole = Whole::default();
        for line in &lines {
            whole.add(format_args!("{line}"));
        }
        lines.push(whole.to_string());
        lines
    }

    #[test]
    fn a_header_comes_back_with_its_motion_and_without_a_frame() {
        let mut dump = dump();
        assert_eq!(
            dump.lines()[4..7],
            [
                "mapper exact",
                "frame 7",
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

    /// Returns the lines with the words of versions 3 and 4.
    fn old_words(lines: Vec<String>) -> Vec<String> {
        let old = |line: String| match line.split_once(' ') {
            Some(("model", checksum)) => format!("pack {checksum}"),
            Some(("frame", name)) => format!("picture {name}"),
            _ => line,
        };
        lines.into_iter().map(old).collect()
    }

    #[test]
    fn version_4_is_read_with_its_own_words() {
        let mut lines = old_words(dump().lines());
        lines[0] = format!("{MAGIC} 4");
        assert_eq!(Dump::from_lines(&ended(lines.clone())).unwrap(), dump());
        let mut renamed = lines.clone();
        renamed[4] = "mapper level".into();
        let header = Dump::from_lines(&ended(renamed)).unwrap().header;
        assert_eq!(header.mapper, Word::new("constant-z"));
        lines[0] = format!("{MAGIC} 5");
        let error = Dump::from_lines(&ended(lines)).unwrap_err();
        assert_eq!(error.line, 4);
        assert!(error.why.contains("'model' should"), "{error}");
    }

    #[test]
    fn version_3_is_read_as_a_dump_without_motion() {
        let mut old = dump();
        old.header.motion = None;
        let mut lines = old_words(old.lines());
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
        assert!(error.why.contains("'motion' should"), "{error}");
    }

    #[test]
    fn other_versions_and_motions_are_refused_by_line() {
        for (at, line, why) in [
            (0, "crystal-ball dump 2", "reads versions 3 to 5"),
            (0, "crystal-ball dump 6", "reads versions 3 to 5"),
            (0, "crystal-ball dump four", "version 'four'"),
            (6, "motion 1 2 3", "it has four hex numbers"),
            (6, "motion 1 2 3 -4", "it has four hex numbers"),
        ] {
            let mut lines = dump().lines();
            lines[at] = line.into();
            let error = Dump::from_lines(&ended(lines)).unwrap_err();
            assert_eq!(error.line, at + 1, "{error}");
            assert!(error.why.contains(why), "{line}: {error}");
        }
    }
}
