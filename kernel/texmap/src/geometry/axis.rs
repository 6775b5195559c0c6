//! The two directions of a span.

/// The direction of a span of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Down a column.
    Down,
    /// To the right along a row.
    Right,
}
