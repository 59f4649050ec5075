//! Extensions of a glTF file's materials that lay something over, under or into the metallic-roughness model.

use raywright_core::scene::{
    Anisotropy, Channel, Clearcoat, Colour, DiffuseTransmission, Iridescence, Physical, Sheen, TextureRef,
};

use super::Import;
use super::entries::{MaterialExtensions, TextureUse};
use super::texture::Use;
use crate::import::Outcome;

impl Import<'_> {
    /// Adds what a material's extensions say.
    pub(super) fn layers(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) -> Outcome<()> {
        self.specular(extensions, label, out)?;
        self.clearcoat(extensions, label, out)?;
        self.sheen(extensions, label, out)?;
        self.anisotropy(extensions, label, out)?;
        self.iridescence(extensions, label, out)?;
        self.diffuse_transmission(extensions, label, out)?;
        if let Some(data) = &extensions.dispersion {
            out.dispersion = self.at_most(data.dispersion, 400.0, label, "dispersion");
        }
        self.volume(extensions, label, out);
        Ok(())
    }

    /// The inside. Without one, what lets light through is a wall that bends none.
    fn volume(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) {
        let body = extensions.volume.as_ref().filter(|volume| volume.thickness_factor > 0.0);
        out.thin_walled = body.is_none() && (out.may_transmit() || out.may_diffuse_through());
        let Some(volume) = body else { return };
        out.attenuation_colour = Colour(volume.attenuation_color.map(|c| self.unit(c, label, "attenuationColor")));
        // Nothing is said by a distance without end.
        out.attenuation_distance = volume.attenuation_distance.filter(|distance| *distance < 1e30);
        if let Some(distance) = out.attenuation_distance.filter(|distance| distance.is_nan() || *distance < 1e-20) {
            self.warnings.add(format!("{label}: an attenuationDistance of {distance} makes no sense; nothing is absorbed"));
            out.attenuation_distance = None;
        }
    }

    fn specular(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = &extensions.specular else { return Ok(()) };
        out.specular = self.unit(data.specular_factor, label, "specularFactor").into();
        out.specular_texture = self.channel(data.specular_texture.as_ref(), Channel::Alpha)?;
        let colour = data.specular_color_factor.map(|c| self.at_most(c, 1e6, label, "specularColorFactor"));
        out.specular_colour = Colour(colour).into();
        out.specular_colour_texture = self.texture(data.specular_color_texture.as_ref(), Use::Colour)?;
        Ok(())
    }

    fn clearcoat(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = &extensions.clearcoat else { return Ok(()) };
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
            normal_texture: self.texture(data.clearcoat_normal_texture.as_ref(), Use::Data)?,
        });
        Ok(())
    }

    fn sheen(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = &extensions.sheen else { return Ok(()) };
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

    fn anisotropy(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = &extensions.anisotropy else { return Ok(()) };
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

    fn iridescence(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = &extensions.iridescence else { return Ok(()) };
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

    fn diffuse_transmission(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) -> Outcome<()> {
        let Some(data) = &extensions.diffuse_transmission else { return Ok(()) };
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
    fn channel(&mut self, info: Option<&TextureUse>, channel: Channel) -> Outcome<Option<TextureRef>> {
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
