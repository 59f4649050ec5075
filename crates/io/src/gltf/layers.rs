//! Material extensions that add layers or lobes to the metallic-roughness model.

use raywright_core::scene::{
    Anisotropy, Channel, Clearcoat, Colour, DiffuseTransmission, Iridescence, Physical, Sheen,
    TextureRef,
};
use raywright_core::validate::{MAX_COORDINATE, MIN_LENGTH};

use super::GltfImport;
use super::entries::{MaterialExtensions, TextureInfo};
use super::texture::TextureRole;
use crate::import::{ImportResult, format_number};
use crate::warning::WarningCode;

impl GltfImport<'_> {
    /// Adds the layers and lobes of a material's extensions to `out`.
    pub(super) fn add_layers(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        self.add_specular(extensions, label, out)?;
        self.add_clearcoat(extensions, label, out)?;
        self.add_sheen(extensions, label, out)?;
        self.add_anisotropy(extensions, label, out)?;
        self.add_iridescence(extensions, label, out)?;
        self.add_diffuse_transmission(extensions, label, out)?;
        if let Some(data) = &extensions.dispersion {
            out.dispersion = self.warnings.clamp_with_warning(
                data.dispersion,
                [0.0, 400.0],
                label,
                "dispersion",
            );
        }
        self.add_volume(extensions, label, out);
        Ok(())
    }

    /// Sets the absorption of the interior (KHR_materials_volume). Without this extension, a
    /// transmissive surface is a thin wall, which does not refract.
    fn add_volume(&mut self, extensions: &MaterialExtensions, label: &str, out: &mut Physical) {
        let body = extensions
            .volume
            .as_ref()
            .filter(|volume| volume.thickness_factor > 0.0);
        out.thin_walled = body.is_none() && (out.may_transmit() || out.may_transmit_diffusely());
        let Some(volume) = body else { return };
        out.attenuation_colour = Colour(
            volume
                .attenuation_color
                .map(|c| self.clamp_unit(c, label, "attenuationColor")),
        );
        // An infinite distance means no absorption.
        let distance = volume
            .attenuation_distance
            .filter(|distance| *distance <= MAX_COORDINATE);
        if let Some(distance) = distance.filter(|distance| *distance <= 0.0) {
            self.warnings.add(
                WarningCode::Range,
                format!(
                    "{label}: the attenuationDistance {} is not above 0; the material absorbs nothing",
                    format_number(distance)
                ),
            );
            return;
        }
        out.attenuation_distance = distance.map(|distance| {
            self.warnings.clamp_with_warning(
                distance,
                [MIN_LENGTH, MAX_COORDINATE],
                label,
                "attenuationDistance",
            )
        });
    }

    fn add_specular(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        let Some(data) = &extensions.specular else {
            return Ok(());
        };
        out.specular = self
            .clamp_unit(data.specular_factor, label, "specularFactor")
            .into();
        out.specular_texture =
            self.texture_channel(data.specular_texture.as_ref(), Channel::Alpha)?;
        let colour = data.specular_color_factor.map(|c| {
            self.warnings
                .clamp_with_warning(c, [0.0, 1e6], label, "specularColorFactor")
        });
        out.specular_colour = Colour(colour).into();
        out.specular_colour_texture =
            self.convert_texture_ref(data.specular_color_texture.as_ref(), TextureRole::Colour)?;
        Ok(())
    }

    fn add_clearcoat(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        let Some(data) = &extensions.clearcoat else {
            return Ok(());
        };
        let factor = self.clamp_unit(data.clearcoat_factor, label, "clearcoatFactor");
        if factor == 0.0 {
            return Ok(());
        }
        out.clearcoat = Some(Clearcoat {
            factor: factor.into(),
            factor_texture: self.texture_channel(data.clearcoat_texture.as_ref(), Channel::Red)?,
            roughness: self
                .clamp_unit(
                    data.clearcoat_roughness_factor,
                    label,
                    "clearcoatRoughnessFactor",
                )
                .into(),
            roughness_texture: self
                .texture_channel(data.clearcoat_roughness_texture.as_ref(), Channel::Green)?,
            normal_scale: self.clamp_normal_scale(
                data.clearcoat_normal_texture.as_ref(),
                label,
                "clearcoatNormalTexture.scale",
            ),
            normal_texture: self
                .convert_texture_ref(data.clearcoat_normal_texture.as_ref(), TextureRole::Data)?,
        });
        Ok(())
    }

    fn add_sheen(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        let Some(data) = &extensions.sheen else {
            return Ok(());
        };
        let colour = data
            .sheen_color_factor
            .map(|c| self.clamp_unit(c, label, "sheenColorFactor"));
        if colour == [0.0; 3] {
            return Ok(());
        }
        out.sheen = Some(Sheen {
            colour: Colour(colour).into(),
            colour_texture: self
                .convert_texture_ref(data.sheen_color_texture.as_ref(), TextureRole::Colour)?,
            roughness: self
                .clamp_unit(data.sheen_roughness_factor, label, "sheenRoughnessFactor")
                .into(),
            roughness_texture: self
                .texture_channel(data.sheen_roughness_texture.as_ref(), Channel::Alpha)?,
        });
        Ok(())
    }

    fn add_anisotropy(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        let Some(data) = &extensions.anisotropy else {
            return Ok(());
        };
        let strength = self.clamp_unit(data.anisotropy_strength, label, "anisotropyStrength");
        if strength == 0.0 {
            return Ok(());
        }
        // Full turns have no effect on the direction.
        let rotation = (data.anisotropy_rotation % core::f64::consts::TAU).to_degrees();
        out.anisotropy = Some(Anisotropy {
            strength: strength.into(),
            rotation,
            texture: self
                .convert_texture_ref(data.anisotropy_texture.as_ref(), TextureRole::Data)?,
        });
        Ok(())
    }

    fn add_iridescence(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        let Some(data) = &extensions.iridescence else {
            return Ok(());
        };
        let factor = self.clamp_unit(data.iridescence_factor, label, "iridescenceFactor");
        if factor == 0.0 {
            return Ok(());
        }
        out.iridescence = Some(Iridescence {
            factor: factor.into(),
            factor_texture: self
                .texture_channel(data.iridescence_texture.as_ref(), Channel::Red)?,
            ior: self.warnings.clamp_with_warning(
                data.iridescence_ior,
                Physical::IOR,
                label,
                "iridescenceIor",
            ),
            thickness: self
                .warnings
                .clamp_with_warning(
                    data.iridescence_thickness_maximum,
                    [0.0, 1e6],
                    label,
                    "iridescenceThicknessMaximum",
                )
                .into(),
            thinnest: self.warnings.clamp_with_warning(
                data.iridescence_thickness_minimum,
                [0.0, 1e6],
                label,
                "iridescenceThicknessMinimum",
            ),
            thickness_texture: self
                .texture_channel(data.iridescence_thickness_texture.as_ref(), Channel::Green)?,
        });
        Ok(())
    }

    fn add_diffuse_transmission(
        &mut self,
        extensions: &MaterialExtensions,
        label: &str,
        out: &mut Physical,
    ) -> ImportResult<()> {
        let Some(data) = &extensions.diffuse_transmission else {
            return Ok(());
        };
        let factor = self.clamp_unit(
            data.diffuse_transmission_factor,
            label,
            "diffuseTransmissionFactor",
        );
        if factor == 0.0 {
            return Ok(());
        }
        let colour = data
            .diffuse_transmission_color_factor
            .map(|c| self.clamp_unit(c, label, "diffuseTransmissionColorFactor"));
        out.diffuse_transmission = Some(DiffuseTransmission {
            factor: factor.into(),
            factor_texture: self
                .texture_channel(data.diffuse_transmission_texture.as_ref(), Channel::Alpha)?,
            colour: Colour(colour).into(),
            colour_texture: self.convert_texture_ref(
                data.diffuse_transmission_color_texture.as_ref(),
                TextureRole::Colour,
            )?,
        });
        Ok(())
    }

    /// Returns a reference to a single channel of a texture; `None` without a texture.
    fn texture_channel(
        &mut self,
        info: Option<&TextureInfo>,
        channel: Channel,
    ) -> ImportResult<Option<TextureRef>> {
        let texture = self.convert_texture_ref(info, TextureRole::Data)?;
        Ok(texture.map(|texture| TextureRef {
            channel: Some(channel),
            ..texture
        }))
    }
}
