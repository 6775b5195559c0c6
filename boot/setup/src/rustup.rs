//! The pinned toolchain from rustup: the user's, or a private download.
//!
//! A download goes to a private `RUSTUP_HOME`, of which only the toolchain's folder is kept. The user's
//! toolchains, default and settings stay as they are.

use std::fs;
use std::path::Path;

use anyhow::{Context, bail};

use super::cache::{self, LockedCache};
use super::offline::offline;
use super::pin;
use super::toolchain::{self, Toolchain};
use system::Progress;
use system::child;

/// Returns the user's toolchain of the pinned version, if it is complete. It stays where it is.
pub fn installed() -> Option<Toolchain> {
    let rustup = which::which("rustup").ok()?;
    // Newer versions of rustup install the toolchain that `which` names, which would change the user's
    // toolchains.
    let mut command = child::command(rustup);
    command
        .args(["which", "--toolchain", pin::RUST, "rustc"])
        .env("RUSTUP_AUTO_INSTALL", "0");
    let rustc = child::run(&mut command).ok()?;
    let folder = Path::new(rustc.trim()).parent()?.parent()?;
    Toolchain::check_pinned(folder).ok()
}

/// Downloads the pinned toolchain into the cache.
pub fn download(cache: &LockedCache) -> anyhow::Result<Toolchain> {
    if let Some(setting) = offline() {
        bail!("cargo is offline ({setting}), so nothing is downloaded");
    }
    let rustup = which::which("rustup")
        .ok()
        .context("rustup is not installed")?;
    cache.room(pin::RUSTUP_UNPACKED + pin::BUILDS, "Rust from rustup")?;
    let home = cache.temporary_folder()?;
    let mut install = child::family(rustup);
    install.args([
        "toolchain",
        "install",
        pin::RUST,
        "--profile",
        "minimal",
        "--no-self-update",
    ]);
    install.args(["--component", "rust-src", "--component", "llvm-tools"]);
    install
        .env("RUSTUP_HOME", home.path())
        .env_remove("RUSTUP_TOOLCHAIN");
    let what = format!(
        "downloading Rust {} with rustup, once (about 15 s in addition to the download)",
        pin::RUST
    );
    let mut step = Progress::new(what, pin::RUSTUP_UNPACKED);
    child::watch(&mut install, |event| {
        step.on(event, || cache::size(home.path()))
    })?;
    drop(step);
    let toolchains = fs::read_dir(home.path().join("toolchains"))
        .context("rustup: no toolchain was installed")?;
    let made = toolchains
        .flatten()
        .next()
        .context("rustup: no toolchain was installed")?
        .path();
    toolchain::keep(cache, &made)
}
