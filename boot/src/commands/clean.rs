//! `clean`: removes everything that the set-up downloaded or built.

use crate::output::Output;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- clean    remove everything; the next run does the whole set-up again";

/// Removes the caches, and prints their sizes.
pub fn run() -> anyhow::Result<()> {
    setup::clean(&mut Output).map(drop)
}
