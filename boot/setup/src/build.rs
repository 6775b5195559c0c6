//! The nested cargo builds of the kernel and of the program that makes the image, and the making of the
//! image.
//!
//! A nested cargo needs a separate target folder, because the outer cargo holds the lock of its own target
//! folder. The user's flags, profiles and wrappers do not reach these builds: see
//! [`settings`].

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Context;
use tempfile::TempDir;

use super::cache::LockedCache;
use super::pin;
use super::settings;
use super::sha256::sha256;
use super::toolchain::Toolchain;
use system::Progress;
use system::child::{self, ChildEvent};

/// The folder in the cache that is the cargo home of the kernel's build.
const CARGO_HOME: &str = "cargo";

const PACKAGE: &str = "crystal-ball-kernel";
const TARGET: &str = "x86_64-unknown-none";
const IMAGE_MAKER: &str = "crystal-ball-image";

/// The version of the build commands, a part of the hash in the image maker's name. Change it when
/// [`image_maker`] builds the image maker in another way.
const RECIPE: &[u8] = b"2: without the user's settings";

/// A program for the bare machine. Each program has a separate image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// The demo.
    Demo,
    /// The benchmark kernel.
    Bench,
}

impl Program {
    /// Returns the name of the binary in the kernel's package.
    fn binary(self) -> &'static str {
        match self {
            Self::Demo => "crystal-ball-kernel",
            Self::Bench => "crystal-ball-measure",
        }
    }

    /// Returns the file name of the image.
    fn image(self) -> &'static str {
        match self {
            Self::Demo => "crystal-ball.img",
            Self::Bench => "measure.img",
        }
    }
}

/// Returns the workspace's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("the crate is two folders below the root")
}

/// Returns the workspace's target folder: the folder in which this program was built.
fn target() -> PathBuf {
    // The search starts at this program's path, because cargo does not pass on a target folder that a
    // configuration file or an option chose.
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

/// Returns the folder in which the kernel is built, and the folder of the image.
pub fn folders() -> [PathBuf; 2] {
    [target().join("kernel"), target().join("crystal-ball")]
}

/// Returns the paths of a program's kernel and image in this workspace, whether or not they exist.
pub fn files(program: Program) -> [PathBuf; 2] {
    let [kernel, image] = folders();
    [
        kernel.join(TARGET).join("release").join(program.binary()),
        image.join(program.image()),
    ]
}

/// Builds a program's kernel, and returns its path.
pub fn kernel(
    cache: &LockedCache,
    toolchain: &Toolchain,
    program: Program,
) -> anyhow::Result<PathBuf> {
    let folder = neutral(cache)?;
    // The home must stay at one path: cargo rebuilds packages that it finds at another path.
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

/// Returns the image maker for this compiler, from the cache or newly built. The build is by far the longest
/// step.
pub fn image_maker(cache: &LockedCache, toolchain: &Toolchain) -> anyhow::Result<PathBuf> {
    let (name, sources) = image_maker_name(toolchain)?;
    let place = cache.path(&name);
    if is_intact(&place) {
        return Ok(place.join(IMAGE_MAKER));
    }
    cache.room(pin::BUILDS, "building the boot loader")?;
    let temporary = cache.temporary_folder()?;
    let folder = neutral(cache)?;
    // `cargo install` reads the configuration files above its home, so the home lies in the neutral folder.
    let home = folder.path().join("home");
    let mut cargo = cargo(toolchain, &home, folder.path())?;
    cargo
        .args(["build", "--manifest-path"])
        .arg(sources.join("Cargo.toml"))
        .args(["--locked", "--target-dir"])
        .arg(temporary.path());
    // The boot loader's build runs more cargos, which build in the folder for temporary files.
    cargo.env("TMPDIR", temporary.path());
    build(
        &mut cargo,
        &format!(
            "building the boot loader with Rust {}, once (about 2 min)",
            toolchain.release()
        ),
    )?;
    let made = temporary.path().join("made");
    fs::create_dir(&made)?;
    fs::rename(
        temporary.path().join("debug").join(IMAGE_MAKER),
        made.join(IMAGE_MAKER),
    )?;
    fs::write(
        made.join("sha256"),
        sha256(&fs::read(made.join(IMAGE_MAKER))?),
    )?;
    Ok(cache.put(&made, &name)?.join(IMAGE_MAKER))
}

/// Returns the image maker's name in the cache, which has a hash of all that the image maker depends on, and
/// the folder of its sources.
pub fn image_maker_name(toolchain: &Toolchain) -> anyhow::Result<(String, PathBuf)> {
    let folder = root().join("boot/image");
    let mut all = [RECIPE, toolchain.version.as_bytes()].concat();
    for file in ["Cargo.toml", "Cargo.lock", "src/main.rs"] {
        let file = folder.join(file);
        all.extend(fs::read(&file).with_context(|| format!("{}: cannot be read", file.display()))?);
    }
    Ok((format!("image-{}", &sha256(&all)[..16]), folder))
}

/// Returns whether the cached image maker in `place` exists and is unchanged.
pub fn is_intact(place: &Path) -> bool {
    let expected = fs::read_to_string(place.join("sha256"));
    fs::read(place.join(IMAGE_MAKER))
        .is_ok_and(|data| expected.is_ok_and(|expected| expected == sha256(&data)))
}

/// Makes the image, and returns its path.
///
/// The image is made on every run: this needs only a tenth of a second, and never leaves an image with an
/// outdated kernel. The name of an image with a ramdisk has the ramdisk's hash, because two runs with
/// different models may work at the same time.
pub fn image(maker: &Path, program: Program, ramdisk: Option<&[u8]>) -> anyhow::Result<PathBuf> {
    let [kernel, mut image] = files(program);
    let [_, folder] = folders();
    fs::create_dir_all(&folder)?;
    let temporary = tempfile::Builder::new()
        .prefix(".temporary")
        .tempdir_in(&folder)?;
    let made = temporary.path().join(program.image());
    let mut make = child::command(maker);
    make.arg(&kernel).arg(&made);
    if let Some(bytes) = ramdisk {
        let file = temporary.path().join("ramdisk");
        fs::write(&file, bytes).context("the ramdisk cannot be written")?;
        make.arg(file);
        image.set_file_name(format!("model-{}.img", &sha256(bytes)[..16]));
    }
    child::run(&mut make).context("the disk image cannot be made")?;
    // Another run may be booting the old image. It keeps the old file, because the rename puts a new file in
    // its place.
    fs::rename(made, &image).with_context(|| format!("{}: cannot be written", image.display()))?;
    Ok(image)
}

/// Returns the cargo that runs this program, or else the cargo in `PATH`.
pub fn cargo_path() -> anyhow::Result<PathBuf> {
    match env::var_os("CARGO") {
        Some(cargo) => Ok(cargo.into()),
        None => which::which("cargo")
            .ok()
            .context("cargo: not found in PATH"),
    }
}

/// Returns a folder without the user's configuration. The lock of the cache ensures that only one build uses
/// it.
fn neutral(cache: &LockedCache) -> anyhow::Result<TempDir> {
    settings::neutral(cache.folder().as_os_str())
}

/// Returns a command that runs the cargo of [`cargo_path`] with the toolchain's compiler, in `folder`, with
/// `home` as its cargo home.
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
    // The pinned compiler is a stable release. This variable makes it and cargo accept `-Z` options.
    command.env("RUSTC_BOOTSTRAP", "1");
    Ok(command)
}

/// Returns `PATH` with `folder` in front, because the boot loader's build calls plain `rustc`.
fn first_in_path(folder: &Path) -> anyhow::Result<OsString> {
    let path = env::var_os("PATH").unwrap_or_default();
    env::join_paths(
        [folder.to_owned()]
            .into_iter()
            .chain(env::split_paths(&path)),
    )
    .with_context(|| {
        format!(
            "{}: PATH cannot contain this folder; set XDG_CACHE_HOME to a folder without ':' in its path",
            folder.display()
        )
    })
}

/// Runs a build. Without work it prints nothing; otherwise it announces `what` and shows cargo's messages.
fn build(cargo: &mut Command, what: &str) -> anyhow::Result<()> {
    let mut step = None;
    let done = child::watch(cargo, |event| match event {
        ChildEvent::Line(line) if line.trim_start().starts_with("Finished ") => {}
        ChildEvent::Line(line) => step
            .get_or_insert_with(|| Progress::new(what, 0))
            .line(line),
        ChildEvent::Tick => {
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
    fn the_target_folder_contains_this_program() {
        assert!(
            env::current_exe().unwrap().starts_with(target()),
            "{}",
            target().display()
        );
    }
}
