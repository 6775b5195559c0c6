//! How a run ended, in words and as an exit code.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::ExitStatus;
use std::time::SystemTime;

/// QEMU's command line, the serial log, and a last screendump.
const EVIDENCE: [&str; 3] = ["command.txt", "serial.log", "screen.png"];

/// Failures whose evidence is kept; older ones are removed.
const KEPT: usize = 20;

/// How a run ended, other than well.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The user closed the window, or ended QEMU by a signal.
    User,
    /// The kernel panicked.
    Panic {
        /// Its last words.
        report: Vec<String>,
    },
    /// The CPU raised an exception in the kernel.
    Exception {
        /// The kernel's last words.
        report: Vec<String>,
    },
    /// The display adapter does not take Mode X.
    Adapter {
        /// The kernel's last words.
        report: Vec<String>,
    },
    /// The machine reset itself with the kernel running.
    TripleFault {
        /// Whether it was seen to boot again, and not only to reset.
        booted: bool,
    },
    /// The kernel said nothing for too long.
    Hang {
        /// What did not come.
        waited_for: String,
    },
    /// The kernel was never reached.
    BootLoader {
        /// The machine reset; otherwise nothing happened at all.
        reset: bool,
    },
    /// The serial line brought something that is not the kernel's.
    Garbled {
        /// What is wrong with it.
        why: String,
    },
    /// QEMU itself failed.
    Qemu {
        /// What it said.
        words: Vec<String>,
        /// How it ended.
        status: Option<ExitStatus>,
    },
}

impl Verdict {
    /// The exit code of this program for the verdict.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Panic { .. } => 10,
            Self::Exception { .. } => 11,
            Self::TripleFault { .. } => 12,
            Self::Hang { .. } => 13,
            Self::BootLoader { .. } => 14,
            Self::Qemu { .. } => 15,
            Self::Garbled { .. } => 16,
            Self::Adapter { .. } => 17,
            // As a shell reports Ctrl-C.
            Self::User => 130,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::User => f.write_str("ended by the user"),
            Self::Panic { report } => write!(f, "the kernel panicked{}", Indented(report)),
            Self::Exception { report } => {
                write!(f, "the CPU raised an exception in the kernel{}", Indented(report))
            }
            Self::Adapter { report } => write!(
                f,
                "the display adapter does not take Mode X{}\nQEMU 10.0 shows RAM in place of video \
                 memory with `-machine smm=off`: leave that out, or use `-vga std`",
                Indented(report)
            ),
            Self::TripleFault { booted: false } => f.write_str(
                "the machine reset itself: a triple fault (an exception that the kernel could not even report)",
            ),
            Self::TripleFault { booted: true } => f.write_str("the kernel started a second time: a reboot loop"),
            Self::Hang { waited_for } => {
                write!(f, "the kernel hangs: {waited_for} did not come in time")
            }
            Self::BootLoader { reset } => write!(
                f,
                "the boot loader {} before it reached the kernel. The usual reason is the display \
                 adapter: the boot loader needs a VGA core with VESA modes, which `-vga std`, `cirrus`, \
                 `vmware` and `virtio` have, and `-vga none`, `bochs-display`, `ramfb` and `ati-vga` lack",
                if *reset { "reset the machine" } else { "stopped" }
            ),
            Self::Garbled { why } => write!(f, "the serial line is garbled: {why}"),
            Self::Qemu { words, status } => {
                f.write_str("QEMU itself failed")?;
                if let Some(status) = status {
                    write!(f, " ({status})")?;
                }
                write!(f, "{}", Indented(words))?;
                match explain(words) {
                    Some(explanation) => write!(f, "\n{explanation}"),
                    None => Ok(()),
                }
            }
        }
    }
}

/// What to make of QEMU's words.
fn explain(words: &[String]) -> Option<&'static str> {
    let said = |text: &str| words.iter().any(|line| line.contains(text));
    if said("Failed to get") && said("lock") {
        Some("Another program holds the disk image; end it, or boot a copy (`image --out FILE`).")
    } else if said("initialization failed") || said("cannot open display") {
        Some("The window could not be opened. `--headless` runs without one.")
    } else if said("No space left") {
        Some("The disk for temporary files is full; TMPDIR can name another folder.")
    } else if words.is_empty() {
        Some("It said nothing: it was killed, or it crashed.")
    } else {
        None
    }
}

/// Lines below a message.
struct Indented<'a>(&'a [String]);

impl fmt::Display for Indented<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|line| write!(f, "\n  {line}"))
    }
}

/// A verdict with its evidence.
#[derive(Debug)]
pub struct Failure {
    /// How the run ended.
    pub verdict: Verdict,
    /// The folder with QEMU's command line (`command.txt`), the serial log (`serial.log`) and a
    /// last screendump (`screen.png`, if QEMU could still take one).
    pub evidence: Option<PathBuf>,
}

impl Failure {
    pub(super) fn plain(verdict: Verdict) -> Self {
        Self {
            verdict,
            evidence: None,
        }
    }

    /// Moves the evidence from QEMU's temporary folder to one of its own under `failures`.
    pub(super) fn keep(verdict: Verdict, folder: &Path, failures: &Path) -> Self {
        let evidence = copy_evidence(folder, failures).ok();
        Self { verdict, evidence }
    }
}

fn copy_evidence(folder: &Path, failures: &Path) -> std::io::Result<PathBuf> {
    std::fs::create_dir_all(failures)?;
    forget_oldest(failures);
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let seconds = now.map_or(0, |now| now.as_secs());
    let kept = tempfile::Builder::new()
        .prefix(&format!("{seconds}-"))
        .tempdir_in(failures)?
        .keep();
    for name in EVIDENCE {
        match std::fs::copy(folder.join(name), kept.join(name)) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    Ok(kept)
}

/// Makes room for one more: the evidence of failures long mended should not fill a disk.
fn forget_oldest(failures: &Path) {
    let entries = std::fs::read_dir(failures).into_iter().flatten();
    let mut kept: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    // Their names begin with the time.
    kept.sort();
    let spare = kept.len().saturating_sub(KEPT - 1);
    for folder in &kept[..spare] {
        // Another run may be removing it, too.
        let _ = std::fs::remove_dir_all(folder);
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.verdict)?;
        match &self.evidence {
            Some(folder) => {
                let kept = EVIDENCE.iter().filter(|name| folder.join(name).exists());
                let kept: Vec<_> = kept.copied().collect();
                write!(f, "\nkept in {}: {}", folder.display(), kept.join(", "))
            }
            None => Ok(()),
        }
    }
}

impl std::error::Error for Failure {}
