//! `image`: writes the disk image.

use std::fs::File;
use std::io;
use std::path::Path;

use anyhow::Context;
use system::{say, write_atomically};

use crate::common::Common;

/// Examples for the help.
pub const HELP: &str = "\
Examples:
  cargo run -- image --out ball.img                       the built-in scenes
  cargo run -- image --out thing.img --model thing.obj    your own model as well";

/// Makes the image, and copies it to `out`.
pub fn run(mut common: Common, out: &Path) -> anyhow::Result<()> {
    common.load_to_boot()?;
    let image = setup::image(&common.options)?;
    let mut from =
        File::open(&image).with_context(|| format!("{}: cannot be read", image.display()))?;
    let bytes = write_atomically(out, |file| Ok(io::copy(&mut from, file)?))?;
    say(format_args!(
        "{}: {bytes} bytes; the image boots on a PC with a BIOS and a VGA",
        out.display()
    ));
    Ok(())
}
