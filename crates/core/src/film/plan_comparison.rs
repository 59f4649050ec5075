//! Compares plans of films: whether films can be merged, and whether a film can be continued.

use super::FilmPlan;

impl FilmPlan {
    /// Returns the name of the first property in which two plans differ, such as "crop", the number
    /// of samples excepted; `None` without another difference.
    pub fn find_division_difference(&self, other: &Self) -> Option<&'static str> {
        let differs = [
            (self.crop != other.crop, "crop"),
            (self.tile_size != other.tile_size, "size of tiles"),
            (self.asked != other.asked, "number of replicates"),
            (self.is_fixed != other.is_fixed, "pattern of samples"),
            (self.adaptive != other.adaptive, "maximum error"),
            (self.denoise != other.denoise, "denoising"),
            (
                (self.random, self.alpha, &self.layers)
                    != (other.random, other.alpha, &other.layers),
                "scene",
            ),
            (self.backdrop != other.backdrop, "ground"),
        ];
        differs
            .into_iter()
            .find(|(differs, _)| *differs)
            .map(|(_, label)| label)
    }

    /// Returns the name of the first property in which two plans differ, such as "number of
    /// samples"; `None` for equal plans.
    pub fn find_difference(&self, other: &Self) -> Option<&'static str> {
        let samples = (self.samples != other.samples).then_some("number of samples");
        samples.or_else(|| self.find_division_difference(other))
    }

    /// Whether this plan can continue a film of the plan `fewer`: each replicate has at least as
    /// many samples in this plan.
    pub fn can_continue_film(&self, fewer: &Self) -> bool {
        fewer.replicates <= self.replicates
            && fewer.replicates_per_net() == self.replicates_per_net()
            && (0..fewer.replicates)
                .all(|r| fewer.replicate_samples(r) <= self.replicate_samples(r))
    }

    /// Returns the least number of samples per pixel, at or above that of this plan, with which the
    /// plan can continue a film of the plan `fewer`; `None` if no number suffices. Both plans have
    /// the same division.
    pub fn least_samples_to_continue(&self, fewer: &Self) -> Option<u32> {
        // The last replicate of `fewer` has the fewest samples, `before` + 1. This plan needs as
        // many in its first `last` replicates, and at least `before` in each further replicate.
        let (before, last) = (
            u64::from(fewer.samples / fewer.replicates - 1),
            u64::from(fewer.replicates),
        );
        let mut samples = self.samples.max(fewer.samples);
        loop {
            let plan = self.with_samples(samples);
            if plan.can_continue_film(fewer) {
                return Some(samples);
            }
            if plan.replicates_per_net() != fewer.replicates_per_net() {
                return None;
            }
            // The number of replicates never decreases, and a smaller sum than this does not
            // suffice for the replicates of `plan`.
            let next = (u64::from(plan.replicates) * before + last).max(u64::from(samples) + 1);
            samples = u32::try_from(next).ok()?;
        }
    }
}
