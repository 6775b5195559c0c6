//! The input of the renderer: this folder decides which polygons and textures are legal.
//!
//! Positions are whole multiples of 1/256 pixel, and texture coordinates are 16.16 texels. Every
//! other folder relies on the ranges that are stated here.

pub mod axis;
pub mod point;
pub mod polygon;
pub mod texture;

pub use axis::Axis;
pub use point::{MAX_COORDINATE, Point, SUBPIXELS, Vertex};
pub(crate) use polygon::check;
pub use polygon::{Dropped, MAX_SIDES};
pub use texture::{Texture, TextureError};
