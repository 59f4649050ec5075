//! The hash of what a scene was made from, worked out when someone asks: a preview of a small model
//! takes less time than its hash.

use std::fmt;
use std::sync::OnceLock;

use sha2::{Digest, Sha256};

/// Bytes that are put aside. What is larger is hashed as it comes and kept nowhere.
const ASIDE: usize = 1 << 20;

/// SHA-256 of pieces of bytes, in order, each with its length before it; shown as 64 hexadecimal
/// digits. Where the processor has no instructions for it, hashing takes fifty of others a byte, so
/// a megabyte at most waits until it is shown.
#[derive(Clone, Debug, Default)]
pub struct SceneHash {
    so_far: Sha256,
    /// What comes after that.
    aside: Vec<u8>,
    /// The digits, once they were asked for.
    digits: OnceLock<String>,
}

impl SceneHash {
    /// Adds a piece.
    pub(crate) fn note(&mut self, bytes: &[u8]) {
        self.digits.take();
        let length = (bytes.len() as u64).to_le_bytes();
        if self.aside.len() + length.len() + bytes.len() <= ASIDE {
            self.aside.extend(length);
            self.aside.extend(bytes);
            return;
        }
        self.so_far.update(&self.aside);
        self.aside.clear();
        self.so_far.update(length);
        self.so_far.update(bytes);
    }
}

impl fmt::Display for SceneHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.digits.get_or_init(|| {
            let all = self.so_far.clone().chain_update(&self.aside).finalize();
            all.iter().map(|byte| format!("{byte:02x}")).collect()
        }))
    }
}

impl PartialEq for SceneHash {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl Eq for SceneHash {}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the hash is SHA-256 of lengths and pieces (FIPS 180-4), whether pieces waited,
    /// were too large to, or came before or after one that was, and asking for it changes nothing.
    #[test]
    fn what_waits_counts_as_what_does_not() {
        let expected = |pieces: &[&[u8]]| {
            let all: Vec<u8> = pieces
                .iter()
                .flat_map(|piece| [&(piece.len() as u64).to_le_bytes()[..], piece].concat())
                .collect();
            Sha256::digest(all)
                .iter()
                .map(|byte| format!("{byte:02x}"))
                .collect::<String>()
        };
        let large = vec![7; ASIDE];
        let half = vec![9; ASIDE / 2];
        let lists: [&[&[u8]]; 5] = [
            &[],
            &[b"a", b""],
            &[b"a", &large, b"b"],
            &[&half, &half, &half, b"c"],
            &[&large[..ASIDE - 8], b"d"],
        ];
        for pieces in lists {
            let mut hash = SceneHash::default();
            for (i, piece) in pieces.iter().enumerate() {
                assert_eq!(hash.to_string(), expected(&pieces[..i]));
                hash.note(piece);
                assert!(hash.aside.len() <= ASIDE);
            }
            assert_eq!(hash.to_string(), expected(pieces));
        }
    }
}
