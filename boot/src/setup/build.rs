//! The nested cargo builds: the kernel, the program that makes the image, and the image.
//!
//! A cargo inside a cargo needs a target folder of its own (the outer one holds the lock of its own), and an
//! environment without the outer one's variables: they would choose the outer compiler, its flags and folders.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Context;

use super::cache::Locked;
use super::debian::sha256;
use super::pin;
use super::progress::Step;
use super::toolchain::Toolchain;
use crate::child::{self, Event};

const PACKAGE: &str = "crystal-ball-kernel";
const TARGET: &str = "x86_64-unknown-none";
const IMAGE_MAKER: &str = "crystal-ball-image";

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
        .parent()
        .expect("the crate is a folder of the workspace")
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
pub fn kernel(toolchain: &Toolchain, program: Program) -> anyhow::Result<PathBuf> {
    let mut cargo = cargo(toolchain)?;
    cargo.current_dir(root()).args([
        "build",
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
    let mut cargo = cargo(toolchain)?;
    cargo
        .current_dir(sources)
        .args(["build", "--locked", "--target-dir"])
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
    let mut all = toolchain.version.clone().into_bytes();
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

/// That cargo, set up for the toolchain.
fn cargo(toolchain: &Toolchain) -> anyhow::Result<Command> {
    let mut command = child::family(cargo_path()?);
    for (name, _) in env::vars_os().filter(|(name, _)| is_outer(&name.to_string_lossy())) {
        command.env_remove(name);
    }
    let programs = toolchain.folder.join("bin");
    command
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

/// What the outer cargo says to its children, and what chooses compilers, flags and folders. What the user
/// says about the network stays.
fn is_outer(name: &str) -> bool {
    const KEPT: [&str; 5] = [
        "CARGO_HOME",
        "CARGO_NET_",
        "CARGO_HTTP_",
        "CARGO_REGISTR",
        "CARGO_TERM_",
    ];
    let cargo = name == "CARGO" || name.starts_with("CARGO_");
    (cargo && !KEPT.iter().any(|kept| name.starts_with(kept)))
        || name.starts_with("RUSTC")
        || [
            "RUSTFLAGS",
            "RUSTDOCFLAGS",
            "RUSTUP_TOOLCHAIN",
            "RUST_RECURSION_COUNT",
            "LD_LIBRARY_PATH",
        ]
        .contains(&name)
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
    fn nested_cargo_sees_nothing_of_the_outer_one_but_the_network() {
        for outer in [
            "CARGO",
            "CARGO_MANIFEST_DIR",
            "CARGO_TARGET_DIR",
            "CARGO_BUILD_TARGET",
            "CARGO_ENCODED_RUSTFLAGS",
            "RUSTC",
            "RUSTC_WRAPPER",
            "RUSTFLAGS",
            "RUSTUP_TOOLCHAIN",
            "RUST_RECURSION_COUNT",
            "LD_LIBRARY_PATH",
        ] {
            assert!(is_outer(outer), "{outer}");
        }
        for kept in [
            "CARGO_HOME",
            "CARGO_NET_OFFLINE",
            "CARGO_HTTP_PROXY",
            "CARGO_REGISTRIES_MINE_INDEX",
            "RUSTUP_HOME",
            "https_proxy",
            "PATH",
            "CARGOT",
        ] {
            assert!(!is_outer(kept), "{kept}");
        }
    }

    #[test]
    fn target_folder_is_the_one_of_this_program() {
        assert!(
            env::current_exe().unwrap().starts_with(target()),
            "{}",
            target().display()
        );
    }
}
