//! Import of STL, binary and ASCII ("StereoLithography Interface Specification", 3D Systems, 1988),
//! with the two common dialects of colours in binary files.
//!
//! A file is a single mesh of flat facets. Their normals follow from their corners by the
//! right-hand rule: the written normals are equal or wrong, and many programs write zeros. The kind
//! of a file is detected from its length and content, because many binary files begin with the
//! keyword of ASCII files.
//!
//! `stl_io` reads neither colours nor loops of more than three corners, and allocates by the count
//! that a file claims; therefore this reader does not use that crate.

mod ascii;
mod binary;

use std::path::Path;

use crate::folder::Folder;
use crate::import::{DecodeBudget, ImportResult, ImportedScene, Warnings};
use crate::text::{split_lines, strip_byte_order_mark};
use crate::{Limits, obj};

/// Imports an STL file from its bytes.
///
/// # Errors
/// A fault of kind input that names facet or line and cause, or of kind limit.
pub(crate) fn import(
    file: &Path,
    bytes: &[u8],
    folder: &Folder,
    limits: &Limits,
) -> ImportResult<ImportedScene> {
    let (mut budget, mut warnings) = (DecodeBudget::new(limits), Warnings::default());
    let mesh = match is_ascii_stl(bytes) {
        true => ascii::read_ascii(bytes, &mut budget, &mut warnings)?,
        false => binary::read_binary(bytes, &mut budget, &mut warnings)?,
    };
    let parts = vec![(None, mesh)];
    obj::scene_from_meshes(file, parts, Vec::new(), (folder, limits), budget, warnings)
}

/// Whether bytes are an STL file of either kind, for input without a file name.
pub(crate) fn is_stl(bytes: &[u8]) -> bool {
    is_ascii_stl(bytes) || binary::has_matching_length(bytes)
}

/// Whether bytes are an ASCII file. The first keyword must be present, after lines of comments, and
/// the first lines must contain only bytes of texts. The length must differ from that of a binary
/// file with the same count of facets.
fn is_ascii_stl(bytes: &[u8]) -> bool {
    let text = strip_byte_order_mark(bytes).trim_ascii_start();
    let begins = split_lines(text)
        .map(<[u8]>::trim_ascii_start)
        .find(|line| !line.is_empty() && !line.starts_with(b"#"))
        .and_then(|line| line.get(..5))
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let head = text.get(..text.len().min(512)).unwrap_or_default();
    begins
        && !head
            .iter()
            .any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace())
        && !binary::has_matching_length(bytes)
}
