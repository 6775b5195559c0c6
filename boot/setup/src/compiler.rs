//! Finds or gets a complete toolchain: the user's choice, the cache's, rustup's, or Debian's packages.

use std::env;

use anyhow::bail;
use system::{Interrupted, say};

use super::cache::{Cache, LockedCache, is_full};
use super::options::Options;
use super::toolchain::{self, Toolchain, VARIABLE};
use super::{debian, pin, rustup};

/// Finds a toolchain without a download: the user's choice, the cache's, or rustup's.
///
/// # Errors
/// If the user's choice is not complete.
pub fn find(cache: &Cache, options: &Options) -> anyhow::Result<Option<Toolchain>> {
    let chosen = options
        .toolchain
        .clone()
        .or_else(|| env::var_os(VARIABLE).map(Into::into));
    if let Some(folder) = chosen {
        return Toolchain::check(&folder).map(Some);
    }
    let kept = cache.path(&toolchain::cached());
    if kept.exists() {
        match Toolchain::check_pinned(&kept) {
            Ok(toolchain) => return Ok(Some(toolchain)),
            Err(error) if error.is::<Interrupted>() => return Err(error),
            Err(error) => say(format_args!(
                "the cached toolchain is damaged and is not used: {error:#}"
            )),
        }
    }
    Ok(rustup::installed())
}

/// Finds a toolchain, or gets the pinned toolchain.
///
/// # Errors
/// If every way failed. The message says what was tried.
pub fn get(cache: &LockedCache, options: &Options) -> anyhow::Result<Toolchain> {
    if let Some(toolchain) = find(cache, options)? {
        return Ok(toolchain);
    }
    let by_rustup = match rustup::download(cache) {
        Ok(toolchain) => return Ok(toolchain),
        Err(error) if error.is::<Interrupted>() || is_full(&error) => return Err(error),
        Err(error) => error,
    };
    say(format_args!(
        "rustup cannot provide Rust {} ({}); trying Debian's packages",
        pin::RUST,
        reason(&by_rustup)
    ));
    let by_debian = match debian::install(cache) {
        Ok(toolchain) => return Ok(toolchain),
        Err(error) if error.is::<Interrupted>() || is_full(&error) => return Err(error),
        Err(error) => error,
    };
    bail!(
        "Rust {} with its library sources cannot be provided: rustup and Debian's packages both failed.\n\
         - rustup: {}\n\
         - Debian's packages: {}\n\
         Do one of these, then try again:\n\
         - use rustup: {}\n\
         - use a complete toolchain in a folder DIR: --toolchain DIR, or {VARIABLE}=DIR",
        pin::RUST,
        indented(&by_rustup),
        indented(&by_debian),
        by_hand(),
    );
}

/// Returns the command that gets the pinned toolchain by hand.
pub fn by_hand() -> String {
    let first = match which::which("rustup") {
        Ok(_) => "",
        Err(_) => "install rustup (https://rustup.rs; no administrator is needed), then ",
    };
    format!(
        "{first}rustup toolchain install {} --profile minimal --component rust-src --component llvm-tools",
        pin::RUST
    )
}

/// Returns an error as one line: the error that a program printed, or else the message's first line.
fn reason(error: &anyhow::Error) -> String {
    let text = format!("{error:#}");
    let own = text
        .lines()
        .find_map(|line| line.trim().strip_prefix("error: "));
    own.or(text.lines().next()).unwrap_or_default().to_owned()
}

fn indented(error: &anyhow::Error) -> String {
    format!("{error:#}").replace('\n', "\n    ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_is_the_error_that_the_program_printed() {
        let of = |text: &'static str| reason(&anyhow::Error::msg(text));
        assert_eq!(
            of("`rustup x` failed (exit status: 1)\ninfo: syncing\nerror: no network\n more"),
            "no network"
        );
        assert_eq!(of("rustup is not installed"), "rustup is not installed");
    }
}
