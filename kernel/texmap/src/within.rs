//! The cheapest way that keeps to an error.
//!
//! For every polygon, and then for every run, a closed form says how far each way to map it may be
//! from the quotients; of those that keep to the [`Tolerance`] the cheapest is taken. From the
//! cheapest on:
//!
//! | way | takes | for |
//! | --- | --- | --- |
//! | one affine map | nothing but its steps | a polygon |
//! | a line | two quotients | a run; where all of a polygon's may be lines that is found out once |
//! | shorter lines | a quotient each, see [`crate::adaptive`] | a run |
//! | quotients | one for every pixel | what is left of a run |
//!
//! The quotients are 0 off, so there always is a way.
//!
//! Quadratic pieces are none of the ways. One of 16 pixels takes longer than its quotients, and one
//! of 32 three quarters of their time, where lines of eight take a third. So they could serve only
//! where such lines err too much and such a curve does not, which is where depth changes by less
//! than a third over it: of the pixels of random faces those are 1 % at most for errors down to
//! 1/16, and 7 % for 1/256 (`tests/within.rs` prints and holds the shares).
//!
//! # One affine map
//!
//! A small face, or one that hardly leans, needs no quotient for its runs at all. For any f0 and c0
//! the linear function A = f0 + (n - f0 c) / c0 differs from f = n / c by
//!
//! ```text
//! f - A = (A - f0) (c0 - c) / c
//! ```
//!
//! exactly. Both factors are linear, so over a polygon neither is larger than at a corner, and c is
//! nowhere less. With f0 and c0 in the middle of what the corners have, that is a quarter of what f
//! and c change by, over the least c.
//!
//! # Lines
//!
//! All columns of a polygon have the same c', and D is linear across them: with the larger one of
//! the first and the last column one R serves them all ([`crate::bounds`]), and of most columns two
//! multiplications tell that they may be lines. Where it does not, or a column's end is clamped,
//! the column's own R is asked for.
//!
//! # Columns or rows
//!
//! A floor's depth changes fast down its columns and hardly along its rows: lines are many times as
//! long there. By the closed form a line that keeps to T is sqrt(4 T c^3 / |D c'|) pixels long, c'
//! being what c changes by along it. So at some of the polygon's places it is asked how long lines
//! would be either way, and what they would take; the axis that takes less, in sum, is the
//! polygon's. Which pixels are covered does not depend on it ([`crate::coverage`]).
//!
//! A pixel takes about the same either way. In the order of the polygons, and in RAM, a piece of a
//! row is made once, but plane by plane four times: in between, it counts as [`ROW`] pieces of a
//! column. So rows are taken where they gain a good deal, and in the order of the planes may still
//! lose a little. A mapper knows no order, and no pixel depends on one.

use core::fmt;

use crate::adaptive::{self, EXACT, LENGTHS, PIECE, Pieces};
use crate::affine::Map;
use crate::bounds::{Above, Chords};
use crate::coverage::{Axis, Run};
use crate::plane::{Form, Plane, Walk};
use crate::runs::Reciprocal;
use crate::{Texture, Vertex, job};
use modex::{HEIGHT, WIDTH};

/// An error that can be accepted: 2^-16 to 256 texels, in 2^-16 texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Tolerance(u32);

impl Tolerance {
    /// The fraction of a texel, rounded down to 2^-16; none below that, or above 256 texels.
    pub const fn new(numerator: u32, denominator: u32) -> Option<Self> {
        if denominator == 0 {
            return None;
        }
        match ((numerator as u64) << 16) / denominator as u64 {
            units @ 1..=0x100_0000 => Some(Self(units as u32)),
            _ => None,
        }
    }

    /// 2^-16 texel.
    pub const fn units(self) -> u32 {
        self.0
    }

    /// A whole number or a fraction of two: `2`, `1/256`.
    pub fn parse(text: &str) -> Option<Self> {
        let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
        Self::new(numerator.parse().ok()?, denominator.parse().ok()?)
    }

    /// A texel.
    pub const TEXEL: Self = Self::part(0);

    /// Half of it, if that is legal.
    pub const fn half(self) -> Option<Self> {
        Self::new(self.0, 1 << 17)
    }

    /// Twice as much, if that is legal.
    pub const fn double(self) -> Option<Self> {
        Self::new(2 * self.0, 1 << 16)
    }

    /// 1 / 2^`bits` texel; at most 16 bits.
    pub(crate) const fn part(bits: u32) -> Self {
        Self(1 << (16 - bits))
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let common = self.0.trailing_zeros().min(16);
        match (self.0 >> common, 1u32 << (16 - common)) {
            (numerator, 1) => write!(f, "{numerator}"),
            (numerator, denominator) => write!(f, "{numerator}/{denominator}"),
        }
    }
}

/// As how many pieces of a column one of a row counts.
pub const ROW: u32 = 2;

/// What a polygon spans.
#[derive(Clone, Copy, Debug)]
struct Span {
    /// On the screen, in 1/256 pixel: left, top, right, bottom.
    borders: [i32; 4],
    /// Whether it lies on the screen.
    is_whole: bool,
    /// The middle of its coordinates in the texture.
    about: [i32; 2],
}

impl Span {
    /// That of a polygon, if it spans any of the screen.
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

    /// Gives `sink` corners between which all of the polygon on the screen lies, from the centre of
    /// pixel (0, 0), in 1/256 pixel: its own, or those of the borders.
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

    /// The first and the last pixel that may have their centre in it, either way.
    fn pixels(&self) -> [(u16, u16); 2] {
        let [left, top, right, bottom] = self.borders;
        let first = |border: i32| (border >> 8) as u16;
        let last = |border: i32| ((border - 1) >> 8) as u16;
        [(first(left), first(top)), (last(right), last(bottom))]
    }

    /// No depth of the polygon on the screen is above the first of these, or below the second; both
    /// are above zero, or there are none.
    #[inline]
    fn depths(&self, polygon: &[Vertex], c: &Form) -> Option<(i64, i64)> {
        let (mut near, mut far) = (i64::MIN, i64::MAX);
        self.corners(polygon, |x, y| {
            // 8 more bits than at a pixel's centre.
            let depth = c.origin * 256 + c.right * x + c.down * y;
            near = near.max(depth);
            far = far.min(depth);
        });
        let (near, far) = ((near >> 8) + 1, far >> 8);
        (far > 0).then_some((near, far))
    }
}

/// Bits that the nearest depth is cut to for an affine map. All over the screen that moves a
/// coordinate by less than 256 texels and 560 pixels over the 2^32 that the middle one has at
/// least: 3 units of 2^-16.
const DEPTH_BITS: u32 = 34;

/// The affine map of a polygon, if it keeps to `tolerance` in all of it.
fn flat(
    polygon: &[Vertex],
    span: &Span,
    (near, far): (i64, i64),
    plane: &Plane,
    texture: &Texture<'_>,
    tolerance: Tolerance,
) -> Option<Map> {
    // A face that is seen at a glancing angle has no such depths; it is not flat.
    let cut = (64 - DEPTH_BITS).checked_sub(near.leading_zeros())?;
    let over_middle = Reciprocal::new((near + far) >> 1 >> cut);
    // Half of what c changes by, against the least: 32 fraction bits.
    let lean = Above::new(Reciprocal::new(far)).lean(((near - far) >> 1) + 1);
    let (mut off, mut inside) = (0, true);
    let mut gradient = |n: &Form, about: i32, last: i32| {
        // Any would do; of an illegal face's the product would not fit.
        let about = i64::from(about.clamp(0, last));
        let mut wide = 0;
        let mut slope = |n: i64, c: i64| {
            let (n, c) = (n >> cut, c >> cut);
            wide |= (n ^ n >> 63) >> 45 | (c ^ c >> 63) >> 37;
            over_middle.slope((n << 16).wrapping_sub(about.wrapping_mul(c)))
        };
        let right = slope(n.right, plane.c.right);
        let down = slope(n.down, plane.c.down);
        let origin = slope(n.origin, plane.c.origin);
        // More texels a pixel than 2^8, or than 2^11 in all, have no place on a face that is flat.
        wide |= (right ^ right >> 63 | down ^ down >> 63) >> 40;
        if wide != 0 {
            return None;
        }
        let (mut low, mut high) = (i64::MAX, i64::MIN);
        span.corners(polygon, |x, y| {
            let at = origin + ((right * x + down * y) >> 8);
            low = low.min(at);
            high = high.max(at);
        });
        let (low, high) = (low >> 16, (high >> 16) + 1);
        let change = high.max(-low);
        let bent = (u128::from(change as u64) * u128::from(lean)) >> 32;
        let (low, high) = (low + about, high + about);
        // What walks are clamped by, and what the reciprocal's 31 bits leave.
        let outside = (-low).max(high - i64::from(last)).max(0);
        off = off.max(bent as i64 + outside + (change >> 28));
        // 3 2^-16 texel at the first pixel.
        inside &= low >= 4 && high < i64::from(last) - 4;
        Some((origin + (about << 16), right, down))
    };
    let last = texture.last();
    let u = gradient(&plane.a, span.about[0], last.0)?;
    let v = gradient(&plane.b, span.about[1], last.1)?;
    // The step is cut at every pixel, the first coordinate and the forms once.
    let [_, top, _, bottom] = span.borders;
    let rounded = i64::from((bottom - top) >> 8) + 7;
    (off + rounded <= tolerance.units().into()).then(|| Map::of([u, v], texture, inside))
}

/// What maps a polygon's runs within an error.
#[derive(Clone, Copy, Debug)]
pub struct Within {
    plane: Plane,
    tolerance: Tolerance,
    by: By,
}

/// How a polygon's runs go, and what is known of all of them.
#[derive(Clone, Copy, Debug)]
enum By {
    /// Columns of one affine map.
    Map(Map),
    /// Columns. In none of them the texture passes faster than here; a pixel for each of the
    /// longest's is taken off the tolerance.
    Columns(Option<Chords>),
    /// Rows.
    Rows,
}

impl Within {
    /// That of a polygon whose texture lies in `plane`.
    #[inline]
    pub fn new(
        polygon: &[Vertex],
        plane: Plane,
        texture: &Texture<'_>,
        tolerance: Tolerance,
    ) -> Self {
        let by = || {
            let span = Span::new(polygon)?;
            let depths = span.depths(polygon, &plane.c);
            let flat = |depths| flat(polygon, &span, depths, &plane, texture, tolerance);
            if let Some(map) = depths.and_then(flat) {
                return Some(By::Map(map));
            }
            if axis(polygon, &span, &plane, tolerance) == Axis::Right {
                return Some(By::Rows);
            }
            let (near, _) = depths?;
            let [(left, top), (right, bottom)] = span.pixels();
            let columns = [left, right].map(|x| Walk::new(&plane, Axis::Down, x, top));
            let tolerance = tolerance.units().saturating_sub((bottom - top).into());
            Some(By::Columns(Some(Chords::new(&columns, near, tolerance))))
        };
        Self {
            plane,
            tolerance,
            by: by().unwrap_or(By::Columns(None)),
        }
    }

    /// The one affine map of all columns, if there is one.
    pub fn map(&self) -> Option<&Map> {
        match &self.by {
            By::Map(map) => Some(map),
            _ => None,
        }
    }

    /// How the runs go.
    pub fn axis(&self) -> Axis {
        match self.by {
            By::Rows => Axis::Right,
            _ => Axis::Down,
        }
    }

    /// Makes the walks of runs, which are those of the polygon along that axis, one after the
    /// other.
    pub fn walks<'t>(&'t self, texture: &'t Texture<'t>) -> impl FnMut(&Run<()>) -> job::Walk + 't {
        let Self {
            plane,
            tolerance,
            by,
        } = self;
        // A run as long as one that was no line is not tried: neighbours are alike.
        let mut too_long = u16::MAX;
        move |run| {
            let (axis, (x, y)) = match by {
                By::Map(map) => return job::Walk::Affine(map.walk(run)),
                By::Columns(_) => (Axis::Down, (run.line, run.first)),
                By::Rows => (Axis::Right, (run.first, run.line)),
            };
            let walk = Walk::new(plane, axis, x, y);
            if let By::Columns(Some(chords)) = by
                && chords.keep(&walk, run.len - 1)
                && let Some(line) = adaptive::whole(&walk, run.len, texture)
            {
                return job::Walk::Affine(line);
            }
            if run.len < too_long {
                let mut pieces = Pieces::new(&walk, run.len, None, *tolerance, texture);
                match pieces.next() {
                    Some(piece) if piece.len == run.len => return job::Walk::Affine(piece.walk),
                    _ => too_long = run.len,
                }
            }
            job::Walk::Adaptive(walk, *tolerance)
        }
    }
}

/// Below so many pixels a run has few pieces, whichever way it goes.
const SHORT: u16 = 32;

/// The axis along which a polygon's lines take less, in the sum of its corners.
fn axis(polygon: &[Vertex], span: &Span, plane: &Plane, tolerance: Tolerance) -> Axis {
    let [(left, top), (right, bottom)] = span.pixels();
    if right - left < SHORT && bottom - top < SHORT {
        return Axis::Down;
    }
    // In 1/256 of what a pixel of a line takes.
    let cost = |axis: Axis, steps: u16, piece: u32, (x, y): (u16, u16)| {
        let walk = Walk::new(plane, axis, x, y);
        let (depth, exact) = (walk.at[2], EXACT << 8);
        if depth <= 0 {
            return exact;
        }
        let chords = Chords::new(&[walk], depth, tolerance.units());
        let depth = chords.cut(depth);
        let mut lengths = [steps].into_iter().chain(LENGTHS);
        let length = lengths.find(|&length| !chords.is_short_of(length, depth));
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
