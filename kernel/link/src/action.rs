//! What a running show can be told to do: by a key, or by `steer` on the line.

use core::fmt;

use crate::{Setting, Word};

/// One thing to do, as one key does it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Action {
    /// `yaw-left`: turn about the solid's own axis, what looks at the viewer to the left.
    YawLeft,
    /// `yaw-right`
    YawRight,
    /// `pitch-up`: turn about the screen's horizontal, what looks at the viewer up.
    PitchUp,
    /// `pitch-down`
    PitchDown,
    /// `roll-left`: turn about the line of sight, the top to the left.
    RollLeft,
    /// `roll-right`
    RollRight,
    /// `faster`: everything that moves; what stands still begins to, as the scene has it.
    Faster,
    /// `slower`
    Slower,
    /// `stop`: nothing moves.
    Stop,
    /// `pause`: nothing moves until it is said again.
    Pause,
    /// `step`: pause, and then a tick each time.
    Step,
    /// `nearer`
    Nearer,
    /// `farther`
    Farther,
    /// `next-scene`
    NextScene,
    /// `next-mapper`
    NextMapper,
    /// `last-mapper`: the one before.
    LastMapper,
    /// `finer`: half the error of `within-T`.
    Finer,
    /// `coarser`: twice the error.
    Coarser,
    /// `next-order`
    NextOrder,
    /// `quality`: lower while it moves, where motion hides it, or no more.
    Quality,
    /// `help`: the keys, written over the picture, or no more.
    Help,
    /// `info`: figures of the pictures, written over them, or no more.
    Info,
    /// `split`: the picture three times, as it is, exact, and its error, or no more.
    Split,
    /// `hint`: for five seconds, which key is help.
    Hint,
    /// `reset`: move as the scene does, with the default settings. The scene stays.
    Reset,
}

impl Action {
    /// Every action with its name on the line.
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

    /// Whether it changes nothing but how a running show is looked at. A log has none of these, and
    /// a held show no use for them.
    pub const fn is_overlay(self) -> bool {
        matches!(self, Self::Help | Self::Info | Self::Split | Self::Hint)
    }

    /// The action of a name.
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

/// What changes a running show's pictures from a tick on.
///
/// The tag stands apart, and [`Action::YawLeft`] is all zeros: a log that is empty then takes no room
/// in the kernel's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Change {
    /// `ACTION`
    Act(Action),
    /// `scene NAME`, `mapper NAME`, `order NAME`
    Set(Setting, Word),
}

impl Change {
    /// Reads a change, as [`fmt::Display`] writes it.
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
