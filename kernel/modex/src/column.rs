//! Destinations: the contract by which a texture mapper writes pixels.

use core::marker::PhantomData;
use core::ptr::NonNull;

use crate::{HEIGHT, STRIDE, WIDTH};

/// A destination for pixels, addressed by lanes that lie in one plane.
///
/// The plane that stores reach is part of the destination's state, as it is of the card's:
/// [`select`] it, then request [`lane`]s of that plane. [`column`] does both.
///
/// [`select`]: Destination::select
/// [`lane`]: Destination::lane
/// [`column`]: Destination::column
pub trait Destination {
    /// Selects the plane of screen column `x`.
    fn select(&mut self, x: u16);

    /// Lends `draw` the `len` pixels from (x, y) on, `STEP` bytes apart; their plane must be selected. A
    /// `STEP` of [`STRIDE`] is a column, and a `STEP` of 1 is every fourth pixel of a row.
    ///
    /// # Panics
    /// If the lane is empty or leaves the 320x240 frame. Coverage never requests such a lane, and a store
    /// outside the page would appear in another page.
    fn lane<const STEP: usize>(
        &mut self,
        x: u16,
        y: u16,
        len: u16,
        draw: impl FnOnce(Lane<'_, STEP>),
    );

    /// Selects the plane of column `x`, and lends `draw` the `len` pixels from (x, y) down.
    ///
    /// # Panics
    /// As [`Destination::lane`].
    fn column(&mut self, x: u16, y: u16, len: u16, draw: impl FnOnce(Column<'_>)) {
        self.select(x);
        self.lane(x, y, len, draw);
    }

    /// Writes the `len` pixels from (x, y) to the right in order, and selects the plane for each; `texel` is
    /// called once for each. The plane that is selected afterwards is unspecified.
    ///
    /// # Panics
    /// As [`Destination::lane`].
    fn row(&mut self, x: u16, y: u16, len: u16, mut texel: impl FnMut() -> u8) {
        check_row(x, y, len);
        for x in x..x + len {
            self.column(x, y, 1, |pixel| pixel.fill(&mut texel));
        }
    }

    /// Lends `draw` line `y` in RAM, then writes the `len` pixels from (x, y) to the right from it, one plane
    /// after the other. `draw` must store to these pixels and to no others. The line's initial contents and
    /// the plane that is selected afterwards are unspecified.
    ///
    /// # Panics
    /// As [`Destination::lane`].
    fn line(&mut self, x: u16, y: u16, len: u16, draw: impl FnOnce(Line<'_>)) {
        check_row(x, y, len);
        let mut line = [[0; STRIDE]; 4];
        draw(line.each_mut());
        for first in 0..len.min(4) {
            let (x, len) = (x + first, (len - first).div_ceil(4));
            let mut own = line[usize::from(x & 3)][usize::from(x / 4)..].iter();
            self.select(x);
            self.lane::<1>(x, y, len, |row| {
                row.fill(|| own.next().copied().unwrap_or(0))
            });
        }
    }
}

/// A line of the screen in RAM: pixel x is `line[x & 3][x / 4]`.
pub type Line<'a> = [&'a mut [u8; STRIDE]; 4];

/// Returns the last screen column of a row, after checking that the row lies in the frame.
pub(crate) fn check_row(x: u16, y: u16, len: u16) -> u16 {
    let more = len.wrapping_sub(1);
    assert!(
        x < WIDTH as u16 && y < HEIGHT as u16 && more < WIDTH as u16 - x,
        "{len} pixels in a row at ({x}, {y}) are not in the frame"
    );
    x + more
}

/// Returns the last screen column of a lane and the line after its last, after checking that the
/// lane lies in the frame.
#[inline]
pub(crate) fn check_lane<const STEP: usize>(x: u16, y: u16, len: u16) -> (u16, u16) {
    const {
        assert!(
            STEP == STRIDE || STEP == 1,
            "columns, or every fourth pixel of a row"
        )
    };
    // For an empty lane `more` is 65 535, which leaves the frame as well.
    let more = u32::from(len.wrapping_sub(1));
    let (right, down) = if STEP == STRIDE {
        (0, more)
    } else {
        (4 * more, 0)
    };
    let (last, line) = (u32::from(x) + right, u32::from(y) + down);
    if last >= WIDTH as u32 || line >= HEIGHT as u32 {
        outside(x, y, len, STEP);
    }
    (last as u16, line as u16 + 1)
}

/// Cold path: keeps the panic formatting out of the caller.
#[cold]
fn outside(x: u16, y: u16, len: u16, step: usize) -> ! {
    panic!("{len} pixels, {step} bytes apart, at ({x}, {y}) are not in the frame")
}

/// A column of one plane: a lane with 80 bytes from pixel to pixel.
pub type Column<'a> = Lane<'a, STRIDE>;

/// A lane: `len` bytes of one plane, a base and then every `STEP`th byte, open for writing once.
///
/// This is the only type that stores to video memory one byte at a time. The stores are volatile: the
/// compiler sees neither the card's planes nor the port writes that select them. It once deleted a plain
/// store as overwritten.
#[derive(Debug)]
pub struct Lane<'a, const STEP: usize> {
    base: NonNull<u8>,
    len: u16,
    lent: PhantomData<&'a mut u8>,
}

impl<'a, const STEP: usize> Lane<'a, STEP> {
    /// Returns the lane of a slice's first byte and every `STEP`th byte after it.
    pub fn over(bytes: &'a mut [u8]) -> Self {
        let len = bytes.len().div_ceil(STEP);
        assert!(len <= usize::from(u16::MAX), "{len} pixels in a lane");
        // SAFETY: the slice spans the lane from its first byte to its last, and its exclusive borrow lives as
        // long as the lane.
        unsafe { Self::new(NonNull::from(bytes).cast(), len as u16) }
    }

    /// Returns a lane of `len` bytes from `base`.
    ///
    /// # Safety
    /// For as long as the lane lives, `base.add(i * STEP)` is valid for volatile writes of a byte for every
    /// `i < len`, and nothing else reads or writes there.
    pub unsafe fn new(base: NonNull<u8>, len: u16) -> Self {
        Self {
            base,
            len,
            lent: PhantomData,
        }
    }

    /// Returns the number of pixels.
    pub fn len(&self) -> u16 {
        self.len
    }

    /// Returns whether the lane has no pixels.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the address of the first byte. The contract of [`Lane::new`] holds as long as the lane lives:
    /// a tuned loop writes to the lane's bytes, volatile, and nowhere else.
    pub fn as_ptr(&mut self) -> *mut u8 {
        self.base.as_ptr()
    }

    /// Lends the `pixels` pixels from pixel `first` on.
    ///
    /// # Panics
    /// If the lane has fewer pixels.
    #[inline]
    pub fn part(&mut self, first: u16, pixels: u16) -> Lane<'_, STEP> {
        assert!(
            first <= self.len && pixels <= self.len - first,
            "{pixels} of {} pixels from pixel {first} on",
            self.len
        );
        // The last pixel may be the last byte of the borrowed memory: no pointer goes past it.
        let base = match first < self.len {
            // SAFETY: `first < len`, so by the contract of `new` the address is inside.
            true => unsafe { self.base.add(usize::from(first) * STEP) },
            false => self.base,
        };
        Lane {
            base,
            len: pixels,
            lent: PhantomData,
        }
    }

    /// Splits the lane into its first `pixels` pixels and the rest.
    ///
    /// # Panics
    /// If the lane has fewer pixels.
    #[inline]
    pub fn split(self, pixels: u16) -> (Self, Self) {
        if pixels > self.len {
            missing(pixels, self.len);
        }
        let Self { base, len, lent } = self;
        // The last pixel may be the last byte of the borrowed memory: no pointer goes past it.
        let after = match pixels < len {
            // SAFETY: `pixels < len`, so by the contract of `new` the address is inside.
            true => unsafe { base.add(usize::from(pixels) * STEP) },
            false => base,
        };
        let (first, second) = (pixels, len - pixels);
        let first = Self {
            base,
            len: first,
            lent,
        };
        let second = Self {
            base: after,
            len: second,
            lent,
        };
        (first, second)
    }

    /// Returns lanes of `pixels` pixels each, from the first pixel on. Pixels at the end that do not fill a
    /// lane are left out.
    ///
    /// # Panics
    /// If `pixels` is 0.
    #[inline]
    pub fn chunks(self, pixels: u16) -> impl Iterator<Item = Self> {
        let Self { base, len, lent } = self;
        let step = usize::from(pixels) * STEP;
        (0..usize::from(len / pixels) * step)
            .step_by(step)
            .map(move |offset| {
                // SAFETY: this many lanes fit in the length, so by the contract of `new` the address is
                // inside, and so are the `pixels` pixels from there on, which are in no other lane.
                let base = unsafe { base.add(offset) };
                let len = pixels;
                Self { base, len, lent }
            })
    }

    /// Writes every pixel in order; `texel` is called once for each.
    #[inline(always)]
    pub fn fill(self, mut texel: impl FnMut() -> u8) {
        for pixel in 0..usize::from(self.len) {
            let value = texel();
            // SAFETY: `pixel < len`, so by the contract of `new` the address is inside.
            let at = unsafe { self.base.add(pixel * STEP) };
            // SAFETY: the same contract makes it valid for a volatile write.
            unsafe { at.write_volatile(value) };
        }
    }
}

/// Cold path: keeps the panic formatting out of the caller.
#[cold]
fn missing(pixels: u16, len: u16) -> ! {
    panic!("{pixels} of {len} pixels")
}
