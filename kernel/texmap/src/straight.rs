//! Straight walks that may leave the texture, cut where they do.
//!
//! A walk that approximates is only near the exact coordinates, and those of a pixel at the
//! polygon's border lie at the texture's: it steps over by as much as it is off. Pulling an end of
//! it into the texture would bend all of it. So it is cut into the pieces that lie inside and
//! those that lie beyond a border, and beyond a border it stands on the last texel: every pixel has
//! the walk's own coordinates, clamped, which are no further from coordinates inside the texture
//! than they were. No inner loop clamps.

use crate::affine::Walk;

/// Furthest that a coordinate may lie from 0 at either end of a walk, 16.16: 4096 texels.
pub(crate) const REACH: i64 = 1 << 28;

/// Coordinates that change evenly from pixel to pixel, inside the texture or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Straight {
    /// At the first pixel, 16.16.
    pub at: [i64; 2],
    /// From a pixel to the next, 16.16.
    pub step: [i64; 2],
}

/// Where a coordinate is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Before,
    Inside,
    Beyond,
}

impl Straight {
    /// Both coordinates after `pixels`, at most 320.
    fn after(&self, pixels: u16) -> [i64; 2] {
        [0, 1].map(|k| self.at[k] + self.step[k] * i64::from(pixels))
    }

    /// Whether the walk over `len` pixels, at least 1, stays within [`REACH`].
    pub(crate) fn in_reach(&self, len: u16) -> bool {
        let near = |k: i64| k.unsigned_abs() <= REACH as u64;
        self.at.into_iter().all(near)
            && (len == 1
                || self.step.into_iter().all(|step| near(step / 2))
                    && self.after(len - 1).into_iter().all(near))
    }

    /// Gives `sink` the pieces of the walk over `len` pixels, at most five: the first pixel of
    /// each, its pixels, and its walk inside a texture whose last coordinates are `last`.
    pub(crate) fn pieces(&self, len: u16, last: (i32, i32), mut sink: impl FnMut(u16, u16, Walk)) {
        let last = [last.0, last.1];
        let sides = |pixel: u16| {
            let at = self.after(pixel);
            [0, 1].map(|k| match at[k] {
                ..0 => Side::Before,
                at if at > i64::from(last[k]) => Side::Beyond,
                _ => Side::Inside,
            })
        };
        let mut first = 0;
        while first < len {
            let here = sides(first);
            // The coordinates are monotone: what holds at two pixels holds between them.
            let (mut same, mut end) = (first, len);
            if sides(len - 1) == here {
                same = len - 1;
            }
            while end - same > 1 {
                let middle = same + (end - same) / 2;
                if sides(middle) == here {
                    same = middle;
                } else {
                    end = middle;
                }
            }
            let at = self.after(first);
            let [(u, du), (v, dv)] = [0, 1].map(|k| match here[k] {
                Side::Before => (0, 0),
                Side::Beyond => (last[k], 0),
                // The step of a single pixel would lead anywhere.
                Side::Inside if end - first == 1 => (at[k] as i32, 0),
                Side::Inside => (at[k] as i32, self.step[k] as i32),
            });
            sink(first, end - first, Walk { u, v, du, dv });
            first = end;
        }
    }
}
