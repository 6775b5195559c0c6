//! Golden frames: committed frames. A change must leave each of them as it is, or bless the new frame.
//!
//! A golden is two files of the same name in `tests/golden`. `NAME.toml` is the description:
//!
//! ```toml
//! about = "The ball from so near that each of the screen's edges cuts it."
//! show = ["0", "pose 00000000 00000000 00000000 00013333"]
//! mapper = "linear-16"      # may be left out, as may be `scene` and `order`
//! ```
//!
//! `NAME.png` is the last of the frames in `show`, as an indexed PNG. The folder is the list of goldens, so
//! none can be forgotten: a PNG without a description is an error, and a description without a PNG fails its
//! check.
//!
//! QEMU's VGA, the emulated VGA, the PNG and QEMU's screen must agree:
//!
//! - The emulated VGA's page equals the PNG, byte for byte, palette included.
//! - QEMU's screendump equals the emulated VGA's scan-out in each of its 640 x 480 dots.
//! - The kernel reads back QEMU's VGA, and sends a CRC-32 of the page, of the palette, and of each plane with
//!   all of its 64 KiB. They equal the checksums of the emulated VGA's memory.
//! - The registers that can be read back equal the emulated VGA's, except PEL Mask, which QEMU does not have.
//! - With [`Transfer::Bytes`] the kernel also sends every byte of the page, and each byte is compared.
//!
//! Checksums are enough for most goldens. CRC-32 finds every change of up to 32 consecutive bits and every
//! change of one or two bits; it misses one in 2^32 of all other changes. A wrong byte on the page must also
//! pass the screendump, which is compared without a checksum: the wrong byte's colour would have to be equal.
//! Checksums cannot show a fault in how bytes are sent and read, so some goldens send their bytes.
//!
//! Both VGAs run the same program and renderer, so equal VGAs alone would prove little about the frame. The
//! PNG is what a person once looked at.

use std::fmt;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use protocol::{Command, Content, FrameName};
use scene::catalogue::Entry;
use serde::Deserialize;
use texmap::{Mapper, Order};

use crate::card::{self, Card, Emulated};
use crate::difference::{Difference, Subject, compare};
use crate::indexed::Indexed;
use crate::look::{Look, Named};
use crate::report::Report;
use crate::screen::Screen;
use system::Progress;
use system::quote::{printable, quoted};
use system::write_atomically;

/// A golden frame.
#[derive(Clone, Debug)]
pub struct Golden {
    /// The golden's name, which is its files' name.
    pub name: String,
    /// Why the golden exists.
    pub about: String,
    /// The frames to show after `hold`; the golden is the last.
    pub show: Vec<FrameName>,
    /// The options to draw with.
    pub look: Look,
    /// The path of the golden's PNG.
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

/// Returns the goldens of a folder, sorted by name.
///
/// # Errors
/// A folder that cannot be read or contains no golden, an invalid description, a PNG without a description, a
/// file that is neither. A description without a PNG is legal here, because `bless` makes the PNG;
/// [`Findings::check_golden`] reports it.
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
        let frames = description.show.iter().map(|name| {
            FrameName::parse(name.split(' '))
                .with_context(|| format!("{} is no frame", quoted(name)))
        });
        let show = frames.collect::<Result<Vec<_>, _>>().with_context(wrong)?;
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

    /// Returns the committed frame, or `None` if the golden was never blessed.
    ///
    /// # Errors
    /// A file that cannot be read or is not an indexed PNG.
    pub fn frame(&self) -> anyhow::Result<Option<Indexed>> {
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

/// Returns a TOML error with its line. The full text of TOML's error is not used, because it quotes the
/// file's bytes unescaped.
fn syntax(text: &str, error: &toml::de::Error) -> anyhow::Error {
    let before = error.span().and_then(|span| text.get(..span.start));
    let line = 1 + before.map_or(0, |text| text.matches('\n').count());
    anyhow::anyhow!("line {line}: {}", printable(error.message()))
}

/// Parses an optional name from a description, and refuses an unknown name.
fn known<T>(
    what: &str,
    name: Option<String>,
    parse: impl FnOnce(&str) -> Option<T>,
) -> anyhow::Result<Option<T>> {
    let Some(name) = name else { return Ok(None) };
    let named = parse(&name).with_context(|| format!("there is no {what} {}", quoted(&name)))?;
    Ok(Some(named))
}

/// A fault found in a golden.
#[derive(Debug)]
pub struct Finding {
    /// The golden's name.
    pub golden: String,
    /// Which two things differ, and how.
    pub words: String,
    /// The expected and the actual side with their difference, if images can show it.
    evidence: Option<Box<(Subject, Subject, Difference)>>,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.golden, self.words)
    }
}

/// How much of the contents of QEMU's VGA is sent and compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// A CRC-32 of the page, of the palette, and of each plane with all of its 64 KiB. Where a checksum
    /// differs, bytes are sent as well, to locate the fault.
    Checksums,
    /// The checksums, and every byte of the displayed page.
    Bytes,
}

/// Runs checks and collects the faults that they find.
#[derive(Debug, Default)]
pub struct Findings {
    found: Vec<Finding>,
}

impl Findings {
    /// Compares the emulated VGA's frame with the committed frame.
    ///
    /// # Errors
    /// A failure of the emulated VGA. A fault in the golden is not an error: it is collected.
    pub fn check_golden(
        &mut self,
        golden: &Golden,
        emulated: &mut Emulated<'_>,
    ) -> anyhow::Result<()> {
        emulated.show_as(&golden.look, &golden.show)?;
        let drawn = Subject::Dump(emulated.dump(Content::Page)?);
        match golden.frame() {
            Ok(Some(frame)) => {
                self.compare(
                    golden,
                    "the emulated card and the golden",
                    &Subject::Png(frame),
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

    /// Shows the golden on both VGAs and compares their memory, screens and registers.
    ///
    /// # Errors
    /// A failure of a VGA. A fault in the golden is not an error: it is collected.
    pub fn check_cards(
        &mut self,
        golden: &Golden,
        emulated: &mut Emulated<'_>,
        machine: &mut impl Card,
        transfer: Transfer,
    ) -> anyhow::Result<()> {
        emulated.show_as(&golden.look, &golden.show)?;
        machine.show_as(&golden.look, &golden.show)?;
        // The kernel has answered and waits for the next command, so it touches no video memory now.
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

    /// Compares the checksums of all video memory and of the palette. If they differ, the bytes differ too,
    /// and the first difference is collected. Returns whether the checksums are equal.
    fn check_memory(
        &mut self,
        golden: &Golden,
        emulated: &mut Emulated<'_>,
        machine: &mut impl Card,
    ) -> anyhow::Result<bool> {
        // Computed from outside the emulated VGA, so that the program, which both VGAs run, has no part in
        // it.
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

    /// Has QEMU's VGA send its bytes, and compares them with the emulated VGA's.
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

    /// Compares two subjects and collects a difference under the golden's name.
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

    /// Returns the collected faults.
    pub fn found(&self) -> &[Finding] {
        &self.found
    }

    /// Succeeds if no fault was collected. Otherwise writes a report to `report`, if images can show a fault,
    /// and returns an error that lists all faults and the report's path.
    ///
    /// # Errors
    /// The collected faults.
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
                // If the report cannot be written, the faults must still be listed.
                Err(error) => format!("\nno report could be written: {error:#}"),
            };
        }
        bail!("{} found wrong:{words}", self.found.len());
    }

    /// Writes an HTML report of the faults that images can show. The folder of `html` belongs to the report:
    /// it is removed and made again.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn report(&self, html: &Path) -> anyhow::Result<()> {
        let mut report = Report::new();
        for finding in &self.found {
            if let Some((expected, got, difference)) = finding.evidence.as_deref() {
                report.add(&finding.golden, expected, got, difference);
            }
        }
        if let Some(folder) = html.parent() {
            // Files of an earlier report would only confuse the reader.
            let _ = std::fs::remove_dir_all(folder);
            std::fs::create_dir_all(folder)
                .with_context(|| format!("{} cannot be made", folder.display()))?;
        }
        report.write(html)
    }
}

/// Describes how two screens differ; `None` if they are equal.
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

/// Makes the emulated VGA's frames the goldens of a folder, if QEMU agrees with each frame that changes.
///
/// `say` receives a line about each change. Returns the number of PNGs written.
///
/// # Errors
/// A VGA that fails, a difference between QEMU's VGA and the emulated VGA (then no PNG is written), a file
/// that cannot be written.
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
        // A PNG that cannot be read is blessed again, like a missing PNG.
        let before = golden.frame().unwrap_or_default();
        match before {
            Some(before) if before == drawn.frame() => continue,
            Some(before) => {
                let expected = Subject::Png(before);
                differ.compare(&golden, "changes", &expected, &Subject::Dump(drawn.clone()));
                if let Some(finding) = differ.found.last() {
                    say(&finding.to_string());
                }
            }
            None => say(&format!("{}: is new: {}", golden.name, golden.about)),
        }
        changes.push((golden, drawn.frame()));
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
    let mut step = Progress::counting("asking QEMU", changes.len() as u64);
    for (done, (golden, _)) in (1..).zip(&changes) {
        disagree.check_cards(golden, &mut emulated, &mut machine, Transfer::Bytes)?;
        step.at(done);
    }
    drop(step);
    leave(machine)?;
    disagree
        .verdict(&report.with_file_name("disagreement").join("report.html"))
        .context("QEMU does not agree, so nothing was blessed")?;
    for (golden, frame) in &changes {
        write_atomically(&golden.png, |file| frame.write_png(file))?;
    }
    Ok(changes.len())
}
