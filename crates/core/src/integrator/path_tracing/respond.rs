//! What surfaces answer to the lights that are asked, and the directions that they draw: one source for one vertex of any surface and for several
//! on common ones. Here numbers go from columns into lanes and back.

use core::array::from_fn;

use raywright_bvh::{Loops, Real, Vector, widest};

use super::vertices::VertexLanes;
use crate::light::{Column, LANES, Vec3Column};
use crate::material::{Bsdf, BsdfSample, Frame, Lobe, LobeFamily, MetallicRoughness, NormalMap};
use crate::number::{Lanes, Mask, Number, Vector3};

/// What surfaces answer to a light.
#[derive(Clone, Copy)]
pub(super) struct LightResponse<N: Number> {
    /// What they send back of it, and the diffuse part of that where a light makes no highlights.
    pub value: N::Vec3,
    pub diffuse: N::Vec3,
    /// How densely they would have drawn the direction to it.
    pub density: N,
}

/// What surfaces send back of a light in a direction to where they are seen from. `dull`: whether it makes no highlights, of several some.
#[inline(always)]
pub(super) fn respond<N: Number, L: LobeFamily<N>, const MOST: usize>(
    bsdf: &Bsdf<N, L, MOST>,
    view: N::Vec3,
    (direction, dull): (N::Vec3, bool),
) -> LightResponse<N> {
    let (value, density) = bsdf.eval_and_pdf(view, direction);
    let diffuse = if dull { bsdf.eval_diffuse(view, direction) } else { N::Vec3::ZERO };
    LightResponse { value, diffuse, density }
}

/// How surfaces answer, in columns.
pub(super) struct Answers<R: Real> {
    pub value: Vec3Column<R>,
    pub diffuse: Vec3Column<R>,
    /// How densely the directions to lights would have been drawn.
    pub light_density: Column<R>,
    /// Whether a direction was drawn, what light from there counts, and how densely it is drawn.
    pub some: Column<bool>,
    pub direction: Vec3Column<R>,
    pub weight: Vec3Column<R>,
    pub density: Column<R>,
}

impl<R: Real> Answers<R> {
    /// Of vertices that ask lights in these directions. `MATTE`: on surfaces that reflect nothing, of which one lobe is left with the same numbers.
    #[inline(always)]
    pub fn of<const MATTE: bool>(vertices: &VertexLanes<R>, lights: &Vec3Column<R>, compensated: bool) -> Self {
        let none = [[R::ZERO; LANES]; 3];
        let mut answers = Self {
            value: none,
            diffuse: none,
            light_density: none[0],
            some: [false; LANES],
            direction: none,
            weight: none,
            density: none[0],
        };
        if R::IS_SINGLE {
            answers.add::<Lanes<LANES>, MATTE>(0, vertices, lights, compensated);
        } else {
            (0..vertices.len).for_each(|lane| answers.add::<R, MATTE>(lane, vertices, lights, compensated));
        }
        answers
    }

    /// Adds those of as many vertices as a number has lanes.
    #[inline(always)]
    fn add<N: Number, const MATTE: bool>(&mut self, from: usize, v: &VertexLanes<R>, lights: &Vec3Column<R>, compensated: bool) {
        let out = self;
        let dull = v.strategy.iter().fold(false, |some, strategy| some | strategy.is_dull());
        let (normal, view, base) =
            (load3::<N, R>(&v.normal, from), -load3::<N, R>(&v.direction, from), load3::<N, R>(&v.base, from));
        let light = (load3::<N, R>(lights, from), dull);
        let numbers = [load::<N, R>(&v.numbers[0], from), load::<N, R>(&v.numbers[1], from), load::<N, R>(&v.numbers[2], from)];
        let (response, sampled) = if MATTE {
            let bsdf = Bsdf::<N, Lobe<N>, 1>::new(normal).with(Lobe::Lambert { albedo: base });
            both(&bsdf, view, light, numbers)
        } else {
            let [metallic, roughness, dielectric, grazing] = &v.terms;
            let model = MetallicRoughness {
                base,
                metallic: load::<N, R>(metallic, from),
                roughness: load::<N, R>(roughness, from),
                dielectric: load::<N, R>(dielectric, from),
                grazing: load::<N, R>(grazing, from),
                glass: None,
            };
            both(&model.rough(normal, view, compensated), view, light, numbers)
        };
        store3::<N, R>(&mut out.value, from, response.value);
        store3::<N, R>(&mut out.diffuse, from, response.diffuse);
        store::<N, R>(&mut out.light_density, from, response.density);
        store3::<N, R>(&mut out.direction, from, sampled.direction);
        store3::<N, R>(&mut out.weight, from, sampled.weight);
        store::<N, R>(&mut out.density, from, sampled.density);
        for lane in 0..N::LANES {
            out.some[from + lane] = sampled.some.lane(lane);
        }
    }
}

/// Numbers of a column from a lane on.
#[inline(always)]
fn load<N: Number, R: Real>(column: &Column<R>, from: usize) -> N {
    N::of_lanes(|lane| Real::to_f64(column[from + lane]))
}

#[inline(always)]
fn load3<N: Number, R: Real>([x, y, z]: &Vec3Column<R>, from: usize) -> N::Vec3 {
    N::Vec3::new(load::<N, R>(x, from), load::<N, R>(y, from), load::<N, R>(z, from))
}

#[inline(always)]
fn store<N: Number, R: Real>(column: &mut Column<R>, from: usize, number: N) {
    for lane in 0..N::LANES {
        column[from + lane] = Real::from_f64(number.lane(lane));
    }
}

#[inline(always)]
fn store3<N: Number, R: Real>([x, y, z]: &mut Vec3Column<R>, from: usize, v: N::Vec3) {
    store::<N, R>(x, from, v.x());
    store::<N, R>(y, from, v.y());
    store::<N, R>(z, from, v.z());
}

#[inline(always)]
fn both<N: Number, const MOST: usize>(
    bsdf: &Bsdf<N, Lobe<N>, MOST>,
    view: N::Vec3,
    light: (N::Vec3, bool),
    numbers: [N; 3],
) -> (LightResponse<N>, BsdfSample<N>) {
    (respond(bsdf, view, light), bsdf.sample(&Frame::about(bsdf.normal()), view, numbers))
}

struct PerturbNormals<'a, N: Number>(&'a NormalMap<N>);

impl<N: Number> Loops for PerturbNormals<'_, N> {
    type Output = N::Vec3;
    #[inline(always)]
    fn run(self) -> N::Vec3 {
        self.0.perturbed_normal()
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
pub(super) fn perturbed_normals<'a, R: Real>(these: impl Fn(usize) -> &'a NormalMap<R>) -> [R::Vec3; LANES] {
    type N = Lanes<LANES>;
    if !R::IS_SINGLE {
        return from_fn(|lane| these(lane).perturbed_normal());
    }
    let vectors = |part: fn(&NormalMap<R>) -> R::Vec3| <N as Number>::Vec3::of_lanes(|lane| part(these(lane)).to_f64());
    let normals = widest(PerturbNormals(&NormalMap::<N> {
        normal: vectors(|bent| bent.normal),
        along: vectors(|bent| bent.along),
        mirrored: mask::<N>(|lane| these(lane).mirrored),
        code: vectors(|bent| bent.code),
        geometric: vectors(|bent| bent.geometric),
        outside: mask::<N>(|lane| these(lane).outside),
        direction: vectors(|bent| bent.direction),
    }));
    from_fn(|lane| R::Vec3::from_f64(normals.lane(lane)))
}
