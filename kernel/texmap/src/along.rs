//! What is linear along a side of a polygon.

/// A quantity that is linear along a side, at the centres of the lines (columns or rows) that
/// the side crosses; 32 fraction bits.
///
/// It is off by less than a step's last bit for every line since the first: over 320 lines by
/// less than 2^-23.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Along {
    first: i32,
    value: i64,
    step: i64,
}

impl Along {
    /// From `a` at 0 to `a + delta` at `length`; line `first` has its centre at `offset`, and the
    /// next ones follow 256 apart. `shift` more fraction bits make 32 of the input's. |a|,
    /// |delta|, length and offset are below 2^25, shift is at most 24.
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

    /// The value at the centre of `line`, one that the side crosses.
    pub(crate) fn at(&self, line: i32) -> i64 {
        self.value + self.step * i64::from(line - self.first)
    }
}

/// floor(n 2^shift / d) without the product: n < 2^50, d < 2^25, shift <= 24.
fn ratio(n: i64, d: i64, shift: u32) -> i64 {
    (n.div_euclid(d) << shift) + (n.rem_euclid(d) << shift) / d
}
