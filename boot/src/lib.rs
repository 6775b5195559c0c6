//! What the `crystal-ball` command and its tests share.

pub mod window;

use std::path::PathBuf;

/// Returns the folder of the workspace's golden frames.
pub fn golden_folder() -> PathBuf {
    setup::root().join("tests").join("golden")
}
