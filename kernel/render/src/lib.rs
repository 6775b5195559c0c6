//! Draws frames of a scene.
#![no_std]
#![forbid(unsafe_code)]

mod errors;
pub mod motion;
mod renderer;

pub use renderer::{MAX_JOBS, RenderMemory, SURFACE_BYTES, SceneRenderer};
