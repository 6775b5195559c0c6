//! A page in RAM with the card's planar layout.

use core::ptr::NonNull;

use crate::column::{check_lane, check_row};
use crate::{Destination, HEIGHT, Lane, Line, PAGE_BYTES, STRIDE, WIDTH};

/// Four planes of one page: pixel (x, y) is `planes[x & 3][80 y + x / 4]`.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct PlanarBuffer {
    /// The planes.
    pub planes: [[u8; PAGE_BYTES]; 4],
}

impl PlanarBuffer {
    /// Returns a page of zeros.
    pub const fn new() -> Self {
        Self {
            planes: [[0; PAGE_BYTES]; 4],
        }
    }

    /// Paints every line y in the colour `background[y]`.
    pub fn clear(&mut self, background: &[u8; HEIGHT]) {
        for plane in &mut self.planes {
            for (line, &colour) in plane.chunks_exact_mut(STRIDE).zip(background) {
                line.fill(colour);
            }
        }
    }

    /// Returns the colour of pixel (x, y).
    ///
    /// # Panics
    /// If the pixel is outside the page.
    pub fn pixel(&self, x: usize, y: usize) -> u8 {
        assert!(x < WIDTH, "x = {x} is outside the page");
        self.planes[x & 3][y * STRIDE + x / 4]
    }
}

impl Default for PlanarBuffer {
    fn default() -> Self {
        Self::new()
    }
}

impl Destination for PlanarBuffer {
    /// Does nothing: all planes can be reached at any time.
    fn select(&mut self, _: u16) {}

    #[inline]
    fn lane<const STEP: usize>(
        &mut self,
        x: u16,
        y: u16,
        len: u16,
        draw: impl FnOnce(Lane<'_, STEP>),
    ) {
        check_lane::<STEP>(x, y, len);
        let (x, top) = (usize::from(x), usize::from(y));
        let first = NonNull::from(&mut self.planes).cast::<u8>();
        // SAFETY: (x, y) is in the frame, so this is a byte of its plane.
        let base = unsafe { first.add((x & 3) * PAGE_BYTES + top * STRIDE + x / 4) };
        // SAFETY: the last pixel is in the frame, too, and `STEP` bytes are a line down or four pixels right:
        // the lane lies in the plane from its first byte to its last. The exclusive borrow of the planes
        // lives until `draw` returns.
        draw(unsafe { Lane::new(base, len) });
    }

    fn line(&mut self, x: u16, y: u16, len: u16, draw: impl FnOnce(Line<'_>)) {
        check_row(x, y, len);
        draw(
            self.planes
                .each_mut()
                .map(|plane| &mut plane.as_chunks_mut().0[usize::from(y)]),
        );
    }

    fn row(&mut self, x: u16, y: u16, len: u16, mut texel: impl FnMut() -> u8) {
        let last = check_row(x, y, len);
        let line = usize::from(y) * STRIDE;
        for x in usize::from(x)..=usize::from(last) {
            self.planes[x & 3][line + x / 4] = texel();
        }
    }
}
