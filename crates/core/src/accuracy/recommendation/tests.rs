//! Rules of the report's first sentences, on constructed measurements.

use super::*;
use crate::accuracy::RungSetting;
use crate::ladder::RungChoice;

/// A value with an interval of a factor.
fn about(value: f64, factor: f64) -> ConfidenceInterval {
    ConfidenceInterval {
        value,
        low: value / factor,
        high: value * factor,
    }
}

fn measured(rungs: &str, bias: f64, light: f64) -> MeasuredSetting {
    MeasuredSetting {
        setting: setting(rungs),
        flags: Vec::new(),
        seconds: about(1.0, 1.1),
        ratio: about(1.0, 1.1),
        errors: SettingErrors {
            root_relmse: about(0.1, 1.05),
            bias: Some(about(bias * 0.1, 1.02)),
            light: about(light, 1.001),
        },
        error_ratio: about(1.0, 1.1),
    }
}

fn setting(rungs: &str) -> RungSetting {
    let choice = |rung: &str| RungChoice::parse(rung).expect("a rung");
    let rungs = rungs.split(' ').filter(|rung| !rung.is_empty());
    RungSetting::from_rungs(&rungs.map(choice).collect::<Vec<_>>())
}

/// Setting with given ratios of time and root error to the setting in use, and the factor of the
/// error's interval.
fn candidate(rungs: &str, time: f64, root: f64, factor: f64) -> MeasuredSetting {
    MeasuredSetting {
        seconds: about(time, 1.05),
        ratio: about(time, 1.05),
        errors: SettingErrors {
            root_relmse: about(root, factor),
            ..measured(rungs, 0.0, 1.0).errors
        },
        error_ratio: about(root, factor),
        ..measured(rungs, 0.0, 1.0)
    }
}

/// The same with much less light.
fn unsound(rungs: &str, time: f64, root: f64) -> MeasuredSetting {
    let mut dark = candidate(rungs, time, root, 1.1);
    dark.errors.light = about(0.5, 1.001);
    dark
}

/// Flags and time of the three recommendations.
fn told(all: &[MeasuredSetting]) -> [Option<(String, f64)>; 3] {
    let found = recommend_settings(all, &pareto_front(all));
    [found.half_the_error, found.same_error, found.biased].map(|advice| {
        let measured = &all[advice?.row];
        Some((measured.setting.flags().concat(), measured.ratio.value))
    })
}

/// Protects: the fastest setting of the front with half of the error is named, the fastest with the
/// same error that is sooner, and a faster one with bias. Wide intervals and the setting in use are
/// never advised. A simpler setting that is within the resolution of clock and noise is preferred.
#[test]
fn the_fastest_that_will_do_is_named() {
    let all = vec![
        candidate("", 1.0, 1.0, 1.1),
        unsound("clamp=1", 0.1, 0.3),
        candidate("samples=1024", 16.0, 0.25, 1.1),
        candidate("samples=256", 4.1, 0.5, 1.1),
        candidate("samples=16 reconstruction=denoised", 0.5, 0.8, 1.1),
        candidate("sampler=stratified", 0.7, 0.9, 1.1),
        candidate("light-sampling=lights", 0.3, 1.04, 1.4),
    ];
    let named = |flags: &str, time| Some((flags.to_owned(), time));
    assert_eq!(
        told(&all),
        [
            named("--spp 256", 4.1),
            named("--spp 16--denoise", 0.5),
            named("--rung clamp=1", 0.1)
        ]
    );
    let half_with = |time: f64| {
        let other = candidate("samples=256 light-sampling=lights", time, 0.51, 1.1);
        told(&[&all[..], &[other]].concat())[0]
            .clone()
            .map(|of| of.1)
    };
    assert_eq!((half_with(4.0), half_with(3.8)), (Some(4.1), Some(3.8)));
    // A row with bias is named, too, where it has half of the error far sooner than the sound one.
    let filtered = unsound("reconstruction=denoised", 1.1, 0.4);
    let [_, same, biased] = told(&[all[0].clone(), all[3].clone(), filtered]);
    assert_eq!((same, biased), (None, named("--denoise", 1.1)));
    // Half of the error is named with its doubt where the front has it, the same error is not.
    let doubtful = candidate("samples=256", 4.1, 0.5, 1.6);
    let found = [&all[..1], &[doubtful]].concat();
    let half = recommend_settings(&found, &pareto_front(&found)).half_the_error;
    assert_eq!(half.map(|advice| advice.certain), Some(false));
    let same = candidate("sampler=stratified", 0.7, 1.0, 1.5);
    assert_eq!(told(&[all[0].clone(), same]), [None, None, None]);
    let slow = candidate("clamp=10", 0.7, 1.2, 1.1);
    assert_eq!(told(&[all[0].clone(), slow]), [None, None, None]);
}

/// Protects: no setting of the front is beaten in time and error, settings with unknown errors and
/// with bias are left out, and the one in use stays if none beats it.
#[test]
fn the_front_is_what_nobody_beats() {
    let all = [
        candidate("", 1.0, 1.0, 1.1),
        candidate("samples=256", 4.0, 0.5, 1.1),
        candidate("samples=4", 0.1, 4.0, 1.1),
        candidate("samples=16", 0.3, 1.5, 3.5),
        candidate("sampler=independent", 1.2, 1.3, 1.1),
        candidate("sampler=stratified", 1.02, 1.005, 1.1),
        unsound("clamp=1", 0.1, 0.1),
    ];
    assert_eq!(pareto_front(&all), [2, 0, 1]);
}

/// Protects: of several settings that hardly differ one stays on the front, also where each is as good as
/// the next within the resolution and only the last clearly takes less time than the one in use.
#[test]
fn equal_settings_do_not_remove_each_other() {
    let all = [
        candidate("", 1.0, 1.0, 1.1),
        candidate("path-length=64", 0.975, 1.0, 1.1),
        candidate("clamp=100", 0.95, 1.0, 1.1),
    ];
    assert_eq!(pareto_front(&all), [2]);
    assert_eq!(pareto_front(&all[..2]), [0]);
}

/// Protects: a setting is unsound with a bias above half of its error, or possibly above .7 of
/// it, or with more than half a per cent of light lost or added, however small its error. A
/// setting that differs in noise alone is always sound, and a denoised one where it keeps the
/// light. So is a setting with surely less of both than the one in use: longer paths are better
/// than short ones even if still too short.
#[test]
fn what_loses_light_is_not_sound() {
    let own = measured("", 0.0, 1.0);
    let sound = |rungs: &str, bias, light| is_recommendable(&measured(rungs, bias, light), &own);
    let clamp = "clamp=1";
    assert!(sound(clamp, 0.45, 1.0) && sound(clamp, 0.3, 0.997));
    assert!(!sound(clamp, 0.51, 1.0) && !sound(clamp, 0.0, 0.994) && !sound(clamp, 0.0, 1.006));
    let with = |bias: Option<ConfidenceInterval>| {
        let mut of = measured(clamp, 0.0, 1.0);
        of.errors.bias = bias;
        is_recommendable(&of, &own)
    };
    assert!(!with(None) && !with(Some(about(0.04, 1.8))) && with(Some(about(0.04, 1.5))));
    assert!(sound("samples=256 sampler=stratified", 0.9, 0.9));
    let filtered = "samples=16 reconstruction=denoised";
    assert!(sound(filtered, 0.9, 1.0) && !sound(filtered, 0.0, 0.994));
    assert!(!sound("clamp=1 reconstruction=denoised", 0.9, 1.0));
    let (short, longer) = (measured(clamp, 1.0, 0.95), measured(clamp, 0.5, 0.98));
    assert!(is_recommendable(&longer, &short) && !is_recommendable(&short, &longer));
}
