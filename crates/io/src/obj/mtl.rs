//! Material libraries: found, made safe for `tobj`, parsed by it.
//!
//! `tobj` panics on a colour with fewer than three numbers (one is enough by the manual) and gives
//! a whole library up for a line that it can't read; such lines are completed or dropped before.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use super::lines::{Statement, decode, relative, statements};
use super::texture::Map;
use crate::folder::{Folder, ReadError};
use crate::import::{Fault, Outcome, Warnings, shown};
use crate::text::{has_decimal_comma, number};
use crate::warning::WarningCode;

/// The materials of all libraries that an OBJ file names; of two of one name, the later counts.
#[derive(Debug, Default)]
pub(super) struct Library {
    materials: HashMap<String, tobj::Material>,
}

/// The name of what faces show that name no material.
pub(super) const DEFAULT: &str = "default";

impl Library {
    /// The default material with each of some images on it, under names that stand for their places
    /// in the list. The only one that a whole file shows has the name of the default.
    pub fn of_images(images: Vec<String>, is_whole: bool) -> (Vec<String>, Self) {
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

    /// A material by name; a default one, with a warning if `asked` for by name, when there is
    /// none.
    pub fn get(&self, name: &str, asked: bool, warnings: &mut Warnings) -> Cow<'_, tobj::Material> {
        match self.materials.get(name) {
            Some(material) => Cow::Borrowed(material),
            None => {
                if asked {
                    warnings.add(
                        WarningCode::Material,
                        format!(
                            "material `{}` is in no library; grey was taken",
                            shown(name)
                        ),
                    );
                }
                Cow::Owned(tobj::Material::default())
            }
        }
    }
}

/// Reads the libraries named by `mtllib` statements. One that can't be had is a warning.
///
/// # Errors
/// A fault of kind limit when one is too large.
pub(super) fn load(names: &[String], folder: &Folder, warnings: &mut Warnings) -> Outcome<Library> {
    let mut library = Library::default();
    let mut seen = HashSet::new();
    for rest in names {
        if !seen.insert(rest) {
            continue;
        }
        for bytes in files(rest, folder, warnings)? {
            let text = safe(&decode(&bytes), warnings);
            // Textures that nothing visible uses are not read, and are the user's all the same.
            statements(&text)
                .filter(names_image)
                .for_each(|statement| folder.name(&Map::parse(statement.rest).path));
            match tobj::load_mtl_buf(&mut text.as_bytes()) {
                Ok((materials, _)) => library
                    .materials
                    .extend(materials.into_iter().map(|m| (m.name.clone(), m))),
                Err(error) => warnings.add(
                    WarningCode::Material,
                    format!("material library `{}` was not read ({error})", shown(rest)),
                ),
            }
        }
    }
    Ok(library)
}

/// Whether a statement of a library names an image.
fn names_image(statement: &Statement) -> bool {
    let keyword = key(statement.keyword);
    keyword.starts_with("map_") || matches!(keyword, "bump" | "disp" | "decal" | "refl" | "norm")
}

/// The libraries behind one `mtllib`: one file whose name may have blanks, or else several files.
fn files(rest: &str, folder: &Folder, warnings: &mut Warnings) -> Outcome<Vec<Vec<u8>>> {
    let whole = folder.read(&relative(rest));
    let words: Vec<&str> = rest.split_whitespace().collect();
    match whole {
        Ok(bytes) => Ok(vec![bytes]),
        Err(ReadError::TooLarge(why)) => Err(Fault::limit(why)),
        Err(why) if words.len() < 2 => {
            warnings.add(WarningCode::Material, format!("material library: {why}"));
            Ok(Vec::new())
        }
        Err(_) => {
            let mut found = Vec::new();
            for word in words {
                match folder.read(&relative(word)) {
                    Ok(bytes) => found.push(bytes),
                    Err(ReadError::TooLarge(why)) => return Err(Fault::limit(why)),
                    Err(why) => {
                        warnings.add(WarningCode::Material, format!("material library: {why}"))
                    }
                }
            }
            Ok(found)
        }
    }
}

/// A library's text with every statement complete, or gone with a warning.
fn safe(text: &str, warnings: &mut Warnings) -> String {
    let mut out = String::with_capacity(text.len());
    for statement in statements(text) {
        match completed(&statement) {
            Some(line) => {
                out.push_str(&line);
                out.push('\n');
            }
            None => warnings.add(
                WarningCode::Unsupported,
                format!(
                    "material library, line {}: `{} {}` was not understood",
                    statement.line,
                    shown(statement.keyword),
                    shown(statement.rest)
                ),
            ),
        }
    }
    out
}

/// Keys in the case of the manual, which is how `tobj` and this importer know them; some programs
/// write others.
const KEYS: [&str; 33] = [
    "newmtl", "Ka", "Kd", "Ks", "Ke", "Kt", "Tf", "Tr", "d", "Ns", "Ni", "illum", "Pr", "Pm", "Ps",
    "Pc", "Pcr", "aniso", "anisor", "norm", "bump", "disp", "decal", "refl", "map_Ka", "map_Kd",
    "map_Ks", "map_Ke", "map_Ns", "map_d", "map_Bump", "map_Pr", "map_Pm",
];

/// A key as the manual writes it.
fn key(keyword: &str) -> &str {
    KEYS.iter()
        .find(|key| key.eq_ignore_ascii_case(keyword))
        .copied()
        .unwrap_or(keyword)
}

/// A statement as tobj takes it.
fn completed(statement: &Statement) -> Option<String> {
    let Statement { keyword, rest, .. } = *statement;
    let keyword = key(keyword);
    let numbers = || {
        rest.split_whitespace()
            .map_while(number)
            .map(|(word, _)| word)
    };
    match keyword {
        // A colour that breaks off there would be taken for grey.
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
            number(rest.trim_start_matches("-halo").split_whitespace().next()?)?.0
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

    /// Protects: tobj panics on the first of these and gives up on the others.
    #[test]
    fn incomplete_statements_do_no_harm() {
        let text = "newmtl\nKd 0.5\nnewmtl a b\nKe 1 2\nNs\nillum x\nd -halo 0.25\nKs spectral f\nmap_Kd\nTf 1f 2 3 4\n";
        let mut warnings = Warnings::default();
        let safe = safe(text, &mut warnings);
        let (materials, _) = tobj::load_mtl_buf(&mut safe.as_bytes()).unwrap();
        assert_eq!(warnings.finish("f").len(), 4);
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

    /// Protects: keys in another case than the manual's mean the same; those that no one knows stay
    /// as they are.
    #[test]
    fn keys_are_known_in_any_case() {
        let text = "NEWMTL a\nKD 0.25 0.5 1\nmap_kd x.png\nMAP_PR y.png\nillum 2\nXy 1\n";
        let (materials, _) =
            tobj::load_mtl_buf(&mut safe(text, &mut Warnings::default()).as_bytes()).unwrap();
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
