//! Solids as borrowed slices, so that a built-in solid and a loaded solid have the same type.

use texmap::MAX_SIDES;

/// Number of planes that a face is clipped at.
pub(crate) const CLIP_PLANES: usize = 5;
/// Most vertices of a mesh.
pub const MAX_VERTICES: usize = 4096;
/// Most faces of a mesh that is not convex. Such a mesh's faces keep their numbers until the frame is drawn.
pub const MAX_FACES: usize = 8192;
/// Most corners of a face. Clipping may add a corner at each of five planes, and the result must still be a
/// polygon of at most [`MAX_SIDES`] sides.
pub const MAX_CORNERS: usize = MAX_SIDES - CLIP_PLANES;
/// Largest coordinate of a mesh's vertex, either sign, 16.16: 64 units. After any turn it is below 2^23, and
/// at [`Pose::MAX_DISTANCE`](crate::Pose::MAX_DISTANCE) below 2^24.
pub const MAX_EXTENT: i32 = 64 << 16;

/// A point or direction: x right, y down, z away from the viewer.
pub type Vec3 = [i32; 3];

/// A corner of a face: a point in space and its place in the texture.
///
/// Faces whose common corners have equal texture coordinates carry one texture across their edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Corner {
    /// Index into the mesh's vertices.
    pub vertex: u16,
    /// Across the texture, 16.16 texels, 0 to its width.
    pub u: i32,
    /// Down the texture, 16.16 texels, 0 to its height.
    pub v: i32,
}

/// A flat convex face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshFace {
    /// Index of the face's first corner. The corners follow each other clockwise when the face looks at the
    /// viewer.
    pub first: u16,
    /// Number of corners, 3 to [`MAX_CORNERS`].
    pub corners: u16,
    /// Index into the scene's textures.
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
    pub faces: &'a [MeshFace],
    /// Whether no front face can hide a part of another, as in a convex solid or a single face. A mesh that
    /// is not convex has at most [`MAX_FACES`] faces.
    pub convex: bool,
}
