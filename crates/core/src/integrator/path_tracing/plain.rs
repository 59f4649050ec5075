//! Vertices on plain rough surfaces, by far the most of real models: their normals, answers to light and ways on are computed several at
//! a time, with the bits that each would have alone. What goes by itself in any case, lights and rays, goes one by one between.

mod lanes;

use core::array::from_fn;
use core::f64::consts::PI;

use raywright_bvh::{Hit, Real};

use lanes::{Shaded, bend, is_single, one, shade};

use super::classic::matte;
use super::lights::{LightQuery, MisStrategy};
use super::vertex::Leaves;
use super::weight;
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::LightId;
use crate::material::{Bent, MetallicRoughness};
use crate::number::Lanes;
use crate::prepare::Material;

/// Vertices that are computed at a time.
const LANES: usize = 8;

/// A segment of many paths.
pub(super) struct Bounce<'a, R: Real> {
    pub paths: &'a mut [PathState<R>],
    /// Those that met something, by their places.
    pub going: &'a [u32],
    /// What they hit, and what that is, in their order.
    pub hits: &'a [Option<Hit<R>>],
    pub met: &'a mut [Interaction<R>],
}

impl<R: Real> Bounce<'_, R> {
    /// The path that comes to a vertex, and what it met there.
    fn of(&self, plain: &Plain<R>) -> (&PathState<R>, &Interaction<R>) {
        let place = plain.place as usize;
        (&self.paths[self.going[place] as usize], &self.met[place])
    }
}

/// A vertex on a plain surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plain<R: Real> {
    /// Its place among the paths that met something.
    place: u32,
    model: MetallicRoughness<R>,
    bent: Option<Bent<R>>,
    /// Factor on lights without size, whose unit is not the same to both families of materials.
    gain: R,
    query: Option<LightQuery<R>>,
}

impl<R: Real> PathTracer<'_, R> {
    /// Whether what a path met is to be one of these vertices, with what that takes; done with what only needs the point itself.
    #[inline(always)]
    pub(super) fn plain(&mut self, place: u32, path: &mut PathState<R>, hit: &Hit<R>, at: &Interaction<R>) -> Option<Plain<R>> {
        let scene = self.scene;
        if path.traced + 1 >= self.max_depth {
            return None;
        }
        let (material, here) = (&scene.materials[at.material as usize], scene.sources.at(at));
        let (mut model, gain, bump) = match material {
            Material::Physical(m) if m.plain => (m.model_at(&here), R::ONE, m.bump.as_ref()),
            Material::Classic(m) if m.matte => (matte(m, &here), R::from_f64(PI), None),
            _ => return None,
        };
        if !model.is_rough() {
            return None;
        }
        self.pass_media(path, at);
        self.keep_first(path, hit);
        path.hit = true;
        path.traced += 1;
        if material.glows() {
            self.emits(path, hit, at, material.emission_at(&here));
        }
        // What a matte surface diffuses knows no index.
        if self.nests() && matches!(material, Material::Physical(_)) {
            self.immersed(path, at, &here, &mut model);
        }
        let bent = bump.map(|bump| at.bending(bump, scene, &path.leg, hit));
        Some(Plain { place, model, bent, gain, query: None })
    }

    /// Adds what these surfaces send back along their paths, and sends the paths on; those that have an end are told.
    pub(super) fn plains(&mut self, mut round: Bounce<'_, R>, plains: &mut [Plain<R>], mut ended: impl FnMut(u32)) {
        plains.chunks(LANES).for_each(|plains| self.bend(&mut round, plains));
        self.ask_lights(&round, plains);
        for plains in plains.chunks(LANES) {
            let shaded = self.shaded(&round, plains);
            for (plain, shaded) in plains.iter().zip(shaded.iter().flatten()) {
                if !self.sent(&mut round, plain, shaded) {
                    ended(plain.place);
                }
            }
        }
    }

    /// Draws the lights that some vertices ask; those that ask the sky look there together.
    fn ask_lights(&self, round: &Bounce<'_, R>, plains: &mut [Plain<R>]) {
        let lights = &self.scene.lights;
        let (mut sky, mut seen) = (Vec::<(usize, R::Vec3, f64)>::with_capacity(plains.len()), Vec::new());
        for (k, plain) in plains.iter_mut().enumerate() {
            let (path, at) = round.of(plain);
            let Some((light, probability)) = self.chosen(path, at, at.normal) else { continue };
            let [.., u, v] = path.draws.light;
            match (light, lights.sky_sampler()) {
                (LightId::Sky, Some(sampler)) => sky.push((k, sampler.drawn::<R>([u, v]), probability)),
                _ => {
                    let drawn = lights.sample(light, at.surface.point, [u, v], probability);
                    plain.query = drawn.and_then(|drawn| self.query_of(light, drawn, at, at.normal, false));
                }
            }
        }
        let from = |k: usize| round.of(&plains[k]).1.surface.point;
        lights.sky.look(sky.iter().map(|&(k, direction, _)| (from(k), direction)), &mut seen);
        for (&(k, direction, probability), seen) in sky.iter().zip(&seen) {
            let (_, at) = round.of(&plains[k]);
            let drawn = lights.sky_sampler().and_then(|sampler| sampler.sample_seen(direction, seen, probability));
            plains[k].query = drawn.and_then(|drawn| self.query_of(LightId::Sky, drawn, at, at.normal, false));
        }
    }

    /// Bends the normals of some vertices.
    fn bend(&self, round: &mut Bounce<'_, R>, plains: &[Plain<R>]) {
        let bumpy = || plains.iter().filter_map(|plain| plain.bent.as_ref().map(|bent| (plain.place, bent)));
        let Some((_, first)) = bumpy().next() else { return };
        let (mut these, mut count) = ([first; LANES], 0);
        for (slot, (_, bent)) in these.iter_mut().zip(bumpy()) {
            *slot = bent;
            count += 1;
        }
        let these = &these[..count];
        let places = bumpy().map(|(place, _)| place as usize);
        if is_single::<R>() {
            let normals = bend::<R>(these);
            places.zip(normals).for_each(|(place, normal)| round.met[place].normal = normal);
        } else {
            places.zip(these).for_each(|(place, bent)| round.met[place].normal = bent.bent());
        }
    }

    /// What some vertices answer.
    #[inline(always)]
    fn shaded(&self, round: &Bounce<'_, R>, plains: &[Plain<R>]) -> [Option<Shaded<R>>; LANES] {
        let of = |lane: usize| {
            let plain = &plains[lane.min(plains.len() - 1)];
            let (path, at) = round.of(plain);
            (plain, path, at)
        };
        let (these, compensated) = (from_fn::<_, LANES, _>(of), self.scene.compensates);
        let mut out = [None; LANES];
        if is_single::<R>() {
            let all = shade::<Lanes<LANES>, R>(&these, compensated);
            for (lane, out) in out.iter_mut().enumerate() {
                *out = Some(one(&all, lane));
            }
        } else {
            for (these, out) in these.chunks(1).zip(&mut out) {
                *out = Some(shade::<R, R>(these, compensated));
            }
        }
        out
    }

    /// Adds what a vertex sends back of the light that it asked, and sends the path on; whether it goes on.
    #[inline(always)]
    fn sent(&mut self, round: &mut Bounce<'_, R>, plain: &Plain<R>, shaded: &Shaded<R>) -> bool {
        let place = plain.place as usize;
        let (path, at) = (&mut round.paths[round.going[place] as usize], &round.met[place]);
        let Some(hit) = &round.hits[place] else { return false };
        if let Some(query) = plain.query {
            let answer = match query.strategy {
                MisStrategy::Value => (shaded.answer, R::ONE),
                MisStrategy::Delta { shines: true } => (shaded.answer, plain.gain),
                MisStrategy::Delta { .. } => (shaded.diffuse, plain.gain),
                MisStrategy::Weighed(density) => (shaded.answer, R::from_f64(weight(density, shaded.density.to_f64()))),
            };
            let sent = self.direct_light(path, at, query, answer);
            path.radiance += path.throughput * sent;
        }
        let luck = R::from_f32(path.draws.scatter[3]);
        let normal = at.normal;
        self.leaves(path, hit, at, &shaded.drawn, Leaves { normal, lit: normal, luck, bent: None, coated: false })
    }
}
