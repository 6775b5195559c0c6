//! A page in RAM to draw on and to present.

use crate::column::check_row;
use crate::drawn::Drawn;
use crate::{Destination, HEIGHT, Lane, Line, PlanarBuffer};

/// A page in RAM that records where it was drawn on.
///
/// Drawing on it costs no port writes, in any order of planes. [`ModeX::present`] then stores it eight bytes
/// at a time, one plane after the other.
///
/// [`ModeX::present`]: crate::ModeX::present
#[derive(Clone, Copy, Debug)]
pub struct Offscreen {
    page: PlanarBuffer,
    drawn: Drawn,
    /// Whether the background has been painted.
    painted: bool,
}

impl Offscreen {
    /// Returns a page of zeros, whose background counts as not painted.
    pub const fn new() -> Self {
        Self {
            page: PlanarBuffer::new(),
            drawn: Drawn::NOTHING,
            painted: false,
        }
    }

    /// Restores the bare background: `background[y]` is the colour of line y. Only the parts that were drawn
    /// on are restored.
    pub fn begin(&mut self, background: &[u8; HEIGHT]) {
        if !core::mem::replace(&mut self.painted, true) {
            self.drawn = Drawn::EVERYTHING;
        }
        let drawn = core::mem::replace(&mut self.drawn, Drawn::NOTHING);
        for (group, y) in drawn.groups() {
            for plane in &mut self.page.planes {
                plane.as_chunks_mut().0[group] = [background[y]; 8];
            }
        }
    }

    /// Makes the next [`Offscreen::begin`] paint the whole background, because the background has changed.
    pub fn forget(&mut self) {
        self.painted = false;
    }

    /// Returns the page.
    pub fn page(&self) -> &PlanarBuffer {
        &self.page
    }

    /// Returns the parts that were drawn on since the background was bare.
    pub(crate) fn drawn(&self) -> &Drawn {
        &self.drawn
    }
}

impl Default for Offscreen {
    fn default() -> Self {
        Self::new()
    }
}

impl Destination for Offscreen {
    fn select(&mut self, x: u16) {
        self.page.select(x);
    }

    #[inline]
    fn lane<const STEP: usize>(
        &mut self,
        x: u16,
        y: u16,
        len: u16,
        draw: impl FnOnce(Lane<'_, STEP>),
    ) {
        self.drawn.lane::<STEP>(x, y, len);
        self.page.lane(x, y, len, draw);
    }

    fn line(&mut self, x: u16, y: u16, len: u16, draw: impl FnOnce(Line<'_>)) {
        let last = check_row(x, y, len);
        self.drawn.add(x, last, y, y + 1);
        self.page.line(x, y, len, draw);
    }
}
