//! The affine column mapper: texture coordinates stepped down the column in 16.16.
//!
//! [`columns`] makes the jobs of a polygon: the coordinates are interpolated along its sides to
//! the column's centre, then along the column. [`column`] draws one.
//!
//! Legal input of the mapper: a job as [`columns`] makes it (its ends inside the texture). Error
//! against the exact affine coordinates: the step is cut to 2^-16 texel towards zero, so after n
//! pixels the coordinate is off by less than n 2^-16 texel, at most 0.0037 over 240.

use modex::{Column, WIDTH};

use crate::along::Along;
use crate::coverage::{self, Dropped, Run};
use crate::{ColumnJob, MAX_SIDES, Texture, Vertex};

/// The texture coordinates along a side of the polygon.
#[derive(Clone, Copy, Default)]
struct Side {
    u: Along,
    v: Along,
}

impl Side {
    /// The side from `a` to `b` in either order; of one that crosses no column nobody asks.
    fn new(a: &Vertex, b: &Vertex) -> Self {
        // Always from left to right: neighbours walk a shared edge with the same bits.
        let (a, b) = if a.x <= b.x { (a, b) } else { (b, a) };
        let Some((first, _)) = coverage::crossed(a.x, b.x, WIDTH as i32) else {
            return Self::default();
        };
        let dx = i64::from(b.x) - i64::from(a.x);
        let along = |a: i32, b: i32, x: i64| Along::new(a, i64::from(b - a), dx, first, x, 16);
        let x = coverage::offset(first, a.x);
        Self {
            u: along(a.u, b.u, x),
            v: along(a.v, b.v, x),
        }
    }
}

/// Gives `sink` a job for every run of inside pixels in every column of the screen, from left
/// to right and in each column downward.
///
/// # Errors
/// A polygon outside the legal range; nothing of it was given to `sink`.
pub fn columns(
    polygon: &[Vertex],
    texture: &Texture<'_>,
    texture_index: u16,
    mut sink: impl FnMut(ColumnJob),
) -> Result<(), Dropped> {
    coverage::check(polygon)?;
    let (width, height) = (texture.width(), texture.height());
    let inside = |vertex: &Vertex| {
        (0..=i32::from(width) << 16).contains(&vertex.u)
            && (0..=i32::from(height) << 16).contains(&vertex.v)
    };
    if !polygon.iter().all(inside) {
        return Err(Dropped::OutOfRange);
    }
    let mut sides = [Side::default(); MAX_SIDES];
    for (i, a) in polygon.iter().enumerate() {
        sides[i] = Side::new(a, &polygon[(i + 1) % polygon.len()]);
    }
    coverage::columns(polygon, |run| {
        let mut job = job(&run, &sides, texture);
        job.texture = texture_index;
        sink(job);
    })
}

/// The job for a run, its texture still open.
///
/// The coordinates at the first and the last pixel's centre are interpolated between the two
/// crossings, then clamped into the texture; the step between them is cut towards zero.
fn job(run: &Run, sides: &[Side; MAX_SIDES], texture: &Texture<'_>) -> ColumnJob {
    let (last_u, last_v) = texture.last();
    let [top, bottom] = run.between;
    // 24 fraction bits of height keep 2^-8 texel even where a whole texture is squeezed into
    // 1/256 pixel. A height below 2^9 pixels then has at most 33 bits and its product with a
    // difference of coordinates (28 bits with 20 of fraction) fits; taller ones are scaled down.
    let mut height = (bottom.at - top.at) >> 8;
    let offset = |row: i64| (((row << 32) + (1 << 31)) - top.at) >> 8;
    let (first, len) = (i64::from(run.first), i64::from(run.len));
    let (mut start, mut stop) = (offset(first), offset(first + len - 1));
    let excess = (64 - height.max(1).leading_zeros()).saturating_sub(34);
    for length in [&mut height, &mut start, &mut stop] {
        *length >>= excess;
    }
    let at = |along: fn(&Side) -> &Along, offset: i64, last: i32| {
        let [from, to] =
            [top, bottom].map(|end| along(&sides[end.side]).at(i32::from(run.line)) >> 12);
        let part = if height > 0 {
            (to - from) * offset.clamp(0, height) / height
        } else {
            0
        };
        (((from + part) >> 4) as i32).clamp(0, last)
    };
    let (u, v) = (at(|s| &s.u, start, last_u), at(|s| &s.v, start, last_v));
    let (mut du, mut dv) = (0, 0);
    // A column of one pixel has no step; dividing by len - 1 all the same was the seeds' trap.
    if run.len > 1 {
        let steps = i32::from(run.len) - 1;
        du = (at(|s| &s.u, stop, last_u) - u) / steps;
        dv = (at(|s| &s.v, stop, last_v) - v) / steps;
    }
    ColumnJob {
        x: run.line,
        y: run.first,
        len: run.len,
        texture: 0,
        u,
        v,
        du,
        dv,
    }
}

/// Draws one column of `job` from `texture`.
#[inline]
pub fn column(texture: &Texture<'_>, job: &ColumnJob, column: Column<'_>) {
    let texels = texture.texels();
    let width = usize::from(texture.width());
    let (mut u, mut v) = (job.u, job.v);
    column.fill(|| {
        let texel = texels[(v >> 16) as usize * width + (u >> 16) as usize];
        // The last addition steps past the column; |u| and |du| are below 2^25, so it fits.
        u += job.du;
        v += job.dv;
        texel
    });
}
