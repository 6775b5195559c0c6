//! Access to the operating system for the other host crates: child processes that end with this program,
//! interrupts by the user, atomic writes, safe quotation, and progress on standard error.
//!
//! A write that fails leaves the old file:
//!
//! ```
//! use std::io::Write;
//!
//! # fn main() -> anyhow::Result<()> {
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("dump");
//! system::write_atomically(&path, |file| Ok(file.write_all(b"complete")?))?;
//! let failed = system::write_atomically(&path, |file| {
//!     file.write_all(b"half")?;
//!     anyhow::bail!("the disk is full") as anyhow::Result<()>
//! });
//! assert!(failed.is_err());
//! assert_eq!(std::fs::read(&path)?, b"complete");
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]

mod atomic;
pub mod child;
mod interrupt;
mod progress;
pub mod quote;

pub use atomic::write_atomically;
pub use interrupt::{Interrupted, catch_interrupts, interrupted};
pub use progress::{Progress, bytes, say};
