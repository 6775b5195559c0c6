//! The affine column loops: one walk, several ways to step it.
//!
//! Each takes a walk inside the texture and draws the texels of its clear twin,
//! [`affine::column`](crate::affine::column), bit for bit unless it says otherwise.

use modex::Column;

use crate::Texture;
use crate::affine::{self, Walk};

/// A way to step a walk down a column.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Loop {
    /// The texel's index multiplied out for every pixel: the clear twin.
    Multiply,
    /// Two fractions, each carry tested (chapter 58's first column loop).
    TwoCarries,
    /// Both fractions in one register, one branch (its last).
    Packed,
    /// The carry picks one of two steps, no branch.
    TwoSteps,
    /// Two accumulators, shifts and masks; padded textures.
    #[default]
    Shifts,
    /// One accumulator for both coordinates, shifts and masks; padded textures.
    Joined,
    /// Each register with the other's fraction, by add-with-carry; padded textures.
    AddCarry,
    /// One accumulator, the index by the CPU's bit-extract; padded textures, a CPU with BMI2.
    Extract,
}

impl Loop {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Multiply,
        Self::TwoCarries,
        Self::Packed,
        Self::TwoSteps,
        Self::Shifts,
        Self::Joined,
        Self::AddCarry,
        Self::Extract,
    ];

    /// Draws a column.
    #[inline]
    pub fn column(self, texture: &Texture<'_>, walk: Walk, column: Column<'_>) {
        affine::column(texture, walk, column);
    }
}
