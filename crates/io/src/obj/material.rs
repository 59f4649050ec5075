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

use raywright_core::scene::{
    AlphaMode, Anisotropy, Channel, Clearcoat, Colour, ColourSpace, NumberInput, Physical, Sheen,
    TextureInput, TextureRef,
};

use super::SceneBuilder;
use super::mtl::LibraryMaterial;
use super::texture::TextureStatement;
use crate::import::{Warnings, sanitise_text};

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
            out.normal_texture = texture("norm", ColourSpace::Linear);
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
            channel: Some(Channel::Red),
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
