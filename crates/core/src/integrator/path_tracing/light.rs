//! Light sampling at vertices, and the weights of multiple importance sampling.

use raywright_bvh::Real;

use super::PathTracer;
use super::vertices::{LitSides, MisStrategy, VertexLanes};
use crate::light::{
    LANES, LightChoices, LightDensity, LightId, LightSampleLanes, ShadowRayTargetKind,
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
            let mut is_used = [false; LANES];
            for (lane, is_used) in is_used.iter_mut().enumerate().take(vertices.len) {
                *is_used = vertices.sides[lane] != LitSides::None;
            }
            sampler.sample_lanes(&vertices.receiving_points(), is_used)
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
    pub(super) fn mis_strategy(
        &self,
        light: LightId,
        density: LightDensity,
    ) -> Option<MisStrategy> {
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
    use glam::Vec3;
    use raywright_bvh::Surface;
    use raywright_bvh::stability::verdicts::CaseRng;
    use serde_json::json;

    use super::super::super::LightTransport;
    use super::*;
    use crate::effects::EffectSet;
    use crate::light::{LightSample, get_lane_vector, set_lane_vector};
    use crate::prepare::PreparedScene;
    use crate::settings::Settings;

    /// A scene of three quads and a sphere that emit, a point light and a sky.
    fn scene_of_all_lights() -> PreparedScene<f32> {
        let quad = |x: f64| {
            json!({ "material": "lamp", "shape": { "quad": { "corner": [x, 3, 0],
                "edge_u": [0.5, 0, 0], "edge_v": [0, 0, 0.5 + 0.1 * x] } } })
        };
        let scene = serde_json::from_value(json!({
            "format": 1,
            "sky": { "gradient": { "bottom": [0.2, 0.3, 0.5], "top": [0.6, 0.7, 0.9] } },
            "lights": [{ "kind": { "point": { "position": [2, 3, 2] } }, "colour": [6, 6, 6] }],
            "materials": [{ "name": "lamp", "model": { "physical": { "emission": [5, 4, 3] } } }],
            "objects": [quad(-2.0), quad(0.0), quad(2.0), { "material": "lamp",
                "shape": { "sphere": { "centre": [0, 4, 0], "radius": 0.3 } } }],
        }))
        .expect("a scene");
        let settings = Settings {
            integrator: crate::scene::Integrator::Path,
            ..Settings::from_scene(&scene)
        };
        PreparedScene::new(&scene, &settings, EffectSet::ALL, &()).expect("it can be prepared")
    }

    /// Vertices at random points, of one to eight lanes, of which some receive light on both sides
    /// and some on neither.
    fn random_vertices(rng: &mut CaseRng, len: usize) -> VertexLanes<f32> {
        let mut number = |least: f64, most: f64| rng.next_uniform(least, most) as f32;
        let mut vertices = VertexLanes::new();
        vertices.len = len;
        for lane in 0..len {
            let mut vector = || Vec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0));
            let (point, normal) = (vector() * 2.0, vector().normalize());
            let surface = Surface {
                point,
                above: point,
                below: point,
                error: 1e-6,
                normal,
            };
            vertices.surface.set_lane(lane, &surface);
            set_lane_vector::<f32>(&mut vertices.normal, lane, normal);
            vertices.sides[lane] =
                [LitSides::One, LitSides::Both, LitSides::None][number(0.0, 2.2) as usize];
            for column in &mut vertices.light_numbers {
                column[lane] = number(0.0, 1.0);
            }
        }
        vertices
    }

    /// Protects: the lights of many vertices are those of each vertex by itself: the choice, the
    /// sampled direction, radiance, density and point. The lamp in a lane changes from batch to
    /// batch.
    #[test]
    fn lights_of_batches_are_those_of_each_vertex() {
        let prepared = scene_of_all_lights();
        let (tracer, lights) = (PathTracer::new(&prepared, 4, false, &()), &prepared.lights);
        let rng = &mut CaseRng::new(7, 0);
        let mut batches: Vec<_> = (0..200)
            .map(|batch| random_vertices(rng, 1 + batch % LANES))
            .collect();
        let mut sampled = SampledLights::default();
        tracer.sample_lights(&mut batches, &mut sampled);
        let (mut found, mut dark) = (std::collections::BTreeMap::new(), 0);
        for (vertices, (choices, samples)) in batches.iter().zip(sampled.batches()) {
            for lane in 0..vertices.len {
                let (from, position) = vertices.receiving_points().get_lane(lane);
                let normal = match vertices.sides[lane] {
                    LitSides::None => {
                        assert_eq!(choices.lights[lane], None);
                        dark += 1;
                        continue;
                    }
                    LitSides::One => get_lane_vector::<f32>(&vertices.normal, lane),
                    LitSides::Both => Vec3::ZERO,
                };
                let [coarse, fine, ..] = vertices.light_numbers.map(|column| column[lane]);
                let alone = lights
                    .light_sampler()
                    .sample::<f32>(from, normal, [coarse, fine]);
                assert_eq!(choices.lights[lane], alone.map(|(light, _)| light));
                let Some((light, probability)) = alone else {
                    continue;
                };
                assert_eq!(choices.probabilities[lane], probability);
                let seen = samples.target_kinds[lane] != ShadowRayTargetKind::Nothing;
                let alone = lights.sample(light, from, position, probability);
                let text = |sample: &LightSample<f32>| format!("{sample:?}");
                assert_eq!(
                    seen.then(|| text(&samples.get_lane(lane))),
                    alone.as_ref().map(text)
                );
                *found.entry(format!("{light:?}")).or_insert(0) += u32::from(seen);
            }
        }
        assert!(dark > 20, "{dark}");
        assert!(
            found.len() == 6 && found.values().all(|&count| count > 20),
            "{found:?}"
        );
    }

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
