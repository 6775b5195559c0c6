//! Messages and progress on standard error.
//!
//! On a terminal progress is a moving bar; elsewhere, such as in the log of a CI job, it is an occasional
//! line. Nothing here uses `eprintln!`: libtest captures its output, and a first `cargo test` would be silent
//! for minutes.

use std::fmt::Display;
use std::io::{IsTerminal, Write, stderr};
use std::time::{Duration, Instant};

use indicatif::{HumanBytes, ProgressBar, ProgressStyle};

use crate::child::ChildEvent;
use crate::quote;

/// The longest silence without a terminal.
const MAX_SILENCE: Duration = Duration::from_secs(10);

/// Writes a message to standard error. The message is lost if standard error is closed.
///
/// No escape sequence in the message reaches the terminal.
pub fn say(text: impl Display) {
    let text = text.to_string();
    // A closed standard error cannot be reported anywhere.
    let _ = writeln!(stderr().lock(), "{}", quote::printable(&text));
}

/// Returns a number of bytes in a readable unit.
pub fn bytes(count: u64) -> impl Display {
    HumanBytes(count)
}

/// The progress of a long step. [`Progress::new`] announces the step.
#[derive(Debug)]
pub struct Progress {
    total: u64,
    begun: Instant,
    /// Without a terminal: the time of the last line, and the progress at that time in percent.
    last_line: (Instant, u64),
    /// Formats an amount.
    amount: fn(u64) -> String,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Announces a step of `total` bytes; 0 if the length is unknown.
    pub fn new(what: impl Display, total: u64) -> Self {
        let template = match total {
            0 => "  {spinner} {elapsed}",
            _ => "  {wide_bar} {bytes} of {total_bytes}, {elapsed}",
        };
        Self::with(what, total, template, |count| bytes(count).to_string())
    }

    /// Announces a step of `total` items.
    pub fn counting(what: impl Display, total: u64) -> Self {
        let template = "  {wide_bar} {pos} of {len}, {elapsed}";
        Self::with(what, total, template, |count| count.to_string())
    }

    fn with(what: impl Display, total: u64, template: &str, amount: fn(u64) -> String) -> Self {
        say(what);
        let bar = stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template(template).expect("the template is constant");
            ProgressBar::new(total).with_style(style)
        });
        let begun = Instant::now();
        Self {
            total,
            begun,
            last_line: (begun, 0),
            amount,
            bar,
        }
    }

    /// Shows that `done` bytes or items are finished. If the length is unknown, `done` is ignored.
    pub fn at(&mut self, done: u64) {
        // An estimate may exceed the total.
        let done = done.min(self.total);
        if let Some(bar) = &self.bar {
            bar.tick();
            return bar.set_position(done);
        }
        let percent = (done * 100).checked_div(self.total).unwrap_or(0);
        if percent >= self.last_line.1 + 10 || self.last_line.0.elapsed() >= MAX_SILENCE {
            self.last_line = (Instant::now(), percent);
            match self.total {
                0 => say(format_args!(
                    "  {} s so far",
                    self.begun.elapsed().as_secs()
                )),
                total => say(format_args!(
                    "  {} of {}",
                    (self.amount)(done),
                    (self.amount)(total)
                )),
            }
        }
    }

    /// Shows a line of a child's output.
    pub fn line(&mut self, text: &str) {
        self.last_line.0 = Instant::now();
        match &self.bar {
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }

    /// Shows progress at each tick of a child, by `done`, and ignores the child's output.
    pub fn on(&mut self, event: ChildEvent, done: impl FnOnce() -> u64) {
        if let ChildEvent::Tick = event {
            self.at(done());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
