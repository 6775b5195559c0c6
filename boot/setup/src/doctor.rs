//! A report of what the set-up has and what is missing, for users whose set-up does not work as expected.

use std::env;
use std::io::Write;
use std::path::Path;

use super::cache::{self, Cache};
use super::offline::offline;
use super::options::Options;
use super::qemu::Qemu;
use super::toolchain::Toolchain;
use super::{apt, build, compiler, debian, pin, qemu};
use system::bytes;
use system::child;

/// Writes the report, and returns whether nothing is missing.
pub fn report(options: &Options, out: &mut impl Write) -> anyhow::Result<bool> {
    let cache = Cache::find()?;
    let toolchain = compiler::find(&cache, options);
    let qemu = qemu::find(&cache, options);
    let mut lines = vec![
        ("cargo", cargo_line()),
        ("toolchain", toolchain_line(&cache, &toolchain)),
    ];
    let can_build = lines
        .iter()
        .all(|(_, line)| !matches!(line, Err(Missing::ByHand(_))));
    let later = |found: Option<String>| {
        found.ok_or_else(|| match can_build {
            true => Missing::NextRun("builds it".to_owned()),
            false => Missing::ByHand("cannot be built before the missing parts above".to_owned()),
        })
    };
    if let Ok(Some(toolchain)) = &toolchain {
        let (name, _) = build::image_maker_name(toolchain)?;
        let maker = cache.path(&name);
        lines.push((
            "boot loader",
            later(build::is_intact(&maker).then(|| maker.display().to_string())),
        ));
    }
    for (what, file) in ["kernel", "disk image"]
        .into_iter()
        .zip(build::files(build::Program::Demo))
    {
        let found = file
            .exists()
            .then(|| format!("{}, {}", file.display(), bytes(cache::size(&file))));
        lines.push((what, later(found)));
    }
    lines.push(("QEMU", qemu_line(&qemu)));
    if let (Ok(Some(qemu)), true) = (&qemu, options.window) {
        let window = match qemu.has_window() {
            true => Ok(format!("displays: {}", qemu.displays.join(", "))),
            false => fetched("qemu-system-gui"),
        };
        lines.push(("window", window));
    }
    for (what, line) in &lines {
        let (mark, text) = match line {
            Ok(text) => ("ok     ", text.clone()),
            Err(Missing::NextRun(does)) => ("MISSING", format!("the next run {does}")),
            Err(Missing::ByHand(text)) => {
                ("MISSING", text.replace('\n', "\n                     "))
            }
        };
        writeln!(out, "{mark} {what:<12} {text}")?;
    }
    let mut also = |what: &str, text: String| writeln!(out, "        {what:<12} {text}");
    let screen = ["WAYLAND_DISPLAY", "DISPLAY"]
        .into_iter()
        .find_map(|name| Some((name, env::var(name).ok()?)));
    also(
        "display",
        screen.map_or(
            "no WAYLAND_DISPLAY or DISPLAY".to_owned(),
            |(name, value)| format!("{name}={value}"),
        ),
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
        format!(
            "{} of Debian's packages in the cache",
            bytes(cache::size(&debian::kept(&cache)))
        ),
    )?;
    for program in ["rustup", "apt-get", "setpriv"] {
        let found = which::which(program).map_or("not installed".to_owned(), |path| {
            path.display().to_string()
        });
        also(program, found)?;
    }
    also(
        "network",
        offline().map_or("allowed".to_owned(), |setting| {
            format!("not used ({setting})")
        }),
    )?;
    Ok(lines.iter().all(|(_, line)| line.is_ok()))
}

/// The reason why a part is missing.
enum Missing {
    /// The next run adds the part. The text says how.
    NextRun(String),
    /// The user must act. The text says what is wrong, and the command to type.
    ByHand(String),
}

fn cargo_line() -> Result<String, Missing> {
    let version = |cargo: &Path| child::run(child::command(cargo).arg("-V"));
    match build::cargo_path().and_then(|cargo| Ok((version(&cargo)?, cargo))) {
        Ok((version, cargo)) => Ok(format!("{} in {}", version.trim(), cargo.display())),
        Err(error) => Err(Missing::ByHand(format!(
            "{error:#}\ninstall rustup, which includes cargo: https://rustup.rs"
        ))),
    }
}

fn toolchain_line(
    cache: &Cache,
    toolchain: &anyhow::Result<Option<Toolchain>>,
) -> Result<String, Missing> {
    let toolchain = match toolchain {
        Ok(toolchain) => toolchain,
        Err(error) => return Err(Missing::ByHand(format!("{error:#}"))),
    };
    if let Some(toolchain) = toolchain {
        let (folder, size) = (&toolchain.folder, cache::size(&toolchain.folder));
        let (release, folder) = (toolchain.release(), folder.display());
        return Ok(format!("Rust {release} in {folder}, {}", bytes(size)));
    }
    let online = offline().is_none();
    let rustup = which::which("rustup").is_ok();
    Err(if online && rustup {
        Missing::NextRun(format!(
            "downloads Rust {} with rustup into the cache",
            pin::RUST
        ))
    } else if apt::is_here() && apt::kept(&debian::kept(cache)).is_some() {
        Missing::NextRun("unpacks the packages in the cache".to_owned())
    } else if online && apt::is_here() {
        Missing::NextRun(format!(
            "downloads Debian's packages of Rust {} into the cache",
            pin::RUST
        ))
    } else {
        Missing::ByHand(compiler::by_hand())
    })
}

fn qemu_line(qemu: &anyhow::Result<Option<Qemu>>) -> Result<String, Missing> {
    match qemu {
        Ok(Some(qemu)) => Ok(format!("{} in {}", qemu.version, qemu.path.display())),
        Ok(None) => fetched("qemu-system-x86"),
        Err(error) => Err(Missing::ByHand(format!("{error:#}"))),
    }
}

/// Returns what will provide a missing package of QEMU: the next run, or the user.
fn fetched(package: &str) -> Result<String, Missing> {
    Err(match offline().is_none() && apt::is_here() {
        true => Missing::NextRun(format!(
            "unpacks Debian's package {package} into the cache, and installs nothing"
        )),
        false => Missing::ByHand(qemu::by_hand(package)),
    })
}
