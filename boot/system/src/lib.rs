//! What the other host crates need of the operating system: child processes that end with this program,
//! interrupts by the user, atomic writes, safe quotation, and progress on standard error.
#![forbid(unsafe_code)]

mod atomic;
pub mod child;
mod interrupt;
mod progress;
pub mod quote;

pub use atomic::write_atomically;
pub use interrupt::{Interrupted, catch_interrupts, interrupted};
pub use progress::{Step, bytes, say};
