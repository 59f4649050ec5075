//! Creation of an interaction from a hit: surface point, texture coordinates and shading normal.

use raywright_bvh::{Hit, Ray, Real, Vector, prefetch};

use crate::interaction::{Interaction, interpolate_vertex_attribute};
use crate::prepare::{ObjectMesh, PreparedScene};
use crate::scene::{MOST_UV_SETS, MeshData};

/// A segment of a path: its ray, and data carried from segment to segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathSegment<R: Real> {
    pub ray: Ray<R>,
    /// Rounding error of the ray's direction: the exact direction minus the stored one.
    pub direction_error: R::Vec3,
    /// Distance from the eye to the ray's origin. Zero except for camera rays of a distant camera,
    /// which start near the scene.
    pub skipped_distance: R,
    /// Length of the path before this segment, for the width of the camera's ray cone. Negative if
    /// neither mip maps nor edges need a ray cone, and for shadow rays.
    pub length_before: R,
}

impl<R: Real> PathSegment<R> {
    /// Creates a segment from a ray without rounding error and without a ray cone.
    pub fn from_ray(ray: Ray<R>) -> Self {
        Self {
            ray,
            direction_error: Vector::ZERO,
            skipped_distance: R::ZERO,
            length_before: -R::ONE,
        }
    }

    /// Creates the first segment of a path. The caller sets its ray.
    #[inline(always)]
    pub fn from_camera(scene: &PreparedScene<R>) -> Self {
        let before = if scene.cone.is_some() || scene.draws_edges {
            R::ZERO
        } else {
            -R::ONE
        };
        // For a distant camera, part of the segment lies before the ray's origin.
        let nowhere = Ray::new(Vector::ZERO, Vector::ZERO);
        Self {
            ray: nowhere,
            direction_error: Vector::ZERO,
            skipped_distance: scene.camera.eye_to_origin_distance(),
            length_before: before,
        }
    }

    /// Replaces this segment by the next segment of the path, along `ray`. `rest` is the rounding
    /// error of the new direction. The time stays.
    ///
    /// Each vector is updated in place: reading a copy would wait until the vectors are stored.
    #[inline(always)]
    pub fn advance_to_ray(&mut self, ray: &Ray<R>, rest: R::Vec3) {
        if self.length_before >= R::ZERO {
            self.length_before += (ray.origin - self.start_point()).length();
        }
        self.ray.origin = ray.origin;
        self.ray.direction = ray.direction;
        self.ray.is_camera_ray = ray.is_camera_ray;
        self.direction_error = rest;
        self.skipped_distance = R::ZERO;
    }

    /// Returns the start of the segment: the ray's origin, or the eye of a distant camera.
    #[inline(always)]
    pub fn start_point(&self) -> R::Vec3 {
        if self.skipped_distance == R::ZERO {
            self.ray.origin
        } else {
            self.ray.origin - self.ray.direction * self.skipped_distance
        }
    }
}

impl<R: Real> PreparedScene<R> {
    /// Prefetches the vertex indices of a hit triangle of a mesh.
    #[inline(always)]
    pub fn prefetch_vertex_indices(&self, hit: &Hit<R>) {
        if let Some(mesh) = &self.objects[hit.outermost_id() as usize].mesh {
            prefetch(
                &self.meshes[mesh.mesh as usize].indices,
                hit.primitive as usize,
            );
        }
    }

    /// Prefetches the normals and the first texture coordinates of a hit triangle's vertices.
    #[inline(always)]
    pub fn prefetch_vertex_attributes(&self, hit: &Hit<R>) {
        let Some(mesh) = &self.objects[hit.outermost_id() as usize].mesh else {
            return;
        };
        let data = &self.meshes[mesh.mesh as usize];
        let uvs = data.uvs.get(mesh.uv_sets.trailing_zeros() as usize);
        for index in data.indices[hit.primitive as usize] {
            prefetch(&data.normals, index as usize);
            if let Some(uvs) = uvs {
                prefetch(uvs, index as usize);
            }
        }
    }
}

impl<R: Real> ObjectMesh<R> {
    /// Returns the indices of a hit triangle's vertices, in the order of the hit's barycentric
    /// weights.
    #[inline(always)]
    pub fn corner_indices(&self, data: &MeshData, hit: &Hit<R>) -> [usize; 3] {
        let [a, b, c] = data.indices[hit.primitive as usize].map(|i| i as usize);
        let (b, c) = if self.flipped { (c, b) } else { (b, c) };
        [a, b, c]
    }
}

impl<R: Real> Interaction<R> {
    /// Creates the interaction of a hit.
    #[inline(always)]
    pub fn from_hit(scene: &PreparedScene<R>, segment: &PathSegment<R>, hit: &Hit<R>) -> Self {
        let mut interaction = Self::with_hit_geometry(scene, segment, hit);
        interaction.fill_attributes(scene, segment, hit);
        interaction.apply_normal_map(scene, segment, hit);
        interaction
    }

    /// Applies the material's normal map, if any.
    #[inline(always)]
    pub fn apply_normal_map(
        &mut self,
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) {
        if scene.objects[self.object as usize].needs_tangents {
            self.perturb_normal(scene, segment, hit);
        }
    }

    /// Creates the interaction of a hit; the material's normal map is not applied.
    #[inline(always)]
    pub fn from_hit_without_normal_map(
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) -> Self {
        let mut interaction = Self::with_hit_geometry(scene, segment, hit);
        interaction.fill_attributes(scene, segment, hit);
        interaction
    }

    /// Creates an interaction with only the geometric data of a hit. [`Self::fill_attributes`]
    /// completes the interaction.
    #[inline(always)]
    pub fn with_hit_geometry(
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) -> Self {
        let mut interaction = Self::PLACEHOLDER;
        interaction.fill_geometry(scene, segment, hit);
        interaction
    }

    /// Sets the geometric data of a hit in place.
    #[inline(always)]
    pub fn fill_geometry(
        &mut self,
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) {
        self.surface = scene.geometry.surface(&segment.ray, hit);
        self.fill_geometry_from_surface(scene, &segment.ray, hit);
    }

    /// Sets the geometric data of a hit, except `surface`, which the caller has set. Fields are set
    /// one by one: an interaction is large, and a new value would be copied.
    #[inline(always)]
    pub fn fill_geometry_from_surface(
        &mut self,
        scene: &PreparedScene<R>,
        ray: &Ray<R>,
        hit: &Hit<R>,
    ) {
        self.object = hit.outermost_id();
        self.material = scene.objects[self.object as usize].material;
        self.normal = self.surface.normal;
        // Not of the copy, which would be waited for.
        self.outside = ray.direction.dot(self.surface.normal) < R::ZERO;
        self.direction = ray.direction;
        self.origin = ray.origin;
        self.distance = hit.t;
        self.time = ray.time;
        self.uv = [[R::ZERO; 2]; MOST_UV_SETS];
        self.footprint = [R::ZERO; MOST_UV_SETS];
        self.texel_footprint = None;
        self.colour = [R::ONE; 4];
    }

    /// Sets the data that depend on object, camera and mesh: texture coordinates, footprints and
    /// shading normal. The normal map is not applied.
    #[inline(always)]
    pub fn fill_attributes(
        &mut self,
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) {
        self.fill_texture_coordinates(scene, segment, hit);
        let record = &scene.objects[self.object as usize];
        self.set_shading_normal(scene, record, (&segment.ray, hit));
    }

    /// Sets texture coordinates, their footprints and vertex colours, and the origin of a ray that
    /// starts at a distant eye.
    #[inline(always)]
    pub fn fill_texture_coordinates(
        &mut self,
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) {
        let (ray, record) = (&segment.ray, &scene.objects[self.object as usize]);
        if segment.skipped_distance != R::ZERO {
            (self.origin, self.distance) =
                (segment.start_point(), hit.t + segment.skipped_distance);
        }
        if record.needs_uv {
            let parameters = scene.geometry.texture_coordinates(ray, hit);
            // A shape has one set of coordinates, used for every set.
            self.uv = [[parameters.u, parameters.v]; MOST_UV_SETS];
        }
        if let Some(mesh) = &record.mesh {
            self.interpolate_attributes(scene, mesh, hit);
        }
        if segment.length_before >= R::ZERO
            && let Some(cone) = &scene.cone
        {
            self.compute_footprints(scene, cone, segment, hit);
        }
    }

    /// Interpolates texture coordinates and colours of a mesh's vertices at a hit.
    #[inline(always)]
    fn interpolate_attributes(
        &mut self,
        scene: &PreparedScene<R>,
        mesh: &ObjectMesh<R>,
        hit: &Hit<R>,
    ) {
        let data = &scene.meshes[mesh.mesh as usize];
        if mesh.uv_sets == 0 && data.colours.is_empty() {
            return;
        }
        let [a, b, c] = mesh.corner_indices(data, hit);
        let (u, v) = (hit.u, hit.v);
        let w = R::ONE - u - v;
        let real = R::from_f32;
        let uv = |set: usize| {
            let set = data.uvs.get(set).filter(|set| !set.is_empty())?;
            let at = |k: usize| {
                interpolate_vertex_attribute([a, b, c].map(|i| real(set[i][k])), [w, u, v])
            };
            Some([at(0), at(1)])
        };
        let mut sets = mesh.uv_sets;
        if sets & 1 != 0 {
            // A mesh without texture coordinates uses the barycentric coordinates of the second and
            // the third corner, in the order of the file.
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
            let at = |k: usize| {
                interpolate_vertex_attribute([a, b, c].map(|i| real(data.colours[i][k])), [w, u, v])
            };
            self.colour = core::array::from_fn(at);
        }
    }
}
