//! Faults: what is wrong, the access that caused it, and the state.

use std::fmt;

/// An access of the program to the card.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// A byte written to a port.
    Out8(u16, u8),
    /// A word written to a port.
    Out16(u16, u16),
    /// A byte read from a port.
    In8(u16),
    /// A word read from a port.
    In16(u16),
    /// A byte stored in the window.
    Store(u16, u8),
    /// A byte read from the window.
    Load(u16),
    /// No access: the screen was examined.
    ScanOut,
}

impl fmt::Display for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Out8(port, value) => write!(f, "out {port:03X}h, {value:02X}h"),
            Self::Out16(port, value) => write!(f, "out {port:03X}h, {value:04X}h"),
            Self::In8(port) => write!(f, "in {port:03X}h (byte)"),
            Self::In16(port) => write!(f, "in {port:03X}h (word)"),
            Self::Store(at, value) => write!(f, "store A000:{at:04X}, {value:02X}h"),
            Self::Load(at) => write!(f, "load A000:{at:04X}"),
            Self::ScanOut => f.write_str("scan-out"),
        }
    }
}

/// An access that real hardware would not perform as intended, or that no scene makes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The fault's name, a fixed text that tests compare.
    pub name: &'static str,
    /// The access that caused it.
    pub access: Access,
    /// The state that made the access wrong.
    pub state: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}): {}", self.name, self.access, self.state)
    }
}

/// A block's complaint about an access: the fault's name and its state.
pub(crate) type Complaint = (&'static str, String);
