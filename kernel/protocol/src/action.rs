//! Actions that steer a running demo, by a key or by `steer`.

use core::fmt;

use crate::{Setting, Word};

/// An action. Each key that does something has one action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Action {
    /// `yaw-left`: turn about the solid's own axis; the side towards the viewer moves to the left.
    YawLeft,
    /// `yaw-right`
    YawRight,
    /// `pitch-up`: turn about the screen's horizontal axis; the side towards the viewer moves up.
    PitchUp,
    /// `pitch-down`
    PitchDown,
    /// `roll-left`: turn about the line of sight; the top moves to the left.
    RollLeft,
    /// `roll-right`
    RollRight,
    /// `faster`: speed up all motion; if nothing moves, start the scene's own motion.
    Faster,
    /// `slower`: slow down all motion.
    Slower,
    /// `stop`: nothing moves.
    Stop,
    /// `pause`: stop all motion, or continue it.
    Pause,
    /// `step`: pause; if paused already, advance by one tick.
    Step,
    /// `nearer`
    Nearer,
    /// `farther`
    Farther,
    /// `next-scene`
    NextScene,
    /// `next-mapper`
    NextMapper,
    /// `last-mapper`: the mapper before this one in the list.
    LastMapper,
    /// `finer`: halve the error bound of `within-T`.
    Finer,
    /// `coarser`: double the error bound of `within-T`.
    Coarser,
    /// `next-order`
    NextOrder,
    /// `quality`: switch reduced quality on or off, for faces whose motion hides it.
    Quality,
    /// `help`: switch the list of keys over the frame on or off.
    Help,
    /// `info`: switch the figures over the frames on or off.
    Info,
    /// `split`: switch the split view on or off: the frame as it is, the exact frame, and the error.
    Split,
    /// `hint`: for five seconds, show which key is help.
    Hint,
    /// `reset`: the scene's own motion and the default settings. The scene stays.
    Reset,
}

impl Action {
    /// All actions, with their names in the protocol.
    pub const ALL: [(&'static str, Self); 25] = [
        ("yaw-left", Self::YawLeft),
        ("yaw-right", Self::YawRight),
        ("pitch-up", Self::PitchUp),
        ("pitch-down", Self::PitchDown),
        ("roll-left", Self::RollLeft),
        ("roll-right", Self::RollRight),
        ("faster", Self::Faster),
        ("slower", Self::Slower),
        ("stop", Self::Stop),
        ("pause", Self::Pause),
        ("step", Self::Step),
        ("nearer", Self::Nearer),
        ("farther", Self::Farther),
        ("next-scene", Self::NextScene),
        ("next-mapper", Self::NextMapper),
        ("last-mapper", Self::LastMapper),
        ("finer", Self::Finer),
        ("coarser", Self::Coarser),
        ("next-order", Self::NextOrder),
        ("quality", Self::Quality),
        ("help", Self::Help),
        ("info", Self::Info),
        ("split", Self::Split),
        ("hint", Self::Hint),
        ("reset", Self::Reset),
    ];

    /// Returns whether an action changes only the overlay of a running demo. A log contains no such action,
    /// and a held demo refuses it.
    pub const fn is_overlay(self) -> bool {
        matches!(self, Self::Help | Self::Info | Self::Split | Self::Hint)
    }

    /// Returns the action with a name.
    pub fn parse(name: &str) -> Option<Self> {
        let named = Self::ALL.iter().find(|(known, _)| *known == name);
        named.map(|&(_, action)| action)
    }
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = Self::ALL.iter().find(|(_, action)| action == self);
        f.write_str(named.map_or("", |(name, _)| name))
    }
}

/// A change to a running demo's frames, from a tick on.
///
/// `repr(u8)` keeps the tag in a byte before the payload, so a change to [`Action::YawLeft`] is all zeros. An
/// empty log then occupies no space in the kernel's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Change {
    /// `ACTION`
    Act(Action),
    /// `scene NAME`, `mapper NAME`, `order NAME`
    Set(Setting, Word),
}

impl Change {
    /// Parses a change, as [`fmt::Display`] writes it.
    pub fn parse<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Self> {
        let first = words.next()?;
        let change = match Setting::parse(first) {
            Some(setting) => Self::Set(setting, Word::new(words.next()?)?),
            None => Self::Act(Action::parse(first)?),
        };
        words.next().is_none().then_some(change)
    }
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Act(action) => action.fmt(f),
            Self::Set(setting, name) => write!(f, "{setting} {name}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_actions_change_only_how_a_show_is_looked_at() {
        for (name, action) in Action::ALL {
            let overlay = ["help", "info", "split", "hint"].contains(&name);
            assert_eq!(action.is_overlay(), overlay, "{name}");
        }
    }
}
