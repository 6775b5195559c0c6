//! The cache folder, which keeps costly downloads and builds for all clones of this user.
//!
//! A lock file allows one set-up at a time. A new entry is made in a temporary folder in the same file
//! system, and a rename puts it in place. A killed run leaves at most its temporary folder, which the next
//! holder of the lock removes.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind};
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use etcetera::BaseStrategy;
use tempfile::TempDir;

use system::{Interrupted, interrupted};
use system::{bytes, say};

const LOCK: &str = "lock";
/// The folder of the temporary folders.
const TEMPORARY: &str = "temporary";

/// The cache folder, which may not exist yet.
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// Returns the cache's place: a folder in the user's cache folder, by the XDG rules.
    pub fn find() -> anyhow::Result<Self> {
        let places = etcetera::base_strategy::Xdg::new().context(
            "no folder for the cache: HOME and XDG_CACHE_HOME are not set; set one of them to a writable folder",
        )?;
        Ok(Self {
            folder: places.cache_dir().join("crystal-ball"),
        })
    }

    /// Creates the folder, waits for other set-ups, and removes the temporary folders of killed runs.
    pub fn lock(self) -> anyhow::Result<LockedCache> {
        let unusable = || {
            format!(
                "{}: the cache folder cannot be used; set XDG_CACHE_HOME to choose another folder",
                self.folder.display()
            )
        };
        fs::create_dir_all(&self.folder).with_context(unusable)?;
        let lock = File::create(self.path(LOCK)).with_context(unusable)?;
        wait(&lock, &self.path(LOCK))?;
        let temporary = self.path(TEMPORARY);
        if temporary.exists() {
            remove(&temporary)?;
        }
        fs::create_dir(&temporary).with_context(unusable)?;
        Ok(LockedCache {
            cache: self,
            _lock: lock,
        })
    }

    /// Returns the path of the entry `name`.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Returns the cache folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }
}

fn wait(lock: &File, path: &Path) -> anyhow::Result<()> {
    let begun = Instant::now();
    let mut reported = false;
    loop {
        match lock.try_lock() {
            Ok(()) => return Ok(()),
            Err(TryLockError::Error(error)) => {
                return Err(error).with_context(|| format!("{}: cannot be locked", path.display()));
            }
            Err(TryLockError::WouldBlock) if interrupted() => return Err(Interrupted.into()),
            Err(TryLockError::WouldBlock) => {}
        }
        if !reported && begun.elapsed() > Duration::from_secs(1) {
            reported = true;
            say(format_args!(
                "waiting for another set-up to release {}",
                path.display()
            ));
        }
        // Polling, not a blocking lock, so that Ctrl-C ends the wait.
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The locked cache: only this process may change it.
pub struct LockedCache {
    cache: Cache,
    _lock: File,
}

impl Deref for LockedCache {
    type Target = Cache;

    fn deref(&self) -> &Cache {
        &self.cache
    }
}

impl LockedCache {
    /// Creates a temporary folder in the cache's file system.
    pub fn temporary_folder(&self) -> anyhow::Result<TempDir> {
        let folder = self.path(TEMPORARY);
        TempDir::new_in(&folder).with_context(|| format!("{}: cannot be written", folder.display()))
    }

    /// Puts the finished `made` in its place in the cache, and removes the entry that was there.
    pub fn put(&self, made: &Path, name: &str) -> anyhow::Result<PathBuf> {
        let place = self.path(name);
        let old = self.temporary_folder()?;
        if place.exists() {
            fs::rename(&place, old.path().join("old"))?;
        }
        fs::rename(made, &place).with_context(|| {
            format!(
                "{}: the new cache entry cannot be moved here",
                place.display()
            )
        })?;
        Ok(place)
    }

    /// Returns all entries of the cache except the lock file, for which other processes may be waiting.
    pub fn contents(&self) -> anyhow::Result<Vec<PathBuf>> {
        let entries = fs::read_dir(self.folder())?.collect::<Result<Vec<_>, _>>()?;
        Ok(entries
            .iter()
            .map(|entry| entry.path())
            .filter(|path| !path.ends_with(LOCK))
            .collect())
    }

    /// Returns an error if the disk has less than `needed` bytes of free space. Call it before a download.
    pub fn room(&self, needed: u64, what: &str) -> anyhow::Result<()> {
        let free = free(self.folder())?;
        if free < needed {
            let text = format!(
                "{}: {what} needs {} of disk space, but {} are free; free some space, or set XDG_CACHE_HOME to a folder \
                 on another disk",
                self.folder().display(),
                bytes(needed),
                bytes(free)
            );
            return Err(io::Error::new(ErrorKind::StorageFull, text).into());
        }
        Ok(())
    }
}

/// Returns the free bytes, for an ordinary user, in the file system of `folder`.
pub fn free(folder: &Path) -> anyhow::Result<u64> {
    let disk = rustix::fs::statvfs(folder)
        .with_context(|| format!("{}: the free disk space cannot be read", folder.display()))?;
    Ok(disk.f_bavail * disk.f_frsize)
}

/// Returns whether a full disk caused the error. Another way to get the same files would then fail too.
pub fn is_full(error: &anyhow::Error) -> bool {
    let by_kind = error.chain().any(|cause| {
        let kind = cause.downcast_ref().map(io::Error::kind);
        matches!(
            kind,
            Some(ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
        )
    });
    let text = format!("{error:#}");
    // The text includes the error output of a child process.
    by_kind
        || ["No space left on device", "Disk quota exceeded"]
            .iter()
            .any(|message| text.contains(message))
}

/// Removes a file, or a folder with its contents.
pub fn remove(path: &Path) -> anyhow::Result<()> {
    if path.is_dir() && !path.is_symlink() {
        fs::remove_dir_all(path)
    } else {
        fs::remove_file(path)
    }
    .with_context(|| format!("{}: cannot be removed", path.display()))
}

/// Returns the bytes of all files in a folder. Files that cannot be read count as 0.
pub fn size(path: &Path) -> u64 {
    let Ok(data) = path.symlink_metadata() else {
        return 0;
    };
    if !data.is_dir() {
        return data.len();
    }
    fs::read_dir(path)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| size(&entry.path()))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finished_entry_replaces_the_old_entry() {
        let place = tempfile::tempdir().unwrap();
        let locked = Cache {
            folder: place.path().join("new"),
        }
        .lock()
        .unwrap();
        for content in ["first", "second"] {
            let temporary = locked.temporary_folder().unwrap();
            fs::create_dir(temporary.path().join("made")).unwrap();
            fs::write(temporary.path().join("made/file"), content).unwrap();
            let kept = locked.put(&temporary.path().join("made"), "kept").unwrap();
            assert_eq!(fs::read_to_string(kept.join("file")).unwrap(), content);
        }
        assert_eq!(fs::read_dir(locked.path(TEMPORARY)).unwrap().count(), 0);
        assert_eq!(size(&locked.path("kept")), 6);
    }

    #[test]
    fn too_little_disk_space_is_reported_before_the_download() {
        let place = tempfile::tempdir().unwrap();
        let locked = Cache {
            folder: place.path().to_owned(),
        }
        .lock()
        .unwrap();
        locked.room(1, "a little").unwrap();
        let error = locked.room(1 << 60, "the world").unwrap_err().to_string();
        assert!(
            error.contains(": the world needs 1.00 EiB of disk space, but ")
                && error.contains("are free"),
            "{error}"
        );
    }

    #[test]
    fn a_full_disk_is_recognised_by_error_kind_and_by_a_childs_output() {
        let of_system = io::Error::from_raw_os_error(28);
        let error = anyhow::Error::from(of_system).context("cannot be written");
        assert!(is_full(&error));
        let message = "`dpkg -x` failed\ntar: x: Cannot write: No space left on device";
        assert!(is_full(&anyhow::Error::msg(message)));
        assert!(!is_full(&anyhow::Error::msg("no network")));
        assert!(!is_full(&io::Error::from_raw_os_error(2).into()));
    }
}
