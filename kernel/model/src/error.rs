//! Why bytes are not a legal model file.

use core::fmt;

use scene::{MAX_CORNERS, MAX_EXTENT};
use texmap::TextureError;

use crate::{MAX_BYTES, VERSION};

/// The reason why bytes are not a model file that can be shown. Vertices, corners, faces and colours are
/// numbered from 0.
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
        /// Length that the header states.
        stated: u32,
        /// Length of the model file.
        actual: usize,
    },
    /// The checksum in the header is wrong: a byte was changed.
    Checksum {
        /// Checksum that the header states.
        stated: u32,
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
    /// This entry of the palette has a component that does not fit 6 bits.
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
    CornerTexture(usize),
    /// This face has too few or too many corners.
    FaceCorners(usize),
    /// This face's normal is not a unit vector.
    FaceNormal(usize),
    /// The faces' counts of corners do not add up to the corners of the model file.
    CornerCount {
        /// Corners that the faces use.
        used: usize,
        /// Corners that the model file has.
        present: usize,
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
            Self::NotAModelFile => f.write_str("the file does not begin as a model file"),
            Self::Short(len) => write!(f, "{len} bytes are too few for a model file"),
            Self::TooLong(len) => {
                write!(
                    f,
                    "the file has {len} bytes; a model file has at most {MAX_BYTES}"
                )
            }
            Self::Version(version) => write!(
                f,
                "the file has version {version} of the format; this program reads version {VERSION}"
            ),
            Self::Length { stated, actual } => {
                write!(
                    f,
                    "the header states {stated} bytes, but the file has {actual}"
                )
            }
            Self::Checksum { stated, computed } => write!(
                f,
                "the header states checksum {stated:08x}, but the bytes have {computed:08x}"
            ),
            Self::TooMany { what, count, most } => {
                write!(f, "the file has {count} {what}; at most {most} are allowed")
            }
            Self::Parts { parts, actual } => write!(
                f,
                "the counts in the header need {parts} bytes, but the file has {actual}"
            ),
            Self::Texture(error) => write!(f, "{error}"),
            Self::Colour(i) => write!(f, "colour {i} has a component above 63"),
            Self::Vertex(i) => write!(f, "vertex {i} is outside +-{MAX_EXTENT}"),
            Self::CornerVertex {
                corner,
                vertex,
                vertices,
            } => write!(
                f,
                "corner {corner} refers to vertex {vertex}, but the mesh has {vertices} vertices"
            ),
            Self::CornerTexture(i) => write!(f, "corner {i} is outside the texture"),
            Self::FaceCorners(i) => {
                write!(
                    f,
                    "face {i} has fewer than 3 or more than {MAX_CORNERS} corners"
                )
            }
            Self::FaceNormal(i) => write!(f, "the normal of face {i} is not a unit vector"),
            Self::CornerCount { used, present } => {
                write!(
                    f,
                    "the faces use {used} corners, but the file has {present}"
                )
            }
        }
    }
}

impl core::error::Error for ModelError {}
