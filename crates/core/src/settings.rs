//! Settings of a render besides the scene: every choice that the command line can override,
//! resolved to plain values.

mod check;
mod rungs;

use raywright_bvh::{AcceleratorKind, BuildQuality};
use serde::{Deserialize, Serialize};

use crate::display::Output;
use crate::effects::EffectSet;
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{Camera, Integrator, Pattern, Scene};
pub use check::SettingsError;
pub use rungs::{AreaShadows, LightSampling, Microfacets, PrecisionChoice, Roulette, SamplerKind};

/// Returns the default number of replicates for a number of samples of the general sampler: as few
/// as the error estimate allows, because each replicate is less uniform than all samples together.
///
/// Two replicates are the fewest that give an estimate, and their intervals hold from eight samples
/// on. But one degree of freedom makes wide intervals (Student's factor for 95 % is 12.7). From 64
/// samples on, which are four times sixteen, the intervals of four replicates hold (factor 3.18) at
/// little cost. `benches/README.md` has the figures of 1 to 8.
pub fn replicates(samples: u32) -> u32 {
    match samples {
        0..8 => 1,
        8..64 => 2,
        _ => 4,
    }
}

/// Placement of samples in a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// A fixed pattern.
    Pattern(Pattern),
    /// Samples of the general sampler, at least one.
    General(u32),
}

impl Sampling {
    /// Resolves `--spp`. The pattern's own count keeps the pattern, one sample of a pattern scene
    /// is the pixel's centre, and any other number uses the general sampler. `None`: as in the
    /// scene.
    pub fn resolve(scene: &Scene, spp: Option<u32>) -> Self {
        match (scene.render.pattern, spp) {
            (Some(pattern), None) => Self::Pattern(pattern),
            (Some(pattern), Some(n)) if n == pattern.count() => Self::Pattern(pattern),
            (Some(_), Some(1)) => Self::Pattern(Pattern::Centre),
            (_, Some(n)) => Self::General(n),
            (None, None) => Self::General(scene.render.samples),
        }
    }

    /// Returns the samples per pixel.
    pub fn count(self) -> u32 {
        match self {
            Self::Pattern(pattern) => pattern.count(),
            Self::General(n) => n,
        }
    }

    /// Returns the fixed pattern, if any.
    pub fn pattern(self) -> Option<Pattern> {
        match self {
            Self::Pattern(pattern) => Some(pattern),
            Self::General(_) => None,
        }
    }

    /// Whether all pixels have the same sample positions.
    pub fn is_fixed(self) -> bool {
        matches!(self, Self::Pattern(_))
    }
}

/// A rectangle of the picture in pixels, counted from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[doc(alias("crop window", "SubImage"))]
pub struct Crop {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Width, above zero.
    pub width: u32,
    /// Height, above zero.
    pub height: u32,
}

/// Background: radiance of camera rays that hit nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// The sky.
    #[default]
    Environment,
    /// Transparent black; reflections and light still come from the sky. A studio's ground keeps
    /// its shadows, as covering black.
    Transparent,
}

/// Layers besides the colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[doc(alias = "GBufferFilm")]
pub enum Aov {
    /// Base colour of the first hit, mean over the samples.
    Albedo,
    /// Shading normal of the first hit, mean over the samples.
    Normal,
    /// Position of the first hit, mean over the samples that hit.
    Position,
    /// Radiance of camera rays without scattered light: lamps, the sky and unlit surfaces; mean
    /// over the samples.
    Emission,
    /// Distance along the pixel-centre ray, −1 for the sky.
    Depth,
    /// Index of the object that the pixel-centre ray hits, −1 for the sky.
    Object,
    /// Index of its material, −1 for the sky.
    Material,
    /// Number of finite samples.
    Samples,
    /// Standard error of the pixel's mean, per channel, from the means of its replicates: 0 without
    /// random sampling, −1 where fewer than two replicates leave it unknown (fewer than eight
    /// samples, or a fixed pattern under random lights).
    StandardError,
}

impl Aov {
    /// Every layer with its name on the command line.
    pub const ALL: [(&'static str, Self); 9] = [
        ("albedo", Self::Albedo),
        ("normal", Self::Normal),
        ("position", Self::Position),
        ("emission", Self::Emission),
        ("depth", Self::Depth),
        ("object", Self::Object),
        ("material", Self::Material),
        ("samples", Self::Samples),
        ("stderr", Self::StandardError),
    ];
}

/// Settings of a render besides the scene.
#[derive(Clone, Debug, PartialEq)]
#[doc(alias = "RenderOptions")]
pub struct Settings {
    /// Width and height of the whole picture in pixels, 1 to [`Settings::MOST_EDGE`].
    pub size: [u32; 2],
    /// Rendered part of the picture; `None`: the whole.
    pub crop: Option<Crop>,
    /// Camera; `None`: framed automatically.
    pub camera: Option<Camera>,
    /// Samples of a pixel, 1 to [`Settings::MOST_SAMPLES`].
    pub sampling: Sampling,
    /// Pixel filter: the weight of a pixel's surroundings in the pixel; used for samples at random
    /// places.
    pub filter: PixelFilter,
    /// Greatest number of ray segments of a path, at least one; Whitted's integrator uses at most
    /// [`Settings::MOST_SEGMENTS`]. [`Settings::UNLIMITED`]: only Russian roulette ends paths.
    pub max_depth: u32,
    /// Greatest radiance of the brightest channel of a path-traced sample; brighter samples are
    /// scaled down. Fewer fireflies at the price of lost light. `None`: no clamping.
    pub clamp: Option<f64>,
    /// Integrator.
    pub integrator: Integrator,
    /// Sampling of area lights by path tracing.
    pub light_sampling: LightSampling,
    /// Reflection formulas of surfaces.
    pub fresnel: FresnelRule,
    /// Treatment of light scattered between microfacets.
    pub microfacets: Microfacets,
    /// Part of a lamp that must be visible for its light to arrive.
    pub area_shadows: AreaShadows,
    /// Start of Russian roulette.
    pub roulette: Roulette,
    /// Source of random numbers.
    pub sampler: SamplerKind,
    /// Output format of files; pictures do not depend on it.
    pub output: Output,
    /// Seed of the general sampler.
    pub seed: u64,
    /// Frame number in an animation, so that neighbouring frames have different noise.
    pub frame: u32,
    /// Number of independent parts of the samples, where there are as many samples; errors are
    /// estimated from the spread of their means. `None`: see [`replicates`].
    pub replicates: Option<u32>,
    /// Whether the finished picture is denoised: less noise for a bias that is estimated with it.
    /// The samples are then taken in four replicates, from eight samples on, and the layers that
    /// [`crate::denoise`] reads are kept.
    pub denoise: bool,
    /// Requested root relMSE of the picture, above zero. Samples are added where the error is,
    /// until the upper end of its interval is below, at most as many as in `sampling`. `None`:
    /// every pixel takes the samples of `sampling`.
    pub max_error: Option<f64>,
    /// Precision of the arithmetic.
    pub precision: PrecisionChoice,
    /// Scan or tree.
    pub accelerator: AcceleratorKind,
    /// Switched-off effects, from [`crate::effects::SWITCHABLE`].
    pub without: EffectSet,
    /// Radiance of camera rays that hit nothing.
    pub background: Background,
    /// Whether the edges of triangles are drawn at the first hits of camera rays.
    pub wireframe: bool,
    /// Additional layers.
    pub aovs: Vec<Aov>,
    /// Edge of a tile in pixels; pictures do not depend on it.
    pub tile_size: u32,
    /// Greatest total of [`Memory`](crate::Memory) in bytes, checked by the estimate before the
    /// preparation; `None`: no limit.
    pub max_memory: Option<u64>,
}

impl Settings {
    /// Greatest limit on the segments of a path.
    pub const MOST_SEGMENTS: u32 = 64;

    /// Greatest edge of a picture in pixels.
    pub const MOST_EDGE: u32 = 65_536;

    /// Greatest number of samples of a pixel: the length of the sampler's sequence.
    pub const MOST_SAMPLES: u32 = 65_536;

    /// No limit on the segments of a path: only Russian roulette ends it.
    pub const UNLIMITED: u32 = u32::MAX;

    /// Returns the radiance behind a studio's ground in a picture with coverage: that of a white
    /// page, or the clamp if lower.
    pub(crate) fn page_radiance(&self) -> f64 {
        self.clamp.map_or(1.0, |maximum| maximum.min(1.0))
    }

    /// Returns the scene's own settings, with its first camera.
    pub fn from_scene(scene: &Scene) -> Self {
        Self {
            size: scene.render.size,
            crop: None,
            camera: scene.cameras.first().cloned(),
            sampling: Sampling::resolve(scene, None),
            filter: scene.render.filter,
            max_depth: scene.render.max_depth,
            clamp: None,
            integrator: scene.render.integrator,
            light_sampling: LightSampling::default(),
            fresnel: FresnelRule::default(),
            microfacets: Microfacets::default(),
            area_shadows: AreaShadows::default(),
            roulette: Roulette::default(),
            sampler: SamplerKind::default(),
            output: Output::default(),
            seed: scene.render.seed,
            frame: 0,
            replicates: None,
            denoise: false,
            max_error: None,
            precision: PrecisionChoice::default(),
            accelerator: AcceleratorKind::Tree(BuildQuality::default()),
            without: EffectSet::EMPTY,
            background: Background::default(),
            wireframe: false,
            aovs: Vec::new(),
            tile_size: 32,
            max_memory: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: one replicate below 8 samples, two below 64, four from there on:
    /// docs/decisions/0033-replicates.md.
    #[test]
    fn pictures_are_divided_by_their_samples() {
        for samples in 0..200 {
            let expected = if samples < 8 {
                1
            } else {
                4 - 2 * u32::from(samples < 64)
            };
            assert_eq!(replicates(samples), expected, "{samples}");
        }
        assert_eq!(replicates(u32::MAX), 4);
    }
}
