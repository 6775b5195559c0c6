//! Settings, and the names that they can have.

use core::fmt;

use strum::{Display, EnumString};

/// A setting that commands change by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Display, EnumString)]
#[strum(serialize_all = "kebab-case")]
pub enum Setting {
    /// `scene`: the scene to draw. The card's mode is set again; in a running demo, only if the scene
    /// changes.
    Scene,
    /// `mapper`: the mapper of textures.
    Mapper,
    /// `order`: the order in which a frame's spans are drawn, and the memory that they are drawn in.
    Order,
}

/// A word of a command, such as the name of a scene, that only the demo can interpret.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    bytes: [u8; Self::MAX],
    len: u8,
}

impl Word {
    /// Most characters in a word.
    pub const MAX: usize = 24;

    /// Returns a word, if `text` is 1 to [`Word::MAX`] printable ASCII characters without a space.
    pub fn new(text: &str) -> Option<Self> {
        let legal = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_graphic());
        let mut bytes = [0; Self::MAX];
        bytes
            .get_mut(..text.len())
            .filter(|_| legal)?
            .copy_from_slice(text.as_bytes());
        let len = text.len() as u8;
        Some(Self { bytes, len })
    }

    /// Returns the word that `named` displays as, if that is a legal word.
    pub fn of(named: impl fmt::Display) -> Option<Self> {
        struct Text([u8; Word::MAX], usize);
        impl fmt::Write for Text {
            fn write_str(&mut self, text: &str) -> fmt::Result {
                let end = self.1 + text.len();
                let place = self.0.get_mut(self.1..end).ok_or(fmt::Error)?;
                place.copy_from_slice(text.as_bytes());
                self.1 = end;
                Ok(())
            }
        }
        let mut text = Text([0; Self::MAX], 0);
        fmt::write(&mut text, format_args!("{named}")).ok()?;
        Self::new(core::str::from_utf8(&text.0[..text.1]).ok()?)
    }

    /// Returns the word's text.
    pub fn as_str(&self) -> &str {
        // `new` has checked that the bytes are ASCII.
        core::str::from_utf8(&self.bytes[..self.len.into()]).unwrap_or_default()
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
