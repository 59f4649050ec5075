//! GLB container (glTF 2.0, section 4): a header, a JSON chunk, and an optional binary chunk.
//!
//! This parser replaces `gltf::Glb`, which has two defects: it panics for a length below 12, and it
//! refuses unknown chunks, although the specification requires readers to skip them.

use crate::import::{FaultPlace, ImportResult, Warnings};

/// The two chunks of a GLB file that glTF defines.
#[derive(Debug)]
pub(super) struct GlbContainer<'a> {
    /// Text of the JSON chunk, padding included.
    pub json: &'a [u8],
    /// The binary chunk, padding included.
    pub binary: Option<&'a [u8]>,
}

/// Whether a file is a GLB container, by its signature.
pub(super) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(b"glTF")
}

/// Splits a GLB file into its chunks.
///
/// # Errors
/// A fault of kind input that describes the defect of the container.
pub(super) fn parse<'a>(
    bytes: &'a [u8],
    warnings: &mut Warnings,
) -> ImportResult<GlbContainer<'a>> {
    let (Some(version), Some(length)) = (read_u32(bytes, 4), read_u32(bytes, 8)) else {
        return Err(fault!("is a GLB file that ends inside its header"));
    };
    if version != 2 {
        return Err(fault!(
            "is a GLB file of version {version}, but only version 2 is supported"
        ));
    }
    let have = bytes.len() as u64;
    if u64::from(length) > have {
        return Err(fault!(
            "is a truncated GLB file with {have} of {length} bytes"
        ));
    }
    if u64::from(length) < have {
        warn!(
            warnings,
            Format,
            "the GLB header states {length} bytes, but the file has {have} bytes: the bytes after the stated length were ignored"
        );
    }
    let mut rest = bytes.get(12..length as usize).ok_or_else(|| {
        fault!("is a GLB file whose header states {length} bytes, fewer than the header itself has")
    })?;
    let (mut json, mut binary) = (None, None);
    let mut number = 0_usize;
    while !rest.is_empty() {
        let (kind, data, after) =
            split_off_chunk(rest).with_place(format_args!("GLB chunk {number}"))?;
        match kind {
            b"JSON" if number == 0 => json = Some(data),
            b"JSON" => {
                return Err(fault!("GLB chunk {number}: is a second JSON chunk"));
            }
            b"BIN\0" if number > 0 && binary.is_none() => binary = Some(data),
            _ if number == 0 => {
                return Err(fault!("is a GLB file whose first chunk is not its JSON"));
            }
            // "Implementations MUST ignore chunks with unknown types."
            _ => warn!(
                warnings,
                Unsupported, "GLB chunk {number}, of unknown type, was ignored"
            ),
        }
        rest = after;
        number += 1;
    }
    let json = json.ok_or_else(|| fault!("is a GLB file without chunks"))?;
    Ok(GlbContainer { json, binary })
}

/// Splits off the first chunk. Returns the type and the data of the chunk, and the bytes after the
/// chunk.
fn split_off_chunk(bytes: &[u8]) -> ImportResult<(&[u8], &[u8], &[u8])> {
    let (Some(length), Some(kind)) = (read_u32(bytes, 0), bytes.get(4..8)) else {
        return Err(fault!("the file ends inside the chunk's header"));
    };
    let body = &bytes[8..];
    match body.split_at_checked(length as usize) {
        Some((data, after)) => Ok((kind, data, after)),
        None => Err(fault!(
            "its header states {length} bytes, but only {} bytes follow",
            body.len()
        )),
    }
}

/// Reads a little-endian 32-bit number at a byte position; `None` beyond the end.
fn read_u32(bytes: &[u8], position: usize) -> Option<u32> {
    bytes
        .get(position..position + 4)?
        .try_into()
        .ok()
        .map(u32::from_le_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(length: u32, chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut out = [
            b"glTF".as_slice(),
            &2_u32.to_le_bytes(),
            &length.to_le_bytes(),
        ]
        .concat();
        for (kind, data) in chunks {
            out.extend((data.len() as u32).to_le_bytes());
            out.extend(*kind);
            out.extend(*data);
        }
        out
    }

    /// Protects: unknown chunks are skipped, as the specification demands; the binary chunk after
    /// them is found.
    #[test]
    fn unknown_chunks_are_skipped() {
        let bytes = glb(
            12 + 8 + 2 + 8 + 3 + 8 + 1,
            &[(b"JSON", b"{}"), (b"WHAT", b"abc"), (b"BIN\0", b"x")],
        );
        let mut warnings = Warnings::default();
        let parts = parse(&bytes, &mut warnings).unwrap();
        assert_eq!(
            (parts.json, parts.binary),
            (b"{}".as_slice(), Some(b"x".as_slice()))
        );
        assert_eq!(warnings.into_warnings("x.glb").len(), 1);
    }

    /// Protects: a length below the header's own size is refused; a subtraction from it would
    /// overflow.
    #[test]
    fn tiny_lengths_are_refused() {
        for length in 0..12 {
            let bytes = glb(length, &[(b"JSON", b"{}")]);
            assert!(
                parse(&bytes, &mut Warnings::default()).is_err(),
                "length {length}"
            );
        }
    }
}
