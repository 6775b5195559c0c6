//! The host program of Crystal Ball: set-up, disk image, QEMU and its verdict.

pub mod card;
pub mod diff;
pub mod dump;
pub mod frames;
pub mod golden;
pub mod indexed;
pub mod look;
pub mod machine;
pub mod measure;
pub mod record;
pub mod replay;
pub mod report;
pub mod screen;
pub mod trade;
pub mod window;
