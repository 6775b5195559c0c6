//! Which pixels of a polygon lie in each column, or in each row, of the screen.
//!
//! # The rule
//!
//! A pixel is inside when an odd number of edges have `ymin <= yc < ymax` and cross `yc` at
//! `x <= xc`, where (xc, yc) is its centre: half-open and even-odd, decided in exact integers.
//! That rule speaks of rows, and [`rows`] takes it as it stands: the first pixel right of an
//! edge is the first with `xc >= x(yc)`, and the pixels between an odd crossing and the next
//! even one are inside.
//!
//! [`columns`] needs it in other words. It says: move the centre right by an infinitesimal e,
//! and down by a d that is infinitesimal even beside e; then nothing is ever exactly on an edge,
//! and the plain even-odd test decides. (Moving right turns `x <= xc` into `x < xc + e`; moving
//! down turns the half-open interval into an open one; and since d is so small beside e, the
//! slope of the edge does not disturb the first.)
//!
//! Said that way it can be asked down a column. The column at xc + e meets the edges with
//! `xmin <= xc < xmax`, vertical ones never, and meets each at y(xc) + e dy/dx. A centre
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
//! Both scans walk *lines* (columns or rows), each a row of *cells* (its pixels), and differ in
//! nothing but which coordinate is which, and the tie. Below, p counts across the lines and q
//! along them: columns have (p, q) = (x, y), rows (y, x).
//!
//! With pa < pb the first cell past an edge is a floor of `N / (256 dp)`, N an integer that
//! grows by `256 dq` from line to line: quotient and remainder are stepped, so there is no
//! rounding to accumulate. |N| < 2^49 within [`MAX_COORDINATE`], in either scan.

use crate::along::Along;
use crate::{MAX_COORDINATE, MAX_SIDES, Point};
use modex::{HEIGHT, WIDTH};

/// Why a polygon is not drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropped {
    /// More than [`MAX_SIDES`] vertices.
    TooManySides,
    /// A vertex further out than [`MAX_COORDINATE`], or texture coordinates outside the texture.
    OutOfRange,
}

/// Most runs in a line: a side begins or ends one.
pub(crate) const MAX_RUNS: usize = MAX_SIDES / 2;

/// Which way a run of pixels goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Down a column.
    Down,
    /// To the right along a row.
    Right,
}

/// Inside pixels without a gap, in one line: a column from [`columns`], a row from [`rows`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// The column's x, or the row's y.
    pub line: u16,
    /// The first pixel: its y in a column, its x in a row.
    pub first: u16,
    /// Pixels, at least 1; all of them are on the screen.
    pub len: u16,
    /// Where the line enters the polygon and where it leaves it. Either may be off the screen.
    pub between: [Crossing; 2],
}

/// Where a side of the polygon meets the middle of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crossing {
    /// The side from vertex `side` to the next one.
    pub side: usize,
    /// y in a column, x in a row, in pixels with 32 fraction bits; off by less than 2^-23. It
    /// decides no pixel: it is there to interpolate between the two ends of a run.
    pub at: i64,
}

/// What makes a scan one by columns or by rows.
struct Lines {
    /// Lines on the screen, and pixels in each.
    count: i32,
    cells: i64,
    /// (p, q) of a point.
    place: fn(Point) -> (i32, i32),
    /// Whether a centre on the crossing is past the edge, by the edge's dq where dp > 0.
    tie: fn(i64) -> bool,
}

const COLUMNS: Lines = Lines {
    count: WIDTH as i32,
    cells: HEIGHT as i64,
    place: |point| (point.x, point.y),
    tie: |dy| dy <= 0,
};

const ROWS: Lines = Lines {
    count: HEIGHT as i32,
    cells: WIDTH as i64,
    place: |point| (point.y, point.x),
    tie: |_| true,
};

/// An edge that crosses at least one line of the screen.
#[derive(Clone, Copy, Default)]
struct Edge {
    side: usize,
    /// Lines `first..end`.
    first: i32,
    end: i32,
    /// The first cell past the edge in the current line, and what of N is left over.
    cell: i64,
    left_over: i64,
    cell_step: i64,
    left_over_step: i64,
    divisor: i64,
    along: Along,
}

impl Edge {
    /// The edge from `a` to `b` in either order, or nothing if no line of the screen meets it.
    fn new(side: usize, a: (i32, i32), b: (i32, i32), lines: &Lines) -> Option<Self> {
        // Always forward: neighbours walk a shared edge with the same bits.
        let (a, b) = if a.0 <= b.0 { (a, b) } else { (b, a) };
        let (first, end) = crossed(a.0, b.0, lines.count)?;
        let dp = i64::from(b.0) - i64::from(a.0);
        let dq = i64::from(b.1) - i64::from(a.1);
        let p = offset(first, a.0);
        let divisor = 256 * dp;
        let tie = if (lines.tie)(dq) {
            divisor - 1
        } else {
            divisor
        };
        let n = (i64::from(a.1) - 128) * dp + p * dq + tie;
        Some(Self {
            side,
            first,
            end,
            cell: n.div_euclid(divisor),
            left_over: n.rem_euclid(divisor),
            cell_step: dq.div_euclid(dp),
            left_over_step: 256 * dq.rem_euclid(dp),
            divisor,
            along: Along::new(a.1, dq, dp, first, p, 24),
        })
    }

    fn advance(&mut self) {
        self.cell += self.cell_step;
        self.left_over += self.left_over_step;
        if self.left_over >= self.divisor {
            self.left_over -= self.divisor;
            self.cell += 1;
        }
    }
}

/// The lines `first..end` of the screen's `count` that an edge from `a` to `b`, `a <= b`,
/// crosses, if there are any: line l has its centre at 256 l + 128, and a <= centre < b.
pub(crate) fn crossed(a: i32, b: i32, count: i32) -> Option<(i32, i32)> {
    let first = ((a + 127) >> 8).max(0);
    let end = ((b + 127) >> 8).min(count);
    (first < end).then_some((first, end))
}

/// How far the centre of `line` is from `a`.
pub(crate) fn offset(line: i32, a: i32) -> i64 {
    i64::from(line) * 256 + 128 - i64::from(a)
}

/// Gives `sink` every run of inside pixels in every column of the screen, from left to right
/// and in each column downward.
///
/// # Errors
/// A polygon outside the legal range; nothing of it was given to `sink`.
pub fn columns(polygon: &[impl Copy + Into<Point>], sink: impl FnMut(Run)) -> Result<(), Dropped> {
    scan(polygon, &COLUMNS, sink)
}

/// Gives `sink` every run of inside pixels in every row of the screen, downward and in each row
/// from left to right. The pixels are the same as those of [`columns`].
///
/// # Errors
/// A polygon outside the legal range; nothing of it was given to `sink`.
pub fn rows(polygon: &[impl Copy + Into<Point>], sink: impl FnMut(Run)) -> Result<(), Dropped> {
    scan(polygon, &ROWS, sink)
}

/// [`columns`] or [`rows`].
///
/// # Errors
/// As they have.
pub fn runs(
    axis: Axis,
    polygon: &[impl Copy + Into<Point>],
    sink: impl FnMut(Run),
) -> Result<(), Dropped> {
    match axis {
        Axis::Down => columns(polygon, sink),
        Axis::Right => rows(polygon, sink),
    }
}

#[inline]
fn scan(
    polygon: &[impl Copy + Into<Point>],
    lines: &Lines,
    mut sink: impl FnMut(Run),
) -> Result<(), Dropped> {
    check(polygon)?;
    let mut edges = [Edge::default(); MAX_SIDES];
    let mut count = 0;
    let (mut first, mut end) = (lines.count, 0);
    for (side, &a) in polygon.iter().enumerate() {
        let b = polygon[(side + 1) % polygon.len()];
        let (a, b) = ((lines.place)(a.into()), (lines.place)(b.into()));
        if let Some(edge) = Edge::new(side, a, b, lines) {
            first = first.min(edge.first);
            end = end.max(edge.end);
            edges[count] = edge;
            count += 1;
        }
    }
    let edges = &mut edges[..count];
    for line in first..end {
        let mut crossings = [(0, Crossing::default()); MAX_SIDES];
        let mut count = 0;
        for edge in edges.iter_mut() {
            if edge.first <= line && line < edge.end {
                let crossing = Crossing {
                    side: edge.side,
                    at: edge.along.at(line),
                };
                crossings[count] = (edge.cell, crossing);
                count += 1;
                edge.advance();
            }
        }
        let crossings = &mut crossings[..count];
        crossings.sort_unstable_by_key(|&(cell, crossing)| (cell, crossing.at));
        for pair in crossings.chunks_exact(2) {
            let [first, end] = [pair[0].0, pair[1].0].map(|cell| cell.clamp(0, lines.cells));
            if first < end {
                sink(Run {
                    line: line as u16,
                    first: first as u16,
                    len: (end - first) as u16,
                    between: [pair[0].1, pair[1].1],
                });
            }
        }
    }
    Ok(())
}

/// Whether the scan's arithmetic holds for `polygon`.
pub(crate) fn check(polygon: &[impl Copy + Into<Point>]) -> Result<(), Dropped> {
    if polygon.len() > MAX_SIDES {
        return Err(Dropped::TooManySides);
    }
    let range = -MAX_COORDINATE..=MAX_COORDINATE;
    let mut points = polygon.iter().map(|&vertex| vertex.into());
    if points.all(|Point { x, y }| range.contains(&x) && range.contains(&y)) {
        Ok(())
    } else {
        Err(Dropped::OutOfRange)
    }
}
