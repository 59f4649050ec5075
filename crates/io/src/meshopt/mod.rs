//! Decoder of meshoptimizer's buffer views, by the texts of EXT_meshopt_compression and
//! KHR_meshopt_compression: vertices, triangles, index sequences, and filters. Versions 0 and 1 of
//! each codec are supported.
//!
//! No length in a packet is trusted: only existing bytes are read, and a packet must end with its
//! last element.

mod filters;
mod indices;
mod vertices;

pub(crate) use filters::{colours, exponential, octahedral, quaternions};
pub(crate) use indices::{sequence, triangles};
pub(crate) use vertices::vertices;

/// Description of a fault in a packet.
pub(crate) type Broken = &'static str;

const SHORT: Broken = "it ends too early";
const LONG: Broken = "something follows its end";
const STRIDE: Broken = "no elements of this packet have this many bytes";

/// Checks the first byte of a packet, which holds the codec `kind` and the version. Returns the
/// version and the bytes after the first.
fn opened(packet: &[u8], kind: u8) -> Result<(u8, &[u8]), Broken> {
    let (first, rest) = packet.split_first().ok_or(SHORT)?;
    match first ^ kind {
        version @ 0..=1 => Ok((version, rest)),
        2..=15 => Err("its version is not read here"),
        _ => Err("its first byte is another codec's"),
    }
}

/// Splits `length` bytes off the front of `rest`.
fn take<'p>(rest: &mut &'p [u8], length: usize) -> Result<&'p [u8], Broken> {
    rest.split_off(..length).ok_or(SHORT)
}

/// Decodes a zigzag code: 0, 1, 2, 3 stand for the differences 0, -1, 1, -2.
fn difference(code: u32) -> u32 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}

#[cfg(test)]
mod tests;
