//! A compiler that can build freestanding code, and the ways to come by one.
//!
//! "Complete" means: the compiler, its own library sources (`core` is built from them), and the LLVM programs
//! with which the boot loader's build makes flat binaries. Plain stable toolchains have the first only.

use std::env;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::cache::{Cache, Locked, is_full};
use super::{Options, debian, pin, rustup, settings};
use system::say;
use system::{Interrupted, child};

/// Names a complete toolchain in the environment.
pub const VARIABLE: &str = "CRYSTAL_BALL_TOOLCHAIN";

/// The environment's name of cargo's setting `net.offline`.
const OFFLINE: &str = "CARGO_NET_OFFLINE";

/// A complete toolchain.
#[derive(Debug)]
pub struct Toolchain {
    /// The folder with `bin` and `lib`.
    pub folder: PathBuf,
    /// All that its compiler says of itself: what it builds is good for this very compiler.
    pub version: String,
}

impl Toolchain {
    /// Looks whether the toolchain in a folder is complete; the error names all that is missing.
    pub fn check(folder: &Path) -> anyhow::Result<Self> {
        let incomplete = || format!("{} is not a complete toolchain", folder.display());
        let folder = folder.canonicalize().with_context(incomplete)?;
        let rustc = folder.join("bin/rustc");
        if !rustc.exists() {
            bail!("{}: it has no bin/rustc", incomplete());
        }
        let version = child::run(
            child::command(&rustc)
                .arg("-vV")
                .env_remove("LD_LIBRARY_PATH"),
        )
        .with_context(incomplete)?;
        let host = field(&version, "host").unwrap_or("unknown");
        let programs = format!("lib/rustlib/{host}/bin");
        let missing: Vec<_> = [
            "lib/rustlib/src/rust/library/core/src/lib.rs (library sources: component rust-src)"
                .to_owned(),
            format!("{programs}/llvm-objcopy (component llvm-tools)"),
            format!("{programs}/llvm-objdump (component llvm-tools)"),
            format!("{programs}/rust-lld"),
        ]
        .into_iter()
        .filter(|part| !folder.join(part.split(' ').next().unwrap_or(part)).exists())
        .collect();
        if !missing.is_empty() {
            bail!("{}: it lacks\n  {}", incomplete(), missing.join("\n  "));
        }
        Ok(Self { folder, version })
    }

    /// As [`check`](Self::check), and it must be the pinned version.
    pub fn check_pinned(folder: &Path) -> anyhow::Result<Self> {
        let toolchain = Self::check(folder)?;
        let release = toolchain.release();
        if release != pin::RUST {
            bail!("{} is Rust {release}, not {}", folder.display(), pin::RUST);
        }
        Ok(toolchain)
    }

    /// The version's number.
    pub fn release(&self) -> &str {
        field(&self.version, "release").unwrap_or("of unknown version")
    }
}

fn field<'a>(version: &'a str, name: &str) -> Option<&'a str> {
    version
        .lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix(": "))
}

/// The name of the pinned toolchain in the cache.
fn cached() -> String {
    format!("toolchain-{}", pin::RUST)
}

/// Puts the pinned toolchain, made aside, into the cache.
pub fn keep(cache: &Locked, made: &Path) -> anyhow::Result<Toolchain> {
    Toolchain::check_pinned(made)?;
    let place = cache.put(made, &cached())?;
    say(format_args!("Rust {} is in {}", pin::RUST, place.display()));
    Toolchain::check_pinned(&place)
}

/// The toolchain that is there: the user's choice, the cache's, or rustup's.
///
/// # Errors
/// When the user's choice is not complete.
pub fn find(cache: &Cache, options: &Options) -> anyhow::Result<Option<Toolchain>> {
    let chosen = options
        .toolchain
        .clone()
        .or_else(|| env::var_os(VARIABLE).map(Into::into));
    if let Some(folder) = chosen {
        return Toolchain::check(&folder).map(Some);
    }
    let kept = cache.path(&cached());
    if kept.exists() {
        match Toolchain::check_pinned(&kept) {
            Ok(toolchain) => return Ok(Some(toolchain)),
            Err(error) if error.is::<Interrupted>() => return Err(error),
            Err(error) => say(format_args!(
                "the kept toolchain is damaged and not used: {error:#}"
            )),
        }
    }
    Ok(rustup::installed())
}

/// Finds a toolchain or gets the pinned one.
///
/// # Errors
/// When there is no way: the message says what was tried.
pub fn get(cache: &Locked, options: &Options) -> anyhow::Result<Toolchain> {
    if let Some(toolchain) = find(cache, options)? {
        return Ok(toolchain);
    }
    let by_rustup = match rustup::download(cache) {
        Ok(toolchain) => return Ok(toolchain),
        Err(error) if error.is::<Interrupted>() || is_full(&error) => return Err(error),
        Err(error) => error,
    };
    say(format_args!(
        "Rust {} does not come from rustup ({}); trying Debian's packages",
        pin::RUST,
        reason(&by_rustup)
    ));
    let by_debian = match debian::install(cache) {
        Ok(toolchain) => return Ok(toolchain),
        Err(error) if error.is::<Interrupted>() || is_full(&error) => return Err(error),
        Err(error) => error,
    };
    bail!(
        "Rust {} with its library sources is needed, and both ways to get it failed.\n\
         - rustup: {}\n\
         - Debian's packages: {}\n\
         Do one of these by hand, then try again:\n\
         - with rustup: {}\n\
         - with any complete toolchain in a folder DIR: --toolchain DIR, or {VARIABLE}=DIR",
        pin::RUST,
        indented(&by_rustup),
        indented(&by_debian),
        by_hand(),
    );
}

/// What a person types to get the pinned toolchain.
pub fn by_hand() -> String {
    let first = match which::which("rustup") {
        Ok(_) => "",
        Err(_) => "install rustup (https://rustup.rs; it needs no administrator), then ",
    };
    format!(
        "{first}rustup toolchain install {} --profile minimal --component rust-src --component llvm-tools",
        pin::RUST
    )
}

/// An error in one line: what a program gave as its error, else how the message begins.
fn reason(error: &anyhow::Error) -> String {
    let text = format!("{error:#}");
    let said = text
        .lines()
        .find_map(|line| line.trim().strip_prefix("error: "));
    said.or(text.lines().next()).unwrap_or_default().to_owned()
}

fn indented(error: &anyhow::Error) -> String {
    format!("{error:#}").replace('\n', "\n    ")
}

/// Cargo's word that the network must not be used: the setting that says so.
pub fn offline() -> Option<String> {
    let folder = env::current_dir().unwrap_or_default();
    let home = settings::home();
    offline_by(env::var(OFFLINE).ok().as_deref(), &folder, home.as_deref())
}

/// By cargo's rules: the variable, then the files from the current folder upward, then cargo's home.
fn offline_by(variable: Option<&str>, folder: &Path, home: Option<&Path>) -> Option<String> {
    if let Some(value) = variable {
        return matches!(value, "true" | "1").then(|| OFFLINE.to_owned());
    }
    let mut files = settings::files(folder, home).into_iter();
    let (says, file) = files.find_map(|file| Some((net_offline(&file)?, file)))?;
    says.then(|| format!("net.offline in {}", file.display()))
}

fn net_offline(file: &Path) -> Option<bool> {
    settings::read(file).get("net")?.get("offline")?.as_bool()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn offline_is_what_cargo_says_in_its_order() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        let (folder, home) = (at("up/down"), at("home"));
        for folder in ["up/.cargo", "up/down/.cargo", "home"] {
            fs::create_dir_all(at(folder)).unwrap();
        }
        let by = |variable| offline_by(variable, &folder, Some(&home));
        let file = |name: &str| Some(format!("net.offline in {}", at(name).display()));
        assert_eq!(by(None), None);
        for said in ["true", "1"] {
            assert_eq!(by(Some(said)).as_deref(), Some(OFFLINE));
        }
        fs::write(at("home/config.toml"), "[net]\noffline = true").unwrap();
        assert_eq!(by(None), file("home/config.toml"));
        assert_eq!(by(Some("false")), None);
        assert_eq!(offline_by(None, &folder, None), None);
        // A nearer file that says nothing of it, or is broken, changes nothing.
        for nothing in ["net.retry = 3", "[net", "net = 1", "net.offline = 1"] {
            fs::write(at("up/.cargo/config.toml"), nothing).unwrap();
            assert_eq!(by(None), file("home/config.toml"), "{nothing}");
        }
        fs::write(at("up/.cargo/config.toml"), "net.offline = false").unwrap();
        assert_eq!(by(None), None);
        fs::write(at("up/down/.cargo/config.toml"), "net = { offline = true }").unwrap();
        assert_eq!(by(None), file("up/down/.cargo/config.toml"));
        fs::write(at("up/down/.cargo/config"), "").unwrap();
        assert_eq!(by(None), None);
        fs::write(at("up/.cargo/config"), "net.offline = true").unwrap();
        assert_eq!(by(None), file("up/.cargo/config"));
    }

    #[test]
    fn reason_is_the_programs_own_error() {
        let of = |text: &'static str| reason(&anyhow::Error::msg(text));
        assert_eq!(
            of("`rustup x` failed (exit status: 1)\ninfo: syncing\nerror: no network\n more"),
            "no network"
        );
        assert_eq!(of("rustup is not installed"), "rustup is not installed");
    }
}
