//! The parts of the `crystal-ball` command that the tests also use.

pub mod window;

use std::path::PathBuf;

/// Returns the folder of the workspace's golden frames.
pub fn golden_folder() -> PathBuf {
    setup::root().join("tests").join("golden")
}
