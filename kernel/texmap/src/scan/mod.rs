//! From polygons to spans: this folder decides which pixels a polygon covers, and which of them are
//! visible.
//!
//! The decision is exact integer arithmetic: no pixel depends on rounding, on the direction of the
//! scan or on the mapper.

pub(crate) mod edges;
pub(crate) mod interpolant;
pub(crate) mod spans;
pub(crate) mod visible;

pub use edges::Crossing;
pub(crate) use edges::{crossed, offset};
pub(crate) use interpolant::EdgeInterpolant;
pub(crate) use spans::MAX_SPANS;
pub use spans::{Span, columns, rows, spans, spans_and_crossings};
pub use visible::Visible;
