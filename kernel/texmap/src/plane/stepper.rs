//! The plane stepper: a plane's three forms, from pixel to pixel of a span.

use super::forms::Plane;
use crate::geometry::Axis;

/// The three forms of a plane along a span of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlaneStepper {
    /// a, b and c at the first pixel's centre.
    pub at: [i64; 3],
    /// Steps of a, b and c from a pixel to the next.
    pub step: [i64; 3],
}

impl PlaneStepper {
    /// Returns the stepper along `axis` from pixel (x, y) of the screen.
    pub fn new(plane: &Plane, axis: Axis, x: u16, y: u16) -> Self {
        let forms = [plane.a, plane.b, plane.c];
        Self {
            at: forms.map(|form| form.at(x, y)),
            step: forms.map(|form| match axis {
                Axis::Down => form.down,
                Axis::Right => form.right,
            }),
        }
    }

    /// Returns the stepper along `axis` from pixel `first` of column or row `line`.
    pub fn along(plane: &Plane, axis: Axis, line: u16, first: u16) -> Self {
        match axis {
            Axis::Down => Self::new(plane, axis, line, first),
            Axis::Right => Self::new(plane, axis, first, line),
        }
    }

    /// Returns a, b and c at `pixels` pixels after the first.
    pub fn after(&self, pixels: u16) -> [i64; 3] {
        [0, 1, 2].map(|k| self.at[k] + self.step[k] * i64::from(pixels))
    }

    /// Returns the stepper that starts at pixel `pixels` of this stepper and steps by `stride` pixels.
    pub(crate) fn every(&self, stride: u16, pixels: u16) -> Self {
        Self {
            at: self.after(pixels),
            step: self.step.map(|step| step * i64::from(stride)),
        }
    }

    /// Returns the forms at the current pixel, and steps to the next pixel.
    pub(crate) fn next(&mut self) -> [i64; 3] {
        let here = self.at;
        // This steps at most one pixel past the span's end, and a step is below 2^55: no overflow.
        self.at = self.after(1);
        here
    }
}
