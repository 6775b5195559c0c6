//! Checks the renderer's column and row scans against the oracle.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use texmap::scan::{Span, columns, rows, spans, spans_and_crossings};
use texmap::{Axis, Dropped, MAX_SIDES, Point};

use crate::coverage::{Area, Pixels, Row};

/// A case of a sweep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CoverageCase {
    /// The polygons. Each is checked separately.
    pub polygons: Vec<Vec<Point>>,
    /// If present, the polygons fill this outline: each pixel inside belongs to exactly one of them, and no
    /// pixel outside belongs to any. The outline may have more sides than the renderer accepts.
    pub outline: Option<Vec<Point>>,
}

/// One of the renderer's scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scan {
    /// [`texmap::scan::columns`].
    Columns,
    /// [`texmap::scan::rows`].
    Rows,
}

/// A reason why a case fails.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CoverageError {
    /// The polygon was dropped.
    Dropped(Scan, Dropped),
    /// The renderer panicked (an overflow, for example).
    Panicked,
    /// A span is empty, out of order, overlaps the previous span, or has a pixel outside the screen or beyond
    /// the ring of pixels around the polygon.
    Misplaced(Scan, Span),
    /// Scan and oracle disagree about whether the pixel is inside.
    Pixel {
        /// The scan that differs.
        scan: Scan,
        /// The pixel's column.
        x: i32,
        /// The pixel's row.
        y: i32,
        /// The oracle's answer.
        inside: bool,
    },
    /// The spans without crossings differ from the spans with crossings.
    Spans(Axis),
    /// Two polygons of the case contain the pixel.
    Twice(i32, i32),
    /// The pixel is in the outline and in no polygon, or in a polygon and not in the outline.
    Gap(i32, i32),
}

impl fmt::Display for CoverageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |scan: &Scan| match scan {
            Scan::Columns => "the column scan",
            Scan::Rows => "the row scan",
        };
        match self {
            Self::Dropped(scan, why) => write!(f, "{} dropped the polygon: {why:?}", name(scan)),
            Self::Panicked => write!(f, "a scan panicked"),
            Self::Misplaced(scan, span) => {
                let Span {
                    line, first, len, ..
                } = span;
                write!(
                    f,
                    "{} gave a misplaced span: line {line}, {len} pixels from {first}",
                    name(scan)
                )
            }
            Self::Pixel { scan, x, y, inside } => {
                let (expected, found) = match inside {
                    true => ("inside", "outside"),
                    false => ("outside", "inside"),
                };
                write!(f, "({x}, {y}) is {expected}, but {found} by {}", name(scan))
            }
            Self::Spans(axis) => write!(
                f,
                "{axis:?}: the spans without crossings differ from the spans with crossings"
            ),
            Self::Twice(x, y) => write!(f, "({x}, {y}) belongs to two polygons"),
            Self::Gap(x, y) => write!(
                f,
                "({x}, {y}) is in the outline or in a polygon, but not in both"
            ),
        }
    }
}

impl std::error::Error for CoverageError {}

/// Checks cases, and owns the memory for the checks.
#[derive(Debug, Default)]
pub struct CoverageChecker {
    oracle: Pixels,
    scanned: Pixels,
    union: Pixels,
    /// Line, first pixel and length of each span.
    found: Vec<(u16, u16, u16)>,
}

impl CoverageChecker {
    /// Checks a case, and returns the number of compared pixels: for each polygon, all pixels of the screen
    /// that meet its bounding box, and the pixels around them.
    ///
    /// # Errors
    /// The first error found.
    pub fn case(&mut self, case: &CoverageCase) -> Result<u64, CoverageError> {
        let Some(outline) = &case.outline else {
            return case.polygons.iter().map(|p| self.polygon(p)).sum();
        };
        let outline_area = Area::around(outline);
        self.union.clear(&outline_area);
        let mut pixels = 0;
        for polygon in &case.polygons {
            pixels += self.polygon(polygon)?;
            let area = Area::around(polygon);
            for y in area.y.clone() {
                let (union, row) = (self.union.row_mut(y), self.oracle.row(y));
                let both = std::array::from_fn(|i| union[i] & row[i]);
                if let Some(x) = first(&both) {
                    return Err(CoverageError::Twice(x, y));
                }
                for (all, word) in union.iter_mut().zip(row) {
                    *all |= word;
                }
            }
        }
        self.oracle.cover(outline, &outline_area);
        match difference(&self.oracle, &self.union, &outline_area) {
            Some((x, y)) => Err(CoverageError::Gap(x, y)),
            None => Ok(pixels + outline_area.pixels()),
        }
    }

    /// Checks a polygon, and returns the number of compared pixels.
    ///
    /// # Errors
    /// The first error found.
    pub fn polygon(&mut self, polygon: &[Point]) -> Result<u64, CoverageError> {
        debug_assert!(polygon.len() <= MAX_SIDES);
        let area = Area::around(polygon);
        self.oracle.cover(polygon, &area);
        for scan in [Scan::Columns, Scan::Rows] {
            // A panic counts as a failure, so that the case is shrunk and printed.
            catch_unwind(AssertUnwindSafe(|| self.scan(polygon, &area, scan)))
                .unwrap_or(Err(CoverageError::Panicked))?;
            if let Some((x, y)) = difference(&self.oracle, &self.scanned, &area) {
                let inside = self.oracle.contains(x, y);
                return Err(CoverageError::Pixel { scan, x, y, inside });
            }
        }
        for axis in [Axis::Down, Axis::Right] {
            self.spans(polygon, axis)?;
        }
        Ok(area.pixels())
    }

    /// Compares the spans without crossings to the spans with crossings.
    fn spans(&mut self, polygon: &[Point], axis: Axis) -> Result<(), CoverageError> {
        let mut found = std::mem::take(&mut self.found);
        found.clear();
        let with = spans_and_crossings(axis, polygon, |span| {
            found.push((span.line, span.first, span.len))
        });
        let mut rest = found.iter();
        let mut same = true;
        let without = spans(axis, polygon, |span| {
            same &= rest.next() == Some(&(span.line, span.first, span.len));
        });
        same &= rest.next().is_none() && with == without;
        self.found = found;
        if same {
            Ok(())
        } else {
            Err(CoverageError::Spans(axis))
        }
    }

    /// Fills `scanned` with one of the renderer's scans.
    fn scan(&mut self, polygon: &[Point], area: &Area, scan: Scan) -> Result<(), CoverageError> {
        let scanned = &mut self.scanned;
        scanned.clear(area);
        let (lines, cells) = match scan {
            Scan::Columns => (&area.x, &area.y),
            Scan::Rows => (&area.y, &area.x),
        };
        // The earliest pixel at which the next span may begin.
        let mut free = (lines.start, cells.start);
        let mut wrong = None;
        let sink = |span: Span| {
            let (line, first) = (i32::from(span.line), i32::from(span.first));
            let end = first + i32::from(span.len);
            let placed = lines.contains(&line) && cells.start <= first && end <= cells.end;
            if !placed || first == end || (line, first) < free {
                wrong.get_or_insert(CoverageError::Misplaced(scan, span));
                return;
            }
            free = (line, end);
            match scan {
                Scan::Columns => {
                    // Only the span's ends; the pixels between are filled in below.
                    let (word, bit) = (line as usize / 64, 1 << (line % 64));
                    scanned.row_mut(first)[word] ^= bit;
                    if end < cells.end {
                        scanned.row_mut(end)[word] ^= bit;
                    }
                }
                Scan::Rows => {
                    scanned.toggle_from(first, line);
                    scanned.toggle_from(end, line);
                }
            }
        };
        match scan {
            Scan::Columns => columns(polygon, sink),
            Scan::Rows => rows(polygon, sink),
        }
        .map_err(|why| CoverageError::Dropped(scan, why))?;
        if scan == Scan::Columns {
            let mut above = Row::default();
            for y in area.y.clone() {
                let row = scanned.row_mut(y);
                for (word, above) in row.iter_mut().zip(above) {
                    *word ^= above;
                }
                above = *row;
            }
        }
        wrong.map_or(Ok(()), Err)
    }
}

/// Returns the first pixel in which two sets differ, in the rows of `area`.
fn difference(a: &Pixels, b: &Pixels, area: &Area) -> Option<(i32, i32)> {
    area.y.clone().find_map(|y| {
        let (a, b) = (a.row(y), b.row(y));
        let x = first(&std::array::from_fn(|i| a[i] ^ b[i]))?;
        Some((x, y))
    })
}

/// Returns the leftmost pixel of a row.
fn first(row: &Row) -> Option<i32> {
    let i = row.iter().position(|&word| word != 0)?;
    Some(i as i32 * 64 + row[i].trailing_zeros() as i32)
}
