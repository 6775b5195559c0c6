//! Scenes as data: meshes, textures, palette, light, poses, and the camera.
//!
//! A frame is a function of scene, options and pose alone: no clock and no history reaches it.
//! [`Pose::at_tick`] makes the pose of a frame number. The crate `render` draws the frame.
//!
//! All arithmetic is in integers and fixed point, so the host and the bare machine produce the same bits.
#![no_std]
#![forbid(unsafe_code)]

mod camera;
pub mod catalogue;
pub mod clip;
mod colour;
mod entry;
pub mod font;
mod mesh;
mod noise;
mod paint;
mod pose;
pub mod trig;

pub use camera::{FOCAL_LENGTH, NEAR};
pub use catalogue::ball::{TEXELS, ball, paint_ball};
pub use colour::{AMBIENT, FULL_LIGHT, LIGHT_LEVELS, LightTable, MATERIALS, lit_level};
pub use entry::Scene;
pub use mesh::{Corner, MAX_CORNERS, MAX_EXTENT, MAX_FACES, MAX_VERTICES, Mesh, MeshFace, Vec3};
pub use pose::{Orientation, Pose};
