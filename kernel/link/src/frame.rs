//! Lines with their checksum.

use core::fmt::{self, Write};

use crc::{CRC_32_ISO_HDLC, Crc, Digest};

use crate::MAX_LINE;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// ` *` and eight digits.
const CHECKSUM: usize = 10;

/// Writes `text` as a line: checksum and LF at its end. What is not printable ASCII goes out as
/// `?`, and text beyond [`MAX_LINE`] is left out, so that every line written is a legal one.
pub fn write_line(text: fmt::Arguments<'_>, mut send: impl FnMut(&[u8])) {
    struct Summed<'a, F> {
        send: &'a mut F,
        digest: Digest<'a, u32>,
        room: usize,
    }
    impl<F: FnMut(&[u8])> Write for Summed<'_, F> {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            for c in text.chars().take(self.room) {
                let byte = match c {
                    ' '..='~' => c as u8,
                    _ => b'?',
                };
                self.digest.update(&[byte]);
                (self.send)(&[byte]);
                self.room -= 1;
            }
            Ok(())
        }
    }
    let mut summed = Summed {
        send: &mut send,
        digest: CRC.digest(),
        room: MAX_LINE - CHECKSUM,
    };
    // The writer above never fails, and what a Display implementation makes of that is its own.
    let _ = summed.write_fmt(text);
    let sum = summed.digest.finalize();
    let mut tail = *b" *00000000\n";
    for (i, digit) in tail[2..10].iter_mut().enumerate() {
        let nibble = (sum >> (28 - 4 * i) & 15) as u8;
        *digit = if nibble < 10 {
            b'0' + nibble
        } else {
            b'a' + nibble - 10
        };
    }
    send(&tail);
}

/// Why a line's checksum was not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The line has no ` *xxxxxxxx` at its end.
    NoChecksum,
    /// The checksum is another one.
    WrongChecksum {
        /// What the line says.
        said: u32,
        /// What its text gives.
        computed: u32,
    },
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoChecksum => f.write_str("the line does not end in a checksum"),
            Self::WrongChecksum { said, computed } => write!(
                f,
                "the line says checksum {said:08x}, its text has {computed:08x}"
            ),
        }
    }
}

impl core::error::Error for FrameError {}

/// The text of a line that ends in its checksum.
///
/// # Errors
/// A checksum that is missing or wrong.
pub fn unframe(line: &str) -> Result<&str, FrameError> {
    let (text, digits) = line.rsplit_once(" *").ok_or(FrameError::NoChecksum)?;
    let lower_hex = |b: u8| b.is_ascii_digit() || (b'a'..=b'f').contains(&b);
    if digits.len() != 8 || !digits.bytes().all(lower_hex) {
        return Err(FrameError::NoChecksum);
    }
    let said = u32::from_str_radix(digits, 16).map_err(|_| FrameError::NoChecksum)?;
    let computed = CRC.checksum(text.as_bytes());
    if said == computed {
        Ok(text)
    } else {
        Err(FrameError::WrongChecksum { said, computed })
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
    fn a_line_comes_back() {
        // The check value of the CRC's own definition.
        assert_eq!(line("123456789"), "123456789 *cbf43926\n");
        for text in ["", "ok", "a *b *c", "tab\tand umlaut \u{e4}"] {
            let line = line(text);
            let printable: String = text
                .chars()
                .map(|c| if (' '..='~').contains(&c) { c } else { '?' })
                .collect();
            assert_eq!(unframe(line.trim_end()), Ok(printable.as_str()));
        }
    }

    #[test]
    fn a_long_line_is_cut_and_still_right() {
        let line = line(&"x".repeat(2 * MAX_LINE));
        assert_eq!(line.len(), MAX_LINE + 1);
        assert!(unframe(line.trim_end()).is_ok());
    }

    #[test]
    fn any_changed_byte_is_noticed() {
        let good = line("shown 1000 page 1");
        let good = good.trim_end();
        for at in 0..good.len() {
            for flip in 1..8 {
                let mut bytes = good.as_bytes().to_vec();
                bytes[at] ^= 1 << (flip - 1);
                let Ok(bad) = String::from_utf8(bytes) else {
                    continue;
                };
                assert!(unframe(&bad).is_err(), "{bad:?} passed");
            }
        }
        assert_eq!(unframe("ok"), Err(FrameError::NoChecksum));
        assert_eq!(unframe("ok *+1234567"), Err(FrameError::NoChecksum));
    }
}
