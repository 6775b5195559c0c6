//! The serial line: COM1, framed lines out, bytes in.

use core::fmt;

use protocol::{ACKNOWLEDGE, CANCEL, Reception, TICKS_PER_SECOND};
use spin::Mutex;
use uart_16550::backend::PioBackend;
use uart_16550::spec::registers::{FifoTriggerLevel, IER};
use uart_16550::{BaudRate, Config, Uart16550};

use super::{ports, timer};
use crate::receiver::{Received, Receiver, Uart};

/// COM1's base port.
const COM1: u16 = 0x3F8;
const DATA: u16 = COM1;
const INTERRUPT_ENABLE: u16 = COM1 + 1;
const LINE_STATUS: u16 = COM1 + 5;
const DATA_READY: u8 = 0x01;
const TRANSMITTER_EMPTY: u8 = 0x20;
/// Bytes that the transmitter accepts at once.
const FIFO: usize = 16;

/// Bytes that can wait for the program: as many as arrive in 0.35 s at 115 200 baud.
const RING: usize = 4096;
static RECEIVER: Receiver<RING> = Receiver::new();

/// The port for sending, if it was found. The interrupt handler accesses the receiver's registers without
/// this lock.
static SERIAL: Mutex<Option<Port>> = Mutex::new(None);

/// The sender's side of COM1.
#[derive(Debug)]
struct Port {
    /// Bytes that the transmitter accepts at once: 1 if the UART has no FIFO.
    room: usize,
}

/// The receiver's side of COM1.
struct Com1;

impl Uart for Com1 {
    fn line_status(&mut self) -> u8 {
        // SAFETY: reading COM1's Line Status touches no memory.
        unsafe { ports::in8(LINE_STATUS) }
    }

    fn data(&mut self) -> u8 {
        // SAFETY: reading COM1's data register removes a byte from the UART and touches no memory.
        unsafe { ports::in8(DATA) }
    }

    fn set_interrupt(&mut self, on: bool) {
        let enabled = if on { IER::DATA_READY } else { IER::empty() };
        // SAFETY: COM1's interrupt has a handler, and the register touches no memory.
        unsafe { ports::out8(INTERRUPT_ENABLE, enabled.bits()) }
    }
}

/// Finds the port and sets it up. A machine without the port still runs, without output.
///
/// It sets 115 200 baud, 8-N-1 and FIFO on, and leaves modem control as it is. [`listen`] switches the
/// interrupt on.
pub fn init() {
    let Some(mut uart) = port() else { return };
    let config = Config {
        baud_rate: BaudRate::Baud115200,
        interrupts: IER::empty(),
        // The other half of the FIFO fills in 0.7 ms, more than twice what the keyboard's handler may need.
        // Bytes below the trigger level arrive with the FIFO's time-out, four characters (0.35 ms) later.
        fifo_trigger_level: Some(FifoTriggerLevel::Eight),
        ..Config::DEFAULT
    };
    if uart.init(config).is_ok() {
        let room = if uart.fifo_enabled() { FIFO } else { 1 };
        *SERIAL.lock() = Some(Port { room });
    }
}

/// Switches the interrupt for received bytes on. The interrupt controller must be set up: it sees only the
/// edge at which a request begins, and bytes that are already waiting begin one here.
pub fn listen() {
    if SERIAL.lock().is_some() {
        Com1.set_interrupt(true);
    }
}

/// Writes one framed line.
pub fn line(text: fmt::Arguments<'_>) {
    if let Some(port) = &mut *SERIAL.lock() {
        protocol::write_line(text, |bytes| port.send(bytes));
    }
}

/// Cancels a line that other software may have begun.
pub fn cancel_line() {
    if let Some(port) = &mut *SERIAL.lock() {
        port.send(&[CANCEL]);
    }
}

impl Port {
    /// Sends bytes, and waits while the host does not read.
    fn send(&mut self, bytes: &[u8]) {
        for bytes in bytes.chunks(self.room) {
            while !super::undisturbed(|| RECEIVER.can_send(&mut Com1)) {
                core::hint::spin_loop();
            }
            for &byte in bytes {
                // SAFETY: writing COM1's data register sends a byte and touches no memory.
                unsafe { ports::out8(DATA, byte) };
            }
        }
    }
}

/// Returns the next received byte, if one is waiting.
pub fn receive() -> Option<Received> {
    RECEIVER.fetch(&mut Com1)
}

/// Returns whether a byte is waiting.
pub fn has_received() -> bool {
    RECEIVER.has_received()
}

/// Returns the receiver's errors since the start.
pub fn reception() -> Reception {
    Reception {
        overruns: RECEIVER.overruns(),
        damaged: RECEIVER.damaged(),
        full: RECEIVER.pauses(),
    }
}

/// The interrupt handler's part: moves received bytes into the ring.
pub(super) fn handle_interrupt() {
    RECEIVER.handle_interrupt(&mut Com1);
}

fn port() -> Option<Uart16550<PioBackend>> {
    // SAFETY: on every PC, COM1's ports belong to a UART or to no device.
    unsafe { Uart16550::new_port(COM1) }.ok()
}

/// A writer for reports of a panic or an exception. It bypasses the lock, which the code that failed may
/// hold, and waits for the host no longer than `HOST_TIMEOUT` in all.
#[derive(Debug)]
pub struct Unlocked {
    clock: timer::Countdown,
}

/// Timer periods that a whole report may wait for the host: 5 s of ticks, and 16 s if the failure came before
/// the timer was set.
const HOST_TIMEOUT: u32 = 5 * TICKS_PER_SECOND;

impl Unlocked {
    /// Takes over the port, and cancels a line that the lock's holder may have begun.
    pub fn take_over() -> Self {
        let mut this = Self {
            clock: timer::Countdown::new(HOST_TIMEOUT),
        };
        this.send(&[CANCEL]);
        this
    }

    /// Writes one framed line.
    pub fn line(&mut self, text: fmt::Arguments<'_>) {
        protocol::write_line(text, |bytes| self.send(bytes));
    }

    /// Waits until the host acknowledges, and discards commands that were on their way.
    pub fn wait_for_host(&mut self) {
        while self.wait(DATA_READY) {
            if Com1.data() == ACKNOWLEDGE {
                return;
            }
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.wait(TRANSMITTER_EMPTY);
            // SAFETY: writing COM1's data register sends a byte and touches no memory.
            unsafe { ports::out8(DATA, byte) };
        }
    }

    /// Waits for `status`. Returns false if `HOST_TIMEOUT` ran out first.
    fn wait(&mut self, status: u8) -> bool {
        loop {
            if Com1.line_status() & status != 0 {
                return true;
            }
            if self.clock.is_over() {
                return false;
            }
        }
    }
}
