//! Light sampling at vertices, and the weights of multiple importance sampling.

use raywright_bvh::{Real, Vector};

use super::PathTracer;
use super::vertices::{LitSides, MisStrategy, VertexLanes};
use crate::light::{
    LANES, LightChoices, LightDensity, LightId, LightSampleLanes, ShadowRayTargetKind,
    set_lane_vector,
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

/// The lights chosen for vertices, and their samples, in batches of [`LANES`] vertices. Kept from
/// queue to queue to reuse the memory of the lists.
#[derive(Default)]
pub(super) struct SampledLights<R: Real> {
    choices: Vec<LightChoices<LANES>>,
    samples: Vec<LightSampleLanes<R>>,
}

impl<R: Real> SampledLights<R> {
    /// Iterates over the chosen lights and their samples.
    pub fn batches(&self) -> impl Iterator<Item = (&LightChoices<LANES>, &LightSampleLanes<R>)> {
        self.choices.iter().zip(&self.samples)
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Chooses and samples a light for each vertex, and sets the vertex's [`MisStrategy`].
    pub(super) fn sample_lights(
        &self,
        batches: &mut [VertexLanes<R>],
        SampledLights { choices, samples }: &mut SampledLights<R>,
    ) {
        choices.clear();
        let sampler = self.scene.lights.light_sampler();
        choices.extend(batches.iter().map(|vertices| {
            let (mut normal, mut is_used) = (vertices.normal, [false; LANES]);
            for lane in 0..vertices.len {
                is_used[lane] = vertices.sides[lane] != LitSides::None;
                if vertices.sides[lane] == LitSides::Both {
                    set_lane_vector::<R>(&mut normal, lane, Vector::ZERO);
                }
            }
            sampler.sample_lanes(&vertices.receiving_points(), &normal, is_used)
        }));
        if samples.len() < choices.len() {
            samples.resize_with(choices.len(), LightSampleLanes::new);
        }
        self.scene.lights.sample_batches(
            batches
                .iter()
                .map(VertexLanes::receiving_points)
                .zip(&*choices),
            samples,
        );
        for ((vertices, choices), samples) in batches.iter_mut().zip(choices).zip(samples) {
            for (lane, light) in choices.lights.iter().enumerate() {
                let light =
                    light.filter(|_| samples.target_kinds[lane] != ShadowRayTargetKind::Nothing);
                match light.and_then(|light| self.mis_strategy(light, samples.lane_density(lane))) {
                    Some(strategy) => vertices.strategy[lane] = strategy,
                    None => samples.target_kinds[lane] = ShadowRayTargetKind::Nothing,
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
