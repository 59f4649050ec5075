//! The film against f64, closed forms and its own parts.

mod adaptive;
mod leave_one_out;
mod parts;
mod picture;
mod sums;
mod uncertainty;

use crate::film::Film;
use crate::settings::{Aov, Sampling, Settings};
use crate::{ReadyScene, Scene, prepare};

/// A lens, a lamp with a penumbra, a half-transparent sheet, glass, and a sky in part of the
/// picture: everything that uses random numbers, and paths that divide.
pub(super) fn scene() -> Scene {
    let text = r#"{ "format": 1,
        "cameras": [{ "pose": { "look_at": { "eye": [0, 1, 4], "target": [0, 0.6, 0] } },
                      "projection": { "thin_lens": { "pinhole": { "vertical_fov": 50 }, "aperture_radius": 0.1, "focus_distance": 3 } } }],
        "materials": [{ "name": "floor", "model": { "classic": { "colour": [0.8, 0.6, 0.4] } } },
                      { "name": "lamp", "model": { "classic": { "local": 0, "emission": [9, 8, 7] } } },
                      { "name": "glass", "model": { "classic": { "local": 0, "transmission": { "ior": 1.5 } } } },
                      { "name": "sheet", "model": { "physical": { "alpha": "blend", "opacity": 0.5 } } }],
        "objects": [{ "shape": { "quad": { "corner": [-2, 0, 2], "edge_u": [4, 0, 0], "edge_v": [0, 0, -4] } }, "material": "floor" },
                    { "shape": { "disk": { "centre": [0, 3, 0], "normal": [0, -1, 0], "radius": 0.7 } }, "material": "lamp" },
                    { "shape": { "quad": { "corner": [-1, 0.2, 1], "edge_u": [0.7, 0, 0], "edge_v": [0, 1, 0] } }, "material": "sheet" },
                    { "shape": { "sphere": { "centre": [0.5, 0.5, 0], "radius": 0.5 } }, "material": "glass" }] }"#;
    serde_json::from_str(text).unwrap_or_else(|e| panic!("the scene is right: {e}"))
}

/// Settings of 11 × 7 pixels, 4 × 3 tiles and this many samples in four replicates.
pub(super) fn settings(samples: u32) -> Settings {
    let sampling = Sampling::General(samples);
    Settings {
        size: [11, 7],
        tile_size: 3,
        sampling,
        replicates: Some(4),
        ..Settings::from_scene(&scene())
    }
}

pub(super) fn ready(settings: &Settings) -> ReadyScene {
    prepare(&scene(), settings, &()).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs work on a pool of one thread, where tiles are finished in order.
pub(super) fn in_order<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("one thread")
        .install(work)
}

/// Every layer.
pub(super) fn layers() -> Vec<Aov> {
    Aov::ALL.iter().map(|&(_, aov)| aov).collect()
}

/// Values of one replicate of a pixel, for constructed films.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReplicateSample {
    pub radiance: [f64; 3],
    pub emission: [f64; 3],
    pub albedo: [f64; 3],
}

/// A film of four independent replicates with sixteen samples each of these values, all facing the
/// camera at the same distance.
pub(crate) fn film_of(size: [u32; 2], seen: impl Fn(usize, usize) -> ReplicateSample) -> Film {
    let settings = Settings {
        size,
        sampling: Sampling::General(64),
        denoise: true,
        ..Settings::from_scene(&Scene::default())
    };
    let ready = prepare(&Scene::default(), &settings, &()).unwrap_or_else(|e| panic!("{e}"));
    let mut film = ready.new_film("");
    let count = film.plan.pixel_count();
    for replicate in 0..4 {
        let sum = |value: [f64; 3]| value.map(|x| 16.0 * x);
        let all: Vec<ReplicateSample> = (0..count).map(|pixel| seen(pixel, replicate)).collect();
        let layer = |(aov, _): &(Aov, _)| {
            let value_of = |replicate_sample: &ReplicateSample| match aov {
                Aov::Albedo => sum(replicate_sample.albedo),
                Aov::Emission => sum(replicate_sample.emission),
                _ => [0.0, 0.0, 16.0],
            };
            all.iter().map(value_of).collect()
        };
        let layers = film.plan.layers.mean.iter().map(layer).collect();
        let sums = all
            .iter()
            .map(|replicate_sample| sum(replicate_sample.radiance))
            .collect();
        film.buffers[replicate] = Some(crate::film::ReplicateBuffer {
            sums,
            samples: vec![16; count],
            layers,
            ..Default::default()
        });
    }
    film.samples_drawn.fill(16);
    film.centre_layers = vec![vec![3.0; count]];
    film
}

/// The film of a single render.
pub(super) fn rendered(ready: &ReadyScene) -> Film {
    let mut film = ready.new_film("scene");
    let part = film.full_part();
    ready
        .render_part(&mut film, &part, &())
        .unwrap_or_else(|e| panic!("{e}"));
    film
}
