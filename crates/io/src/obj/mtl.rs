//! Material libraries of OBJ files: located, repaired for `tobj`, and parsed.
//!
//! `tobj` panics on a colour with fewer than three numbers (the manual allows a single number) and
//! rejects a whole library for a malformed line. Such lines are completed or dropped before
//! parsing.

use std::collections::{HashMap, HashSet};

use super::lines::{
    Statement, decode_text, normalise_path, split_statements, strip_name_comment, takes_name,
};
use super::texture::{TextureStatement, image_candidates};
use crate::folder::Folder;
use crate::import::{Fault, ImportResult, Warnings, catch_invalid_input, sanitise_text};
use crate::text::{has_decimal_comma, parse_number_prefix};
use crate::warning::WarningCode;

/// Materials of all libraries that an OBJ file names. Of two materials with the same name, the
/// later applies.
#[derive(Debug, Default)]
pub(super) struct MaterialLibrary {
    materials: HashMap<String, LibraryMaterial>,
}

/// A material of a library.
#[derive(Clone, Debug, Default)]
pub(super) struct LibraryMaterial {
    pub source: tobj::Material,
    /// Folder of the library, relative to the folder of the OBJ file. The text is empty or ends in
    /// `/`.
    pub folder: String,
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
        let (mut names, mut library) = (Vec::new(), Self::default());
        for (i, image) in images.into_iter().enumerate() {
            let name = if is_default {
                DEFAULT.to_owned()
            } else {
                format!("texture {i}")
            };
            let source = tobj::Material {
                name: name.clone(),
                diffuse_texture: Some(image),
                ..tobj::Material::default()
            };
            library.add(source, "");
            names.push(name);
        }
        (names, library)
    }

    fn add(&mut self, source: tobj::Material, folder: &str) {
        let (name, folder) = (source.name.clone(), folder.to_owned());
        let material = LibraryMaterial { source, folder };
        // The name in the OBJ file may lack a comment that follows the name in the library.
        if let Some((short, _)) = name.split_once(" # ") {
            let short = self.materials.entry(short.trim_end().to_owned());
            short.or_insert_with(|| material.clone());
        }
        self.materials.insert(name, material);
    }

    /// Returns the material with this name; `None` if no library has the name.
    pub fn find_material(&self, name: &str) -> Option<&LibraryMaterial> {
        [name, strip_name_comment(name)]
            .into_iter()
            .find_map(|name| self.materials.get(name))
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
        for (path, bytes) in read_libraries(rest, folder, warnings)? {
            let place = path.rfind('/').map_or("", |end| &path[..=end]);
            let text = repair_text(&decode_text(&bytes), warnings);
            // Images of unused materials are not read, but are the user's files too.
            split_statements(&text)
                .filter(|statement| takes_name(statement.keyword) && statement.keyword != "newmtl")
                .flat_map(|image| {
                    image_candidates(place, &TextureStatement::parse(image.rest).path)
                })
                .for_each(|path| folder.record_reference(&path));
            match tobj::load_mtl_buf(&mut text.as_bytes()) {
                Ok((materials, _)) => materials
                    .into_iter()
                    .for_each(|material| library.add(material, place)),
                Err(error) => warnings.add(
                    WarningCode::Material,
                    format!(
                        "material library `{}` was not read ({error})",
                        sanitise_text(&path)
                    ),
                ),
            }
        }
    }
    Ok(library)
}

/// Reads the libraries of an `mtllib` statement, each with its path. The statement names a single
/// file, whose name may contain blanks, or several files.
fn read_libraries(
    rest: &str,
    folder: &Folder,
    warnings: &mut Warnings,
) -> ImportResult<Vec<(String, Vec<u8>)>> {
    let read = |name: &str| -> ImportResult<Result<(String, Vec<u8>), String>> {
        let path = normalise_path(name);
        let bytes = catch_invalid_input(folder.read(&path).map_err(Fault::from))?;
        Ok(bytes.map(|bytes| (path, bytes)))
    };
    let name = strip_name_comment(rest);
    for whole in [rest, name] {
        if let Ok(library) = read(whole)? {
            return Ok(vec![library]);
        }
    }
    let mut found = Vec::new();
    for word in name.split_whitespace() {
        match read(word)? {
            Ok(library) => found.push(library),
            Err(why) => warnings.add(WarningCode::Material, format!("material library: {why}")),
        }
    }
    Ok(found)
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
