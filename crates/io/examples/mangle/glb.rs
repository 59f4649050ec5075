//! Splits and rebuilds GLB files, with correct or wrong lengths.

use crate::random::MangleRng;

/// Returns the JSON and the rest of a container, if it has both.
pub fn parts(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let length = u32::from_le_bytes(*bytes.get(12..)?.first_chunk()?) as usize;
    bytes.starts_with(b"glTF").then_some(())?;
    Some((bytes.get(20..20 + length)?, bytes.get(20 + length..)?))
}

/// Builds a container from a JSON text and the rest of another container.
pub fn container(mut json: Vec<u8>, rest: &[u8]) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let lengths =
        [20 + json.len() + rest.len(), json.len()].map(|length| (length as u32).to_le_bytes());
    [
        &b"glTF\x02\0\0\0"[..],
        &lengths[0],
        &lengths[1],
        b"JSON",
        &json,
        rest,
    ]
    .concat()
}

/// Corrupts the length of the file or of one of its first two chunks.
pub fn break_length(bytes: &mut [u8], rng: &mut MangleRng) {
    let second = parts(bytes).map_or(12, |(json, _)| 20 + json.len());
    let position = *rng.choose(&[8, 12, second]);
    let Some(place) = bytes
        .get_mut(position..)
        .and_then(|rest| rest.first_chunk_mut::<4>())
    else {
        return;
    };
    let length = u32::from_le_bytes(*place);
    let new = [
        0,
        1,
        3,
        length.wrapping_sub(1),
        length.wrapping_add(1),
        length.wrapping_mul(2),
        u32::MAX,
        u32::MAX - 7,
        1 << 31,
    ];
    *place = rng.choose(&new).to_le_bytes();
}
