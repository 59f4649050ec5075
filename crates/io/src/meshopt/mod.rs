//! Decoder of buffer views that meshoptimizer compressed, written from the specifications of
//! EXT_meshopt_compression and KHR_meshopt_compression. It decodes vertices, triangles, index
//! sequences and filters, in versions 0 and 1 of each codec.
//!
//! No length in a packet is trusted: only existing bytes are read, and a packet must end with its
//! last element.

mod filters;
mod indices;
mod vertices;

pub(crate) use filters::{
    decode_colours, decode_exponential, decode_octahedral, decode_quaternions,
};
pub(crate) use indices::{decode_index_sequence, decode_triangles};
pub(crate) use vertices::decode_vertices;

/// Description of a fault in a packet.
pub(crate) type PacketFault = &'static str;

const TOO_SHORT: PacketFault = "the compressed data ends before the last element";
const TOO_LONG: PacketFault = "the compressed data continues after the last element";
const WRONG_STRIDE: PacketFault = "the byteStride is invalid for this mode or filter";

/// Checks the first byte of a packet, which holds the codec (`kind`) and the codec's version.
/// Returns the version and the other bytes.
fn parse_header(packet: &[u8], kind: u8) -> Result<(u8, &[u8]), PacketFault> {
    let (first, rest) = packet.split_first().ok_or(TOO_SHORT)?;
    match first ^ kind {
        version @ 0..=1 => Ok((version, rest)),
        2..=15 => Err("the version of the compression codec is not supported"),
        _ => Err("the first byte of the compressed data is that of another codec"),
    }
}

/// Removes `length` bytes from the front of `rest`, and returns them.
fn split_off_bytes<'p>(rest: &mut &'p [u8], length: usize) -> Result<&'p [u8], PacketFault> {
    rest.split_off(..length).ok_or(TOO_SHORT)
}

/// Decodes a zigzag code: 0, 1, 2, 3 stand for the differences 0, -1, 1, -2.
fn decode_zigzag(code: u32) -> u32 {
    (code >> 1) ^ (code & 1).wrapping_neg()
}

#[cfg(test)]
mod tests;
