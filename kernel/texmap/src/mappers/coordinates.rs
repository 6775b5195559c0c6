//! The reference implementation of every kind of span: its texture coordinates, pixel after pixel.

use super::mapped_span::SpanKind;
use super::quadratic::PolynomialStepper;
use crate::geometry::Texture;
use crate::loops::{AffineStepper, LineStepper};
use crate::plane::{PlaneStepper, coordinate};

/// A span's texture coordinates, pixel after pixel.
pub(crate) enum Coordinates {
    Affine(AffineStepper),
    Exact(PlaneStepper, (u16, u16)),
    Pieces(PolynomialStepper),
    FreeDirection(LineStepper),
}

impl Coordinates {
    /// Returns the coordinates of a span of `len` pixels, which is not adaptive: an adaptive span's pieces
    /// have their own coordinates.
    pub fn new(kind: SpanKind, len: u16, texture: &Texture<'_>) -> Self {
        match kind {
            SpanKind::Affine(stepper) => Self::Affine(stepper),
            SpanKind::Upright(stepper) => Self::Affine(stepper.into()),
            SpanKind::Exact(stepper) => Self::Exact(stepper, (texture.width(), texture.height())),
            SpanKind::Linear(stepper, pieces) => {
                Self::Pieces(PolynomialStepper::linear(stepper, len, pieces, texture))
            }
            SpanKind::Quadratic(stepper, pieces) => {
                Self::Pieces(PolynomialStepper::quadratic(stepper, len, pieces, texture))
            }
            SpanKind::FreeDirection(stepper) => Self::FreeDirection(stepper),
            SpanKind::Adaptive(..) => unreachable!("its pieces have them"),
        }
    }

    /// Returns the coordinates of the current pixel, and steps to the next pixel.
    pub fn next(&mut self) -> (i32, i32) {
        match self {
            Self::Affine(stepper) => stepper.next().unwrap_or_default(),
            Self::Exact(stepper, size) => {
                let [a, b, c] = stepper.next();
                (coordinate(a, c, size.0), coordinate(b, c, size.1))
            }
            Self::Pieces(stepper) => stepper.next().unwrap_or_default(),
            Self::FreeDirection(stepper) => stepper.next().unwrap_or_default(),
        }
    }
}
