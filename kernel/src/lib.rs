//! Hardware access for the programs on the bare machine: the demo and the benchmark kernel.
//!
//! [`machine`] accesses the devices. The code beside it needs no device, and is tested on the host.
#![cfg_attr(target_os = "none", no_std)]

pub mod machine;
pub mod receiver;
pub mod ring;
