//! The pinned compiler's version. To pin another version, change this file, and, if that version needs
//! another boot loader, the `bootloader` dependencies of `boot/image` and of the kernel.
//!
//! The version is pinned because the boot loader's target files are in a format that changes with the
//! compiler: `bootloader` 0.11.15 builds with 1.96 but not with every later version. Both rustup and Debian
//! 12 have 1.96.

/// The version of the compiler and of its library sources.
pub const RUST: &str = "1.96.0";

/// Debian's packages of the compiler, all of version [`RUST`]. The first one has no version in its name.
pub const DEBIAN_RUST: [&str; 4] = [
    "rustc-web",
    "libstd-rust-web-dev",
    "libstd-rust-web-1.96",
    "rust-web-src",
];

/// Debian's packages of LLVM, which the compiler and the boot loader's build use.
pub const DEBIAN_LLVM: [&str; 3] = ["llvm-22", "lld-22", "libllvm22"];

/// The folder of LLVM's programs in Debian's packages, below `usr`.
pub const LLVM_PROGRAMS: &str = "lib/llvm-22/bin";

/// Bytes on the disk of Debian's packages, unpacked (measured, rounded up).
pub const DEBIAN_UNPACKED: u64 = 1_000_000_000;

/// Bytes on the disk of rustup's toolchain with the needed components: download and unpacked files together
/// (measured, rounded up).
pub const RUSTUP_UNPACKED: u64 = 1_010_000_000;

/// Bytes on the disk that the boot loader's build needs temporarily, besides the toolchain (measured,
/// rounded up).
pub const BUILDS: u64 = 600_000_000;
