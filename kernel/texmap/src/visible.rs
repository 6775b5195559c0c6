//! Hidden surfaces: which face is seen at each pixel, as visible spans, column by column.
//!
//! Of a convex solid the faces that look at the viewer hide nothing of each other, and nothing here
//! is needed. Of any other the faces are asked twice. First each of them gives the pixels that it
//! covers to the columns' spans, where it keeps those at which it is nearer than what was there.
//! Then the mappers make their jobs, of the faces that are seen at all, and each job is cut to its
//! face's spans. So every pixel is written once, by the nearest face; no polygon is split, which
//! would make T-junctions, and no mapper knows of it.
//!
//! # Depth
//!
//! The ray t d through a pixel meets the plane n . p = s, s = n . V for a point V of it, at
//! 1 / t = (n . d) / s. Here n is the cross product of the face's three anchors, d a linear form of
//! the screen as in [`crate::plane`], and s above zero for a face that looks at the viewer. Which of
//! two faces is nearer is decided by (n . d) s' > (n' . d) s, exactly; of faces that are equally near
//! the one that came first stays. Nothing is rounded but the normal of a face that spans some 80
//! units or more: it is cut to 45 bits, once, and s is taken from the cut one.
//!
//! A face that is seen exactly edge-on, or turned over by the rounding to the screen's grid (s <= 0),
//! counts as infinitely far away: it shows where nothing else is.
//!
//! # Why halving finds where one face comes to lie before another
//!
//! Down a column both sides of the comparison are linear, so it changes at most once: equal ends
//! mean that all between are the same.
//!
//! # Ranges
//!
//! Anchors are within [`MAX_POSITION`](crate::plane::MAX_POSITION), 2^24, and the focal length is at
//! most 2^9 pixels here. With n cut to 45 bits n . d is below 2^45 (320 + 240 + 2^10) < 2^56 and s
//! below 3 2^45 2^24 < 2^71, and a product of the two fits 127 bits.
//!
//! # Room
//!
//! Spans of a column are disjoint and none is empty, so there are at most as many as pixels: the
//! arena can't be full.

use crate::coverage::{Axis, Dropped, Run, spans};
use crate::job::Job;
use crate::mapper::Face;
use crate::plane::{Form, on_screen};
use modex::{HEIGHT, WIDTH};

/// Bits of a normal's coordinates.
const NORMAL_BITS: u32 = 45;
/// Largest focal length for which the comparison's products fit.
const MAX_FOCAL_LENGTH: i32 = 1 << 9;

/// How near the plane of a face is, at every pixel.
#[derive(Clone, Copy, Debug)]
struct Nearness {
    /// Over `span`: what 1 / z is, but for a factor that all faces share.
    form: Form,
    /// Above zero.
    over: i128,
}

impl Nearness {
    /// Infinitely far away; all zeros, but for what it is divided by.
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
        // Differences are below 2^25, their products below 2^50.
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

    /// Whether it is nearer than `other` at pixel (x, y).
    fn beats(&self, other: &Self, x: u16, y: u16) -> bool {
        let at = |nearness: &Self| i128::from(nearness.form.at(x, y));
        at(self) * other.over > at(other) * self.over
    }
}

/// Pixels `top..end` of a column, at which `face` is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Span {
    top: u8,
    end: u8,
    face: u16,
}

const _: () = assert!(HEIGHT <= u8::MAX as usize);

/// The spans of one column, downward; neighbours of one face are one span.
#[derive(Clone, Copy, Debug)]
struct Spans {
    spans: [Span; HEIGHT],
    len: u8,
}

impl Spans {
    const EMPTY: Self = Self {
        spans: [Span {
            top: 0,
            end: 0,
            face: 0,
        }; HEIGHT],
        len: 0,
    };

    fn all(&self) -> &[Span] {
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
        self.spans[usize::from(self.len)] = Span { top, end, face };
        self.len += 1;
    }
}

/// The faces of one picture, at most `FACES`, and where each of them is seen.
#[derive(Clone, Copy, Debug)]
pub struct Visible<const FACES: usize> {
    columns: [Spans; WIDTH],
    /// Columns that are being changed are copied from here.
    before: Spans,
    faces: [Nearness; FACES],
    /// Of each face, whether it has a span.
    seen: [bool; FACES],
}

impl<const FACES: usize> Visible<FACES> {
    /// Without any face. All of it is zeros: a static of it takes no room in an image.
    pub const fn new() -> Self {
        Self {
            columns: [Spans::EMPTY; WIDTH],
            before: Spans::EMPTY,
            faces: [Nearness::NONE; FACES],
            seen: [false; FACES],
        }
    }

    /// Takes all faces away.
    pub fn clear(&mut self) {
        for column in &mut self.columns {
            column.len = 0;
        }
    }

    /// Adds a face that looks at the viewer, by a number below `FACES` that no other has.
    ///
    /// # Errors
    /// A polygon outside the legal range; nothing of it was added.
    ///
    /// # Panics
    /// If the number is not below `FACES`.
    pub fn add(&mut self, number: u16, face: &Face<'_>) -> Result<(), Dropped> {
        self.faces[usize::from(number)] = Nearness::new(face);
        spans(Axis::Down, face.polygon, |run| self.lay(number, &run))
    }

    /// Lays a run of a face over its column.
    fn lay(&mut self, number: u16, run: &Run<()>) {
        let Self {
            columns,
            before,
            faces,
            ..
        } = self;
        let x = run.line;
        let column = &mut columns[usize::from(x)];
        let (mut from, end) = (run.first, run.first + run.len);
        // Nothing is there yet, or all of it above: nothing has to be made room for.
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
        for span in before.all() {
            let (top, bottom) = (u16::from(span.top), u16::from(span.end));
            // What the run has above this span.
            column.push(number, from, end.min(top));
            from = from.max(end.min(top));
            let (first, last) = (top.max(from), bottom.min(end));
            if first >= last {
                column.push(span.face, top, bottom);
                continue;
            }
            column.push(span.face, top, first);
            let beats = |y| own.beats(&faces[usize::from(span.face)], x, y);
            let (above, below) = (beats(first), beats(last - 1));
            let face = |won| if won { number } else { span.face };
            // The first pixel of which the other is said.
            let turn = match above == below {
                true => last,
                false => halve(first, last, |y| beats(y) == above),
            };
            column.push(face(above), first, turn);
            column.push(face(below), turn, last);
            column.push(span.face, last, bottom);
            from = last;
        }
        column.push(number, from, end);
    }

    /// Finds out which faces are seen, when all were added.
    pub fn finish(&mut self) {
        self.seen = [false; FACES];
        for span in self.columns.iter().flat_map(Spans::all) {
            self.seen[usize::from(span.face)] = true;
        }
    }

    /// Whether a face is seen at any pixel; asked after [`Visible::finish`].
    pub fn sees(&self, number: u16) -> bool {
        self.seen[usize::from(number)]
    }

    /// The face that is seen at pixel (x, y), if there is one.
    pub fn at(&self, x: u16, y: u16) -> Option<u16> {
        let spans = self.columns[usize::from(x)].all();
        let after = spans.partition_point(|span| u16::from(span.end) <= y);
        let span = spans.get(after)?;
        (u16::from(span.top) <= y).then_some(span.face)
    }

    /// Gives `sink` the parts of a face's job at which the face is seen, in the job's order.
    pub fn cut(&self, number: u16, job: &Job, mut sink: impl FnMut(Job)) {
        if job.is_column() {
            let (top, end) = (job.y, job.y + job.len);
            for span in self.columns[usize::from(job.x)].all() {
                let from = top.max(span.top.into());
                let to = end.min(span.end.into());
                if span.face == number && from < to {
                    sink(job.part(from - top, to - from));
                }
            }
            return;
        }
        let mut pixel = 0;
        let seen = |i| {
            let (x, y) = job.place(i);
            self.at(x, y) == Some(number)
        };
        while pixel < job.len {
            let first = pixel;
            let is_seen = seen(first);
            while pixel < job.len && seen(pixel) == is_seen {
                pixel += 1;
            }
            if is_seen {
                sink(job.part(first, pixel - first));
            }
        }
    }
}

impl<const FACES: usize> Default for Visible<FACES> {
    fn default() -> Self {
        Self::new()
    }
}

/// The first of `first + 1..=last` for which `holds` no longer does, as it does for `first`.
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
