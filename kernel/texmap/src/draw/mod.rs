//! Drawing: this folder decides in which order the spans of a frame are written, and how each is
//! written to a column, to a row or to a plane of a row.
//!
//! A job is a mapped span with its texture. A bounded list holds the jobs of a frame; when the list
//! is full, the renderer draws its jobs and empties it.

pub(crate) mod job;
pub(crate) mod job_list;
pub(crate) mod order;
pub(crate) mod renderer;
mod visible_parts;

pub use job::Job;
pub use job_list::JobList;
pub use order::Order;
pub use renderer::{Renderer, Stats};
