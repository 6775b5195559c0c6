//! Draws frames of a scene.
#![no_std]
#![forbid(unsafe_code)]

mod errors;
pub mod motion;
mod renderer;

pub use renderer::{Drawn, MAX_JOBS, RenderMemory, RenderOptions, SURFACE_BYTES, SceneRenderer};
