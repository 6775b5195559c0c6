//! The tests that boot a machine, all in one program: it is linked once, sets up once, and keeps two
//! cores busy, since libtest runs as many tests at a time as there are cores.
//!
//! `cargo test --test qemu golden::` runs those of one module.

mod boot;
mod figures;
mod golden;
mod judged;
mod line;
mod measure;
mod model;
mod ready;
mod record;
mod wide;
