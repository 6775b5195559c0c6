//! Subdivisions: the fixed ways to cut a span into pieces.

/// Longest piece of [`Subdivision::Powers`], in steps.
pub(crate) const LONGEST_POWER: u16 = 64;

/// A way to cut a span into pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subdivision {
    /// Pieces of the given number of steps, 2 to 128, and a last piece of the steps left over.
    Of(u8),
    /// Powers of two that add up to the span's steps, at most 64 each, the longest first. Every division by a
    /// piece's length is a shift.
    Powers,
    /// A single piece: the whole span.
    Whole,
}

impl Subdivision {
    /// Returns the steps of the next piece when `left` steps are left. No later piece is longer.
    #[inline]
    pub fn longest(self, left: u16) -> u16 {
        match self {
            Self::Of(steps) => left.min(steps.into()),
            Self::Powers => match left.min(LONGEST_POWER) {
                0 => 0,
                left => 1 << left.ilog2(),
            },
            Self::Whole => left,
        }
    }
}
