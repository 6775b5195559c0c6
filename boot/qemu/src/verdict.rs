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
const MIN_MIB: u64 = 32;
/// QEMU options that may replace the image by other firmware or another system.
const FIRMWARE_OPTIONS: [&str; 6] = ["bios", "boot", "kernel", "L", "option-rom", "pflash"];

/// Number of failures whose evidence is kept; older evidence is removed.
const MAX_FAILURES: usize = 20;

/// How a run failed. A run in which the kernel left on command has no verdict.
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
        /// Whether the machine reset; otherwise it stopped without a reset.
        reset: bool,
        /// The properties of the machine that explain the end.
        diagnosis: BootDiagnosis,
    },
    /// The serial line carried data that the kernel of this version does not send.
    Garbled {
        /// What is wrong with the data.
        why: String,
    },
    /// QEMU itself failed.
    Qemu {
        /// QEMU's output.
        output: Vec<String>,
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
                "the display adapter does not support Mode X{}\nWith `-machine smm=off`, QEMU 10.0 shows RAM in \
                 place of video memory: leave that option out. With another adapter: use `--vga std`",
                Indented(report)
            ),
            Self::TripleFault { booted: false } => f.write_str(
                "the machine reset itself: a triple fault (an exception that the kernel could not report)",
            ),
            Self::TripleFault { booted: true } => f.write_str("the kernel started a second time: a reboot loop"),
            Self::Hang { waited_for } => {
                write!(f, "the kernel hangs: {waited_for} did not come within the time limit")
            }
            Self::BootLoader { reset, diagnosis } => {
                let end = if *reset { "reset the machine" } else { "stopped" };
                write!(f, "the boot loader {end} before it reached the kernel{diagnosis}")
            }
            Self::Garbled { why } => write!(f, "the serial line is garbled: {why}"),
            Self::Qemu { output, status } => {
                f.write_str("QEMU failed")?;
                if let Some(status) = status {
                    write!(f, " ({status})")?;
                }
                write!(f, "{}", Indented(output))?;
                match explain(output) {
                    Some(explanation) => write!(f, "\n{explanation}"),
                    None => Ok(()),
                }
            }
        }
    }
}

/// QEMU's answers about a machine whose boot loader did not reach the kernel.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BootDiagnosis {
    /// Bytes of memory, if QEMU reported them.
    pub memory: Option<u64>,
    /// Whether the CPU has long mode, if QEMU reported it.
    pub long_mode: Option<bool>,
    /// The user's arguments for QEMU.
    pub arguments: Vec<OsString>,
    /// The lines on the screen, if it is in text mode.
    pub screen: Vec<String>,
}

impl BootDiagnosis {
    /// Returns the reasons why the image may not boot on this machine, each with its remedy.
    fn causes(&self) -> Vec<String> {
        let mut causes = Vec::new();
        if let Some(bytes) = self.memory
            && bytes < MIN_MIB << 20
        {
            causes.push(format!(
                "memory: the machine has {} MiB; give it at least {MIN_MIB} (`-m {MIN_MIB}`)",
                bytes >> 20
            ));
        }
        if self.long_mode == Some(false) {
            causes.push(
                "CPU: it has no long mode, but the kernel is 64-bit code; choose a 64-bit CPU \
                 (`-cpu qemu64`)"
                    .into(),
            );
        }
        if names_accelerator(&self.arguments) {
            causes.push(
                "accelerator: the image was tested with TCG only; leave the option out to use TCG"
                    .into(),
            );
        }
        for word in &self.arguments {
            let word = word.to_string_lossy();
            if option(&word).is_some_and(|name| FIRMWARE_OPTIONS.contains(&name)) {
                causes.push(format!(
                    "firmware: `{word}` may boot other firmware or another system; leave it out"
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

impl fmt::Display for BootDiagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let causes = self.causes();
        write!(f, "{}", Indented(&causes))?;
        if causes.is_empty() {
            f.write_str(
                "\n  display adapter: the boot loader needs a VGA core with VESA modes: `-vga std`, \
                 `cirrus`, `vmware` and `virtio` have it; `-vga none`, `bochs-display`, `ramfb` and \
                 `ati-vga` do not",
            )?;
        }
        if self.screen.is_empty() {
            return Ok(());
        }
        write!(f, "\n  the text on the screen:")?;
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
fn explain(output: &[String]) -> Option<&'static str> {
    let has = |text: &str| output.iter().any(|line| line.contains(text));
    if has("Failed to get") && has("lock") {
        Some(
            "Another program has locked the disk image; end that program, or boot a copy (`image --out FILE`).",
        )
    } else if has("initialization failed") || has("cannot open display") {
        Some("The window cannot be opened; use `--headless` to run without a window.")
    } else if has("No space left") {
        Some("The disk for temporary files is full; set TMPDIR to another folder.")
    } else if output.is_empty() {
        Some("QEMU printed nothing: it was killed, or it crashed.")
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
    /// Writes the evidence into a new folder under `failures`, and returns the new folder's path.
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
    let mut folders: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    // The folders' names begin with the time.
    folders.sort();
    let spare = folders.len().saturating_sub(MAX_FAILURES - 1);
    for folder in &folders[..spare] {
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
                write!(f, "\nevidence in {}: {}", folder.display(), kept.join(", "))
            }
            None => Ok(()),
        }
    }
}

impl std::error::Error for Failure {}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(diagnosis: BootDiagnosis) -> String {
        let reset = false;
        Verdict::BootLoader { reset, diagnosis }.to_string()
    }

    #[test]
    fn the_message_about_a_stopped_boot_loader_names_the_cause() {
        let sound = BootDiagnosis {
            memory: Some(128 << 20),
            long_mode: Some(true),
            ..BootDiagnosis::default()
        };
        let adapter = message(sound.clone());
        assert!(adapter.contains("display adapter"), "{adapter}");
        let with = |words: &[&str]| BootDiagnosis {
            arguments: words.iter().map(OsString::from).collect(),
            ..sound.clone()
        };
        for (diagnosis, text) in [
            (
                BootDiagnosis {
                    memory: Some(16 << 20),
                    ..sound.clone()
                },
                "has 16 MiB; give it at least 32",
            ),
            (
                BootDiagnosis {
                    long_mode: Some(false),
                    ..sound.clone()
                },
                "no long mode",
            ),
            (with(&["-accel", "kvm"]), "leave the option out"),
            (with(&["-bios", "other.bin"]), "`-bios`"),
            (with(&["--kernel", "vmlinuz"]), "`--kernel`"),
            (with(&["-drive", "if=pflash,file=x"]), "`if=pflash,file=x`"),
            (
                with(&["-device", "ide-hd,drive=x,bootindex=0"]),
                "boot before the image",
            ),
        ] {
            let message = message(diagnosis);
            assert!(message.contains(text), "{message}");
            assert!(!message.contains("display adapter"), "{message}");
        }
        assert!(message(with(&["-m", "64"])).contains("display adapter"));
    }

    #[test]
    fn text_memory_gives_lines_only_if_every_character_is_printable() {
        let mut memory = [b' ', 7].repeat(80 * 25);
        for (i, character) in b"No bootable device.".iter().enumerate() {
            memory[2 * (160 + i)] = *character;
        }
        assert_eq!(text_lines(&memory), ["No bootable device."]);
        let diagnosis = BootDiagnosis {
            screen: text_lines(&memory),
            ..BootDiagnosis::default()
        };
        let message = message(diagnosis);
        assert!(
            message.ends_with("the text on the screen:\n    No bootable device."),
            "{message}"
        );
        assert_eq!(text_lines(&[0; 4000]), [""; 0]);
        memory[0] = 0xFF;
        assert_eq!(text_lines(&memory), [""; 0]);
        assert_eq!(text_lines(&[]), [""; 0]);
    }
}
