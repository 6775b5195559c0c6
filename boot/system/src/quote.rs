//! Quotation of foreign bytes in messages.
//!
//! A file, a dump, QEMU or the serial line may contain any bytes, and a terminal obeys some of them: escape
//! sequences change colours, the title and the text on the screen. Messages therefore show every unprintable
//! byte as an escape (`\x1b`, `\u{202e}`).

use std::borrow::Cow;
use std::path::Path;

/// Longest quotation, in characters.
const MAX_CHARACTERS: usize = 40;

/// Returns foreign bytes in single quotes: escaped, and cut after 40 characters.
///
/// A cut quotation ends in `...` and the number of bytes in the original.
pub fn quoted(bytes: impl AsRef<[u8]>) -> String {
    let bytes = bytes.as_ref();
    let (mut quotation, mut length) = (String::from("'"), 0);
    for chunk in bytes.utf8_chunks() {
        let valid = chunk.valid().chars().map(|c| match c {
            '\\' => "\\\\".into(),
            c => escaped(c),
        });
        let broken = chunk.invalid().iter().map(|byte| format!("\\x{byte:02x}"));
        for piece in valid.chain(broken) {
            length += piece.chars().count();
            if length > MAX_CHARACTERS {
                return format!("{quotation}...' ({} bytes)", bytes.len());
            }
            quotation += &piece;
        }
    }
    quotation + "'"
}

/// Returns a path, escaped but not cut, so that the reader can find the file.
pub fn path(path: &Path) -> String {
    let bytes = path.as_os_str().as_encoded_bytes();
    bytes
        .utf8_chunks()
        .flat_map(|chunk| {
            let broken = chunk.invalid().iter().map(|byte| format!("\\x{byte:02x}"));
            chunk.valid().chars().map(escaped).chain(broken)
        })
        .collect()
}

/// Returns text that is safe for a terminal: line ends and tabs stay, and every other unprintable character
/// is escaped.
pub fn printable(text: &str) -> Cow<'_, str> {
    let plain = |c: char| matches!(c, ' '..='~' | '\n' | '\t');
    if text.chars().all(plain) {
        return text.into();
    }
    let keep = |c: char| match c {
        '\n' | '\t' => c.into(),
        c => escaped(c),
    };
    text.chars().map(keep).collect()
}

/// Returns a printable character unchanged, and the escape of any other.
fn escaped(c: char) -> String {
    match c {
        ' '..='~' => c.into(),
        _ if c.is_ascii() => format!("\\x{:02x}", c as u32),
        // A combining mark prints behind a letter, so let `str` see it behind one.
        _ => format!("a{c}").escape_debug().skip(1).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    use super::*;

    #[test]
    fn quotations_contain_no_byte_that_a_terminal_obeys() {
        for (bytes, quotation) in [
            (&b"plain"[..], "'plain'"),
            (b"", "''"),
            (b"\x1b[31mEVIL\x1b[0m", r"'\x1b[31mEVIL\x1b[0m'"),
            (b"a\r\n\t\0\x7f", r"'a\x0d\x0a\x09\x00\x7f'"),
            (br"\x1b", r"'\\x1b'"),
            (b"\xe4\xff", r"'\xe4\xff'"),
            ("ä, \u{9b}31m".as_bytes(), r"'ä, \u{9b}31m'"),
            (
                "\u{202e}\u{2028}\u{200b}e\u{301}".as_bytes(),
                "'\\u{202e}\\u{2028}\\u{200b}e\u{301}'",
            ),
        ] {
            assert_eq!(quoted(bytes), quotation);
        }
        let all: Vec<u8> = (0..=255).collect();
        for one in all.iter().map(|byte| quoted([*byte])) {
            assert!(
                one.bytes().all(|byte| (b' '..=b'~').contains(&byte)),
                "{one}"
            );
        }
        let name = Path::new(OsStr::from_bytes(b"a\x1b[2J\nb\xff\\.obj"));
        assert_eq!(path(name), r"a\x1b[2J\x0ab\xff\.obj");
        assert_eq!(printable("ä\tb\nc"), "ä\tb\nc");
        assert_eq!(printable("a\x1b]0;b\x07\r\n"), "a\\x1b]0;b\\x07\\x0d\n");
    }

    #[test]
    fn a_long_quotation_is_cut_between_two_characters_or_escapes() {
        let long = [b'x'; 20_000];
        assert_eq!(
            quoted(&long[..MAX_CHARACTERS]),
            format!("'{}'", "x".repeat(MAX_CHARACTERS))
        );
        let cut = format!("'{}...' (20000 bytes)", "x".repeat(MAX_CHARACTERS));
        assert_eq!(quoted(long), cut);
        let escapes = quoted([0x1b; 100]);
        assert_eq!(escapes, format!("'{}...' (100 bytes)", r"\x1b".repeat(10)));
        // The longest path that Linux allows is not cut.
        let name = "y".repeat(4096);
        assert_eq!(path(Path::new(&name)), name);
    }
}
