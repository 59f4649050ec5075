//! References in glTF files. A reference is embedded data, or the name of a file beside the scene.

use std::borrow::Cow;

use base64::Engine as _;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use crate::folder::{Folder, ReadError};
use crate::import::{Fault, ImportResult, sanitise_text};

/// Base64 decoder that accepts data with and without padding. Programs pad data differently, and
/// the content is unambiguous in either case.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Whether a reference embeds its data.
pub(crate) fn is_data_uri(uri: &str) -> bool {
    uri.get(..5)
        .is_some_and(|head| head.eq_ignore_ascii_case("data:"))
}

/// Records the file that a reference names as an input, without reading the file.
pub(crate) fn record_reference(folder: &Folder, uri: &str) {
    if !is_data_uri(uri) {
        folder.record_reference(&percent_decode_str(uri).decode_utf8_lossy());
        folder.record_reference(uri);
    }
}

/// Returns the data of a reference. The reference is embedded data (`data:`, RFC 2397) or a
/// relative reference to a file (RFC 3986).
///
/// # Errors
///
/// A fault of kind input for broken base64, a percent escape that is not UTF-8, or a file that
/// [`Folder::read`] refuses.
pub(crate) fn read_reference(folder: &Folder, uri: &str) -> ImportResult<Vec<u8>> {
    if is_data_uri(uri) {
        return decode_data_uri(uri.get(5..).unwrap_or_default());
    }
    let decoded = percent_decode_str(uri).decode_utf8().map_err(|_| {
        fault!(
            "`{}` has a percent escape that is not UTF-8",
            sanitise_text(uri)
        )
    })?;
    // Some programs do not escape names, so that a file may be called `50%25.png`; other programs
    // separate folders by backslashes, as Windows does.
    let others = [uri.to_owned(), decoded.replace('\\', "/")];
    match folder.read(&decoded) {
        Err(ReadError::Unreadable(reason)) => {
            let mut found = others
                .iter()
                .filter(|other| **other != decoded)
                .filter_map(|other| folder.read(other).ok());
            found
                .next()
                .ok_or_else(|| ReadError::Unreadable(reason).into())
        }
        other => other.map_err(Fault::from),
    }
}

/// Decodes the data of an embedded reference; `text` is the reference without its leading `data:`.
fn decode_data_uri(text: &str) -> ImportResult<Vec<u8>> {
    let (head, body) = text
        .split_once(',')
        .ok_or_else(|| fault!("a data: URI has no comma"))?;
    let bytes: Cow<[u8]> = percent_decode_str(body).into();
    if !head
        .split(';')
        .any(|parameter| parameter.trim().eq_ignore_ascii_case("base64"))
    {
        return Ok(bytes.into_owned());
    }
    // Embedded buffers may have a gigabyte, so that they are copied only if they contain line
    // breaks.
    let base64 = match bytes.iter().any(u8::is_ascii_whitespace) {
        true => bytes
            .iter()
            .copied()
            .filter(|b| !b.is_ascii_whitespace())
            .collect(),
        false => bytes,
    };
    BASE64
        .decode(base64)
        .map_err(|e| fault!("a data: URI has invalid base64 ({e})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: base64 with and without padding, with escapes and line breaks, and plain
    /// percent-encoded text.
    #[test]
    fn data_references_are_decoded() {
        for text in [
            ";base64,QUJD",
            "x/y;charset=z;BASE64,QUJD",
            ";base64,QU\r\nJD",
            ";base64,QUJ%44",
            ",ABC",
            ",%41BC",
        ] {
            assert_eq!(decode_data_uri(text), Ok(b"ABC".to_vec()), "{text}");
        }
        for text in [";base64,QQ==", ";base64,QQ", ";base64,QQ%3D%3D"] {
            assert_eq!(decode_data_uri(text), Ok(b"A".to_vec()), "{text}");
        }
        for text in [";base64", ";base64,@@@", ";base64,Q"] {
            assert!(decode_data_uri(text).is_err(), "{text}");
        }
    }

    /// Protects: escapes are decoded, and a file whose name contains the escape is found as well.
    #[test]
    fn names_are_read_escaped_and_as_they_are() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a b.bin"), "1").unwrap();
        std::fs::write(folder.path().join("50%25.bin"), "2").unwrap();
        let folder = Folder::parent_of(&folder.path().join("x.gltf"), 100).unwrap();
        assert_eq!(read_reference(&folder, "a%20b.bin"), Ok(b"1".to_vec()));
        assert_eq!(read_reference(&folder, "a b.bin"), Ok(b"1".to_vec()));
        assert_eq!(read_reference(&folder, "50%25.bin"), Ok(b"2".to_vec()));
        assert_eq!(
            read_reference(&folder, ".\\a%20b.bin"),
            Ok(b"1".to_vec()),
            "as Windows parts folders"
        );
        for uri in [
            "%2e%2e/x",
            "%2Fetc/passwd",
            "file:///etc/passwd",
            "http://localhost/x",
            "%FF.bin",
            "..\\x",
            "%5Cetc%5Cpasswd",
        ] {
            assert!(read_reference(&folder, uri).is_err(), "{uri}");
        }
    }
}
