//! The set-up, once for all tests.

use std::io::Write;
use std::sync::LazyLock;

use qemu::Config;
use setup::{Options, Ready};

/// The result of the set-up, which every boot needs.
pub static READY: LazyLock<Ready> = LazyLock::new(|| with(&Options::default()));

/// Runs the set-up with these options.
///
/// If the set-up fails, no test of this program can pass, so the program ends at once. The reason is then the
/// last line on the screen, and not one of fifty failures.
pub fn with(options: &Options) -> Ready {
    setup::ready(options).unwrap_or_else(|error| {
        // Not with `eprintln!`, whose output libtest keeps until the test has ended.
        let _ = writeln!(
            std::io::stderr(),
            "\n\nerror: the set-up for the tests that boot a machine failed: {error:#}\n\n\
             `cargo run -- doctor` lists the parts that exist and the parts that are missing. \
             `cargo test --no-fail-fast` runs the tests that need no set-up.\n"
        );
        std::process::exit(1);
    })
}

/// Returns the image on QEMU's standard adapter, without a window.
pub fn config() -> Config {
    Config::new(&READY)
}
