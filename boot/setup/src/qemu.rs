//! Finds a QEMU: the user's choice, the system's, or a QEMU unpacked into the cache.
//!
//! Nothing is ever installed on the system. If QEMU is missing, or cannot open a window that the user wants,
//! Debian's packages are unpacked into the cache, with the libraries that the system lacks. That needs no
//! administrator and no confirmation, and cannot conflict with installed packages.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::apt::{self, MACHINE, Request};
use super::cache::{Cache, LockedCache, is_full};
use super::options::Options;
use system::say;
use system::{Interrupted, child};

const PROGRAM: &str = "qemu-system-x86_64";

/// The packages to unpack: QEMU, and its window.
const PACKAGES: [&str; 2] = ["qemu-system-x86", "qemu-system-gui"];

/// A QEMU that was checked to start.
#[derive(Debug, Clone)]
pub struct Qemu {
    /// The program.
    pub path: PathBuf,
    /// The version, as the program prints it.
    pub version: String,
    /// The program's displays, by QEMU's names (`none`, `gtk`, `sdl`, ...).
    pub displays: Vec<String>,
}

impl Qemu {
    fn check(path: PathBuf) -> anyhow::Result<Self> {
        let failed = || format!("{}: not a working QEMU", path.display());
        let output = child::run(child::command(&path).arg("--version")).with_context(failed)?;
        let Some((_, version)) = output
            .lines()
            .next()
            .unwrap_or_default()
            .split_once(" version ")
        else {
            bail!("{}: `--version` prints no version", failed());
        };
        let help =
            child::run(child::command(&path).args(["-display", "help"])).with_context(failed)?;
        Ok(Self {
            version: version.to_owned(),
            displays: displays(&help),
            path,
        })
    }

    /// Returns whether the program can open a window on a desktop.
    pub fn has_window(&self) -> bool {
        self.displays
            .iter()
            .any(|display| display == "gtk" || display == "sdl")
    }

    /// Returns whether the program meets the options: a window, if the user wants one.
    fn satisfies(&self, options: &Options) -> bool {
        self.has_window() || !options.window
    }
}

/// Parses the output of `-display help`: a heading, then a name on each line. Newer versions print an
/// explanation after an empty line.
fn displays(help: &str) -> Vec<String> {
    let names = help
        .lines()
        .skip(1)
        .take_while(|line| !line.trim().is_empty());
    names.map(|line| line.trim().to_owned()).collect()
}

/// Returns the best existing QEMU: the user's choice, else the system's, else the cache's. A QEMU that lacks
/// a requested window is returned only if no better one exists.
///
/// # Errors
/// If the user's choice or the system's QEMU does not work.
pub fn find(cache: &Cache, options: &Options) -> anyhow::Result<Option<Qemu>> {
    if let Some(path) = &options.qemu {
        let found = which::which(path);
        let found = found.with_context(|| {
            format!(
                "{}: not found; give the path of a {PROGRAM}",
                path.display()
            )
        })?;
        return Qemu::check(found).map(Some);
    }
    let system = which::which(PROGRAM).ok().map(Qemu::check).transpose()?;
    if system.as_ref().is_some_and(|qemu| qemu.satisfies(options)) {
        return Ok(system);
    }
    let unpacked = in_cache(cache, None)?;
    let better = unpacked.filter(|qemu| system.is_none() || qemu.satisfies(options));
    Ok(better.or(system))
}

/// Returns the name of the cache folder for an unpacked QEMU, of the system's suite or of another one.
fn folder(suite: Option<&str>) -> String {
    suite.map_or_else(|| "qemu".to_owned(), |suite| format!("qemu-{suite}"))
}

/// Returns the QEMU in the cache, if it still works. It can stop working, because it also needs libraries of
/// the system.
fn in_cache(cache: &Cache, suite: Option<&str>) -> anyhow::Result<Option<Qemu>> {
    let program = cache.path(&folder(suite)).join("bin").join(PROGRAM);
    if !program.exists() {
        return Ok(None);
    }
    match Qemu::check(program) {
        Ok(qemu) => Ok(Some(qemu)),
        Err(error) if error.is::<Interrupted>() => Err(error),
        Err(error) => {
            say(format_args!(
                "the cached QEMU does not work and is not used: {error:#}"
            ));
            Ok(None)
        }
    }
}

/// Finds a QEMU, or unpacks one into the cache.
///
/// # Errors
/// If no way to get a QEMU works: the message says what was tried and what to do. A missing window is not an
/// error.
pub fn get(cache: &LockedCache, options: &Options) -> anyhow::Result<Qemu> {
    let found = find(cache, options)?;
    // A QEMU that the user chose is used without a check for a window.
    if let Some(qemu) = &found
        && (qemu.satisfies(options) || options.qemu.is_some())
    {
        return Ok(qemu.clone());
    }
    match (unpack(cache, options.window, None), found) {
        (Ok(qemu), _) => Ok(qemu),
        (Err(error), _) if error.is::<Interrupted>() || is_full(&error) => Err(error),
        (Err(error), Some(qemu)) => {
            say(format_args!(
                "{}: this QEMU cannot open a window, and no other QEMU can be provided: {error:#}\n{}",
                qemu.path.display(),
                by_hand("qemu-system-gui")
            ));
            Ok(qemu)
        }
        (Err(error), None) => bail!(
            "QEMU: not installed, and Debian's packages cannot provide it: {error:#}\n{}\n\
             - give the path of a {PROGRAM}: --qemu PATH",
            by_hand(PACKAGES[0])
        ),
    }
}

/// Returns what the user can do about a missing package.
pub fn by_hand(package: &str) -> String {
    format!(
        "Do one of these, then try again:\n\
         - install QEMU for x86_64 with your system's package manager, or ask your administrator to \
         (Debian, Ubuntu: sudo apt-get install {package})"
    )
}

/// Returns the QEMU of a Debian suite, such as `bookworm-backports` or `sid`, without a window, from the
/// cache or newly unpacked into it. This needs a system with apt-get, and changes nothing on it.
///
/// # Errors
/// If the suite does not exist, or its packages cannot be fetched.
pub fn of_suite(cache: &LockedCache, suite: &str) -> anyhow::Result<Qemu> {
    let name = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
    if !suite.starts_with(|c: char| c.is_ascii_alphanumeric()) || !suite.chars().all(name) {
        bail!(
            "--suite '{suite}': not the name of a Debian suite; give a name such as bookworm-backports"
        );
    }
    match in_cache(cache, Some(suite))? {
        Some(qemu) => Ok(qemu),
        None => unpack(cache, false, Some(suite)),
    }
}

/// Unpacks Debian's packages of QEMU into the cache.
fn unpack(cache: &LockedCache, window: bool, suite: Option<&str>) -> anyhow::Result<Qemu> {
    let what = if window {
        "QEMU and its window"
    } else {
        "QEMU"
    };
    let request = Request {
        what,
        without_dependencies: &[],
        with_dependencies: &PACKAGES[..1 + usize::from(window)],
        // Fetched in any case, because the system's packages may be of another version than the program.
        always: &["qemu-", "seabios", "ipxe-qemu"],
        never: &[],
        suite,
        check: |_| Ok(()),
        // Measured: the unpacked files need 4 times the space of the packages.
        room: |bytes| 5 * bytes,
    };
    let temporary = cache.temporary_folder()?;
    let (packages, made) = (
        temporary.path().join("packages"),
        temporary.path().join("made"),
    );
    fs::create_dir(&made)?;
    let list = apt::fetch(cache, &request, &packages)?;
    apt::unpack(what, &list, &packages, &made)?;
    arrange(&made).context("Debian's packages do not have the expected layout")?;
    // A check before the new QEMU replaces an older one in the cache.
    Qemu::check(made.join("bin").join(PROGRAM))?;
    let place = cache.put(&made, &folder(suite))?;
    say(format_args!("QEMU is in {}", place.display()));
    Qemu::check(place.join("bin").join(PROGRAM))
}

/// Puts a script into `bin` that starts the QEMU in `usr` with the libraries, modules and firmware of its
/// packages.
fn arrange(made: &Path) -> anyhow::Result<()> {
    let libraries = format!("usr/lib/{MACHINE}-linux-gnu");
    if !made.join("usr/bin").join(PROGRAM).exists() {
        bail!("usr/bin/{PROGRAM}: missing");
    }
    let mut folders = BTreeSet::new();
    with_libraries(made, Path::new(&libraries), &mut folders)?;
    let path = folders
        .iter()
        .map(|folder| format!("$top/{folder}"))
        .collect::<Vec<_>>()
        .join(":");
    // A C library works only with its own loader. If the packages have a C library, they also have its
    // loader.
    let loader = fs::read_dir(made.join(&libraries))?
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .find(|name| name.starts_with("ld-linux"));
    let start = match loader {
        Some(loader) => format!("exec \"$top/{libraries}/{loader}\" --library-path \"{path}\""),
        None => format!("LD_LIBRARY_PATH={path} exec"),
    };
    let text = format!(
        "#!/bin/sh\n\
         top=${{0%/*}}/..\n\
         export QEMU_MODULE_DIR=\"$top/{libraries}/qemu\"\n\
         export XDG_DATA_DIRS=\"${{XDG_DATA_DIRS:-/usr/local/share:/usr/share}}:$top/usr/share\"\n\
         {start} \"$top/usr/bin/{PROGRAM}\" -L \"$top/usr/share/qemu\" -L \"$top/usr/share/seabios\" \
         -L \"$top/usr/lib/ipxe/qemu\" \"$@\"\n"
    );
    let script = made.join("bin").join(PROGRAM);
    fs::create_dir(made.join("bin"))?;
    fs::write(&script, text)?;
    fs::set_permissions(&script, fs::Permissions::from_mode(0o755))?;
    Ok(())
}

/// Collects the folders that contain shared libraries, in `folder` and below it, as paths relative to `top`.
fn with_libraries(top: &Path, folder: &Path, folders: &mut BTreeSet<String>) -> anyhow::Result<()> {
    for entry in fs::read_dir(top.join(folder))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.file_type()?.is_dir() {
            with_libraries(top, &folder.join(&name), folders)?;
        } else if name.starts_with("lib") && name.contains(".so") {
            folders.insert(folder.display().to_string());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_displays_of_old_and_new_versions_are_read() {
        let old = "Available display backend types:\nnone\ngtk\negl-headless\n";
        let new =
            format!("{old}\nSome display backends support suboptions, which can be set with\n");
        assert_eq!(displays(old), ["none", "gtk", "egl-headless"]);
        assert_eq!(displays(&new), displays(old));
        assert_eq!(displays(""), [""; 0]);
    }
}
