//! Model files: the file format of a user's model, for the kernel and for the host program.
//!
//! The host computes mesh, texels, palette and light table once, on import. The kernel and the emulated VGA's
//! demo then read the same bytes, so they draw the same frame, and a model file's checksum identifies the
//! model.
//!
//! # The format, version 1
//!
//! All numbers are little-endian, and the parts follow each other without gaps:
//!
//! | bytes | contents |
//! | --- | --- |
//! | 8 | [`MAGIC`] |
//! | 4 | [`VERSION`] |
//! | 4 | length of the whole model file in bytes |
//! | 4 | checksum: the CRC-32 (ISO-HDLC) of all bytes after it |
//! | 2, 2, 2 | the numbers of vertices V, corners C and faces F |
//! | 2, 2 | the texture's width W and height H |
//! | 256 x 3 | palette: the DAC's colours, red, green and blue, each 0 to 63 |
//! | 24 x 256 | light table: for each light level and texel an entry of the palette |
//! | 240 | background: for each scan line an entry of the palette |
//! | W x H | texels, row by row from the top left |
//! | V x 12 | vertices: x right, y down, z away from the viewer, signed, 16.16 |
//! | C x 10 | corners of all faces: 2 bytes of vertex index, 4 of u and 4 of v in the texture, 16.16 texels |
//! | F x 8 | faces: 2 bytes with the number of corners, which follow the corners of the face before; three times 2 bytes of the outward unit normal, signed, 14 fraction bits |
//!
//! A texel is not a colour: the light table turns it into a colour. So texels and palette can be reduced
//! independently.
//!
//! # Checks
//!
//! [`ModelFile::parse`] trusts nothing, because the bytes may come from anywhere. The checksum finds any
//! accidental change. But a model file can be forged with a matching checksum, so every count, index and
//! range is also checked. A scene from an accepted model file is within every limit of the renderer and
//! the mappers, and cannot make them panic. Whether the scene looks good is not checked: faces may be bent,
//! inside out or invisible.
//!
//! # Example
//!
//! ```
//! use model::{ModelFile, Parts};
//! use scene::catalogue::Colours;
//! use scene::{Corner, Mesh, MeshFace};
//! use texmap::Texture;
//!
//! // A triangle with a texture of one texel.
//! let face = MeshFace {
//!     corners: 3,
//!     normal: [0, 0, -(1 << 14)],
//!     ..MeshFace::default()
//! };
//! let parts = Parts {
//!     mesh: Mesh {
//!         vertices: &[[0, 0, 0], [1 << 16, 0, 0], [0, 1 << 16, 0]],
//!         corners: &[0, 1, 2].map(|vertex| Corner { vertex, u: 0, v: 0 }),
//!         faces: &[face],
//!         convex: false,
//!     },
//!     texture: Texture::new(&[7], 1, 1).unwrap(),
//!     colours: Colours::BUILT_IN,
//!     background: &[0; modex::HEIGHT],
//! };
//! let mut bytes = Vec::new();
//! let checksum = parts.write(|part| bytes.extend_from_slice(part));
//! assert_eq!(ModelFile::parse(&bytes).unwrap().checksum(), checksum);
//! ```
#![no_std]
#![forbid(unsafe_code)]

mod arena;
mod error;

use crc::{CRC_32_ISO_HDLC, Crc};
use modex::{HEIGHT, Palette};
use scene::catalogue::{Colours, Entry};
use scene::{
    Corner, LIGHT_LEVELS, LightTable, MAX_CORNERS, MAX_EXTENT, MAX_FACES, MAX_VERTICES, Mesh,
    MeshFace,
};
use texmap::Texture;

pub use arena::Arena;
pub use error::ModelError;

/// First bytes of a model file.
pub const MAGIC: [u8; 8] = *b"CBALPACK";
/// Version of the format.
pub const VERSION: u32 = 1;
/// Most corners of all faces together: as many as the largest number of triangles has.
pub const MAX_ALL_CORNERS: usize = 3 * MAX_FACES;
/// Longest model file in bytes.
pub const MAX_BYTES: usize = 512 * 1024;

/// Bytes of magic, version, length and checksum, which come before the bytes that the checksum covers.
const SUMMED: usize = 20;
/// Bytes before the palette.
const HEADER: usize = SUMMED + 10;
const PALETTE: usize = 256 * 3;
const LIGHT: usize = LIGHT_LEVELS * 256;
const VERTEX: usize = 12;
const CORNER: usize = 10;
const FACE: usize = 8;

// A model file with the largest counts still fits `MAX_BYTES`.
const _: () = assert!(
    HEADER
        + PALETTE
        + LIGHT
        + HEIGHT
        + Texture::MAX_SIDE as usize * Texture::MAX_SIDE as usize
        + MAX_VERTICES * VERTEX
        + MAX_ALL_CORNERS * CORNER
        + MAX_FACES * FACE
        <= MAX_BYTES
);

/// Largest difference of a normal's squared length from 2^28, that of a unit vector: rounding may change each
/// component by one unit. The light raises a product with the normal to the 32nd power, and longer normals
/// would overflow 64 bits.
const NORMAL_SLACK: i64 = 1 << 16;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The content of a model file.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// The solid.
    pub mesh: Mesh<'a>,
    /// The texture that covers the solid.
    pub texture: Texture<'a>,
    /// Palette and light table.
    pub colours: Colours<'a>,
    /// The palette entry of each scan line where the solid does not cover it.
    pub background: &'a [u8; HEIGHT],
}

impl Parts<'_> {
    /// Passes the model file's bytes from the palette on to `sink`, in pieces and in order.
    fn body(&self, sink: &mut impl FnMut(&[u8])) {
        sink(self.colours.palette.as_flattened());
        sink(self.colours.light.as_flattened());
        sink(self.background);
        let rows = self.texture.texels().chunks(self.texture.pitch().into());
        for row in rows.take(self.texture.height().into()) {
            sink(&row[..self.texture.width().into()]);
        }
        for vertex in self.mesh.vertices {
            vertex.iter().for_each(|k| sink(&k.to_le_bytes()));
        }
        for corner in self.mesh.corners {
            sink(&corner.vertex.to_le_bytes());
            sink(&corner.u.to_le_bytes());
            sink(&corner.v.to_le_bytes());
        }
        for face in self.mesh.faces {
            sink(&face.corners.to_le_bytes());
            let normal = face.normal.map(|k| k as i16);
            normal.iter().for_each(|k| sink(&k.to_le_bytes()));
        }
    }

    /// Writes the model file in pieces, and returns its checksum. Values beyond a limit are written as they
    /// are; [`ModelFile::parse`] refuses them. The faces use the corners one after the other, and all faces
    /// use the one texture; their `first` and `texture` are ignored.
    pub fn write(&self, mut sink: impl FnMut(&[u8])) -> u32 {
        let Mesh {
            vertices,
            corners,
            faces,
            ..
        } = self.mesh;
        let counts = [vertices.len(), corners.len(), faces.len()];
        let sides = [self.texture.width(), self.texture.height()];
        let mut numbers = [0; HEADER - SUMMED];
        let values = counts.map(|count| count as u16).into_iter().chain(sides);
        for (place, value) in numbers.chunks_exact_mut(2).zip(values) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        let mut digest = CRC.digest();
        let mut length = HEADER;
        digest.update(&numbers);
        self.body(&mut |bytes| {
            digest.update(bytes);
            length += bytes.len();
        });
        let checksum = digest.finalize();
        sink(&MAGIC);
        for number in [VERSION, length as u32, checksum] {
            sink(&number.to_le_bytes());
        }
        sink(&numbers);
        self.body(&mut sink);
        checksum
    }
}

/// A model file whose bytes have been checked. It borrows the bytes.
#[derive(Clone, Copy, Debug)]
pub struct ModelFile<'p> {
    checksum: u32,
    colours: Colours<'p>,
    background: &'p [u8; HEIGHT],
    texture: Texture<'p>,
    vertices: &'p [[u8; VERTEX]],
    corners: &'p [[u8; CORNER]],
    faces: &'p [[u8; FACE]],
}

/// A reader that removes parts from the front of bytes.
struct Reader<'p> {
    rest: &'p [u8],
}

impl<'p> Reader<'p> {
    /// Returns the next `len` bytes. They exist, because the length was compared with the sum of all parts.
    fn take(&mut self, len: usize) -> &'p [u8] {
        let (part, rest) = self.rest.split_at(len);
        self.rest = rest;
        part
    }

    /// Returns the next `count` records of N bytes.
    fn records<const N: usize>(&mut self, count: usize) -> &'p [[u8; N]] {
        let (records, _) = self.take(count * N).as_chunks();
        records
    }
}

impl<'p> ModelFile<'p> {
    /// Parses a model file, and checks all of it.
    ///
    /// # Errors
    /// The reason that concerns the first value that is not legal.
    pub fn parse(bytes: &'p [u8]) -> Result<Self, ModelError> {
        if bytes.len() > MAX_BYTES {
            return Err(ModelError::TooLong(bytes.len()));
        }
        // Check the magic first, so that other bytes are reported as no model file and not as a short model
        // file.
        if !bytes.starts_with(&MAGIC) {
            return Err(ModelError::NotAModelFile);
        }
        let (header, _) = bytes
            .split_first_chunk::<HEADER>()
            .ok_or(ModelError::Short(bytes.len()))?;
        let word = |at: usize| u16::from_le_bytes([header[at], header[at + 1]]);
        let long = |at: usize| u32::from(word(at)) | u32::from(word(at + 2)) << 16;
        // Another version may have its length and checksum in other places.
        let version = long(8);
        if version != VERSION {
            return Err(ModelError::Version(version));
        }
        let stated = long(12);
        if stated as usize != bytes.len() {
            let actual = bytes.len();
            return Err(ModelError::Length { stated, actual });
        }
        let (stated, computed) = (long(16), CRC.checksum(&bytes[SUMMED..]));
        if stated != computed {
            return Err(ModelError::Checksum { stated, computed });
        }
        let [vertices, corners, faces] = [20, 22, 24].map(|at| usize::from(word(at)));
        let (width, height) = (word(26), word(28));
        for (what, count, most) in [
            ("vertices", vertices, MAX_VERTICES),
            ("corners", corners, MAX_ALL_CORNERS),
            ("faces", faces, MAX_FACES),
        ] {
            if count > most {
                return Err(ModelError::TooMany { what, count, most });
            }
        }
        let texels = usize::from(width) * usize::from(height);
        let fixed = HEADER + PALETTE + LIGHT + HEIGHT;
        let parts = fixed + texels + vertices * VERTEX + corners * CORNER + faces * FACE;
        if parts != bytes.len() {
            let actual = bytes.len();
            return Err(ModelError::Parts { parts, actual });
        }

        let mut reader = Reader {
            rest: &bytes[HEADER..],
        };
        let palette: &Palette = whole(reader.records(256));
        let light: &LightTable = whole(reader.records(LIGHT_LEVELS));
        let background = whole(reader.take(HEIGHT));
        let texture = Texture::new(reader.take(texels), width, height)?;
        let model_file = Self {
            checksum: stated,
            colours: Colours { palette, light },
            background,
            texture,
            vertices: reader.records(vertices),
            corners: reader.records(corners),
            faces: reader.records(faces),
        };
        model_file.check()?;
        Ok(model_file)
    }

    /// Checks every value against its range.
    fn check(&self) -> Result<(), ModelError> {
        let beyond_dac = |colour: &[u8; 3]| colour.iter().any(|&part| part > 63);
        if let Some(entry) = self.colours.palette.iter().position(beyond_dac) {
            return Err(ModelError::Colour(entry));
        }
        let extent = -MAX_EXTENT..=MAX_EXTENT;
        for (i, vertex) in self.vertices.iter().map(vertex).enumerate() {
            if !vertex.iter().all(|k| extent.contains(k)) {
                return Err(ModelError::Vertex(i));
            }
        }
        let width = i32::from(self.texture.width()) << 16;
        let height = i32::from(self.texture.height()) << 16;
        for (i, corner) in self.corners.iter().map(corner).enumerate() {
            if usize::from(corner.vertex) >= self.vertices.len() {
                return Err(ModelError::CornerVertex {
                    corner: i,
                    vertex: corner.vertex,
                    vertices: self.vertices.len(),
                });
            }
            if !(0..=width).contains(&corner.u) || !(0..=height).contains(&corner.v) {
                return Err(ModelError::CornerTexture(i));
            }
        }
        let mut first = 0;
        for (i, face) in self.faces.iter().enumerate() {
            let face = face_at(face, first);
            if !(3..=MAX_CORNERS).contains(&face.corners.into()) {
                return Err(ModelError::FaceCorners(i));
            }
            let length: i64 = face.normal.iter().map(|&k| i64::from(k).pow(2)).sum();
            if (length - (1 << 28)).abs() > NORMAL_SLACK {
                return Err(ModelError::FaceNormal(i));
            }
            // The sum is at most MAX_FACES x MAX_CORNERS.
            first += usize::from(face.corners);
        }
        if first != self.corners.len() {
            return Err(ModelError::CornerCount {
                used: first,
                present: self.corners.len(),
            });
        }
        Ok(())
    }

    /// Returns the checksum in the header, which identifies the model file.
    pub fn checksum(&self) -> u32 {
        self.checksum
    }

    /// Returns the model file's scene. Its mesh is unpacked into `arena`.
    pub fn entry<'a>(&self, arena: &'a mut Arena) -> Entry<'a>
    where
        'p: 'a,
    {
        let Arena {
            vertices,
            corners,
            faces,
        } = arena;
        let mut first = 0;
        let faces_of = self.faces.iter().map(|bytes| {
            let face = face_at(bytes, first);
            first += usize::from(face.corners);
            face
        });
        let mesh = Mesh {
            vertices: arena::fill(vertices, self.vertices.iter().map(vertex)),
            corners: arena::fill(corners, self.corners.iter().map(corner)),
            faces: arena::fill(faces, faces_of),
            // A file's solid may be concave, so it is never assumed to be convex.
            convex: false,
        };
        Entry::loaded(mesh, self.texture, self.colours, self.background)
    }
}

/// Converts a part to its fixed size.
fn whole<T, const N: usize>(part: &[T]) -> &[T; N] {
    part.try_into().expect("it was cut to this size")
}

fn vertex(bytes: &[u8; VERTEX]) -> [i32; 3] {
    let (parts, _) = bytes.as_chunks();
    [0, 1, 2].map(|k| i32::from_le_bytes(parts[k]))
}

fn corner(bytes: &[u8; CORNER]) -> Corner {
    let [a, b, place @ ..] = *bytes;
    let (parts, _) = place.as_chunks();
    Corner {
        vertex: u16::from_le_bytes([a, b]),
        u: i32::from_le_bytes(parts[0]),
        v: i32::from_le_bytes(parts[1]),
    }
}

/// Returns a face whose first corner is `first`, which is at most [`MAX_ALL_CORNERS`] in an accepted model
/// file.
fn face_at(bytes: &[u8; FACE], first: usize) -> MeshFace {
    let (words, _) = bytes.as_chunks();
    MeshFace {
        first: first as u16,
        corners: u16::from_le_bytes(words[0]),
        texture: 0,
        normal: [1, 2, 3].map(|k| i16::from_le_bytes(words[k]).into()),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use modex::PlanarBuffer;
    use render::{RenderMemory, RenderOptions, SceneRenderer};
    use scene::Pose;
    use std::boxed::Box;
    use std::string::ToString;
    use std::vec::Vec;

    const SIDES: (u16, u16) = (7, 5);

    /// Returns a model file with the catalogue's cube and a small texture.
    fn cube() -> Vec<u8> {
        let cube = Entry::parse("cube").unwrap().scene(&[]);
        let mut corners = cube.mesh.corners.to_vec();
        for corner in &mut corners {
            let most = |on: i32, side: u16| if on > 0 { i32::from(side) << 16 } else { 0 };
            (corner.u, corner.v) = (most(corner.u, SIDES.0), most(corner.v, SIDES.1));
        }
        let texels: Vec<u8> = (0..SIDES.0 * SIDES.1).map(|i| 100 + i as u8).collect();
        let parts = Parts {
            mesh: Mesh {
                corners: &corners,
                ..cube.mesh
            },
            texture: Texture::new(&texels, SIDES.0, SIDES.1).unwrap(),
            colours: Colours {
                palette: cube.palette,
                light: cube.light,
            },
            background: cube.background,
        };
        let mut bytes = Vec::new();
        let checksum = parts.write(|part| bytes.extend_from_slice(part));
        assert_eq!(ModelFile::parse(&bytes).unwrap().checksum(), checksum);
        bytes
    }

    /// Returns a changed model file whose length and checksum match the change.
    fn forged(change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
        let mut bytes = cube();
        change(&mut bytes);
        let length = (bytes.len() as u32).to_le_bytes();
        bytes[12..16].copy_from_slice(&length);
        let checksum = CRC.checksum(&bytes[SUMMED..]).to_le_bytes();
        bytes[16..20].copy_from_slice(&checksum);
        bytes
    }

    #[test]
    fn a_parsed_model_file_has_the_written_scene() {
        let bytes = cube();
        let model_file = ModelFile::parse(&bytes).unwrap();
        let mut arena = in_place::boxed!(Arena);
        let entry = model_file.entry(&mut arena);
        let mut painted = Box::new([0; scene::catalogue::MAX_TEXELS]);
        let textures = entry.paint(&mut painted);
        let (scene, cube) = (
            entry.scene(&textures),
            Entry::parse("cube").unwrap().scene(&[]),
        );
        assert_eq!(scene.name, Entry::LOADED);
        assert_eq!(scene.mesh.vertices, cube.mesh.vertices);
        assert_eq!(scene.mesh.faces, cube.mesh.faces);
        assert_eq!(scene.mesh.corners.len(), cube.mesh.corners.len());
        for (corner, before) in scene.mesh.corners.iter().zip(cube.mesh.corners) {
            assert_eq!(corner.vertex, before.vertex);
            assert_eq!(corner.u > 0, before.u > 0);
        }
        assert_eq!((scene.palette, scene.light), (cube.palette, cube.light));
        assert_eq!(scene.background, cube.background);
        assert_eq!((textures[0].width(), textures[0].height()), SIDES);
        assert!((100..135).eq(textures[0].texels().iter().copied()));
    }

    #[test]
    fn every_changed_byte_is_found() {
        let good = cube();
        for at in 0..good.len() {
            let mut bytes = good.clone();
            bytes[at] ^= 1 << (at % 8);
            assert!(ModelFile::parse(&bytes).is_err(), "byte {at}");
        }
        for len in 0..good.len() {
            assert!(ModelFile::parse(&good[..len]).is_err(), "{len} bytes");
        }
    }

    #[test]
    fn an_illegal_value_is_named_even_if_the_checksum_is_right() {
        const FIXED: usize = HEADER + PALETTE + LIGHT + HEIGHT;
        const VERTICES: usize = FIXED + (SIDES.0 * SIDES.1) as usize;
        const CORNERS: usize = VERTICES + 24 * VERTEX;
        const FACES: usize = CORNERS + 24 * CORNER;
        let with = |at: usize, new: &'static [u8]| {
            forged(|bytes| bytes[at..at + new.len()].copy_from_slice(new))
        };
        for (bytes, why) in [
            (with(0, b"c"), "does not begin as a model file"),
            (Vec::new(), "does not begin as a model file"),
            (MAGIC.to_vec(), "8 bytes are too few"),
            (
                with(8, &[2]),
                "version 2 of the format; this program reads version 1",
            ),
            (std::vec![0; MAX_BYTES], "does not begin as a model file"),
            (std::vec![0; MAX_BYTES + 1], "has at most 524288"),
            (
                with(20, &[1, 16]),
                "4097 vertices; at most 4096 are allowed",
            ),
            (
                with(22, &[1, 96]),
                "24577 corners; at most 24576 are allowed",
            ),
            (with(24, &[1, 32]), "8193 faces; at most 8192 are allowed"),
            (with(24, &[7]), "the counts in the header need"),
            (
                forged(|bytes| bytes.push(0)),
                "the counts in the header need",
            ),
            (with(26, &[0, 0]), "the counts in the header need"),
            (
                forged(|bytes| {
                    bytes[26] = 0;
                    bytes.drain(FIXED..VERTICES);
                }),
                "a texture of 0 x 5 texels",
            ),
            (with(HEADER + 5, &[64]), "colour 1 has a component above 63"),
            (with(VERTICES + 15, &[0x7F]), "vertex 1 is outside"),
            (with(VERTICES + 15, &[0x80]), "vertex 1 is outside"),
            (
                with(CORNERS, &[24]),
                "corner 0 refers to vertex 24, but the mesh has 24 vertices",
            ),
            (
                with(CORNERS + 15, &[0xFF]),
                "corner 1 is outside the texture",
            ),
            (with(CORNERS + 14, &[8]), "corner 1 is outside the texture"),
            (with(FACES, &[2]), "face 0 has fewer than 3"),
            (
                with(FACES + 8, &[12]),
                "face 1 has fewer than 3 or more than 11",
            ),
            (with(FACES + 2, &[0, 64]), "the normal of face 0"),
            (
                with(FACES + 2, &[0, 64, 1, 1, 0, 0]),
                "the normal of face 0",
            ),
            (with(FACES + 6, &[0, 0]), "the normal of face 0"),
            (
                with(FACES, &[5]),
                "the faces use 25 corners, but the file has 24",
            ),
        ] {
            let error = ModelFile::parse(&bytes).unwrap_err().to_string();
            assert!(error.contains(why), "{error}: it should contain '{why}'");
        }
        // The largest normal that rounding may produce is accepted: a squared length of 2^28 + 2^16.
        ModelFile::parse(&with(FACES + 2, &[0, 64, 0, 1, 0, 0])).unwrap();
        let mut long = cube();
        long.push(0);
        let error = ModelFile::parse(&long).unwrap_err().to_string();
        assert!(
            error.contains("the header states 7793 bytes, but the file has 7794"),
            "{error}"
        );
    }

    #[test]
    fn a_model_at_the_limits_can_be_drawn() {
        let texels = std::vec![0; 1 << 16];
        let colours = Colours::BUILT_IN;
        let background = Entry::parse("cube").unwrap().scene(&[]).background;
        let extent = [MAX_EXTENT, -MAX_EXTENT];
        let vertices: Vec<_> = (0..MAX_VERTICES)
            .map(|i| [0, 1, 2].map(|k| extent[(i >> k) & 1]))
            .collect();
        let corners: Vec<_> = (0..MAX_ALL_CORNERS)
            .map(|i| Corner {
                vertex: (i * 5 % MAX_VERTICES) as u16,
                u: (256 << 16) * (i as i32 & 1),
                v: (256 << 16) * (i as i32 >> 1 & 1),
            })
            .collect();
        let faces = std::vec![
            MeshFace {
                corners: 3,
                normal: [9460, 9459, -9459],
                ..MeshFace::default()
            };
            MAX_FACES
        ];
        let parts = Parts {
            mesh: Mesh {
                vertices: &vertices,
                corners: &corners,
                faces: &faces,
                convex: false,
            },
            texture: Texture::new(&texels, 256, 256).unwrap(),
            colours,
            background,
        };
        let mut bytes = Vec::new();
        parts.write(|part| bytes.extend_from_slice(part));
        assert!((MAX_BYTES * 3 / 4..=MAX_BYTES).contains(&bytes.len()));
        let model_file = ModelFile::parse(&bytes).unwrap();
        let mut arena = in_place::boxed!(Arena);
        let entry = model_file.entry(&mut arena);
        let mut memory = in_place::boxed!(RenderMemory);
        let mut painted = Box::new([0; scene::catalogue::MAX_TEXELS]);
        let textures = entry.paint(&mut painted);
        let mut renderer = SceneRenderer::new(&mut memory, entry.scene(&textures));
        let pose = Pose {
            distance: Pose::MAX_DISTANCE,
            ..entry.pose(77)
        };
        let stats = renderer
            .draw(&pose, RenderOptions::default(), &mut PlanarBuffer::new())
            .stats;
        assert!(stats.polygons > 1000, "{stats:?}");
    }
}
