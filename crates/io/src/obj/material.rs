//! Conversion of MTL materials to physical materials.
//!
//! MTL describes Phong shading and names rendering tricks (`illum`). Common files are interpreted
//! as follows:
//!
//! | in the file | becomes |
//! |---|---|
//! | `illum` 4, 6, 7, 9 with `d` below 1, `Tr`, or a `Tf` that is neither 0 nor 1 | smooth glass with index `Ni`, tinted by `Tf` |
//! | the same without a `Kd` that is not black; for `illum` 4, 9 also with `Tf` 1 | smooth glass |
//! | `illum` 3 | a mirror tinted by `Ks`; with a `Kd` that is not black, a metal of colour `Kd` and roughness by `Ns` (as Blender writes metals) |
//! | `illum` 5 | a polished dielectric with index `Ni` over `Kd` |
//! | `Kd` black, `Ks` not | a metal of colour `Ks` and roughness by `Ns` |
//! | no `Ks`, or `illum` 0, 1 | matte: `Kd` without any highlight (index 1, so that nothing mirrors) |
//! | anything else | a dielectric of index 1.5 over `Kd`, with roughness by `Ns` |
//!
//! A mirror becomes a metal of the physical material model, not a mirror of the `classic` model, so
//! that every integrator can trace all materials of a file. `d` or `Tr` below opaque is coverage;
//! `Ke` is radiance. `Pr`, `Pm`, their images and `norm`, all of the PBR extension, take precedence
//! over derived values; `Ps`, `Pc`, `Pcr`, `aniso` and `anisor` of this extension add layers. `Ka`
//! is ignored, because light is simulated.

use std::collections::{BTreeSet, HashMap, HashSet};

use raywright_core::scene::{
    AlphaMode, Anisotropy, Channel, Clearcoat, Colour, ColourSpace, NumberInput, Physical, Sheen,
    TextureInput, TextureRef,
};

use super::SceneBuilder;
use super::survey::{
    Statement, decode_text, normalise_path, split_statements, strip_name_comment, takes_name,
};
use super::texture::{TextureStatement, image_candidates};
use crate::folder::Folder;
use crate::import::{Fault, ImportResult, Warnings, catch_invalid_input, sanitise_text};
use crate::text::{has_decimal_comma, parse_number_prefix};

/// Returns the perceptual roughness, from 0 to 1, of a Phong lobe with this exponent n. Its α is
/// √(2/(n+2)) (Walter, Marschner, Li, Torrance, "Microfacet Models for Refraction through Rough
/// Surfaces", 2007), and the perceptual roughness is √α.
fn phong_roughness(exponent: f64) -> f64 {
    (2.0 / (exponent.max(0.0) + 2.0)).sqrt().sqrt()
}

/// Keys of the images that the importer uses.
const IMAGES: [&str; 6] = ["map_Kd", "map_d", "map_Ke", "map_Pr", "map_Pm", "norm"];

impl LibraryMaterial {
    /// Returns the texture statements that the importer uses, each with the folder of the library.
    pub fn image_statements(&self) -> impl Iterator<Item = (&str, &str)> {
        IMAGES
            .into_iter()
            .filter_map(|key| Some((&*self.folder, self.text(key)?)))
    }

    /// Returns the text after the key of an image, or after a key that `tobj` does not know.
    fn text(&self, key: &str) -> Option<&str> {
        let text = match key {
            "map_Kd" => self.source.diffuse_texture.as_ref(),
            "map_d" => self.source.dissolve_texture.as_ref(),
            _ => self.source.unknown_param.get(key),
        };
        text.map(String::as_str)
    }

    /// Returns the first number after a key that `tobj` does not know, from 0 to 1.
    fn share(&self, key: &str) -> Option<f64> {
        self.text(key).and_then(parse_number).map(clamp_unit)
    }
}

impl SceneBuilder<'_> {
    /// Converts a material of the file to a physical material, with the textures whose images could
    /// be read.
    pub(super) fn convert_physical(&mut self, material: &LibraryMaterial) -> Physical {
        let opacity = read_opacity(material, &mut self.warnings);
        let mut texture =
            |key: &str, space| self.texture_ref(&material.folder, material.text(key)?, space);
        let mut out = convert_surface(material, opacity);
        out.base_colour_texture = texture("map_Kd", ColourSpace::Srgb);
        out.emission_texture = texture("map_Ke", ColourSpace::Srgb);
        let missing = f64::from(u8::from(out.emission_texture.is_some()));
        let emission = material.source.emissive.unwrap_or([missing; 3]);
        let usable = |c: f64| {
            if c.is_finite() {
                round_to_f32(c).max(0.0)
            } else {
                0.0
            }
        };
        out.emission = Colour(emission.map(usable)).into();
        for (key, image, input) in [
            ("Pr", "map_Pr", &mut out.roughness),
            ("Pm", "map_Pm", &mut out.metallic),
        ] {
            let value = material.share(key);
            match texture(image, ColourSpace::Linear) {
                Some(image) => *input = texture_input(image, value.unwrap_or(1.0)),
                None => *input = value.map_or(input.clone(), NumberInput::from),
            }
        }
        add_layers(material, &mut out);
        if let Some(statement) = material.text("norm") {
            let image = texture("norm", ColourSpace::Linear);
            out.normal_texture = image.map(|image| TextureRef {
                channel: None,
                ..image
            });
            out.normal_scale = TextureStatement::parse(statement).bump;
        }
        if !out.may_transmit() {
            out.opacity = opacity.into();
            let [alpha, colour] = ["map_d", "map_Kd"].map(|key| {
                material
                    .text(key)
                    .map(|text| TextureStatement::parse(text).path)
            });
            let own_alpha = alpha.is_some() && alpha == colour;
            if opacity < 1.0 || own_alpha {
                out.alpha = AlphaMode::Blend;
            }
            if !own_alpha && let Some(image) = texture("map_d", ColourSpace::Linear) {
                (out.alpha, out.opacity) = (AlphaMode::Blend, texture_input(image, opacity));
            }
        }
        out
    }
}

/// Rounds a number of a material to single precision.
fn round_to_f32(value: f64) -> f64 {
    f64::from(value as f32)
}

/// Returns the physical material for the colours, the highlight and the refraction of an MTL
/// material, by the table in the description of the module.
fn convert_surface(material: &LibraryMaterial, opacity: f64) -> Physical {
    let source = &material.source;
    let rgb = |colour: Option<[f64; 3]>, missing: f64| {
        colour.map_or([missing; 3], |c| c.map(|c| clamp_unit(round_to_f32(c))))
    };
    let has_image = source.diffuse_texture.is_some();
    let diffuse = rgb(source.diffuse, if has_image { 1.0 } else { 0.8 });
    let specular = rgb(source.specular, 0.0);
    let filter = transmission_filter(material);
    let index = source
        .optical_density
        .map(round_to_f32)
        .filter(|n| n.is_finite() && *n >= 1.0);
    let rough = source
        .shininess
        .map_or(1.0, |n| phong_roughness(round_to_f32(n)));
    let illum = source.illumination_model.unwrap_or(2);
    let coloured = |colour: [f64; 3]| Physical {
        base_colour: Colour(colour).into(),
        ..Physical::default()
    };
    let metal = |colour: [f64; 3], roughness: f64| Physical {
        metallic: 1.0.into(),
        roughness: roughness.into(),
        ..coloured(colour)
    };
    let matte = || Physical {
        ior: 1.0.into(),
        ..coloured(diffuse)
    };
    let glass = || Physical {
        transmission: 1.0.into(),
        roughness: 0.0.into(),
        ior: index.unwrap_or(1.5).into(),
        // A black filter is no filter: it belongs to files in which `Tf` is unused.
        ..coloured(filter.filter(|tint| !is_black(*tint)).unwrap_or([1.0; 3]))
    };
    match illum {
        4 | 6 | 7 | 9 if is_transparent(material, opacity) => glass(),
        3 if is_black(diffuse) => metal(specular, 0.0),
        3 => metal(diffuse, rough),
        5 => Physical {
            roughness: 0.0.into(),
            ior: index.unwrap_or(1.5).into(),
            ..coloured(diffuse)
        },
        0 | 1 => matte(),
        _ if is_black(specular) => matte(),
        _ if is_black(diffuse) && !has_image => metal(specular, rough),
        _ => Physical {
            roughness: rough.into(),
            ..coloured(diffuse)
        },
    }
}

/// Whether a material that `illum` allows to refract light does so. Programs write `illum` 4 and
/// `Tf 1 1 1` for opaque materials too: a diffuse colour counts unless `d`, `Tr` or `Tf` states
/// transparency.
fn is_transparent(material: &LibraryMaterial, opacity: f64) -> bool {
    /// Largest channel of a diffuse colour that files of glass state in place of black.
    const DARK: f64 = 0.02;
    let source = &material.source;
    let filter = transmission_filter(material);
    let is_diffuse = source.diffuse_texture.is_some()
        || source
            .diffuse
            .is_some_and(|kd| kd.iter().any(|&c| c > DARK));
    let is_filtered = |tint| !is_black(tint) && tint != [1.0; 3];
    let refracts = matches!(source.illumination_model, Some(6 | 7))
        || filter.is_some_and(|tint| !is_black(tint));
    opacity < 1.0 || filter.is_some_and(is_filtered) || (refracts && !is_diffuse)
}

/// Returns the tint of refracted light, from `Tf`; `None` without `Tf`. A missing channel is 1.
fn transmission_filter(material: &LibraryMaterial) -> Option<[f64; 3]> {
    let words = material.text("Tf")?.split_whitespace();
    let mut numbers = words.map(|word| parse_number(word).unwrap_or(1.0));
    Some([0; 3].map(|_| clamp_unit(numbers.next().unwrap_or(1.0))))
}

fn is_black(colour: [f64; 3]) -> bool {
    colour.iter().all(|&channel| channel == 0.0)
}

/// Adds the layers of MTL's PBR extension to a material: `Ps` is sheen, `Pc` and `Pcr` are a
/// clearcoat, `aniso` and `anisor` (in turns) are anisotropy.
fn add_layers(material: &LibraryMaterial, out: &mut Physical) {
    let some = |key: &str| material.share(key).filter(|value| *value > 0.0);
    out.sheen = some("Ps").map(|strength| Sheen {
        colour: Colour([strength; 3]).into(),
        ..Sheen::default()
    });
    out.clearcoat = some("Pc").map(|factor| Clearcoat {
        factor: factor.into(),
        roughness: material.share("Pcr").unwrap_or(0.0).into(),
        ..Clearcoat::default()
    });
    out.anisotropy = some("aniso").map(|strength| Anisotropy {
        strength: strength.into(),
        rotation: 360.0 * material.share("anisor").unwrap_or(0.0),
        texture: None,
    });
}

/// Returns the opacity of a material from 0 to 1: `d` or, without a `d`, 1 − `Tr`.
fn read_opacity(material: &LibraryMaterial, warnings: &mut Warnings) -> f64 {
    if let Some(dissolve) = material.source.dissolve {
        return clamp_unit(round_to_f32(dissolve));
    }
    match material.text("Tr").and_then(parse_number) {
        // Old exporters wrote `Tr 1` for an opaque material. Files that describe an invisible
        // material hardly exist.
        Some(1.0) => {
            warn!(
                warnings,
                Choice,
                "material `{}`: `Tr 1` without `d` is read as opaque, not as invisible",
                sanitise_text(&material.source.name)
            );
            1.0
        }
        transparency => clamp_unit(1.0 - transparency.unwrap_or(0.0)),
    }
}

/// Returns a material input that is the red channel of an image multiplied by a factor.
fn texture_input(image: TextureRef, factor: f64) -> NumberInput {
    NumberInput::Texture(TextureInput {
        texture: TextureRef {
            factor: Colour([factor; 3]),
            channel: image.channel.or(Some(Channel::Red)),
            ..image
        },
    })
}

fn parse_number(text: &str) -> Option<f64> {
    text.split_whitespace()
        .next()?
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite())
}

fn clamp_unit(value: f64) -> f64 {
    if value.is_nan() {
        0.0
    } else {
        value.clamp(0.0, 1.0)
    }
}

// Material libraries of OBJ files: located, repaired for `tobj`, and parsed.
//
// `tobj` panics on a colour with fewer than three numbers (the manual allows a single number) and
// rejects a whole library for a malformed line. Such lines are completed or dropped before
// parsing.

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
    use raywright_core::scene::ColourInput;

    fn parse(text: &str) -> LibraryMaterial {
        let (mut materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).unwrap();
        LibraryMaterial {
            source: materials.remove(0),
            ..LibraryMaterial::default()
        }
    }

    fn of(text: &str) -> Physical {
        let text = format!("newmtl m\n{text}");
        let material = parse(&text);
        convert_surface(&material, material.source.dissolve.unwrap_or(1.0))
    }

    fn base(material: &Physical) -> [f64; 3] {
        match material.base_colour {
            ColourInput::Constant(Colour(colour)) => colour,
            ref other => panic!("{other:?}"),
        }
    }

    /// Protects: the table at the top, line by line.
    #[test]
    fn illumination_models_mean_what_the_table_says() {
        let glass = of("Kd 0 0 0\nTf 0.5 1 1\nNi 1.25\nd 0.1\nillum 7");
        assert_eq!(
            (&glass.transmission, &glass.ior, base(&glass)),
            (&1.0.into(), &1.25.into(), [0.5, 1.0, 1.0])
        );
        assert_eq!(glass.roughness, 0.0.into());
        assert_eq!(of("illum 4").transmission, 0.0.into());
        assert_eq!(of("illum 4\nd 0.5").transmission, 1.0.into());
        let mirror = of("Kd 0 0 0\nKs 1 0.5 0.25\nNs 1000\nillum 3");
        assert_eq!(base(&mirror), [1.0, 0.5, 0.25]);
        assert_eq!(
            (mirror.metallic, mirror.roughness),
            (1.0.into(), 0.0.into())
        );
        let metal = of("Kd 1 0.5 0.25\nKs 0.5 0.5 0.5\nNs 30\nillum 3");
        assert_eq!(base(&metal), [1.0, 0.5, 0.25]);
        assert_eq!((metal.metallic, metal.roughness), (1.0.into(), 0.5.into()));
        let matte = of("Kd 0.5 0.5 0.5\nillum 1");
        assert_eq!(
            (matte.ior, matte.roughness, matte.metallic),
            (1.0.into(), 1.0.into(), 0.0.into())
        );
        let source = parse("newmtl m\nPs 0.5\nPc 0.8\nPcr 0.1\naniso 0.6\nanisor 0.25");
        let mut coated = Physical::default();
        add_layers(&source, &mut coated);
        let (coat, anisotropy) = (
            coated.clearcoat.expect("a coat"),
            coated.anisotropy.expect("combed"),
        );
        assert_eq!((coat.factor, coat.roughness), (0.8.into(), 0.1.into()));
        assert_eq!(
            (anisotropy.strength, anisotropy.rotation),
            (0.6.into(), 90.0)
        );
        assert_eq!(
            coated.sheen.expect("fibres").colour,
            Colour([0.5; 3]).into()
        );
        let shiny = of("Kd 0.5 0.5 0.5\nKs 0.3 0.3 0.3\nNs 30\nillum 2");
        assert_eq!(
            (shiny.ior, shiny.roughness, shiny.metallic),
            (1.5.into(), 0.5.into(), 0.0.into())
        );
    }
}

#[cfg(test)]
mod mtl_tests {
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
