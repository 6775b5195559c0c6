//! Coverage: the pixels of a polygon in each column, or in each row, of the screen.
//!
//! # The rule
//!
//! A pixel with centre (xc, yc) is inside when an odd number of edges have `ymin <= yc < ymax` and
//! cross `yc` at `x <= xc`. The rule is half-open and even-odd, and is decided in exact integers.
//! It speaks of rows, so [`rows`] applies it as it stands: the first pixel to the right of an edge
//! is the first with `xc >= x(yc)`, and the pixels between an odd crossing and the next even
//! crossing are inside.
//!
//! [`columns`] needs the same rule in terms of columns. Restate the rule first: move the centre to
//! the right by an infinitesimal e, and down by a d that is infinitesimal even compared with e.
//! Then no edge ever passes exactly through a centre, and the plain even-odd test decides. (The
//! move to the right turns `x <= xc` into `x < xc + e`. The move down turns the half-open interval
//! into an open one. Because d is so small compared with e, the slope of the edge does not disturb
//! the first comparison.)
//!
//! In this form the test also works down a column. The column at xc + e meets exactly the edges
//! with `xmin <= xc < xmax`, so it never meets a vertical edge. It meets each of them at
//! y(xc) + e dy/dx. A centre at yc + d lies below that crossing when yc > y(xc). When yc = y(xc),
//! it does so only if dy/dx <= 0: if the slope is positive, the crossing lies e dy/dx further down,
//! which is more than d. So the first row below an edge is
//!
//! - the first with `yc >= y(xc)` if dy <= 0,
//! - the first with `yc > y(xc)` if dy > 0,
//!
//! and the rows between an odd crossing and the next even crossing are inside. If every edge used
//! `>=`, columns would draw the transposed rule: on ties they would draw other pixels than rows do,
//! and leave gaps where the two meet.
//!
//! # The arithmetic
//!
//! Both scans go through *lines* (columns or rows), each of which is a row of *cells* (its pixels).
//! They differ only in the roles of the coordinates and in the tie. Below, p counts across the
//! lines and q along them: (p, q) is (x, y) for columns and (y, x) for rows. For the edge from
//! (pa, qa) to (pb, qb) with pa < pb, dp = pb - pa and dq = qb - qa.
//!
//! The first cell past an edge is the floor of `N / (256 dp)`, where N is an integer that grows by
//! `256 dq` from line to line. The last 8 bits of N never change, so they are dropped: the cell is
//! the floor of v = n / dp, where n = floor(N / 256) grows by dq per line. The scan steps v with 36
//! fraction bits, and rounds the start and the step up. So the stepped value is above v by less
//! than 1 unit of 2^-36 for the start, and by less than 1 unit for each of at most 319 steps. v is
//! a multiple of 1 / dp, so it is below the next whole number by at least 1 / dp, which is at least
//! 2^12 of those units. The stepped value therefore always has the same floor as v. Within
//! [`MAX_COORDINATE`], |N| < 2^49 and dp <= 2^24, in either scan.
//!
//! Between two vertices that are neighbours in the order of the lines, every line crosses the same
//! edges, so the scan determines these edges once for the whole stretch. A convex polygon has two
//! of them, and the smaller cell comes first: no sort is needed.

use crate::along::Along;
use crate::{MAX_COORDINATE, MAX_SIDES, Point};
use modex::{HEIGHT, WIDTH};

/// The reason why a polygon is not drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropped {
    /// More than [`MAX_SIDES`] vertices.
    TooManySides,
    /// A vertex is further out than [`MAX_COORDINATE`], or its texture coordinates are outside the
    /// texture.
    OutOfRange,
}

/// Most spans in a line: a span needs two sides, one at each end.
pub(crate) const MAX_RUNS: usize = MAX_SIDES / 2;

/// The direction of a span of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Down a column.
    Down,
    /// To the right along a row.
    Right,
}

/// A span: consecutive inside pixels of one line. The line is a column from [`columns`] and a row
/// from [`rows`]. [`spans`] yields spans without crossings: `End` is `()` there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run<End = Crossing> {
    /// The column's x, or the row's y.
    pub line: u16,
    /// The first pixel: its y in a column, its x in a row.
    pub first: u16,
    /// The number of pixels, at least 1; all of them are on the screen.
    pub len: u16,
    /// The crossings where the line enters and leaves the polygon. Either may be off the screen.
    pub between: [End; 2],
}

/// A crossing of a polygon's side with the centre of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crossing {
    /// The side from vertex `side` to the next vertex.
    pub side: usize,
    /// The crossing's y in a column, or its x in a row: in pixels with 32 fraction bits, off by
    /// less than 2^-23. It decides no pixel; it serves to interpolate between the two ends of a
    /// span.
    pub at: i64,
}

/// What a scan reports about a side's crossing with a line: [`Crossing`], or nothing.
trait End: Copy + Default {
    /// The precomputed data of a side that yields its crossings.
    type Along: Copy + Default;

    /// Returns the data of a side that starts at q = `a`, rises by `dq` over `dp`, and has advanced
    /// by `p` at line `first`.
    fn along(a: i32, dq: i32, dp: i32, first: i32, p: i32) -> Self::Along;

    /// Returns the crossing of `side` with `line`.
    fn new(side: usize, along: &Self::Along, line: i32) -> Self;

    /// Whether crossings of the same cell may come in any order.
    const BY_CELL: bool;

    /// Returns the sort key among crossings of the same cell.
    fn at(&self) -> i64;
}

impl End for Crossing {
    type Along = Along;
    const BY_CELL: bool = false;

    fn along(a: i32, dq: i32, dp: i32, first: i32, p: i32) -> Along {
        Along::new(a, dq.into(), dp.into(), first, p.into(), 24)
    }

    fn new(side: usize, along: &Along, line: i32) -> Self {
        let at = along.at(line);
        Self { side, at }
    }

    fn at(&self) -> i64 {
        self.at
    }
}

/// For scans that need the pixels only.
impl End for () {
    type Along = ();
    const BY_CELL: bool = true;

    fn along(_: i32, _: i32, _: i32, _: i32, _: i32) {}

    fn new(_: usize, (): &(), _: i32) {}

    fn at(&self) -> i64 {
        0
    }
}

/// The differences between a scan by columns and a scan by rows.
struct Lines {
    /// Lines on the screen, and pixels in each line.
    count: i32,
    cells: i64,
    /// Returns (p, q) of a point.
    place: fn(Point) -> (i32, i32),
    /// Returns whether a centre exactly on the crossing is past the edge, from the edge's dq where
    /// dp > 0.
    tie: fn(i32) -> bool,
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

/// Fraction bits of a cell.
const FRACTION: u32 = 36;

/// An edge that crosses at least one line of the screen.
#[derive(Clone, Copy, Default)]
struct Edge<A> {
    side: usize,
    /// The lines `first..end` that the edge crosses.
    first: i32,
    end: i32,
    /// The first cell past the edge in the current line, with [`FRACTION`] bits. It is at most one
    /// step further out than the edge reaches: below 2^26 cells.
    cell: i64,
    step: i64,
    along: A,
}

impl<A: Copy> Edge<A> {
    /// Returns the edge between `a` and `b`, given in either order, or nothing if no line of the
    /// screen meets it.
    #[inline]
    fn new<E: End<Along = A>>(
        side: usize,
        a: (i32, i32),
        b: (i32, i32),
        lines: &Lines,
    ) -> Option<Self> {
        // Always forward, so that neighbours step along a shared edge with the same bits.
        let (a, b) = if a.0 <= b.0 { (a, b) } else { (b, a) };
        let (first, end) = crossed(a.0, b.0, lines.count)?;
        let (dp, dq) = (b.0 - a.0, b.1 - a.1);
        let p = offset(first, a.0);
        let tie = 256 * i64::from(dp) - i64::from((lines.tie)(dq));
        let n = i64::from(a.1 - 128) * i64::from(dp) + i64::from(p) * i64::from(dq) + tie;
        let (cell, left_over) = divided(n >> 8, dp);
        // |dq| <= 2^25 and left_over < dp <= 2^24.
        let up = |n: i32| -((-i64::from(n) << FRACTION).div_euclid(dp.into()));
        Some(Self {
            side,
            first,
            end,
            cell: (i64::from(cell) << FRACTION) + up(left_over),
            step: up(dq),
            along: E::along(a.1, dq, dp, first, p),
        })
    }
}

/// Returns the quotient, rounded down, and the remainder. The quotient must fit 32 bits. Near the
/// screen, which is nearly always, the numerator fits 32 bits as well, and a 32-bit division costs
/// a fraction of a 64-bit division.
#[inline]
fn divided(n: i64, d: i32) -> (i32, i32) {
    match i32::try_from(n) {
        Ok(n) => (n.div_euclid(d), n.rem_euclid(d)),
        Err(_) => {
            let d = i64::from(d);
            (n.div_euclid(d) as i32, n.rem_euclid(d) as i32)
        }
    }
}

/// Returns the lines `first..end` of the screen's `count` lines that an edge from `a` to `b`
/// crosses, with `a <= b`, or nothing if it crosses no line. The centre of line l is at 256 l +
/// 128, and the edge crosses it if a <= centre < b.
pub(crate) fn crossed(a: i32, b: i32, count: i32) -> Option<(i32, i32)> {
    let first = ((a + 127) >> 8).max(0);
    let end = ((b + 127) >> 8).min(count);
    (first < end).then_some((first, end))
}

/// Returns the distance from `a` to the centre of `line`.
pub(crate) fn offset(line: i32, a: i32) -> i32 {
    line * 256 + 128 - a
}

/// Passes every span of inside pixels in every column of the screen to `sink`: columns from left to
/// right, and downward in each column.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub fn columns(polygon: &[impl Copy + Into<Point>], sink: impl FnMut(Run)) -> Result<(), Dropped> {
    scan::<Crossing>(polygon, &COLUMNS, sink)
}

/// Passes every span of inside pixels in every row of the screen to `sink`: rows downward, and from
/// left to right in each row. The pixels are the same as those of [`columns`].
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub fn rows(polygon: &[impl Copy + Into<Point>], sink: impl FnMut(Run)) -> Result<(), Dropped> {
    scan::<Crossing>(polygon, &ROWS, sink)
}

/// Passes the spans of [`columns`] or [`rows`] to `sink`, by `axis`.
///
/// # Errors
/// As for [`columns`] and [`rows`].
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

/// Passes the same spans as [`runs`] to `sink`, without the crossings, which cost more than the
/// pixels.
///
/// # Errors
/// As for [`columns`].
pub fn spans(
    axis: Axis,
    polygon: &[impl Copy + Into<Point>],
    sink: impl FnMut(Run<()>),
) -> Result<(), Dropped> {
    match axis {
        Axis::Down => scan::<()>(polygon, &COLUMNS, sink),
        Axis::Right => scan::<()>(polygon, &ROWS, sink),
    }
}

#[inline]
fn scan<E: End>(
    polygon: &[impl Copy + Into<Point>],
    lines: &Lines,
    mut sink: impl FnMut(Run<E>),
) -> Result<(), Dropped> {
    check(polygon)?;
    let mut edges = [Edge::<E::Along>::default(); MAX_SIDES];
    let mut count = 0;
    let (mut line, mut stop) = (lines.count, 0);
    let place = |&point| (lines.place)(Into::<Point>::into(point));
    if let Some(last) = polygon.last() {
        let mut a = place(last);
        let mut side = polygon.len() - 1;
        for (i, b) in polygon.iter().enumerate() {
            let b = place(b);
            if let Some(edge) = Edge::new::<E>(side, a, b, lines) {
                line = line.min(edge.first);
                stop = stop.max(edge.end);
                edges[count] = edge;
                count += 1;
            }
            (a, side) = (b, i);
        }
    }
    let edges = &mut edges[..count];
    let mut give = |line, [top, bottom]: [(i64, E); 2]| {
        let (mut first, mut end) = (top.0 >> FRACTION, bottom.0 >> FRACTION);
        // Nearly all spans begin and end on the screen: test both signs at once.
        if first | (lines.cells - end) < 0 {
            [first, end] = [first, end].map(|cell| cell.clamp(0, lines.cells));
        }
        if first < end {
            sink(Run {
                line: line as u16,
                first: first as u16,
                len: (end - first) as u16,
                between: [top.1, bottom.1],
            });
        }
    };
    while line < stop {
        // Move the edges that cross the line to the front. The other edges start later, or have
        // ended.
        let (mut active, mut end) = (0, stop);
        for i in 0..edges.len() {
            let edge = &edges[i];
            if edge.first > line {
                end = end.min(edge.first);
            } else if edge.end > line {
                end = end.min(edge.end);
                if active < i {
                    edges.swap(active, i);
                }
                active += 1;
            }
        }
        let crossing = |edge: &Edge<E::Along>, line| {
            let end = E::new(edge.side, &edge.along, line);
            (edge.cell, end)
        };
        // By cell first; within a cell by the position of the crossing.
        let key = |&(cell, end): &(i64, E)| (cell >> FRACTION, end.at());
        match &mut edges[..active] {
            [] => {}
            [first, second] => {
                // Local copies, so that the compiler keeps the two edges in registers.
                let (mut a, mut b) = (*first, *second);
                for line in line..end {
                    let (mut top, mut bottom) = (crossing(&a, line), crossing(&b, line));
                    let turned = match E::BY_CELL {
                        true => bottom.0 < top.0,
                        false => key(&bottom) < key(&top),
                    };
                    if turned {
                        (top, bottom) = (bottom, top);
                    }
                    give(line, [top, bottom]);
                    a.cell += a.step;
                    b.cell += b.step;
                }
                (*first, *second) = (a, b);
            }
            active => {
                let mut crossings = [(0, E::default()); MAX_SIDES];
                let crossings = &mut crossings[..active.len()];
                for line in line..end {
                    for (edge, place) in active.iter_mut().zip(crossings.iter_mut()) {
                        *place = crossing(edge, line);
                        edge.cell += edge.step;
                    }
                    crossings.sort_unstable_by_key(key);
                    for pair in crossings.chunks_exact(2) {
                        give(line, [pair[0], pair[1]]);
                    }
                }
            }
        }
        line = end;
    }
    Ok(())
}

/// Returns an error if the scan's arithmetic does not hold for `polygon`.
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
