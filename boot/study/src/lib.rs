//! Measures the cost of accuracy: each mapper's error on the host, its cost in RAM, and its cost in the
//! kernel.
//!
//! [`trade`] measures all three, and writes tables, plots and a page. [`measure`] runs the benchmark kernel
//! and reads its answers.
//!
//! This example measures the error of two mappers on a scene:
//!
//! ```
//! use study::trade::accuracy::{self, FrameJobs};
//! use study::trade::workload;
//! use texmap::Mapper;
//!
//! let mut jobs = Box::new(FrameJobs::new());
//! let largest = ["affine", "exact"].map(|name| {
//!     let mapper = Mapper::parse(name).expect("a mapper's name");
//!     workload::with("tilted", 0, |workload| {
//!         let accuracy = accuracy::measure(workload, mapper, &mut jobs);
//!         accuracy.errors.largest()
//!     })
//! });
//! // In texels: affine mapping has a large error on a tilted square, the exact mapper one of the last bit.
//! assert!(largest[0] > 4.0);
//! assert!(largest[1] < 1.0 / 65_535.0);
//! ```

pub mod measure;
pub mod trade;
