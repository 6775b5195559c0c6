//! Ticks: 1/60 s of machine time, from the programmable interval timer.
//!
//! The VGA's retrace can't pace anything here: QEMU toggles it at every read.

use core::sync::atomic::{AtomicU32, Ordering};

use super::ports;

/// The timer's input clock in Hz (14.31818 MHz / 12).
const CLOCK: u32 = 1_193_182;
/// Ticks a second.
const RATE: u32 = 60;
/// 60.0011 Hz.
const DIVISOR: u16 = (CLOCK / RATE) as u16;

const CHANNEL_0: u16 = 0x40;
const COMMAND: u16 = 0x43;
/// Channel 0, low byte then high byte, mode 2 (rate generator), binary.
const RATE_GENERATOR: u8 = 0x34;

static TICKS: AtomicU32 = AtomicU32::new(0);

/// Starts the timer. Interrupts must be set up.
pub fn start() {
    let [low, high] = DIVISOR.to_le_bytes();
    for (port, value) in [
        (COMMAND, RATE_GENERATOR),
        (CHANNEL_0, low),
        (CHANNEL_0, high),
    ] {
        // SAFETY: the timer's ports; its interrupt has a handler.
        unsafe { ports::out8(port, value) };
    }
    x86_64::instructions::interrupts::enable();
}

/// Ticks since the start; after 2^32 - 1 comes 0.
pub fn ticks() -> u32 {
    TICKS.load(Ordering::Relaxed)
}

/// The interrupt handler's part.
pub(super) fn tick() {
    TICKS.fetch_add(1, Ordering::Relaxed);
}
