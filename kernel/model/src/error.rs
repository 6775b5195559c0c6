//! Why bytes are not a legal model file.

use core::fmt;

use scene::{MAX_CORNERS, MAX_EXTENT};
use texmap::TextureError;

use crate::{MAX_BYTES, VERSION};

/// Why bytes are not a model file that can be shown. Vertices, corners, faces and colours are numbered from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelError {
    /// The bytes do not begin with [`crate::MAGIC`].
    NotAModelFile,
    /// The model file has this many bytes, fewer than a header.
    Short(usize),
    /// The model file has this many bytes, more than [`MAX_BYTES`].
    TooLong(usize),
    /// The model file has this version of the format, which is not [`VERSION`].
    Version(u32),
    /// The length in the header is wrong.
    Length {
        /// Length in the header.
        said: u32,
        /// Length of the model file.
        actual: usize,
    },
    /// The checksum in the header is wrong: a byte was changed.
    Checksum {
        /// Checksum in the header.
        said: u32,
        /// Checksum of the bytes.
        computed: u32,
    },
    /// The model file has more items of a kind than the limit.
    TooMany {
        /// The kind of item.
        what: &'static str,
        /// How many items the model file has.
        count: usize,
        /// How many items are allowed.
        most: usize,
    },
    /// The counts in the header do not match the length of the model file.
    Parts {
        /// Bytes that the counted parts need.
        parts: usize,
        /// Length of the model file.
        actual: usize,
    },
    /// The texture is not legal.
    Texture(TextureError),
    /// This entry of the palette has a part that does not fit 6 bits.
    Colour(usize),
    /// This vertex is too far from the origin.
    Vertex(usize),
    /// A corner refers to a vertex that does not exist.
    CornerVertex {
        /// The corner.
        corner: usize,
        /// The vertex that it refers to.
        vertex: u16,
        /// Vertices that exist.
        vertices: usize,
    },
    /// The texture coordinates of this corner are outside the texture.
    CornerPlace(usize),
    /// This face has too few or too many corners.
    FaceCorners(usize),
    /// This face's normal is not a unit vector.
    FaceNormal(usize),
    /// The faces' counts of corners do not add up to the corners of the model file.
    Shared {
        /// Corners that the faces use.
        used: usize,
        /// Corners that the model file has.
        there: usize,
    },
}

impl From<TextureError> for ModelError {
    fn from(error: TextureError) -> Self {
        Self::Texture(error)
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotAModelFile => f.write_str("it does not begin as a model file"),
            Self::Short(len) => write!(f, "{len} bytes are too few for a model file"),
            Self::TooLong(len) => {
                write!(
                    f,
                    "it has {len} bytes; a model file has at most {MAX_BYTES}"
                )
            }
            Self::Version(version) => write!(
                f,
                "it is a model file of version {version}; this program reads version {VERSION}"
            ),
            Self::Length { said, actual } => {
                write!(f, "its header says {said} bytes, and it has {actual}")
            }
            Self::Checksum { said, computed } => write!(
                f,
                "its header says checksum {said:08x}, its bytes have {computed:08x}"
            ),
            Self::TooMany { what, count, most } => {
                write!(f, "it has {count} {what}; there is room for {most}")
            }
            Self::Parts { parts, actual } => write!(
                f,
                "what its header counts takes {parts} bytes, and it has {actual}"
            ),
            Self::Texture(error) => write!(f, "{error}"),
            Self::Colour(i) => write!(f, "colour {i} has a part above 63"),
            Self::Vertex(i) => write!(f, "vertex {i} is outside +-{MAX_EXTENT}"),
            Self::CornerVertex {
                corner,
                vertex,
                vertices,
            } => write!(
                f,
                "corner {corner} refers to vertex {vertex}, but the mesh has {vertices} vertices"
            ),
            Self::CornerPlace(i) => write!(f, "corner {i} is outside the texture"),
            Self::FaceCorners(i) => {
                write!(
                    f,
                    "face {i} has fewer than 3 or more than {MAX_CORNERS} corners"
                )
            }
            Self::FaceNormal(i) => write!(f, "the normal of face {i} is no unit vector"),
            Self::Shared { used, there } => {
                write!(f, "its faces take {used} corners, and it has {there}")
            }
        }
    }
}

impl core::error::Error for ModelError {}
