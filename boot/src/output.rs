//! Standard output.

use std::io::{self, IsTerminal, Write};
use std::path::Path;

use system::quote::printable;

/// Standard output. A full disk is an error; a closed pipe is not.
pub struct Output;

impl Output {
    fn attempt<T>(unread: T, result: io::Result<T>) -> io::Result<T> {
        result.or_else(|error| match error.kind() {
            io::ErrorKind::BrokenPipe => Ok(unread),
            // The caller tries again.
            io::ErrorKind::Interrupted => Err(error),
            kind => {
                let message = format!("cannot write to standard output: {error}");
                Err(io::Error::new(kind, message))
            }
        })
    }
}

impl Write for Output {
    /// Writes bytes unchanged into a pipe or file. On a terminal, escape sequences (in a file's name, for
    /// example) are shown and not obeyed.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut out = io::stdout().lock();
        match std::str::from_utf8(bytes) {
            Ok(text) if out.is_terminal() => {
                let written = out.write_all(printable(text).as_bytes());
                Self::attempt(bytes.len(), written.map(|()| bytes.len()))
            }
            _ => Self::attempt(bytes.len(), out.write(bytes)),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Self::attempt((), io::stdout().flush())
    }
}

/// Prints the path of a file that was written, so that the next program in a pipe can read it.
pub fn print_path(path: &Path) -> io::Result<()> {
    writeln!(Output, "{}", path.display())
}
