//! The one place that says which compiler: a new pin is made by changing this file (and, where it wants
//! another boot loader, `boot/image`'s and the kernel's dependency).
//!
//! The version is pinned because the boot loader's target files are in a format that compilers change:
//! `bootloader` 0.11.15 builds with 1.96 and not with every later one. It is the version that both rustup and
//! Debian 12 have.

/// The compiler and its library sources.
pub const RUST: &str = "1.96.0";

/// Debian's packages of it, all of version [`RUST`]. The first one has no version in its name.
pub const DEBIAN_RUST: [&str; 4] = [
    "rustc-web",
    "libstd-rust-web-dev",
    "libstd-rust-web-1.96",
    "rust-web-src",
];

/// Debian's packages of the LLVM that the compiler and the boot loader's build use.
pub const DEBIAN_LLVM: [&str; 3] = ["llvm-22", "lld-22", "libllvm22"];

/// Where Debian's LLVM has its programs, below `usr`.
pub const LLVM_PROGRAMS: &str = "lib/llvm-22/bin";

/// Debian's packages unpacked, on the disk (measured, rounded up).
pub const DEBIAN_UNPACKED: u64 = 1_000_000_000;

/// rustup's toolchain with the components needed, download and unpacked at once (measured, rounded up).
pub const RUSTUP_UNPACKED: u64 = 1_010_000_000;

/// What the build of the boot loader needs for a while beside the toolchain (measured, rounded up).
pub const BUILDS: u64 = 600_000_000;
