//! The `diff` command: compares two files, or two folders of dumps and indexed PNGs.
//!
//! Nothing passes by luck. A file that cannot be compared, a file that one folder lacks, and a comparison
//! without any file lead to [`Outcome::Incomparable`], which is neither "equal" nor "different".

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::io::Write;
use std::path::Path;

use system::{Interrupted, interrupted, quote, say};

use crate::difference::{Capture, compare};
use crate::report::Report;

/// The extensions of the files to compare in a folder.
const EXTENSIONS: [&str; 2] = ["dump", "png"];

/// The result of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// All pairs are equal.
    Equal,
    /// A pair differs.
    Different,
    /// A pair could not be compared.
    Incomparable,
}

impl Outcome {
    /// Returns the exit code that `diff` and `cmp` use for this result.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Equal => 0,
            Self::Different => 1,
            Self::Incomparable => 2,
        }
    }
}

/// Compares two files or two folders. Differences go to `out`, and errors about pairs that cannot be compared
/// go to standard error. If `report` is given, both also go into an HTML file.
///
/// # Errors
/// `out` or the report cannot be written, or the user interrupted the comparison.
pub fn run(
    a: &Path,
    b: &Path,
    report: Option<&Path>,
    out: &mut impl Write,
) -> anyhow::Result<Outcome> {
    let mut comparison = Comparison {
        report: report.map(|_| Report::between(a, b)),
        out,
        pairs: 0,
        different: 0,
        incomparable: 0,
        pixels: 0,
    };
    match (a.is_dir(), b.is_dir()) {
        (true, true) => comparison.folders(a, b)?,
        (false, false) => comparison.files(a, b)?,
        (a_is_folder, _) => {
            let (folder, other) = if a_is_folder { (a, b) } else { (b, a) };
            let why = match other.metadata() {
                Ok(_) => format!(
                    "{} is a folder, {} is a file; give two files or two folders",
                    quote::path(folder),
                    quote::path(other)
                ),
                Err(error) => format!("{}: cannot be read: {error}", quote::path(other)),
            };
            comparison.incomparable(&quote::path(other), &why);
        }
    }
    let outcome = comparison.outcome();
    if let (Some(html), Some(report)) = (report, comparison.report) {
        report.write(html)?;
        say(format_args!("report: {}", html.display()));
    }
    Ok(outcome)
}

/// A comparison, with the results so far.
struct Comparison<'a, W> {
    /// The report, if the user requested one.
    report: Option<Report>,
    out: &'a mut W,
    pairs: usize,
    different: usize,
    incomparable: usize,
    pixels: usize,
}

impl<W: Write> Comparison<'_, W> {
    fn files(&mut self, a: &Path, b: &Path) -> anyhow::Result<()> {
        let (from, to) = (quote::path(a), quote::path(b));
        let name = match (a.file_name(), b.file_name()) {
            (Some(a), Some(b)) if a != b => {
                format!(
                    "{} and {}",
                    quote::path(a.as_ref()),
                    quote::path(b.as_ref())
                )
            }
            (_, Some(b)) => quote::path(b.as_ref()),
            (_, None) => to.clone(),
        };
        let differs = format!("{to} differs from {from}");
        self.pair(&name, &differs, &format!("{from} and {to}"), a, b)?;
        if self.outcome() == Outcome::Equal {
            writeln!(self.out, "equal: {from} and {to}, {} pixels", self.pixels)?;
        }
        Ok(())
    }

    fn folders(&mut self, a: &Path, b: &Path) -> anyhow::Result<()> {
        let mut names = [BTreeSet::new(), BTreeSet::new()];
        for (names, folder) in names.iter_mut().zip([a, b]) {
            match list(folder) {
                Ok(list) => *names = list,
                Err(error) => {
                    let folder = quote::path(folder);
                    let why = format!("{folder}: cannot be read: {error}");
                    self.incomparable(&folder, &why);
                    return Ok(());
                }
            }
        }
        let [in_a, in_b] = &names;
        for name in in_a | in_b {
            if interrupted() {
                return Err(Interrupted.into());
            }
            let shown = quote::path(name.as_ref());
            let lacks = match (in_a.contains(&name), in_b.contains(&name)) {
                (true, false) => Some((a, b)),
                (false, _) => Some((b, a)),
                (true, true) => None,
            };
            if let Some((has, lacks)) = lacks {
                let (has, lacks) = (quote::path(has), quote::path(lacks));
                self.pairs += 1;
                self.incomparable(
                    &shown,
                    &format!("{shown}: in {has}, but missing from {lacks}"),
                );
                continue;
            }
            let differs = format!("{shown} differs");
            self.pair(&shown, &differs, &shown, &a.join(&name), &b.join(&name))?;
        }
        let pairs = self.pairs;
        if pairs == 0 {
            let (a, b) = (quote::path(a), quote::path(b));
            let why = format!("{a} and {b}: neither folder has a .dump or a .png file to compare");
            self.incomparable(&a, &why);
            return Ok(());
        }
        let s = if pairs == 1 { "" } else { "s" };
        if self.outcome() == Outcome::Equal {
            writeln!(self.out, "equal: {pairs} pair{s}, {} pixels", self.pixels)?;
            return Ok(());
        }
        write!(self.out, "{} of {pairs} pair{s} differ", self.different)?;
        if self.different == 1 {
            write!(self.out, "s")?;
        }
        if self.incomparable > 0 {
            write!(self.out, ", {} could not be compared", self.incomparable)?;
        }
        Ok(writeln!(self.out)?)
    }

    /// Compares two files. `differs` is the start of the line that describes a difference; `both` names the
    /// two files in the error message.
    fn pair(
        &mut self,
        name: &str,
        differs: &str,
        both: &str,
        a: &Path,
        b: &Path,
    ) -> anyhow::Result<()> {
        self.pairs += 1;
        let (expected, got) = match (Capture::read(a), Capture::read(b)) {
            (Ok(expected), Ok(got)) => (expected, got),
            (expected, got) => {
                let errors = [expected.err(), got.err()];
                let errors: Vec<_> = errors.iter().flatten().map(|e| format!("{e:#}")).collect();
                for error in &errors {
                    say(format_args!("error: {error}"));
                }
                self.count_incomparable(name, &errors.join("; "));
                return Ok(());
            }
        };
        match compare(&expected, &got) {
            Ok(None) => {
                self.pixels += match (&expected, &got) {
                    (Capture::Png(frame), _) | (_, Capture::Png(frame)) => frame.pixels.len(),
                    (Capture::Dump(dump), _) => dump.pixels.len(),
                };
                if let Some(report) = &mut self.report {
                    report.add_equal();
                }
            }
            Ok(Some(difference)) => {
                writeln!(self.out, "{differs}: {difference}")?;
                self.different += 1;
                if let Some(report) = &mut self.report {
                    report.add(name, &expected, &got, &difference);
                }
            }
            Err(why) => self.incomparable(name, &format!("{both} cannot be compared: {why:#}")),
        }
        Ok(())
    }

    fn incomparable(&mut self, name: &str, why: &str) {
        say(format_args!("error: {why}"));
        self.count_incomparable(name, why);
    }

    fn count_incomparable(&mut self, name: &str, why: &str) {
        self.incomparable += 1;
        if let Some(report) = &mut self.report {
            report.add_incomparable(name, why);
        }
    }

    fn outcome(&self) -> Outcome {
        match (self.incomparable, self.different) {
            (0, 0) => Outcome::Equal,
            (0, _) => Outcome::Different,
            _ => Outcome::Incomparable,
        }
    }
}

/// Returns the names of the dumps and PNGs in a folder.
pub(crate) fn list(folder: &Path) -> std::io::Result<BTreeSet<OsString>> {
    let mut names = BTreeSet::new();
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name();
        let extension = Path::new(&name).extension();
        if extension.is_some_and(|found| EXTENSIONS.iter().any(|known| found == *known)) {
            names.insert(name);
        }
    }
    Ok(names)
}
