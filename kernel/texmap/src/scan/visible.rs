//! Hidden surfaces: the visible face at each pixel, as visible spans, column by column.
//!
//! The faces of a convex solid that look at the viewer hide no part of each other, so such a solid needs
//! nothing from this module. For any other solid, the faces are visited twice. First each face is laid over
//! the columns: it keeps the pixels of its coverage where it is nearer than the face that was there. Then the
//! mappers make the jobs of the visible faces, and each job is cut to its face's spans. So every pixel is
//! written once, by the nearest face. No polygon is split, which would make T-junctions, and no mapper knows
//! about it.
//!
//! # Depth
//!
//! The ray t d through a pixel meets the plane n . p = s, where s = n . V for a point V of the plane, at
//! 1 / t = (n . d) / s. Here n is the cross product of two edges between the face's three anchors, and n . d
//! is a linear form of the screen as in [`crate::plane`]. s is above zero for a face that looks at the
//! viewer. A face with n and s is nearer than a face with n' and s' when (n . d) s' > (n' . d) s, which is
//! decided exactly. Of equally near faces, the first stays. Only the normal of a face that spans some 80
//! units or more is rounded: it is reduced to 45 bits, once, and s is computed from the reduced normal.
//!
//! A face that is seen exactly edge-on, or that rounding to the screen's grid has turned over (s <= 0),
//! counts as infinitely far away: it shows only where no other face is.
//!
//! # Why bisection finds the change between two faces
//!
//! Down a column both sides of the comparison are linear, so its result changes at most once. If the result
//! is equal at two pixels, it is equal at all pixels between.
//!
//! # Ranges
//!
//! Anchors are within [`MAX_POSITION`](crate::plane::MAX_POSITION), 2^24, and the focal length is at most 2^9
//! pixels here. With n reduced to 45 bits, n . d is below 2^45 (320 + 240 + 2^10) < 2^56 and s is below
//! 3 2^45 2^24 < 2^71, so a product of the two fits 127 bits.
//!
//! # Capacity
//!
//! The spans of a column are disjoint and not empty, so a column has at most as many spans as pixels: the
//! arena cannot overflow.

use super::spans::{Span, spans};
use crate::geometry::{Axis, Dropped};
use crate::plane::{Face, Form, on_screen};
use modex::{HEIGHT, WIDTH};

/// Bits of a normal's coordinates.
const NORMAL_BITS: u32 = 45;
/// Largest focal length for which the comparison's products fit.
const MAX_FOCAL_LENGTH: i32 = 1 << 9;

/// The inverse depth of a face's plane, at every pixel.
#[derive(Clone, Copy, Debug)]
struct InverseDepth {
    /// Numerator n . d: `form` / `over` is 1 / z up to a factor that all faces share.
    form: Form,
    /// Denominator s; above zero.
    over: i128,
}

impl InverseDepth {
    /// Infinitely far away, except that `over` is zero and has to be set. All zeros, so that a static of them
    /// occupies no space in an image.
    const NONE: Self = Self {
        form: Form {
            origin: 0,
            right: 0,
            down: 0,
        },
        over: 0,
    };

    fn new(face: &Face<'_>) -> Self {
        debug_assert!((1..=MAX_FOCAL_LENGTH).contains(&face.focal_length));
        let [v0, v1, v2] = face.anchors.map(|anchor| anchor.position.map(i64::from));
        // Differences are below 2^25, and their products below 2^50.
        let [a, b] = [v1, v2].map(|v| [0, 1, 2].map(|k| v[k] - v0[k]));
        let normal = [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ];
        let largest = normal.map(i64::unsigned_abs).into_iter().max().unwrap_or(0);
        let excess = (64 - largest.leading_zeros()).saturating_sub(NORMAL_BITS);
        let normal = normal.map(|k| i128::from(k >> excess));
        let over: i128 = (0..3).map(|k| normal[k] * i128::from(v0[k])).sum();
        if over <= 0 {
            return Self {
                over: 1,
                ..Self::NONE
            };
        }
        let [origin, right, down] = on_screen(normal, face.focal_length).map(|k| k as i64);
        let form = Form {
            origin,
            right,
            down,
        };
        Self { form, over }
    }

    /// Returns whether this face is nearer than `other` at pixel (x, y).
    fn beats(&self, other: &Self, x: u16, y: u16) -> bool {
        let at = |depth: &Self| i128::from(depth.form.at(x, y));
        at(self) * other.over > at(other) * self.over
    }
}

/// A visible span: pixels `top..end` of a column, where `face` is visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct VisibleSpan {
    top: u8,
    end: u8,
    face: u16,
}

const _: () = assert!(HEIGHT <= u8::MAX as usize);

/// The visible spans of one column, downward. Adjacent spans of one face are merged.
#[derive(Clone, Copy, Debug)]
struct ColumnSpans {
    spans: [VisibleSpan; HEIGHT],
    len: u8,
}

impl ColumnSpans {
    const EMPTY: Self = Self {
        spans: [VisibleSpan {
            top: 0,
            end: 0,
            face: 0,
        }; HEIGHT],
        len: 0,
    };

    fn all(&self) -> &[VisibleSpan] {
        &self.spans[..self.len.into()]
    }

    fn push(&mut self, face: u16, top: u16, end: u16) {
        if top >= end {
            return;
        }
        let (top, end) = (top as u8, end as u8);
        if let Some(last) = self.spans[..self.len.into()].last_mut()
            && (last.face, last.end) == (face, top)
        {
            last.end = end;
            return;
        }
        self.spans[usize::from(self.len)] = VisibleSpan { top, end, face };
        self.len += 1;
    }
}

/// The faces of one frame, at most `FACES`, and the pixels where each of them is visible.
#[derive(Clone, Copy, Debug)]
pub struct Visible<const FACES: usize> {
    columns: [ColumnSpans; WIDTH],
    /// A copy of the column that is being changed.
    before: ColumnSpans,
    faces: [InverseDepth; FACES],
    /// Whether each face has a span.
    seen: [bool; FACES],
}

impl<const FACES: usize> Visible<FACES> {
    /// Returns a value without faces. It is all zeros, so a static occupies no space in an image.
    pub const fn new() -> Self {
        Self {
            columns: [ColumnSpans::EMPTY; WIDTH],
            before: ColumnSpans::EMPTY,
            faces: [InverseDepth::NONE; FACES],
            seen: [false; FACES],
        }
    }

    /// Removes all faces.
    pub fn clear(&mut self) {
        for column in &mut self.columns {
            column.len = 0;
        }
    }

    /// Adds a face that looks at the viewer. `number` must be below `FACES` and different for each face.
    ///
    /// # Errors
    /// If the polygon is outside the legal range; then no part of it was added.
    ///
    /// # Panics
    /// If the number is not below `FACES`.
    pub fn add(&mut self, number: u16, face: &Face<'_>) -> Result<(), Dropped> {
        self.faces[usize::from(number)] = InverseDepth::new(face);
        spans(Axis::Down, face.polygon, |span| self.lay(number, &span))
    }

    /// Lays a span of a face over its column.
    fn lay(&mut self, number: u16, span: &Span<()>) {
        let Self {
            columns,
            before,
            faces,
            ..
        } = self;
        let x = span.line;
        let column = &mut columns[usize::from(x)];
        let (mut from, end) = (span.first, span.first + span.len);
        // The column is empty, or all its spans are above: append.
        if column
            .all()
            .last()
            .is_none_or(|last| u16::from(last.end) <= from)
        {
            return column.push(number, from, end);
        }
        before.len = column.len;
        before.spans[..column.len.into()].copy_from_slice(column.all());
        column.len = 0;
        let own = &faces[usize::from(number)];
        for old in before.all() {
            let (top, bottom) = (u16::from(old.top), u16::from(old.end));
            // The part of the new span above the old span.
            column.push(number, from, end.min(top));
            from = from.max(end.min(top));
            let (first, last) = (top.max(from), bottom.min(end));
            if first >= last {
                column.push(old.face, top, bottom);
                continue;
            }
            column.push(old.face, top, first);
            let beats = |y| own.beats(&faces[usize::from(old.face)], x, y);
            let (above, below) = (beats(first), beats(last - 1));
            let face = |won| if won { number } else { old.face };
            // The first pixel where the comparison has the other result.
            let turn = match above == below {
                true => last,
                false => halve(first, last, |y| beats(y) == above),
            };
            column.push(face(above), first, turn);
            column.push(face(below), turn, last);
            column.push(old.face, last, bottom);
            from = last;
        }
        column.push(number, from, end);
    }

    /// Determines which faces are visible. Call it after the last face was added.
    pub fn finish(&mut self) {
        self.seen = [false; FACES];
        for span in self.columns.iter().flat_map(ColumnSpans::all) {
            self.seen[usize::from(span.face)] = true;
        }
    }

    /// Returns whether a face is visible at any pixel. Call it after [`Visible::finish`].
    pub fn sees(&self, number: u16) -> bool {
        self.seen[usize::from(number)]
    }

    /// Returns the face that is visible at pixel (x, y), if any.
    pub fn at(&self, x: u16, y: u16) -> Option<u16> {
        let spans = self.columns[usize::from(x)].all();
        let after = spans.partition_point(|span| u16::from(span.end) <= y);
        let span = spans.get(after)?;
        (u16::from(span.top) <= y).then_some(span.face)
    }

    /// Returns the parts `top..end` of column `x` where a face is visible, downward.
    pub(crate) fn in_column(&self, number: u16, x: u16) -> impl Iterator<Item = (u16, u16)> {
        let spans = self.columns[usize::from(x)].all().iter();
        spans
            .filter(move |span| span.face == number)
            .map(|span| (span.top.into(), span.end.into()))
    }
}

impl<const FACES: usize> Default for Visible<FACES> {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns the first number in `first + 1..=last` for which `holds` is false, given that it is true for
/// `first`. `last` counts as false and is not tested.
fn halve(first: u16, last: u16, holds: impl Fn(u16) -> bool) -> u16 {
    let (mut yes, mut no) = (first, last);
    while no - yes > 1 {
        let middle = yes + (no - yes) / 2;
        if holds(middle) {
            yes = middle;
        } else {
            no = middle;
        }
    }
    no
}
