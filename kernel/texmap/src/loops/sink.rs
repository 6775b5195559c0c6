//! Pixel sinks: the pixels that receive a span's texels, one after the other. They lie down a column, at
//! every fourth pixel of a row, or at every pixel of a row.

use modex::{Column, Lane, Line};

/// The pixels of a span, which can be filled part by part.
pub(crate) trait SpanPixels {
    /// A part of the pixels.
    type Part<'p>: PixelSink
    where
        Self: 'p;

    /// Returns the `count` pixels from `first` on.
    fn part(&mut self, first: u16, count: u16) -> Self::Part<'_>;
}

/// Pixels to be filled.
pub(crate) trait PixelSink: Sized {
    /// Writes a texel to every pixel, in order; `texel` is called once for each.
    fn fill(self, texel: impl FnMut() -> u8);

    /// Passes a sink that is a column to `column`, and any other sink to `other`.
    #[inline(always)]
    fn by_kind(self, column: impl FnOnce(Column<'_>), other: impl FnOnce(Self)) {
        let _ = column;
        other(self);
    }
}

impl<const STEP: usize> SpanPixels for Lane<'_, STEP>
where
    for<'p> Lane<'p, STEP>: PixelSink,
{
    type Part<'p>
        = Lane<'p, STEP>
    where
        Self: 'p;

    #[inline(always)]
    fn part(&mut self, first: u16, count: u16) -> Lane<'_, STEP> {
        Lane::part(self, first, count)
    }
}

impl PixelSink for Column<'_> {
    #[inline(always)]
    fn fill(self, texel: impl FnMut() -> u8) {
        Lane::fill(self, texel);
    }

    #[inline(always)]
    fn by_kind(self, column: impl FnOnce(Column<'_>), other: impl FnOnce(Self)) {
        let _ = other;
        column(self);
    }
}

impl PixelSink for Lane<'_, 1> {
    #[inline(always)]
    fn fill(self, texel: impl FnMut() -> u8) {
        Lane::fill(self, texel);
    }
}

/// The pixels of a line from `x` on.
pub(crate) struct RowPixels<'a> {
    pub line: Line<'a>,
    pub x: u16,
}

impl<'a> SpanPixels for RowPixels<'a> {
    type Part<'p>
        = RowSink<'p, 'a>
    where
        Self: 'p;

    #[inline(always)]
    fn part(&mut self, first: u16, count: u16) -> RowSink<'_, 'a> {
        let x = self.x + first;
        RowSink {
            line: &mut self.line,
            first: x.into(),
            end: (x + count).into(),
        }
    }
}

/// The pixels `first..end` of a line.
pub(crate) struct RowSink<'p, 'a> {
    line: &'p mut Line<'a>,
    first: usize,
    end: usize,
}

impl PixelSink for RowSink<'_, '_> {
    #[inline(always)]
    fn fill(self, mut texel: impl FnMut() -> u8) {
        let Self { line, first, end } = self;
        // Write groups of four pixels with the same address, and the pixels before and after them one by one.
        let (from, to) = (first.div_ceil(4), end / 4);
        for x in first..end.min(4 * from) {
            line[x & 3][x / 4] = texel();
        }
        if from > to {
            return;
        }
        let [a, b, c, d] = line.each_mut().map(|plane| plane[from..to].iter_mut());
        for (((a, b), c), d) in a.zip(b).zip(c).zip(d) {
            *a = texel();
            *b = texel();
            *c = texel();
            *d = texel();
        }
        for x in 4 * to..end {
            line[x & 3][x / 4] = texel();
        }
    }
}
