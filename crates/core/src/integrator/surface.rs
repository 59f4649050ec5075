//! The surface point of a hit, made once, as shading sees it.

use raywright_bvh::{Hit, Precision, Ray, Real, Surface, Vec3Of, Vector};

use super::Kernel;
use crate::expr::Inputs;
use crate::prepare::{ObjectRecord, Point, Prepared};
use crate::scene::MOST_UV_SETS;

/// A ray as a path came along it.
pub(crate) struct Leg<R: Real> {
    pub ray: Ray<R>,
    /// What storing took from the direction.
    pub rest: R::Vec3,
    /// How far before its origin the ray began: a camera's that is far away. Zero for every other.
    pub ahead: R,
}

impl<R: Real> Leg<R> {
    /// A ray that starts where it is and is what it seems.
    pub fn of(ray: Ray<R>) -> Self {
        Self { ray, rest: Vector::ZERO, ahead: R::ZERO }
    }

    /// Where it began.
    #[inline(always)]
    pub fn start(&self) -> R::Vec3 {
        if self.ahead == R::ZERO { self.ray.origin } else { self.ray.origin - self.ray.direction * self.ahead }
    }
}

/// A hit point with what materials read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shading<P: Precision> {
    pub object: u32,
    pub material: u32,
    /// Geometric, normal outwards; what spawned rays start from.
    pub surface: Surface<P::Real>,
    /// Whether the ray arrived against the outward normal.
    pub outside: bool,
    /// Position, shading normal, directions, texture coordinates, distance. `l`, `shadow` and `occluder_distance` belong to
    /// a light and are set where one is shaded.
    pub point: Point<P::Real>,
    /// Colour of the mesh's vertices with alpha; white where there is none.
    pub vertex_colour: [P::Real; 4],
}

impl<P: Precision> Shading<P> {
    #[inline(always)]
    pub fn new<K: Kernel>(scene: &Prepared<P>, leg: &Leg<P::Real>, hit: &Hit<P::Real>) -> Self {
        let ray = &leg.ray;
        let surface = scene.geometry.surface(ray, hit);
        let object = scene.object_of[hit.order() as usize];
        let record = &scene.objects[object as usize];
        let d = ray.direction;
        let outside = d.dot(surface.normal) < P::Real::ZERO;
        let mut shading = Self {
            object,
            material: record.material,
            surface,
            outside,
            point: Point::of(Inputs {
                p: surface.point,
                n: surface.normal,
                d,
                o: ray.origin,
                distance: hit.t,
                occluder_distance: P::Real::INFINITY,
                shadow: P::Real::ONE,
                ..Inputs::default()
            }),
            vertex_colour: [P::Real::ONE; 4],
        };
        if leg.ahead != P::Real::ZERO {
            let inputs = &mut shading.point.inputs;
            (inputs.o, inputs.distance) = (leg.start(), hit.t + leg.ahead);
        }
        if record.coordinates {
            let parameters = scene.geometry.parameters(ray, hit);
            let inputs = &mut shading.point.inputs;
            (inputs.u, inputs.v) = (parameters.u, parameters.v);
            // A shape has one set, whatever set is asked for.
            shading.point.further_uv = [[parameters.u, parameters.v]; MOST_UV_SETS - 1];
        }
        if K::MESHES {
            shading.attributes(record, hit);
        }
        let inputs = &mut shading.point.inputs;
        if record.face_viewer && !outside {
            inputs.n = -inputs.n;
        }
        if K::MESHES && record.mesh.is_some() {
            inputs.n = towards_viewer::<P>(inputs.n, surface.normal, outside, d);
        }
        inputs.r = d - inputs.n * (P::Real::from_f64(2.0) * d.dot(inputs.n));
        shading
    }

    /// The hit as expressions see it.
    #[inline(always)]
    pub fn inputs(&self) -> &Inputs<P::Real> {
        &self.point.inputs
    }

    /// Interpolates what the mesh's vertices carry.
    fn attributes(&mut self, record: &ObjectRecord<P::Real>, hit: &Hit<P::Real>) {
        let Some(mesh) = &record.mesh else { return };
        let data = &mesh.data;
        let [a, b, c] = data.indices[(hit.primitive - mesh.first) as usize].map(|i| i as usize);
        let (b, c) = if mesh.flipped { (c, b) } else { (b, c) };
        let (u, v) = (hit.u, hit.v);
        let w = P::Real::ONE - u - v;
        let real = P::Real::from_f32;
        if !data.normals.is_empty() {
            let normal =
                |i: usize| Vec3Of::<P>::new(real(data.normals[i][0]), real(data.normals[i][1]), real(data.normals[i][2]));
            let n = normal(a) * w + normal(b) * u + normal(c) * v;
            let [x, y, z] = mesh.normals;
            let n = (x * n.x() + y * n.y() + z * n.z()).normalize();
            // Normals that cancel, or that a flat transform squeezes to nothing, leave the facet's.
            if n.is_finite() {
                self.point.inputs.n = n;
            }
        }
        let uv = |set: usize| {
            let set = data.uvs.get(set).filter(|set| !set.is_empty())?;
            let at = |k: usize| real(set[a][k]) * w + real(set[b][k]) * u + real(set[c][k]) * v;
            Some([at(0), at(1)])
        };
        // Without a set, the weights of the second and the third corner of the file's own order.
        let own = if mesh.flipped { [v, u] } else { [u, v] };
        [self.point.inputs.u, self.point.inputs.v] = uv(0).unwrap_or(own);
        for &set in &mesh.further_sets {
            // What a shader reads of an attribute that a mesh does not have.
            self.point.further_uv[set - 1] = uv(set).unwrap_or([P::Real::ZERO; 2]);
        }
        if !data.colours.is_empty() {
            let at = |k: usize| real(data.colours[a][k]) * w + real(data.colours[b][k]) * u + real(data.colours[c][k]) * v;
            self.vertex_colour = core::array::from_fn(at);
        }
    }
}

/// A shading normal on the viewer's side: where interpolation tilts it past the silhouette, it is bent back until it is just
/// perpendicular to the view, so that no reflection goes through the surface unseen.
#[inline]
fn towards_viewer<P: Precision>(n: Vec3Of<P>, geometric: Vec3Of<P>, outside: bool, d: Vec3Of<P>) -> Vec3Of<P> {
    let facing = if outside { geometric } else { -geometric };
    let away = d.dot(n);
    if away < P::Real::ZERO {
        return n;
    }
    if n.dot(facing) <= P::Real::ZERO {
        return facing;
    }
    let bent = (n - d * (away * P::Real::from_f64(1.001))).normalize();
    if bent.is_finite() { bent } else { facing }
}
