//! Texture mapping by columns: coverage, mappers, jobs, and the renderer that draws the jobs.
//!
//! Drawing has two steps. First, a [`Mapper`] turns a face into jobs: [`coverage`] finds the pixels
//! of each screen column that lie inside the face's polygon, and the mapper adds the texture
//! coordinates at the first of these pixels and the steps to the next. Then a [`Renderer`] draws
//! the jobs in the chosen [`Order`], through a [`modex::Destination`]. The code that draws a job
//! sees one span of pixels; it depends neither on the order of the jobs nor on what lies behind the
//! span.
//!
//! Integers decide pixels: coverage is exact, and everything else is fixed point with a range that
//! is stated where the type is defined. So the host and the bare machine produce the same bits.
#![no_std]
#![deny(unsafe_code)]

pub mod adaptive;
pub mod affine;
mod along;
pub mod bounds;
pub mod coverage;
pub mod exact;
pub mod free;
mod job;
pub mod level;
pub mod loops;
mod mapper;
mod places;
pub mod plane;
mod polygon;
mod renderer;
pub mod runs;
mod straight;
pub mod tiles;
pub mod visible;
pub mod within;

pub use job::{Job, JobList, Rows, Style, Walk};
pub use mapper::{Face, Mapper};
pub use plane::Plane;
pub use polygon::{MAX_COORDINATE, MAX_SIDES, Point, SUBPIXELS, Texture, TextureError, Vertex};
pub use renderer::{Order, Renderer, Stats};
pub use visible::Visible;
pub use within::Tolerance;
