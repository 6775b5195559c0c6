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
//! grows by `256 dq` from line to line. N's last 8 bits never change, and are cut: the cell is the
//! floor of v = n / dp, n = floor(N / 256), and n grows by dq. v is stepped with 36 fraction bits,
//! start and step rounded up. So it is above the true v by less than 1 for the start and 1 for each
//! of at most 319 steps, in units of 2^-36; the true v is a multiple of 1 / dp, and below the next
//! whole number by at least that, more than 2^12 such units: its floor is never another.
//! |N| < 2^49 within [`MAX_COORDINATE`], dp <= 2^24, in either scan.
//!
//! Between two vertices, in the order of the lines, the same edges cross every line: which they
//! are is asked once for such a stretch. In a convex polygon they are two, and the smaller cell
//! comes first: there is nothing to sort.

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

/// Inside pixels without a gap, in one line: a column from [`columns`], a row from [`rows`]; of
/// [`spans`] without the crossings, `End` being `()`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run<End = Crossing> {
    /// The column's x, or the row's y.
    pub line: u16,
    /// The first pixel: its y in a column, its x in a row.
    pub first: u16,
    /// Pixels, at least 1; all of them are on the screen.
    pub len: u16,
    /// Where the line enters the polygon and where it leaves it. Either may be off the screen.
    pub between: [End; 2],
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

/// What a scan tells of where a side meets a line.
trait End: Copy + Default {
    /// What it is made of, for every side.
    type Along: Copy + Default;

    /// That of a side from q = `a` on that rises by `dq` in `dp`, and is `p` further at line `first`.
    fn along(a: i32, dq: i32, dp: i32, first: i32, p: i32) -> Self::Along;

    /// Where `side` meets `line`.
    fn new(side: usize, along: &Self::Along, line: i32) -> Self;

    /// Whether crossings of the same cell may come in any order.
    const BY_CELL: bool;

    /// Its order among crossings of the same cell.
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

/// The pixels are all that is asked for.
impl End for () {
    type Along = ();
    const BY_CELL: bool = true;

    fn along(_: i32, _: i32, _: i32, _: i32, _: i32) {}

    fn new(_: usize, (): &(), _: i32) {}

    fn at(&self) -> i64 {
        0
    }
}

/// What makes a scan one by columns or by rows.
struct Lines {
    /// Lines on the screen, and pixels in each.
    count: i32,
    cells: i64,
    /// (p, q) of a point.
    place: fn(Point) -> (i32, i32),
    /// Whether a centre on the crossing is past the edge, by the edge's dq where dp > 0.
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
    /// Lines `first..end`.
    first: i32,
    end: i32,
    /// The first cell past the edge in the current line, [`FRACTION`] bits; at most a step
    /// further out than the edge goes: below 2^26 cells.
    cell: i64,
    step: i64,
    along: A,
}

impl<A: Copy> Edge<A> {
    /// The edge from `a` to `b` in either order, or nothing if no line of the screen meets it.
    #[inline]
    fn new<E: End<Along = A>>(
        side: usize,
        a: (i32, i32),
        b: (i32, i32),
        lines: &Lines,
    ) -> Option<Self> {
        // Always forward: neighbours walk a shared edge with the same bits.
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

/// Quotient, rounded down, and remainder; the quotient fits. Near the screen, which is nearly
/// always, 32 bits hold all of it, and the division costs a fraction.
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

/// The lines `first..end` of the screen's `count` that an edge from `a` to `b`, `a <= b`,
/// crosses, if there are any: line l has its centre at 256 l + 128, and a <= centre < b.
pub(crate) fn crossed(a: i32, b: i32, count: i32) -> Option<(i32, i32)> {
    let first = ((a + 127) >> 8).max(0);
    let end = ((b + 127) >> 8).min(count);
    (first < end).then_some((first, end))
}

/// How far the centre of `line` is from `a`.
pub(crate) fn offset(line: i32, a: i32) -> i32 {
    line * 256 + 128 - a
}

/// Gives `sink` every run of inside pixels in every column of the screen, from left to right
/// and in each column downward.
///
/// # Errors
/// A polygon outside the legal range; nothing of it was given to `sink`.
pub fn columns(polygon: &[impl Copy + Into<Point>], sink: impl FnMut(Run)) -> Result<(), Dropped> {
    scan::<Crossing>(polygon, &COLUMNS, sink)
}

/// Gives `sink` every run of inside pixels in every row of the screen, downward and in each row
/// from left to right. The pixels are the same as those of [`columns`].
///
/// # Errors
/// A polygon outside the legal range; nothing of it was given to `sink`.
pub fn rows(polygon: &[impl Copy + Into<Point>], sink: impl FnMut(Run)) -> Result<(), Dropped> {
    scan::<Crossing>(polygon, &ROWS, sink)
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

/// The same runs for those who need no crossings, which cost more than the pixels.
///
/// # Errors
/// As [`columns`] has.
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
        // Nearly all begin and end on the screen: a look at both signs.
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
        // Edges that cross the line go to the front, the others are not yet there, or ended.
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
        // By cells; within one by where the sides cross the line.
        let key = |&(cell, end): &(i64, E)| (cell >> FRACTION, end.at());
        match &mut edges[..active] {
            [] => {}
            [first, second] => {
                // The compiler keeps the two in registers: nobody else sees them.
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
