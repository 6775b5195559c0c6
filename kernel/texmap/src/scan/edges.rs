//! Edges: the cells where the sides of a polygon cross the lines of the screen, in exact integers.
//!
//! # The arithmetic
//!
//! Both scans go through *lines* (columns or rows), each of which is a row of *cells* (its pixels). They
//! differ only in the roles of the coordinates and in the tie. Below, p counts across the lines and q along
//! them: (p, q) is (x, y) for columns and (y, x) for rows. For the edge from (pa, qa) to (pb, qb) with
//! pa < pb, dp = pb - pa and dq = qb - qa.
//!
//! The first cell past an edge is the floor of `N / (256 dp)`, where N is an integer that grows by `256 dq`
//! from line to line. The last 8 bits of N never change, so they are dropped: the cell is the floor of
//! v = n / dp, where n = floor(N / 256) grows by dq per line. The scan steps v with 36 fraction bits, and
//! rounds the start and the step up. So the stepped value is above v by less than 1 unit of 2^-36 for the
//! start, and by less than 1 unit for each of at most 319 steps. v is a multiple of 1 / dp, so it is below
//! the next whole number by at least 1 / dp, which is at least 2^12 of those units. The stepped value
//! therefore always has the same floor as v. Within
//! [`MAX_COORDINATE`](crate::MAX_COORDINATE), |N| < 2^49 and dp <= 2^24, in either scan.

use super::interpolant::EdgeInterpolant;
use crate::geometry::Point;
use modex::{HEIGHT, WIDTH};

/// A crossing of a polygon's side with the centre of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crossing {
    /// The side from vertex `side` to the next vertex.
    pub side: usize,
    /// The crossing's y in a column, or its x in a row: in pixels with 32 fraction bits, off by less than
    /// 2^-23. It decides no pixel; it serves to interpolate between the two ends of a span.
    pub at: i64,
}

/// The data that a scan reports about a side's crossing with a line: [`Crossing`], or nothing.
pub(crate) trait SpanEnd: Copy + Default {
    /// The precomputed data of a side that yields its crossings.
    type Interpolant: Copy + Default;

    /// Returns the data of a side that starts at q = `a`, rises by `dq` over `dp`, and has advanced by `p` at
    /// line `first`.
    fn interpolant(a: i32, dq: i32, dp: i32, first: i32, p: i32) -> Self::Interpolant;

    /// Returns the crossing of `side` with `line`.
    fn new(side: usize, interpolant: &Self::Interpolant, line: i32) -> Self;

    /// Whether crossings of the same cell may come in any order.
    const BY_CELL: bool;

    /// Returns the sort key among crossings of the same cell.
    fn at(&self) -> i64;
}

impl SpanEnd for Crossing {
    type Interpolant = EdgeInterpolant;
    const BY_CELL: bool = false;

    fn interpolant(a: i32, dq: i32, dp: i32, first: i32, p: i32) -> EdgeInterpolant {
        EdgeInterpolant::new(a, dq.into(), dp.into(), first, p.into(), 24)
    }

    fn new(side: usize, interpolant: &EdgeInterpolant, line: i32) -> Self {
        let at = interpolant.at(line);
        Self { side, at }
    }

    fn at(&self) -> i64 {
        self.at
    }
}

/// For scans that need the pixels only.
impl SpanEnd for () {
    type Interpolant = ();
    const BY_CELL: bool = true;

    fn interpolant(_: i32, _: i32, _: i32, _: i32, _: i32) {}

    fn new(_: usize, (): &(), _: i32) {}

    fn at(&self) -> i64 {
        0
    }
}

/// The differences between a scan by columns and a scan by rows.
pub(crate) struct ScanDirection {
    /// Lines on the screen, and pixels in each line.
    pub count: i32,
    pub cells: i64,
    /// Returns (p, q) of a point.
    pub place: fn(Point) -> (i32, i32),
    /// Returns whether a centre exactly on the crossing is past the edge, from the edge's dq where dp > 0.
    pub tie: fn(i32) -> bool,
}

pub(crate) const COLUMNS: ScanDirection = ScanDirection {
    count: WIDTH as i32,
    cells: HEIGHT as i64,
    place: |point| (point.x, point.y),
    tie: |dy| dy <= 0,
};

pub(crate) const ROWS: ScanDirection = ScanDirection {
    count: HEIGHT as i32,
    cells: WIDTH as i64,
    place: |point| (point.y, point.x),
    tie: |_| true,
};

/// Fraction bits of a cell.
pub(crate) const FRACTION: u32 = 36;

/// An edge that crosses at least one line of the screen.
#[derive(Clone, Copy, Default)]
pub(crate) struct Edge<A> {
    pub side: usize,
    /// The lines `first..end` that the edge crosses.
    pub first: i32,
    pub end: i32,
    /// The first cell past the edge in the current line, with [`FRACTION`] bits. It is at most one step
    /// further out than the edge reaches: below 2^26 cells.
    pub cell: i64,
    pub step: i64,
    pub interpolant: A,
}

impl<A: Copy> Edge<A> {
    /// Returns the edge between `a` and `b`, given in either order, or nothing if no line of the screen meets
    /// it.
    #[inline]
    pub fn new<E: SpanEnd<Interpolant = A>>(
        side: usize,
        a: (i32, i32),
        b: (i32, i32),
        lines: &ScanDirection,
    ) -> Option<Self> {
        // Step forward always, so that neighbours step along a shared edge with the same bits.
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
            interpolant: E::interpolant(a.1, dq, dp, first, p),
        })
    }
}

/// Returns the quotient, rounded down, and the remainder. The quotient must fit 32 bits. Near the screen,
/// which is nearly always, the numerator fits 32 bits as well, and a 32-bit division costs a fraction of a
/// 64-bit division.
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

/// Returns the lines `first..end` of the screen's `count` lines that an edge from `a` to `b` crosses, with
/// `a <= b`, or nothing if it crosses no line. The centre of line l is at 256 l + 128, and the edge crosses
/// it if a <= centre < b.
pub(crate) fn crossed(a: i32, b: i32, count: i32) -> Option<(i32, i32)> {
    let first = ((a + 127) >> 8).max(0);
    let end = ((b + 127) >> 8).min(count);
    (first < end).then_some((first, end))
}

/// Returns the distance from `a` to the centre of `line`.
pub(crate) fn offset(line: i32, a: i32) -> i32 {
    line * 256 + 128 - a
}
