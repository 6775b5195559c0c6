//! Draws frames of a scene: scene, pose and options in, pixels out.
//!
//! A [`SceneRenderer`] prepares a scene: it checks the limits and lights the textures. [`SceneRenderer::at`]
//! turns the scene into a pose: it projects the vertices, and finds which face is visible at each pixel. The
//! [`PosedScene`] then draws any number of frames, each with its own [`RenderOptions`], and measures the
//! mapper's error and the texture's motion. A frame depends on nothing else: no clock and no history.
//!
//! All memory is in a [`RenderMemory`], whose limits are checked when the scene is set. All arithmetic is in
//! integers and fixed point, so the host and the bare machine produce the same bits.
//!
//! ```
//! use modex::PlanarBuffer;
//! use render::{RenderMemory, RenderOptions, SceneRenderer};
//! use scene::catalogue::{Entry, MAX_TEXELS};
//!
//! let cube = Entry::parse("cube").unwrap();
//! let mut texels = Box::new([0; MAX_TEXELS]);
//! let textures = cube.paint(&mut texels);
//! let mut memory = in_place::boxed!(RenderMemory);
//! let mut renderer = SceneRenderer::new(&mut memory, cube.scene(&textures));
//!
//! let mut page = PlanarBuffer::new();
//! page.clear(renderer.background());
//! let drawn = renderer.draw(&cube.pose(0), RenderOptions::default(), &mut page);
//! assert_eq!(drawn.stats.polygons, 3);
//! assert_ne!(page.pixel(160, 120), renderer.background()[120]);
//! ```
#![no_std]
#![forbid(unsafe_code)]

mod errors;
pub mod motion;
mod options;
mod period;
mod posed;
mod quality;
mod renderer;
mod surfaces;

pub use options::{Drawn, RenderOptions};
pub use posed::{MAX_JOBS, PosedScene};
pub use renderer::{RenderMemory, SceneRenderer};
pub use surfaces::SURFACE_BYTES;
