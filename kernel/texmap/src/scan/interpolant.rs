//! Edge interpolants: quantities that are linear along a side of a polygon.

/// A quantity that is linear along a side, at the centres of the lines (columns or rows) that the side
/// crosses; 32 fraction bits.
///
/// Its error is below one unit in the last place of the step for every line since the first: below 2^-23 over
/// 320 lines.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EdgeInterpolant {
    first: i32,
    value: i64,
    step: i64,
}

impl EdgeInterpolant {
    /// Returns the quantity that runs from `a` at 0 to `a + delta` at `length`. The centre of line `first` is
    /// at `offset`, and the centres of the next lines follow 256 apart. `shift` fraction bits are added to
    /// those of the input, to make 32. |a|, |delta|, length and offset are below 2^25, and shift is at most
    /// 24.
    pub(crate) fn new(
        a: i32,
        delta: i64,
        length: i64,
        first: i32,
        offset: i64,
        shift: u32,
    ) -> Self {
        Self {
            first,
            value: (i64::from(a) << shift) + ratio(delta * offset, length, shift),
            step: ratio(delta * 256, length, shift),
        }
    }

    /// Returns the value at the centre of `line`, which the side must cross.
    pub(crate) fn at(&self, line: i32) -> i64 {
        self.value + self.step * i64::from(line - self.first)
    }
}

/// Returns floor(n 2^shift / d) without forming n 2^shift, which could overflow: n < 2^50, d < 2^25,
/// shift <= 24.
fn ratio(n: i64, d: i64, shift: u32) -> i64 {
    (n.div_euclid(d) << shift) + (n.rem_euclid(d) << shift) / d
}
