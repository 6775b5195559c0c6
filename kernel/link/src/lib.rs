//! The serial line between kernel and host: both ends of one protocol.
//!
//! Text, a line at a time, so that a person at a terminal can speak it and `diff` can compare
//! what was said. The kernel's lines end in a checksum:
//!
//! ```text
//! ok show 480 *999dd5b2
//! ```
//!
//! The eight hex digits are the CRC-32 (ISO-HDLC) of everything before ` *`. A line ends in LF, in
//! CR, or in CR LF. Both ends of the line send LF; the Enter key of a terminal sends CR, and some
//! programs on the way turn LF into CR LF. Lines are printable ASCII, at most [`MAX_LINE`] bytes.
//! Backspace and Delete take the last byte back, and the byte [`CANCEL`] (Ctrl-X) takes back the
//! whole line so far.
//!
//! The kernel does not echo what it receives: a person at a terminal sees the answers alone, and
//! switches the terminal's own echo on. A terminal that shows each line further to the right than
//! the line before has to add a CR to each LF: `picocom --echo --imap lfcrlf` does both.
//!
//! The kernel receives at any time, also while it draws. A line from which the UART has lost a byte,
//! or in which a byte arrived damaged, is answered with `error` and is not carried out; of two lines
//! beside a loss both are refused.
//!
//! The host sends a [`Command`] a line; it may end it in a checksum too, and then the kernel
//! checks it. The kernel answers with any number of lines and closes with one that begins with
//! `ok` (and repeats the command) or `error` (and says why):
//!
//! | command | answer, before `ok` |
//! | --- | --- |
//! | `hold` | |
//! | `run` | |
//! | `show 480`, `show pose 0 13e93e93 0ccccccc 2f333` | `page 1` |
//! | `show 480 motion ffa4fa50 0 0 0` | the same; the picture is drawn in reduced quality |
//! | `show at 99` | the same |
//! | `scene cube`, `mapper exact`, `order planes` | |
//! | `scene`, `mapper`, `order` | a line for each that there is: `exact perspective; ...`, the one that is set begins with `*` |
//! | `steer faster`, `steer 99 mapper exact` | |
//! | `log` | `scene ball`, `mapper shifts`, `order polygons`, and a line for each change: `steer 99 faster`; after a log that is full `lost 3`, and how many were not noted |
//! | `keys` | a line for each key: `F finer: half the error of within-T` |
//! | `dump`, `dump all` | a [`dump`] |
//! | `checksums`, `checksums all` | `page start 4b00 crc ...`, `palette crc ...`, with `all` four of `plane 0 crc ...` |
//! | `registers` | a line for each block: `sequencer 03 01 08 00 06`, ... |
//! | `counts` | `picture polygons 228 columns ...`, and a line for each purpose: `draw ports 3460 map-mask ...` |
//! | `state` | `held` or `running tick 99`, `scene ball`, `mapper shifts`, `order polygons`, `picture 480`, `motion none` (a motion if it had faces drawn in reduced quality), `drawn shifts` (the picture's mapper; `none` without a picture), `page 1 start 4b00`, `serial overruns 0 damaged 0 full 0` ([`Reception`]) |
//! | `version` | `crystal-ball 0.1.0 protocol 6 dump 4` |
//! | `fail KIND` | none: the kernel breaks in the way that is named ([`Fault`]) |
//! | `leave` | after the `ok` QEMU ends |
//!
//! Commands that come while an answer is under way are answered after it, in their order. A host
//! that does not read is waited for. Between answers the kernel says on its own:
//!
//! - `hello crystal-ball VERSION protocol 6`: the boot loader has handed over;
//! - `loaded pack 1a2b3c4d`, with the pack's checksum, or `refused pack: ...`, and why: if the
//!   boot loader brought a ramdisk, right after it;
//! - `running`: the first picture is on the screen;
//! - `panic ...`, `exception ...`, `adapter ...`, and lines that explain it, then
//!   [`END_OF_REPORT`].
#![no_std]
#![forbid(unsafe_code)]

mod action;
mod command;
pub mod dump;
mod frame;
mod lines;

pub use action::{Action, Change};
pub use command::{Command, CommandError, Content, Fault, Motion, Picture, Setting, Word};
pub use frame::{Checksum, FrameError, unframe, write_line};
pub use lines::{Lines, Noise};

/// Ticks in a second of the machine's time: a frame is drawn for each tick, as far as the machine
/// keeps up.
pub const TICKS_PER_SECOND: u32 = 60;
/// The protocol's version, in the kernel's first line.
pub const PROTOCOL: u32 = 6;
/// Longest line in bytes, its checksum included, its end not: 320 pixels of a dump with their
/// label take 657.
pub const MAX_LINE: usize = 700;
/// First word of the kernel's first line.
pub const HELLO: &str = "hello";
/// First word of the line that says that the ramdisk's pack was taken.
pub const LOADED: &str = "loaded";
/// First word of the line that says that it was not.
pub const REFUSED: &str = "refused";
/// The line that says that the first picture is on the screen.
pub const RUNNING: &str = "running";
/// First word of a panic's first line.
pub const PANIC: &str = "panic";
/// First word of an exception's first line.
pub const EXCEPTION: &str = "exception";
/// First word of the first line of the report that the display adapter does not take Mode X.
pub const ADAPTER: &str = "adapter";
/// The last line of a panic's, an exception's or an adapter's report. The kernel then waits, for a bounded time,
/// for [`ACKNOWLEDGE`].
pub const END_OF_REPORT: &str = "end of report";
/// The byte (ACK) by which the host says that it has taken its last screendump.
pub const ACKNOWLEDGE: u8 = 0x06;
/// The byte (CAN) that throws away what has been said of a line so far. The kernel's first line
/// begins with it, since firmware may have spoken before, and so does a report, since the failure
/// may have happened in the middle of a line.
pub const CANCEL: u8 = 0x18;
/// First word of an answer's last line when the command was carried out.
pub const OK: &str = "ok";
/// First word of an answer's last line when it was not.
pub const ERROR: &str = "error";

/// What went wrong on the way into the kernel, counted since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reception {
    /// Times that the UART lost bytes, because its FIFO was full.
    pub overruns: u32,
    /// Bytes with a parity or framing error, and breaks.
    pub damaged: u32,
    /// Times that the kernel's own buffer was full. That alone loses nothing on a line whose sender
    /// can wait, such as QEMU's; on a wire overruns follow.
    pub full: u32,
}

/// What the kernel writes to QEMU's `isa-debug-exit` device. QEMU's exit code is twice that
/// plus one, so none of them is 0 or 1, which QEMU uses itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Asked to leave.
    Left = 0x10,
    /// A panic.
    Panic = 0x11,
    /// A CPU exception.
    Exception = 0x12,
    /// The display adapter does not take Mode X.
    Adapter = 0x13,
}

impl Exit {
    /// Port of the device, as the host configures it: on a PC no device answers there.
    pub const PORT: u16 = 0xF4;

    /// QEMU's exit code for it.
    pub const fn code(self) -> i32 {
        (self as i32) << 1 | 1
    }

    /// The exit that QEMU's exit code stands for.
    pub fn from_code(code: i32) -> Option<Self> {
        [Self::Left, Self::Panic, Self::Exception, Self::Adapter]
            .into_iter()
            .find(|exit| exit.code() == code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exit_has_a_code_of_its_own_and_comes_back_from_it() {
        let codes = [
            (Exit::Left, 33),
            (Exit::Panic, 35),
            (Exit::Exception, 37),
            (Exit::Adapter, 39),
        ];
        for (exit, code) in codes {
            assert_eq!(exit.code(), code);
            assert_eq!(Exit::from_code(code), Some(exit));
        }
        // Those of QEMU itself, of a write that QEMU does not make, and of a signal.
        for code in [0, 1, 31, 34, 41, 139, -1] {
            assert_eq!(Exit::from_code(code), None);
        }
    }
}
