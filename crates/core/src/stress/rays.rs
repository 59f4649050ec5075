//! Camera rays that continue through all surfaces. They record the order of the surfaces, and test
//! rays that start at the first surface.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use raywright_bvh::{Hit, Interval, Ray, Real, Surface, Vector};

use super::RayDeadline;
use super::copy_crossings::CopyCrossings;
use super::facts::{SceneFacts, SurfaceKind, unit_random};
use super::orientation::OrientationTable;
use super::overlap_table::OverlapTable;
use super::ray_crossings::{RayCrossing, record_unclosed_bodies};
use super::ray_survey::{RayPoint, RaySurvey, SurfaceOnRay, record_maximum, record_sighting};
use super::values::{MaterialValueClass, classify_values};
use crate::dispatch::PreparedSceneTask;
use crate::integrator::{MAX_MEDIA, PathSegment};
use crate::interaction::Interaction;
use crate::prepare::{PreparedScene, PreparedSpawnRule};
use crate::scene::Shape;

/// `GRID`: numbers of rays along the picture's width and height in a round. `ROUNDS`: number of
/// rounds.
const GRID: [u64; 2] = [160, 90];
const ROUNDS: u64 = 4;

/// Greatest number of surfaces that a ray passes.
const HITS: usize = 128;

/// Number of rays that start at each first hit.
const STARTS: u64 = 2;

/// Task that traces the rays of a camera. Rounds are only traced in full.
pub(super) struct RaySurveyTask<'a> {
    pub scene_facts: &'a SceneFacts<'a>,
    pub overlaps: &'a OverlapTable,
    pub orientations: &'a OrientationTable<'a>,
    pub size: [u32; 2],
    pub seed: u64,
    pub deadline: &'a RayDeadline<'a>,
}

impl PreparedSceneTask for RaySurveyTask<'_> {
    type Output = RaySurvey;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> RaySurvey {
        survey_rays(prepared, self)
    }
}

fn survey_rays<R: Real>(prepared: &PreparedScene<R>, of: &RaySurveyTask<'_>) -> RaySurvey {
    let &RaySurveyTask {
        scene_facts,
        overlaps,
        orientations,
        size,
        seed,
        deadline,
    } = of;
    let mut objects = scene_facts.objects.iter();
    let looks_through = objects.any(|object| object.surface_kind == SurfaceKind::Body);
    let mut objects = scene_facts.objects.iter();
    let walker = SurveyRayTracer {
        prepared,
        scene_facts,
        overlaps,
        orientations,
        has_one_sided: objects.any(|object| object.hides_back_faces()),
        size,
        seed,
        continues_behind_surfaces: looks_through,
    };
    let mut survey = RaySurvey {
        planned: ROUNDS * GRID[0] * GRID[1],
        ..RaySurvey::default()
    };
    for round in 0..ROUNDS {
        if deadline.has_passed() && round > 0 {
            break;
        }
        let row = |row: u64| {
            let first = (round * GRID[1] + row) * GRID[0];
            (0..GRID[0]).fold(RaySurvey::default(), |mut survey, column| {
                walker.trace_through_all_surfaces([column, row], first + column, &mut survey);
                survey
            })
        };
        survey = (0..GRID[1])
            .into_par_iter()
            .map(row)
            .reduce(RaySurvey::default, RaySurvey::combine)
            .combine(survey);
    }
    survey.separate_bodies_around_camera();
    survey
}

pub(super) struct SurveyRayTracer<'a, R: Real> {
    pub prepared: &'a PreparedScene<R>,
    pub scene_facts: &'a SceneFacts<'a>,
    pub orientations: &'a OrientationTable<'a>,
    /// Whether an object is hidden from one side.
    pub has_one_sided: bool,
    pub overlaps: &'a OverlapTable,
    size: [u32; 2],
    seed: u64,
    /// Whether rays continue behind the second surface. Only in scenes with glass bodies.
    continues_behind_surfaces: bool,
}

impl<R: Real> SurveyRayTracer<'_, R> {
    fn trace_through_all_surfaces(&self, cell: [u64; 2], index: u64, survey: &mut RaySurvey) {
        let at = |axis: usize| {
            let share = (cell[axis] as f64 + unit_random(self.seed, index, axis as u64))
                / GRID[axis] as f64;
            R::from_f64(share * f64::from(self.size[axis]))
        };
        let camera = &self.prepared.camera;
        let lens = [2, 3].map(|selected| unit_random(self.seed, index, selected) as f32);
        let ray = camera.generate_timed_ray(
            at(0),
            at(1),
            lens.map(|x| x.min(0.999_999)),
            unit_random(self.seed, index, 4) as f32,
        );
        survey.rays += 1;
        if let Some(first) = self
            .prepared
            .geometry
            .closest(&ray, Interval::positive(), &mut ())
        {
            survey.hits += 1;
            self.survey_first_hit(&ray, &first, index, survey);
            self.survey_coincident_surface(&ray, &first, index, survey);
        }
        self.survey_all_surfaces(
            &Ray {
                is_camera_ray: false,
                ..ray
            },
            index,
            survey,
        );
    }

    pub fn ray_crossing(&self, ray: &Ray<R>, hit: &Hit<R>) -> RayCrossing<R> {
        let surface = self.prepared.geometry.surface(ray, hit);
        let enters = surface.normal.to_f64().dot(ray.direction.to_f64()) < 0.0;
        RayCrossing {
            object: self.scene_facts.facts_index(hit.outermost_id()),
            surface,
            enters,
        }
    }

    /// Returns the point at which a camera ray hits a surface.
    pub fn sighted_point(&self, surface: &Surface<R>, hit: &Hit<R>, ray: u64) -> RayPoint {
        RayPoint {
            ray,
            position: self.prepared.to_world(surface.point),
            distance: hit.t.to_f64(),
        }
    }

    /// Records the first hit of a ray: values of the material, overlapping objects, normals, and
    /// rays that start there.
    fn survey_first_hit(&self, ray: &Ray<R>, hit: &Hit<R>, index: u64, survey: &mut RaySurvey) {
        let prepared = self.prepared;
        let segment = PathSegment {
            ray: *ray,
            ..PathSegment::from_camera(prepared)
        };
        let interaction = Interaction::from_hit(prepared, &segment, hit);
        let object = self.scene_facts.facts_index(hit.outermost_id());
        let seen = self.sighted_point(&interaction.surface, hit, index);
        record_sighting(&mut survey.first_hits, object, seen);
        let place = [seen.position, interaction.surface.normal.to_f64()];
        for other in self.overlaps.overlapping_objects(
            self.scene_facts,
            object,
            place,
            ray.direction.to_f64(),
        ) {
            record_sighting(&mut survey.coplanar, [object, other], seen);
        }
        if !interaction.outside {
            record_sighting(&mut survey.first_within, object, seen);
        }
        if self.has_opposed_normals(ray, hit) {
            record_sighting(&mut survey.opposed_normals, object, seen);
        }
        let material = interaction.material as usize;
        match classify_values(prepared, &interaction) {
            MaterialValueClass::Fine => {}
            MaterialValueClass::NotNumbers(key) => {
                record_sighting(&mut survey.not_numbers, (material, key), seen)
            }
            MaterialValueClass::ColourAboveOne(value) => {
                record_sighting(&mut survey.colours_above_one, material, seen);
                record_maximum(&mut survey.greatest_colours, material, value);
            }
        }
        for start in 0..STARTS {
            self.survey_spawned_ray(&interaction, hit, [index, start], survey);
        }
    }

    /// Returns whether the vertex normals point to the opposite side of the triangle.
    fn has_opposed_normals(&self, ray: &Ray<R>, hit: &Hit<R>) -> bool {
        let Some(mesh) = &self.prepared.objects[hit.outermost_id() as usize].mesh else {
            return false;
        };
        let data = &self.prepared.meshes[mesh.mesh as usize];
        let [a, b, c] =
            data.indices[hit.primitive as usize].map(|corner| data.normals.get(corner as usize));
        let (Some(a), Some(b), Some(c), false) = (a, b, c, mesh.rotates) else {
            return false;
        };
        let [b, c] = if mesh.flipped { [c, b] } else { [b, c] };
        let (u, v) = (hit.u.to_f64(), hit.v.to_f64());
        let own = DVec3::from(a.map(f64::from)) * (1.0 - u - v)
            + DVec3::from(b.map(f64::from)) * u
            + DVec3::from(c.map(f64::from)) * v;
        let [x, y, z] = mesh.normals.map(|column| column.to_f64());
        let normal = x * own.x + y * own.y + z * own.z;
        normal.dot(self.prepared.geometry.surface(ray, hit).normal.to_f64()) < 0.0
    }

    /// Traces a random ray from the visible side of a surface. Records whether it hits the same
    /// primitive again, and whether it starts behind another surface.
    fn survey_spawned_ray(
        &self,
        interaction: &Interaction<R>,
        hit: &Hit<R>,
        [index, start]: [u64; 2],
        survey: &mut RaySurvey,
    ) {
        let prepared = self.prepared;
        let number = |selected: u64| unit_random(self.seed, index, 8 + 2 * start + selected);
        let (z, turn) = (2.0 * number(0) - 1.0, number(1) * core::f64::consts::TAU);
        let ring = (1.0 - z * z).sqrt();
        let ball = DVec3::new(ring * libm::cos(turn), ring * libm::sin(turn), z);
        let side = if interaction.outside {
            interaction.surface.normal.to_f64()
        } else {
            -interaction.surface.normal.to_f64()
        };
        let Some(direction) = (side + ball * 0.99).try_normalize() else {
            return;
        };
        let direction = R::Vec3::from_f64(direction);
        let ray = prepared
            .spawn_ray(interaction, direction, R::ONE)
            .with_time(interaction.time);
        let object = self.scene_facts.facts_index(hit.outermost_id());
        let seen = self.sighted_point(&interaction.surface, hit, index);
        survey.spawned_rays += 1;
        let range = Interval {
            min: prepared.min_hit_distances().secondary,
            max: R::INFINITY,
        };
        let again = prepared.geometry.closest(&ray, range, &mut ());
        let is_same =
            |other: &Hit<R>| (other.tie_order(), other.instance) == (hit.tie_order(), hit.instance);
        if again.as_ref().is_some_and(is_same)
            && self.cannot_be_hit_again(object, interaction.outside)
        {
            record_sighting(&mut survey.self_hits, object, seen);
        }
        if let Some(other) = again.as_ref().filter(|other| !is_same(other)) {
            self.survey_twin_shadow(&interaction.surface, (&ray, other), (object, seen), survey);
        }
        if matches!(prepared.rules.spawn, PreparedSpawnRule::Constant { .. }) {
            let own = interaction.surface.spawn_ray_origin(direction);
            let unit_direction = ray.origin - own;
            let length = unit_direction.length();
            let range = Interval {
                min: R::ZERO,
                max: length,
            };
            let between = || {
                prepared.geometry.closest(
                    &Ray::new(own, unit_direction / length).with_time(interaction.time),
                    range,
                    &mut (),
                )
            };
            // Its own surface is looked at above.
            if length > R::ZERO && between().is_some_and(|other| !is_same(&other)) {
                record_sighting(&mut survey.starts_behind_surface, object, seen);
            }
        }
    }

    /// Returns whether a ray that leaves a primitive on this side can never hit it again. This
    /// holds for flat shapes, and for the outside of convex shapes.
    fn cannot_be_hit_again(&self, object: usize, outside: bool) -> bool {
        match self.scene_facts.objects[object].object.shape {
            Shape::Mesh(_)
            | Shape::Triangle { .. }
            | Shape::Quad { .. }
            | Shape::Disk { .. }
            | Shape::Plane { .. } => true,
            Shape::Sphere { .. }
            | Shape::Box { .. }
            | Shape::Ellipsoid { .. }
            | Shape::Cone { .. } => outside,
            Shape::Cylinder { caps, height, .. } => outside && (caps || height.is_none()),
            Shape::Hyperboloid { .. } | Shape::Paraboloid { .. } | Shape::Torus { .. } => false,
        }
    }

    /// Traces a ray through all surfaces, with backs visible too, and records the order of the
    /// surfaces.
    fn survey_all_surfaces(&self, ray: &Ray<R>, index: u64, survey: &mut RaySurvey) {
        let (mut range, mut depths) = (Interval::positive(), BTreeMap::<usize, i64>::new());
        let mut copies = CopyCrossings::default();
        let mut hits: Vec<(usize, RayPoint)> = Vec::new();
        for step in 0..HITS {
            let Some(hit) = self.prepared.geometry.closest(ray, range, &mut ()) else {
                if step == 0 {
                    self.survey_hidden_backs(ray, index, None, survey);
                }
                return record_unclosed_bodies(&depths, &hits, survey);
            };
            range.min = hit.t;
            let crossing = self.ray_crossing(ray, &hit);
            let seen = self.sighted_point(&crossing.surface, &hit, index);
            if !hits.iter().any(|(object, _)| *object == crossing.object) {
                hits.push((crossing.object, seen));
                record_sighting(&mut survey.sightings, crossing.object, seen);
            }
            if step == 0 {
                let surface = SurfaceOnRay {
                    object: crossing.object,
                    primitive: hit.primitive,
                    point: seen,
                };
                let visible = Some((surface, crossing.enters));
                self.survey_hidden_backs(ray, index, visible, survey);
            }
            if step > 0 && !self.continues_behind_surfaces {
                return;
            }
            self.update_body_depths(&crossing, &mut depths, seen, survey);
            self.survey_glass_contact(ray, (&crossing, seen), &mut depths, survey);
            copies.cross_surface(
                self.scene_facts,
                &hit,
                (crossing.object, crossing.enters),
                seen,
                survey,
            );
        }
    }

    /// Updates the depth of a ray within each glass body at a crossing.
    fn update_body_depths(
        &self,
        crossing: &RayCrossing<R>,
        depths: &mut BTreeMap<usize, i64>,
        seen: RayPoint,
        survey: &mut RaySurvey,
    ) {
        let object_facts = &self.scene_facts.objects[crossing.object];
        if object_facts.surface_kind != SurfaceKind::Body || object_facts.hides_back_faces() {
            return;
        }
        if crossing.enters {
            let around = depths
                .iter()
                .filter(|(object, depth)| **depth > 0 && **object != crossing.object);
            let mut materials = vec![object_facts.material.map(|(index, _)| index)];
            for (&other, _) in around {
                record_sighting(&mut survey.nested, [other, crossing.object], seen);
                materials.push(
                    self.scene_facts.objects[other]
                        .material
                        .map(|(index, _)| index),
                );
            }
            materials.sort_unstable();
            materials.dedup();
            if materials.len() > MAX_MEDIA {
                record_sighting(&mut survey.beyond_most_bodies, crossing.object, seen);
            }
        }
        *depths.entry(crossing.object).or_insert(0) += if crossing.enters { 1 } else { -1 };
    }
}
