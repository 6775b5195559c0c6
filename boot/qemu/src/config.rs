//! The configuration of a boot, and its time limits.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

use setup::Ready;

/// The time limits of a run.
///
/// A limit counts the processor time that QEMU uses. An idle QEMU reaches the limit by wall time, and every
/// wait ends after 15 times the limit in wall time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// From QEMU's start to the kernel's first line.
    pub boot: Duration,
    /// For each answer of the kernel or of QEMU, and for QEMU's end.
    pub answer: Duration,
    /// For a user's pause of the machine while this program waits for an answer; wall time.
    pub pause: Duration,
}

impl Default for Limits {
    /// Returns at least ten times the time of each step on a quiet machine: 1.2 s for a boot, 1 s for a
    /// dump of all video memory. (A boot from an IDE disk, which this crate does not use, needs 2.5 s.) A
    /// pause may last an hour.
    fn default() -> Self {
        Self {
            boot: Duration::from_secs(20),
            answer: Duration::from_secs(10),
            pause: Duration::from_secs(3600),
        }
    }
}

/// The configuration of a boot.
#[derive(Clone, Debug)]
pub struct Config {
    /// QEMU's program.
    pub qemu: PathBuf,
    /// The disk image.
    pub image: PathBuf,
    /// The value of QEMU's `-vga`.
    pub vga: String,
    /// The value of QEMU's `-display`; `none` for no window.
    pub display: String,
    /// The checksum of the model file that the kernel must accept. If it is `None`, the kernel may refuse the
    /// model file, and [`Vm::model_answer`](super::Vm::model_answer) returns its answer.
    pub model_file: Option<u32>,
    /// More arguments for QEMU.
    pub arguments: Vec<OsString>,
    /// The folder for evidence: each failure gets a new folder in it.
    pub failures: PathBuf,
    /// The time limits.
    pub limits: Limits,
}

impl Config {
    /// Returns the configuration for the image on QEMU's standard adapter, without a window. Evidence is kept
    /// in a folder beside the image.
    pub fn new(ready: &Ready) -> Self {
        Self {
            qemu: ready.qemu.path.clone(),
            image: ready.image.clone(),
            vga: "std".into(),
            display: "none".into(),
            model_file: None,
            arguments: Vec::new(),
            failures: ready.image.with_file_name("failures"),
            limits: Limits::default(),
        }
    }
}
