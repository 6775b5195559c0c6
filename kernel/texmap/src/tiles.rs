//! Tiles: the polygon cut by a grid of the screen, and affine inside each tile.
//!
//! The period cut polygons into smaller ones and drew those affine. New vertices would have to be
//! snapped, and the picture's outline and seams with them; here the screen's own grid cuts, every
//! [`SIDE`] pixels, so coverage stays what it is. The quotient is taken at the tiles' corners, which
//! are centres of pixels and which neighbours share. A column's run is cut where it passes from a
//! tile into the next; its coordinates at the tile's top and bottom are interpolated between the
//! corners, and those of its pixels between these two. Every division by a length is a shift.
//!
//! Corners outside the polygon lie in its plane and may lie outside the texture. They are not
//! clamped, since that would bend the tile; the walks are, where they step over the border.
//!
//! # Error
//!
//! Between two places with the depth ratio r (at least 1), between which u changes by du, linear
//! interpolation is off by at most |du| (sqrt r - 1)/(sqrt r + 1). Along the top and the bottom of
//! the tile that is the error at the column's two ends, and no more of it than its share arrives at
//! a pixel between them. Down the column it comes in once more, for the exact coordinates at these
//! ends. So the bound is the larger one of top and bottom, plus the column's: closed, and reached
//! where the two have one sign. To that comes [`DRIFT`].
//!
//! A tile that has a corner on or beyond the horizon, further than 4096 texels away, or
//! [`MOST_DEPTH`] times as deep as another, has no use for its corners: its runs are exact.

use modex::{HEIGHT, WIDTH};

use crate::coverage::{Axis, Dropped, spans};
use crate::job::{Job, Walk};
use crate::level::Reciprocal;
use crate::plane::{self, Plane};
use crate::straight::{REACH, Straight};
use crate::{Face, Texture};

/// Pixels along a tile's side.
pub const SIDE: u16 = 1 << BITS;
const BITS: u32 = 4;
/// Depth of a tile's deepest corner over that of its nearest, at most: from there on linear
/// interpolation is off by more than a third of the way between them.
pub const MOST_DEPTH: i64 = 4;
/// Most that fixed point adds to the error, 16.16: the corner and the walk's start are rounded
/// down, 15 steps to nearest, and the reciprocal is off by an eighth at the furthest corner.
pub const DRIFT: i32 = 10;

/// Corners down the screen.
const CORNERS: usize = HEIGHT / SIDE as usize + 1;
const _: () = assert!(WIDTH.is_multiple_of(SIDE as usize) && HEIGHT.is_multiple_of(SIDE as usize));

/// u and v, 16.16 and within `REACH`, and c, above zero.
type Corner = [i64; 3];

/// The corners left and right of a column of tiles, found when they are first asked for.
#[derive(Debug)]
struct Grid {
    plane: Plane,
    /// The column of tiles.
    column: u16,
    /// Whether a corner was asked for, and what it is if it is of use.
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

    /// Goes to another column of tiles; what was on the right of this one may be on its left.
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
            let over = Reciprocal::new(c)?;
            let [u, v] = [plane.a, plane.b].map(|form| {
                let at = i64::try_from(over.times(form.at(x, y))).ok()?;
                (at.abs() <= REACH).then_some(at)
            });
            Some([u?, v?, c])
        })
    }

    /// The walk of column `x`, down from line `y`, in the tile that holds the pixel.
    fn walk(&mut self, x: u16, y: u16) -> Option<Straight> {
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
            // Multiplied out nothing is lost: 20 fraction bits at the ends, then 24.
            let top = (a << BITS) + (b - a) * i;
            let bottom = (c << BITS) + (d - c) * i;
            let step = bottom - top;
            let at = (top << BITS) + step * j;
            let half = 1 << (2 * BITS - 1);
            (at >> (2 * BITS), (step + half) >> (2 * BITS))
        });
        Some(Straight {
            at: [u, v],
            step: [du, dv],
        })
    }
}

/// Gives `sink` the jobs of a face.
///
/// # Errors
/// A polygon outside the legal range; nothing of it was given to `sink`.
pub(crate) fn jobs(
    face: &Face<'_>,
    texture: &Texture<'_>,
    mut sink: impl FnMut(Job),
) -> Result<(), Dropped> {
    let mut grid = Grid::new(face.plane());
    spans(Axis::Down, face.polygon, |run| {
        let x = run.line;
        if x / SIDE != grid.column {
            grid.go(x / SIDE);
        }
        let (mut y, end) = (run.first, run.first + run.len);
        while y < end {
            let stop = end.min((y / SIDE + 1) * SIDE);
            let mut add = |first: u16, len, walk| {
                sink(Job::new(Axis::Down, x, y + first, len, face.texture, walk));
            };
            match grid.walk(x, y) {
                Some(straight) => straight.pieces(stop - y, texture.last(), |first, len, walk| {
                    add(first, len, Walk::Affine(walk));
                }),
                None => {
                    let walk = plane::Walk::new(&grid.plane, Axis::Down, x, y);
                    add(0, stop - y, Walk::Exact(walk));
                }
            }
            y = stop;
        }
    })
}
