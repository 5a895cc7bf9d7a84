//! Short names for things: the first 16 hexadecimal digits of a SHA-256.

use sha2::{Digest as _, Sha256};

/// The first 64 bits of a finished hash, as 16 hexadecimal digits.
pub(crate) fn short(hash: Sha256) -> String {
    let digest: [u8; 32] = hash.finalize().into();
    format!("{:016x}", digest.first_chunk().map_or(0, |first| u64::from_be_bytes(*first)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_digits_of_the_whole_are_kept() {
        // The SHA-256 of "abc", FIPS 180-4.
        assert_eq!(short(Sha256::new_with_prefix("abc")), "ba7816bf8f01cfea");
    }
}
