//! The surfaces that light others: objects whose material gives off light, the same everywhere or, to a path tracer, any.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{AnyShape, Placed};
use raywright_bvh::{Group, Precision, Real, Side, Surface, Vec3Of, Vector, Visibility};

use super::geometry::{BLOCK, side_of, triangles};
use super::input::Sources;
use super::shape::any_shape;
use super::{PrepareError, go_on};
use crate::generate::all;
use crate::interaction::Interaction;
use crate::light::{EmitterList, Glow};
use crate::lookup::Lookup;
use crate::observer::Observer;
use crate::scene::{MOST_UV_SETS, MeshData, Scene, Shape};

/// Which of them count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// Those that give off the same everywhere.
    pub even: bool,
    /// Those whose emission varies.
    pub varied: bool,
    /// Whether they are read where a ray meets them, as a path tracer does where only a part of them is there.
    pub read: bool,
}

/// Means of emission are estimated by so many points in all, and by that many of each triangle or shape.
const POINTS: usize = 1 << 20;
const EACH: [usize; 2] = [2, 8];

/// Finds them, in the order of the scene's objects.
///
/// # Errors
/// [`PrepareError::Cancelled`].
pub(super) fn emitters<P: Precision>(
    scene: &Scene,
    lookup: &Lookup<'_>,
    (materials, sources): (&[super::Material<P::Real>], &Sources<P::Real>),
    wanted: Wanted,
    observer: &dyn Observer,
) -> Result<EmitterList<P>, PrepareError> {
    let mut list = EmitterList::default();
    // A generator's objects differ only in their places, which leave the area alone.
    let mut last: Option<(&Shape, DMat3, f64)> = None;
    for (index, shown) in all(scene).enumerate() {
        if index.is_multiple_of(BLOCK) {
            go_on(observer)?;
        }
        list.next_object();
        let object = shown.object;
        let Some((place, material)) = lookup.material(&object.material) else { continue };
        let source = match material.even_emission() {
            Some(radiance) if wanted.even && !(wanted.read && material.is_cut()) => {
                Source::Even(Vector::from_f64(radiance.0.into()))
            }
            Some(_) if wanted.even => Source::Varied(Varied { material: &materials[place], sources, cut: true }),
            None if wanted.varied && material.emits() => {
                Source::Varied(Varied { material: &materials[place], sources, cut: material.is_cut() })
            }
            _ => continue,
        };
        let (side, map) = (side_of(object.side), shown.map());
        if let Shape::Mesh(name) = &object.shape {
            if let Some(data) = lookup.mesh_data(name) {
                mesh(&mut list, index, data, map, (&source, side), observer)?;
            }
            continue;
        }
        let known = last.filter(|(shape, turn, _)| **shape == object.shape && *turn == map.matrix3).map(|(.., area)| area);
        let area = shape(&mut list, &object.shape, map, &source, side, known);
        last = area.map(|area| (&object.shape, map.matrix3, area)).or(last);
    }
    Ok(list)
}

/// Where emission comes from.
enum Source<'a, P: Precision> {
    /// The same everywhere.
    Even(Vec3Of<P>),
    Varied(Varied<'a, P>),
}

/// Emission that varies.
struct Varied<'a, P: Precision> {
    material: &'a super::Material<P::Real>,
    sources: &'a Sources<P::Real>,
    /// Whether the surface is there in part.
    cut: bool,
}

impl<P: Precision> Varied<'_, P> {
    /// What is given off at a point, of the surface's share that is there. What only meshes or rays know is left out: this is for means, by
    /// which emitters are chosen, and no picture's mean depends on them.
    fn at(&self, surface: &Surface<P::Real>, uv: [[P::Real; 2]; MOST_UV_SETS], colour: [P::Real; 4]) -> Vec3Of<P> {
        let at = Interaction {
            surface: *surface,
            normal: surface.normal,
            outside: true,
            direction: -surface.normal,
            origin: surface.point + surface.normal,
            distance: P::Real::ONE,
            time: P::Real::ZERO,
            uv,
            footprint: [P::Real::ZERO; MOST_UV_SETS],
            lies: None,
            colour,
            object: 0,
            material: 0,
        };
        let here = self.sources.at(&at);
        let emission = self.material.emission_at(&here) * self.material.alpha_at(&here);
        let brightest = emission.max_element();
        // Also leaves out what is no number.
        if brightest > P::Real::ZERO && emission.is_finite() { emission.max(Vector::ZERO) } else { Vector::ZERO }
    }
}

/// The mean of what is found at a grid of so many points by so many.
fn mean<P: Precision>(across: usize, passable: bool, mut at: impl FnMut([P::Real; 2]) -> Vec3Of<P>) -> Glow<P> {
    let step = |i: usize| P::Real::from_f64((i as f64 + 0.5) / across as f64);
    let mut sum = Vec3Of::<P>::ZERO;
    for i in 0..across * across {
        sum += at([step(i % across), step(i / across)]);
    }
    Glow { radiance: sum * P::Real::from_f64(1.0 / (across * across) as f64), varies: true, passable }
}

/// Adds a shape under a map, with numbers of its own where it is only moved, as the geometry has it, and returns its area.
fn shape<P: Precision>(
    list: &mut EmitterList<P>,
    shape: &Shape,
    map: DAffine3,
    source: &Source<'_, P>,
    side: Side,
    area: Option<f64>,
) -> Option<f64> {
    let glow = |drawn: &dyn Fn([P::Real; 2]) -> Option<Surface<P::Real>>| match source {
        Source::Even(radiance) => Glow::even(*radiance),
        Source::Varied(varied) => mean(EACH[1], varied.cut, |uv| {
            let surface = drawn(uv);
            surface.map_or(Vector::ZERO, |surface| varied.at(&surface, [uv; MOST_UV_SETS], [P::Real::ONE; 4]))
        }),
    };
    if map.matrix3 == DMat3::IDENTITY {
        let shape = any_shape(shape, map.translation)?;
        let glow = glow(&|[u, v]| Some(shape.sample_area::<P>(u, v)?.0.stored::<P>()));
        return Some(list.plain(shape, glow, side, area));
    }
    let placed = Placed::new(any_shape(shape, DVec3::ZERO)?, map)?;
    let glow = glow(&|[u, v]| Some(placed.sample_area(u, v)?.0.stored::<P>()));
    Some(list.placed(placed, glow, side, area))
}

/// Adds the triangles of an object's mesh under a map.
fn mesh<P: Precision>(
    list: &mut EmitterList<P>,
    object: usize,
    data: &MeshData,
    map: DAffine3,
    (source, side): (&Source<'_, P>, Side),
    observer: &dyn Observer,
) -> Result<(), PrepareError> {
    let mut group = Group::<P>::default();
    let flipped = map.matrix3.determinant() < 0.0;
    triangles(&mut group, object, data, Some((map, flipped)), Visibility::default(), observer)?;
    let [least, most] = EACH;
    let across = ((POINTS / data.indices.len().max(1)) as f64).sqrt() as usize;
    for (index, &triangle) in group.triangles().iter().enumerate() {
        if index.is_multiple_of(BLOCK) {
            go_on(observer)?;
        }
        let shape = AnyShape::Triangle(triangle);
        let glow = match source {
            Source::Even(radiance) => Glow::even(*radiance),
            Source::Varied(varied) => {
                mean(across.clamp(least, most), varied.cut, |uv| on_triangle(varied, &shape, (data, index, flipped), uv))
            }
        };
        list.plain(shape, glow, side, None);
    }
    Ok(())
}

/// What a triangle of a mesh gives off at the point that two numbers stand for.
fn on_triangle<P: Precision>(
    varied: &Varied<'_, P>,
    shape: &AnyShape<P::Real>,
    (data, index, flipped): (&MeshData, usize, bool),
    [u, v]: [P::Real; 2],
) -> Vec3Of<P> {
    let one = P::Real::ONE;
    let root = v.sqrt();
    let [a, b, c] = data.indices[index].map(|i| i as usize);
    let (b, c) = if flipped { (c, b) } else { (b, c) };
    // Even over the triangle; where it lies counts for expressions of places alone.
    let weights = [one - root, root * (one - u), root * u];
    let of = |values: [f32; 3]| {
        let [x, y, z] = values.map(P::Real::from_f32);
        x * weights[0] + y * weights[1] + z * weights[2]
    };
    let uv = core::array::from_fn(|set| {
        let read = |k: usize| {
            data.uvs.get(set).filter(|set| !set.is_empty()).map_or(P::Real::ZERO, |uvs| of([a, b, c].map(|i| uvs[i][k])))
        };
        [read(0), read(1)]
    });
    let colour = core::array::from_fn(|k| if data.colours.is_empty() { one } else { of([a, b, c].map(|i| data.colours[i][k])) });
    let drawn = shape.sample_area::<P>(u, v);
    drawn.map_or(Vector::ZERO, |(located, _)| varied.at(&located.stored::<P>(), uv, colour))
}

#[cfg(test)]
mod tests;
