//! Texture mapping by columns: coverage, mappers, jobs and who draws them.
//!
//! Two steps. A [`Mapper`] makes jobs of a face: [`coverage`] says which pixels of each screen
//! column are inside its polygon, and the mapper where the texture is at the first of them, and
//! the steps to the next. A [`Renderer`] then draws the jobs, in one [`Order`] or another, through
//! a [`modex::Destination`]. What draws a job sees one run of pixels; it knows neither the order of
//! the jobs nor what lies behind the run.
//!
//! Integers decide pixels: coverage is exact, and everything else is fixed point whose range is
//! written where the type is defined, so host and bare machine produce the same bits.
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
