//! Identity of a picture: the scene and every setting that affects a sample, stored as text for
//! comparison. Films of equal identity are parts of one picture. Film files can therefore be
//! compared without their scene.

use core::fmt::Debug;

use serde::{Deserialize, Serialize};

use crate::settings::Settings;

/// Identity of a picture: its scene, and the settings that affect its samples. Settings that affect
/// only the computation (threads, accelerator, memory) are excluded. The number of samples is part
/// of the film's plan.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct FilmIdentity {
    /// Text that identifies the scene.
    pub scene: String,
    /// Names and values of the settings.
    settings: Vec<(String, String)>,
}

impl FilmIdentity {
    pub fn new(scene: &str, settings: &Settings) -> Self {
        // Every setting is listed here, so that the compiler reports a new setting. Crop, tiles,
        // replicates and denoising belong to the film's plan.
        let Settings {
            size,
            camera,
            sampling,
            filter,
            max_depth,
            clamp,
            integrator,
            light_sampling,
            sky_choice,
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
            edges,
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
        let settings: [(&str, &dyn Debug); 23] = [
            ("size", size),
            ("camera", camera),
            ("pattern of samples", &sampling.pattern()),
            ("pixel filter", filter),
            ("maximum depth", max_depth),
            ("clamp", clamp),
            ("integrator", integrator),
            ("light sampling", light_sampling),
            ("choice of the sky's directions", sky_choice),
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
            ("edges", edges),
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

    /// Returns the name of the first setting that differs between two identities, or "scene" if
    /// only the scene differs. `None` for equal identities.
    pub fn find_difference(&self, other: &Self) -> Option<String> {
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
