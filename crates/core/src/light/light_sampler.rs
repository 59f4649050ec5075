//! Choice of a light for a surface point. Infinitely distant lights are chosen in proportion to
//! their power. All other lights are chosen by a tree over positions and directions. Up to a
//! hundred thousand lights, their number hardly affects time and noise.

use core::f64::consts::PI;

use glam::DVec3;
use raywright_bvh::{LaneFloats, Real, Vector};

use super::cdf::{entry_probability, push_cdf, sample_index};
use super::lanes::{LANES, LaneColumn, LightChoices, ReceivingPointLanes, get_lane_vector};
use super::tree::{LightLeaf, LightNode, LightTree, ReceivingPoint};
use super::{LightBounds, LightId, Lights};

/// Sampler that chooses one light for a surface point, in proportion to the lights' estimated
/// contributions.
#[derive(Clone, Debug, Default)]
pub struct LightSampler {
    /// Infinitely distant lights.
    far: Vec<LightId>,
    /// Cumulative distribution of the distant lights by power.
    far_shares: Vec<f64>,
    /// Probability of choosing a distant light: ½ if the scene has both distant and nearby lights,
    /// else 0 or 1.
    far_share: f64,
    tree: LightTree,
    /// Slot of each emitter in the tree, a place for a child of a node. [`LightTree::NONE`] for an
    /// emitter without power.
    leaves: Vec<u32>,
}

/// Returns the sum of a coarse and a fine number, see [`LightSampler::sample`].
#[inline(always)]
pub(crate) fn add_numbers<F: LaneFloats>(coarse: F, fine: F) -> F::Doubles {
    const STEP: f64 = 1.0 / (1 << 23) as f64;
    coarse.widen() + fine.widen() * fine.double_like(STEP)
}

impl LightSampler {
    /// Builds the sampler over all lights of positive power.
    pub(super) fn new<R: Real>(lights: &Lights<R>) -> Self {
        let (mut far, mut powers, mut near) = (Vec::new(), Vec::new(), Vec::new());
        for id in lights.light_ids() {
            let power = lights.power(id);
            // Leaves out NaN too.
            let shines = power > 0.0 && power.is_finite();
            match (lights.bounds(id), id) {
                (Some(bounds), _) if shines => near.push(LightLeaf {
                    light: id,
                    bounds,
                    intensity: lights.intensity(id, &bounds),
                }),
                (None, LightId::Delta(_) | LightId::Sky) if lights.emits_from_infinity(id) => {
                    far.push(id);
                    powers.push(power);
                }
                _ => {}
            }
        }
        // Distant lights whose powers are out of range count equally.
        if !powers.iter().any(|&power| power > 0.0 && power.is_finite()) {
            powers.fill(1.0);
        }
        let mut far_shares = Vec::with_capacity(far.len());
        push_cdf(&mut far_shares, &powers);
        let far_share = match (far.is_empty(), near.is_empty()) {
            (true, _) => 0.0,
            (false, true) => 1.0,
            (false, false) => 0.5,
        };
        let mut leaves = vec![LightTree::NONE; lights.emitters.len()];
        let tree = LightTree::new(near, |light, node| {
            if let LightId::Emitter(i) = light {
                leaves[i as usize] = node;
            }
        });
        Self {
            far,
            far_shares,
            far_share,
            tree,
            leaves,
        }
    }

    /// Returns the only node of the tree over nearby lights, see [`LightTree::single_node`].
    pub(super) fn single_node(&self) -> Option<(Option<&LightNode>, LaneColumn<Option<LightId>>)> {
        self.tree.single_node()
    }

    /// Returns the probability of choosing a distant light. It is chosen for numbers below.
    pub(super) fn far_share(&self) -> f64 {
        self.far_share
    }

    /// Whether no light can be chosen.
    pub fn is_empty(&self) -> bool {
        self.far.is_empty() && self.tree.is_empty()
    }

    /// Samples a light for a surface point. Returns the light and its probability, or `None` if no
    /// light contributes at the point.
    ///
    /// - `normal`: unit normal of the side that receives light; zero if both sides receive light.
    /// - `numbers`: coarse and fine uniform number in [0, 1), added with weights 1 and 2⁻²³: a
    ///   single `f32` number has steps of 2⁻²³.
    #[inline]
    pub fn sample<R: Real>(
        &self,
        from: R::Vec3,
        normal: R::Vec3,
        [coarse, fine]: [f32; 2],
    ) -> Option<(LightId, f64)> {
        self.sample_by_number::<R>(from, normal, add_numbers(coarse, fine))
    }

    #[inline]
    fn sample_by_number<R: Real>(
        &self,
        from: R::Vec3,
        normal: R::Vec3,
        u: f64,
    ) -> Option<(LightId, f64)> {
        let choices = self.choose([true], [u], |_| ReceivingPoint {
            point: from.to_f64(),
            normal: normal.to_f64(),
        });
        choices.lights[0].map(|light| (light, choices.probabilities[0]))
    }

    /// Samples a light for a point that is lit from both sides as [`Self::sample`] does, but not
    /// the sky, whose probability is `sky`, or zero to sample it. The returned probability is still
    /// that of all lights.
    pub(super) fn sample_without_sky<R: Real>(
        &self,
        from: R::Vec3,
        [coarse, fine]: [f32; 2],
        sky: f64,
    ) -> Option<(LightId, f64)> {
        // The sky is the last distant light.
        let (u, below) = (
            add_numbers(coarse, fine) * (1.0 - sky),
            self.far_share - sky,
        );
        let u = if u < below { u } else { u + sky };
        (sky < 1.0).then(|| self.sample_by_number::<R>(from, R::Vec3::ZERO, u))?
    }

    /// Returns the probability of choosing the sky.
    pub(super) fn sky_share(&self) -> f64 {
        self.probability::<f64>(LightId::Sky, DVec3::ZERO, DVec3::ZERO)
    }

    /// Samples a light for each point whose `is_used` is set as [`Self::sample`] does, in less time.
    #[inline]
    pub(crate) fn sample_lanes<R: Real>(
        &self,
        points: &ReceivingPointLanes<'_, R>,
        is_used: LaneColumn<bool>,
    ) -> LightChoices<LANES> {
        let mut u = [0.0; LANES];
        for (lane, u) in u.iter_mut().enumerate() {
            *u = add_numbers(points.numbers[0][lane], points.numbers[1][lane]);
        }
        self.choose(is_used, u, |lane| ReceivingPoint {
            point: get_lane_vector::<R>(points.point, lane).to_f64(),
            normal: points.normal(lane).to_f64(),
        })
    }

    /// Samples a light for each point whose `is_used` is set, by the point's number `u` in [0, 1).
    #[inline(always)]
    fn choose<const N: usize>(
        &self,
        mut is_used: [bool; N],
        mut u: [f64; N],
        receiver: impl Fn(usize) -> ReceivingPoint,
    ) -> LightChoices<N> {
        if self.far_share == 0.0 {
            return self.tree.sample_lights(&is_used, &u, receiver);
        }
        let mut choices = LightChoices::NONE;
        let near_share = 1.0 - self.far_share;
        for (i, (is_used, u)) in is_used.iter_mut().zip(&mut u).enumerate() {
            if *is_used && *u < self.far_share {
                let (index, probability, _) = sample_index(&self.far_shares, *u / self.far_share);
                choices.lights[i] = Some(self.far[index]);
                choices.probabilities[i] = probability * self.far_share;
                *is_used = false;
            }
            *u = (*u - self.far_share) / near_share;
        }
        let near = self.tree.sample_lights(&is_used, &u, receiver);
        for (i, _) in is_used.iter().enumerate().filter(|&(_, is_used)| *is_used) {
            choices.lights[i] = near.lights[i];
            choices.probabilities[i] = near.probabilities[i] * near_share;
        }
        choices
    }

    /// Returns the probability with which [`LightSampler::sample`] chooses `light` for a point.
    #[inline]
    pub fn probability<R: Real>(&self, light: LightId, from: R::Vec3, normal: R::Vec3) -> f64 {
        match light {
            LightId::Emitter(i) => {
                let receiver = ReceivingPoint {
                    point: from.to_f64(),
                    normal: normal.to_f64(),
                };
                let leaf = self
                    .leaves
                    .get(i as usize)
                    .copied()
                    .unwrap_or(LightTree::NONE);
                (1.0 - self.far_share) * self.tree.probability(leaf, &receiver)
            }
            // The sky is the last distant light. No path hits a delta light, so its probability is
            // never read.
            LightId::Sky if self.far.last() == Some(&LightId::Sky) => {
                entry_probability(&self.far_shares, self.far.len() - 1) * self.far_share
            }
            LightId::Sky | LightId::Delta(_) => 0.0,
        }
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> u64 {
        self.tree.bytes() + size_of_val(self.leaves.as_slice()) as u64
    }

    /// Estimates the bytes of the tables for `lights` lights, of which `emitters` are emitters.
    pub(crate) fn estimate_bytes(lights: u64, emitters: u64) -> u64 {
        LightTree::estimate_bytes(lights)
            .saturating_add(emitters.saturating_mul(size_of::<u32>() as u64))
    }
}

impl<R: Real> Lights<R> {
    /// Returns the greatest intensity of a nearby light times π, summed over the three channels.
    fn intensity(&self, light: LightId, bounds: &LightBounds) -> f64 {
        match light {
            LightId::Delta(i) => PI * self.delta[i as usize].intensity(self.scene_radius),
            _ => self.power(light) / bounds.flux_per_intensity(),
        }
    }

    /// Whether an infinitely distant light has any radiance.
    fn emits_from_infinity(&self, light: LightId) -> bool {
        match light {
            LightId::Delta(i) => {
                self.delta[i as usize]
                    .sample(R::Vec3::ZERO)
                    .is_some_and(|light_sample| {
                        let zero = <R as Real>::ZERO;
                        light_sample.arriving.max_element() > zero
                    })
            }
            LightId::Sky => true,
            LightId::Emitter(_) => false,
        }
    }
}

#[cfg(test)]
mod tests;
