//! Why bytes are no pack.

use core::fmt;

use scene::{MAX_CORNERS, MAX_EXTENT};
use texmap::TextureError;

use crate::{MAX_BYTES, VERSION};

/// Why bytes are no pack that can be shown. Things are numbered from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackError {
    /// They do not begin with [`crate::MAGIC`].
    NoPack,
    /// So many bytes: fewer than a header has.
    Short(usize),
    /// So many bytes: more than [`MAX_BYTES`].
    TooLong(usize),
    /// Another version of the format.
    Version(u32),
    /// There are other than the header says.
    Length {
        /// Bytes by the header.
        said: u32,
        /// Bytes that there are.
        actual: usize,
    },
    /// A byte was changed.
    Checksum {
        /// What the header says.
        said: u32,
        /// What the bytes give.
        computed: u32,
    },
    /// More of something than there is room for.
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many.
        count: usize,
        /// How many there may be.
        most: usize,
    },
    /// What the header counts takes another number of bytes.
    Parts {
        /// Bytes that it takes.
        parts: usize,
        /// Bytes that there are.
        actual: usize,
    },
    /// The texture can't be one.
    Texture(TextureError),
    /// This entry of the palette has a part that no 6 bits hold.
    Colour(usize),
    /// This vertex is too far out.
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
    /// This corner is outside of the texture.
    CornerPlace(usize),
    /// This face has too few or too many corners.
    FaceCorners(usize),
    /// This face's normal is no unit vector.
    FaceNormal(usize),
    /// The faces take another number of corners.
    Shared {
        /// Corners that they take.
        used: usize,
        /// Corners that there are.
        there: usize,
    },
}

impl From<TextureError> for PackError {
    fn from(error: TextureError) -> Self {
        Self::Texture(error)
    }
}

impl fmt::Display for PackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPack => f.write_str("it does not begin as a pack"),
            Self::Short(len) => write!(f, "{len} bytes are too few for a pack"),
            Self::TooLong(len) => {
                write!(f, "it has {len} bytes; a pack has at most {MAX_BYTES}")
            }
            Self::Version(version) => write!(
                f,
                "it is a pack of version {version}; this program reads version {VERSION}"
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

impl core::error::Error for PackError {}
