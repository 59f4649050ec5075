//! Shading normals of hits on meshes: interpolated from the normals of the corners, for one hit or
//! for several side by side. A root and a quotient take long; side by side they are paid once.

use raywright_bvh::{Hit, Ray, Real, SimdTask, Vector, run_widest};

use crate::interaction::Interaction;
use crate::light::{LANES, LaneColumn, Vec3Column, get_lane_vector, set_lane_vector};
use crate::material::{ensure_reflection_above, reflects_above};
use crate::prepare::{ObjectMesh, ObjectRecord, PreparedScene};

/// Normals at the corners of a hit triangle, and the weights of the hit.
struct CornerNormals<R: Real> {
    normals: [R::Vec3; 3],
    /// Barycentric weights.
    weights: [R; 3],
}

impl<R: Real> CornerNormals<R> {
    /// Reads the normals of a hit's triangle; `None` if the mesh has no normals.
    #[inline(always)]
    fn from_hit(scene: &PreparedScene<R>, mesh: &ObjectMesh<R>, hit: &Hit<R>) -> Option<Self> {
        let data = &scene.meshes[mesh.mesh as usize];
        if data.normals.is_empty() {
            return None;
        }
        let [a, b, c] = mesh.corner_indices(data, hit);
        let normal = |i: usize| {
            let [x, y, z] = data.normals[i];
            R::Vec3::new(R::from_f32(x), R::from_f32(y), R::from_f32(z))
        };
        Some(Self {
            normals: [normal(a), normal(b), normal(c)],
            weights: [R::ONE - hit.u - hit.v, hit.u, hit.v],
        })
    }

    /// Returns the weighted sum of the normals, in the space of the mesh.
    #[inline(always)]
    fn interpolate(&self) -> R::Vec3 {
        let ([a, b, c], [w, u, v]) = (self.normals, self.weights);
        a * w + b * u + c * v
    }
}

/// Returns a normal of a mesh in the world. `axes` are the columns of the map of normals.
#[inline(always)]
fn transform_normal<R: Real>([x, y, z]: [R::Vec3; 3], n: R::Vec3) -> R::Vec3 {
    x * n.x() + y * n.y() + z * n.z()
}

impl<R: Real> Interaction<R> {
    /// Sets the shading normal of a hit on an object. Without normals at the corners, or where they
    /// cancel or vanish under a flat transform, the geometric normal is the shading normal.
    #[inline(always)]
    pub fn set_shading_normal(
        &mut self,
        scene: &PreparedScene<R>,
        record: &ObjectRecord<R>,
        (ray, hit): (&Ray<R>, &Hit<R>),
    ) {
        if let Some(mesh) = &record.mesh
            && let Some(corners) = CornerNormals::from_hit(scene, mesh, hit)
        {
            let n = corners.interpolate();
            let n = if mesh.rotates {
                scene.geometry.normal_to_world(ray, hit, n)
            } else {
                transform_normal::<R>(mesh.normals, n)
            }
            .normalize();
            if n.is_finite() {
                self.normal = n;
            }
        }
        if record.face_viewer && !self.outside {
            self.normal = -self.normal;
        }
        if record.mesh.is_some() {
            self.bend_shading_normal();
        }
    }

    /// Bends a shading normal that reflects the view below the surface.
    #[inline(always)]
    fn bend_shading_normal(&mut self) {
        self.normal = ensure_reflection_above::<R>(
            self.normal,
            self.surface.normal,
            self.outside,
            self.direction,
        );
    }
}

/// Normals at the corners of up to [`LANES`] hit triangles, as a structure of arrays.
pub(super) struct CornerNormalLanes<R: Real> {
    corners: [Vec3Column<R>; 3],
    weights: [LaneColumn<R>; 3],
    /// Columns of the maps of normals.
    axes: [Vec3Column<R>; 3],
    /// Whether the map of normals in each lane changes no normal.
    keeps_normals: LaneColumn<bool>,
    /// Whether the shading normal is turned to the ray's side.
    faces_viewer: LaneColumn<bool>,
}

/// Normals at hits, as a structure of arrays.
pub(super) struct FacingNormalLanes<R: Real> {
    /// Shading normals.
    pub shading: Vec3Column<R>,
    /// Geometric normals on the rays' sides.
    pub geometric: Vec3Column<R>,
}

impl<R: Real> CornerNormalLanes<R> {
    pub fn new() -> Self {
        let (zero, one) = ([R::ZERO; LANES], [R::ONE; LANES]);
        Self {
            corners: [[zero; 3]; 3],
            weights: [zero; 3],
            axes: [[one, zero, zero], [zero, one, zero], [zero, zero, one]],
            keeps_normals: [true; LANES],
            faces_viewer: [false; LANES],
        }
    }

    /// Sets the hit in a lane. Normals of zero stand for a mesh without normals.
    #[inline(always)]
    pub fn set_hit(
        &mut self,
        lane: usize,
        scene: &PreparedScene<R>,
        (record, mesh): (&ObjectRecord<R>, &ObjectMesh<R>),
        hit: &Hit<R>,
    ) {
        match CornerNormals::from_hit(scene, mesh, hit) {
            Some(corners) => self.set_lane(lane, &corners, record, mesh),
            None => {
                self.corners
                    .iter_mut()
                    .for_each(|column| set_lane_vector::<R>(column, lane, Vector::ZERO));
                self.faces_viewer[lane] = record.face_viewer;
            }
        }
    }

    #[inline(always)]
    fn set_lane(
        &mut self,
        lane: usize,
        corners: &CornerNormals<R>,
        record: &ObjectRecord<R>,
        mesh: &ObjectMesh<R>,
    ) {
        for (column, normal) in self.corners.iter_mut().zip(corners.normals) {
            set_lane_vector::<R>(column, lane, normal);
        }
        for (column, weight) in self.weights.iter_mut().zip(corners.weights) {
            column[lane] = weight;
        }
        // Most maps change no normal, and such a map is mostly in the lane already.
        if !(mesh.keeps_normals & self.keeps_normals[lane]) {
            for (column, axis) in self.axes.iter_mut().zip(mesh.normals) {
                set_lane_vector::<R>(column, lane, axis);
            }
            self.keeps_normals[lane] = mesh.keeps_normals;
        }
        self.faces_viewer[lane] = record.face_viewer;
    }

    /// Returns the normals at the hits of the first `len` lanes, given their outward geometric
    /// normals and the directions of their rays.
    #[inline(always)]
    pub fn facing_normals(
        &self,
        geometric: &Vec3Column<R>,
        direction: &Vec3Column<R>,
        len: usize,
    ) -> FacingNormalLanes<R> {
        let (mut normals, is_kept) = run_widest(ShadingNormalTask {
            corners: self,
            geometric,
            direction,
        });
        for (lane, _) in is_kept.iter().enumerate().take(len).filter(|kept| !kept.1) {
            let n = ensure_reflection_above::<R>(
                get_lane_vector::<R>(&normals.shading, lane),
                get_lane_vector::<R>(&normals.geometric, lane),
                true,
                get_lane_vector::<R>(direction, lane),
            );
            set_lane_vector::<R>(&mut normals.shading, lane, n);
        }
        normals
    }
}

/// Up to [`LANES`] hits on meshes with normals, as a structure of arrays.
pub(super) struct ShadingNormalLanes<R: Real> {
    len: usize,
    /// Indices of the hits' interactions.
    indices: LaneColumn<usize>,
    corners: CornerNormalLanes<R>,
    /// Outward geometric normals.
    geometric: Vec3Column<R>,
    direction: Vec3Column<R>,
}

impl<R: Real> ShadingNormalLanes<R> {
    pub fn new() -> Self {
        let none = [[R::ZERO; LANES]; 3];
        Self {
            len: 0,
            indices: [0; LANES],
            corners: CornerNormalLanes::new(),
            geometric: none,
            direction: none,
        }
    }

    /// Sets the shading normal of a hit: now, or with others in [`Self::flush`]. `index` is the
    /// index of the hit's interaction in `interactions`.
    #[inline(always)]
    pub fn push_hit(
        &mut self,
        scene: &PreparedScene<R>,
        (interactions, index): (&mut [Interaction<R>], usize),
        (ray, hit): (&Ray<R>, &Hit<R>),
    ) {
        let interaction = &mut interactions[index];
        let record = &scene.objects[interaction.object as usize];
        let mesh = record.mesh.as_ref().filter(|mesh| !mesh.rotates);
        let corners =
            mesh.and_then(|mesh| Some((mesh, CornerNormals::from_hit(scene, mesh, hit)?)));
        let Some((mesh, corners)) = corners else {
            interaction.set_shading_normal(scene, record, (ray, hit));
            return;
        };
        let lane = self.len;
        self.len += 1;
        self.indices[lane] = index;
        self.corners.set_lane(lane, &corners, record, mesh);
        set_lane_vector::<R>(&mut self.geometric, lane, interaction.surface.normal);
        set_lane_vector::<R>(&mut self.direction, lane, interaction.direction);
        if self.len == LANES {
            self.flush(interactions);
        }
    }

    /// Sets the shading normals of the pending hits.
    #[inline(always)]
    pub fn flush(&mut self, interactions: &mut [Interaction<R>]) {
        if self.len == 0 {
            return;
        }
        let normals = self
            .corners
            .facing_normals(&self.geometric, &self.direction, self.len);
        for (lane, &index) in self.indices.iter().enumerate().take(self.len) {
            interactions[index].normal = get_lane_vector::<R>(&normals.shading, lane);
        }
        self.len = 0;
    }
}

/// Task of [`run_widest`]: the normals at hits before shading normals are bent, and whether each is
/// kept as it is.
struct ShadingNormalTask<'a, R: Real> {
    corners: &'a CornerNormalLanes<R>,
    geometric: &'a Vec3Column<R>,
    direction: &'a Vec3Column<R>,
}

impl<R: Real> SimdTask for ShadingNormalTask<'_, R> {
    type Output = (FacingNormalLanes<R>, LaneColumn<bool>);
    #[inline(always)]
    fn run(self) -> Self::Output {
        let (lanes, none) = (self.corners, [[R::ZERO; LANES]; 3]);
        let mut normals = FacingNormalLanes {
            shading: none,
            geometric: none,
        };
        let mut is_kept = [false; LANES];
        for (lane, is_kept) in is_kept.iter_mut().enumerate() {
            let vectors = |columns: &[Vec3Column<R>; 3]| {
                [
                    get_lane_vector::<R>(&columns[0], lane),
                    get_lane_vector::<R>(&columns[1], lane),
                    get_lane_vector::<R>(&columns[2], lane),
                ]
            };
            let corners = CornerNormals::<R> {
                normals: vectors(&lanes.corners),
                weights: [
                    lanes.weights[0][lane],
                    lanes.weights[1][lane],
                    lanes.weights[2][lane],
                ],
            };
            let n = transform_normal::<R>(vectors(&lanes.axes), corners.interpolate()).normalize();
            let geometric = get_lane_vector::<R>(self.geometric, lane);
            let direction = get_lane_vector::<R>(self.direction, lane);
            let outside = direction.dot(geometric) < R::ZERO;
            let n = if n.is_finite() { n } else { geometric };
            let n = if lanes.faces_viewer[lane] & !outside {
                -n
            } else {
                n
            };
            let facing = if outside { geometric } else { -geometric };
            set_lane_vector::<R>(&mut normals.shading, lane, n);
            set_lane_vector::<R>(&mut normals.geometric, lane, facing);
            *is_kept = reflects_above::<R>(n, facing, true, direction);
        }
        (normals, is_kept)
    }
}

#[cfg(test)]
mod tests;
