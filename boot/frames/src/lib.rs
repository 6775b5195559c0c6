//! Handles frames on the host: drawing, dumps, PNGs, comparison, golden frames, recordings and replay.
//!
//! Nothing here starts QEMU. Functions that need a VGA are generic over [`backend::Backend`], which QEMU's
//! VGA and the emulated VGA implement.
//!
//! This example reads two dumps and compares them:
//!
//! ```
//! use frames::difference::{Capture, compare};
//! use frames::dump::Dump;
//! use protocol::Content;
//!
//! let mut dump = Dump::example(Content::Page);
//! let mut files = [Vec::new(), Vec::new()];
//! dump.write(&mut files[0])?;
//! dump.pixels[321] ^= 1;
//! dump.write(&mut files[1])?;
//!
//! let [expected, got] = files.map(|file| Dump::read(&file).map(Capture::Dump));
//! let difference = compare(&expected?, &got?)?.expect("a pixel differs");
//! assert_eq!(
//!     difference.to_string(),
//!     "1 of 76800 pixels differs, first plane 1, x 1, y 1: expected 46, got 47"
//! );
//! # anyhow::Ok(())
//! ```
#![forbid(unsafe_code)]

pub mod backend;
pub mod comparison;
pub mod difference;
pub mod dump;
pub mod golden;
pub mod html;
pub mod indexed;
pub mod options;
pub mod record;
pub mod replay;
pub mod report;
pub mod rgb;
pub mod write;
