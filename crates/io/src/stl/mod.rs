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

use std::path::Path;

use raywright_core::scene::MeshData;

use crate::folder::Folder;
use crate::import::{DecodeBudget, Fault, ImportResult, ImportedScene, Warnings};
use crate::mesh_tools::decode_vertex_colour;
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
        false => read_binary(bytes, &mut budget, &mut warnings)?,
    };
    let parts = vec![(None, mesh)];
    obj::scene_from_meshes(file, parts, Vec::new(), (folder, limits), budget, warnings)
}

/// Whether bytes are an STL file of either kind, for input without a file name.
pub(crate) fn is_stl(bytes: &[u8]) -> bool {
    is_ascii_stl(bytes) || has_matching_length(bytes)
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
        && !has_matching_length(bytes)
}

// Binary STL: 80 arbitrary bytes, the number of facets, and 50 bytes for each facet. A facet
// consists of its normal, three corners, and an attribute word of two bytes. The word was meant as
// a length; programs store the facet's colour in it.

/// Number of bytes before the first facet.
const HEADER_BYTES: usize = 84;
/// Number of bytes of a facet.
const FACET_BYTES: usize = 50;

/// Conventions by which programs store the colour of a facet in its attribute word.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ColourDialect {
    /// Convention of Materialise Magics. The value is the default colour, from the header. A facet
    /// has a colour of its own if the top bit of its attribute word is clear; red is in the low
    /// bits.
    Magics([f32; 3]),
    /// Convention of VisCAM and SolidView. A facet has a colour of its own if the top bit of its
    /// attribute word is set; blue is in the low bits.
    VisCam,
    /// Convention of MeshLab: the header has a colour, and no facet has a colour of its own.
    Header([f32; 3]),
}

/// Whether the length of a file is the length that its number of facets requires.
pub(super) fn has_matching_length(bytes: &[u8]) -> bool {
    facet_count(bytes).is_some_and(|count| {
        count
            .checked_mul(FACET_BYTES)
            .and_then(|facets| facets.checked_add(HEADER_BYTES))
            == Some(bytes.len())
    })
}

fn facet_count(bytes: &[u8]) -> Option<usize> {
    usize::try_from(u32::from_le_bytes(*bytes.get(80..)?.first_chunk()?)).ok()
}

/// Reads the mesh of a file.
///
/// # Errors
/// A fault of kind input for a truncated file, of kind limit for more facets than allowed.
pub(super) fn read_binary(
    bytes: &[u8],
    budget: &mut DecodeBudget,
    warnings: &mut Warnings,
) -> ImportResult<MeshData> {
    let head =
        "is no STL file: it has neither ASCII facets after `solid` nor a binary header of 84 bytes";
    let (count, rest) = facet_count(bytes)
        .zip(bytes.get(HEADER_BYTES..))
        .ok_or_else(|| Fault::invalid_input(head))?;
    let (facets, _) = rest.as_chunks::<FACET_BYTES>();
    let there = facets.len();
    if there < count {
        return Err(fault!(
            "is a truncated binary STL file with {there} of {count} facets"
        ));
    }
    let beyond = rest.len() - count * FACET_BYTES;
    if beyond > 0 {
        warn!(
            warnings,
            Format, "{beyond} bytes after the stated {count} facets were ignored"
        );
    }
    let facets = facets.get(..count).unwrap_or_default();
    budget.reserve_triangles(count)?;
    budget.reserve_memory(count, 3 * size_of::<[f32; 3]>())?;
    let dialect = detect_dialect(bytes.get(..80).unwrap_or_default(), facets);
    if dialect.is_some() {
        budget.reserve_memory(count, 3 * size_of::<[f32; 4]>())?;
    }
    let number = |facet: &[u8; FACET_BYTES], position: usize| {
        facet[position..]
            .first_chunk()
            .map_or(0.0, |bytes| f32::from_le_bytes(*bytes))
    };
    let corner = |facet: &[u8; FACET_BYTES], position: usize| {
        [0, 4, 8].map(|axis| number(facet, 12 + 12 * position + axis))
    };
    let colour = |facet: &[u8; FACET_BYTES]| {
        dialect.map(|dialect| decode_vertex_colour(dialect.decode_colour(attribute_word(facet))))
    };
    Ok(MeshData {
        positions: facets
            .iter()
            .flat_map(|facet| [0, 1, 2].map(|position| corner(facet, position)))
            .collect::<Vec<_>>()
            .into(),
        // Each facet has three vertices of its own.
        indices: (0..count as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        colours: facets
            .iter()
            .flat_map(|facet| colour(facet).map(|colour| [colour; 3]))
            .flatten()
            .collect(),
        ..MeshData::default()
    })
}

fn attribute_word(facet: &[u8; FACET_BYTES]) -> u16 {
    u16::from_le_bytes([facet[48], facet[49]])
}

/// Detects the convention of facet colours, Magics by the default colour in the header, VisCAM by
/// the facets. Returns `None` if the attribute words are no colours. A convention counts only if
/// some facet has a colour by it: programs write words of zeros, or the top bit alone, in all
/// facets.
fn detect_dialect(header: &[u8], facets: &[[u8; FACET_BYTES]]) -> Option<ColourDialect> {
    const KEY: &[u8] = b"COLOR=";
    let any = |test: fn(u16) -> bool| facets.iter().any(|facet| test(attribute_word(facet)));
    let colour: Option<&[u8; 4]> = header
        .windows(KEY.len())
        .position(|word| word == KEY)
        .and_then(|position| header.get(position + KEY.len()..)?.first_chunk())
        // A title may hold text there, such as `COLOR=none`.
        .filter(|rgba| !rgba.iter().all(|byte| matches!(byte, b' '..=b'~')));
    match colour {
        Some(&[r, g, b, _]) => {
            let rgb = [r, g, b].map(|code: u8| f32::from(code) / 255.0);
            Some(match any(|word| word != 0) {
                true => ColourDialect::Magics(rgb),
                false => ColourDialect::Header(rgb),
            })
        }
        None => any(|word| word > 0x8000).then_some(ColourDialect::VisCam),
    }
}

impl ColourDialect {
    /// Returns the sRGB colour of a facet, with channels from 0 to 1, from its attribute word.
    fn decode_colour(self, attribute: u16) -> [f32; 3] {
        let [low, middle, high] = [0, 5, 10].map(|shift| f32::from(attribute >> shift & 31) / 31.0);
        let marked = attribute & 0x8000 != 0;
        match self {
            Self::Header(all) => all,
            Self::Magics(all) if marked => all,
            Self::Magics(_) => [low, middle, high],
            Self::VisCam if marked => [high, middle, low],
            Self::VisCam => [1.0; 3],
        }
    }
}
