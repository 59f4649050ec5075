//! A sky in closed form: a gradient from nadir to zenith, and suns. The code is generic over the
//! number of directions in SIMD lanes.

use raywright_bvh::{Real, SimdTask, Vector, run_widest};

use super::{DirectionBatch, LANES, SkySample, for_each_direction_batch};
use crate::number::{Lanes, Number, Vector3};

/// A sky with a gradient from nadir to zenith, and suns.
#[derive(Clone, Debug)]
pub struct GradientSky<R: Real> {
    /// Radiance from straight below.
    pub bottom: R::Vec3,
    /// Radiance from straight above.
    pub top: R::Vec3,
    pub suns: Vec<SunLobe<R>>,
}

/// A sun: a lobe of radiance `colour`·cosⁿ, with the cosine of the angle to `direction` and n =
/// `exponent`.
#[derive(Clone, Debug)]
pub struct SunLobe<R: Real> {
    pub direction: R::Vec3,
    pub colour: R::Vec3,
    pub exponent: u32,
}

/// Returns the same vector in every SIMD lane.
#[inline(always)]
fn splat<R: Real, N: Number>(v: R::Vec3) -> N::Vec3 {
    N::Vec3::from_lanes(|_| v.to_f64())
}

impl<R: Real> GradientSky<R> {
    /// Returns the radiance along unit directions, one in each SIMD lane of `N`.
    #[inline(always)]
    pub fn radiance<N: Number>(&self, d: N::Vec3) -> N::Vec3 {
        let [zero, half, one] = [0.0, 0.5, 1.0].map(N::from_f64);
        let s = half * (d.y() + one);
        let mut sky = splat::<R, N>(self.bottom) * (one - s) + splat::<R, N>(self.top) * s;
        for sun in &self.suns {
            let cosine = d.dot(splat::<R, N>(sun.direction)).max(zero);
            sky += splat::<R, N>(sun.colour) * cosine.powi(sun.exponent);
        }
        sky
    }

    /// Appends the radiance along many unit directions in order, computed in SIMD lanes of `f32`.
    pub fn eval_directions(
        &self,
        directions: impl Iterator<Item = R::Vec3>,
        out: &mut Vec<SkySample<R>>,
    ) {
        for_each_direction_batch::<R>(directions, |directions, count| {
            let seen = run_widest(GradientTask {
                gradient: self,
                directions,
            });
            out.extend((0..count).map(|i| SkySample {
                image_coordinates: [R::ZERO; 2],
                radiance: R::Vec3::from_f64(seen.lane(i)),
            }));
        });
    }
}

/// SIMD task: radiance along a batch of directions.
struct GradientTask<'a, R: Real> {
    gradient: &'a GradientSky<R>,
    directions: &'a DirectionBatch<R>,
}

impl<R: Real> SimdTask for GradientTask<'_, R> {
    type Output = <Lanes<LANES> as Number>::Vec3;
    #[inline(always)]
    fn run(self) -> Self::Output {
        type N = Lanes<LANES>;
        // Column by column: `map` of an array is not inlined.
        let [x, y, z] = self.directions;
        self.gradient.radiance::<N>(<N as Number>::Vec3::new(
            N::from_lanes(|lane| x[lane].to_f64()),
            N::from_lanes(|lane| y[lane].to_f64()),
            N::from_lanes(|lane| z[lane].to_f64()),
        ))
    }
}
