//! Outermost points of a scene, which determine its silhouette from any side. They are found in two
//! passes without storing all points.

use std::cell::Cell;
use std::collections::HashMap;

use glam::DVec3;
use raywright_bvh::shapes::transform_bounds;
use raywright_bvh::{Aabb, Shape as _};

use super::{Patch, contains, examine, find_view_bounds, mesh_vertex_position};
use crate::extent::{flattens_surfaces, surface_triangles};
use crate::generate::{all_objects, objects_with_counts};
use crate::lookup::SceneLookup;
use crate::scene::{MeshData, Scene, Shape};
use crate::shape::convert_moved_shape;

/// Number of cells along an edge of the cube that divides directions, for a scene or for a mesh
/// with few uses (see [`select_outermost_points`]).
pub(super) const FINE_CELLS: usize = 64;
/// Number of cells along an edge of that cube, for a mesh with many uses.
const COARSE_CELLS: usize = 12;

/// Greatest number of objects that show a mesh for which the fine division is used.
const MAX_FINE_USES: u64 = 4;

/// Greatest number of points that are visited. For any further object, only the corners of its
/// bounding box are visited. Points are visited one by one and not stored.
const MAX_POINTS: usize = 1 << 22;

/// Outermost points of the objects of a scene, in the objects' own spaces.
pub(super) struct OutlinePoints<'a> {
    /// Outermost points of each mesh, and its area, by name.
    meshes: HashMap<&'a str, (Vec<DVec3>, f64)>,
    /// Points of a ball of radius 1, for spheres.
    ball: Vec<DVec3>,
    /// Number of triangles of all objects.
    pub triangles: usize,
    /// Whether a mesh has stray parts, whose points are missing.
    pub has_stray_parts: bool,
}

impl<'a> OutlinePoints<'a> {
    pub fn from_scene(scene: &'a Scene, lookup: &SceneLookup<'_>) -> Self {
        let mut uses: HashMap<&str, u64> = HashMap::new();
        let mut triangles = 0_u64;
        for (object, count) in objects_with_counts(scene) {
            let Shape::Mesh(name) = &object.shape else {
                continue;
            };
            let uses = uses.entry(name).or_default();
            *uses = uses.saturating_add(count);
            let own = lookup
                .mesh_data(name)
                .map_or(0, |data| data.indices.len() as u64);
            triangles = triangles.saturating_add(count.saturating_mul(own));
        }
        let has_stray_parts = Cell::new(false);
        let hull = |(name, uses): (&'a str, u64)| {
            let data = lookup.mesh_data(name)?;
            let used = find_used_vertices(data);
            let patches = examine(surface_patches(data), data.indices.len());
            let view = find_view_bounds(&patches);
            let is_stray = |point: &DVec3| view.is_some_and(|view| !contains(&view, *point));
            let edge = if uses > MAX_FINE_USES {
                COARSE_CELLS
            } else {
                FINE_CELLS
            };
            let points = |visit: &mut dyn FnMut(DVec3)| {
                for point in used_vertex_positions(data, &used) {
                    match is_stray(&point) {
                        true => has_stray_parts.set(true),
                        false => visit(point),
                    }
                }
            };
            let examined: f64 = patches.iter().map(|(_, area)| area).sum();
            let area = examined * data.indices.len() as f64 / patches.len().max(1) as f64;
            Some((name, (select_outermost_points(points, edge), area)))
        };
        Self {
            meshes: uses.into_iter().filter_map(hull).collect(),
            ball: unit_sphere_points(),
            triangles: triangles as usize,
            has_stray_parts: has_stray_parts.get(),
        }
    }

    /// Returns bounds and area of the objects of a scene.
    pub fn object_patches(&self, scene: &Scene) -> Vec<Patch> {
        let count = objects_with_counts(scene)
            .map(|(_, count)| count)
            .sum::<u64>();
        let patches = all_objects(scene).filter_map(|placed_object| {
            let (bounds, area) = match &placed_object.object.shape {
                Shape::Mesh(name) => {
                    let (points, area) = self.meshes.get(name.as_str())?;
                    (Aabb::from_points(points.iter().copied()), *area)
                }
                shape => {
                    let bounds = Aabb::from_points(bounding_box_corners(shape));
                    let [x, y, z] = bounds.extent().to_array();
                    (bounds, 2.0 * (x * y + y * z + z * x))
                }
            };
            let map = placed_object.object_to_world();
            let scale = libm::cbrt(map.matrix3.determinant().abs());
            (!bounds.is_empty()).then(|| (transform_bounds(&map, &bounds), area * scale * scale))
        });
        examine(patches, usize::try_from(count).unwrap_or(usize::MAX))
    }

    /// Visits the points of all objects in world space.
    pub fn visit_points(&self, scene: &Scene, visit: &mut dyn FnMut(DVec3)) {
        // The additive identity, which keeps the sign of zeros.
        const NOWHERE: DVec3 = DVec3::splat(-0.0);
        let mut seen = 0;
        for placed_object in all_objects(scene) {
            let (own, size, centre) = match &placed_object.object.shape {
                Shape::Mesh(name) => (
                    self.meshes
                        .get(name.as_str())
                        .map_or(&[][..], |(points, _)| points),
                    1.0,
                    NOWHERE,
                ),
                Shape::Sphere { centre, radius } => (&self.ball[..], *radius, DVec3::from(*centre)),
                shape => (&bounding_box_corners(shape)[..], 1.0, NOWHERE),
            };
            let boxed;
            let own = if seen + own.len() <= MAX_POINTS {
                own
            } else {
                boxed = Aabb::from_points(own.iter().copied()).corners();
                &boxed
            };
            let maps = placed_object
                .object_to_world_at_ends()
                .unwrap_or([placed_object.object_to_world(); 2]);
            let maps = &maps[..1 + usize::from(maps[0] != maps[1])];
            for map in maps.iter().filter(|map| !flattens_surfaces(map)) {
                let points = own
                    .iter()
                    .map(|&point| map.transform_point3(centre + point * size))
                    .filter(|point| point.is_finite());
                points.for_each(|point| {
                    seen += 1;
                    visit(point);
                });
            }
        }
    }
}

/// Iterates over bounds and area of the triangles of a mesh, in its own space.
fn surface_patches(data: &MeshData) -> impl Iterator<Item = Patch> {
    data.indices.iter().map(|corners| {
        let [a, b, c] = corners.map(|i| mesh_vertex_position(data, i));
        let area = 0.5 * (b - a).cross(c - a).length();
        (Aabb::from_points([a, b, c]), area)
    })
}

/// Returns for each vertex of a mesh whether a triangle with an area uses it.
fn find_used_vertices(data: &MeshData) -> Vec<bool> {
    let mut used = vec![false; data.positions.len()];
    surface_triangles(data)
        .flatten()
        .for_each(|i| used[i as usize] = true);
    used
}

/// Iterates over the finite vertex positions that are flagged as used, each once.
fn used_vertex_positions(data: &MeshData, used: &[bool]) -> impl Iterator<Item = DVec3> {
    let used = used.iter().enumerate().filter(|(_, used)| **used);
    used.map(|(i, _)| mesh_vertex_position(data, i as u32))
        .filter(|point| point.is_finite())
}

/// Returns points on a sphere of radius 1, one in the middle of each coarse cell of directions.
fn unit_sphere_points() -> Vec<DVec3> {
    let direction = |cell: usize| {
        let (face, row, column) = (
            cell / (COARSE_CELLS * COARSE_CELLS),
            cell / COARSE_CELLS % COARSE_CELLS,
            cell % COARSE_CELLS,
        );
        let at = |i: usize| 2.0 * (i as f64 + 0.5) / COARSE_CELLS as f64 - 1.0;
        let mut direction = DVec3::ZERO;
        direction[face % 3] = if face < 3 { 1.0 } else { -1.0 };
        direction[(face + 1) % 3] = at(row);
        direction[(face + 2) % 3] = at(column);
        direction.normalize()
    };
    (0..6 * COARSE_CELLS * COARSE_CELLS)
        .map(direction)
        .collect()
}

/// Returns the corners of the box around a shape.
fn bounding_box_corners(shape: &Shape) -> Vec<DVec3> {
    let bounds = convert_moved_shape::<f64>(shape, DVec3::ZERO)
        .and_then(|shape| shape.bounds())
        .filter(|bounds| !bounds.is_empty());
    bounds
        .filter(|bounds| bounds.to_padded().is_some())
        .map_or(Vec::new(), |bounds| bounds.corners().to_vec())
}

/// Returns the outermost points of a set: in each cell of directions from the middle of its
/// bounding box, the farthest point.
///
/// - The cells divide the faces of a cube, `edge` cells along each edge.
/// - Directions and distances are measured after scaling the bounding box to a cube.
/// - Of equally far points, the first is returned.
/// - If the points are not more than the cells, all are returned.
/// - `points` is called twice, so that no list of all points is stored.
pub(super) fn select_outermost_points(
    points: impl Fn(&mut dyn FnMut(DVec3)),
    edge: usize,
) -> Vec<DVec3> {
    let cells = 6 * edge * edge;
    let (mut few, mut count, mut bounds) = (Vec::new(), 0_usize, Aabb::EMPTY);
    points(&mut |point| {
        count += 1;
        bounds.min = DVec3::select(point.cmplt(bounds.min), point, bounds.min);
        bounds.max = DVec3::select(point.cmpgt(bounds.max), point, bounds.max);
        if count <= cells {
            few.push(point);
        }
    });
    if count <= cells {
        return few;
    }
    let (centre, half) = (bounds.centre(), bounds.extent() * 0.5);
    let scale = DVec3::from_array(
        [half.x, half.y, half.z].map(|half| if half > 0.0 { 1.0 / half } else { 0.0 }),
    );
    let mut farthest: Vec<Option<(f64, DVec3)>> = vec![None; cells];
    points(&mut |point| {
        let direction = (point - centre) * scale;
        let distance = direction.length_squared();
        let axis =
            if direction.x.abs() >= direction.y.abs() && direction.x.abs() >= direction.z.abs() {
                0
            } else {
                1 + usize::from(direction.z.abs() > direction.y.abs())
            };
        let maximum = direction[axis];
        if maximum == 0.0 {
            return;
        }
        let place =
            |x: f64| ((0.5 * (x / maximum.abs() + 1.0) * edge as f64) as usize).min(edge - 1);
        let face = axis + 3 * usize::from(maximum < 0.0);
        let cell = &mut farthest[(face * edge + place(direction[(axis + 1) % 3])) * edge
            + place(direction[(axis + 2) % 3])];
        if cell.is_none_or(|(other, _)| distance > other) {
            *cell = Some((distance, point));
        }
    });
    let outermost: Vec<DVec3> = farthest
        .into_iter()
        .flatten()
        .map(|(_, point)| point)
        .collect();
    // All points coincide.
    if outermost.is_empty() {
        vec![centre]
    } else {
        outermost
    }
}
