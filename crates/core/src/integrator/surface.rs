//! From a hit to the interaction that it is, made once.

use raywright_bvh::{Hit, Ray, Real, Vector};

use crate::interaction::{Interaction, interpolate};
use crate::material::reflecting_above;
use crate::prepare::{ObjectRecord, Prepared};
use crate::scene::MOST_UV_SETS;

/// A ray as a path came along it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathSegment<R: Real> {
    pub ray: Ray<R>,
    /// What storing took from the direction.
    pub rest: R::Vec3,
    /// How far before its origin the ray began: a camera's that is far away. Zero for every other.
    pub ahead: R,
    /// How long the path was before, by which a ray of the camera has widened; below zero where
    /// nobody asks, as of rays to lights.
    pub before: R,
}

impl<R: Real> PathSegment<R> {
    /// A ray that starts where it is and is what it seems.
    pub fn of(ray: Ray<R>) -> Self {
        Self {
            ray,
            rest: Vector::ZERO,
            ahead: R::ZERO,
            before: -R::ONE,
        }
    }

    /// What is to be known of any ray of a scene's camera besides the ray.
    #[inline(always)]
    pub fn of_camera(scene: &Prepared<R>) -> Self {
        let before = if scene.cone.is_some() {
            R::ZERO
        } else {
            -R::ONE
        };
        // What a camera that is far away has of the way behind it lies before the ray's origin.
        let nowhere = Ray::new(Vector::ZERO, Vector::ZERO);
        Self {
            ray: nowhere,
            rest: Vector::ZERO,
            ahead: scene.camera.ahead(),
            before,
        }
    }

    /// Goes on with the next one of the path: it keeps the time. In its place and vector by vector,
    /// since a leg that is copied has to wait for its own numbers.
    #[inline(always)]
    pub fn go_on(&mut self, ray: &Ray<R>, rest: R::Vec3) {
        if self.before >= R::ZERO {
            self.before += (ray.origin - self.start()).length();
        }
        self.ray.origin = ray.origin;
        self.ray.direction = ray.direction;
        self.ray.culls = ray.culls;
        self.rest = rest;
        self.ahead = R::ZERO;
    }

    /// Where it began.
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
    /// Where a ray met what it hit.
    #[inline(always)]
    pub fn of(scene: &Prepared<R>, leg: &PathSegment<R>, hit: &Hit<R>) -> Self {
        let mut at = Self::begun(scene, leg, hit);
        at.finish(scene, leg, hit);
        at.perturb_where_bumpy(scene, leg, hit);
        at
    }

    /// Bends the normal where an image of the material does.
    #[inline(always)]
    pub fn perturb_where_bumpy(&mut self, scene: &Prepared<R>, leg: &PathSegment<R>, hit: &Hit<R>) {
        if scene.objects[self.object as usize].bumpy {
            self.perturb_normal(scene, leg, hit);
        }
    }

    /// The same before an image bends the normal.
    #[inline(always)]
    pub fn smooth(scene: &Prepared<R>, leg: &PathSegment<R>, hit: &Hit<R>) -> Self {
        let mut at = Self::begun(scene, leg, hit);
        at.finish(scene, leg, hit);
        at
    }

    /// What every hit has, still to be finished.
    #[inline(always)]
    pub fn begun(scene: &Prepared<R>, leg: &PathSegment<R>, hit: &Hit<R>) -> Self {
        let mut at = Self::NOWHERE;
        at.begin(scene, leg, hit);
        at
    }

    /// The same in its place.
    #[inline(always)]
    pub fn begin(&mut self, scene: &Prepared<R>, leg: &PathSegment<R>, hit: &Hit<R>) {
        self.surface = scene.geometry.surface(&leg.ray, hit);
        self.begin_located(scene, &leg.ray, hit);
    }

    /// The same where the surface is known: field by field, since an interaction is long and is
    /// copied wherever it is handed on.
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
        self.lies = None;
        self.colour = [R::ONE; 4];
    }

    /// Adds what depends on the object, the camera and the mesh; the normal is not bent yet.
    #[inline(always)]
    pub fn finish(&mut self, scene: &Prepared<R>, leg: &PathSegment<R>, hit: &Hit<R>) {
        let (ray, record) = (&leg.ray, &scene.objects[self.object as usize]);
        if leg.ahead != R::ZERO {
            (self.origin, self.distance) = (leg.start(), hit.t + leg.ahead);
        }
        if record.coordinates {
            let parameters = scene.geometry.parameters(ray, hit);
            // A shape has one set, whatever set is asked for.
            self.uv = [[parameters.u, parameters.v]; MOST_UV_SETS];
        }
        self.attributes(scene, record, ray, hit);
        if leg.before >= R::ZERO
            && let Some(cone) = &scene.cone
        {
            self.cover(scene, cone, leg, hit);
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

    /// Interpolates what the mesh's vertices carry.
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
            // Normals that cancel, or that a flat transform squeezes to nothing, leave the facet's.
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
            // Without a set, the weights of the second and the third corner of the file's own
            // order.
            self.uv[0] = uv(0).unwrap_or(if mesh.flipped { [v, u] } else { [u, v] });
            sets &= !1;
        }
        while sets != 0 {
            let set = sets.trailing_zeros() as usize;
            // What a shader reads of an attribute that a mesh does not have.
            self.uv[set] = uv(set).unwrap_or([R::ZERO; 2]);
            sets &= sets - 1;
        }
        if !data.colours.is_empty() {
            let at = |k: usize| interpolate([a, b, c].map(|i| real(data.colours[i][k])), [w, u, v]);
            self.colour = core::array::from_fn(at);
        }
    }
}
