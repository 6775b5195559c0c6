//! Which pixels of the screen are inside a polygon.
//!
//! Range: coordinates within +-2^30. Differences are then at most 2^31 and products 2^62, so all arithmetic
//! is exact in 64 bits; the renderer's own limit is 2^23.

use std::ops::Range;

use texmap::Point;

/// Pixels in a row of the screen.
pub const WIDTH: i32 = 320;
/// Rows of the screen.
pub const HEIGHT: i32 = 240;

/// Returns whether a pixel is inside, word for word by the definition: inside when an odd number of edges
/// have `ymin <= yc < ymax` and cross yc at `x <= xc`.
pub fn inside(polygon: &[Point], x: i32, y: i32) -> bool {
    let odd = edges(polygon).filter(|edge| edge.spans(y) && edge.crosses_left_of(x, y));
    odd.count() % 2 == 1
}

/// An edge, its upper end first. A level edge spans no row, so the order of its ends does not matter.
#[derive(Clone, Copy)]
struct Edge {
    upper: Point,
    lower: Point,
}

fn edges(polygon: &[Point]) -> impl Iterator<Item = Edge> {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(&a, &b)| {
        let (upper, lower) = if a.y <= b.y { (a, b) } else { (b, a) };
        Edge { upper, lower }
    })
}

/// Returns the centre of pixel `i` in 1/256 pixel.
fn centre(i: i32) -> i64 {
    256 * i64::from(i) + 128
}

impl Edge {
    /// ymin <= yc < ymax.
    fn spans(&self, y: i32) -> bool {
        let yc = centre(y);
        i64::from(self.upper.y) <= yc && yc < i64::from(self.lower.y)
    }

    /// x <= xc where the edge crosses yc. The edge spans the row.
    fn crosses_left_of(&self, x: i32, y: i32) -> bool {
        let (ux, uy) = (i64::from(self.upper.x), i64::from(self.upper.y));
        let (lx, ly) = (i64::from(self.lower.x), i64::from(self.lower.y));
        // ux + (lx - ux) (yc - uy) / (ly - uy) <= xc, and ly - uy > 0.
        (lx - ux) * (centre(y) - uy) <= (centre(x) - ux) * (ly - uy)
    }
}

/// A rectangle of the screen's pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Area {
    /// Columns.
    pub x: Range<i32>,
    /// Rows.
    pub y: Range<i32>,
}

impl Area {
    /// Returns the pixels of the screen that meet the polygon's bounding box, and the ring of pixels around
    /// them. No other pixel can be inside.
    pub fn around(polygon: &[Point]) -> Self {
        let range = |coordinates: &mut dyn Iterator<Item = i32>, limit: i32| {
            let (min, max) = coordinates.fold((i32::MAX, i32::MIN), |(min, max), c| {
                (min.min(c), max.max(c))
            });
            let cut = |c: i32| c.clamp(0, limit);
            cut((min >> 8).saturating_sub(1))..cut((max >> 8).saturating_add(2))
        };
        Self {
            x: range(&mut polygon.iter().map(|p| p.x), WIDTH),
            y: range(&mut polygon.iter().map(|p| p.y), HEIGHT),
        }
    }

    /// Returns number of pixels.
    pub fn pixels(&self) -> u64 {
        self.x.len() as u64 * self.y.len() as u64
    }
}

/// A row of the screen, one bit for each pixel; the lowest bit is the leftmost pixel.
pub type Row = [u64; WIDTH as usize / 64];

/// A set of pixels of the screen.
#[derive(Clone, Debug)]
pub struct Pixels {
    rows: [Row; HEIGHT as usize],
}

impl Default for Pixels {
    fn default() -> Self {
        Self {
            rows: [[0; WIDTH as usize / 64]; HEIGHT as usize],
        }
    }
}

impl Pixels {
    /// Returns row `y` of the set.
    pub fn row(&self, y: i32) -> &Row {
        &self.rows[y as usize]
    }

    /// Returns row `y` of the set.
    pub fn row_mut(&mut self, y: i32) -> &mut Row {
        &mut self.rows[y as usize]
    }

    /// Returns whether the pixel is in the set.
    pub fn contains(&self, x: i32, y: i32) -> bool {
        self.row(y)[x as usize / 64] >> (x % 64) & 1 == 1
    }

    /// Toggles pixel (x, y) and all that follow it in its row.
    pub fn toggle_from(&mut self, x: i32, y: i32) {
        let mut mask = !0 << (x % 64);
        // Toggles nothing if x is the row's end.
        for word in &mut self.rows[y as usize][x as usize / 64..] {
            *word ^= mask;
            mask = !0;
        }
    }

    /// Removes all pixels in the rows of `area` from the set.
    pub fn clear(&mut self, area: &Area) {
        for y in area.y.clone() {
            *self.row_mut(y) = Row::default();
        }
    }

    /// Fills the rows of `area`, which is at least [`Area::around`] the polygon, with the pixels that are
    /// [`inside`] it.
    ///
    /// As x grows, an edge's answer changes from no to yes once. So a binary search finds the first pixel
    /// with a yes, and all pixels from there on are toggled.
    pub fn cover(&mut self, polygon: &[Point], area: &Area) {
        self.clear(area);
        for edge in edges(polygon) {
            let rows = area.y.clone();
            for y in rows
                .skip_while(|&y| !edge.spans(y))
                .take_while(|&y| edge.spans(y))
            {
                let Range { mut start, mut end } = area.x;
                while start < end {
                    let middle = (start + end) / 2;
                    if edge.crosses_left_of(middle, y) {
                        end = middle;
                    } else {
                        start = middle + 1;
                    }
                }
                self.toggle_from(start, y);
            }
        }
    }
}
