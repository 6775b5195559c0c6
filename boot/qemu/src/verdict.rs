//! The verdict on a run: its message, its exit code and its evidence.

use std::ffi::OsString;
use std::fmt;
use std::fs::{File, read_dir};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::ExitStatus;
use std::time::SystemTime;

use super::option::{names_accelerator, option};
use frames::rgb::RgbImage;

/// MiB of memory with which the image boots on every QEMU version tried: 7.2 needs 25, versions from 10 on up
/// to 32.
const ENOUGH_MIB: u64 = 32;
/// QEMU options that may replace the image by other firmware or another system.
const OTHER_FIRMWARE: [&str; 6] = ["bios", "boot", "kernel", "L", "option-rom", "pflash"];

/// Number of failures whose evidence is kept; older evidence is removed.
const KEPT: usize = 20;

/// How a run ended, unless the kernel left on command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The user closed the window, reset or powered down the machine from QEMU's menu, or ended QEMU by a
    /// signal.
    User,
    /// The kernel panicked.
    Panic {
        /// The kernel's report.
        report: Vec<String>,
    },
    /// The CPU raised an exception in the kernel.
    Exception {
        /// The kernel's report.
        report: Vec<String>,
    },
    /// The display adapter does not support Mode X.
    Adapter {
        /// The kernel's report.
        report: Vec<String>,
    },
    /// The machine reset itself while the kernel was running.
    TripleFault {
        /// Whether the kernel was seen to start a second time; otherwise only the reset was seen.
        booted: bool,
    },
    /// Something that this program waited for did not come in time.
    Hang {
        /// What did not come, as a noun phrase.
        waited_for: String,
    },
    /// The boot loader ended before it reached the kernel.
    BootLoader {
        /// Whether the machine reset; otherwise nothing happened at all.
        reset: bool,
        /// QEMU's answers about the machine.
        found: Found,
    },
    /// The serial line carried data that the kernel of this version does not send.
    Garbled {
        /// What is wrong with the data.
        why: String,
    },
    /// QEMU itself failed.
    Qemu {
        /// QEMU's output.
        words: Vec<String>,
        /// QEMU's exit status, if it had ended.
        status: Option<ExitStatus>,
    },
}

impl Verdict {
    /// Returns this program's exit code for the verdict.
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
            // The exit code that a shell reports for Ctrl-C.
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
                "the display adapter does not take Mode X{}\nQEMU 10.0 with `-machine smm=off` shows RAM \
                 in place of video memory: leave that option out. In place of another adapter use \
                 `--vga std`",
                Indented(report)
            ),
            Self::TripleFault { booted: false } => f.write_str(
                "the machine reset itself: a triple fault (an exception that the kernel could not even report)",
            ),
            Self::TripleFault { booted: true } => f.write_str("the kernel started a second time: a reboot loop"),
            Self::Hang { waited_for } => {
                write!(f, "the kernel hangs: {waited_for} did not come in time")
            }
            Self::BootLoader { reset, found } => {
                let end = if *reset { "reset the machine" } else { "stopped" };
                write!(f, "the boot loader {end} before it reached the kernel{found}")
            }
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

/// The properties of a machine whose boot loader did not reach the kernel.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Bytes of memory, if QEMU reported them.
    pub memory: Option<u64>,
    /// Whether the CPU has long mode, if QEMU reported it.
    pub long_mode: Option<bool>,
    /// The user's arguments for QEMU.
    pub arguments: Vec<OsString>,
    /// The lines on the screen, if it is in text mode.
    pub screen: Vec<String>,
}

impl Found {
    /// Returns the reasons why the image may not boot on this machine, each with its remedy.
    fn causes(&self) -> Vec<String> {
        let mut causes = Vec::new();
        if let Some(bytes) = self.memory
            && bytes < ENOUGH_MIB << 20
        {
            causes.push(format!(
                "memory: the machine has {} MiB; give it at least {ENOUGH_MIB} (`-m {ENOUGH_MIB}`)",
                bytes >> 20
            ));
        }
        if self.long_mode == Some(false) {
            causes.push(
                "CPU: it has no long mode, and the kernel is 64-bit code; name a 64-bit CPU \
                 (`-cpu qemu64`)"
                    .into(),
            );
        }
        if names_accelerator(&self.arguments) {
            causes.push(
                "accelerator: the image is tried with TCG only; leave yours out to use it".into(),
            );
        }
        for word in &self.arguments {
            let word = word.to_string_lossy();
            if option(&word).is_some_and(|name| OTHER_FIRMWARE.contains(&name)) {
                causes.push(format!(
                    "firmware: `{word}` may put other firmware or another system in the image's \
                     place; leave it out"
                ));
            } else if word.contains("if=pflash") || word.contains("bootindex=") {
                causes.push(format!(
                    "disk: `{word}` may boot before the image; leave it out"
                ));
            }
        }
        causes
    }
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let causes = self.causes();
        write!(f, "{}", Indented(&causes))?;
        if causes.is_empty() {
            f.write_str(
                "\n  display adapter: the boot loader needs a VGA core with VESA modes; `-vga std`, \
                 `cirrus`, `vmware` and `virtio` have one, `-vga none`, `bochs-display`, `ramfb` and \
                 `ati-vga` have none",
            )?;
        }
        if self.screen.is_empty() {
            return Ok(());
        }
        write!(f, "\n  its screen says:")?;
        self.screen
            .iter()
            .try_for_each(|line| write!(f, "\n    {line}"))
    }
}

/// Returns the non-empty lines in VGA text memory: two bytes for each place, the character and its colours,
/// and 80 places in a line.
///
/// Returns no lines if a character is not printable ASCII or zero: the memory then holds something else.
pub fn text_lines(memory: &[u8]) -> Vec<String> {
    let characters = memory.iter().step_by(2);
    let is_text = |byte: u8| byte == 0 || (b' '..=b'~').contains(&byte);
    if !characters.clone().all(|&byte| is_text(byte)) {
        return Vec::new();
    }
    let characters: Vec<u8> = characters.map(|&byte| byte.max(b' ')).collect();
    let lines = characters.chunks(80);
    let lines = lines.map(|line| String::from_utf8_lossy(line).trim_end().to_string());
    lines.filter(|line| !line.is_empty()).collect()
}

/// Returns an explanation of QEMU's output, if the output is a known error.
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

/// Lines below a message, indented.
struct Indented<'a>(&'a [String]);

impl fmt::Display for Indented<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|line| write!(f, "\n  {line}"))
    }
}

/// The evidence of a run, in case it fails.
#[derive(Debug)]
pub(super) struct Evidence {
    /// QEMU's command line.
    pub command: String,
    /// Everything on the serial line, in a file without a name.
    pub serial: Option<File>,
    /// The last screendump.
    pub screen: Option<RgbImage>,
}

impl Evidence {
    /// Writes the evidence into a new folder under `failures`, and returns that folder.
    fn keep(&self, failures: &Path) -> anyhow::Result<PathBuf> {
        std::fs::create_dir_all(failures)?;
        forget_oldest(failures);
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let seconds = now.map_or(0, |now| now.as_secs());
        let folder = tempfile::Builder::new()
            .prefix(&format!("{seconds}-"))
            .tempdir_in(failures)?
            .keep();
        std::fs::write(folder.join("command.txt"), &self.command)?;
        if let Some(log) = &self.serial {
            // Read from an explicit offset: the log's writer shares the file's position.
            let mut bytes = vec![0; log.metadata()?.len().try_into()?];
            log.read_exact_at(&mut bytes, 0)?;
            std::fs::write(folder.join("serial.log"), bytes)?;
        }
        if let Some(screen) = &self.screen {
            screen.write_png(File::create(folder.join("screen.png"))?)?;
        }
        Ok(folder)
    }
}

/// A verdict with its evidence.
#[derive(Debug)]
pub struct Failure {
    /// How the run ended.
    pub verdict: Verdict,
    /// The folder with QEMU's command line (`command.txt`), the serial log (`serial.log`) and a last
    /// screendump (`screen.png`, if QEMU could still take one).
    pub evidence: Option<PathBuf>,
}

impl Failure {
    pub(super) fn plain(verdict: Verdict) -> Self {
        Self {
            verdict,
            evidence: None,
        }
    }

    /// Keeps the evidence in a folder under `failures`, and returns the failure.
    pub(super) fn keep(verdict: Verdict, evidence: &Evidence, failures: &Path) -> Self {
        // If the evidence cannot be kept, the failure itself must still be reported.
        let evidence = evidence.keep(failures).ok();
        Self { verdict, evidence }
    }
}

/// Removes the oldest evidence, to make room for one more folder. Evidence of old failures must not fill the
/// disk.
fn forget_oldest(failures: &Path) {
    let entries = read_dir(failures).into_iter().flatten();
    let mut kept: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    // The folders' names begin with the time.
    kept.sort();
    let spare = kept.len().saturating_sub(KEPT - 1);
    for folder in &kept[..spare] {
        // Another run may be removing the same folder.
        let _ = std::fs::remove_dir_all(folder);
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.verdict)?;
        match &self.evidence {
            Some(folder) => {
                let kept = ["command.txt", "serial.log", "screen.png"].into_iter();
                let kept = kept.filter(|name| folder.join(name).exists());
                let kept: Vec<_> = kept.collect();
                write!(f, "\nkept in {}: {}", folder.display(), kept.join(", "))
            }
            None => Ok(()),
        }
    }
}

impl std::error::Error for Failure {}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(found: Found) -> String {
        let reset = false;
        Verdict::BootLoader { reset, found }.to_string()
    }

    #[test]
    fn a_stop_in_the_boot_loader_names_what_was_found() {
        let whole = Found {
            memory: Some(128 << 20),
            long_mode: Some(true),
            ..Found::default()
        };
        let adapter = said(whole.clone());
        assert!(adapter.contains("display adapter"), "{adapter}");
        let with = |words: &[&str]| Found {
            arguments: words.iter().map(OsString::from).collect(),
            ..whole.clone()
        };
        for (found, words) in [
            (
                Found {
                    memory: Some(16 << 20),
                    ..whole.clone()
                },
                "has 16 MiB; give it at least 32",
            ),
            (
                Found {
                    long_mode: Some(false),
                    ..whole.clone()
                },
                "no long mode",
            ),
            (with(&["-accel", "kvm"]), "leave yours out"),
            (with(&["-bios", "other.bin"]), "`-bios`"),
            (with(&["--kernel", "vmlinuz"]), "`--kernel`"),
            (with(&["-drive", "if=pflash,file=x"]), "`if=pflash,file=x`"),
            (
                with(&["-device", "ide-hd,drive=x,bootindex=0"]),
                "boot before the image",
            ),
        ] {
            let said = said(found);
            assert!(said.contains(words), "{said}");
            assert!(!said.contains("display adapter"), "{said}");
        }
        assert!(said(with(&["-m", "64"])).contains("display adapter"));
    }

    #[test]
    fn text_memory_is_read_as_lines_or_not_at_all() {
        let mut memory = [b' ', 7].repeat(80 * 25);
        for (i, character) in b"No bootable device.".iter().enumerate() {
            memory[2 * (160 + i)] = *character;
        }
        assert_eq!(text_lines(&memory), ["No bootable device."]);
        let found = Found {
            screen: text_lines(&memory),
            ..Found::default()
        };
        let said = said(found);
        assert!(
            said.ends_with("its screen says:\n    No bootable device."),
            "{said}"
        );
        assert_eq!(text_lines(&[0; 4000]), [""; 0]);
        memory[0] = 0xFF;
        assert_eq!(text_lines(&memory), [""; 0]);
        assert_eq!(text_lines(&[]), [""; 0]);
    }
}
