//! Bytes into lines.

use crate::{CANCEL, MAX_LINE};

/// Collects bytes until a line is whole, in a fixed buffer.
#[derive(Clone, Debug)]
pub struct Lines {
    bytes: [u8; MAX_LINE],
    len: usize,
    noise: Option<Noise>,
}

/// Why a line was thrown away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// It is longer than [`MAX_LINE`].
    TooLong,
    /// It has a byte that is not printable ASCII.
    NotText(u8),
}

impl core::fmt::Display for Noise {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooLong => write!(f, "a line of more than {MAX_LINE} bytes"),
            Self::NotText(byte) => write!(f, "a line with the byte {byte:02x}"),
        }
    }
}

impl Lines {
    /// Nothing collected.
    pub const fn new() -> Self {
        Self {
            bytes: [0; MAX_LINE],
            len: 0,
            noise: None,
        }
    }

    /// Takes a byte; with the LF that ends a line, the line, or why it is none.
    ///
    /// A CR counts only before the LF: anywhere else it is noise.
    pub fn push(&mut self, byte: u8) -> Option<Result<&str, Noise>> {
        if byte == CANCEL {
            (self.len, self.noise) = (0, None);
            return None;
        }
        if byte != b'\n' {
            match self.bytes.get_mut(self.len) {
                Some(place) => {
                    *place = byte;
                    self.len += 1;
                }
                // The CR of a line that just fits.
                None if byte == b'\r' => {}
                None => self.noise = Some(Noise::TooLong),
            }
            return None;
        }
        let len = core::mem::take(&mut self.len);
        if let Some(noise) = self.noise.take() {
            return Some(Err(noise));
        }
        let line = &self.bytes[..len];
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if let Some(&byte) = line.iter().find(|b| !(b' '..=b'~').contains(b)) {
            return Some(Err(Noise::NotText(byte)));
        }
        Some(core::str::from_utf8(line).map_err(|_| Noise::NotText(line[0])))
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

    fn lines(bytes: &[u8]) -> Vec<Result<String, Noise>> {
        let mut lines = Lines::new();
        bytes
            .iter()
            .filter_map(|&b| lines.push(b).map(|line| line.map(ToString::to_string)))
            .collect()
    }

    #[test]
    fn lines_end_in_lf_or_cr_lf() {
        let ok = |text: &str| Ok(text.to_string());
        assert_eq!(lines(b"a\nb c\r\n\nd"), [ok("a"), ok("b c"), ok("")]);
    }

    #[test]
    fn noise_costs_a_line_and_no_more() {
        let mut bytes = std::vec![b'x'; 1_000_000];
        bytes.extend_from_slice(b"\nshow 1\n\xFF\nc\rr\nhold\n");
        assert_eq!(
            lines(&bytes),
            [
                Err(Noise::TooLong),
                Ok("show 1".to_string()),
                Err(Noise::NotText(0xFF)),
                Err(Noise::NotText(b'\r')),
                Ok("hold".to_string()),
            ]
        );
    }

    #[test]
    fn a_cancelled_line_leaves_nothing() {
        let mut bytes = std::vec![b'x'; 2 * MAX_LINE];
        bytes.extend_from_slice(b"\x18panic\n\xFFab\x18\nc\n");
        let expected = ["panic", "", "c"].map(|text| Ok(text.to_string()));
        assert_eq!(lines(&bytes), expected);
    }

    #[test]
    fn the_longest_line_fits() {
        for end in ["\n", "\r\n"] {
            let longest = "x".repeat(MAX_LINE);
            let line = std::format!("{longest}{end}");
            assert_eq!(lines(line.as_bytes()), [Ok(longest)]);
        }
        let line = std::format!("{}\n", "x".repeat(MAX_LINE + 1));
        assert_eq!(lines(line.as_bytes()), [Err(Noise::TooLong)]);
    }
}
