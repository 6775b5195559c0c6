//! The tests that boot a machine, all in one program: it is linked once, runs the set-up once, and uses all
//! cores, since libtest runs as many tests at a time as the host has cores.
//!
//! `cargo test --test qemu golden::` runs the tests of one module.

mod boot;
mod expected_failure;
mod figures;
mod golden;
mod line;
mod measure;
mod model;
mod ready;
mod record;
mod wide;
