//! `crystal-ball-image KERNEL OUT`: makes a disk image that boots the kernel on a PC BIOS.
//!
//! A program of its own, outside the workspace, because the `bootloader` crate builds its BIOS stages with a
//! compiler that has its library sources: the pinned one, not the user's.

use std::env;
use std::path::PathBuf;
use std::process::ExitCode;

use bootloader::{BiosBoot, BootConfig};

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    let [kernel, out] = arguments.as_slice() else {
        eprintln!("usage: crystal-ball-image KERNEL OUT");
        return ExitCode::from(2);
    };
    let mut config = BootConfig::default();
    // The serial line is the kernel's alone: its first byte is the first byte of the protocol.
    config.serial_logging = false;
    config.frame_buffer_logging = false;
    match BiosBoot::new(kernel)
        .set_boot_config(&config)
        .create_disk_image(out)
    {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
