//! Meshes, textures, palette, light, and the camera.
//!
//! A frame is a function of scene, options and pose alone: no clock and no history reaches it.
//! [`Pose::at_tick`] makes the pose of a frame number. [`Stage::draw`] turns the pose into polygons in screen
//! space and gives them to the mapper.
//!
//! All arithmetic is in integers and fixed point, so the host and the bare machine produce the same bits.
#![no_std]
#![forbid(unsafe_code)]

mod camera;
pub mod catalogue;
mod clip;
mod colour;
mod entry;
pub mod font;
mod mesh;
mod noise;
mod paint;
mod pose;
mod stage;
pub mod trig;

pub use camera::{FOCAL_LENGTH, NEAR};
pub use catalogue::ball::{TEXELS, ball, paint_ball};
pub use colour::{AMBIENT, FULL_LIGHT, LIGHT_LEVELS, LightTable, MATERIALS};
pub use mesh::{Corner, Face, MAX_CORNERS, MAX_EXTENT, Mesh, Vec3};
pub use pose::{Orientation, Pose};
pub use stage::motion;
pub use stage::{MAX_FACES, MAX_JOBS, MAX_VERTICES, SURFACE_BYTES, Scene, Stage, Storage};
