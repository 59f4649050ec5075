//! Comparison of two renders that should be equal: scenes that differ in nothing visible, and the
//! distance of their pictures.

use core::fmt;

use glam::DVec3;
use raywright::bvh::stability::verdicts::CaseRng;
use raywright::core::picture::Picture;
use raywright::core::scene::{Object, SamplePattern, Scene, Shape};
use raywright::core::settings::{Aov, PrecisionChoice, Sampling};
use raywright::core::{Settings, prepare};

use super::retold::retold;
use super::worlds::{WorldContents, WorldLayout, world};

/// Width and height of a picture, whose mirrored columns have exactly opposite coordinates.
pub const SIZE: [u32; 2] = [64, 48];

/// Accepted difference of two pictures.
#[derive(Clone, Copy, Debug)]
struct DistanceBound {
    /// Largest tolerated difference of a pixel, in any unit of the picture.
    tolerance: f32,
    /// Share of the pixels that may differ by more.
    share: f64,
}

impl DistanceBound {
    /// Equality in every bit.
    const EXACT: Self = Self {
        tolerance: 0.0,
        share: 0.0,
    };
    /// Agreement except where rounding decides: at the edges of shadows and of reflections.
    const ROUNDED: Self = Self {
        tolerance: 1e-3,
        share: 0.02,
    };
}

/// A change of a scene's description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// Every length times a power of two.
    Scaled,
    /// A distant position, and one farther by a power of two.
    Moved,
    /// Objects in another order, with emitters in their own order.
    Reordered,
    /// Triangles of meshes in another order.
    Shuffled,
    /// Meshes divided into two objects.
    Split,
    /// A mesh of its own for each object that shared a mesh.
    Copied,
    /// Left and right exchanged.
    Mirrored,
    /// Axes permuted cyclically.
    Turned,
}

impl Symmetry {
    /// All symmetries.
    pub const ALL: [Self; 8] = [
        Self::Scaled,
        Self::Moved,
        Self::Reordered,
        Self::Shuffled,
        Self::Split,
        Self::Copied,
        Self::Mirrored,
        Self::Turned,
    ];

    /// Symmetries that apply to any scene, not only to a generated one.
    pub const OF_ANY: [Self; 4] = [Self::Reordered, Self::Shuffled, Self::Split, Self::Copied];

    /// Accepted difference for a scene. With exchanged axes products are summed in another order.
    /// Rays are transformed to the space of a shared mesh, whereas an unshared mesh is transformed
    /// to world space and then rounded; without a transform both agree.
    fn bound(self, scene: &Scene) -> DistanceBound {
        let is_moved = |object: &Object| {
            matches!(object.shape, Shape::Mesh(_)) && !object.transform.is_empty()
        };
        match self {
            Self::Mirrored | Self::Turned => DistanceBound::ROUNDED,
            Self::Split | Self::Copied if scene.objects.iter().any(is_moved) => {
                DistanceBound::ROUNDED
            }
            _ => DistanceBound::EXACT,
        }
    }

    /// Whether the symmetry moves pixels or changes the random samples of light: then only the
    /// centre of each pixel is compared.
    fn turns(self) -> bool {
        matches!(self, Self::Mirrored | Self::Turned)
    }

    /// A generated scene in two descriptions.
    fn of_world(self, seed: u64) -> [TwinScene; 2] {
        let rng = &mut CaseRng::new(seed, 2);
        let contents = if self.turns() {
            WorldContents::Turnable
        } else {
            WorldContents::All
        };
        // From a millionth to a thousand million metres.
        let unit = 2.0_f64.powi(rng.next_uniform(-20.0, 30.0) as i32);
        let own = WorldLayout {
            unit,
            ..WorldLayout::default()
        };
        let shown = |layout: WorldLayout| TwinScene {
            unit: layout.unit,
            flipped: layout.signs.x < 0.0,
            ..TwinScene::of(world(seed, contents, &layout))
        };
        let other = match self {
            Self::Scaled => WorldLayout {
                unit: unit * 2.0_f64.powi(rng.choose(&[-7, -2, 3, 10])),
                ..own
            },
            Self::Mirrored => WorldLayout {
                signs: DVec3::new(-1.0, 1.0, 1.0),
                ..own
            },
            Self::Turned => WorldLayout {
                axes: rng.choose(&[[1, 2, 0], [2, 0, 1]]),
                ..own
            },
            Self::Moved => {
                let far = unit * DVec3::new(rng.choose(&[-1.0, 1.0]) * 65536.0, 0.0, 131_072.0);
                let by = unit * DVec3::new(rng.choose(&[-1.0, 1.0]) * 1_048_576.0, 0.0, 524_288.0);
                return [
                    shown(WorldLayout { offset: far, ..own }),
                    shown(WorldLayout {
                        offset: far + by,
                        ..own
                    }),
                ];
            }
            _ => {
                let scene = world(seed, contents, &own);
                return [
                    TwinScene::of(scene.clone()),
                    TwinScene::of(retold(self, scene, seed)),
                ];
            }
        };
        [shown(own), shown(other)]
    }
}

/// A scene with the interpretation of its picture.
struct TwinScene {
    scene: Scene,
    /// Unit of depths in metres.
    unit: f64,
    /// Whether columns are reversed.
    flipped: bool,
}

impl TwinScene {
    fn of(scene: Scene) -> Self {
        Self {
            scene,
            unit: 1.0,
            flipped: false,
        }
    }
}

/// Distance of two pictures.
#[derive(Clone, Debug)]
pub struct PictureDistance {
    /// Description of the comparison.
    pub label: String,
    /// Share of the pixels that differ by more than the tolerance.
    pub share: f64,
    /// The largest difference.
    pub worst: f32,
    /// First pixel that differs, with its channels in both pictures.
    pub first: Option<String>,
    /// Whether the difference is accepted.
    pub holds: bool,
}

impl fmt::Display for PictureDistance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let first = self.first.as_deref().unwrap_or("nowhere");
        write!(
            f,
            "{}: {:.2} % of the pixels are apart, by up to {:e}; {first}",
            self.label,
            100.0 * self.share,
            self.worst
        )
    }
}

fn picture(shown: &TwinScene, symmetry: Symmetry, precision: PrecisionChoice) -> Picture {
    let scene = &shown.scene;
    let few = scene.render.pattern.is_none().then_some(2);
    let sampling = if symmetry.turns() {
        Sampling::Pattern(SamplePattern::Centre)
    } else {
        Sampling::from_spp(scene, few)
    };
    let aovs = vec![Aov::Depth, Aov::Albedo];
    let settings = Settings {
        size: SIZE,
        precision,
        aovs,
        sampling,
        max_depth: 5,
        ..Settings::from_scene(scene)
    };
    prepare(scene, &settings, &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture
}

/// All channels of a pixel, with depths in the scene's unit.
fn channels(picture: &Picture, shown: &TwinScene, at: usize) -> Vec<f32> {
    let [width, column] = [picture.width as usize, at % picture.width as usize];
    let at = if shown.flipped {
        at - column + (width - 1 - column)
    } else {
        at
    };
    let layer = |layer: &raywright::core::picture::PictureLayer| {
        // −1 without a hit.
        let is_depth = layer.name == "depth.Z" && layer.samples[at] > 0.0;
        if is_depth {
            (f64::from(layer.samples[at]) / shown.unit) as f32
        } else {
            layer.samples[at]
        }
    };
    picture.rgb[at]
        .into_iter()
        .chain(picture.layers.iter().map(layer))
        .collect()
}

/// Compares the pictures of two descriptions of a scene.
fn compare(
    label: String,
    symmetry: Symmetry,
    [a, b]: &[TwinScene; 2],
    precision: PrecisionChoice,
) -> PictureDistance {
    let (pictures, bound) = (
        [
            picture(a, symmetry, precision),
            picture(b, symmetry, precision),
        ],
        symmetry.bound(&a.scene),
    );
    // Random samples of light differ along other axes; samples of distant lights also depend on the
    // scene's bounds, which are looser around shared meshes. In these cases only hits are compared.
    let is_drawn = bound.share > 0.0 && a.scene.render.pattern.is_none();
    let (mut count, mut worst, mut first) = (0, 0.0_f32, None);
    for at in 0..pictures[0].rgb.len() {
        let [one, other] = [channels(&pictures[0], a, at), channels(&pictures[1], b, at)];
        let skipped = if is_drawn { 3 } else { 0 };
        let off = one.iter().zip(&other).skip(skipped).map(|(x, y)| {
            if x.to_bits() == y.to_bits() {
                0.0
            } else {
                (x - y).abs().max(f32::MIN_POSITIVE)
            }
        });
        let off = off.fold(0.0, |maximum, off| {
            if off > maximum || off.is_nan() {
                off
            } else {
                maximum
            }
        });
        let is_apart = off > bound.tolerance || off.is_nan();
        worst = worst.max(off);
        if is_apart {
            count += 1;
            first.get_or_insert_with(|| format!("pixel {at}: {one:?} and {other:?}"));
        }
    }
    let share = f64::from(count) / pictures[0].rgb.len() as f64;
    let is_sound = pictures
        .iter()
        .all(|picture| picture.rgb.iter().flatten().all(|x| x.is_finite()));
    PictureDistance {
        label,
        share,
        worst,
        first,
        holds: is_sound && share <= bound.share,
    }
}

/// Compares a random scene, given by a seed.
pub fn of_world(symmetry: Symmetry, seed: u64, precision: PrecisionChoice) -> PictureDistance {
    compare(
        format!("{symmetry:?}, {precision:?}, seed {seed}"),
        symmetry,
        &symmetry.of_world(seed),
        precision,
    )
}

/// Compares any scene.
pub fn of_scene(
    name: &str,
    scene: &Scene,
    symmetry: Symmetry,
    seed: u64,
    precision: PrecisionChoice,
) -> PictureDistance {
    let other = retold(symmetry, scene.clone(), seed);
    compare(
        format!("{symmetry:?}, {precision:?}, {name}, seed {seed}"),
        symmetry,
        &[scene.clone(), other].map(TwinScene::of),
        precision,
    )
}
