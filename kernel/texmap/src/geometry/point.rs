//! Places on the screen, and the corners of polygons.

/// Units of a position per pixel: positions are whole multiples of 1/256 pixel.
pub const SUBPIXELS: i32 = 256;
/// Largest magnitude of a vertex's x or y: 32 767 pixels. Within it, every product of the scan fits 64 bits.
pub const MAX_COORDINATE: i32 = 32_767 * SUBPIXELS;

/// A place on the screen. Pixel (x, y) has its centre at (256 x + 128, 256 y + 128).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Point {
    /// Position to the right, in 1/256 pixel, within +-[`MAX_COORDINATE`].
    pub x: i32,
    /// Position downward, in 1/256 pixel, within +-[`MAX_COORDINATE`].
    pub y: i32,
}

impl From<Vertex> for Point {
    fn from(vertex: Vertex) -> Self {
        Self {
            x: vertex.x,
            y: vertex.y,
        }
    }
}

/// A corner of a polygon: its place on the screen, as in [`Point`], and its texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Vertex {
    /// Position to the right, in 1/256 pixel, within +-[`MAX_COORDINATE`].
    pub x: i32,
    /// Position downward, in 1/256 pixel, within +-[`MAX_COORDINATE`].
    pub y: i32,
    /// Coordinate across the texture: 16.16 texels, 0 to its width.
    pub u: i32,
    /// Coordinate down the texture: 16.16 texels, 0 to its height.
    pub v: i32,
}
