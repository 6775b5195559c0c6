//! The free-direction mapper: spans along the lines of constant depth, in whatever direction they
//! run.
//!
//! Every plane has lines of constant depth on the screen: along them c stays constant, so
//! c.right dx + c.down dy = 0. Along such a line u and v are linear, and one division serves the
//! whole line. Pixels do not lie exactly on the line, so the mapper draws it through the pixels
//! nearest to it. A line nearer the horizontal has one pixel in every column that it crosses, and a
//! line nearer the vertical has one pixel in every row. All lines are copies of one line, moved by
//! whole pixels (down, or to the right), so each pixel of the screen lies on exactly one line.
//!
//! # Which pixels
//!
//! Exactly the pixels of coverage, each once. Take a line nearer the horizontal, S(x) whole pixels
//! down at column x. Pixel (x, y) lies on line y - S(x), so an inside span of column x becomes a
//! range of lines. From a column to the next, the mapper closes the lines that have left the
//! ranges, and each becomes a job from the column where it was opened; it opens the lines that are
//! new in the ranges. Only the differences are examined. Nearer the vertical, columns and rows
//! change places.
//!
//! # Error
//!
//! Across its direction, the line passes up to half a pixel beside the centres of its pixels: down
//! the column for a line nearer the horizontal. In that direction u is a hyperbola. So the error is
//! at most the sum of three terms: the larger of u's differences between the centre and the two
//! places [`ASIDE`] above and below it; [`level::drift`](crate::level::drift) for the pixel's
//! number in its line; and one unit in the last place of the forms for each of the line's pixels.
//! To first order that is half a pixel's worth of the texture's gradient across the line, and this
//! error does occur. Where c is not above zero on a line, or the line's coordinates go further than
//! 4096 texels, its pixels are drawn exactly.

use crate::coverage::{Axis, Dropped, MAX_RUNS, spans};
use crate::job::{self, Job};
use crate::level::Line;
use crate::plane::{self, Form, Plane};
use crate::{Face, Texture, affine};
use modex::{HEIGHT, WIDTH};

/// Fraction bits of a line's offset across its direction: 320 steps keep it within 2^-14 pixel.
const FRACTION: u32 = 22;
/// Largest distance of a line from a pixel's centre, in 2^-14 pixel: half a pixel, plus the error
/// of the offset's steps.
pub const ASIDE: i32 = (1 << 13) + 1;
/// Half a pixel.
const HALF: i32 = 1 << (FRACTION - 1);
/// Upper limit of the number of lines that meet the screen: one for each pixel of the first column,
/// and one for each pixel that the slope, at most 1, shifts a line over the width. Rows have
/// equally many.
const LINES: usize = WIDTH + HEIGHT;

/// A walk along a line that moves between rows or columns from pixel to pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Walk {
    /// The texture coordinates, and their steps along the line.
    pub texture: affine::Walk,
    /// The line's offset across its direction at the first pixel: 22 fraction bits, 0 to 1.
    pub aside: i32,
    /// The step of `aside`, -1 to 1.
    pub slope: i32,
}

impl Walk {
    /// Returns the offset of pixel `i` from the first pixel's row or column, in pixels.
    pub fn aside(&self, i: u16) -> i16 {
        ((self.aside + self.slope * i32::from(i)) >> FRACTION) as i16
    }

    /// Returns the walk that starts at pixel `i`, with offsets relative to that pixel's row or
    /// column.
    pub(crate) fn after(&self, i: u16) -> Self {
        let aside = self.aside + self.slope * i32::from(i);
        Self {
            texture: self.texture.every(1, i.into()),
            aside: aside & ((1 << FRACTION) - 1),
            ..*self
        }
    }

    /// Returns how many pixels from `i` on, of `len` in all, lie in the same row or column.
    pub(crate) fn straight(&self, i: u16, len: u16) -> u16 {
        let here = self.aside(i);
        let end = (i + 1..len).find(|&next| self.aside(next) != here);
        end.unwrap_or(len) - i
    }
}

impl Iterator for Walk {
    type Item = (i32, i32);

    fn next(&mut self) -> Option<(i32, i32)> {
        self.texture.next()
    }
}

/// The lines of constant depth of a plane.
#[derive(Debug)]
struct Lines {
    plane: Plane,
    /// The direction in which a line advances by one pixel per step.
    axis: Axis,
    /// The offset across that direction at pixel 0, and its step, with [`FRACTION`] bits.
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
fn place(axis: Axis, along: u16, aside: u16) -> (u16, u16) {
    match axis {
        Axis::Right => (along, aside),
        Axis::Down => (aside, along),
    }
}

/// Returns n / d, rounded to nearest.
fn rounded(n: i128, d: i128) -> i128 {
    let (n, d) = if d < 0 { (-n, -d) } else { (n, d) };
    (2 * n + d).div_euclid(2 * d)
}

impl Lines {
    fn new(plane: &Plane) -> Self {
        // A line advances in the direction in which c changes less.
        let axis = match plane.c.right.unsigned_abs() < plane.c.down.unsigned_abs() {
            true => Axis::Right,
            false => Axis::Down,
        };
        let (c_along, c_aside) = steps(&plane.c, axis);
        // Both are zero: depth is constant everywhere, and any line will do.
        let c_aside = if c_aside == 0 { 1 } else { c_aside };
        let slope = rounded(-(i128::from(c_along) << FRACTION), c_aside.into()) as i32;
        // The rounding moves a form by at most one unit in the last place for each pixel.
        let step = [plane.a, plane.b].map(|form| {
            let (along, aside) = steps(&form, axis);
            let share = i128::from(aside) * i128::from(c_along);
            along - rounded(share, c_aside.into()) as i64
        });
        let pixels = match axis {
            Axis::Right => WIDTH,
            Axis::Down => HEIGHT,
        };
        // Lines are numbered from 0, so that no line lies before the screen's first pixel. A line
        // without slope passes through the pixels' centres.
        let furthest = HALF + slope * (pixels as i32 - 1);
        let start = HALF - (furthest.max(HALF) >> FRACTION << FRACTION);
        Self {
            plane: *plane,
            axis,
            start,
            slope,
            step,
        }
    }

    /// Returns the offset of line 0 at pixel `along`; its whole pixels are zero or below.
    fn aside(&self, along: u16) -> i32 {
        self.start + self.slope * i32::from(along)
    }

    /// Returns the number of the line through the pixel at these positions along the axis and
    /// across it.
    fn line(&self, along: u16, aside: u16) -> usize {
        (i32::from(aside) - (self.aside(along) >> FRACTION)) as usize
    }

    /// Passes the jobs of pixels `from..to` of a line to `sink`.
    fn draw(
        &self,
        line: usize,
        from: u16,
        to: u16,
        texture: &Texture<'_>,
        number: u16,
        mut sink: impl FnMut(Job),
    ) {
        let start = self.aside(from);
        let len = to - from;
        let skew = |first: u16| {
            let place = start + self.slope * i32::from(first);
            let aside = (line as i32 + (place >> FRACTION)) as u16;
            (aside, place & ((1 << FRACTION) - 1))
        };
        let job = |first: u16, len: u16, walk| {
            let (aside, _) = skew(first);
            Job::new(self.axis, aside, from + first, len, number, walk)
        };
        let walk = |first: u16, texture| Walk {
            texture,
            aside: skew(first).1,
            slope: self.slope,
        };
        // The forms on the line itself, beside the first pixel's centre.
        let (aside, fraction) = skew(0);
        let (x, y) = place(self.axis, from, aside);
        let at = [self.plane.a, self.plane.b, self.plane.c].map(|form| {
            let (_, step) = steps(&form, self.axis);
            let beside = i128::from(step) * i128::from(fraction - HALF);
            form.at(x, y) + (beside >> FRACTION) as i64
        });
        let forms = Line {
            at,
            step: self.step,
        };
        if let Some(straight) = forms.straight(len) {
            straight.pieces(len, texture.last(), |first, len, texture| {
                sink(job(first, len, job::Walk::Free(walk(first, texture))));
            });
            return;
        }
        let pixels = walk(0, affine::Walk::default());
        let mut first = 0;
        while first < len {
            let straight = pixels.straight(first, len);
            let (aside, _) = skew(first);
            let (x, y) = place(self.axis, from + first, aside);
            let exact = plane::Walk::new(&self.plane, self.axis, x, y);
            sink(job(first, straight, job::Walk::Exact(exact)));
            first += straight;
        }
    }
}

/// The lines that are inside at one position: disjoint ranges, in order.
#[derive(Clone, Copy, Debug)]
struct Inside {
    ranges: [(usize, usize); MAX_RUNS],
    len: usize,
}

impl Inside {
    const NOTHING: Self = Self {
        ranges: [(0, 0); MAX_RUNS],
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

/// Passes the jobs of a face to `sink`.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no job.
pub(crate) fn jobs(
    face: &Face<'_>,
    texture: &Texture<'_>,
    mut sink: impl FnMut(Job),
) -> Result<(), Dropped> {
    let lines = Lines::new(&face.plane());
    // The spans go across the lines.
    let across = match lines.axis {
        Axis::Right => Axis::Down,
        Axis::Down => Axis::Right,
    };
    let mut opened = [0; LINES];
    let (mut before, mut now) = (Inside::NOTHING, Inside::NOTHING);
    let mut here = 0;
    let mut go = |to: u16, before: &Inside, now: &Inside| {
        before.without(now, |line| {
            lines.draw(line, opened[line], to, texture, face.texture, &mut sink);
        });
        now.without(before, |line| opened[line] = to);
    };
    spans(across, face.polygon, |run| {
        if run.line != here {
            go(here, &before, &now);
            (before, now) = (now, Inside::NOTHING);
            if run.line != here + 1 {
                go(here + 1, &before, &now);
                before = now;
            }
            here = run.line;
        }
        now.add((
            lines.line(run.line, run.first),
            lines.line(run.line, run.first + run.len),
        ));
    })?;
    go(here, &before, &now);
    go(here + 1, &now, &Inside::NOTHING);
    Ok(())
}
