//! The memory that a model file's mesh is unpacked into.

use scene::{Corner, MAX_VERTICES, MeshFace, Vec3};

use crate::{MAX_ALL_CORNERS, MAX_FACES};

/// Memory for the largest mesh, about half a MiB. It is meant for a static.
#[derive(Clone, Copy, Debug)]
pub struct Arena {
    pub(crate) vertices: [Vec3; MAX_VERTICES],
    pub(crate) corners: [Corner; MAX_ALL_CORNERS],
    pub(crate) faces: [MeshFace; MAX_FACES],
}

impl Arena {
    /// Returns an empty arena. It is all zeros, so it occupies no space in an image.
    pub const fn new() -> Self {
        Self {
            vertices: [[0; 3]; MAX_VERTICES],
            corners: [Corner {
                vertex: 0,
                u: 0,
                v: 0,
            }; MAX_ALL_CORNERS],
            faces: [MeshFace {
                first: 0,
                corners: 0,
                texture: 0,
                normal: [0; 3],
            }; MAX_FACES],
        }
    }
}

impl Default for Arena {
    fn default() -> Self {
        Self::new()
    }
}

/// Copies items to the front of `place`, and returns that part of `place`.
pub(crate) fn fill<T>(place: &mut [T], items: impl ExactSizeIterator<Item = T>) -> &[T] {
    let filled = &mut place[..items.len()];
    for (to, item) in filled.iter_mut().zip(items) {
        *to = item;
    }
    filled
}
