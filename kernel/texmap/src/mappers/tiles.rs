//! The tile mapper: the screen's grid cuts the polygon, and the mapping is affine inside each tile.
//!
//! Renderers of the time cut polygons into smaller polygons and drew these affine. But new vertices would
//! have to be snapped, and would move the frame's outline and seams. Here the screen's own grid cuts, every
//! [`SIDE`] pixels, so coverage does not change. The quotient is computed at the corners of the tiles, which
//! are centres of pixels and are shared by neighbouring tiles. A column's span is cut where it passes from
//! one tile into the next. Its coordinates at the tile's top and bottom are interpolated between the corners,
//! and the coordinates of its pixels between top and bottom. Every division by a length is a shift.
//!
//! Corners outside the polygon still lie in its plane, and may lie outside the texture. They are not clamped,
//! since that would bend the tile. The spans are clamped where they cross the border.
//!
//! # Error
//!
//! Let u change by du between two places with the depth ratio r (at least 1). Linear interpolation between
//! them is off by at most |du| (sqrt r - 1)/(sqrt r + 1). Along the top and the bottom of the tile, that
//! bounds the error at the column's two ends, and a pixel between the ends gets a weighted mean of the two
//! errors. Down the column the same formula applies once more, to the interpolation between the exact
//! coordinates at these ends. So the bound is the larger of the errors of top and bottom, plus the column's
//! own: a closed form, which is reached where the two have the same sign. Fixed point adds up to [`DRIFT`].
//!
//! If a tile has a corner on or beyond the horizon, or a corner further than 4096 texels away, or a corner
//! [`MOST_DEPTH`] times as deep as another, its corners are not used: its spans are exact.

use modex::{HEIGHT, WIDTH};

use super::clamped::{ClampedStep, REACH};
use super::mapped_span::{MappedSpan, SpanKind};
use crate::geometry::{Axis, Dropped, Texture};
use crate::plane::{Face, Plane, PlaneStepper, Reciprocal};
use crate::scan::spans;

/// Length of a tile's side in pixels.
pub const SIDE: u16 = 1 << BITS;
const BITS: u32 = 4;
/// Limit of the ratio between the depths of a tile's deepest and nearest corners. From this ratio on, linear
/// interpolation is off by a third or more of the difference between them.
pub const MOST_DEPTH: i64 = 4;
/// Most that fixed point adds to the error, 16.16: the corner and the span's start are rounded down, 15 steps
/// are rounded to nearest, and the reciprocal is off by 1/8 of a unit at the furthest corner.
pub const DRIFT: i32 = 10;

/// Corners down the screen.
const CORNERS: usize = HEIGHT / SIDE as usize + 1;
const _: () = assert!(WIDTH.is_multiple_of(SIDE as usize) && HEIGHT.is_multiple_of(SIDE as usize));

/// u and v, 16.16 and within `REACH`, and c, above zero.
type Corner = [i64; 3];

/// The corners on the left and on the right of a column of tiles, computed on first use.
#[derive(Debug)]
struct Grid {
    plane: Plane,
    /// Index of the column of tiles.
    column: u16,
    /// The corners: outer `None` if not yet computed, inner `None` if the corner is unusable.
    sides: [[Option<Option<Corner>>; CORNERS]; 2],
}

impl Grid {
    fn new(plane: Plane) -> Self {
        Self {
            plane,
            column: 0,
            sides: [[None; CORNERS]; 2],
        }
    }

    /// Moves to another column of tiles. If it is the next column, the right corners become its left corners.
    fn go(&mut self, column: u16) {
        let [_, right] = self.sides;
        self.sides = match column == self.column + 1 {
            true => [right, [None; CORNERS]],
            false => [[None; CORNERS]; 2],
        };
        self.column = column;
    }

    fn corner(&mut self, right: u16, row: u16) -> Option<Corner> {
        let Self { plane, column, .. } = *self;
        *self.sides[usize::from(right)][usize::from(row)].get_or_insert_with(|| {
            let (x, y) = ((column + right) * SIDE, row * SIDE);
            let c = plane.c.at(x, y);
            let over = Reciprocal::unbiased(c)?;
            let [u, v] = [plane.a, plane.b].map(|form| {
                let at = i64::try_from(over.floor(form.at(x, y))).ok()?;
                (at.abs() <= REACH).then_some(at)
            });
            Some([u?, v?, c])
        })
    }

    /// Returns the steps of column `x`, down from line `y`, in the tile that holds the pixel.
    fn step(&mut self, x: u16, y: u16) -> Option<ClampedStep> {
        let row = y / SIDE;
        let corners = [
            self.corner(0, row)?,
            self.corner(1, row)?,
            self.corner(0, row + 1)?,
            self.corner(1, row + 1)?,
        ];
        let depths = corners.map(|[_, _, c]| c);
        let nearest = depths.into_iter().min()?;
        let deepest = depths.into_iter().max()?;
        if deepest / MOST_DEPTH >= nearest {
            return None;
        }
        let [i, j] = [x, y].map(|k| i64::from(k % SIDE));
        let [(u, du), (v, dv)] = [0, 1].map(|k| {
            let [a, b, c, d] = corners.map(|corner| corner[k]);
            // Multiplied out, nothing is lost: 20 fraction bits at the ends, then 24.
            let top = (a << BITS) + (b - a) * i;
            let bottom = (c << BITS) + (d - c) * i;
            let step = bottom - top;
            let at = (top << BITS) + step * j;
            let half = 1 << (2 * BITS - 1);
            (at >> (2 * BITS), (step + half) >> (2 * BITS))
        });
        Some(ClampedStep {
            at: [u, v],
            step: [du, dv],
        })
    }
}

/// Passes the spans of a face to `sink`.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub(crate) fn map(
    face: &Face<'_>,
    texture: &Texture<'_>,
    sink: &mut dyn FnMut(MappedSpan),
) -> Result<(), Dropped> {
    let mut grid = Grid::new(face.plane());
    spans(Axis::Down, face.polygon, |span| {
        let x = span.line;
        if x / SIDE != grid.column {
            grid.go(x / SIDE);
        }
        let (mut y, end) = (span.first, span.first + span.len);
        while y < end {
            let stop = end.min((y / SIDE + 1) * SIDE);
            let mut add = |first: u16, len, kind| {
                sink(MappedSpan {
                    axis: Axis::Down,
                    line: x,
                    first: y + first,
                    len,
                    kind,
                });
            };
            match grid.step(x, y) {
                Some(step) => step.pieces(stop - y, texture.last(), |first, len, stepper| {
                    add(first, len, SpanKind::Affine(stepper));
                }),
                None => {
                    let stepper = PlaneStepper::new(&grid.plane, Axis::Down, x, y);
                    add(0, stop - y, SpanKind::Exact(stepper));
                }
            }
            y = stop;
        }
    })
}
