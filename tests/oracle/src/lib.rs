//! The renderer's required results, from the definitions, and the sweeps that compare the renderer with them.
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
