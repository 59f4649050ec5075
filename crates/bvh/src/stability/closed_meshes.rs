//! Cases T03, T06, T07 and T10: flat lattices of cells, and closed meshes of any size and position.
//! No ray may pass through them.

use glam::{DVec3, Vec3};

use super::triangles::{ClosedMesh, create_icosphere};
use super::verdicts::{
    CaseOutcome, CaseRng, RayCount, Verdict, create_ray_towards, create_unnormalised_ray,
    format_ray_bits, judge_rays, round_to_f32, to_scalar,
};
use super::{Measurement, measure_by_each_kernel};
use crate::shapes::{AnyShape, Cuboid};
use crate::{Aabb, AcceleratorKind, Geometry, Interval, PrimitiveSet, Ray, Real, Visibility};

/// Number of cells along each side of a lattice.
const CELLS: usize = 20;

/// Whether both a closest-hit query and an any-hit query of the ray find a hit.
fn is_hit<R: Real>(geometry: &Geometry<R>, ray: &Ray<R>) -> bool {
    let range = Interval::positive();
    geometry.closest(ray, range, &mut ()).is_some()
        && geometry.occluded(ray, range, &mut |_| true, &mut ())
}

/// Creates a point from its coordinate `along` an axis and its coordinates `a` and `b` on the two
/// axes that follow cyclically.
fn point_across_axis(axis: usize, [a, b]: [f64; 2], along: f64) -> DVec3 {
    let mut p = DVec3::ZERO;
    (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (along, a, b);
    p
}

/// Builds a flat lattice of square cells perpendicular to an axis, with two triangles per cell.
/// `is_flipped` reverses the winding of the triangles.
fn build_flat_lattice<R: Real>(axis: usize, is_flipped: bool) -> Geometry<R> {
    let mut group = PrimitiveSet::<R>::default();
    for cell in 0..CELLS * CELLS {
        let (i, j) = ((cell % CELLS) as f64, (cell / CELLS) as f64);
        let at = |a: f64, b: f64| to_scalar::<R>(point_across_axis(axis, [i + a, j + b], 0.0));
        for [a, b, c] in [
            [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0)],
            [at(0.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
        ] {
            let corners = if is_flipped { [a, c, b] } else { [a, b, c] };
            group
                .add_triangle(corners, Visibility::default())
                .expect("finite corners");
        }
    }
    Geometry::new(group, AcceleratorKind::default())
}

/// Builds a lattice of solid cubes.
fn build_solid_lattice<R: Real>(axis: usize) -> Geometry<R> {
    let mut group = PrimitiveSet::<R>::default();
    for cell in 0..CELLS * CELLS {
        let min = point_across_axis(axis, [(cell % CELLS) as f64, (cell / CELLS) as f64], -1.0);
        group
            .add_shape(
                AnyShape::Cuboid(Cuboid::new(min, min + 1.0)),
                Visibility::default(),
            )
            .expect("finite corners");
    }
    Geometry::new(group, AcceleratorKind::default())
}

/// Measures case T03: rays perpendicular to a flat lattice of square cells, through each corner and
/// each middle of an edge or cell. The cells are pairs of triangles, or solid cubes. The zero
/// components of the ray directions have either sign.
pub fn measure_lattices<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let trees = (0..3)
        .flat_map(|axis| {
            [
                build_flat_lattice(axis, false),
                build_flat_lattice(axis, true),
                build_solid_lattice(axis),
            ]
        })
        .collect();
    let places = 2 * CELLS as u64 - 1;
    measure_by_each_kernel::<R>(trees, |trees| {
        let each = trees.iter().enumerate().map(|(index, tree)| {
            // The number of rays is so small that either ray count traces all of them.
            judge_rays("T03", 203, (places * places * 4) as u32, rays, |rng| {
                let (place, signs) = (rng.ray_index() / 4, rng.ray_index() % 4);
                let zero = |bit: u64| if signs >> bit & 1 == 0 { 0.0 } else { -0.0 };
                let at = [place % places, place / places].map(|i| (i + 1) as f64 * 0.5);
                let (axis, towards) = (index / 3, [-1.0, 1.0][(place % 2) as usize]);
                let ray = create_unnormalised_ray::<R>(
                    point_across_axis(axis, at, -5.0 * towards),
                    point_across_axis(axis, [zero(0), zero(1)], towards),
                );
                Verdict::from_condition(is_hit(tree, &ray), || {
                    format!(
                        "the ray passes through lattice {index} without a hit{}",
                        format_ray_bits(&ray)
                    )
                })
            })
        });
        each.reduce(CaseOutcome::merge).expect("lattices")
    })
}

/// Scales and then translates a mesh. Each corner is rounded to f32.
fn transform_mesh(mesh: &ClosedMesh, size: f64, position: DVec3) -> ClosedMesh {
    let corner = |p: &Vec3| (p.as_dvec3() * size + position).as_vec3();
    ClosedMesh {
        corners: mesh.corners.iter().map(corner).collect(),
        faces: mesh.faces.clone(),
    }
}

/// A closed mesh: a subdivided icosahedron around a point.
struct SphereMesh {
    mesh: ClosedMesh,
    centre: DVec3,
    radius: f64,
}

impl SphereMesh {
    fn new(levels: u32, radius: f64, position: DVec3) -> Self {
        let centre = round_to_f32(position);
        Self {
            mesh: transform_mesh(&create_icosphere(levels), radius, centre),
            centre,
            radius,
        }
    }

    /// Creates a ray from inside the mesh towards a corner, an edge, or any point of the
    /// surrounding sphere.
    fn sample_inner_ray<R: Real>(&self, rng: &mut CaseRng) -> Ray<R> {
        let face = self.mesh.faces[rng.next_bits() as usize % self.mesh.faces.len()];
        let corner = |i: usize| self.mesh.corners[face[i]].as_dvec3();
        let target = match rng.next_bits() % 3 {
            0 => corner(0),
            1 => corner(0) + (corner(1) - corner(0)) * rng.next_in_unit_interval(),
            _ => self.centre + rng.sample_direction() * self.radius,
        };
        create_ray_towards::<R>(
            self.centre
                + rng.sample_direction() * (0.6 * self.radius * rng.next_in_unit_interval()),
            target,
        )
    }
}

/// Measures rays from inside the closed meshes `globes`. Each ray must hit.
fn measure_mesh_leaks<R: Real>(
    case: &str,
    seed: u64,
    count: u32,
    rays: RayCount,
    globes: &[SphereMesh],
) -> Vec<Measurement> {
    let trees = globes
        .iter()
        .map(|globe| globe.mesh.build_tree::<R>())
        .collect();
    measure_by_each_kernel(trees, |trees| {
        judge_rays(case, seed, count, rays, |rng| {
            let index = rng.ray_index() as usize % globes.len();
            let ray = globes[index].sample_inner_ray::<R>(rng);
            let SphereMesh { centre, radius, .. } = &globes[index];
            Verdict::from_condition(is_hit(&trees[index], &ray), || {
                format!(
                    "the ray leaves the closed mesh of radius {radius:e} around {centre} without a hit{}",
                    format_ray_bits(&ray)
                )
            })
        })
    })
}

/// Measures case T06: rays from inside closed meshes of every size from 1e-12 to 1e12.
pub fn measure_mesh_sizes<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let globes: Vec<_> = (-12..=12)
        .map(|k| SphereMesh::new(3, 10_f64.powi(k), DVec3::ZERO))
        .collect();
    measure_mesh_leaks::<R>("T06", 226, 1_000_000, rays, &globes)
}

/// Creates three closed meshes far from the origin.
fn build_distant_meshes() -> [SphereMesh; 3] {
    let diagonal = DVec3::new(0.8, -0.36, 0.48);
    [
        SphereMesh::new(4, 2.0, DVec3::new(148_376.0, 1234.0, -223_423.0)),
        SphereMesh::new(3, 1.0, diagonal * 1e5),
        SphereMesh::new(2, 1.0, diagonal * 1e6),
    ]
}

/// Measures case T07: rays inside closed meshes far from the origin, and rays towards a distant
/// flat ground of square cells.
pub fn measure_distant_meshes<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let measured = measure_mesh_leaks::<R>("T07", 227, 1_000_000, rays, &build_distant_meshes());
    const SIDE: usize = 12;
    let corner = |i: usize, j: usize| {
        Vec3::new(
            148_376.0 + 2.0 * i as f32,
            1234.0,
            -223_423.0 + 2.0 * j as f32,
        )
    };
    let mut group = PrimitiveSet::<R>::default();
    for cell in 0..SIDE * SIDE {
        let (i, j) = (cell % SIDE, cell / SIDE);
        let [p, q, r, s] = [
            corner(i, j),
            corner(i + 1, j),
            corner(i + 1, j + 1),
            corner(i, j + 1),
        ];
        for face in [[p, q, r], [p, r, s]] {
            group
                .add_triangle(
                    face.map(|p| to_scalar::<R>(p.as_dvec3())),
                    Visibility::default(),
                )
                .expect("finite corners");
        }
    }
    let ground = measure_by_each_kernel(
        vec![Geometry::new(group, AcceleratorKind::default())],
        |trees| {
            judge_rays("T07 ground", 228, 400_000, rays, |rng| {
                let inner = |rng: &mut CaseRng| 1 + rng.next_bits() as usize % (SIDE - 1);
                let (i, j) = (inner(rng), inner(rng));
                // The ray is aimed at a corner inside the ground, or at an edge that ends at this
                // corner.
                let (di, dj) = rng.choose(&[(0, 0), (1, 0), (0, 1), (1, 1)]);
                let (a, b) = (
                    corner(i, j).as_dvec3(),
                    corner(i.max(di) - di, j.max(dj) - dj).as_dvec3(),
                );
                let target = a + (b - a) * rng.next_in_unit_interval() * 0.99;
                let up = rng.sample_point_in_cube() + DVec3::Y * 1.5;
                let ray =
                    create_ray_towards::<R>(target + up * rng.next_uniform(1.0, 20.0), target);
                // The rounding of the direction moves the target by a tiny fraction of a cell.
                Verdict::from_condition(is_hit(&trees[0], &ray), || {
                    format!(
                        "the ray passes through the ground without a hit{}",
                        format_ray_bits(&ray)
                    )
                })
            })
        },
    );
    let both = |(mut globes, ground): (Measurement, Measurement)| {
        globes.outcome = globes.outcome.merge(ground.outcome);
        globes
    };
    measured.into_iter().zip(ground).map(both).collect()
}

/// Measures case T10: the padding of boxes. Rays from inside the meshes of case T07, and from
/// inside a mesh at the origin, must hit. Padding increases the surface area of boxes, and so the
/// number of rays that enter them. For the mesh at the origin the area must increase by less than
/// 30 percent.
pub fn measure_box_inflation<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let [a, b, c] = build_distant_meshes();
    let near = SphereMesh::new(4, 1.0, DVec3::ZERO);
    let half_area = |e: DVec3| e.x * e.y + e.y * e.z + e.z * e.x;
    let (mut tight, mut padded) = (0.0, 0.0);
    for face in &near.mesh.faces {
        let bounds = Aabb::from_points(face.map(|i| near.mesh.corners[i].as_dvec3()));
        let Some(grown) = bounds.to_padded() else {
            continue;
        };
        tight += half_area(bounds.extent());
        padded += half_area((grown.max - grown.min).as_dvec3());
    }
    let mut measured = measure_mesh_leaks::<R>("T10", 230, 400_000, rays, &[a, b, c, near]);
    let cost = judge_rays("T10 surface", 231, 1, rays, |_| {
        Verdict::from_error(padded / tight, 1.3, || {
            "surface area of the padded boxes divided by the surface area of the boxes without padding".to_owned()
        })
    });
    measured.iter_mut().for_each(|measurement| {
        measurement.outcome = measurement.outcome.clone().merge(cost.clone())
    });
    measured
}
