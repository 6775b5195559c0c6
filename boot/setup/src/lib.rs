//! The set-up that `cargo run` and `cargo test` do on first use, and nobody has to remember.
//!
//! Everything a run needs and a new machine lacks: the pinned compiler with its library sources, the boot
//! loader built by it, the kernel, the disk image, a QEMU. Plain stable cargo is all the user has, and build
//! scripts cannot do this (a nested cargo in the same target folder waits for ever), so the host program does.
//!
//! It is one locked step, done by every run and by every test that boots: cargo-nextest runs each test in a
//! process of its own, and nothing here trusts that another process has finished. Whatever is kept in the
//! cache is made aside and renamed, so that it is whole or not there at every point where this
//! program can be killed; what is found there is verified before use and made again when it is damaged.

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
mod pin;
mod qemu;
mod rustup;
mod settings;
mod sha256;
mod toolchain;

use build::Program;
pub use build::root;
use cache::Cache;
pub use qemu::Qemu;

/// What the user may decide about the set-up.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// A complete Rust toolchain to use in place of the pinned one; `CRYSTAL_BALL_TOOLCHAIN` says the same.
    pub toolchain: Option<PathBuf>,
    /// The QEMU to use, in place of the one in `PATH` or in the cache.
    pub qemu: Option<PathBuf>,
    /// A window is wanted: a QEMU that can open one is preferred, or fetched.
    pub window: bool,
    /// What the kernel is to find in its ramdisk: a pack, as a rule.
    pub ramdisk: Option<Vec<u8>>,
}

/// All that is needed to boot.
#[derive(Debug, Clone)]
pub struct Ready {
    /// The bootable disk image.
    pub image: PathBuf,
    /// The kernel in it, as an ELF file.
    pub kernel: PathBuf,
    /// The QEMU to boot it with.
    pub qemu: Qemu,
}

/// Where this workspace's image is, and what is made beside it.
pub fn folder() -> PathBuf {
    let [_, image] = build::folders();
    image
}

/// Does the whole set-up, or what is left of it to do.
///
/// # Errors
/// When a part cannot be had: the message says what was tried, why it failed and what to do by hand.
/// [`Interrupted`](system::Interrupted) when the user stopped it.
pub fn ready(options: &Options) -> anyhow::Result<Ready> {
    ready_with(options, Program::Show)
}

/// The same for the program that measures, which has an image of its own.
///
/// # Errors
/// As [`ready`].
pub fn ready_to_measure(options: &Options) -> anyhow::Result<Ready> {
    ready_with(options, Program::Measure)
}

fn ready_with(options: &Options, program: Program) -> anyhow::Result<Ready> {
    let cache = Cache::find()?.lock()?;
    // First, because where there is no way to get it this fails at once, and the rest takes minutes.
    let qemu = qemu::get(&cache, options)?;
    let (kernel, image) = boot_files(&cache, options, program)?;
    Ok(Ready {
        image,
        kernel,
        qemu,
    })
}

/// Gets the QEMU of one of Debian's suites, such as `bookworm-backports` or `sid`, without a window: from the
/// cache, or unpacked into it. `cargo run -- qemu --suite bookworm-backports` prints its path.
///
/// This is for testing other versions than the installed one. It needs a system with apt-get and its package
/// sources, and changes nothing on it.
///
/// # Errors
/// When the suite does not exist, or its packages cannot be had.
pub fn qemu_of_suite(suite: &str) -> anyhow::Result<Qemu> {
    qemu::of_suite(&Cache::find()?.lock()?, suite)
}

/// Gets the QEMU alone, which needs no image.
///
/// # Errors
/// As [`ready`].
pub fn qemu(options: &Options) -> anyhow::Result<Qemu> {
    qemu::get(&Cache::find()?.lock()?, options)
}

/// The disk image alone, which needs no QEMU.
///
/// # Errors
/// As [`ready`].
pub fn image(options: &Options) -> anyhow::Result<PathBuf> {
    Ok(boot_files(&Cache::find()?.lock()?, options, Program::Show)?.1)
}

fn boot_files(
    cache: &cache::Locked,
    options: &Options,
    program: Program,
) -> anyhow::Result<(PathBuf, PathBuf)> {
    // Without a cargo the rest would be for nothing: this is known before the downloads.
    build::cargo_path()?;
    let toolchain = compiler::get(cache, options)?;
    let maker = build::image_maker(cache, &toolchain)?;
    let kernel = build::kernel(cache, &toolchain, program)?;
    let ramdisk = options
        .ramdisk
        .as_deref()
        .filter(|_| program == Program::Show);
    let image = build::image(&maker, program, ramdisk)?;
    Ok((kernel, image))
}

/// Tells what there is and what is missing, and installs nothing. True when a run has all it needs.
///
/// # Errors
/// When `out` cannot be written or there is no place for a cache.
pub fn doctor(options: &Options, out: &mut impl Write) -> anyhow::Result<bool> {
    doctor::report(options, out)
}

/// Removes the cache, and the kernel and image of this workspace; tells what, and returns the bytes freed.
///
/// # Errors
/// When something cannot be removed.
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
