//! Work on foreign files, fenced in.
//!
//! Files may be made to take for ever, or to make a library panic. So the work is done on a thread
//! that nobody has to wait for, whatever it is doing: reading a pipe that never ends, cutting a face,
//! decoding, quantising. The thread that asked for it hears of interrupts and looks at the clock.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use system::{Interrupted, interrupted};

/// How often the waiting thread looks up.
const LOOK_UP: Duration = Duration::from_millis(20);
/// The work's stack: as large as that of a program's first thread.
const STACK: usize = 8 << 20;

/// Does `work` on the file of this name, for `limit` at most, and returns its result.
///
/// The thread of work that is given up goes on until the program ends: the caller should end it.
///
/// # Errors
/// Those of the work; [`Interrupted`] when the user asks to stop; the time limit; a panic.
pub fn run<T: Send + 'static>(
    name: &str,
    limit: Duration,
    work: impl FnOnce() -> anyhow::Result<T> + Send + 'static,
) -> anyhow::Result<T> {
    let (send, done) = channel();
    let worker = thread::Builder::new().stack_size(STACK).spawn(move || {
        // Where nobody listens any more, nobody misses the result.
        let _ = send.send(work());
    });
    worker.context("there is no thread to read files on")?;
    let begun = Instant::now();
    loop {
        match done.recv_timeout(LOOK_UP) {
            Ok(result) => return result,
            Err(RecvTimeoutError::Timeout) if interrupted() => return Err(Interrupted.into()),
            Err(RecvTimeoutError::Timeout) if begun.elapsed() < limit => {}
            Err(RecvTimeoutError::Timeout) => bail!(
                "{name}: making a model of it takes more than {} s; simplify it",
                limit.as_secs()
            ),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    // It ended without a result.
    bail!(
        "{name}: reading it or its texture made this program panic, as said above; please report \
         it, with the files"
    )
}
