//! The pinned toolchain from Debian's packages, unpacked into the cache, without root and without an
//! installation.
//!
//! At another place in the file system, Debian's compiler still finds its library folder, but not its shared
//! libraries. So a small script starts each program and says where its libraries are. The cache keeps the
//! packages, because the archive drops a version when the next version arrives.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::apt::{self, MACHINE, Package, Request};
use super::cache::{self, Cache, LockedCache, is_full};
use super::pin;
use super::toolchain::{self, Toolchain, VARIABLE};
use system::say;
use system::{Interrupted, child};

/// The request for the compiler's packages.
const REQUEST: Request = Request {
    what: "Rust",
    // Without dependencies: `rustc-web` depends on a C compiler, and a system with cargo already has a C
    // compiler.
    without_dependencies: &pin::DEBIAN_RUST,
    with_dependencies: &pin::DEBIAN_LLVM,
    always: &pin::DEBIAN_LLVM,
    // The scripts set `LD_LIBRARY_PATH`. The linker inherits it, and another C library would break the
    // linker.
    never: &["libc6", "libgcc-s1", "libstdc++6"],
    suite: None,
    check,
    room: |_| pin::DEBIAN_UNPACKED + pin::BUILDS,
};

/// Makes the toolchain from the packages in the cache, or from newly fetched packages.
pub fn install(cache: &LockedCache) -> anyhow::Result<Toolchain> {
    let folder = kept(cache);
    if let Some(packages) = apt::kept(&folder) {
        match make(cache, &packages, &folder) {
            Err(error) if !error.is::<Interrupted>() && !is_full(&error) => say(format_args!(
                "the cached packages do not make a toolchain and are downloaded again: {error:#}"
            )),
            done => return done,
        }
    }
    let what = format!("Rust {}", pin::RUST);
    let request = Request {
        what: &what,
        ..REQUEST
    };
    let packages = apt::fetch(cache, &request, &folder)?;
    make(cache, &packages, &folder)
}

/// Unpacks the packages, and puts the toolchain in its place in the cache.
fn make(cache: &LockedCache, packages: &[Package], folder: &Path) -> anyhow::Result<Toolchain> {
    cache.room(
        pin::DEBIAN_UNPACKED + pin::BUILDS,
        "Rust from Debian's packages",
    )?;
    let temporary = cache.temporary_folder()?;
    let what = "Rust from Debian's packages (about 15 s)";
    apt::unpack(what, packages, folder, temporary.path())?;
    let made = temporary.path().join("usr");
    arrange(&made).context("Debian's packages do not have the expected layout")?;
    toolchain::keep(cache, &made)
}

/// Checks that the compiler's own packages have the pinned version. LLVM and the libraries may have any
/// version.
fn check(package: &Package) -> anyhow::Result<()> {
    let (name, version) = (package.name(), package.version());
    let pinned = version
        .strip_prefix(pin::RUST)
        .is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit()));
    if name.contains("rust") && !pinned {
        bail!(
            "{name}: Debian's archive has version {version}, but Rust {} is required; \
             choose a complete toolchain of that version with --toolchain DIR or {VARIABLE}=DIR",
            pin::RUST
        );
    }
    Ok(())
}

/// Returns the folder of the cache that keeps the packages.
pub fn kept(cache: &Cache) -> PathBuf {
    cache.path(&format!("packages-{}", pin::RUST))
}

/// Gives Debian's `usr` the layout of a rustup toolchain.
fn arrange(usr: &Path) -> anyhow::Result<()> {
    // Of the 434 MB of sources, the compiler uses 80: `library`, and the files that name the version.
    let sources = usr.join("src").join(format!("rustc-{}", pin::RUST));
    for unused in ["src", "compiler"] {
        let unused = sources.join(unused);
        if unused.exists() {
            cache::remove(&unused)?;
        }
    }
    let rustc = usr.join("libexec/rustc");
    fs::create_dir_all(usr.join("libexec"))?;
    fs::rename(usr.join("bin/rustc"), rustc)?;
    script(usr, "bin/rustc", "..", "libexec/rustc")?;
    let programs = format!("lib/rustlib/{MACHINE}-unknown-linux-gnu/bin");
    fs::create_dir_all(usr.join(&programs))?;
    for (name, program, option) in [
        ("llvm-objcopy", "llvm-objcopy", &["--version"][..]),
        ("llvm-objdump", "llvm-objdump", &["--version"]),
        ("rust-lld", "lld", &["-flavor", "gnu", "--version"]),
    ] {
        let program = format!("{}/{program}", pin::LLVM_PROGRAMS);
        let name = format!("{programs}/{name}");
        script(usr, &name, "../../../..", &program)?;
        // A program starts only if all its libraries are found.
        child::run(child::command(usr.join(&name)).args(option))?;
    }
    Ok(())
}

/// Writes a script that starts `program` with its shared libraries. `up` leads from the script's folder to
/// `usr`. The script finds `program` and the libraries relative to its own path, because the whole folder is
/// renamed later.
fn script(usr: &Path, name: &str, up: &str, program: &str) -> anyhow::Result<()> {
    if !usr.join(program).exists() {
        bail!("{program}: missing");
    }
    let text = format!(
        "#!/bin/sh\ntop=${{0%/*}}/{up}\nLD_LIBRARY_PATH=$top/lib/{MACHINE}-linux-gnu exec \"$top/{program}\" \"$@\"\n"
    );
    let path = usr.join(name);
    fs::write(&path, text)?;
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_compilers_packages_must_have_the_pinned_version() {
        let pinned = |file: &str| check(&Package::of_file(file)).is_ok();
        assert!(pinned("rustc-web_1.96.0+dfsg1-1_amd64.deb"));
        assert!(pinned("llvm-22_1%3a22.1.8-1_amd64.deb"));
        for other in ["1.96.01", "1.96.1+dfsg1-1", "1.85.0+dfsg3-1", ""] {
            assert!(
                !pinned(&format!("libstd-rust-web-dev_{other}_amd64.deb")),
                "{other}"
            );
        }
    }
}
