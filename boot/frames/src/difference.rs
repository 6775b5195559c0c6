//! Compares two dumps or indexed PNGs, byte by byte.
//!
//! The comparison uses indices, not colours: it compares what video memory holds, not how the frame looks.
//! The palette is compared separately. If a comparison is impossible, the result is an error, never "equal".

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fmt;
use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

use anyhow::{Context, bail};
use modex::Rgb6;
use protocol::Content;
use protocol::dump::{MAGIC, OrNone, PLANE_BYTES};

use crate::dump::Dump;
use crate::indexed::IndexedImage;
use system::quote;

/// The first bytes of every PNG.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
/// The largest number of bytes to read from a file. A dump of all memory has about half a million. The limit
/// exists because some files, such as devices, have no end.
const MAX_BYTES: u64 = 1 << 26;
/// The largest number of pixels in a PNG. A PNG's header may claim more pixels than fit into memory.
const MAX_PIXELS: u64 = 1 << 24;

/// A captured frame: one side of a comparison.
#[derive(Clone, Debug, PartialEq, Eq)]
#[expect(
    clippy::large_enum_variant,
    reason = "both variants have their pixels on the heap"
)]
pub enum Capture {
    /// The contents of a VGA.
    Dump(Dump),
    /// A frame from an indexed PNG.
    Png(IndexedImage),
}

impl Capture {
    /// Reads a PNG or a dump. The content decides which, not the name.
    ///
    /// # Errors
    /// A file that cannot be read, or is neither a PNG nor a dump. The error names the file and, for a
    /// damaged dump, the line.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        Self::load(path).with_context(|| quote::path(path))
    }

    fn load(path: &Path) -> anyhow::Result<Self> {
        let mut bytes = Vec::new();
        File::open(path)
            .and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes))
            .context("cannot be read")?;
        if bytes.len() as u64 > MAX_BYTES {
            bail!("the file has more than {MAX_BYTES} bytes; a dump or a frame's PNG has fewer");
        }
        if bytes.starts_with(PNG) {
            return Ok(Self::Png(read_png(&bytes)?));
        }
        let dump = Dump::read(&bytes);
        Ok(Self::Dump(dump.map_err(|error| {
            anyhow::anyhow!(if bytes.starts_with(MAGIC.as_bytes()) {
                format!("{error}; take the dump again")
            } else {
                format!("{error}, and not a PNG; give a dump or an indexed PNG")
            })
        })?))
    }

    /// Returns the frame on the screen.
    pub(crate) fn frame(&self) -> Cow<'_, IndexedImage> {
        match self {
            Self::Dump(dump) => Cow::Owned(dump.frame()),
            Self::Png(frame) => Cow::Borrowed(frame),
        }
    }
}

fn read_png(bytes: &[u8]) -> anyhow::Result<IndexedImage> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    let damaged = "the PNG is damaged or cut short";
    let header = decoder.read_header_info().context(damaged)?;
    let (width, height) = (header.width, header.height);
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        bail!("the PNG's header claims {width} x {height} pixels; the limit is {MAX_PIXELS}");
    }
    IndexedImage::read_png(Cursor::new(bytes)).map_err(|error| {
        if error.is::<png::DecodingError>() {
            error.context(damaged)
        } else {
            error
        }
    })
}

/// The difference between two captures; [`Display`](fmt::Display) describes it in one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The pixels that differ; for dumps of all memory, the bytes.
    pub pixels: Option<PixelDifference>,
    /// The palette entries that differ.
    pub palette: Option<PaletteDifference>,
    /// The fields of the dumps' headers that differ.
    pub fields: Vec<HeaderDifference>,
}

/// The pixels, or bytes of video memory, that differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PixelDifference {
    /// The first difference: the leftmost on the uppermost line. In memory: the lowest plane at the lowest
    /// address.
    pub first: PixelPosition,
    /// The expected value of the first difference.
    pub expected: u8,
    /// The actual value of the first difference.
    pub got: u8,
    /// The number of pixels that differ.
    pub count: usize,
    /// The number of pixels compared.
    pub of: usize,
    /// The bounding box of the differences. For memory the box is in an image whose lines are the dump's
    /// lines.
    pub bounds: Bounds,
    /// The number of differences in each plane.
    pub planes: [usize; 4],
    /// The number of differences in each page, and last the number past the last page. Empty unless all video
    /// memory was compared.
    pub pages: Vec<usize>,
}

/// The position of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelPosition {
    /// The plane.
    pub plane: usize,
    /// The distance from the left edge of the pixel's page.
    pub x: usize,
    /// The distance from the top edge of the pixel's page.
    pub y: usize,
    /// The address in video memory, if all of it was compared.
    pub memory: Option<MemoryAddress>,
}

/// The address of a byte in video memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryAddress {
    /// The address in the plane.
    pub address: u16,
    /// The page that contains the byte; `None` past the last page.
    pub page: Option<usize>,
}

/// A box of pixels; both ends are included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// The leftmost column.
    pub x0: usize,
    /// The rightmost column.
    pub x1: usize,
    /// The uppermost line.
    pub y0: usize,
    /// The lowest line.
    pub y1: usize,
}

/// The palette entries that differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PaletteDifference {
    /// The index of the first entry that differs.
    pub first: usize,
    /// The expected colour of the first entry; `None` if the expected palette is shorter.
    pub expected: Option<Rgb6>,
    /// The actual colour of the first entry; `None` if the actual palette is shorter.
    pub got: Option<Rgb6>,
    /// The number of entries that differ.
    pub count: usize,
    /// The number of entries in the longer palette.
    pub of: usize,
}

/// A field of the dumps' headers that differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeaderDifference {
    /// The field's label.
    pub name: &'static str,
    /// The expected value.
    pub expected: String,
    /// The actual value.
    pub got: String,
}

/// The layout of a capture's pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelLayout {
    /// Pixels in a line.
    pub width: usize,
    /// The lines of a page, if the pixels are all of video memory; `None` for a single page.
    pub memory: Option<usize>,
}

impl PixelLayout {
    pub fn place(&self, i: usize) -> PixelPosition {
        let (x, y) = (i % self.width, i / self.width);
        let (y, memory) = match self.memory {
            None => (y, None),
            Some(height) => {
                let page = Some(y / height).filter(|&page| page < self.pages(height));
                let address = (i / 4) as u16;
                (y % height, Some(MemoryAddress { address, page }))
            }
        };
        PixelPosition {
            plane: i & 3,
            x,
            y,
            memory,
        }
    }

    /// Returns the number of whole pages in video memory.
    fn pages(&self, height: usize) -> usize {
        4 * PLANE_BYTES / (self.width * height)
    }

    /// Compares pixels of this layout; `None` if they are equal.
    pub fn compare(&self, expected: &[u8], got: &[u8]) -> Option<PixelDifference> {
        let mut planes = [0; 4];
        let mut pages = match self.memory {
            Some(height) => vec![0; self.pages(height) + 1],
            None => Vec::new(),
        };
        let past = pages.len().saturating_sub(1);
        let mut found: Option<PixelDifference> = None;
        for (i, (&expected, &got)) in expected.iter().zip(got).enumerate() {
            if expected == got {
                continue;
            }
            let place = self.place(i);
            planes[place.plane] += 1;
            if let Some(memory) = place.memory {
                pages[memory.page.unwrap_or(past)] += 1;
            }
            let (x, y) = (i % self.width, i / self.width);
            let pixels = found.get_or_insert(PixelDifference {
                first: place,
                expected,
                got,
                count: 0,
                of: 0,
                bounds: Bounds {
                    x0: x,
                    x1: x,
                    y0: y,
                    y1: y,
                },
                planes,
                pages: Vec::new(),
            });
            let Bounds { x0, x1, y0, y1 } = pixels.bounds;
            pixels.bounds = Bounds {
                x0: x0.min(x),
                x1: x1.max(x),
                y0: y0.min(y),
                y1: y1.max(y),
            };
        }
        let found = found?;
        Some(PixelDifference {
            count: planes.iter().sum(),
            of: expected.len(),
            planes,
            pages,
            ..found
        })
    }
}

/// Compares two captures; `None` if they are equal. A dump and a PNG are compared as frames.
///
/// # Errors
/// Captures that cannot be compared: different contents, sizes or models, or palettes that hold the same
/// colours in a different order. Some programs reorder a PNG's palette, and the indices then mean nothing.
pub fn compare(expected: &Capture, got: &Capture) -> anyhow::Result<Option<Difference>> {
    let difference = match (expected, got) {
        (Capture::Dump(expected), Capture::Dump(got)) => compare_dumps(expected, got)?,
        (expected, got) => {
            let (expected, got) = (expected.frame(), got.frame());
            same_size((expected.width, expected.height), (got.width, got.height))?;
            same_order(&expected.palette, &got.palette)?;
            let layout = PixelLayout {
                width: expected.width,
                memory: None,
            };
            Difference {
                pixels: layout.compare(&expected.pixels, &got.pixels),
                palette: compare_palettes(&expected.palette, &got.palette),
                fields: Vec::new(),
            }
        }
    };
    Ok((!difference.is_none()).then_some(difference))
}

fn compare_dumps(expected: &Dump, got: &Dump) -> anyhow::Result<Difference> {
    let (a, b) = (&expected.header, &got.header);
    if a.content != b.content {
        bail!(
            "expected is a dump of {}, got a dump of {}; take both with --all or both without",
            content(a.content),
            content(b.content)
        );
    }
    same_size((a.width, a.height), (b.width, b.height))?;
    if let (Some(expected), Some(got)) = (a.model_file, b.model_file)
        && expected != got
    {
        bail!(
            "the dumps show different models: expected has the model file {expected:08x}, got has \
             {got:08x}; take both with the same --model and --texture"
        );
    }
    let model_file = |model_file: Option<u32>| {
        model_file.map_or("none".into(), |model_file| format!("{model_file:08x}"))
    };
    let fields = [
        ("scene", a.scene.clone(), b.scene.clone()),
        ("model", model_file(a.model_file), model_file(b.model_file)),
        (
            "mapper",
            OrNone(&a.mapper).to_string(),
            OrNone(&b.mapper).to_string(),
        ),
        (
            "frame",
            OrNone(&a.frame).to_string(),
            OrNone(&b.frame).to_string(),
        ),
        (
            "motion",
            OrNone(&a.motion).to_string(),
            OrNone(&b.motion).to_string(),
        ),
        (
            "start",
            format!("{:04x}", a.start),
            format!("{:04x}", b.start),
        ),
    ];
    let field = |(name, expected, got)| HeaderDifference {
        name,
        expected,
        got,
    };
    let layout = PixelLayout {
        width: a.width.into(),
        memory: (a.content == Content::Memory).then_some(a.height.into()),
    };
    Ok(Difference {
        pixels: layout.compare(&expected.pixels, &got.pixels),
        palette: compare_palettes(&expected.palette, &got.palette),
        fields: fields
            .into_iter()
            .filter(|(_, expected, got)| expected != got)
            .map(field)
            .collect(),
    })
}

fn content(content: Content) -> &'static str {
    match content {
        Content::Page => "a page",
        Content::Memory => "all memory",
    }
}

fn same_size<T: PartialEq + fmt::Display>(expected: (T, T), got: (T, T)) -> anyhow::Result<()> {
    if expected != got {
        bail!(
            "expected is {} x {} pixels, got is {} x {}; both must have the same size",
            expected.0,
            expected.1,
            got.0,
            got.1
        );
    }
    Ok(())
}

/// Refuses palettes that hold the same colours in a different order.
fn same_order(expected: &[Rgb6], got: &[Rgb6]) -> anyhow::Result<()> {
    let mut pairs = expected.iter().zip(got).enumerate();
    let Some((entry, (a, b))) = pairs.find(|(_, (a, b))| a != b) else {
        return Ok(());
    };
    let set = |palette: &[Rgb6]| palette.iter().copied().collect::<BTreeSet<_>>();
    if set(expected) == set(got) {
        bail!(
            "the palettes hold the same colours in another order (entry {entry:02x}: expected {}, \
             got {}), so indices cannot be compared; give the PNG as this program wrote it",
            HexColour(*a),
            HexColour(*b)
        );
    }
    Ok(())
}

fn compare_palettes(expected: &[Rgb6], got: &[Rgb6]) -> Option<PaletteDifference> {
    let of = expected.len().max(got.len());
    let mut entries = differing_entries(expected, got);
    let first = entries.next()?;
    Some(PaletteDifference {
        first,
        expected: expected.get(first).copied(),
        got: got.get(first).copied(),
        count: 1 + entries.count(),
        of,
    })
}

/// Returns the indices of the palette entries that differ.
pub(crate) fn differing_entries(expected: &[Rgb6], got: &[Rgb6]) -> impl Iterator<Item = usize> {
    let of = expected.len().max(got.len());
    (0..of).filter(|&entry| expected.get(entry) != got.get(entry))
}

/// A colour, in the notation of dumps.
pub(crate) struct HexColour(pub Rgb6);

impl fmt::Display for HexColour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [red, green, blue] = self.0;
        write!(f, "{red:02x}{green:02x}{blue:02x}")
    }
}

/// Returns an entry's colour in the notation of dumps, or `nothing` for a missing entry.
pub(crate) fn colour(colour: Option<Rgb6>) -> String {
    colour.map_or("nothing".into(), |colour| HexColour(colour).to_string())
}

impl Difference {
    fn is_none(&self) -> bool {
        self.pixels.is_none() && self.palette.is_none() && self.fields.is_empty()
    }

    /// Returns one description for each kind of difference.
    pub(crate) fn parts(&self) -> Vec<String> {
        let pixels = self.pixels.iter().map(ToString::to_string);
        let palette = self.palette.iter().map(ToString::to_string);
        let fields = self.fields.iter().map(ToString::to_string);
        pixels.chain(palette).chain(fields).collect()
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.parts().join("; "))
    }
}

/// Writes "`count` of `of` `what` differ", or "differs" for one.
fn differ(f: &mut fmt::Formatter<'_>, count: usize, of: usize, what: &str) -> fmt::Result {
    let s = if count == 1 { "s" } else { "" };
    write!(f, "{count} of {of} {what} differ{s}")
}

impl fmt::Display for PixelDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let memory = !self.pages.is_empty();
        let what = if memory { "bytes" } else { "pixels" };
        differ(f, self.count, self.of, what)?;
        let (expected, got) = (self.expected, self.got);
        write!(
            f,
            ", first {}: expected {expected:02x}, got {got:02x}",
            self.first
        )?;
        if !memory {
            return match self.count {
                1 => Ok(()),
                _ => write!(f, "; all in {}", self.bounds),
            };
        }
        let [p0, p1, p2, p3] = self.planes;
        write!(f, "; in plane 0: {p0}, 1: {p1}, 2: {p2}, 3: {p3}")?;
        let past = self.pages.len() - 1;
        for (page, count) in self.pages.iter().enumerate().filter(|&(_, &n)| n > 0) {
            match page == past {
                true => write!(f, "; past the last page: {count}")?,
                false => write!(f, "; in page {page}: {count}")?,
            }
        }
        Ok(())
    }
}

impl fmt::Display for PixelPosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            plane,
            x,
            y,
            memory,
        } = self;
        match memory {
            None => write!(f, "plane {plane}, x {x}, y {y}"),
            Some(MemoryAddress { address, page }) => {
                write!(f, "plane {plane}, address {address:04x} ")?;
                match page {
                    Some(page) => write!(f, "(page {page}, x {x}, y {y})"),
                    None => write!(f, "(past the last page)"),
                }
            }
        }
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { x0, x1, y0, y1 } = self;
        write!(f, "x {x0}..{x1}, y {y0}..{y1}, ends included")
    }
}

impl fmt::Display for PaletteDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        differ(f, self.count, self.of, "palette entries")?;
        let (expected, got) = (colour(self.expected), colour(self.got));
        let first = self.first;
        write!(f, ", first {first:02x}: expected {expected}, got {got}")
    }
}

impl fmt::Display for HeaderDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            expected,
            got,
        } = self;
        write!(f, "{name}: expected {expected}, got {got}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the result of [`compare`] for a dump and a copy that `change` has modified, as text.
    fn described(content: Content, change: impl FnOnce(&mut Dump)) -> String {
        let expected = Dump::example(content);
        let mut got = expected.clone();
        change(&mut got);
        let [expected, got] = [expected, got].map(Capture::Dump);
        match compare(&expected, &got) {
            Ok(None) => "equal".into(),
            Ok(Some(difference)) => difference.to_string(),
            Err(why) => format!("error: {why:#}"),
        }
    }

    #[test]
    fn differing_pixels_of_a_page_are_described_by_their_number_the_first_and_their_box() {
        assert_eq!(described(Content::Page, |_| {}), "equal");
        let one = described(Content::Page, |got| got.pixels[12 * 320 + 33] ^= 0xFF);
        assert_eq!(
            one,
            "1 of 76800 pixels differs, first plane 1, x 33, y 12: expected 6c, got 93"
        );
        let three = described(Content::Page, |got| {
            for (x, y) in [(319, 12), (2, 100), (40, 239)] {
                got.pixels[y * 320 + x] += 1;
            }
        });
        assert_eq!(
            three,
            "3 of 76800 pixels differ, first plane 3, x 319, y 12: expected 8f, got 90; \
             all in x 2..319, y 12..239, ends included"
        );
        let all = described(Content::Page, |got| {
            got.pixels.iter_mut().for_each(|p| *p += 1);
        });
        assert!(
            all.starts_with("76800 of 76800 pixels differ, first plane 0, x 0, y 0: "),
            "{all}"
        );
        assert!(all.ends_with("all in x 0..319, y 0..239, ends included"));
    }

    #[test]
    fn differing_bytes_of_memory_are_described_by_plane_address_and_page() {
        assert_eq!(described(Content::Memory, |_| {}), "equal");
        let at = |plane: usize, address: usize| 4 * address + plane;
        let some = described(Content::Memory, |got| {
            // The last bytes of page 0 and of memory, and two bytes of page 2. The first difference is not in
            // plane 0.
            for i in [
                at(3, 0x4AFF),
                at(0, 0x9600),
                at(2, 0x9600 + 80),
                at(0, 0xFFFF),
            ] {
                got.pixels[i] ^= 1;
            }
        });
        assert_eq!(
            some,
            "4 of 262144 bytes differ, first plane 3, address 4aff (page 0, x 319, y 239): \
             expected f4, got f5; in plane 0: 2, 1: 0, 2: 1, 3: 1; in page 0: 1; in page 2: 2; \
             past the last page: 1"
        );
        let past = described(Content::Memory, |got| got.pixels[at(1, 0xE100)] ^= 1);
        assert!(
            past.contains("first plane 1, address e100 (past the last page): "),
            "{past}"
        );
        let before = described(Content::Memory, |got| got.pixels[at(3, 0xE0FF)] ^= 1);
        assert!(before.contains("e0ff (page 2, x 319, y 239)"), "{before}");
    }

    #[test]
    fn differences_in_palette_and_header_are_described_separately() {
        let palette = described(Content::Page, |got| {
            got.palette[3] = [0x2A, 0x1C, 0x0F];
            got.palette[255][0] ^= 1;
        });
        assert_eq!(
            palette,
            "2 of 256 palette entries differ, first 03: expected 000303, got 2a1c0f"
        );
        let start = described(Content::Page, |got| got.header.start = 0);
        assert_eq!(start, "start: expected 4b00, got 0000");
        let all = described(Content::Memory, |got| {
            got.pixels[0] = 9;
            got.palette[0] = [1, 1, 1];
            got.header.scene = "cube".into();
            got.header.frame = None;
        });
        assert_eq!(
            all,
            "1 of 262144 bytes differs, first plane 0, address 0000 (page 0, x 0, y 0): \
             expected 00, got 09; in plane 0: 1, 1: 0, 2: 0, 3: 0; in page 0: 1; \
             1 of 256 palette entries differs, first 00: expected 000000, got 010101; \
             scene: expected ball, got cube; frame: expected 480, got none"
        );
        let model = described(Content::Page, |got| got.header.model_file = Some(0x1A2B));
        assert_eq!(model, "model: expected none, got 00001a2b");
    }

    #[test]
    fn dumps_of_other_content_or_size_are_not_compared() {
        let content = described(Content::Page, |got| *got = Dump::example(Content::Memory));
        assert_eq!(
            content,
            "error: expected is a dump of a page, got a dump of all memory; take both with --all or both \
             without"
        );
        let size = described(Content::Page, |got| got.header.height = 200);
        assert_eq!(
            size,
            "error: expected is 320 x 240 pixels, got is 320 x 200; both must have the same size"
        );
    }

    #[test]
    fn a_dump_is_compared_with_a_frame_as_a_frame() {
        for content in [Content::Page, Content::Memory] {
            let dump = Dump::example(content);
            let mut frame = dump.frame();
            let dump = Capture::Dump(dump);
            let same = Capture::Png(frame.clone());
            assert_eq!(compare(&dump, &same).unwrap(), None);
            assert_eq!(compare(&same, &dump).unwrap(), None);
            frame.pixels[321] ^= 1;
            let difference = compare(&Capture::Png(frame), &dump);
            let pixels = difference.unwrap().unwrap().pixels.unwrap();
            assert_eq!((pixels.count, pixels.of), (1, 320 * 240));
            assert_eq!(
                pixels.first,
                PixelPosition {
                    plane: 1,
                    x: 1,
                    y: 1,
                    memory: None
                }
            );
        }
    }

    #[test]
    fn palettes_may_differ_but_not_hold_the_same_colours_in_another_order() {
        let frame = Dump::example(Content::Page).frame();
        let with = |change: &dyn Fn(&mut Vec<Rgb6>)| {
            let mut other = frame.clone();
            change(&mut other.palette);
            compare(&Capture::Png(frame.clone()), &Capture::Png(other))
        };
        let error = with(&|palette| palette.swap(3, 200)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the palettes hold the same colours in another order (entry 03: expected 000303, \
             got 320800), so indices cannot be compared; give the PNG as this program wrote it"
        );
        let palette = |difference: anyhow::Result<Option<Difference>>| {
            difference.unwrap().unwrap().palette.unwrap()
        };
        let changed = palette(with(&|palette| palette[200] = [63, 63, 63]));
        assert_eq!((changed.first, changed.count), (200, 1));
        // Unused entries are missing at the end: the entries before them can still be compared.
        let shorter = palette(with(&|palette| palette.truncate(253)));
        assert_eq!(
            shorter.to_string(),
            "3 of 256 palette entries differ, first fd: expected 3f3d01, got nothing"
        );
    }
}
