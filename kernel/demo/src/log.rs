//! The log: the changes of a demo's state, with their ticks.

use protocol::Action;

use crate::steering::{State, StateChange};

/// A change and its tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LogEntry {
    tick: u32,
    change: StateChange,
}

impl LogEntry {
    /// An unused entry. It is all zeros, so that an empty log occupies no space in the kernel's image.
    const EMPTY: Self = Self {
        tick: 0,
        change: StateChange::Act(Action::YawLeft),
    };
}

/// Memory for a log's changes.
pub(crate) type LogMemory = [LogEntry; Log::MAX];

/// A log: a known state, and the changes since, with their ticks.
#[derive(Debug)]
pub(crate) struct Log<'a> {
    /// The state before the first change.
    start: State<'a>,
    entries: &'a mut LogMemory,
    len: usize,
    /// The number of changes that took effect and did not fit in the log.
    lost: u32,
}

/// Why a change cannot be added to the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LogError {
    /// Its tick is before this tick, the tick of the last change.
    Before(u32),
    /// The log is full.
    Full,
}

impl<'a> Log<'a> {
    /// Most changes. A push at its limit changes nothing and is not logged, so even a person who never stops
    /// pressing keys adds only some hundred a minute.
    pub const MAX: usize = 1024;

    /// Memory for an empty log, all zeros.
    pub const MEMORY: LogMemory = [LogEntry::EMPTY; Self::MAX];

    /// Returns a log without changes since `start`.
    pub fn new(start: State<'a>, entries: &'a mut LogMemory) -> Self {
        let (len, lost) = (0, 0);
        Self {
            start,
            entries,
            len,
            lost,
        }
    }

    /// Discards all changes and starts again with `start`.
    pub fn restart(&mut self, start: State<'a>) {
        (self.start, self.len, self.lost) = (start, 0, 0);
    }

    /// Returns the state before the first change.
    pub fn start(&self) -> &State<'a> {
        &self.start
    }

    /// Returns the state before the first change, to change it.
    pub fn start_mut(&mut self) -> &mut State<'a> {
        &mut self.start
    }

    /// Returns the changes with their ticks, which never decrease.
    pub fn changes(&self) -> impl Iterator<Item = (u32, StateChange)> {
        let entries = self.entries[..self.len].iter();
        entries.map(|entry| (entry.tick, entry.change))
    }

    /// Returns how many changes took effect and did not fit in the log.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Adds a change.
    ///
    /// # Errors
    /// If the tick is before the tick of the last change, or if the log is full.
    pub fn add(&mut self, tick: u32, change: StateChange) -> Result<(), LogError> {
        let last = self.changes().last().map(|(tick, _)| tick);
        if let Some(last) = last.filter(|&last| tick < last) {
            return Err(LogError::Before(last));
        }
        let entry = self.entries.get_mut(self.len).ok_or(LogError::Full)?;
        *entry = LogEntry { tick, change };
        self.len += 1;
        Ok(())
    }

    /// Adds a change that took effect, or counts it as lost if it cannot be added. A change also counts as
    /// lost when the tick counter wraps, after 828 days.
    pub fn add_or_count(&mut self, tick: u32, change: StateChange) {
        if self.add(tick, change).is_err() {
            self.lost = self.lost.saturating_add(1);
        }
    }

    /// Returns the state at a tick, or `None` if earlier changes were lost.
    pub fn state(&self, tick: u32) -> Option<State<'a>> {
        let mut state = self.start;
        for (at, change) in self.changes() {
            if tick < at {
                return Some(state);
            }
            state.apply(at, change);
        }
        (self.lost == 0).then_some(state)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::steering::tests::{any_action, state_of};
    use std::boxed::Box;
    use std::vec::Vec;

    #[test]
    fn a_log_gives_the_state_at_every_tick_until_it_is_full() {
        let mut random = seeded::generator();
        let mut memory = Box::new(Log::MEMORY);
        let start = state_of(0);
        let mut log = Log::new(start, &mut memory);
        let (mut state, mut tick, mut poses) = (start, 0, Vec::new());
        while log.changes().count() < Log::MAX {
            let action = any_action(&mut random);
            let change = StateChange::Act(action);
            if action != Action::NextScene && state.apply(tick, change) {
                log.add_or_count(tick, change);
            }
            if random.bool() {
                poses.push((tick, state.pose(tick)));
                tick += random.u32(1..5);
            }
        }
        for (tick, pose) in &poses {
            assert_eq!(log.state(*tick).unwrap().pose(*tick), *pose, "at {tick}");
        }
        assert!(log.state(tick).is_some());
        let stop = StateChange::Act(Action::Stop);
        assert!(matches!(log.add(0, stop), Err(LogError::Before(last)) if last <= tick));
        assert_eq!(log.add(tick, stop), Err(LogError::Full));
        log.add_or_count(tick, stop);
        assert_eq!(log.lost(), 1);
        assert!(log.state(tick).is_none() && log.state(0).is_some());
        log.restart(start);
        assert_eq!((log.lost(), log.changes().count()), (0, 0));
    }
}
