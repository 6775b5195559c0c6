//! Pixel sinks: the places that receive a span's texels, one after the other. They lie down a
//! column, at every fourth pixel of a row, or at every pixel of a row.

use modex::{Column, Lane, Line};

use crate::affine::Walk;
use crate::job::Tools;
use crate::loops::Loop;
use crate::{Texture, exact, plane};

/// The places of a span's texels.
pub(crate) trait Places {
    /// A part of the places.
    type Part<'p>: Part
    where
        Self: 'p;

    /// Returns the `count` places from `first` on.
    fn part(&mut self, first: u16, count: u16) -> Self::Part<'_>;
}

/// Places to be filled.
pub(crate) trait Part: Sized {
    /// Writes a texel to every place, in order; `texel` is called once for each.
    fn fill(self, texel: impl FnMut() -> u8);

    /// Writes the texels of an affine walk.
    #[inline(always)]
    fn affine(self, texture: &Texture<'_>, walk: Walk, tools: &Tools) {
        Loop::along(texture, walk, tools.extract, self);
    }

    /// Writes the texels of the quotients.
    #[inline(always)]
    fn exact(self, texture: &Texture<'_>, mut walk: plane::Walk) {
        self.fill(|| exact::texel(texture, walk.next()));
    }
}

impl<const STEP: usize> Places for Lane<'_, STEP>
where
    for<'p> Lane<'p, STEP>: Part,
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

impl Part for Column<'_> {
    #[inline(always)]
    fn fill(self, texel: impl FnMut() -> u8) {
        Lane::fill(self, texel);
    }

    #[inline(always)]
    fn affine(self, texture: &Texture<'_>, walk: Walk, tools: &Tools) {
        (tools.column)(texture, &walk, self);
    }

    #[inline(always)]
    fn exact(self, texture: &Texture<'_>, walk: plane::Walk) {
        exact::column(texture, walk, self.len(), self);
    }
}

impl Part for Lane<'_, 1> {
    #[inline(always)]
    fn fill(self, texel: impl FnMut() -> u8) {
        Lane::fill(self, texel);
    }
}

/// The pixels of a line from `x` on.
pub(crate) struct Row<'a> {
    pub line: Line<'a>,
    pub x: u16,
}

impl<'a> Places for Row<'a> {
    type Part<'p>
        = RowPart<'p, 'a>
    where
        Self: 'p;

    #[inline(always)]
    fn part(&mut self, first: u16, count: u16) -> RowPart<'_, 'a> {
        let x = self.x + first;
        RowPart {
            line: &mut self.line,
            first: x.into(),
            end: (x + count).into(),
        }
    }
}

/// The pixels `first..end` of a line.
pub(crate) struct RowPart<'p, 'a> {
    line: &'p mut Line<'a>,
    first: usize,
    end: usize,
}

impl Part for RowPart<'_, '_> {
    #[inline(always)]
    fn fill(self, mut texel: impl FnMut() -> u8) {
        let Self { line, first, end } = self;
        // Write groups of four pixels with the same address, and the pixels before and after them
        // one by one.
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
