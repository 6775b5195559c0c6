//! Texture mapping by columns: polygons to pixels.
//!
//! Drawing has two steps. First, a face becomes jobs: the [scan] finds the spans of pixels in each
//! screen column (or row) that lie inside the face's polygon, and a [`Mapper`] adds a stepper to each
//! span: the texture coordinates of its first pixel and how they advance. Then a [`Renderer`] draws
//! the jobs in the chosen [`Order`], through a [`modex::Destination`]. The code that draws a job sees
//! one span of pixels; it depends neither on the order of the jobs nor on the faces behind the span.
//!
//! Integers decide pixels: coverage is exact, and everything else is fixed point with a range that
//! is stated where the type is defined. So the host and the bare machine produce the same bits.
//!
//! A folder uses only the folders before it: [`geometry`], [`plane`], [`scan`], [`loops`],
//! [`mappers`], [`draw`].
//!
//! # Example
//!
//! ```
//! use modex::PlanarBuffer;
//! use texmap::plane::Anchor;
//! use texmap::{Face, JobList, Mapper, Order, Renderer, Texture, Vertex};
//!
//! let textures = [Texture::new(&[7; 16], 4, 4)?];
//! // Positions in pixels and coordinates in texels, as fixed point.
//! let corner = |x: i32, y: i32, u: i32, v: i32| Vertex {
//!     x: x << 8,
//!     y: y << 8,
//!     u: u << 16,
//!     v: v << 16,
//! };
//! let face = Face {
//!     polygon: &[corner(10, 10, 0, 0), corner(90, 10, 4, 0), corner(10, 90, 0, 4)],
//!     texture: 0,
//!     // Affine mappers, such as the default, use no anchors.
//!     anchors: [Anchor::default(); 3],
//!     focal_length: 258,
//! };
//! let mut page = PlanarBuffer::new();
//! let mut jobs = JobList::<256>::new();
//! let (mapper, order) = (Mapper::default(), Order::default());
//! let mut renderer = Renderer::new(&mut jobs, &textures, &mut page, mapper, order);
//! renderer.face(&face);
//! assert_eq!(renderer.finish().polygons, 1);
//! assert_eq!((page.pixel(20, 20), page.pixel(80, 80)), (7, 0));
//! # Ok::<(), texmap::TextureError>(())
//! ```
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
pub use loops::{AffineStepper, Loop, Quotients, Rows, Style};
pub use mappers::{Mapper, SpanKind};
pub use plane::{Face, Plane, PlaneStepper, Subdivision, Tolerance};
pub use scan::Visible;
