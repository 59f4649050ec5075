//! Hash of a scene's sources. The hash is computed on request only, because hashing a small model
//! takes longer than a preview of the model.

use std::fmt;
use std::sync::OnceLock;

use sha2::{Digest, Sha256};

/// Largest number of buffered bytes. If the bytes of an [`SceneHash::add_bytes`] call do not fit,
/// the buffer and these bytes are hashed immediately.
const BUFFER_BYTES: usize = 1 << 20;

/// SHA-256 of a sequence of byte strings, each preceded by its length; displayed as 64 hexadecimal
/// digits. Hashing takes fifty instructions per byte on a processor without SHA instructions.
/// Therefore up to a megabyte is kept in a buffer, which is hashed only when it is full or when the
/// hash is displayed.
#[derive(Clone, Debug, Default)]
pub struct SceneHash {
    hasher: Sha256,
    /// Bytes that were added but are not hashed yet.
    buffer: Vec<u8>,
    /// The 64 hexadecimal digits, once computed.
    digits: OnceLock<String>,
}

impl SceneHash {
    /// Adds a byte string.
    pub(crate) fn add_bytes(&mut self, bytes: &[u8]) {
        self.digits.take();
        let length = (bytes.len() as u64).to_le_bytes();
        if self.buffer.len() + length.len() + bytes.len() <= BUFFER_BYTES {
            self.buffer.extend(length);
            self.buffer.extend(bytes);
            return;
        }
        self.hasher.update(&self.buffer);
        self.buffer.clear();
        self.hasher.update(length);
        self.hasher.update(bytes);
    }
}

impl fmt::Display for SceneHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.digits.get_or_init(|| {
            let all = self.hasher.clone().chain_update(&self.buffer).finalize();
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

    /// Protects: the hash is SHA-256 of lengths and pieces (FIPS 180-4), whether pieces were
    /// buffered or too large, in any order, and reading the hash changes nothing.
    #[test]
    fn hash_of_pieces_is_sha256() {
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
        let large = vec![7; BUFFER_BYTES];
        let half = vec![9; BUFFER_BYTES / 2];
        let lists: [&[&[u8]]; 5] = [
            &[],
            &[b"a", b""],
            &[b"a", &large, b"b"],
            &[&half, &half, &half, b"c"],
            &[&large[..BUFFER_BYTES - 8], b"d"],
        ];
        for pieces in lists {
            let mut hash = SceneHash::default();
            for (i, piece) in pieces.iter().enumerate() {
                assert_eq!(hash.to_string(), expected(&pieces[..i]));
                hash.add_bytes(piece);
                assert!(hash.buffer.len() <= BUFFER_BYTES);
            }
            assert_eq!(hash.to_string(), expected(pieces));
        }
    }
}
