//! The cheapest way that keeps to an error.
//!
//! For every polygon, and then for every run, [`crate::bounds`] says how far each way to map it may be
//! from the quotients; of those that keep to the [`Tolerance`] the cheapest is taken. The quotients
//! themselves are 0 off, so there always is one.
//!
//! # Flat
//!
//! A small face, or one that hardly leans, needs no quotient for its runs at all. With f0 = n0 / c0 at a
//! pixel in the middle of it and A the linear function that has f's value and slopes there,
//!
//! ```text
//! f - A = (A - f0) (c0 - c) / c
//! ```
//!
//! exactly: n = n0 + c0 (A - f0) + f0 (c - c0). Both factors are linear, so over a polygon neither is
//! larger than at a corner, and c is nowhere less. That is one bound for the polygon; A is three
//! numbers for each coordinate, and a run takes two multiplications.

use core::fmt;

use crate::bounds::{Above, Bend, passes};
use crate::coverage::Axis;
use crate::job;
use crate::plane::{Plane, Walk};
use crate::runs::{Pieces, Reciprocal, between};
use crate::{Texture, Vertex, affine};
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

/// What must be to gain by halving a run, as a [`Cost`]: two more bounds to find, and as much again.
const HALVING: u32 = 2400;

/// A way to map a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Linear pieces.
    Linear(Pieces),
    /// Quadratic pieces.
    Quadratic(Pieces),
    /// A quotient for every pixel.
    Exact,
}

/// What a way takes, in 1/16 of what a pixel of an affine column takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// For the run.
    pub run: u32,
    /// For every piece.
    pub piece: u32,
    /// For every pixel.
    pub pixel: u32,
}

impl Way {
    /// All of them, with what they take.
    pub const ALL: &'static [(Self, Cost); 10] = &{
        const fn cost(run: u32, piece: u32, pixel: u32) -> Cost {
            Cost { run, piece, pixel }
        }
        const fn linear(steps: u8) -> (Way, Cost) {
            (Way::Linear(Pieces::Of(steps)), cost(100, 100, 16))
        }
        const fn quadratic(pieces: Pieces) -> (Way, Cost) {
            (Way::Quadratic(pieces), cost(100, 400, 17))
        }
        [
            (Way::Linear(Pieces::Whole), cost(0, 0, 16)),
            linear(64),
            linear(32),
            linear(16),
            linear(8),
            linear(4),
            quadratic(Pieces::Whole),
            quadratic(Pieces::Of(32)),
            quadratic(Pieces::Of(16)),
            (Way::Exact, cost(100, 0, 44)),
        ]
    };

    /// What it takes for a run of `len` pixels.
    pub const fn cost(self, Cost { run, piece, pixel }: Cost, len: u16) -> u32 {
        let steps = if len > 1 { len as u32 - 1 } else { 1 };
        let pieces = match self {
            Self::Linear(Pieces::Of(of)) | Self::Quadratic(Pieces::Of(of)) => {
                steps.div_ceil(of as u32)
            }
            _ => 1,
        };
        run + piece * pieces + pixel * len as u32
    }

    /// The most that it is off, in 2^-16 texel.
    pub fn bound(self, bend: &Bend) -> u32 {
        match self {
            Self::Linear(pieces) => bend.linear(pieces),
            Self::Quadratic(pieces) => bend.quadratic(pieces),
            Self::Exact => 0,
        }
    }

    /// Whether half a run of `len` pixels would gain by a single linear piece in place of this.
    fn slow(self, len: u16) -> bool {
        let own = Self::ALL.iter().find(|(way, _)| *way == self);
        own.is_some_and(|&(way, cost)| {
            let (whole, least) = Self::ALL[0];
            way.cost(cost, len) > whole.cost(least, len) + 2 * HALVING
        })
    }

    /// The cheapest for the run that keeps to `tolerance`.
    pub fn cheapest(bend: &Bend, tolerance: Tolerance) -> Self {
        let keeps = |way: Self| way.bound(bend) <= tolerance.units();
        // No other takes less.
        let (whole, _) = Self::ALL[0];
        if keeps(whole) {
            return whole;
        }
        // Most ways are refused by two multiplications, before their own bound is asked for.
        let steps = u64::from(bend.steps());
        let squared = u64::from(tolerance.units()) * steps * steps;
        let (chord, curve) = (bend.chord_at_least(), bend.curve_at_least());
        let hopeless = |way: Self| match way {
            Self::Linear(Pieces::Of(n)) => chord * u64::from(n).pow(2) > squared,
            Self::Quadratic(Pieces::Of(n)) => curve * u64::from(n).pow(3) > squared * steps,
            Self::Quadratic(_) => curve > tolerance.units().into(),
            _ => false,
        };
        let order = &ORDERS[usize::from(bend.steps()).min(HEIGHT - 1)];
        for &way in order {
            if !hopeless(way) && keeps(way) {
                return way;
            }
        }
        Self::Exact
    }
}

/// The ways but for the first, the cheapest first, for every number of steps.
static ORDERS: [[Way; Way::ALL.len() - 1]; HEIGHT] = {
    let mut orders = [[Way::Exact; Way::ALL.len() - 1]; HEIGHT];
    let mut steps = 0;
    while steps < HEIGHT {
        let order = &mut orders[steps];
        let mut costs = [0; Way::ALL.len() - 1];
        let mut way = 1;
        while way < Way::ALL.len() {
            let (new, cost) = Way::ALL[way];
            let cost = new.cost(cost, steps as u16 + 1);
            let mut place = way - 1;
            while place > 0 && costs[place - 1] > cost {
                order[place] = order[place - 1];
                costs[place] = costs[place - 1];
                place -= 1;
            }
            order[place] = new;
            costs[place] = cost;
            way += 1;
        }
        steps += 1;
    }
    orders
};

/// The affine map of a whole polygon that touches its plane's quotients in the middle.
#[derive(Clone, Copy, Debug)]
struct Flat {
    /// The pixel in the middle.
    middle: (i32, i32),
    /// u and v there, and what they grow by to the right and down: 32 fraction bits.
    maps: [[i64; 3]; 2],
    /// What the tolerance leaves for a run's fixed point and its clamped ends, 2^-16 texel.
    spare: i64,
    last: (i32, i32),
}

impl Flat {
    /// That of a polygon, if there is one that keeps to `tolerance`.
    fn new(
        polygon: &[Vertex],
        plane: &Plane,
        texture: &Texture<'_>,
        tolerance: Tolerance,
    ) -> Option<Self> {
        let span = |of: fn(&Vertex) -> i32, end: usize| {
            let end = end as i32 * 256;
            let (mut least, mut most) = (end, 0);
            for vertex in polygon {
                least = least.min(of(vertex));
                most = most.max(of(vertex));
            }
            (least.max(0), most.min(end), 0 <= least && most <= end)
        };
        let (left, right, inside_x) = span(|vertex| vertex.x, WIDTH);
        let (top, bottom, inside_y) = span(|vertex| vertex.y, HEIGHT);
        if left >= right || top >= bottom {
            return None;
        }
        let middle = ((left + right) >> 9, (top + bottom) >> 9);
        let at = |form: crate::plane::Form| form.at(middle.0 as u16, middle.1 as u16);
        let (a, b, c) = (at(plane.a), at(plane.b), at(plane.c));
        if c <= 0 {
            return None;
        }
        let reciprocal = Reciprocal::new(c);
        // The middle of what the corners span may lie outside the polygon, and the texture.
        let quotient = |n: i64| {
            let inside = n.abs() >> 8 < c;
            let size = inside.then(|| reciprocal.times(n.abs()))?;
            Some(if n < 0 { -size } else { size })
        };
        let (u, v) = (quotient(a)?, quotient(b)?);
        let inverse = Above::new(reciprocal);
        // A slope of more texels a pixel than this has no place in a polygon that is nearly flat.
        let steep = 1 << 40;
        let slope = |n: i64, step: i64, c_step: i64| {
            let d = passes((n, step), (c, c_step));
            let pace = inverse.pace(d.unsigned_abs());
            let slope = (pace < steep).then_some(pace as i64)?;
            Some(if d > 0 { -slope } else { slope })
        };
        let map = |at: i32, n: i64, form: crate::plane::Form| {
            let right = slope(n, form.right, plane.c.right)?;
            let down = slope(n, form.down, plane.c.down)?;
            Some([i64::from(at) << 16, right, down])
        };
        let maps = [map(u, a, plane.a)?, map(v, b, plane.b)?];
        // How far A, and c, get from their values in the middle.
        let (mut change, mut lean) = (0u64, 0u64);
        let mut corner = |x: i32, y: i32| {
            let (dx, dy) = (
                i64::from(x - middle.0 * 256 - 128),
                i64::from(y - middle.1 * 256 - 128),
            );
            let across = |right: i64, down: i64| (right * dx + down * dy).unsigned_abs();
            for [_, right, down] in maps {
                change = change.max(across(right, down));
            }
            lean = lean.max(across(plane.c.right, plane.c.down));
        };
        if inside_x && inside_y {
            for vertex in polygon {
                corner(vertex.x, vertex.y);
            }
        } else {
            for (x, y) in [(left, top), (right, top), (left, bottom), (right, bottom)] {
                corner(x, y);
            }
        }
        let lean = (lean >> 8) as i64 + 1;
        let least = c - lean;
        // Where A is off by more than the texture's size nothing is left of the estimate.
        if least <= 0 || change >= 1 << 50 {
            return None;
        }
        let lean = Above::new(Reciprocal::new(least)).lean(lean);
        let off = (u128::from(change) * u128::from(lean)) >> 56;
        let spare = i64::from(tolerance.units()) - off.min(1 << 40) as i64 - 4;
        (spare > 0).then_some(Self {
            middle,
            maps,
            spare,
            last: texture.last(),
        })
    }

    /// The walk down a column's run, unless its own part of the error is too large.
    #[inline]
    fn walk(&self, x: u16, y: u16, len: u16) -> Option<affine::Walk> {
        let steps = len - 1;
        let (dx, dy) = (
            i64::from(x) - i64::from(self.middle.0),
            i64::from(y) - i64::from(self.middle.1),
        );
        let [u, v] = self.maps.map(|[at, right, down]| {
            let start = at + right * dx + down * dy;
            (start, start + i64::from(steps) * down, down)
        });
        let inside = |(start, end, _): (i64, i64, i64), last: i32| {
            let range = 0..=(i64::from(last) << 16) + 0xFFFF;
            range.contains(&start) && range.contains(&end)
        };
        if i64::from(steps) > self.spare {
            return None;
        }
        if inside(u, self.last.0) && inside(v, self.last.1) {
            let step = |down: i64| (down / (1 << 16)) as i32;
            return Some(affine::Walk {
                u: (u.0 >> 16) as i32,
                v: (v.0 >> 16) as i32,
                du: step(u.2),
                dv: step(v.2),
            });
        }
        let mut outside = 0;
        let mut clamped = |value: i64, last: i32| {
            let value = value >> 16;
            let inside = value.clamp(0, last.into());
            outside = outside.max((value - inside).abs());
            inside as i32
        };
        let from = (clamped(u.0, self.last.0), clamped(v.0, self.last.1));
        let to = (clamped(u.1, self.last.0), clamped(v.1, self.last.1));
        (i64::from(steps) + outside < self.spare).then(|| between(from, to, steps))
    }
}

/// What maps a polygon's runs within an error.
#[derive(Clone, Copy, Debug)]
pub struct Within {
    plane: Plane,
    flat: Option<Flat>,
    tolerance: Tolerance,
}

impl Within {
    /// That of a polygon whose texture lies in `plane`.
    pub fn new(
        polygon: &[Vertex],
        plane: Plane,
        texture: &Texture<'_>,
        tolerance: Tolerance,
    ) -> Self {
        Self {
            plane,
            flat: Flat::new(polygon, &plane, texture, tolerance),
            tolerance,
        }
    }

    /// The walk down a run of `len` pixels from (x, y), if the polygon's affine map is good enough
    /// for it.
    #[inline]
    pub fn flat(&self, x: u16, y: u16, len: u16) -> Option<affine::Walk> {
        self.flat.as_ref()?.walk(x, y, len)
    }

    /// Gives `sink` the parts of a run of `len` pixels from (x, y) down: the first pixel of each, its
    /// pixels, and its walk.
    #[inline]
    pub fn parts(
        &self,
        (x, y): (u16, u16),
        len: u16,
        texture: &Texture<'_>,
        sink: &mut impl FnMut(u16, u16, job::Walk),
    ) {
        if let Some(walk) = self.flat(x, y, len) {
            return sink(y, len, job::Walk::Affine(walk));
        }
        let walk = Walk::new(&self.plane, Axis::Down, x, y);
        self.cut(walk, y, len, texture, sink);
    }

    /// Those of a run that needs quotients. What suits the far half may be too good for the near one:
    /// a run that leans far enough, and takes its time, is halved.
    fn cut(
        &self,
        mut walk: Walk,
        y: u16,
        len: u16,
        texture: &Texture<'_>,
        sink: &mut impl FnMut(u16, u16, job::Walk),
    ) {
        let bend = Bend::new(&walk, len, texture);
        let way = Way::cheapest(&bend, self.tolerance);
        if way != Way::Linear(Pieces::Whole) && way.slow(len) && bend.leans(len / 2) {
            let half = len / 2;
            self.cut(walk, y, half, texture, sink);
            walk.at = walk.after(half);
            return self.cut(walk, y + half, len - half, texture, sink);
        }
        let walk = match way {
            Way::Linear(Pieces::Whole) => {
                let [from, to] = bend.ends;
                job::Walk::Affine(between(from, to, len - 1))
            }
            Way::Linear(pieces) => job::Walk::Linear(walk, pieces),
            Way::Quadratic(pieces) => job::Walk::Quadratic(walk, pieces),
            Way::Exact => job::Walk::Exact(walk),
        };
        sink(y, len, walk);
    }
}
