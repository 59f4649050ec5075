//! Table of ladders: names, default rungs, and rungs with their values and descriptions for users.

use raywright_bvh::BuildQuality;

use super::{Rung, RungValue};
use crate::display::OutputFormat;
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{Integrator, TextureFilter};
use crate::settings::{
    AreaShadows, LightSampling, MicrofacetEnergy, PrecisionChoice, RouletteStart, SamplerKind,
};

/// Defines the ladders from a table. A ladder is written `KIND = NAME, DEFAULT, VALUE;`, where
/// `VALUE` is the variant of [`RungValue`] that its rungs set. A line `RUNG { VALUE } ABOUT` for
/// each rung follows.
macro_rules! ladders {
    ($($(#[$doc:meta])* $kind:ident = $name:literal, $default:literal, $value:ident;
        $($rung:literal { $sets:expr } $about:literal)*)*) => {
        /// Ladder: a choice that trades accuracy for time.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Ladder {
            $($(#[$doc])* $kind,)*
        }

        impl Ladder {
            /// Every ladder; ladders that change pictures come first.
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

            /// Returns the rungs from fast to exact; for ladders that do not change pictures, from
            /// the shortest preparation to the longest.
            pub const fn rungs(self) -> &'static [Rung] {
                match self {
                    $(Self::$kind => &[$(Rung { name: $rung, about: $about, value: RungValue::$value($sets) }),*],)*
                }
            }
        }
    };
}

ladders! {
    /// Integrator.
    Integrator = "integrator", "path", Integrator;
        "whitted" { Integrator::Whitted }
            "mirrors, glass and direct light: indirect light is missing"
        "path" { Integrator::Path } "direct and indirect light"
    /// Number format of rays and surfaces: f32 or f64.
    Precision = "precision", "robust", Precision;
        "robust" { PrecisionChoice::Robust } "f32 stored, f64 where a hit is decided"
        "reference" { PrecisionChoice::Reference } "f64 throughout"
    /// Offset of the start of a ray that leaves a surface.
    RayOffset = "ray-offset", "error-bound", ConstantOffset;
        "constant" { true } "a constant distance: right at one scale, false shadows and leaks at others"
        "error-bound" { false } "outside the error of the hit point, at every scale"
    /// Kind of shadows: none for lights without size, hard, or with penumbras.
    Shadows = "shadows", "on", Shadows;
        "off" { None } "lights without size cast no shadows"
        "hard" { Some(AreaShadows::Hard) }
            "a lamp counts where its centre is visible: no penumbras"
        "on" { Some(AreaShadows::Soft) } "shadows by every occluder, with penumbras"
    /// Sampling of area lights by path tracing.
    LightSampling = "light-sampling", "both", LightSampling;
        "scattering" { LightSampling::Scattering } "paths hit lights by chance: noise where lights are small"
        "lights" { LightSampling::Lights } "each vertex samples one light: noise where surfaces are glossy and lights large"
        "both" { LightSampling::Both } "both, weighted by their densities (multiple importance sampling)"
    /// Reflection formulas of path tracing.
    Fresnel = "fresnel", "conserving", Fresnel;
        "schlick" { FresnelRule::Schlick } "Schlick's formula for all: up to 0.08 off at grazing angles, of glass too"
        "model" { FresnelRule::Model }
            "glTF's sample formulas to the letter: white plastic reflects up to 1.89 times the incident light"
        "conserving" { FresnelRule::Conserving }
            "Schlick's for metallic-roughness, exact for glass and complex indices; the diffuse lobe gets the light that the specular lobe leaves"
        "exact" { FresnelRule::Exact } "Fresnel's equations for every material with an index; metals with a colour alone keep Schlick's"
    /// Treatment of light scattered between microfacets.
    Microfacets = "microfacets", "compensated", Microfacets;
        "single" { MicrofacetEnergy::Single } "light between facets is lost: rough metal is up to 60 % too dark"
        "compensated" { MicrofacetEnergy::Compensated }
            "light between facets is compensated: white metal reflects all light, to half a per cent, anisotropic metal to one"
    /// Dispersion: refraction by wavelength.
    Colour = "colour", "spectral", Spectral;
        "rgb" { false } "all wavelengths refract alike: no rainbows"
        "spectral" { true } "each refracted path has one wavelength: noise in colours"
    /// Filter of image textures.
    TextureFilter = "texture-filter", "bilinear", TextureFilter;
        "nearest" { TextureFilter::Nearest } "the nearest texel: blocks near by, and sparkles far away"
        "mipmaps" { TextureFilter::Mipmaps } "the mean over about a pixel: no sparkles with one sample, and blurred with many"
        "bilinear" { TextureFilter::Bilinear } "the weighted mean of four: smooth near by, and far away as sharp as samples make it"
    /// Greatest number of segments of a path.
    PathLength = "path-length", "8", PathLength;
        "1" { 1 } "camera rays alone: no reflection, no refraction"
        "2" { 2 } "one reflection or refraction"
        "4" { 4 } "three, as the documented preset"
        "8" { 8 } "seven: through two glass balls and out again"
        "16" { 16 } "fifteen"
        "64" { 64 } "sixty-three; more by --max-depth alone"
    /// Start of Russian roulette.
    Roulette = "roulette", "late", Roulette;
        "early" { RouletteStart::Early } "dim paths are ended by chance from the first surface on: less time a sample, more noise"
        "late" { RouletteStart::Late } "from the fourth segment on"
        "off" { RouletteStart::Off } "no path ends by chance: least noise a sample, most time"
    /// Limit on the radiance of a sample.
    Clamp = "clamp", "off", Clamp;
        "1" { Some(1.0) } "samples brighter than white are white: no fireflies, and dark where light is rare"
        "10" { Some(10.0) } "brightness above ten times white is lost, such as the sun in a mirror"
        "100" { Some(100.0) } "brightness above a hundred times white is lost"
        "off" { None } "no brightness is lost; rare bright paths are noise"
    /// Pixel filter.
    PixelFilter = "pixel-filter", "box", PixelFilter;
        "gaussian" { PixelFilter::Gaussian } "a bell over three pixels: no jagged edges, and everything softer"
        "blackman-harris" { PixelFilter::BlackmanHarris } "a narrower bell over three pixels"
        "tent" { PixelFilter::Tent } "up to the middles of the neighbours"
        "box" { PixelFilter::Box } "the pixel alone: sharp, with jagged edges at high contrast"
    /// Samples per pixel.
    Samples = "samples", "64", Samples;
        "1" { 1 } "edges are jagged"
        "4" { 4 } "edges have five steps"
        "16" { 16 } "noise a quarter of one sample's, or less"
        "64" { 64 } "an eighth, or less"
        "256" { 256 } "a sixteenth, or less"
        "1024" { 1024 } "a thirty-second, or less"
    /// Sampler: source of the random numbers of samples.
    Sampler = "sampler", "sobol", Sampler;
        "independent" { SamplerKind::Independent } "independent numbers: noise falls with the root of the samples"
        "stratified" { SamplerKind::Stratified } "jittered grids of sixteen: less noise where pictures are smooth"
        "sobol" { SamplerKind::Sobol } "scrambled Sobol points: least noise, four dimensions even together"
    /// Denoising of the picture.
    Reconstruction = "reconstruction", "unbiased", Denoised;
        "denoised" { true } "biased: noise is filtered out, and with it some fine or faint detail; the error is stated"
        "unbiased" { false } "the mean of the samples: right on average, with its noise"
    /// Output format of files.
    Output = "output", "8-bit", Output;
        "8-bit" { OutputFormat::Eight } "PNG of 256 codes: steps in dark ramps, and nothing brighter than white"
        "8-bit-dither" { OutputFormat::Dithered } "PNG of 256 codes, dithered: no steps, and a grain of one code"
        "16-bit" { OutputFormat::Sixteen } "PNG of 65 536 codes: nothing brighter than white"
        "float" { OutputFormat::Float } "EXR alone: linear radiance as it is"
    /// Build quality of the BVH, which trades build time against traversal time.
    Build = "build", "medium", Build;
        "fast" { BuildQuality::Fast } "least build time: clustered, and improved a little"
        "medium" { BuildQuality::Medium } "clustered, and improved"
        "high" { BuildQuality::High } "twice the build time: clustered among more neighbours, and all of it improved"
    /// Accelerator: linear scan or BVH.
    Accelerator = "accelerator", "bvh", Tree;
        "linear" { false } "every primitive is tested"
        "bvh" { true } "a tree of boxes"
}
