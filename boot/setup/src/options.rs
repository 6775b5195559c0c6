//! The user's choices about the set-up.

use std::path::PathBuf;

/// The user's choices about the set-up.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// A complete Rust toolchain to use instead of the pinned one. The variable `CRYSTAL_BALL_TOOLCHAIN` has
    /// the same effect.
    pub toolchain: Option<PathBuf>,
    /// The QEMU to use, instead of the one in `PATH` or in the cache.
    pub qemu: Option<PathBuf>,
    /// Whether the user wants a window. If so, a QEMU that can open a window is preferred, or fetched.
    pub window: bool,
    /// The contents of the kernel's ramdisk, usually a model file.
    pub ramdisk: Option<Vec<u8>>,
}
