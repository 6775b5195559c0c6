//! Textures: rectangles of texels, and the reasons why texels do not make one.

use core::fmt;

/// A rectangle of texels, row by row. Texel (i, j) covers [i, i + 1) x [j, j + 1).
///
/// The rows lie `pitch` texels apart. In a *padded* texture the pitch and the number of rows are powers of
/// two, so an index made of masked coordinates cannot leave the texture. A *tiled* texture is a rectangle
/// that repeats one tile, and only the tile's texels are stored. Every statement about coordinates in a
/// texture refers to the rectangle; only the index wraps around.
#[derive(Clone, Copy, Debug)]
pub struct Texture<'a> {
    texels: &'a [u8],
    /// See [`Texture::last`].
    last: (i32, i32),
    pitch: u16,
    is_padded: bool,
    /// See [`Texture::masks`].
    masks: u64,
    /// Masks that keep the tile's bits of a column's number and of a row's number.
    wrap: (u16, u16),
}

/// The reason why texels and sides do not make a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureError {
    /// A side is not 1 to 256 texels.
    Size {
        /// Texels across.
        width: u16,
        /// Texels down.
        height: u16,
    },
    /// The slice's length is not the texture's number of texels.
    Length {
        /// The texture's number of texels.
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
    /// The value of [`Texture::wrap`] when nothing wraps.
    const WHOLE: (u16, u16) = (u16::MAX, u16::MAX);

    /// Returns a texture of `width` x `height` texels.
    ///
    /// # Errors
    /// If a side is outside 1 to 256, or the slice has another length.
    pub fn new(texels: &'a [u8], width: u16, height: u16) -> Result<Self, TextureError> {
        Self::with_rows(texels, width, height, width, height)
    }

    /// Returns a padded texture of `width` x `height` texels. `texels` has [`Texture::padded_len`] texels, in
    /// rows of the next power of two. Texels beyond `width` or `height` are never drawn.
    ///
    /// # Errors
    /// If a side is outside 1 to 256, or the slice has another length.
    pub fn padded(texels: &'a [u8], width: u16, height: u16) -> Result<Self, TextureError> {
        let [pitch, rows] = [width, height].map(|k| k.min(Self::MAX_SIDE).next_power_of_two());
        Self::with_rows(texels, width, height, pitch, rows)
    }

    /// Returns a texture of `width` x `height` texels that repeats a tile of `tile.0` x `tile.1` texels;
    /// `texels` has the tile's. The tile's sides must be powers of two.
    ///
    /// # Errors
    /// If a side is outside 1 to 256, or the slice has another length.
    ///
    /// # Panics
    /// If a side of the tile is not a power of two.
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

    /// Returns the sides of a tiled texture's tile, or nothing for other textures.
    pub fn tile(&self) -> Option<(u16, u16)> {
        let (column, row) = self.wrap;
        (self.wrap != Self::WHOLE).then(|| (column + 1, row + 1))
    }

    /// Returns the number of texels of a padded texture, with its padding.
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

    /// Returns the distance from a row to the next, in texels.
    pub fn pitch(&self) -> u16 {
        self.pitch
    }

    /// Returns the bits of a column's number and of a row's in a padded texture, or nothing for other
    /// textures.
    pub fn bits(&self) -> Option<(u32, u32)> {
        let columns = self.pitch.trailing_zeros();
        self.is_padded
            .then(|| (columns, self.texels.len().trailing_zeros() - columns))
    }

    /// Returns a mask of the coordinates' bits that make the index in a padded texture. The column's bits are
    /// bits 16 and up of u. The row's bits continue them, 32 bits higher, in v times the pitch.
    ///
    /// Every column needs the mask, so it is computed once, with the texture.
    #[inline]
    pub(crate) fn masks(&self) -> Option<u64> {
        self.is_padded.then_some(self.masks)
    }

    /// Returns the texel at coordinates inside the texture, 16.16.
    #[inline]
    pub fn at(&self, u: i32, v: i32) -> u8 {
        self.texel((u >> 16) as usize, (v >> 16) as usize)
    }

    /// Returns the texel in a column and a row of the texture.
    #[inline(always)]
    pub(crate) fn texel(&self, column: usize, row: usize) -> u8 {
        self.texels[self.index(column, row)]
    }

    /// Returns the index in [`Texture::texels`] of the texel in a column and a row of the texture.
    #[inline(always)]
    pub(crate) fn index(&self, column: usize, row: usize) -> usize {
        let (wrap_column, wrap_row) = self.wrap;
        let row = row & usize::from(wrap_row);
        row * usize::from(self.pitch) + (column & usize::from(wrap_column))
    }

    /// Returns the masks of a column's number and of a row's number, which lead to the stored texel.
    #[inline]
    pub(crate) fn wrap(&self) -> (u16, u16) {
        self.wrap
    }

    /// Returns the texels, in rows that lie `pitch` apart; in a tiled texture, the tile's texels.
    pub fn texels(&self) -> &'a [u8] {
        self.texels
    }

    /// Returns the number of texels across, 1 to 256.
    pub fn width(&self) -> u16 {
        (self.last.0 >> 16) as u16 + 1
    }

    /// Returns the number of texels down, 1 to 256.
    pub fn height(&self) -> u16 {
        (self.last.1 >> 16) as u16 + 1
    }

    /// Returns the last coordinates inside the texture, 16.16. The last texel owns the far border, so
    /// u = width reads texel width - 1.
    #[inline]
    pub fn last(&self) -> (i32, i32) {
        self.last
    }
}
