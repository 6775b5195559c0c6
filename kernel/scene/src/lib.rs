//! Describes scenes as data: meshes, textures, palette, light, poses, and the camera.
//!
//! A frame is a function of scene, options and pose alone: no clock and no history reaches it.
//! [`Pose::at_tick`] makes the pose of a frame number. The crate `render` draws the frame.
//!
//! All arithmetic is in integers and fixed point, so the host and the bare machine produce the same bits.
//!
//! ```
//! use scene::catalogue::{Entry, MAX_TEXELS};
//!
//! let cube = Entry::parse("cube").unwrap();
//! let mut texels = Box::new([0; MAX_TEXELS]);
//! let textures = cube.paint(&mut texels);
//! let scene = cube.scene(&textures);
//! assert_eq!((scene.mesh.faces.len(), scene.textures.len()), (6, 1));
//! // Frame 0 is the scene at its pose of tick 0, and the nearest corner is in front of the eye.
//! let pose = cube.pose(0);
//! let depths = scene.mesh.vertices.iter().map(|&vertex| pose.orientation().turn(vertex)[2] + pose.distance);
//! assert!(depths.min().unwrap() > scene::NEAR);
//! ```
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
