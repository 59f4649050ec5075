//! Import of STL, binary and text ("StereoLithography Interface Specification", 3D Systems, 1988),
//! with the two usual ways to write colours into binary files.
//!
//! A file is one mesh of flat facets. Their normals are those of their corners by the right-hand
//! rule: those that are written say the same or are wrong, and many programs write zeros. Which of
//! the two kinds a file is tell its length and its content, since many binary files begin with the
//! word of the text ones.
//!
//! `stl_io` reads neither colours nor loops of more than three corners, and takes memory by the
//! count that a file claims, so the reader is our own.

mod ascii;
mod binary;

use std::path::Path;

use crate::folder::Folder;
use crate::import::{Budget, Imported, Outcome, Warnings};
use crate::text::without_mark;
use crate::{Error, Limits, obj};

/// Reads an STL file, given its bytes.
///
/// # Errors
/// An error of kind input naming facet or line and cause, or of kind limit.
pub(crate) fn load(
    file: &Path,
    bytes: &[u8],
    folder: &Folder,
    limits: &Limits,
) -> Result<Imported, Error> {
    import(file, bytes, folder, limits).map_err(|fault| fault.into_error(file.display()))
}

fn import(file: &Path, bytes: &[u8], folder: &Folder, limits: &Limits) -> Outcome<Imported> {
    let (mut budget, mut warnings) = (Budget::new(limits), Warnings::default());
    let mesh = match is_text(bytes) {
        true => ascii::read(bytes, &mut budget, &mut warnings)?,
        false => binary::read(bytes, &mut budget, &mut warnings)?,
    };
    obj::of_mesh(file, mesh, (folder, limits), budget, warnings)
}

/// Whether bytes are an STL file of either kind, for who does not know it by its name.
pub(crate) fn is_stl(bytes: &[u8]) -> bool {
    is_text(bytes) || binary::has_its_length(bytes)
}

/// Whether bytes are the text kind: they begin as one, have no byte in their first lines that texts
/// have not, and not the very length that their count of facets would make a binary file.
fn is_text(bytes: &[u8]) -> bool {
    let start = without_mark(bytes).trim_ascii_start();
    let begins = start
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let head = start.get(..start.len().min(512)).unwrap_or_default();
    begins
        && !head
            .iter()
            .any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace())
        && !binary::has_its_length(bytes)
}
