//! What a texture mapper writes through.

use core::marker::PhantomData;
use core::ptr::NonNull;

use crate::STRIDE;

/// A place for pixels, addressed by column.
pub trait Destination {
    /// Lends `draw` the `len` pixels from (x, y) down, their plane selected.
    ///
    /// # Panics
    /// If the column is empty or leaves the 320x240 picture: coverage never asks for that, and
    /// a store outside the page would show up in another one.
    fn column(&mut self, x: u16, y: u16, len: u16, draw: impl FnOnce(Column<'_>));
}

/// `len` bytes at a base and then every 80: a column of one plane, open for writing once.
///
/// The only type that stores to video memory one byte at a time. The stores are volatile: the
/// compiler sees neither the card's planes nor the port writes that select them, and was seen
/// deleting a plain store as overwritten.
#[derive(Debug)]
pub struct Column<'a> {
    base: NonNull<u8>,
    len: u16,
    lent: PhantomData<&'a mut u8>,
}

impl Column<'_> {
    /// A column of `len` bytes from `base`.
    ///
    /// # Safety
    /// For as long as the column lives, `base.add(i * STRIDE)` is valid for volatile writes of
    /// a byte for every `i < len`, and nothing else reads or writes there.
    pub unsafe fn new(base: NonNull<u8>, len: u16) -> Self {
        Self {
            base,
            len,
            lent: PhantomData,
        }
    }

    /// The first `rows` pixels, and those after them.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn split(self, rows: u16) -> (Self, Self) {
        assert!(rows <= self.len, "{rows} of {} pixels", self.len);
        let Self { base, len, lent } = self;
        // The last pixel may be the last byte of what is lent: no pointer goes past it.
        let after = match rows < len {
            // SAFETY: `rows < len`, so by the contract of `new` the address is inside.
            true => unsafe { base.add(usize::from(rows) * STRIDE) },
            false => base,
        };
        let (first, second) = (rows, len - rows);
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

    /// Writes every pixel from the top down; `texel` is called once for each.
    #[inline(always)]
    pub fn fill(self, mut texel: impl FnMut() -> u8) {
        for row in 0..usize::from(self.len) {
            let value = texel();
            // SAFETY: `row < len`, so by the contract of `new` the address is inside.
            let at = unsafe { self.base.add(row * STRIDE) };
            // SAFETY: the same contract makes it valid for a volatile write.
            unsafe { at.write_volatile(value) };
        }
    }
}
