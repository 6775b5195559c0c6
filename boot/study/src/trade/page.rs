//! The HTML page: plots, frames with maps of their errors, and the tables. It needs no network.

use std::fmt::Write as _;

use modex::{HEIGHT, WIDTH};
use texmap::Mapper;

use super::accuracy::{self, Accuracy, FrameJobs};
use super::table::{decibels, percent, texels};
use super::workload::Workload;
use frames::html::{self, escape};
use frames::indexed::IndexedImage;
use frames::rgb::RgbImage;

/// The page's title.
const TITLE: &str = "What accuracy costs";
/// The page's addition to the style sheet of the reports.
const STYLE: &str = include_str!("page.css");

/// The range of errors that the maps' colours distinguish, as powers of two of a texel.
const HEAT: (f64, f64) = (-8.0, 5.0);
/// The maps' colours, evenly over [`HEAT`]. The legend's gradient in page.css has the same colours.
const COLOURS: [[u8; 3]; 6] = [
    [0x10, 0x10, 0x2A],
    [0x2B, 0x3F, 0x9E],
    [0x7C, 0x3C, 0xB8],
    [0xD9, 0x3F, 0x74],
    [0xFB, 0x9A, 0x3C],
    [0xFF, 0xF5, 0xB0],
];
/// The maps' colour of the background.
const BACKGROUND: [u8; 3] = [0x4C, 0x4C, 0x4C];

/// A frame and the map of its errors, shared by all mappers that draw both alike.
#[derive(Clone, Debug)]
pub struct GalleryFrame {
    /// The mappers' names.
    pub mappers: Vec<String>,
    /// The frame.
    pub image: IndexedImage,
    /// The map of the frame's errors.
    pub heat: RgbImage,
    /// The mappers' accuracy on the frame.
    pub accuracy: Accuracy,
}

/// The frames of a scene.
#[derive(Clone, Debug)]
pub struct Gallery {
    /// The scene's name.
    pub scene: String,
    /// A line about the scene.
    pub about: String,
    /// The frames that differ.
    pub shown: Vec<GalleryFrame>,
}

impl Gallery {
    /// Draws a workload's first frame with each mapper.
    pub fn new(workload: &Workload<'_>, mappers: &[Mapper], jobs: &mut FrameJobs) -> Self {
        let mut shown: Vec<GalleryFrame> = Vec::new();
        let colours = |pixels: &[u8]| {
            let colours = pixels.iter().map(|&i| workload.palette[usize::from(i)]);
            colours.collect::<Vec<_>>()
        };
        let exact = colours(&accuracy::frame(workload, 0, Mapper::Exact, jobs));
        for &mapper in mappers {
            let pixels = accuracy::frame(workload, 0, mapper, jobs);
            let mut accuracy = Accuracy {
                psnr: super::stats::psnr(&colours(&pixels), &exact),
                ..Accuracy::default()
            };
            let mut heat = vec![BACKGROUND; WIDTH * HEIGHT];
            for face in &workload.frames[0] {
                let texture = workload.texture(face.face().texture);
                accuracy::errors(mapper, face, texture, |(x, y), error, other| {
                    heat[usize::from(y) * WIDTH + usize::from(x)] = colour(error);
                    accuracy.errors.add(error);
                    accuracy.other_texels += u64::from(other);
                });
            }
            let alike = |s: &&mut GalleryFrame| {
                s.image.pixels == pixels && s.accuracy.errors == accuracy.errors
            };
            if let Some(same) = shown.iter_mut().find(alike) {
                same.mappers.push(mapper.to_string());
                continue;
            }
            shown.push(GalleryFrame {
                mappers: vec![mapper.to_string()],
                image: IndexedImage {
                    width: WIDTH,
                    height: HEIGHT,
                    palette: workload.palette.map(|c| c.map(|part| part >> 2)).to_vec(),
                    pixels,
                },
                heat: RgbImage {
                    width: WIDTH,
                    height: HEIGHT,
                    pixels: heat,
                },
                accuracy,
            });
        }
        Self {
            scene: workload.name.into(),
            about: workload.about.clone(),
            shown,
        }
    }

    /// Returns the file name of a frame, or of its map.
    pub fn file(&self, shown: &GalleryFrame, map: bool) -> String {
        let of = if map { "-error" } else { "" };
        // A mapper's name can have a slash.
        let mapper = shown.mappers[0].replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        format!("{}-{mapper}{of}.png", self.scene)
    }

    fn section(&self, page: &mut String, folder: &str) {
        let (scene, about) = (escape(&self.scene), escape(&self.about));
        let _ = write!(
            page,
            "<section class=\"card\">\n<h2>The scene <code>{scene}</code></h2>\n<p>{about}. \
             Mappers whose frames and errors are equal share an image.</p>\n<div class=\"gallery\">\n"
        );
        for shown in &self.shown {
            let names = shown.mappers.iter().map(|name| escape(name));
            let names = names.collect::<Vec<_>>().join(", ");
            let errors = &shown.accuracy.errors;
            let _ = writeln!(
                page,
                "<figure><figcaption><b>{names}</b><span>largest {} texels, mean {}; other texels \
                 {}; PSNR {}</span></figcaption>\n\
                 <img src=\"{folder}/{}\" alt=\"{scene} by {names}\" width=\"320\" height=\"240\">\
                 <img src=\"{folder}/{}\" alt=\"its errors\" width=\"320\" height=\"240\"></figure>",
                texels(errors.largest()),
                texels(errors.mean()),
                escape(&percent(shown.accuracy.other_share())),
                decibels(shown.accuracy.psnr),
                self.file(shown, false),
                self.file(shown, true),
            );
        }
        *page += "</div>\n</section>\n";
    }
}

/// Returns the colour of an error in texels.
fn colour(error: f64) -> [u8; 3] {
    let (from, to) = HEAT;
    let steps = (COLOURS.len() - 1) as f64;
    let at = ((error.log2() - from) / (to - from)).clamp(0.0, 1.0) * steps;
    let i = (at as usize).min(COLOURS.len() - 2);
    let part = at - i as f64;
    std::array::from_fn(|k| {
        let (a, b) = (f64::from(COLOURS[i][k]), f64::from(COLOURS[i + 1][k]));
        (a + (b - a) * part).round() as u8
    })
}

/// The parts of the page.
#[derive(Debug)]
pub struct TradePage<'a> {
    /// Lines about the run and about the machine.
    pub about: &'a [String],
    /// The plots, each with a caption and the SVG.
    pub plots: &'a [(String, String)],
    /// The frames.
    pub galleries: &'a [Gallery],
    /// The folder of the images, beside the page.
    pub folder: &'a str,
    /// The tables, each with a title, a line about it, and the cells. The first table is shown open.
    pub tables: &'a [(String, String, Vec<Vec<String>>)],
    /// The cells of the table of the sources' claims.
    pub claims: &'a [Vec<String>],
}

impl TradePage<'_> {
    /// Returns the page as HTML.
    pub fn html(&self) -> String {
        let mut page = html::head(TITLE, STYLE);
        let _ = write!(
            page,
            "<body class=\"trade\">\n<header class=\"top\">\n\
             <p class=\"brand\">Crystal Ball <span>trade</span></p>\n\
             <h1>{TITLE}</h1>\n"
        );
        for line in self.about {
            let _ = writeln!(page, "<p>{}</p>", escape(line));
        }
        page += "</header>\n<main>\n";
        for (caption, svg) in self.plots {
            let _ = write!(
                page,
                "<section class=\"card plot\">\n{svg}\n<p>{}</p>\n</section>\n",
                escape(caption)
            );
        }
        if let Some((title, about, cells)) = self.tables.first() {
            let _ = write!(
                page,
                "<section class=\"card\">\n<h2>{}</h2>\n<p>{}</p>\n",
                escape(title),
                escape(about)
            );
            table(&mut page, cells);
            page += "</section>\n";
        }
        if self.tables.len() > 1 {
            page += "<section class=\"card\">\n<h2>Scene by scene</h2>\n";
            for (title, about, cells) in &self.tables[1..] {
                let _ = writeln!(
                    page,
                    "<details><summary><b>{}</b> {}</summary>",
                    escape(title),
                    escape(about)
                );
                table(&mut page, cells);
                page += "</details>\n";
            }
            page += "</section>\n";
        }
        page += LEGEND;
        for gallery in self.galleries {
            gallery.section(&mut page, self.folder);
        }
        page += "<section class=\"card claims\">\n<h2>The sources' claims, measured</h2>\n<p>What the book's \
                 chapters 57 and 58 and the articles on perspective claim for the machines of their \
                 time, and what this run measured.</p>\n";
        table(&mut page, self.claims);
        page += "</section>\n</main>\n</body>\n</html>\n";
        page
    }
}

const LEGEND: &str = "<aside class=\"heat\"><span>Maps of the error, in texels:</span>\
                      <i></i><ol><li>1/256</li><li>1/32</li><li>1/4</li><li>2</li><li>8</li><li>32</li></ol>\
                      <span>grey: background</span></aside>\n";

/// Adds a table to the page. The first line of `cells` is the header.
fn table(page: &mut String, cells: &[Vec<String>]) {
    *page += "<div class=\"wide\"><table>\n";
    for (i, line) in cells.iter().enumerate() {
        let (open, close) = match i {
            0 => ("<thead><tr>", "</tr></thead>\n<tbody>\n"),
            _ => ("<tr>", "</tr>\n"),
        };
        *page += open;
        for cell in line {
            let tag = if i == 0 { "th" } else { "td" };
            let _ = write!(page, "<{tag}>{}</{tag}>", code(&escape(cell)));
        }
        *page += close;
    }
    *page += "</tbody>\n</table></div>\n";
}

/// Returns the text with everything between backticks as code.
fn code(text: &str) -> String {
    let mut out = String::new();
    for (i, part) in text.split('`').enumerate() {
        match i % 2 {
            0 => out += part,
            _ => {
                let _ = write!(out, "<code>{part}</code>");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::workload::with;

    #[test]
    fn the_legend_has_the_colours_of_small_to_large_errors() {
        assert_eq!(colour(0.0), COLOURS[0]);
        assert_eq!(colour(1.0 / 256.0), COLOURS[0]);
        assert_eq!(colour(32.0), COLOURS[5]);
        assert_eq!(colour(1e9), COLOURS[5]);
        let step = (HEAT.1 - HEAT.0) / 5.0;
        assert_eq!(colour((HEAT.0 + 2.0 * step).exp2()), COLOURS[2]);
        for [red, green, blue] in COLOURS {
            let hex = format!("#{red:02x}{green:02x}{blue:02x}");
            assert!(STYLE.contains(&hex), "{hex}");
        }
    }

    #[test]
    fn the_page_names_every_image_and_loads_nothing_from_the_network() {
        let mappers = ["affine", "packed", "exact"].map(|name| Mapper::parse(name).unwrap());
        let mut jobs = Box::new(FrameJobs::new());
        let gallery = with("tilted", 0, |workload| {
            Gallery::new(workload, &mappers, &mut jobs)
        });
        let names = gallery.shown.iter().map(|shown| shown.mappers.len());
        assert_eq!(names.sum::<usize>(), 3);
        let exact = gallery
            .shown
            .iter()
            .find(|s| s.mappers[0] == "exact")
            .unwrap();
        assert_eq!(exact.accuracy.psnr, f64::INFINITY);
        assert!(exact.heat.pixels.contains(&COLOURS[0]) && exact.heat.pixels.contains(&BACKGROUND));
        let html = TradePage {
            about: &["a <b>".into()],
            plots: &[("caption".into(), "<svg></svg>".into())],
            galleries: std::slice::from_ref(&gallery),
            folder: "images",
            tables: &[(
                "t".into(),
                "about".into(),
                vec![vec!["h".into()], vec!["`c` < d".into()]],
            )],
            claims: &[vec!["head".into()]],
        }
        .html();
        for shown in &gallery.shown {
            for map in [false, true] {
                let name = format!("\"images/{}\"", gallery.file(shown, map));
                assert!(html.contains(&name), "{name}");
            }
        }
        assert!(html.contains("a &lt;b&gt;") && html.contains("<code>c</code> &lt; d"));
        assert!(!html.contains("://") && !html.contains("@import") && !html.contains("<script"));
    }
}
