//! What the set-up says while it works.
//!
//! Straight to standard error, not by `eprintln!`: libtest captures that, and a first `cargo test` would be
//! silent for minutes. On a terminal a moving line, elsewhere (CI logs) a plain line now and then.

use std::fmt::Display;
use std::io::{IsTerminal, Write, stderr};
use std::time::{Duration, Instant};

use indicatif::{HumanBytes, ProgressBar, ProgressStyle};

use crate::child::Event;
use crate::quote;

/// Without a terminal: this long without a word is long enough.
const SILENCE: Duration = Duration::from_secs(10);

/// Writes a message to standard error, on lines of its own; lost where that is closed.
///
/// Whatever the message quotes, no escape sequence in it reaches the terminal.
pub fn say(text: impl Display) {
    let text = text.to_string();
    // There is no other place to report that standard error is closed.
    let _ = writeln!(stderr().lock(), "{}", quote::printable(&text));
}

/// Bytes as people read them.
pub fn bytes(count: u64) -> impl Display {
    HumanBytes(count)
}

/// A step that takes a while: announced when made, then told how far it is.
#[derive(Debug)]
pub struct Step {
    total: u64,
    begun: Instant,
    /// Without a terminal: when the last line was written, and how far it was, in per cent.
    said: (Instant, u64),
    /// How an amount is told.
    amount: fn(u64) -> String,
    bar: Option<ProgressBar>,
}

impl Step {
    /// A step of `total` bytes, or of unknown length (0).
    pub fn new(what: impl Display, total: u64) -> Self {
        let template = match total {
            0 => "  {spinner} {elapsed}",
            _ => "  {wide_bar} {bytes} of {total_bytes}, {elapsed}",
        };
        Self::with(what, total, template, |count| bytes(count).to_string())
    }

    /// A step of `total` things.
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
            said: (begun, 0),
            amount,
            bar,
        }
    }

    /// This many bytes are done (of unknown length: any number).
    pub fn at(&mut self, done: u64) {
        // Estimates and file system overhead: never more than all.
        let done = done.min(self.total);
        if let Some(bar) = &self.bar {
            bar.tick();
            return bar.set_position(done);
        }
        let percent = (done * 100).checked_div(self.total).unwrap_or(0);
        if percent >= self.said.1 + 10 || self.said.0.elapsed() >= SILENCE {
            self.said = (Instant::now(), percent);
            match self.total {
                0 => say(format_args!(
                    "  {} s, still at it",
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

    /// A line of a child's own words.
    pub fn line(&mut self, text: &str) {
        self.said.0 = Instant::now();
        match &self.bar {
            Some(bar) => bar.suspend(|| say(text)),
            None => say(text),
        }
    }

    /// A child's events, when only its life matters: `done` tells how far it is.
    pub fn on(&mut self, event: Event, done: impl FnOnce() -> u64) {
        if let Event::Tick = event {
            self.at(done());
        }
    }
}

impl Drop for Step {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
