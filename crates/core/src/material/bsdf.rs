//! The BSDF of a surface at a point: a list of lobes, evaluated, sampled and weighted together. The
//! type of the lobes is a parameter: code for common materials contains no rare lobes.

use super::lobe::Lobe;
use super::lobe_traits::{BsdfLobe, Directions};
use super::shading_frame::ShadingFrame;
use crate::number::{Mask, Number, Vector3};

/// Greatest number of lobes of a BSDF of [`Lobe`]s.
pub const MOST_LOBES: usize = 6;

/// The BSDF of a surface at a point: the sum of at most `MOST` lobes of the type `L`. `N` is the
/// number type, for one path or for several SIMD lanes.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<N: Number, L: BsdfLobe<N> = Lobe<N>, const MOST: usize = MOST_LOBES> {
    normal: N::Vec3,
    lobes: [L; MOST],
    count: usize,
}

/// Incident direction sampled from a BSDF, with its weight and density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample<N: Number> {
    /// Mask of the SIMD lanes with a valid sample. A lane whose sample carries no light is invalid,
    /// and its direction, weight and density are zero.
    pub is_valid: N::Mask,
    /// Unit direction, away from the surface.
    pub direction: N::Vec3,
    /// BSDF value · |cosine to the normal| / density. Its mean over many samples is the albedo.
    pub weight: N::Vec3,
    /// Density by solid angle; zero for a delta lobe.
    pub density: N,
    /// Mask of the SIMD lanes that sampled a delta lobe. Light sampling cannot find the direction
    /// of a delta lobe.
    pub delta: N::Mask,
}

/// Part of a BSDF that is evaluated.
#[derive(Clone, Copy)]
enum BsdfPart {
    /// All reflection, for light from above the surface.
    Reflection,
    /// All transmission, for light from below the surface.
    Transmission,
    /// The diffuse part of the reflection.
    Diffuse,
}

impl<N: Number, L: BsdfLobe<N>, const MOST: usize> Bsdf<N, L, MOST> {
    /// Creates a BSDF without lobes, which is black.
    #[inline(always)]
    pub fn new(normal: N::Vec3) -> Self {
        Self {
            normal,
            lobes: [L::NOTHING; MOST],
            count: 0,
        }
    }

    /// Removes all lobes and replaces the normal, in place.
    #[inline(always)]
    pub fn reset(&mut self, normal: N::Vec3) {
        (self.normal, self.count) = (normal, 0);
    }

    /// Adds a lobe; does nothing if the BSDF already holds `MOST` lobes.
    #[inline(always)]
    pub fn add_lobe(&mut self, lobe: L) {
        if let Some(slot) = self.lobes.get_mut(self.count) {
            *slot = lobe;
            self.count += 1;
        }
    }

    /// Returns the BSDF with one more lobe, see [`Self::add_lobe`].
    #[inline(always)]
    #[must_use]
    pub fn with_lobe(mut self, lobe: L) -> Self {
        self.add_lobe(lobe);
        self
    }

    /// Returns the shading normal, on the viewer's side.
    #[inline(always)]
    pub fn normal(&self) -> N::Vec3 {
        self.normal
    }

    /// Returns the lobes in the order of their addition.
    #[inline(always)]
    pub fn lobes(&self) -> &[L] {
        &self.lobes[..self.count]
    }

    /// Whether all lobes are delta lobes.
    #[inline(always)]
    pub fn is_delta(&self) -> bool {
        self.lobes().iter().all(L::is_delta)
    }

    /// Returns the sum of the lobes' values in a part of the BSDF, and the sum of their densities,
    /// each times the lobe's importance.
    ///
    /// The part is a value and not a function of the lobe: the compiler does not inline a function
    /// that is passed as an argument into a SIMD task.
    #[inline(always)]
    fn sum_lobes(
        &self,
        directions: &Directions<N>,
        importances: &[N; MOST],
        part: BsdfPart,
    ) -> (N::Vec3, N) {
        let (mut value, mut sum) = (N::Vec3::ZERO, N::ZERO);
        for (lobe, &importance) in self.lobes().iter().zip(importances) {
            let (own, density) = match part {
                BsdfPart::Reflection => lobe.eval_and_pdf(directions),
                BsdfPart::Transmission => lobe.eval_transmission_and_pdf(directions),
                BsdfPart::Diffuse => (lobe.eval_diffuse(directions), N::ZERO),
            };
            value += own;
            sum = sum + importance * density;
        }
        (value, sum)
    }

    /// Evaluates the BRDF for light from `wi` to `wo`, both above the surface. Delta lobes
    /// contribute zero.
    #[inline(always)]
    pub fn eval(&self, wo: N::Vec3, wi: N::Vec3) -> N::Vec3 {
        self.sum_lobes(
            &Directions::new(self.normal, wo, wi),
            &[N::ZERO; MOST],
            BsdfPart::Reflection,
        )
        .0
    }

    /// Whether a non-delta lobe transmits light.
    #[inline(always)]
    pub fn is_transmissive(&self) -> bool {
        self.lobes().iter().any(L::is_transmissive)
    }

    /// Evaluates the diffuse part of the BRDF, for lights that make no highlights. The directions
    /// are those of [`Self::eval`].
    #[inline(always)]
    pub fn eval_diffuse(&self, wo: N::Vec3, wi: N::Vec3) -> N::Vec3 {
        self.sum_lobes(
            &Directions::new(self.normal, wo, wi),
            &[N::ZERO; MOST],
            BsdfPart::Diffuse,
        )
        .0
    }

    /// Returns the sampling weight of each lobe for the cosine of the view, and the sum of these
    /// weights.
    #[inline(always)]
    fn importances(&self, cosine: N) -> ([N; MOST], N) {
        let (mut each, mut sum) = ([N::ZERO; MOST], N::ZERO);
        for (importance, lobe) in each.iter_mut().zip(self.lobes()) {
            *importance = lobe.importance(cosine);
            sum = sum + *importance;
        }
        (each, sum)
    }

    /// Returns the density by solid angle with which [`Self::sample`] returns `wi`. A delta lobe
    /// adds no density, but the probability of choosing it reduces the density of all other lobes.
    #[inline(always)]
    pub fn pdf(&self, wo: N::Vec3, wi: N::Vec3) -> N {
        self.eval_and_pdf(wo, wi).1
    }

    /// Returns the BSDF value and the density of [`Self::pdf`] together: most of their computation
    /// is shared. Unlike [`Self::eval`], the value includes transmission for `wi` below the
    /// surface.
    #[inline(always)]
    pub fn eval_and_pdf(&self, wo: N::Vec3, wi: N::Vec3) -> (N::Vec3, N) {
        let cosine = self.normal.dot(wo);
        self.eval_and_pdf_with_importances(&self.importances(cosine), cosine, wo, wi)
    }

    /// As [`Self::eval_and_pdf`], with the lobes' sampling weights already computed.
    #[inline(always)]
    fn eval_and_pdf_with_importances(
        &self,
        (importances, total): &([N; MOST], N),
        cosine: N,
        wo: N::Vec3,
        wi: N::Vec3,
    ) -> (N::Vec3, N) {
        let (directions, zero) = (Directions::new(self.normal, wo, wi), N::ZERO);
        let (value, sum) = self.sum_lobes(&directions, importances, BsdfPart::Reflection);
        let (able, above) = (
            cosine.greater_than(zero) & total.greater_than(zero),
            self.normal.dot(wi).greater_than(zero),
        );
        let over = N::select(able & above, sum / *total, zero);
        if !self.is_transmissive() {
            return (value, over);
        }
        let (through, sum) = self.sum_lobes(&directions, importances, BsdfPart::Transmission);
        let below = zero.greater_than(self.normal.dot(wi));
        (
            N::Vec3::select(below, through, value),
            N::select(able & below, sum / *total, over),
        )
    }

    /// Samples an incident direction by three random numbers in [0, 1). `choice` chooses the lobe,
    /// `u` and `v` the direction. `frame` is a frame about the normal.
    #[inline(always)]
    pub fn sample(
        &self,
        frame: &ShadingFrame<N>,
        wo: N::Vec3,
        [choice, u, v]: [N; 3],
    ) -> BsdfSample<N> {
        let cosine = self.normal.dot(wo);
        let importances = self.importances(cosine);
        let (each, total) = importances;
        let able = cosine.greater_than(N::ZERO) & total.greater_than(N::ZERO);
        let (mut direction, mut weight, mut delta) =
            (N::Vec3::ZERO, N::Vec3::ZERO, N::Mask::default());
        let local = frame.to_local(wo);
        let mut before = N::ZERO;
        for ((lobe, chosen), importance) in self
            .lobes()
            .iter()
            .zip(self.choose_lobes(&each, choice * total, able))
            .zip(each)
        {
            let start = before;
            before = before + importance;
            if !chosen.any_lane() {
                continue;
            }
            if lobe.is_delta() {
                let (mirrored, share) = lobe.sample_delta(self.normal, wo, u);
                direction = N::Vec3::select(chosen, mirrored, direction);
                weight = N::Vec3::select(chosen, share / (importance / total), weight);
                delta = delta | chosen;
            } else {
                // The position of the first number within the interval of the chosen lobe is again
                // uniform in [0, 1).
                let rest = ((choice * total - start) / importance).max(N::ZERO);
                direction = N::Vec3::select(
                    chosen,
                    lobe.sample(frame, wo, local, rest, [u, v]),
                    direction,
                );
            }
        }
        let (value, density) =
            self.eval_and_pdf_with_importances(&importances, cosine, wo, direction);
        let facing = self.normal.dot(direction);
        // False for NaN and for a failed sample too.
        let mut sent = density.greater_than(N::ZERO) & facing.greater_than(N::ZERO) & !delta;
        let mut drawn = value * (facing / density);
        if self.is_transmissive() {
            let below = density.greater_than(N::ZERO) & N::ZERO.greater_than(facing) & !delta;
            drawn = N::Vec3::select(below, -drawn, drawn);
            sent = sent | below;
        }
        let some = delta | sent;
        BsdfSample {
            is_valid: some,
            direction: N::Vec3::select(some, direction, N::Vec3::ZERO),
            weight: N::Vec3::select(sent, drawn, weight),
            density: N::select(sent, density, N::ZERO),
            delta,
        }
    }

    /// Returns, for each lobe, the mask of the SIMD lanes that sample this lobe. Only lanes of the
    /// mask `able` sample.
    ///
    /// Let a lobe's start be the sum of the importances before it. A lane samples the last lobe of
    /// positive importance whose start is at most `target`. The search runs backwards from the last
    /// lobe: rounding then leaves no gap at the end.
    #[inline(always)]
    fn choose_lobes(&self, importances: &[N; MOST], target: N, able: N::Mask) -> [N::Mask; MOST] {
        let (mut chosen, mut left) = ([N::Mask::default(); MOST], able);
        let mut before = [N::ZERO; MOST];
        for i in 1..MOST {
            before[i] = before[i - 1] + importances[i - 1];
        }
        for i in (0..self.lobes().len()).rev() {
            chosen[i] =
                left & importances[i].greater_than(N::ZERO) & !before[i].greater_than(target);
            left = left & !chosen[i];
        }
        chosen
    }
}
