//! Recognises the formats of files that are neither an OBJ nor a PNG.

use file_format::FileFormat;

/// Returns the name of the format that a file's first bytes show. Returns `None` for an unknown format and
/// for plain text, except for UTF-16 and UTF-32. `size` is the size of the whole file, if known.
pub fn of(begin: &[u8], size: Option<usize>) -> Option<String> {
    // No format needs more bytes than these to be recognised.
    let begin = &begin[..begin.len().min(4096)];
    match begin {
        [0xFF, 0xFE, 0, 0, ..] | [0, 0, 0xFE, 0xFF, ..] => return Some("UTF-32 text".into()),
        [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => return Some("UTF-16 text".into()),
        // Without a byte order mark: every other byte of the first characters is zero.
        [0, a, 0, b, ..] | [a, 0, b, 0, ..] if a.is_ascii_graphic() && is_text(*b) => {
            return Some("UTF-16 text".into());
        }
        _ => {}
    }
    // The size must fit the number of triangles, because a text can begin with the same word.
    if let Some((_, [a, b, c, d, ..])) = begin.split_at_checked(80)
        && let triangles = u32::from_le_bytes([*a, *b, *c, *d]) as usize
        && size == Some(84 + 50 * triangles)
        && triangles > 0
    {
        return Some("binary STL".into());
    }
    let text = begin.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(begin);
    let text = text.trim_ascii_start();
    match text {
        [b'<', ..] => return Some(markup(text).into()),
        [b'{' | b'[', ..] => return Some("JSON".into()),
        [b'P', b'1'..=b'6', end, ..] if end.is_ascii_whitespace() => return Some("PNM".into()),
        _ => {}
    }
    for (word, name) in [
        (&b"ply"[..], "PLY"),
        (b"OFF", "OFF"),
        (b"newmtl", "an MTL material library"),
        (b"; FBX", "FBX"),
        (b"#usda", "USD"),
        (b"PXR-USDC", "USD"),
        (b"#VRML", "VRML"),
        (b"#X3D", "X3D"),
        (b"ISO-10303-21", "STEP"),
    ] {
        if let Some(after) = text.strip_prefix(word)
            && !after.first().is_some_and(u8::is_ascii_alphanumeric)
        {
            return Some(name.into());
        }
    }
    match FileFormat::from_bytes(begin) {
        FileFormat::ArbitraryBinaryData | FileFormat::PlainText | FileFormat::Empty => None,
        format => Some(format.short_name().unwrap_or(format.name()).into()),
    }
}

/// Returns the format of markup, by a word that every program writes in the first lines.
fn markup(text: &[u8]) -> &'static str {
    let text = text.to_ascii_lowercase();
    let has = |word: &[u8]| text.windows(word.len()).any(|window| window == word);
    match () {
        () if has(b"<svg") => "SVG",
        () if has(b"<collada") => "COLLADA",
        () if has(b"<x3d") => "X3D",
        () if has(b"<html") || has(b"<!doctype html") || has(b"<body") => "HTML",
        () => "XML or HTML",
    }
}

fn is_text(byte: u8) -> bool {
    byte.is_ascii_graphic() || byte.is_ascii_whitespace()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_formats_are_named_and_plain_text_is_not() {
        let mut stl = b"solid but binary".to_vec();
        stl.resize(80, 0);
        stl.extend(2u32.to_le_bytes());
        stl.resize(84 + 100, 7);
        let size = stl.len();
        assert_eq!(of(&stl, Some(size)).as_deref(), Some("binary STL"));
        assert_eq!(of(&stl, Some(size + 1)).as_deref(), Some("STL"));
        for (bytes, expected) in [
            (&b"\xFF\xD8\xFF\xE0\0\x10JFIF"[..], "JPEG"),
            (b"GIF89a", "GIF"),
            (b"RIFF\x10\0\0\0WEBPVP8 ", "WebP"),
            (
                b"BM\x46\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x01\0\0\0\x01\0\0\0\x01\0",
                "BMP",
            ),
            (b"II*\0\x08\0\0\0", "TIFF"),
            (b"MM\0*\0\0\0\x08", "TIFF"),
            (b"\0\0\x01\0\x01\0\x10\x10", "ICO"),
            (b"\0\0\0\x20ftypavif", "AVIF"),
            (b"\0\0\0\x20ftypheic", "HEIC"),
            (b"8BPS\0\x01", "PSD"),
            (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "PNG"),
            (b"P6\n1 1\n255\nabc", "PNM"),
            (b"  <svg xmlns=''>", "SVG"),
            (b"<?xml version='1.0'?>\n<svg>", "SVG"),
            (b"\xEF\xBB\xBF\n<!DOCTYPE HTML>", "HTML"),
            (b"<html>", "HTML"),
            (b"<p>", "XML or HTML"),
            (b"<?xml version='1.0'?><COLLADA>", "COLLADA"),
            (b"solid cube\n facet normal 0 0 1", "STL"),
            (b"ply\nformat ascii 1.0\n", "PLY"),
            (b"ply\r\nformat binary_little_endian 1.0\r\n", "PLY"),
            (b"OFF\n8 6 0\n", "OFF"),
            (b"{\"asset\": {}}", "JSON"),
            (b"[1]", "JSON"),
            (b"glTF\x02\0\0\0", "GLB"),
            (b"Kaydara FBX Binary  \0\x1a\0", "FBX"),
            (b"; FBX 7.4.0 project file", "FBX"),
            (b"PK\x03\x04\x14\0", "ZIP"),
            (b"\x1f\x8b\x08\0", "GZ"),
            (b"%PDF-1.7", "PDF"),
            (b"\x7fELF\x02\x01\x01", "ELF"),
            (b"newmtl red\nKd 1 0 0\n", "an MTL material library"),
            (b"\xFF\xFEv\0 \0", "UTF-16 text"),
            (b"\xFE\xFF\0v\0 ", "UTF-16 text"),
            (b"v\0 \0", "UTF-16 text"),
            (b"\0v\0 ", "UTF-16 text"),
            (b"\xFF\xFE\0\0v\0\0\0", "UTF-32 text"),
        ] {
            assert_eq!(
                of(bytes, None).as_deref(),
                Some(expected),
                "{}",
                bytes.escape_ascii()
            );
        }
        for bytes in [
            &b""[..],
            b"hello",
            b"v 0 0 0\n",
            b"# a comment\nmtllib a.mtl\n",
            b"offset",
            b"\0\0\0\0",
            b"plywood",
            b"solidus",
        ] {
            assert_eq!(
                of(bytes, Some(bytes.len())),
                None,
                "{}",
                bytes.escape_ascii()
            );
        }
    }
}
