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

impl LibraryMaterial {
    /// Returns the texture statements that the importer uses, each with the folder of the library.
    pub fn image_statements(&self) -> impl Iterator<Item = (&str, &TextureStatement)> {
        IMAGES
            .iter()
            .filter_map(|key| Some((&*self.folder, self.images.get(key)?)))
    }

    fn colour(&self, key: &str) -> Option<[f64; 3]> {
        self.numbers.get(key).copied()
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.colour(key).map(|[number, ..]| number)
    }

    /// Returns a finite number, limited to the range from 0 to 1.
    fn share(&self, key: &str) -> Option<f64> {
        Some(clamp_unit(
            self.number(key).filter(|number| number.is_finite())?,
        ))
    }
}

impl SceneBuilder<'_> {
    /// Converts a material of the file to a physical material, with the textures whose images could
    /// be read.
    pub(super) fn convert_physical(&mut self, material: &LibraryMaterial) -> Physical {
        let opacity = read_opacity(material, &mut self.warnings);
        let mut texture =
            |key: &str, space| self.texture_ref(&material.folder, material.images.get(key)?, space);
        let mut out = convert_surface(material, opacity);
        out.base_colour_texture = texture("map_Kd", ColourSpace::Srgb);
        out.emission_texture = texture("map_Ke", ColourSpace::Srgb);
        let missing = f64::from(u8::from(out.emission_texture.is_some()));
        let emission = material.colour("Ke").unwrap_or([missing; 3]);
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
        if let Some(statement) = material.images.get("norm") {
            let image = texture("norm", ColourSpace::Linear);
            out.normal_texture = image.map(|image| TextureRef {
                channel: None,
                ..image
            });
            out.normal_scale = statement.bump;
        }
        if !out.may_transmit() {
            out.opacity = opacity.into();
            let path = |key| material.images.get(key).map(|image| &image.path);
            let [alpha, colour] = ["map_d", "map_Kd"].map(path);
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
    let rgb = |key: &str, missing: f64| {
        let colour = material.colour(key);
        colour.map_or([missing; 3], |c| c.map(|c| clamp_unit(round_to_f32(c))))
    };
    let has_image = material.images.contains_key("map_Kd");
    let diffuse = rgb("Kd", if has_image { 1.0 } else { 0.8 });
    let specular = rgb("Ks", 0.0);
    let filter = transmission_filter(material);
    let number = |key: &str| material.number(key).map(round_to_f32);
    let index = number("Ni").filter(|n| n.is_finite() && *n >= 1.0);
    let rough = number("Ns").map_or(1.0, phong_roughness);
    let illum = number("illum").unwrap_or(2.0) as i64;
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
    let filter = transmission_filter(material);
    let is_diffuse = material.images.contains_key("map_Kd")
        || (material.colour("Kd")).is_some_and(|kd| kd.iter().any(|&c| c > DARK));
    let is_filtered = |tint| !is_black(tint) && tint != [1.0; 3];
    let refracts = matches!(material.number("illum"), Some(6.0 | 7.0))
        || filter.is_some_and(|tint| !is_black(tint));
    opacity < 1.0 || filter.is_some_and(is_filtered) || (refracts && !is_diffuse)
}

/// Returns the tint of refracted light, from `Tf`; `None` without `Tf`. A channel that is
/// not finite is 1.
fn transmission_filter(material: &LibraryMaterial) -> Option<[f64; 3]> {
    let channel = |c: f64| if c.is_finite() { clamp_unit(c) } else { 1.0 };
    Some(material.colour("Tf")?.map(channel))
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
    if let Some(dissolve) = material.number("d") {
        return clamp_unit(round_to_f32(dissolve));
    }
    match material.number("Tr").filter(|number| number.is_finite()) {
        // Old exporters wrote `Tr 1` for an opaque material. Files that describe an invisible
        // material hardly exist.
        Some(1.0) => {
            warn!(
                warnings,
                Choice,
                "material `{}`: `Tr 1` without `d` is read as opaque, not as invisible",
                sanitise_text(&material.name)
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

fn clamp_unit(value: f64) -> f64 {
    if value.is_nan() {
        0.0
    } else {
        value.clamp(0.0, 1.0)
    }
}

// Material libraries of OBJ files. They are not read by `tobj`, which panics on a colour with fewer
// than three numbers (the manual allows a single number) and rejects a whole library for a malformed
// line.

/// Materials of all libraries that an OBJ file names. Of two materials with the same name, the
/// later applies.
#[derive(Debug, Default)]
pub(super) struct MaterialLibrary {
    materials: HashMap<String, LibraryMaterial>,
}

/// A material of a library.
#[derive(Clone, Debug, Default)]
pub(super) struct LibraryMaterial {
    name: String,
    /// Colours and numbers by their keys; a single number is all three channels.
    numbers: HashMap<&'static str, [f64; 3]>,
    /// Texture statements by their keys.
    images: HashMap<&'static str, TextureStatement>,
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
            library.add(LibraryMaterial {
                name: name.clone(),
                images: [("map_Kd", TextureStatement::parse(&image))].into(),
                ..LibraryMaterial::default()
            });
            names.push(name);
        }
        (names, library)
    }

    fn add(&mut self, material: LibraryMaterial) {
        let name = material.name.clone();
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
            for material in read_materials(&decode_text(&bytes), (folder, place), warnings) {
                library.add(material);
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

// Keys of MTL that the importer reads, by the form of their texts, in the spelling of the manual; some
// programs write them in another letter case.
const COLOURS: [&str; 6] = ["Ka", "Kd", "Ks", "Ke", "Kt", "Tf"];
const NUMBERS: [&str; 12] = [
    "d", "Ns", "Ni", "Tr", "Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "anisor", "illum",
];
const IMAGES: [&str; 6] = ["map_Kd", "map_d", "map_Ke", "map_Pr", "map_Pm", "norm"];

/// Reads the materials of a library in a folder. A malformed statement is left out with a warning.
fn read_materials(
    text: &str,
    (folder, place): (&Folder, &str),
    warnings: &mut Warnings,
) -> Vec<LibraryMaterial> {
    let mut materials: Vec<LibraryMaterial> = Vec::new();
    for Statement {
        line,
        keyword,
        rest,
        ..
    } in split_statements(text)
    {
        if keyword.eq_ignore_ascii_case("newmtl") {
            materials.push(LibraryMaterial {
                name: if rest.is_empty() { "unnamed" } else { rest }.to_owned(),
                folder: place.to_owned(),
                ..LibraryMaterial::default()
            });
            continue;
        }
        // Images of unused materials are not read, but are the user's files too.
        if takes_name(keyword) {
            for path in image_candidates(place, &TextureStatement::parse(rest).path) {
                folder.record_reference(&path);
            }
        }
        // Statements before the first name describe no material.
        let mut nothing = LibraryMaterial::default();
        let material = materials.last_mut().unwrap_or(&mut nothing);
        if material.read_statement(keyword, rest).is_none() {
            warn!(
                warnings,
                Unsupported,
                "material library, line {line}: `{} {}` could not be parsed and is ignored",
                sanitise_text(keyword),
                sanitise_text(rest)
            );
        }
    }
    materials
}

impl LibraryMaterial {
    /// Reads a statement; `None` for a malformed one.
    fn read_statement(&mut self, keyword: &str, rest: &str) -> Option<()> {
        let is_key = |key: &&str| key.eq_ignore_ascii_case(keyword);
        let mut words = rest.trim_start_matches("-halo").split_whitespace();
        let number = |word| Some(parse_number_prefix(word)?.1);
        if let Some(key) = COLOURS.into_iter().find(is_key) {
            // A number with a decimal comma, such as `0,8`, would be parsed up to the comma, as a
            // grey value.
            if words.clone().any(has_decimal_comma) {
                return None;
            }
            // "If only r is specified, then g and b are assumed to be equal to r."
            let mut rgb: Vec<f64> = words.map_while(number).take(3).collect();
            rgb.resize(3, *rgb.last()?);
            self.numbers.insert(key, [rgb[0], rgb[1], rgb[2]]);
        } else if let Some(key) = NUMBERS.into_iter().find(is_key) {
            self.numbers.insert(key, [number(words.next()?)?; 3]);
        } else if rest.is_empty() {
            return None;
        } else if let Some(key) = IMAGES.into_iter().find(is_key) {
            self.images.insert(key, TextureStatement::parse(rest));
        } else if !is_key(&"map_Ka") {
            // Some programs write `map_Bump`.
            let bump = Some("map_bump").filter(is_key);
            self.unsupported.insert(bump.unwrap_or(keyword).to_owned());
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywright_core::scene::ColourInput;

    fn parse(text: &str) -> LibraryMaterial {
        super::mtl_tests::read(text, &mut Warnings::default()).remove(0)
    }

    fn of(text: &str) -> Physical {
        let text = format!("newmtl m\n{text}");
        let material = parse(&text);
        convert_surface(&material, material.number("d").unwrap_or(1.0))
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

    pub(super) fn read(text: &str, warnings: &mut Warnings) -> Vec<LibraryMaterial> {
        let folder = Folder::for_built_in_scene(0);
        read_materials(text, (&folder, ""), warnings)
    }

    /// Protects: incomplete statements are completed or dropped.
    #[test]
    fn incomplete_statements_do_no_harm() {
        let text = "newmtl\nKd 0.5\nnewmtl a b\nKe 1 2\nNs\nillum x\nd -halo 0.25\nKs spectral f\nmap_Kd\nTf 1f 2 3 4\n";
        let mut warnings = Warnings::default();
        let materials = read(text, &mut warnings);
        assert_eq!(warnings.into_warnings("f").len(), 4);
        let [unnamed, named] = materials.as_slice() else {
            panic!("{materials:?}")
        };
        assert_eq!(
            (unnamed.name.as_str(), unnamed.colour("Kd")),
            ("unnamed", Some([0.5; 3]))
        );
        assert_eq!(
            (named.name.as_str(), named.colour("Ke"), named.number("d")),
            ("a b", Some([1.0, 2.0, 2.0]), Some(0.25))
        );
        assert_eq!(named.colour("Tf"), Some([1.0, 2.0, 3.0]));
    }

    /// Protects: keys in another case than the manual's have the same meaning; unknown keys are
    /// kept as they are written.
    #[test]
    fn keys_are_known_in_any_case() {
        let text = "NEWMTL a\nKD 0.25 0.5 1\nmap_kd x.png\nMAP_PR y.png\nILLUM 2\nXy 1\n";
        let [material] = &read(text, &mut Warnings::default())[..] else {
            panic!("one material")
        };
        assert_eq!(material.colour("Kd"), Some([0.25, 0.5, 1.0]));
        assert_eq!(material.number("illum"), Some(2.0));
        let path = |key| material.images.get(key).map(|image| image.path.as_str());
        assert_eq!(
            ["map_Kd", "map_Pr"].map(path),
            [Some("x.png"), Some("y.png")]
        );
        assert_eq!(material.unsupported, BTreeSet::from(["Xy".to_owned()]));
    }
}
