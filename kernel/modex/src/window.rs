//! Windows: a part of a destination that shows another part of the frame.

use core::ops::Range;

use crate::column::{check_lane, check_row};
use crate::{Destination, Lane, STRIDE, WIDTH};

/// Some columns of a frame, shown at other columns of a destination. Pixels outside these columns are not
/// drawn.
///
/// A window moves columns by whole addresses, four columns each, so every column keeps its plane. Code that
/// draws by planes, or selects one plane for many columns, works unchanged.
#[derive(Debug)]
pub struct Window<'d, D> {
    destination: &'d mut D,
    columns: Range<u16>,
    to: u16,
}

impl<'d, D: Destination> Window<'d, D> {
    /// Returns a window that shows the frame's `columns` from column `to` of `destination` on.
    ///
    /// # Panics
    /// If the columns leave the frame on either side, or if they would move by a distance that is not a
    /// multiple of four.
    pub fn new(destination: &'d mut D, columns: Range<u16>, to: u16) -> Self {
        let (width, frame) = (columns.end.saturating_sub(columns.start), WIDTH as u16);
        assert!(
            columns.end <= frame
                && to <= frame - width
                && columns.start.abs_diff(to).is_multiple_of(4),
            "columns {columns:?} cannot be shown from column {to} on"
        );
        Self {
            destination,
            columns,
            to,
        }
    }

    /// Returns which of `len` pixels are shown. The first is in column `x`, and they lie `step` columns
    /// apart.
    fn shown(&self, x: u16, len: u16, step: u16) -> Range<u16> {
        let before = |column: u16| column.saturating_sub(x).div_ceil(step).min(len);
        before(self.columns.start)..before(self.columns.end)
    }

    /// Returns the destination's column for the shown column `x`.
    fn moved(&self, x: u16) -> u16 {
        x - self.columns.start + self.to
    }
}

impl<D: Destination> Destination for Window<'_, D> {
    fn select(&mut self, x: u16) {
        self.destination.select(x);
    }

    fn lane<const STEP: usize>(
        &mut self,
        x: u16,
        y: u16,
        len: u16,
        draw: impl FnOnce(Lane<'_, STEP>),
    ) {
        check_lane::<STEP>(x, y, len);
        if STEP == STRIDE {
            if self.columns.contains(&x) {
                let x = self.moved(x);
                self.destination.lane(x, y, len, draw);
            }
            return;
        }
        let shown = self.shown(x, len, 4);
        if shown.len() == usize::from(len) {
            let x = self.moved(x);
            self.destination.lane(x, y, len, draw);
        } else if !shown.is_empty() {
            // `draw` has to begin at the first pixel, so draw the whole lane into RAM and copy the part.
            let mut whole = [0; STRIDE];
            draw(Lane::over(&mut whole[..len.into()]));
            let part = &whole[usize::from(shown.start)..usize::from(shown.end)];
            let mut texels = part.iter().copied();
            let x = self.moved(x + 4 * shown.start);
            self.destination.lane::<1>(x, y, part.len() as u16, |lane| {
                lane.fill(|| texels.next().unwrap_or_default());
            });
        }
    }

    fn row(&mut self, x: u16, y: u16, len: u16, mut texel: impl FnMut() -> u8) {
        check_row(x, y, len);
        let shown = self.shown(x, len, 1);
        for _ in 0..shown.start {
            texel();
        }
        if !shown.is_empty() {
            let x = self.moved(x + shown.start);
            self.destination.row(x, y, shown.len() as u16, texel);
        }
    }
}
