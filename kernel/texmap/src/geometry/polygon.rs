//! The legal range of polygons.

use super::point::{MAX_COORDINATE, Point};

/// Most sides of a polygon.
pub const MAX_SIDES: usize = 16;

/// The reason why a polygon is not drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropped {
    /// More than [`MAX_SIDES`] vertices.
    TooManySides,
    /// A vertex is further out than [`MAX_COORDINATE`], or its texture coordinates are outside the texture.
    ///
    /// Only mappers that interpolate the vertices' texture coordinates check them: [`Mapper::Affine`],
    /// [`Mapper::HalfStep`] and [`Mapper::Rows`]. All other mappers compute texture coordinates from the
    /// face's plane, clamp them into the texture, and draw such a polygon.
    ///
    /// [`Mapper::Affine`]: crate::Mapper::Affine
    /// [`Mapper::HalfStep`]: crate::Mapper::HalfStep
    /// [`Mapper::Rows`]: crate::Mapper::Rows
    OutOfRange,
}

/// Returns an error if the scan's arithmetic does not hold for `polygon`.
pub(crate) fn check(polygon: &[impl Copy + Into<Point>]) -> Result<(), Dropped> {
    if polygon.len() > MAX_SIDES {
        return Err(Dropped::TooManySides);
    }
    let range = -MAX_COORDINATE..=MAX_COORDINATE;
    let mut points = polygon.iter().map(|&vertex| vertex.into());
    if points.all(|Point { x, y }| range.contains(&x) && range.contains(&y)) {
        Ok(())
    } else {
        Err(Dropped::OutOfRange)
    }
}
