//! Golden frames: pictures that every change must leave as they are, or bless.
//!
//! A golden is two files of one name in `tests/golden`: a description, `NAME.toml`,
//!
//! ```toml
//! about = "The ball from so near that each of the screen's edges cuts it."
//! show = ["0", "pose 00000000 00000000 00000000 00013333"]
//! mapper = "linear-16"      # may be left out, as may be `scene` and `order`
//! ```
//!
//! and `NAME.png`, the last of these pictures, indexed. They are found by folder, so none can be
//! forgotten in a list: one without its other half is an error.
//!
//! Four things must agree: QEMU's card, the emulated card, the PNG, and QEMU's screen.
//!
//! - The emulated card's page is the PNG, byte for byte, palette included.
//! - QEMU's screendump is the emulated card's scan-out, dot for dot: 640 x 480 of them.
//! - The kernel sends a CRC-32 of each plane, all 64 KiB of it, of the page and of the palette, as it
//!   reads them back from QEMU's card. They are the checksums of the emulated card's memory.
//! - The registers that can be read back are the emulated card's.
//! - With [`Transfer::Bytes`] the kernel sends every byte of the page, too.
//!
//! Checksums are enough for most goldens. CRC-32 finds every change of up to 32 bits in a row, and
//! every change of one or two bits; of any other one it lets one in 2^32 pass. A wrong byte on the
//! page must pass the screendump as well, which has no checksum: its colour would have to be the same
//! one. What checksums cannot show is a fault in how bytes are sent and read, so some goldens send them.
//!
//! Program and renderer are the same on both cards, so equal cards alone would prove little of the
//! picture: the PNG is what a person once looked at.

use std::fmt;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use link::{Command, Content, Picture};
use scene::catalogue::Entry;
use serde::Deserialize;
use texmap::{Mapper, Order};

use crate::card::{self, Card, Emulated};
use crate::difference::{Difference, Subject, compare};
use crate::indexed::Indexed;
use crate::look::{Look, Named};
use crate::report::Report;
use crate::screen::Screen;
use system::Step;
use system::quote::{printable, quoted};
use system::write_atomically;

/// A golden frame.
#[derive(Clone, Debug)]
pub struct Golden {
    /// Its name: that of its files.
    pub name: String,
    /// What it is there for.
    pub about: String,
    /// The pictures that are shown, after `hold`; the golden is the last.
    pub show: Vec<Picture>,
    /// How they are drawn.
    pub look: Look,
    /// Its PNG.
    pub png: PathBuf,
}

/// A description as it stands in the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    about: String,
    show: Vec<String>,
    scene: Option<String>,
    mapper: Option<String>,
    order: Option<String>,
}

/// The goldens of a folder by name.
///
/// # Errors
/// A folder that can't be read or has none, a description that is none, a PNG without one. A
/// description without its PNG is found when that is read: `bless` makes it.
pub fn find(folder: &Path) -> anyhow::Result<Vec<Golden>> {
    let files = || format!("{} cannot be read", folder.display());
    let mut goldens = Vec::new();
    let mut pngs = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(files)? {
        let path = entry.with_context(files)?.path();
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("toml") => goldens.push(Golden::read(&path)?),
            Some("png") => pngs.push(path),
            _ => bail!("{} is neither a description nor a PNG", path.display()),
        }
    }
    if let Some(orphan) = pngs
        .iter()
        .find(|png| goldens.iter().all(|g| g.png != **png))
    {
        bail!(
            "{} is an orphan: it has no description beside it; write one, or remove the PNG",
            orphan.display()
        );
    }
    if goldens.is_empty() {
        bail!("{} has no golden frames", folder.display());
    }
    goldens.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(goldens)
}

impl Golden {
    fn read(path: &Path) -> anyhow::Result<Self> {
        let wrong = || format!("{} is no golden's description", path.display());
        let text = std::fs::read_to_string(path).with_context(wrong)?;
        let description: Description = toml::from_str(&text)
            .map_err(|error| syntax(&text, &error))
            .with_context(wrong)?;
        let pictures = description.show.iter().map(|name| {
            Picture::parse(name.split(' '))
                .with_context(|| format!("{} is no picture", quoted(name)))
        });
        let show = pictures
            .collect::<Result<Vec<_>, _>>()
            .with_context(wrong)?;
        if show.is_empty() {
            return Err(anyhow::anyhow!("it shows nothing")).with_context(wrong);
        }
        let look = Look {
            scene: known("scene", description.scene, Entry::parse)
                .with_context(wrong)?
                .map(|entry| Named(entry.name)),
            mapper: known("mapper", description.mapper, Mapper::parse).with_context(wrong)?,
            order: known("order", description.order, Order::parse)
                .with_context(wrong)?
                .map(Named),
        };
        Ok(Self {
            look,
            name: path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into(),
            about: description.about,
            show,
            png: path.with_extension("png"),
        })
    }

    /// The committed picture; none if it was never blessed.
    ///
    /// # Errors
    /// A file that is no indexed PNG.
    pub fn picture(&self) -> anyhow::Result<Option<Indexed>> {
        let wrong = || format!("{} is no golden", self.png.display());
        match File::open(&self.png) {
            Ok(file) => Ok(Some(
                Indexed::read_png(BufReader::new(file)).with_context(wrong)?,
            )),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error).with_context(wrong),
        }
    }
}

/// An error of TOML's with its line. The error's own words repeat the file's bytes as they are.
fn syntax(text: &str, error: &toml::de::Error) -> anyhow::Error {
    let before = error.span().and_then(|span| text.get(..span.start));
    let line = 1 + before.map_or(0, |text| text.matches('\n').count());
    anyhow::anyhow!("line {line}: {}", printable(error.message()))
}

/// What a description names, if it names it.
fn known<T>(
    what: &str,
    name: Option<String>,
    parse: impl FnOnce(&str) -> Option<T>,
) -> anyhow::Result<Option<T>> {
    let Some(name) = name else { return Ok(None) };
    let named = parse(&name).with_context(|| format!("there is no {what} {}", quoted(&name)))?;
    Ok(Some(named))
}

/// What was found wrong with a golden.
#[derive(Debug)]
pub struct Finding {
    /// The golden's name.
    pub golden: String,
    /// Which two things, and how they differ.
    pub words: String,
    /// Expected and got, where pictures show it.
    evidence: Option<Box<(Subject, Subject, Difference)>>,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.golden, self.words)
    }
}

/// How much of what QEMU's card holds is sent and compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// A CRC-32 of the page, of the palette, and of each plane with all of its 64 KiB. Bytes are
    /// sent where a checksum differs, to say what is wrong.
    Checksums,
    /// The same, and every byte of the page on the screen.
    Bytes,
}

/// Checks, and collects what they find.
#[derive(Debug, Default)]
pub struct Findings {
    found: Vec<Finding>,
}

impl Findings {
    /// Compares the emulated card with the committed picture.
    ///
    /// # Errors
    /// When the emulated card can't be asked; a finding is none.
    pub fn check_golden(
        &mut self,
        golden: &Golden,
        emulated: &mut Emulated<'_>,
    ) -> anyhow::Result<()> {
        emulated.show_as(&golden.look, &golden.show)?;
        let drawn = Subject::Dump(emulated.dump(Content::Page)?);
        match golden.picture() {
            Ok(Some(picture)) => {
                self.compare(
                    golden,
                    "the emulated card and the golden",
                    &Subject::Picture(picture),
                    &drawn,
                );
            }
            Ok(None) => self.note(
                golden,
                "it was never blessed: `cargo bless` makes its PNG".into(),
            ),
            Err(error) => self.note(golden, format!("{error:#}")),
        }
        Ok(())
    }

    /// Shows the golden on both cards and compares what they hold, show and have in their
    /// registers.
    ///
    /// # Errors
    /// When a card can't be asked; a finding is none.
    pub fn check_cards(
        &mut self,
        golden: &Golden,
        emulated: &mut Emulated<'_>,
        machine: &mut impl Card,
        transfer: Transfer,
    ) -> anyhow::Result<()> {
        emulated.show_as(&golden.look, &golden.show)?;
        machine.show_as(&golden.look, &golden.show)?;
        // Between the answer and the next command, when the kernel touches no video memory.
        let screen = machine.screen()?;
        let held = self.check_memory(golden, emulated, machine)?;
        if transfer == Transfer::Bytes || !held {
            self.check_bytes(golden, Content::Page, emulated, machine)?;
        }
        if let Some(difference) = difference(&emulated.screen()?, &screen) {
            self.note(
                golden,
                format!("QEMU's screen and the emulated card's scan-out: {difference}"),
            );
        }
        let [expected, got] = [
            emulated.ask(Command::Registers)?,
            machine.ask(Command::Registers)?,
        ];
        for (expected, got) in expected.iter().zip(&got) {
            // QEMU has no PEL Mask.
            if expected != got && !expected.starts_with("pel-mask ") {
                self.note(
                    golden,
                    format!(
                        "registers of QEMU's card are '{got}', of the emulated one '{expected}'"
                    ),
                );
            }
        }
        Ok(())
    }

    /// Compares the checksums of all video memory and of the palette. Where they differ, so must
    /// the bytes: the first that do are noted. Returns whether the checksums are equal.
    fn check_memory(
        &mut self,
        golden: &Golden,
        emulated: &mut Emulated<'_>,
        machine: &mut impl Card,
    ) -> anyhow::Result<bool> {
        // From outside the emulated card: the program that runs on both cards has no part in it.
        let expected = emulated.dump(Content::Memory)?.checksums();
        let got = machine.ask(Command::Checksums(Content::Memory))?;
        if got == expected {
            return Ok(true);
        }
        let differ = expected.iter().zip(&got).find(|(a, b)| a != b);
        let words = match differ {
            Some((expected, got)) => format!("expected '{expected}', got '{got}'"),
            None => format!("expected {} lines, got {}", expected.len(), got.len()),
        };
        self.note(
            golden,
            format!("checksums of QEMU's card and of the emulated card: {words}"),
        );
        self.check_bytes(golden, Content::Memory, emulated, machine)?;
        Ok(false)
    }

    /// Has QEMU's card sent byte by byte, and compares it with the emulated card.
    fn check_bytes(
        &mut self,
        golden: &Golden,
        content: Content,
        emulated: &mut Emulated<'_>,
        machine: &mut impl Card,
    ) -> anyhow::Result<()> {
        let expected = Subject::Dump(emulated.dump(content)?);
        let got = Subject::Dump(machine.dump(content)?);
        self.compare(golden, "QEMU and the emulated card", &expected, &got);
        Ok(())
    }

    /// Compares two subjects under a golden's name.
    pub fn compare(&mut self, golden: &Golden, what: &str, expected: &Subject, got: &Subject) {
        let words = match compare(expected, got) {
            Ok(None) => return,
            Ok(Some(difference)) => {
                let words = format!("{what}: {difference}");
                let evidence = Box::new((expected.clone(), got.clone(), difference));
                return self.found.push(Finding {
                    golden: golden.name.clone(),
                    words,
                    evidence: Some(evidence),
                });
            }
            Err(error) => format!("{what} cannot be compared: {error:#}"),
        };
        self.note(golden, words);
    }

    fn note(&mut self, golden: &Golden, words: String) {
        self.found.push(Finding {
            golden: golden.name.clone(),
            words,
            evidence: None,
        });
    }

    /// What was found.
    pub fn found(&self) -> &[Finding] {
        &self.found
    }

    /// Good if nothing was found; otherwise an error with all of it, and the path of a report.
    ///
    /// # Errors
    /// What was found.
    pub fn verdict(self, report: &Path) -> anyhow::Result<()> {
        if self.found.is_empty() {
            return Ok(());
        }
        let mut words = String::new();
        for finding in &self.found {
            words += &format!("\n  {finding}");
        }
        if self.found.iter().any(|finding| finding.evidence.is_some()) {
            words += &match self.report(report) {
                Ok(()) => format!("\nreport: {}", report.display()),
                // A report that can't be written must not hide what it is about.
                Err(error) => format!("\nno report could be written: {error:#}"),
            };
        }
        bail!("{} found wrong:{words}", self.found.len());
    }

    /// Writes what was found with its pictures. The folder is the report's alone, and made anew.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn report(&self, html: &Path) -> anyhow::Result<()> {
        let mut report = Report::new();
        for finding in &self.found {
            if let Some((expected, got, difference)) = finding.evidence.as_deref() {
                report.add(&finding.golden, expected, got, difference);
            }
        }
        if let Some(folder) = html.parent() {
            // What an earlier one left would only confuse.
            let _ = std::fs::remove_dir_all(folder);
            std::fs::create_dir_all(folder)
                .with_context(|| format!("{} cannot be made", folder.display()))?;
        }
        report.write(html)
    }
}

/// How two screens differ, in words.
fn difference(expected: &Screen, got: &Screen) -> Option<String> {
    let size = |screen: &Screen| (screen.width, screen.height);
    if size(expected) != size(got) {
        return Some(format!("{:?} dots and {:?}", size(got), size(expected)));
    }
    let mut pairs = expected.pixels.iter().zip(&got.pixels).enumerate();
    let (i, (expected_dot, got_dot)) = pairs.find(|(_, (a, b))| a != b)?;
    let count = 1 + pairs.filter(|(_, (a, b))| a != b).count();
    let (x, y) = (i % expected.width, i / expected.width);
    Some(format!(
        "dot {x} of scan line {y} is {got_dot:02x?} and {expected_dot:02x?} (first of {count} of {})",
        expected.pixels.len()
    ))
}

/// Makes the emulated card's pictures the goldens of a folder, if QEMU agrees with each that
/// changes. `say` is told what changes; the number of PNGs written is returned.
///
/// # Errors
/// When a card fails, QEMU's card differs (then nothing is written), or a file can't be written.
pub fn bless<C: Card>(
    folder: &Path,
    report: &Path,
    boot: impl FnOnce() -> anyhow::Result<C>,
    leave: impl FnOnce(C) -> anyhow::Result<()>,
    mut say: impl FnMut(&str),
) -> anyhow::Result<usize> {
    let mut memory = card::memory();
    let mut emulated = Emulated::new(&mut memory)?;
    let mut changes = Vec::new();
    let mut differ = Findings::default();
    for golden in find(folder)? {
        emulated.show_as(&golden.look, &golden.show)?;
        let drawn = emulated.dump(Content::Page)?;
        // What can't be read is blessed anew, as what is not there.
        let before = golden.picture().unwrap_or_default();
        match before {
            Some(before) if before == drawn.picture() => continue,
            Some(before) => {
                let expected = Subject::Picture(before);
                differ.compare(&golden, "changes", &expected, &Subject::Dump(drawn.clone()));
                if let Some(finding) = differ.found.last() {
                    say(&finding.to_string());
                }
            }
            None => say(&format!("{}: is new: {}", golden.name, golden.about)),
        }
        changes.push((golden, drawn.picture()));
    }
    if changes.is_empty() {
        return Ok(0);
    }
    if !differ.found.is_empty() {
        differ.report(report)?;
        say(&format!("before and after: {}", report.display()));
    }
    let mut machine = boot()?;
    let mut disagree = Findings::default();
    let mut step = Step::counting("asking QEMU", changes.len() as u64);
    for (done, (golden, _)) in (1..).zip(&changes) {
        disagree.check_cards(golden, &mut emulated, &mut machine, Transfer::Bytes)?;
        step.at(done);
    }
    drop(step);
    leave(machine)?;
    disagree
        .verdict(&report.with_file_name("disagreement").join("report.html"))
        .context("QEMU does not agree, so nothing was blessed")?;
    for (golden, picture) in &changes {
        write_atomically(&golden.png, |file| picture.write_png(file))?;
    }
    Ok(changes.len())
}
