//! What facets lose that meet light once: the share that a rough white surface sends back, tabulated, so that the rest can be given
//! back ("Practical multiple scattering compensation for microfacet models", Turquin 2019).

use std::sync::LazyLock;

use glam::DVec3;

use super::fresnel::towards_grazing;
use super::lobe::{on_disk, smith, visible_facet};
use crate::number::{Number, Vector3};

/// Roughnesses and cosines of the table.
const STEPS: usize = 32;
/// Points of the disk by which an entry is summed: outwards, and around.
const OUTWARDS: usize = 40;
const AROUND: usize = 16;

/// Share that facets of reflectance one send back, by the cosine of view and the perceptual roughness. Cosines go by their root, because
/// it falls fast towards grazing.
static SENT_BACK: LazyLock<Vec<f32>> = LazyLock::new(|| table(|_| 1.0));

/// The same of facets that reflect nothing at normal incidence and all at grazing incidence, by Schlick.
static SENT_BACK_GRAZING: LazyLock<Vec<f32>> = LazyLock::new(|| table(towards_grazing));

fn table(reflectance: fn(f64) -> f64) -> Vec<f32> {
    let share = |i: usize| i as f64 / (STEPS - 1) as f64;
    let entry = |i: usize| {
        let cosine = (share(i % STEPS) * share(i % STEPS)).max(1e-4);
        single_scattering(cosine, share(i / STEPS), reflectance) as f32
    };
    (0..STEPS * STEPS).map(entry).collect()
}

/// The directional albedo of GGX facets of a reflectance by the cosine of incidence: the mean of its product with G₂/G₁ over the facets that
/// are seen, by the midpoint rule over their probability, finer towards those that lie flattest against the view, where much of the loss is.
fn single_scattering(cosine: f64, roughness: f64, reflectance: fn(f64) -> f64) -> f64 {
    let alpha = roughness.max(super::lobe::LEAST_ROUGHNESS).powi(2);
    let (a2, wo) = (alpha * alpha, DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine));
    let sent = |k: usize| {
        let rest = 1.0 - ((k / AROUND) as f64 + 0.5) / OUTWARDS as f64;
        let facet =
            visible_facet::<f64>(wo, [alpha; 2], on_disk([1.0 - rest.powi(3), ((k % AROUND) as f64 + 0.5) / AROUND as f64]));
        let cell = 3.0 * rest * rest / (OUTWARDS * AROUND) as f64;
        let into = (facet * (2.0 * wo.dot(facet)) - wo).z;
        if into <= 0.0 {
            return 0.0;
        }
        let (own, other) = (smith(a2, cosine), smith(a2, into));
        reflectance(wo.dot(facet)) * (cell * (cosine + own) * into / (cosine * other + into * own))
    };
    (0..OUTWARDS * AROUND).map(sent).sum()
}

/// What a table has for a cosine and a roughness.
#[inline]
fn looked_up(table: &[f32], cosine: f64, roughness: f64) -> f64 {
    let at = |x: f64| {
        // Also zero for what is no number.
        let x = if x > 0.0 { x.min(1.0) } else { 0.0 } * (STEPS - 1) as f64;
        let below = (x as usize).min(STEPS - 2);
        (below, x - below as f64)
    };
    let ((i, u), (j, v)) = (at(cosine.max(0.0).sqrt()), at(roughness));
    let row = |j: usize| {
        let [a, b] = [table[j * STEPS + i], table[j * STEPS + i + 1]].map(f64::from);
        a + (b - a) * u
    };
    row(j) + (row(j + 1) - row(j)) * v
}

/// What a rough surface's reflectances are multiplied by so that white ones send back all: 1 + f0·(1/E − 1) of the share E that
/// facets send back at once.
#[inline]
pub(super) fn given_back<N: Number>(f0: N::Vec3, roughness: N, cosine: N) -> N::Vec3 {
    let table = &*SENT_BACK;
    let lost = N::of_lanes(|lane| {
        let sent = looked_up(table, cosine.lane(lane), roughness.lane(lane));
        1.0 / sent.clamp(0.05, 1.0) - 1.0
    });
    N::Vec3::ONE + f0 * lost
}

/// Share that facets send back whose reflectance goes by Schlick from `f0` at normal incidence to one.
pub(super) fn sent_back(f0: f64, roughness: f64, cosine: f64) -> f64 {
    let [all, grazing] = [&*SENT_BACK, &*SENT_BACK_GRAZING].map(|table| looked_up(table, cosine, roughness));
    (f0 * all + (1.0 - f0) * grazing).clamp(0.0, 1.0)
}
