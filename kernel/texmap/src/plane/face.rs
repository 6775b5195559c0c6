//! Faces: polygons with the planes of their textures.

use super::forms::{Anchor, Plane};
use crate::geometry::Vertex;

/// A face on the screen, with everything that the mappers need.
#[derive(Clone, Copy, Debug)]
pub struct Face<'p> {
    /// The face's snapped corners.
    pub polygon: &'p [Vertex],
    /// Index of the texture among the scene's textures.
    pub texture: u16,
    /// Three points of the texture's plane.
    pub anchors: [Anchor; 3],
    /// The focal length in pixels.
    pub focal_length: i32,
}

impl Face<'_> {
    /// Returns the texture's plane.
    pub fn plane(&self) -> Plane {
        Plane::new(&self.anchors, self.focal_length)
    }
}
