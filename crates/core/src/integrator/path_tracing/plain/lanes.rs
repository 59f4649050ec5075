//! What is computed of several vertices on plain surfaces at a time: here numbers go from paths into lanes and back.

use core::array::from_fn;

use raywright_bvh::{Loops, Real, Vector, widest};

use super::super::PathState;
use super::{LANES, Plain};
use crate::interaction::Interaction;
use crate::material::{Bent, Frame, MetallicRoughness, Sampled};
use crate::number::{Lanes, Mask, Number, Vector3};

/// What several vertices have in common with what is computed of them.
struct Shading<'a, N: Number> {
    normal: &'a N::Vec3,
    view: &'a N::Vec3,
    model: &'a MetallicRoughness<N>,
    /// Where the lights are that they ask.
    light: &'a N::Vec3,
    numbers: &'a [N; 3],
    compensated: bool,
    /// Whether some of these lights make no highlights.
    dull: bool,
}

/// How several vertices answer.
#[derive(Clone, Copy)]
pub struct Shaded<N: Number> {
    /// What they send back of light from there, the diffuse part of it where some light makes no highlights, and how densely they would have
    /// drawn it.
    pub answer: N::Vec3,
    pub diffuse: N::Vec3,
    pub density: N,
    pub drawn: Sampled<N>,
}

impl<N: Number> Loops for Shading<'_, N> {
    type Output = Shaded<N>;
    #[inline(always)]
    fn run(self) -> Shaded<N> {
        let (normal, view) = (*self.normal, *self.view);
        let bsdf = self.model.rough(normal, view, self.compensated);
        let (answer, density) = bsdf.answer(view, *self.light);
        let diffuse = if self.dull { bsdf.diffuse(view, *self.light) } else { N::Vec3::ZERO };
        Shaded { answer, diffuse, density, drawn: bsdf.sample(&Frame::about(normal), view, *self.numbers) }
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

/// Normals that images bend.
#[inline(always)]
pub fn bend<R: Real>(these: &[&Bent<R>]) -> [R::Vec3; LANES] {
    type N = Lanes<LANES>;
    // Lanes without a vertex do what the last one does.
    let of = |lane: usize| these[lane.min(these.len() - 1)];
    let normals = widest(Bending(&Bent::<N> {
        normal: <N as Number>::Vec3::of_lanes(|lane| of(lane).normal.to_f64()),
        along: <N as Number>::Vec3::of_lanes(|lane| of(lane).along.to_f64()),
        mirrored: mask::<N>(|lane| of(lane).mirrored),
        code: <N as Number>::Vec3::of_lanes(|lane| of(lane).code.to_f64()),
        geometric: <N as Number>::Vec3::of_lanes(|lane| of(lane).geometric.to_f64()),
        outside: mask::<N>(|lane| of(lane).outside),
        direction: <N as Number>::Vec3::of_lanes(|lane| of(lane).direction.to_f64()),
    }));
    from_fn(|lane| R::Vec3::from_f64(normals.lane(lane)))
}

/// What is computed of several vertices at once.
#[inline(always)]
pub fn shade<N: Number, R: Real>(these: &[(&Plain<R>, &PathState<R>, &Interaction<R>)], compensated: bool) -> Shaded<N> {
    let of = |lane: usize| these[lane.min(these.len() - 1)];
    let model = |lane: usize| &of(lane).0.model;
    let normal = N::Vec3::of_lanes(|lane| of(lane).2.normal.to_f64());
    widest(Shading::<N> {
        normal: &normal,
        view: &-N::Vec3::of_lanes(|lane| of(lane).2.direction.to_f64()),
        model: &MetallicRoughness {
            base: N::Vec3::of_lanes(|lane| model(lane).base.to_f64()),
            metallic: N::of_lanes(|lane| model(lane).metallic.to_f64()),
            roughness: N::of_lanes(|lane| model(lane).roughness.to_f64()),
            dielectric: N::of_lanes(|lane| model(lane).dielectric.to_f64()),
            grazing: N::of_lanes(|lane| model(lane).grazing.to_f64()),
            glass: None,
        },
        light: &N::Vec3::of_lanes(|lane| {
            let (plain, _, at) = of(lane);
            plain.query.map_or(at.normal, |query| query.seen.direction).to_f64()
        }),
        numbers: &from_fn(|k| N::of_lanes(|lane| of(lane).1.draws.scatter[k].into())),
        compensated,
        dull: these.iter().any(|(plain, ..)| plain.query.is_some_and(|query| query.strategy.is_dull())),
    })
}

/// Whether lanes, which are f32, have this scalar's bits.
pub fn is_single<R: Real>() -> bool {
    size_of::<R>() == size_of::<f32>()
}

/// One lane of what was computed.
#[inline(always)]
pub fn one<const N: usize, R: Real>(all: &Shaded<Lanes<N>>, lane: usize) -> Shaded<R> {
    let vector = |v: <Lanes<N> as Number>::Vec3| R::Vec3::from_f64(v.lane(lane));
    let number = |x: Lanes<N>| R::from_f64(x.lane(lane));
    let drawn = &all.drawn;
    Shaded {
        answer: vector(all.answer),
        diffuse: vector(all.diffuse),
        density: number(all.density),
        drawn: Sampled {
            some: drawn.some.lane(lane),
            direction: vector(drawn.direction),
            weight: vector(drawn.weight),
            density: number(drawn.density),
            delta: drawn.delta.lane(lane),
        },
    }
}
