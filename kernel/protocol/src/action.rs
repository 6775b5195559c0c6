//! Actions that steer a running demo, by a key or by the command `steer`.

use core::fmt;

use strum::{Display, EnumString, VariantArray};

use crate::{Setting, Word};

/// An action. Each key that does something has one action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Display, EnumString, VariantArray)]
#[strum(serialize_all = "kebab-case")]
#[repr(u8)]
pub enum Action {
    /// `yaw-left`: turn about the solid's own axis; the side towards the viewer moves to the left.
    YawLeft,
    /// `yaw-right`: the opposite of `yaw-left`.
    YawRight,
    /// `pitch-up`: turn about the screen's horizontal axis; the side towards the viewer moves up.
    PitchUp,
    /// `pitch-down`: the opposite of `pitch-up`.
    PitchDown,
    /// `roll-left`: turn about the line of sight; the top moves to the left.
    RollLeft,
    /// `roll-right`: the opposite of `roll-left`.
    RollRight,
    /// `faster`: speed up all motion; if nothing moves, start the scene's own motion.
    Faster,
    /// `slower`: slow down all motion.
    Slower,
    /// `stop`: stop the scene's own motion and all turns.
    Stop,
    /// `pause`: stop all motion, or continue it.
    Pause,
    /// `step`: pause; if paused already, advance by one tick.
    Step,
    /// `nearer`: move the solid towards the viewer.
    Nearer,
    /// `farther`: move the solid away from the viewer.
    Farther,
    /// `next-scene`: show the next scene in the list.
    NextScene,
    /// `next-mapper`: use the next mapper in the list.
    NextMapper,
    /// `last-mapper`: use the mapper before the current mapper in the list.
    LastMapper,
    /// `finer`: halve the error bound of `within-T`.
    Finer,
    /// `coarser`: double the error bound of `within-T`.
    Coarser,
    /// `next-order`: use the next order in the list.
    NextOrder,
    /// `quality`: switch reduced quality on or off, for faces whose motion hides it.
    Quality,
    /// `help`: switch the list of keys over the frame on or off.
    Help,
    /// `info`: switch the figures over the frames on or off.
    Info,
    /// `split`: switch the split view on or off: the frame as it is, the exact frame, and the error.
    Split,
    /// `hint`: show for five seconds which key shows the help.
    Hint,
    /// `reset`: restore the scene's own motion and the default settings. The scene stays.
    Reset,
}

impl Action {
    /// All actions.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// Returns whether an action changes only the overlay of a running demo. A log contains no such action,
    /// and a held demo refuses it.
    pub const fn is_overlay(self) -> bool {
        matches!(self, Self::Help | Self::Info | Self::Split | Self::Hint)
    }
}

/// A change to a running demo's frames, from a tick on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
        let change = match first.parse() {
            Ok(setting) => Self::Set(setting, Word::new(words.next()?)?),
            Err(_) => Self::Act(first.parse().ok()?),
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
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn four_actions_change_only_the_overlay() {
        for action in Action::ALL {
            let name = action.to_string();
            let overlay = ["help", "info", "split", "hint"].contains(&name.as_str());
            assert_eq!(action.is_overlay(), overlay, "{name}");
        }
    }
}
