//! Coverage: the pixels of a polygon in each column, or in each row, of the screen.
//!
//! # The rule
//!
//! A pixel with centre (xc, yc) is inside when an odd number of edges have `ymin <= yc < ymax` and cross `yc`
//! at `x <= xc`. The rule is half-open and even-odd, and is decided in exact integers. It speaks of rows, so
//! [`rows`] applies it as it stands: the first pixel to the right of an edge is the first with `xc >= x(yc)`,
//! and the pixels between an odd crossing and the next even crossing are inside.
//!
//! [`columns`] needs the same rule in terms of columns. Restate the rule first: move the centre to
//! the right by an infinitesimal e, and down by a d that is infinitesimal even compared with e. Then no edge
//! ever passes exactly through a centre, and the plain even-odd test decides. (The move to the right turns
//! `x <= xc` into `x < xc + e`. The move down turns the half-open interval into an open one. Because d is so
//! small compared with e, the slope of the edge does not disturb the first comparison.)
//!
//! In this form the test also works down a column. The column at xc + e meets exactly the edges with
//! `xmin <= xc < xmax`, so it never meets a vertical edge. It meets each of them at y(xc) + e dy/dx. A centre
//! at yc + d lies below that crossing when yc > y(xc). When yc = y(xc), it does so only if dy/dx <= 0: if the
//! slope is positive, the crossing lies e dy/dx further down, which is more than d. So the first row below an
//! edge is
//!
//! - the first with `yc >= y(xc)` if dy <= 0,
//! - the first with `yc > y(xc)` if dy > 0,
//!
//! and the rows between an odd crossing and the next even crossing are inside. If every edge used `>=`,
//! columns would draw the transposed rule: on ties they would draw other pixels than rows do, and leave gaps
//! where the two meet.
//!
//! # The scan
//!
//! Between two vertices that are neighbours in the order of the lines, every line crosses the same edges, so
//! the scan determines these edges once for the whole stretch. A convex polygon has two of them, and the
//! smaller cell comes first: no sort is needed.

use super::edges::{COLUMNS, Crossing, Edge, FRACTION, ROWS, ScanDirection, SpanEnd};
use crate::geometry::{Axis, Dropped, MAX_SIDES, Point, check};

/// Most spans in a line: a span needs two sides, one at each end.
pub(crate) const MAX_SPANS: usize = MAX_SIDES / 2;

/// A span: consecutive inside pixels of one line. The line is a column from [`columns`] and a row from
/// [`rows`]. [`spans`] yields spans without crossings: `End` is `()` there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span<End = Crossing> {
    /// The column's x, or the row's y.
    pub line: u16,
    /// The first pixel: its y in a column, its x in a row.
    pub first: u16,
    /// The number of pixels, at least 1; all of them are on the screen.
    pub len: u16,
    /// The crossings where the line enters and leaves the polygon. Either may be off the screen.
    pub ends: [End; 2],
}

/// Passes every span of inside pixels in every column of the screen to `sink`: columns from left to right,
/// and downward in each column.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub fn columns(polygon: &[impl Copy + Into<Point>], sink: impl FnMut(Span)) -> Result<(), Dropped> {
    scan::<Crossing>(polygon, &COLUMNS, sink)
}

/// Passes every span of inside pixels in every row of the screen to `sink`: rows downward, and from left to
/// right in each row. The pixels are the same as those of [`columns`].
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub fn rows(polygon: &[impl Copy + Into<Point>], sink: impl FnMut(Span)) -> Result<(), Dropped> {
    scan::<Crossing>(polygon, &ROWS, sink)
}

/// Passes the spans of [`columns`] or [`rows`] to `sink`, by `axis`.
///
/// # Errors
/// As for [`columns`] and [`rows`].
pub fn spans_and_crossings(
    axis: Axis,
    polygon: &[impl Copy + Into<Point>],
    sink: impl FnMut(Span),
) -> Result<(), Dropped> {
    match axis {
        Axis::Down => columns(polygon, sink),
        Axis::Right => rows(polygon, sink),
    }
}

/// Passes the same spans as [`spans_and_crossings`] to `sink`, without the crossings, which cost more than
/// the pixels.
///
/// # Errors
/// As for [`columns`].
pub fn spans(
    axis: Axis,
    polygon: &[impl Copy + Into<Point>],
    sink: impl FnMut(Span<()>),
) -> Result<(), Dropped> {
    match axis {
        Axis::Down => scan::<()>(polygon, &COLUMNS, sink),
        Axis::Right => scan::<()>(polygon, &ROWS, sink),
    }
}

#[inline]
fn scan<E: SpanEnd>(
    polygon: &[impl Copy + Into<Point>],
    lines: &ScanDirection,
    mut sink: impl FnMut(Span<E>),
) -> Result<(), Dropped> {
    check(polygon)?;
    let mut edges = [Edge::<E::Interpolant>::default(); MAX_SIDES];
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
            sink(Span {
                line: line as u16,
                first: first as u16,
                len: (end - first) as u16,
                ends: [top.1, bottom.1],
            });
        }
    };
    while line < stop {
        // Move the edges that cross the line to the front. The other edges start later, or have ended.
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
        let crossing = |edge: &Edge<E::Interpolant>, line| {
            let end = E::new(edge.side, &edge.interpolant, line);
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
