//! Atomic writes to files that the user names.
//!
//! A reader sees the old file or the complete new one. Links, devices and FIFOs stay what they are.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use anyhow::Context;

/// Symbolic links that are followed in a row: as many as Linux follows.
const MAX_LINKS: usize = 40;

/// Writes a temporary file in the same folder, and renames it to `path` when it is complete.
///
/// A symbolic link stays a link, and its target is replaced. A device or a FIFO is written to directly,
/// because a rename would replace it by a file.
///
/// # Errors
/// `write` fails, or the file cannot be created.
pub fn write_atomically<T>(
    path: &Path,
    write: impl FnOnce(&mut File) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let context = || format!("{} cannot be written", path.display());
    if fs::metadata(path).is_ok_and(|data| !data.is_file()) {
        let mut target = OpenOptions::new()
            .write(true)
            .open(path)
            .with_context(context)?;
        return write(&mut target).with_context(context);
    }
    let path = follow(path).with_context(context)?;
    let mut file = tempfile::Builder::new()
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder(&path))
        .with_context(context)?;
    let written = write(file.as_file_mut()).with_context(context)?;
    file.persist(&path).with_context(context)?;
    Ok(written)
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Returns the end of a chain of links. `canonicalize` fails if the target does not exist yet.
fn follow(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        match fs::read_link(&path) {
            Ok(link) => path = folder(&path).join(link),
            // `path` is not a link, or does not exist.
            Err(_) => return Ok(path),
        }
    }
    Err(rustix::io::Errno::LOOP.into())
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::os::unix::fs::{FileTypeExt, symlink};

    use rustix::fs::{CWD, Mode};

    use super::*;

    fn hello(path: &Path) -> anyhow::Result<()> {
        write_atomically(path, |file| Ok(file.write_all(b"hello")?))
    }

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "old").unwrap();
        let half = write_atomically(&path, |file| {
            file.write_all(b"half")?;
            anyhow::bail!("no more")
        });
        let half: anyhow::Result<()> = half;
        assert!(format!("{:#}", half.unwrap_err()).ends_with("file cannot be written: no more"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        hello(&path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"hello");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(hello(folder.path()).is_err(), "a folder is not a file");
    }

    #[test]
    fn a_symbolic_link_stays_and_its_target_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        fs::write(at("sub/there"), "old").unwrap();
        symlink("sub/there", at("to-file")).unwrap();
        symlink("to-file", at("to-link")).unwrap();
        symlink(at("sub/new"), at("dangling")).unwrap();
        for (link, file) in [("to-link", "sub/there"), ("dangling", "sub/new")] {
            hello(&at(link)).unwrap();
            assert!(at(link).is_symlink(), "{link}");
            assert!(!at(file).is_symlink(), "{file}");
            assert_eq!(fs::read(at(file)).unwrap(), b"hello");
        }
        symlink("loop", at("loop")).unwrap();
        assert!(hello(&at("loop")).is_err());
        assert!(at("loop").is_symlink());
    }

    #[test]
    fn devices_and_fifos_are_written_to_directly() {
        let folder = tempfile::tempdir().unwrap();
        let (link, fifo) = (folder.path().join("link"), folder.path().join("fifo"));
        symlink("/dev/null", &link).unwrap();
        hello(&link).unwrap();
        assert!(link.is_symlink());
        let null = fs::metadata("/dev/null").unwrap().file_type();
        assert!(null.is_char_device());

        rustix::fs::mkfifoat(CWD, &fifo, Mode::RUSR | Mode::WUSR).unwrap();
        let reader = {
            let fifo = fifo.clone();
            std::thread::spawn(move || {
                let mut text = String::new();
                File::open(fifo).unwrap().read_to_string(&mut text).unwrap();
                text
            })
        };
        hello(&fifo).unwrap();
        assert_eq!(reader.join().unwrap(), "hello");
        assert!(fs::metadata(&fifo).unwrap().file_type().is_fifo());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
