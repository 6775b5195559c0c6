//! The keyboard: scancodes from the PS/2 controller (8042), by interrupt.
//!
//! The controller is asked for little, since firmware has set it up for an operating system to take
//! over, and a USB keyboard may stand behind it by the firmware's doing: its configuration byte is
//! read and written back with keyboard, interrupt and translation on, and the mouse off. So codes are
//! of set 1 whatever the keyboard speaks. Left as they are: the keyboard's rate of repeats, its
//! lights, and its own code set.

use core::sync::atomic::{AtomicU32, Ordering};

use super::ports;
use crate::ring::Ring;

/// Data: codes in, and the byte of a command out.
const DATA: u16 = 0x60;
/// Status when read, commands when written.
const STATUS: u16 = 0x64;

/// A byte is waiting in [`DATA`].
const OUTPUT_FULL: u8 = 0x01;
/// The controller has not taken the last byte yet.
const INPUT_FULL: u8 = 0x02;
/// The waiting byte is the mouse's.
const FROM_MOUSE: u8 = 0x20;
/// What a port with nothing behind it reads.
const NOTHING: u8 = 0xFF;

const READ_CONFIGURATION: u8 = 0x20;
const WRITE_CONFIGURATION: u8 = 0x60;
const DISABLE_MOUSE: u8 = 0xA7;
const DISABLE_KEYBOARD: u8 = 0xAD;
const ENABLE_KEYBOARD: u8 = 0xAE;
/// Interrupt for the keyboard, and its codes translated to set 1.
const ON: u8 = 0x41;
/// Interrupt for the mouse.
const OFF: u8 = 0x02;
/// The clocks of keyboard and mouse stopped.
const STOPPED: u8 = 0x30;

/// Polls of a status bit before the controller is given up: it answers within some milliseconds, and
/// a poll takes about a microsecond.
const POLLS: u32 = 100_000;

/// Codes that wait for the program: what a keyboard sends in three seconds.
const RING: usize = 128;
static CODES: Ring<RING> = Ring::new();
/// Codes that found no room.
static LOST: AtomicU32 = AtomicU32::new(0);

/// Sets the controller up. A machine without one runs all the same, and no key does anything.
///
/// Both ports are off until the end: a byte that a device sends between the command and the
/// controller's answer would be taken for the configuration byte.
///
/// Called with interrupts off, the keyboard's not masked: a code that came before would keep the
/// request up, and no other one would be seen.
pub fn init() {
    if status() == NOTHING {
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
            // SAFETY: the configuration byte, which the controller waits for.
            unsafe { ports::out8(DATA, configuration) };
        }
    }
    command(ENABLE_KEYBOARD);
    wait(|status| status & INPUT_FULL == 0);
    drain();
}

/// The next code, if any.
pub fn receive() -> Option<u8> {
    CODES.pop().map(|code| code as u8)
}

/// Whether a code is waiting.
pub fn has_received() -> bool {
    !CODES.is_empty()
}

/// Codes that found no room.
pub fn lost() -> u32 {
    LOST.load(Ordering::Relaxed)
}

/// The interrupt handler's part: fetches what the controller has. All of it, since the request is an
/// edge; and no more than the ring holds, should the port read nonsense.
pub(super) fn take() {
    for _ in 0..RING {
        let status = status();
        if status & OUTPUT_FULL == 0 || status == NOTHING {
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
    // SAFETY: it takes a byte from the controller and touches no memory.
    unsafe { ports::in8(DATA) }
}

fn command(command: u8) {
    if wait(|status| status & INPUT_FULL == 0) {
        // SAFETY: the commands above set the controller up; none resets the machine.
        unsafe { ports::out8(STATUS, command) };
    }
}

/// Throws away what is waiting.
fn drain() {
    wait(|status| {
        let waiting = status & OUTPUT_FULL != 0;
        if waiting {
            read();
        }
        !waiting
    });
}

/// Whether the status came to hold.
fn wait(mut holds: impl FnMut(u8) -> bool) -> bool {
    (0..POLLS).any(|_| holds(status()))
}
