//! The studio's ground. The ground is no surface: a camera ray that reaches the ground shows the
//! backdrop, darkened by the scene's shadow from the studio's light.

use raywright_bvh::{Interval, Ray, Real, Vector};

use super::{PathState, PathTracer};
use crate::light::ShadowRayTarget;
use crate::sampler::{SamplePurpose, SampleSequence, sample_4d_batch};

impl<R: Real> PathTracer<'_, R> {
    /// Returns for each escaped camera ray the visible share of the studio's light at the ray's
    /// point on the ground, 0 to 1. The estimate is a single shadow ray in a sampled direction of
    /// that light. The share is 1 without a ground and far from the scene.
    pub(super) fn trace_ground_visibility<'a>(
        &mut self,
        paths: impl Iterator<Item = &'a PathState<R>>,
    ) -> Vec<R> {
        let (scene, zero) = (self.scene, R::ZERO);
        let Some(ground) = &scene.ground else {
            return paths.map(|_| R::ONE).collect();
        };
        let (mut shares, mut hit_points, mut sequences) = (Vec::new(), Vec::new(), Vec::new());
        for PathState {
            segment,
            sample_hash,
            address,
            ..
        } in paths
        {
            let ray = &segment.ray;
            let t = (ground.height - ray.origin.y()) / ray.direction.y();
            // The ground is invisible from below.
            let hits_ground = ray.direction.y() < zero && t > -segment.skipped_distance;
            let position = ray.at(t);
            let point: R::Vec3 = Vector::new(position.x(), ground.height, position.z());
            let is_near = (point - ground.centre).length() <= ground.shadow_radius;
            if hits_ground && is_near {
                hit_points.push((shares.len(), point, ray.time));
                sequences.push((
                    SampleSequence::from_sample_hash(*sample_hash, *address, SamplePurpose::Ground),
                    address.index,
                ));
            }
            shares.push(R::ONE);
        }
        let mut numbers = Vec::new();
        sample_4d_batch(sequences.iter().copied(), &mut numbers);
        let mut directions: Vec<R::Vec3> = Vec::with_capacity(numbers.len());
        ground.direction_sampler.sample_directions(
            numbers.iter().map(|&[u, v, ..]| [u.into(), v.into()]),
            |direction| directions.push(Vector::from_f64(direction)),
        );
        for (&(index, point, time), &direction) in hit_points.iter().zip(&directions) {
            // Written once: a ray that is copied just after it was written is waited for.
            let shadow_ray = Ray {
                origin: Vector::new(point.x(), point.y(), point.z()),
                direction: Vector::new(direction.x(), direction.y(), direction.z()),
                time,
                is_camera_ray: false,
            };
            let range = Interval {
                min: zero,
                max: R::INFINITY,
            };
            self.counters.shadow += 1;
            shares[index] = scene
                .trace_shadow((&shadow_ray, range), &ShadowRayTarget::Infinity, false)
                .share;
        }
        shares
    }
}
