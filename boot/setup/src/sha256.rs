//! SHA-256, to verify downloads and files in the cache.

use sha2::{Digest, Sha256};

/// Returns the SHA-256 of `data` as 64 hexadecimal digits.
pub fn sha256(data: &[u8]) -> String {
    Sha256::digest(data)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}
