//! A scene by name: its mesh, textures, colours, background and default poses.
//!
//! A loaded model is an [`Entry`] as well, so the code that shows scenes does not have to know which scenes are
//! built in.

use core::ops::Deref;

use modex::{HEIGHT, Palette};
use texmap::Texture;

use crate::colour::{LIGHT_TABLE, PALETTE};
use crate::{LightTable, Mesh, Pose, Scene};

/// Texels of the largest painted texture: the memory that [`Entry::paint`] borrows.
pub const MAX_TEXELS: usize = 256 * 256;

/// A scene by name.
#[derive(Clone, Copy, Debug)]
pub struct Entry<'a> {
    /// Its name: small letters, digits and hyphens.
    pub name: &'static str,
    /// A line about it, for people.
    pub about: &'static str,
    pub(crate) mesh: Mesh<'a>,
    pub(crate) colours: Colours<'a>,
    pub(crate) background: &'a [u8; HEIGHT],
    pub(crate) cover: Cover<'a>,
    pub(crate) mipmaps: bool,
    pub(crate) pose: fn(u32) -> Pose,
    /// By how much nearer all looks the same again, 16.16 units; 0 if it does not.
    pub(crate) tile: i32,
}

/// The DAC's colours, and what they become in the light.
#[derive(Clone, Copy, Debug)]
pub struct Colours<'a> {
    /// The DAC's colours.
    pub palette: &'a Palette,
    /// What a texel becomes at a light level.
    pub light: &'a LightTable,
}

impl Colours<'static> {
    /// Of all that is built in.
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

/// Where an entry's textures come from.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Cover<'a> {
    /// They are painted by code.
    Painted(for<'m> fn(&'m mut [u8; MAX_TEXELS]) -> Textures<'m>),
    /// It is there.
    Loaded(Texture<'a>),
}

impl<'a> Entry<'a> {
    /// The name of a solid that was loaded; no built-in scene has it.
    pub const LOADED: &'static str = "model";

    /// A solid that was loaded. It turns as the ball does.
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

    /// Its textures in full light; what has to be painted is painted into `texels`.
    pub fn paint<'m>(&self, texels: &'m mut [u8; MAX_TEXELS]) -> Textures<'m>
    where
        'a: 'm,
    {
        match self.cover {
            Cover::Painted(paint) => paint(texels),
            Cover::Loaded(texture) => texture.into(),
        }
    }

    /// The scene. `textures` holds what [`Entry::paint`] gave.
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

    /// The default pose at a tick: frame N of the scene is its pose at tick N.
    pub fn pose(&self, tick: u32) -> Pose {
        (self.pose)(tick)
    }

    /// A pose that looks as `next` does, at the distance that is nearest to that of `pose`.
    ///
    /// A walk along tiles goes on from a tile's end at the beginning of the same one. Nothing is seen
    /// of that in the two pictures; but whoever asks how far it is from one pose to the next would be
    /// told of a leap back.
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
