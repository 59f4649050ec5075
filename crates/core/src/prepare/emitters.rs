//! Preparation of area lights: objects of uniformly emissive materials or, for a path tracer, of
//! any emissive material.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{AnyShape, Quad, SampleArea, TransformedShape, Triangle};
use raywright_bvh::{PrimitiveSet, Real, Side, Surface, Vector, Visibility};

use super::error::{PrepareError, check_cancelled};
use super::geometry::{BLOCK, side_of, triangles};
use crate::generate::{all_about, counted};
use crate::interaction::{Interaction, interpolate};
use crate::light::{EmissionEstimate, EmitterList};
use crate::lookup::SceneLookup;
use crate::observer::Observer;
use crate::scene::{Colour, MOST_UV_SETS, Material as MaterialData, MeshData, Scene, Shape};
use crate::shape::placed_shape;
use crate::texture::TextureTables;

/// Selection of emitters.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmitterFilter {
    /// Emitters of uniform emission.
    pub even: bool,
    /// Emitters of varying emission.
    pub varied: bool,
    /// Whether emission is evaluated at hits, as a path tracer does for partly transparent
    /// surfaces.
    pub read: bool,
}

/// Numbers of points at which varying emission is evaluated: in all; along each side of a
/// triangle, least and most; along each side of a shape.
const POINTS: u64 = 1 << 20;
const EACH: [u64; 2] = [2, 32];
const OF_SHAPE: usize = 8;

/// Points along each side of a triangle of varying emission, for a number of such triangles.
pub(super) fn points_across(triangles: u64) -> u64 {
    let [minimum, maximum] = EACH;
    (POINTS / triangles.max(1)).isqrt().clamp(minimum, maximum)
}

/// Emission of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Emission {
    /// Uniform radiance.
    Even(Colour),
    /// Radiance evaluated at each point.
    Varied,
}

impl EmitterFilter {
    /// Emission of a material that is selected; `None` without any.
    pub fn of(self, material: &MaterialData) -> Option<Emission> {
        match material.even_emission() {
            Some(_) if self.even && self.read && material.is_cut() => Some(Emission::Varied),
            Some(radiance) if self.even => Some(Emission::Even(radiance)),
            None if self.varied && material.emits() => Some(Emission::Varied),
            _ => None,
        }
    }
}

/// Number of triangles of varying emission.
fn varied_triangles(
    scene: &Scene,
    lookup: &SceneLookup<'_>,
    requested: EmitterFilter,
    observer: &dyn Observer,
) -> Result<u64, PrepareError> {
    let mut sum = 0_u64;
    for (index, (object, count)) in counted(scene).enumerate() {
        if index.is_multiple_of(BLOCK) {
            check_cancelled(observer)?;
        }
        let Shape::Mesh(name) = &object.shape else {
            continue;
        };
        let varies = lookup
            .material(&object.material)
            .is_some_and(|(_, material)| requested.of(material) == Some(Emission::Varied));
        let triangles = lookup
            .mesh_data(name)
            .filter(|_| varies)
            .map_or(0, |data| data.indices.len() as u64);
        sum = triangles.saturating_mul(count).saturating_add(sum);
    }
    Ok(sum)
}

/// Lists the emitters, with coordinates relative to an origin, in the order of the scene's objects.
///
/// # Errors
/// [`PrepareError::Cancelled`].
pub(super) fn emitters<R: Real>(
    (scene, origin): (&Scene, DVec3),
    lookup: &SceneLookup<'_>,
    (materials, texture_tables): (&[super::PreparedMaterial<R>], &TextureTables<R>),
    requested: EmitterFilter,
    observer: &dyn Observer,
) -> Result<EmitterList<R>, PrepareError> {
    let mut list = EmitterList::default();
    let varied = varied_triangles(scene, lookup, requested, observer)?;
    let across = points_across(varied);
    list.reserve_cells(varied, across);
    let across = across as usize;
    // A generator's objects differ only in position, which does not change the area.
    let mut last: Option<(&Shape, DMat3, f64)> = None;
    for (index, placed_object) in all_about(scene, origin).enumerate() {
        if index.is_multiple_of(BLOCK) {
            check_cancelled(observer)?;
        }
        list.next_object();
        let object = placed_object.object;
        let Some((position, material)) = lookup.material(&object.material) else {
            continue;
        };
        let source = match requested.of(material) {
            Some(Emission::Even(radiance)) => {
                EmissionSource::Even(Vector::from_f64(radiance.0.into()))
            }
            Some(Emission::Varied) => EmissionSource::Varied(VaryingEmission {
                material: &materials[position],
                texture_tables,
                cut: material.is_cut(),
            }),
            None => continue,
        };
        let (side, map) = (side_of(object.side).seen(), placed_object.map());
        if let Shape::Mesh(name) = &object.shape {
            if let Some(data) = lookup.mesh_data(name) {
                mesh(
                    &mut list,
                    (index, data),
                    map,
                    (&source, side, across),
                    observer,
                )?;
            }
            continue;
        }
        let known = last
            .filter(|(shape, turn, _)| **shape == object.shape && *turn == map.matrix3)
            .map(|(.., area)| area);
        let area = shape(&mut list, &object.shape, map, &source, side, known);
        last = area.map(|area| (&object.shape, map.matrix3, area)).or(last);
    }
    Ok(list)
}

/// Source of emission.
enum EmissionSource<'a, R: Real> {
    /// Uniform radiance.
    Even(R::Vec3),
    Varied(VaryingEmission<'a, R>),
}

/// Varying emission.
struct VaryingEmission<'a, R: Real> {
    material: &'a super::PreparedMaterial<R>,
    texture_tables: &'a TextureTables<R>,
    /// Whether the surface is partly transparent.
    cut: bool,
}

impl<R: Real> VaryingEmission<'_, R> {
    /// Radiance at a point, times the surface's alpha. Inputs known only to meshes or rays are left
    /// out: the value serves means, by which emitters are chosen, and no picture's expectation
    /// depends on them.
    fn at(&self, surface: &Surface<R>, uv: [[R; 2]; MOST_UV_SETS], colour: [R; 4]) -> R::Vec3 {
        let interaction = Interaction {
            surface: *surface,
            normal: surface.normal,
            outside: true,
            direction: -surface.normal,
            origin: surface.point + surface.normal,
            distance: R::ONE,
            time: R::ZERO,
            uv,
            footprint: [R::ZERO; MOST_UV_SETS],
            texel_footprint: None,
            colour,
            object: 0,
            material: 0,
        };
        let context = self.texture_tables.shading_context(&interaction);
        let emission = self.material.emission_at(&context) * self.material.alpha_at(&context);
        let brightest = emission.max_element();
        // Leaves out NaN too.
        if brightest > R::ZERO && emission.is_finite() {
            emission.max(Vector::ZERO)
        } else {
            Vector::ZERO
        }
    }
}

/// Evaluates `at` at the middles of a grid's cells, `across` along each side, row by row.
fn look<R: Real>(across: usize, found: &mut Vec<R::Vec3>, mut at: impl FnMut([R; 2]) -> R::Vec3) {
    let step = |i: usize| R::from_f64((i as f64 + 0.5) / across as f64);
    found.clear();
    found.extend((0..across * across).map(|i| at([step(i % across), step(i / across)])));
}

/// Adds a transformed shape and returns its area. A pure translation is applied to the shape's own
/// numbers, as in the geometry.
fn shape<R: Real>(
    list: &mut EmitterList<R>,
    shape: &Shape,
    map: DAffine3,
    source: &EmissionSource<'_, R>,
    side: Side,
    area: Option<f64>,
) -> Option<f64> {
    let glow = |drawn: &dyn Fn([R; 2]) -> Option<Surface<R>>| match source {
        EmissionSource::Even(radiance) => EmissionEstimate::even(*radiance),
        EmissionSource::Varied(varied) => {
            let mut found = Vec::new();
            look(OF_SHAPE, &mut found, |uv| {
                let surface = drawn(uv);
                surface.map_or(Vector::ZERO, |surface| {
                    varied.at(&surface, [uv; MOST_UV_SETS], [R::ONE; 4])
                })
            });
            EmissionEstimate::varied(&found, varied.cut)
        }
    };
    let (shape, map) = placed_shape(shape, map)?;
    let Some(map) = map else {
        let emission = glow(&|[u, v]| Some(shape.sample_area(u, v)?.0.to_scalar::<R>()));
        return Some(list.add_constant(shape, emission, side, area));
    };
    let transformed_shape = TransformedShape::new(shape, map)?;
    let emission = glow(&|[u, v]| Some(transformed_shape.sample_area(u, v)?.0.to_scalar::<R>()));
    Some(list.add_transformed(transformed_shape, emission, side, area))
}

/// Adds the triangles of an object's transformed mesh.
fn mesh<R: Real>(
    list: &mut EmitterList<R>,
    (object, data): (usize, &MeshData),
    map: DAffine3,
    (source, side, across): (&EmissionSource<'_, R>, Side, usize),
    observer: &dyn Observer,
) -> Result<(), PrepareError> {
    let mut group = PrimitiveSet::<R>::default();
    let flipped = map.matrix3.determinant() < 0.0;
    triangles(
        &mut group,
        object,
        data,
        Some((map, flipped)),
        Visibility::default(),
        observer,
    )?;
    let (mut found, mut done) = (Vec::new(), 0);
    for (index, &triangle) in group.triangles().iter().enumerate() {
        if index.is_multiple_of(BLOCK) {
            check_cancelled(observer)?;
        }
        match source {
            _ if index < done => {}
            EmissionSource::Even(radiance) => {
                if let Some(quad) = quad(group.triangles(), (data, index, flipped)) {
                    list.add_halves(quad, *radiance, side);
                    done = index + 2;
                    continue;
                }
                list.add_constant(
                    AnyShape::Triangle(triangle),
                    EmissionEstimate::even(*radiance),
                    side,
                    None,
                );
            }
            EmissionSource::Varied(varied) => {
                look(across, &mut found, |uv| {
                    on_triangle(varied, &triangle, (data, index, flipped), uv)
                });
                list.varied(triangle, &found, varied.cut, side, across);
            }
        }
    }
    Ok(())
}

/// The quad that a triangle of a mesh and the next one form, as for nearly all lamps of models: a
/// parallelogram by the file's own numbers, so that it is one in every precision.
fn quad<R: Real>(
    triangles: &[Triangle<R>],
    (data, index, flipped): (&MeshData, usize, bool),
) -> Option<Quad<R>> {
    let corners = |index: usize| {
        let [a, b, c] = *data.indices.get(index)?;
        Some(
            [a, if flipped { c } else { b }, if flipped { b } else { c }]
                .map(|i| data.positions.offsets()[i as usize]),
        )
    };
    let (first, second) = (corners(index)?, corners(index + 1)?);
    let (p, q) = (triangles[index], triangles[index + 1]);
    if p.area() == 0.0 || q.area() == 0.0 {
        return None;
    }
    // The triangles traverse the shared edge in opposite directions.
    let edges = (0..9).map(|k| (k / 3, k % 3));
    let (i, j) = edges
        .into_iter()
        .find(|&(i, j)| first[i] == second[(j + 1) % 3] && first[(i + 1) % 3] == second[j])?;
    let exact = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let (a, b) = (exact(first[(i + 1) % 3]), exact(first[(i + 2) % 3]));
    let (c, d) = (exact(first[i]), exact(second[(j + 2) % 3]));
    let corners = [
        p.vertices[(i + 1) % 3],
        p.vertices[(i + 2) % 3],
        p.vertices[i],
        q.vertices[(j + 2) % 3],
    ];
    (a + c == b + d).then_some(Quad { corners })
}

/// Radiance of a mesh's triangle at the point sampled by two numbers.
fn on_triangle<R: Real>(
    varied: &VaryingEmission<'_, R>,
    triangle: &Triangle<R>,
    (data, index, flipped): (&MeshData, usize, bool),
    [u, v]: [R; 2],
) -> R::Vec3 {
    let one = R::ONE;
    let root = u.sqrt();
    let [a, b, c] = data.indices[index].map(|i| i as usize);
    let (b, c) = if flipped { (c, b) } else { (b, c) };
    // The weights of the sampled point.
    let weights = [root * (one - v), one - root, root * v];
    let value_of = |values: [f32; 3]| interpolate(values.map(R::from_f32), weights);
    let uv = core::array::from_fn(|set| {
        let read = |k: usize| {
            data.uvs
                .get(set)
                .filter(|set| !set.is_empty())
                .map_or(R::ZERO, |uvs| value_of([a, b, c].map(|i| uvs[i][k])))
        };
        [read(0), read(1)]
    });
    let colour = core::array::from_fn(|k| {
        if data.colours.is_empty() {
            one
        } else {
            value_of([a, b, c].map(|i| data.colours[i][k]))
        }
    });
    let (surface_point, _) = triangle.sample_area(u, v);
    varied.at(&surface_point.to_scalar::<R>(), uv, colour)
}

#[cfg(test)]
mod tests;
