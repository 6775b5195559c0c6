//! A parser for Wavefront OBJ files: positions, texture coordinates, and faces of any size.
//!
//! The project has its own parser because the parser must name the line of every error, and no library does
//! so: tobj's errors have neither line nor value, obj-rs panics at legal statements (`unimplemented!`), and
//! wavefront_obj refuses negative indices and cuts every face into a fan. A library would only save the
//! splitting of lines into words.
//!
//! # What is read
//!
//! The parser reads only what a face uses, so it can refuse nothing else. It reads the faces first, and then
//! only the positions and texture coordinates that they name: a vertex that no face uses may have any words
//! for numbers. It never reads normals, neither their numbers nor their indices, because faces are flat. It
//! skips names, groups and materials. It leaves out all other statements (points, lines, curves, tags of
//! other programs) and counts them.
//!
//! # Lines
//!
//! CR, LF or CR LF ends a line, in any mix. Spaces, tabs, vertical tabs and form feeds separate words. A
//! word that begins with `#` begins a comment. A `\` at the end of a line, with or without blanks after it,
//! joins the next line to it, unless the next line begins with a keyword: then the `\` is the end of a name
//! (`usemtl mats\`).

use std::borrow::Cow;
use std::fmt;

use scene::MAX_VERTICES;
use system::quote::quoted;

/// The largest coordinate, of either sign. The limit leaves room for the squares that are computed later.
const MAX_COORDINATE: f64 = 1e30;
/// The maximum number of corners of a face: an outline with this many can be extruded, because a mesh has
/// room for it twice. To cut a face that visits the same points again and again needs a time that grows with
/// the cube of its corners: seconds at this limit, 329 s at 16 000.
pub const MAX_CORNERS: usize = MAX_VERTICES / 2;
/// The maximum number of faces of a file, and of corners of all its faces. A mesh has room for far fewer, but
/// the rest may have no area. The limits bound the memory that a file can claim.
const MAX_READ: usize = 1 << 20;
const MAX_READ_CORNERS: usize = 4 * MAX_READ;

/// The statements that are skipped without a message: names, groups, smoothing, materials, normals.
const SKIPPED: [&[u8]; 6] = [b"g", b"mtllib", b"o", b"s", b"usemtl", b"vn"];
/// The keywords that begin a statement, even if the line before ends with a `\`: the keywords that occur in
/// files.
const KEYWORDS: [&[u8]; 13] = [
    b"f", b"fo", b"g", b"l", b"mtllib", b"o", b"p", b"s", b"usemtl", b"v", b"vn", b"vp", b"vt",
];
/// The maximum number of kinds of skipped statements that the message names.
const MAX_KINDS: usize = 6;

/// The polygons of an OBJ file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Obj {
    /// Positions: x right, y up, z towards the viewer; finite. Positions that no face uses are zeros.
    pub positions: Vec<[f64; 3]>,
    /// Texture coordinates: u to the right, v up, the whole texture from 0 to 1; finite. Texture coordinates
    /// that no face uses are zeros.
    pub texture_coordinates: Vec<[f64; 2]>,
    /// The corners of all faces.
    pub corners: Vec<ObjCorner>,
    /// The faces.
    pub faces: Vec<ObjFace>,
    /// The statements that are unknown, or make no polygon.
    pub skipped: SkippedStatements,
}

/// A corner of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjCorner {
    /// The index of the position.
    pub position: u32,
    /// The index of the texture coordinates. Either all corners of a face have texture coordinates, or no
    /// corner has.
    pub uv: Option<u32>,
}

/// A polygon, counter-clockwise when seen from its front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjFace {
    /// The index of the first corner.
    pub first: usize,
    /// The number of corners, at most [`MAX_CORNERS`].
    pub corners: usize,
    /// The line in the file, counted from 1.
    pub line: usize,
}

/// The statements that were skipped.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SkippedStatements {
    /// The number of statements.
    pub count: usize,
    /// The first keywords in the order of the file, each with its first line and its number of statements.
    pub kinds: Vec<(Vec<u8>, usize, usize)>,
}

impl SkippedStatements {
    fn add(&mut self, keyword: &[u8], line: usize) {
        self.count += 1;
        let known = self.kinds.iter_mut().find(|(known, ..)| known == keyword);
        if let Some((.., count)) = known {
            *count += 1;
        } else if self.kinds.len() < MAX_KINDS {
            self.kinds.push((keyword.to_vec(), line, 1));
        }
    }
}

/// Writes the number of skipped statements, and their kinds.
impl fmt::Display for SkippedStatements {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let s = if self.count == 1 { "" } else { "s" };
        write!(f, "{} statement{s} skipped", self.count)?;
        if self.count == 0 {
            return Ok(());
        }
        write!(f, " (")?;
        for (i, (keyword, _, count)) in self.kinds.iter().enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            write!(f, "{comma}{count} {}", quoted(keyword))?;
        }
        let named: usize = self.kinds.iter().map(|(.., count)| count).sum();
        match self.count - named {
            0 => write!(f, ")"),
            others => write!(f, ", {others} others)"),
        }
    }
}

impl Obj {
    /// Returns the corners of a face.
    pub fn corners_of(&self, face: &ObjFace) -> &[ObjCorner] {
        &self.corners[face.first..][..face.corners]
    }
}

/// An error in a line of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadLine {
    /// The line, counted from 1. For a statement over several lines, it is the first.
    pub line: usize,
    /// What is wrong with the line, and what to do.
    pub why: String,
}

impl fmt::Display for BadLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.why)
    }
}

impl std::error::Error for BadLine {}

/// Parses a file's bytes. They need not be UTF-8, because names can have any encoding.
///
/// # Errors
/// The first wrong face; else the first wrong position or texture coordinate that a face uses. A file
/// without faces is no model: then the error is the first wrong position or texture coordinate, or an
/// unknown statement that comes before it or in a file without positions.
pub fn parse(bytes: &[u8]) -> Result<Obj, BadLine> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let mut obj = Obj::default();
    let counts = faces(bytes, &mut obj)?;
    let mut used = used(&obj, counts)?;
    if !obj.faces.is_empty() {
        coordinates(bytes, &mut obj, &used)?;
        return Ok(obj);
    }
    used.positions.fill(true);
    used.texture_coordinates.fill(true);
    let wrong = coordinates(bytes, &mut obj, &used).err();
    let unknown = obj.skipped.kinds.first();
    let unknown = unknown.map(|(keyword, line, _)| BadLine {
        line: *line,
        why: format!(
            "{} is not a statement of a Wavefront OBJ, and the file has no faces; pass an OBJ file",
            quoted(keyword)
        ),
    });
    match (wrong, unknown) {
        (Some(wrong), Some(unknown)) if unknown.line < wrong.line => Err(unknown),
        (Some(wrong), _) => Err(wrong),
        // A text of another kind.
        (None, Some(unknown)) if counts.positions == 0 => Err(unknown),
        // Points or lines.
        _ => Ok(obj),
    }
}

/// A value for the positions, and a value for the texture coordinates.
#[derive(Clone, Copy, Debug, Default)]
struct ByAttribute<T> {
    positions: T,
    texture_coordinates: T,
}

/// Reads the faces, and counts the positions and texture coordinates.
fn faces(bytes: &[u8], obj: &mut Obj) -> Result<ByAttribute<usize>, BadLine> {
    let mut counts = ByAttribute::default();
    for statement in Statements::new(bytes) {
        let line = statement.line;
        let wrong = |why| BadLine { line, why };
        let mut words = words(&statement.text);
        let Some(keyword) = words.next() else {
            continue;
        };
        match keyword {
            b"v" => counts.positions += 1,
            b"vt" => counts.texture_coordinates += 1,
            b"f" | b"fo" => {
                if statement.cut {
                    let why = "the face continues on the next line, but the file ends here; save the \
                               file again";
                    return Err(wrong(why.into()));
                }
                face(line, words, counts, obj).map_err(wrong)?;
            }
            skipped if SKIPPED.contains(&skipped) => {}
            unknown => obj.skipped.add(unknown, line),
        }
    }
    Ok(counts)
}

/// Reads a face from its corners.
fn face<'a>(
    line: usize,
    mut words: impl Iterator<Item = &'a [u8]>,
    counts: ByAttribute<usize>,
    obj: &mut Obj,
) -> Result<(), String> {
    let first = obj.corners.len();
    for word in words.by_ref().take(MAX_CORNERS) {
        obj.corners.push(corner(word, counts)?);
    }
    let corners = obj.corners.len() - first;
    let more = words.count();
    if more > 0 {
        return Err(format!(
            "the face has {} corners, but at most {MAX_CORNERS} are allowed; {SIMPLIFY}",
            corners + more
        ));
    }
    if obj.faces.len() == MAX_READ || obj.corners.len() > MAX_READ_CORNERS {
        return Err(format!(
            "up to this line the file has {} faces and {} corners, but at most {MAX_READ} \
             faces and {MAX_READ_CORNERS} corners are allowed; {SIMPLIFY}",
            obj.faces.len() + 1,
            obj.corners.len(),
        ));
    }
    let face_corners = &mut obj.corners[first..];
    if face_corners.iter().any(|corner| corner.uv.is_none()) {
        // The face gets projected coordinates, and uses no coordinates of the file.
        face_corners.iter_mut().for_each(|corner| corner.uv = None);
    }
    obj.faces.push(ObjFace {
        first,
        corners,
        line,
    });
    Ok(())
}

/// What the user can do about a model that is too large.
pub const SIMPLIFY: &str = "simplify the model in the program that made it";

/// Reads a corner: `1`, `1/2`, `1//3` or `1/2/3`. The normal's index can be any text.
fn corner(word: &[u8], counts: ByAttribute<usize>) -> Result<ObjCorner, String> {
    let mut parts = word.split(|&byte| byte == b'/');
    let mut index = |what, counts| match parts.next() {
        None | Some(b"") => Ok(None),
        Some(part) => match from_zero(part, counts) {
            Ok(index) => Ok(Some(index)),
            Err(why) => Err(format!("{}: the {what} {why}", quoted(word))),
        },
    };
    let position = index("position", counts.positions)?;
    let uv = index("texture coordinate", counts.texture_coordinates)?;
    if parts.nth(1).is_some() {
        return Err(format!(
            "{} has more than three indices; write a corner as 1/2/3",
            quoted(word)
        ));
    }
    let position = position
        .ok_or_else(|| format!("{} has no position; write a corner as 1/2/3", quoted(word)))?;
    Ok(ObjCorner { position, uv })
}

/// Converts an index of the file, counted from 1, to an index counted from 0. A positive index may precede
/// what it names. A negative index counts back from the last element before the line.
fn from_zero(word: &[u8], counts: usize) -> Result<u32, String> {
    let number = std::str::from_utf8(word).ok();
    let number = number.and_then(|word| word.parse::<i128>().ok());
    let number = number
        .ok_or_else(|| format!("{} is not a whole number; correct the index", quoted(word)))?;
    match number {
        0 => Err("0 does not exist; indices count from 1".into()),
        1.. => u32::try_from(number - 1)
            .map_err(|_| format!("{number} does not exist; correct the index")),
        _ => usize::try_from(-number)
            .ok()
            .and_then(|back| counts.checked_sub(back))
            .map(|index| index as u32)
            .ok_or_else(|| {
                format!("{number} does not exist: the file has {counts} before this line; correct the index")
            }),
    }
}

/// Returns which positions and texture coordinates the faces use.
///
/// # Errors
/// The first face that uses an element that does not exist.
fn used(obj: &Obj, counts: ByAttribute<usize>) -> Result<ByAttribute<Vec<bool>>, BadLine> {
    let mut used = ByAttribute {
        positions: vec![false; counts.positions],
        texture_coordinates: vec![false; counts.texture_coordinates],
    };
    let mark = |used: &mut Vec<bool>, index: u32, what: &str| match used.get_mut(index as usize) {
        Some(used) => {
            *used = true;
            Ok(())
        }
        None => Err(format!(
            "{what} {} does not exist: the file has {}; correct the index",
            u64::from(index) + 1,
            used.len()
        )),
    };
    for face in &obj.faces {
        for corner in obj.corners_of(face) {
            mark(&mut used.positions, corner.position, "position")
                .and_then(|()| match corner.uv {
                    Some(uv) => mark(&mut used.texture_coordinates, uv, "texture coordinate"),
                    None => Ok(()),
                })
                .map_err(|why| BadLine {
                    line: face.line,
                    why,
                })?;
        }
    }
    Ok(used)
}

/// Reads the coordinates that are used.
fn coordinates(bytes: &[u8], obj: &mut Obj, used: &ByAttribute<Vec<bool>>) -> Result<(), BadLine> {
    // Zeroed memory that is never written needs no physical memory.
    obj.positions = vec![[0.0; 3]; used.positions.len()];
    obj.texture_coordinates = vec![[0.0; 2]; used.texture_coordinates.len()];
    let mut positions = obj.positions.iter_mut().zip(&used.positions);
    let mut texture_coordinates = obj
        .texture_coordinates
        .iter_mut()
        .zip(&used.texture_coordinates);
    for statement in Statements::new(bytes) {
        let mut words = words(&statement.text);
        let read = match words.next() {
            // A weight or a colour may follow the coordinates.
            Some(b"v") => match positions.next() {
                Some((position, true)) => numbers("v", words, position, 3),
                _ => Ok(()),
            },
            // v may be missing. A depth may follow it.
            Some(b"vt") => match texture_coordinates.next() {
                Some((uv, true)) => numbers("vt", words, uv, 1),
                _ => Ok(()),
            },
            _ => Ok(()),
        };
        read.map_err(|why| BadLine {
            line: statement.line,
            why,
        })?;
    }
    Ok(())
}

/// Reads a statement's first numbers. At least `least` numbers must exist; the others stay zero.
fn numbers<'a>(
    keyword: &str,
    mut words: impl Iterator<Item = &'a [u8]>,
    numbers: &mut [f64],
    least: usize,
) -> Result<(), String> {
    for (i, number) in numbers.iter_mut().enumerate() {
        let Some(word) = words.next() else {
            if i >= least {
                break;
            }
            return Err(format!(
                "'{keyword}' has {i} of {least} required numbers; add the missing numbers"
            ));
        };
        *number = self::number(word)?;
    }
    Ok(())
}

/// Reads a number.
fn number(word: &[u8]) -> Result<f64, String> {
    let parse = |text: &str| text.parse::<f64>().ok();
    let text = std::str::from_utf8(word).unwrap_or_default();
    let Some(number) = parse(text) else {
        let hint = match parse(&text.replacen(',', ".", 1)) {
            Some(_) => "write a decimal point, not a comma",
            None => "write a number such as -0.5 or 1e-3",
        };
        return Err(format!("{} is not a number; {hint}", quoted(word)));
    };
    if number.is_nan() || number.abs() > MAX_COORDINATE {
        return Err(format!(
            "{} is not within +-{MAX_COORDINATE:e}; correct or remove it",
            quoted(word)
        ));
    }
    Ok(number)
}

/// Returns whether a byte separates words.
fn is_blank(byte: &u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0B | 0x0C)
}

/// Returns the words of a statement, up to a comment.
fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(is_blank)
        .filter(|word| !word.is_empty())
        .take_while(|word| word[0] != b'#')
}

/// A statement, with its lines joined.
struct Statement<'a> {
    text: Cow<'a, [u8]>,
    /// The statement's first line, counted from 1.
    line: usize,
    /// Whether the file ends where the statement should continue.
    cut: bool,
}

/// An iterator over the statements of a file.
struct Statements<'a> {
    rest: Option<&'a [u8]>,
    line: usize,
}

impl<'a> Statements<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self {
            rest: Some(bytes),
            line: 0,
        }
    }

    /// Returns the next line, without its end.
    fn line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest?;
        self.line += 1;
        let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let Some(end) = end else {
            self.rest = None;
            return Some(rest);
        };
        let (line, after) = rest.split_at(end);
        self.rest = Some(after.strip_prefix(b"\r\n").unwrap_or(&after[1..]));
        Some(line)
    }

    /// Returns whether the next line begins a new statement.
    fn next_line_is_a_statement(&self) -> bool {
        let next = self.rest.unwrap_or_default();
        let end = next.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let next = &next[..end.unwrap_or(next.len())];
        words(next)
            .next()
            .is_some_and(|word| KEYWORDS.contains(&word))
    }
}

/// Returns a line without the `\` at its end, or `None` if the line does not end in `\` or has a comment.
fn continued(line: &[u8]) -> Option<&[u8]> {
    let blanks = line.iter().rev().take_while(|byte| is_blank(byte)).count();
    let whole = line[..line.len() - blanks].strip_suffix(b"\\")?;
    // A comment ends with its line, even if a `\` comes last.
    let comment = line.split(is_blank).any(|word| word.first() == Some(&b'#'));
    (!comment).then_some(whole)
}

impl<'a> Iterator for Statements<'a> {
    type Item = Statement<'a>;

    fn next(&mut self) -> Option<Statement<'a>> {
        let mut text = self.line().map(Cow::Borrowed)?;
        let line = self.line;
        let mut from = 0;
        while let Some(whole) = continued(&text[from..]) {
            let whole = from + whole.len();
            let joined = text.to_mut();
            joined.truncate(whole);
            if self.next_line_is_a_statement() {
                break;
            }
            let Some(next) = self.line() else {
                return Some(Statement {
                    text,
                    line,
                    cut: true,
                });
            };
            joined.push(b' ');
            from = joined.len();
            joined.extend_from_slice(next);
        }
        Some(Statement {
            text,
            line,
            cut: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(position: u32, uv: Option<u32>) -> ObjCorner {
        ObjCorner { position, uv }
    }

    #[test]
    fn every_spelling_of_a_face_is_read() {
        let obj = parse(
            b"# a comment \\\n\
              mtllib some.mtl\r\n\
              o one\n\
              v 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\n\
              vt 0\nvt 1 0\nvt 1 1 0\nvn 0 0 1\n\
              s off\n\
              f 1 2 3\n\
              f 1/1 2/2 \\\n   3/3 # goes on\n\
              o two \xE9\n\
              v +2e0 -.5 5.\n\
              f 1//1 -1//-1 3//1\n\
              f -4/-3/1 -3/-2/1 -2/-1/1 4/1/1\n\
              f 5 1 2\nv 0 0 1\n\
              l 1 2\np 1\nl 2 3\n",
        )
        .unwrap();
        assert_eq!(obj.positions[2..4], [[1.0, 1.0, 0.0], [2.0, -0.5, 5.0]]);
        assert_eq!(
            obj.texture_coordinates,
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]
        );
        let faces: Vec<_> = obj.faces.iter().map(|face| obj.corners_of(face)).collect();
        let bare = |positions: [u32; 3]| positions.map(|position| corner(position, None));
        assert_eq!(faces[0], bare([0, 1, 2]));
        assert_eq!(faces[1], [0, 1, 2].map(|i| corner(i, Some(i))));
        assert_eq!(faces[2], bare([0, 3, 2]));
        let four = [(0, 0), (1, 1), (2, 2), (3, 0)].map(|(p, t)| corner(p, Some(t)));
        assert_eq!(faces[3], four);
        assert_eq!(faces[4], bare([4, 0, 1]));
        assert_eq!(
            obj.skipped.to_string(),
            "3 statements skipped (2 'l', 1 'p')"
        );
        let lines: Vec<_> = obj.faces.iter().map(|face| face.line).collect();
        assert_eq!(lines, [12, 13, 17, 18, 19]);
    }

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";

    /// Returns the faces and coordinates of a text, without their lines.
    fn read(text: &[u8]) -> (Vec<[f64; 3]>, Vec<[f64; 2]>, Vec<ObjCorner>) {
        let obj = parse(text).unwrap_or_else(|error| panic!("{}: {error}", text.escape_ascii()));
        (obj.positions, obj.texture_coordinates, obj.corners)
    }

    #[test]
    fn any_line_ends_and_any_blanks_are_accepted() {
        let plain = read(TRIANGLE.as_bytes());
        for text in [
            format!("\u{feff}{TRIANGLE}"),
            TRIANGLE.replace('\n', "\r"),
            TRIANGLE.replace('\n', "\r\n"),
            TRIANGLE.replacen('\n', "\r", 3).replacen('\n', "\r\n", 2),
            TRIANGLE.replace(' ', "\x0b\t\x0c"),
            TRIANGLE.replace('\n', " \x0b\n"),
            TRIANGLE.replace(" 0 0\n", " \\\n0 0\n"),
            TRIANGLE.replace(" 0 0\n", "\\ \t\x0b\x0c\r\n0\\\r0\r\n"),
            TRIANGLE.trim_end().into(),
            // A name may end with a `\`.
            format!("usemtl mats\\\n{TRIANGLE}"),
            format!("usemtl C:\\mats\\ \r\n{TRIANGLE}o \\"),
            TRIANGLE.replace("\nv", "\\\nv"),
            format!("g a \\\n  b c\n{TRIANGLE}"),
            format!("{TRIANGLE}vn 0 0 \\"),
        ] {
            assert_eq!(read(text.as_bytes()), plain, "{text:?}");
        }
        for (text, line) in [
            ("\r\rf 0", 3),
            ("\r\n\r\nf 0", 3),
            ("\n\r\nf 0", 3),
            ("a\r\nb\rc\nf 0", 4),
            ("\n\rf 0", 3),
            ("usemtl mats\\\nv 0 0 0\nf 0", 3),
            ("v 0 \\\n 0 \\ \n 0\nf 1 2 \\\n 0", 4),
        ] {
            assert_eq!(parse(text.as_bytes()).unwrap_err().line, line, "{text:?}");
        }
    }

    #[test]
    fn data_that_no_face_uses_is_never_an_error() {
        let plain = read(TRIANGLE.as_bytes());
        for more in [
            "vn nan nan nan",
            "vn -nan(ind) -1.#IND 1.#QNAN0",
            "vn",
            "vn x\0y \x1b[31m",
            "v nan 0 0\nvt 1.#INF00",
            "v\nvt",
            "v 1,5 0x10 1.0abc",
            "usemtl \0",
            "# \0",
        ] {
            let (mut positions, mut texture_coordinates, corners) =
                read(format!("{TRIANGLE}{more}").as_bytes());
            positions.truncate(3);
            texture_coordinates.truncate(3);
            assert_eq!((positions, texture_coordinates, corners), plain, "{more:?}");
        }
        for face in [
            "f 1/1/0 2/2/99 3/3/-99",
            "f 1/1/x 2/2/ 3/3/1.5",
            "f 1/1/1/ 2/2 3/3",
        ] {
            let text = TRIANGLE.replace("f 1/1 2/2 3/3", face);
            match face.contains("/1/1/") {
                true => assert!(parse(text.as_bytes()).is_err()),
                false => assert_eq!(read(text.as_bytes()), plain, "{face}"),
            }
        }
        // A face with a corner without texture coordinates gets projected coordinates.
        let mixed = TRIANGLE.replace("3/3", "3").replace("vt 1 0", "vt nan");
        let (_, _, corners) = read(mixed.as_bytes());
        assert!(corners.iter().all(|corner| corner.uv.is_none()));
        // Anything may follow the numbers that count.
        let behind = TRIANGLE.replace("v 1 0 0", "v 1 0 0 1.#J nan");
        let behind = behind.replace("vt 1 0", "vt 1 0 -nan(ind)");
        assert_eq!(read(behind.as_bytes()), plain);
    }

    #[test]
    fn unknown_statements_are_counted_by_kind() {
        let skipped = |more: &str| {
            parse(format!("{TRIANGLE}{more}").as_bytes())
                .unwrap()
                .skipped
        };
        assert_eq!(
            skipped("vn 1\no\ng a\ns 1\nusemtl\nmtllib a b"),
            SkippedStatements::default()
        );
        let tagged = skipped("t crease 2/1/0 1 2 2.0");
        assert_eq!(tagged.to_string(), "1 statement skipped (1 't')");
        assert_eq!(tagged.kinds, [(b"t".to_vec(), 8, 1)]);
        let many =
            skipped("vw 1\nt\nusemap a\nvw 2\ncstype b\ncurv 1\nsurf 1\nend\nend\n\x1b[0m\n");
        let expected = "10 statements skipped (2 'vw', 1 't', 1 'usemap', 1 'cstype', 1 'curv', \
                     1 'surf', 3 others)";
        assert_eq!(many.to_string(), expected);
        let escape = skipped("\x1b[0m").to_string();
        assert_eq!(escape, r"1 statement skipped (1 '\x1b[0m')");
    }

    #[test]
    fn errors_name_the_line_and_the_reason() {
        let numbers = |word: &str| format!("v 0 0 0\nv 0 0 {word}\nf 1 2 1");
        let mut cases: Vec<(String, usize, &str)> = Vec::new();
        for (word, why) in [
            ("x", "'x' is not a number"),
            ("1.#INF00", "'1.#INF00' is not a number"),
            ("1.#QNAN0", "'1.#QNAN0' is not a number"),
            ("-1.#IND", "'-1.#IND' is not a number"),
            ("-nan(ind)", "'-nan(ind)' is not a number"),
            ("1.0abc", "'1.0abc' is not a number"),
            ("0x10", "'0x10' is not a number"),
            ("1_0", "'1_0' is not a number"),
            (
                "1,5",
                "'1,5' is not a number; write a decimal point, not a comma",
            ),
            ("1#", "'1#' is not a number"),
            ("1\0", "'1\\x00' is not a number"),
            ("1\u{a0}", "'1\\u{a0}' is not a number"),
            ("nan", "'nan' is not within +-1e30"),
            ("-inf", "'-inf' is not within"),
            ("infinity", "'infinity' is not within"),
            ("1e999", "'1e999' is not within"),
            ("1e31", "'1e31' is not within"),
            ("", "'v' has 2 of 3 required numbers"),
            ("#1", "'v' has 2 of 3 required numbers"),
        ] {
            cases.push((numbers(word), 2, why));
        }
        for (text, line, why) in [
            (
                "vt\nv 0 0 0\nf 1/1 1/1 1/1",
                1,
                "'vt' has 0 of 1 required numbers",
            ),
            ("vt NaN 0\nv 0 0 0\nf 1/1 1/1 1/1", 1, "'NaN' is not within"),
            (
                "v 0 0 0\n\nf 1 1 2\n",
                3,
                "position 2 does not exist: the file has 1",
            ),
            (
                "v 0 0 0\nf 0 1 1",
                2,
                "'0': the position 0 does not exist; indices count from 1",
            ),
            (
                "v 0 0 0\nf 1 -2 1",
                2,
                "'-2': the position -2 does not exist: the file has 1 before this line",
            ),
            (
                "v 0 0 0\nf 1/1 1/1 1/1",
                2,
                "texture coordinate 1 does not exist: the file has 0",
            ),
            (
                "v 0 0 0\nf 1/-1 1 1",
                2,
                "the texture coordinate -1 does not exist: the file has 0 before",
            ),
            ("v 0 0 0\nf 1.5 1 1", 2, "'1.5' is not a whole number"),
            ("v 0 0 0\nf a 1 1", 2, "'a' is not a whole number"),
            ("v 0 0 0\nf /1 1 1", 2, "'/1' has no position"),
            ("v 0 0 0\nf 1/1/1/1 1 1", 2, "more than three indices"),
            (
                "v 0 0 0\nf 99999999999999999999 1 1",
                2,
                "99999999999999999999 does not exist",
            ),
            (
                "v 0 0 0\nf 4294967296 1 1",
                2,
                "4294967296 does not exist: the file has 1",
            ),
            (
                "v 0 0 0\nf 1 -9223372036854775808 1",
                2,
                "the file has 1 before this line",
            ),
            ("\nf 1 1\\\n 1 \\", 2, "the file ends here"),
            // No faces: the error names the first line that does not belong in an OBJ.
            (
                "# a\nhello\nworld",
                2,
                "'hello' is not a statement of a Wavefront OBJ",
            ),
            ("hello\nv for vendetta", 1, "'hello' is not a statement"),
            ("v for vendetta\nhello", 1, "'for' is not a number"),
            ("\x7fELF\0", 1, "'\\x7fELF\\x00' is not a statement"),
        ] {
            cases.push((text.into(), line, why));
        }
        for (text, line, why) in cases {
            let error = parse(text.as_bytes()).unwrap_err();
            assert!(error.why.contains(why), "{text:?}: {error}");
            assert_eq!(error.line, line, "{text:?}: {error}");
        }
    }

    #[test]
    fn files_beyond_the_limits_are_refused() {
        let corners = |count: usize| format!("v 0 0 0\nf{}\n", " 1".repeat(count));
        assert!(parse(corners(MAX_CORNERS).as_bytes()).is_ok());
        let error = parse(corners(MAX_CORNERS + 1).as_bytes()).unwrap_err();
        assert!(
            error
                .why
                .starts_with("the face has 2049 corners, but at most 2048 are allowed;")
        );
        assert_eq!(error.line, 2);
        let error =
            parse(format!("v 0 0 0\n{}", "f\n".repeat(MAX_READ + 1)).as_bytes()).unwrap_err();
        assert_eq!(error.line, MAX_READ + 2);
        assert!(
            error
                .why
                .starts_with("up to this line the file has 1048577 faces and 0 corners"),
            "{error}"
        );
        let face = format!("f{}\n", " 1".repeat(MAX_CORNERS));
        let error = parse(format!("v 0 0 0\n{}", face.repeat(2050)).as_bytes()).unwrap_err();
        assert!(
            error
                .why
                .contains("at most 1048576 faces and 4194304 corners are allowed"),
            "{error}"
        );
    }
}
