//! The constant-z mapper: walls and floors, where one division serves a whole span.
//!
//! Where the plane's c does not change down the columns (a wall) or along the rows (a floor), a span has a
//! single depth: u = a / c and v = b / c are linear along it, so affine steps are exact perspective. A wall
//! whose u is constant as well (its texture stands upright) steps one coordinate only. For any other plane,
//! the exact mapper draws the columns.
//!
//! Legal input: any face. Error against the quotient of the plane's integers, clamped into the texture: at
//! most [`drift`]. Where c is not above zero, or the steps lead further than 4096 texels, the span is drawn
//! exactly.

use super::clamped::ConstantDepthForms;
use super::mapped_span::{MappedSpan, SpanKind};
use crate::geometry::{Axis, Dropped, Texture};
use crate::loops::{AffineStepper, UprightStepper};
use crate::plane::{Face, Plane, PlaneStepper};
use crate::scan::spans;

/// Returns the largest error of a coordinate at pixel `i` of a span of constant depth, 16.16. The step is
/// rounded to nearest, the start is rounded down, and the reciprocal is off by 2^-31 of its value: at the
/// 4096 texels that steps may reach, that is 1/8 of a unit in the start and 1/8 in the steps.
pub fn drift(i: u16) -> i32 {
    i32::from(i) / 2 + 3
}

/// Returns the axis along which the plane's depth is constant, if any; columns before rows.
pub fn axis(plane: &Plane) -> Option<Axis> {
    match (plane.c.down, plane.c.right) {
        (0, _) => Some(Axis::Down),
        (_, 0) => Some(Axis::Right),
        _ => None,
    }
}

/// Passes the spans of a face to `sink`.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub(crate) fn map(
    face: &Face<'_>,
    texture: &Texture<'_>,
    sink: &mut dyn FnMut(MappedSpan),
) -> Result<(), Dropped> {
    let plane = face.plane();
    let constant = axis(&plane);
    let axis = constant.unwrap_or(Axis::Down);
    spans(axis, face.polygon, |span| {
        let mapped = |first: u16, len, kind| MappedSpan {
            axis,
            line: span.line,
            first: span.first + first,
            len,
            kind,
        };
        let stepper = PlaneStepper::along(&plane, axis, span.line, span.first);
        let [a, b, _] = stepper.step;
        let forms = ConstantDepthForms {
            at: stepper.at,
            step: [a, b],
        };
        match constant.and_then(|_| forms.step(span.len)) {
            Some(step) => step.pieces(span.len, texture.last(), |first, len, stepper| {
                let AffineStepper { u, v, du, dv } = stepper;
                let kind = match (axis, du) {
                    (Axis::Down, 0) => SpanKind::Upright(UprightStepper { u, v, dv }),
                    _ => SpanKind::Affine(stepper),
                };
                sink(mapped(first, len, kind));
            }),
            None => sink(mapped(0, span.len, SpanKind::Exact(stepper))),
        }
    })
}
