//! Interrupts by the user.

use std::fmt;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Makes Ctrl-C, `SIGTERM` and `SIGHUP` set a flag ([`interrupted`]) instead of ending the program, so that
/// the program can remove its temporary folders. A second signal ends the program at once.
pub fn catch_interrupts() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let caught = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(Interrupted::EXIT_CODE);
            }
        });
        // Without the handler, Ctrl-C ends the program at once, and the next set-up removes its leftovers.
        drop(caught);
    });
}

/// Returns whether the user has requested a stop since [`catch_interrupts`].
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// The error of work that was stopped by the user.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted;

impl Interrupted {
    /// The exit code that a shell reports for a program ended by Ctrl-C.
    pub const EXIT_CODE: i32 = 130;
}

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("interrupted")
    }
}

impl std::error::Error for Interrupted {}
