//! The table of ladders: each with its name, the rung of a scene that says nothing, and its rungs,
//! what each sets and what it gets wrong, as users read it.

use raywright_bvh::BuildQuality;

use super::{Rung, RungValue};
use crate::display::Output;
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{Filter, Integrator};
use crate::settings::{
    AreaShadows, LightSampling, Microfacets, PrecisionChoice, Roulette, SamplerKind,
};

/// Makes the ladders of a table of `KIND = NAME, DEFAULT, VALUE;` with rows
/// `RUNG { WHAT IT SETS } ABOUT`.
macro_rules! ladders {
    ($($(#[$doc:meta])* $kind:ident = $name:literal, $default:literal, $value:ident;
        $($rung:literal { $sets:expr } $about:literal)*)*) => {
        /// One ladder.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Ladder {
            $($(#[$doc])* $kind,)*
        }

        impl Ladder {
            /// Every ladder, those that change pictures first.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$kind),*];

            /// Name in reports and on the command line.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// The rung of a scene that says nothing.
            pub const fn default_rung(self) -> &'static str {
                match self {
                    $(Self::$kind => $default,)*
                }
            }

            /// Its rungs, from fast to exact; where no picture depends on them, from the least
            /// preparation to the most.
            pub const fn rungs(self) -> &'static [Rung] {
                match self {
                    $(Self::$kind => &[$(Rung { name: $rung, about: $about, value: RungValue::$value($sets) }),*],)*
                }
            }
        }
    };
}

ladders! {
    /// How light is computed.
    Integrator = "integrator", "path", Integrator;
        "whitted" { Integrator::Whitted }
            "mirrors, glass and light straight from lamps: what lights walls by way of other walls is missing"
        "path" { Integrator::Path } "all light that finds its way"
    /// Arithmetic of rays and surfaces.
    Precision = "precision", "robust", Precision;
        "robust" { PrecisionChoice::Robust } "f32 stored, f64 where a hit is decided"
        "reference" { PrecisionChoice::Reference } "f64 throughout"
    /// Where a ray that leaves a surface starts.
    RayOffset = "ray-offset", "error-bound", ConstantOffset;
        "constant" { true } "a constant distance: right at one scale, false shadows and leaks at others"
        "error-bound" { false } "outside the error of the hit point, at every scale"
    /// Whether something between a light and a surface counts.
    Shadows = "shadows", "on", Shadows;
        "off" { None } "the light of lights without size passes through everything"
        "hard" { Some(AreaShadows::Hard) }
            "a lamp is there where its middle is seen: no penumbras, and where it is half hidden all or nothing"
        "on" { Some(AreaShadows::Soft) } "what stands in between counts"
    /// How a path tracer finds light that has a size.
    LightSampling = "light-sampling", "both", LightSampling;
        "scattering" { LightSampling::Scattering } "paths meet light by chance: noise where lights are small"
        "lights" { LightSampling::Lights } "each vertex asks one light: noise where surfaces are glossy and lights large"
        "both" { LightSampling::Both } "each in the share in which it is the better one"
    /// By which formulas a path tracer's surfaces reflect.
    Fresnel = "fresnel", "conserving", Fresnel;
        "schlick" { FresnelRule::Schlick } "Schlick's formula for all: up to 0.08 off at grazing angles, of glass too"
        "model" { FresnelRule::Model }
            "glTF's sample formulas to the letter: makes light, white plastic sends back up to 1.89 of what it gets"
        "conserving" { FresnelRule::Conserving }
            "Schlick's for metallic-roughness, exact for glass and complex indices; what is diffused is what facets leave"
        "exact" { FresnelRule::Exact } "Fresnel's equations for whatever has an index; metals with a colour alone keep Schlick's"
    /// What becomes of light that microfacets send to each other.
    Microfacets = "microfacets", "compensated", Microfacets;
        "single" { Microfacets::Single } "what facets send to each other is lost: rough metal is up to 60 % too dark"
        "compensated" { Microfacets::Compensated }
            "given back: white metal sends back all, to half a per cent, combed metal to one"
    /// Whether colours that are bent apart have a wavelength.
    Colour = "colour", "spectral", Spectral;
        "rgb" { false } "all colours are bent alike: no rainbows"
        "spectral" { true } "each path that is bent has one wavelength: noise in colours"
    /// How texels are combined.
    TextureFilter = "texture-filter", "bilinear", TextureFilter;
        "nearest" { Filter::Nearest } "the nearest texel: blocks near by, and sparkles far away"
        "mipmaps" { Filter::Mipmaps } "the mean over about a pixel: no sparkles with one sample, and blurred with many"
        "bilinear" { Filter::Bilinear } "the weighted mean of four: smooth near by, and far away as sharp as samples make it"
    /// How many segments a path may have.
    PathLength = "path-length", "8", PathLength;
        "1" { 1 } "camera rays alone: no reflection, no refraction"
        "2" { 2 } "one reflection or refraction"
        "4" { 4 } "three, as the documented preset"
        "8" { 8 } "seven: through two glass balls and out again"
        "16" { 16 } "fifteen"
        "64" { 64 } "sixty-three; more by --max-depth alone"
    /// When chance ends paths.
    Roulette = "roulette", "late", Roulette;
        "early" { Roulette::Early } "dim paths are ended by chance from the first surface on: less time a sample, more noise"
        "late" { Roulette::Late } "from the fourth segment on"
        "off" { Roulette::Off } "no path ends by chance: least noise a sample, most time"
    /// How bright a sample may be.
    Clamp = "clamp", "off", Clamp;
        "1" { Some(1.0) } "samples brighter than white are white: no fireflies, and dark where light is rare"
        "10" { Some(10.0) } "what is brighter than ten times white is lost, from the sun in a mirror on"
        "100" { Some(100.0) } "what is a hundred times as bright as white is lost"
        "off" { None } "nothing is lost, and what is rare and bright is noise"
    /// How much of a pixel's surroundings counts towards it.
    PixelFilter = "pixel-filter", "box", PixelFilter;
        "gaussian" { PixelFilter::Gaussian } "a bell over three pixels: no stairs, and everything softer"
        "blackman-harris" { PixelFilter::BlackmanHarris } "a narrower bell over three pixels"
        "tent" { PixelFilter::Tent } "up to the middles of the neighbours"
        "box" { PixelFilter::Box } "the pixel alone: sharp, with stairs at high contrast"
    /// How many samples a pixel takes.
    Samples = "samples", "64", Samples;
        "1" { 1 } "edges are stairs"
        "4" { 4 } "edges have five steps"
        "16" { 16 } "noise a quarter of one sample's, or less"
        "64" { 64 } "an eighth, or less"
        "256" { 256 } "a sixteenth, or less"
        "1024" { 1024 } "a thirty-second, or less"
    /// Where random numbers come from.
    Sampler = "sampler", "sobol", Sampler;
        "independent" { SamplerKind::Independent } "each number by itself: noise falls with the root of the samples"
        "stratified" { SamplerKind::Stratified } "sixteen at a time on a jittered grid: less noise where pictures are smooth"
        "sobol" { SamplerKind::Sobol } "scrambled Sobol points: least noise, four dimensions even together"
    /// Whether noise is filtered out of the picture.
    Reconstruction = "reconstruction", "unbiased", Denoised;
        "denoised" { true } "biased: noise is filtered out, and with it some of what is fine or faint; its own error is told"
        "unbiased" { false } "the mean of the samples: right on average, noise and all"
    /// What files keep of the picture.
    Output = "output", "8-bit", Output;
        "8-bit" { Output::Eight } "PNG of 256 codes: steps in dark ramps, and nothing brighter than white"
        "8-bit-dither" { Output::Dithered } "PNG of 256 codes, one of the two nearest by place: no steps, and a grain of one code"
        "16-bit" { Output::Sixteen } "PNG of 65 536 codes: nothing brighter than white"
        "float" { Output::Float } "EXR alone: linear radiance as it is"
    /// How long the tree is built for how fast it is walked.
    Build = "build", "medium", Build;
        "fast" { BuildQuality::Fast } "least build time: clustered, and improved a little"
        "medium" { BuildQuality::Medium } "clustered, and improved"
        "high" { BuildQuality::High } "twice the build time: clustered among more neighbours, and all of it improved"
    /// How rays find what they hit.
    Accelerator = "accelerator", "bvh", Tree;
        "linear" { false } "every primitive is tested"
        "bvh" { true } "a tree of boxes"
}
