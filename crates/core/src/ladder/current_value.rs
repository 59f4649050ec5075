//! The value that a ladder (a choice that trades accuracy for time) has in a scene and its
//! settings.

use raywright_bvh::AcceleratorKind;

use super::{Ladder, RungValue};
use crate::effects::{Effect, chosen_integrator};
use crate::scene::{Scene, SpawnRule};
use crate::settings::Settings;

impl Ladder {
    /// Returns the ladder's value in a scene and its settings. `None` if textures have different
    /// filters (for the ladder of the texture filter), or if no BVH is used (for its build
    /// quality).
    pub(super) fn current_value(self, scene: &Scene, settings: &Settings) -> Option<RungValue> {
        Some(match self {
            Self::Integrator => RungValue::Integrator(chosen_integrator(scene, settings)),
            Self::Precision => RungValue::Precision(settings.precision),
            Self::RayOffset => {
                RungValue::ConstantOffset(matches!(scene.classic.spawn, SpawnRule::Constant(_)))
            }
            Self::Shadows => RungValue::Shadows(
                (!settings.without.has(Effect::Shadows)).then_some(settings.area_shadows),
            ),
            Self::LightSampling => RungValue::LightSampling(settings.light_sampling),
            Self::SkyChoice => RungValue::SkyChoice(settings.sky_choice),
            Self::Fresnel => RungValue::Fresnel(settings.fresnel),
            Self::Microfacets => RungValue::Microfacets(settings.microfacets),
            Self::Colour => RungValue::Spectral(!settings.without.has(Effect::Dispersion)),
            Self::TextureFilter => {
                let mut filters = scene.textures.iter().map(|texture| texture.filter);
                let first = filters.next().unwrap_or_default();
                return filters
                    .all(|other| other == first)
                    .then_some(RungValue::TextureFilter(first));
            }
            Self::PathLength => RungValue::PathLength(settings.max_depth),
            Self::Roulette => RungValue::Roulette(settings.roulette),
            Self::Clamp => RungValue::Clamp(settings.clamp),
            Self::PixelFilter => RungValue::PixelFilter(settings.filter),
            Self::Samples => RungValue::Samples(settings.samples()),
            Self::Sampler => RungValue::Sampler(settings.sampler),
            Self::Reconstruction => RungValue::Denoised(settings.denoise),
            Self::Output => RungValue::Output(settings.output),
            Self::Build => match settings.accelerator {
                AcceleratorKind::Tree(quality) => RungValue::Build(quality),
                AcceleratorKind::Linear => return None,
            },
            Self::Accelerator => {
                RungValue::Tree(matches!(settings.accelerator, AcceleratorKind::Tree(_)))
            }
        })
    }
}
