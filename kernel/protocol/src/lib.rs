//! The serial protocol between kernel and host, for both ends.
//!
//! The protocol is text, one line at a time, so that a person at a terminal can use it and `diff` can compare
//! transcripts. The kernel's lines end in a checksum:
//!
//! ```text
//! ok show 480 *999dd5b2
//! ```
//!
//! The eight hex digits are the CRC-32 (ISO-HDLC) of everything before ` *`. A line ends in LF, in CR, or in
//! CR LF. Both ends send LF; the Enter key of a terminal sends CR, and some programs on the way turn LF into
//! CR LF. Lines are printable ASCII, at most [`MAX_LINE`] bytes. Backspace and Delete remove the last byte of
//! the line, and the byte [`CANCEL`] (Ctrl-X) removes all of the line so far.
//!
//! The kernel does not echo, so a person at a terminal sees only the answers unless the terminal echoes
//! locally. If a terminal starts each line where the line before ended, it has to add a CR to each LF:
//! `picocom --echo --imap lfcrlf` does both.
//!
//! The kernel receives at any time, also while it draws. If the UART lost a byte of a line, or a byte of the
//! line arrived damaged, the kernel answers the line with `error` and does not carry it out. If the loss is
//! between two lines, the kernel refuses both.
//!
//! The host sends one [`Command`] a line. The host may end the line in a checksum too, and the kernel then
//! checks it. The kernel answers with any number of lines. The last line begins with `ok` and repeats the
//! command, or begins with `error` and says what is wrong:
//!
//! | command | answer, before `ok` |
//! | --- | --- |
//! | `hold` | |
//! | `run` | |
//! | `show 480`, `show pose 0 13e93e93 0ccccccc 2f333` | `page 1` |
//! | `show 480 motion ffa4fa50 0 0 0` | the same; the frame is drawn in reduced quality |
//! | `show at 99` | the same |
//! | `scene cube`, `mapper exact`, `order planes` | |
//! | `scene`, `mapper`, `order` | a line for each value: `exact perspective; ...`; the line of the current value begins with `*` |
//! | `steer faster`, `steer 99 mapper exact` | |
//! | `log` | `scene ball`, `mapper shifts`, `order polygons`, and a line for each change: `steer 99 faster`; if the log was full, a last line with the number of changes that are not in it: `lost 3` |
//! | `keys` | a line for each key: `F finer: half the error of within-T` |
//! | `dump`, `dump all` | a [`dump`] |
//! | `checksums`, `checksums all` | `page start 4b00 crc ...`, `palette crc ...`, with `all` four of `plane 0 crc ...` |
//! | `registers` | a line for each block: `sequencer 03 01 08 00 06`, ... |
//! | `counts` | `frame polygons 228 columns ...`, a line for each purpose: `draw ports 3460 map-mask ...`, the pace of a running demo: `pace frames ...`, and `keys taken ...` |
//! | `state` | `held` or `running tick 99`, `scene ball`, `mapper shifts`, `order polygons`, `frame 480`, `motion none` (a motion if the frame has faces in reduced quality), `drawn shifts` (the frame's mapper; `none` without a frame), `page 1 start 4b00`, `serial overruns 0 damaged 0 full 0` ([`Reception`]) |
//! | `version` | `crystal-ball 0.1.0 protocol 7 dump 5` |
//! | `fail KIND` | no answer: the kernel fails in the named way ([`FailKind`]) |
//! | `leave` | no lines; QEMU ends after the `ok` |
//!
//! Commands that arrive during an answer are answered after it, in order. The kernel waits for a host that
//! does not read. Between answers the kernel also sends these lines:
//!
//! - `hello crystal-ball VERSION protocol 7`: the boot loader has started the kernel;
//! - `loaded model 1a2b3c4d`, with the model file's checksum, or `refused model: ...`, with the reason: right
//!   after `hello`, if the boot loader has loaded a ramdisk;
//! - `running`: the first frame is on the screen;
//! - `panic ...`, `exception ...` or `adapter ...`, then lines with details, then [`END_OF_REPORT`].
//!
//! # Example
//!
//! ```
//! use protocol::{Command, FrameName, without_checksum, write_line};
//!
//! // The kernel parses a command, with or without a checksum.
//! let command = Command::parse("show 480").unwrap();
//! assert_eq!(command, Command::Show(FrameName::Number(480)));
//!
//! // It ends each line of its answer in a checksum, which the host verifies.
//! let mut line = Vec::new();
//! write_line(format_args!("ok {command}"), |bytes| line.extend_from_slice(bytes));
//! assert_eq!(line, b"ok show 480 *999dd5b2\n");
//! assert_eq!(without_checksum("ok show 480 *999dd5b2"), Ok("ok show 480"));
//! ```
#![no_std]
#![forbid(unsafe_code)]

mod action;
mod command;
pub mod dump;
mod frame;
mod lines;
mod setting;

pub use action::{Action, Change};
pub use command::{Command, CommandError, Content, FailKind, FrameName, Motion};
pub use frame::{Checksum, ChecksumError, without_checksum, write_line};
pub use lines::{LineError, Lines};
pub use setting::{Setting, Word};

/// Ticks in a second of the machine's time. The demo draws a frame for each tick, as far as the machine keeps
/// up.
pub const TICKS_PER_SECOND: u32 = 60;
/// The protocol's version, which the kernel's first line contains.
pub const PROTOCOL: u32 = 7;
/// Longest line in bytes, with its checksum and without its line end. 320 pixels of a dump and their label
/// are 657 bytes long.
pub const MAX_LINE: usize = 700;
/// First word of the kernel's first line.
pub const HELLO: &str = "hello";
/// First word of the line that says that the kernel has accepted the ramdisk's model file.
pub const LOADED: &str = "loaded";
/// First word of the line that says that the kernel has refused the ramdisk's model file.
pub const REFUSED: &str = "refused";
/// The line that says that the first frame is on the screen.
pub const RUNNING: &str = "running";
/// First word of a panic's first line.
pub const PANIC: &str = "panic";
/// First word of an exception's first line.
pub const EXCEPTION: &str = "exception";
/// First word of the first line of the report that the display adapter does not support Mode X.
pub const ADAPTER: &str = "adapter";
/// The last line of a report of a panic, an exception or an adapter. The kernel then waits, for a bounded
/// time, for [`ACKNOWLEDGE`].
pub const END_OF_REPORT: &str = "end of report";
/// The byte (ACK) that the host sends when it has taken its last screendump.
pub const ACKNOWLEDGE: u8 = 0x06;
/// The byte (CAN) that discards what the line contains so far. The kernel's first line begins with it,
/// because firmware may have written to the line before. A report begins with it too, because the failure may
/// have happened in the middle of a line.
pub const CANCEL: u8 = 0x18;
/// First word of an answer's last line if the command was carried out.
pub const OK: &str = "ok";
/// First word of an answer's last line if the command was not carried out.
pub const ERROR: &str = "error";

/// Errors of the kernel's receiver, counted since the kernel's start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reception {
    /// Times that the UART lost bytes because its FIFO was full.
    pub overruns: u32,
    /// Bytes with a parity or framing error, and breaks.
    pub damaged: u32,
    /// Times that the kernel's own buffer was full. If the sender can wait, as QEMU can, this loses nothing;
    /// on a wire, overruns follow.
    pub full: u32,
}

/// The value that the kernel writes to QEMU's `isa-debug-exit` device. QEMU's exit code is twice the value
/// plus one. The values are chosen so that no exit code is 0 or 1, which QEMU uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// The host sent `leave`.
    Left = 0x10,
    /// A panic.
    Panic = 0x11,
    /// A CPU exception.
    Exception = 0x12,
    /// The display adapter does not support Mode X.
    Adapter = 0x13,
}

impl Exit {
    /// Port of the device, as the host configures it. On a PC no device answers there.
    pub const PORT: u16 = 0xF4;

    /// Returns QEMU's exit code for this exit.
    pub const fn code(self) -> i32 {
        (self as i32) << 1 | 1
    }

    /// Returns the exit that QEMU's exit code stands for.
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
    fn each_exit_has_a_different_code_and_is_found_by_it() {
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
        // Exit codes of QEMU, of a value that the kernel does not write, and of a signal.
        for code in [0, 1, 31, 34, 41, 139, -1] {
            assert_eq!(Exit::from_code(code), None);
        }
    }
}
