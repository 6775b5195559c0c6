//! `crystal-ball-image KERNEL OUT [RAMDISK]`: makes a disk image that boots the kernel on a PC BIOS,
//! with a ramdisk for it if one is given.
//!
//! A program of its own, outside the workspace, because the `bootloader` crate builds its BIOS stages with a
//! compiler that has its library sources: the pinned one, not the user's.

use std::env;
use std::path::PathBuf;
use std::process::ExitCode;

use bootloader::{BiosBoot, BootConfig};

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    let [kernel, out, ramdisk @ ..] = arguments.as_slice() else {
        return usage();
    };
    if ramdisk.len() > 1 {
        return usage();
    }
    let mut config = BootConfig::default();
    // The serial line is the kernel's alone: its first byte is the first byte of the protocol.
    config.serial_logging = false;
    config.frame_buffer_logging = false;
    let mut image = BiosBoot::new(kernel);
    image.set_boot_config(&config);
    for ramdisk in ramdisk {
        image.set_ramdisk(ramdisk);
    }
    match image.create_disk_image(out) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn usage() -> ExitCode {
    eprintln!("usage: crystal-ball-image KERNEL OUT [RAMDISK]");
    ExitCode::from(2)
}
