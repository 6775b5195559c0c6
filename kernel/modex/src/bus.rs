//! Access to ports and video memory.

use crate::Lane;

/// The purpose of an access, so that a bus that counts can count purposes separately.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Purpose {
    /// Setting the mode and the palette; reading registers and memory back.
    Setup,
    /// Drawing columns.
    Draw,
    /// Restoring the background of a page.
    Erase,
    /// Drawing the overlay over the frame.
    Overlay,
    /// Changing the start address and waiting for it.
    Flip,
}

/// Port and video-memory access to a VGA.
///
/// Reads take `&mut self`: reading a port of the VGA has side effects (3DA resets the attribute controller's
/// flip-flop). Addresses are offsets into the window at A0000h. Their type wraps at 64 KiB, as the card's
/// addresses do. Accesses happen in program order. An implementation must not let the compiler move a store
/// across a port write, because a port write decides where the store goes.
pub trait Bus {
    /// Writes a byte to a port.
    fn out8(&mut self, port: u16, value: u8);
    /// Writes a word to a port. On the index ports of sequencer, graphics controller and CRTC, the low byte
    /// is the index and the high byte its data.
    fn out16(&mut self, port: u16, value: u16);
    /// Reads a byte from a port.
    fn in8(&mut self, port: u16) -> u8;
    /// Reads a word from a port.
    fn in16(&mut self, port: u16) -> u16;
    /// Stores eight bytes at `at..at + 8`, lowest byte first. `at` is a multiple of 8.
    fn store64(&mut self, at: u16, bytes: u64);
    /// Loads the byte at `at` from the plane that Read Map selects. Fills all four latches.
    fn load8(&mut self, at: u16) -> u8;
    /// Lends `draw` the `len` bytes at `at`, `at + STEP`, ..., and carries out its stores before returning.
    /// All of the bytes lie inside the window.
    fn lane<const STEP: usize>(&mut self, at: u16, len: u16, draw: impl FnOnce(Lane<'_, STEP>));
    /// Announces the purpose of the following accesses.
    fn purpose(&mut self, _purpose: Purpose) {}
}

/// A borrowed bus is a bus, so that a driver can use a card that outlives it.
impl<B: Bus> Bus for &mut B {
    fn out8(&mut self, port: u16, value: u8) {
        B::out8(self, port, value);
    }

    fn out16(&mut self, port: u16, value: u16) {
        B::out16(self, port, value);
    }

    fn in8(&mut self, port: u16) -> u8 {
        B::in8(self, port)
    }

    fn in16(&mut self, port: u16) -> u16 {
        B::in16(self, port)
    }

    fn store64(&mut self, at: u16, bytes: u64) {
        B::store64(self, at, bytes);
    }

    fn load8(&mut self, at: u16) -> u8 {
        B::load8(self, at)
    }

    fn lane<const STEP: usize>(&mut self, at: u16, len: u16, draw: impl FnOnce(Lane<'_, STEP>)) {
        B::lane(self, at, len, draw);
    }

    fn purpose(&mut self, purpose: Purpose) {
        B::purpose(self, purpose);
    }
}
