//! Adaptive subdivision: perspective by linear pieces, each as long as an error allows.
//!
//! Pieces are linear between the quotients at their ends, as in [`crate::runs`]; but how long one
//! is depends on where it lies. Far away the texture bends most. So pieces are made from the run's
//! near end on, and become shorter and shorter; where even the shortest errs too much the rest of
//! the run is exact.
//!
//! # How long
//!
//! A piece of n pixels keeps to the tolerance where the mean of the depths at its ends is large
//! enough ([`crate::bounds`]): one multiplication tells, and no quotient has to be found first. If
//! the whole run keeps to it, it is one piece. Otherwise pieces have the [`LENGTHS`], each the
//! longest that keeps to it there: none is longer than the one before, since depth falls. What is
//! left over at the far end may be shorter, and is judged as if it were not.
//!
//! Error: no more than the tolerance, which pays for everything: the chords, their ends (rounded
//! down, and clamped into the texture), and steps that are cut towards zero. Where a clamp alone is
//! too much, a piece is one pixel, its own end.
//!
//! # Rows
//!
//! Lengths are multiples of four, and a row's first piece ends where four pixels do that share an
//! address. So each of the next has as many pixels in one plane as in another.

use crate::bounds::{Chords, place};
use crate::job::Tools;
use crate::places::{Part, Places};
use crate::plane::Walk;
use crate::runs::{Reciprocal, between};
use crate::within::Tolerance;
use crate::{Texture, affine};

/// Pixels of a piece, the longest first. One of four would take longer than quotients: see
/// [`PIECE`].
pub const LENGTHS: [u16; 11] = [256, 192, 128, 96, 64, 48, 32, 24, 16, 12, 8];
/// What making a piece takes, in pixels of an affine column.
pub const PIECE: u32 = 26;
/// What a quotient for a pixel takes, in the same.
pub const EXACT: u32 = 7;

/// A piece of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// The first pixel, counted from the run's first.
    pub first: u16,
    /// Pixels, at least 1.
    pub len: u16,
    /// Its walk, from its first pixel on.
    pub walk: affine::Walk,
}

/// What cuts a run into pieces, from its near end on; then [`Pieces::rest`] tells what is left.
#[derive(Clone, Copy, Debug)]
pub struct Pieces {
    /// From where the next piece begins away from the near end.
    walk: Walk,
    /// The run's far end is its first pixel.
    backward: bool,
    /// Pixels of the run, and those of them that have their piece.
    len: u16,
    done: u16,
    chords: Chords,
    /// Pixels of the next piece, if it keeps to the tolerance.
    longest: u16,
    /// What the product of the depths at its ends must not be less than.
    least: u64,
    /// Which of [`LENGTHS`] is the next shorter.
    shorter: usize,
    /// What the first piece is shorter by than its length.
    lead: u16,
    /// Where the next piece begins: the depth, the coordinates, and what they were clamped by.
    near: u64,
    here: (i32, i32),
    outside: u32,
    /// The texture's last coordinates.
    last: (i32, i32),
}

impl Pieces {
    /// Cuts the run of `len` pixels, at least 1, along `walk`; a row is told by the x of its first
    /// pixel.
    pub fn new(
        walk: &Walk,
        len: u16,
        row: Option<u16>,
        tolerance: Tolerance,
        texture: &Texture<'_>,
    ) -> Self {
        let last = texture.last();
        let end = walk.after(len - 1);
        let backward = walk.step[2] > 0;
        let (walk, end) = match backward {
            false => (*walk, end),
            true => {
                let step = walk.step.map(|step| -step);
                (Walk { at: end, step }, walk.at)
            }
        };
        let depth = walk.at[2].max(1);
        let chords = Chords::new(&[walk], depth, tolerance.units());
        let near = chords.cut(depth);
        let (here, outside) = coordinates(walk.at, last);
        let mut pieces = Self {
            walk,
            backward,
            len,
            done: 0,
            chords,
            longest: 0,
            least: u64::MAX,
            shorter: LENGTHS.len(),
            lead: 0,
            near,
            here,
            outside,
            last,
        };
        // On the horizon and beyond it no piece begins.
        if walk.at[2] <= 0 {
            return pieces;
        }
        pieces.set(len - 1);
        if !pieces.keeps(end[2]) {
            let is_short = |length: &&u16| **length >= len || chords.is_short_of(**length, near);
            pieces.shorter = LENGTHS.iter().take_while(is_short).count();
            if let (Some(()), Some(x)) = (pieces.shorten(), row) {
                let beside = if backward {
                    (x + len).wrapping_neg()
                } else {
                    x
                };
                pieces.lead = beside & 3;
            }
        }
        pieces
    }

    /// Sets the length of the next piece.
    #[inline]
    fn set(&mut self, length: u16) {
        self.longest = length;
        self.least = self.chords.least(length, 0);
    }

    /// Sets it to the next shorter, if there is one.
    #[inline]
    fn shorten(&mut self) -> Option<()> {
        let &length = LENGTHS.get(self.shorter)?;
        self.shorter += 1;
        self.set(length);
        Some(())
    }

    /// Whether the next piece may end at this depth.
    #[inline]
    fn keeps(&self, depth: i64) -> bool {
        depth > 0 && self.near * self.chords.cut(depth) >= self.least
    }

    /// The steps of the next piece, up to so many, the forms at its end and the coordinates there,
    /// where one of the ends is clamped.
    #[cold]
    fn clamped(&self, steps: u16) -> (u16, [i64; 3], ((i32, i32), u32)) {
        let shorter = LENGTHS.into_iter().filter(|&length| length < steps);
        for steps in [steps].into_iter().chain(shorter) {
            let end = self.walk.after(steps);
            let there = coordinates(end, self.last);
            let least = self.chords.least(steps, self.outside.max(there.1));
            if self.near * self.chords.cut(end[2]) >= least {
                return (steps, end, there);
            }
        }
        // Nothing lies between the ends of a single step.
        let steps = steps.min(1);
        let end = self.walk.after(steps);
        (steps, end, coordinates(end, self.last))
    }

    /// What is left when there is no next piece: its first pixel, its pixels and its walk from the
    /// first on.
    pub fn rest(&self) -> Option<(u16, u16, Walk)> {
        let len = self.len - self.done;
        if len == 0 {
            return None;
        }
        Some(match self.backward {
            false => (self.done, len, self.walk),
            true => {
                let at = self.walk.after(len - 1);
                let step = self.walk.step.map(|step| -step);
                (0, len, Walk { at, step })
            }
        })
    }
}

/// Ends at the run's far end, or where what is left has to be exact.
impl Iterator for Pieces {
    type Item = Piece;

    fn next(&mut self) -> Option<Piece> {
        let left = (self.len - self.done).checked_sub(1)?;
        let (steps, end) = loop {
            let steps = left.min(self.longest - self.lead);
            let end = self.walk.after(steps);
            if self.keeps(end[2]) {
                break (steps, end);
            }
            self.shorten()?;
        };
        let (mut steps, mut end, mut to) = (steps, end, coordinates(end, self.last));
        if self.outside | to.1 != 0 {
            (steps, end, to) = self.clamped(steps);
        }
        let (there, outside) = to;
        let mut walk = between(self.here, there, steps);
        let len = steps + u16::from(steps == left);
        let mut first = self.done;
        if self.backward {
            walk = walk.every(-1, i32::from(len) - 1);
            first = self.len - self.done - len;
        }
        self.done += len;
        self.lead = 0;
        self.walk.at = end;
        (self.near, self.here, self.outside) = (self.chords.cut(end[2]), there, outside);
        Some(Piece { first, len, walk })
    }
}

/// The coordinates where the three forms have these values, clamped into the texture, and by how
/// much; where c is not above zero they are of no use.
#[inline(always)]
fn coordinates([a, b, c]: [i64; 3], last: (i32, i32)) -> ((i32, i32), u32) {
    let c = c.max(1);
    let reciprocal = Reciprocal::new(c);
    let inside = |n: i64, last: i32| {
        // Without a sign, what is below zero is above every size.
        (n as u64) < (i64::from((last >> 16) + 1) * c) as u64
    };
    match inside(a, last.0) && inside(b, last.1) {
        true => ((reciprocal.times(a), reciprocal.times(b)), 0),
        false => place(reciprocal, [a, b, c], last),
    }
}

/// A whole run as one piece: of one that is known to keep to the tolerance, unless an end is
/// clamped.
#[inline]
pub(crate) fn whole(walk: &Walk, len: u16, texture: &Texture<'_>) -> Option<affine::Walk> {
    let last = texture.last();
    let (from, outside) = coordinates(walk.at, last);
    let (to, outside_too) = coordinates(walk.after(len - 1), last);
    (outside | outside_too == 0).then(|| between(from, to, len - 1))
}

/// Draws every `STRIDE`th pixel of a run from pixel `first` on.
#[inline(always)]
pub(crate) fn draw<const STRIDE: u16>(
    mut pieces: Pieces,
    first: u16,
    texture: &Texture<'_>,
    tools: &Tools,
    mut places: impl Places,
) {
    // That of the first such pixel that is not before a pixel of the run.
    let place = |pixel: u16| (pixel + STRIDE - 1 - first) / STRIDE;
    let mut next = pieces.next();
    while let Some(piece) = next {
        // Asked for before this one is drawn: its division is done meanwhile.
        next = pieces.next();
        let (from, to) = (place(piece.first), place(piece.first + piece.len));
        if from < to {
            let skipped = from * STRIDE + first - piece.first;
            let walk = piece.walk.every(STRIDE.into(), skipped.into());
            places.part(from, to - from).affine(texture, walk, tools);
        }
    }
    if let Some((from, len, walk)) = pieces.rest() {
        let (from, to, pixel) = (place(from), place(from + len), from);
        if from < to {
            let walk = walk.every(STRIDE, from * STRIDE + first - pixel);
            places.part(from, to - from).exact(texture, walk);
        }
    }
}
