//! The keyboard: scan codes from the PS/2 controller (8042), by interrupt.
//!
//! The kernel changes little in the controller, because the firmware has set it up for an operating system,
//! and may be emulating it for a USB keyboard. The kernel reads the configuration byte and writes it back
//! with keyboard, interrupt and translation on, and the mouse off. So codes are in set 1, whatever the
//! keyboard sends. The keyboard's repeat rate, lights and own code set stay as they are.

use core::sync::atomic::{AtomicU32, Ordering};

use super::ports;
use crate::ring::Ring;

/// Data port: reads codes, and writes the byte after a command.
const DATA: u16 = 0x60;
/// Status port when read, command port when written.
const STATUS: u16 = 0x64;

/// Status: a byte is waiting in [`DATA`].
const OUTPUT_FULL: u8 = 0x01;
/// Status: the controller has not accepted the last byte yet.
const INPUT_FULL: u8 = 0x02;
/// Status: the waiting byte is the mouse's.
const FROM_MOUSE: u8 = 0x20;
/// The value that a port without a device reads.
const NO_DEVICE: u8 = 0xFF;

const READ_CONFIGURATION: u8 = 0x20;
const WRITE_CONFIGURATION: u8 = 0x60;
const DISABLE_MOUSE: u8 = 0xA7;
const DISABLE_KEYBOARD: u8 = 0xAD;
const ENABLE_KEYBOARD: u8 = 0xAE;
/// Configuration: interrupt for the keyboard, and translation of its codes to set 1.
const ON: u8 = 0x41;
/// Configuration: interrupt for the mouse.
const OFF: u8 = 0x02;
/// Configuration: stop the clocks of keyboard and mouse.
const STOPPED: u8 = 0x30;

/// Polls of a status bit before the kernel gives the controller up. The controller answers within some
/// milliseconds, and a poll lasts about a microsecond.
const POLLS: u32 = 100_000;

/// Codes that can wait for the program: as many as a keyboard sends in three seconds.
const RING: usize = 128;
static CODES: Ring<RING> = Ring::new();
/// Codes that were lost because the ring was full.
static LOST: AtomicU32 = AtomicU32::new(0);

/// Sets the controller up. A machine without a controller still runs; keys then have no effect.
///
/// Both ports are off until the end, because a byte from a device between the command and the controller's
/// answer would be read as the configuration byte.
///
/// Called with interrupts off and the keyboard's interrupt not masked. A code that arrived earlier would keep
/// the request up, and no later request would be seen.
pub fn init() {
    if status() == NO_DEVICE {
        return;
    }
    command(DISABLE_KEYBOARD);
    command(DISABLE_MOUSE);
    wait(|status| status & INPUT_FULL == 0);
    drain();
    command(READ_CONFIGURATION);
    if wait(|status| status & OUTPUT_FULL != 0) {
        let configuration = read() & !OFF | ON | STOPPED;
        command(WRITE_CONFIGURATION);
        if wait(|status| status & INPUT_FULL == 0) {
            // SAFETY: the controller is waiting for its configuration byte, which this is.
            unsafe { ports::out8(DATA, configuration) };
        }
    }
    command(ENABLE_KEYBOARD);
    wait(|status| status & INPUT_FULL == 0);
    drain();
}

/// Returns the next code, if one is waiting.
pub fn receive() -> Option<u8> {
    CODES.pop().map(|code| code as u8)
}

/// Returns whether a code is waiting.
pub fn has_received() -> bool {
    !CODES.is_empty()
}

/// Returns how many codes were lost because the ring was full.
pub fn lost() -> u32 {
    LOST.load(Ordering::Relaxed)
}

/// The interrupt handler's part: fetches what the controller has. It fetches every waiting code, because the
/// request is an edge, but no more codes than the ring holds, in case the port reads nonsense.
pub(super) fn handle_interrupt() {
    for _ in 0..RING {
        let status = status();
        if status & OUTPUT_FULL == 0 || status == NO_DEVICE {
            return;
        }
        let code = read();
        if status & FROM_MOUSE == 0 && !CODES.push(code.into()) {
            LOST.fetch_add(1, Ordering::Relaxed);
        }
    }
}

fn status() -> u8 {
    // SAFETY: reading the controller's status changes nothing.
    unsafe { ports::in8(STATUS) }
}

fn read() -> u8 {
    // SAFETY: the read removes a byte from the controller and touches no memory.
    unsafe { ports::in8(DATA) }
}

fn command(command: u8) {
    if wait(|status| status & INPUT_FULL == 0) {
        // SAFETY: the commands above set the controller up; none of them resets the machine.
        unsafe { ports::out8(STATUS, command) };
    }
}

/// Discards the waiting bytes.
fn drain() {
    wait(|status| {
        let waiting = status & OUTPUT_FULL != 0;
        if waiting {
            read();
        }
        !waiting
    });
}

/// Polls the status until `holds` accepts it. Returns false if that does not happen within [`POLLS`] polls.
fn wait(mut holds: impl FnMut(u8) -> bool) -> bool {
    (0..POLLS).any(|_| holds(status()))
}
