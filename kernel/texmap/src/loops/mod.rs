//! The inner loops: this folder decides how a span's pixels are written, texel by texel.
//!
//! A loop gets a stepper whose coordinates lie inside the texture, and a sink with a constant
//! stride. It neither clamps nor divides. Each tuned loop has a portable version with the same
//! registers and the same bits.

#[cfg(target_arch = "x86_64")]
pub(crate) mod cpu;
pub(crate) mod quotients;
pub(crate) mod registers;
pub(crate) mod select;
pub(crate) mod sink;
pub(crate) mod stepper;
pub(crate) mod style;
#[cfg(target_arch = "x86_64")]
pub(crate) mod tuned;

pub use quotients::Quotients;
pub(crate) use quotients::{DrawQuotients, InsideSpan};
pub use select::Loop;
pub(crate) use select::{AffineLoops, Draw};
pub(crate) use sink::{PixelSink, RowPixels, SpanPixels};
pub(crate) use stepper::LINE_FRACTION;
pub use stepper::{AffineStepper, LineStepper, UprightStepper};
pub use style::{Rows, Style};
#[cfg(target_arch = "x86_64")]
pub(crate) use tuned::{extract_eights, shifts_eights};
