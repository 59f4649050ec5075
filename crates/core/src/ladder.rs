//! The ladders: every choice that trades accuracy for time, under a name, with its rungs and what each gets wrong.
//!
//! A ladder is a closed set of rungs from fast to exact. Which rung is in use is read from scene and settings, and choosing one
//! changes these and nothing else, so that a rung and the flag or key that means the same cannot differ.

use core::fmt;

use raywright_bvh::{AcceleratorKind, BuildQuality};
use serde::Serialize;

use crate::effects::{Effect, EffectReport, EffectSet, Status, chosen};
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::scene::{ConstantOffset, Filter, Integrator, OffsetDirection, Scene, SpawnRule};
use crate::settings::{LightSampling, Microfacets, PrecisionChoice, Sampling, Settings};
use crate::suggest::closest;

/// One ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Ladder {
    /// Arithmetic of rays and surfaces.
    Precision,
    /// Where a ray that leaves a surface starts.
    RayOffset,
    /// Whether something between a light and a surface counts.
    Shadows,
    /// How a path tracer finds light that has a size.
    LightSampling,
    /// By which formulas a path tracer's surfaces reflect.
    Fresnel,
    /// What becomes of light that microfacets send to each other.
    Microfacets,
    /// How texels are combined.
    TextureFilter,
    /// How many segments a path may have.
    PathLength,
    /// How much of a pixel's surroundings counts towards it.
    PixelFilter,
    /// How many samples a pixel takes.
    Samples,
    /// How long the tree is built for how fast it is walked.
    Build,
    /// How rays find what they hit.
    Accelerator,
}

/// One rung of a ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Rung {
    /// Name in reports and on the command line.
    pub name: &'static str,
    /// What it is, and what it gets wrong.
    pub about: &'static str,
}

const fn rung(name: &'static str, about: &'static str) -> Rung {
    Rung { name, about }
}

const PRECISION: &[Rung] = &[
    rung("fast", "textbook formulas in f32: wrong far from the origin, at grazing angles and on tori"),
    rung("robust", "f32 stored, f64 where a hit is decided"),
    rung("reference", "f64 throughout"),
];
const RAY_OFFSET: &[Rung] = &[
    rung("constant", "a constant distance: right at one scale, false shadows and leaks at others"),
    rung("error-bound", "outside the error of the hit point, at every scale"),
];
const SHADOWS: &[Rung] = &[rung("off", "light passes through everything"), rung("on", "what stands in between counts")];
const LIGHT_SAMPLING: &[Rung] = &[
    rung("scattering", "paths meet light by chance: noise where lights are small"),
    rung("lights", "each vertex asks one light: noise where surfaces are glossy and lights large"),
    rung("both", "each in the share in which it is the better one"),
];
const FRESNEL: &[Rung] = &[
    rung("schlick", "Schlick's formula for all: up to 0.08 off at grazing angles, of glass too"),
    rung("model", "Schlick's for metallic-roughness, which is defined by it; exact for glass and complex indices"),
    rung("exact", "Fresnel's equations for whatever has an index; metals with a colour alone keep Schlick's"),
];
const MICROFACETS: &[Rung] = &[
    rung("single", "what facets send to each other is lost: rough metal is up to 60 % too dark"),
    rung("compensated", "given back: white metal sends back all, to half a per cent"),
];
const TEXTURE_FILTER: &[Rung] = &[
    rung("nearest", "the nearest texel: blocks near by, and sparkles far away"),
    rung("mipmaps", "the mean over about a pixel: no sparkles with one sample, and blurred with many"),
    rung("bilinear", "the weighted mean of four: smooth near by, and far away as sharp as samples make it"),
];
/// What the rungs are in a scene, in the same order.
const FILTERS: [Filter; 3] = [Filter::Nearest, Filter::Mipmaps, Filter::Bilinear];
const PIXEL_FILTER: &[Rung] = &[
    rung("gaussian", "a bell over three pixels: no stairs, and everything softer"),
    rung("blackman-harris", "a narrower bell over three pixels"),
    rung("tent", "up to the middles of the neighbours"),
    rung("box", "the pixel alone: sharp, with stairs at high contrast"),
];
const PATH_LENGTH: &[Rung] = &[
    rung("1", "camera rays alone: no reflection, no refraction"),
    rung("2", "one reflection or refraction"),
    rung("4", "three, as the documented preset"),
    rung("8", "seven: through two glass balls and out again"),
    rung("16", "fifteen"),
    rung("64", "as many as there can be"),
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
    rung("medium", "split from the top and improved, and clustered where sizes differ much"),
    rung("high", "several times the build time: more is improved, long triangles across the axes are split"),
    rung("compact", "least memory, slower rays: as medium, and neighbouring triangles share corners"),
];
const ACCELERATOR: &[Rung] = &[
    rung("linear", "every primitive is tested"),
    rung("linear-boxes", "the box of every primitive is tested, four at a time"),
    rung("bvh", "a tree of boxes"),
];

/// The constant offset of scenes that name none, in metres.
const OFFSET: ConstantOffset =
    ConstantOffset { offset: 1e-3, along: OffsetDirection::Normal, camera_min: 0.0, secondary_min: 0.0, shadow_min: 0.0 };

impl Ladder {
    /// Every ladder, those that change pictures first.
    pub const ALL: [Self; 12] = [
        Self::Precision,
        Self::RayOffset,
        Self::Shadows,
        Self::LightSampling,
        Self::Fresnel,
        Self::Microfacets,
        Self::TextureFilter,
        Self::PathLength,
        Self::PixelFilter,
        Self::Samples,
        Self::Build,
        Self::Accelerator,
    ];

    /// Name in reports and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Precision => "precision",
            Self::RayOffset => "ray-offset",
            Self::Shadows => "shadows",
            Self::LightSampling => "light-sampling",
            Self::Fresnel => "fresnel",
            Self::Microfacets => "microfacets",
            Self::TextureFilter => "texture-filter",
            Self::PathLength => "path-length",
            Self::PixelFilter => "pixel-filter",
            Self::Samples => "samples",
            Self::Build => "build",
            Self::Accelerator => "accelerator",
        }
    }

    /// Its rungs, from fast to exact; where no picture depends on them, from the least preparation to the most.
    pub const fn rungs(self) -> &'static [Rung] {
        match self {
            Self::Precision => PRECISION,
            Self::RayOffset => RAY_OFFSET,
            Self::Shadows => SHADOWS,
            Self::LightSampling => LIGHT_SAMPLING,
            Self::Fresnel => FRESNEL,
            Self::Microfacets => MICROFACETS,
            Self::TextureFilter => TEXTURE_FILTER,
            Self::PathLength => PATH_LENGTH,
            Self::PixelFilter => PIXEL_FILTER,
            Self::Samples => SAMPLES,
            Self::Build => BUILD,
            Self::Accelerator => ACCELERATOR,
        }
    }

    /// The rung of a scene that says nothing.
    pub const fn default_rung(self) -> &'static str {
        match self {
            Self::Precision => "robust",
            Self::RayOffset => "error-bound",
            Self::Shadows => "on",
            Self::LightSampling => "both",
            Self::Fresnel => "model",
            Self::Microfacets => "compensated",
            Self::TextureFilter => "bilinear",
            Self::PathLength => "8",
            Self::PixelFilter => "box",
            Self::Samples => "64",
            Self::Build => "medium",
            Self::Accelerator => "bvh",
        }
    }

    /// Its rungs as choices, in the same order.
    pub fn choices(self) -> impl DoubleEndedIterator<Item = Choice> {
        self.rungs().iter().map(move |rung| Choice { ladder: self, rung: rung.name })
    }

    /// Whether the picture depends on it; otherwise only time and memory do.
    pub const fn changes_pictures(self) -> bool {
        !matches!(self, Self::Build | Self::Accelerator)
    }

    /// Whether its rungs are different pictures of equal right, so that none is the more exact one: what the scene asks for is what
    /// the others are compared with.
    pub const fn is_a_matter_of_taste(self) -> bool {
        matches!(self, Self::PixelFilter)
    }

    /// Whether a render on one rung can have the random numbers of a render on another, so that they differ by the choice alone.
    pub const fn shares_random_numbers(self) -> bool {
        !matches!(self, Self::Samples | Self::LightSampling)
    }

    /// A scene reaches it when it calls for one of these; every scene does where the set is empty.
    pub const fn effects(self) -> EffectSet {
        match self {
            Self::RayOffset => EffectSet::of(&[
                Effect::Shadows,
                Effect::SoftShadows,
                Effect::MirrorReflection,
                Effect::Refraction,
                Effect::Transparency,
            ]),
            Self::Shadows => EffectSet::of(&[Effect::Shadows]),
            Self::LightSampling => EffectSet::of(&[Effect::SoftShadows, Effect::SkyLight]),
            Self::Fresnel | Self::Microfacets => EffectSet::of(&[Effect::PhysicalMaterials]),
            Self::TextureFilter => EffectSet::of(&[Effect::ImageTextures]),
            Self::PathLength => EffectSet::of(&[Effect::MirrorReflection, Effect::Refraction, Effect::Transparency]),
            _ => EffectSet::EMPTY,
        }
    }

    /// Name of the rung in use; a number of samples or segments need not be that of a rung.
    pub fn in_use(self, scene: &Scene, settings: &Settings) -> String {
        let mixed = || "mixed".to_owned();
        match self {
            Self::Precision => PRECISION[settings.precision as usize].name.to_owned(),
            Self::RayOffset => match scene.classic.spawn {
                SpawnRule::Constant(_) => "constant".to_owned(),
                SpawnRule::ErrorBound => "error-bound".to_owned(),
            },
            Self::Shadows => if settings.without.has(Effect::Shadows) { "off" } else { "on" }.to_owned(),
            Self::LightSampling => LIGHT_SAMPLING[settings.light_sampling as usize].name.to_owned(),
            Self::Fresnel => FRESNEL[settings.fresnel as usize].name.to_owned(),
            Self::Microfacets => MICROFACETS[settings.microfacets as usize].name.to_owned(),
            Self::TextureFilter => match scene.textures.first() {
                Some(first) if scene.textures.iter().any(|t| t.filter != first.filter) => mixed(),
                first => TEXTURE_FILTER[first.map_or(2, |t| place(&FILTERS, t.filter).unwrap_or(2))].name.to_owned(),
            },
            Self::PathLength if settings.max_depth == Settings::UNLIMITED => "unlimited".to_owned(),
            Self::PathLength => settings.max_depth.to_string(),
            Self::PixelFilter => {
                place(&PixelFilter::ALL, settings.filter).map_or_else(mixed, |i| PIXEL_FILTER[i].name.to_owned())
            }
            Self::Samples => settings.sampling.count().to_string(),
            Self::Build => match settings.accelerator {
                AcceleratorKind::Tree(quality) => build_rung(quality).to_owned(),
                _ => "none".to_owned(),
            },
            Self::Accelerator => match settings.accelerator {
                AcceleratorKind::Linear => "linear".to_owned(),
                AcceleratorKind::LinearBoxes => "linear-boxes".to_owned(),
                AcceleratorKind::Tree(_) => "bvh".to_owned(),
            },
        }
    }
}

fn place<T: PartialEq>(list: &[T], item: T) -> Option<usize> {
    list.iter().position(|known| *known == item)
}

/// How trees are built, by the name of a rung of [`Ladder::Build`]; none where it has no such rung.
pub fn build_quality(rung: &str) -> Option<BuildQuality> {
    BUILD.iter().position(|known| known.name == rung).map(|at| BuildQuality::ALL[at])
}

/// The rung of [`Ladder::Build`] that builds trees so.
pub fn build_rung(quality: BuildQuality) -> &'static str {
    place(&BuildQuality::ALL, quality).map_or("", |at| BUILD[at].name)
}

/// A rung of a ladder that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    ladder: Ladder,
    rung: &'static str,
}

/// Why a text names no rung.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct UnknownRung(String);

impl Choice {
    /// Reads `LADDER=RUNG`.
    ///
    /// # Errors
    /// What is wrong with the text, with the nearest word or all of them.
    pub fn parse(text: &str) -> Result<Self, UnknownRung> {
        let (ladder, rung) =
            text.split_once('=').ok_or_else(|| UnknownRung("expected LADDER=RUNG, such as precision=fast".to_owned()))?;
        let known: Vec<&str> = Ladder::ALL.iter().map(|ladder| ladder.name()).collect();
        let found = Ladder::ALL.into_iter().find(|known| known.name() == ladder);
        let ladder = found.ok_or_else(|| unknown("ladder", ladder, &known))?;
        let names: Vec<&'static str> = ladder.rungs().iter().map(|rung| rung.name).collect();
        let found = names.iter().find(|name| **name == rung);
        let rung = found.ok_or_else(|| unknown(&format!("rung of {}", ladder.name()), rung, &names))?;
        Ok(Self { ladder, rung })
    }

    /// The ladder.
    pub fn ladder(&self) -> Ladder {
        self.ladder
    }

    /// Name of the rung.
    pub fn rung(&self) -> &'static str {
        self.rung
    }

    /// Puts scene and settings on the rung.
    pub fn apply(&self, scene: &mut Scene, settings: &mut Settings) {
        // Names of rungs come from the ladder, so each is found and each number is one.
        let at = self.ladder.rungs().iter().position(|rung| rung.name == self.rung).unwrap_or_default();
        let number = || self.rung.parse().unwrap_or(1);
        match self.ladder {
            Ladder::Precision => {
                settings.precision = [PrecisionChoice::Fast, PrecisionChoice::Robust, PrecisionChoice::Reference][at];
            }
            Ladder::RayOffset => match (at, scene.classic.spawn) {
                (0, SpawnRule::ErrorBound) => scene.classic.spawn = SpawnRule::Constant(OFFSET),
                (0, SpawnRule::Constant(_)) => {}
                _ => scene.classic.spawn = SpawnRule::ErrorBound,
            },
            Ladder::Shadows => {
                let shadows = EffectSet::of(&[Effect::Shadows]);
                let others = settings.without.without(shadows);
                settings.without = if at == 0 { others.or(shadows) } else { others };
            }
            Ladder::LightSampling => {
                settings.light_sampling = [LightSampling::Scattering, LightSampling::Lights, LightSampling::Both][at];
            }
            Ladder::Fresnel => settings.fresnel = [FresnelRule::Schlick, FresnelRule::Model, FresnelRule::Exact][at],
            Ladder::Microfacets => settings.microfacets = [Microfacets::Single, Microfacets::Compensated][at],
            Ladder::TextureFilter => {
                let filter = FILTERS[at];
                scene.textures.iter_mut().for_each(|texture| texture.filter = filter);
            }
            Ladder::PathLength => settings.max_depth = number(),
            Ladder::PixelFilter => settings.filter = PixelFilter::ALL[at],
            Ladder::Samples => settings.sampling = Sampling::resolve(scene, Some(number())),
            Ladder::Build => settings.accelerator = AcceleratorKind::Tree(BuildQuality::ALL[at]),
            Ladder::Accelerator => match at {
                0 => settings.accelerator = AcceleratorKind::Linear,
                1 => settings.accelerator = AcceleratorKind::LinearBoxes,
                _ if matches!(settings.accelerator, AcceleratorKind::Tree(_)) => {}
                _ => settings.accelerator = AcceleratorKind::default(),
            },
        }
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.ladder.name(), self.rung)
    }
}

fn unknown(what: &str, name: &str, known: &[&str]) -> UnknownRung {
    let hint = match closest(name, known.iter().copied()) {
        Some(word) => format!("did you mean `{word}`?"),
        None => format!("known: {}", known.join(", ")),
    };
    UnknownRung(format!("there is no {what} `{name}`; {hint}"))
}

/// A ladder as one render stands on it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Standing {
    /// Name of the ladder.
    pub ladder: &'static str,
    /// Name of the rung in use.
    pub rung: String,
    /// The rung where nothing is said.
    pub default: &'static str,
    /// Whether the picture depends on it.
    pub changes_pictures: bool,
    /// All rungs, from fast to exact.
    pub rungs: &'static [Rung],
}

/// The ladders that a scene reaches: those whose effects it calls for.
pub fn reached(scene: &Scene, settings: &Settings, effects: &EffectReport) -> impl Iterator<Item = Ladder> + use<> {
    let present: EffectSet = effects.effects.iter().filter(|f| f.status != Status::Absent).map(|f| f.effect).collect();
    // Whitted ray tracing always asks, and meets nothing by chance; paths go on from every surface.
    let paths = chosen(scene, settings) == Integrator::Path;
    let is_fixed = settings.sampling.is_fixed();
    let called_for = move |ladder: Ladder| ladder.effects().is_empty() || !ladder.effects().and(present).is_empty();
    Ladder::ALL.into_iter().filter(move |&ladder| match ladder {
        Ladder::LightSampling | Ladder::Fresnel | Ladder::Microfacets => paths && called_for(ladder),
        Ladder::PathLength => paths || called_for(ladder),
        Ladder::PixelFilter => !is_fixed,
        _ => called_for(ladder),
    })
}

/// The ladders that a scene reaches, with the rungs in use.
pub fn standings(scene: &Scene, settings: &Settings, effects: &EffectReport) -> Vec<Standing> {
    let standing = |ladder: Ladder| Standing {
        ladder: ladder.name(),
        rung: ladder.in_use(scene, settings),
        default: ladder.default_rung(),
        changes_pictures: ladder.changes_pictures(),
        rungs: ladder.rungs(),
    };
    reached(scene, settings, effects).map(standing).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ColourSpace, Texture, Wrap};

    fn scene() -> Scene {
        let texture = |filter| Texture {
            name: String::new(),
            image: String::new(),
            colour_space: ColourSpace::Srgb,
            filter,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
        };
        Scene { textures: vec![texture(Filter::Bilinear), texture(Filter::Nearest)], ..Scene::default() }
    }

    /// Protects: choosing any rung of any ladder puts scene and settings onto it and onto no other ladder's rung, from
    /// wherever they stood; the default is a rung.
    #[test]
    fn a_chosen_rung_is_in_use() {
        for ladder in Ladder::ALL {
            assert!(ladder.rungs().iter().any(|rung| rung.name == ladder.default_rung()), "{ladder:?}");
            for before in ladder.rungs() {
                for after in ladder.rungs() {
                    let (mut scene, mut settings) = (scene(), Settings::of(&scene()));
                    for rung in [before, after] {
                        let choice = Choice::parse(&format!("{}={}", ladder.name(), rung.name)).expect("a rung");
                        choice.apply(&mut scene, &mut settings);
                        assert_eq!((ladder.in_use(&scene, &settings).as_str(), choice.ladder()), (rung.name, ladder));
                        assert_eq!(choice.to_string(), format!("{}={}", ladder.name(), rung.name));
                    }
                    for other in Ladder::ALL {
                        let tree = [Ladder::Build, Ladder::Accelerator];
                        if other != ladder && !(tree.contains(&other) && tree.contains(&ladder)) {
                            let own = other.in_use(&self::scene(), &Settings::of(&self::scene()));
                            assert_eq!(other.in_use(&scene, &settings), own, "{ladder:?} moved {other:?}");
                        }
                    }
                }
            }
        }
    }

    /// Protects: a scene's own constant offset stays when the constant rung is asked for.
    #[test]
    fn the_own_constant_stays() {
        let own = SpawnRule::Constant(ConstantOffset { offset: 0.25, ..OFFSET });
        let mut scene = scene();
        scene.classic.spawn = own;
        let mut settings = Settings::of(&scene);
        Choice::parse("ray-offset=constant").expect("a rung").apply(&mut scene, &mut settings);
        assert_eq!(scene.classic.spawn, own);
    }

    /// Protects: a path tracer goes on from every surface, so that its paths have a length to choose; without mirrors Whitted's have none.
    #[test]
    fn paths_have_a_length_to_choose() {
        let reached_by = |integrator| {
            let (scene, settings) = (scene(), Settings { integrator, ..Settings::of(&scene()) });
            let effects = crate::effects::detect(&scene, &settings);
            reached(&scene, &settings, &effects).any(|ladder| ladder == Ladder::PathLength)
        };
        assert_eq!([Integrator::Path, Integrator::Whitted].map(reached_by), [true, false]);
    }

    /// Protects: what is no rung is refused with the nearest word, or with all of them.
    #[test]
    fn mistakes_are_explained() {
        let said = |text| Choice::parse(text).expect_err("no rung").to_string();
        assert_eq!(said("precision"), "expected LADDER=RUNG, such as precision=fast");
        assert_eq!(said("precison=fast"), "there is no ladder `precison`; did you mean `precision`?");
        assert_eq!(said("precision=exact"), "there is no rung of precision `exact`; known: fast, robust, reference");
        assert!(said("colour=red").contains("known: precision, ray-offset"));
    }
}
