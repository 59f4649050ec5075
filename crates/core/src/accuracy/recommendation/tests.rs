//! Rules of the report's first sentences, on constructed measurements.

use super::*;
use crate::accuracy::SettingErrors;
use crate::ladder::RungChoice;

/// A value with an interval of a factor.
fn about(value: f64, factor: f64) -> ConfidenceInterval {
    ConfidenceInterval {
        value,
        low: value / factor,
        high: value * factor,
    }
}

fn measured(bias: f64, light: f64) -> MeasuredSetting {
    let errors = SettingErrors {
        rmse: about(0.1, 1.1),
        relmse: about(0.01, 1.1),
        bias: Some(about(bias * 0.01, 1.05)),
        light: about(light, 1.001),
    };
    MeasuredSetting {
        tiles: 9,
        renders: 2,
        seconds: about(1.0, 1.1),
        ratio: about(1.0, 1.1),
        rays: 1,
        errors,
        flip: about(0.1, 1.1),
    }
}

fn setting(rungs: &str) -> RungSetting {
    RungSetting::from_rungs(
        &rungs
            .split(' ')
            .map(|rung| RungChoice::parse(rung).expect("a rung"))
            .collect::<Vec<_>>(),
    )
}

/// Candidate with given ratios of time and root error to the setting in use, and the factor of the
/// error's interval.
fn candidate(rungs: &str, time: f64, root: f64, factor: f64) -> RecommendationCandidate {
    let cost = RelativeCost {
        time: about(time, 1.05),
        error: about(root * root, factor),
    };
    RecommendationCandidate {
        setting: setting(rungs),
        measured: measured(0.0, 1.0),
        cost,
        is_recommendable: true,
    }
}

fn told(advice: Option<Recommendation>) -> Option<(String, f64)> {
    advice.map(|advice| (advice.flags.concat(), advice.time.value))
}

/// Protects: the fastest setting with half of the error is named, and the fastest with the same
/// error that is sooner. Settings that may be slower, the scene's own and unsound ones are never
/// advised; without a suitable setting the advice is empty. A simpler setting that takes hardly
/// longer is preferred.
#[test]
fn the_fastest_that_will_do_is_named() {
    let own_candidate = RecommendationCandidate {
        setting: RungSetting::default(),
        ..candidate("samples=16", 0.1, 0.1, 1.1)
    };
    let unsound = RecommendationCandidate {
        is_recommendable: false,
        ..candidate("clamp=1", 0.1, 0.3, 1.1)
    };
    let all = vec![
        own_candidate.clone(),
        unsound.clone(),
        candidate("samples=1024", 16.0, 0.25, 1.1),
        candidate("samples=256", 4.1, 0.5, 1.1),
        candidate("samples=16 reconstruction=denoised", 0.5, 0.8, 1.1),
        candidate("sampler=stratified", 0.78, 0.9, 1.1),
        candidate("light-sampling=lights", 0.3, 1.04, 1.1),
    ];
    let with = |other: RecommendationCandidate| {
        recommend_settings([&all[..], &[other]].concat(), 20.0)
            .half_the_error
            .map(|advice| advice.time.value)
    };
    assert_eq!(
        with(candidate(
            "samples=256 light-sampling=lights",
            3.8,
            0.5,
            1.1
        )),
        Some(4.1)
    );
    assert_eq!(
        with(candidate(
            "samples=256 light-sampling=lights",
            3.6,
            0.5,
            1.1
        )),
        Some(3.6)
    );
    let found = recommend_settings(all, 20.0);
    assert_eq!(
        told(found.half_the_error),
        Some(("--rung samples=256".to_owned(), 4.1))
    );
    assert_eq!(
        told(found.same_error),
        Some((
            "--rung samples=16--rung reconstruction=denoised".to_owned(),
            0.5
        ))
    );
    assert_eq!(
        recommend_settings(
            vec![own_candidate, unsound, candidate("clamp=10", 0.7, 1.2, 1.1)],
            20.0
        ),
        Recommendations::default()
    );
    // A denoised setting may have half of the error, too.
    let denoised = recommend_settings(
        vec![
            candidate("samples=256", 4.0, 0.5, 1.1),
            candidate("samples=16 reconstruction=denoised", 0.4, 0.5, 1.1),
        ],
        20.0,
    );
    assert_eq!(told(denoised.half_the_error).map(|of| of.1), Some(0.4));
}

/// Protects: a setting is advised only if its interval confirms it; otherwise a sufficient budget
/// is named. An interval twice as wide as allowed, as a factor, needs four times the time.
#[test]
fn a_doubtful_setting_is_no_advice() {
    let wide = (0.6_f64 / 0.5).powi(2);
    let found = recommend_settings(vec![candidate("samples=256", 4.0, 0.5, wide * wide)], 20.0);
    assert!(
        found.half_the_error.is_none()
            && found
                .half_needs
                .is_some_and(|needs| (needs - 80.0).abs() < 1e-6),
        "{found:?}"
    );
    assert!(
        recommend_settings(vec![candidate("samples=256", 4.0, 0.5, 0.99 * wide)], 20.0)
            .half_the_error
            .is_some()
    );
    let hopeless = recommend_settings(vec![candidate("samples=256", 4.0, 0.5, 100.0)], 20.0);
    assert_eq!((hopeless.half_the_error, hopeless.half_needs), (None, None));
    let lost = candidate("samples=256", 4.0, 0.5, f64::INFINITY);
    assert_eq!(recommend_settings(vec![lost], 20.0).half_needs, None);
}

/// Protects: a setting is unsound with a bias above a quarter of its squared error, or possibly
/// above half, or with more than half a per cent of light lost or added, however small its error. A
/// setting that differs in noise alone is always sound, and a denoised one where it keeps the
/// light. So is a setting with surely less of both than the one in use: longer paths are better
/// than short ones even if still too short.
#[test]
fn what_loses_light_is_not_sound() {
    let (clamp, own_measured) = (setting("clamp=1"), measured(0.0, 1.0));
    let sound =
        |each_measured: &MeasuredSetting| is_recommendable(&clamp, each_measured, &own_measured);
    assert!(sound(&measured(0.2, 1.0)) && sound(&measured(0.1, 0.997)));
    assert!(
        !sound(&measured(0.26, 1.0))
            && !sound(&measured(0.0, 0.994))
            && !sound(&measured(0.0, 1.006))
    );
    let with = |bias: Option<ConfidenceInterval>| MeasuredSetting {
        errors: SettingErrors {
            bias,
            ..own_measured.errors
        },
        ..own_measured.clone()
    };
    assert!(
        !sound(&with(None))
            && !sound(&with(Some(about(0.002, 3.0))))
            && sound(&with(Some(about(0.002, 2.0))))
    );
    assert!(is_recommendable(
        &setting("samples=256 sampler=stratified"),
        &measured(0.9, 0.9),
        &own_measured
    ));
    let filtered = setting("samples=16 reconstruction=denoised");
    assert!(
        is_recommendable(&filtered, &measured(0.9, 1.0), &own_measured)
            && !is_recommendable(&filtered, &measured(0.0, 0.994), &own_measured)
    );
    assert!(!is_recommendable(
        &clamp.with_rung(filtered.choices()[1]),
        &measured(0.9, 1.0),
        &own_measured
    ));
    let (short, longer) = (measured(1.0, 0.95), measured(0.5, 0.98));
    assert!(
        is_recommendable(&clamp, &longer, &short) && !is_recommendable(&clamp, &short, &longer)
    );
}
