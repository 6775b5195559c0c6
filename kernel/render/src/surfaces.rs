//! The surface cache: a scene's textures with a copy for each light level and mipmap.
//!
//! Light in the mapper would cost a second look-up for every pixel. A face has one light level, so each
//! texture is run through the light table once per level when the scene is set, and a face uses the copy for
//! its level. The mapper's loop needs no light.

use modex::Palette;
use scene::{LIGHT_LEVELS, MATERIALS, Scene};
use texmap::{Texture, Vertex};

use crate::period::half_period;

/// Room for a scene's textures, padded, with a copy for each light level: one texture of the largest size.
pub const SURFACE_BYTES: usize = 3 << 19;
/// Most surfaces of a scene: each texture, and each of its mipmaps, is one.
const MAX_SURFACES: usize = 16;
/// Mipmaps of a texture: the texture itself, and copies down to 1/64 of its sides.
const MIPMAPS: usize = 7;

/// The place of a texture's lit copies, which follow each other: one for each light level.
#[derive(Clone, Copy, Debug, Default)]
struct Surface {
    first: usize,
    width: u16,
    height: u16,
    /// Columns and rows of the tile, if the texture is tiled.
    tile: Option<(u16, u16)>,
}

impl Surface {
    /// Returns the copy for a light level.
    fn lit<'t>(&self, level: usize, texels: &'t [u8; SURFACE_BYTES]) -> Texture<'t> {
        let (width, height) = (self.width, self.height);
        let len = self.texels();
        let texels = &texels[self.first + level * len..][..len];
        let texture = match self.tile {
            Some(tile) => Texture::tiled(texels, tile, width, height),
            None => Texture::padded(texels, width, height),
        };
        texture.expect("a lit copy has the sides of its texture")
    }

    /// Returns the number of texels of one copy, padding included.
    fn texels(&self) -> usize {
        let (width, height) = self.sides();
        Texture::padded_len(width, height)
    }

    /// Returns the numbers of texels stored across and down: the tile's, or the texture's.
    fn sides(&self) -> (u16, u16) {
        self.tile.unwrap_or((self.width, self.height))
    }

    /// Returns the texture with each side halved `times` times; a side is at least one texel.
    fn halved(self, times: usize) -> Self {
        let part = |side: u16| (side >> times).max(1);
        Self {
            width: part(self.width),
            height: part(self.height),
            tile: self.tile.map(|(width, height)| (part(width), part(height))),
            ..self
        }
    }
}

/// The surfaces of a scene.
#[derive(Debug)]
pub(crate) struct Surfaces<'a> {
    all: [Surface; MAX_SURFACES],
    /// Mipmaps of each texture of the scene.
    mipmaps: usize,
    /// Half the shortest period of the textures, 16.16 texels.
    half_period: Option<u32>,
    texels: &'a mut [u8; SURFACE_BYTES],
}

impl<'a> Surfaces<'a> {
    /// Returns the surfaces of a scene without textures.
    pub fn new(texels: &'a mut [u8; SURFACE_BYTES]) -> Self {
        Self {
            all: [Surface::default(); MAX_SURFACES],
            mipmaps: 1,
            half_period: None,
            texels,
        }
    }

    /// Replaces the surfaces with those of `scene`.
    ///
    /// # Panics
    /// If the scene has more than [`MAX_SURFACES`] surfaces, or the copies need more than [`SURFACE_BYTES`].
    pub fn set(&mut self, scene: &Scene<'_, '_>) {
        self.mipmaps = if scene.mipmaps { MIPMAPS } else { 1 };
        let count = scene.textures.len() * self.mipmaps;
        assert!(
            count <= MAX_SURFACES,
            "{}: the textures and their mipmaps are {count}; at most {MAX_SURFACES} fit",
            scene.name
        );
        self.all = [Surface::default(); MAX_SURFACES];
        let mut free = 0;
        for (texture, mipmaps) in scene.textures.iter().zip(self.all.chunks_mut(self.mipmaps)) {
            let whole = Surface {
                first: 0,
                width: texture.width(),
                height: texture.height(),
                tile: texture.tile(),
            };
            for (mip, surface) in mipmaps.iter_mut().enumerate() {
                *surface = Surface {
                    first: free,
                    ..whole.halved(mip)
                };
                let len = surface.texels();
                let lit = self
                    .texels
                    .get_mut(free..free + len * LIGHT_LEVELS)
                    .expect("the scene's textures are larger than the surface cache");
                free += lit.len();
                let (columns, rows) = surface.sides();
                let pitch = usize::from(columns).next_power_of_two();
                let block = (whole.sides().0 / columns, whole.sides().1 / rows);
                for j in 0..rows {
                    for i in 0..columns {
                        let texel = match mip {
                            0 => texture.at(i32::from(i) << 16, i32::from(j) << 16),
                            _ => mean(texture, (i, j), block, scene.palette),
                        };
                        let place = usize::from(j) * pitch + usize::from(i);
                        let copies = lit.chunks_exact_mut(len);
                        for (copy, light) in copies.zip(scene.light) {
                            copy[place] = light[usize::from(texel)];
                        }
                    }
                }
            }
        }
        let half_periods = scene.textures.iter();
        self.half_period = half_periods
            .filter_map(|texture| half_period(texture, scene.palette))
            .min();
    }

    /// Returns the mipmap that a polygon uses.
    pub fn mipmap(&self, polygon: &[Vertex]) -> usize {
        match self.mipmaps {
            1 => 0,
            mipmaps => mipmap(polygon, mipmaps),
        }
    }

    /// Returns the number of a texture's lit copy.
    pub fn number(&self, texture: u16, mip: usize, level: usize) -> u16 {
        ((usize::from(texture) * self.mipmaps + mip) * LIGHT_LEVELS + level) as u16
    }

    /// Returns the lit copy with a number.
    pub fn texture(&self, number: u16) -> Texture<'_> {
        let number = usize::from(number);
        self.all[number / LIGHT_LEVELS].lit(number % LIGHT_LEVELS, self.texels)
    }

    /// Returns every lit copy, by number.
    ///
    /// The renderer calls this for each frame, at 1 to 5 us: the copies borrow the cache, so it cannot keep
    /// both. A look-up for each job would cost more, at 13 ns and thousands of jobs.
    pub fn textures(&self) -> [Texture<'_>; MAX_SURFACES * LIGHT_LEVELS] {
        let mut textures = [Texture::DOT; MAX_SURFACES * LIGHT_LEVELS];
        let lit = textures.chunks_exact_mut(LIGHT_LEVELS);
        for (surface, lit) in self
            .all
            .iter()
            .zip(lit)
            .filter(|(surface, _)| surface.width > 0)
        {
            for (level, lit) in lit.iter_mut().enumerate() {
                *lit = surface.lit(level, self.texels);
            }
        }
        textures
    }

    /// Returns half the shortest period of the textures, 16.16 texels, or `None` if no texture has two
    /// colours.
    pub fn half_period(&self) -> Option<u32> {
        self.half_period
    }
}

/// Returns the colour nearest to the mean of a block of `size` texels. `place` is the block's column and row,
/// counted in blocks. The result is a material's colour, which light can change.
fn mean(texture: &Texture<'_>, place: (u16, u16), size: (u16, u16), palette: &Palette) -> u8 {
    let mut sum = [0; 3];
    for j in 0..size.1 {
        for i in 0..size.0 {
            let [column, row] =
                [place.0 * size.0 + i, place.1 * size.1 + j].map(|at| i32::from(at) << 16);
            let colour = palette[usize::from(texture.at(column, row))];
            for (sum, part) in sum.iter_mut().zip(colour) {
                *sum += i32::from(part);
            }
        }
    }
    // At most 2^16 texels of 2^6 each, with 4 fraction bits.
    let count = i32::from(size.0) * i32::from(size.1);
    let mean = sum.map(|sum| sum * 16 / count);
    let distance = |entry: &usize| -> i32 {
        let off = |k: usize| mean[k] - 16 * i32::from(palette[*entry][k]);
        (0..3).map(|k| off(k).pow(2)).sum()
    };
    MATERIALS.min_by_key(distance).unwrap_or(0) as u8
}

/// Returns the mipmap, of `mipmaps`, that a polygon uses. Along the side with the most texels to a pixel, a
/// pixel covers one texel of that mipmap, within a factor of the square root of two.
///
/// A larger mipmap would show a moire pattern along that side; across it, this mipmap is smoother than
/// necessary.
fn mipmap(polygon: &[Vertex], mipmaps: usize) -> usize {
    let mut mip = 0;
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        // In 1/256 texel, below 2^17, and 1/256 pixel, below 2^25. A side shorter than a pixel counts as one
        // pixel: no detail is visible there.
        let square = |x: i32, y: i32| i64::from(x).pow(2) + i64::from(y).pow(2);
        let texels = square((b.u - a.u) >> 8, (b.v - a.v) >> 8);
        let pixels = square(b.x - a.x, b.y - a.y).max(1 << 16);
        while mip + 1 < mipmaps && i128::from(texels) > i128::from(pixels) << (2 * mip + 1) {
            mip += 1;
        }
    }
    mip
}
