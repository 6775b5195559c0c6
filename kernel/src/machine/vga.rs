//! The bare machine's VGA, as the Mode X driver's bus.

use core::ptr::NonNull;

use modex::{Bus, Lane, PLANE_BYTES};

use super::ports;

/// The card's ports, and its window at A0000h. Only this type reaches video memory, always by volatile
/// accesses and never as a slice: a compiler that saw plain stores would merge or drop stores that differ
/// only in the port writes between them.
#[derive(Debug)]
pub struct HardwareVga {
    base: NonNull<u8>,
}

impl HardwareVga {
    /// Returns the card whose window is mapped at `base`.
    ///
    /// # Safety
    /// `base..base + 64 KiB` is the card's window for the life of the value, and no other code accesses the
    /// window or the card's ports.
    pub unsafe fn new(base: NonNull<u8>) -> Self {
        Self { base }
    }
}

impl Bus for HardwareVga {
    fn out8(&mut self, port: u16, value: u8) {
        // SAFETY: the VGA's ports change what is shown and where stores go, never RAM.
        unsafe { ports::out8(port, value) }
    }

    fn out16(&mut self, port: u16, value: u16) {
        // SAFETY: as in `out8`.
        unsafe { ports::out16(port, value) }
    }

    fn in8(&mut self, port: u16) -> u8 {
        // SAFETY: as in `out8`.
        unsafe { ports::in8(port) }
    }

    fn in16(&mut self, port: u16) -> u16 {
        // SAFETY: as in `out8`.
        unsafe { ports::in16(port) }
    }

    fn store64(&mut self, at: u16, bytes: u64) {
        assert!(
            at.is_multiple_of(8),
            "a wide store at {at:04x} is not aligned"
        );
        // SAFETY: `at` is a multiple of 8 below 64 KiB, so at least 8 bytes remain in the window.
        let place = unsafe { self.base.add(usize::from(at)) }.cast::<u64>();
        // SAFETY: the place is inside the window, and aligned, because the window starts on a page.
        unsafe { place.write_volatile(bytes) }
    }

    fn load8(&mut self, at: u16) -> u8 {
        // SAFETY: any 16-bit offset is inside the window.
        let place = unsafe { self.base.add(usize::from(at)) };
        // SAFETY: the place is inside the window. A load from the card fills the card's latches and changes
        // no RAM.
        unsafe { place.read_volatile() }
    }

    #[inline]
    fn lane<const STEP: usize>(&mut self, at: u16, len: u16, draw: impl FnOnce(Lane<'_, STEP>)) {
        let end = usize::from(at) + usize::from(len.saturating_sub(1)) * STEP;
        if end >= PLANE_BYTES {
            outside(at, len, STEP);
        }
        // SAFETY: `at` is inside the window.
        let base = unsafe { self.base.add(usize::from(at)) };
        // SAFETY: from `at` to `end` the lane is inside the window, which only `self` reaches.
        draw(unsafe { Lane::new(base, len) });
    }
}

/// Cold path: keeps the panic formatting out of the caller.
#[cold]
fn outside(at: u16, len: u16, step: usize) -> ! {
    panic!("{len} pixels, {step} bytes apart, at {at:04x} leave the window")
}
