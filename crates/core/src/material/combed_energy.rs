//! What combed facets lose that meet light once, as [`super::energy`] has it for even ones: the share that white facets send back depends on
//! the view's azimuth too, and on how rough they are either way. Tabulated over the four, so that the rest can be given back.

use std::sync::LazyLock;

use glam::DVec3;

use super::lobe::{LEAST_ROUGHNESS, on_disk, visible_facet};
use crate::number::{Number, Vector3};

/// Entries by the root of the cosine of the view, by how far it looks along the rough way, by roughness, and by strength.
const STEPS: [usize; 4] = [14, 6, 8, 8];
/// Points of the disk by which an entry is summed: outwards, and around.
const OUTWARDS: usize = 20;
const AROUND: usize = 20;

static SENT_BACK: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let [heights, azimuths, roughnesses, strengths] = STEPS;
    let share = |i: usize, steps: usize| i as f64 / (steps - 1) as f64;
    let mut entries = Vec::with_capacity(heights * azimuths * roughnesses * strengths);
    for strength in 0..strengths {
        for roughness in 0..roughnesses {
            let alpha = alphas(share(roughness, roughnesses), share(strength, strengths));
            for azimuth in 0..azimuths {
                for height in 0..heights {
                    let cosine = share(height, heights).powi(2).max(1e-4);
                    entries.push(single_scattering(cosine, share(azimuth, azimuths), alpha) as f32);
                }
            }
        }
    }
    entries
});

/// Makes the table, before many ask for it at once.
pub(crate) fn prepare() {
    LazyLock::force(&SENT_BACK);
}

/// α along the tangent and along the bitangent (KHR_materials_anisotropy).
fn alphas(roughness: f64, strength: f64) -> [f64; 2] {
    let alpha = roughness.max(LEAST_ROUGHNESS).powi(2);
    [alpha + (1.0 - alpha) * strength * strength, alpha]
}

/// The directional albedo of white facets: the mean of G₂/G₁ over those that are seen, by the midpoint rule over their probability. `along`:
/// cosine of the azimuth to the tangent.
fn single_scattering(cosine: f64, along: f64, alpha: [f64; 2]) -> f64 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let wo = DVec3::new(sine * along, sine * (1.0 - along * along).max(0.0).sqrt(), cosine);
    let stretched = |v: DVec3| ((alpha[0] * v.x).powi(2) + (alpha[1] * v.y).powi(2) + v.z * v.z).sqrt();
    let sent = |k: usize| {
        let rest = 1.0 - ((k / AROUND) as f64 + 0.5) / OUTWARDS as f64;
        let point = [1.0 - rest.powi(3), ((k % AROUND) as f64 + 0.5) / AROUND as f64];
        let facet = visible_facet::<f64>(wo, alpha, on_disk(point));
        let cell = 3.0 * rest * rest / (OUTWARDS * AROUND) as f64;
        let into = facet * (2.0 * wo.dot(facet)) - wo;
        if into.z <= 0.0 {
            return 0.0;
        }
        let (own, other) = (stretched(wo), stretched(into));
        cell * (cosine + own) * into.z / (cosine * other + into.z * own)
    };
    (0..OUTWARDS * AROUND).map(sent).sum()
}

/// What the table has between its entries.
fn looked_up(at: [f64; 4]) -> f64 {
    let table = &*SENT_BACK;
    let places: [(usize, f64); 4] = core::array::from_fn(|k| {
        // Also zero for what is no number.
        let x = if at[k] > 0.0 { at[k].min(1.0) } else { 0.0 } * (STEPS[k] - 1) as f64;
        let below = (x as usize).min(STEPS[k] - 2);
        (below, x - below as f64)
    });
    (0..16_usize)
        .map(|corner| {
            let (mut index, mut weight) = (0, 1.0);
            for k in (0..4).rev() {
                let ((below, share), above) = (places[k], corner >> k & 1);
                index = index * STEPS[k] + below + above;
                weight *= if above == 1 { share } else { 1.0 - share };
            }
            weight * f64::from(table[index])
        })
        .sum()
}

/// What a combed surface's reflectances are multiplied by so that white ones send back all, seen along a direction in its frame.
pub(super) fn given_back<N: Number>(f0: N::Vec3, wo: N::Vec3, roughness: N, strength: N) -> N::Vec3 {
    let lost = N::of_lanes(|lane| {
        let o: DVec3 = wo.lane(lane);
        let across = (o.x * o.x + o.y * o.y).sqrt();
        let along = if across > 0.0 { o.x.abs() / across } else { 0.0 };
        let sent = looked_up([o.z.max(0.0).sqrt(), along, roughness.lane(lane), strength.lane(lane)]);
        1.0 / sent.clamp(0.05, 1.0) - 1.0
    });
    N::Vec3::ONE + f0 * lost
}
