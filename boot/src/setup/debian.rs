//! The pinned toolchain from Debian's packages, unpacked into the cache: no root, nothing installed.
//!
//! Debian's compiler finds its own library folder but not its own shared libraries when it stands elsewhere,
//! so each program is started through a small script that says where they are. The packages are kept: the
//! archive drops a version when the next one comes.

use std::fmt::{self, Display, Formatter};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, anyhow, bail};
use sha2::{Digest, Sha256};

use super::cache::{self, Cache, Locked};
use super::pin;
use super::progress::{Step, say};
use super::toolchain::{self, Toolchain, VARIABLE, offline};
use crate::child::{self, Interrupted};

/// The list of the packages kept, beside them: apt-get's own words. Written when all are there.
const LIST: &str = "list";

/// The machine's name in Debian's and Rust's paths alike.
const MACHINE: &str = std::env::consts::ARCH;

/// Makes the toolchain from packages kept or fetched.
pub fn install(cache: &Locked) -> anyhow::Result<Toolchain> {
    let dpkg = which::which("dpkg")
        .ok()
        .context("this is no Debian system (no dpkg)")?;
    let packages = packages(cache)?;
    cache.room(
        pin::DEBIAN_UNPACKED + pin::BUILDS,
        "Rust from Debian's packages",
    )?;
    let aside = cache.aside()?;
    let total = packages.iter().map(|package| cache::size(package)).sum();
    let mut step = Step::new("unpacking Rust from Debian's packages (about 15 s)", total);
    let mut done = 0;
    for package in &packages {
        child::watch(
            child::family(&dpkg)
                .arg("-x")
                .arg(package)
                .arg(aside.path()),
            |event| step.on(event, || done),
        )?;
        done += cache::size(package);
        step.at(done);
    }
    drop(step);
    let made = aside.path().join("usr");
    arrange(&made).context("Debian's packages are not laid out as expected")?;
    toolchain::keep(cache, &made)
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
    for (name, program) in [
        ("llvm-objcopy", "llvm-objcopy"),
        ("llvm-objdump", "llvm-objdump"),
        ("rust-lld", "lld"),
    ] {
        let program = format!("{}/{program}", pin::LLVM_PROGRAMS);
        script(usr, &format!("{programs}/{name}"), "../../../..", &program)?;
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

/// A package as `apt-get --print-uris download` tells it.
#[derive(Debug, PartialEq, Eq)]
struct Package {
    file: String,
    bytes: u64,
    sha256: String,
}

impl Package {
    /// Reads `'URI' FILE BYTES SHA256:HASH`.
    fn parse(line: &str) -> Option<Self> {
        let mut words = line.strip_prefix('\'')?.split_once("' ")?.1.split(' ');
        let (file, bytes) = (words.next()?.to_owned(), words.next()?.parse().ok()?);
        let sha256 = words.next()?.strip_prefix("SHA256:")?.to_owned();
        Some(Self {
            file,
            bytes,
            sha256,
        })
    }

    fn parse_all(text: &str) -> Vec<Self> {
        text.lines().filter_map(Self::parse).collect()
    }

    fn name(&self) -> &str {
        self.file.split('_').next().unwrap_or_default()
    }

    fn version(&self) -> &str {
        self.file.split('_').nth(1).unwrap_or_default()
    }

    /// Whether it is what the pin means: LLVM and the libraries may be of any version.
    fn pinned(&self) -> bool {
        !self.name().contains("rust")
            || self
                .version()
                .strip_prefix(pin::RUST)
                .is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit()))
    }

    /// Whether a folder has it, whole and unchanged.
    fn is_in(&self, folder: &Path) -> bool {
        fs::read(folder.join(&self.file)).is_ok_and(|data| sha256(&data) == self.sha256)
    }
}

impl Display for Package {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        write!(f, "'' {} {} SHA256:{}", self.file, self.bytes, self.sha256)
    }
}

/// The hash as sixty-four hexadecimal digits.
pub fn sha256(data: &[u8]) -> String {
    Sha256::digest(data)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

/// The names of the packages that this system needs.
fn names() -> Vec<&'static str> {
    let libraries = Path::new("/usr/lib").join(format!("{MACHINE}-linux-gnu"));
    let missing = pin::DEBIAN_LIBRARIES
        .iter()
        .filter(|(file, _)| !libraries.join(file).exists());
    pin::DEBIAN
        .into_iter()
        .chain(missing.map(|(_, package)| *package))
        .collect()
}

/// The folder of the packages kept.
pub fn kept(cache: &Cache) -> PathBuf {
    cache.path(&format!("packages-{}", pin::RUST))
}

/// The package files, from the cache or fetched into it.
fn packages(cache: &Locked) -> anyhow::Result<Vec<PathBuf>> {
    let names = names();
    let folder = kept(cache);
    let list = Package::parse_all(&fs::read_to_string(folder.join(LIST)).unwrap_or_default());
    let whole = names
        .iter()
        .all(|name| list.iter().any(|package| package.name() == *name))
        && missing(&list, &folder).is_empty();
    let list = if whole {
        list
    } else {
        if let Some(setting) = offline() {
            bail!("cargo is offline ({setting}), so nothing is downloaded");
        }
        fetch(cache, &names, &folder)?
    };
    Ok(list
        .iter()
        .map(|package| folder.join(&package.file))
        .collect())
}

/// Fetches by the system's package lists, or, where those are missing or old, by lists of our own.
fn fetch(cache: &Locked, names: &[&str], folder: &Path) -> anyhow::Result<Vec<Package>> {
    which::which("apt-get")
        .ok()
        .context("this is no Debian system (no apt-get)")?;
    let system = Apt { lists: None };
    let listed = system.list(cache, names);
    if let Ok(list) = &listed {
        room(cache, list, folder)?;
    }
    match listed.and_then(|list| download(cache, &system, list, folder)) {
        Err(error) if !error.is::<Interrupted>() => {}
        done => return done,
    }
    say(
        "by this system's package lists it cannot be had; asking the archive for newer lists (kept apart)",
    );
    let lists = cache.aside()?;
    // apt-get makes neither.
    for folder in ["lists/partial", "cache/archives/partial"] {
        fs::create_dir_all(lists.path().join(folder))?;
    }
    let own = Apt {
        lists: Some(lists.path()),
    };
    // Its exit code is that of its worst source: what counts is whether the packages are found afterwards.
    let updated = child::run(own.command().args(["--error-on=any", "update"]));
    let list = match (own.list(cache, names), updated) {
        (Err(error), Err(update)) if !error.is::<Interrupted>() => {
            return Err(anyhow!("{update:#}\n{error:#}"));
        }
        (list, _) => list?,
    };
    room(cache, &list, folder)?;
    download(cache, &own, list, folder)
}

/// The packages of a list that are not in `folder` yet.
fn missing<'a>(list: &'a [Package], folder: &Path) -> Vec<&'a Package> {
    list.iter()
        .filter(|package| !package.is_in(folder))
        .collect()
}

fn room(cache: &Locked, list: &[Package], folder: &Path) -> anyhow::Result<()> {
    let download: u64 = missing(list, folder)
        .iter()
        .map(|package| package.bytes)
        .sum();
    cache.room(
        download + pin::DEBIAN_UNPACKED + pin::BUILDS,
        "Rust from Debian's packages",
    )
}

/// Downloads what is not in `folder` yet, and notes there what it has.
fn download(
    cache: &Locked,
    apt: &Apt,
    list: Vec<Package>,
    folder: &Path,
) -> anyhow::Result<Vec<Package>> {
    let missing = missing(&list, folder);
    let aside = cache.aside()?;
    if !missing.is_empty() {
        let total = missing.iter().map(|package| package.bytes).sum();
        let what = format!("downloading Rust {} as Debian packages, once", pin::RUST);
        let mut step = Step::new(what, total);
        let mut get = apt.command();
        get.arg("download")
            .args(missing.iter().map(|package| package.name()));
        get.current_dir(aside.path());
        let got = child::watch(&mut get, |event| {
            step.on(event, || cache::size(aside.path()))
        });
        drop(step);
        fs::create_dir_all(folder)?;
        // Also after a failure: what is whole need not be fetched again.
        for package in missing.iter().filter(|package| package.is_in(aside.path())) {
            fs::rename(aside.path().join(&package.file), folder.join(&package.file))?;
        }
        got?;
    }
    if let Some(package) = missing.iter().find(|package| !package.is_in(folder)) {
        let (file, hash) = (&package.file, &package.sha256);
        bail!("{file} was cut short or changed on its way: its SHA-256 is not {hash}");
    }
    let text: String = list.iter().map(|package| format!("{package}\n")).collect();
    fs::write(aside.path().join(LIST), text)?;
    fs::rename(aside.path().join(LIST), folder.join(LIST))?;
    Ok(list)
}

/// apt-get, with the system's package lists or with lists in a folder of ours.
struct Apt<'a> {
    lists: Option<&'a Path>,
}

impl Apt<'_> {
    fn command(&self) -> Command {
        let mut command = child::family("apt-get");
        // As root apt-get would download as another user, who cannot write to the cache, and warn about it.
        command
            .env("LC_ALL", "C")
            .args(["-q", "-o", "APT::Sandbox::User=root"]);
        if let Some(folder) = self.lists {
            for (option, name) in [("Dir::State::lists", "lists"), ("Dir::Cache", "cache")] {
                command
                    .arg("-o")
                    .arg(format!("{option}={}", folder.join(name).display()));
            }
        }
        command
    }

    /// What the archive has for these names, if it is the pinned version.
    fn list(&self, cache: &Locked, names: &[&str]) -> anyhow::Result<Vec<Package>> {
        // In an empty folder: it does not list what is there already.
        let empty = cache.aside()?;
        let ask = |names: &[&str]| {
            let mut command = self.command();
            command
                .args(["--print-uris", "download"])
                .args(names)
                .current_dir(empty.path());
            child::run(&mut command).map(|text| Package::parse_all(&text))
        };
        // Its own package has the version in its name, and is not found at all when the version is another.
        let compiler = ask(&pin::DEBIAN[..1])?;
        if let Some(other) = compiler.iter().find(|package| !package.pinned()) {
            bail!(
                "the archive has {} {}, and this project is pinned to {}: \
                 give a complete toolchain of that version with --toolchain DIR or {VARIABLE}=DIR",
                other.name(),
                other.version(),
                pin::RUST
            );
        }
        let list = ask(names)?;
        match names
            .iter()
            .find(|name| !list.iter().any(|package| package.name() == **name))
        {
            Some(name) => bail!("apt-get does not say where to get {name}"),
            None => Ok(list),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "'http://archive/pool/rustc-web_1.deb' rustc-web_1.96.0+dfsg1-1~deb12u2_amd64.deb 4450500 SHA256:8fef";

    #[test]
    fn reads_what_apt_get_says_and_what_it_wrote_itself() {
        let package = Package::parse(LINE).unwrap();
        assert_eq!(
            (package.name(), package.version()),
            ("rustc-web", "1.96.0+dfsg1-1~deb12u2")
        );
        assert_eq!(
            (package.bytes, package.sha256.as_str()),
            (4_450_500, "8fef")
        );
        assert_eq!(Package::parse(&package.to_string()), Some(package));
        let other = [
            "",
            "Reading package lists...",
            "'x' file",
            "'x' file 5 MD5Sum:00",
            "'x' file much SHA256:00",
        ];
        assert_eq!(Package::parse_all(&other.join("\n")), []);
    }

    #[test]
    fn only_the_compilers_packages_have_the_pinned_version() {
        let pinned = |file: &str| {
            Package {
                file: file.to_owned(),
                bytes: 0,
                sha256: String::new(),
            }
            .pinned()
        };
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
