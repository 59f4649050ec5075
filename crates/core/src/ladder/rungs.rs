//! The rungs of every ladder, each with what it gets wrong: what users read, and nothing else.

use super::{Ladder, Rung};

const fn rung(name: &'static str, about: &'static str) -> Rung {
    Rung { name, about }
}

const PRECISION: &[Rung] = &[rung("robust", "f32 stored, f64 where a hit is decided"), rung("reference", "f64 throughout")];
const RAY_OFFSET: &[Rung] = &[
    rung("constant", "a constant distance: right at one scale, false shadows and leaks at others"),
    rung("error-bound", "outside the error of the hit point, at every scale"),
];
const SHADOWS: &[Rung] = &[
    rung("off", "the light of lights without size passes through everything"),
    rung("hard", "a lamp is there where its middle is seen: no penumbras, and where it is half hidden all or nothing"),
    rung("on", "what stands in between counts"),
];
const LIGHT_SAMPLING: &[Rung] = &[
    rung("scattering", "paths meet light by chance: noise where lights are small"),
    rung("lights", "each vertex asks one light: noise where surfaces are glossy and lights large"),
    rung("both", "each in the share in which it is the better one"),
];
const FRESNEL: &[Rung] = &[
    rung("schlick", "Schlick's formula for all: up to 0.08 off at grazing angles, of glass too"),
    rung("model", "glTF's sample formulas to the letter: makes light, white plastic sends back up to 1.89 of what it gets"),
    rung(
        "conserving",
        "Schlick's for metallic-roughness, exact for glass and complex indices; what is diffused is what facets leave",
    ),
    rung("exact", "Fresnel's equations for whatever has an index; metals with a colour alone keep Schlick's"),
];
const MICROFACETS: &[Rung] = &[
    rung("single", "what facets send to each other is lost: rough metal is up to 60 % too dark"),
    rung("compensated", "given back: white metal sends back all, to half a per cent, combed metal to one"),
];
const TEXTURE_FILTER: &[Rung] = &[
    rung("nearest", "the nearest texel: blocks near by, and sparkles far away"),
    rung("mipmaps", "the mean over about a pixel: no sparkles with one sample, and blurred with many"),
    rung("bilinear", "the weighted mean of four: smooth near by, and far away as sharp as samples make it"),
];
const PIXEL_FILTER: &[Rung] = &[
    rung("gaussian", "a bell over three pixels: no stairs, and everything softer"),
    rung("blackman-harris", "a narrower bell over three pixels"),
    rung("tent", "up to the middles of the neighbours"),
    rung("box", "the pixel alone: sharp, with stairs at high contrast"),
];
const ROULETTE: &[Rung] = &[
    rung("early", "dim paths are ended by chance from the first surface on: less time a sample, more noise"),
    rung("late", "from the fourth segment on"),
    rung("off", "no path ends by chance: least noise a sample, most time"),
];
const CLAMP: &[Rung] = &[
    rung("1", "samples brighter than white are white: no fireflies, and dark where light is rare"),
    rung("10", "what is brighter than ten times white is lost, from the sun in a mirror on"),
    rung("100", "what is a hundred times as bright as white is lost"),
    rung("off", "nothing is lost, and what is rare and bright is noise"),
];
const SAMPLER: &[Rung] = &[
    rung("independent", "each number by itself: noise falls with the root of the samples"),
    rung("stratified", "sixteen at a time on a jittered grid: less noise where pictures are smooth"),
    rung("sobol", "scrambled Sobol points: least noise, four dimensions even together"),
];
const ACCUMULATION: &[Rung] = &[
    rung("f32", "each sample is added to an f32: rounded to the steps of the sum so far"),
    rung("f64", "sums keep every digit of their samples"),
];
const RECONSTRUCTION: &[Rung] = &[
    rung("denoised", "biased: noise is filtered out, and with it some of what is fine or faint; its own error is told"),
    rung("unbiased", "the mean of the samples: right on average, noise and all"),
];
const OUTPUT: &[Rung] = &[
    rung("8-bit", "PNG of 256 codes: steps in dark ramps, and nothing brighter than white"),
    rung("8-bit-dither", "PNG of 256 codes, one of the two nearest by place: no steps, and a grain of one code"),
    rung("16-bit", "PNG of 65 536 codes: nothing brighter than white"),
    rung("float", "EXR alone: linear radiance as it is"),
];
const PATH_LENGTH: &[Rung] = &[
    rung("1", "camera rays alone: no reflection, no refraction"),
    rung("2", "one reflection or refraction"),
    rung("4", "three, as the documented preset"),
    rung("8", "seven: through two glass balls and out again"),
    rung("16", "fifteen"),
    rung("64", "sixty-three; more by --max-depth alone"),
];
const SAMPLES: &[Rung] = &[
    rung("1", "edges are stairs"),
    rung("4", "edges have five steps"),
    rung("16", "noise a quarter of one sample's, or less"),
    rung("64", "an eighth, or less"),
    rung("256", "a sixteenth, or less"),
    rung("1024", "a thirty-second, or less"),
];
const BUILD: &[Rung] = &[
    rung("fast", "least build time: split from the top, large sets by samples"),
    rung("medium", "split from the top, and improved"),
    rung("high", "several times the build time: more is improved"),
];
const ACCELERATOR: &[Rung] = &[rung("linear", "every primitive is tested"), rung("bvh", "a tree of boxes")];

const INTEGRATOR: &[Rung] = &[
    rung("whitted", "mirrors, glass and light straight from lamps: what lights walls by way of other walls is missing"),
    rung("path", "all light that finds its way"),
];
const COLOUR: &[Rung] = &[
    rung("rgb", "all colours are bent alike: no rainbows"),
    rung("spectral", "each path that is bent has one wavelength: noise in colours"),
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
