//! Texture mapping by columns: coverage, mappers, column jobs and who executes them.
//!
//! Two steps. [`coverage`] says which pixels of each screen column are inside a polygon, and a
//! [`Mapping`] makes column jobs of that: where the texture is at the first pixel, and the steps to
//! the next. An executor ([`Renderer`]) then draws the jobs through a [`modex::Destination`]. A
//! mapper sees one job and one column; it knows neither the order of the jobs nor what lies behind
//! the column.
//!
//! Integers decide pixels: coverage is exact, and everything else is fixed point whose range is
//! written where the type is defined, so host and bare machine produce the same bits.
#![no_std]
#![forbid(unsafe_code)]

pub mod affine;
mod along;
pub mod coverage;
pub mod exact;
mod job;
pub mod plane;
mod polygon;
mod renderer;

pub use job::{ColumnJob, JobList, Walk};
pub use plane::Plane;
pub use polygon::{MAX_COORDINATE, MAX_SIDES, Point, SUBPIXELS, Texture, TextureError, Vertex};
pub use renderer::{Mapping, Renderer, Stats};
