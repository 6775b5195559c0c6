//! Protection against files whose import does not end, or makes a library panic.
//!
//! The work runs on a separate thread, which the caller can abandon at any moment: while it reads an endless
//! pipe, cuts a face, decodes or quantises. The calling thread waits for the result, and watches for
//! interrupts and for the time limit.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use system::{Interrupted, interrupted};

/// The interval at which the waiting thread checks for interrupts and for the time limit.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// The size of the worker's stack: that of a program's first thread.
const STACK: usize = 8 << 20;

/// Runs `work` on the file with this name, for at most `limit`, and returns its result.
///
/// After an error, the worker's thread may run until the program ends, so the caller should end the program.
///
/// # Errors
/// The errors of `work`; [`Interrupted`] if the user stops the program; the time limit; a panic.
pub fn run<T: Send + 'static>(
    name: &str,
    limit: Duration,
    work: impl FnOnce() -> anyhow::Result<T> + Send + 'static,
) -> anyhow::Result<T> {
    let (send, done) = channel();
    let worker = thread::Builder::new().stack_size(STACK).spawn(move || {
        // If the caller has given up, nobody needs the result.
        let _ = send.send(work());
    });
    worker.context("no thread can be started to import the model")?;
    let begun = Instant::now();
    loop {
        match done.recv_timeout(POLL_INTERVAL) {
            Ok(result) => return result,
            Err(RecvTimeoutError::Timeout) if interrupted() => return Err(Interrupted.into()),
            Err(RecvTimeoutError::Timeout) if begun.elapsed() < limit => {}
            Err(RecvTimeoutError::Timeout) => bail!(
                "{name}: the import has not finished within {} s; simplify the model",
                limit.as_secs()
            ),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    // The worker ended without a result.
    bail!(
        "{name}: this program panicked while it imported the model or its texture (see the panic above); \
         please report it, with the files"
    )
}
