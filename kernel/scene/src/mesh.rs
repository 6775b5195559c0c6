//! Solids as borrowed slices, so that one built in and one loaded are the same type.

use texmap::MAX_SIDES;

use crate::clip::PLANES;

/// Most corners of a face: clipping may add one at each of five planes, and what it makes still
/// has to be a polygon of at most [`MAX_SIDES`].
pub const MAX_CORNERS: usize = MAX_SIDES - PLANES;
/// Largest coordinate of a mesh's vertex, either sign, 16.16: 64 units. Turned any way it stays
/// below 2^23, and at [`Pose::MAX_DISTANCE`](crate::Pose::MAX_DISTANCE) below 2^24.
pub const MAX_EXTENT: i32 = 64 << 16;

/// A point or direction: x right, y down, z away from the viewer.
pub type Vec3 = [i32; 3];

/// A corner of a face: a point in space and its place in the texture.
///
/// Faces that share points in space and places in the texture carry one texture over all of
/// them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Corner {
    /// Which of the mesh's vertices.
    pub vertex: u16,
    /// Across the texture, 16.16 texels, 0 to its width.
    pub u: i32,
    /// Down the texture, 16.16 texels, 0 to its height.
    pub v: i32,
}

/// A flat convex face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Face {
    /// Its first corner; the rest follow, clockwise when the face looks at the viewer.
    pub first: u16,
    /// How many corners, 3 to [`MAX_CORNERS`].
    pub corners: u16,
    /// Which of the scene's textures.
    pub texture: u16,
    /// The outward unit normal, 14 fraction bits.
    pub normal: Vec3,
}

/// A solid.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// Points, 16.16, each coordinate within +-[`MAX_EXTENT`].
    pub vertices: &'a [Vec3],
    /// Corners of all faces.
    pub corners: &'a [Corner],
    /// Faces.
    pub faces: &'a [Face],
    /// Whether none of them can hide a part of another that looks at the viewer, as of a convex solid
    /// and of a single face. What is not convex has at most [`MAX_FACES`](crate::MAX_FACES).
    pub convex: bool,
}
