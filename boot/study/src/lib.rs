//! What accuracy costs: the error of each mapper on the host, its cost in RAM, and its cost in the kernel.
//!
//! [`trade`] measures all of it and writes tables, plots and a page. [`measure`] asks the measuring kernel.

pub mod measure;
pub mod trade;
