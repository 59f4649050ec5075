//! What a rung sets in a scene and its settings.

use raywright_bvh::{AcceleratorKind, BuildQuality};

use crate::display::Output;
use crate::effects::{Effect, EffectSet};
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{ConstantOffset, Filter, Integrator, OffsetDirection, Scene, SpawnRule};
use crate::settings::{
    AreaShadows, LightSampling, Microfacets, PrecisionChoice, Roulette, SamplerKind, Sampling,
    Settings,
};

/// The constant offset of scenes that name none, in metres.
pub(super) const OFFSET: ConstantOffset = ConstantOffset {
    offset: 1e-3,
    along: OffsetDirection::Normal,
    camera_min: 0.0,
    secondary_min: 0.0,
    shadow_min: 0.0,
};

/// What a rung means, each kind of one ladder.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the ladders say what they are")]
pub enum RungValue {
    Integrator(Integrator),
    Precision(PrecisionChoice),
    /// Whether rays start at a constant distance from where they leave.
    ConstantOffset(bool),
    /// None: there are no shadows.
    Shadows(Option<AreaShadows>),
    LightSampling(LightSampling),
    Fresnel(FresnelRule),
    Microfacets(Microfacets),
    /// Whether light that is bent has a wavelength.
    Spectral(bool),
    TextureFilter(Filter),
    PathLength(u32),
    Roulette(Roulette),
    /// None: samples are as bright as they are.
    Clamp(Option<f64>),
    PixelFilter(PixelFilter),
    Samples(u32),
    Sampler(SamplerKind),
    Denoised(bool),
    Output(Output),
    Build(BuildQuality),
    /// Whether there is a tree.
    Tree(bool),
}

impl RungValue {
    /// Puts scene and settings on it.
    pub(super) fn apply(self, scene: &mut Scene, settings: &mut Settings) {
        match self {
            Self::Integrator(value) => settings.integrator = value,
            Self::Precision(value) => settings.precision = value,
            Self::ConstantOffset(false) => scene.classic.spawn = SpawnRule::ErrorBound,
            // A scene's own constant stays.
            Self::ConstantOffset(true) if matches!(scene.classic.spawn, SpawnRule::Constant(_)) => {
            }
            Self::ConstantOffset(true) => scene.classic.spawn = SpawnRule::Constant(OFFSET),
            Self::Shadows(value) => {
                switch(settings, Effect::Shadows, value.is_none());
                settings.area_shadows = value.unwrap_or_default();
            }
            Self::LightSampling(value) => settings.light_sampling = value,
            Self::Fresnel(value) => settings.fresnel = value,
            Self::Microfacets(value) => settings.microfacets = value,
            Self::Spectral(value) => switch(settings, Effect::Dispersion, !value),
            Self::TextureFilter(value) => scene
                .textures
                .iter_mut()
                .for_each(|texture| texture.filter = value),
            Self::PathLength(value) => settings.max_depth = value,
            Self::Roulette(value) => settings.roulette = value,
            Self::Clamp(value) => settings.clamp = value,
            Self::PixelFilter(value) => settings.filter = value,
            Self::Samples(value) => settings.sampling = Sampling::resolve(scene, Some(value)),
            Self::Sampler(value) => settings.sampler = value,
            Self::Denoised(value) => settings.denoise = value,
            Self::Output(value) => settings.output = value,
            Self::Build(value) => settings.accelerator = AcceleratorKind::Tree(value),
            Self::Tree(false) => settings.accelerator = AcceleratorKind::Linear,
            // So does the tree of a build that was chosen.
            Self::Tree(true) if matches!(settings.accelerator, AcceleratorKind::Tree(_)) => {}
            Self::Tree(true) => settings.accelerator = AcceleratorKind::default(),
        }
    }

    /// What it is called where it is no rung.
    pub(super) fn number(self) -> String {
        match self {
            Self::PathLength(Settings::UNLIMITED) => "unlimited".to_owned(),
            Self::PathLength(number) | Self::Samples(number) => number.to_string(),
            Self::Clamp(Some(most)) => most.to_string(),
            // Every other value is a rung's.
            other => format!("{other:?}"),
        }
    }
}

/// Switches an effect off or on.
fn switch(settings: &mut Settings, effect: Effect, off: bool) {
    let (one, others) = (
        EffectSet::of(&[effect]),
        settings.without.without(EffectSet::of(&[effect])),
    );
    settings.without = if off { others.or(one) } else { others };
}
