//! Solids as borrowed slices, so that one built in and one loaded are the same type.

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

/// A flat face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Face {
    /// Its first corner; the rest follow, clockwise when the face looks at the viewer.
    pub first: u16,
    /// How many corners, 3 to [`texmap::MAX_SIDES`].
    pub corners: u16,
    /// Which of the scene's textures.
    pub texture: u16,
    /// The outward unit normal, 14 fraction bits.
    pub normal: Vec3,
}

/// A solid.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// Points, 16.16.
    pub vertices: &'a [Vec3],
    /// Corners of all faces.
    pub corners: &'a [Corner],
    /// Faces.
    pub faces: &'a [Face],
}
