//! What drawing costs: pieces of work that can be repeated, and the protocol that asks for them.
//!
//! The measuring kernel gives a [`Bench`] the bare machine's card and its time stamp counter, and
//! the host asks for one mapper and order after the other. Nothing is counted while time is taken:
//! port writes and stores are counted by the same bench on the emulated card behind a
//! [`modex::Counted`], and `check` tells the pictures' checksums of both.
//!
//! # The protocol
//!
//! As in [`link`]: lines with checksums, an answer closes with `ok` and what was asked, or `error`.
//! Nothing is said while something is measured.
//!
//! | line | answer, before `ok` |
//! | --- | --- |
//! | `calibrate` | `instructions 4000000 ticks 4000000`, and whether the CPU has BMI2: `bmi2 no` |
//! | `measure affine planes 5` | for each [`Work`] its pixels and the ticks of each round: `screen-ram pixels 76800 ticks 5 5 5 5 5` |
//! | `runs affine planes 5` | for each of [`LENGTHS`] the same of `run-8-jobs` and `run-8-draw` |
//! | `check affine planes` | for each work that draws the CRC-32 of its picture: `screen-ram crc 5d41402a` |
//! | `leave` | after the `ok` QEMU ends |
#![no_std]
#![forbid(unsafe_code)]

mod bench;
mod line;
mod screen;
mod work;

pub use bench::{Bench, Clock, FRAME, LENGTHS, Memory, Out};
pub use line::{Ask, AskError, Figure, MAX_ROUNDS};
pub use work::{Place, Work};
