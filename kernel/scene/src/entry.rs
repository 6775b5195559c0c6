//! A scene with its name: mesh, textures, colours, background and default poses.
//!
//! A loaded model is an [`Entry`] as well, so the code that draws scenes does not have to know which scenes
//! are built in.

use core::ops::Deref;

use modex::{HEIGHT, Palette};
use texmap::Texture;

use crate::colour::{LIGHT_TABLE, PALETTE};
use crate::{LightTable, Mesh, Pose};

/// A mesh with its textures, colours and background.
///
/// `'t` is the textures' lifetime. The renderer makes its own lit copies, so the textures need not outlive
/// its set-up.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a, 't> {
    /// Name, for people.
    pub name: &'static str,
    /// The solid, about the origin.
    pub mesh: Mesh<'a>,
    /// Textures in full light.
    pub textures: &'t [Texture<'t>],
    /// The DAC's colours.
    pub palette: &'a Palette,
    /// The colour that each colour becomes at each light level.
    pub light: &'t LightTable,
    /// The colour of each scan line where no solid covers it.
    pub background: &'a [u8; HEIGHT],
    /// Whether the textures need smaller copies for distant faces. If so, the sides of the textures, or of
    /// their tiles, are powers of two.
    pub mipmaps: bool,
}

/// Texels of the largest painted texture: the memory that [`Entry::paint`] borrows.
pub const MAX_TEXELS: usize = 256 * 256;

/// A scene with its name.
#[derive(Clone, Copy, Debug)]
pub struct Entry<'a> {
    /// Its name: small letters, digits and hyphens.
    pub name: &'static str,
    /// A one-line description, for people.
    pub about: &'static str,
    pub(crate) mesh: Mesh<'a>,
    pub(crate) colours: Colours<'a>,
    pub(crate) background: &'a [u8; HEIGHT],
    pub(crate) cover: Cover<'a>,
    pub(crate) mipmaps: bool,
    pub(crate) pose: fn(u32) -> Pose,
    /// The change of distance after which the scene looks the same again, 16.16 units; 0 if it never does.
    pub(crate) tile: i32,
}

/// The DAC's colours, and their lit versions.
#[derive(Clone, Copy, Debug)]
pub struct Colours<'a> {
    /// The DAC's colours.
    pub palette: &'a Palette,
    /// The colour of each texel at each light level.
    pub light: &'a LightTable,
}

impl Colours<'static> {
    /// The colours of the built-in scenes.
    pub const BUILT_IN: Self = Self {
        palette: &PALETTE,
        light: &LIGHT_TABLE,
    };
}

/// Most textures of an entry.
const MAX_TEXTURES: usize = 2;

/// An entry's textures.
#[derive(Clone, Copy, Debug)]
pub struct Textures<'t> {
    all: [Texture<'t>; MAX_TEXTURES],
    len: usize,
}

impl<'t> Deref for Textures<'t> {
    type Target = [Texture<'t>];

    fn deref(&self) -> &Self::Target {
        &self.all[..self.len]
    }
}

impl<'t> From<Texture<'t>> for Textures<'t> {
    fn from(texture: Texture<'t>) -> Self {
        Self {
            all: [texture; MAX_TEXTURES],
            len: 1,
        }
    }
}

impl<'t> From<[Texture<'t>; MAX_TEXTURES]> for Textures<'t> {
    fn from(all: [Texture<'t>; MAX_TEXTURES]) -> Self {
        Self {
            all,
            len: MAX_TEXTURES,
        }
    }
}

/// The source of an entry's textures.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Cover<'a> {
    /// Painted by code.
    Painted(for<'m> fn(&'m mut [u8; MAX_TEXELS]) -> Textures<'m>),
    /// Loaded with the model.
    Loaded(Texture<'a>),
}

impl<'a> Entry<'a> {
    /// The name of a loaded model; no built-in scene has it.
    pub const LOADED: &'static str = "model";

    /// Returns an entry for a loaded model, which turns as the ball does.
    pub fn loaded(
        mesh: Mesh<'a>,
        texture: Texture<'a>,
        colours: Colours<'a>,
        background: &'a [u8; HEIGHT],
    ) -> Self {
        Self {
            name: Self::LOADED,
            about: "the model that was loaded with the image",
            mesh,
            colours,
            background,
            cover: Cover::Loaded(texture),
            mipmaps: false,
            pose: Pose::at_tick,
            tile: 0,
        }
    }

    /// Returns the textures in full light; `texels` holds the texels of painted textures.
    pub fn paint<'m>(&self, texels: &'m mut [u8; MAX_TEXELS]) -> Textures<'m>
    where
        'a: 'm,
    {
        match self.cover {
            Cover::Painted(paint) => paint(texels),
            Cover::Loaded(texture) => texture.into(),
        }
    }

    /// Returns the scene. `textures` are those that [`Entry::paint`] returned.
    pub fn scene<'t>(&self, textures: &'t [Texture<'t>]) -> Scene<'a, 't>
    where
        'a: 't,
    {
        Scene {
            name: self.name,
            mesh: self.mesh,
            textures,
            palette: self.colours.palette,
            light: self.colours.light,
            background: self.background,
            mipmaps: self.mipmaps,
        }
    }

    /// Returns the default pose at a tick: frame N of the scene is its pose at tick N.
    pub fn pose(&self, tick: u32) -> Pose {
        (self.pose)(tick)
    }

    /// Returns a pose that looks as `next` does, at the distance nearest to that of `pose`.
    ///
    /// A motion along tiles jumps from the end of a tile back to its start. The two frames do not show the
    /// jump, but the distance from one pose to the next would.
    pub fn following(&self, pose: &Pose, next: Pose) -> Pose {
        if self.tile == 0 {
            return next;
        }
        let leap = next.distance - pose.distance;
        let tiles = (leap + self.tile / 2).div_euclid(self.tile);
        let distance = (next.distance - tiles * self.tile).clamp(0, Pose::MAX_DISTANCE);
        Pose { distance, ..next }
    }
}
