//! A QEMU, and whether it can open a window.
//!
//! Installing it changes the system, which is never done silently: as root without a terminal (a container,
//! CI) after one line that says what and why, on a terminal after a yes, else by the user's own hand. The
//! installing apt-get is the one child that is *not* killed with this program: half-configured packages are
//! worse than a moment's wait.

use std::io::{IsTerminal, stderr, stdin};
use std::os::fd::AsFd;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, bail};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

use super::Options;
use super::progress::say;
use super::toolchain::offline;
use crate::child::{self, Interrupted, interrupted};

const PROGRAM: &str = "qemu-system-x86_64";
const PACKAGE: &str = "qemu-system-x86";
const WINDOW_PACKAGE: &str = "qemu-system-gui";

/// How long Ctrl-C may go unheard at a question.
const STEP: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 50_000_000,
};

/// A QEMU that starts.
#[derive(Debug, Clone)]
pub struct Qemu {
    /// The program.
    pub path: PathBuf,
    /// Its version, as it says it.
    pub version: String,
    /// The displays it has, by QEMU's names (`none`, `gtk`, `sdl`, ...).
    pub displays: Vec<String>,
}

impl Qemu {
    fn check(path: PathBuf) -> anyhow::Result<Self> {
        let failed = || format!("{} does not work as a QEMU", path.display());
        let said = child::run(child::command(&path).arg("--version")).with_context(failed)?;
        let Some((_, version)) = said
            .lines()
            .next()
            .unwrap_or_default()
            .split_once(" version ")
        else {
            bail!("{}: it does not tell its version", failed());
        };
        let help =
            child::run(child::command(&path).args(["-display", "help"])).with_context(failed)?;
        Ok(Self {
            version: version.to_owned(),
            displays: displays(&help),
            path,
        })
    }

    /// Whether it can open a window on a desktop.
    pub fn has_window(&self) -> bool {
        self.displays
            .iter()
            .any(|display| display == "gtk" || display == "sdl")
    }
}

/// Reads `-display help`: a heading, a name a line, and from some versions on an explanation after a gap.
fn displays(help: &str) -> Vec<String> {
    let names = help
        .lines()
        .skip(1)
        .take_while(|line| !line.trim().is_empty());
    names.map(|line| line.trim().to_owned()).collect()
}

/// The QEMU that is there, if any.
///
/// # Errors
/// When the one there does not work.
pub fn find(options: &Options) -> anyhow::Result<Option<Qemu>> {
    match options.qemu.clone().or_else(|| which::which(PROGRAM).ok()) {
        Some(path) => Qemu::check(
            which::which(&path).with_context(|| format!("there is no {}", path.display()))?,
        )
        .map(Some),
        None => Ok(None),
    }
}

/// Finds a QEMU, or installs one where that is allowed; the same for its window, where one is wanted.
///
/// # Errors
/// When there is none, with the command that installs it. Being without a window is no error.
pub fn get(options: &Options) -> anyhow::Result<Qemu> {
    let again = || find(options)?.with_context(|| format!("there is still no {PROGRAM} in PATH"));
    let mut qemu = match find(options)? {
        Some(qemu) => qemu,
        None => {
            let missing =
                format!("{PROGRAM} is not installed, and it is the machine that the demo runs on");
            install(PACKAGE, &missing)?;
            again()?
        }
    };
    // A QEMU of the user's own choice does not load Debian's modules.
    if options.window && options.qemu.is_none() && !qemu.has_window() {
        match install(WINDOW_PACKAGE, "this QEMU cannot open a window") {
            Ok(()) => qemu = again()?,
            Err(error) if error.is::<Interrupted>() => return Err(error),
            Err(error) => say(format_args!("{error:#}")),
        }
    }
    Ok(qemu)
}

/// Who may install, and how.
#[derive(Debug, PartialEq, Eq)]
enum Right {
    /// At once.
    Now,
    /// After a yes, as root or through sudo.
    Ask { sudo: bool },
    /// Only the user's own hand.
    None,
}

fn right(root: bool, terminal: bool, sudo: bool) -> Right {
    match (root, terminal) {
        (true, false) => Right::Now,
        (false, true) if !sudo => Right::None,
        (_, true) => Right::Ask { sudo: !root },
        (false, false) => Right::None,
    }
}

fn install(package: &str, why: &str) -> anyhow::Result<()> {
    if which::which("apt-get").is_err() {
        bail!(
            "{why}; install QEMU for x86_64 with your system's package manager (Debian calls it {package}), or name one with --qemu PATH"
        );
    }
    let root = rustix::process::geteuid().is_root();
    let right = right(
        root,
        stdin().is_terminal() && stderr().is_terminal(),
        which::which("sudo").is_ok(),
    );
    let by_hand = format!(
        "{0}apt-get update && {0}apt-get install --no-install-recommends {package}",
        if root { "" } else { "sudo " }
    );
    if offline().is_some() || right == Right::None {
        bail!("{why}; install it with\n  {by_hand}");
    }
    if let Right::Ask { .. } = right {
        say(format_args!(
            "{why}. Install it on this system, with\n  {by_hand}\nnow? [y/N]"
        ));
        if !matches!(answer()?.trim().to_lowercase().as_str(), "y" | "yes") {
            bail!("{why}; when you want it:\n  {by_hand}");
        }
    } else {
        say(format_args!(
            "{why}: installing Debian's package {package} on this system (apt-get, as root)"
        ));
    }
    let sudo = right == Right::Ask { sudo: true };
    for arguments in [
        &["update"][..],
        &["install", "-y", "--no-install-recommends", package],
    ] {
        let mut command = Command::new(if sudo { "sudo" } else { "apt-get" });
        if sudo {
            command.args(["env", "DEBIAN_FRONTEND=noninteractive", "apt-get"]);
        }
        command.env("DEBIAN_FRONTEND", "noninteractive").args([
            "-q",
            "-o",
            "DPkg::Lock::Timeout=120",
        ]);
        command
            .args(arguments)
            .stdout(stderr().as_fd().try_clone_to_owned()?);
        let status = command
            .status()
            .with_context(|| format!("{} cannot be started", child::line(&command)))?;
        if interrupted() {
            return Err(Interrupted.into());
        }
        // An update fails with its worst source; the install tells whether it matters.
        if !status.success() && arguments != ["update"] {
            bail!(
                "{why}, and `{}` failed ({status}); by hand:\n  {by_hand}",
                child::line(&command)
            );
        }
    }
    Ok(())
}

/// A line from the terminal.
fn answer() -> anyhow::Result<String> {
    let input = stdin();
    // `read_line` alone goes on after a signal, and the user would have to type Ctrl-C twice.
    loop {
        if interrupted() {
            return Err(Interrupted.into());
        }
        match poll(&mut [PollFd::new(&input, PollFlags::IN)], Some(&STEP)) {
            Ok(0) | Err(Errno::INTR) => {}
            Ok(_) => break,
            Err(error) => return Err(error).context("the terminal cannot be read"),
        }
    }
    let mut answer = String::new();
    let read = input.read_line(&mut answer);
    // The terminal was closed: that is a signal and an error.
    if interrupted() {
        return Err(Interrupted.into());
    }
    read.context("the terminal cannot be read")?;
    Ok(answer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_displays_of_old_and_new_versions() {
        let old = "Available display backend types:\nnone\ngtk\negl-headless\n";
        let new =
            format!("{old}\nSome display backends support suboptions, which can be set with\n");
        assert_eq!(displays(old), ["none", "gtk", "egl-headless"]);
        assert_eq!(displays(&new), displays(old));
        assert_eq!(displays(""), [""; 0]);
    }

    #[test]
    fn system_is_changed_only_by_root_or_after_a_question() {
        assert_eq!(right(true, false, false), Right::Now);
        assert_eq!(right(true, true, false), Right::Ask { sudo: false });
        assert_eq!(right(false, true, true), Right::Ask { sudo: true });
        for (terminal, sudo) in [(true, false), (false, true), (false, false)] {
            assert_eq!(right(false, terminal, sudo), Right::None);
        }
    }
}
