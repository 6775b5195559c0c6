//! Provides everything that a boot needs, on the first `cargo run` or `cargo test`, without manual steps.
//!
//! It provides what a run needs and a new machine lacks: the pinned compiler with its library sources, the
//! boot loader built by that compiler, the kernel, the disk image, and QEMU. The user needs only a stable
//! cargo. Build scripts cannot do this work, because a nested cargo in the same target folder would wait
//! forever, so the host program does it.
//!
//! The set-up is one locked step. Every run does it, and so does every test that boots: cargo-nextest runs
//! each test in a separate process, and the set-up never assumes that another process has finished. A cache
//! entry is made in a temporary folder and renamed, so that it is complete or missing at every point at
//! which this program can be killed. An entry is verified before use, and made again if it is damaged.
//!
//! The report of [`doctor`] needs no set-up and changes nothing:
//!
//! ```
//! # fn main() -> anyhow::Result<()> {
//! let mut report = Vec::new();
//! setup::doctor(&setup::Options::default(), &mut report)?;
//! let report = String::from_utf8(report)?;
//! assert!(["cargo", "toolchain", "QEMU", "cache"].iter().all(|part| report.contains(part)));
//! # Ok(())
//! # }
//! ```

use std::io::Write;
use std::path::PathBuf;

use system::bytes;

mod apt;
mod build;
mod cache;
mod compiler;
mod debian;
mod doctor;
mod offline;
mod options;
mod pin;
mod qemu;
mod rustup;
mod settings;
mod sha256;
mod toolchain;

use build::Program;
pub use build::root;
use cache::Cache;
pub use options::Options;
pub use qemu::Qemu;

/// The files and the QEMU that a boot needs.
#[derive(Debug, Clone)]
pub struct Ready {
    /// The bootable disk image.
    pub image: PathBuf,
    /// The kernel in the image, as an ELF file.
    pub kernel: PathBuf,
    /// The QEMU that boots the image.
    pub qemu: Qemu,
}

/// Returns the folder of this workspace's images, and of the files made beside them.
pub fn folder() -> PathBuf {
    let [_, image] = build::folders();
    image
}

/// Does the set-up for the demo, as far as earlier runs have not done it.
///
/// # Errors
/// If a part cannot be provided: the message says what was tried, why it failed and what to do by hand.
/// [`Interrupted`](system::Interrupted) if the user stopped the program.
pub fn ready(options: &Options) -> anyhow::Result<Ready> {
    ready_with(options, Program::Demo)
}

/// Does the set-up for the benchmark kernel, which has a separate image. See [`ready`].
///
/// # Errors
/// As [`ready`].
pub fn ready_to_measure(options: &Options) -> anyhow::Result<Ready> {
    ready_with(options, Program::Bench)
}

fn ready_with(options: &Options, program: Program) -> anyhow::Result<Ready> {
    let cache = Cache::find()?.lock()?;
    // QEMU comes first: without a way to get it, the set-up fails at once, and the other parts need minutes.
    let qemu = qemu::get(&cache, options)?;
    let (kernel, image) = boot_files(&cache, options, program)?;
    Ok(Ready {
        image,
        kernel,
        qemu,
    })
}

/// Returns the QEMU of a Debian suite, such as `bookworm-backports` or `sid`, without a window, from the
/// cache or newly unpacked into it. `cargo run -- qemu --suite bookworm-backports` prints its path.
///
/// Use it to test versions other than the installed one. It needs a system with apt-get and its package
/// sources, and changes nothing on that system.
///
/// # Errors
/// If the suite does not exist, or its packages cannot be fetched.
pub fn qemu_of_suite(suite: &str) -> anyhow::Result<Qemu> {
    qemu::of_suite(&Cache::find()?.lock()?, suite)
}

/// Returns a QEMU, without an image.
///
/// # Errors
/// As [`ready`].
pub fn qemu(options: &Options) -> anyhow::Result<Qemu> {
    qemu::get(&Cache::find()?.lock()?, options)
}

/// Returns the demo's disk image, without a QEMU.
///
/// # Errors
/// As [`ready`].
pub fn image(options: &Options) -> anyhow::Result<PathBuf> {
    Ok(boot_files(&Cache::find()?.lock()?, options, Program::Demo)?.1)
}

fn boot_files(
    cache: &cache::LockedCache,
    options: &Options,
    program: Program,
) -> anyhow::Result<(PathBuf, PathBuf)> {
    // Without cargo the build would fail, so check for it before the downloads.
    build::cargo_path()?;
    let toolchain = compiler::get(cache, options)?;
    let maker = build::image_maker(cache, &toolchain)?;
    let kernel = build::kernel(cache, &toolchain, program)?;
    let ramdisk = options
        .ramdisk
        .as_deref()
        .filter(|_| program == Program::Demo);
    let image = build::image(&maker, program, ramdisk)?;
    Ok((kernel, image))
}

/// Writes a report of the parts that exist and the parts that are missing, and installs nothing. Returns
/// whether no part is missing.
///
/// # Errors
/// If `out` cannot be written, or no folder can hold the cache.
pub fn doctor(options: &Options, out: &mut impl Write) -> anyhow::Result<bool> {
    doctor::report(options, out)
}

/// Removes the cache, and the kernel and image of this workspace. Lists what it removed, and returns the
/// bytes freed.
///
/// # Errors
/// If something cannot be removed.
pub fn clean(out: &mut impl Write) -> anyhow::Result<u64> {
    let cache = Cache::find()?.lock()?;
    let mut freed = 0;
    for folder in cache.contents()?.into_iter().chain(build::folders()) {
        let size = cache::size(&folder);
        if folder.exists() {
            cache::remove(&folder)?;
            writeln!(out, "removed {} ({})", folder.display(), bytes(size))?;
            freed += size;
        }
    }
    writeln!(out, "{} freed", bytes(freed))?;
    Ok(freed)
}
