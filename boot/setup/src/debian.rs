//! The pinned toolchain from Debian's packages, unpacked into the cache: no root, nothing installed.
//!
//! Debian's compiler finds its own library folder but not its own shared libraries when it stands elsewhere,
//! so each program is started through a small script that says where they are. The packages are kept: the
//! archive drops a version when the next one comes.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::apt::{self, MACHINE, Package, Wanted};
use super::cache::{self, Cache, Locked, is_full};
use super::pin;
use super::toolchain::{self, Toolchain, VARIABLE};
use system::say;
use system::{Interrupted, child};

/// The compiler's packages.
const WANTED: Wanted = Wanted {
    what: "Rust",
    // Without what it depends on: `rustc-web` depends on a C compiler, and cargo cannot be here without one.
    alone: &pin::DEBIAN_RUST,
    whole: &pin::DEBIAN_LLVM,
    own: &pin::DEBIAN_LLVM,
    // The scripts set `LD_LIBRARY_PATH`, which the linker inherits: another C library would break it.
    never: &["libc6", "libgcc-s1", "libstdc++6"],
    suite: None,
    check,
    room: |_| pin::DEBIAN_UNPACKED + pin::BUILDS,
};

/// Makes the toolchain from packages kept or fetched.
pub fn install(cache: &Locked) -> anyhow::Result<Toolchain> {
    let folder = kept(cache);
    if let Some(packages) = apt::kept(&folder) {
        match make(cache, &packages, &folder) {
            Err(error) if !error.is::<Interrupted>() && !is_full(&error) => say(format_args!(
                "the packages kept do not make a toolchain, and are fetched again: {error:#}"
            )),
            done => return done,
        }
    }
    let what = format!("Rust {}", pin::RUST);
    let wanted = Wanted {
        what: &what,
        ..WANTED
    };
    let packages = apt::fetch(cache, &wanted, &folder)?;
    make(cache, &packages, &folder)
}

/// Unpacks the packages and puts the toolchain in its place.
fn make(cache: &Locked, packages: &[Package], folder: &Path) -> anyhow::Result<Toolchain> {
    cache.room(
        pin::DEBIAN_UNPACKED + pin::BUILDS,
        "Rust from Debian's packages",
    )?;
    let aside = cache.aside()?;
    let what = "Rust from Debian's packages (about 15 s)";
    apt::unpack(what, packages, folder, aside.path())?;
    let made = aside.path().join("usr");
    arrange(&made).context("Debian's packages are not laid out as expected")?;
    toolchain::keep(cache, &made)
}

/// Only the compiler's own packages have the pinned version: LLVM and the libraries may have any.
fn check(package: &Package) -> anyhow::Result<()> {
    let (name, version) = (package.name(), package.version());
    let pinned = version
        .strip_prefix(pin::RUST)
        .is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit()));
    if name.contains("rust") && !pinned {
        bail!(
            "the archive has {name} {version}, and this project is pinned to {}: \
             give a complete toolchain of that version with --toolchain DIR or {VARIABLE}=DIR",
            pin::RUST
        );
    }
    Ok(())
}

/// The folder of the packages kept.
pub fn kept(cache: &Cache) -> PathBuf {
    cache.path(&format!("packages-{}", pin::RUST))
}

/// Gives Debian's `usr` the layout of a rustup toolchain.
fn arrange(usr: &Path) -> anyhow::Result<()> {
    // The compiler takes 80 of 434 MB of sources: `library`, and what says which version it is.
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
        // It starts only if all of its libraries are there.
        child::run(child::command(usr.join(&name)).args(option))?;
    }
    Ok(())
}

/// A script that starts `program` with its shared libraries. It finds both from its own place, `up` from the
/// top, because the whole folder is renamed afterwards.
fn script(usr: &Path, name: &str, up: &str, program: &str) -> anyhow::Result<()> {
    if !usr.join(program).exists() {
        bail!("there is no {program}");
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
    fn only_the_compilers_packages_have_the_pinned_version() {
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
