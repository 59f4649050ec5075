//! Ladders and rungs. A ladder is a choice that trades accuracy for time, such as the number of
//! samples. A rung is one of its values, from fast to exact.
//!
//! The rung in use is read from scene and settings, and choosing a rung changes only scene and
//! settings. So a rung always means the same as the command-line flag or scene key for that choice.

mod choice;
mod rungs;
mod value;

use raywright_bvh::BuildQuality;
use serde::Serialize;

use crate::denoise;
use crate::effects::{Effect, EffectReport, EffectSet, EffectStatus, chosen_integrator};
use crate::scene::{Integrator, Scene};
use crate::settings::Settings;
pub use choice::{RungChoice, UnknownRungError};
pub use rungs::Ladder;
pub use value::RungValue;

/// Rung: a value of a ladder, with its name and description. A ladder is a choice that trades
/// accuracy for time, see [`Ladder`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rung {
    /// Name in reports and on the command line.
    pub name: &'static str,
    /// Description for users. It says which error the rung causes.
    pub about: &'static str,
    /// Value that the rung sets in scene and settings.
    #[serde(skip)]
    pub value: RungValue,
}

impl Ladder {
    /// Iterates over the ladder's rungs from fast to exact, each as a choice that names the ladder
    /// too.
    pub fn choices(self) -> impl DoubleEndedIterator<Item = RungChoice> {
        self.rungs()
            .iter()
            .map(move |rung| RungChoice { ladder: self, rung })
    }

    /// Whether different rungs of the ladder give different pictures. All other ladders change only
    /// time, memory or the file format.
    pub const fn changes_pictures(self) -> bool {
        !matches!(self, Self::Build | Self::Accelerator | Self::Output)
    }

    /// Whether all rungs have the same expected picture. Their renders then differ only in noise.
    pub const fn is_free_of_bias(self) -> bool {
        matches!(
            self,
            Self::Samples | Self::Sampler | Self::LightSampling | Self::SkyChoice | Self::Roulette
        )
    }

    /// Returns the effects on which the ladder has an influence. The ladder matters to scenes with
    /// any of these effects; without effects, to every scene.
    const fn affected_effects(self) -> &'static [Effect] {
        use Effect::*;
        match self {
            Self::RayOffset => &[
                Shadows,
                SoftShadows,
                MirrorReflection,
                Refraction,
                Transparency,
            ],
            Self::Shadows => &[Shadows, SoftShadows],
            Self::LightSampling => &[SoftShadows, SkyLight],
            Self::SkyChoice => &[SkyLight],
            Self::Fresnel | Self::Microfacets => &[PhysicalMaterials],
            Self::Colour => &[Dispersion],
            Self::TextureFilter => &[ImageTextures],
            Self::PathLength => &[MirrorReflection, Refraction, Transparency],
            _ => &[],
        }
    }

    /// Returns the rung with this name, or `None`.
    pub fn rung_by_name(self, name: &str) -> Option<&'static Rung> {
        self.rungs().iter().find(|rung| rung.name == name)
    }

    /// Returns the name of the rung in use: the one whose choice changes nothing. Outside the ladder it
    /// is a number, `none` for trees that are not used, and `mixed` for several.
    pub fn current_rung_name(self, scene: &Scene, settings: &Settings) -> String {
        // What rungs change or read of a scene.
        let part = Scene {
            render: scene.render.clone(),
            classic: scene.classic.clone(),
            textures: scene.textures.clone(),
            ..Scene::default()
        };
        let settings = Settings {
            integrator: chosen_integrator(scene, settings),
            ..settings.clone()
        };
        let is_in_use = |rung: &&Rung| {
            let (mut scene, mut after) = (part.clone(), settings.clone());
            rung.value.apply(&mut scene, &mut after);
            scene == part && after == settings
        };
        match self.rungs().iter().find(is_in_use) {
            Some(rung) => rung.name.to_owned(),
            None => match self {
                Self::PathLength if settings.max_depth == Settings::UNLIMITED => "unlimited".into(),
                Self::PathLength => settings.max_depth.to_string(),
                Self::Samples => settings.samples().to_string(),
                Self::Clamp => settings.clamp.unwrap_or_default().to_string(),
                Self::Build => "none".into(),
                _ => "mixed".into(),
            },
        }
    }
}

/// Returns the build quality that a rung of [`Ladder::Build`] sets, or `None` for an unknown name.
pub fn build_quality_of_rung(rung: &str) -> Option<BuildQuality> {
    let RungValue::Build(quality) = Ladder::Build.rung_by_name(rung)?.value else {
        return None;
    };
    Some(quality)
}

/// Returns the name of the rung of [`Ladder::Build`] with this build quality.
pub fn rung_name_of_build_quality(quality: BuildQuality) -> &'static str {
    Ladder::Build
        .rungs()
        .iter()
        .find(|rung| rung.value == RungValue::Build(quality))
        .map_or("", |rung| rung.name)
}

/// A ladder (a choice that trades accuracy for time) with the rung (value) that a scene and its
/// settings use. For reports.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurrentRung {
    /// Name of the ladder.
    pub ladder: &'static str,
    /// Name of the rung in use.
    pub rung: String,
    /// Name of the default rung.
    pub default: &'static str,
    /// Whether the ladder changes the picture.
    pub changes_pictures: bool,
    /// All rungs, from fast to exact.
    pub rungs: &'static [Rung],
}

/// Returns the effects that a scene needs according to a report, whether they are simulated or left
/// out.
pub(crate) fn needed_effects(effects: &EffectReport) -> EffectSet {
    effects
        .effects
        .iter()
        .filter(|f| f.status != EffectStatus::Absent)
        .map(|f| f.effect)
        .collect()
}

/// Iterates over the ladders that have an influence on a scene. They depend on its integrator,
/// sampling and effects.
pub(crate) fn applicable_ladders(
    scene: &Scene,
    settings: &Settings,
    effects: &EffectReport,
) -> impl Iterator<Item = Ladder> + use<> {
    let present = needed_effects(effects);
    // Whitted ray tracing samples every light and hits none by chance. Path tracing continues from
    // every surface.
    let paths = chosen_integrator(scene, settings) == Integrator::Path;
    let is_fixed = settings.sampling.is_fixed();
    let can_be_denoised = denoise::is_denoisable_sampling(settings.sampling);
    // Whether random numbers choose positions in the pixel, paths, or points on area lights.
    let by_chance = !is_fixed
        || paths
        || present.has(Effect::SoftShadows)
        || present.has(Effect::FuzzyReflection);
    let called_for = move |ladder: Ladder| {
        let affected = ladder.affected_effects();
        affected.is_empty() || affected.iter().any(|&effect| present.has(effect))
    };
    Ladder::ALL.into_iter().filter(move |&ladder| match ladder {
        // The integrators interpret classic materials differently, and neither is more exact.
        Ladder::Integrator => paths || present.has(Effect::PhysicalMaterials),
        Ladder::LightSampling
        | Ladder::SkyChoice
        | Ladder::Fresnel
        | Ladder::Microfacets
        | Ladder::Colour => paths && called_for(ladder),
        Ladder::PathLength => paths || called_for(ladder),
        Ladder::PixelFilter => !is_fixed,
        Ladder::Roulette | Ladder::Clamp => paths,
        Ladder::Sampler => by_chance,
        Ladder::Reconstruction => by_chance && can_be_denoised,
        _ => called_for(ladder),
    })
}

/// Returns the ladders that have an influence on a scene, each with its rung in use.
pub fn current_rungs(
    scene: &Scene,
    settings: &Settings,
    effects: &EffectReport,
) -> Vec<CurrentRung> {
    let current_rung = |ladder: Ladder| CurrentRung {
        ladder: ladder.name(),
        rung: ladder.current_rung_name(scene, settings),
        default: ladder.default_rung(),
        changes_pictures: ladder.changes_pictures(),
        rungs: ladder.rungs(),
    };
    applicable_ladders(scene, settings, effects)
        .map(current_rung)
        .collect()
}

#[cfg(test)]
mod tests;
