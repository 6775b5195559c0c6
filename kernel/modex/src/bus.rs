//! How ports and video memory are reached.

use crate::Lane;

/// Why an access is made, so that a bus that counts can count apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Purpose {
    /// Setting the mode and the palette; reading registers and memory back.
    Setup,
    /// Drawing columns.
    Draw,
    /// Restoring the background of a page.
    Erase,
    /// Writing over the picture.
    Overlay,
    /// Changing the start address and waiting for it.
    Flip,
}

/// Port and video-memory access to a VGA.
///
/// Reads take `&mut self`: reading a port of the VGA has side effects (3DA resets the
/// attribute controller's flip-flop). Addresses are offsets into the window at A0000h, and
/// wrap at 64 KiB by their type, as the card's do. Accesses happen in program order; an
/// implementation must not let the compiler move a store across a port write, since a port
/// write decides where the store goes.
pub trait Bus {
    /// Writes a byte to a port.
    fn out8(&mut self, port: u16, value: u8);
    /// Writes a word to a port: on the index ports of sequencer, graphics controller and CRTC
    /// that is the index in the low byte and its data in the high byte.
    fn out16(&mut self, port: u16, value: u16);
    /// Reads a byte from a port.
    fn in8(&mut self, port: u16) -> u8;
    /// Reads a word from a port.
    fn in16(&mut self, port: u16) -> u16;
    /// Stores eight bytes at `at..at + 8`, little end first. `at` is a multiple of 8.
    fn store64(&mut self, at: u16, bytes: u64);
    /// Loads the byte at `at`, of the plane that Read Map names. All four latches are filled.
    fn load8(&mut self, at: u16) -> u8;
    /// Lends `draw` the `len` bytes at `at`, `at + STEP`, ..., and carries out what it stored
    /// before returning. All of them lie inside the window.
    fn lane<const STEP: usize>(&mut self, at: u16, len: u16, draw: impl FnOnce(Lane<'_, STEP>));
    /// Announces what the next accesses are for.
    fn purpose(&mut self, _purpose: Purpose) {}
}

/// A bus that is only lent, so that a driver can be put on a card that outlives it.
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
