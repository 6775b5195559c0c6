//! The renderer's required results, from the definitions, and the sweeps that compare the renderer with them.
//!
//! ```
//! use oracle::coverage::inside;
//! use texmap::Point;
//!
//! // The square from (0, 0) to (2, 2); coordinates are in 1/256 pixel.
//! let square = [(0, 0), (512, 0), (512, 512), (0, 512)].map(|(x, y)| Point { x, y });
//! assert!(inside(&square, 1, 1));
//! assert!(!inside(&square, 2, 1));
//! ```
//!
//! If the renderer were on both sides of a comparison, its bugs would cancel. So [`coverage`], [`texel`] and
//! [`sight`] share no code with the renderer, except for the plain types of points and faces, and are written
//! to be read beside the definitions.
//!
//! [`mix`] makes the polygons that are most likely to go wrong, [`check`] compares the renderer's scans with
//! the oracle on them, and [`shrink`] makes a failure small. [`plane`] does the same for the exact mapper,
//! [`solid`] for whole solids in any pose. `cargo sweep` runs all of them for a chosen time, the default
//! tests for some seconds.
#![forbid(unsafe_code)]

pub mod check;
pub mod coverage;
pub mod depth;
pub mod mix;
pub mod plane;
pub mod shrink;
pub mod sight;
pub mod small_world;
pub mod solid;
pub mod texel;
