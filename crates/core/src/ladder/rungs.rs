//! Table of ladders: each with its name, its default rung, and its rungs with their values and
//! descriptions for users.

use raywright_bvh::BuildQuality;

use super::{Rung, RungValue};
use crate::display::Output;
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{Filter, Integrator};
use crate::settings::{
    AreaShadows, LightSampling, Microfacets, PrecisionChoice, Roulette, SamplerKind,
};

/// Defines the ladders from a table of `KIND = NAME, DEFAULT, VALUE;` with rows `RUNG { VALUE }
/// ABOUT`.
macro_rules! ladders {
    ($($(#[$doc:meta])* $kind:ident = $name:literal, $default:literal, $value:ident;
        $($rung:literal { $sets:expr } $about:literal)*)*) => {
        /// A ladder.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Ladder {
            $($(#[$doc])* $kind,)*
        }

        impl Ladder {
            /// Every ladder; those that change pictures come first.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$kind),*];

            /// Returns the name in reports and on the command line.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// Returns the default rung.
            pub const fn default_rung(self) -> &'static str {
                match self {
                    $(Self::$kind => $default,)*
                }
            }

            /// Returns the rungs, from fast to exact; for ladders that do not change pictures, from
            /// the least preparation to the most.
            pub const fn rungs(self) -> &'static [Rung] {
                match self {
                    $(Self::$kind => &[$(Rung { name: $rung, about: $about, value: RungValue::$value($sets) }),*],)*
                }
            }
        }
    };
}

ladders! {
    /// Computation of light.
    Integrator = "integrator", "path", Integrator;
        "whitted" { Integrator::Whitted }
            "mirrors, glass and light straight from lamps: what lights walls by way of other walls is missing"
        "path" { Integrator::Path } "all light that finds its way"
    /// Arithmetic of rays and surfaces.
    Precision = "precision", "robust", Precision;
        "robust" { PrecisionChoice::Robust } "f32 stored, f64 where a hit is decided"
        "reference" { PrecisionChoice::Reference } "f64 throughout"
    /// Start of a ray that leaves a surface.
    RayOffset = "ray-offset", "error-bound", ConstantOffset;
        "constant" { true } "a constant distance: right at one scale, false shadows and leaks at others"
        "error-bound" { false } "outside the error of the hit point, at every scale"
    /// Occlusion between a light and a surface.
    Shadows = "shadows", "on", Shadows;
        "off" { None } "the light of lights without size passes through everything"
        "hard" { Some(AreaShadows::Hard) }
            "a lamp is there where its middle is seen: no penumbras, and where it is half hidden all or nothing"
        "on" { Some(AreaShadows::Soft) } "what stands in between counts"
    /// Sampling of area lights by path tracing.
    LightSampling = "light-sampling", "both", LightSampling;
        "scattering" { LightSampling::Scattering } "paths meet light by chance: noise where lights are small"
        "lights" { LightSampling::Lights } "each vertex asks one light: noise where surfaces are glossy and lights large"
        "both" { LightSampling::Both } "each in the share in which it is the better one"
    /// Reflection formulas of path tracing.
    Fresnel = "fresnel", "conserving", Fresnel;
        "schlick" { FresnelRule::Schlick } "Schlick's formula for all: up to 0.08 off at grazing angles, of glass too"
        "model" { FresnelRule::Model }
            "glTF's sample formulas to the letter: makes light, white plastic sends back up to 1.89 of what it gets"
        "conserving" { FresnelRule::Conserving }
            "Schlick's for metallic-roughness, exact for glass and complex indices; what is diffused is what facets leave"
        "exact" { FresnelRule::Exact } "Fresnel's equations for whatever has an index; metals with a colour alone keep Schlick's"
    /// Light scattered between microfacets.
    Microfacets = "microfacets", "compensated", Microfacets;
        "single" { Microfacets::Single } "what facets send to each other is lost: rough metal is up to 60 % too dark"
        "compensated" { Microfacets::Compensated }
            "given back: white metal sends back all, to half a per cent, combed metal to one"
    /// Dispersion by wavelengths.
    Colour = "colour", "spectral", Spectral;
        "rgb" { false } "all colours are bent alike: no rainbows"
        "spectral" { true } "each path that is bent has one wavelength: noise in colours"
    /// Interpolation between texels.
    TextureFilter = "texture-filter", "bilinear", TextureFilter;
        "nearest" { Filter::Nearest } "the nearest texel: blocks near by, and sparkles far away"
        "mipmaps" { Filter::Mipmaps } "the mean over about a pixel: no sparkles with one sample, and blurred with many"
        "bilinear" { Filter::Bilinear } "the weighted mean of four: smooth near by, and far away as sharp as samples make it"
    /// Greatest number of segments of a path.
    PathLength = "path-length", "8", PathLength;
        "1" { 1 } "camera rays alone: no reflection, no refraction"
        "2" { 2 } "one reflection or refraction"
        "4" { 4 } "three, as the documented preset"
        "8" { 8 } "seven: through two glass balls and out again"
        "16" { 16 } "fifteen"
        "64" { 64 } "sixty-three; more by --max-depth alone"
    /// Russian roulette.
    Roulette = "roulette", "late", Roulette;
        "early" { Roulette::Early } "dim paths are ended by chance from the first surface on: less time a sample, more noise"
        "late" { Roulette::Late } "from the fourth segment on"
        "off" { Roulette::Off } "no path ends by chance: least noise a sample, most time"
    /// Greatest radiance of a sample.
    Clamp = "clamp", "off", Clamp;
        "1" { Some(1.0) } "samples brighter than white are white: no fireflies, and dark where light is rare"
        "10" { Some(10.0) } "what is brighter than ten times white is lost, from the sun in a mirror on"
        "100" { Some(100.0) } "what is a hundred times as bright as white is lost"
        "off" { None } "nothing is lost, and what is rare and bright is noise"
    /// Pixel filter.
    PixelFilter = "pixel-filter", "box", PixelFilter;
        "gaussian" { PixelFilter::Gaussian } "a bell over three pixels: no stairs, and everything softer"
        "blackman-harris" { PixelFilter::BlackmanHarris } "a narrower bell over three pixels"
        "tent" { PixelFilter::Tent } "up to the middles of the neighbours"
        "box" { PixelFilter::Box } "the pixel alone: sharp, with stairs at high contrast"
    /// Samples per pixel.
    Samples = "samples", "64", Samples;
        "1" { 1 } "edges are stairs"
        "4" { 4 } "edges have five steps"
        "16" { 16 } "noise a quarter of one sample's, or less"
        "64" { 64 } "an eighth, or less"
        "256" { 256 } "a sixteenth, or less"
        "1024" { 1024 } "a thirty-second, or less"
    /// Source of random numbers.
    Sampler = "sampler", "sobol", Sampler;
        "independent" { SamplerKind::Independent } "each number by itself: noise falls with the root of the samples"
        "stratified" { SamplerKind::Stratified } "sixteen at a time on a jittered grid: less noise where pictures are smooth"
        "sobol" { SamplerKind::Sobol } "scrambled Sobol points: least noise, four dimensions even together"
    /// Denoising of the picture.
    Reconstruction = "reconstruction", "unbiased", Denoised;
        "denoised" { true } "biased: noise is filtered out, and with it some of what is fine or faint; its own error is told"
        "unbiased" { false } "the mean of the samples: right on average, noise and all"
    /// Output format of files.
    Output = "output", "8-bit", Output;
        "8-bit" { Output::Eight } "PNG of 256 codes: steps in dark ramps, and nothing brighter than white"
        "8-bit-dither" { Output::Dithered } "PNG of 256 codes, one of the two nearest by place: no steps, and a grain of one code"
        "16-bit" { Output::Sixteen } "PNG of 65 536 codes: nothing brighter than white"
        "float" { Output::Float } "EXR alone: linear radiance as it is"
    /// Build time of the tree against its traversal time.
    Build = "build", "medium", Build;
        "fast" { BuildQuality::Fast } "least build time: clustered, and improved a little"
        "medium" { BuildQuality::Medium } "clustered, and improved"
        "high" { BuildQuality::High } "twice the build time: clustered among more neighbours, and all of it improved"
    /// Search for the hits of rays.
    Accelerator = "accelerator", "bvh", Tree;
        "linear" { false } "every primitive is tested"
        "bvh" { true } "a tree of boxes"
}
