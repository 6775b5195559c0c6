//! Which pixels of a polygon lie in each screen column, and their texture coordinates.
//!
//! # The rule
//!
//! A pixel is inside when an odd number of edges have `ymin <= yc < ymax` and cross `yc` at
//! `x <= xc`, where (xc, yc) is its centre: half-open and even-odd, decided in exact integers.
//! That rule speaks of rows. It says: move the centre right by an infinitesimal e, and down by
//! a d that is infinitesimal even beside e; then nothing is ever exactly on an edge, and the
//! plain even-odd test decides. (Moving right turns `x <= xc` into `x < xc + e`; moving down
//! turns the half-open interval into an open one; and since d is so small beside e, the slope
//! of the edge does not disturb the first.)
//!
//! Said that way it can be asked down a column instead. The column at xc + e meets the edges
//! with `xmin <= xc < xmax`, vertical ones never, and meets each at y(xc) + e dy/dx. A centre
//! at yc + d lies below that crossing when yc > y(xc), and when yc = y(xc) only if dy/dx <= 0:
//! for a rising edge (e times a positive slope) the crossing is further down than d. So the
//! first row below an edge is
//!
//! - the first with `yc >= y(xc)` if dy <= 0,
//! - the first with `yc > y(xc)` if dy > 0,
//!
//! and the rows between an odd crossing and the next even one are inside. Had each slanted edge
//! kept `>=`, columns would draw the transposed rule: other pixels than rows draw on ties, and
//! gaps where the two meet.
//!
//! # The arithmetic
//!
//! With xa < xb the first row below an edge is a floor of `N / (256 dx)`, N an integer that
//! grows by `256 dy` from column to column: quotient and remainder are stepped, so there is no
//! rounding to accumulate. |N| < 2^49 within [`MAX_COORDINATE`]. The crossing's exact height and
//! the edge's texture coordinates are stepped in 32 fraction bits; over 320 columns they are off
//! by less than 2^-23.

use crate::{ColumnJob, MAX_COORDINATE, MAX_SIDES, Texture, Vertex};
use modex::{HEIGHT, WIDTH};

/// Why a polygon is not drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropped {
    /// More than [`MAX_SIDES`] vertices.
    TooManySides,
    /// A vertex further out than [`MAX_COORDINATE`], or texture coordinates outside the texture.
    OutOfRange,
}

/// A quantity that is linear along an edge, at the centre of the current column.
#[derive(Clone, Copy, Default)]
struct Along {
    /// 32 fraction bits.
    value: i64,
    step: i64,
}

impl Along {
    /// From `a` at x = 0 to `a + delta` at x = dx, at `x`; one column is 256 x. `shift` more
    /// fraction bits make 32 of the input's. |a|, |delta|, dx and x are below 2^25.
    fn new(a: i32, delta: i64, dx: i64, x: i64, shift: u32) -> Self {
        Self {
            value: (i64::from(a) << shift) + ratio(delta * x, dx, shift),
            step: ratio(delta * 256, dx, shift),
        }
    }

    fn advance(&mut self) {
        self.value += self.step;
    }
}

/// floor(n 2^shift / d) without the product: n < 2^50, d < 2^25, shift <= 24.
fn ratio(n: i64, d: i64, shift: u32) -> i64 {
    (n.div_euclid(d) << shift) + (n.rem_euclid(d) << shift) / d
}

/// An edge that crosses at least one column of the screen.
#[derive(Clone, Copy, Default)]
struct Edge {
    /// Columns `first..end`.
    first: i32,
    end: i32,
    /// The first row below the edge in the current column, and what of N is left over.
    row: i64,
    left_over: i64,
    row_step: i64,
    left_over_step: i64,
    divisor: i64,
    y: Along,
    u: Along,
    v: Along,
}

impl Edge {
    /// The edge from `a` to `b` in either order, or nothing if no column of the screen meets it.
    fn new(a: &Vertex, b: &Vertex) -> Option<Self> {
        // Always from left to right: neighbours walk a shared edge with the same bits.
        let (a, b) = if a.x <= b.x { (a, b) } else { (b, a) };
        // Column c has its centre at 256 c + 128; these are the columns with xa <= xc < xb.
        let first = ((a.x + 127) >> 8).max(0);
        let end = ((b.x + 127) >> 8).min(WIDTH as i32);
        if first >= end {
            return None;
        }
        let dx = i64::from(b.x) - i64::from(a.x);
        let dy = i64::from(b.y) - i64::from(a.y);
        let x = i64::from(first) * 256 + 128 - i64::from(a.x);
        let divisor = 256 * dx;
        // A row's centre on the crossing is below it only if the edge does not fall.
        let tie = if dy <= 0 { divisor - 1 } else { divisor };
        let n = (i64::from(a.y) - 128) * dx + x * dy + tie;
        Some(Self {
            first,
            end,
            row: n.div_euclid(divisor),
            left_over: n.rem_euclid(divisor),
            row_step: dy.div_euclid(dx),
            left_over_step: 256 * dy.rem_euclid(dx),
            divisor,
            y: Along::new(a.y, dy, dx, x, 24),
            u: Along::new(a.u, i64::from(b.u - a.u), dx, x, 16),
            v: Along::new(a.v, i64::from(b.v - a.v), dx, x, 16),
        })
    }

    fn advance(&mut self) {
        self.row += self.row_step;
        self.left_over += self.left_over_step;
        if self.left_over >= self.divisor {
            self.left_over -= self.divisor;
            self.row += 1;
        }
        self.y.advance();
        self.u.advance();
        self.v.advance();
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
    check(polygon, texture)?;
    let mut edges = [Edge::default(); MAX_SIDES];
    let mut count = 0;
    let (mut first, mut end) = (WIDTH as i32, 0);
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        if let Some(edge) = Edge::new(a, b) {
            first = first.min(edge.first);
            end = end.max(edge.end);
            edges[count] = edge;
            count += 1;
        }
    }
    let edges = &mut edges[..count];
    for column in first..end {
        let mut crossings = [0usize; MAX_SIDES];
        let mut crossed = 0;
        for (i, edge) in edges.iter().enumerate() {
            if edge.first <= column && column < edge.end {
                crossings[crossed] = i;
                crossed += 1;
            }
        }
        let crossings = &mut crossings[..crossed];
        crossings.sort_unstable_by_key(|&i| (edges[i].row, edges[i].y.value));
        for pair in crossings.chunks_exact(2) {
            let (top, bottom) = (&edges[pair[0]], &edges[pair[1]]);
            let rows = top.row.clamp(0, HEIGHT as i64)..bottom.row.clamp(0, HEIGHT as i64);
            if !rows.is_empty() {
                let mut job = run(top, bottom, rows, texture);
                job.x = column as u16;
                job.texture = texture_index;
                sink(job);
            }
        }
        for &i in crossings.iter() {
            edges[i].advance();
        }
    }
    Ok(())
}

fn check(polygon: &[Vertex], texture: &Texture<'_>) -> Result<(), Dropped> {
    if polygon.len() > MAX_SIDES {
        return Err(Dropped::TooManySides);
    }
    let screen = -MAX_COORDINATE..=MAX_COORDINATE;
    let (width, height) = (texture.width(), texture.height());
    let inside = polygon.iter().all(|vertex| {
        screen.contains(&vertex.x)
            && screen.contains(&vertex.y)
            && (0..=i32::from(width) << 16).contains(&vertex.u)
            && (0..=i32::from(height) << 16).contains(&vertex.v)
    });
    if inside {
        Ok(())
    } else {
        Err(Dropped::OutOfRange)
    }
}

/// The job for the rows between two edges in one column, its place across still open.
///
/// The coordinates at the first and the last pixel's centre are interpolated between the two
/// crossings, then clamped into the texture; the step between them is cut towards zero.
fn run(top: &Edge, bottom: &Edge, rows: core::ops::Range<i64>, texture: &Texture<'_>) -> ColumnJob {
    let (last_u, last_v) = texture.last();
    // 24 fraction bits of height keep 2^-8 texel even where a whole texture is squeezed into
    // 1/256 pixel. A height below 2^9 pixels then has at most 33 bits and its product with a
    // difference of coordinates (28 bits with 20 of fraction) fits; taller ones are scaled down.
    let mut height = (bottom.y.value - top.y.value) >> 8;
    let offset = |row: i64| (((row << 32) + (1 << 31)) - top.y.value) >> 8;
    let (mut start, mut stop) = (offset(rows.start), offset(rows.end - 1));
    let excess = (64 - height.max(1).leading_zeros()).saturating_sub(34);
    for length in [&mut height, &mut start, &mut stop] {
        *length >>= excess;
    }
    let at = |along: fn(&Edge) -> i64, offset: i64, last: i32| {
        let (from, to) = (along(top) >> 12, along(bottom) >> 12);
        let part = if height > 0 {
            (to - from) * offset.clamp(0, height) / height
        } else {
            0
        };
        (((from + part) >> 4) as i32).clamp(0, last)
    };
    let (u, v) = (
        at(|e| e.u.value, start, last_u),
        at(|e| e.v.value, start, last_v),
    );
    let len = (rows.end - rows.start) as i32;
    let (mut du, mut dv) = (0, 0);
    // A column of one pixel has no step; dividing by len - 1 all the same was the seeds' trap.
    if len > 1 {
        du = (at(|e| e.u.value, stop, last_u) - u) / (len - 1);
        dv = (at(|e| e.v.value, stop, last_v) - v) / (len - 1);
    }
    ColumnJob {
        x: 0,
        y: rows.start as u16,
        len: len as u16,
        texture: 0,
        u,
        v,
        du,
        dv,
    }
}
