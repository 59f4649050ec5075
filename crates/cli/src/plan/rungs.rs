//! Rungs of ladders that were asked for by name: put onto scene and settings, where nothing else says something different.

use raywright_core::effects::{Effect, EffectSet};
use raywright_core::ladder::Ladder;
use raywright_core::{Scene, Settings};
use raywright_io::Error;

use crate::args::{ChoiceArgs, RenderArgs};
use crate::failure::Failure;

/// Applies `--without` and `--rung`.
pub fn choose(args: &ChoiceArgs, scene: &mut Scene, settings: &mut Settings) -> Result<(), Failure> {
    settings.without = args.without.iter().copied().collect::<EffectSet>();
    for (i, choice) in args.rungs.iter().enumerate() {
        let ladder = choice.ladder();
        if args.rungs[..i].iter().any(|earlier| earlier.ladder() == ladder) {
            return Err(twice(ladder, "--rung"));
        }
        if ladder == Ladder::Shadows && args.without.contains(&Effect::Shadows) {
            return Err(twice(ladder, "--without"));
        }
        choice.apply(scene, settings);
    }
    Ok(())
}

/// Refuses a rung of a ladder that has a flag of its own, where that is given too.
pub fn refuse_two_words(args: &RenderArgs) -> Result<(), Failure> {
    for choice in &args.choices.rungs {
        let flag = match choice.ladder() {
            Ladder::Precision if args.light.precision.is_some() => "--precision",
            Ladder::Samples if args.light.spp.is_some() => "--spp",
            Ladder::Clamp if args.light.clamp.is_some() => "--clamp",
            Ladder::Reconstruction if args.light.denoise => "--denoise",
            Ladder::Reconstruction | Ladder::Samples if args.light.quick => "--quick",
            Ladder::PathLength if args.light.max_depth.is_some() => "--max-depth",
            Ladder::Accelerator | Ladder::Build if args.machine.accel.is_some() => "--accel",
            _ => continue,
        };
        return Err(twice(choice.ladder(), flag));
    }
    Ok(())
}

fn twice(ladder: Ladder, flag: &str) -> Failure {
    let error = Error::usage(format_args!("--rung {}=... and {flag} both say which {} is meant", ladder.name(), ladder.name()));
    error.with_hint("leave one of them away").into()
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use raywright_core::accuracy::Setting;
    use raywright_core::ladder::Choice;

    use super::*;
    use crate::args::{Arguments, Command, LightArgs, Precision};

    fn rungs(list: &[&str]) -> ChoiceArgs {
        let choice = |text: &&str| Choice::parse(text).expect("a rung");
        ChoiceArgs { rungs: list.iter().map(choice).collect(), without: Vec::new() }
    }

    /// Protects: rungs and switches reach the settings, and two words for one thing are refused.
    #[test]
    fn choices_reach_the_settings_once() {
        let (mut scene, mut settings) = (Scene::default(), Settings::of(&Scene::default()));
        let args = ChoiceArgs { without: vec![Effect::Highlights], ..rungs(&["path-length=4", "shadows=off"]) };
        choose(&args, &mut scene, &mut settings).expect("no contradiction");
        assert_eq!((settings.max_depth, settings.without), (4, EffectSet::of(&[Effect::Highlights, Effect::Shadows])));
        assert!(choose(&rungs(&["build=fast", "build=high"]), &mut scene, &mut settings).is_err());
        let both = ChoiceArgs { without: vec![Effect::Shadows], ..rungs(&["shadows=on"]) };
        assert!(choose(&both, &mut scene, &mut settings).is_err());
    }

    /// Protects: what `--rung` renders is what the ladder measures, by every rung of every ladder: one scene and one set of settings.
    #[test]
    fn what_is_rendered_is_what_is_measured() {
        let texture = serde_json::json!({ "name": "t", "image": "i", "filter": "bilinear" });
        let own: Scene = serde_json::from_value(serde_json::json!({ "format": 1, "textures": [texture] })).expect("a scene");
        let rendered = |rungs: &[Choice]| {
            let mut scene = own.clone();
            let args =
                RenderArgs { choices: ChoiceArgs { rungs: rungs.to_vec(), ..ChoiceArgs::default() }, ..RenderArgs::default() };
            let mut plan = super::super::settle(&scene, &args, |_, _, _| panic!("nothing is framed")).expect("a plan");
            choose(&args.choices, &mut scene, &mut plan.settings).expect("no contradiction");
            (scene, plan.settings)
        };
        let (_, settings) = rendered(&[]);
        for choice in Ladder::ALL.into_iter().flat_map(Ladder::choices) {
            let words = ["raywright", "render", "--rung", &choice.to_string()];
            let Ok(Arguments { command: Some(Command::Render(args)), .. }) = Arguments::try_parse_from(words) else {
                panic!("a right command line")
            };
            assert_eq!(rendered(&args.choices.rungs), Setting::one(choice).applied(&own, &settings), "{choice}");
        }
    }

    /// Protects: a flag and a rung of the same ladder contradict each other; of two ladders they don't.
    #[test]
    fn a_flag_and_its_rung_are_refused() {
        let light = LightArgs { precision: Some(Precision::Reference), ..LightArgs::default() };
        let with = |list: &[&str]| RenderArgs { choices: rungs(list), light: light.clone(), ..RenderArgs::default() };
        assert!(refuse_two_words(&with(&["precision=reference"])).is_err());
        assert!(refuse_two_words(&with(&["samples=4", "path-length=2"])).is_ok());
    }

    /// Protects: every flag contradicts the rungs of what it says, and no others.
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
                let words = [&["raywright", "render", "--rung", rung], flag].concat();
                let Ok(Arguments { command: Some(Command::Render(args)), .. }) = Arguments::try_parse_from(words) else {
                    panic!("a right command line")
                };
                u8::from(refuse_two_words(&args).is_err())
            })
        };
        assert_eq!(refused(&["--precision", "reference"]), [1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(refused(&["--spp", "4"]), [0, 1, 0, 0, 0, 0, 0]);
        assert_eq!(refused(&["--max-depth", "2"]), [0, 0, 1, 0, 0, 0, 0]);
        assert_eq!(refused(&["--accel", "bvh"]), [0, 0, 0, 1, 1, 0, 0]);
        assert_eq!(refused(&["--clamp", "3"]), [0, 0, 0, 0, 0, 1, 0]);
        assert_eq!(refused(&["--denoise"]), [0, 0, 0, 0, 0, 0, 1]);
        assert_eq!(refused(&["--quick"]), [0, 1, 0, 0, 0, 0, 1]);
        assert_eq!(refused(&[]), [0; 7]);
    }
}
