//! Vertices on common surfaces, rough and opaque without layers, by far the most of real models: their normals, points of lamps, responses to
//! light and next directions are computed several at a time. Shadow rays go one by one between.

use core::array::from_fn;
use core::f64::consts::PI;

use raywright_bvh::{Hit, Interval, Ray, Real, Vector, widest};

use super::classic::matte;
use super::respond::perturbed_normals;
use super::scatter::ScatteredRay;
use super::shade::{Shade, ShadedLanes};
use super::vertices::{VertexLanes, VertexList};
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::{ChoiceQuery, ChosenLight, LANES, LightLanes, TargetKind, put, vector};
use crate::material::NormalMap;
use crate::prepare::{Material, Spawn};

/// A segment of many paths.
pub(super) struct Bounce<'a, R: Real> {
    pub paths: &'a mut [PathState<R>],
    /// Those that met something, by their places.
    pub going: &'a [u32],
    /// What they met, in their order.
    pub met: &'a mut [Interaction<R>],
}

impl<R: Real> Bounce<'_, R> {
    /// The path that comes to a vertex, and what it met there.
    #[inline(always)]
    fn of(&self, place: u32) -> (&PathState<R>, &Interaction<R>) {
        (&self.paths[self.going[place as usize] as usize], &self.met[place as usize])
    }
}

/// Vertices on common surfaces by whether they reflect anything, and what lights are asked for them; kept, so that its lists are made once.
#[derive(Default)]
pub(super) struct RoughVertices<R: Real> {
    matte: VertexList<R>,
    glossy: VertexList<R>,
    /// Normals that images bend, with the places of their vertices among the glossy ones.
    bent: Vec<(usize, NormalMap<R>)>,
    chosen: Vec<Option<ChosenLight<R>>>,
    lights: Vec<LightLanes<R>>,
}

impl<R: Real> RoughVertices<R> {
    pub fn clear(&mut self) {
        self.matte.clear();
        self.glossy.clear();
        self.bent.clear();
    }

    /// Bends the normals of those on which images do.
    fn bend_normals(&mut self, met: &mut [Interaction<R>]) {
        let vertices = self.glossy.lanes();
        for these in self.bent.chunks(LANES) {
            let normals = perturbed_normals(|lane| &these[lane.min(these.len() - 1)].1);
            for (&(vertex, _), normal) in these.iter().zip(normals) {
                let (vertices, lane) = (&mut vertices[vertex / LANES], vertex % LANES);
                put::<R>(&mut vertices.normal, lane, normal);
                met[vertices.place[lane] as usize].normal = normal;
            }
        }
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Puts what a path met among these vertices, where it is one, done with what only needs the point itself. Whether it is.
    #[inline(always)]
    pub(super) fn gather_rough(
        &mut self,
        place: u32,
        (path, hit, at): (&mut PathState<R>, &Hit<R>, &Interaction<R>),
        vertices: &mut RoughVertices<R>,
    ) -> bool {
        let scene = self.scene;
        if path.traced - path.matched + 1 >= self.max_depth {
            return false;
        }
        let (material, here) = (&scene.materials[at.material as usize], scene.sources.at(at));
        let (mut model, gain, bump) = match material {
            Material::Physical(m) if m.plain => (m.model_at(&here), R::ONE, m.bump.as_ref()),
            Material::Classic(m) if m.matte => (matte(m, &here), R::from_f64(PI), None),
            _ => return false,
        };
        if !model.is_rough() {
            return false;
        }
        self.pass_media(path, at);
        self.keep_first(path, hit);
        path.hit = true;
        path.traced += 1;
        if material.glows() {
            self.emits(path, hit, at, material.emission_at(&here));
        }
        let is_physical = matches!(material, Material::Physical(_));
        // What a matte surface diffuses knows no index.
        if self.nests() && is_physical {
            self.immersed(path, at, &here, &mut model);
        }
        // Normals are bent among the glossy ones.
        let is_matte = model.is_matte() && bump.is_none();
        let (lanes, index) = if is_matte { vertices.matte.open() } else { vertices.glossy.open() };
        if let Some(bump) = bump {
            vertices.bent.push((index * LANES + lanes.len, at.normal_map(bump, scene, &path.leg, hit)));
        }
        lanes.push(place, (path, at), (&model, gain), scene.roulette);
        true
    }

    /// Shades these vertices and sends their paths on; those that have an end are told.
    pub(super) fn shade_gathered(
        &mut self,
        mut bounce: Bounce<'_, R>,
        vertices: &mut RoughVertices<R>,
        mut ended: impl FnMut(u32),
    ) {
        vertices.bend_normals(bounce.met);
        let RoughVertices { matte, glossy, chosen, lights, .. } = vertices;
        self.shade_each::<true>(&mut bounce, matte.lanes(), (chosen, lights), &mut ended);
        self.shade_each::<false>(&mut bounce, glossy.lanes(), (chosen, lights), &mut ended);
    }

    fn shade_each<const MATTE: bool>(
        &mut self,
        bounce: &mut Bounce<'_, R>,
        vertices: &mut [VertexLanes<R>],
        (chosen, lights): (&mut Vec<Option<ChosenLight<R>>>, &mut Vec<LightLanes<R>>),
        ended: &mut impl FnMut(u32),
    ) {
        self.sample_lights(bounce, vertices, (chosen, lights));
        for ((vertices, chosen), lights) in vertices.iter().zip(chosen.chunks(LANES)).zip(&*lights) {
            let compensated = self.scene.compensates;
            let shaded = widest(Shade::<R, MATTE> { vertices, lights, compensated, reach: self.scene.rules.shadow_max_distance });
            for lane in 0..vertices.len {
                if let Some(chosen) = chosen[lane].as_ref().filter(|_| shaded.is_lit[lane]) {
                    self.add_light(bounce, (vertices, lane), (chosen, lights), &shaded);
                }
                if shaded.goes_on[lane] {
                    self.send_on(bounce, (vertices, lane), &shaded);
                } else {
                    if shaded.overflows[lane] {
                        let place = vertices.place[lane] as usize;
                        bounce.paths[bounce.going[place] as usize].radiance = Vector::splat(R::INFINITY);
                    }
                    ended(vertices.place[lane]);
                }
            }
        }
    }

    /// Samples the lights that vertices ask.
    fn sample_lights(
        &self,
        bounce: &Bounce<'_, R>,
        vertices: &mut [VertexLanes<R>],
        (chosen, lights): (&mut Vec<Option<ChosenLight<R>>>, &mut Vec<LightLanes<R>>),
    ) {
        chosen.clear();
        for vertices in &*vertices {
            let numbers = |lane: usize| bounce.of(vertices.place[lane]).0.draws.light;
            let point = |lane: usize| vertices.surface.lane(lane).point;
            let drawn = self.scene.lights.choice().draw_each::<R, LANES>(from_fn(|lane| {
                (lane < vertices.len).then(|| {
                    let [coarse, fine, ..] = numbers(lane);
                    ChoiceQuery { from: point(lane), normal: vector::<R>(&vertices.normal, lane), numbers: [coarse, fine] }
                })
            }));
            chosen.extend((0..vertices.len).map(|lane| {
                let ([.., u, v], (light, probability)) = (numbers(lane), drawn[lane]?);
                Some(ChosenLight { light, probability, from: point(lane), position: [u, v] })
            }));
        }
        self.scene.lights.sample_each(chosen, lights);
        for ((vertices, chosen), lights) in vertices.iter_mut().zip(chosen.chunks(LANES)).zip(lights) {
            for (lane, chosen) in chosen.iter().enumerate() {
                let asked = chosen.as_ref().filter(|_| lights.aim[lane] != TargetKind::Nothing);
                match asked.and_then(|chosen| self.strategy(chosen.light, lights.density_of(lane))) {
                    Some(strategy) => vertices.strategy[lane] = strategy,
                    None => lights.aim[lane] = TargetKind::Nothing,
                }
            }
        }
    }

    /// Adds what a vertex sends back of a light, as far as it arrives.
    #[inline(always)]
    fn add_light(
        &mut self,
        bounce: &mut Bounce<'_, R>,
        (vertices, lane): (&VertexLanes<R>, usize),
        (&ChosenLight { light, .. }, lights): (&ChosenLight<R>, &LightLanes<R>),
        shaded: &ShadedLanes<R>,
    ) {
        let place = vertices.place[lane] as usize;
        let (path, at) = (&mut bounce.paths[bounce.going[place] as usize], &bounce.met[place]);
        let sent = vector::<R>(&shaded.sent, lane);
        let sent = if self.straight_to_lights(light) && lights.aim[lane] != TargetKind::Target {
            let length = shaded.length[lane];
            // Where the light is where the ray would start, nothing is in between.
            let arrives = if length > R::ZERO && (length < R::INFINITY || lights.aim[lane] == TargetKind::Infinity) {
                let ray = Ray::new(vector::<R>(&shaded.start, lane), vector::<R>(&shaded.towards, lane)).at_time(at.time);
                self.passes(&ray, Interval { min: R::ZERO, max: length }, None, lights.is_sizeless(lane))
            } else {
                R::ONE
            };
            let sent = if arrives > R::ZERO { sent * arrives } else { Vector::ZERO };
            self.usage.count(light, sent != Vector::ZERO);
            sent
        } else {
            self.arriving(path, at, (light, lights.lane(lane), false), sent)
        };
        path.radiance += path.throughput * sent;
    }

    /// Sends a path on in the direction that was drawn.
    #[inline(always)]
    fn send_on(&mut self, bounce: &mut Bounce<'_, R>, (vertices, lane): (&VertexLanes<R>, usize), shaded: &ShadedLanes<R>) {
        let place = vertices.place[lane] as usize;
        let (path, at) = (&mut bounce.paths[bounce.going[place] as usize], &bounce.met[place]);
        let mut ray = shaded.ray(lane);
        if !matches!(self.scene.rules.spawn, Spawn::ErrorBound) {
            ray = self.scene.spawn(at, ray.direction, R::ONE);
        }
        let density = shaded.density[lane].to_f64();
        let onward = ScatteredRay { ray, rest: Vector::ZERO, lit: at.normal, smooth: false, through: false, straight: false };
        self.leave(path, at, (vector::<R>(&shaded.throughput, lane), density), onward);
    }
}
