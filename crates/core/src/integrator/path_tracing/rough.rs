//! Vertices on common surfaces, rough and opaque without layers, by far the most of real models: their normals, points of lamps, responses to
//! light and next directions are computed several at a time. Shadow rays go one by one between.

use core::f64::consts::PI;

use arrayvec::ArrayVec;
use raywright_bvh::{Hit, Real};

use super::classic::matte;
use super::direct::LightQuery;
use super::scatter::Scattering;
use super::shade::{LANES, bend, shade};
use super::{PathState, PathTracer};
use crate::interaction::Interaction;
use crate::light::{ChosenLight, LightSample};
use crate::material::{Bent, MetallicRoughness};
use crate::prepare::Material;

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
    #[inline(always)]
    fn of(&self, vertex: &RoughVertex<R>) -> (&PathState<R>, &Interaction<R>) {
        let place = vertex.place as usize;
        (&self.paths[self.going[place] as usize], &self.met[place])
    }
}

/// A vertex on a common surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughVertex<R: Real> {
    /// Its place among the paths that met something.
    place: u32,
    pub model: MetallicRoughness<R>,
    bent: Option<Bent<R>>,
    /// Factor on lights without size, whose unit is not the same to both families of materials.
    gain: R,
    pub query: Option<LightQuery<R>>,
}

/// Vertices on common surfaces by whether they reflect anything, and what lights are asked for them; kept, so that its lists are made once.
#[derive(Default)]
pub(super) struct RoughVertices<R: Real> {
    matte: Vec<RoughVertex<R>>,
    glossy: Vec<RoughVertex<R>>,
    chosen: Vec<Option<ChosenLight<R>>>,
    samples: Vec<Option<LightSample<R>>>,
}

impl<R: Real> RoughVertices<R> {
    pub fn clear(&mut self) {
        self.matte.clear();
        self.glossy.clear();
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
        if path.traced + 1 >= self.max_depth {
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
        let bent = bump.map(|bump| at.bending(bump, scene, &path.leg, hit));
        let list = if is_physical { &mut vertices.glossy } else { &mut vertices.matte };
        list.push(RoughVertex { place, model, bent, gain, query: None });
        true
    }

    /// Shades these vertices and sends their paths on; those that have an end are told.
    pub(super) fn shade_gathered(
        &mut self,
        mut bounce: Bounce<'_, R>,
        vertices: &mut RoughVertices<R>,
        mut ended: impl FnMut(u32),
    ) {
        vertices.glossy.chunks(LANES).for_each(|vertices| bend_normals(&mut bounce, vertices));
        self.sample_lights(&bounce, vertices);
        self.shade_each::<true>(&mut bounce, &vertices.matte, &mut ended);
        self.shade_each::<false>(&mut bounce, &vertices.glossy, &mut ended);
    }

    /// Draws the lights that vertices ask.
    fn sample_lights(&self, bounce: &Bounce<'_, R>, vertices: &mut RoughVertices<R>) {
        let RoughVertices { matte, glossy, chosen, samples } = vertices;
        for list in [matte, glossy] {
            chosen.clear();
            chosen.extend(list.iter().map(|vertex| {
                let (path, at) = bounce.of(vertex);
                self.choose_light(path, at, at.normal)
            }));
            self.scene.lights.sample_each(chosen, samples);
            for ((vertex, chosen), sample) in list.iter_mut().zip(&*chosen).zip(&*samples) {
                let (_, at) = bounce.of(vertex);
                if let (Some(chosen), Some(sample)) = (chosen, sample) {
                    vertex.query = self.query_of(chosen.light, sample, at, at.normal, false);
                }
            }
        }
    }

    /// Adds what vertices send back of the lights that they asked, and sends their paths on.
    #[inline(always)]
    fn shade_each<const MATTE: bool>(
        &mut self,
        bounce: &mut Bounce<'_, R>,
        vertices: &[RoughVertex<R>],
        ended: &mut impl FnMut(u32),
    ) {
        for vertices in vertices.chunks(LANES) {
            let shaded = {
                let of = |vertex| {
                    let (path, at) = bounce.of(vertex);
                    (vertex, path, at)
                };
                let these: ArrayVec<_, LANES> = vertices.iter().map(of).collect();
                shade::<R, MATTE>(&these, self.scene.compensates)
            };
            for (vertex, shaded) in vertices.iter().zip(shaded.iter().flatten()) {
                let place = vertex.place as usize;
                let (path, at) = (&mut bounce.paths[bounce.going[place] as usize], &bounce.met[place]);
                if let Some(query) = &vertex.query {
                    self.add_direct(path, at, query, (&shaded.light, vertex.gain));
                }
                let normal = at.normal;
                let scattering = Scattering { normal, lit: normal, bent: None, coated: false };
                let goes_on =
                    bounce.hits[place].as_ref().is_some_and(|hit| self.scatter(path, hit, at, &shaded.scattered, scattering));
                if !goes_on {
                    ended(vertex.place);
                }
            }
        }
    }
}

/// Bends the normals of some vertices.
fn bend_normals<R: Real>(bounce: &mut Bounce<'_, R>, vertices: &[RoughVertex<R>]) {
    let bumpy = || vertices.iter().filter_map(|vertex| vertex.bent.as_ref().map(|bent| (vertex.place, bent)));
    let these: ArrayVec<_, LANES> = bumpy().map(|(_, bent)| bent).collect();
    if !these.is_empty() {
        bumpy().zip(bend(&these)).for_each(|((place, _), normal)| bounce.met[place as usize].normal = normal);
    }
}
