//! The plane of a texture in space: this folder decides the exact texture coordinates of every
//! pixel, and bounds the error of an approximation.
//!
//! [`Plane`] defines the coordinates. [`bounds`] is the one place for error bounds.

pub mod bounds;
pub(crate) mod face;
pub(crate) mod forms;
pub(crate) mod reciprocal;
pub(crate) mod stepper;
pub(crate) mod subdivision;
pub(crate) mod tolerance;

pub use face::Face;
pub(crate) use forms::on_screen;
pub use forms::{Anchor, Form, MAX_FOCAL_LENGTH, MAX_POSITION, Plane, ROUNDING, coordinate, texel};
pub(crate) use reciprocal::{LargeReciprocal, ReciprocalAbove, quotients_and_excess};
pub use reciprocal::{Reciprocal, quotients};
pub use stepper::PlaneStepper;
pub(crate) use subdivision::LONGEST_POWER;
pub use subdivision::Subdivision;
pub use tolerance::Tolerance;
