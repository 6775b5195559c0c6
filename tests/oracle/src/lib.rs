//! What the renderer must do, from the definitions, and the sweeps that compare the two.
//!
//! One renderer on both sides of a comparison cancels its own bugs. So [`coverage`] shares no
//! code with `texmap`, but for the plain type of a point, and is written to be read beside the
//! definition. [`mix`] makes the polygons that are most likely to go wrong, [`check`] compares
//! the renderer's scans with the oracle on them, [`shrink`] makes a failure small. `cargo sweep`
//! runs that for as long as it is told to, the default tests for some seconds.
#![forbid(unsafe_code)]

pub mod check;
pub mod coverage;
pub mod mix;
pub mod shrink;
pub mod small_world;
pub mod texel;
