//! The machine's edge, for every program of the bare machine: the show, and the one that measures.
//!
//! [`machine`] reaches the devices. What needs no device is beside it and is tested on the host.
#![cfg_attr(target_os = "none", no_std)]

pub mod machine;
pub mod receiver;
pub mod ring;
