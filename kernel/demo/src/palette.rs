//! Nearest colours in an arbitrary palette.

use modex::{Palette, Rgb6};

/// Returns the entry of a palette that is nearest to a colour, by the sum of squared differences.
pub fn nearest(palette: &Palette, colour: Rgb6) -> u8 {
    let distance = |entry: &Rgb6| -> u32 {
        let parts = entry.iter().zip(colour);
        parts.map(|(&a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
    };
    let entries = (0..=u8::MAX).zip(palette);
    let nearest = entries.min_by_key(|(_, entry)| distance(entry));
    nearest.map_or(0, |(index, _)| index)
}
