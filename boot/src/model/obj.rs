//! Wavefront OBJ files: positions, places in a texture, and faces of any size.
//!
//! A parser of our own, because what is asked of it is the line of everything that is wrong, and
//! none of the libraries tells it: tobj's errors name neither line nor value, obj-rs panics at legal
//! statements (`unimplemented!`), and wavefront_obj has line numbers, but refuses negative indices
//! and cuts every face to a fan. What would be left for them to do is to split lines into words.
//!
//! Of the format all statements are known, and what is not a polygon (points, lines, curves and
//! surfaces of free form) is counted and left out. Normals are checked and not used: faces are flat.
//! Materials are not read.

use std::fmt;

/// Furthest coordinate, either sign: a model's size is squared on the way.
const MAX_COORDINATE: f64 = 1e30;

/// The statements that make no polygon, and that are no loss: names, groups, materials, normals.
const IGNORED: [&str; 26] = [
    "bevel",
    "bmat",
    "c_interp",
    "call",
    "csh",
    "cstype",
    "ctech",
    "d_interp",
    "deg",
    "end",
    "g",
    "lod",
    "maplib",
    "mg",
    "mtllib",
    "o",
    "parm",
    "res",
    "s",
    "shadow_obj",
    "step",
    "stech",
    "trace_obj",
    "usemap",
    "usemtl",
    "vp",
];
/// The statements of things that can be seen, and that are not drawn.
const UNDRAWN: [&str; 14] = [
    "bsp", "bzp", "cdc", "cdp", "con", "curv", "curv2", "hole", "l", "p", "scrv", "sp", "surf",
    "trim",
];

/// What an OBJ file has of polygons.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Obj {
    /// x right, y up, z towards the viewer; finite.
    pub positions: Vec<[f64; 3]>,
    /// Places in the texture: u to the right, v up, one being the whole of it; finite.
    pub places: Vec<[f64; 2]>,
    /// Corners of all faces.
    pub corners: Vec<Corner>,
    /// Faces.
    pub faces: Vec<Face>,
    /// Points, lines, curves and surfaces of free form.
    pub undrawn: usize,
}

/// A corner of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Corner {
    /// Which of the positions.
    pub position: usize,
    /// Which of the places, if it has one.
    pub place: Option<usize>,
}

/// A polygon, counter-clockwise as it is seen from its front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Its first corner.
    pub first: usize,
    /// How many corners; any number.
    pub corners: usize,
    /// The line that it is on, counted from 1.
    pub line: usize,
}

impl Obj {
    /// The corners of one of the faces.
    pub fn corners_of(&self, face: &Face) -> &[Corner] {
        &self.corners[face.first..][..face.corners]
    }
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadLine {
    /// The line, counted from 1; of a statement over several lines the first.
    pub line: usize,
    /// What is wrong with it.
    pub why: String,
}

impl fmt::Display for BadLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.why)
    }
}

impl std::error::Error for BadLine {}

/// Reads a file's bytes. They need not be UTF-8: names are in any encoding.
///
/// # Errors
/// The first line that is wrong; of indices that are too large, the first face with one.
pub fn parse(bytes: &[u8]) -> Result<Obj, BadLine> {
    let mut reader = Reader::default();
    let mut statement = Vec::new();
    let mut first = 1;
    for (number, line) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
        if line.contains(&0) {
            return Err(BadLine {
                line: number,
                why: "it has a zero byte: this is no text, and no OBJ".into(),
            });
        }
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if statement.is_empty() {
            first = number;
        }
        // A comment ends with its line, whatever that ends in.
        match line.iter().position(|&byte| byte == b'#') {
            Some(comment) => statement.extend_from_slice(&line[..comment]),
            None => {
                if let Some(continued) = line.strip_suffix(b"\\") {
                    statement.extend_from_slice(continued);
                    statement.push(b' ');
                    continue;
                }
                statement.extend_from_slice(line);
            }
        }
        reader
            .statement(first, &String::from_utf8_lossy(&statement))
            .map_err(|why| BadLine { line: first, why })?;
        statement.clear();
    }
    if !statement.is_empty() {
        return Err(BadLine {
            line: first,
            why: "it goes on in a next line, and there is none".into(),
        });
    }
    reader.whole()
}

#[derive(Default)]
struct Reader {
    obj: Obj,
    normals: usize,
    /// The largest index of a normal, counted from 1, and the line that it is on.
    last_normal: (usize, usize),
}

impl Reader {
    fn statement(&mut self, line: usize, text: &str) -> Result<(), String> {
        let mut words = text.split_ascii_whitespace();
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        match keyword {
            // After the coordinates there may be a weight, or a colour.
            "v" => {
                let [x, y, z] = numbers(keyword, &mut words, 3)?;
                self.obj.positions.push([x, y, z]);
            }
            // After u and v there may be a depth; v may be left out.
            "vt" => {
                let [u, v, _] = numbers(keyword, &mut words, 1)?;
                self.obj.places.push([u, v]);
            }
            "vn" => {
                numbers(keyword, &mut words, 3)?;
                self.normals += 1;
            }
            "f" | "fo" => {
                let first = self.obj.corners.len();
                for word in words {
                    let corner = self.corner(line, word)?;
                    self.obj.corners.push(corner);
                }
                let corners = self.obj.corners.len() - first;
                self.obj.faces.push(Face {
                    first,
                    corners,
                    line,
                });
            }
            known if IGNORED.contains(&known) => {}
            known if UNDRAWN.contains(&known) => self.obj.undrawn += 1,
            _ => {
                let said: String = keyword.chars().take(20).collect();
                return Err(format!("'{said}' is no statement of a Wavefront OBJ"));
            }
        }
        Ok(())
    }

    /// A corner: `1`, `1/2`, `1//3` or `1/2/3`.
    fn corner(&mut self, line: usize, word: &str) -> Result<Corner, String> {
        let mut parts = word.split('/');
        let mut index = |what, there| match parts.next() {
            None | Some("") => Ok(None),
            Some(part) => from_zero(part, there)
                .map_err(|why| format!("'{word}': {what} {why}"))
                .map(Some),
        };
        let position = index("position", self.obj.positions.len())?;
        let place = index("texture coordinate", self.obj.places.len())?;
        let normal = index("normal", self.normals)?;
        if parts.next().is_some() {
            return Err(format!("'{word}' has more than three indices"));
        }
        if let Some(normal) = normal.filter(|&normal| normal >= self.last_normal.0) {
            self.last_normal = (normal + 1, line);
        }
        let position = position.ok_or_else(|| format!("'{word}' has no position"))?;
        Ok(Corner { position, place })
    }

    /// The whole file, its indices compared with what there is of each.
    fn whole(self) -> Result<Obj, BadLine> {
        let Self {
            obj,
            normals,
            last_normal,
        } = self;
        let beyond = |line, what: &str, index: usize, there: usize| {
            let why = format!("{what} {index}: there are {there} of them");
            Err(BadLine { line, why })
        };
        for face in &obj.faces {
            for corner in obj.corners_of(face) {
                if corner.position >= obj.positions.len() {
                    let there = obj.positions.len();
                    return beyond(face.line, "position", corner.position + 1, there);
                }
                if let Some(place) = corner.place.filter(|&place| place >= obj.places.len()) {
                    let there = obj.places.len();
                    return beyond(face.line, "texture coordinate", place + 1, there);
                }
            }
        }
        if last_normal.0 > normals {
            return beyond(last_normal.1, "normal", last_normal.0, normals);
        }
        Ok(obj)
    }
}

/// The first three of a statement's numbers; `least` of them must be there, the others are zeros.
fn numbers<'a>(
    keyword: &str,
    words: &mut impl Iterator<Item = &'a str>,
    least: usize,
) -> Result<[f64; 3], String> {
    let mut numbers = [0.0; 3];
    for (i, number) in numbers.iter_mut().enumerate() {
        let Some(word) = words.next() else {
            if i >= least {
                break;
            }
            return Err(format!("'{keyword}' has {i} numbers; it takes {least}"));
        };
        let parsed = word.parse::<f64>();
        *number = parsed.map_err(|_| format!("'{word}' is no number"))?;
        if !number.is_finite() {
            return Err(format!("'{word}' is not finite"));
        }
        if number.abs() > MAX_COORDINATE {
            return Err(format!("{word} is beyond +-{MAX_COORDINATE:e}"));
        }
    }
    Ok(numbers)
}

/// An index, counted from 0. Counted from 1 in the file, it may come before what it names; below
/// zero it counts back from the last one before it.
fn from_zero(word: &str, there: usize) -> Result<usize, String> {
    let number: i64 = word
        .parse()
        .map_err(|_| format!("'{word}' is no whole number"))?;
    match number {
        0 => Err("0: they are counted from 1".into()),
        1.. => Ok((number - 1) as usize),
        _ => usize::try_from(number.unsigned_abs())
            .ok()
            .and_then(|back| there.checked_sub(back))
            .ok_or_else(|| format!("{number}: there are {there} before it")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(position: usize, place: Option<usize>) -> Corner {
        Corner { position, place }
    }

    #[test]
    fn all_ways_to_write_a_face_are_read() {
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
              l 1 2\np 1\n",
        )
        .unwrap();
        assert_eq!(obj.positions[2..4], [[1.0, 1.0, 0.0], [2.0, -0.5, 5.0]]);
        assert_eq!(obj.places, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
        let faces: Vec<_> = obj.faces.iter().map(|face| obj.corners_of(face)).collect();
        let bare = |positions: [usize; 3]| positions.map(|position| corner(position, None));
        assert_eq!(faces[0], bare([0, 1, 2]));
        assert_eq!(faces[1], [0, 1, 2].map(|i| corner(i, Some(i))));
        assert_eq!(faces[2], bare([0, 3, 2]));
        let four = [(0, 0), (1, 1), (2, 2), (3, 0)].map(|(p, t)| corner(p, Some(t)));
        assert_eq!(faces[3], four);
        assert_eq!(faces[4], bare([4, 0, 1]));
        assert_eq!(obj.undrawn, 2);
        let lines: Vec<_> = obj.faces.iter().map(|face| face.line).collect();
        assert_eq!(lines, [12, 13, 17, 18, 19]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, line, why) in [
            (
                "# ok\nsolid cube\n",
                2,
                "'solid' is no statement of a Wavefront OBJ",
            ),
            ("\x7fELF", 1, "'\x7fELF' is no statement"),
            ("v 0 0\0 0", 1, "zero byte"),
            ("v 0 0", 1, "'v' has 2 numbers; it takes 3"),
            ("vt", 1, "'vt' has 0 numbers; it takes 1"),
            ("v 0 0 x", 1, "'x' is no number"),
            ("v 0 0 0\nv 0 nan 0", 2, "'nan' is not finite"),
            ("v 0 0 -inf", 1, "'-inf' is not finite"),
            ("v 0 0 1e999", 1, "'1e999' is not finite"),
            ("vt NaN 0", 1, "'NaN' is not finite"),
            ("vn 0 0 infinity", 1, "'infinity' is not finite"),
            ("v 0 0 1e31", 1, "1e31 is beyond +-1e30"),
            ("v 0 0 0\n\nf 1 1 2\n", 3, "position 2: there are 1 of them"),
            (
                "v 0 0 0\nf 0 1 1",
                2,
                "'0': position 0: they are counted from 1",
            ),
            (
                "v 0 0 0\nf 1 -2 1",
                2,
                "'-2': position -2: there are 1 before it",
            ),
            (
                "v 0 0 0\nf 1/1 1 1",
                2,
                "texture coordinate 1: there are 0 of them",
            ),
            ("v 0 0 0\nf 1//4 1 1", 2, "normal 4: there are 0 of them"),
            (
                "v 0 0 0\nf 1/-1 1 1",
                2,
                "texture coordinate -1: there are 0 before",
            ),
            ("v 0 0 0\nf 1.5 1 1", 2, "'1.5' is no whole number"),
            ("v 0 0 0\nf a 1 1", 2, "'a' is no whole number"),
            ("v 0 0 0\nf /1 1 1", 2, "'/1' has no position"),
            ("v 0 0 0\nf 1/1/1/1 1 1", 2, "more than three indices"),
            (
                "v 0 0 0\nf 99999999999999999999 1 1",
                2,
                "is no whole number",
            ),
            (
                "v 0 0 0\nf 1 -9223372036854775808 1",
                2,
                "there are 1 before it",
            ),
            ("\nv 0 \\\n0 \\", 2, "goes on in a next line"),
        ] {
            let error = parse(text.as_bytes()).unwrap_err();
            assert!(error.why.contains(why), "{text:?}: {error}");
            assert_eq!(error.line, line, "{text:?}: {error}");
        }
    }
}
