//! The affine column mapper: texture coordinates stepped down the column in 16.16.
//!
//! [`Sides`] has the coordinates along a polygon's sides, and makes the walk down a run: exactly
//! between the two crossings, or by chapter 57's half steps. [`column`] draws one.
//!
//! Legal input of the mapper: a walk as [`Sides`] makes it (inside the texture). Error against the
//! exact affine coordinates: the step is cut to 2^-16 texel towards zero, so after n pixels the
//! coordinate is off by less than n 2^-16 texel, at most 0.0037 over 240. The half steps are
//! another rule: see [`Sides::half_step`].

use modex::{Column, HEIGHT, WIDTH};

use crate::along::Along;
use crate::coverage::{self, Axis, Dropped, Run};
use crate::{MAX_SIDES, Texture, Vertex};

/// The texture coordinates along a side of the polygon.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    u: Along,
    v: Along,
}

impl Side {
    /// The side from `a` to `b` in either order, at the lines that go along `axis`; of one that
    /// crosses none nobody asks.
    fn new(a: &Vertex, b: &Vertex, axis: Axis) -> Self {
        let (across, lines): (fn(&Vertex) -> i32, _) = match axis {
            Axis::Down => (|vertex| vertex.x, WIDTH),
            Axis::Right => (|vertex| vertex.y, HEIGHT),
        };
        // Always forward: neighbours walk a shared edge with the same bits.
        let (a, b) = if across(a) <= across(b) {
            (a, b)
        } else {
            (b, a)
        };
        let (from, to) = (across(a), across(b));
        let Some((first, _)) = coverage::crossed(from, to, lines as i32) else {
            return Self::default();
        };
        let length = i64::from(to) - i64::from(from);
        let offset = i64::from(coverage::offset(first, from));
        let along = |a: i32, b: i32| Along::new(a, i64::from(b - a), length, first, offset, 16);
        Self {
            u: along(a.u, b.u),
            v: along(a.v, b.v),
        }
    }
}

/// A walk through the texture, 16.16.
///
/// For every pixel i of its run, `u + i du` and `v + i dv` lie inside the texture: the two end
/// values were clamped into it and the steps are cut towards zero, so nothing between can leave
/// it. The mapper does not clamp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Walk {
    /// Across the texture, at the first pixel's centre.
    pub u: i32,
    /// Down the texture, at the first pixel's centre.
    pub v: i32,
    /// Step of `u` from a pixel to the next.
    pub du: i32,
    /// Step of `v` from a pixel to the next.
    pub dv: i32,
}

impl Walk {
    /// The walk from pixel `pixels` of this one on, in steps of `stride` pixels.
    pub fn every(&self, stride: i32, pixels: i32) -> Self {
        let Self { u, v, du, dv } = *self;
        Self {
            u: u + pixels * du,
            v: v + pixels * dv,
            du: stride * du,
            dv: stride * dv,
        }
    }
}

/// The coordinates, pixel after pixel.
impl Iterator for Walk {
    type Item = (i32, i32);

    fn next(&mut self) -> Option<(i32, i32)> {
        let here = (self.u, self.v);
        // The last addition steps past the run; |u| and |du| are below 2^25, so it fits.
        self.u += self.du;
        self.v += self.dv;
        Some(here)
    }
}

/// The texture coordinates along all sides of a polygon.
#[derive(Debug)]
pub struct Sides {
    sides: [Side; MAX_SIDES],
    /// The last coordinate inside the texture, across and down.
    last: (i32, i32),
}

impl Sides {
    /// Those of `polygon` in `texture`, at the lines that go along `axis`.
    ///
    /// # Errors
    /// A polygon outside the legal range, or coordinates outside the texture.
    pub fn new(polygon: &[Vertex], texture: &Texture<'_>, axis: Axis) -> Result<Self, Dropped> {
        coverage::check(polygon)?;
        let (width, height) = (texture.width(), texture.height());
        let inside = |vertex: &Vertex| {
            (0..=i32::from(width) << 16).contains(&vertex.u)
                && (0..=i32::from(height) << 16).contains(&vertex.v)
        };
        if !polygon.iter().all(inside) {
            return Err(Dropped::OutOfRange);
        }
        let mut sides = [Side::default(); MAX_SIDES];
        for (i, a) in polygon.iter().enumerate() {
            sides[i] = Side::new(a, &polygon[(i + 1) % polygon.len()], axis);
        }
        Ok(Self {
            sides,
            last: texture.last(),
        })
    }

    /// The walk along a run of [`coverage::runs`] on the same axis.
    ///
    /// The coordinates at the first and the last pixel's centre are interpolated between the two
    /// crossings, then clamped into the texture; the step between them is cut towards zero.
    pub fn walk(&self, run: &Run) -> Walk {
        let [top, bottom] = run.between;
        // 24 fraction bits of height keep 2^-8 texel even where a whole texture is squeezed into
        // 1/256 pixel. A height below 2^9 pixels then has at most 33 bits and its product with a
        // difference of coordinates (28 bits with 20 of fraction) fits; taller ones are scaled
        // down.
        let mut height = (bottom.at - top.at) >> 8;
        let offset = |row: i64| (((row << 32) + (1 << 31)) - top.at) >> 8;
        let (first, len) = (i64::from(run.first), i64::from(run.len));
        let (mut start, mut stop) = (offset(first), offset(first + len - 1));
        let excess = (64 - height.max(1).leading_zeros()).saturating_sub(34);
        for length in [&mut height, &mut start, &mut stop] {
            *length >>= excess;
        }
        let at = |along: fn(&Side) -> &Along, offset: i64, last: i32| {
            let [from, to] = self.ends(run, along).map(|end| end >> 12);
            let part = if height > 0 {
                (to - from) * offset.clamp(0, height) / height
            } else {
                0
            };
            (((from + part) >> 4) as i32).clamp(0, last)
        };
        let (u, v) = (
            at(|s| &s.u, start, self.last.0),
            at(|s| &s.v, start, self.last.1),
        );
        let (mut du, mut dv) = (0, 0);
        // A column of one pixel has no step; dividing by len - 1 all the same was the seeds' trap.
        if run.len > 1 {
            let steps = i32::from(run.len) - 1;
            du = (at(|s| &s.u, stop, self.last.0) - u) / steps;
            dv = (at(|s| &s.v, stop, self.last.1) - v) / steps;
        }
        Walk { u, v, du, dv }
    }

    /// The walk by chapter 57's rule, translated to texels that begin at whole numbers.
    ///
    /// It knows pixels, not where in them the crossings lie: the coordinates of the two crossings
    /// are shared out over the n pixels between them in n equal steps, and the first pixel stands
    /// half a step in.
    ///
    /// Error against the exact affine coordinates: half a pixel's worth of texture along the run.
    /// For let the crossings be h pixels apart, the first centre f past the one and the last centre
    /// g before the other: n - 1 + f + g = h, with f and g from 0 to 1. Pixel i is given what
    /// belongs (i + 1/2) h/n past the first crossing, and its centre is i + f past it. The
    /// difference is (1 - t) (1/2 - f) + t (g - 1/2) with t = (i + 1/2)/n: between the two, so
    /// never above 1/2, and 1/2 along the whole run where f = 0 and g = 1. The step is cut to 2^-16
    /// texel towards zero besides, as in [`Sides::walk`].
    pub fn half_step(&self, run: &Run) -> Walk {
        // The first pixel whose centre is not above a crossing, on the screen or off it.
        let cell = |at: i64| (at + (1 << 31) - 1) >> 32;
        let [top, bottom] = run.between.map(|end| cell(end.at));
        // Crossings are off by 2^-23: they may be told on the wrong side of a centre.
        let before = (i64::from(run.first) - top).max(0);
        let steps = (bottom - top).max(before + i64::from(run.len));
        let [u, v] = [
            self.ends(run, |s| &s.u).map(|u| (u, self.last.0)),
            self.ends(run, |s| &s.v).map(|v| (v, self.last.1)),
        ]
        .map(|[(from, last), (to, _)]| {
            let [from, to] = [from, to].map(|end| (end >> 16).clamp(0, i64::from(last) + 1));
            let step = (to - from) / steps;
            // Not from the cut step: what it lost would add up over pixels that nobody sees.
            let first = from + (to - from) * (2 * before + 1) / (2 * steps);
            (first.min(i64::from(last)) as i32, step as i32)
        });
        Walk {
            u: u.0,
            v: v.0,
            du: u.1,
            dv: v.1,
        }
    }

    /// A coordinate where the run's column enters the polygon and where it leaves it.
    fn ends(&self, run: &Run, along: fn(&Side) -> &Along) -> [i64; 2] {
        let line = i32::from(run.line);
        run.between.map(|end| along(&self.sides[end.side]).at(line))
    }
}

/// Draws one column, the texel's index multiplied out for each pixel: the clear twin of
/// [`crate::loops`].
#[inline]
pub fn column(texture: &Texture<'_>, mut walk: Walk, column: Column<'_>) {
    column.fill(|| {
        let (u, v) = (walk.u, walk.v);
        walk = walk.every(1, 1);
        texture.at(u, v)
    });
}
