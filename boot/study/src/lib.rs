//! The cost of accuracy: each mapper's error on the host, its cost in RAM, and its cost in the kernel.
//!
//! [`trade`] measures all three, and writes tables, plots and a page. [`measure`] runs the benchmark kernel
//! and reads its answers.

pub mod measure;
pub mod trade;
