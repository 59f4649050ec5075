//! Table of ladders: names, default rungs, and rungs with their values and descriptions for users.

use raywright_bvh::BuildQuality;

use super::{Rung, RungValue};
use crate::display::OutputFormat;
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{Integrator, TextureFilter};
use crate::settings::{
    AreaShadows, LightSampling, MicrofacetEnergy, PrecisionChoice, RouletteStart, SamplerKind,
    SkyChoice,
};

/// Defines the ladders from a table. A ladder is written `KIND = NAME, DEFAULT, VALUE;`. `VALUE` is
/// the variant of [`RungValue`] that its rungs set. Then follows a line `RUNG { VALUE } ABOUT` for
/// each rung.
macro_rules! ladders {
    ($($(#[$doc:meta])* $kind:ident = $name:literal, $default:literal, $value:ident;
        $($rung:literal { $sets:expr } $about:literal)*)*) => {
        /// Ladder: a choice that trades accuracy for time, such as the number of samples. Its
        /// values are [`Rung`]s.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Ladder {
            $($(#[$doc])* $kind,)*
        }

        impl Ladder {
            /// Every ladder, the most important first; ladders that change no picture come last.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$kind),*];

            /// Returns the name of the ladder in reports and on the command line.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// Returns the name of the default rung.
            pub const fn default_rung(self) -> &'static str {
                match self {
                    $(Self::$kind => $default,)*
                }
            }

            /// Returns the rungs from fast to exact. For ladders that do not change pictures, the
            /// order is from the shortest preparation to the longest.
            pub const fn rungs(self) -> &'static [Rung] {
                match self {
                    $(Self::$kind => &[$(Rung { name: $rung, about: $about, value: RungValue::$value($sets) }),*],)*
                }
            }
        }
    };
}

ladders! {
    /// Samples per pixel.
    Samples = "samples", "64", Samples;
        "1" { 1 } "edges are jagged"
        "4" { 4 } "edges have five steps"
        "16" { 16 } "a quarter of the noise of one sample, or less"
        "64" { 64 } "an eighth of the noise of one sample, or less"
        "256" { 256 } "a sixteenth of the noise of one sample, or less"
        "1024" { 1024 } "a thirty-second of the noise of one sample, or less"
    /// Denoising of the picture.
    Reconstruction = "reconstruction", "unbiased", Denoised;
        "denoised" { true } "biased: a filter removes noise and some fine or faint detail; the error is estimated"
        "unbiased" { false } "the mean of the samples: correct on average, but noisy"
    /// Integrator.
    Integrator = "integrator", "path", Integrator;
        "whitted" { Integrator::Whitted }
            "mirrors, glass and direct light; no indirect light between matte surfaces"
        "path" { Integrator::Path } "direct and indirect light"
    /// Start of Russian roulette.
    Roulette = "roulette", "late", Roulette;
        "early" { RouletteStart::Early } "paths end by chance from the first surface on, with the probability of their absorption: less time per sample, more noise"
        "late" { RouletteStart::Late } "paths of a throughput below a half end by chance from the third segment on"
        "off" { RouletteStart::Off } "no path ends by chance: least noise per sample, most time"
    /// Greatest number of segments of a path.
    PathLength = "path-length", "8", PathLength;
        "1" { 1 } "only camera rays: no reflection, no refraction"
        "2" { 2 } "one reflection or refraction"
        "4" { 4 } "three reflections or refractions"
        "8" { 8 } "seven reflections or refractions: through two glass balls"
        "16" { 16 } "fifteen reflections or refractions"
        "64" { 64 } "sixty-three reflections or refractions; for more use --max-depth"
    /// Limit on the radiance of a sample.
    Clamp = "clamp", "off", Clamp;
        "1" { Some(1.0) } "samples brighter than white are clamped to white: no fireflies, but too dark where few paths carry the light"
        "10" { Some(10.0) } "brightness above ten times white is lost, such as the sun in a mirror"
        "100" { Some(100.0) } "brightness above a hundred times white is lost"
        "off" { None } "no brightness is lost; rare bright paths appear as noise"
    /// Sampling of area lights by path tracing.
    LightSampling = "light-sampling", "both", LightSampling;
        "scattering" { LightSampling::Scattering } "paths hit lights by chance: noise where lights are small"
        "lights" { LightSampling::Lights } "each vertex samples one light: noise where surfaces are glossy and lights large"
        "both" { LightSampling::Both } "scattering and light sampling, weighted by their densities (multiple importance sampling)"
    /// Number format of rays and surfaces: f32 or f64.
    Precision = "precision", "robust", Precision;
        "robust" { PrecisionChoice::Robust } "numbers are stored as f32; hits are decided in f64"
        "reference" { PrecisionChoice::Reference } "all numbers and operations in f64"
    /// Offset of the start of a ray that leaves a surface.
    RayOffset = "ray-offset", "error-bound", ConstantOffset;
        "constant" { true } "a constant distance: right for scenes of one size, with false shadows and light leaks at other sizes"
        "error-bound" { false } "a distance just above the rounding error of the hit point: right for scenes of every size"
    /// Kind of shadows: none for lights without size, hard, or with penumbras.
    Shadows = "shadows", "on", Shadows;
        "off" { None } "lights without size cast no shadows"
        "hard" { Some(AreaShadows::Hard) }
            "a surface is lit if it sees the centre of the area light: shadows without penumbras"
        "on" { Some(AreaShadows::Soft) } "shadows by every occluder, with penumbras"
    /// Choice of the sky's directions that path tracing samples.
    SkyChoice = "sky-choice", "openings", SkyChoice;
        "power" { SkyChoice::Power } "by the sky's radiance: noise in rooms that a window lights"
        "openings" { SkyChoice::Openings } "by the light that reaches each part of the scene, where walls hide most of the sky"
    /// Reflection formulas of path tracing.
    Fresnel = "fresnel", "conserving", Fresnel;
        "schlick" { FresnelRule::Schlick } "Schlick's formula for all materials, glass too: the error of the reflectance is up to 0.08 at grazing angles"
        "model" { FresnelRule::Model }
            "glTF's sample formulas to the letter: white plastic reflects up to 1.89 times the incident light"
        "conserving" { FresnelRule::Conserving }
            "Schlick's formula for metallic-roughness materials, Fresnel's equations for glass and complex indices; the diffuse lobe gets the light that the specular lobe does not reflect"
        "exact" { FresnelRule::Exact } "Fresnel's equations for every material with an index of refraction; metals given only by a colour keep Schlick's formula"
    /// Treatment of light scattered between microfacets.
    Microfacets = "microfacets", "compensated", Microfacets;
        "single" { MicrofacetEnergy::Single } "light scattered between microfacets is lost: rough metal is up to 60 % too dark"
        "compensated" { MicrofacetEnergy::Compensated }
            "light scattered between microfacets is compensated: white metal reflects all light to within 0.5 %, anisotropic metal to within 1 %"
    /// Dispersion: refraction by wavelength.
    Colour = "colour", "spectral", Spectral;
        "rgb" { false } "all wavelengths refract alike: no rainbows"
        "spectral" { true } "each refracted path has a single wavelength: colour noise"
    /// Filter of image textures.
    TextureFilter = "texture-filter", "bilinear", TextureFilter;
        "nearest" { TextureFilter::Nearest } "the nearest texel: visible blocks near the camera, and sparkles far away"
        "mipmaps" { TextureFilter::Mipmaps } "the mean over about a pixel: no sparkles with one sample per pixel, but a blurred picture with many"
        "bilinear" { TextureFilter::Bilinear } "the weighted mean of four texels: smooth near the camera; far away, more samples make it sharper"
    /// Pixel filter.
    PixelFilter = "pixel-filter", "box", PixelFilter;
        "gaussian" { PixelFilter::Gaussian } "a bell curve over three pixels: no jagged edges, a softer picture"
        "blackman-harris" { PixelFilter::BlackmanHarris } "a narrower bell curve over three pixels"
        "tent" { PixelFilter::Tent } "a linear slope up to the centres of the neighbouring pixels"
        "box" { PixelFilter::Box } "the pixel alone: sharp, with jagged edges at high contrast"
    /// Sampler: source of the random numbers of samples.
    Sampler = "sampler", "sobol", Sampler;
        "independent" { SamplerKind::Independent } "independent numbers: noise falls with the square root of the number of samples"
        "stratified" { SamplerKind::Stratified } "jittered grids of sixteen: less noise where pictures are smooth"
        "sobol" { SamplerKind::Sobol } "scrambled Sobol points: least noise, evenly distributed in four dimensions"
    /// Output format of files.
    Output = "output", "8-bit", Output;
        "8-bit" { OutputFormat::Eight } "PNG of 256 codes: visible steps in dark gradients; brighter than white is lost"
        "8-bit-dither" { OutputFormat::Dithered } "PNG of 256 codes, dithered: no steps, but noise of one code"
        "16-bit" { OutputFormat::Sixteen } "PNG of 65 536 codes: brighter than white is lost"
        "float" { OutputFormat::Float } "linear radiance, without limit or rounding to codes; only for EXR"
    /// Build quality of the BVH, which trades build time against traversal time.
    Build = "build", "medium", Build;
        "fast" { BuildQuality::Fast } "least build time: built by clustering, improved a little"
        "medium" { BuildQuality::Medium } "built by clustering, and improved"
        "high" { BuildQuality::High } "twice the build time: built by clustering among more neighbours, and improved everywhere"
    /// Accelerator: linear scan or BVH.
    Accelerator = "accelerator", "bvh", Tree;
        "linear" { false } "every primitive is tested"
        "bvh" { true } "a bounding volume hierarchy (tree of boxes)"
}
