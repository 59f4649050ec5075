//! The ladders: every choice that trades accuracy for time, under a name, with its rungs and what
//! each gets wrong.
//!
//! A ladder is a closed set of rungs from fast to exact. Which rung is in use is read from scene
//! and settings, and choosing one changes these and nothing else, so that a rung and the flag or
//! key that means the same cannot differ.

mod choice;
mod in_use;
mod rungs;
mod value;

use raywright_bvh::BuildQuality;
use serde::Serialize;

use crate::denoise;
use crate::effects::{Effect, EffectReport, EffectSet, Status, chosen};
use crate::scene::{Integrator, Scene};
use crate::settings::Settings;
pub use choice::{Choice, UnknownRung};
pub use rungs::Ladder;
pub use value::RungValue;

/// One rung of a ladder.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rung {
    /// Name in reports and on the command line.
    pub name: &'static str,
    /// What it is, and what it gets wrong.
    pub about: &'static str,
    /// What it sets.
    #[serde(skip)]
    pub value: RungValue,
}

impl Ladder {
    /// Its rungs as choices, in the same order.
    pub fn choices(self) -> impl DoubleEndedIterator<Item = Choice> {
        self.rungs()
            .iter()
            .map(move |rung| Choice { ladder: self, rung })
    }

    /// Whether the picture depends on it; otherwise only time and memory do, or what a file keeps
    /// of it.
    pub const fn changes_pictures(self) -> bool {
        !matches!(self, Self::Build | Self::Accelerator | Self::Output)
    }

    /// Whether its rungs are different pictures of equal right, so that none is the more exact one:
    /// what the scene asks for is what the others are compared with.
    pub const fn is_a_matter_of_taste(self) -> bool {
        matches!(self, Self::PixelFilter)
    }

    /// Whether a render on one rung can have the random numbers of a render on another, so that
    /// they differ by the choice alone.
    pub const fn shares_random_numbers(self) -> bool {
        !matches!(
            self,
            Self::Samples
                | Self::Sampler
                | Self::LightSampling
                | Self::Integrator
                | Self::Colour
                | Self::Roulette
                | Self::Reconstruction
        )
    }

    /// Whether its rungs have one mean, so that they differ in noise alone.
    pub const fn is_free_of_bias(self) -> bool {
        matches!(
            self,
            Self::Samples | Self::Sampler | Self::LightSampling | Self::Roulette
        )
    }

    /// A scene reaches it when it calls for one of these; every scene does where the set is empty.
    pub const fn effects(self) -> EffectSet {
        match self {
            Self::RayOffset => EffectSet::of(&[
                Effect::Shadows,
                Effect::SoftShadows,
                Effect::MirrorReflection,
                Effect::Refraction,
                Effect::Transparency,
            ]),
            Self::Shadows => EffectSet::of(&[Effect::Shadows, Effect::SoftShadows]),
            Self::LightSampling => EffectSet::of(&[Effect::SoftShadows, Effect::SkyLight]),
            Self::Fresnel | Self::Microfacets => EffectSet::of(&[Effect::PhysicalMaterials]),
            Self::Colour => EffectSet::of(&[Effect::Dispersion]),
            Self::TextureFilter => EffectSet::of(&[Effect::ImageTextures]),
            Self::PathLength => EffectSet::of(&[
                Effect::MirrorReflection,
                Effect::Refraction,
                Effect::Transparency,
            ]),
            _ => EffectSet::EMPTY,
        }
    }

    /// The rung of a name.
    pub fn rung(self, name: &str) -> Option<&'static Rung> {
        self.rungs().iter().find(|rung| rung.name == name)
    }

    /// Name of the rung in use; a number of samples or segments need not be that of a rung.
    pub fn in_use(self, scene: &Scene, settings: &Settings) -> String {
        let Some(value) = self.value_in_use(scene, settings) else {
            return if self == Self::Build { "none" } else { "mixed" }.to_owned();
        };
        let rung = self.rungs().iter().find(|rung| rung.value == value);
        rung.map_or_else(|| value.number(), |rung| rung.name.to_owned())
    }
}

/// How trees are built, by the name of a rung of [`Ladder::Build`]; none where it has no such rung.
pub fn build_quality(rung: &str) -> Option<BuildQuality> {
    let RungValue::Build(quality) = Ladder::Build.rung(rung)?.value else {
        return None;
    };
    Some(quality)
}

/// The rung of [`Ladder::Build`] that builds trees so.
pub fn build_rung(quality: BuildQuality) -> &'static str {
    Ladder::Build
        .rungs()
        .iter()
        .find(|rung| rung.value == RungValue::Build(quality))
        .map_or("", |rung| rung.name)
}

/// A ladder as one render stands on it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurrentRung {
    /// Name of the ladder.
    pub ladder: &'static str,
    /// Name of the rung in use.
    pub rung: String,
    /// The rung where nothing is said.
    pub default: &'static str,
    /// Whether the picture depends on it.
    pub changes_pictures: bool,
    /// All rungs, from fast to exact.
    pub rungs: &'static [Rung],
}

/// The effects that a scene calls for.
pub fn called_for(effects: &EffectReport) -> EffectSet {
    effects
        .effects
        .iter()
        .filter(|f| f.status != Status::Absent)
        .map(|f| f.effect)
        .collect()
}

/// The ladders that a scene reaches: those whose effects it calls for.
pub fn reached(
    scene: &Scene,
    settings: &Settings,
    effects: &EffectReport,
) -> impl Iterator<Item = Ladder> + use<> {
    let present = called_for(effects);
    // Whitted ray tracing always asks, and meets nothing by chance; paths go on from every surface.
    let paths = chosen(scene, settings) == Integrator::Path;
    let is_fixed = settings.sampling.is_fixed();
    let can_be_denoised = denoise::is_possible(settings.sampling);
    // Where samples lie at random places, or draw points of lamps.
    let by_chance = !is_fixed
        || paths
        || present.has(Effect::SoftShadows)
        || present.has(Effect::FuzzyReflection);
    let called_for = move |ladder: Ladder| {
        ladder.effects().is_empty() || !ladder.effects().and(present).is_empty()
    };
    Ladder::ALL.into_iter().filter(move |&ladder| match ladder {
        // Classic surfaces have one reading by each integrator, and neither is the more exact one.
        Ladder::Integrator => paths || present.has(Effect::PhysicalMaterials),
        Ladder::LightSampling | Ladder::Fresnel | Ladder::Microfacets | Ladder::Colour => {
            paths && called_for(ladder)
        }
        Ladder::PathLength => paths || called_for(ladder),
        Ladder::PixelFilter => !is_fixed,
        Ladder::Roulette | Ladder::Clamp => paths,
        Ladder::Sampler => by_chance,
        Ladder::Reconstruction => by_chance && can_be_denoised,
        _ => called_for(ladder),
    })
}

/// The ladders that a scene reaches, with the rungs in use.
pub fn standings(scene: &Scene, settings: &Settings, effects: &EffectReport) -> Vec<CurrentRung> {
    let standing = |ladder: Ladder| CurrentRung {
        ladder: ladder.name(),
        rung: ladder.in_use(scene, settings),
        default: ladder.default_rung(),
        changes_pictures: ladder.changes_pictures(),
        rungs: ladder.rungs(),
    };
    reached(scene, settings, effects).map(standing).collect()
}

#[cfg(test)]
mod tests;
