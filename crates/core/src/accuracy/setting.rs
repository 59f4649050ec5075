//! A setting to be measured: the scene with some changed rungs (quality levels).

use core::fmt;

use serde::Serialize;

use crate::ladder::{Ladder, RungChoice};
use crate::scene::Scene;
use crate::settings::{PrecisionChoice, Sampling, Settings};

/// Set of rungs (quality levels) that replace the scene's own, at most one per ladder (choice). The
/// empty set is the scene's own setting. Files hold its flags.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(into = "Vec<String>")]
pub struct RungSetting(Vec<RungChoice>);

impl From<RungSetting> for Vec<String> {
    fn from(setting: RungSetting) -> Self {
        setting.flags()
    }
}

impl RungSetting {
    /// Returns the setting that changes a single rung (quality level).
    pub fn from_rung(choice: RungChoice) -> Self {
        Self(vec![choice])
    }

    /// Returns the setting with these rungs (quality levels). Of several rungs of the same ladder,
    /// the last counts.
    pub fn from_rungs(choices: &[RungChoice]) -> Self {
        Self::default().with_rungs(choices)
    }

    /// Returns the changed rungs (quality levels), in the order of their ladders.
    pub fn choices(&self) -> &[RungChoice] {
        &self.0
    }

    /// Returns the setting with this rung (quality level) added. It replaces a rung of the same
    /// ladder.
    #[must_use]
    pub fn with_rung(&self, choice: RungChoice) -> Self {
        let others = self
            .0
            .iter()
            .copied()
            .filter(|other| other.ladder() != choice.ladder());
        let mut all: Vec<RungChoice> = others.chain([choice]).collect();
        all.sort_by_key(RungChoice::ladder);
        Self(all)
    }

    /// Returns the setting with these rungs added. Each replaces a rung of the same ladder.
    #[must_use]
    pub fn with_rungs(&self, choices: &[RungChoice]) -> Self {
        let all = choices.iter();
        all.fold(self.clone(), |setting, &choice| setting.with_rung(choice))
    }

    /// Returns the setting without a change of this ladder, which has the scene's own rung (quality
    /// level) again.
    #[must_use]
    pub fn without_ladder(&self, ladder: Ladder) -> Self {
        Self(
            self.0
                .iter()
                .copied()
                .filter(|choice| choice.ladder() != ladder)
                .collect(),
        )
    }

    /// Returns the changed rung (quality level) of a ladder, or `None` if the ladder has the
    /// scene's own rung.
    pub fn rung(&self, ladder: Ladder) -> Option<RungChoice> {
        self.0
            .iter()
            .copied()
            .find(|choice| choice.ladder() == ladder)
    }

    /// Returns the scene and its settings after applying the changed rungs (quality levels).
    pub fn apply(&self, scene: &Scene, settings: &Settings) -> (Scene, Settings) {
        let (mut scene, mut settings) = (scene.clone(), settings.clone());
        self.0
            .iter()
            .for_each(|choice| choice.apply(&mut scene, &mut settings));
        (scene, settings)
    }

    /// Whether the setting differs from the scene's own only in noise: none of its changed ladders
    /// adds bias.
    pub fn is_free_of_bias(&self) -> bool {
        self.0
            .iter()
            .all(|choice| choice.ladder().is_free_of_bias())
    }

    /// Returns the flags of `render` for the changed rungs (quality levels), such as `--spp 16`.
    pub fn flags(&self) -> Vec<String> {
        self.0.iter().map(RungChoice::flag).collect()
    }
}

impl fmt::Display for RungSetting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.is_empty() {
            true => f.write_str("in use"),
            false => f.write_str(&self.flags().join(" ")),
        }
    }
}

/// Returns scene and settings of the reference picture. It has the rungs (quality levels) of
/// `exact`, `samples` per pixel, arithmetic in f64, random numbers of its own, and no denoising.
pub(super) fn reference_setup(
    exact: &RungSetting,
    scene: &Scene,
    settings: &Settings,
    samples: u32,
) -> (Scene, Settings) {
    let (scene, mut settings) = exact.apply(scene, settings);
    settings.precision = PrecisionChoice::Reference;
    settings.sampling = Sampling::General(samples);
    settings.seed = !settings.seed;
    settings.denoise = false;
    (scene, settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(text: &str) -> RungChoice {
        RungChoice::parse(text).expect("a rung")
    }

    /// Protects: a ladder has one rung at a time, and equal settings compare equal, whatever the
    /// order of their construction.
    #[test]
    fn each_ladder_has_one_rung() {
        let setting = RungSetting::from_rung(choice("samples=16"))
            .with_rung(choice("precision=reference"))
            .with_rung(choice("samples=4"));
        let other =
            RungSetting::from_rung(choice("precision=reference")).with_rung(choice("samples=4"));
        assert_eq!(setting, other);
        assert_eq!(setting.flags(), ["--spp 4", "--precision reference"]);
        assert_eq!(
            setting.without_ladder(Ladder::Samples),
            RungSetting::from_rung(choice("precision=reference"))
        );
        assert_eq!(setting.rung(Ladder::Samples), Some(choice("samples=4")));
        assert_eq!(
            (
                RungSetting::default().to_string().as_str(),
                RungSetting::default().flags().len()
            ),
            ("in use", 0)
        );
    }

    /// Protects: the reference is in f64 with its own number of samples, whatever the rungs, and
    /// shares no random numbers with renders.
    #[test]
    fn the_reference_is_better_than_all() {
        let scene = Scene::default();
        let settings = Settings {
            max_depth: 2,
            ..Settings::from_scene(&scene)
        };
        let rungs = RungSetting::from_rung(choice("path-length=64"))
            .with_rung(choice("precision=reference"))
            .with_rung(choice("samples=4"));
        let (_, exact) = reference_setup(&rungs, &scene, &settings, 300);
        assert_eq!(
            (exact.max_depth, exact.precision),
            (64, PrecisionChoice::Reference)
        );
        assert_eq!(exact.sampling, Sampling::General(300));
        assert_ne!(exact.seed, settings.seed);
    }
}
