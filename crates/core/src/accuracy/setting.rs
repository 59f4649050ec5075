//! Settings that are measured: a scene as it is asked for, with some of its ladders on other rungs.

use core::fmt;

use crate::ladder::{Choice, Ladder};
use crate::scene::Scene;
use crate::settings::{PrecisionChoice, Sampling, Settings};

/// Other rungs than the scene's own, at most one a ladder; none: the scene as it is asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setting(Vec<Choice>);

impl Setting {
    /// One ladder on another rung.
    pub fn one(choice: Choice) -> Self {
        Self(vec![choice])
    }

    /// Several ladders on other rungs; the last one counts where a ladder is named twice.
    pub fn of(choices: &[Choice]) -> Self {
        choices
            .iter()
            .fold(Self::default(), |setting, &choice| setting.with(choice))
    }

    /// The rungs, in the order of their ladders.
    pub fn choices(&self) -> &[Choice] {
        &self.0
    }

    /// The same with one ladder on another rung.
    #[must_use]
    pub fn with(&self, choice: Choice) -> Self {
        let others = self
            .0
            .iter()
            .copied()
            .filter(|other| other.ladder() != choice.ladder());
        let mut all: Vec<Choice> = others.chain([choice]).collect();
        all.sort_by_key(Choice::ladder);
        Self(all)
    }

    /// The same with one ladder back where the scene has it.
    #[must_use]
    pub fn without(&self, ladder: Ladder) -> Self {
        Self(
            self.0
                .iter()
                .copied()
                .filter(|choice| choice.ladder() != ladder)
                .collect(),
        )
    }

    /// The rung that a ladder is put on; none where it stays.
    pub fn rung(&self, ladder: Ladder) -> Option<Choice> {
        self.0
            .iter()
            .copied()
            .find(|choice| choice.ladder() == ladder)
    }

    /// Scene and settings as this setting has them.
    pub fn applied(&self, scene: &Scene, settings: &Settings) -> (Scene, Settings) {
        let (mut scene, mut settings) = (scene.clone(), settings.clone());
        self.0
            .iter()
            .for_each(|choice| choice.apply(&mut scene, &mut settings));
        (scene, settings)
    }

    /// Whether it differs from the scene's own in noise alone.
    pub fn is_free_of_bias(&self) -> bool {
        self.0
            .iter()
            .all(|choice| choice.ladder().is_free_of_bias())
    }

    /// The flags that ask for it, one a ladder.
    pub fn flags(&self) -> Vec<String> {
        self.0
            .iter()
            .map(|choice| format!("--rung {choice}"))
            .collect()
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.as_slice() {
            [] => f.write_str("as it is"),
            all => f.write_str(
                &all.iter()
                    .map(Choice::to_string)
                    .collect::<Vec<_>>()
                    .join(" "),
            ),
        }
    }
}

/// Scene and settings of the reference: on the rungs given, in f64, with so many samples of the
/// general sampler and random numbers that no measured render has.
pub(super) fn reference(
    exact: &Setting,
    scene: &Scene,
    settings: &Settings,
    samples: u32,
) -> (Scene, Settings) {
    let (scene, mut settings) = exact.applied(scene, settings);
    settings.precision = PrecisionChoice::Reference;
    settings.sampling = Sampling::General(samples);
    settings.seed = !settings.seed;
    settings.denoise = false;
    (scene, settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(text: &str) -> Choice {
        Choice::parse(text).expect("a rung")
    }

    /// Protects: a ladder stands on one rung at a time, and settings that ask for the same are the
    /// same, however they came about.
    #[test]
    fn each_ladder_has_one_rung() {
        let one = Setting::one(choice("samples=16"))
            .with(choice("precision=reference"))
            .with(choice("samples=4"));
        let other = Setting::one(choice("precision=reference")).with(choice("samples=4"));
        assert_eq!(one, other);
        assert_eq!(
            one.flags(),
            ["--rung precision=reference", "--rung samples=4"]
        );
        assert_eq!(
            one.without(Ladder::Samples),
            Setting::one(choice("precision=reference"))
        );
        assert_eq!(one.rung(Ladder::Samples), Some(choice("samples=4")));
        assert_eq!(
            (
                Setting::default().to_string().as_str(),
                Setting::default().flags().len()
            ),
            ("as it is", 0)
        );
    }

    /// Protects: the reference is in f64 with its own samples, whatever the rungs, and shares no
    /// random numbers with renders.
    #[test]
    fn the_reference_is_better_than_all() {
        let scene = Scene::default();
        let settings = Settings {
            max_depth: 2,
            ..Settings::of(&scene)
        };
        let rungs = Setting::one(choice("path-length=64"))
            .with(choice("precision=reference"))
            .with(choice("samples=4"));
        let (_, exact) = reference(&rungs, &scene, &settings, 300);
        assert_eq!(
            (exact.max_depth, exact.precision),
            (64, PrecisionChoice::Reference)
        );
        assert_eq!(exact.sampling, Sampling::General(300));
        assert_ne!(exact.seed, settings.seed);
    }
}
