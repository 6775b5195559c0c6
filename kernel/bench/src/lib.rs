//! The benchmark: repeatable pieces of drawing work to measure, and the protocol that requests them.
//!
//! The benchmark kernel gives a [`Bench`] the bare machine's card and its time stamp counter. The host
//! requests one mapper and order after the other. The kernel counts nothing while it measures times. The same
//! bench on the emulated VGA, behind a [`modex::Counted`], counts port writes and stores. `check` prints
//! checksums of the frames, so that the host can compare the frames of both cards.
//!
//! # The protocol
//!
//! As in the crate [`protocol`], lines have checksums, and the last line of an answer is `ok` with the
//! request, or `error`. The kernel sends nothing during a measurement.
//!
//! | line | answer, before `ok` |
//! | --- | --- |
//! | `calibrate` | `instructions 4000000 ticks 4000000`, and whether the CPU has BMI2: `bmi2 no` |
//! | `measure affine planes 5` | for each [`Work`], its pixels and the ticks of each round: `screen-ram pixels 76800 ticks 5 5 5 5 5` |
//! | `spans affine planes 5` | for each of [`LENGTHS`] (here 8), the same figures of `span-8-jobs` and `span-8-draw` |
//! | `check affine planes` | for each [`Work`] that draws, the CRC-32 of its frame: `screen-ram crc 5d41402a` |
//! | `leave` | no lines; QEMU ends after the `ok` |
//!
//! # Example
//!
//! ```
//! use bench::{BenchRequest, Figure};
//!
//! let request = BenchRequest::parse("measure affine planes 5").unwrap();
//! assert_eq!(request.to_string(), "measure affine planes 5");
//!
//! let figure = Figure::parse("pixels 76800 ticks 5 4 6".split(' ')).unwrap();
//! assert_eq!((figure.pixels(), figure.ticks()), (76_800, &[5, 4, 6][..]));
//! ```
#![no_std]
#![forbid(unsafe_code)]

mod bench;
mod request;
mod screen;
mod work;

pub use bench::{Bench, BenchMemory, Clock, FRAME, LENGTHS, Out};
pub use request::{BenchRequest, BenchRequestError, Figure, MAX_ROUNDS};
pub use work::{Target, Work};
