//! A toolchain that can build freestanding code.
//!
//! A complete toolchain has the compiler, the compiler's own library sources (`core` is built from them),
//! and the LLVM programs with which the boot loader's build makes flat binaries. An ordinary stable
//! toolchain has only the compiler.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::cache::LockedCache;
use super::pin;
use system::{child, say};

/// The environment variable that names a complete toolchain to use.
pub const VARIABLE: &str = "CRYSTAL_BALL_TOOLCHAIN";

/// A complete toolchain.
#[derive(Debug)]
pub struct Toolchain {
    /// The folder with `bin` and `lib`.
    pub folder: PathBuf,
    /// The output of `rustc -vV`. It identifies the compiler for which the image maker was built.
    pub version: String,
}

impl Toolchain {
    /// Checks that the toolchain in a folder is complete.
    ///
    /// # Errors
    /// If a part is missing: the message names every missing part.
    pub fn check(folder: &Path) -> anyhow::Result<Self> {
        let incomplete = || format!("{}: not a complete toolchain", folder.display());
        let folder = folder.canonicalize().with_context(incomplete)?;
        let rustc = folder.join("bin/rustc");
        if !rustc.exists() {
            bail!("{}: bin/rustc is missing", incomplete());
        }
        let version = child::run(
            child::command(&rustc)
                .arg("-vV")
                .env_remove("LD_LIBRARY_PATH"),
        )
        .with_context(incomplete)?;
        let host = field(&version, "host").unwrap_or("unknown");
        let programs = format!("lib/rustlib/{host}/bin");
        let missing: Vec<_> = [
            "lib/rustlib/src/rust/library/core/src/lib.rs (library sources: component rust-src)"
                .to_owned(),
            format!("{programs}/llvm-objcopy (component llvm-tools)"),
            format!("{programs}/llvm-objdump (component llvm-tools)"),
            format!("{programs}/rust-lld"),
        ]
        .into_iter()
        .filter(|part| !folder.join(part.split(' ').next().unwrap_or(part)).exists())
        .collect();
        if !missing.is_empty() {
            bail!(
                "{}: these parts are missing:\n  {}",
                incomplete(),
                missing.join("\n  ")
            );
        }
        Ok(Self { folder, version })
    }

    /// Checks as [`check`](Self::check) does, and also that the version is the pinned one.
    pub fn check_pinned(folder: &Path) -> anyhow::Result<Self> {
        let toolchain = Self::check(folder)?;
        let release = toolchain.release();
        if release != pin::RUST {
            bail!(
                "{}: this toolchain is Rust {release}, but {} is required",
                folder.display(),
                pin::RUST
            );
        }
        Ok(toolchain)
    }

    /// Returns the version's number.
    pub fn release(&self) -> &str {
        field(&self.version, "release").unwrap_or("of unknown version")
    }
}

fn field<'a>(version: &'a str, name: &str) -> Option<&'a str> {
    version
        .lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix(": "))
}

/// Returns the name of the pinned toolchain in the cache.
pub fn cached() -> String {
    format!("toolchain-{}", pin::RUST)
}

/// Puts a finished toolchain of the pinned version into the cache.
pub fn keep(cache: &LockedCache, made: &Path) -> anyhow::Result<Toolchain> {
    Toolchain::check_pinned(made)?;
    let place = cache.put(made, &cached())?;
    say(format_args!("Rust {} is in {}", pin::RUST, place.display()));
    Toolchain::check_pinned(&place)
}
