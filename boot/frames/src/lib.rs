//! Frames on the host: drawing them on a VGA, dumps, PNGs, comparison, golden frames, recordings.
//!
//! Nothing here starts QEMU. Functions that need a VGA are generic over [`backend::Backend`], which QEMU's VGA and
//! the emulated VGA implement.
#![forbid(unsafe_code)]

pub mod backend;
pub mod comparison;
pub mod difference;
pub mod dump;
pub mod golden;
pub mod indexed;
pub mod options;
pub mod record;
pub mod replay;
pub mod report;
pub mod rgb;
pub mod write;
