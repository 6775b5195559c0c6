//! Clamped steps: constant steps that may leave the texture, cut into pieces where they do.
//!
//! An approximation is only close to the exact coordinates, and the exact coordinates of a pixel at the
//! polygon's border lie at the texture's border. So the steps may cross the border by as much as its error.
//! Clamping one of the ends into the texture would bend the whole span. Instead, the span is cut into pieces
//! that lie inside and pieces that lie beyond a border, and beyond a border the coordinate stays on the last
//! texel. Every pixel then has its own coordinates, clamped, and clamping brings them no further from any
//! coordinates inside the texture. No inner loop clamps.

use crate::loops::AffineStepper;
use crate::plane::Reciprocal;

/// Largest magnitude of a coordinate at either end of a span, 16.16: 4096 texels.
pub(crate) const REACH: i64 = 1 << 28;

/// Coordinates that change by a constant step from pixel to pixel, inside the texture or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ClampedStep {
    /// u and v at the first pixel, 16.16.
    pub at: [i64; 2],
    /// Steps of u and v from a pixel to the next, 16.16.
    pub step: [i64; 2],
}

/// The position of a coordinate relative to the texture.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Position {
    Before,
    Inside,
    Beyond,
}

impl ClampedStep {
    /// Returns both coordinates at `pixels` pixels after the first, at most 320.
    fn after(&self, pixels: u16) -> [i64; 2] {
        [0, 1].map(|k| self.at[k] + self.step[k] * i64::from(pixels))
    }

    /// Returns whether the coordinates over `len` pixels, at least 1, stay within [`REACH`].
    pub(crate) fn in_reach(&self, len: u16) -> bool {
        let near = |k: i64| k.unsigned_abs() <= REACH as u64;
        self.at.into_iter().all(near)
            && (len == 1
                || self.step.into_iter().all(|step| near(step / 2))
                    && self.after(len - 1).into_iter().all(near))
    }

    /// Passes the pieces over `len` pixels, at most five, to `sink`: the index of each piece's first pixel,
    /// its length in pixels, and its stepper inside a texture whose last coordinates are `last`.
    pub(crate) fn pieces(
        &self,
        len: u16,
        last: (i32, i32),
        mut sink: impl FnMut(u16, u16, AffineStepper),
    ) {
        let last = [last.0, last.1];
        let positions = |pixel: u16| {
            let at = self.after(pixel);
            [0, 1].map(|k| match at[k] {
                ..0 => Position::Before,
                at if at > i64::from(last[k]) => Position::Beyond,
                _ => Position::Inside,
            })
        };
        let mut first = 0;
        while first < len {
            let here = positions(first);
            // The coordinates are monotone, so a position that holds at two pixels holds between them. Find
            // the piece's last pixel by bisection.
            let (mut same, mut end) = (first, len);
            if positions(len - 1) == here {
                same = len - 1;
            }
            while end - same > 1 {
                let middle = same + (end - same) / 2;
                if positions(middle) == here {
                    same = middle;
                } else {
                    end = middle;
                }
            }
            let at = self.after(first);
            let [(u, du), (v, dv)] = [0, 1].map(|k| match here[k] {
                Position::Before => (0, 0),
                Position::Beyond => (last[k], 0),
                // The step may not fit, and a single pixel needs no step.
                Position::Inside if end - first == 1 => (at[k] as i32, 0),
                Position::Inside => (at[k] as i32, self.step[k] as i32),
            });
            sink(first, end - first, AffineStepper { u, v, du, dv });
            first = end;
        }
    }
}

/// The forms along a span of constant depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ConstantDepthForms {
    /// a and b at the first pixel, and the constant c.
    pub at: [i64; 3],
    /// The steps of a and b.
    pub step: [i64; 2],
}

impl ConstantDepthForms {
    /// Returns the steps over `len` pixels, or nothing if c is not above zero or the steps lead out of reach.
    pub(crate) fn step(&self, len: u16) -> Option<ClampedStep> {
        let [a, b, c] = self.at;
        let over = Reciprocal::unbiased(c)?;
        let at = [a, b].map(|n| i64::try_from(over.floor(n)));
        let step = self.step.map(|n| i64::try_from(over.nearest(n)));
        let clamped = ClampedStep {
            at: [at[0].ok()?, at[1].ok()?],
            step: match len {
                1 => [0; 2],
                _ => [step[0].ok()?, step[1].ok()?],
            },
        };
        clamped.in_reach(len).then_some(clamped)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn steps_out_of_reach_are_refused() {
        let far = |a, c, step, len| {
            let at = [a, 0, c];
            let step = [step, 0];
            ConstantDepthForms { at, step }.step(len).is_none()
        };
        let c = 1 << 40;
        assert!(!far(4096 * c, c, 0, 1) && far(4096 * c + c / 1024, c, 0, 1));
        assert!(!far(-4096 * c, c, 1024 * c, 9) && far(-4096 * c, c, 1024 * c, 10));
        assert!(far(0, c, 8193 * c, 2) && !far(0, c, 8193 * c, 1));
        // The widest forms over the least depth.
        assert!(far(1 << 61, 1, 0, 1) && far(-(1 << 61), 1, 1 << 55, 320));
        assert!(far(0, 1, i64::MAX, 2) && far(0, 1, i64::MIN, 2) && !far(0, 1, i64::MIN, 1));
        assert_eq!(REACH, 4096 << 16);
    }
}
