//! The rungs of every ladder, each with what it sets and what it gets wrong, as users read it.

use raywright_bvh::BuildQuality;

use super::{Ladder, Rung, Value};
use crate::display::Output;
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{Filter, Integrator};
use crate::settings::{Accumulation, AreaShadows, LightSampling, Microfacets, PrecisionChoice, Roulette, SamplerKind};

const fn rung(value: Value, name: &'static str, about: &'static str) -> Rung {
    Rung { name, about, value }
}

const PRECISION: &[Rung] = &[
    rung(Value::Precision(PrecisionChoice::Robust), "robust", "f32 stored, f64 where a hit is decided"),
    rung(Value::Precision(PrecisionChoice::Reference), "reference", "f64 throughout"),
];
const RAY_OFFSET: &[Rung] = &[
    rung(Value::ConstantOffset(true), "constant", "a constant distance: right at one scale, false shadows and leaks at others"),
    rung(Value::ConstantOffset(false), "error-bound", "outside the error of the hit point, at every scale"),
];
const SHADOWS: &[Rung] = &[
    rung(Value::Shadows(None), "off", "the light of lights without size passes through everything"),
    rung(
        Value::Shadows(Some(AreaShadows::Hard)),
        "hard",
        "a lamp is there where its middle is seen: no penumbras, and where it is half hidden all or nothing",
    ),
    rung(Value::Shadows(Some(AreaShadows::Soft)), "on", "what stands in between counts"),
];
const LIGHT_SAMPLING: &[Rung] = &[
    rung(
        Value::LightSampling(LightSampling::Scattering),
        "scattering",
        "paths meet light by chance: noise where lights are small",
    ),
    rung(
        Value::LightSampling(LightSampling::Lights),
        "lights",
        "each vertex asks one light: noise where surfaces are glossy and lights large",
    ),
    rung(Value::LightSampling(LightSampling::Both), "both", "each in the share in which it is the better one"),
];
const FRESNEL: &[Rung] = &[
    rung(
        Value::Fresnel(FresnelRule::Schlick),
        "schlick",
        "Schlick's formula for all: up to 0.08 off at grazing angles, of glass too",
    ),
    rung(
        Value::Fresnel(FresnelRule::Model),
        "model",
        "glTF's sample formulas to the letter: makes light, white plastic sends back up to 1.89 of what it gets",
    ),
    rung(
        Value::Fresnel(FresnelRule::Conserving),
        "conserving",
        "Schlick's for metallic-roughness, exact for glass and complex indices; what is diffused is what facets leave",
    ),
    rung(
        Value::Fresnel(FresnelRule::Exact),
        "exact",
        "Fresnel's equations for whatever has an index; metals with a colour alone keep Schlick's",
    ),
];
const MICROFACETS: &[Rung] = &[
    rung(
        Value::Microfacets(Microfacets::Single),
        "single",
        "what facets send to each other is lost: rough metal is up to 60 % too dark",
    ),
    rung(
        Value::Microfacets(Microfacets::Compensated),
        "compensated",
        "given back: white metal sends back all, to half a per cent, combed metal to one",
    ),
];
const TEXTURE_FILTER: &[Rung] = &[
    rung(Value::TextureFilter(Filter::Nearest), "nearest", "the nearest texel: blocks near by, and sparkles far away"),
    rung(
        Value::TextureFilter(Filter::Mipmaps),
        "mipmaps",
        "the mean over about a pixel: no sparkles with one sample, and blurred with many",
    ),
    rung(
        Value::TextureFilter(Filter::Bilinear),
        "bilinear",
        "the weighted mean of four: smooth near by, and far away as sharp as samples make it",
    ),
];
const PIXEL_FILTER: &[Rung] = &[
    rung(Value::PixelFilter(PixelFilter::Gaussian), "gaussian", "a bell over three pixels: no stairs, and everything softer"),
    rung(Value::PixelFilter(PixelFilter::BlackmanHarris), "blackman-harris", "a narrower bell over three pixels"),
    rung(Value::PixelFilter(PixelFilter::Tent), "tent", "up to the middles of the neighbours"),
    rung(Value::PixelFilter(PixelFilter::Box), "box", "the pixel alone: sharp, with stairs at high contrast"),
];
const ROULETTE: &[Rung] = &[
    rung(
        Value::Roulette(Roulette::Early),
        "early",
        "dim paths are ended by chance from the first surface on: less time a sample, more noise",
    ),
    rung(Value::Roulette(Roulette::Late), "late", "from the fourth segment on"),
    rung(Value::Roulette(Roulette::Off), "off", "no path ends by chance: least noise a sample, most time"),
];
const CLAMP: &[Rung] = &[
    rung(Value::Clamp(Some(1.0)), "1", "samples brighter than white are white: no fireflies, and dark where light is rare"),
    rung(Value::Clamp(Some(10.0)), "10", "what is brighter than ten times white is lost, from the sun in a mirror on"),
    rung(Value::Clamp(Some(100.0)), "100", "what is a hundred times as bright as white is lost"),
    rung(Value::Clamp(None), "off", "nothing is lost, and what is rare and bright is noise"),
];
const SAMPLER: &[Rung] = &[
    rung(
        Value::Sampler(SamplerKind::Independent),
        "independent",
        "each number by itself: noise falls with the root of the samples",
    ),
    rung(
        Value::Sampler(SamplerKind::Stratified),
        "stratified",
        "sixteen at a time on a jittered grid: less noise where pictures are smooth",
    ),
    rung(Value::Sampler(SamplerKind::Sobol), "sobol", "scrambled Sobol points: least noise, four dimensions even together"),
];
const ACCUMULATION: &[Rung] = &[
    rung(
        Value::Accumulation(Accumulation::Single),
        "f32",
        "each sample is added to an f32: rounded to the steps of the sum so far",
    ),
    rung(Value::Accumulation(Accumulation::Double), "f64", "sums keep every digit of their samples"),
];
const RECONSTRUCTION: &[Rung] = &[
    rung(
        Value::Denoised(true),
        "denoised",
        "biased: noise is filtered out, and with it some of what is fine or faint; its own error is told",
    ),
    rung(Value::Denoised(false), "unbiased", "the mean of the samples: right on average, noise and all"),
];
const OUTPUT: &[Rung] = &[
    rung(Value::Output(Output::Eight), "8-bit", "PNG of 256 codes: steps in dark ramps, and nothing brighter than white"),
    rung(
        Value::Output(Output::Dithered),
        "8-bit-dither",
        "PNG of 256 codes, one of the two nearest by place: no steps, and a grain of one code",
    ),
    rung(Value::Output(Output::Sixteen), "16-bit", "PNG of 65 536 codes: nothing brighter than white"),
    rung(Value::Output(Output::Float), "float", "EXR alone: linear radiance as it is"),
];
const PATH_LENGTH: &[Rung] = &[
    rung(Value::PathLength(1), "1", "camera rays alone: no reflection, no refraction"),
    rung(Value::PathLength(2), "2", "one reflection or refraction"),
    rung(Value::PathLength(4), "4", "three, as the documented preset"),
    rung(Value::PathLength(8), "8", "seven: through two glass balls and out again"),
    rung(Value::PathLength(16), "16", "fifteen"),
    rung(Value::PathLength(64), "64", "sixty-three; more by --max-depth alone"),
];
const SAMPLES: &[Rung] = &[
    rung(Value::Samples(1), "1", "edges are stairs"),
    rung(Value::Samples(4), "4", "edges have five steps"),
    rung(Value::Samples(16), "16", "noise a quarter of one sample's, or less"),
    rung(Value::Samples(64), "64", "an eighth, or less"),
    rung(Value::Samples(256), "256", "a sixteenth, or less"),
    rung(Value::Samples(1024), "1024", "a thirty-second, or less"),
];
const BUILD: &[Rung] = &[
    rung(Value::Build(BuildQuality::Fast), "fast", "least build time: split from the top, large sets by samples"),
    rung(Value::Build(BuildQuality::Medium), "medium", "split from the top, and improved"),
    rung(Value::Build(BuildQuality::High), "high", "several times the build time: more is improved"),
];
const ACCELERATOR: &[Rung] =
    &[rung(Value::Tree(false), "linear", "every primitive is tested"), rung(Value::Tree(true), "bvh", "a tree of boxes")];

const INTEGRATOR: &[Rung] = &[
    rung(
        Value::Integrator(Integrator::Whitted),
        "whitted",
        "mirrors, glass and light straight from lamps: what lights walls by way of other walls is missing",
    ),
    rung(Value::Integrator(Integrator::Path), "path", "all light that finds its way"),
];
const COLOUR: &[Rung] = &[
    rung(Value::Spectral(false), "rgb", "all colours are bent alike: no rainbows"),
    rung(Value::Spectral(true), "spectral", "each path that is bent has one wavelength: noise in colours"),
];

/// What is known of a ladder.
pub(super) struct LadderDescription {
    pub name: &'static str,
    pub rungs: &'static [Rung],
    /// The rung of a scene that says nothing.
    pub default_rung: &'static str,
}

const fn of(name: &'static str, rungs: &'static [Rung], default_rung: &'static str) -> LadderDescription {
    LadderDescription { name, rungs, default_rung }
}

/// Names, rungs and defaults of all ladders.
pub(super) const fn facts(ladder: Ladder) -> LadderDescription {
    match ladder {
        Ladder::Integrator => of("integrator", INTEGRATOR, "path"),
        Ladder::Precision => of("precision", PRECISION, "robust"),
        Ladder::RayOffset => of("ray-offset", RAY_OFFSET, "error-bound"),
        Ladder::Shadows => of("shadows", SHADOWS, "on"),
        Ladder::LightSampling => of("light-sampling", LIGHT_SAMPLING, "both"),
        Ladder::Fresnel => of("fresnel", FRESNEL, "conserving"),
        Ladder::Microfacets => of("microfacets", MICROFACETS, "compensated"),
        Ladder::Colour => of("colour", COLOUR, "spectral"),
        Ladder::TextureFilter => of("texture-filter", TEXTURE_FILTER, "bilinear"),
        Ladder::PathLength => of("path-length", PATH_LENGTH, "8"),
        Ladder::Roulette => of("roulette", ROULETTE, "late"),
        Ladder::Clamp => of("clamp", CLAMP, "off"),
        Ladder::Sampler => of("sampler", SAMPLER, "sobol"),
        Ladder::Accumulation => of("accumulation", ACCUMULATION, "f64"),
        Ladder::Reconstruction => of("reconstruction", RECONSTRUCTION, "unbiased"),
        Ladder::Output => of("output", OUTPUT, "8-bit"),
        Ladder::PixelFilter => of("pixel-filter", PIXEL_FILTER, "box"),
        Ladder::Samples => of("samples", SAMPLES, "64"),
        Ladder::Build => of("build", BUILD, "medium"),
        Ladder::Accelerator => of("accelerator", ACCELERATOR, "bvh"),
    }
}
