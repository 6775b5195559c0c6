//! SHA-256, by which downloads and kept files are verified.

use sha2::{Digest, Sha256};

/// Returns the hash as 64 hexadecimal digits.
pub fn sha256(data: &[u8]) -> String {
    Sha256::digest(data)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}
