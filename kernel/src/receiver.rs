//! The receiver: it moves bytes from the UART to the program.
//!
//! The UART's FIFO holds 16 bytes, which arrive in 1.4 ms at 115 200 baud; drawing a frame takes longer. So
//! the interrupt handler moves the bytes from the FIFO into a [`Ring`], which the program empties between
//! frames.
//!
//! When the ring is full, the handler leaves the bytes in the FIFO and switches the UART's interrupt off. The
//! program switches it on again when half of the ring is free. QEMU holds back the bytes that follow, so
//! nothing is lost. A real UART overruns its FIFO and reports that.
//!
//! A line with a lost or damaged byte must never be carried out, not even the part of it that arrived.
//! [`Received::damaged`] marks the bytes that may be next to a loss.

use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};

use crate::ring::Ring;

/// Line Status bit 0: a byte can be read.
const DATA_READY: u8 = 0x01;
/// Line Status bit 1: a byte arrived while the FIFO was full, and is lost.
const OVERRUN: u8 = 0x02;
/// Line Status bits 2 to 4: the next byte has a parity error, a framing error, or is a break.
const DAMAGED: u8 = 0x1C;
/// Line Status bit 5: the transmitter accepts bytes.
const TRANSMITTER_READY: u8 = 0x20;
/// The value that a port without a device reads. A UART sets bit 7 only with a FIFO error, and never sets all
/// bits.
const NO_DEVICE: u8 = 0xFF;
/// Bytes that the receiver's FIFO holds.
const FIFO: u8 = 16;
/// Set in a ring's item if the byte is damaged.
const MARK: u16 = 0x100;

/// Access to a UART's registers.
pub trait Uart {
    /// Reads Line Status. The read clears the UART's error bits.
    fn line_status(&mut self) -> u8;
    /// Removes the oldest byte from the FIFO and returns it.
    fn data(&mut self) -> u8;
    /// Switches the interrupt for received bytes on or off.
    fn set_interrupt(&mut self, on: bool);
}

/// A received byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// The byte.
    pub byte: u8,
    /// Bytes before this one may be lost, or this byte arrived damaged.
    pub damaged: bool,
}

/// A ring of `SIZE` bytes behind a UART, and counters of its errors.
#[derive(Debug)]
pub struct Receiver<const SIZE: usize> {
    ring: Ring<SIZE>,
    /// Number of following bytes that are marked as damaged.
    suspect: AtomicU8,
    /// The UART's interrupt is off, because the ring was full.
    paused: AtomicBool,
    overruns: AtomicU32,
    damaged: AtomicU32,
    pauses: AtomicU32,
}

impl<const SIZE: usize> Receiver<SIZE> {
    /// Returns a receiver that has received nothing.
    pub const fn new() -> Self {
        Self {
            ring: Ring::new(),
            suspect: AtomicU8::new(0),
            paused: AtomicBool::new(false),
            overruns: AtomicU32::new(0),
            damaged: AtomicU32::new(0),
            pauses: AtomicU32::new(0),
        }
    }

    /// The interrupt handler's part: moves bytes from the FIFO into the ring, until the FIFO is empty or the
    /// ring is full. It must not stop earlier, because the interrupt controller sees only the edge at which
    /// the UART's request begins.
    pub fn handle_interrupt(&self, uart: &mut impl Uart) {
        // Check for a full ring first: reading Line Status clears the errors of the next byte.
        while !self.ring.is_full() {
            let status = uart.line_status();
            if status == NO_DEVICE {
                return;
            }
            self.count_errors(status);
            if status & DATA_READY == 0 {
                return;
            }
            let byte = u16::from(uart.data());
            let suspect = self.suspect.load(Ordering::Relaxed);
            self.suspect
                .store(suspect.saturating_sub(1), Ordering::Relaxed);
            let mark = if suspect > 0 { MARK } else { 0 };
            // The push succeeds: only the handler stores, and the ring had room.
            let _ = self.ring.push(byte | mark);
        }
        self.pauses.fetch_add(1, Ordering::Relaxed);
        self.paused.store(true, Ordering::Relaxed);
        uart.set_interrupt(false);
    }

    /// The program's part: removes the oldest byte from the ring and returns it.
    pub fn fetch(&self, uart: &mut impl Uart) -> Option<Received> {
        let item = self.ring.pop();
        if self.paused.load(Ordering::Relaxed) && self.ring.len() <= SIZE / 2 {
            // The handler cannot run until `set_interrupt`, because its interrupt is off.
            self.paused.store(false, Ordering::Relaxed);
            uart.set_interrupt(true);
        }
        item.map(|item| Received {
            byte: item as u8,
            damaged: item & MARK != 0,
        })
    }

    /// Returns whether the ring holds bytes.
    pub fn has_received(&self) -> bool {
        !self.ring.is_empty()
    }

    /// Returns whether the transmitter accepts bytes. Senders must call this function and not read Line
    /// Status, because the read clears the error bits. Called with interrupts off, so that the handler moves
    /// no byte between the read and the count of its errors.
    pub fn can_send(&self, uart: &mut impl Uart) -> bool {
        let status = uart.line_status();
        self.count_errors(status);
        status & TRANSMITTER_READY != 0
    }

    /// Counts the errors in a value of Line Status, and marks the bytes that they affect.
    fn count_errors(&self, status: u8) {
        if status & OVERRUN != 0 {
            self.overruns.fetch_add(1, Ordering::Relaxed);
            // The FIFO was full when the byte was lost, and no byte has been removed from it since. The gap
            // is therefore after the bytes that the FIFO holds and before the byte that follows. A UART
            // without a FIFO lost the byte before its next byte. All of these bytes are marked.
            self.suspect.store(FIFO + 1, Ordering::Relaxed);
        }
        if status & DAMAGED != 0 {
            self.damaged.fetch_add(1, Ordering::Relaxed);
            self.suspect.fetch_max(1, Ordering::Relaxed);
        }
    }

    /// Times that the UART lost bytes because its FIFO was full.
    pub fn overruns(&self) -> u32 {
        self.overruns.load(Ordering::Relaxed)
    }

    /// Bytes that arrived with a parity error, a framing error or as a break.
    pub fn damaged(&self) -> u32 {
        self.damaged.load(Ordering::Relaxed)
    }

    /// Times that the ring was full.
    pub fn pauses(&self) -> u32 {
        self.pauses.load(Ordering::Relaxed)
    }
}

impl<const SIZE: usize> Default for Receiver<SIZE> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::Lines;
    use std::collections::VecDeque;

    /// A UART with a FIFO of 16 bytes, as its datasheet describes it.
    #[derive(Default)]
    struct SimulatedUart {
        fifo: VecDeque<(u8, u8)>,
        overrun: u8,
        on: bool,
        /// The sender waits while the FIFO is full, as QEMU does.
        waits: bool,
        /// The transmitter is busy.
        busy: bool,
    }

    impl SimulatedUart {
        fn on() -> Self {
            let on = true;
            Self {
                on,
                ..Self::default()
            }
        }

        /// Lets a byte arrive on the wire, with `errors` in the bits of Line Status.
        fn arrive(&mut self, byte: u8, errors: u8) {
            if self.fifo.len() < usize::from(FIFO) {
                self.fifo.push_back((byte, errors));
            } else {
                assert!(!self.waits);
                self.overrun = OVERRUN;
            }
        }

        /// Returns whether the UART requests an interrupt, at a trigger level of 8 bytes.
        fn requests(&self) -> bool {
            self.on && self.fifo.len() >= 8
        }
    }

    impl Uart for SimulatedUart {
        fn line_status(&mut self) -> u8 {
            let next = self.fifo.front_mut();
            let ready = if next.is_some() { DATA_READY } else { 0 };
            let errors = next.map_or(0, |(_, errors)| std::mem::take(errors));
            let sending = if self.busy { 0 } else { TRANSMITTER_READY };
            ready | errors | std::mem::take(&mut self.overrun) | sending
        }

        fn data(&mut self) -> u8 {
            self.fifo.pop_front().map_or(0, |(byte, _)| byte)
        }

        fn set_interrupt(&mut self, on: bool) {
            self.on = on;
        }
    }

    fn fetch_all<const SIZE: usize>(
        receiver: &Receiver<SIZE>,
        uart: &mut SimulatedUart,
        lines: &mut Lines,
        received_lines: &mut Vec<Result<String, String>>,
    ) {
        while let Some(received) = receiver.fetch(uart) {
            if received.damaged {
                lines.damage();
            }
            if let Some(line) = lines.push(received.byte) {
                received_lines.push(line.map(str::to_owned).map_err(|error| error.to_string()));
            }
        }
    }

    /// 115 200 baud without a pause during a frame of 300 ms, in which the program fetches nothing: 3 456
    /// bytes.
    #[test]
    fn a_burst_during_a_long_frame_loses_nothing() {
        let sent: Vec<String> = (0..216).map(|n| format!("show {n:010}")).collect();
        let bytes: Vec<u8> = sent.join("\r").into_bytes();
        assert!(bytes.len() >= 3_400, "{}", bytes.len());
        let receiver = Receiver::<4096>::new();
        let mut uart = SimulatedUart::on();
        for &byte in bytes.iter().chain(b"\r") {
            uart.arrive(byte, 0);
            if uart.requests() {
                receiver.handle_interrupt(&mut uart);
            }
        }
        // The FIFO's time-out delivers the rest.
        receiver.handle_interrupt(&mut uart);
        let (mut lines, mut received_lines) = (Lines::new(), Vec::new());
        fetch_all(&receiver, &mut uart, &mut lines, &mut received_lines);
        let expected: Vec<_> = sent.into_iter().map(Ok).collect();
        assert_eq!(received_lines, expected);
        assert_eq!((receiver.overruns(), receiver.pauses()), (0, 0));
        assert!(!receiver.has_received());
    }

    /// A sender that waits while the FIFO is full loses nothing, however small the ring is.
    #[test]
    fn a_full_ring_makes_the_sender_wait() {
        let receiver = Receiver::<16>::new();
        let mut uart = SimulatedUart::on();
        uart.waits = true;
        let mut sent = (0..5_000u32).map(|n| n as u8);
        let mut expected = (0..5_000u32).map(|n| n as u8);
        let mut fetched = 0;
        for round in 0..10_000 {
            while uart.fifo.len() < usize::from(FIFO)
                && let Some(byte) = sent.next()
            {
                uart.arrive(byte, 0);
                if uart.requests() {
                    receiver.handle_interrupt(&mut uart);
                }
            }
            if round % 3 == 0 && uart.on {
                receiver.handle_interrupt(&mut uart);
            }
            for _ in 0..round % 7 {
                if let Some(received) = receiver.fetch(&mut uart) {
                    assert_eq!(Some(received.byte), expected.next());
                    assert!(!received.damaged);
                    fetched += 1;
                }
            }
        }
        assert_eq!(fetched, 5_000);
        assert!(receiver.pauses() > 100, "{}", receiver.pauses());
        assert!(uart.on, "the interrupt is on again");
        assert_eq!(receiver.overruns(), 0);
    }

    #[test]
    fn the_interrupt_is_off_until_a_full_ring_is_half_empty() {
        let receiver = Receiver::<16>::new();
        let mut uart = SimulatedUart::on();
        for byte in 0..16 {
            uart.arrive(byte, 0);
            receiver.handle_interrupt(&mut uart);
            assert_eq!(uart.on, byte < 15, "after {byte}");
        }
        for byte in 0..16 {
            assert_eq!(receiver.fetch(&mut uart).map(|r| r.byte), Some(byte));
            assert_eq!(uart.on, byte >= 7, "after {byte}");
        }
        // Only a pause lets the program switch the interrupt on.
        uart.on = false;
        assert_eq!(receiver.fetch(&mut uart), None);
        assert!(!uart.on);
        assert_eq!(receiver.pauses(), 1);
    }

    #[test]
    fn a_waiting_byte_and_a_busy_transmitter_are_reported() {
        let receiver = Receiver::<16>::new();
        let mut uart = SimulatedUart::on();
        for busy in [true, false] {
            uart.busy = busy;
            uart.arrive(7, 0);
            assert_eq!(receiver.can_send(&mut uart), !busy);
            assert!(!receiver.has_received());
            receiver.handle_interrupt(&mut uart);
            assert!(receiver.has_received());
            assert!(receiver.fetch(&mut uart).is_some());
        }
    }

    /// Whichever bytes a UART loses, no line that misses one of them is accepted.
    #[test]
    fn a_line_with_a_lost_byte_is_refused() {
        let mut random = seeded::generator();
        let mut refused = 0;
        for _ in 0..300 {
            let receiver = Receiver::<64>::new();
            let mut uart = SimulatedUart::on();
            let (mut lines, mut received_lines) = (Lines::new(), Vec::new());
            let mut sent = Vec::new();
            let mut lost = false;
            for number in 0..40 {
                let width = random.usize(1..20);
                let line = format!("{number:0width$}");
                for &byte in line.as_bytes().iter().chain(b"\n") {
                    uart.arrive(byte, 0);
                    lost |= uart.overrun != 0;
                    // The handler runs late, and the program later still.
                    if random.u8(..12) == 0 {
                        receiver.handle_interrupt(&mut uart);
                    }
                    if random.u8(..40) == 0 {
                        // Sending reads Line Status too.
                        assert!(receiver.can_send(&mut uart));
                        fetch_all(&receiver, &mut uart, &mut lines, &mut received_lines);
                    }
                }
                sent.push(line);
            }
            let mut rest = sent.iter();
            for line in &received_lines {
                match line {
                    // Accepted lines are complete and in order.
                    Ok(line) => assert!(rest.any(|sent| sent == line), "'{line}' was not sent"),
                    Err(error) => {
                        assert_eq!(
                            error,
                            "bytes of the line were lost or damaged on the wire; send the line again"
                        );
                        refused += 1;
                    }
                }
            }
            if receiver.overruns() == 0 && uart.overrun == 0 {
                assert!(!lost);
                assert!(received_lines.iter().all(Result::is_ok));
            }
        }
        assert!(refused > 100, "{refused}");
    }

    #[test]
    fn a_line_with_a_damaged_byte_is_refused_whoever_reads_the_status() {
        for sender_reads_first in [false, true] {
            for error in [0x04, 0x08, 0x10] {
                let receiver = Receiver::<64>::new();
                let mut uart = SimulatedUart::on();
                for &byte in b"one\ntwo\nthree\n" {
                    uart.arrive(byte, if byte == b'w' { error } else { 0 });
                    if sender_reads_first {
                        receiver.can_send(&mut uart);
                    }
                    receiver.handle_interrupt(&mut uart);
                }
                let (mut lines, mut received_lines) = (Lines::new(), Vec::new());
                fetch_all(&receiver, &mut uart, &mut lines, &mut received_lines);
                let lost =
                    "bytes of the line were lost or damaged on the wire; send the line again";
                let expected = [Ok("one"), Err(lost), Ok("three")];
                let received_lines: Vec<_> = received_lines
                    .iter()
                    .map(|line| line.as_deref().map_err(String::as_str))
                    .collect();
                assert_eq!(received_lines, expected);
                assert_eq!((receiver.damaged(), receiver.overruns()), (1, 0));
            }
        }
    }

    #[test]
    fn a_port_without_a_device_gives_no_bytes() {
        struct NoDevice;
        impl Uart for NoDevice {
            fn line_status(&mut self) -> u8 {
                NO_DEVICE
            }
            fn data(&mut self) -> u8 {
                unreachable!("the port has no byte")
            }
            fn set_interrupt(&mut self, _: bool) {
                unreachable!("the ring is empty")
            }
        }
        let receiver = Receiver::<16>::new();
        receiver.handle_interrupt(&mut NoDevice);
        assert!(!receiver.has_received());
        assert_eq!((receiver.overruns(), receiver.damaged()), (0, 0));
    }
}
