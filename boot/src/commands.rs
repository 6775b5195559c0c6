//! The subcommands, a file for each.

pub mod bless;
pub mod clean;
pub mod diff;
pub mod doctor;
pub mod dump;
pub mod emulate;
pub mod image;
pub mod qemu;
pub mod record;
pub mod replay;
pub mod trade;
pub mod watch;
