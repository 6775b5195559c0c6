//! The mapper that stays within an error: the cheapest way to map each span that keeps to a tolerance.
//!
//! For every polygon, and then for every span, closed forms bound the error of each way to map it against the
//! quotients. Of the ways that keep to the [`Tolerance`], the mapper uses the cheapest. From the cheapest on:
//!
//! | way | cost | applies to |
//! | --- | --- | --- |
//! | an affine map | nothing but its steps | a polygon |
//! | a line | two quotients | a span; one test shows where all spans of a polygon can be lines |
//! | shorter lines | a quotient each, see [`super::adaptive`] | a span |
//! | quotients | one for every pixel | the rest of a span |
//!
//! The quotients have error 0, so a way always exists.
//!
//! Quadratic pieces are not among the ways. A quadratic piece of 16 pixels costs more than 16 quotients, and
//! a piece of 32 pixels three quarters as much as 32 quotients, while lines of eight pixels cost a third. So
//! a quadratic could help only where the error of such lines is too large and the error of such a curve is
//! not, which is where the depth changes by less than a third over the curve. In random faces that is at most
//! 1 % of the pixels for errors down to 1/16 texel, and 7 % for 1/256 texel (`tests/within.rs` prints the
//! shares and checks them).
//!
//! # One affine map
//!
//! A face that is small, or hardly tilted, needs no quotient for its spans at all. Let f = n / c be a texture
//! coordinate, where n is the form a or b. For any f0 and c0, the linear function A = f0 + (n - f0 c) / c0
//! differs from f by
//!
//! ```text
//! f - A = (A - f0) (c0 - c) / c
//! ```
//!
//! exactly. Both factors of the numerator are linear, so over a polygon neither is larger in magnitude than
//! at some corner, and c is nowhere less than at some corner. With f0 and c0 in the middle of the corners'
//! values, the error is at most a quarter of the product of the changes of A and of c over the polygon,
//! divided by the least c.
//!
//! # Lines
//!
//! All columns of a polygon have the same c', the change of c per pixel, and D is linear across the columns
//! ([`crate::plane::bounds`] defines D and R). So an R computed from the larger |D| of the first and the last
//! column serves all columns, and for most columns two multiplications then show that the column can be a
//! line. Where they do not show it, or an end of the column is clamped, the column's own R decides.
//!
//! # Columns or rows
//!
//! The depth of a floor changes fast down its columns and hardly along its rows, so lines are many times
//! longer along rows. By the closed form, a line that keeps to a tolerance T is sqrt(4 T c^3 / |D c'|) pixels
//! long, where c' is the change of c along the line. So at some places of the polygon the mapper computes the
//! length and the cost of lines in both directions. The axis with the smaller total cost becomes the
//! polygon's axis. The covered pixels do not depend on the axis ([`crate::scan`]).
//!
//! A pixel costs about the same in both directions. A piece of a row is made once in the order of the
//! polygons and in RAM, but four times in the order of the planes. As a compromise it counts as
//! [`ROW`] pieces of a column. So rows are used where they gain much, and may still lose a little
//! in the order of the planes. A mapper does not know the order, and no pixel depends on the order.

use super::adaptive::{self, AdaptivePieces, EXACT, LENGTHS, PIECE};
use super::affine::{self, AffineMap};
use super::mapped_span::{MappedSpan, SpanKind};
use crate::geometry::{Axis, Dropped, Texture, Vertex};
use crate::loops::Loop;
use crate::plane::bounds::Chords;
use crate::plane::{Face, Form, Plane, PlaneStepper, Reciprocal, ReciprocalAbove, Tolerance};
use crate::scan::{Span, spans};
use modex::{HEIGHT, WIDTH};

/// The assumed cost of making a piece of a row, in pieces of a column.
pub const ROW: u32 = 2;

/// The extent of a polygon: its bounding box on the screen, and the middle of its texture coordinates.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// The part on the screen, in 1/256 pixel: left, top, right, bottom.
    borders: [i32; 4],
    /// Whether the whole polygon lies on the screen.
    is_whole: bool,
    /// The middle of its texture coordinates, across and down.
    about: [i32; 2],
}

impl Extent {
    /// Returns the bounding box of a polygon, or nothing if it does not overlap the screen.
    fn new(polygon: &[Vertex]) -> Option<Self> {
        let (mut least, mut most) = ([i32::MAX; 4], [i32::MIN; 4]);
        for vertex in polygon {
            for (k, at) in [vertex.x, vertex.y, vertex.u, vertex.v]
                .into_iter()
                .enumerate()
            {
                least[k] = least[k].min(at);
                most[k] = most[k].max(at);
            }
        }
        let (width, height) = (WIDTH as i32 * 256, HEIGHT as i32 * 256);
        let [left, top] = [least[0].max(0), least[1].max(0)];
        let [right, bottom] = [most[0].min(width), most[1].min(height)];
        (left < right && top < bottom).then(|| Self {
            borders: [left, top, right, bottom],
            is_whole: least[0] >= 0 && least[1] >= 0 && most[0] <= width && most[1] <= height,
            about: [2, 3].map(|k| (least[k] >> 1) + (most[k] >> 1)),
        })
    }

    /// Passes corners that enclose the polygon's part on the screen to `sink`, relative to the centre of
    /// pixel (0, 0), in 1/256 pixel: the polygon's own corners, or those of the box.
    #[inline(always)]
    fn corners(&self, polygon: &[Vertex], mut sink: impl FnMut(i64, i64)) {
        let mut corner = |x: i32, y: i32| sink((x - 128).into(), (y - 128).into());
        if self.is_whole {
            for vertex in polygon {
                corner(vertex.x, vertex.y);
            }
        } else {
            let [left, top, right, bottom] = self.borders;
            for (x, y) in [(left, top), (right, top), (left, bottom), (right, bottom)] {
                corner(x, y);
            }
        }
    }

    /// Returns the first and the last pixel, as (x, y), that may have their centre in the box.
    fn pixels(&self) -> [(u16, u16); 2] {
        let [left, top, right, bottom] = self.borders;
        let first = |border: i32| (border >> 8) as u16;
        let last = |border: i32| ((border - 1) >> 8) as u16;
        [(first(left), first(top)), (last(right), last(bottom))]
    }

    /// Returns the limits (near, far) of the polygon's inverse depths on the screen: no value of the form c
    /// is above near or below far. Returns nothing unless both are above zero.
    #[inline]
    fn inverse_depths(&self, polygon: &[Vertex], c: &Form) -> Option<(i64, i64)> {
        let (mut near, mut far) = (i64::MIN, i64::MAX);
        self.corners(polygon, |x, y| {
            // With 8 more bits than at a pixel's centre.
            let c = c.origin * 256 + c.right * x + c.down * y;
            near = near.max(c);
            far = far.min(c);
        });
        let (near, far) = ((near >> 8) + 1, far >> 8);
        (far > 0).then_some((near, far))
    }
}

/// Bits to which the largest inverse depth is reduced for an affine map. That moves a coordinate by less than
/// 3 units of 2^-16 texel anywhere on the screen: each coefficient is off by less than one, which counts for
/// at most 560 pixels (width and height) and 256 texels, and the middle of the inverse depths is at least
/// 2^32, so the coordinate moves by less than 256 x 560 / 2^32 texel.
const DEPTH_BITS: u32 = 34;

/// Returns the affine map of a polygon, if the map keeps to `tolerance` everywhere in the polygon.
fn flat(
    polygon: &[Vertex],
    extent: &Extent,
    (near, far): (i64, i64),
    plane: &Plane,
    texture: &Texture<'_>,
    tolerance: Tolerance,
) -> Option<AffineMap> {
    // A face with smaller inverse depths is seen at a glancing angle; it is not flat.
    let cut = (64 - DEPTH_BITS).checked_sub(near.leading_zeros())?;
    let over_middle = Reciprocal::new((near + far) >> 1 >> cut);
    // Half of the change of c, relative to the least c: 32 fraction bits.
    let relative_slope =
        ReciprocalAbove::new(Reciprocal::new(far)).relative_slope(((near - far) >> 1) + 1);
    let (mut off, mut inside) = (0, true);
    let mut gradient = |n: &Form, about: i32, last: i32| {
        // Any f0 is correct. Clamp it, because the product with an illegal face's coordinate would not fit.
        let about = i64::from(about.clamp(0, last));
        let mut wide = 0;
        let mut slope = |n: i64, c: i64| {
            let (n, c) = (n >> cut, c >> cut);
            wide |= (n ^ n >> 63) >> 45 | (c ^ c >> 63) >> 37;
            over_middle.times_signed((n << 16).wrapping_sub(about.wrapping_mul(c)))
        };
        let right = slope(n.right, plane.c.right);
        let down = slope(n.down, plane.c.down);
        let origin = slope(n.origin, plane.c.origin);
        // A flat face never has more than 2^8 texels per pixel (tested here) or 2^11 texels in all (tested in
        // `gradient`).
        wide |= (right ^ right >> 63 | down ^ down >> 63) >> 40;
        if wide != 0 {
            return None;
        }
        let (mut low, mut high) = (i64::MAX, i64::MIN);
        extent.corners(polygon, |x, y| {
            let at = origin + ((right * x + down * y) >> 8);
            low = low.min(at);
            high = high.max(at);
        });
        let (low, high) = (low >> 16, (high >> 16) + 1);
        let change = high.max(-low);
        let error = (u128::from(change as u64) * u128::from(relative_slope)) >> 32;
        let (low, high) = (low + about, high + about);
        // The amount by which spans are clamped, and the error of the reciprocal's 31 bits.
        let outside = (-low).max(high - i64::from(last)).max(0);
        off = off.max(error as i64 + outside + (change >> 28));
        // A coordinate is off by up to 3 2^-16 texel at the first pixel.
        inside &= low >= 4 && high < i64::from(last) - 4;
        Some((origin + (about << 16), right, down))
    };
    let last = texture.last();
    let u = gradient(&plane.a, extent.about[0], last.0)?;
    let v = gradient(&plane.b, extent.about[1], last.1)?;
    // The step is cut once per pixel; the first coordinate and the forms are cut once per span.
    let [_, top, _, bottom] = extent.borders;
    let rounded = i64::from((bottom - top) >> 8) + 7;
    (off + rounded <= tolerance.units().into()).then(|| AffineMap::of([u, v], texture, inside))
}

/// Passes the spans of a face to `sink`.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub(crate) fn map(
    tolerance: Tolerance,
    face: &Face<'_>,
    texture: &Texture<'_>,
    sink: &mut dyn FnMut(MappedSpan),
) -> Result<(), Dropped> {
    let within = Within::new(face.polygon, face.plane(), texture, tolerance);
    if let Some(map) = within.map() {
        return affine::map_by(map, Loop::fastest(), face, sink);
    }
    let axis = within.axis();
    let mut kind = within.kinds(texture);
    spans(axis, face.polygon, |span| {
        sink(MappedSpan::new(axis, &span, kind(&span)));
    })
}

/// Maps a polygon's spans within an error.
#[derive(Clone, Copy, Debug)]
pub struct Within {
    plane: Plane,
    tolerance: Tolerance,
    by: By,
}

/// The direction of a polygon's spans, and what holds for all of them.
#[derive(Clone, Copy, Debug)]
enum By {
    /// Columns of one affine map.
    Map(AffineMap),
    /// Columns. The chords use the largest |D| of all columns, and the tolerance is reduced by one unit for
    /// each pixel of the longest column.
    Columns(Option<Chords>),
    /// Rows.
    Rows,
}

impl Within {
    /// Returns the mapper of a polygon whose texture lies in `plane`.
    #[inline]
    pub fn new(
        polygon: &[Vertex],
        plane: Plane,
        texture: &Texture<'_>,
        tolerance: Tolerance,
    ) -> Self {
        let by = || {
            let extent = Extent::new(polygon)?;
            let limits = extent.inverse_depths(polygon, &plane.c);
            let flat = |limits| flat(polygon, &extent, limits, &plane, texture, tolerance);
            if let Some(map) = limits.and_then(flat) {
                return Some(By::Map(map));
            }
            if axis(polygon, &extent, &plane, tolerance) == Axis::Right {
                return Some(By::Rows);
            }
            let (near, _) = limits?;
            let [(left, top), (right, bottom)] = extent.pixels();
            let columns = [left, right].map(|x| PlaneStepper::new(&plane, Axis::Down, x, top));
            let tolerance = tolerance.units().saturating_sub((bottom - top).into());
            Some(By::Columns(Some(Chords::new(&columns, near, tolerance))))
        };
        Self {
            plane,
            tolerance,
            by: by().unwrap_or(By::Columns(None)),
        }
    }

    /// Returns the single affine map of all columns, if one keeps to the tolerance.
    pub fn map(&self) -> Option<&AffineMap> {
        match &self.by {
            By::Map(map) => Some(map),
            _ => None,
        }
    }

    /// Returns the direction of the spans.
    pub fn axis(&self) -> Axis {
        match self.by {
            By::Rows => Axis::Right,
            _ => Axis::Down,
        }
    }

    /// Returns a function that makes the kind of each span. Call it with the polygon's spans along
    /// [`Within::axis`], one after the other.
    pub fn kinds<'t>(&'t self, texture: &'t Texture<'t>) -> impl FnMut(&Span<()>) -> SpanKind + 't {
        let Self {
            plane,
            tolerance,
            by,
        } = self;
        // A span that is at least as long as a span that failed to be a line is not tried: neighbours are
        // alike.
        let mut too_long = u16::MAX;
        move |span| {
            let axis = match by {
                By::Map(map) => return SpanKind::Affine(map.stepper(span)),
                By::Columns(_) => Axis::Down,
                By::Rows => Axis::Right,
            };
            let stepper = PlaneStepper::along(plane, axis, span.line, span.first);
            if let By::Columns(Some(chords)) = by
                && chords.keep(&stepper, span.len - 1)
                && let Some(line) = adaptive::whole(&stepper, span.len, texture)
            {
                return SpanKind::Affine(line);
            }
            if span.len < too_long {
                let mut pieces = AdaptivePieces::new(&stepper, span.len, None, *tolerance, texture);
                match pieces.next() {
                    Some(piece) if piece.len == span.len => return SpanKind::Affine(piece.stepper),
                    _ => too_long = span.len,
                }
            }
            SpanKind::Adaptive(stepper, *tolerance)
        }
    }
}

/// Below this number of pixels a span has few pieces in either direction.
const SHORT: u16 = 32;

/// Returns the axis along which a polygon's lines cost less, summed over its corners.
fn axis(polygon: &[Vertex], extent: &Extent, plane: &Plane, tolerance: Tolerance) -> Axis {
    let [(left, top), (right, bottom)] = extent.pixels();
    if right - left < SHORT && bottom - top < SHORT {
        return Axis::Down;
    }
    // In 1/256 of the cost of a line's pixel.
    let cost = |axis: Axis, steps: u16, piece: u32, (x, y): (u16, u16)| {
        let stepper = PlaneStepper::new(plane, axis, x, y);
        let (c, exact) = (stepper.at[2], EXACT << 8);
        if c <= 0 {
            return exact;
        }
        let chords = Chords::new(&[stepper], c, tolerance.units());
        let near = chords.cut(c);
        let mut lengths = [steps].into_iter().chain(LENGTHS);
        let length = lengths.find(|&length| !chords.is_short_of(length, near));
        length.map_or(exact, |length| {
            let line = (1 << 8) + (piece << 8) / u32::from(length.min(steps).max(1));
            line.min(exact)
        })
    };
    let (mut columns, mut rows) = (0, 0);
    for vertex in polygon {
        let at = |border: i32, first: u16, last: u16| {
            (border >> 8).clamp(first.into(), last.into()) as u16
        };
        let place = (at(vertex.x, left, right), at(vertex.y, top, bottom));
        columns += cost(Axis::Down, bottom - top, PIECE, place);
        rows += cost(Axis::Right, right - left, ROW * PIECE, place);
    }
    match rows < columns {
        true => Axis::Right,
        false => Axis::Down,
    }
}
