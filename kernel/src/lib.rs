//! The machine's edge, for every program of the bare machine: the show, and the one that measures.
#![cfg_attr(target_os = "none", no_std)]

pub mod machine;
