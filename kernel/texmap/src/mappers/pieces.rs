//! Pieces of a span in perspective: exact quotients at the ends of each piece, and a polynomial between.
//!
//! A span of `len` pixels has `len - 1` steps from its first pixel's centre to its last. The steps are cut
//! into pieces. Neighbouring pieces share the quotient between them, and the last piece ends *on* the span's
//! last pixel. So a span of one pixel has no piece, and nothing is divided by zero.

use crate::geometry::Texture;
use crate::loops::AffineStepper;
use crate::plane::{PlaneStepper, Subdivision, quotients};

/// Longest span in steps, which is one less than its pixels: a row of the screen.
const MAX_STEPS: usize = modex::WIDTH - 1;

/// 2^48 / n, rounded down.
pub(crate) const INVERSES: [u64; MAX_STEPS + 1] = {
    let mut inverses = [0; MAX_STEPS + 1];
    let mut n = 1;
    while n <= MAX_STEPS {
        inverses[n] = (1 << 48) / n as u64;
        n += 1;
    }
    inverses
};

/// Returns `delta / steps`, cut towards zero; |delta| < 2^24, steps 1 to 319.
///
/// Below 2^8 steps the result is floor(delta m / 2^32), where m is the next whole number above 2^32 / steps.
/// Its error is at most delta / 2^32 < 2^-8 upward, and a quotient is at least 1 / steps below the next whole
/// number.
#[inline]
pub fn over(delta: i32, steps: u16) -> i32 {
    if steps.is_power_of_two() {
        let round = (delta >> 31) & (i32::from(steps) - 1);
        return (delta + round) >> steps.trailing_zeros();
    }
    if steps > 255 {
        return delta / i32::from(steps);
    }
    let inverse = (INVERSES[usize::from(steps)] >> 16) + 1;
    let size = (u64::from(delta.unsigned_abs()) * inverse) >> 32;
    if delta < 0 {
        -(size as i32)
    } else {
        size as i32
    }
}

/// Returns the stepper of `steps` steps between two places inside the texture.
#[inline]
pub fn between(from: (i32, i32), to: (i32, i32), steps: u16) -> AffineStepper {
    let (du, dv) = match steps {
        0 => (0, 0),
        _ => (over(to.0 - from.0, steps), over(to.1 - from.1, steps)),
    };
    AffineStepper {
        u: from.0,
        v: from.1,
        du,
        dv,
    }
}

/// Cuts a span into pieces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cuts {
    stepper: PlaneStepper,
    pieces: Subdivision,
    pub last: (i32, i32),
    /// The coordinates where the next piece begins.
    here: (i32, i32),
    /// The steps left.
    left: u16,
}

/// A piece of a span: its steps, its pixels, and the coordinates at its ends.
pub(crate) struct Piece {
    pub steps: u16,
    pub pixels: u16,
    pub from: (i32, i32),
    pub to: (i32, i32),
    /// Twice the forms at the middle.
    pub middle: [i64; 3],
}

impl Piece {
    /// Returns the stepper along the piece.
    #[inline]
    pub(crate) fn stepper(&self) -> AffineStepper {
        between(self.from, self.to, self.steps)
    }
}

impl Cuts {
    #[inline]
    pub(crate) fn new(
        stepper: PlaneStepper,
        len: u16,
        pieces: Subdivision,
        texture: &Texture<'_>,
    ) -> Self {
        let last = texture.last();
        Self {
            stepper,
            pieces,
            last,
            here: quotients(stepper.at, last),
            left: len - 1,
        }
    }

    /// Returns the next piece. Call it only until the pieces have all of the span's pixels.
    #[inline]
    pub(crate) fn next(&mut self) -> Piece {
        let steps = self.pieces.longest(self.left);
        self.left -= steps;
        let from = self.here;
        let end = self.stepper.after(steps);
        let middle = [0, 1, 2].map(|k| self.stepper.at[k] + end[k]);
        self.stepper.at = end;
        if steps > 0 {
            self.here = quotients(end, self.last);
        }
        Piece {
            steps,
            pixels: steps + u16::from(self.left == 0),
            from,
            to: self.here,
            middle,
        }
    }
}
