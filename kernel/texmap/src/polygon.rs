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
///
/// The rows lie `pitch` texels apart. In a *padded* texture the pitch and the number of rows are
/// powers of two: an index put together from masked coordinates can't leave it. A *tiled* one is a
/// rectangle laid out of one tile, of which alone there are texels: whatever is said of coordinates
/// in a texture is said of the rectangle, and only the index wraps around.
#[derive(Clone, Copy, Debug)]
pub struct Texture<'a> {
    texels: &'a [u8],
    /// See [`Texture::last`].
    last: (i32, i32),
    pitch: u16,
    is_padded: bool,
    /// See [`Texture::masks`].
    masks: u64,
    /// Those bits of a column's number and of a row's that are the tile's.
    wrap: (u16, u16),
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
    /// The slice does not hold as many texels.
    Length {
        /// What the texture has.
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
        last: (0xFFFF, 0xFFFF),
        pitch: 1,
        is_padded: true,
        masks: 0,
        wrap: Self::WHOLE,
    };
    /// What [`Texture::wrap`] is where nothing wraps.
    const WHOLE: (u16, u16) = (u16::MAX, u16::MAX);

    /// A texture of `width` x `height` texels.
    ///
    /// # Errors
    /// A side outside 1 to 256, or a slice of another length.
    pub fn new(texels: &'a [u8], width: u16, height: u16) -> Result<Self, TextureError> {
        Self::with_rows(texels, width, height, width, height)
    }

    /// A padded texture of `width` x `height` texels: `texels` has [`Texture::padded_len`] of them,
    /// in rows of the next power of two. What lies beyond `width` or `height` is never drawn.
    ///
    /// # Errors
    /// A side outside 1 to 256, or a slice of another length.
    pub fn padded(texels: &'a [u8], width: u16, height: u16) -> Result<Self, TextureError> {
        let [pitch, rows] = [width, height].map(|k| k.min(Self::MAX_SIDE).next_power_of_two());
        Self::with_rows(texels, width, height, pitch, rows)
    }

    /// A texture of `width` x `height` texels, laid out of a tile of `tile.0` x `tile.1`, whose
    /// `texels` are given. The tile's sides are powers of two.
    ///
    /// # Errors
    /// A side outside 1 to 256, or a slice of another length.
    ///
    /// # Panics
    /// If a side of the tile is no power of two.
    pub fn tiled(
        texels: &'a [u8],
        tile: (u16, u16),
        width: u16,
        height: u16,
    ) -> Result<Self, TextureError> {
        assert!(
            tile.0.is_power_of_two() && tile.1.is_power_of_two(),
            "a tile of {} x {} texels does not wrap by masks",
            tile.0,
            tile.1
        );
        Ok(Self {
            wrap: (tile.0 - 1, tile.1 - 1),
            ..Self::with_rows(texels, width, height, tile.0, tile.1)?
        })
    }

    /// The sides of the tile that a tiled texture is laid out of.
    pub fn tile(&self) -> Option<(u16, u16)> {
        let (column, row) = self.wrap;
        (self.wrap != Self::WHOLE).then(|| (column + 1, row + 1))
    }

    /// Texels of a padded texture.
    pub fn padded_len(width: u16, height: u16) -> usize {
        let [pitch, rows] = [width, height].map(|k| usize::from(k).next_power_of_two());
        pitch * rows
    }

    fn with_rows(
        texels: &'a [u8],
        width: u16,
        height: u16,
        pitch: u16,
        rows: u16,
    ) -> Result<Self, TextureError> {
        let sides = 1..=Self::MAX_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(TextureError::Size { width, height });
        }
        let (expected, actual) = (usize::from(pitch) * usize::from(rows), texels.len());
        if expected != actual {
            return Err(TextureError::Length { expected, actual });
        }
        Ok(Self {
            texels,
            last: ((i32::from(width) << 16) - 1, (i32::from(height) << 16) - 1),
            pitch,
            is_padded: pitch.is_power_of_two() && actual.is_power_of_two(),
            masks: ((actual as u64 - u64::from(pitch)) << 32 | u64::from(pitch - 1)) << 16,
            wrap: Self::WHOLE,
        })
    }

    /// Texels from a row to the next.
    pub fn pitch(&self) -> u16 {
        self.pitch
    }

    /// In a padded texture, the bits of a column's number and of a row's.
    pub fn bits(&self) -> Option<(u32, u32)> {
        let columns = self.pitch.trailing_zeros();
        self.is_padded
            .then(|| (columns, self.texels.len().trailing_zeros() - columns))
    }

    /// In a padded texture, which bits of coordinates make the index: the column's are bits 16 and
    /// up of u; the row's go on from them, 32 bits higher, in v times the pitch.
    ///
    /// Asked for every column, and therefore made with the texture.
    #[inline]
    pub(crate) fn masks(&self) -> Option<u64> {
        self.is_padded.then_some(self.masks)
    }

    /// The texel at coordinates inside the texture, 16.16.
    #[inline]
    pub fn at(&self, u: i32, v: i32) -> u8 {
        self.texel((u >> 16) as usize, (v >> 16) as usize)
    }

    /// The texel in a column and a row of the texture.
    #[inline(always)]
    pub(crate) fn texel(&self, column: usize, row: usize) -> u8 {
        let (wrap_column, wrap_row) = self.wrap;
        let row = row & usize::from(wrap_row);
        self.texels[row * usize::from(self.pitch) + (column & usize::from(wrap_column))]
    }

    /// The texels, row by row, `pitch` apart; of a tiled texture the tile's.
    pub fn texels(&self) -> &'a [u8] {
        self.texels
    }

    /// Texels across, 1 to 256.
    pub fn width(&self) -> u16 {
        (self.last.0 >> 16) as u16 + 1
    }

    /// Texels down, 1 to 256.
    pub fn height(&self) -> u16 {
        (self.last.1 >> 16) as u16 + 1
    }

    /// The last coordinate inside, 16.16: the last texel owns the far border, so u = width
    /// reads texel width - 1.
    #[inline]
    pub fn last(&self) -> (i32, i32) {
        self.last
    }
}
