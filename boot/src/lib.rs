//! The host program of Crystal Ball: set-up, disk image, QEMU and its verdict.

pub mod aside;
pub mod child;
pub mod machine;
pub mod screen;
pub mod setup;
