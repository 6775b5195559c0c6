//! Draws frames of a scene.
#![no_std]
#![forbid(unsafe_code)]

mod errors;
pub mod motion;
mod posed;
mod quality;
mod renderer;
mod surfaces;

pub use posed::{Drawn, PosedScene, RenderOptions};
pub use renderer::{MAX_JOBS, RenderMemory, SceneRenderer};
pub use surfaces::SURFACE_BYTES;
