//! Creation of an interaction from a hit.

use raywright_bvh::{Hit, Ray, Real, Vector};

use crate::interaction::{Interaction, interpolate};
use crate::material::reflecting_above;
use crate::prepare::{ObjectRecord, Prepared};
use crate::scene::MOST_UV_SETS;

/// A segment of a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathSegment<R: Real> {
    pub ray: Ray<R>,
    /// Rounding error of the stored direction.
    pub rest: R::Vec3,
    /// Distance from the ray's beginning to its origin: positive for a distant camera, zero
    /// otherwise.
    pub ahead: R,
    /// Length of the path before, for the width of the camera's ray cone; negative if unused, as
    /// for shadow rays.
    pub before: R,
}

impl<R: Real> PathSegment<R> {
    /// A segment of an exact ray that begins at its origin.
    pub fn from_ray(ray: Ray<R>) -> Self {
        Self {
            ray,
            rest: Vector::ZERO,
            ahead: R::ZERO,
            before: -R::ONE,
        }
    }

    /// The segment of a camera ray, without the ray.
    #[inline(always)]
    pub fn from_camera(scene: &Prepared<R>) -> Self {
        let before = if scene.cone.is_some() {
            R::ZERO
        } else {
            -R::ONE
        };
        // For a distant camera, part of the way lies before the ray's origin.
        let nowhere = Ray::new(Vector::ZERO, Vector::ZERO);
        Self {
            ray: nowhere,
            rest: Vector::ZERO,
            ahead: scene.camera.ahead(),
            before,
        }
    }

    /// Continues with the next segment of the path, at the same time. Updated in place and vector
    /// by vector, since a copied segment would have to wait for its own numbers.
    #[inline(always)]
    pub fn advance(&mut self, ray: &Ray<R>, rest: R::Vec3) {
        if self.before >= R::ZERO {
            self.before += (ray.origin - self.start()).length();
        }
        self.ray.origin = ray.origin;
        self.ray.direction = ray.direction;
        self.ray.culls = ray.culls;
        self.rest = rest;
        self.ahead = R::ZERO;
    }

    /// Beginning of the segment.
    #[inline(always)]
    pub fn start(&self) -> R::Vec3 {
        if self.ahead == R::ZERO {
            self.ray.origin
        } else {
            self.ray.origin - self.ray.direction * self.ahead
        }
    }
}

impl<R: Real> Interaction<R> {
    /// The interaction of a hit.
    #[inline(always)]
    pub fn from_hit(scene: &Prepared<R>, segment: &PathSegment<R>, hit: &Hit<R>) -> Self {
        let mut interaction = Self::begun(scene, segment, hit);
        interaction.finish(scene, segment, hit);
        interaction.perturb_where_bumpy(scene, segment, hit);
        interaction
    }

    /// Applies the material's normal map, if any.
    #[inline(always)]
    pub fn perturb_where_bumpy(
        &mut self,
        scene: &Prepared<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) {
        if scene.objects[self.object as usize].bumpy {
            self.perturb_normal(scene, segment, hit);
        }
    }

    /// The interaction without the normal map.
    #[inline(always)]
    pub fn smooth(scene: &Prepared<R>, segment: &PathSegment<R>, hit: &Hit<R>) -> Self {
        let mut interaction = Self::begun(scene, segment, hit);
        interaction.finish(scene, segment, hit);
        interaction
    }

    /// An interaction with the data common to all hits, to be completed by [`Self::finish`].
    #[inline(always)]
    pub fn begun(scene: &Prepared<R>, segment: &PathSegment<R>, hit: &Hit<R>) -> Self {
        let mut interaction = Self::NOWHERE;
        interaction.begin(scene, segment, hit);
        interaction
    }

    /// [`Self::begun`] in place.
    #[inline(always)]
    pub fn begin(&mut self, scene: &Prepared<R>, segment: &PathSegment<R>, hit: &Hit<R>) {
        self.surface = scene.geometry.surface(&segment.ray, hit);
        self.begin_located(scene, &segment.ray, hit);
    }

    /// [`Self::begin`] for a known surface: field by field, since an interaction is large and would
    /// be copied.
    #[inline(always)]
    pub fn begin_located(&mut self, scene: &Prepared<R>, ray: &Ray<R>, hit: &Hit<R>) {
        self.object = hit.outermost();
        self.material = scene.objects[self.object as usize].material;
        self.normal = self.surface.normal;
        self.outside = ray.direction.dot(self.normal) < R::ZERO;
        self.direction = ray.direction;
        self.origin = ray.origin;
        self.distance = hit.t;
        self.time = ray.time;
        self.uv = [[R::ZERO; 2]; MOST_UV_SETS];
        self.footprint = [R::ZERO; MOST_UV_SETS];
        self.texel_footprint = None;
        self.colour = [R::ONE; 4];
    }

    /// Adds the data that depend on the object, the camera and the mesh, except the normal map.
    #[inline(always)]
    pub fn finish(&mut self, scene: &Prepared<R>, segment: &PathSegment<R>, hit: &Hit<R>) {
        let (ray, record) = (&segment.ray, &scene.objects[self.object as usize]);
        if segment.ahead != R::ZERO {
            (self.origin, self.distance) = (segment.start(), hit.t + segment.ahead);
        }
        if record.coordinates {
            let parameters = scene.geometry.parameters(ray, hit);
            // A shape has one set of coordinates, used for every set.
            self.uv = [[parameters.u, parameters.v]; MOST_UV_SETS];
        }
        self.attributes(scene, record, ray, hit);
        if segment.before >= R::ZERO
            && let Some(cone) = &scene.cone
        {
            self.cover(scene, cone, segment, hit);
        }
        if record.face_viewer && !self.outside {
            self.normal = -self.normal;
        }
        if record.mesh.is_some() {
            self.normal = reflecting_above::<R>(
                self.normal,
                self.surface.normal,
                self.outside,
                self.direction,
            );
        }
    }

    /// Interpolates the attributes of the mesh's vertices.
    fn attributes(
        &mut self,
        scene: &Prepared<R>,
        record: &ObjectRecord<R>,
        ray: &Ray<R>,
        hit: &Hit<R>,
    ) {
        let Some(mesh) = &record.mesh else { return };
        let data = &scene.meshes[mesh.mesh as usize];
        let [a, b, c] = data.indices[hit.primitive as usize].map(|i| i as usize);
        let (b, c) = if mesh.flipped { (c, b) } else { (b, c) };
        let (u, v) = (hit.u, hit.v);
        let w = R::ONE - u - v;
        let real = R::from_f32;
        if !data.normals.is_empty() {
            let normal = |i: usize| {
                R::Vec3::new(
                    real(data.normals[i][0]),
                    real(data.normals[i][1]),
                    real(data.normals[i][2]),
                )
            };
            let n = normal(a) * w + normal(b) * u + normal(c) * v;
            let [x, y, z] = mesh.normals;
            let n = if mesh.turns {
                scene.geometry.normal(ray, hit, n)
            } else {
                x * n.x() + y * n.y() + z * n.z()
            }
            .normalize();
            // Normals that cancel, or vanish under a flat transform, leave the geometric normal.
            if n.is_finite() {
                self.normal = n;
            }
        }
        let uv = |set: usize| {
            let set = data.uvs.get(set).filter(|set| !set.is_empty())?;
            let at = |k: usize| interpolate([a, b, c].map(|i| real(set[i][k])), [w, u, v]);
            Some([at(0), at(1)])
        };
        let mut sets = mesh.sets;
        if sets & 1 != 0 {
            // Without a set, the barycentric coordinates of the second and the third corner in the
            // file's order.
            self.uv[0] = uv(0).unwrap_or(if mesh.flipped { [v, u] } else { [u, v] });
            sets &= !1;
        }
        while sets != 0 {
            let set = sets.trailing_zeros() as usize;
            // The default of a missing attribute.
            self.uv[set] = uv(set).unwrap_or([R::ZERO; 2]);
            sets &= sets - 1;
        }
        if !data.colours.is_empty() {
            let at = |k: usize| interpolate([a, b, c].map(|i| real(data.colours[i][k])), [w, u, v]);
            self.colour = core::array::from_fn(at);
        }
    }
}
