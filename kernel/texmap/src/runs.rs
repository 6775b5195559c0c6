//! Perspective by runs: the quotient at the ends of short pieces of a run, and a polynomial between.

use crate::Texture;
use crate::plane::{Walk, coordinate};

/// How a run is cut into pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// Of so many pixels each, 2 to 128, and what is left over.
    Of(u8),
    /// Of the powers of two that the run's length is the sum of, none above 64, the longest first:
    /// every division by a length is a shift.
    Powers,
    /// One: the run.
    Whole,
}

/// The coordinates of a plane's walk, linear or quadratic in each piece, pixel after pixel.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    walk: Walk,
    size: (u16, u16),
}

impl Steps {
    /// Linear in each piece.
    pub fn linear(walk: Walk, _len: u16, _pieces: Pieces, texture: &Texture<'_>) -> Self {
        Self {
            walk,
            size: (texture.width(), texture.height()),
        }
    }

    /// Quadratic in each piece.
    pub fn quadratic(walk: Walk, _len: u16, _pieces: Pieces, texture: &Texture<'_>) -> Self {
        Self {
            walk,
            size: (texture.width(), texture.height()),
        }
    }
}

impl Iterator for Steps {
    type Item = (i32, i32);

    fn next(&mut self) -> Option<(i32, i32)> {
        let [a, b, c] = self.walk.next();
        Some((coordinate(a, c, self.size.0), coordinate(b, c, self.size.1)))
    }
}
