//! What vertices send back of the lights that they ask, and the directions in which their paths go on: one source for one vertex of any
//! surface and for several on common ones, which have the bits that each would have alone. Here numbers go from paths into lanes and back.

use core::array::from_fn;

use raywright_bvh::{Loops, Real, Vector, widest};

use super::PathState;
use super::rough::RoughVertex;
use crate::interaction::Interaction;
use crate::material::{Bent, Bsdf, Frame, Lobe, MetallicRoughness, Sampled, Scatters};
use crate::number::{Lanes, Mask, Number, Vector3};

/// Vertices that are shaded at a time.
pub(super) const LANES: usize = 8;

/// What surfaces answer to a light.
#[derive(Clone, Copy)]
pub(super) struct LightResponse<N: Number> {
    /// What they send back of it, and the diffuse part of that where a light makes no highlights.
    pub value: N::Vec3,
    pub diffuse: N::Vec3,
    /// How densely they would have drawn the direction to it.
    pub density: N,
}

/// A light that surfaces answer to.
#[derive(Clone, Copy)]
pub(super) struct LightDirection<N: Number> {
    pub direction: N::Vec3,
    /// Whether it may shine through the surface; of single vertices alone.
    pub through: bool,
    /// Whether it makes no highlights, of several some.
    pub dull: bool,
}

/// What surfaces send back of a light to where they are seen from.
#[inline(always)]
pub(super) fn respond<N: Number, L: Scatters<N>, const MOST: usize>(
    bsdf: &Bsdf<N, L, MOST>,
    view: N::Vec3,
    LightDirection { direction, through, dull }: LightDirection<N>,
) -> LightResponse<N> {
    let (value, density) = bsdf.answer(view, direction);
    let value = if through { bsdf.eval_either(view, direction) } else { value };
    let diffuse = if dull { bsdf.diffuse(view, direction) } else { N::Vec3::ZERO };
    LightResponse { value, diffuse, density }
}

/// How several vertices answer.
#[derive(Clone, Copy)]
pub(super) struct Shaded<N: Number> {
    pub light: LightResponse<N>,
    pub scattered: Sampled<N>,
}

/// Several vertices on common surfaces. `MATTE`: on those that reflect nothing, of which one lobe is left with the same numbers.
struct Shading<'a, N: Number, const MATTE: bool> {
    normal: &'a N::Vec3,
    view: &'a N::Vec3,
    model: &'a MetallicRoughness<N>,
    light: &'a LightDirection<N>,
    numbers: &'a [N; 3],
    compensated: bool,
}

impl<N: Number, const MATTE: bool> Shading<'_, N, MATTE> {
    #[inline(always)]
    fn by<const MOST: usize>(&self, bsdf: &Bsdf<N, Lobe<N>, MOST>) -> Shaded<N> {
        let (normal, view) = (*self.normal, *self.view);
        Shaded { light: respond(bsdf, view, *self.light), scattered: bsdf.sample(&Frame::about(normal), view, *self.numbers) }
    }
}

impl<N: Number, const MATTE: bool> Loops for Shading<'_, N, MATTE> {
    type Output = Shaded<N>;
    #[inline(always)]
    fn run(self) -> Shaded<N> {
        if MATTE {
            self.by(&Bsdf::<N, Lobe<N>, 1>::of_kind(*self.normal).with(Lobe::Lambert { albedo: self.model.base }))
        } else {
            self.by(&self.model.rough(*self.normal, *self.view, self.compensated))
        }
    }
}

struct Bending<'a, N: Number>(&'a Bent<N>);

impl<N: Number> Loops for Bending<'_, N> {
    type Output = N::Vec3;
    #[inline(always)]
    fn run(self) -> N::Vec3 {
        self.0.bent()
    }
}

/// A mask of what is said of each lane.
#[inline(always)]
fn mask<N: Number>(yes: impl Fn(usize) -> bool) -> N::Mask {
    let mut mask = N::Mask::default();
    (0..N::LANES).filter(|&lane| yes(lane)).for_each(|lane| mask.set(lane));
    mask
}

/// Normals that images bend, of at most so many vertices as there are lanes.
#[inline(always)]
pub(super) fn bend<R: Real>(these: &[&Bent<R>]) -> [R::Vec3; LANES] {
    type N = Lanes<LANES>;
    let of = |lane: usize| these[lane.min(these.len() - 1)];
    if !is_single::<R>() {
        return from_fn(|lane| of(lane).bent());
    }
    let vectors = |part: fn(&Bent<R>) -> R::Vec3| <N as Number>::Vec3::of_lanes(|lane| part(of(lane)).to_f64());
    let normals = widest(Bending(&Bent::<N> {
        normal: vectors(|bent| bent.normal),
        along: vectors(|bent| bent.along),
        mirrored: mask::<N>(|lane| of(lane).mirrored),
        code: vectors(|bent| bent.code),
        geometric: vectors(|bent| bent.geometric),
        outside: mask::<N>(|lane| of(lane).outside),
        direction: vectors(|bent| bent.direction),
    }));
    from_fn(|lane| R::Vec3::from_f64(normals.lane(lane)))
}

/// Shades the vertices on common surfaces, at most so many as there are lanes.
#[inline(always)]
pub(super) fn shade<R: Real, const MATTE: bool>(
    these: &[(&RoughVertex<R>, &PathState<R>, &Interaction<R>)],
    compensated: bool,
) -> [Option<Shaded<R>>; LANES] {
    let mut out = [None; LANES];
    if is_single::<R>() {
        let all = together::<Lanes<LANES>, R, MATTE>(these, compensated);
        for (lane, out) in out.iter_mut().enumerate().take(these.len()) {
            *out = Some(one(&all, lane));
        }
    } else {
        for (these, out) in these.chunks(1).zip(&mut out) {
            *out = Some(together::<R, R, MATTE>(these, compensated));
        }
    }
    out
}

#[inline(always)]
fn together<N: Number, R: Real, const MATTE: bool>(
    these: &[(&RoughVertex<R>, &PathState<R>, &Interaction<R>)],
    compensated: bool,
) -> Shaded<N> {
    // Lanes without a vertex do what the last one does.
    let of = |lane: usize| these[lane.min(these.len() - 1)];
    let model = |lane: usize| &of(lane).0.model;
    let number = |of: fn(&MetallicRoughness<R>) -> R| {
        if MATTE { N::ZERO } else { N::of_lanes(|lane| of(model(lane)).to_f64()) }
    };
    let direction = N::Vec3::of_lanes(|lane| {
        let (vertex, _, at) = of(lane);
        vertex.query.map_or(at.normal, |query| query.seen.direction).to_f64()
    });
    let dull = these.iter().any(|(vertex, ..)| vertex.query.is_some_and(|query| query.strategy.is_dull()));
    widest(Shading::<N, MATTE> {
        normal: &N::Vec3::of_lanes(|lane| of(lane).2.normal.to_f64()),
        view: &-N::Vec3::of_lanes(|lane| of(lane).2.direction.to_f64()),
        model: &MetallicRoughness {
            base: N::Vec3::of_lanes(|lane| model(lane).base.to_f64()),
            metallic: number(|model| model.metallic),
            roughness: number(|model| model.roughness),
            dielectric: number(|model| model.dielectric),
            grazing: number(|model| model.grazing),
            glass: None,
        },
        light: &LightDirection { direction, through: false, dull },
        numbers: &from_fn(|k| N::of_lanes(|lane| of(lane).1.draws.scatter[k].into())),
        compensated,
    })
}

/// Whether lanes, which are f32, have this scalar's bits.
fn is_single<R: Real>() -> bool {
    size_of::<R>() == size_of::<f32>()
}

/// One lane of what was computed.
#[inline(always)]
fn one<R: Real>(all: &Shaded<Lanes<LANES>>, lane: usize) -> Shaded<R> {
    let vector = |v: <Lanes<LANES> as Number>::Vec3| R::Vec3::from_f64(v.lane(lane));
    let number = |x: Lanes<LANES>| R::from_f64(x.lane(lane));
    let (light, scattered) = (&all.light, &all.scattered);
    Shaded {
        light: LightResponse { value: vector(light.value), diffuse: vector(light.diffuse), density: number(light.density) },
        scattered: Sampled {
            some: scattered.some.lane(lane),
            direction: vector(scattered.direction),
            weight: vector(scattered.weight),
            density: number(scattered.density),
            delta: scattered.delta.lane(lane),
        },
    }
}
