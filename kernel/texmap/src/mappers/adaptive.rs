//! Adaptive subdivision: perspective by linear pieces, each as long as an error allows.
//!
//! Pieces are linear between the quotients at their ends, as in [`super::linear`], but the length of a piece
//! depends on where it lies. The texture coordinate is most curved far away. So pieces are made from the
//! span's near end on, and become shorter and shorter. Where the error of even the shortest piece is too
//! large, the rest of the span is drawn exactly.
//!
//! # How long
//!
//! A piece of n pixels keeps to the tolerance where the geometric mean of the inverse depths at its ends is
//! large enough ([`crate::plane::bounds`]). One multiplication decides that, before any quotient is computed.
//! (The inverse depth is the value of the form c, which is large near the eye.) If the whole span keeps to
//! the tolerance, it is one piece. Otherwise each piece has the longest of the [`LENGTHS`] that keeps to the
//! tolerance there. No piece is longer than the piece before it, since c falls. The last piece at the far end
//! may be shorter, and is judged as if it had its full length.
//!
//! Error: at most the tolerance, which covers everything: the chords, their ends (rounded down, and clamped
//! into the texture), and the steps, which are cut towards zero. Where a clamp alone exceeds the tolerance, a
//! piece is a single pixel, which is its own end.
//!
//! # Rows
//!
//! Lengths are multiples of four, and a row's first piece ends where a group of four pixels with a common
//! address ends. So each of the following pieces has equally many pixels in all four planes.

use super::exact;
use super::pieces::between;
use crate::geometry::Texture;
use crate::loops::{AffineLoops, AffineStepper, DrawQuotients, SpanPixels};
use crate::plane::bounds::Chords;
use crate::plane::{PlaneStepper, Reciprocal, Tolerance, quotients_and_excess};

/// Lengths of pieces in pixels, the longest first. A piece of four would cost more than quotients: see
/// [`PIECE`].
pub const LENGTHS: [u16; 11] = [256, 192, 128, 96, 64, 48, 32, 24, 16, 12, 8];
/// Cost of making a piece, in pixels of an affine column.
pub const PIECE: u32 = 26;
/// Cost of a quotient for a pixel, in pixels of an affine column.
pub const EXACT: u32 = 7;

/// A piece of a span.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AffinePiece {
    /// The first pixel, counted from the span's first.
    pub first: u16,
    /// The number of pixels, at least 1.
    pub len: u16,
    /// The piece's stepper, from its first pixel on.
    pub stepper: AffineStepper,
}

/// Cuts a span into pieces, from its near end on. Then [`AdaptivePieces::rest`] returns what is left.
#[derive(Clone, Copy, Debug)]
pub struct AdaptivePieces {
    /// The forms from the start of the next piece on, away from the near end.
    stepper: PlaneStepper,
    /// Whether the span's far end is its first pixel.
    backward: bool,
    /// Pixels of the span, and the number of them that already have a piece.
    len: u16,
    done: u16,
    chords: Chords,
    /// Steps of the next piece, if it keeps to the tolerance.
    longest: u16,
    /// The least product of the inverse depths at the next piece's ends.
    least: u64,
    /// Index of the next shorter of the [`LENGTHS`].
    shorter: usize,
    /// Pixels by which the first piece is shorter than its length.
    lead: u16,
    /// Start of the next piece: its inverse depth, its coordinates, and the amount by which they were
    /// clamped.
    near: u64,
    here: (i32, i32),
    outside: u32,
    /// The texture's last coordinates.
    last: (i32, i32),
}

impl AdaptivePieces {
    /// Returns the pieces of the span of `len` pixels, at least 1, along `stepper`. For a row, `row` is
    /// the x of its first pixel.
    pub fn new(
        stepper: &PlaneStepper,
        len: u16,
        row: Option<u16>,
        tolerance: Tolerance,
        texture: &Texture<'_>,
    ) -> Self {
        let last = texture.last();
        let end = stepper.after(len - 1);
        let backward = stepper.step[2] > 0;
        let (stepper, end) = match backward {
            false => (*stepper, end),
            true => {
                let step = stepper.step.map(|step| -step);
                (PlaneStepper { at: end, step }, stepper.at)
            }
        };
        let c = stepper.at[2].max(1);
        let chords = Chords::new(&[stepper], c, tolerance.units());
        let near = chords.cut(c);
        let (here, outside) = coordinates(stepper.at, last);
        let mut pieces = Self {
            stepper,
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
        // No piece begins on or beyond the horizon.
        if stepper.at[2] <= 0 {
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

    /// Sets the length of the next piece to the next shorter length, if one exists.
    #[inline]
    fn shorten(&mut self) -> Option<()> {
        let &length = LENGTHS.get(self.shorter)?;
        self.shorter += 1;
        self.set(length);
        Some(())
    }

    /// Returns whether the next piece may end at this inverse depth.
    #[inline]
    fn keeps(&self, c: i64) -> bool {
        c > 0 && self.near * self.chords.cut(c) >= self.least
    }

    /// Returns the steps of the next piece, at most `steps`, the forms at its end, and the coordinates there,
    /// for a piece with a clamped end.
    #[cold]
    fn clamped(&self, steps: u16) -> (u16, [i64; 3], ((i32, i32), u32)) {
        let shorter = LENGTHS.into_iter().filter(|&length| length < steps);
        for steps in [steps].into_iter().chain(shorter) {
            let end = self.stepper.after(steps);
            let there = coordinates(end, self.last);
            let least = self.chords.least(steps, self.outside.max(there.1));
            if self.near * self.chords.cut(end[2]) >= least {
                return (steps, end, there);
            }
        }
        // Nothing lies between the ends of a single step.
        let steps = steps.min(1);
        let end = self.stepper.after(steps);
        (steps, end, coordinates(end, self.last))
    }

    /// Returns what is left when no next piece exists: its first pixel, its number of pixels, and its stepper
    /// from that pixel on.
    pub fn rest(&self) -> Option<(u16, u16, PlaneStepper)> {
        let len = self.len - self.done;
        if len == 0 {
            return None;
        }
        Some(match self.backward {
            false => (self.done, len, self.stepper),
            true => {
                let at = self.stepper.after(len - 1);
                let step = self.stepper.step.map(|step| -step);
                (0, len, PlaneStepper { at, step })
            }
        })
    }
}

/// Ends at the span's far end, or where the rest has to be exact.
impl Iterator for AdaptivePieces {
    type Item = AffinePiece;

    fn next(&mut self) -> Option<AffinePiece> {
        let left = (self.len - self.done).checked_sub(1)?;
        let (steps, end) = loop {
            let steps = left.min(self.longest - self.lead);
            let end = self.stepper.after(steps);
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
        let mut stepper = between(self.here, there, steps);
        let len = steps + u16::from(steps == left);
        let mut first = self.done;
        if self.backward {
            stepper = stepper.every(-1, i32::from(len) - 1);
            first = self.len - self.done - len;
        }
        self.done += len;
        self.lead = 0;
        self.stepper.at = end;
        (self.near, self.here, self.outside) = (self.chords.cut(end[2]), there, outside);
        Some(AffinePiece {
            first,
            len,
            stepper,
        })
    }
}

/// Returns the coordinates where the three forms have these values, clamped into the texture, and the amount
/// by which they were clamped. Where c is not above zero the result is meaningless.
#[inline(always)]
fn coordinates([a, b, c]: [i64; 3], last: (i32, i32)) -> ((i32, i32), u32) {
    let c = c.max(1);
    let reciprocal = Reciprocal::new(c);
    let inside = |n: i64, last: i32| {
        // As an unsigned number, a negative form is above every limit.
        (n as u64) < (i64::from((last >> 16) + 1) * c) as u64
    };
    match inside(a, last.0) && inside(b, last.1) {
        true => ((reciprocal.times(a), reciprocal.times(b)), 0),
        false => quotients_and_excess(reciprocal, [a, b, c], last),
    }
}

/// Returns a whole span as one piece, or nothing if an end is clamped. The span must be known to keep to the
/// tolerance.
#[inline]
pub(crate) fn whole(
    stepper: &PlaneStepper,
    len: u16,
    texture: &Texture<'_>,
) -> Option<AffineStepper> {
    let last = texture.last();
    let (from, outside) = coordinates(stepper.at, last);
    let (to, outside_too) = coordinates(stepper.after(len - 1), last);
    (outside | outside_too == 0).then(|| between(from, to, len - 1))
}

/// Draws every `STRIDE`th pixel of a span from pixel `first` on.
#[inline(always)]
pub(crate) fn draw<const STRIDE: u16>(
    mut pieces: AdaptivePieces,
    first: u16,
    texture: &Texture<'_>,
    (affine, quotients): (AffineLoops, DrawQuotients),
    mut pixels: impl SpanPixels,
) {
    // The index of the first drawn pixel that is not before `pixel` of the span.
    let place = |pixel: u16| (pixel + STRIDE - 1 - first) / STRIDE;
    let mut next = pieces.next();
    while let Some(piece) = next {
        // Requested before the current piece is drawn, so that its division overlaps the drawing.
        next = pieces.next();
        let (from, to) = (place(piece.first), place(piece.first + piece.len));
        if from < to {
            let skipped = from * STRIDE + first - piece.first;
            let stepper = piece.stepper.every(STRIDE.into(), skipped.into());
            affine.fill(texture, stepper, pixels.part(from, to - from));
        }
    }
    if let Some((from, len, stepper)) = pieces.rest() {
        let (from, to, pixel) = (place(from), place(from + len), from);
        if from < to {
            let stepper = stepper.every(STRIDE, from * STRIDE + first - pixel);
            exact::fill(texture, stepper, quotients, &mut pixels, from, to - from);
        }
    }
}
