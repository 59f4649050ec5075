//! Preparation of area lights. For a path tracer, any emissive object is an area light; for other
//! integrators, only an object of uniform emission.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{AnyShape, Quad, SampleArea, TransformedShape, Triangle};
use raywright_bvh::{Aabb, Geometry, PrimitiveSet, Real, Side, Surface, Vector, Visibility};

use super::context::PrepareContext;
use super::emitter_filter::{EmitterFilter, MaterialEmission};
use super::error::{PrepareError, check_cancelled};
use super::geometry::{CANCEL_CHECK_INTERVAL, add_triangles, side_from_rule};
use super::material_set::MaterialSet;
use crate::effects::Effect;
use crate::generate::{objects_relative_to, objects_with_counts};
use crate::interaction::{Interaction, interpolate_vertex_attribute};
use crate::light::{
    DeltaLight, EmissionEstimate, EmitterList, EmitterStrategy, Emitters, Irradiance, Lights,
    SkyRadiance,
};
use crate::lookup::SceneLookup;
use crate::motion::object_transforms_at_ends;
use crate::observer::Observer;
use crate::scene::{MOST_UV_SETS, MeshData, Scene, Shape};
use crate::settings::{LightSampling, Settings};
use crate::shape::convert_shape;
use crate::storage_origin::light_relative_to;
use crate::texture::InputTables;

/// Greatest number of points, on all triangles together, at which varying emission is evaluated
/// during preparation.
const MAX_EMISSION_POINTS: u64 = 1 << 20;
/// Least and greatest number of points along each side of a triangle at which varying emission is
/// evaluated.
const TRIANGLE_GRID_RANGE: [u64; 2] = [2, 32];
/// Number of points along each side of a shape at which varying emission is evaluated. It does not
/// apply to meshes.
const SHAPE_GRID_SIZE: usize = 8;

/// Returns the number of points along each side of a triangle at which varying emission is
/// evaluated. `triangles` is the number of triangles of varying emission in the scene.
pub(super) fn emission_grid_size(triangles: u64) -> u64 {
    let [minimum, maximum] = TRIANGLE_GRID_RANGE;
    (MAX_EMISSION_POINTS / triangles.max(1))
        .isqrt()
        .clamp(minimum, maximum)
}

/// Counts the triangles in a scene whose emission varies and is selected by `requested`.
fn count_varying_triangles(
    scene: &Scene,
    lookup: &SceneLookup<'_>,
    requested: EmitterFilter,
    observer: &dyn Observer,
) -> Result<u64, PrepareError> {
    let mut sum = 0_u64;
    for (index, (object, count)) in objects_with_counts(scene).enumerate() {
        if index.is_multiple_of(CANCEL_CHECK_INTERVAL) {
            check_cancelled(observer)?;
        }
        let Shape::Mesh(name) = &object.shape else {
            continue;
        };
        let varies = lookup
            .material(&object.material)
            .is_some_and(|(_, material)| {
                requested.selected_emission(material) == Some(MaterialEmission::Varying)
            });
        let triangles = lookup
            .mesh_data(name)
            .filter(|_| varies)
            .map_or(0, |data| data.indices.len() as u64);
        sum = triangles.saturating_mul(count).saturating_add(sum);
    }
    Ok(sum)
}

/// Lists the area lights in the order of the scene's objects, with coordinates relative to an
/// origin.
///
/// # Errors
/// [`PrepareError::Cancelled`].
fn list_emitters<R: Real>(
    (scene, origin): (&Scene, DVec3),
    lookup: &SceneLookup<'_>,
    (materials, texture_tables): (&[super::PreparedMaterial<R>], &InputTables<R>),
    requested: EmitterFilter,
    observer: &dyn Observer,
) -> Result<EmitterList<R>, PrepareError> {
    let mut list = EmitterList::default();
    let varied = count_varying_triangles(scene, lookup, requested, observer)?;
    let across = emission_grid_size(varied);
    list.reserve_cells(varied, across);
    let across = across as usize;
    // The area of the last shape is reused, because a generator's objects differ only in position.
    let mut last: Option<(&Shape, DMat3, f64)> = None;
    for (index, placed_object) in objects_relative_to(scene, origin).enumerate() {
        if index.is_multiple_of(CANCEL_CHECK_INTERVAL) {
            check_cancelled(observer)?;
        }
        list.begin_object();
        let object = placed_object.object;
        // Samples lie where the object is at time 0. So a moving object is not sampled: only paths
        // that hit it find its light.
        if object_transforms_at_ends(object).is_some() {
            continue;
        }
        let Some((position, material)) = lookup.material(&object.material) else {
            continue;
        };
        let source = match requested.selected_emission(material) {
            Some(MaterialEmission::Uniform(radiance)) => {
                EmissionSource::Uniform(Vector::from_f64(radiance.0.into()))
            }
            Some(MaterialEmission::Varying) => EmissionSource::Varying(VaryingEmission {
                material: &materials[position],
                texture_tables,
                partly_transparent: material.is_partly_transparent(),
            }),
            None => continue,
        };
        let (side, map) = (
            side_from_rule(object.side).sides_visible_to_camera(),
            placed_object.object_to_world(),
        );
        if let Shape::Mesh(name) = &object.shape {
            if let Some(data) = lookup.mesh_data(name) {
                add_mesh(
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
        let area = add_shape(&mut list, &object.shape, map, &source, side, known);
        last = area.map(|area| (&object.shape, map.matrix3, area)).or(last);
    }
    Ok(list)
}

/// Emission of the object whose area lights are being added.
enum EmissionSource<'a, R: Real> {
    /// Uniform radiance.
    Uniform(R::Vec3),
    /// Radiance evaluated at each point.
    Varying(VaryingEmission<'a, R>),
}

/// Varying emission of an object's material.
struct VaryingEmission<'a, R: Real> {
    material: &'a super::PreparedMaterial<R>,
    texture_tables: &'a InputTables<R>,
    /// Whether the surface is partly transparent.
    partly_transparent: bool,
}

impl<R: Real> VaryingEmission<'_, R> {
    /// Returns the radiance at a point times the surface's alpha. Constants replace inputs that
    /// depend on a ray. The result serves only as a sampling weight of emitters, so it does not
    /// change the expectation of a picture.
    fn eval_radiance_times_alpha(
        &self,
        surface: &Surface<R>,
        uv: [[R; 2]; MOST_UV_SETS],
        colour: [R; 4],
    ) -> R::Vec3 {
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
        // The comparison is also false for NaN.
        if brightest > R::ZERO && emission.is_finite() {
            emission.max(Vector::ZERO)
        } else {
            Vector::ZERO
        }
    }
}

/// Evaluates the function `at` at the centres of `across` × `across` equal cells of the unit
/// square, row by row. The results replace the content of `found`.
fn eval_on_grid<R: Real>(
    across: usize,
    found: &mut Vec<R::Vec3>,
    mut at: impl FnMut([R; 2]) -> R::Vec3,
) {
    let step = |i: usize| R::from_f64((i as f64 + 0.5) / across as f64);
    found.clear();
    found.extend((0..across * across).map(|i| at([step(i % across), step(i / across)])));
}

/// Adds a transformed shape as an area light, and returns its area. `area` is the area if it is
/// already known from an equal shape. As in the geometry, a pure translation is added to the
/// shape's coordinates.
fn add_shape<R: Real>(
    list: &mut EmitterList<R>,
    shape: &Shape,
    map: DAffine3,
    source: &EmissionSource<'_, R>,
    side: Side,
    area: Option<f64>,
) -> Option<f64> {
    let glow = |drawn: &dyn Fn([R; 2]) -> Option<Surface<R>>| match source {
        EmissionSource::Uniform(radiance) => EmissionEstimate::from_uniform_emission(*radiance),
        EmissionSource::Varying(varied) => {
            let mut found = Vec::new();
            eval_on_grid(SHAPE_GRID_SIZE, &mut found, |uv| {
                let surface = drawn(uv);
                surface.map_or(Vector::ZERO, |surface| {
                    varied.eval_radiance_times_alpha(&surface, [uv; MOST_UV_SETS], [R::ONE; 4])
                })
            });
            EmissionEstimate::from_emission_samples(&found, varied.partly_transparent)
        }
    };
    let (shape, map) = convert_shape(shape, map)?;
    let Some(map) = map else {
        let emission = glow(&|[u, v]| Some(shape.sample_area(u, v)?.0.to_scalar::<R>()));
        return Some(list.add_shape(shape, emission, side, area));
    };
    let transformed_shape = TransformedShape::new(shape, map)?;
    let emission = glow(&|[u, v]| Some(transformed_shape.sample_area(u, v)?.0.to_scalar::<R>()));
    Some(list.add_transformed_shape(transformed_shape, emission, side, area))
}

/// Adds the triangles of a transformed mesh as area lights. Two triangles of uniform emission that
/// form a parallelogram become a single quad.
fn add_mesh<R: Real>(
    list: &mut EmitterList<R>,
    (object, data): (usize, &MeshData),
    map: DAffine3,
    (source, side, across): (&EmissionSource<'_, R>, Side, usize),
    observer: &dyn Observer,
) -> Result<(), PrepareError> {
    let mut group = PrimitiveSet::<R>::default();
    let flipped = map.matrix3.determinant() < 0.0;
    add_triangles(
        &mut group,
        object,
        data,
        Some((map, flipped)),
        Visibility::default(),
        observer,
    )?;
    let (mut found, mut done) = (Vec::new(), 0);
    for (index, &triangle) in group.triangles().iter().enumerate() {
        if index.is_multiple_of(CANCEL_CHECK_INTERVAL) {
            check_cancelled(observer)?;
        }
        match source {
            _ if index < done => {}
            EmissionSource::Uniform(radiance) => {
                if let Some(quad) = merge_into_quad(group.triangles(), (data, index, flipped)) {
                    list.add_quad_halves(quad, *radiance, side);
                    done = index + 2;
                    continue;
                }
                list.add_shape(
                    AnyShape::Triangle(triangle),
                    EmissionEstimate::from_uniform_emission(*radiance),
                    side,
                    None,
                );
            }
            EmissionSource::Varying(varied) => {
                eval_on_grid(across, &mut found, |uv| {
                    eval_on_triangle(varied, &triangle, (data, index, flipped), uv)
                });
                list.add_varying_triangle(
                    triangle,
                    &found,
                    varied.partly_transparent,
                    side,
                    across,
                );
            }
        }
    }
    Ok(())
}

/// Returns the quad that a mesh's triangle and the next triangle form, as in most lamps of models.
/// In the coordinates of the file, the two must form an exact parallelogram. The result is then the
/// same in every precision.
fn merge_into_quad<R: Real>(
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
    // Adjacent triangles traverse their common edge in opposite directions.
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

/// Returns the radiance at a point of a mesh's triangle. The point is the one to which sampling
/// maps the random numbers `u` and `v` in [0, 1).
fn eval_on_triangle<R: Real>(
    varied: &VaryingEmission<'_, R>,
    triangle: &Triangle<R>,
    (data, index, flipped): (&MeshData, usize, bool),
    [u, v]: [R; 2],
) -> R::Vec3 {
    let one = R::ONE;
    let root = u.sqrt();
    let [a, b, c] = data.indices[index].map(|i| i as usize);
    let (b, c) = if flipped { (c, b) } else { (b, c) };
    // Barycentric weights of the sampled point.
    let weights = [root * (one - v), one - root, root * v];
    let value_of =
        |values: [f32; 3]| interpolate_vertex_attribute(values.map(R::from_f32), weights);
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
    varied.eval_radiance_times_alpha(&surface_point.to_scalar::<R>(), uv, colour)
}

// Preparation of a scene's lights: delta lights, area lights and the sky, with their samplers.

/// Prepares the lights of a scene. Samplers are built only for a path tracer.
///
/// # Errors
/// [`PrepareError::Cancelled`].
pub(super) fn prepare_lights<R: Real>(
    context: &PrepareContext<'_>,
    materials: &MaterialSet<R>,
    sky: SkyRadiance<R>,
    geometry: &Geometry<R>,
) -> Result<Lights<R>, PrepareError> {
    let emitters = prepare_emitters(context, materials)?;
    let bounds: Aabb = geometry.bounded_primitives_box();
    let mut lights = Lights::new(
        prepare_delta_lights(context),
        Emitters::new(emitters),
        sky,
        &bounds,
    );
    if context.is_path_tracing {
        lights.emitters.strategy = EmitterStrategy::SolidAngle;
        lights.emitters.find_triangles(geometry);
        if context.simulated.has(Effect::SkyLight) {
            build_sky_sampler(&mut lights, context.settings);
        }
        lights.build_light_sampler();
    }
    Ok(lights)
}

/// Lists the area lights of a scene; none if no effect needs area lights.
fn prepare_emitters<R: Real>(
    context: &PrepareContext<'_>,
    materials: &MaterialSet<R>,
) -> Result<EmitterList<R>, PrepareError> {
    let requested = context.emitter_filter();
    if !(requested.uniform || requested.varying) {
        return Ok(EmitterList::default());
    }
    list_emitters::<R>(
        (context.scene, context.origin.origin),
        context.lookup,
        (&materials.materials, &materials.texture_tables),
        requested,
        context.observer,
    )
}

/// Returns the delta lights of a scene. Lights whose effect is switched off are left out, so no
/// loop visits them.
fn prepare_delta_lights<R: Real>(context: &PrepareContext<'_>) -> Vec<DeltaLight<R>> {
    let simulated = context.simulated;
    if !(simulated.has(Effect::DirectLight) || simulated.has(Effect::Highlights)) {
        return Vec::new();
    }
    context
        .scene
        .lights
        .iter()
        .map(|light| light_relative_to(context.origin.origin, light))
        .map(|light| DeltaLight::new(&light, simulated.has(Effect::Shadows)))
        .collect()
}

/// Builds the sampler of the sky in the form that the settings' sampling strategy needs.
pub(super) fn build_sky_sampler<R: Real>(lights: &mut Lights<R>, settings: &Settings) {
    lights.build_sky_sampler();
    if settings.light_sampling == LightSampling::Both {
        lights.sample_bright_excess();
    }
}

/// Returns the cosine-weighted mean of the sky's radiance; `None` if the integrator does not read
/// it.
pub(super) fn prepare_irradiance<R: Real>(
    context: &PrepareContext<'_>,
    sky: &SkyRadiance<R>,
) -> Option<Irradiance<R>> {
    let is_needed =
        context.simulated.has(Effect::SkyLight) && !context.is_path_tracing && !sky.is_black();
    is_needed.then(|| Irradiance::new(sky))
}

#[cfg(test)]
mod tests;
