//! The cost of accuracy: the same work by textbook formulas and by the library. Programs time the
//! implementations alternately. The rays are ordinary: they start five radii from a shape of about
//! unit size, and about half of them hit. Hard cases are rare, but every ray pays for their
//! treatment.

use core::fmt;
use core::hint::black_box;
use std::rc::Rc;

use super::prelude::*;
use super::sphere::build_sphere;
use super::textbook;

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
        write!(f, "CostComparison({})", self.label)
    }
}

/// Number of different rays or samples of a comparison.
const SAMPLES: u64 = 4096;

/// Creates the comparison of three implementations on random samples, which `draw` creates. One
/// call of the work processes all samples `turns` times.
pub fn compare_formulas<S: 'static>(
    label: &'static str,
    turns: u32,
    draw: impl Fn(&mut CaseRng) -> S,
    textbook: impl Fn(&S) + 'static,
    robust: impl Fn(&S) + 'static,
    reference: impl Fn(&S) + 'static,
) -> CostComparison {
    fn repeat<S: 'static>(samples: &Rc<[S]>, turns: u32, work: impl Fn(&S) + 'static) -> TimedWork {
        let samples = samples.clone();
        Box::new(move || (0..turns).for_each(|_| samples.iter().for_each(&work)))
    }
    let sample = |index| draw(&mut CaseRng::new(2, index));
    let samples = (0..SAMPLES).map(sample).collect();
    CostComparison {
        label,
        count: SAMPLES as u32 * turns,
        textbook: repeat(&samples, turns, textbook),
        library: [
            repeat(&samples, turns, robust),
            repeat(&samples, turns, reference),
        ],
    }
}

/// A ray, and the same ray prepared as the library's queries prepare it in each precision.
struct RaySample {
    ray: Ray<f32>,
    robust: PreparedRay,
    reference: PreparedRay,
}

/// Draws a ray that starts at distance 5 from the origin and aims at a point near a shape of about
/// unit size at the origin.
fn draw_ray(rng: &mut CaseRng) -> RaySample {
    let origin = rng.sample_direction() * 5.0;
    let direction = (rng.sample_point_in_cube() * 1.2 - origin).normalize();
    let ray = create_unnormalised_ray(origin, direction);
    RaySample {
        ray,
        robust: PreparedRay::new(ray),
        reference: PreparedRay::new(create_unnormalised_ray::<f64>(origin, direction)),
    }
}

/// Creates the comparison of intersection tests of one shape around the origin, followed by the
/// surface at the hit if `with_surface`. The shape is stored in f32 and in f64.
fn compare_intersections(
    label: &'static str,
    turns: u32,
    with_surface: bool,
    robust: AnyShape<f32>,
    reference: AnyShape<f64>,
) -> CostComparison {
    fn test<R: Real>(shape: &AnyShape<R>, ray: &PreparedRay, with_surface: bool) {
        let hit = black_box(shape).intersect(ray, Interval::positive(), Side::Both);
        let surface = hit
            .filter(|_| with_surface)
            .map(|hit| shape.surface(ray, hit));
        black_box((hit, surface));
    }
    let by_textbook = move |sample: &RaySample| {
        let t = textbook::intersect(black_box(&robust), &sample.ray);
        let normal = t
            .filter(|_| with_surface)
            .map(|t| sample.ray.at(t).normalize());
        black_box((t, normal));
    };
    compare_formulas(
        label,
        turns,
        draw_ray,
        by_textbook,
        move |sample| test(&robust, &sample.robust, with_surface),
        move |sample| test(&reference, &sample.reference, with_surface),
    )
}

/// Creates the comparison for a case, given by its number such as `P01`. Returns `None` for a case
/// without a textbook formula, and for a case that does not test a shape.
pub fn build_cost_comparison(number: &str) -> Option<CostComparison> {
    /// Compares a shape, which is created in both precisions.
    macro_rules! compare {
        ($label:literal, $turns:literal, $with_surface:literal, $shape:expr) => {
            compare_intersections($label, $turns, $with_surface, $shape, $shape)
        };
    }
    let (zero, axis) = (DVec3::ZERO, DVec3::new(0.3, 1.0, -0.2));
    let sides = [DVec3::new(2.0, 0.2, 0.0), DVec3::new(0.1, 2.0, 0.3)];
    let corner = DVec3::new(-1.0, -1.0, 0.2);
    let corners = [corner, corner + sides[0], corner + sides[1]];
    Some(match number {
        "P01" => compare!(
            "intersection of a sphere",
            40,
            false,
            AnyShape::Sphere(build_sphere(zero, 1.0))
        ),
        "P02" => compare!(
            "intersection of a sphere, and the surface at its hit",
            20,
            true,
            AnyShape::Sphere(build_sphere(zero, 1.0))
        ),
        "P13" => compare!(
            "intersection of a cone",
            20,
            false,
            AnyShape::Cone(Cone::new(-axis, axis, 1.0, 0.0, 2.0))
        ),
        "P15" => compare!(
            "intersection of an ellipsoid",
            40,
            false,
            AnyShape::Ellipsoid(Ellipsoid::new(zero, DVec3::new(1.0, 0.6, 0.8)))
        ),
        "P17" => compare!(
            "intersection of a torus",
            4,
            false,
            AnyShape::Torus(Torus::new(zero, axis, 0.8, 0.3))
        ),
        "P21" => compare!(
            "intersection of a triangle",
            40,
            false,
            AnyShape::Triangle(Triangle::new(corners.map(Vector::from_f64)))
        ),
        _ => return None,
    })
}
