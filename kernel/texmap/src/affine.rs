//! The affine column mapper: texture coordinates stepped down the column in 16.16.
//!
//! [`Sides`] has the coordinates along a polygon's sides, and makes the walk down a run: exactly
//! between the two crossings, or by chapter 57's half steps. For a triangle that is one affine map:
//! where it is moderate, [`Map`] has it, and its walks at a fraction of the cost. [`column()`] draws
//! one.
//!
//! Legal input of the mapper: a walk as these make it (inside the texture). Error against the exact
//! affine coordinates: the step is cut to 2^-16 texel towards zero, so after n pixels the
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

/// The one affine map of a triangle: both gradients once, and then no division in a run unless it
/// is cut at the texture's border.
///
/// Legal input: three corners that lie within [`Map::REACH`] of the screen's middle in x and in y,
/// in the texture or on its border, and less than 256 texels a pixel across and down the screen.
/// Of others there is none, and [`Sides`] has their walks.
///
/// Error against the exact affine coordinates: less than 3 2^-16 texel at the first pixel (see
/// [`Map::new`]; it is rounded down besides), and after n pixels less than n 2^-16 more, the step
/// being cut towards zero.
#[derive(Clone, Copy, Debug)]
pub struct Map {
    u: Gradient,
    v: Gradient,
    /// The last coordinate inside the texture, across and down.
    last: (i32, i32),
    /// Whether no corner is so near the texture's border that rounding could lead out of it.
    inside: bool,
}

/// A coordinate that is linear on the screen; 32 fraction bits, steps within +-2^40.
#[derive(Clone, Copy, Debug)]
struct Gradient {
    /// At the centre of pixel (0, 0): below 2^52.
    origin: i64,
    right: i64,
    down: i64,
    /// `down` as a walk has it: 16 fraction bits, cut towards zero.
    step: i32,
}

impl Map {
    /// How far a corner may be from the screen's middle in either direction: 512 pixels, in 1/256
    /// pixel.
    pub const REACH: i32 = 512 * 256;

    /// That of `polygon` in `texture`, if it has one in the legal range.
    #[inline]
    pub fn new(polygon: &[Vertex], texture: &Texture<'_>) -> Option<Self> {
        let [a, b, c] = polygon else {
            return None;
        };
        let last = texture.last();
        let near = |at: i32, pixels: usize| {
            let middle = pixels as i32 * 128;
            (middle - Self::REACH..=middle + Self::REACH).contains(&at)
        };
        let legal = |at: &Vertex| {
            near(at.x, WIDTH)
                && near(at.y, HEIGHT)
                && (0..=last.0 + 1).contains(&at.u)
                && (0..=last.1 + 1).contains(&at.v)
        };
        if !(legal(a) && legal(b) && legal(c)) {
            return None;
        }
        // Differences of places are at most 2^18, of coordinates 2^24. Three points lie in a box:
        // what they span is no larger than it, 2^36, and 2^42 with a coordinate for a side.
        let spanned = |p: (i32, i32), q: (i32, i32)| {
            i64::from(p.0) * i64::from(q.1) - i64::from(p.1) * i64::from(q.0)
        };
        let (x, y) = ((b.x - a.x, c.x - a.x), (b.y - a.y, c.y - a.y));
        let area = spanned(x, y);
        if area == 0 {
            return None;
        }
        // One division. Off by less than 1, it moves a gradient by less than 2^42 2^-38, 2^-28
        // texel a pixel, and over 2^10 pixels each way a coordinate by 2^-17; the gradients' own
        // last places and the origin's are less than another 2^-20.
        let over = (1 << 62) / area;
        let gradient = |at: [i32; 3]| {
            let change = (at[1] - at[0], at[2] - at[0]);
            // n / area 2^24 is below 2^40.
            let [right, down] = [spanned(change, y), spanned(x, change)].map(|n| {
                (n.abs() < area.abs() << 16)
                    .then(|| ((i128::from(n) * i128::from(over)) >> 38) as i64)
            });
            let (right, down) = (right?, down?);
            let to_origin = right * i64::from(128 - a.x) + down * i64::from(128 - a.y);
            Some(Gradient {
                origin: (i64::from(at[0]) << 16) + (to_origin >> 8),
                right,
                down,
                step: (down / (1 << 16)) as i32,
            })
        };
        // 3 2^-16 texel at the first pixel; the step, cut towards zero, leads no further out.
        let clear = |at: [i32; 3], last: i32| at.iter().all(|at| (4..last - 4).contains(at));
        let (u, v) = ([a.u, b.u, c.u], [a.v, b.v, c.v]);
        Some(Self {
            u: gradient(u)?,
            v: gradient(v)?,
            last,
            inside: clear(u, last.0) && clear(v, last.1),
        })
    }

    /// The map with these values at the centre of pixel (0, 0), and these steps to the right and
    /// down; 32 fraction bits, steps within +-2^40. `inside` tells that no pixel is as near the
    /// texture's border as 4 2^-16 texel.
    pub(crate) fn of(maps: [(i64, i64, i64); 2], texture: &Texture<'_>, inside: bool) -> Self {
        let [u, v] = maps.map(|(origin, right, down)| Gradient {
            origin,
            right,
            down,
            step: (down / (1 << 16)) as i32,
        });
        Self {
            u,
            v,
            last: texture.last(),
            inside,
        }
    }

    /// The walk down a run of [`coverage::spans`] or [`coverage::columns`].
    ///
    /// Where the first or the last pixel comes to lie outside the texture, which only rounding and
    /// the far border bring about, both are clamped into it, and the step is what lies between.
    #[inline]
    pub fn walk<End>(&self, run: &Run<End>) -> Walk {
        let (x, y) = (i64::from(run.line), i64::from(run.first));
        let steps = i64::from(run.len) - 1;
        let walk = |along: &Gradient, last: i32| {
            let first = along.origin + x * along.right + y * along.down;
            let start = first >> 16;
            if self.inside {
                return (start as i32, along.step);
            }
            let stop = start + steps * i64::from(along.step);
            // Without a sign, what is below zero is above every size.
            let inside = |at: i64| at as u64 <= last as u64;
            if inside(start) && inside(stop) {
                return (start as i32, along.step);
            }
            let clamped = |at: i64| at.clamp(0, last.into()) as i32;
            let start = clamped(start);
            let stop = clamped((first + steps * along.down) >> 16);
            // A run of one pixel has no step.
            (start, (stop - start) / (steps as i32).max(1))
        };
        let (u, du) = walk(&self.u, self.last.0);
        let (v, dv) = walk(&self.v, self.last.1);
        Walk { u, v, du, dv }
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
