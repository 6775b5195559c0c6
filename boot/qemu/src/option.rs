//! QEMU's options as a user writes them.

use std::ffi::OsString;

/// Options that choose an accelerator, besides `-machine accel=`.
const ACCELERATOR_OPTIONS: [&str; 4] = ["accel", "enable-kvm", "enable-hax", "enable-hvf"];

/// Returns the name of an option without its dashes. QEMU accepts one dash or two.
pub fn option(word: &str) -> Option<&str> {
    word.strip_prefix("--").or_else(|| word.strip_prefix('-'))
}

/// Returns whether the arguments choose an accelerator, in any of QEMU's spellings.
pub fn names_accelerator(arguments: &[OsString]) -> bool {
    let words: Vec<_> = arguments
        .iter()
        .map(|word| word.to_string_lossy())
        .collect();
    words.iter().enumerate().any(|(at, word)| {
        let value = words.get(at + 1).map_or("", |value| value.as_ref());
        match option(word) {
            Some("machine" | "M") => value.split(',').any(|part| part.starts_with("accel=")),
            Some(name) => ACCELERATOR_OPTIONS.contains(&name),
            None => false,
        }
    })
}
