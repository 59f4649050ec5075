//! Material extensions that add layers or lobes to the metallic-roughness model.

use raywright_core::scene::{
    Anisotropy, Channel, Clearcoat, Colour, DiffuseTransmission, Iridescence, Physical, Sheen,
    TextureRef,
};
use raywright_core::validate::{FARTHEST, SMALLEST};

use super::Import;
use super::entries::{MaterialExtensions, TextureUse};
use super::texture::TextureRole;
use crate::import::{Outcome, number};
use crate::warning::WarningCode;

impl Import<'_> {
    /// Adds the layers and lobes of a material's extensions to `out`.
    pub(super) fn layers(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> Outcome<()> {
        self.specular(extensions, label, out)?;
        self.clearcoat(extensions, label, out)?;
        self.sheen(extensions, label, out)?;
        self.anisotropy(extensions, label, out)?;
        self.iridescence(extensions, label, out)?;
        self.diffuse_transmission(extensions, label, out)?;
        if let Some(data) = &extensions.dispersion {
            out.dispersion =
                self.warnings
                    .clamped(data.dispersion, [0.0, 400.0], label, "dispersion");
        }
        self.volume(extensions, label, out);
        Ok(())
    }

    /// Adds the absorption of the interior (KHR_materials_volume). Without a volume, a transmissive
    /// surface is thin-walled and does not refract.
    fn volume(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) {
        let body = extensions
            .volume
            .as_ref()
            .filter(|volume| volume.thickness_factor > 0.0);
        out.thin_walled = body.is_none() && (out.may_transmit() || out.may_diffuse_through());
        let Some(volume) = body else { return };
        out.attenuation_colour = Colour(
            volume
                .attenuation_color
                .map(|c| self.unit(c, label, "attenuationColor")),
        );
        // An infinite distance means no absorption.
        let distance = volume
            .attenuation_distance
            .filter(|distance| *distance <= FARTHEST);
        if let Some(distance) = distance.filter(|distance| *distance <= 0.0) {
            self.warnings.add(
                WarningCode::Range,
                format!(
                    "{label}: an attenuationDistance of {} makes no sense; nothing is absorbed",
                    number(distance)
                ),
            );
            return;
        }
        out.attenuation_distance = distance.map(|distance| {
            self.warnings
                .clamped(distance, [SMALLEST, FARTHEST], label, "attenuationDistance")
        });
    }

    fn specular(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> Outcome<()> {
        let Some(data) = &extensions.specular else {
            return Ok(());
        };
        out.specular = self
            .unit(data.specular_factor, label, "specularFactor")
            .into();
        out.specular_texture = self.channel(data.specular_texture.as_ref(), Channel::Alpha)?;
        let colour = data.specular_color_factor.map(|c| {
            self.warnings
                .clamped(c, [0.0, 1e6], label, "specularColorFactor")
        });
        out.specular_colour = Colour(colour).into();
        out.specular_colour_texture =
            self.texture(data.specular_color_texture.as_ref(), TextureRole::Colour)?;
        Ok(())
    }

    fn clearcoat(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> Outcome<()> {
        let Some(data) = &extensions.clearcoat else {
            return Ok(());
        };
        let factor = self.unit(data.clearcoat_factor, label, "clearcoatFactor");
        if factor == 0.0 {
            return Ok(());
        }
        out.clearcoat = Some(Clearcoat {
            factor: factor.into(),
            factor_texture: self.channel(data.clearcoat_texture.as_ref(), Channel::Red)?,
            roughness: self
                .unit(
                    data.clearcoat_roughness_factor,
                    label,
                    "clearcoatRoughnessFactor",
                )
                .into(),
            roughness_texture: self
                .channel(data.clearcoat_roughness_texture.as_ref(), Channel::Green)?,
            normal_scale: self.normal_scale(
                data.clearcoat_normal_texture.as_ref(),
                label,
                "clearcoatNormalTexture.scale",
            ),
            normal_texture: self
                .texture(data.clearcoat_normal_texture.as_ref(), TextureRole::Data)?,
        });
        Ok(())
    }

    fn sheen(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> Outcome<()> {
        let Some(data) = &extensions.sheen else {
            return Ok(());
        };
        let colour = data
            .sheen_color_factor
            .map(|c| self.unit(c, label, "sheenColorFactor"));
        if colour == [0.0; 3] {
            return Ok(());
        }
        out.sheen = Some(Sheen {
            colour: Colour(colour).into(),
            colour_texture: self.texture(data.sheen_color_texture.as_ref(), TextureRole::Colour)?,
            roughness: self
                .unit(data.sheen_roughness_factor, label, "sheenRoughnessFactor")
                .into(),
            roughness_texture: self
                .channel(data.sheen_roughness_texture.as_ref(), Channel::Alpha)?,
        });
        Ok(())
    }

    fn anisotropy(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> Outcome<()> {
        let Some(data) = &extensions.anisotropy else {
            return Ok(());
        };
        let strength = self.unit(data.anisotropy_strength, label, "anisotropyStrength");
        if strength == 0.0 {
            return Ok(());
        }
        // Whole turns have no effect.
        let rotation = (data.anisotropy_rotation % core::f64::consts::TAU).to_degrees();
        out.anisotropy = Some(Anisotropy {
            strength: strength.into(),
            rotation,
            texture: self.texture(data.anisotropy_texture.as_ref(), TextureRole::Data)?,
        });
        Ok(())
    }

    fn iridescence(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> Outcome<()> {
        let Some(data) = &extensions.iridescence else {
            return Ok(());
        };
        let factor = self.unit(data.iridescence_factor, label, "iridescenceFactor");
        if factor == 0.0 {
            return Ok(());
        }
        out.iridescence = Some(Iridescence {
            factor: factor.into(),
            factor_texture: self.channel(data.iridescence_texture.as_ref(), Channel::Red)?,
            ior: self.warnings.clamped(
                data.iridescence_ior,
                Physical::IOR,
                label,
                "iridescenceIor",
            ),
            thickness: self
                .warnings
                .clamped(
                    data.iridescence_thickness_maximum,
                    [0.0, 1e6],
                    label,
                    "iridescenceThicknessMaximum",
                )
                .into(),
            thinnest: self.warnings.clamped(
                data.iridescence_thickness_minimum,
                [0.0, 1e6],
                label,
                "iridescenceThicknessMinimum",
            ),
            thickness_texture: self
                .channel(data.iridescence_thickness_texture.as_ref(), Channel::Green)?,
        });
        Ok(())
    }

    fn diffuse_transmission(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> Outcome<()> {
        let Some(data) = &extensions.diffuse_transmission else {
            return Ok(());
        };
        let factor = self.unit(
            data.diffuse_transmission_factor,
            label,
            "diffuseTransmissionFactor",
        );
        if factor == 0.0 {
            return Ok(());
        }
        let colour = data
            .diffuse_transmission_color_factor
            .map(|c| self.unit(c, label, "diffuseTransmissionColorFactor"));
        out.diffuse_transmission = Some(DiffuseTransmission {
            factor: factor.into(),
            factor_texture: self
                .channel(data.diffuse_transmission_texture.as_ref(), Channel::Alpha)?,
            colour: Colour(colour).into(),
            colour_texture: self.texture(
                data.diffuse_transmission_color_texture.as_ref(),
                TextureRole::Colour,
            )?,
        });
        Ok(())
    }

    /// Returns a reference to a single channel of a texture; `None` without a texture.
    fn channel(
        &mut self,
        info: Option<&TextureUse>,
        channel: Channel,
    ) -> Outcome<Option<TextureRef>> {
        let texture = self.texture(info, TextureRole::Data)?;
        Ok(texture.map(|texture| TextureRef {
            channel: Some(channel),
            ..texture
        }))
    }
}
