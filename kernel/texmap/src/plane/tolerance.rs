//! Tolerances: the error that a user accepts.

use core::fmt;

/// An acceptable error: 1 to 2^24 units of 2^-16 texel, which is 2^-16 to 256 texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Tolerance(u32);

impl Tolerance {
    /// Returns the fraction of a texel, rounded down to 2^-16, or nothing if it is below 2^-16 or above 256
    /// texels.
    pub const fn new(numerator: u32, denominator: u32) -> Option<Self> {
        if denominator == 0 {
            return None;
        }
        match ((numerator as u64) << 16) / denominator as u64 {
            units @ 1..=0x100_0000 => Some(Self(units as u32)),
            _ => None,
        }
    }

    /// Returns the error in units of 2^-16 texel.
    pub const fn units(self) -> u32 {
        self.0
    }

    /// Parses a whole number, or a fraction of two whole numbers: `2`, `1/256`.
    pub fn parse(text: &str) -> Option<Self> {
        let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
        Self::new(numerator.parse().ok()?, denominator.parse().ok()?)
    }

    /// One texel.
    pub const TEXEL: Self = Self::part(0);

    /// Returns half of this tolerance, or nothing if that is out of range.
    pub const fn half(self) -> Option<Self> {
        Self::new(self.0, 1 << 17)
    }

    /// Returns twice this tolerance, or nothing if that is out of range.
    pub const fn double(self) -> Option<Self> {
        Self::new(2 * self.0, 1 << 16)
    }

    /// Returns 1 / 2^`bits` texel, for at most 16 bits.
    pub(crate) const fn part(bits: u32) -> Self {
        Self(1 << (16 - bits))
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let common = self.0.trailing_zeros().min(16);
        match (self.0 >> common, 1u32 << (16 - common)) {
            (numerator, 1) => write!(f, "{numerator}"),
            (numerator, denominator) => write!(f, "{numerator}/{denominator}"),
        }
    }
}
