//! What makes films parts of one picture: the scene and every setting that decides a sample, as
//! text that is only ever compared, so that a film in a file can be told from others without the
//! scene that it shows.

use core::fmt::Debug;

use serde::{Deserialize, Serialize};

use crate::settings::Settings;

/// What decides the samples of a picture. How they are computed (threads, accelerator, memory) does
/// not, and how many of them there are is the plan's business.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Identity {
    /// What tells its scene from others.
    pub scene: String,
    /// Each setting with its value.
    settings: Vec<(String, String)>,
}

impl Identity {
    pub fn new(scene: &str, settings: &Settings) -> Self {
        // Every setting is named, so that a new one cannot be forgotten. Crop, tiles, replicates
        // and denoising are the plan's.
        let Settings {
            size,
            camera,
            sampling,
            filter,
            max_depth,
            clamp,
            integrator,
            light_sampling,
            fresnel,
            microfacets,
            area_shadows,
            roulette,
            sampler,
            seed,
            frame,
            precision,
            without,
            background,
            wireframe,
            aovs,
            crop: _,
            max_error,
            denoise: _,
            replicates: _,
            tile_size: _,
            accelerator: _,
            output: _,
            max_memory: _,
        } = settings;
        let settings: [(&str, &dyn Debug); 21] = [
            ("size", size),
            ("camera", camera),
            ("pattern of samples", &sampling.pattern()),
            ("pixel filter", filter),
            ("maximum depth", max_depth),
            ("clamp", clamp),
            ("integrator", integrator),
            ("light sampling", light_sampling),
            ("Fresnel rule", fresnel),
            ("rule of microfacets", microfacets),
            ("shadows of lamps", area_shadows),
            ("Russian roulette", roulette),
            ("sampler", sampler),
            ("seed", seed),
            ("frame", frame),
            ("maximum error", max_error),
            ("precision", precision),
            ("list of effects switched off", without),
            ("background", background),
            ("wireframe", wireframe),
            ("list of layers", aovs),
        ];
        let settings = settings
            .into_iter()
            .map(|(name, value)| (name.to_owned(), format!("{value:?}")))
            .collect();
        Self {
            scene: scene.to_owned(),
            settings,
        }
    }

    /// What tells another picture from this one.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let named = |(name, value): &(String, String)| {
            other.settings.iter().any(|(n, v)| n == name && v == value)
        };
        let foreign = self
            .settings
            .iter()
            .find(|setting| !named(setting))
            .map(|(name, _)| name.clone());
        foreign
            .or((self.settings.len() != other.settings.len())
                .then(|| "list of settings".to_owned()))
            .or_else(|| (self.scene != other.scene).then(|| "scene".to_owned()))
    }
}
