//! The host program of Crystal Ball: set-up, disk image, QEMU and its verdict.

pub mod aside;
pub mod card;
pub mod child;
pub mod dump;
pub mod frames;
pub mod indexed;
pub mod machine;
pub mod screen;
pub mod setup;
