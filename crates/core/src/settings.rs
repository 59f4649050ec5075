//! What a render is asked for besides the scene: every choice that the command line can override,
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

/// Replicates that so many samples of the general sampler are divided into, where nothing else is
/// asked for: as few as the estimate of the error allows, because each is less even than all
/// samples together would be.
///
/// Two are the fewest that say anything, and from eight samples on they hold what they claim; but
/// one degree of freedom makes wide intervals (Student's factor for 95 % is 12.7). From 64 samples
/// on, which are four times sixteen, four hold what they claim (factor 3.18) at little cost.
/// `benches/README.md` has the figures of 1 to 8.
pub fn replicates(samples: u32) -> u32 {
    match samples {
        0..8 => 1,
        8..64 => 2,
        _ => 4,
    }
}

/// Where in a pixel its samples lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// A fixed pattern.
    Pattern(Pattern),
    /// So many samples of the general sampler, at least one.
    General(u32),
}

impl Sampling {
    /// `--spp`: the count of the scene's pattern keeps it, one sample of a pattern scene is the
    /// pixel's centre, anything else uses the general sampler. None: as the scene says.
    pub fn resolve(scene: &Scene, spp: Option<u32>) -> Self {
        match (scene.render.pattern, spp) {
            (Some(pattern), None) => Self::Pattern(pattern),
            (Some(pattern), Some(n)) if n == pattern.count() => Self::Pattern(pattern),
            (Some(_), Some(1)) => Self::Pattern(Pattern::Centre),
            (_, Some(n)) => Self::General(n),
            (None, None) => Self::General(scene.render.samples),
        }
    }

    /// Samples a pixel.
    pub fn count(self) -> u32 {
        match self {
            Self::Pattern(pattern) => pattern.count(),
            Self::General(n) => n,
        }
    }

    /// The fixed pattern, if it is one.
    pub fn pattern(self) -> Option<Pattern> {
        match self {
            Self::Pattern(pattern) => Some(pattern),
            Self::General(_) => None,
        }
    }

    /// Whether every sample's place is the same in all pixels.
    pub fn is_fixed(self) -> bool {
        matches!(self, Self::Pattern(_))
    }
}

/// A part of the picture in pixels, counted from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crop {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns, above zero.
    pub width: u32,
    /// Rows, above zero.
    pub height: u32,
}

/// What camera rays see that hit nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// The sky.
    #[default]
    Environment,
    /// Nothing: alpha 0, black; reflections and light still come from the sky. A studio's ground
    /// keeps its shadows, as black that covers.
    Transparent,
}

/// Layers besides the colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Aov {
    /// Base colour of the first hit, mean over the samples.
    Albedo,
    /// Shading normal of the first hit, mean over the samples.
    Normal,
    /// Position of the first hit, mean over the samples that hit.
    Position,
    /// What camera rays see without light from elsewhere: lamps, the sky and what shows its colour
    /// as it is; mean over the samples.
    Emission,
    /// Distance along the pixel-centre ray, −1 for the sky.
    Depth,
    /// Index of the object that the pixel-centre ray hits, −1 for the sky.
    Object,
    /// Index of its material, −1 for the sky.
    Material,
    /// Samples that entered the pixel.
    Samples,
    /// Standard error of the pixel's mean, per channel, from the means of its replicates: 0 where
    /// chance has no part, −1 where fewer than two replicates leave it unknown (fewer than eight
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

/// Everything a render is asked for besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Width and height of the whole picture in pixels, 1 to [`Settings::MOST_EDGE`].
    pub size: [u32; 2],
    /// The part that is rendered; none: all of it.
    pub crop: Option<Crop>,
    /// The view; none: framed automatically.
    pub camera: Option<Camera>,
    /// Samples of a pixel, 1 to [`Settings::MOST_SAMPLES`].
    pub sampling: Sampling,
    /// How much of a pixel's surroundings counts towards it, where samples lie at random places.
    pub filter: PixelFilter,
    /// Ray segments a path may have, at least one, of which Whitted's integrator takes
    /// [`Settings::MOST_SEGMENTS`] at most;
    /// [`Settings::UNLIMITED`]: as many as chance allows.
    pub max_depth: u32,
    /// Radiance to which the brightest channel of a path-traced sample is brought where it is above
    /// it: fewer fireflies for light that is lost. None: nothing is lost.
    pub clamp: Option<f64>,
    /// How light is computed.
    pub integrator: Integrator,
    /// How a path tracer finds light that has a size.
    pub light_sampling: LightSampling,
    /// By which formulas surfaces reflect.
    pub fresnel: FresnelRule,
    /// What becomes of light that microfacets send to each other.
    pub microfacets: Microfacets,
    /// Which part of a lamp has to be seen for its light to arrive.
    pub area_shadows: AreaShadows,
    /// When chance ends paths.
    pub roulette: Roulette,
    /// Where random numbers come from.
    pub sampler: SamplerKind,
    /// What files keep of the picture, which does not depend on it.
    pub output: Output,
    /// Seed of the general sampler.
    pub seed: u64,
    /// Number of the picture in a sequence, so that neighbours in it do not share their noise.
    pub frame: u32,
    /// Independent parts that the general sampler's samples are taken in, where there are as many
    /// samples; the spread of their means is what errors are estimated from. None: [`replicates`]
    /// says how many.
    pub replicates: Option<u32>,
    /// Whether the picture is denoised once it is there: less noise for a bias that it tells
    /// itself. Its samples are taken in four replicates then, from eight on, and it keeps the
    /// layers that [`crate::denoise`] reads.
    pub denoise: bool,
    /// Root relMSE that the picture may have, above zero: samples are added where the error is
    /// until the upper end of its interval is below, at most as many as `sampling` says. None:
    /// every pixel takes those.
    pub max_error: Option<f64>,
    /// Arithmetic.
    pub precision: PrecisionChoice,
    /// Scan or tree.
    pub accelerator: AcceleratorKind,
    /// Effects that are switched off, of [`crate::effects::SWITCHABLE`].
    pub without: EffectSet,
    /// What camera rays see that hit nothing.
    pub background: Background,
    /// Whether edges of triangles are drawn where camera rays meet them first.
    pub wireframe: bool,
    /// Extra layers.
    pub aovs: Vec<Aov>,
    /// Edge of a tile in pixels; pictures do not depend on it.
    pub tile_size: u32,
    /// Bytes that [`Memory`](crate::Memory) may take in all, by what is told of it before anything
    /// is built; none: no limit.
    pub max_memory: Option<u64>,
}

impl Settings {
    /// Segments that a path may be limited to at most.
    pub const MOST_SEGMENTS: u32 = 64;

    /// Pixels that an edge of a picture may have.
    pub const MOST_EDGE: u32 = 65_536;

    /// Samples that a pixel may have: as many as the sampler's sequence holds.
    pub const MOST_SAMPLES: u32 = 65_536;

    /// No limit on the segments of a path: chance alone ends it.
    pub const UNLIMITED: u32 = u32::MAX;

    /// Radiance behind a studio's ground where what is before it is kept apart: that of a white
    /// page, or as much of it as a limit leaves.
    pub(crate) fn page_radiance(&self) -> f64 {
        self.clamp.map_or(1.0, |most| most.min(1.0))
    }

    /// What the scene itself asks for, with its first camera.
    pub fn of(scene: &Scene) -> Self {
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

    /// Protects: one picture below 8 samples, two below 64, four from there on:
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
