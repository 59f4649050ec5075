//! Directional albedos of rough facets, tabulated: what facets send back at once, so that what lies below gets the rest and no more, and
//! what they send to each other comes back.
//!
//! With E(o) the share of light that is sent back towards o, and Ē its mean by the cosine, (1 − E(o))·(1 − E(i))/(π·(1 − Ē)) sends back
//! 1 − E(o) in all ("A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling", Kelemen, Szirmay-Kalos 2001; "Revisiting
//! Physically Based Shading at Imageworks", Kulla, Conty 2017). It is the same both ways, and keeps exactly what E leaves. Both
//! uses of it here are one formula: the base below a layer, whose E is the layer's, and the facets' own interreflection, whose E is that
//! of white ones. Refused for the base: glTF's 1 − F(h·l), by which white plastic sends back 1.89 times what it gets at 89.5°;
//! 1 − E(o) alone (Cycles, OpenPBR), which keeps as much but is not the same both ways; min(1 − E(o), 1 − E(i)), the rule of covers,
//! which is never too much either but loses 5 % head-on.

use std::sync::LazyLock;

use glam::DVec3;

use super::fresnel::towards_grazing;
use super::lobe::{LEAST_ROUGHNESS, on_disk, smith, visible_facet};
use crate::number::{Mask, Number, Vector3};

/// Roughnesses and cosines of the table.
const STEPS: usize = 32;
/// Points of the disk by which an entry is summed: outwards, and around one half, since the other one is alike.
const OUTWARDS: usize = 40;
const AROUND: usize = 8;
/// Mean over the hemisphere, by the cosine, of Schlick's way towards grazing incidence: 2·∫(1 − c)⁵·c dc.
const MEAN_GRAZING: f64 = 1.0 / 21.0;

/// What white facets lose that meet light once, and what those send back that reflect nothing at normal incidence and all at grazing
/// incidence, by Schlick.
type Entry = [f32; 2];

/// Entries by the perceptual roughness and the cosine of view, and their means over the hemisphere by the roughness. Roughnesses go by their
/// root and cosines by their fourth one, because albedos fall fast towards grazing where facets are next to smooth. With even steps of
/// roughness and roots of cosines, what is interpolated was up to .010 off at cosines from .02 on; so it is up to .004.
struct Table {
    entries: Vec<Entry>,
    means: Vec<Entry>,
}

static TABLE: LazyLock<Table> = LazyLock::new(Table::new);

/// Makes the table, if that has not been done: before a clock runs.
pub(super) fn prepare() {
    LazyLock::force(&TABLE);
}

impl Table {
    fn new() -> Self {
        let share = |i: usize| i as f64 / (STEPS - 1) as f64;
        let entry = |i: usize| {
            let [cosine, roughness] = [share(i % STEPS).powi(4).max(1e-4), share(i / STEPS).powi(2)];
            let [all, grazing] = single_scattering(cosine, roughness);
            [(1.0 - all).max(0.0) as f32, grazing as f32]
        };
        let entries: Vec<Entry> = (0..STEPS * STEPS).map(entry).collect();
        let means = entries.chunks(STEPS).map(mean).collect();
        Self { entries, means }
    }
}

/// The mean over the hemisphere of what is interpolated between a row's entries: 8·∫E·s⁷ ds by the fourth root s of the cosine, in closed form
/// over each step, so that what is looked up and its mean are one function's.
fn mean(row: &[Entry]) -> Entry {
    let step = 1.0 / (STEPS - 1) as f64;
    let mut sum = [0.0; 2];
    for (i, pair) in row.windows(2).enumerate() {
        let (a, b) = (i as f64 * step, (i + 1) as f64 * step);
        let (even, rising) = (b.powi(8) - a.powi(8), 8.0 / 9.0 * (b.powi(9) - a.powi(9)));
        for (k, sum) in sum.iter_mut().enumerate() {
            let (from, to) = (f64::from(pair[0][k]), f64::from(pair[1][k]));
            let slope = (to - from) / step;
            *sum += (from - slope * a) * even + slope * rising;
        }
    }
    sum.map(|x| x as f32)
}

/// The directional albedo of GGX facets of reflectance one, and of one that goes from none to all by Schlick, by the cosine of incidence:
/// the mean of its product with G₂/G₁ over the facets that are seen, by the midpoint rule over their probability, finer towards those
/// that lie flattest against the view, where much of the loss is.
fn single_scattering(cosine: f64, roughness: f64) -> [f64; 2] {
    let alpha = roughness.max(LEAST_ROUGHNESS).powi(2);
    let (a2, wo) = (alpha * alpha, DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine));
    let (own, mut sum) = (smith(a2, cosine), [0.0; 2]);
    for k in 0..OUTWARDS * AROUND {
        let rest = 1.0 - ((k / AROUND) as f64 + 0.5) / OUTWARDS as f64;
        let turn = 0.25 + 0.5 * ((k % AROUND) as f64 + 0.5) / AROUND as f64;
        let facet = visible_facet::<f64>(wo, [alpha; 2], on_disk([1.0 - rest.powi(3), turn]));
        let into = (facet * (2.0 * wo.dot(facet)) - wo).z;
        if into > 0.0 {
            let cell = 3.0 * rest * rest / (OUTWARDS * AROUND) as f64;
            let sent = cell * (cosine + own) * into / (cosine * smith(a2, into) + into * own);
            sum = [sum[0] + sent, sum[1] + sent * towards_grazing(wo.dot(facet))];
        }
    }
    sum
}

/// Between which steps a share lies, and how far.
#[inline(always)]
fn between(x: f64) -> (usize, f64) {
    // Also zero for what is no number.
    let x = if x > 0.0 { x.min(1.0) } else { 0.0 } * (STEPS - 1) as f64;
    let below = (x as usize).min(STEPS - 2);
    (below, x - below as f64)
}

#[inline(always)]
fn mix(a: [f64; 2], b: [f64; 2], share: f64) -> [f64; 2] {
    [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share]
}

/// What the table has for a cosine and a roughness; of what is next to smooth, what a mirror does.
#[inline(always)]
fn looked_up(table: &Table, cosine: f64, roughness: f64) -> [f64; 2] {
    if roughness <= LEAST_ROUGHNESS {
        return [0.0, towards_grazing(cosine.max(0.0))];
    }
    let ((i, u), (j, v)) = (between(cosine.max(0.0).sqrt().sqrt()), between(roughness.sqrt()));
    let row = |j: usize| {
        let pair = &table.entries[j * STEPS + i..j * STEPS + i + 2];
        mix(pair[0].map(f64::from), pair[1].map(f64::from), u)
    };
    mix(row(j), row(j + 1), v)
}

#[inline(always)]
fn mean_looked_up(table: &Table, roughness: f64) -> [f64; 2] {
    if roughness <= LEAST_ROUGHNESS {
        return [0.0, MEAN_GRAZING];
    }
    let (j, v) = between(roughness.sqrt());
    mix(table.means[j].map(f64::from), table.means[j + 1].map(f64::from), v)
}

/// Share of Schlick's mean weight by which that of facets is spread about it.
const SPREAD: f64 = 0.35;

/// What white facets lose, and what those send back that reflect all at grazing incidence alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Albedo<N: Number> {
    pub lost: N,
    pub grazing: N,
}

impl<N: Number> Albedo<N> {
    #[inline(always)]
    fn of(entry: impl Fn(usize) -> [f64; 2]) -> Self {
        let both = <N::Vec3 as Vector3<N>>::of_lanes(|lane| {
            let [lost, grazing] = entry(lane);
            DVec3::new(lost, grazing, 0.0)
        });
        Self { lost: both.x(), grazing: both.y() }
    }

    /// Towards a direction, by its cosine.
    #[inline(always)]
    pub fn towards(cosine: N, roughness: N) -> Self {
        let table = &*TABLE;
        Self::of(|lane| looked_up(table, cosine.lane(lane), roughness.lane(lane)))
    }

    /// In the mean over the hemisphere, by the cosine.
    #[inline(always)]
    pub fn mean(roughness: N) -> Self {
        let table = &*TABLE;
        Self::of(|lane| mean_looked_up(table, roughness.lane(lane)))
    }

    /// Share that facets send back whose reflectance at a cosine is said: that at the cosine whose Schlick's weight is the mean of what they
    /// show. Exact for mirrors and for Schlick's formula; Fresnel's, which rises less than in proportion to it, sends back less.
    pub fn sent_by(&self, reflectance: impl Fn(N) -> N) -> N {
        let sent = N::ONE - self.lost;
        // Schlick's weight in the mean, and to both sides of it as far as facets spread it.
        let of = |way: f64| {
            let cosine = N::of_lanes(|lane| {
                let weight = (self.grazing.lane(lane) / sent.lane(lane).max(1e-6)).clamp(0.0, 1.0);
                let spread = (SPREAD * weight).min(1.0 - weight);
                1.0 - libm::pow(weight + way * spread, 0.2)
            });
            reflectance(cosine)
        };
        let half = N::from_f64(0.5);
        sent * of(0.0).max((of(-1.0) + of(1.0)) * half)
    }

    /// Share that facets send back which reflect `f0` at normal and `f90` at grazing incidence.
    #[inline(always)]
    pub fn sent(&self, f0: N, f90: N) -> N {
        f0 * (N::ONE - self.lost) + (f90 - f0) * self.grazing
    }
}

/// Share that facets send back whose reflectance goes by Schlick from `f0` at normal incidence to one.
pub(super) fn sent_back(f0: f64, roughness: f64, cosine: f64) -> f64 {
    Albedo::<f64>::towards(cosine, roughness).sent(f0, 1.0).clamp(0.0, 1.0)
}

/// Factor of what white facets send to each other, of ones that reflect f0 at normal and f90 at grazing incidence, and of which white ones
/// lose a share in the mean: F̄²·Ē/(1 − F̄·(1 − Ē)) by the mean reflectance F̄ (Kulla, Conty 2017).
#[inline(always)]
pub(super) fn interreflected<N: Number>(f0: N::Vec3, f90: N, lost: N) -> N::Vec3 {
    let part = |f0: N| interreflected_of(f0, f90, lost);
    N::Vec3::new(part(f0.x()), part(f0.y()), part(f0.z()))
}

/// The same of one reflectance.
#[inline(always)]
pub(super) fn interreflected_of<N: Number>(f0: N, f90: N, lost: N) -> N {
    let mean = f0 + (f90 - f0) * N::from_f64(MEAN_GRAZING);
    mean * mean * (N::ONE - lost) / (N::ONE - mean * lost)
}

/// The mean over the hemisphere, by the cosine, of what is said of cosines: Gauss's rule by their squares.
pub(super) fn mean_of<N: Number>(of: impl Fn(N) -> N) -> N {
    const RULE: [[f64; 2]; 4] = [
        [0.069_431_844_202_973_7, 0.173_927_422_568_726_9],
        [0.330_009_478_207_571_9, 0.326_072_577_431_273_1],
        [0.669_990_521_792_428_1, 0.326_072_577_431_273_1],
        [0.930_568_155_797_026_3, 0.173_927_422_568_726_9],
    ];
    RULE.iter().fold(N::ZERO, |sum, [square, weight]| sum + of(N::from_f64(square.sqrt())) * N::from_f64(*weight))
}

/// What a layer of facets leaves to a base below it, and what white ones leave to each other, seen from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remainder<N: Number> {
    /// Reflectance of the layer at normal and at grazing incidence, and its factor of what white facets send to each other.
    layer: [N; 3],
    /// Perceptual roughness.
    pub(super) roughness: N,
    /// What is left towards the view, over what is in the mean: of the layer, and of white facets.
    pub(super) seen: [N; 2],
    /// What is left towards the view: what a white base sends there of even light, and white facets of what they send to each other. What the
    /// choice among lobes goes by.
    pub(super) shown: [N; 2],
}

/// Least mean that is told from none.
const LEAST_MEAN: f64 = 1e-6;

impl<N: Number> Remainder<N> {
    /// Of a layer of such reflectances, not yet seen from anywhere.
    #[inline(always)]
    pub(super) fn new(layer: [N; 3], roughness: N) -> Self {
        Self { layer, roughness, seen: [N::ONE; 2], shown: [N::ONE; 2] }
    }

    /// Seen from a direction with this left to it and that in the mean.
    #[inline(always)]
    pub(super) fn seen(self, left: [N; 2], mean: [N; 2]) -> Self {
        let over = |k: usize| left[k] / mean[k].max(N::from_f64(LEAST_MEAN));
        Self { seen: [over(0), over(1)], shown: left, ..self }
    }

    /// Seen at a cosine.
    #[inline(always)]
    pub(super) fn seen_at(self, cosine: N, mean: Albedo<N>) -> Self {
        self.seen(self.left(Albedo::towards(cosine, self.roughness)), self.left(mean))
    }

    /// What is left of light: by the layer, and by white facets.
    #[inline(always)]
    pub(super) fn left(&self, albedo: Albedo<N>) -> [N; 2] {
        self.left_of(albedo.sent(self.layer[0], self.layer[1]), albedo.lost)
    }

    /// The same of a layer that sends back a share at once.
    #[inline(always)]
    pub(super) fn left_of(&self, sent: N, lost: N) -> [N; 2] {
        [(N::ONE - (sent + self.layer[2] * lost)).max(N::ZERO), lost]
    }

    /// Whether there is a layer.
    #[inline(always)]
    pub(super) fn is_covered(&self) -> bool {
        self.layer[0].max(self.layer[1]).max(self.layer[2]).above(N::ZERO).any()
    }

    /// Factors of 1/π for light from a direction: of what a white base sends back, and of what white facets send to each other.
    #[inline(always)]
    pub(super) fn towards(&self, cosine: N) -> [N; 2] {
        let left = self.left(Albedo::towards(cosine, self.roughness));
        [left[0] * self.seen[0], left[1] * self.seen[1]]
    }
}
