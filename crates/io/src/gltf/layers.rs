//! Extensions of a glTF file's materials that lay something over, under or into the metallic-roughness model: read from their JSON, because
//! `gltf::json` has no types for them.

use gltf::json;
use gltf::json::texture::Info;
use raywright_core::scene::{
    Anisotropy, Channel, Clearcoat, Colour, DiffuseTransmission, Iridescence, Physical, Sheen, TextureRef,
};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::Import;
use super::texture::Use;
use crate::import::{Fault, Outcome};

/// A type for an extension with its keys, their types and the values that they have where nothing is said.
macro_rules! extension {
    ($name:ident { $($key:ident: $type:ty = $default:expr),* $(,)? }) => {
        #[derive(Debug, Deserialize)]
        #[serde(default, rename_all = "camelCase")]
        struct $name {
            $($key: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($key: $default,)* }
            }
        }
    };
}
extension!(VolumeData { thickness_factor: f64 = 0.0, attenuation_distance: Option<f64> = None, attenuation_color: [f64; 3] = [1.0; 3], });
extension!(SpecularData {
    specular_factor: f64 = 1.0,
    specular_texture: Option<Info> = None,
    specular_color_factor: [f64; 3] = [1.0; 3],
    specular_color_texture: Option<Info> = None,
});
extension!(ClearcoatData {
    clearcoat_factor: f64 = 0.0,
    clearcoat_texture: Option<Info> = None,
    clearcoat_roughness_factor: f64 = 0.0,
    clearcoat_roughness_texture: Option<Info> = None,
    clearcoat_normal_texture: Option<json::material::NormalTexture> = None,
});
extension!(SheenData {
    sheen_color_factor: [f64; 3] = [0.0; 3],
    sheen_color_texture: Option<Info> = None,
    sheen_roughness_factor: f64 = 0.0,
    sheen_roughness_texture: Option<Info> = None,
});
extension!(AnisotropyData {
    anisotropy_strength: f64 = 0.0,
    anisotropy_rotation: f64 = 0.0,
    anisotropy_texture: Option<Info> = None,
});
extension!(IridescenceData {
    iridescence_factor: f64 = 0.0,
    iridescence_texture: Option<Info> = None,
    iridescence_ior: f64 = 1.3,
    iridescence_thickness_minimum: f64 = 100.0,
    iridescence_thickness_maximum: f64 = 400.0,
    iridescence_thickness_texture: Option<Info> = None,
});
extension!(DispersionData { dispersion: f64 = 0.0 });
extension!(DiffuseTransmissionData {
    diffuse_transmission_factor: f64 = 0.0,
    diffuse_transmission_texture: Option<Info> = None,
    diffuse_transmission_color_factor: [f64; 3] = [1.0; 3],
    diffuse_transmission_color_texture: Option<Info> = None,
});

/// An extension of a material; none where it has none.
fn read<T: DeserializeOwned>(extensions: &Map<String, Value>, name: &str) -> Outcome<Option<T>> {
    let Some(value) = extensions.get(name) else { return Ok(None) };
    serde_json::from_value(value.clone()).map(Some).map_err(|e| Fault::input(format!("extensions.{name}: {e}")))
}

impl Import<'_> {
    /// Adds what a material's extensions say.
    pub(super) fn layers(&mut self, extensions: &Map<String, Value>, label: &str, out: &mut Physical) -> Outcome<()> {
        self.specular(extensions, label, out)?;
        self.clearcoat(extensions, label, out)?;
        self.sheen(extensions, label, out)?;
        self.anisotropy(extensions, label, out)?;
        self.iridescence(extensions, label, out)?;
        self.diffuse_transmission(extensions, label, out)?;
        if let Some(DispersionData { dispersion }) = read(extensions, "KHR_materials_dispersion")? {
            out.dispersion = self.at_most(dispersion, 400.0, label, "dispersion");
        }
        self.volume(extensions, label, out)
    }

    /// The inside. Without one, what lets light through is a wall that bends none.
    fn volume(&mut self, extensions: &Map<String, Value>, label: &str, out: &mut Physical) -> Outcome<()> {
        let volume: VolumeData = read(extensions, "KHR_materials_volume")?.unwrap_or_default();
        let body = volume.thickness_factor > 0.0;
        out.thin_walled = !body && (out.may_transmit() || out.may_diffuse_through());
        if !body {
            return Ok(());
        }
        out.attenuation_colour = Colour(volume.attenuation_color.map(|c| self.unit(c, label, "attenuationColor")));
        // Nothing is said by a distance without end.
        out.attenuation_distance = volume.attenuation_distance.filter(|distance| *distance < 1e30);
        if let Some(distance) = out.attenuation_distance.filter(|distance| distance.is_nan() || *distance < 1e-20) {
            self.warnings.add(format!("{label}: an attenuationDistance of {distance} makes no sense; nothing is absorbed"));
            out.attenuation_distance = None;
        }
        Ok(())
    }

    fn specular(&mut self, extensions: &Map<String, Value>, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = read::<SpecularData>(extensions, "KHR_materials_specular")? else { return Ok(()) };
        out.specular = self.unit(data.specular_factor, label, "specularFactor").into();
        out.specular_texture = self.channel(data.specular_texture.as_ref(), Channel::Alpha)?;
        let colour = data.specular_color_factor.map(|c| self.at_most(c, 1e6, label, "specularColorFactor"));
        out.specular_colour = Colour(colour).into();
        out.specular_colour_texture = self.texture(data.specular_color_texture.as_ref(), Use::Colour)?;
        Ok(())
    }

    fn clearcoat(&mut self, extensions: &Map<String, Value>, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = read::<ClearcoatData>(extensions, "KHR_materials_clearcoat")? else { return Ok(()) };
        let factor = self.unit(data.clearcoat_factor, label, "clearcoatFactor");
        if factor == 0.0 {
            return Ok(());
        }
        out.clearcoat = Some(Clearcoat {
            factor: factor.into(),
            factor_texture: self.channel(data.clearcoat_texture.as_ref(), Channel::Red)?,
            roughness: self.unit(data.clearcoat_roughness_factor, label, "clearcoatRoughnessFactor").into(),
            roughness_texture: self.channel(data.clearcoat_roughness_texture.as_ref(), Channel::Green)?,
            normal_scale: data.clearcoat_normal_texture.as_ref().map_or(1.0, |normal| f64::from(normal.scale)),
            normal_texture: self.normal_texture(data.clearcoat_normal_texture.as_ref())?,
        });
        Ok(())
    }

    fn sheen(&mut self, extensions: &Map<String, Value>, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = read::<SheenData>(extensions, "KHR_materials_sheen")? else { return Ok(()) };
        let colour = data.sheen_color_factor.map(|c| self.unit(c, label, "sheenColorFactor"));
        if colour == [0.0; 3] {
            return Ok(());
        }
        out.sheen = Some(Sheen {
            colour: Colour(colour).into(),
            colour_texture: self.texture(data.sheen_color_texture.as_ref(), Use::Colour)?,
            roughness: self.unit(data.sheen_roughness_factor, label, "sheenRoughnessFactor").into(),
            roughness_texture: self.channel(data.sheen_roughness_texture.as_ref(), Channel::Alpha)?,
        });
        Ok(())
    }

    fn anisotropy(&mut self, extensions: &Map<String, Value>, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = read::<AnisotropyData>(extensions, "KHR_materials_anisotropy")? else { return Ok(()) };
        let strength = self.unit(data.anisotropy_strength, label, "anisotropyStrength");
        if strength == 0.0 {
            return Ok(());
        }
        let rotation = data.anisotropy_rotation.to_degrees();
        out.anisotropy = Some(Anisotropy {
            strength: strength.into(),
            rotation: if rotation.abs() < 1e9 { rotation } else { 0.0 },
            texture: self.texture(data.anisotropy_texture.as_ref(), Use::Data)?,
        });
        Ok(())
    }

    fn iridescence(&mut self, extensions: &Map<String, Value>, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = read::<IridescenceData>(extensions, "KHR_materials_iridescence")? else { return Ok(()) };
        let factor = self.unit(data.iridescence_factor, label, "iridescenceFactor");
        if factor == 0.0 {
            return Ok(());
        }
        out.iridescence = Some(Iridescence {
            factor: factor.into(),
            factor_texture: self.channel(data.iridescence_texture.as_ref(), Channel::Red)?,
            ior: self.ior(data.iridescence_ior, label).min(Physical::IOR[1]),
            thickness: self.at_most(data.iridescence_thickness_maximum, 1e6, label, "iridescenceThicknessMaximum").into(),
            thinnest: self.at_most(data.iridescence_thickness_minimum, 1e6, label, "iridescenceThicknessMinimum"),
            thickness_texture: self.channel(data.iridescence_thickness_texture.as_ref(), Channel::Green)?,
        });
        Ok(())
    }

    fn diffuse_transmission(&mut self, extensions: &Map<String, Value>, label: &str, out: &mut Physical) -> Outcome<()> {
        let data = read::<DiffuseTransmissionData>(extensions, "KHR_materials_diffuse_transmission")?;
        let Some(data) = data else { return Ok(()) };
        let factor = self.unit(data.diffuse_transmission_factor, label, "diffuseTransmissionFactor");
        if factor == 0.0 {
            return Ok(());
        }
        let colour = data.diffuse_transmission_color_factor.map(|c| self.unit(c, label, "diffuseTransmissionColorFactor"));
        out.diffuse_transmission = Some(DiffuseTransmission {
            factor: factor.into(),
            factor_texture: self.channel(data.diffuse_transmission_texture.as_ref(), Channel::Alpha)?,
            colour: Colour(colour).into(),
            colour_texture: self.texture(data.diffuse_transmission_color_texture.as_ref(), Use::Colour)?,
        });
        Ok(())
    }

    /// A use of a texture for one of its channels.
    fn channel(&mut self, info: Option<&Info>, channel: Channel) -> Outcome<Option<TextureRef>> {
        let texture = self.texture(info, Use::Data)?;
        Ok(texture.map(|texture| TextureRef { channel: Some(channel), ..texture }))
    }

    /// A number from zero to the greatest that is taken.
    fn at_most(&mut self, value: f64, most: f64, label: &str, what: &str) -> f64 {
        if (0.0..=most).contains(&value) {
            return value;
        }
        let clamped = if value.is_nan() { 0.0 } else { value.clamp(0.0, most) };
        self.warnings.add(format!("{label}: {what} {value} is outside 0 to {most}; {clamped} was taken"));
        clamped
    }
}
