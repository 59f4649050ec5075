//! Errors of whole pictures against closed forms, and against the truth of a scene whose pixels are known.

use super::{layers, ready, rendered, settings};
use crate::film::{Film, Plane};
use crate::scene::Scene;
use crate::settings::{Sampling, Settings};
use crate::{Ready, prepare};

/// A film of pixels whose replicates have these means, each of two samples.
fn film(pixels: &[[f64; 4]]) -> Film {
    let all = Settings {
        size: [pixels.len() as u32, 1],
        sampling: Sampling::General(8),
        replicates: Some(4),
        ..Settings::of(&Scene::default())
    };
    let ready = prepare(&Scene::default(), &all, &()).expect("an empty scene");
    let mut film = ready.film("");
    for replicate in 0..4 {
        let sums = pixels.iter().map(|means| [2.0 * means[replicate]; 3]).collect();
        film.planes[replicate] = Some(Plane { sums, samples: vec![2; pixels.len()], ..Plane::default() });
    }
    film
}

/// Protects: of replicates with the means 1, 2, 3, 4 the mean has a variance of 5/12, whose root is the error; relative to 2.5² less that
/// variance and 0.01. A hundred such pixels count for 100 · 5/3, and the interval is as wide as 2R/((R − 1)n) says.
#[test]
fn errors_of_pictures_by_hand() {
    let found = film(&[[1.0, 2.0, 3.0, 4.0]; 100]).uncertainty().expect("four replicates");
    let (variance, n) = (5.0_f64 / 12.0, 500.0 / 3.0);
    assert!((found.rmse.value - variance.sqrt()).abs() < 1e-12);
    assert!((found.root_relmse.value - (variance / (6.25 - variance + 0.01)).sqrt()).abs() < 1e-12);
    assert!((found.rmse.pixels - n).abs() < 1e-9);
    let half = 1.959_963_984_540_054 * (8.0_f64 / 3.0 / n).sqrt() / 2.0;
    for estimate in [found.rmse, found.root_relmse] {
        assert!(
            (estimate.high / estimate.value - half.exp()).abs() < 1e-12
                && (estimate.low / estimate.value - (-half).exp()).abs() < 1e-12
        );
    }
    assert!(found.converged);
}

/// Protects: where one pixel of many carries the error it is said, and where nothing varies the error is zero and sure.
#[test]
fn few_pixels_say_little() {
    let mut pixels = [[1.0, 1.01, 0.99, 1.0]; 100];
    pixels[40] = [1.0, 1.0, 1.0, 90.0];
    let found = film(&pixels).uncertainty().expect("four replicates");
    assert!(!found.converged && found.rmse.pixels < 2.0, "{found:?}");
    let still = film(&[[0.5; 4]; 10]).uncertainty().expect("four replicates");
    assert_eq!((still.rmse.value, still.rmse.high, still.converged), (0.0, 0.0, true));
}

/// Protects: nothing is said where nothing is known: of one replicate, of a pixel without samples, of a pattern.
#[test]
fn nothing_is_said_of_nothing() {
    let of = |settings: Settings| rendered(&ready(&settings)).uncertainty();
    assert!(of(Settings { replicates: Some(1), ..settings(6) }).is_none());
    assert!(of(settings(6)).is_some());
    assert!(
        of(Settings { sampling: Sampling::Pattern(crate::scene::Pattern::Corners), aovs: layers(), ..settings(4) }).is_none()
    );
    let ready: Ready = ready(&settings(6));
    let mut film = ready.film("scene");
    let first = crate::film::Part { tiles: 0..1, ..film.whole() };
    ready.render_part(&mut film, &first, &()).expect("its own film");
    assert!(film.uncertainty().is_none());
}
