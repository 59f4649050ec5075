//! Material libraries of OBJ files: located, repaired for `tobj`, and parsed.
//!
//! `tobj` panics on a colour with fewer than three numbers (the manual allows a single number) and
//! rejects a whole library for a malformed line. Such lines are completed or dropped before
//! parsing.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use super::lines::{Statement, decode_text, normalise_path, split_statements};
use super::texture::TextureStatement;
use crate::folder::{Folder, ReadError};
use crate::import::{Fault, ImportResult, Warnings, sanitise_text};
use crate::text::{has_decimal_comma, parse_number_prefix};
use crate::warning::WarningCode;

/// Materials of all libraries that an OBJ file names. Of two materials with the same name, the
/// later applies.
#[derive(Debug, Default)]
pub(super) struct MaterialLibrary {
    materials: HashMap<String, tobj::Material>,
}

/// Name of the material of faces without a material.
pub(super) const DEFAULT: &str = "default";

impl MaterialLibrary {
    /// Creates a library with a material for each image. Each material is the default material,
    /// with the image as its colour. Returns the names of the materials, and the library. If a
    /// single image covers all faces (`is_whole`), its material has the default name; other names
    /// contain the index of the image.
    pub fn from_images(images: Vec<String>, is_whole: bool) -> (Vec<String>, Self) {
        let is_default = is_whole && images.len() == 1;
        let name = |i: usize| {
            if is_default {
                DEFAULT.to_owned()
            } else {
                format!("texture {i}")
            }
        };
        let names: Vec<String> = (0..images.len()).map(name).collect();
        let shown = |image| tobj::Material {
            diffuse_texture: Some(image),
            ..tobj::Material::default()
        };
        let materials = names
            .iter()
            .cloned()
            .zip(images.into_iter().map(shown))
            .collect();
        (names, Self { materials })
    }

    /// Returns the material with this name, or the default material if no library has the name. If
    /// `requested` is set, the file uses the name, and a missing material gives a warning.
    pub fn find_material(
        &self,
        name: &str,
        requested: bool,
        warnings: &mut Warnings,
    ) -> Cow<'_, tobj::Material> {
        match self.materials.get(name) {
            Some(material) => Cow::Borrowed(material),
            None => {
                if requested {
                    warnings.add(
                        WarningCode::Material,
                        format!(
                            "material `{}` is in no material library; a grey material is used",
                            sanitise_text(name)
                        ),
                    );
                }
                Cow::Owned(tobj::Material::default())
            }
        }
    }
}

/// Reads the libraries named by `mtllib` statements. A missing library is a warning.
///
/// # Errors
/// A fault of kind limit for an oversized library.
pub(super) fn load(
    names: &[String],
    folder: &Folder,
    warnings: &mut Warnings,
) -> ImportResult<MaterialLibrary> {
    let mut library = MaterialLibrary::default();
    let mut seen = HashSet::new();
    for rest in names {
        if !seen.insert(rest) {
            continue;
        }
        for bytes in read_libraries(rest, folder, warnings)? {
            let text = repair_text(&decode_text(&bytes), warnings);
            // Images of unused materials are not read, but are the user's files too.
            split_statements(&text)
                .filter(is_image_statement)
                .for_each(|statement| {
                    folder.record_reference(&TextureStatement::parse(statement.rest).path)
                });
            match tobj::load_mtl_buf(&mut text.as_bytes()) {
                Ok((materials, _)) => library
                    .materials
                    .extend(materials.into_iter().map(|m| (m.name.clone(), m))),
                Err(error) => warnings.add(
                    WarningCode::Material,
                    format!(
                        "material library `{}` was not read ({error})",
                        sanitise_text(rest)
                    ),
                ),
            }
        }
    }
    Ok(library)
}

/// Whether a statement of a library names an image.
fn is_image_statement(statement: &Statement) -> bool {
    let keyword = canonical_key(statement.keyword);
    keyword.starts_with("map_") || matches!(keyword, "bump" | "disp" | "decal" | "refl" | "norm")
}

/// Reads the libraries of an `mtllib` statement. The statement names a single file, whose name may
/// contain blanks, or several files.
fn read_libraries(
    rest: &str,
    folder: &Folder,
    warnings: &mut Warnings,
) -> ImportResult<Vec<Vec<u8>>> {
    let whole = folder.read(&normalise_path(rest));
    let words: Vec<&str> = rest.split_whitespace().collect();
    match whole {
        Ok(bytes) => Ok(vec![bytes]),
        Err(ReadError::TooLarge(reason)) => Err(Fault::over_limit(reason)),
        Err(why) if words.len() < 2 => {
            warnings.add(WarningCode::Material, format!("material library: {why}"));
            Ok(Vec::new())
        }
        Err(_) => {
            let mut found = Vec::new();
            for word in words {
                match folder.read(&normalise_path(word)) {
                    Ok(bytes) => found.push(bytes),
                    Err(ReadError::TooLarge(reason)) => return Err(Fault::over_limit(reason)),
                    Err(why) => {
                        warnings.add(WarningCode::Material, format!("material library: {why}"))
                    }
                }
            }
            Ok(found)
        }
    }
}

/// Returns a library's text with incomplete statements completed, or dropped with a warning.
fn repair_text(text: &str, warnings: &mut Warnings) -> String {
    let mut out = String::with_capacity(text.len());
    for statement in split_statements(text) {
        match complete_statement(&statement) {
            Some(line) => {
                out.push_str(&line);
                out.push('\n');
            }
            None => warnings.add(
                WarningCode::Unsupported,
                format!(
                    "material library, line {}: `{} {}` could not be parsed and is ignored",
                    statement.line,
                    sanitise_text(statement.keyword),
                    sanitise_text(statement.rest)
                ),
            ),
        }
    }
    out
}

/// Keys of MTL in the spelling of the manual, which `tobj` and this importer expect; some programs
/// write them in another letter case.
const KEYS: [&str; 33] = [
    "newmtl", "Ka", "Kd", "Ks", "Ke", "Kt", "Tf", "Tr", "d", "Ns", "Ni", "illum", "Pr", "Pm", "Ps",
    "Pc", "Pcr", "aniso", "anisor", "norm", "bump", "disp", "decal", "refl", "map_Ka", "map_Kd",
    "map_Ks", "map_Ke", "map_Ns", "map_d", "map_Bump", "map_Pr", "map_Pm",
];

/// Returns a key in the spelling of the manual; an unknown key is unchanged.
fn canonical_key(keyword: &str) -> &str {
    KEYS.iter()
        .find(|key| key.eq_ignore_ascii_case(keyword))
        .copied()
        .unwrap_or(keyword)
}

/// Returns a statement in a form that `tobj` accepts, or `None` for a malformed statement.
fn complete_statement(statement: &Statement) -> Option<String> {
    let Statement { keyword, rest, .. } = *statement;
    let keyword = canonical_key(keyword);
    let numbers = || {
        rest.split_whitespace()
            .map_while(parse_number_prefix)
            .map(|(word, _)| word)
    };
    match keyword {
        // A number with a decimal comma, such as `0,8`, would be parsed up to the comma, as a grey
        // value.
        "Ka" | "Kd" | "Ks" | "Ke" | "Tf" if rest.split_whitespace().any(has_decimal_comma) => None,
        "newmtl" => Some(format!(
            "newmtl {}",
            if rest.is_empty() { "unnamed" } else { rest }
        )),
        "Ka" | "Kd" | "Ks" | "Ke" | "Tf" => {
            // "If only r is specified, then g and b are assumed to be equal to r."
            let mut rgb = numbers().take(3).collect::<Vec<_>>();
            let last = *rgb.last()?;
            rgb.resize(3, last);
            Some(format!("{keyword} {}", rgb.join(" ")))
        }
        "d" => Some(format!(
            "d {}",
            parse_number_prefix(rest.trim_start_matches("-halo").split_whitespace().next()?)?.0
        )),
        "Ns" | "Ni" | "Tr" | "Pr" | "Pm" => Some(format!("{keyword} {}", numbers().next()?)),
        "illum" => Some(format!(
            "illum {}",
            rest.split_whitespace().next()?.parse::<u8>().ok()?
        )),
        _ if rest.is_empty() => None,
        _ => Some(format!("{keyword} {rest}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: incomplete statements are completed or dropped: tobj panics on the first of these
    /// and rejects the library for the others.
    #[test]
    fn incomplete_statements_do_no_harm() {
        let text = "newmtl\nKd 0.5\nnewmtl a b\nKe 1 2\nNs\nillum x\nd -halo 0.25\nKs spectral f\nmap_Kd\nTf 1f 2 3 4\n";
        let mut warnings = Warnings::default();
        let safe = repair_text(text, &mut warnings);
        let (materials, _) = tobj::load_mtl_buf(&mut safe.as_bytes()).unwrap();
        assert_eq!(warnings.into_warnings("f").len(), 4);
        let [unnamed, named] = materials.as_slice() else {
            panic!("{materials:?}")
        };
        assert_eq!(
            (unnamed.name.as_str(), unnamed.diffuse),
            ("unnamed", Some([0.5; 3]))
        );
        assert_eq!(
            (named.name.as_str(), named.emissive, named.dissolve),
            ("a b", Some([1.0, 2.0, 2.0]), Some(0.25))
        );
    }

    /// Protects: keys in another case than the manual's have the same meaning; unknown keys stay
    /// unchanged.
    #[test]
    fn keys_are_known_in_any_case() {
        let text = "NEWMTL a\nKD 0.25 0.5 1\nmap_kd x.png\nMAP_PR y.png\nillum 2\nXy 1\n";
        let (materials, _) =
            tobj::load_mtl_buf(&mut repair_text(text, &mut Warnings::default()).as_bytes())
                .unwrap();
        assert_eq!(materials[0].diffuse, Some([0.25, 0.5, 1.0]));
        assert_eq!(materials[0].diffuse_texture.as_deref(), Some("x.png"));
        let mut others: Vec<&str> = materials[0]
            .unknown_param
            .keys()
            .map(String::as_str)
            .collect();
        others.sort_unstable();
        assert_eq!(others, ["Xy", "map_Pr"]);
    }
}
