//! The cost of accuracy: the same work by textbook formulas and by the library. Programs time the
//! implementations alternately. The rays are ordinary: they start five radii from a shape of about
//! unit size, and about half of them hit. Hard cases are rare, but every ray pays for their
//! treatment.

use core::fmt;
use core::hint::black_box;

use glam::DVec3;

use super::verdicts::{CaseRng, to_scalar};
use super::{IntersectFunction, textbook};
use crate::shapes::{AnyShape, Cone, Ellipsoid, Sphere, Torus, Triangle};
use crate::{Interval, PreparedRay, Ray, Real, Shape, Side};

/// Work that a program times. One call processes all rays or samples of a comparison.
pub type TimedWork = Box<dyn Fn()>;

/// The same work in three implementations, for a comparison of their times: textbook formulas in
/// f32, and the library in each of its two precisions.
pub struct CostComparison {
    /// Name of the operation that is timed, such as an intersection test.
    pub label: &'static str,
    /// Number of rays or samples that one call of the work processes.
    pub count: u32,
    /// Implementation by textbook formulas in f32.
    pub textbook: TimedWork,
    /// Implementations by the library: with scalars in f32 (the setting `robust`), then in f64
    /// (`reference`).
    pub library: [TimedWork; 2],
}

impl fmt::Debug for CostComparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CostComparison")
            .field("label", &self.label)
            .field("count", &self.count)
            .finish_non_exhaustive()
    }
}

/// Number of different rays that a comparison traces.
const RAYS: u32 = 4096;

/// Creates the comparison for a case, given by its number such as `P01`. Returns `None` for a case
/// without a textbook formula, and for a case that does not test a shape.
pub fn build_cost_comparison(number: &str) -> Option<CostComparison> {
    let (zero, axis) = (DVec3::ZERO, DVec3::new(0.3, 1.0, -0.2));
    Some(match number {
        "P01" => compare_intersections(
            "intersection of a sphere",
            40,
            build_unit_sphere::<f32>().into(),
            build_unit_sphere::<f64>().into(),
        ),
        "P02" => compare_surfaces(20),
        "P13" => {
            let (single, double) = (
                Cone::new(-axis, axis, 1.0, 0.0, 2.0),
                Cone::new(-axis, axis, 1.0, 0.0, 2.0),
            );
            compare_intersections("intersection of a cone", 20, single.into(), double.into())
        }
        "P15" => {
            let semi = DVec3::new(1.0, 0.6, 0.8);
            compare_intersections(
                "intersection of an ellipsoid",
                40,
                Ellipsoid::new(zero, semi).into(),
                Ellipsoid::new(zero, semi).into(),
            )
        }
        "P17" => {
            let (single, double) = (
                Torus::new(zero, axis, 0.8, 0.3),
                Torus::new(zero, axis, 0.8, 0.3),
            );
            compare_intersections("intersection of a torus", 4, single.into(), double.into())
        }
        "P21" => compare_intersections(
            "intersection of a triangle",
            40,
            build_test_triangle::<f32>(),
            build_test_triangle::<f64>(),
        ),
        _ => return None,
    })
}

/// Returns the unit sphere around the origin.
fn build_unit_sphere<R: Real>() -> Sphere<R> {
    Sphere {
        centre: to_scalar::<R>(DVec3::ZERO),
        radius: R::ONE,
    }
}

/// Returns a slanted triangle near the origin.
fn build_test_triangle<R: Real>() -> AnyShape<R> {
    let corners = [
        DVec3::new(-1.0, -1.0, 0.2),
        DVec3::new(1.0, -0.8, 0.2),
        DVec3::new(-0.9, 1.0, 0.5),
    ];
    Triangle::new(corners.map(to_scalar::<R>)).into()
}

/// Creates the rays of the comparison. They start at distance 5 from the origin and aim at points
/// near a shape of about unit size at the origin.
fn create_random_rays<R: Real>() -> Vec<Ray<R>> {
    let ray = |i: u32| {
        let rng = &mut CaseRng::new(1, i.into());
        let origin = rng.sample_direction() * 5.0;
        Ray::new(
            to_scalar::<R>(origin),
            to_scalar::<R>((rng.sample_point_in_cube() * 1.2 - origin).normalize()),
        )
    };
    (0..RAYS).map(ray).collect()
}

/// Creates the rays of the comparison, prepared as the library's queries prepare them.
fn prepare_random_rays<R: Real>() -> Vec<PreparedRay> {
    create_random_rays::<R>()
        .into_iter()
        .map(PreparedRay::new)
        .collect()
}

/// Creates the comparison of intersection tests of one shape, stored in f32 (`single`) and in f64
/// (`double`). One call of the work tests all rays `turns` times.
fn compare_intersections(
    label: &'static str,
    turns: u32,
    single: AnyShape<f32>,
    double: AnyShape<f64>,
) -> CostComparison {
    fn create_intersection_work<R: Real>(turns: u32, shape: AnyShape<R>) -> TimedWork {
        let rays = prepare_random_rays::<R>();
        Box::new(move || {
            for ray in (0..turns).flat_map(|_| &rays) {
                black_box(black_box(&shape).intersect(ray, Interval::positive(), Side::Both));
            }
        })
    }
    let (rays, by): (_, IntersectFunction<f32>) =
        (create_random_rays::<f32>(), textbook::intersect);
    let by_textbook = move || {
        for ray in (0..turns).flat_map(|_| &rays) {
            black_box(by(black_box(&single), ray));
        }
    };
    CostComparison {
        label,
        count: RAYS * turns,
        textbook: Box::new(by_textbook),
        library: [
            create_intersection_work(turns, single),
            create_intersection_work(turns, double),
        ],
    }
}

/// Creates the comparison for a sphere: its intersection test, followed by the surface at the hit.
/// One call of the work tests all rays `turns` times.
fn compare_surfaces(turns: u32) -> CostComparison {
    fn create_intersection_work<R: Real>(turns: u32) -> TimedWork {
        let (sphere, rays) = (build_unit_sphere::<R>(), prepare_random_rays::<R>());
        Box::new(move || {
            for ray in (0..turns).flat_map(|_| &rays) {
                let hit = black_box(&sphere).intersect(ray, Interval::positive(), Side::Both);
                black_box(hit.map(|hit| sphere.surface(ray, hit)));
            }
        })
    }
    let (ball, shot) = (build_unit_sphere::<f32>(), create_random_rays::<f32>());
    let by_textbook = move || {
        for ray in (0..turns).flat_map(|_| &shot) {
            black_box(textbook::intersect_sphere_surface(black_box(&ball), ray));
        }
    };
    let label = "intersection of a sphere, and the surface at its hit";
    CostComparison {
        label,
        count: RAYS * turns,
        textbook: Box::new(by_textbook),
        library: [
            create_intersection_work::<f32>(turns),
            create_intersection_work::<f64>(turns),
        ],
    }
}
