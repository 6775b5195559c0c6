//! Ticks, [`TICKS_PER_SECOND`] of them, from the programmable interval timer.
//!
//! The VGA's retrace cannot serve as a clock: QEMU toggles it at every read.

use core::sync::atomic::{AtomicU32, Ordering};

use protocol::TICKS_PER_SECOND;

use super::ports;

/// The timer's input clock in Hz (14.31818 MHz / 12).
const CLOCK: u32 = 1_193_182;
/// The divisor for 60.0011 Hz.
const DIVISOR: u16 = (CLOCK / TICKS_PER_SECOND) as u16;

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

/// Returns the ticks since the start; after 2^32 - 1 comes 0.
pub fn ticks() -> u32 {
    TICKS.load(Ordering::Relaxed)
}

/// A time limit that needs no interrupts: it polls the timer's counter and counts how often it restarts.
#[derive(Debug)]
pub struct Countdown {
    periods: u32,
    reads: u32,
    last: u16,
}

impl Countdown {
    /// Reads of the counter before a timer that does not count is given up.
    const READS: u32 = 50_000_000;
    /// Command that latches channel 0's count.
    const LATCH: u8 = 0x00;

    /// Returns a countdown that is over when the counter has restarted `periods` times between polls.
    pub fn new(periods: u32) -> Self {
        Self {
            periods,
            reads: Self::READS,
            last: 0,
        }
    }

    /// Polls the counter. Returns whether the countdown is over.
    pub fn is_over(&mut self) -> bool {
        // SAFETY: latching the count only affects the next read.
        unsafe { ports::out8(COMMAND, Self::LATCH) };
        // SAFETY: the timer's ports touch no memory. Low byte first, as it was set.
        let [low, high] = [(); 2].map(|()| unsafe { ports::in8(CHANNEL_0) });
        let count = u16::from_le_bytes([low, high]);
        // The counter counts down, so a larger count means that it has restarted.
        if count > self.last {
            self.periods = self.periods.saturating_sub(1);
        }
        self.last = count;
        self.reads = self.reads.saturating_sub(1);
        self.periods == 0 || self.reads == 0
    }
}

/// The interrupt handler's part: counts a tick.
pub(super) fn tick() {
    TICKS.fetch_add(1, Ordering::Relaxed);
}
