//! Cases P01, P02, P13, P15, P17, P21 and P22: shapes for which textbook formulas fail, measured by
//! these formulas and by the library on the same rays.

use super::judge::{Outcome, RayCount};
use super::quadrics::{extreme_distance, near_root};
use super::sphere::{drift, far_sphere, surface};
use super::torus::far_torus;
use super::triangles::{ClosedMesh, RayTarget, cube, icosphere, leaks, leaks_of_library};
use super::{Measurement, by_shapes, intersect, textbook};
use crate::Real;

/// Returns the measurements of both precisions, each beside the outcome of the textbook.
fn compared(textbook: Outcome, robust: Outcome, reference: Outcome) -> Vec<Measurement> {
    [by_shapes::<f32>(robust), by_shapes::<f64>(reference)]
        .map(|measurement| Measurement {
            textbook: Some(textbook.clone()),
            ..measurement
        })
        .to_vec()
}

/// Adds up the outcomes of the parts of a case.
fn sum<T>(each: impl IntoIterator<Item = T>, value_of: impl Fn(T) -> Outcome) -> Outcome {
    each.into_iter()
        .map(value_of)
        .reduce(Outcome::plus)
        .expect("a case has parts")
}

/// Distances of the spheres from the rays' origins, in radii.
const RATIOS: [f64; 6] = [2.0, 1e2, 1e3, 1e4, 1e5, 1e6];

/// P01: hits of spheres from 2 to 10⁶ radii away.
pub fn far_spheres(rays: RayCount) -> Vec<Measurement> {
    compared(
        sum(RATIOS, |ratio| {
            far_sphere(ratio, 8.0, rays, textbook::intersect)
        }),
        sum(RATIOS, |ratio| {
            far_sphere::<f32>(ratio, 2.0, rays, intersect)
        }),
        sum(RATIOS, |ratio| {
            far_sphere::<f64>(ratio, 16.0, rays, intersect)
        }),
    )
}

/// P02: the surface points of spheres from 2 to 10⁶ radii away, around the origin and far from it.
pub fn drifts(rays: RayCount) -> Vec<Measurement> {
    let parts = || {
        [0.0, 1e3, 1e5]
            .into_iter()
            .flat_map(|offset| RATIOS.map(|ratio| (offset, ratio)))
    };
    compared(
        sum(parts(), |(offset, ratio)| {
            drift(offset, ratio, rays, textbook::sphere_surface)
        }),
        sum(parts(), |(offset, ratio)| {
            drift::<f32>(offset, ratio, rays, surface)
        }),
        sum(parts(), |(offset, ratio)| {
            drift::<f64>(offset, ratio, rays, surface)
        }),
    )
}

/// P13: rays along, or nearly along, a generator of a cone or an asymptote of a hyperboloid.
pub fn vanishing_coefficients(rays: RayCount) -> Vec<Measurement> {
    let parts = || {
        ["cone", "hyperboloid"]
            .into_iter()
            .flat_map(|case| [1e-1, 1e-3, 1e-5, 1e-7, 0.0].map(|off| (case, off)))
    };
    compared(
        sum(parts(), |(case, off)| {
            near_root(case, off, 1e-5, rays, textbook::intersect)
        }),
        sum(parts(), |(case, off)| {
            near_root::<f32>(case, off, 1e-5, rays, intersect)
        }),
        sum(parts(), |(case, off)| {
            near_root::<f64>(case, off, 1e-5, rays, intersect)
        }),
    )
}

/// P15: hits of flat and of needle-like ellipsoids.
pub fn extreme_ellipsoids(rays: RayCount) -> Vec<Measurement> {
    const AXES: [f64; 4] = [1e-3, 1e-2, 1e2, 1e3];
    compared(
        sum(AXES, |k| {
            extreme_distance(k, 1e-3, rays, textbook::intersect)
        }),
        sum(AXES, |k| extreme_distance::<f32>(k, 1e-3, rays, intersect)),
        sum(AXES, |k| extreme_distance::<f64>(k, 1e-3, rays, intersect)),
    )
}

/// P17: tori with three tube radii, from 3 to 1000 major radii away.
pub fn far_tori(rays: RayCount) -> Vec<Measurement> {
    const COUNT: u32 = 10_000;
    let parts = || {
        [0.3, 0.1, 0.01]
            .into_iter()
            .flat_map(|tube| [3.0, 10.0, 100.0, 1000.0].map(|far| (tube, far)))
    };
    compared(
        sum(parts(), |(tube, far)| {
            far_torus(tube, far, COUNT, rays, textbook::intersect)
        }),
        sum(parts(), |(tube, far)| {
            far_torus::<f32>(tube, far, COUNT, rays, intersect)
        }),
        sum(parts(), |(tube, far)| {
            far_torus::<f64>(tube, far, COUNT, rays, intersect)
        }),
    )
}

const AIMS: [RayTarget; 4] = [
    RayTarget::Corner,
    RayTarget::Edge,
    RayTarget::FromCentre,
    RayTarget::Anywhere,
];

fn closed_meshes() -> [(&'static str, ClosedMesh); 2] {
    [("icosphere", icosphere(5)), ("cube", cube(16))]
}

/// P22: the closed meshes of P21, with every face or every second face flipped.
pub fn turned_edges(rays: RayCount) -> Vec<Measurement> {
    fn of<R: Real>(count: u32, rays: RayCount) -> Measurement {
        let turned = [1, 2]
            .into_iter()
            .flat_map(|every| closed_meshes().map(|(name, mesh)| (name, mesh.flip_every(every))));
        let parts: Vec<_> = turned
            .flat_map(|(name, mesh)| AIMS.map(|ray_target| (name, mesh.clone(), ray_target)))
            .collect();
        by_shapes::<R>(sum(parts, |(name, mesh, ray_target)| {
            leaks_of_library::<R>(name, &mesh, ray_target, count, rays)
        }))
    }
    vec![of::<f32>(1_000_000, rays), of::<f64>(100_000, rays)]
}

/// P21: rays at common edges and corners of closed meshes. The textbook gets fewer rays, since it
/// tests every face.
pub fn shared_edges(rays: RayCount) -> Vec<Measurement> {
    let meshes = closed_meshes();
    let parts = || {
        meshes
            .iter()
            .flat_map(|(name, mesh)| AIMS.map(|ray_target| (*name, mesh, ray_target)))
    };
    let by_textbook = |(name, mesh, ray_target): (&str, &ClosedMesh, RayTarget)| {
        let triangles = mesh.triangles();
        leaks(name, mesh, ray_target, 10_000, rays, |ray| {
            textbook::hits_any(&triangles, ray)
        })
    };
    compared(
        sum(parts(), by_textbook),
        sum(parts(), |(name, mesh, ray_target)| {
            leaks_of_library::<f32>(name, mesh, ray_target, 1_000_000, rays)
        }),
        sum(parts(), |(name, mesh, ray_target)| {
            leaks_of_library::<f64>(name, mesh, ray_target, 100_000, rays)
        }),
    )
}
