//! Mapped spans: what a mapper yields. A mapped span is a span of pixels with the stepper of its texture
//! coordinates.

use crate::geometry::{Axis, Dropped};
use crate::loops::{AffineStepper, LineStepper, UprightStepper};
use crate::plane::{Face, PlaneStepper, Subdivision, Tolerance};
use crate::scan::{Span, spans};

/// How the texture coordinates advance along a span: a stepper, and the way to use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpanKind {
    /// Constant steps: see [`super::affine`].
    Affine(AffineStepper),
    /// A quotient for every pixel: see [`super::exact`].
    Exact(PlaneStepper),
    /// Linear pieces: see [`super::linear`].
    Linear(PlaneStepper, Subdivision),
    /// Quadratic pieces: see [`super::quadratic`].
    Quadratic(PlaneStepper, Subdivision),
    /// Linear pieces within a tolerance: see [`super::adaptive`].
    Adaptive(PlaneStepper, Tolerance),
    /// Constant depth, with only one coordinate stepped: see [`super::constant_z`].
    Upright(UprightStepper),
    /// A span that leaves its row or column: see [`super::free_direction`].
    FreeDirection(LineStepper),
}

impl SpanKind {
    /// Returns the part of the span from pixel `first` on.
    ///
    /// Pieces start again at the part's first pixel. They are no longer than the pieces of the whole span,
    /// and lie within it, so every [bound](crate::plane::bounds) still holds.
    pub(crate) fn after(self, first: u16) -> Self {
        let after = |stepper: PlaneStepper| PlaneStepper {
            at: stepper.after(first),
            ..stepper
        };
        match self {
            Self::Affine(stepper) => Self::Affine(stepper.every(1, first.into())),
            Self::Exact(stepper) => Self::Exact(after(stepper)),
            Self::Linear(stepper, pieces) => Self::Linear(after(stepper), pieces),
            Self::Quadratic(stepper, pieces) => Self::Quadratic(after(stepper), pieces),
            Self::Adaptive(stepper, tolerance) => Self::Adaptive(after(stepper), tolerance),
            Self::Upright(stepper) => Self::Upright(stepper.after(first)),
            Self::FreeDirection(stepper) => Self::FreeDirection(stepper.after(first)),
        }
    }
}

/// A span of pixels with its texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MappedSpan {
    /// Direction: down a column or along a row.
    pub axis: Axis,
    /// The column's x, or the row's y.
    pub line: u16,
    /// The first pixel: its y in a column, its x in a row.
    pub first: u16,
    /// The number of pixels, at least 1.
    pub len: u16,
    /// The texture coordinates along the span.
    pub kind: SpanKind,
}

impl MappedSpan {
    /// Returns a polygon's span with its texture coordinates.
    pub(crate) fn new<End>(axis: Axis, span: &Span<End>, kind: SpanKind) -> Self {
        Self {
            axis,
            line: span.line,
            first: span.first,
            len: span.len,
            kind,
        }
    }
}

/// Passes the spans of a face along `axis` to `sink`; `kind` makes the kind of each span from its plane
/// stepper.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub(crate) fn map_plane(
    axis: Axis,
    face: &Face<'_>,
    kind: impl Fn(PlaneStepper) -> SpanKind,
    sink: &mut dyn FnMut(MappedSpan),
) -> Result<(), Dropped> {
    let plane = face.plane();
    spans(axis, face.polygon, |span| {
        let stepper = PlaneStepper::along(&plane, axis, span.line, span.first);
        sink(MappedSpan::new(axis, &span, kind(stepper)));
    })
}
