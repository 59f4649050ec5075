//! Settings of a render: every choice that the command line can override, as plain values.

use raywright_bvh::{AcceleratorKind, BuildQuality};
use serde::{Deserialize, Serialize};

use crate::display::OutputFormat;
use crate::effects::EffectSet;
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{Camera, Integrator, SamplePattern, Scene};

/// Returns the default number of replicates. Replicates are independent parts of a pixel's samples,
/// from which errors are estimated. Their number is as small as possible, because the samples of a
/// replicate are less uniform than all samples together.
///
/// Two replicates are the fewest that give an estimate, and their 95 % intervals are correct from
/// eight samples on. With a single degree of freedom, these intervals are wide (Student's factor is
/// 12.7). From 64 samples on, four replicates give correct intervals at little cost (Student's
/// factor is 3.18). `docs/decisions/0033-replicates.md` has measurements for 2 to 8 replicates.
#[doc(hidden)]
pub fn default_replicates(samples: u32) -> u32 {
    match samples {
        0..8 => 1,
        8..64 => 2,
        _ => 4,
    }
}

/// Positions and number of the samples in a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// A fixed pattern of positions, the same in every pixel.
    Pattern(SamplePattern),
    /// Number of samples at random positions, at least one.
    General(u32),
}

impl Sampling {
    /// Returns the sampling of a scene with `spp` samples per pixel; `None` keeps the scene's
    /// sampling. A scene with a fixed pattern keeps it if the pattern has `spp` samples. For a
    /// single sample, its pattern becomes one sample at the pixel's centre. In all other cases,
    /// samples are at random positions.
    pub fn from_spp(scene: &Scene, spp: Option<u32>) -> Self {
        match (scene.render.pattern, spp) {
            (Some(pattern), None) => Self::Pattern(pattern),
            (Some(pattern), Some(n)) if n == pattern.sample_count() => Self::Pattern(pattern),
            (Some(_), Some(1)) => Self::Pattern(SamplePattern::Centre),
            (_, Some(n)) => Self::General(n),
            (None, None) => Self::General(scene.render.samples),
        }
    }

    /// Returns the number of samples per pixel.
    pub fn samples_per_pixel(self) -> u32 {
        match self {
            Self::Pattern(pattern) => pattern.sample_count(),
            Self::General(n) => n,
        }
    }

    /// Returns the fixed pattern of sample positions; `None` for random positions.
    pub fn pattern(self) -> Option<SamplePattern> {
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

/// Rectangle of a picture in pixels. Columns are numbered from the left and rows from the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[doc(alias("crop window", "SubImage"))]
pub struct Crop {
    /// First column of the rectangle.
    pub x: u32,
    /// First row of the rectangle, from the top.
    pub y: u32,
    /// Width, above zero.
    pub width: u32,
    /// Height, above zero.
    pub height: u32,
}

/// Background of a picture: what camera rays see where they hit no surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// The sky.
    #[default]
    Environment,
    /// Transparent black. The sky still lights the scene and appears in reflections. A shadow on a
    /// studio's ground is kept as black with coverage.
    Transparent,
}

/// Additional layer (arbitrary output variable) that a render stores besides the colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[doc(alias = "GBufferFilm")]
pub enum Aov {
    /// Base colour of the first hit, averaged over the samples.
    Albedo,
    /// Shading normal of the first hit, averaged over the samples.
    Normal,
    /// Position of the first hit in metres, averaged over the samples that hit.
    Position,
    /// Directly visible emission: the radiance of lamps, sky and unlit surfaces that camera rays
    /// hit. Scattered light is not included. Averaged over the samples.
    Emission,
    /// Distance of the hit along the ray through the pixel's centre, in metres; −1 for the sky.
    Depth,
    /// Index of the object that the ray through the pixel's centre hits; −1 for the sky.
    Object,
    /// Index of the material that the ray through the pixel's centre hits; −1 for the sky.
    Material,
    /// Share of the pixel that feature edges cover: outlines, borders, steps and creases. It is
    /// negative where lines are bright, on dark surfaces. A picture with this layer shows the lines.
    Edges,
    /// Number of finite samples of the pixel.
    Samples,
    /// Standard error of the pixel's mean, per channel. It is estimated from the means of the
    /// pixel's replicates (independent parts of its samples). Two special values:
    ///
    /// - 0: the samples are not random.
    /// - −1: unknown, because the pixel has fewer than two replicates. This is so with fewer than
    ///   eight samples, or if a fixed pattern of samples is lit by random lights.
    StandardError,
}

impl Aov {
    /// Every layer with its name on the command line.
    pub const ALL: [(&'static str, Self); 10] = [
        ("albedo", Self::Albedo),
        ("normal", Self::Normal),
        ("position", Self::Position),
        ("emission", Self::Emission),
        ("depth", Self::Depth),
        ("object", Self::Object),
        ("material", Self::Material),
        ("edges", Self::Edges),
        ("samples", Self::Samples),
        ("stderr", Self::StandardError),
    ];
}

/// Settings of a render, besides the scene's data: size, samples, integrator, layers and so on.
/// [`Settings::from_scene`] takes the values that the scene contains.
#[derive(Clone, Debug, PartialEq)]
#[doc(alias = "RenderOptions")]
pub struct Settings {
    /// Width and height of the whole picture in pixels, 1 to [`Settings::MOST_EDGE`].
    pub size: [u32; 2],
    /// Rendered rectangle of the picture; `None` renders the whole picture.
    pub crop: Option<Crop>,
    /// Camera; `None` frames the scene automatically.
    pub camera: Option<Camera>,
    /// Positions of the samples in a pixel, and their number, 1 to [`Settings::MOST_SAMPLES`].
    pub sampling: Sampling,
    /// Pixel filter: the distribution of random sample positions around the pixel's centre. Fixed
    /// patterns ignore it.
    pub filter: PixelFilter,
    /// Greatest number of ray segments of a path, at least one. Whitted ray tracing uses at most
    /// [`Settings::MOST_SEGMENTS`]. With [`Settings::UNLIMITED`] only Russian roulette ends paths.
    pub max_depth: u32,
    /// Greatest radiance of the brightest channel of a path-traced sample. Brighter samples are
    /// scaled down, which removes fireflies but loses light. `None` does not clamp.
    pub clamp: Option<f64>,
    /// Integrator.
    pub integrator: Integrator,
    /// Sampling of area lights by path tracing.
    pub light_sampling: LightSampling,
    /// Choice of the sky's directions that path tracing samples.
    pub sky_choice: SkyChoice,
    /// Formula for the Fresnel reflectance of surfaces.
    pub fresnel: FresnelRule,
    /// Treatment of light scattered between microfacets.
    pub microfacets: MicrofacetEnergy,
    /// Which point of an area light must be visible for its light to arrive: the sampled point or
    /// the centre.
    pub area_shadows: AreaShadows,
    /// Segment of a path at which Russian roulette starts.
    pub roulette: RouletteStart,
    /// Source of the random numbers of samples.
    pub sampler: SamplerKind,
    /// Output format of files; pictures do not depend on it.
    pub output: OutputFormat,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Frame number in an animation. Different frames have different noise.
    pub frame: u32,
    /// Number of replicates, which are independent parts of a pixel's samples; at most the number
    /// of samples. The variance of the replicates' means gives the error estimate. `None` uses
    /// [`default_replicates`].
    pub replicates: Option<u32>,
    /// Whether the finished picture is denoised. Denoising replaces noise by a smaller bias and
    /// estimates the error. From eight samples on, a film to be denoised has four replicates; below
    /// 64 samples, two of them share a net of samples, so that the samples are those of the same
    /// picture without denoising. The layers that [`crate::denoise`] reads are kept.
    pub denoise: bool,
    /// Requested error of the picture: the root of its relative mean squared error (relMSE), above
    /// zero. Samples are added where errors are largest, up to the number of `sampling` per pixel.
    /// The render ends when the upper end of the error's confidence interval is below the requested
    /// error. `None` takes all samples of `sampling` in every pixel.
    pub max_error: Option<f64>,
    /// Precision of numbers and arithmetic: `f32` with robust hits, or `f64`.
    pub precision: PrecisionChoice,
    /// Accelerator that finds hits: linear scan or BVH.
    pub accelerator: AcceleratorKind,
    /// Effects that are switched off, from [`crate::effects::SWITCHABLE_EFFECTS`].
    pub without: EffectSet,
    /// What camera rays see where they hit no surface.
    pub background: Background,
    /// Whether the edges of triangles are drawn at the first hits of camera rays.
    pub wireframe: bool,
    /// Whether feature edges (outlines, borders, steps and creases) are drawn over the picture. The
    /// picture then has the layer [`Aov::Edges`], too.
    pub edges: bool,
    /// Layers to store besides the colour.
    pub aovs: Vec<Aov>,
    /// Edge of a tile in pixels. It does not change pictures.
    pub tile_size: u32,
    /// Largest permitted memory in bytes. A scene whose estimate (see
    /// [`MemoryUse`](crate::MemoryUse)) is larger is refused before preparation. `None` sets no
    /// limit.
    pub max_memory: Option<u64>,
}

impl Settings {
    /// Greatest number of segments of a path in Whitted ray tracing.
    pub const MOST_SEGMENTS: u32 = 64;

    /// Greatest edge of a picture in pixels.
    pub const MOST_EDGE: u32 = 65_536;

    /// Greatest number of samples per pixel: the length of the sampler's sequence.
    pub const MOST_SAMPLES: u32 = 65_536;

    /// Value of `max_depth` for paths without a limit, which only Russian roulette ends.
    pub const UNLIMITED: u32 = u32::MAX;

    /// Returns the number of samples per pixel, which `sampling` sets.
    pub fn samples(&self) -> u32 {
        self.sampling.samples_per_pixel()
    }

    /// Returns the radiance that is assumed behind a studio's ground in a picture with coverage. It
    /// is 1, like a white page, or the clamp if the clamp is lower.
    pub(crate) fn radiance_behind_ground(&self) -> f64 {
        self.clamp.map_or(1.0, |maximum| maximum.min(1.0))
    }

    /// Returns the settings that a scene contains, with its first camera. All further settings have
    /// their defaults.
    pub fn from_scene(scene: &Scene) -> Self {
        Self {
            size: scene.render.size,
            crop: None,
            camera: scene.cameras.first().cloned(),
            sampling: Sampling::from_spp(scene, None),
            filter: scene.render.filter,
            max_depth: scene.render.max_depth,
            clamp: None,
            integrator: scene.render.integrator,
            light_sampling: LightSampling::default(),
            sky_choice: SkyChoice::default(),
            fresnel: FresnelRule::default(),
            microfacets: MicrofacetEnergy::default(),
            area_shadows: AreaShadows::default(),
            roulette: RouletteStart::default(),
            sampler: SamplerKind::default(),
            output: OutputFormat::default(),
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
            edges: false,
            aovs: Vec::new(),
            tile_size: 32,
            max_memory: None,
        }
    }
}

// Settings with a fixed list of values, which are the rungs (quality levels) of ladders. Each
// setting has a default.

/// Precision of the arithmetic (`--precision`). In all precisions, the same `f32` random numbers
/// determine positions in the pixel, on the lens and on lights. So pictures differ only by
/// rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias = "Float")]
pub enum PrecisionChoice {
    /// Numbers are stored in `f32`. Intersections avoid cancellation and decide hits in `f64`.
    #[default]
    Robust,
    /// All numbers are stored and computed in `f64`.
    Reference,
}

/// Strategy by which path tracing finds area lights. All strategies are unbiased and differ only in
/// noise. Two kinds of light are found in one manner whatever the strategy. Lights without size are
/// sampled directly. Lights seen in a mirror or through smooth glass are hit by paths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias("BVHLightSampler", "PowerLightSampler"))]
pub enum LightSampling {
    /// Paths hit lights by chance (BSDF sampling).
    Scattering,
    /// Each vertex samples a point on one light (light sampling).
    Lights,
    /// BSDF and light sampling, combined by multiple importance sampling.
    #[default]
    Both,
}

/// Choice of the sky's directions that path tracing samples. Both choices are unbiased and differ
/// only in noise and time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias("portal", "light portal"))]
pub enum SkyChoice {
    /// By the sky's radiance.
    Power,
    /// By the light that reaches each part of the scene, where walls hide most of the sky. It is
    /// found before the first sample, by a million rays.
    #[default]
    Openings,
}

/// Treatment of light that scatters several times between microfacets, under path tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MicrofacetEnergy {
    /// Light scattered more than once between microfacets is lost.
    Single,
    /// The lost light is compensated, so white metal reflects all light.
    #[default]
    Compensated,
}

/// Source of the random numbers of a pixel's samples. All sources are unbiased and differ only in
/// noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[doc(alias("ZSobolSampler", "IndependentSampler"))]
pub enum SamplerKind {
    /// Independent random numbers.
    Independent,
    /// Jittered grids of four by four numbers, one grid per sixteen samples.
    Stratified,
    /// Points of a scrambled Sobol sequence.
    #[default]
    Sobol,
}

/// Start of Russian roulette along a path, by the number of path segments (from hit to hit). The
/// choices are unbiased; they differ in time and noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum RouletteStart {
    /// From the first surface of a path on, with the probability of its absorption.
    Early,
    /// From the third segment of a path on, while the throughput is below a half.
    #[default]
    Late,
    /// Never, except for paths without a limit, which only Russian roulette ends.
    Off,
}

/// Point of an area light that must be visible for the light to arrive. It determines whether
/// shadows are hard or soft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AreaShadows {
    /// The centre of the light: hard shadows.
    Hard,
    /// The sampled point on the light: unbiased penumbras.
    #[default]
    Soft,
}

// Validation of settings before preparation.

/// Error: a setting is out of range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Width or height of the picture is zero or too large.
    #[error("the size {} x {} pixels is out of range: width and height must be 1 to {} pixels", .0[0], .0[1], Settings::MOST_EDGE)]
    Size([u32; 2]),
    /// The crop is empty or extends outside the picture.
    #[error("the crop of {} x {} pixels at column {}, row {} is empty or extends outside the picture of {} x {} pixels; choose a rectangle inside the picture", .crop.width, .crop.height, .crop.x, .crop.y, .size[0], .size[1])]
    Crop {
        /// The crop.
        crop: Crop,
        /// Size of the picture.
        size: [u32; 2],
    },
    /// The number of samples per pixel is zero or too large.
    #[error("{0} samples per pixel are out of range: the number must be 1 to {most}", most = Settings::MOST_SAMPLES)]
    Samples(u32),
    /// The greatest number of segments of a path is zero.
    #[error(
        "the greatest number of path segments is 0, but must be at least 1, because the camera ray is the first segment"
    )]
    Depth,
    /// A value that must be above zero is zero, negative, NaN or infinite.
    #[error("the setting `{name}` is {value}, but must be a finite number above 0")]
    Number {
        /// Name of the field.
        name: &'static str,
        /// Value of the field.
        value: f64,
    },
}

impl Settings {
    /// Checks that all settings are in range. Preparation makes this check first.
    ///
    /// # Errors
    /// The first setting that is out of range, as [`SettingsError`].
    pub fn check(&self) -> Result<(), SettingsError> {
        if !self
            .size
            .iter()
            .all(|edge| (1..=Self::MOST_EDGE).contains(edge))
        {
            return Err(SettingsError::Size(self.size));
        }
        let fits = |start: u32, extent: u32, whole: u32| {
            extent > 0 && start.checked_add(extent).is_some_and(|end| end <= whole)
        };
        if let Some(crop) = self.crop
            && !(fits(crop.x, crop.width, self.size[0]) && fits(crop.y, crop.height, self.size[1]))
        {
            return Err(SettingsError::Crop {
                crop,
                size: self.size,
            });
        }
        if let Sampling::General(count) = self.sampling
            && !(1..=Self::MOST_SAMPLES).contains(&count)
        {
            return Err(SettingsError::Samples(count));
        }
        if self.max_depth == 0 {
            return Err(SettingsError::Depth);
        }
        for (name, value) in [("clamp", self.clamp), ("max_error", self.max_error)] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err(SettingsError::Number { name, value });
            }
        }
        Ok(())
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
            assert_eq!(default_replicates(samples), expected, "{samples}");
        }
        assert_eq!(default_replicates(u32::MAX), 4);
    }
}

#[cfg(test)]
mod check_tests {
    use super::*;
    use crate::scene::Scene;

    fn settings() -> Settings {
        let scene: Scene = serde_json::from_str(r#"{ "format": 1 }"#).expect("an empty scene");
        Settings {
            size: [8, 6],
            sampling: Sampling::General(16),
            ..Settings::from_scene(&scene)
        }
    }

    /// Protects: the least and the greatest value of each number pass, values beyond them are
    /// refused with the name of their field, and no sum overflows.
    #[test]
    fn limits_are_kept() {
        type E = SettingsError;
        let (right, maximum) = (settings(), Settings::MOST_EDGE);
        let crop = |x, y, width, height| Settings {
            crop: Some(Crop {
                x,
                y,
                width,
                height,
            }),
            ..settings()
        };
        let count = |count| Settings {
            sampling: Sampling::General(count),
            ..settings()
        };
        let depth = |max_depth| Settings {
            max_depth,
            ..settings()
        };
        let clamp = |value| Settings {
            clamp: Some(value),
            ..settings()
        };
        for good in [
            Settings {
                size: [1, maximum],
                ..settings()
            },
            crop(0, 0, 8, 6),
            crop(7, 5, 1, 1),
            count(1),
            count(65_536),
            depth(1),
            depth(Settings::UNLIMITED),
            clamp(1e-9),
        ] {
            assert_eq!(good.check(), Ok(()), "{good:?}");
        }
        let wrong_crop = |crop: Crop| E::Crop {
            crop,
            size: right.size,
        };
        for (bad, error) in [
            (
                Settings {
                    size: [0, 6],
                    ..settings()
                },
                E::Size([0, 6]),
            ),
            (
                Settings {
                    size: [6, maximum + 1],
                    ..settings()
                },
                E::Size([6, maximum + 1]),
            ),
            (
                crop(0, 0, 9, 6),
                wrong_crop(Crop {
                    x: 0,
                    y: 0,
                    width: 9,
                    height: 6,
                }),
            ),
            (
                crop(0, 1, 8, 6),
                wrong_crop(Crop {
                    x: 0,
                    y: 1,
                    width: 8,
                    height: 6,
                }),
            ),
            (
                crop(2, 2, 0, 1),
                wrong_crop(Crop {
                    x: 2,
                    y: 2,
                    width: 0,
                    height: 1,
                }),
            ),
            (
                crop(u32::MAX, 0, 2, 1),
                wrong_crop(Crop {
                    x: u32::MAX,
                    y: 0,
                    width: 2,
                    height: 1,
                }),
            ),
            (count(0), E::Samples(0)),
            (count(65_537), E::Samples(65_537)),
            (depth(0), E::Depth),
            (
                clamp(0.0),
                E::Number {
                    name: "clamp",
                    value: 0.0,
                },
            ),
            (
                clamp(f64::INFINITY),
                E::Number {
                    name: "clamp",
                    value: f64::INFINITY,
                },
            ),
            (
                Settings {
                    max_error: Some(-1.0),
                    ..settings()
                },
                E::Number {
                    name: "max_error",
                    value: -1.0,
                },
            ),
        ] {
            assert_eq!(bad.check(), Err(error), "{bad:?}");
            assert!(error.to_string().len() > 30, "{error}");
        }
    }
}
