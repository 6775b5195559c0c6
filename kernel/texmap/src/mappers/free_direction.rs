//! The free-direction mapper: spans along the lines of constant depth, in whatever direction they run.
//!
//! Every plane has lines of constant depth on the screen: along them c stays constant, so
//! c.right dx + c.down dy = 0. Along such a line u and v are linear, and one division serves the whole line.
//! Pixels do not lie exactly on the line, so the mapper draws the line through the pixels nearest to it. A
//! line nearer the horizontal has one pixel in every column that it crosses, and a line nearer the vertical
//! has one pixel in every row.
//! All lines are copies of one line, moved by whole pixels (down, or to the right), so each pixel of the
//! screen lies on exactly one line.
//!
//! # Which pixels
//!
//! Exactly the pixels of coverage, each once. Take a line nearer the horizontal, S(x) whole pixels down at
//! column x. Pixel (x, y) lies on line y - S(x), so an inside span of column x becomes a range of lines. From
//! a column to the next, the mapper closes the lines that have left the ranges, and each becomes a job from
//! the column where it was opened; it opens the lines that are new in the ranges. Only the differences are
//! examined. Nearer the vertical, columns and rows change places.
//!
//! # Error
//!
//! Across its direction, the line passes up to half a pixel beside the centres of its pixels: down the column
//! for a line nearer the horizontal. In that direction u is a hyperbola. So the error is at most the sum of
//! three terms: the larger of u's differences between the centre and the two places [`LARGEST_DISTANCE`]
//! above and below it; [`drift`](super::constant_z::drift) for the pixel's number in its line; and one unit
//! in the last place of the forms for each of the line's pixels. To first order that is half a pixel's worth
//! of the texture's gradient across the line, and this error does occur. Where c is not above zero on a line,
//! or the line's coordinates go further than 4096 texels, its pixels are drawn exactly.

use super::clamped::ConstantDepthForms;
use super::mapped_span::{MappedSpan, SpanKind};
use crate::geometry::{Axis, Dropped, Texture};
use crate::loops::{AffineStepper, LINE_FRACTION, LineStepper};
use crate::plane::{Face, Form, Plane, PlaneStepper};
use crate::scan::{MAX_SPANS, spans};
use modex::{HEIGHT, WIDTH};

/// Largest distance of a line from a pixel's centre, in 2^-14 pixel: half a pixel, plus the error of the
/// offset's steps.
pub const LARGEST_DISTANCE: i32 = (1 << 13) + 1;
/// Half a pixel.
const HALF: i32 = 1 << (LINE_FRACTION - 1);
/// Upper limit of the number of lines that meet the screen: one for each pixel of the first column, and one
/// for each pixel that the slope, at most 1, shifts a line over the width. Rows have equally many.
const LINES: usize = WIDTH + HEIGHT;

/// The lines of constant depth of a plane.
#[derive(Debug)]
struct ConstantDepthLines {
    plane: Plane,
    /// The direction in which a line advances by one pixel per step.
    axis: Axis,
    /// The offset across that direction at pixel 0, and its step, with [`LINE_FRACTION`] bits.
    start: i32,
    slope: i32,
    /// Steps of a and b along a line.
    step: [i64; 2],
}

/// Returns a form's steps along `axis` and across it.
fn steps(form: &Form, axis: Axis) -> (i64, i64) {
    match axis {
        Axis::Right => (form.right, form.down),
        Axis::Down => (form.down, form.right),
    }
}

/// Returns the pixel (x, y) with these positions along `axis` and across it.
fn place(axis: Axis, along: u16, across: u16) -> (u16, u16) {
    match axis {
        Axis::Right => (along, across),
        Axis::Down => (across, along),
    }
}

/// Returns n / d, rounded to nearest.
fn rounded(n: i128, d: i128) -> i128 {
    let (n, d) = if d < 0 { (-n, -d) } else { (n, d) };
    (2 * n + d).div_euclid(2 * d)
}

impl ConstantDepthLines {
    fn new(plane: &Plane) -> Self {
        // A line advances in the direction in which c changes less.
        let axis = match plane.c.right.unsigned_abs() < plane.c.down.unsigned_abs() {
            true => Axis::Right,
            false => Axis::Down,
        };
        let (c_along, c_across) = steps(&plane.c, axis);
        // Both are zero: depth is constant everywhere, and any line will do.
        let c_across = if c_across == 0 { 1 } else { c_across };
        let slope = rounded(-(i128::from(c_along) << LINE_FRACTION), c_across.into()) as i32;
        // The rounding moves a form by at most one unit in the last place for each pixel.
        let step = [plane.a, plane.b].map(|form| {
            let (along, across) = steps(&form, axis);
            let share = i128::from(across) * i128::from(c_along);
            along - rounded(share, c_across.into()) as i64
        });
        let pixels = match axis {
            Axis::Right => WIDTH,
            Axis::Down => HEIGHT,
        };
        // Lines are numbered from 0, so that no line lies before the screen's first pixel. A line without
        // slope passes through the pixels' centres.
        let furthest = HALF + slope * (pixels as i32 - 1);
        let start = HALF - (furthest.max(HALF) >> LINE_FRACTION << LINE_FRACTION);
        Self {
            plane: *plane,
            axis,
            start,
            slope,
            step,
        }
    }

    /// Returns the offset of line 0 at pixel `along`; its whole pixels are zero or below.
    fn offset(&self, along: u16) -> i32 {
        self.start + self.slope * i32::from(along)
    }

    /// Returns the number of the line through the pixel at these positions along the axis and across it.
    fn line(&self, along: u16, across: u16) -> usize {
        (i32::from(across) - (self.offset(along) >> LINE_FRACTION)) as usize
    }

    /// Passes the spans of pixels `from..to` of a line to `sink`.
    fn map(
        &self,
        line: usize,
        from: u16,
        to: u16,
        texture: &Texture<'_>,
        sink: &mut dyn FnMut(MappedSpan),
    ) {
        let start = self.offset(from);
        let len = to - from;
        // The row or column of a pixel, and the line's offset in it.
        let split = |first: u16| {
            let offset = start + self.slope * i32::from(first);
            let across = (line as i32 + (offset >> LINE_FRACTION)) as u16;
            (across, offset & ((1 << LINE_FRACTION) - 1))
        };
        let mapped = |first: u16, len, kind| MappedSpan {
            axis: self.axis,
            line: split(first).0,
            first: from + first,
            len,
            kind,
        };
        let stepper = |first: u16, texture| LineStepper {
            texture,
            offset: split(first).1,
            slope: self.slope,
        };
        // The forms on the line itself, beside the first pixel's centre.
        let (across, fraction) = split(0);
        let (x, y) = place(self.axis, from, across);
        let at = [self.plane.a, self.plane.b, self.plane.c].map(|form| {
            let (_, step) = steps(&form, self.axis);
            let beside = i128::from(step) * i128::from(fraction - HALF);
            form.at(x, y) + (beside >> LINE_FRACTION) as i64
        });
        let forms = ConstantDepthForms {
            at,
            step: self.step,
        };
        if let Some(step) = forms.step(len) {
            step.pieces(len, texture.last(), |first, len, texture| {
                let kind = SpanKind::FreeDirection(stepper(first, texture));
                sink(mapped(first, len, kind));
            });
            return;
        }
        let pixels = stepper(0, AffineStepper::default());
        let mut first = 0;
        while first < len {
            let count = pixels.pixels_in_line(first, len);
            let exact = PlaneStepper::along(&self.plane, self.axis, split(first).0, from + first);
            sink(mapped(first, count, SpanKind::Exact(exact)));
            first += count;
        }
    }
}

/// The lines that are inside at one position: disjoint ranges, in order.
#[derive(Clone, Copy, Debug)]
struct LineRanges {
    ranges: [(usize, usize); MAX_SPANS],
    len: usize,
}

impl LineRanges {
    const NOTHING: Self = Self {
        ranges: [(0, 0); MAX_SPANS],
        len: 0,
    };

    fn add(&mut self, range: (usize, usize)) {
        self.ranges[self.len] = range;
        self.len += 1;
    }

    fn ranges(&self) -> &[(usize, usize)] {
        &self.ranges[..self.len]
    }

    /// Passes the lines that are inside here and not in `other` to `sink`.
    fn without(&self, other: &Self, mut sink: impl FnMut(usize)) {
        for &(mut first, end) in self.ranges() {
            for &(from, to) in other.ranges() {
                for line in first..from.min(end) {
                    sink(line);
                }
                first = first.max(to);
            }
            for line in first..end {
                sink(line);
            }
        }
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
    let lines = ConstantDepthLines::new(&face.plane());
    // The spans go across the lines.
    let across = match lines.axis {
        Axis::Right => Axis::Down,
        Axis::Down => Axis::Right,
    };
    let mut opened = [0; LINES];
    let (mut before, mut now) = (LineRanges::NOTHING, LineRanges::NOTHING);
    let mut here = 0;
    let mut go = |to: u16, before: &LineRanges, now: &LineRanges| {
        before.without(now, |line| {
            lines.map(line, opened[line], to, texture, sink);
        });
        now.without(before, |line| opened[line] = to);
    };
    spans(across, face.polygon, |span| {
        if span.line != here {
            go(here, &before, &now);
            (before, now) = (now, LineRanges::NOTHING);
            if span.line != here + 1 {
                go(here + 1, &before, &now);
                before = now;
            }
            here = span.line;
        }
        now.add((
            lines.line(span.line, span.first),
            lines.line(span.line, span.first + span.len),
        ));
    })?;
    go(here, &before, &now);
    go(here + 1, &now, &LineRanges::NOTHING);
    Ok(())
}
