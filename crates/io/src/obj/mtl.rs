//! Material libraries of OBJ files: located, repaired for `tobj`, and parsed.
//!
//! `tobj` panics on a colour with fewer than three numbers (the manual allows a single number) and
//! rejects a whole library for a malformed line. Such lines are completed or dropped before
//! parsing.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::lines::{
    Statement, decode_text, normalise_path, split_statements, strip_name_comment, takes_name,
};
use super::texture::{TextureStatement, image_candidates};
use crate::folder::Folder;
use crate::import::{Fault, ImportResult, Warnings, catch_invalid_input, sanitise_text};
use crate::text::{has_decimal_comma, parse_number_prefix};

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
    /// Keys that are ignored although they would change the appearance.
    pub unsupported: BTreeSet<String>,
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
            library.add(LibraryMaterial {
                source,
                ..LibraryMaterial::default()
            });
            names.push(name);
        }
        (names, library)
    }

    fn add(&mut self, material: LibraryMaterial) {
        let name = material.source.name.clone();
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
    names: &[&str],
    folder: &Folder,
    warnings: &mut Warnings,
) -> ImportResult<MaterialLibrary> {
    let mut library = MaterialLibrary::default();
    let mut seen = HashSet::new();
    for rest in names.iter().filter(|name| seen.insert(**name)) {
        for (path, bytes) in read_libraries(rest, folder, warnings)? {
            let place = path.rfind('/').map_or("", |end| &path[..=end]);
            let text = decode_text(&bytes);
            // Images of unused materials are not read, but are the user's files too.
            split_statements(&text)
                .filter(|statement| takes_name(statement.keyword) && statement.keyword != "newmtl")
                .flat_map(|image| {
                    image_candidates(place, &TextureStatement::parse(image.rest).path)
                })
                .for_each(|path| folder.record_reference(&path));
            let (text, unsupported) = repair_text(&text, warnings);
            match tobj::load_mtl_buf(&mut text.as_bytes()) {
                Ok((materials, _)) => {
                    for (source, unsupported) in materials.into_iter().zip(unsupported) {
                        let folder = place.to_owned();
                        library.add(LibraryMaterial {
                            source,
                            folder,
                            unsupported,
                        });
                    }
                }
                Err(error) => warn!(
                    warnings,
                    Material,
                    "material library `{}` was not read ({error})",
                    sanitise_text(&path)
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
            Err(why) => warn!(warnings, Material, "material library: {why}"),
        }
    }
    Ok(found)
}

/// Form of the text after a key of MTL.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Name,
    Color,
    Number,
    Whole,
    Text,
    /// A text that the importer ignores, although it changes the appearance.
    Unsupported,
}

/// Keys of MTL by the form of their texts, in the spelling of the manual, which `tobj` and this
/// importer expect; some programs write them in another letter case.
const KEYS: [(Form, &[&str]); 6] = [
    (Form::Name, &["newmtl"]),
    (Form::Color, &["Ka", "Kd", "Ks", "Ke", "Tf"]),
    (Form::Number, &["d", "Ns", "Ni", "Tr", "Pr", "Pm"]),
    (Form::Whole, &["illum"]),
    (
        Form::Text,
        &[
            "Kt", "Ps", "Pc", "Pcr", "aniso", "anisor", "norm", "map_Ka", "map_Kd", "map_Ke",
            "map_d", "map_Pr", "map_Pm",
        ],
    ),
    (
        Form::Unsupported,
        &[
            "bump", "disp", "decal", "refl", "map_Ks", "map_Ns", "map_bump",
        ],
    ),
];

/// Returns a library's text with incomplete statements completed, or dropped with a warning, and
/// the unsupported keys of each material.
fn repair_text(text: &str, warnings: &mut Warnings) -> (String, Vec<BTreeSet<String>>) {
    let mut out = String::with_capacity(text.len());
    let mut unsupported = Vec::new();
    for Statement {
        line,
        keyword,
        rest,
        ..
    } in split_statements(text)
    {
        let known = |key: &&str| key.eq_ignore_ascii_case(keyword);
        let (form, key) = KEYS
            .iter()
            .find_map(|(form, keys)| Some((*form, *keys.iter().find(|key| known(key))?)))
            .unwrap_or((Form::Unsupported, keyword));
        let Some(rest) = complete_text(form, rest) else {
            warn!(
                warnings,
                Unsupported,
                "material library, line {line}: `{} {}` could not be parsed and is ignored",
                sanitise_text(keyword),
                sanitise_text(rest)
            );
            continue;
        };
        match form {
            Form::Name => unsupported.push(BTreeSet::new()),
            Form::Unsupported => {
                if let Some(keys) = unsupported.last_mut() {
                    keys.insert(key.to_owned());
                }
            }
            _ => {}
        }
        out.extend([key, " ", &rest, "\n"]);
    }
    (out, unsupported)
}

/// Returns the text of a key in a form that `tobj` accepts, or `None` for a malformed text.
fn complete_text(form: Form, rest: &str) -> Option<String> {
    let mut words = rest.trim_start_matches("-halo").split_whitespace();
    let number = |word| parse_number_prefix(word).map(|(number, _)| number);
    match form {
        Form::Name if rest.is_empty() => Some("unnamed".to_owned()),
        // A number with a decimal comma, such as `0,8`, would be parsed up to the comma, as a grey
        // value.
        Form::Color if words.clone().any(has_decimal_comma) => None,
        Form::Color => {
            // "If only r is specified, then g and b are assumed to be equal to r."
            let mut rgb: Vec<&str> = words.map_while(number).take(3).collect();
            rgb.resize(3, rgb.last()?);
            Some(rgb.join(" "))
        }
        Form::Number => number(words.next()?).map(str::to_owned),
        Form::Whole => words.next()?.parse::<u8>().ok().map(|n| n.to_string()),
        _ if rest.is_empty() => None,
        _ => Some(rest.to_owned()),
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
        let (safe, _) = repair_text(text, &mut warnings);
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
        let (safe, unsupported) = repair_text(text, &mut Warnings::default());
        let (materials, _) = tobj::load_mtl_buf(&mut safe.as_bytes()).unwrap();
        assert_eq!(materials[0].diffuse, Some([0.25, 0.5, 1.0]));
        assert_eq!(materials[0].diffuse_texture.as_deref(), Some("x.png"));
        let mut others: Vec<&str> = materials[0]
            .unknown_param
            .keys()
            .map(String::as_str)
            .collect();
        others.sort_unstable();
        assert_eq!(others, ["Xy", "map_Pr"]);
        assert_eq!(unsupported, [BTreeSet::from(["Xy".to_owned()])]);
    }
}
