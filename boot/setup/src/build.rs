//! The nested cargo builds: the kernel, the program that makes the image, and the image.
//!
//! A cargo inside a cargo needs a target folder of its own, because the outer cargo holds the lock of its target
//! folder. The user's flags, profiles and wrappers do not reach these builds: see [settings](super::settings).

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Context;
use tempfile::TempDir;

use super::cache::Locked;
use super::pin;
use super::settings;
use super::sha256::sha256;
use super::toolchain::Toolchain;
use system::Step;
use system::child::{self, Event};

/// The kernel's cargo home, in the cache.
const CARGO_HOME: &str = "cargo";

const PACKAGE: &str = "crystal-ball-kernel";
const TARGET: &str = "x86_64-unknown-none";
const IMAGE_MAKER: &str = "crystal-ball-image";

/// Is part of the image maker's name in the cache: to be changed when the way of building it changes.
const WAY: &[u8] = b"2: without the user's settings";

/// A program of the bare machine, with an image of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// The show.
    Show,
    /// The one that measures.
    Measure,
}

impl Program {
    /// The binary in the kernel's package.
    fn binary(self) -> &'static str {
        match self {
            Self::Show => "crystal-ball-kernel",
            Self::Measure => "crystal-ball-measure",
        }
    }

    /// The image's file.
    fn image(self) -> &'static str {
        match self {
            Self::Show => "crystal-ball.img",
            Self::Measure => "measure.img",
        }
    }
}

/// The workspace's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("the crate is two folders below the root")
}

/// The workspace's target folder: the one this very program was built in.
fn target() -> PathBuf {
    // Cargo does not tell it at run time when a configuration file or an option chose it.
    let program = env::current_exe().unwrap_or_default();
    let built_in = program
        .ancestors()
        .find(|folder| folder.join(".rustc_info.json").exists());
    let chosen = || env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    built_in
        .map(Path::to_owned)
        .or_else(chosen)
        .unwrap_or_else(|| root().join("target"))
}

/// Where the kernel is built, and where the image is.
pub fn folders() -> [PathBuf; 2] {
    [target().join("kernel"), target().join("crystal-ball")]
}

/// A program's kernel and image in this workspace, whether or not they exist.
pub fn files(program: Program) -> [PathBuf; 2] {
    let [kernel, image] = folders();
    [
        kernel.join(TARGET).join("release").join(program.binary()),
        image.join(program.image()),
    ]
}

/// Builds a program's kernel.
pub fn kernel(cache: &Locked, toolchain: &Toolchain, program: Program) -> anyhow::Result<PathBuf> {
    let folder = neutral(cache)?;
    // Cargo builds again what lies at another path: the home stays.
    let mut cargo = cargo(toolchain, &cache.path(CARGO_HOME), folder.path())?;
    cargo.args(["build", "--manifest-path"]);
    cargo.arg(root().join("Cargo.toml")).args([
        "--release",
        "--locked",
        "-p",
        PACKAGE,
        "--bin",
        program.binary(),
        "--target",
        TARGET,
    ]);
    cargo.args([
        "-Zbuild-std=core,compiler_builtins",
        "-Zbuild-std-features=compiler-builtins-mem",
    ]);
    cargo.arg("--target-dir").arg(&folders()[0]);
    build(
        &mut cargo,
        &format!(
            "building the kernel with Rust {} (the first time about 25 s)",
            toolchain.release()
        ),
    )?;
    let [kernel, _] = files(program);
    Ok(kernel)
}

/// The program that makes images, for this compiler: from the cache, or built (by far the longest step).
pub fn image_maker(cache: &Locked, toolchain: &Toolchain) -> anyhow::Result<PathBuf> {
    let (name, sources) = image_maker_name(toolchain)?;
    let place = cache.path(&name);
    if is_whole(&place) {
        return Ok(place.join(IMAGE_MAKER));
    }
    cache.room(pin::BUILDS, "building the boot loader")?;
    let aside = cache.aside()?;
    let folder = neutral(cache)?;
    // `cargo install` reads the configuration files above its home.
    let home = folder.path().join("home");
    let mut cargo = cargo(toolchain, &home, folder.path())?;
    cargo
        .args(["build", "--manifest-path"])
        .arg(sources.join("Cargo.toml"))
        .args(["--locked", "--target-dir"])
        .arg(aside.path());
    // The boot loader's build runs more cargos, which build in the folder for temporary files.
    cargo.env("TMPDIR", aside.path());
    build(
        &mut cargo,
        &format!(
            "building the boot loader with Rust {}, once (about 2 min)",
            toolchain.release()
        ),
    )?;
    let made = aside.path().join("made");
    fs::create_dir(&made)?;
    fs::rename(
        aside.path().join("debug").join(IMAGE_MAKER),
        made.join(IMAGE_MAKER),
    )?;
    fs::write(
        made.join("sha256"),
        sha256(&fs::read(made.join(IMAGE_MAKER))?),
    )?;
    Ok(cache.put(&made, &name)?.join(IMAGE_MAKER))
}

/// The image maker's name in the cache, which says all that it depends on, and the folder of its sources.
pub fn image_maker_name(toolchain: &Toolchain) -> anyhow::Result<(String, PathBuf)> {
    let folder = root().join("boot/image");
    let mut all = [WAY, toolchain.version.as_bytes()].concat();
    for file in ["Cargo.toml", "Cargo.lock", "src/main.rs"] {
        let file = folder.join(file);
        all.extend(fs::read(&file).with_context(|| format!("{} cannot be read", file.display()))?);
    }
    Ok((format!("image-{}", &sha256(&all)[..16]), folder))
}

/// Whether a kept image maker is there and unchanged.
pub fn is_whole(place: &Path) -> bool {
    let said = fs::read_to_string(place.join("sha256"));
    fs::read(place.join(IMAGE_MAKER)).is_ok_and(|data| said.is_ok_and(|said| said == sha256(&data)))
}

/// Makes the image. Always: it takes a tenth of a second, and an image of another kernel would be worse.
///
/// One with a ramdisk has a name that says which: two runs with two models may be at it at once.
pub fn image(maker: &Path, program: Program, ramdisk: Option<&[u8]>) -> anyhow::Result<PathBuf> {
    let [kernel, mut image] = files(program);
    let [_, folder] = folders();
    fs::create_dir_all(&folder)?;
    let aside = tempfile::Builder::new()
        .prefix(".aside")
        .tempdir_in(&folder)?;
    let made = aside.path().join(program.image());
    let mut make = child::command(maker);
    make.arg(&kernel).arg(&made);
    if let Some(bytes) = ramdisk {
        let file = aside.path().join("ramdisk");
        fs::write(&file, bytes).context("the ramdisk cannot be written")?;
        make.arg(file);
        image.set_file_name(format!("model-{}.img", &sha256(bytes)[..16]));
    }
    child::run(&mut make).context("the disk image cannot be made")?;
    // Others may be booting the old one: they keep it, this is a new file.
    fs::rename(made, &image).with_context(|| format!("{} cannot be written", image.display()))?;
    Ok(image)
}

/// The cargo that runs us, else the one in `PATH`.
pub fn cargo_path() -> anyhow::Result<PathBuf> {
    match env::var_os("CARGO") {
        Some(cargo) => Ok(cargo.into()),
        None => which::which("cargo")
            .ok()
            .context("cargo is needed, and not in PATH"),
    }
}

/// A folder without the user's configuration, for one build at a time: the cache is locked.
fn neutral(cache: &Locked) -> anyhow::Result<TempDir> {
    settings::neutral(cache.folder().as_os_str())
}

/// That cargo, set up for the toolchain: it runs in `folder`, and `home` becomes its home.
fn cargo(toolchain: &Toolchain, home: &Path, folder: &Path) -> anyhow::Result<Command> {
    settings::make_home(home, &env::current_dir()?, settings::home().as_deref())?;
    let mut command = child::family(cargo_path()?);
    let programs = toolchain.folder.join("bin");
    command
        .current_dir(folder)
        .env_clear()
        .envs(settings::kept(env::vars_os()))
        .env("CARGO_HOME", home)
        .env("RUSTC", programs.join("rustc"))
        .env("PATH", first_in_path(&programs)?);
    // The pinned compiler is a stable one; this lets cargo and it take `-Z` options all the same.
    command.env("RUSTC_BOOTSTRAP", "1");
    Ok(command)
}

/// The boot loader's build calls plain `rustc`.
fn first_in_path(folder: &Path) -> anyhow::Result<OsString> {
    let path = env::var_os("PATH").unwrap_or_default();
    env::join_paths(
        [folder.to_owned()]
            .into_iter()
            .chain(env::split_paths(&path)),
    )
    .context("the cache's path cannot stand in PATH")
}

/// Runs a build: silent when there is nothing to do, else announced, with cargo's own words.
fn build(cargo: &mut Command, what: &str) -> anyhow::Result<()> {
    let mut step = None;
    let done = child::watch(cargo, |event| match event {
        Event::Line(line) if line.trim_start().starts_with("Finished ") => {}
        Event::Line(line) => step.get_or_insert_with(|| Step::new(what, 0)).line(line),
        Event::Tick => {
            if let Some(step) = &mut step {
                step.at(0);
            }
        }
    });
    drop(step);
    done.map(|_| ()).with_context(|| format!("{what} failed"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn target_folder_is_the_one_of_this_program() {
        assert!(
            env::current_exe().unwrap().starts_with(target()),
            "{}",
            target().display()
        );
    }
}
