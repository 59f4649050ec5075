//! Values that rungs (quality levels) set in a scene and its settings.

use raywright_bvh::{AcceleratorKind, BuildQuality};

use crate::display::OutputFormat;
use crate::effects::{Effect, EffectSet};
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{ConstantOffset, Integrator, OffsetDirection, Scene, SpawnRule, TextureFilter};
use crate::settings::{
    AreaShadows, LightSampling, MicrofacetEnergy, PrecisionChoice, RouletteStart, SamplerKind,
    Sampling, Settings, SkyChoice,
};

/// Constant offset in metres of the start of rays with the rung `ray-offset=constant`. It applies
/// to scenes that do not set a constant offset themselves.
pub(super) const OFFSET: ConstantOffset = ConstantOffset {
    offset: 1e-3,
    along: OffsetDirection::Normal,
    camera_min: 0.0,
    secondary_min: 0.0,
    shadow_min: 0.0,
};

/// Value that a rung sets in scene and settings, such as a number of samples. Each variant belongs
/// to one ladder.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the ladders say what they are")]
pub enum RungValue {
    Integrator(Integrator),
    Precision(PrecisionChoice),
    /// Whether rays that leave a surface start at a constant distance from it.
    ConstantOffset(bool),
    /// Shadows of area lights; `None` switches off the shadows of lights without size.
    Shadows(Option<AreaShadows>),
    LightSampling(LightSampling),
    SkyChoice(SkyChoice),
    Fresnel(FresnelRule),
    Microfacets(MicrofacetEnergy),
    /// Whether a path refracted with dispersion carries a single wavelength.
    Spectral(bool),
    TextureFilter(TextureFilter),
    PathLength(u32),
    Roulette(RouletteStart),
    /// Greatest radiance of a sample; `None` does not clamp.
    Clamp(Option<f64>),
    PixelFilter(PixelFilter),
    Samples(u32),
    Sampler(SamplerKind),
    Denoised(bool),
    Output(OutputFormat),
    Build(BuildQuality),
    /// Whether a BVH is used; else every primitive is tested.
    Tree(bool),
}

impl RungValue {
    /// Sets the value in scene and settings.
    pub(super) fn apply(self, scene: &mut Scene, settings: &mut Settings) {
        match self {
            Self::Integrator(value) => settings.integrator = value,
            Self::Precision(value) => settings.precision = value,
            Self::ConstantOffset(false) => scene.classic.spawn = SpawnRule::ErrorBound,
            // A constant offset of the scene itself stays.
            Self::ConstantOffset(true) if matches!(scene.classic.spawn, SpawnRule::Constant(_)) => {
            }
            Self::ConstantOffset(true) => scene.classic.spawn = SpawnRule::Constant(OFFSET),
            Self::Shadows(value) => {
                set_effect_switched_off(settings, Effect::Shadows, value.is_none());
                settings.area_shadows = value.unwrap_or(settings.area_shadows);
            }
            Self::LightSampling(value) => settings.light_sampling = value,
            Self::SkyChoice(value) => settings.sky_choice = value,
            Self::Fresnel(value) => settings.fresnel = value,
            Self::Microfacets(value) => settings.microfacets = value,
            Self::Spectral(value) => set_effect_switched_off(settings, Effect::Dispersion, !value),
            Self::TextureFilter(value) => scene
                .textures
                .iter_mut()
                .for_each(|texture| texture.filter = value),
            Self::PathLength(value) => settings.max_depth = value,
            Self::Roulette(value) => settings.roulette = value,
            Self::Clamp(value) => settings.clamp = value,
            Self::PixelFilter(value) => settings.filter = value,
            Self::Samples(value) => settings.sampling = Sampling::from_spp(scene, Some(value)),
            Self::Sampler(value) => settings.sampler = value,
            Self::Denoised(value) => settings.denoise = value,
            Self::Output(value) => settings.output = value,
            Self::Build(value) => settings.accelerator = AcceleratorKind::Tree(value),
            Self::Tree(false) => settings.accelerator = AcceleratorKind::Linear,
            // A chosen build quality of the tree stays.
            Self::Tree(true) if matches!(settings.accelerator, AcceleratorKind::Tree(_)) => {}
            Self::Tree(true) => settings.accelerator = AcceleratorKind::default(),
        }
    }
}

/// Switches an effect off or on in the settings.
fn set_effect_switched_off(settings: &mut Settings, effect: Effect, off: bool) {
    let (effects, others) = (
        EffectSet::from_effects(&[effect]),
        settings.without.without(EffectSet::from_effects(&[effect])),
    );
    settings.without = if off { others.or(effects) } else { others };
}
