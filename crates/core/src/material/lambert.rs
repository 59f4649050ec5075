//! Lambert's lobe for matte surfaces. A BSDF of this lobe type contains no code of other lobes.

use core::f64::consts::PI;

use super::lobe_traits::{BsdfLobe, Directions, ScatteringLobe, sample_cosine_hemisphere};
use super::shading_frame::ShadingFrame;
use crate::number::{Number, Vector3};

/// Lambert's lobe: it reflects the same radiance in every direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert<N: Number> {
    /// Diffuse reflectance.
    pub albedo: N::Vec3,
}

impl<N: Number> BsdfLobe<N> for Lambert<N> {
    const NOTHING: Self = Self {
        albedo: <N::Vec3 as Vector3<N>>::ZERO,
    };
}

impl<N: Number> ScatteringLobe<N> for Lambert<N> {
    #[inline(always)]
    fn importance(&self, _: N) -> N {
        self.albedo.max_element()
    }

    #[inline(always)]
    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        (
            self.albedo / N::from_f64(PI),
            directions.cos_wi / N::from_f64(PI),
        )
    }

    #[inline(always)]
    fn eval_diffuse(&self, _: &Directions<N>) -> N::Vec3 {
        self.albedo / N::from_f64(PI)
    }

    #[inline(always)]
    fn sample(
        &self,
        frame: &ShadingFrame<N>,
        _: N::Vec3,
        _: N::Vec3,
        _: N,
        point: [N; 2],
    ) -> N::Vec3 {
        frame.to_world(sample_cosine_hemisphere::<N>(point))
    }
}
