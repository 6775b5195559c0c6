//! Letters of five columns by seven rows, for text on textures and over frames.

/// Columns of a letter; one free column separates letters.
pub const WIDTH: usize = 5;
/// Rows of a letter.
pub const HEIGHT: usize = 7;

/// Every character that the project writes. Small letters are written as capitals.
#[rustfmt::skip]
const GLYPHS: [(u8, [&[u8; WIDTH]; HEIGHT]); 45] = [
    (b'%', [b"##..#", b"##..#", b"...#.", b"..#..", b".#...", b"#..##", b"#..##"]),
    (b'+', [b".....", b"..#..", b"..#..", b"#####", b"..#..", b"..#..", b"....."]),
    (b',', [b".....", b".....", b".....", b".....", b".##..", b"..#..", b".#..."]),
    (b'-', [b".....", b".....", b".....", b"#####", b".....", b".....", b"....."]),
    (b'.', [b".....", b".....", b".....", b".....", b".....", b".##..", b".##.."]),
    (b'/', [b".....", b"....#", b"...#.", b"..#..", b".#...", b"#....", b"....."]),
    (b'0', [b".###.", b"#...#", b"#..##", b"#.#.#", b"##..#", b"#...#", b".###."]),
    (b'1', [b"..#..", b".##..", b"..#..", b"..#..", b"..#..", b"..#..", b".###."]),
    (b'2', [b".###.", b"#...#", b"....#", b"...#.", b"..#..", b".#...", b"#####"]),
    (b'3', [b".###.", b"#...#", b"....#", b"..##.", b"....#", b"#...#", b".###."]),
    (b'4', [b"...#.", b"..##.", b".#.#.", b"#..#.", b"#####", b"...#.", b"...#."]),
    (b'5', [b"#####", b"#....", b"####.", b"....#", b"....#", b"#...#", b".###."]),
    (b'6', [b".###.", b"#....", b"#....", b"####.", b"#...#", b"#...#", b".###."]),
    (b'7', [b"#####", b"....#", b"...#.", b"...#.", b"..#..", b"..#..", b"..#.."]),
    (b'8', [b".###.", b"#...#", b"#...#", b".###.", b"#...#", b"#...#", b".###."]),
    (b'9', [b".###.", b"#...#", b"#...#", b".####", b"....#", b"....#", b".###."]),
    (b':', [b".....", b".##..", b".##..", b".....", b".##..", b".##..", b"....."]),
    (b'A', [b".###.", b"#...#", b"#...#", b"#####", b"#...#", b"#...#", b"#...#"]),
    (b'B', [b"####.", b"#...#", b"#...#", b"####.", b"#...#", b"#...#", b"####."]),
    (b'C', [b".###.", b"#...#", b"#....", b"#....", b"#....", b"#...#", b".###."]),
    (b'D', [b"####.", b"#...#", b"#...#", b"#...#", b"#...#", b"#...#", b"####."]),
    (b'E', [b"#####", b"#....", b"#....", b"####.", b"#....", b"#....", b"#####"]),
    (b'F', [b"#####", b"#....", b"#....", b"####.", b"#....", b"#....", b"#...."]),
    (b'G', [b".###.", b"#...#", b"#....", b"#.###", b"#...#", b"#...#", b".###."]),
    (b'H', [b"#...#", b"#...#", b"#...#", b"#####", b"#...#", b"#...#", b"#...#"]),
    (b'I', [b".###.", b"..#..", b"..#..", b"..#..", b"..#..", b"..#..", b".###."]),
    (b'J', [b"..###", b"...#.", b"...#.", b"...#.", b"...#.", b"#..#.", b".##.."]),
    (b'K', [b"#...#", b"#..#.", b"#.#..", b"##...", b"#.#..", b"#..#.", b"#...#"]),
    (b'L', [b"#....", b"#....", b"#....", b"#....", b"#....", b"#....", b"#####"]),
    (b'M', [b"#...#", b"##.##", b"#.#.#", b"#.#.#", b"#...#", b"#...#", b"#...#"]),
    (b'N', [b"#...#", b"##..#", b"##..#", b"#.#.#", b"#..##", b"#..##", b"#...#"]),
    (b'O', [b".###.", b"#...#", b"#...#", b"#...#", b"#...#", b"#...#", b".###."]),
    (b'P', [b"####.", b"#...#", b"#...#", b"####.", b"#....", b"#....", b"#...."]),
    (b'Q', [b".###.", b"#...#", b"#...#", b"#...#", b"#.#.#", b"#..#.", b".##.#"]),
    (b'R', [b"####.", b"#...#", b"#...#", b"####.", b"#.#..", b"#..#.", b"#...#"]),
    (b'S', [b".####", b"#....", b"#....", b".###.", b"....#", b"....#", b"####."]),
    (b'T', [b"#####", b"..#..", b"..#..", b"..#..", b"..#..", b"..#..", b"..#.."]),
    (b'U', [b"#...#", b"#...#", b"#...#", b"#...#", b"#...#", b"#...#", b".###."]),
    (b'V', [b"#...#", b"#...#", b"#...#", b"#...#", b"#...#", b".#.#.", b"..#.."]),
    (b'W', [b"#...#", b"#...#", b"#...#", b"#.#.#", b"#.#.#", b"#.#.#", b".#.#."]),
    (b'X', [b"#...#", b"#...#", b".#.#.", b"..#..", b".#.#.", b"#...#", b"#...#"]),
    (b'Y', [b"#...#", b"#...#", b".#.#.", b"..#..", b"..#..", b"..#..", b"..#.."]),
    (b'Z', [b"#####", b"....#", b"...#.", b"..#..", b".#...", b"#....", b"#####"]),
    (b'_', [b".....", b".....", b".....", b".....", b".....", b".....", b"#####"]),
    (b'~', [b".....", b".....", b".#...", b"#.#.#", b"...#.", b".....", b"....."]),
];

/// A letter's rows. Each bit of a row is a column; the lowest bit is the leftmost.
pub type Glyph = [u8; HEIGHT];

/// The glyphs of ASCII, small letters as capitals; empty where no glyph exists.
static FONT: [Glyph; 128] = {
    let mut font = [[0; HEIGHT]; 128];
    let mut i = 0;
    while i < GLYPHS.len() {
        let (character, rows) = GLYPHS[i];
        let mut glyph = [0; HEIGHT];
        let mut y = 0;
        while y < HEIGHT {
            let mut x = 0;
            while x < WIDTH {
                glyph[y] |= ((rows[y][x] == b'#') as u8) << x;
                x += 1;
            }
            y += 1;
        }
        font[character as usize] = glyph;
        font[character.to_ascii_lowercase() as usize] = glyph;
        i += 1;
    }
    font
};

/// Returns the glyph of a character, or an empty one if the font lacks the character.
pub fn glyph(character: char) -> Glyph {
    FONT.get(character as usize).copied().unwrap_or_default()
}

/// Returns whether a character's glyph covers a pixel; (0, 0) is the glyph's top left.
pub(crate) fn covers(character: char, x: i64, y: i64) -> bool {
    let column = 0..WIDTH as i64;
    let row = usize::try_from(y).ok().filter(|&y| y < HEIGHT);
    row.is_some_and(|y| column.contains(&x) && glyph(character)[y] >> x & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_glyphs_are_alike() {
        for (i, (a, rows)) in GLYPHS.iter().enumerate() {
            let same = GLYPHS[..i].iter().find(|(_, other)| other == rows);
            assert_eq!(same, None, "{}", *a as char);
            let a = *a as char;
            assert_eq!(glyph(a), glyph(a.to_ascii_lowercase()));
            assert_ne!(glyph(a), [0; HEIGHT]);
        }
        assert_eq!([' ', '\u{e4}', '^'].map(glyph), [[0; HEIGHT]; 3]);
    }
}
