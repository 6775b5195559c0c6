//! The serial line: COM1, framed lines out, bytes in.

use core::fmt;

use link::{ACKNOWLEDGE, CANCEL};
use spin::Mutex;
use uart_16550::backend::PioBackend;
use uart_16550::spec::registers::{FifoTriggerLevel, IER};
use uart_16550::{BaudRate, Config, Uart16550};

use super::{ports, timer};

/// COM1's base port.
const COM1: u16 = 0x3F8;

/// The port, once it was found.
static SERIAL: Mutex<Option<Uart16550<PioBackend>>> = Mutex::new(None);

/// Finds and sets up the port. A machine without one runs all the same, and says nothing.
///
/// Set: 115 200 baud, 8-N-1, FIFO on, an interrupt for bytes received, which wakes the processor. Left unset: everything about modem control.
pub fn init() {
    let Some(mut uart) = port() else { return };
    let config = Config {
        baud_rate: BaudRate::Baud115200,
        interrupts: IER::DATA_READY,
        // An interrupt for each byte would cost ten times the time when much is said. What is left
        // below the level comes with the FIFO's time-out, four characters (0.35 ms) later.
        fifo_trigger_level: Some(FifoTriggerLevel::Fourteen),
        ..Config::DEFAULT
    };
    if uart.init(config).is_ok() {
        *SERIAL.lock() = Some(uart);
    }
}

/// Writes one framed line.
pub fn line(text: fmt::Arguments<'_>) {
    if let Some(uart) = &mut *SERIAL.lock() {
        link::write_line(text, |bytes| uart.send_bytes_exact(bytes));
    }
}

/// Cancels the line that something else may have begun.
pub fn cancel_line() {
    if let Some(uart) = &mut *SERIAL.lock() {
        uart.send_bytes_exact(&[CANCEL]);
    }
}

/// The next byte that was received, if any.
pub fn receive() -> Option<u8> {
    SERIAL.lock().as_mut()?.try_receive_byte().ok()
}

/// Whether a byte is waiting.
pub fn has_received() -> bool {
    let mut serial = SERIAL.lock();
    serial
        .as_mut()
        .is_some_and(|uart| uart.ready_to_receive().is_ok())
}

fn port() -> Option<Uart16550<PioBackend>> {
    // SAFETY: COM1's ports are a UART's, or nobody's, on every PC.
    unsafe { Uart16550::new_port(COM1) }.ok()
}

/// A writer for reports of a panic or an exception: it goes past the lock, which the code that
/// failed may hold, and waits for the host no longer than [`PATIENCE`] in all.
#[derive(Debug)]
pub struct Unlocked {
    clock: timer::Countdown,
}

/// Timer periods that a whole report may wait for its host: 5 s at 60 Hz, and 16 s if the failure
/// came before the timer was set.
const PATIENCE: u32 = 300;

const LINE_STATUS: u16 = COM1 + 5;
const DATA_READY: u8 = 0x01;
const TRANSMITTER_EMPTY: u8 = 0x20;

impl Unlocked {
    /// Takes the port over; what the lock's holder had begun of a line is cancelled.
    pub fn take_over() -> Self {
        let mut this = Self {
            clock: timer::Countdown::new(PATIENCE),
        };
        this.send(&[CANCEL]);
        this
    }

    /// Writes one framed line.
    pub fn line(&mut self, text: fmt::Arguments<'_>) {
        link::write_line(text, |bytes| self.send(bytes));
    }

    /// Waits until the host acknowledges; commands that were under way are thrown away.
    pub fn wait_for_host(&mut self) {
        while self.wait(DATA_READY) {
            // SAFETY: reading COM1's data register takes a byte and touches no memory.
            if unsafe { ports::in8(COM1) } == ACKNOWLEDGE {
                return;
            }
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.wait(TRANSMITTER_EMPTY);
            // SAFETY: writing COM1's data register sends a byte and touches no memory.
            unsafe { ports::out8(COM1, byte) };
        }
    }

    /// Whether `status` came before patience was over.
    fn wait(&mut self, status: u8) -> bool {
        loop {
            // SAFETY: reading COM1's line status touches no memory.
            if unsafe { ports::in8(LINE_STATUS) } & status != 0 {
                return true;
            }
            if self.clock.is_over() {
                return false;
            }
        }
    }
}
