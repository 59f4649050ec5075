//! Cases P01, P02, P13, P15, P17, P21 and P22: shapes for which textbook formulas fail. Textbook
//! formulas and the library are measured on the same rays.

use super::quadrics::{judge_hit_distance_of_extreme_ellipsoid, judge_near_root_of_quadric};
use super::sphere::{eval_library_surface, judge_far_sphere, judge_surface_point};
use super::torus::judge_far_torus;
use super::triangles::{
    ClosedMesh, RayTarget, create_cube_mesh, create_icosphere, judge_mesh_leaks,
    judge_mesh_leaks_of_tree,
};
use super::verdicts::{CaseOutcome, RayCount};
use super::{Measurement, create_treeless_measurement, intersect_by_library, textbook};
use crate::Real;

/// Creates the measurements of a case for the precisions f32 (`robust`) and f64 (`reference`), each
/// with the outcome of the textbook formulas.
fn pair_outcomes_with_textbook(
    textbook: CaseOutcome,
    robust: CaseOutcome,
    reference: CaseOutcome,
) -> Vec<Measurement> {
    [
        create_treeless_measurement::<f32>(robust),
        create_treeless_measurement::<f64>(reference),
    ]
    .map(|measurement| Measurement {
        textbook: Some(textbook.clone()),
        ..measurement
    })
    .to_vec()
}

/// Adds up the outcomes of the parts of a case. `value_of` returns the outcome of a part.
fn sum_outcomes<T>(
    each: impl IntoIterator<Item = T>,
    value_of: impl Fn(T) -> CaseOutcome,
) -> CaseOutcome {
    each.into_iter()
        .map(value_of)
        .reduce(CaseOutcome::merge)
        .expect("a case has parts")
}

/// Distances of the spheres from the rays' origins, in radii.
const RATIOS: [f64; 6] = [2.0, 1e2, 1e3, 1e4, 1e5, 1e6];

/// Measures case P01: hits of spheres from 2 to 10⁶ radii away.
pub(crate) fn measure_far_spheres(rays: RayCount) -> Vec<Measurement> {
    pair_outcomes_with_textbook(
        sum_outcomes(RATIOS, |ratio| {
            judge_far_sphere(ratio, 8.0, rays, textbook::intersect)
        }),
        sum_outcomes(RATIOS, |ratio| {
            judge_far_sphere::<f32>(ratio, 2.0, rays, intersect_by_library)
        }),
        sum_outcomes(RATIOS, |ratio| {
            judge_far_sphere::<f64>(ratio, 16.0, rays, intersect_by_library)
        }),
    )
}

/// Measures case P02: the surface points of spheres from 2 to 10⁶ radii away, around the origin and
/// far from it.
pub(crate) fn measure_surface_points(rays: RayCount) -> Vec<Measurement> {
    let parts = || {
        [0.0, 1e3, 1e5]
            .into_iter()
            .flat_map(|offset| RATIOS.map(|ratio| (offset, ratio)))
    };
    pair_outcomes_with_textbook(
        sum_outcomes(parts(), |(offset, ratio)| {
            judge_surface_point(offset, ratio, rays, textbook::intersect_sphere_surface)
        }),
        sum_outcomes(parts(), |(offset, ratio)| {
            judge_surface_point::<f32>(offset, ratio, rays, eval_library_surface)
        }),
        sum_outcomes(parts(), |(offset, ratio)| {
            judge_surface_point::<f64>(offset, ratio, rays, eval_library_surface)
        }),
    )
}

/// Measures case P13: rays along, or nearly along, a generator of a cone or an asymptote of a
/// hyperboloid. The leading coefficient of the quadratic vanishes for such rays.
pub(crate) fn measure_vanishing_coefficients(rays: RayCount) -> Vec<Measurement> {
    let parts = || {
        ["cone", "hyperboloid"]
            .into_iter()
            .flat_map(|case| [1e-1, 1e-3, 1e-5, 1e-7, 0.0].map(|off| (case, off)))
    };
    pair_outcomes_with_textbook(
        sum_outcomes(parts(), |(case, off)| {
            judge_near_root_of_quadric(case, off, 1e-5, rays, textbook::intersect)
        }),
        sum_outcomes(parts(), |(case, off)| {
            judge_near_root_of_quadric::<f32>(case, off, 1e-5, rays, intersect_by_library)
        }),
        sum_outcomes(parts(), |(case, off)| {
            judge_near_root_of_quadric::<f64>(case, off, 1e-5, rays, intersect_by_library)
        }),
    )
}

/// Measures case P15: hits of flat and of needle-like ellipsoids.
pub(crate) fn measure_extreme_ellipsoids(rays: RayCount) -> Vec<Measurement> {
    const AXES: [f64; 4] = [1e-3, 1e-2, 1e2, 1e3];
    pair_outcomes_with_textbook(
        sum_outcomes(AXES, |k| {
            judge_hit_distance_of_extreme_ellipsoid(k, 1e-3, rays, textbook::intersect)
        }),
        sum_outcomes(AXES, |k| {
            judge_hit_distance_of_extreme_ellipsoid::<f32>(k, 1e-3, rays, intersect_by_library)
        }),
        sum_outcomes(AXES, |k| {
            judge_hit_distance_of_extreme_ellipsoid::<f64>(k, 1e-3, rays, intersect_by_library)
        }),
    )
}

/// Measures case P17: tori with three tube radii, from 3 to 1000 major radii away.
pub(crate) fn measure_far_tori(rays: RayCount) -> Vec<Measurement> {
    const COUNT: u32 = 10_000;
    let parts = || {
        [0.3, 0.1, 0.01]
            .into_iter()
            .flat_map(|tube| [3.0, 10.0, 100.0, 1000.0].map(|far| (tube, far)))
    };
    pair_outcomes_with_textbook(
        sum_outcomes(parts(), |(tube, far)| {
            judge_far_torus(tube, far, COUNT, rays, textbook::intersect)
        }),
        sum_outcomes(parts(), |(tube, far)| {
            judge_far_torus::<f32>(tube, far, COUNT, rays, intersect_by_library)
        }),
        sum_outcomes(parts(), |(tube, far)| {
            judge_far_torus::<f64>(tube, far, COUNT, rays, intersect_by_library)
        }),
    )
}

const AIMS: [RayTarget; 4] = [
    RayTarget::Corner,
    RayTarget::Edge,
    RayTarget::FromCentre,
    RayTarget::Anywhere,
];

fn build_closed_meshes() -> [(&'static str, ClosedMesh); 2] {
    [
        ("icosphere", create_icosphere(5)),
        ("cube", create_cube_mesh(16)),
    ]
}

/// Measures case P22: the closed meshes of P21, with every face or every second face flipped.
pub(crate) fn measure_flipped_faces(rays: RayCount) -> Vec<Measurement> {
    fn measure_precision<R: Real>(count: u32, rays: RayCount) -> Measurement {
        let turned = [1, 2].into_iter().flat_map(|every| {
            build_closed_meshes().map(|(name, mesh)| (name, mesh.flip_every_nth_face(every)))
        });
        let parts: Vec<_> = turned
            .flat_map(|(name, mesh)| AIMS.map(|ray_target| (name, mesh.clone(), ray_target)))
            .collect();
        create_treeless_measurement::<R>(sum_outcomes(parts, |(name, mesh, ray_target)| {
            judge_mesh_leaks_of_tree::<R>(name, &mesh, ray_target, count, rays)
        }))
    }
    vec![
        measure_precision::<f32>(1_000_000, rays),
        measure_precision::<f64>(100_000, rays),
    ]
}

/// Measures case P21: rays at common edges and corners of closed meshes. The textbook formula is
/// measured with fewer rays: it has no tree, so it tests every face.
pub(crate) fn measure_shared_edges(rays: RayCount) -> Vec<Measurement> {
    let meshes = build_closed_meshes();
    let parts = || {
        meshes
            .iter()
            .flat_map(|(name, mesh)| AIMS.map(|ray_target| (*name, mesh, ray_target)))
    };
    let by_textbook = |(name, mesh, ray_target): (&str, &ClosedMesh, RayTarget)| {
        let triangles = mesh.triangles();
        judge_mesh_leaks(name, mesh, ray_target, 10_000, rays, |ray| {
            textbook::hits_any_triangle(&triangles, ray)
        })
    };
    pair_outcomes_with_textbook(
        sum_outcomes(parts(), by_textbook),
        sum_outcomes(parts(), |(name, mesh, ray_target)| {
            judge_mesh_leaks_of_tree::<f32>(name, mesh, ray_target, 1_000_000, rays)
        }),
        sum_outcomes(parts(), |(name, mesh, ray_target)| {
            judge_mesh_leaks_of_tree::<f64>(name, mesh, ray_target, 100_000, rays)
        }),
    )
}
