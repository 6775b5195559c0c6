//! Frames on the host: drawing them on a VGA, dumps, PNGs, comparison, golden frames, recordings.
//!
//! Nothing here starts QEMU. Functions that need a VGA are generic over [`card::Card`], which QEMU's VGA and
//! the emulated VGA implement.
#![forbid(unsafe_code)]

pub mod card;
pub mod comparison;
pub mod difference;
pub mod dump;
pub mod golden;
pub mod indexed;
pub mod look;
pub mod record;
pub mod replay;
pub mod report;
pub mod screen;
pub mod write;
