//! What goes into the mapper: vertices and textures.

use core::fmt;

/// Positions are whole multiples of 1/256 pixel.
pub const SUBPIXELS: i32 = 256;
/// Largest x or y of a vertex, either sign: 32 767 pixels. Within it every product of the scan
/// fits 64 bits.
pub const MAX_COORDINATE: i32 = 32_767 * SUBPIXELS;
/// Most sides of a polygon.
pub const MAX_SIDES: usize = 16;

/// A place on the screen. Pixel (x, y) has its centre at (256 x + 128, 256 y + 128).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Point {
    /// Right, in 1/256 pixel, within +-[`MAX_COORDINATE`].
    pub x: i32,
    /// Down, in 1/256 pixel, within +-[`MAX_COORDINATE`].
    pub y: i32,
}

impl From<Vertex> for Point {
    fn from(vertex: Vertex) -> Self {
        Self {
            x: vertex.x,
            y: vertex.y,
        }
    }
}

/// A corner of a polygon on the screen, placed as a [`Point`], and in its texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Vertex {
    /// Right, in 1/256 pixel, within +-[`MAX_COORDINATE`].
    pub x: i32,
    /// Down, in 1/256 pixel, within +-[`MAX_COORDINATE`].
    pub y: i32,
    /// Across the texture, 16.16 texels, 0 to its width.
    pub u: i32,
    /// Down the texture, 16.16 texels, 0 to its height.
    pub v: i32,
}

/// A rectangle of texels, row by row. Texel (i, j) covers [i, i + 1) x [j, j + 1).
#[derive(Clone, Copy, Debug)]
pub struct Texture<'a> {
    texels: &'a [u8],
    width: u16,
    height: u16,
}

/// Why a texture can't be one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureError {
    /// A side is not 1 to 256 texels.
    Size {
        /// Texels across.
        width: u16,
        /// Texels down.
        height: u16,
    },
    /// The slice does not hold width x height texels.
    Length {
        /// width x height.
        expected: usize,
        /// The slice's length.
        actual: usize,
    },
}

impl fmt::Display for TextureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { width, height } => {
                write!(
                    f,
                    "a texture of {width} x {height} texels; each side is 1 to 256"
                )
            }
            Self::Length { expected, actual } => {
                write!(f, "{actual} texels for a texture that has {expected}")
            }
        }
    }
}

impl core::error::Error for TextureError {}

impl<'a> Texture<'a> {
    /// Longest side in texels.
    pub const MAX_SIDE: u16 = 256;
    /// The smallest texture: one texel of colour 0.
    pub const DOT: Texture<'static> = Texture {
        texels: &[0],
        width: 1,
        height: 1,
    };

    /// A texture of `width` x `height` texels.
    ///
    /// # Errors
    /// A side outside 1 to 256, or a slice of another length.
    pub fn new(texels: &'a [u8], width: u16, height: u16) -> Result<Self, TextureError> {
        let sides = 1..=Self::MAX_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(TextureError::Size { width, height });
        }
        let (expected, actual) = (usize::from(width) * usize::from(height), texels.len());
        if expected != actual {
            return Err(TextureError::Length { expected, actual });
        }
        Ok(Self {
            texels,
            width,
            height,
        })
    }

    /// The texels, row by row.
    pub fn texels(&self) -> &'a [u8] {
        self.texels
    }

    /// Texels across, 1 to 256.
    pub fn width(&self) -> u16 {
        self.width
    }

    /// Texels down, 1 to 256.
    pub fn height(&self) -> u16 {
        self.height
    }

    /// The last coordinate inside, 16.16: the last texel owns the far border, so u = width
    /// reads texel width - 1.
    pub fn last(&self) -> (i32, i32) {
        (
            (i32::from(self.width) << 16) - 1,
            (i32::from(self.height) << 16) - 1,
        )
    }
}
