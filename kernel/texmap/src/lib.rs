//! Texture mapping by columns: coverage, mappers, jobs, and the renderer that draws the jobs.
//!
//! Drawing has two steps. First, a [`Mapper`] turns a face into jobs: the [scan] finds the pixels
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

pub mod draw;
pub mod geometry;
pub mod loops;
pub mod mappers;
pub mod plane;
pub mod scan;

pub use draw::{Job, JobList, Order, Renderer, Stats};
pub use geometry::{
    Axis, Dropped, MAX_COORDINATE, MAX_SIDES, Point, SUBPIXELS, Texture, TextureError, Vertex,
};
pub use loops::{AffineStepper, Loop, Rows, Style};
pub use mappers::{Mapper, SpanKind};
pub use plane::{Face, Plane, PlaneStepper, Subdivision, Tolerance};
pub use scan::Visible;
