//! `crystal-ball-image KERNEL OUT [RAMDISK]` writes a disk image that boots the kernel on a PC BIOS and
//! passes the kernel the ramdisk, if the command line names one.
//!
//! This is a separate program, outside the workspace, because the `bootloader` crate builds its BIOS stages
//! with a compiler that has its library sources: the pinned compiler, not the user's.

use std::env;
use std::fs;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, ensure};
use bootloader::{BiosBoot, BootConfig};
use fatfs::{FileSystem, FormatVolumeOptions, FsOptions};
use mbrman::MBRHeader;

/// Bytes in a sector.
const SECTOR: usize = 512;

/// Bytes in a cluster of the boot partition: the largest size that FAT has.
const CLUSTER: usize = 32 * 1024;

/// The boot loader understands at most this many sectors in its partition: with more, the number no longer
/// fits FAT's 16-bit field, and the loader takes the partition for FAT32, which it cannot read.
const MAX_SECTORS: usize = 0xFFFF;

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = env::args_os().skip(1).map(PathBuf::from).collect();
    let (kernel, out, ramdisk) = match arguments.as_slice() {
        [kernel, out] => (kernel, out, None),
        [kernel, out, ramdisk] => (kernel, out, Some(ramdisk.as_path())),
        _ => {
            eprintln!("usage: crystal-ball-image KERNEL OUT [RAMDISK]");
            return ExitCode::from(2);
        }
    };
    match make(kernel, out, ramdisk) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn make(kernel: &Path, out: &Path, ramdisk: Option<&Path>) -> anyhow::Result<()> {
    let mut config = BootConfig::default();
    // Only the kernel writes to the serial line: its first byte is the first byte of the protocol.
    config.serial_logging = false;
    config.frame_buffer_logging = false;
    let mut image = BiosBoot::new(kernel);
    image.set_boot_config(&config);
    if let Some(ramdisk) = ramdisk {
        image.set_ramdisk(ramdisk);
    }
    image.create_disk_image(out)?;
    let written = || format!("{} cannot be rewritten with large clusters", out.display());
    let image = with_large_clusters(fs::read(out)?).with_context(written)?;
    fs::write(out, image).with_context(written)
}

/// Formats the image's boot partition again, with the same files in larger clusters.
///
/// `bootloader` formats it with clusters of 1 KiB. For every cluster the loader calls the BIOS for 16 KiB and
/// for an entry of the allocation table, so that a file is read sixteen times over.
fn with_large_clusters(mut image: Vec<u8>) -> anyhow::Result<Vec<u8>> {
    let mut header = MBRHeader::read_from(&mut Cursor::new(&image))?;
    let start = header.partition_2.starting_lba as usize * SECTOR;
    let files = files(&mut image[start..])?;

    let clusters: usize = files
        .iter()
        .map(|(_, data)| data.len().div_ceil(CLUSTER))
        .sum();
    // The boot sector, the allocation table and the root directory take less than the one cluster more.
    let sectors = (clusters + 1) * (CLUSTER / SECTOR);
    ensure!(
        sectors <= MAX_SECTORS,
        "the kernel and the ramdisk take {} KiB; the boot loader reads at most {} KiB",
        sectors * SECTOR / 1024,
        MAX_SECTORS * SECTOR / 1024
    );
    let mut partition = vec![0; sectors * SECTOR];
    let format = FormatVolumeOptions::new()
        .bytes_per_cluster(CLUSTER as u32)
        .fats(1)
        // Two for each of the five files that there may be, and one that ends the list.
        .max_root_dir_entries(16);
    fatfs::format_volume(Cursor::new(partition.as_mut_slice()), format)?;
    let system = FileSystem::new(Cursor::new(partition.as_mut_slice()), FsOptions::new())?;
    for (name, data) in files {
        let mut file = system.root_dir().create_file(&name)?;
        file.write_all(&data).with_context(|| name)?;
    }
    system.unmount()?;

    image.truncate(start);
    image.append(&mut partition);
    header.partition_2.sectors = sectors as u32;
    header.write_into(&mut Cursor::new(image.as_mut_slice()))?;
    Ok(image)
}

/// The files in the root directory of a FAT partition: name and content.
fn files(partition: &mut [u8]) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let system = FileSystem::new(Cursor::new(partition), FsOptions::new())?;
    let mut files = Vec::new();
    for entry in system.root_dir().iter() {
        let entry = entry?;
        let mut data = Vec::new();
        entry.to_file().read_to_end(&mut data)?;
        files.push((entry.file_name(), data));
    }
    Ok(files)
}
