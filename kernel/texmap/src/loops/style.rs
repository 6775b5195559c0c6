//! Styles: which loops draw a mapper's spans.

use super::quotients::Quotients;
use super::select::Loop;

/// How the pixels of a row are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rows {
    /// Computes address, plane and texel from scratch for every pixel.
    Multiply,
    /// Steps everything, and selects the plane for every pixel.
    Steps,
    /// Draws the row in four passes, one for each plane.
    Passes,
    /// Makes all texels one after the other, and then writes the planes: see
    /// [`modex::Destination::line`].
    #[default]
    Lines,
}

/// How spans are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Style {
    /// The loop for affine columns.
    pub affine: Loop,
    /// The way to write rows.
    pub rows: Rows,
    /// The way to compute exact quotients down columns.
    pub quotients: Quotients,
}
