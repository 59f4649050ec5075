//! Lamps that emit most of their light from a small part of their surface. Samples of a lamp are
//! spread evenly over a shape, so that they hit the bright part by chance.

use core::f64::consts::{PI, TAU};

use glam::DVec3;
use raywright_bvh::{Interval, Ray, Real, Vector};

use super::directions::directions_in_cone;
use super::facts::unit_random;
use super::light_tracer::{LightTracer, VisiblePoint};
use super::ray_hits::{HITS, hits_along_ray};
use crate::integrator::PathSegment;
use crate::interaction::Interaction;
use crate::scene::{Shape, SideRule};

/// Greatest number of lamps that are sampled, and number of lines that they share.
const LAMPS: usize = 64;
const LINES: usize = 1 << 16;

/// A lamp of varying emission.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnevenLamp {
    pub object: usize,
    /// Variance of a surface point's radiance, in units of the squared mean.
    pub variance: f64,
    /// Share of the surface that emits half of the light.
    pub half_light_area: f64,
    /// Mean radiance that the visible surfaces reflect of its light.
    pub arriving: f64,
}

impl<R: Real> LightTracer<'_, R> {
    /// Samples the listed shapes whose emission varies. Samples of meshes follow the emission.
    pub fn measure_uneven_lamps(&self, seen: &[VisiblePoint]) -> Vec<UnevenLamp> {
        let listed = self.scene_facts.scene.objects.len();
        let objects = self.scene_facts.objects.iter().take(listed);
        let varies = objects.enumerate().filter(|(_, object)| {
            let emission = object
                .material
                .and_then(|(_, material)| material.uniform_emission());
            let is_mesh = matches!(object.object.shape, Shape::Mesh(_));
            object.emits_light() && emission.is_none() && !is_mesh
        });
        let lamps: Vec<usize> = varies.map(|(index, _)| index).take(LAMPS).collect();
        let lines = LINES / lamps.len().max(1);
        let lamp = |&object: &usize| {
            let is_over = self.deadline.has_passed();
            (!is_over).then(|| self.measure_uneven_lamp(object, lines, seen))?
        };
        lamps.iter().filter_map(lamp).collect()
    }

    /// Samples the radiance where random lines cross the lamp: lines of all directions hit every
    /// part of a surface equally often. Their number gives the area.
    fn measure_uneven_lamp(
        &self,
        object: usize,
        lines: usize,
        seen: &[VisiblePoint],
    ) -> Option<UnevenLamp> {
        let object_facts = &self.scene_facts.objects[object];
        let bounds = object_facts.bounds?;
        let radius = 0.5 * bounds.extent().length();
        let mut found: Vec<f64> = Vec::new();
        for (index, direction) in directions_in_cone(DVec3::Y, -1.0, lines).enumerate() {
            let number = |axis| unit_random(3, index as u64, axis);
            let (x, y) = direction.any_orthonormal_pair();
            let (sin, cos) = libm::sincos(TAU * number(0));
            let beside = (x * cos + y * sin) * (radius * number(1).sqrt());
            let start = bounds.centre() + beside - direction * radius - self.prepared.origin.origin;
            let [start, direction] = [start, direction].map(R::Vec3::from_f64);
            let ray = Ray::new(start, direction);
            self.emission_on_line(&ray, R::from_f64(2.0 * radius), object, &mut found);
        }
        found.sort_unstable_by(f64::total_cmp);
        let number = found.len() as f64;
        let sum: f64 = found.iter().sum();
        let squares: f64 = found.iter().map(|radiance| radiance * radiance).sum();
        let mean = sum / number;
        let mut rest = 0.5 * sum;
        let brightest = found.iter().rev().take_while(|&&radiance| {
            rest -= radiance;
            rest > 0.0
        });
        let half = brightest.count() + 1;
        let area = 2.0 * PI * radius * radius * number / lines as f64;
        let sides = match object_facts.object.side {
            SideRule::Both => 2.0,
            _ => 1.0,
        };
        (mean > 0.0).then(|| UnevenLamp {
            object,
            variance: squares / number / (mean * mean) - 1.0,
            half_light_area: half as f64 / number,
            arriving: self.arriving_light(object, mean * area * sides, seen),
        })
    }

    /// Adds the radiance, the mean of three channels, at each crossing of a line with an object.
    fn emission_on_line(&self, ray: &Ray<R>, length: R, object: usize, found: &mut Vec<f64>) {
        let range = Interval {
            min: R::ZERO,
            max: length,
        };
        let hits = hits_along_ray(&self.prepared.geometry, ray, range).take(HITS);
        for hit in hits.filter(|hit| self.facts_index(hit) == object) {
            let segment = PathSegment {
                ray: *ray,
                ..PathSegment::from_camera(self.prepared)
            };
            let interaction = Interaction::from_hit(self.prepared, &segment, &hit);
            let context = self.prepared.texture_tables.shading_context(&interaction);
            let material = &self.prepared.materials[interaction.material as usize];
            let emission = material.emission_at(&context).to_f64().element_sum() / 3.0;
            found.extend((emission.is_finite() && emission >= 0.0).then_some(emission));
        }
    }
}
