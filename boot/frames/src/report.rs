//! Writes an HTML report of the differences between frames. The report needs no network.
//!
//! The report `FILE.html` has a folder `FILE-files` beside it. For each pair that differs, the folder
//! contains the expected frame, the actual frame and their difference as PNGs, and, if dumps were compared,
//! both dumps. File and folder can be moved, zipped or uploaded together. Files of an earlier report stay in
//! the folder, but nothing links to them.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::fmt::{self, Write as _};
use std::fs;
use std::io::Write as _;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use anyhow::Context;
use modex::Rgb6;
use protocol::Content;

use crate::difference::{
    Bounds, Capture, Difference, HexColour, PixelLayout, colour, differing_entries,
};
use crate::dump::Dump;
use crate::html::{self, escape};
use crate::indexed::IndexedImage;
use crate::rgb::RgbImage;
use system::write_atomically;
use vga::widen;

const SCRIPT: &str = include_str!("report.js");

/// The scale at which frames are shown if the window is wide enough.
const SCALE: usize = 3;
/// The width in CSS pixels that narrow frames are scaled up to.
const WIDTH: usize = SCALE * modex::WIDTH;
/// The largest number of pixels to list with their values.
const LISTED: usize = 16;
/// Longest part of a pair's name that becomes part of its files' names, in characters.
const MAX_NAME: usize = 80;

// The colours of the difference image. report.css repeats them for the legend.

/// The two ends of the scale for differing pixels: from a barely visible difference to the largest possible.
const NEAR: [u8; 3] = [0xFF, 0xE0, 0x3A];
const FAR: [u8; 3] = [0xFF, 0x1F, 0x6B];
/// A different index with the same colour.
const SAME_COLOUR: [u8; 3] = [0x20, 0xD5, 0xFF];
/// The same index with a different colour.
const SAME_INDEX: [u8; 3] = [0x8F, 0x7B, 0xFF];

/// Collects the results of a comparison, and writes them as HTML.
#[derive(Clone, Debug, Default)]
pub struct Report {
    between: Option<[String; 2]>,
    equal: usize,
    different: Vec<DifferentPair>,
    incomparable: Vec<[String; 2]>,
}

/// A pair that differs.
#[derive(Clone, Debug)]
struct DifferentPair {
    name: String,
    expected: Capture,
    got: Capture,
    difference: Difference,
}

/// A function that writes the contents of a file in the report's folder.
type WriteFile<'a> = Box<dyn Fn(&mut fs::File) -> anyhow::Result<()> + 'a>;

impl Report {
    /// Returns an empty report.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns an empty report that names the two sides of the comparison.
    pub fn between(expected: &Path, got: &Path) -> Self {
        Self {
            between: Some([expected, got].map(|path| path.display().to_string())),
            ..Self::default()
        }
    }

    /// Adds a pair that differs.
    pub fn add(&mut self, name: &str, expected: &Capture, got: &Capture, difference: &Difference) {
        self.different.push(DifferentPair {
            name: name.into(),
            expected: expected.clone(),
            got: got.clone(),
            difference: difference.clone(),
        });
    }

    /// Counts a pair that is equal.
    pub fn add_equal(&mut self) {
        self.equal += 1;
    }

    /// Adds a pair that could not be compared.
    pub fn add_incomparable(&mut self, name: &str, why: &str) {
        self.incomparable.push([name.into(), why.into()]);
    }

    /// Writes the folder's files, and then the HTML file, which is either complete or missing.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, html: &Path) -> anyhow::Result<()> {
        let name = || format!("--report {}: not a file name", html.display());
        let mut folder_name = html.file_stem().with_context(name)?.to_owned();
        folder_name.push("-files");
        let folder = html.with_file_name(&folder_name);
        if !self.different.is_empty() && !folder.is_dir() {
            let context = || format!("{}: the folder cannot be created", folder.display());
            fs::create_dir(&folder).with_context(context)?;
        }
        let url = url(&folder_name);
        let mut page = self.head();
        let mut names = UniqueNames::default();
        for (i, pair) in self.different.iter().enumerate() {
            let name = names.take(&pair.name);
            let put = |suffix: &str, write: WriteFile| {
                let path = folder.join(format!("{name}-{suffix}"));
                write_atomically(&path, write)
            };
            pair.section(&mut page, i, &format!("{url}/{name}"), &put)?;
        }
        page += "</main>\n";
        if !self.different.is_empty() {
            let _ = writeln!(page, "<script>\n{SCRIPT}</script>");
        }
        page += "</body>\n</html>\n";
        write_atomically(html, |file| Ok(file.write_all(page.as_bytes())?))
    }

    fn title(&self) -> String {
        let (different, equal) = (self.different.len(), self.equal);
        let all = different + equal + self.incomparable.len();
        let title = match (different, all) {
            (0, all) if all == equal => "Nothing differs".into(),
            (0, all) => format!("None of {all} pairs differs"),
            (1, 1) => "1 pair differs".into(),
            (1, all) => format!("1 of {all} pairs differs"),
            (n, all) => format!("{n} of {all} pairs differ"),
        };
        match self.incomparable.len() {
            0 => title,
            1 if all == 1 => "The pair could not be compared".into(),
            n => format!("{title}, {n} could not be compared"),
        }
    }

    /// Returns the start of the page, up to the first pair.
    fn head(&self) -> String {
        let title = self.title();
        let verdict = match (self.different.len(), self.incomparable.len()) {
            (0, 0) => "equal",
            _ => "different",
        };
        let mut page = html::head(&title, "");
        let _ = write!(
            page,
            "<body id=\"top\">\n<header class=\"top {verdict}\">\n\
             <p class=\"brand\">Crystal Ball <span>diff</span></p>\n<h1>{}</h1>\n",
            escape(&title)
        );
        if let Some(between) = &self.between {
            let [expected, got] = between.each_ref().map(|path| escape(path));
            let _ = writeln!(
                page,
                "<p class=\"between\"><span>expected</span> <code>{expected}</code> \
                 <span>got</span> <code>{got}</code></p>"
            );
        }
        match (self.different.len(), self.equal) {
            (0, 1) => page += "<p>The pair is equal.</p>\n",
            (0, 2..) => {
                let _ = writeln!(page, "<p>{} pairs are equal.</p>", self.equal);
            }
            _ => {}
        }
        page += "</header>\n";
        if !self.different.is_empty() {
            page += LEGEND;
        }
        page += "<main>\n";
        if !self.incomparable.is_empty() {
            page += "<section class=\"card errors\">\n<h2>Could not be compared</h2>\n<dl>\n";
            for [name, why] in &self.incomparable {
                let (name, why) = (escape(name), escape(why));
                let _ = writeln!(page, "<dt>{name}</dt><dd>{why}</dd>");
            }
            page += "</dl>\n</section>\n";
        }
        if self.different.len() > 1 {
            self.contents(&mut page);
        }
        page
    }

    /// Adds the table of contents.
    fn contents(&self, page: &mut String) {
        *page += "<nav class=\"card\">\n<table class=\"contents\">\n<thead><tr><th>pair</th>\
                  <th class=\"n\">pixels that differ</th><th></th><th class=\"n\">palette entries</th>\
                  <th>header</th></tr></thead>\n<tbody>\n";
        for (i, pair) in self.different.iter().enumerate() {
            let Difference {
                pixels,
                palette,
                fields,
            } = &pair.difference;
            let dash = "<span class=\"none\">&ndash;</span>";
            let (count, share) = match pixels {
                None => (dash.into(), String::new()),
                Some(p) => (p.count.to_string(), percent(p.count, p.of)),
            };
            let palette = palette.map_or(dash.into(), |palette| palette.count.to_string());
            let fields: Vec<_> = fields.iter().map(|field| field.name).collect();
            let fields = match fields.is_empty() {
                true => dash.into(),
                false => fields.join(", "),
            };
            let _ = writeln!(
                page,
                "<tr><td><a href=\"#pair-{i}\">{}</a></td><td class=\"n\">{count}</td>\
                 <td class=\"share\">{share}</td><td class=\"n\">{palette}</td><td>{fields}</td></tr>",
                escape(&pair.name)
            );
        }
        *page += "</tbody>\n</table>\n</nav>\n";
    }
}

/// The legend of the colours, and the controls for the frames' scale.
const LEGEND: &str = r#"<aside class="bar">
<ul class="legend" aria-label="Colours of the difference images">
<li><i class="ramp"></i>different colour: similar to very different</li>
<li><i class="same-colour"></i>different index, same colour</li>
<li><i class="same-index"></i>same index, different colour</li>
<li><i class="same"></i>equal</li>
<li><i class="bounds"></i>box around the differences</li>
</ul>
<div class="controls">
<span class="scale" role="radiogroup" aria-label="Scale">
<label><input type="radio" name="scale" id="fit" checked>3x if it fits</label><label><input type="radio" name="scale" id="x1">1x</label><label><input type="radio" name="scale" id="x2">2x</label><label><input type="radio" name="scale" id="x3">3x</label>
</span>
<label class="check"><input type="checkbox" id="boxes" checked>boxes</label>
</div>
</aside>
"#;

/// A pair of images to show side by side, with their difference.
struct ImagePair {
    /// Part of the files' names.
    suffix: &'static str,
    title: Option<&'static str>,
    expected: IndexedImage,
    got: IndexedImage,
    layout: PixelLayout,
}

impl DifferentPair {
    fn views(&self) -> Vec<ImagePair> {
        let (expected, got) = (self.expected.frame(), self.got.frame());
        let page = ImagePair {
            suffix: "",
            title: None,
            layout: PixelLayout {
                width: expected.width,
                memory: None,
            },
            expected: expected.into_owned(),
            got: got.into_owned(),
        };
        let (Capture::Dump(expected), Capture::Dump(got)) = (&self.expected, &self.got) else {
            return vec![page];
        };
        if expected.header.content != Content::Memory {
            return vec![page];
        }
        let outside = {
            let header = &expected.header;
            let length = usize::from(header.width / 4) * usize::from(header.height);
            let mut pixels = expected.pixels.iter().zip(&got.pixels).enumerate();
            pixels.any(|(i, (a, b))| {
                let behind = ((i / 4) as u16).wrapping_sub(header.start);
                a != b && usize::from(behind) >= length
            })
        };
        let memory = ImagePair {
            suffix: "-memory",
            title: Some("All of video memory"),
            expected: whole(expected),
            got: whole(got),
            layout: PixelLayout {
                width: expected.header.width.into(),
                memory: Some(expected.header.height.into()),
            },
        };
        let page = ImagePair {
            title: Some("The page on the screen"),
            ..page
        };
        let shown = page.expected != page.got;
        match (shown, outside) {
            (_, false) => vec![page],
            (true, true) => vec![page, memory],
            (false, true) => vec![memory],
        }
    }

    /// Writes the pair's files with `put`, and adds the pair's section to the page.
    fn section(
        &self,
        page: &mut String,
        i: usize,
        url: &str,
        put: &dyn Fn(&str, WriteFile) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let name = escape(&self.name);
        let _ = write!(
            page,
            "<section class=\"card pair\" id=\"pair-{i}\">\n<h2>{name} <a href=\"#top\">top</a></h2>\n\
             <ul class=\"lines\">\n"
        );
        for part in self.difference.parts() {
            let _ = writeln!(page, "<li>{}</li>", escape(&part));
        }
        *page += "</ul>\n";
        let mut links = Vec::new();
        for view in self.views() {
            let ImagePair {
                suffix,
                expected,
                got,
                ..
            } = &view;
            let ending = |of: &str| format!("{of}{suffix}.png");
            put(&ending("expected"), Box::new(|to| expected.write_png(to)))?;
            put(&ending("got"), Box::new(|to| got.write_png(to)))?;
            let difference = difference(expected, got);
            put(
                &ending("difference"),
                Box::new(|to| difference.write_png(to)),
            )?;
            view.figures(page, &self.name, url);
            links.extend(["expected", "got", "difference"].map(ending));
        }
        for (of, subject) in [("expected", &self.expected), ("got", &self.got)] {
            if let Capture::Dump(dump) = subject {
                let ending = format!("{of}.dump");
                put(&ending, Box::new(|to| Ok(dump.write(to)?)))?;
                links.push(ending);
            }
        }
        self.list_pixels(page);
        self.list_palette(page);
        *page += "<p class=\"files\">Files:";
        for ending in links {
            let _ = write!(page, " <a href=\"{url}-{ending}\">{ending}</a>");
        }
        *page += "</p>\n</section>\n";
        Ok(())
    }

    /// Lists the first pixels that differ, with their values.
    fn list_pixels(&self, page: &mut String) {
        let Some(pixels) = &self.difference.pixels else {
            return;
        };
        let (expected, got);
        let (layout, a, b) = match (&self.expected, &self.got) {
            (Capture::Dump(a), Capture::Dump(b)) => {
                let height = usize::from(a.header.height);
                let memory = (a.header.content == Content::Memory).then_some(height);
                let width = a.header.width.into();
                (PixelLayout { width, memory }, &a.pixels[..], &b.pixels[..])
            }
            (a, b) => {
                (expected, got) = (a.frame(), b.frame());
                let width = expected.width;
                let layout = PixelLayout {
                    width,
                    memory: None,
                };
                (layout, &expected.pixels[..], &got.pixels[..])
            }
        };
        let count = pixels.count;
        let summary = match count {
            1 => "Value of the pixel".into(),
            ..=LISTED => format!("Values of all {count} pixels"),
            _ => format!("Values of the first {LISTED} pixels"),
        };
        let at = match layout.memory {
            Some(_) => "<th>address</th><th>page</th>",
            None => "",
        };
        let _ = write!(
            page,
            "<details>\n<summary>{summary}</summary>\n<table class=\"values\">\n<thead><tr>\
             <th>plane</th>{at}<th>x</th><th>y</th><th>expected</th><th>got</th></tr></thead>\n<tbody>\n"
        );
        let palettes = [palette(&self.expected), palette(&self.got)];
        let differing = a.iter().zip(b).enumerate().filter(|(_, (a, b))| a != b);
        for (i, (&a, &b)) in differing.take(LISTED) {
            let place = layout.place(i);
            let (mut x, mut y) = (place.x.to_string(), place.y.to_string());
            let _ = write!(page, "<tr><td>{}</td>", place.plane);
            if let Some(at) = place.memory {
                let page_name = at
                    .page
                    .map_or("past the last".into(), |page| page.to_string());
                let _ = write!(page, "<td>{:04x}</td><td>{page_name}</td>", at.address);
                if at.page.is_none() {
                    (x, y) = (String::new(), String::new());
                }
            }
            let _ = write!(page, "<td>{x}</td><td>{y}</td>");
            for (index, palette) in [a, b].into_iter().zip(palettes) {
                let colour = palette.get(usize::from(index)).copied();
                let _ = write!(page, "<td>{index:02x} {}</td>", Swatch(colour));
            }
            *page += "</tr>\n";
        }
        *page += "</tbody>\n</table>\n</details>\n";
    }

    /// Lists the palette entries that differ.
    fn list_palette(&self, page: &mut String) {
        let Some(colours) = &self.difference.palette else {
            return;
        };
        let entries = match colours.count {
            1 => "Palette entry that differs".into(),
            n => format!("{n} palette entries that differ"),
        };
        let _ = write!(
            page,
            "<details>\n<summary>{entries}</summary>\n<table class=\"values\">\n\
             <thead><tr><th>entry</th><th>expected</th><th>got</th></tr></thead>\n<tbody>\n"
        );
        let [expected, got] = [palette(&self.expected), palette(&self.got)];
        for entry in differing_entries(expected, got) {
            let [expected, got] =
                [expected, got].map(|palette| Swatch(palette.get(entry).copied()));
            let _ = writeln!(
                page,
                "<tr><td>{entry:02x}</td><td>{expected}</td><td>{got}</td></tr>"
            );
        }
        *page += "</tbody>\n</table>\n</details>\n";
    }
}

impl ImagePair {
    /// Adds the three images, side by side.
    fn figures(&self, page: &mut String, name: &str, url: &str) {
        let (width, height) = (self.expected.width.max(1), self.expected.height.max(1));
        if let Some(title) = self.title {
            let _ = writeln!(page, "<h3>{title}</h3>");
        }
        let memory = self.layout.memory;
        let scale = SCALE.max(WIDTH / width);
        let kind = if memory.is_some() { " memory" } else { "" };
        let bounds = self.bounds();
        let _ = writeln!(
            page,
            "<div class=\"three{kind}\" style=\"--w:{width};--h:{height};--s:{scale}\" \
             data-width=\"{width}\" data-height=\"{height}\" data-page=\"{}\">",
            memory.unwrap_or(0)
        );
        let name = escape(name);
        for (caption, of) in [
            ("Expected", "expected"),
            ("Got", "got"),
            ("Difference", "difference"),
        ] {
            let source = format!("{url}-{of}{}.png", self.suffix);
            let _ = write!(
                page,
                "<figure><figcaption>{caption}</figcaption><div class=\"view\"><a href=\"{source}\">\
                 <img src=\"{source}\" alt=\"{caption}: {name}\" width=\"{width}\" height=\"{height}\" \
                 loading=\"lazy\"></a>"
            );
            if let Some(lines) = memory {
                let pages = height / lines;
                for i in 0..=pages.min(8) {
                    let y = 100.0 * (i * lines) as f64 / height as f64;
                    let label = match i == pages {
                        true => "past the last page".into(),
                        false => format!("page {i}"),
                    };
                    let _ = write!(
                        page,
                        "<div class=\"page\" style=\"top:{y:.3}%\">{label}</div>"
                    );
                }
            }
            let _ = writeln!(page, "{bounds}</div></figure>");
        }
        *page += "</div>\n";
    }

    /// Returns a bounding box of the differences for each page that has any, as HTML.
    fn bounds(&self) -> String {
        let (width, height) = (self.expected.width, self.expected.height);
        let lines = self.layout.memory.unwrap_or(height);
        let layout = PixelLayout {
            width,
            memory: None,
        };
        let pages = [&self.expected, &self.got].map(|of| of.pixels.chunks((width * lines).max(1)));
        let [expected, got] = pages;
        let pairs = expected.zip(got).enumerate();
        let boxes = pairs.filter_map(|(page, (expected, got))| {
            let Bounds { x0, x1, y0, y1 } = layout.compare(expected, got)?.bounds;
            let above = page * lines;
            let moved = Bounds {
                x0,
                x1,
                y0: above + y0,
                y1: above + y1,
            };
            Some(bounds(&moved, width, height))
        });
        boxes.collect()
    }
}

/// Returns a box as an outline over an image of `width` x `height` pixels, as HTML.
fn bounds(bounds: &Bounds, width: usize, height: usize) -> String {
    let Bounds { x0, x1, y0, y1 } = *bounds;
    let share = |part: usize, whole: usize| 100.0 * part as f64 / whole as f64;
    format!(
        "<div class=\"bounds\" style=\"left:{:.3}%;top:{:.3}%;width:{:.3}%;height:{:.3}%\"></div>",
        share(x0, width),
        share(y0, height),
        share(x1 - x0 + 1, width),
        share(y1 - y0 + 1, height)
    )
}

/// Returns all of video memory as an image whose lines are the dump's lines.
fn whole(dump: &Dump) -> IndexedImage {
    let width = usize::from(dump.header.width);
    let height = dump.pixels.len().div_ceil(width);
    let mut pixels = dump.pixels.clone();
    pixels.resize(width * height, 0);
    IndexedImage {
        width,
        height,
        palette: dump.palette.to_vec(),
        pixels,
    }
}

fn palette(subject: &Capture) -> &[Rgb6] {
    match subject {
        Capture::Dump(dump) => &dump.palette,
        Capture::Png(frame) => &frame.palette,
    }
}

/// Returns the expected frame in dim grey, with the differing pixels in bright colours.
fn difference(expected: &IndexedImage, got: &IndexedImage) -> RgbImage {
    let colour = |frame: &IndexedImage, index: u8| {
        let colour = frame.palette.get(usize::from(index));
        colour.copied().unwrap_or_default()
    };
    let pairs = expected.pixels.iter().zip(&got.pixels);
    let pixels = pairs.map(|(&a, &b)| {
        let (from, to) = (colour(expected, a), colour(got, b));
        match (a == b, from == to) {
            (true, true) => dim(from),
            (true, false) => SAME_INDEX,
            (false, true) => SAME_COLOUR,
            (false, false) => between_near_and_far(from, to),
        }
    });
    RgbImage {
        width: expected.width,
        height: expected.height,
        pixels: pixels.collect(),
    }
}

fn dim(colour: Rgb6) -> [u8; 3] {
    let [red, green, blue] = colour.map(|part| u32::from(widen(part)));
    let luma = (299 * red + 587 * green + 114 * blue) / 1000;
    [(20 + luma * 100 / 255) as u8; 3]
}

fn between_near_and_far(from: Rgb6, to: Rgb6) -> [u8; 3] {
    let parts = from.iter().zip(&to).map(|(a, b)| a.abs_diff(*b));
    let far = i32::from(parts.max().unwrap_or(0)).min(63);
    std::array::from_fn(|part| {
        let (near, end) = (i32::from(NEAR[part]), i32::from(FAR[part]));
        (near + (end - near) * far / 63) as u8
    })
}

/// A colour as a sample and its components, or `nothing` for a missing colour.
struct Swatch(Option<Rgb6>);

impl fmt::Display for Swatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(parts) = self.0 {
            let shown = HexColour(parts.map(widen));
            write!(f, "<i style=\"background:#{shown}\"></i>")?;
        }
        write!(f, "<code>{}</code>", colour(self.0))
    }
}

/// File names that are unique on any file system, even one that ignores case.
#[derive(Default)]
struct UniqueNames(HashSet<String>);

impl UniqueNames {
    fn take(&mut self, name: &str) -> String {
        let mut plain = String::new();
        for c in name.chars().take(MAX_NAME) {
            // A name must not begin with `.`, which hides the file, or with `-`, which looks like an option.
            match c {
                'a'..='z' | 'A'..='Z' | '0'..='9' | '_' => plain.push(c),
                '.' if !plain.is_empty() => plain.push(c),
                _ if plain.is_empty() || plain.ends_with('-') => {}
                _ => plain.push('-'),
            }
        }
        if plain.is_empty() {
            plain.push_str("pair");
        }
        let mut unique = plain.clone();
        let mut times = 1;
        while !self.0.insert(unique.to_lowercase()) {
            times += 1;
            unique = format!("{plain}-{times}");
        }
        unique
    }
}

fn percent(count: usize, of: usize) -> String {
    match 100.0 * count as f64 / of as f64 {
        share if share < 0.01 => escape("< 0.01 %"),
        share => format!("{share:.2} %"),
    }
}

/// Returns a file name as part of a relative URL.
fn url(name: &OsStr) -> String {
    // Without `./`, the part of a name before a colon would be a URL scheme.
    let mut url = String::from("./");
    for &byte in name.as_bytes() {
        match byte {
            b'0'..=b'9' | b'A'..=b'Z' | b'a'..=b'z' | b'-' | b'.' | b'_' => url.push(byte.into()),
            _ => {
                let _ = write!(url, "%{byte:02X}");
            }
        }
    }
    url
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::difference::compare;
    use crate::html::STYLE;

    fn frame(pixels: &[u8]) -> IndexedImage {
        IndexedImage {
            width: 4,
            height: pixels.len() / 4,
            palette: vec![[0; 3], [63; 3], [63; 3], [0, 0, 1]],
            pixels: pixels.to_vec(),
        }
    }

    #[test]
    fn the_difference_image_shows_how_much_colours_differ() {
        let expected = frame(&[0, 0, 1, 1]);
        let mut got = frame(&[1, 3, 2, 1]);
        let pixels = |got: &IndexedImage| difference(&expected, got).pixels;
        let [far, near, same, equal] = pixels(&got)[..] else {
            panic!()
        };
        assert_eq!(far, FAR);
        assert!(near.iter().zip(&NEAR).all(|(a, b)| a.abs_diff(*b) < 5));
        assert_eq!(same, SAME_COLOUR);
        assert_eq!(equal, [120; 3], "dim");
        got.palette[1] = [0, 63, 63];
        assert_eq!(pixels(&got)[3], SAME_INDEX);
    }

    #[test]
    fn the_legend_has_the_colours_of_the_difference_image() {
        for (name, [red, green, blue]) in [
            ("near", NEAR),
            ("far", FAR),
            ("same-colour", SAME_COLOUR),
            ("same-index", SAME_INDEX),
        ] {
            let line = format!("--{name}: #{red:02x}{green:02x}{blue:02x};");
            assert!(STYLE.contains(&line), "{line}");
        }
    }

    #[test]
    fn names_are_escaped_in_the_page_and_in_file_names() {
        let folder = tempfile::tempdir().unwrap();
        let html = folder.path().join("a b%#é.html");
        let (expected, got) = (frame(&[0; 8]), frame(&[1; 8]));
        let [expected, got] = [expected, got].map(Capture::Png);
        let difference = compare(&expected, &got).unwrap().unwrap();
        let mut report = Report::new();
        for name in ["../<b>&\"'/x", "../<B>&\"'/x", "", &"long ".repeat(99)] {
            report.add(name, &expected, &got, &difference);
        }
        report.add_incomparable("<i>", "<u>");
        report.write(&html).unwrap();
        let page = fs::read_to_string(&html).unwrap();
        for bad in ["<b>", "<B>", "<i>", "<u>", "'/x"] {
            assert!(!page.contains(bad), "{bad}");
        }
        assert!(page.contains("<dt>&lt;i&gt;</dt><dd>&lt;u&gt;</dd>"));
        assert!(page.contains("../&lt;b&gt;&amp;&quot;&#39;/x"));
        // Every file that the page names exists, and the page names every file.
        let files = folder.path().join("a b%#é-files");
        let files = fs::read_dir(files).unwrap();
        let files = files.map(|file| file.unwrap().file_name().into_string().unwrap());
        let files: HashSet<_> = files.collect();
        let named = page.split('"').filter_map(|part| {
            let name = part.strip_prefix("./a%20b%25%23%C3%A9-files/")?;
            Some(name.to_owned())
        });
        assert_eq!(named.collect::<HashSet<_>>(), files);
        assert_eq!(files.len(), 4 * 3);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_report_loads_nothing_from_the_network() {
        for text in [STYLE, SCRIPT, LEGEND] {
            assert!(!text.contains("//") || text == SCRIPT && !text.contains("://"));
            assert!(!text.contains("@import"));
        }
    }
}
