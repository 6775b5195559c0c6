//! The key map: from scan codes to actions.
//!
//! Codes are in scan code set 1, as the keyboard controller sends them. A key is identified by its position;
//! the letters are those that a US keyboard has there.
//!
//! A key that is held down repeats. Actions that turn, approach or step act on every repeat; all other
//! actions act only on the first push. Codes can get lost when a machine is too busy to fetch them. If a
//! release is lost, the next push of that key looks like a repeat and may do nothing; the loss has no other
//! effect.

use core::fmt;

use pc_keyboard::{KeyCode, KeyState, ScancodeSet, ScancodeSet1};
use protocol::Action;

/// A key and its action.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// The key's name, for people.
    pub name: &'static str,
    /// The key, and a second key with the same action. The two are equal if no second key exists.
    codes: [KeyCode; 2],
    /// What the key does.
    pub action: Action,
    /// A one-line description, for people.
    pub about: &'static str,
}

/// All keys that have an action. Each action has one entry, except the hint, which has no key.
///
/// Kept by hand, because each entry has a description and key codes.
#[rustfmt::skip]
pub const KEYS: &[Key] = &[
    key("Left", [KeyCode::ArrowLeft; 2], Action::YawLeft, "turn to the left"),
    key("Right", [KeyCode::ArrowRight; 2], Action::YawRight, "turn to the right"),
    key("Up", [KeyCode::ArrowUp; 2], Action::PitchUp, "turn up"),
    key("Down", [KeyCode::ArrowDown; 2], Action::PitchDown, "turn down"),
    key("A", [KeyCode::A; 2], Action::RollLeft, "lean to the left"),
    key("D", [KeyCode::D; 2], Action::RollRight, "lean to the right"),
    key("+", [KeyCode::OemPlus, KeyCode::NumpadAdd], Action::Faster, "faster"),
    key("-", [KeyCode::OemMinus, KeyCode::NumpadSubtract], Action::Slower, "slower"),
    key("0", [KeyCode::Key0, KeyCode::Numpad0], Action::Stop, "stop turning"),
    key("Space", [KeyCode::Spacebar; 2], Action::Pause, "pause and resume"),
    key("S", [KeyCode::S; 2], Action::Step, "pause, then a tick at a time"),
    key("PgUp", [KeyCode::PageUp; 2], Action::Nearer, "nearer"),
    key("PgDn", [KeyCode::PageDown; 2], Action::Farther, "farther"),
    key("N", [KeyCode::N; 2], Action::NextScene, "next scene"),
    key("M", [KeyCode::M; 2], Action::NextMapper, "next mapper"),
    key("B", [KeyCode::B; 2], Action::LastMapper, "previous mapper"),
    key("F", [KeyCode::F; 2], Action::Finer, "finer: half the error of within-T"),
    key("C", [KeyCode::C; 2], Action::Coarser, "coarser: twice the error"),
    key("O", [KeyCode::O; 2], Action::NextOrder, "next order: polygons, planes, buffer"),
    key("L", [KeyCode::L; 2], Action::Quality, "reduced quality while it moves"),
    key("H", [KeyCode::H, KeyCode::F1], Action::Help, "help: the keys"),
    key("I", [KeyCode::I; 2], Action::Info, "info: figures of the frame"),
    key("X", [KeyCode::X; 2], Action::Split, "split: current, exact, error"),
    key("R", [KeyCode::R; 2], Action::Reset, "reset everything but the scene"),
];

const fn key(name: &'static str, codes: [KeyCode; 2], action: Action, about: &'static str) -> Key {
    Key {
        name,
        codes,
        action,
        about,
    }
}

/// Returns whether an action acts on every repeat of a key that is held down.
fn repeats(action: Action) -> bool {
    matches!(
        action,
        Action::YawLeft
            | Action::YawRight
            | Action::PitchUp
            | Action::PitchDown
            | Action::RollLeft
            | Action::RollRight
            | Action::Faster
            | Action::Slower
            | Action::Step
            | Action::Nearer
            | Action::Farther
    )
}

/// A keyboard's state: which keys are down.
pub(crate) struct Keyboard {
    set: ScancodeSet1,
    /// One bit for each [`KeyCode`].
    down: u128,
}

impl Keyboard {
    /// Returns a keyboard with no key down.
    pub const fn new() -> Self {
        Self {
            set: ScancodeSet1::new(),
            down: 0,
        }
    }

    /// Handles a code. Returns the action if the code completes a push of a key that has an action.
    pub fn push(&mut self, code: u8) -> Option<Action> {
        // An invalid code is ignored; the decoder starts again with the next code.
        let event = self.set.advance_state(code).ok()??;
        let bit = 1u128 << (event.code as u8 & 127);
        let again = self.down & bit != 0;
        match event.state {
            KeyState::Down => self.down |= bit,
            KeyState::Up | KeyState::SingleShot => {
                self.down &= !bit;
                return None;
            }
        }
        let key = KEYS.iter().find(|key| key.codes.contains(&event.code))?;
        (!again || repeats(key.action)).then_some(key.action)
    }
}

impl fmt::Debug for Keyboard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Keyboard({:x})", self.down)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    /// Codes of set 1: a letter's push is one byte, its release is that byte with bit 7 set, and an arrow's
    /// code follows E0.
    const A: u8 = 0x1E;
    const M: u8 = 0x32;
    const LEFT: u8 = 0x4B;
    const UP: u8 = 0x80;
    const EXTENDED: u8 = 0xE0;

    fn actions(keyboard: &mut Keyboard, codes: &[u8]) -> Vec<Action> {
        codes
            .iter()
            .filter_map(|&code| keyboard.push(code))
            .collect()
    }

    #[test]
    fn every_action_has_one_key_and_every_key_one_action() {
        for &action in Action::ALL {
            let keys = KEYS.iter().filter(|key| key.action == action);
            let expected = usize::from(action != Action::Hint);
            assert_eq!(keys.count(), expected, "{action}");
        }
        let mut codes: Vec<_> = KEYS.iter().flat_map(|key| key.codes).collect();
        let all = codes.len();
        codes.sort();
        codes.dedup();
        let single = KEYS.iter().filter(|key| key.codes[0] == key.codes[1]);
        assert_eq!(codes.len(), all - single.count());
        // Every code fits a bit of `Keyboard::down`.
        assert!((KeyCode::Unknown as u8) < 128);
    }

    #[test]
    fn a_repeat_turns_and_does_not_toggle() {
        let mut keyboard = Keyboard::new();
        let left = [EXTENDED, LEFT];
        let held = actions(&mut keyboard, &[left; 5].concat());
        assert_eq!(held, [Action::YawLeft; 5]);
        // After another key is pushed, the keyboard repeats that key instead.
        let held = actions(&mut keyboard, &[M, M, M, A, A, M | UP, A, M]);
        let [m, a] = [Action::NextMapper, Action::RollLeft];
        assert_eq!(held, [m, a, a, a, m]);
        let released = actions(&mut keyboard, &[EXTENDED, LEFT | UP, A | UP, M | UP, M]);
        assert_eq!(released, [m]);
    }

    #[test]
    fn a_lost_code_costs_at_most_one_push() {
        // The release was lost.
        let mut keyboard = Keyboard::new();
        assert_eq!(
            actions(&mut keyboard, &[M, M, M | UP, M]),
            [Action::NextMapper; 2]
        );
        // The prefix E0 was lost, or M got one by a loss: keypad 4 has no action, and neither has E0 M.
        let mut keyboard = Keyboard::new();
        assert_eq!(
            actions(&mut keyboard, &[LEFT, LEFT | UP, EXTENDED, M, M]),
            [Action::NextMapper]
        );
    }

    /// Any bytes: no panic, and a key works afterwards.
    #[test]
    fn after_any_codes_a_key_still_works() {
        let mut random = seeded::generator();
        for _ in 0..1000 {
            let mut keyboard = Keyboard::new();
            for _ in 0..random.usize(..200) {
                keyboard.push(random.u8(..));
            }
            let pushed = actions(&mut keyboard, &[M | UP, M | UP, M]);
            assert_eq!(pushed, [Action::NextMapper]);
        }
    }
}
