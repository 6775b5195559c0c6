//! The tests of the host program that need no QEMU, all in one program: it is linked once.
//!
//! `cargo test --test host diff::` runs the tests of one module.

mod by_definition;
mod diff;
mod fuzz;
mod gaps;
mod import;
mod mutants;
mod trade;
