//! Assembly of received bytes into lines.

use crate::{CANCEL, MAX_LINE};

/// Backspace and Delete: both remove the last byte of a line.
const ERASE: [u8; 2] = [0x08, 0x7F];

/// Collects bytes until a line is complete, in a fixed buffer.
///
/// LF, CR, and CR LF each end a line: a host sends LF, the Enter key of a terminal sends CR, and some
/// programs send both. Backspace and Delete remove the last byte, and [`CANCEL`] removes the whole line.
#[derive(Clone, Debug)]
pub struct Lines {
    /// The bytes of the line that fit.
    bytes: [u8; MAX_LINE],
    /// The line's length. Bytes beyond the buffer are counted too, so that they can be removed again.
    len: usize,
    /// The last byte was a CR, so an LF right after it does not end another line.
    returned: bool,
    /// Bytes of this line were lost or damaged.
    damaged: bool,
}

/// The reason why a line was discarded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineError {
    /// The line is longer than [`MAX_LINE`].
    TooLong,
    /// The line has a byte that is not printable ASCII.
    NotText(u8),
    /// Bytes of the line were lost or damaged on the wire ([`Lines::damage`]).
    Damaged,
}

impl core::fmt::Display for LineError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooLong => write!(f, "the line is longer than {MAX_LINE} bytes"),
            Self::NotText(byte) => write!(
                f,
                "the line contains the byte {byte:02x}, which is not printable ASCII"
            ),
            Self::Damaged => f.write_str(
                "bytes of the line were lost or damaged on the wire; send the line again",
            ),
        }
    }
}

impl core::error::Error for LineError {}

impl Lines {
    /// Returns an empty buffer.
    pub const fn new() -> Self {
        Self {
            bytes: [0; MAX_LINE],
            len: 0,
            returned: false,
            damaged: false,
        }
    }

    /// Records that bytes may be missing here, or that the next byte arrived damaged. The line that the next
    /// byte belongs to is refused, unless it is cancelled.
    pub fn damage(&mut self) {
        self.damaged = true;
        // Bytes between the CR and an LF may be lost, so an LF now ends a line.
        self.returned = false;
    }

    /// Adds a byte. If the byte ends a line, returns the line, or why it was discarded.
    pub fn push(&mut self, byte: u8) -> Option<Result<&str, LineError>> {
        let returned = core::mem::replace(&mut self.returned, byte == b'\r');
        match byte {
            b'\n' if returned => None,
            b'\n' | b'\r' => Some(self.end()),
            CANCEL => {
                (self.len, self.damaged) = (0, false);
                None
            }
            byte if ERASE.contains(&byte) => {
                self.len = self.len.saturating_sub(1);
                None
            }
            byte => {
                if let Some(place) = self.bytes.get_mut(self.len) {
                    *place = byte;
                }
                self.len = self.len.saturating_add(1);
                None
            }
        }
    }

    /// Returns the line so far, and begins the next.
    fn end(&mut self) -> Result<&str, LineError> {
        let len = core::mem::take(&mut self.len);
        if core::mem::take(&mut self.damaged) {
            return Err(LineError::Damaged);
        }
        let line = self.bytes.get(..len).ok_or(LineError::TooLong)?;
        match line.iter().find(|byte| !(b' '..=b'~').contains(byte)) {
            Some(&byte) => Err(LineError::NotText(byte)),
            None => core::str::from_utf8(line).map_err(|_| LineError::NotText(line[0])),
        }
    }
}

impl Default for Lines {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::{String, ToString};
    use std::vec::Vec;

    fn lines(bytes: &[u8]) -> Vec<Result<String, LineError>> {
        let mut lines = Lines::new();
        bytes
            .iter()
            .filter_map(|&b| lines.push(b).map(|line| line.map(ToString::to_string)))
            .collect()
    }

    fn ok(text: &str) -> Result<String, LineError> {
        Ok(text.to_string())
    }

    #[test]
    fn lines_end_in_lf_or_cr_or_both() {
        assert_eq!(
            lines(b"a\nb c\r\n\nd\re\r\n\r\n\r\rf"),
            ["a", "b c", "", "d", "e", "", "", ""].map(ok)
        );
        // With any byte between CR and LF, the LF ends another line.
        assert_eq!(lines(b"a\r \x08\nb\r\x18\n"), ["a", "", "b", ""].map(ok));
    }

    #[test]
    fn a_line_is_edited_by_backspace_and_delete() {
        assert_eq!(
            lines(b"shp\x08ow\x7f\x7f\x7fhow 1\n\x08\x7fhold\r"),
            ["show 1", "hold"].map(ok)
        );
        // Bytes that are not text can be removed like any other.
        assert_eq!(lines(b"a\xff\x08b\n"), [ok("ab")]);
        // So can bytes beyond the buffer.
        let mut bytes = std::vec![b'x'; MAX_LINE + 2];
        bytes.extend([0x7F; 2]);
        bytes.push(b'\n');
        assert_eq!(lines(&bytes), [ok(&"x".repeat(MAX_LINE))]);
    }

    #[test]
    fn each_error_says_what_is_wrong_with_the_line() {
        for (error, reason) in [
            (LineError::TooLong, "longer than 700 bytes"),
            (LineError::NotText(0xFF), "contains the byte ff"),
            (LineError::Damaged, "send the line again"),
        ] {
            assert!(error.to_string().contains(reason), "{error}");
        }
    }

    #[test]
    fn an_illegal_line_does_not_affect_the_next_line() {
        let mut bytes = std::vec![b'x'; 1_000_000];
        bytes.extend_from_slice(b"\nshow 1\n\xFF\nc\x1b[A\nhold\n");
        assert_eq!(
            lines(&bytes),
            [
                Err(LineError::TooLong),
                ok("show 1"),
                Err(LineError::NotText(0xFF)),
                Err(LineError::NotText(0x1B)),
                ok("hold"),
            ]
        );
    }

    #[test]
    fn a_cancelled_line_leaves_no_bytes_behind() {
        let mut bytes = std::vec![b'x'; 2 * MAX_LINE];
        bytes.extend_from_slice(b"\x18panic\n\xFFab\x18\nc\n");
        assert_eq!(lines(&bytes), ["panic", "", "c"].map(ok));
    }

    #[test]
    fn the_longest_line_fits() {
        for end in ["\n", "\r\n", "\r"] {
            let longest = "x".repeat(MAX_LINE);
            let line = std::format!("{longest}{end}");
            assert_eq!(lines(line.as_bytes()), [Ok(longest)]);
            let line = std::format!("{}{end}", "x".repeat(MAX_LINE + 1));
            assert_eq!(lines(line.as_bytes()), [Err(LineError::TooLong)]);
        }
    }

    #[test]
    fn only_a_damaged_line_is_refused() {
        let mut lines = Lines::new();
        let mut received = Vec::new();
        for &byte in b"hold\nsho!w 1\rrun\n!show!\n!x\x18run\r!\n" {
            match byte {
                b'!' => lines.damage(),
                byte => received.extend(lines.push(byte).map(|line| line.map(ToString::to_string))),
            }
        }
        let damaged = || Err(LineError::Damaged);
        assert_eq!(
            received,
            [
                ok("hold"),
                damaged(),
                ok("run"),
                damaged(),
                ok("run"),
                damaged()
            ]
        );
    }

    /// Any bytes give the same lines as a text editor with unlimited space.
    #[test]
    fn any_bytes_give_the_lines_of_a_simple_model() {
        let mut random = seeded::generator();
        let special = [b'\n', b'\r', b'\r', 0x08, 0x7F, CANCEL, 0xFF, 0x1B];
        for _ in 0..500 {
            let rare = random.u32(2..2_000);
            let bytes: Vec<u8> = (0..random.usize(0..5_000))
                .map(|_| match random.u32(..rare) {
                    0 => special[random.usize(..special.len())],
                    _ => random.u8(b' '..=b'~'),
                })
                .collect();
            let (mut expected, mut line) = (Vec::new(), Vec::new());
            for (at, &byte) in bytes.iter().enumerate() {
                match byte {
                    b'\n' if at > 0 && bytes[at - 1] == b'\r' => {}
                    b'\n' | b'\r' => {
                        let text = core::mem::take(&mut line);
                        let bad = text.iter().find(|byte| !(32..127).contains(*byte));
                        expected.push(match bad {
                            _ if text.len() > MAX_LINE => Err(LineError::TooLong),
                            Some(&bad) => Err(LineError::NotText(bad)),
                            None => Ok(String::from_utf8(text).unwrap()),
                        });
                    }
                    0x08 | 0x7F => _ = line.pop(),
                    CANCEL => line.clear(),
                    byte => line.push(byte),
                }
            }
            assert_eq!(lines(&bytes), expected);
        }
    }
}
