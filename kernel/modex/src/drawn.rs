//! The record of what was drawn on a page: the parts that the next frame on the page must erase.

use crate::column::check_lane;
use crate::{HEIGHT, STRIDE};

/// Bytes of one wide store, and of one group of the records in [`Drawn`]: 8 bytes, 32 pixels, of a
/// line.
pub(crate) const GROUP_BYTES: usize = 8;
const GROUPS: usize = STRIDE / GROUP_BYTES;
const GROUP_PIXELS: u16 = 4 * GROUP_BYTES as u16;

/// The parts of a page that were drawn on since the page last held the bare background: for each group of 32
/// pixel columns, the lines from a top to a bottom. Both records only grow, and start at zero, so a lane is
/// added without a test whether its group already has lines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    /// Lines from the top to the page's end.
    rise: [u16; GROUPS],
    /// The line after the last.
    bottom: [u16; GROUPS],
}

impl Drawn {
    /// Nothing drawn. All zeros, so that a value that contains it occupies no space in the kernel's image.
    pub(crate) const NOTHING: Self = Self {
        rise: [0; GROUPS],
        bottom: [0; GROUPS],
    };
    pub(crate) const EVERYTHING: Self = Self {
        rise: [HEIGHT as u16; GROUPS],
        bottom: [HEIGHT as u16; GROUPS],
    };

    /// Adds a lane of `len` pixels from (x, y) on.
    ///
    /// # Panics
    /// If the lane leaves the frame.
    #[inline]
    pub(crate) fn lane<const STEP: usize>(&mut self, x: u16, y: u16, len: u16) {
        let (last, bottom) = check_lane::<STEP>(x, y, len);
        if STEP == STRIDE {
            self.add_to(usize::from(x / GROUP_PIXELS), y, bottom);
        } else {
            self.add(x, last, y, bottom);
        }
    }

    /// Adds the pixel columns `first..=last`, lines `top..bottom`, all of which must be in the
    /// frame.
    #[inline]
    pub(crate) fn add(&mut self, first: u16, last: u16, top: u16, bottom: u16) {
        for group in usize::from(first / GROUP_PIXELS)..=usize::from(last / GROUP_PIXELS) {
            self.add_to(group, top, bottom);
        }
    }

    #[inline]
    fn add_to(&mut self, group: usize, top: u16, bottom: u16) {
        let rise = HEIGHT as u16 - top;
        // Most lanes lie beside other lanes and store nothing here.
        if self.rise[group] < rise {
            self.rise[group] = rise;
        }
        if self.bottom[group] < bottom {
            self.bottom[group] = bottom;
        }
    }

    /// Returns the parts that were drawn on in either record.
    pub(crate) fn or(&self, other: &Self) -> Self {
        let mut both = *self;
        for group in 0..GROUPS {
            both.add_to(
                group,
                HEIGHT as u16 - other.rise[group],
                other.bottom[group],
            );
        }
        both
    }

    /// Returns the groups of 8 bytes that were drawn on, counted from the page's start, each with
    /// its line.
    pub(crate) fn groups(&self) -> impl Iterator<Item = (usize, usize)> {
        let lines = self.rise.into_iter().zip(self.bottom);
        lines.enumerate().flat_map(|(group, (rise, bottom))| {
            let lines = HEIGHT - usize::from(rise)..usize::from(bottom);
            lines.map(move |y| (y * GROUPS + group, y))
        })
    }
}
