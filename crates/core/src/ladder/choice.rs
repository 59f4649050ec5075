//! A rung that was asked for, and how scene and settings are put on it.

use core::fmt;

use raywright_bvh::{AcceleratorKind, BuildQuality};

use super::{FILTERS, Ladder};
use crate::display::Output;
use crate::effects::{Effect, EffectSet};
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{ConstantOffset, Integrator, OffsetDirection, Scene, SpawnRule};
use crate::settings::{
    Accumulation, AreaShadows, LightSampling, Microfacets, PrecisionChoice, Roulette, SamplerKind, Sampling, Settings,
};
use crate::suggest::closest;

/// The constant offset of scenes that name none, in metres.
pub(super) const OFFSET: ConstantOffset =
    ConstantOffset { offset: 1e-3, along: OffsetDirection::Normal, camera_min: 0.0, secondary_min: 0.0, shadow_min: 0.0 };

/// A rung of a ladder that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    pub(super) ladder: Ladder,
    pub(super) rung: &'static str,
}

/// Why a text names no rung.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnknownRung(String);

impl Choice {
    /// Reads `LADDER=RUNG`.
    ///
    /// # Errors
    /// What is wrong with the text, with the nearest word or all of them.
    pub fn parse(text: &str) -> Result<Self, UnknownRung> {
        let (ladder, rung) =
            text.split_once('=').ok_or_else(|| UnknownRung("expected LADDER=RUNG, such as precision=reference".to_owned()))?;
        let known: Vec<&str> = Ladder::ALL.iter().map(|ladder| ladder.name()).collect();
        let found = Ladder::ALL.into_iter().find(|known| known.name() == ladder);
        let ladder = found.ok_or_else(|| unknown("ladder", ladder, &known))?;
        let names: Vec<&'static str> = ladder.rungs().iter().map(|rung| rung.name).collect();
        let found = names.iter().find(|name| **name == rung);
        let rung = found.ok_or_else(|| unknown(&format!("rung of {}", ladder.name()), rung, &names))?;
        Ok(Self { ladder, rung })
    }

    /// The ladder.
    pub fn ladder(&self) -> Ladder {
        self.ladder
    }

    /// Name of the rung.
    pub fn rung(&self) -> &'static str {
        self.rung
    }

    /// What the rung is, and what it gets wrong.
    pub fn about(&self) -> &'static str {
        self.ladder.rungs().iter().find(|rung| rung.name == self.rung).map_or("", |rung| rung.about)
    }

    /// Whether the rung is another picture than its neighbour to a scene that calls for these effects: without lamps of a size there are no
    /// penumbras to lose, and without lights of none nothing that passes everything.
    pub fn differs(&self, present: EffectSet) -> bool {
        match (self.ladder, self.rung) {
            (Ladder::Shadows, "hard") => present.has(Effect::SoftShadows),
            (Ladder::Shadows, "off") => present.has(Effect::Shadows),
            _ => true,
        }
    }

    /// Whether it can be what the others of its ladder are compared with: what makes light can't.
    pub fn can_be_reference(&self) -> bool {
        !matches!((self.ladder, self.rung), (Ladder::Fresnel, "model"))
    }

    /// Puts scene and settings on the rung.
    pub fn apply(&self, scene: &mut Scene, settings: &mut Settings) {
        // Names of rungs come from the ladder, so each is found and each number is one.
        let at = self.ladder.rungs().iter().position(|rung| rung.name == self.rung).unwrap_or_default();
        let number = || self.rung.parse().unwrap_or(1);
        match self.ladder {
            Ladder::Integrator => settings.integrator = [Integrator::Whitted, Integrator::Path][at],
            Ladder::Precision => {
                settings.precision = [PrecisionChoice::Robust, PrecisionChoice::Reference][at];
            }
            Ladder::RayOffset => match (at, scene.classic.spawn) {
                (0, SpawnRule::ErrorBound) => scene.classic.spawn = SpawnRule::Constant(OFFSET),
                (0, SpawnRule::Constant(_)) => {}
                _ => scene.classic.spawn = SpawnRule::ErrorBound,
            },
            Ladder::Shadows => {
                switch(settings, Effect::Shadows, at == 0);
                settings.area_shadows = if at == 1 { AreaShadows::Hard } else { AreaShadows::Soft };
            }
            Ladder::Roulette => settings.roulette = [Roulette::Early, Roulette::Late, Roulette::Off][at],
            Ladder::Clamp => settings.clamp = self.rung.parse().ok(),
            Ladder::Sampler => {
                settings.sampler = [SamplerKind::Independent, SamplerKind::Stratified, SamplerKind::Sobol][at];
            }
            Ladder::Accumulation => settings.accumulation = [Accumulation::Single, Accumulation::Double][at],
            Ladder::Reconstruction => settings.denoise = at == 0,
            Ladder::Output => settings.output = Output::ALL[at],
            Ladder::Colour => switch(settings, Effect::Dispersion, at == 0),
            Ladder::LightSampling => {
                settings.light_sampling = [LightSampling::Scattering, LightSampling::Lights, LightSampling::Both][at];
            }
            Ladder::Fresnel => settings.fresnel = FresnelRule::ALL[at],
            Ladder::Microfacets => settings.microfacets = [Microfacets::Single, Microfacets::Compensated][at],
            Ladder::TextureFilter => {
                let filter = FILTERS[at];
                scene.textures.iter_mut().for_each(|texture| texture.filter = filter);
            }
            Ladder::PathLength => settings.max_depth = number(),
            Ladder::PixelFilter => settings.filter = PixelFilter::ALL[at],
            Ladder::Samples => settings.sampling = Sampling::resolve(scene, Some(number())),
            Ladder::Build => settings.accelerator = AcceleratorKind::Tree(BuildQuality::ALL[at]),
            Ladder::Accelerator => match at {
                0 => settings.accelerator = AcceleratorKind::Linear,
                _ if matches!(settings.accelerator, AcceleratorKind::Tree(_)) => {}
                _ => settings.accelerator = AcceleratorKind::default(),
            },
        }
    }
}

/// Switches an effect off or on.
fn switch(settings: &mut Settings, effect: Effect, off: bool) {
    let (one, others) = (EffectSet::of(&[effect]), settings.without.without(EffectSet::of(&[effect])));
    settings.without = if off { others.or(one) } else { others };
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.ladder.name(), self.rung)
    }
}

fn unknown(what: &str, name: &str, known: &[&str]) -> UnknownRung {
    let hint = match closest(name, known.iter().copied()) {
        Some(word) => format!("did you mean `{word}`?"),
        None => format!("known: {}", known.join(", ")),
    };
    UnknownRung(format!("there is no {what} `{name}`; {hint}"))
}
