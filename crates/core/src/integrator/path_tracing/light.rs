//! Light sampling at vertices, and the weights of multiple importance sampling.

use core::array::from_fn;

use raywright_bvh::{Real, Vector};

use super::PathTracer;
use super::vertices::{LitSides, MisStrategy, VertexLanes, WavefrontSlice};
use crate::light::{
    ChosenLight, LANES, LightDensity, LightId, LightSampleLanes, LightSamplerQuery,
    ShadowRayTargetKind, get_lane_vector,
};
use crate::settings::LightSampling;

/// Returns the weight of a sampling technique by the power heuristic, own²/(own² + other²) (Veach,
/// Guibas 1995). `own` and `other` are the densities of this technique and of the alternative. The
/// ratio is squared, not each density: no square overflows.
#[inline(always)]
pub(super) fn power_heuristic(own: f64, other: f64) -> f64 {
    if own == other {
        return 0.5;
    }
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

/// The lights chosen for vertices, and their samples. Kept from batch to batch to reuse the memory
/// of the lists.
#[derive(Default)]
pub(super) struct SampledLights<R: Real> {
    chosen_lights: Vec<Option<ChosenLight<R>>>,
    lights: Vec<LightSampleLanes<R>>,
}

impl<R: Real> SampledLights<R> {
    /// Iterates over the chosen lights and their samples in batches of [`LANES`] vertices.
    pub fn batches(
        &self,
    ) -> impl Iterator<Item = (&[Option<ChosenLight<R>>], &LightSampleLanes<R>)> {
        self.chosen_lights.chunks(LANES).zip(&self.lights)
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Chooses and samples a light for each vertex, and sets the vertex's [`MisStrategy`].
    pub(super) fn sample_lights(
        &self,
        slice: &WavefrontSlice<'_, R>,
        vertices: &mut [VertexLanes<R>],
        SampledLights {
            chosen_lights,
            lights,
        }: &mut SampledLights<R>,
    ) {
        chosen_lights.clear();
        for vertices in &*vertices {
            let numbers = |lane: usize| {
                slice
                    .path_and_interaction(vertices.hit_indices[lane])
                    .0
                    .samples
                    .light
            };
            let point = |lane: usize| vertices.surface.get_lane(lane).point;
            let drawn = self
                .scene
                .lights
                .light_sampler()
                .sample_many::<R, LANES>(from_fn(|lane| {
                    let normal = match vertices.sides[lane] {
                        LitSides::None => return None,
                        LitSides::One => get_lane_vector::<R>(&vertices.normal, lane),
                        LitSides::Both => Vector::ZERO,
                    };
                    let [coarse, fine, ..] = if lane < vertices.len {
                        numbers(lane)
                    } else {
                        return None;
                    };
                    Some(LightSamplerQuery {
                        from: point(lane),
                        normal,
                        numbers: [coarse, fine],
                    })
                }));
            chosen_lights.extend((0..vertices.len).map(|lane| {
                let ([.., u, v], (light, probability)) = (numbers(lane), drawn[lane]?);
                Some(ChosenLight {
                    light,
                    probability,
                    from: point(lane),
                    position: [u, v],
                })
            }));
        }
        self.scene.lights.sample_batches(chosen_lights, lights);
        for ((vertices, chosen_lights), lights) in vertices
            .iter_mut()
            .zip(chosen_lights.chunks(LANES))
            .zip(lights)
        {
            for (lane, chosen_light) in chosen_lights.iter().enumerate() {
                let requested = chosen_light
                    .as_ref()
                    .filter(|_| lights.target_kinds[lane] != ShadowRayTargetKind::Nothing);
                match requested.and_then(|chosen_light| {
                    self.mis_strategy(chosen_light.light, lights.lane_density(lane))
                }) {
                    Some(strategy) => vertices.strategy[lane] = strategy,
                    None => lights.target_kinds[lane] = ShadowRayTargetKind::Nothing,
                }
            }
        }
    }

    /// Returns the weighting of a sample of a light with the given density; `None` if only BSDF
    /// sampling finds the light.
    #[inline(always)]
    fn mis_strategy(&self, light: LightId, density: LightDensity) -> Option<MisStrategy> {
        Some(match (density, light) {
            (LightDensity::Delta, LightId::Delta(i)) => MisStrategy::Delta {
                shines: self.scene.lights.delta[i as usize].specular,
            },
            (LightDensity::Delta, _) => MisStrategy::Delta { shines: false },
            (LightDensity::SolidAngle(_), _) => match self.scene.light_sampling_strategy(light) {
                LightSampling::Scattering => return None,
                LightSampling::Lights => MisStrategy::Unweighted,
                LightSampling::Both => MisStrategy::PowerHeuristic,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::power_heuristic;
    use raywright_bvh::stability::verdicts::CaseRng;

    /// Protects: the weights of two techniques are numbers from 0 to 1 that sum to one for any
    /// densities, zero, infinite or with squares beyond `f64`; and they follow the definition where
    /// `f64` holds all terms.
    #[test]
    fn m05_shares_of_extreme_densities() {
        let extremes = [0.0, 1e-300, 1e-30, 1.0, 1e25, 1e300, f64::INFINITY];
        for (own, other) in extremes
            .into_iter()
            .flat_map(|own| extremes.map(|other| (own, other)))
        {
            let shares = [power_heuristic(own, other), power_heuristic(other, own)];
            assert!(
                shares.iter().all(|share| (0.0..=1.0).contains(share)),
                "{own:e}, {other:e}: {shares:?}"
            );
            assert!(
                (shares[0] + shares[1] - 1.0).abs() <= 2.0 * f64::EPSILON,
                "{own:e}, {other:e}: {shares:?}"
            );
        }
        for index in 0..10_000 {
            let rng = &mut CaseRng::new(1, index);
            let exponent = rng.next_uniform(-140.0, 140.0);
            let (own, other) = (
                10_f64.powf(exponent),
                10_f64.powf(exponent + rng.next_uniform(-10.0, 10.0)),
            );
            // If a square underflows, it is negligible beside the other.
            let requested = own * own / (own * own + other * other);
            assert!(
                (power_heuristic(own, other) - requested).abs() <= 1e-14 * requested,
                "{:016x}, {:016x}",
                own.to_bits(),
                other.to_bits()
            );
        }
    }
}
