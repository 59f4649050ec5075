//! Vertices on uncommon surfaces, each with its own lobes: creation, response to lights and
//! sampling. All later stages are shared with common surfaces.

use core::f64::consts::PI;

use raywright_bvh::{Hit, Real, Vector};

use super::super::spawn::stored;
use super::mixture::MixtureSurface;
use super::respond::{Answers, LaneVertex, respond};
use super::scatter::Onward;
use super::vertices::{Bounce, LitSides, VertexLanes, VertexList};
use super::{PathState, PathTracer, classic};
use crate::interaction::Interaction;
use crate::light::{Column, LightLanes, vector};
use crate::material::{Bsdf, Frame, Glass, LayeredBsdf, LobeFamily};
use crate::prepare::Material;

/// Lobes of a surface at a hit.
enum SurfaceLobes<R: Real> {
    Plain(Bsdf<R>),
    /// Index among the layered BSDFs, which are too large to be moved.
    Layered(usize),
    Mixture(MixtureSurface<R>),
}

/// Surfaces of these vertices; kept to reuse the memory of the lists.
#[derive(Default)]
pub(super) struct GeneralSurfaces<R: Real> {
    /// The lobes of each surface, and the glass for exact mirror and refracted directions.
    each: Vec<(SurfaceLobes<R>, Option<Glass<R>>)>,
    layered: Vec<LayeredBsdf<R>>,
    layered_used: usize,
}

impl<R: Real> GeneralSurfaces<R> {
    pub fn clear(&mut self) {
        self.each.clear();
        self.layered_used = 0;
    }

    /// An unused layered BSDF, and its index.
    fn open_layered(&mut self) -> (&mut LayeredBsdf<R>, usize) {
        let place = self.layered_used;
        if place == self.layered.len() {
            self.layered.push(LayeredBsdf::new(Vector::ZERO));
        }
        self.layered_used += 1;
        (&mut self.layered[place], place)
    }
}

/// The sides on which the lobes receive sampled light.
fn sides<R: Real, L: LobeFamily<R>, const MOST: usize>(bsdf: &Bsdf<R, L, MOST>) -> LitSides {
    match (bsdf.is_delta(), bsdf.lets_through()) {
        (true, _) => LitSides::None,
        (false, true) => LitSides::Both,
        (false, false) => LitSides::One,
    }
}

impl<R: Real> PathTracer<'_, R> {
    /// Adds a hit to these vertices. Returns false if its material needs no vertex.
    pub(super) fn gather_general(
        &self,
        place: u32,
        (path, hit, at): (&mut PathState<R>, &Hit<R>, &Interaction<R>),
        (vertices, surfaces): (&mut VertexList<R>, &mut GeneralSurfaces<R>),
    ) -> bool {
        let scene = self.scene;
        let here = scene.sources.at(at);
        let (lobes, glass, (normal, sides, gain)) = match &scene.materials[at.material as usize] {
            Material::Classic(m) => {
                // A delta light's unit is the radiance of a white classic surface facing it, not
                // its irradiance.
                let gain = R::from_f64(PI);
                if let Some(mixture) = &m.mixture {
                    let surface = MixtureSurface::new(mixture, at, m.colour.colour(&here));
                    let sides = surface.sides(mixture);
                    (
                        SurfaceLobes::Mixture(surface),
                        None,
                        (at.facing_normal(), sides, gain),
                    )
                } else {
                    let mut glass = m
                        .transmission
                        .as_ref()
                        .map(|transmission| transmission.glass);
                    if let Some(glass) = glass.as_mut().filter(|_| self.nests()) {
                        glass.ior = self.relative_index(path, at, &here);
                    }
                    let normal = if glass.is_some() {
                        at.facing_normal()
                    } else {
                        at.normal
                    };
                    let bsdf = classic::lobes((m, glass.as_ref()), &here, at, normal);
                    let answers = (normal, sides(&bsdf), gain);
                    (SurfaceLobes::Plain(bsdf), glass, answers)
                }
            }
            Material::Physical(m) => {
                if let Some(layers) = m.layered {
                    let (bsdf, index) = surfaces.open_layered();
                    let glass =
                        self.layers_at(path, hit, at, (m, &scene.layers[layers as usize]), bsdf);
                    (
                        SurfaceLobes::Layered(index),
                        glass,
                        (bsdf.normal(), sides(bsdf), R::ONE),
                    )
                } else {
                    let mut model = m.model_at(&here);
                    if self.nests() {
                        self.immersed(path, at, &here, &mut model);
                    }
                    let normal = if model.glass.is_some() {
                        at.facing_normal()
                    } else {
                        at.normal
                    };
                    let bsdf =
                        model.transport(normal, -at.direction, at.outside, scene.compensates);
                    let answers = (normal, sides(&bsdf), R::ONE);
                    (SurfaceLobes::Plain(bsdf), model.glass, answers)
                }
            }
            Material::Unused => return false,
        };
        vertices
            .open()
            .push(place, (path, at), (normal, sides, gain), scene.roulette);
        surfaces.each.push((lobes, glass));
        true
    }

    /// Responses of these vertices to their lights, and how their paths go on; `before` is the
    /// number of earlier vertices.
    pub(super) fn answer_general(
        &self,
        bounce: &Bounce<'_, R>,
        (surfaces, before): (&GeneralSurfaces<R>, usize),
        (vertices, lights): (&VertexLanes<R>, &LightLanes<R>),
        onward: &mut Column<Onward<R>>,
    ) -> Answers<R> {
        let mut answers = Answers::NONE;
        for (lane, (onward, (lobes, glass))) in onward
            .iter_mut()
            .zip(&surfaces.each[before..][..vertices.len])
            .enumerate()
        {
            let here = LaneVertex {
                bounce,
                vertices,
                lights,
                lane,
            };
            *onward = match lobes {
                SurfaceLobes::Plain(bsdf) => {
                    self.answer(&here, (bsdf, glass.as_ref()), &mut answers)
                }
                SurfaceLobes::Layered(place) => self.answer(
                    &here,
                    (&surfaces.layered[*place], glass.as_ref()),
                    &mut answers,
                ),
                SurfaceLobes::Mixture(surface) => self.answer_mixture(&here, surface, &mut answers),
            };
        }
        answers
    }

    /// Response of lobes at a vertex, and how its path goes on.
    fn answer<L: LobeFamily<R>, const MOST: usize>(
        &self,
        here: &LaneVertex<'_, R>,
        (bsdf, glass): (&Bsdf<R, L, MOST>, Option<&Glass<R>>),
        answers: &mut Answers<R>,
    ) -> Onward<R> {
        let (normal, view) = (bsdf.normal(), here.view());
        if let Some(light) = here.light() {
            answers.put_response(here.lane, &respond(bsdf, view, light));
        }
        let [lobe, u, v, _] = here.numbers();
        let mut drawn = bsdf.sample(&Frame::about(normal), view, [lobe, u, v]);
        let through = drawn.direction.dot(normal) < R::ZERO;
        // A shading normal must not turn a reflection below the surface, nor a transmission above
        // it.
        let geometric = vector::<R>(&here.vertices.geometric, here.lane);
        if !drawn.some || (geometric.dot(drawn.direction) < R::ZERO) != through {
            return Onward::REFLECTED;
        }
        let (place, mut rest) = (here.vertices.place[here.lane], Vector::ZERO);
        let (path, at) = here.bounce.of(place);
        // A coat may mirror about its own normal.
        if let Some(glass) = glass.filter(|_| drawn.delta && (through || !L::COATED))
            && let Some(hit) = &here.bounce.hits[place as usize]
        {
            // Including the digits lost in storing the direction.
            let interface = self.scene.interface(&path.leg, hit, at, glass);
            let exact = if through {
                interface.refracted
            } else {
                Some(interface.reflected)
            };
            (drawn.direction, rest) = exact.map_or((drawn.direction, rest), stored::<R>);
        }
        let material = &self.scene.materials[at.material as usize];
        // Among delta lobes only thin walls transmit straight, if their alpha is opaque.
        let straight =
            L::COATED && drawn.delta && through && material.is_wall() && material.covers();
        answers.put_sample(here.lane, &drawn);
        Onward {
            rest,
            smooth: drawn.delta,
            through,
            straight,
        }
    }
}
