//! References of glTF files: data that travels inside the reference, or the name of a file beside the scene.

use base64::Engine as _;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use crate::folder::{Folder, ReadError};
use crate::import::{Fault, Outcome, shown};

/// Writers differ in how they end base64 data; what they mean is never in doubt.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent).with_decode_allow_trailing_bits(true),
);

/// Whether a reference carries its data itself.
pub(crate) fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|head| head.eq_ignore_ascii_case("data:"))
}

/// Reads what a reference means (RFC 3986 relative references and RFC 2397 data).
///
/// # Errors
/// A fault of kind input: broken base64, a percent escape that is not UTF-8, or a file that [`Folder::read`] refuses.
pub(crate) fn read(folder: &Folder, uri: &str) -> Outcome<Vec<u8>> {
    if is_data(uri) {
        return data(uri.get(5..).unwrap_or_default());
    }
    let decoded = percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| Fault::input(format!("`{}` has a percent escape that is not UTF-8", shown(uri))))?;
    match folder.read(&decoded) {
        // Some writers do not escape: a file may really be called `50%25.png`.
        Err(ReadError::Unreadable(why)) if decoded.as_ref() != uri => {
            folder.read(uri).map_err(|_| ReadError::Unreadable(why).into())
        }
        other => other.map_err(Fault::from),
    }
}

/// The bytes of a data reference, given what follows `data:`.
fn data(text: &str) -> Outcome<Vec<u8>> {
    let (head, body) = text.split_once(',').ok_or_else(|| Fault::input("a data: reference without a comma"))?;
    let bytes: Vec<u8> = percent_decode_str(body).collect();
    if !head.split(';').any(|parameter| parameter.trim().eq_ignore_ascii_case("base64")) {
        return Ok(bytes);
    }
    let packed: Vec<u8> = bytes.into_iter().filter(|b| !b.is_ascii_whitespace()).collect();
    BASE64.decode(packed).map_err(|e| Fault::input(format!("a data: reference with broken base64 ({e})")))
}
