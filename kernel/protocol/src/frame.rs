//! Framing: lines with a checksum.

use core::fmt::{self, Write};

use crc::{CRC_32_ISO_HDLC, Crc, Digest};

use crate::MAX_LINE;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Length of ` *` and eight digits.
const CHECKSUM: usize = 10;

/// The CRC-32 (ISO-HDLC) of bytes that arrive in pieces.
#[derive(Clone)]
pub struct Checksum(Digest<'static, u32>);

impl Checksum {
    /// Returns the checksum of no bytes.
    pub fn new() -> Self {
        Self(CRC.digest())
    }

    /// Adds the next bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Returns the checksum of all bytes so far.
    pub fn value(&self) -> u32 {
        self.0.clone().finalize()
    }
}

impl Default for Checksum {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Debug for Checksum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Checksum({:08x})", self.value())
    }
}

/// Bytes that are collected before they are added to the checksum and sent.
const CHUNK: usize = 64;

/// Writer for the text of a line: makes it printable, cuts it to length, and computes its checksum.
struct LineWriter<F> {
    send: F,
    checksum: Checksum,
    room: usize,
    chunk: [u8; CHUNK],
    collected: usize,
}

impl<F: FnMut(&[u8])> LineWriter<F> {
    fn flush(&mut self) {
        let chunk = &self.chunk[..core::mem::take(&mut self.collected)];
        self.checksum.add(chunk);
        (self.send)(chunk);
    }
}

impl<F: FnMut(&[u8])> Write for LineWriter<F> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for c in text.chars() {
            if self.room == 0 {
                break;
            }
            self.room -= 1;
            self.chunk[self.collected] = match c {
                ' '..='~' => c as u8,
                _ => b'?',
            };
            self.collected += 1;
            if self.collected == CHUNK {
                self.flush();
            }
        }
        Ok(())
    }
}

/// Writes `text` as a line that ends in its checksum and LF. Each character that is not printable ASCII
/// becomes `?`, and text that would make the line longer than [`MAX_LINE`] is cut off, so every line written
/// is legal.
pub fn write_line(text: fmt::Arguments<'_>, send: impl FnMut(&[u8])) {
    let mut writer = LineWriter {
        send,
        checksum: Checksum::new(),
        room: MAX_LINE - CHECKSUM,
        chunk: [0; CHUNK],
        collected: 0,
    };
    // The writer never fails. A `Display` implementation may, and the line then ends where it failed.
    let _ = writer.write_fmt(text);
    writer.flush();
    let sum = writer.checksum.value();
    // The checksum itself must always fit, and is not added to the checksum.
    writer.room = CHECKSUM;
    let _ = write!(writer, " *{sum:08x}");
    writer.chunk[writer.collected] = b'\n';
    writer.collected += 1;
    writer.flush();
}

/// The reason why a line's checksum was not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChecksumError {
    /// The line has no ` *xxxxxxxx` at its end.
    NoChecksum,
    /// The checksum does not match the text.
    WrongChecksum {
        /// The checksum in the line.
        stated: u32,
        /// The checksum of the line's text.
        computed: u32,
    },
}

impl fmt::Display for ChecksumError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoChecksum => f.write_str("the line does not end in a checksum"),
            Self::WrongChecksum { stated, computed } => write!(
                f,
                "the line has checksum {stated:08x}, but its text has {computed:08x}"
            ),
        }
    }
}

impl core::error::Error for ChecksumError {}

/// Returns the text of a line that ends in its checksum.
///
/// # Errors
/// If the checksum is missing or wrong.
pub fn without_checksum(line: &str) -> Result<&str, ChecksumError> {
    let (text, digits) = line.rsplit_once(" *").ok_or(ChecksumError::NoChecksum)?;
    let lower_hex = |b: u8| b.is_ascii_digit() || (b'a'..=b'f').contains(&b);
    if digits.len() != 8 || !digits.bytes().all(lower_hex) {
        return Err(ChecksumError::NoChecksum);
    }
    let stated = u32::from_str_radix(digits, 16).map_err(|_| ChecksumError::NoChecksum)?;
    let computed = CRC.checksum(text.as_bytes());
    if stated == computed {
        Ok(text)
    } else {
        Err(ChecksumError::WrongChecksum { stated, computed })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::String;
    use std::vec::Vec;

    fn line(text: &str) -> String {
        let mut bytes = Vec::new();
        write_line(format_args!("{text}"), |sent| bytes.extend_from_slice(sent));
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn a_written_line_is_read_again() {
        // The check value in the CRC's definition.
        assert_eq!(line("123456789"), "123456789 *cbf43926\n");
        for text in ["", "ok", "a *b *c", "tab\tand umlaut \u{e4}"] {
            let line = line(text);
            let printable: String = text
                .chars()
                .map(|c| if (' '..='~').contains(&c) { c } else { '?' })
                .collect();
            assert_eq!(without_checksum(line.trim_end()), Ok(printable.as_str()));
        }
    }

    /// The kernel sends each chunk with the serial line locked once, so a chunk of one byte would be slow.
    #[test]
    fn a_line_is_sent_in_chunks() {
        let mut lengths = Vec::new();
        let text = "x".repeat(2 * CHUNK + 1);
        write_line(format_args!("{text}"), |sent| lengths.push(sent.len()));
        assert_eq!(lengths, [CHUNK, CHUNK, 1, CHECKSUM + 1]);
    }

    #[test]
    fn a_long_line_is_cut_and_its_checksum_is_right() {
        let line = line(&"x".repeat(2 * MAX_LINE));
        assert_eq!(line.len(), MAX_LINE + 1);
        assert!(without_checksum(line.trim_end()).is_ok());
    }

    #[test]
    fn every_changed_bit_is_found() {
        let good = line("shown 1000 page 1");
        let good = good.trim_end();
        for at in 0..good.len() {
            for flip in 1..8 {
                let mut bytes = good.as_bytes().to_vec();
                bytes[at] ^= 1 << (flip - 1);
                let Ok(bad) = String::from_utf8(bytes) else {
                    continue;
                };
                assert!(without_checksum(&bad).is_err(), "{bad:?} passed");
            }
        }
        assert_eq!(without_checksum("ok"), Err(ChecksumError::NoChecksum));
        assert_eq!(
            without_checksum("ok *+1234567"),
            Err(ChecksumError::NoChecksum)
        );
    }
}
