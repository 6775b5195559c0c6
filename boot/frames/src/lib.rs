//! Frames on the host: the cards that draw them, dumps and PNGs of them, comparison, golden frames, recordings.
//!
//! Nothing here starts QEMU. [`card::Card`] is what QEMU's card and the emulated VGA have in common, so each
//! function works with both.
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
