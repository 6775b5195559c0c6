//! What is there and what is missing, for people whose set-up does not do what they expect.

use std::env;
use std::io::Write;

use super::cache::{self, Cache};
use super::progress::bytes;
use super::toolchain::{self, Toolchain};
use super::{Options, build, debian, qemu};
use crate::child;

/// Writes the report; true when nothing is missing.
pub fn report(options: &Options, out: &mut impl Write) -> anyhow::Result<bool> {
    let cache = Cache::find()?;
    let toolchain = toolchain::find(&cache, options);
    let qemu = qemu::find(options);
    let mut lines = vec![
        ("cargo", there(cargo_version())),
        ("toolchain", toolchain_line(&toolchain)),
    ];
    if let Ok(Some(toolchain)) = &toolchain {
        let (name, _) = build::image_maker_name(toolchain)?;
        let maker = cache.path(&name);
        lines.push((
            "boot loader",
            there(build::is_whole(&maker).then(|| maker.display().to_string())),
        ));
    }
    for (what, file) in ["kernel", "disk image"]
        .into_iter()
        .zip(build::files(build::Program::Show))
    {
        let found = file
            .exists()
            .then(|| format!("{}, {}", file.display(), bytes(cache::size(&file))));
        lines.push((what, there(found)));
    }
    lines.push((
        "QEMU",
        match &qemu {
            Ok(Some(qemu)) => Ok(format!("{} in {}", qemu.version, qemu.path.display())),
            Ok(None) => Err("not installed".to_owned()),
            Err(error) => Err(format!("{error:#}")),
        },
    ));
    for (what, line) in &lines {
        let (mark, text) = match line {
            Ok(text) => ("ok     ", text),
            Err(text) => ("MISSING", text),
        };
        writeln!(out, "{mark} {what:<12} {text}")?;
    }
    let mut also = |what: &str, text: String| writeln!(out, "        {what:<12} {text}");
    if let Ok(Some(qemu)) = &qemu {
        let window = if qemu.has_window() {
            "can open a window"
        } else {
            "no window (Debian: qemu-system-gui)"
        };
        also(
            "",
            format!("{window}; displays: {}", qemu.displays.join(", ")),
        )?;
    }
    let screen = ["WAYLAND_DISPLAY", "DISPLAY"]
        .into_iter()
        .find_map(|name| Some((name, env::var(name).ok()?)));
    also(
        "display",
        screen.map_or("none".to_owned(), |(name, value)| format!("{name}={value}")),
    )?;
    let folder = cache.folder();
    let existing = folder
        .ancestors()
        .find(|folder| folder.exists())
        .unwrap_or(folder);
    let (used, free) = (cache::size(folder), cache::free(existing)?);
    also(
        "cache",
        format!(
            "{}, {} used, {} free",
            folder.display(),
            bytes(used),
            bytes(free)
        ),
    )?;
    also(
        "packages",
        format!("{} kept", bytes(cache::size(&debian::kept(&cache)))),
    )?;
    for program in ["rustup", "apt-get", "setpriv"] {
        let found =
            which::which(program).map_or("none".to_owned(), |path| path.display().to_string());
        also(program, found)?;
    }
    also(
        "network",
        toolchain::offline().map_or("may be used".to_owned(), |setting| {
            format!("not used ({setting})")
        }),
    )?;
    Ok(lines.iter().all(|(_, line)| line.is_ok()))
}

fn there(found: Option<String>) -> Result<String, String> {
    found.ok_or_else(|| "not there yet: the next run makes it".to_owned())
}

fn toolchain_line(toolchain: &anyhow::Result<Option<Toolchain>>) -> Result<String, String> {
    match toolchain {
        Ok(Some(toolchain)) => {
            let (folder, size) = (&toolchain.folder, cache::size(&toolchain.folder));
            Ok(format!(
                "Rust {} in {}, {}",
                toolchain.release(),
                folder.display(),
                bytes(size)
            ))
        }
        Ok(None) => there(None),
        Err(error) => Err(format!("{error:#}")),
    }
}

fn cargo_version() -> Option<String> {
    let cargo = build::cargo_path().ok()?;
    let version = child::run(child::command(&cargo).arg("-V")).ok()?;
    Some(format!("{} in {}", version.trim(), cargo.display()))
}
