//! The studio's ground, which is no surface: camera rays that come to it see the backdrop, dimmed by the share of the studio's light that
//! the scene keeps from it there.

use raywright_bvh::{Interval, Ray, Real, Vector};

use super::super::PathSegment;
use super::PathTracer;
use crate::light::Target;
use crate::sampler::{Address, Purpose, pair};

impl<R: Real> PathTracer<'_, R> {
    /// Share of the studio's light that arrives where a camera ray that hit nothing comes to the ground: one direction is asked, drawn by
    /// what comes from there. One where there is no ground, or where it lies too far from everything.
    #[inline]
    pub(super) fn light_on_ground(&mut self, leg: &PathSegment<R>, address: &Address) -> R {
        let scene = self.scene;
        let Some(ground) = &scene.ground else { return R::ONE };
        let (ray, zero) = (&leg.ray, R::ZERO);
        let t = (ground.height - ray.origin.y()) / ray.direction.y();
        // Seen from below, it is not there.
        let is_met = ray.direction.y() < zero && t > -leg.ahead;
        let met = ray.at(t);
        let point: R::Vec3 = Vector::new(met.x(), ground.height, met.z());
        let is_near = (point - ground.centre).length() <= ground.reach;
        if !(is_met && is_near) {
            return R::ONE;
        }
        let direction = Vector::from_f64(ground.light.direction(pair(*address, Purpose::Ground).map(f64::from)));
        let towards = Ray::new(point, direction).at_time(ray.time);
        let range = Interval { min: zero, max: R::INFINITY };
        self.counters.shadow += 1;
        scene.between((&towards, range), &Target::Infinity, false).share
    }
}
