//! Camera rays that continue through all surfaces, and rays that start at the first surface.

use std::collections::btree_map::Entry;

use super::facts::HITS;
use super::*;
use crate::integrator::PathSegment;
use crate::interaction::Interaction;
use crate::prepare::{PreparedMaterial, PreparedSpawnRule};

/// `GRID`: numbers of rays along the picture's width and height in a round. `ROUNDS`: number of
/// rounds.
const GRID: [u64; 2] = [160, 90];
const ROUNDS: u64 = 4;
/// Number of rays that start at each first hit.
const STARTS: u64 = 2;
/// Half the length around a hit in which other surfaces count as being in the same place, in units of
/// the hit's error, and the greatest number of surfaces that are looked for there.
const PLACE_REACH: f64 = 256.0;
const PLACE_HITS: usize = 64;
/// Greatest separation, in units of the sum of two hits' errors, of surfaces that shadow each other.
const SHADOWED: f64 = 4.0;
/// Least length of a ray in two copies of a generator that overlap, as a share of the ray's length.
/// Copies that touch may be crossed in any order.
const OVERLAP: f64 = 1e-4;
/// End of a colour's range, slightly above 1 to allow for rounding.
const MAX_IN_RANGE: f64 = 1.0 + 1e-5;

/// Task that traces the rays of a camera. Rounds are only traced in full.
pub(super) struct RaySurveyTask<'a> {
    facts: &'a SceneFacts<'a>,
    /// Size of the prepared picture.
    size: [u32; 2],
    deadline: &'a RayDeadline<'a>,
}

impl PreparedSceneTask for RaySurveyTask<'_> {
    type Output = RaySurvey;

    fn run<R: Real>(&self, prepared: &PreparedScene<R>) -> RaySurvey {
        let objects = &self.facts.objects;
        let (has_body, has_one_sided) = (
            objects.iter().any(ObjectFacts::is_body),
            objects.iter().any(ObjectFacts::hides_back_faces),
        );
        let mut survey = RaySurvey {
            planned: ROUNDS * GRID[0] * GRID[1],
            ..RaySurvey::default()
        };
        for round in 0..ROUNDS {
            if self.deadline.has_passed() && round > 0 {
                break;
            }
            let row = |row: u64| {
                let mut survey = RaySurvey::default();
                for column in 0..GRID[0] {
                    let index = (round * GRID[1] + row) * GRID[0] + column;
                    let mut tracer = SurveyRay {
                        facts: self.facts,
                        prepared,
                        has_body,
                        has_one_sided,
                        ray: self.generate_ray(prepared, [column, row], index),
                        index,
                        survey: &mut survey,
                    };
                    tracer.trace();
                }
                survey
            };
            let rows = (0..GRID[1]).into_par_iter().map(row);
            survey = rows
                .reduce(RaySurvey::default, RaySurvey::combine)
                .combine(survey);
        }
        survey.separate_bodies_around_camera();
        survey
    }
}

impl<'a> RaySurveyTask<'a> {
    pub fn new(
        facts: &'a SceneFacts<'a>,
        ready: &ReadyScene,
        deadline: &'a RayDeadline<'a>,
    ) -> Self {
        Self {
            facts,
            size: ready.settings().size,
            deadline,
        }
    }

    fn generate_ray<R: Real>(
        &self,
        prepared: &PreparedScene<R>,
        cell: [u64; 2],
        index: u64,
    ) -> Ray<R> {
        let number = |dimension| unit_random(self.facts.settings.seed, index, dimension);
        let at = |axis: usize| {
            let share = (cell[axis] as f64 + number(axis as u64)) / GRID[axis] as f64;
            R::from_f64(share * f64::from(self.size[axis]))
        };
        let lens = [2, 3].map(|dimension| (number(dimension) as f32).min(0.999_999));
        let (x, y, time) = (at(0), at(1), number(4) as f32);
        prepared.camera.generate_timed_ray(x, y, lens, time)
    }
}

/// A surface that a ray crosses.
struct Crossing<R: Real> {
    object: usize,
    primitive: u32,
    surface: Surface<R>,
    enters: bool,
    at: Sighting,
}

/// A ray of the survey.
struct SurveyRay<'a, R: Real> {
    facts: &'a SceneFacts<'a>,
    prepared: &'a PreparedScene<R>,
    /// Whether the scene has a body of glass, so that rays continue behind the second surface, and
    /// whether an object is hidden from one side.
    has_body: bool,
    has_one_sided: bool,
    ray: Ray<R>,
    index: u64,
    survey: &'a mut RaySurvey,
}

impl<R: Real> SurveyRay<'_, R> {
    fn trace(&mut self) {
        self.survey.rays += 1;
        if let Some(hit) = self.closest(&self.ray, Interval::positive()) {
            self.survey.hits += 1;
            self.survey_first_hit(&hit);
            self.survey_surfaces_in_place(&hit);
        }
        self.ray.is_camera_ray = false;
        self.survey_all_surfaces();
    }

    fn closest(&self, ray: &Ray<R>, range: Interval<R>) -> Option<Hit<R>> {
        self.prepared.geometry.closest(ray, range, &mut ())
    }

    fn crossing(&self, ray: &Ray<R>, hit: &Hit<R>) -> Crossing<R> {
        let surface = self.prepared.geometry.surface(ray, hit);
        Crossing {
            object: self.facts.object_of_hit(hit).index,
            primitive: hit.primitive,
            enters: surface.normal.dot(ray.direction) < R::ZERO,
            at: Sighting {
                count: 1,
                position: self.prepared.to_world(surface.point),
                value: 0.0,
                ray: self.index,
                distance: hit.t.to_f64(),
            },
            surface,
        }
    }

    /// Records the first hit of the ray: values of the material, overlapping objects, normals, and
    /// rays that start there.
    fn survey_first_hit(&mut self, hit: &Hit<R>) {
        let segment = PathSegment {
            ray: self.ray,
            ..PathSegment::from_camera(self.prepared)
        };
        let interaction = Interaction::from_hit(self.prepared, &segment, hit);
        let Crossing { object, at, .. } = self.crossing(&self.ray, hit);
        self.survey.add(RayEvent::FirstHit(object), at);
        if !interaction.outside {
            self.survey.add(RayEvent::FirstHitInside(object), at);
        }
        let topology = self.facts.topology(&self.facts.objects[object]);
        let opposed = topology.map(|topology| &topology.faults.opposed_normals);
        if opposed.is_some_and(|tally| tally.some.contains(&hit.primitive)) {
            self.survey.add(RayEvent::OpposedNormals(object), at);
        }
        self.survey_material(&interaction, at);
        for start in 0..STARTS {
            self.survey_spawned_ray(&interaction, hit, start);
        }
    }

    /// Records values of the material that are not finite, or else a base colour above 1.
    fn survey_material(&mut self, interaction: &Interaction<R>, at: Sighting) {
        let context = self.prepared.texture_tables.shading_context(interaction);
        let index = interaction.material as usize;
        let material = &self.prepared.materials[index];
        let colour = |x: R::Vec3| x.to_f64();
        let number = |x: R| DVec3::splat(x.to_f64());
        let mut values = vec![("emission", colour(material.emission_at(&context)))];
        match material {
            PreparedMaterial::Classic(m) => values.extend([
                ("colour", colour(m.colour.eval_colour(&context))),
                ("local", number(m.local.eval_number(&context))),
            ]),
            PreparedMaterial::Physical(m) => values.extend([
                ("base_colour", colour(m.base_colour_at(&context))),
                ("roughness", number(m.roughness.eval_number(&context))),
                ("metallic", number(m.metallic.eval_number(&context))),
                ("opacity", number(m.opacity.eval_number(&context))),
            ]),
            PreparedMaterial::Unused => return,
        }
        let is_colour = |&&(key, value): &&(&str, DVec3)| {
            key == "base_colour" && value.max_element() > MAX_IN_RANGE
        };
        if let Some(&(key, _)) = values.iter().find(|(_, value)| !value.is_finite()) {
            self.survey.add(RayEvent::NotNumber(index, key), at);
        } else if let Some((_, colour)) = values.iter().find(is_colour) {
            let value = colour.max_element();
            let at = Sighting { value, ..at };
            self.survey.add(RayEvent::ColourAboveOne(index), at);
        }
    }

    /// Traces a random ray from the visible side of a surface. Records whether it hits the same
    /// primitive again, and whether it starts behind another surface.
    fn survey_spawned_ray(&mut self, interaction: &Interaction<R>, hit: &Hit<R>, start: u64) {
        let (prepared, surface) = (self.prepared, &interaction.surface);
        let seed = self.facts.settings.seed;
        let number = |dimension: u64| unit_random(seed, self.index, 8 + 2 * start + dimension);
        let (z, (sin, cos)) = (2.0 * number(0) - 1.0, libm::sincos(number(1) * TAU));
        let ring = (1.0 - z * z).sqrt();
        let side = surface.normal.to_f64() * if interaction.outside { 1.0 } else { -1.0 };
        let ball = DVec3::new(ring * cos, ring * sin, z);
        let Some(direction) = (side + ball * 0.99).try_normalize() else {
            return;
        };
        let direction = R::Vec3::from_f64(direction);
        let ray = prepared.spawn_ray(interaction, direction, R::ONE);
        let ray = ray.with_time(interaction.time);
        let Crossing { object, at, .. } = self.crossing(&self.ray, hit);
        self.survey.spawned_rays += 1;
        let is_same =
            |other: &Hit<R>| (other.tie_order(), other.instance) == (hit.tie_order(), hit.instance);
        let range = Interval {
            min: prepared.min_hit_distances().secondary,
            max: R::INFINITY,
        };
        if let Some(other) = self.closest(&ray, range) {
            let is_opaque = |object: usize| self.facts.objects[object].is_opaque();
            let again = self.crossing(&ray, &other);
            let is_near = separation(surface, &again.surface, SHADOWED).is_some();
            if is_same(&other) && other.t <= surface.error * R::from_f64(SHADOWED) {
                self.survey.add(RayEvent::SelfHit(object), at);
            } else if !is_same(&other) && is_near && is_opaque(object) && is_opaque(again.object) {
                let pair = [object.min(again.object), object.max(again.object)];
                self.survey.add(RayEvent::TwinShadow(pair), at);
            }
        }
        if matches!(prepared.rules.spawn, PreparedSpawnRule::Constant { .. }) {
            let own = surface.spawn_ray_origin(direction);
            let offset = ray.origin - own;
            let length = offset.length();
            let ray = Ray::new(own, offset / length).with_time(interaction.time);
            let range = Interval {
                min: R::ZERO,
                max: length,
            };
            // Its own surface is looked at above.
            if length > R::ZERO
                && self
                    .closest(&ray, range)
                    .is_some_and(|other| !is_same(&other))
            {
                self.survey.add(RayEvent::StartBehindSurface(object), at);
            }
        }
    }

    /// Records the objects of other materials that the ray could hit in place of the first surface,
    /// by rounding or by their order in the file. Bodies that stand back to back hide each other's
    /// faces.
    fn survey_surfaces_in_place(&mut self, hit: &Hit<R>) {
        let (facts, first) = (self.facts, self.crossing(&self.ray, hit));
        let own = &facts.objects[first.object];
        for other in self.surfaces_in_place(&first) {
            let others = &facts.objects[other.object];
            let is_back_to_back = first.enters != other.enters
                && facts.is_closed_body(own)
                && facts.is_closed_body(others);
            let value = separation(&first.surface, &other.surface, self.place_reach());
            let is_told = is_back_to_back || own.object.material == others.object.material;
            if let Some(value) = value.filter(|_| !is_told) {
                let event = RayEvent::InPlace([first.object, other.object]);
                self.survey.add(event, Sighting { value, ..first.at });
            }
        }
    }

    /// Returns the surfaces of other objects in the place of a surface, those at the same distance
    /// too, of which a query returns one alone. The place is as large in double precision.
    fn surfaces_in_place(&self, crossing: &Crossing<R>) -> Vec<Crossing<R>> {
        let mut found = Vec::new();
        let mut visit = |hit: &Hit<R>| {
            found.push(self.crossing(&self.ray, hit));
            found.len() >= PLACE_HITS
        };
        let geometry = &self.prepared.geometry;
        geometry.visit_hits(&self.ray, self.place_range(crossing), &mut visit);
        found.sort_by_key(|other| other.object);
        found.dedup_by_key(|other| other.object);
        found.retain(|other| other.object != crossing.object);
        found
    }

    /// Returns [`PLACE_REACH`], in units of the errors in the scalar of the prepared scene.
    fn place_reach(&self) -> f64 {
        PLACE_REACH * self.facts.unit_roundoff() / R::ROUNDOFF.to_f64()
    }

    /// Returns the distances within the place of a surface.
    fn place_range(&self, crossing: &Crossing<R>) -> Interval<R> {
        let half = crossing.surface.error * R::from_f64(self.place_reach());
        let at = R::from_f64(crossing.at.distance);
        Interval {
            min: at - half,
            max: at + half,
        }
    }

    /// Follows the ray through all surfaces, with backs visible too, and records the order of the
    /// surfaces.
    fn survey_all_surfaces(&mut self) {
        let (ray, prepared) = (self.ray, self.prepared);
        // Of each body, how often the ray has entered it more often than left it.
        let mut depths = BTreeMap::<usize, i64>::new();
        let mut first_points = BTreeMap::<usize, Sighting>::new();
        // Copies of generators that the ray has entered.
        let mut copies: Vec<(usize, u32, Sighting)> = Vec::new();
        let mut has_overlap = false;
        let mut hits = hits_along_ray(&prepared.geometry, &ray, Interval::positive());
        for step in 0..2 * HITS {
            let hit = hits.next();
            let crossing = hit.as_ref().map(|hit| self.crossing(&ray, hit));
            if step == 0 && self.has_one_sided {
                self.survey_hidden_backs(crossing.as_ref());
            }
            let Some((hit, crossing)) = hit.zip(crossing) else {
                return self.survey_unclosed_bodies(&depths, &first_points);
            };
            let Crossing { object, at, .. } = crossing;
            if let Entry::Vacant(entry) = first_points.entry(object) {
                entry.insert(at);
                self.survey.add(RayEvent::Crossed(object), at);
            }
            if step > 0 && !self.has_body {
                return;
            }
            let facts = self.facts;
            let body = &facts.objects[object];
            if body.is_body() && !body.hides_back_faces() {
                if crossing.enters {
                    self.survey_entry(object, at, &depths);
                }
                *depths.entry(object).or_insert(0) += if crossing.enters { 1 } else { -1 };
                if facts.generator(object).is_some() {
                    let overlap = cross_copy(&mut copies, hit.outermost_id(), &crossing);
                    if let Some(at) =
                        overlap.filter(|_| !core::mem::replace(&mut has_overlap, true))
                    {
                        self.survey.add(RayEvent::Nested([object; 2]), at);
                    }
                }
            }
            self.survey_glass_contact(&crossing, &mut depths);
        }
    }

    /// Records the bodies around a body that the ray enters.
    fn survey_entry(&mut self, object: usize, at: Sighting, depths: &BTreeMap<usize, i64>) {
        for (&other, _) in depths.iter().filter(|(_, depth)| **depth > 0) {
            let event = match other == object {
                true => RayEvent::Layered(object),
                false => RayEvent::Nested([other, object]),
            };
            self.survey.add(event, at);
        }
    }

    /// Records the bodies that the ray entered and left unequally often, at its end.
    fn survey_unclosed_bodies(
        &mut self,
        depths: &BTreeMap<usize, i64>,
        first_points: &BTreeMap<usize, Sighting>,
    ) {
        for (&object, &depth) in depths.iter().filter(|(_, depth)| **depth != 0) {
            let event = match depth {
                -1 => RayEvent::AroundCamera(object),
                _ => RayEvent::Unbalanced(object),
            };
            if let Some(&at) = first_points.get(&object) {
                self.survey.add(event, at);
            }
        }
    }

    /// Surveys a crossing at which glass and an opaque object touch and the ray hits only one of
    /// them, as both are at the same distance. Counts the boundary of the glass as crossed. Records
    /// that the opaque object is lost.
    ///
    /// If rays hit the opaque surface, the picture is that of glass that reaches into the object:
    /// light is reflected within the glass. If they hit the glass, light leaves it and starts beyond
    /// the opaque surface.
    fn survey_glass_contact(&mut self, crossing: &Crossing<R>, depths: &mut BTreeMap<usize, i64>) {
        let facts = self.facts;
        let own = &facts.objects[crossing.object];
        if !own.is_body() && !own.is_opaque() {
            return;
        }
        let range = self.place_range(crossing);
        let hits = hits_along_ray(&self.prepared.geometry, &self.ray, range).take(PLACE_HITS);
        let hits: Vec<usize> = hits.map(|hit| facts.object_of_hit(&hit).index).collect();
        for other in self.surfaces_in_place(crossing) {
            let others = &facts.objects[other.object];
            if hits.contains(&other.object) {
                continue;
            }
            if own.is_body() && others.is_opaque() {
                let event = RayEvent::ContactLost([crossing.object, other.object]);
                self.survey.add(event, crossing.at);
            } else if own.is_opaque() && others.is_body() && !others.hides_back_faces() {
                *depths.entry(other.object).or_insert(0) += if other.enters { 1 } else { -1 };
            }
        }
    }

    /// Records the ray's first surface if it is hidden from the camera, or flipped. `visible` is the
    /// first surface that the ray hits.
    fn survey_hidden_backs(&mut self, visible: Option<&Crossing<R>>) {
        let side = |crossing: &Crossing<R>| self.facts.objects[crossing.object].object.side;
        let back = self.nearest_hidden_back(visible.map(|crossing| crossing.at.distance));
        // Only camera rays pass through the backs of culled surfaces.
        let is_culled =
            |crossing: &&Crossing<R>| side(crossing) == SideRule::Culled && !crossing.enters;
        let hidden = back.as_ref().or(visible.filter(is_culled));
        let Some(surface) = hidden.or(visible) else {
            return;
        };
        let (object, at) = (surface.object, surface.at);
        let facts = &self.facts.objects[object];
        let topology = self.facts.topology(facts);
        let [is_inside_out, is_flipped] = match topology.filter(|_| facts.hides_back_faces()) {
            Some(topology) => topology.orientation_of(surface.primitive, hidden.is_some()),
            None => [false; 2],
        };
        let fault = match (hidden.is_some(), is_inside_out, is_flipped) {
            (true, true, _) => Some(RayEvent::InsideOutHidden(object)),
            (true, false, true) => Some(RayEvent::FlippedHidden(object)),
            (false, false, true) => Some(RayEvent::FlippedShown(object)),
            _ => None,
        };
        let back = hidden.map(|_| RayEvent::HiddenBack(object));
        for event in back.into_iter().chain(fault) {
            self.survey.add(event, at);
        }
    }

    /// Returns the first surface on the ray, up to a distance, that no ray hits from this side. A ray
    /// in the opposite direction hits it.
    fn nearest_hidden_back(&self, end: Option<f64>) -> Option<Crossing<R>> {
        let origin = self.prepared.to_world(self.ray.origin);
        let beyond =
            || origin.distance(self.facts.bounds.centre()) + 2.0 * self.facts.largest_extent();
        let end = end.unwrap_or_else(beyond);
        let way_back = Ray {
            origin: self.ray.at(R::from_f64(end)),
            direction: -self.ray.direction,
            ..self.ray
        };
        let range = Interval {
            min: R::ZERO,
            max: R::from_f64(end),
        };
        let is_one_sided = |hit: &Hit<R>| {
            let side = self.facts.object_of_hit(hit).object.side;
            matches!(side, SideRule::Outside | SideRule::Inside)
        };
        let hits = hits_along_ray(&self.prepared.geometry, &way_back, range).take(2 * HITS);
        let hit = hits.filter(is_one_sided).last()?;
        let mut crossing = self.crossing(&way_back, &hit);
        crossing.at.distance = end - crossing.at.distance;
        Some(crossing)
    }
}

/// Returns the separation of two parallel surfaces in metres. `None` if they are not parallel, or
/// further apart than `errors` times the sum of their hits' errors.
fn separation<R: Real>(a: &Surface<R>, b: &Surface<R>, errors: f64) -> Option<f64> {
    let [m, n] = [a, b].map(|surface| surface.normal.to_f64());
    let apart = (b.point.to_f64() - a.point.to_f64()).dot(m).abs();
    let error = a.error.to_f64() + b.error.to_f64();
    (m.dot(n).abs() > 1.0 - 1e-6 && apart <= errors * error).then_some(apart)
}

/// Adds a copy of a generator that a ray enters. Of one that it leaves, returns the point at which the
/// ray has entered another copy of the generator while inside this one: at touching copies, rounding may
/// hide that from the ray.
fn cross_copy<R: Real>(
    copies: &mut Vec<(usize, u32, Sighting)>,
    copy: u32,
    crossing: &Crossing<R>,
) -> Option<Sighting> {
    if crossing.enters {
        copies.push((crossing.object, copy, crossing.at));
        return None;
    }
    let start = copies
        .iter()
        .rfind(|(_, other, _)| *other == copy)?
        .2
        .distance;
    let inside = start..crossing.at.distance * (1.0 - OVERLAP);
    let is_inside = |(object, other, at): &&(usize, u32, Sighting)| {
        *object == crossing.object && *other != copy && inside.contains(&at.distance)
    };
    Some(copies.iter().find(is_inside)?.2)
}
