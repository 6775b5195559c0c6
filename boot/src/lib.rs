//! The `crystal-ball` command: what accuracy costs, and the window.

pub mod measure;
pub mod trade;
pub mod window;

use std::path::PathBuf;

/// Returns the folder of the workspace's golden frames.
pub fn golden_folder() -> PathBuf {
    setup::root().join("tests").join("golden")
}
