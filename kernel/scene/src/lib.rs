//! What is seen: meshes, textures, palette, light, and the camera that looks at them.
//!
//! A picture is a function of scene and pose, and of nothing else: no clock and no history
//! reaches it. [`Pose::at_tick`] makes the pose of a frame number; [`Stage::draw`] turns it into
//! polygons in screen space and hands them to the mapper.
//!
//! All of it is integers and fixed point, so the same bits come out on the host and on the bare
//! machine.
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
