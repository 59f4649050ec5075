//! Rungs (quality levels of settings) and effects chosen by flags. They are applied to the scene
//! and its settings, and flags that contradict them are refused.

use raywright_core::effects::{Effect, EffectSet};
use raywright_core::ladder::{Ladder, RungChoice};
use raywright_core::{Scene, Settings};

use super::DisplayOverrides;
use crate::args::ChoiceArgs;
use crate::failure::Failure;

/// Chosen rungs (quality levels of settings) and switched-off effects.
#[derive(Clone, Debug, Default)]
pub struct RungChoices {
    /// Chosen rungs. [`RungChoices::apply`] refuses two rungs of the same ladder.
    pub rungs: Vec<RungChoice>,
    /// Switched-off effects.
    pub without: Vec<Effect>,
}

impl From<&ChoiceArgs> for RungChoices {
    fn from(args: &ChoiceArgs) -> Self {
        Self {
            rungs: args.rungs.clone(),
            without: args.without.clone(),
        }
    }
}

impl RungChoices {
    /// Applies the chosen rungs (quality levels) to the scene and its settings, and switches the
    /// effects off. Fails with a usage error for two rungs of the same ladder.
    pub fn apply(&self, scene: &mut Scene, settings: &mut Settings) -> Result<(), Failure> {
        settings.without = self.without.iter().copied().collect::<EffectSet>();
        for (i, choice) in self.rungs.iter().enumerate() {
            let ladder = choice.ladder();
            if self.rungs[..i]
                .iter()
                .any(|earlier| earlier.ladder() == ladder)
            {
                return Err(contradiction_failure(ladder, "--rung"));
            }
            if ladder == Ladder::Shadows && self.without.contains(&Effect::Shadows) {
                return Err(contradiction_failure(ladder, "--without"));
            }
            choice.apply(scene, settings);
        }
        Ok(())
    }

    /// Whether `--rung` chooses a rung (quality level) of this ladder.
    pub fn has_ladder(&self, ladder: Ladder) -> bool {
        self.rungs.iter().any(|choice| choice.ladder() == ladder)
    }

    /// Formats each choice. A rung becomes `LADDER=RUNG` after the prefix `rung`. A switched-off
    /// effect becomes its name, with hyphens in place of blanks, after the prefix `without`.
    pub fn format_choices(&self, rung: &str, without: &str) -> Vec<String> {
        let rungs = self.rungs.iter().map(|choice| format!("{rung}{choice}"));
        let without = self
            .without
            .iter()
            .map(|effect| format!("{without}{}", effect.name().replace(' ', "-")));
        rungs.chain(without).collect()
    }
}

/// Refuses a `--rung` for a ladder whose setting another given flag, such as `--spp`, sets too.
pub(super) fn refuse_contradicting_flags(
    rungs: &[RungChoice],
    overrides: &DisplayOverrides,
) -> Result<(), Failure> {
    let light = &overrides.light;
    for choice in rungs {
        let flag = match choice.ladder() {
            Ladder::Precision if light.precision.is_some() => "--precision",
            Ladder::Samples if light.spp.is_some() => "--spp",
            Ladder::Clamp if light.clamp.is_some() => "--clamp",
            Ladder::Reconstruction if light.denoise => "--denoise",
            Ladder::Reconstruction | Ladder::Samples if light.quick => "--quick",
            Ladder::PathLength if light.max_depth.is_some() => "--max-depth",
            Ladder::Accelerator | Ladder::Build if overrides.accel.is_some() => "--accel",
            _ => continue,
        };
        return Err(contradiction_failure(choice.ladder(), flag));
    }
    Ok(())
}

fn contradiction_failure(ladder: Ladder, flag: &str) -> Failure {
    Failure::usage(
        format_args!(
            "--rung {}=... and {flag} both set the ladder {}",
            ladder.name(),
            ladder.name()
        ),
        "leave out one of the two flags",
    )
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use raywright_core::accuracy::RungSetting;

    use super::*;
    use crate::args::{Arguments, Command};
    use crate::plan::RenderTask;

    fn task(words: &[&str]) -> RenderTask {
        let words = [&["raywright", "render"], words].concat();
        let Ok(Arguments {
            command: Some(Command::Render(args)),
            ..
        }) = Arguments::try_parse_from(words)
        else {
            panic!("a right command line")
        };
        RenderTask::new(*args).expect("nothing is wrong with it")
    }

    fn rungs(list: &[&str]) -> RungChoices {
        let choice = |text: &&str| RungChoice::parse(text).expect("a rung");
        RungChoices {
            rungs: list.iter().map(choice).collect(),
            without: Vec::new(),
        }
    }

    /// Protects: chosen rungs and switched-off effects reach the settings, and contradictory flags
    /// are refused.
    #[test]
    fn choices_reach_the_settings_once() {
        let (mut scene, mut settings) = (Scene::default(), Settings::from_scene(&Scene::default()));
        let choices = RungChoices {
            without: vec![Effect::Highlights],
            ..rungs(&["path-length=4", "shadows=off"])
        };
        choices
            .apply(&mut scene, &mut settings)
            .expect("no contradiction");
        assert_eq!(
            (settings.max_depth, settings.without),
            (
                4,
                EffectSet::from_effects(&[Effect::Highlights, Effect::Shadows])
            )
        );
        assert!(
            rungs(&["build=fast", "build=high"])
                .apply(&mut scene, &mut settings)
                .is_err()
        );
        let both = RungChoices {
            without: vec![Effect::Shadows],
            ..rungs(&["shadows=on"])
        };
        assert!(both.apply(&mut scene, &mut settings).is_err());
    }

    /// Protects: `--rung` renders exactly the scene and settings that the ladder measures, for
    /// every rung of every ladder.
    #[test]
    fn what_is_rendered_is_what_is_measured() {
        let texture = serde_json::json!({ "name": "t", "image": "i", "filter": "bilinear" });
        let own: Scene =
            serde_json::from_value(serde_json::json!({ "format": 1, "textures": [texture] }))
                .expect("a scene");
        let rendered = |words: &[&str]| {
            let mut scene = own.clone();
            let plan = task(words)
                .resolve_plan(&mut scene, None, |_, _, _, _| panic!("nothing is framed"))
                .expect("a plan");
            (scene, plan.settings)
        };
        let (_, settings) = rendered(&[]);
        for choice in Ladder::ALL.into_iter().flat_map(Ladder::choices) {
            let measured = RungSetting::from_rung(choice).apply(&own, &settings);
            assert_eq!(
                rendered(&["--rung", &choice.to_string()]),
                measured,
                "{choice}"
            );
        }
    }

    /// Protects: a flag such as `--spp` contradicts only the rungs of the ladder that it sets.
    #[test]
    fn each_flag_has_its_ladders() {
        let refused = |flag: &[&str]| {
            [
                "precision=reference",
                "samples=4",
                "path-length=2",
                "accelerator=linear",
                "build=fast",
                "clamp=10",
                "reconstruction=denoised",
            ]
            .map(|rung| {
                let RenderTask {
                    choices, overrides, ..
                } = task(&[&["--rung", rung], flag].concat());
                u8::from(refuse_contradicting_flags(&choices.rungs, &overrides).is_err())
            })
        };
        assert_eq!(
            refused(&["--precision", "reference"]),
            [1, 0, 0, 0, 0, 0, 0]
        );
        assert_eq!(refused(&["--spp", "4"]), [0, 1, 0, 0, 0, 0, 0]);
        assert_eq!(refused(&["--max-depth", "2"]), [0, 0, 1, 0, 0, 0, 0]);
        assert_eq!(refused(&["--accel", "bvh"]), [0, 0, 0, 1, 1, 0, 0]);
        assert_eq!(refused(&["--clamp", "3"]), [0, 0, 0, 0, 0, 1, 0]);
        assert_eq!(refused(&["--denoise"]), [0, 0, 0, 0, 0, 0, 1]);
        assert_eq!(refused(&["--quick"]), [0, 1, 0, 0, 0, 0, 1]);
        assert_eq!(refused(&[]), [0; 7]);
    }

    /// Protects: chosen rungs and switched-off effects are printed as the user typed them.
    #[test]
    fn choices_have_their_own_words() {
        let choices = RungChoices {
            without: vec![Effect::MirrorReflection, Effect::Sky],
            ..rungs(&["samples=16"])
        };
        let words = choices.format_choices(" rung:", " without=").concat();
        assert_eq!(
            words,
            " rung:samples=16 without=mirror-reflection without=sky"
        );
    }
}
