//! The set-up, once for all tests of a program.

use std::sync::LazyLock;

use crystal_ball::machine::Config;
use crystal_ball::setup::{self, Options, Ready};

pub static READY: LazyLock<Ready> =
    LazyLock::new(|| setup::ready(&Options::default()).expect("the set-up failed"));

/// The image on QEMU's standard adapter, without a window.
pub fn config() -> Config {
    Config::new(&READY)
}
