//! Golden frames: committed frames. A change to the program must leave each frame as it is, or bless the new
//! frame.
//!
//! A golden is two files of the same name in `tests/golden`. `NAME.toml` is the description:
//!
//! ```toml
//! about = "The ball, so close that each edge of the screen cuts it."
//! show = ["0", "pose 00000000 00000000 00000000 00013333"]
//! mapper = "linear-16"      # may be left out, as may be `scene` and `order`
//! ```
//!
//! `NAME.png` is the last of the frames in `show`, as an indexed PNG. The folder is the list of goldens, so
//! no golden can be forgotten: a PNG without a description is an error, and a description without a PNG
//! fails its check.
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
//! Both VGAs run the same program and renderer, so equal VGAs alone would prove little about the frame. A
//! person looked at each PNG before it was committed.

use std::fmt;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use protocol::{Command, Content, FrameName};
use scene::catalogue::Entry;
use serde::Deserialize;
use texmap::{Mapper, Order};

use crate::backend::{self, Backend, EmulatedDemo};
use crate::difference::{Capture, Difference, compare};
use crate::indexed::IndexedImage;
use crate::options::FrameOptions;
use crate::report::Report;
use crate::rgb::RgbImage;
use system::Progress;
use system::quote::{self, printable, quoted};
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
    pub options: FrameOptions,
    /// The path of the golden's PNG.
    pub png: PathBuf,
}

/// The description file's fields, unchecked.
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
    let files = || format!("{}: cannot be read", folder.display());
    let mut goldens = Vec::new();
    let mut pngs = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(files)? {
        let path = entry.with_context(files)?.path();
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("toml") => goldens.push(Golden::read(&path)?),
            Some("png") => pngs.push(path),
            _ => bail!(
                "{}: neither a description (.toml) nor a PNG; move the file elsewhere",
                path.display()
            ),
        }
    }
    if let Some(orphan) = pngs
        .iter()
        .find(|png| goldens.iter().all(|g| g.png != **png))
    {
        bail!(
            "{}: the description {} is missing; write it, or remove the PNG",
            orphan.display(),
            quote::path(
                orphan
                    .with_extension("toml")
                    .file_name()
                    .unwrap_or_default()
                    .as_ref()
            )
        );
    }
    if goldens.is_empty() {
        bail!("{}: the folder has no golden frames", folder.display());
    }
    goldens.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(goldens)
}

impl Golden {
    fn read(path: &Path) -> anyhow::Result<Self> {
        let wrong = || format!("{}: not a valid description of a golden", path.display());
        let text = std::fs::read_to_string(path).with_context(wrong)?;
        let description: Description = toml::from_str(&text)
            .map_err(|error| syntax(&text, &error))
            .with_context(wrong)?;
        let frames = description.show.iter().map(|name| {
            FrameName::parse(name.split(' '))
                .with_context(|| format!("{} is not a frame's name", quoted(name)))
        });
        let show = frames.collect::<Result<Vec<_>, _>>().with_context(wrong)?;
        if show.is_empty() {
            return Err(anyhow::anyhow!("`show` is empty; name at least one frame"))
                .with_context(wrong);
        }
        let options = FrameOptions {
            scene: known("scene", description.scene, |name| {
                Entry::parse(name).map(|entry| entry.name)
            })
            .with_context(wrong)?,
            mapper: known("mapper", description.mapper, Mapper::parse).with_context(wrong)?,
            order: known("order", description.order, Order::parse).with_context(wrong)?,
        };
        Ok(Self {
            options,
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
    pub fn frame(&self) -> anyhow::Result<Option<IndexedImage>> {
        let wrong = || format!("{}: cannot be read as a golden frame", self.png.display());
        match File::open(&self.png) {
            Ok(file) => Ok(Some(
                IndexedImage::read_png(BufReader::new(file)).with_context(wrong)?,
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
    let named = parse(&name).with_context(|| format!("unknown {what} {}", quoted(&name)))?;
    Ok(Some(named))
}

/// A fault found in a golden.
#[derive(Debug)]
pub struct Finding {
    /// The golden's name.
    pub golden: String,
    /// Which two things differ, and how.
    pub description: String,
    /// The expected and the actual side with their difference, if images can show it.
    evidence: Option<Box<(Capture, Capture, Difference)>>,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.golden, self.description)
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
        emulated: &mut EmulatedDemo<'_>,
    ) -> anyhow::Result<()> {
        emulated.show_with(&golden.options, &golden.show)?;
        let drawn = Capture::Dump(emulated.dump(Content::Page)?);
        match golden.frame() {
            Ok(Some(frame)) => {
                self.compare(
                    golden,
                    "expected the golden, got the emulated VGA's frame",
                    &Capture::Png(frame),
                    &drawn,
                );
            }
            Ok(None) => self.note(golden, "the PNG is missing; `cargo bless` writes it".into()),
            Err(error) => self.note(golden, format!("{error:#}")),
        }
        Ok(())
    }

    /// Shows the golden on both VGAs and compares their memory, screens and registers.
    ///
    /// # Errors
    /// A failure of a VGA. A fault in the golden is not an error: it is collected.
    pub fn check_vgas(
        &mut self,
        golden: &Golden,
        emulated: &mut EmulatedDemo<'_>,
        qemu: &mut impl Backend,
        transfer: Transfer,
    ) -> anyhow::Result<()> {
        emulated.show_with(&golden.options, &golden.show)?;
        qemu.show_with(&golden.options, &golden.show)?;
        // The kernel has answered and waits for the next command, so it touches no video memory now.
        let screen = qemu.screen()?;
        let held = self.check_memory(golden, emulated, qemu)?;
        if transfer == Transfer::Bytes || !held {
            self.check_bytes(golden, Content::Page, emulated, qemu)?;
        }
        if let Some(difference) = difference(&emulated.screen()?, &screen) {
            self.note(
                golden,
                format!("screen: expected the emulated VGA's, got QEMU's: {difference}"),
            );
        }
        let [expected, got] = [
            emulated.send(Command::Registers)?,
            qemu.send(Command::Registers)?,
        ];
        for (expected, got) in expected.iter().zip(&got) {
            // QEMU has no PEL Mask.
            if expected != got && !expected.starts_with("pel-mask ") {
                self.note(
                    golden,
                    format!("registers: the emulated VGA has '{expected}', QEMU's VGA has '{got}'"),
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
        emulated: &mut EmulatedDemo<'_>,
        qemu: &mut impl Backend,
    ) -> anyhow::Result<bool> {
        // Computed from outside the emulated VGA, so that the program, which both VGAs run, has no part in
        // it.
        let expected = emulated.dump(Content::Memory)?.checksums();
        let got = qemu.send(Command::Checksums(Content::Memory))?;
        if got == expected {
            return Ok(true);
        }
        let differ = expected.iter().zip(&got).find(|(a, b)| a != b);
        let difference = match differ {
            Some((expected, got)) => {
                format!("the emulated VGA has '{expected}', QEMU's VGA has '{got}'")
            }
            None => format!(
                "the emulated VGA has {} lines, QEMU's VGA has {}",
                expected.len(),
                got.len()
            ),
        };
        self.note(golden, format!("checksums: {difference}"));
        self.check_bytes(golden, Content::Memory, emulated, qemu)?;
        Ok(false)
    }

    /// Has QEMU's VGA send its bytes, and compares them with the emulated VGA's.
    fn check_bytes(
        &mut self,
        golden: &Golden,
        content: Content,
        emulated: &mut EmulatedDemo<'_>,
        qemu: &mut impl Backend,
    ) -> anyhow::Result<()> {
        let expected = Capture::Dump(emulated.dump(content)?);
        let got = Capture::Dump(qemu.dump(content)?);
        let what = "expected the emulated VGA's bytes, got QEMU's";
        self.compare(golden, what, &expected, &got);
        Ok(())
    }

    /// Compares two captures and collects a difference under the golden's name. `what` says which captures.
    pub fn compare(&mut self, golden: &Golden, what: &str, expected: &Capture, got: &Capture) {
        match compare(expected, got) {
            Ok(None) => {}
            Ok(Some(difference)) => self.found.push(Finding {
                golden: golden.name.clone(),
                description: format!("{what}: {difference}"),
                evidence: Some(Box::new((expected.clone(), got.clone(), difference))),
            }),
            Err(error) => self.note(golden, format!("{what}: cannot be compared: {error:#}")),
        }
    }

    fn note(&mut self, golden: &Golden, description: String) {
        self.found.push(Finding {
            golden: golden.name.clone(),
            description,
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
        let mut list = String::new();
        for finding in &self.found {
            list += &format!("\n  {finding}");
        }
        if self.found.iter().any(|finding| finding.evidence.is_some()) {
            list += &match self.report(report) {
                Ok(()) => format!("\nreport: {}", report.display()),
                // If the report cannot be written, the faults must still be listed.
                Err(error) => format!("\nthe report cannot be written: {error:#}"),
            };
        }
        bail!("faults in golden frames: {}{list}", self.found.len());
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
                .with_context(|| format!("{}: the folder cannot be created", folder.display()))?;
        }
        report.write(html)
    }
}

/// Describes how two screens differ; `None` if they are equal.
fn difference(expected: &RgbImage, got: &RgbImage) -> Option<String> {
    let size = |screen: &RgbImage| (screen.width, screen.height);
    if size(expected) != size(got) {
        let ((width, height), (got_width, got_height)) = (size(expected), size(got));
        return Some(format!(
            "expected {width} x {height} dots, got {got_width} x {got_height}"
        ));
    }
    let mut pairs = expected.pixels.iter().zip(&got.pixels).enumerate();
    let (i, (expected_dot, got_dot)) = pairs.find(|(_, (a, b))| a != b)?;
    let count = 1 + pairs.filter(|(_, (a, b))| a != b).count();
    let (x, y) = (i % expected.width, i / expected.width);
    Some(format!(
        "{count} of {} dots differ, first dot {x} of scan line {y}: expected {expected_dot:02x?}, got \
         {got_dot:02x?}",
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
pub fn bless<B: Backend>(
    folder: &Path,
    report: &Path,
    boot: impl FnOnce() -> anyhow::Result<B>,
    leave: impl FnOnce(B) -> anyhow::Result<()>,
    mut say: impl FnMut(&str),
) -> anyhow::Result<usize> {
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory)?;
    let mut changes = Vec::new();
    let mut differ = Findings::default();
    for golden in find(folder)? {
        emulated.show_with(&golden.options, &golden.show)?;
        let drawn = emulated.dump(Content::Page)?;
        // A PNG that cannot be read is blessed again, like a missing PNG.
        let before = golden.frame().unwrap_or_default();
        match before {
            Some(before) if before == drawn.frame() => continue,
            Some(before) => {
                let expected = Capture::Png(before);
                let what = "expected the golden, got the new frame";
                differ.compare(&golden, what, &expected, &Capture::Dump(drawn.clone()));
                if let Some(finding) = differ.found.last() {
                    say(&finding.to_string());
                }
            }
            None => say(&format!("{}: new: {}", golden.name, golden.about)),
        }
        changes.push((golden, drawn.frame()));
    }
    if changes.is_empty() {
        return Ok(0);
    }
    if !differ.found.is_empty() {
        differ.report(report)?;
        say(&format!("report of the changes: {}", report.display()));
    }
    let mut qemu = boot()?;
    let mut disagree = Findings::default();
    let mut step = Progress::counting("asking QEMU", changes.len() as u64);
    for (done, (golden, _)) in (1..).zip(&changes) {
        disagree.check_vgas(golden, &mut emulated, &mut qemu, Transfer::Bytes)?;
        step.at(done);
    }
    drop(step);
    leave(qemu)?;
    disagree
        .verdict(&report.with_file_name("disagreement").join("report.html"))
        .context("QEMU's VGA shows other frames, so no golden was changed")?;
    for (golden, frame) in &changes {
        write_atomically(&golden.png, |file| frame.write_png(file))?;
    }
    Ok(changes.len())
}
