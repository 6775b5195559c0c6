//! Clamped walks: straight walks that may leave the texture, cut into pieces where they do.
//!
//! An approximate walk is only close to the exact coordinates, and the exact coordinates of a pixel
//! at the polygon's border lie at the texture's border. So the walk may cross the border by as much
//! as its error. Clamping one of its ends into the texture would bend the whole walk. Instead, the
//! walk is cut into pieces that lie inside and pieces that lie beyond a border, and beyond a border
//! the coordinate stays on the last texel. Every pixel then has the walk's own coordinates,
//! clamped, and clamping brings them no further from any coordinates inside the texture. No inner
//! loop clamps.

use crate::affine::Walk;

/// Largest magnitude of a coordinate at either end of a walk, 16.16: 4096 texels.
pub(crate) const REACH: i64 = 1 << 28;

/// Coordinates that change by a constant step from pixel to pixel, inside the texture or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Straight {
    /// u and v at the first pixel, 16.16.
    pub at: [i64; 2],
    /// Steps of u and v from a pixel to the next, 16.16.
    pub step: [i64; 2],
}

/// The position of a coordinate relative to the texture.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Before,
    Inside,
    Beyond,
}

impl Straight {
    /// Returns both coordinates at `pixels` pixels after the first, at most 320.
    fn after(&self, pixels: u16) -> [i64; 2] {
        [0, 1].map(|k| self.at[k] + self.step[k] * i64::from(pixels))
    }

    /// Returns whether the walk over `len` pixels, at least 1, stays within [`REACH`].
    pub(crate) fn in_reach(&self, len: u16) -> bool {
        let near = |k: i64| k.unsigned_abs() <= REACH as u64;
        self.at.into_iter().all(near)
            && (len == 1
                || self.step.into_iter().all(|step| near(step / 2))
                    && self.after(len - 1).into_iter().all(near))
    }

    /// Passes the pieces of the walk over `len` pixels, at most five, to `sink`: the index of each
    /// piece's first pixel, its length in pixels, and its walk inside a texture whose last
    /// coordinates are `last`.
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
            // The coordinates are monotone, so a position that holds at two pixels holds between
            // them. Find the piece's last pixel by bisection.
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
                // The step may not fit, and a single pixel needs no step.
                Side::Inside if end - first == 1 => (at[k] as i32, 0),
                Side::Inside => (at[k] as i32, self.step[k] as i32),
            });
            sink(first, end - first, Walk { u, v, du, dv });
            first = end;
        }
    }
}
