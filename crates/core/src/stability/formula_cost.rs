//! Cost of the library's numerically robust formulas, in nanoseconds per ray or sample. They and
//! textbook formulas are timed alternately by the CPU time of a thread. The rays are ordinary: they
//! start five radii from a shape of about unit size, and about half of them hit. Hard cases are
//! rare, but every ray pays for their treatment.

use core::hint::black_box;

use raywright_bvh::stability::prelude::*;
use raywright_bvh::stability::shapes::build_sphere;
use raywright_bvh::stability::textbook;

use super::shading::textbook_shading_frame;
use crate::bench::clock::thread_seconds;
use crate::material::{ShadingFrame, SmoothInterface, fresnel_dielectric};

/// Times of the textbook formula and of the library's formulas for a numerically hard case.
#[derive(Clone, Debug)]
pub struct CaseCost {
    /// Description of the work that is done per ray or sample.
    pub label: &'static str,
    /// Times by round, in nanoseconds per ray or sample: of the textbook formula in f32, and of the
    /// library's in the precisions `robust` and `reference`.
    pub rounds: Vec<[f64; 3]>,
}

/// Number of timed rounds. A round before them is not counted.
const ROUNDS: usize = 15;
/// Number of different samples.
const SAMPLES: u64 = 2048;
/// Number of times that each sample is computed in a round.
const TURNS: u64 = 4;

/// Input of the timed formulas, in a precision.
struct Sample<R: Real> {
    ray: Ray<R>,
    prepared: PreparedRay,
    shape: AnyShape<R>,
    d: R::Vec3,
    n: R::Vec3,
}

impl<R: Real> Sample<R> {
    /// Draws the samples of a case: the shape around the origin that it times, a ray that starts at
    /// distance 5 and aims at a point near the shape, and two directions.
    fn draw(number: &str) -> Vec<Self> {
        let axis = DVec3::new(0.3, 1.0, -0.2);
        let shape = match number {
            "P13" => Cone::new(-DVec3::Y, DVec3::Y, 1.0, 0.0, 2.0).into(),
            "P15" => Ellipsoid::new(DVec3::ZERO, DVec3::new(1.0, 0.6, 0.8)).into(),
            "P17" => Torus::new(DVec3::ZERO, axis, 0.8, 0.3).into(),
            "P21" => {
                let corners = [[-1.0, -1.0, 0.2], [1.0, -0.8, 0.2], [-0.9, 1.0, 0.5]];
                Triangle::new(corners.map(|corner| to_scalar::<R>(corner.into()))).into()
            }
            _ => build_sphere(DVec3::ZERO, 1.0).into(),
        };
        let draw = |index| {
            let rng = &mut CaseRng::new(2, index);
            let origin = rng.sample_direction() * 5.0;
            let direction = (rng.sample_point_in_cube() * 1.2 - origin).normalize();
            let ray = create_unnormalised_ray(origin, direction);
            let [d, n] = [(); 2].map(|()| to_scalar::<R>(rng.sample_direction()));
            Self {
                ray,
                prepared: PreparedRay::new(ray),
                shape,
                d,
                n,
            }
        };
        (0..SAMPLES).map(draw).collect()
    }

    fn intersect(&self) -> Option<ShapeHit<R>> {
        self.shape
            .intersect(&self.prepared, Interval::positive(), Side::Both)
    }

    fn surface(&self) -> Option<Surface<R>> {
        self.intersect()
            .map(|hit| self.shape.surface(&self.prepared, hit))
    }

    fn shading_frame(&self) -> ShadingFrame<R> {
        ShadingFrame::from_normal(self.n)
    }

    fn reflected(&self) -> R::Vec3 {
        let interface = SmoothInterface::new(self.d.to_f64(), self.n.to_f64(), 1.0);
        to_scalar::<R>(interface.reflected)
    }

    fn reflectance_of_glass(&self) -> f64 {
        let (cosine, eta) = (self.n.x().abs().to_f64(), 1.5_f64.recip());
        let beyond = (1.0 - eta * eta * (1.0 - cosine) * (1.0 + cosine)).sqrt();
        fresnel_dielectric(cosine, Some(beyond), eta)
    }
}

impl Sample<f32> {
    fn textbook(&self) -> Option<f32> {
        textbook::intersect(&self.shape, &self.ray)
    }
}

/// Keeps the compiler from leaving out a computation without further use.
fn consume<T>(value: T) {
    black_box(value);
}

/// Times works in turns. Returns the nanoseconds per sample of each, by round.
fn time_in_turns(works: [&dyn Fn(); 3]) -> Vec<[f64; 3]> {
    let time_round = |round: usize| {
        let mut nanoseconds = [0.0; 3];
        for index in 0..works.len() {
            let turn = (index + round) % works.len();
            let start = thread_seconds();
            (0..TURNS).for_each(|_| works[turn]());
            nanoseconds[turn] = (thread_seconds() - start) * 1e9 / (SAMPLES * TURNS) as f64;
        }
        nanoseconds
    };
    (0..=ROUNDS).map(time_round).skip(1).collect()
}

/// Times the textbook formula and the library's formulas for the hard case with this number. `None`
/// for a case without textbook formula.
pub fn time_case_formulas(number: &str) -> Option<CaseCost> {
    let (narrow, wide) = (Sample::<f32>::draw(number), Sample::<f64>::draw(number));
    /// Times the textbook's expression of a sample, and the library's in both precisions.
    macro_rules! time {
        ($label:literal, |$s:ident| $textbook:expr, $library:expr) => {
            CaseCost {
                label: $label,
                rounds: time_in_turns([
                    &|| narrow.iter().for_each(|$s| consume($textbook)),
                    &|| narrow.iter().for_each(|$s| consume($library)),
                    &|| wide.iter().for_each(|$s| consume($library)),
                ]),
            }
        };
    }
    Some(match number {
        "P01" | "P13" | "P15" | "P17" | "P21" => {
            time!("intersection of the shape", |s| s.textbook(), s.intersect())
        }
        "P02" => time!(
            "intersection of a sphere, and the surface at its hit",
            |s| s.textbook().map(|t| s.ray.at(t).normalize()),
            s.surface()
        ),
        "S09" => time!(
            "a shading frame about a normal",
            |s| textbook_shading_frame(s.n),
            s.shading_frame()
        ),
        "S11" => time!(
            "a mirror-reflected direction",
            |s| s.d.reflect(s.n),
            s.reflected()
        ),
        // Schlick's approximation in f32, and the library's Fresnel equations, which use f64 in both
        // precisions.
        "S13" => time!(
            "a reflectance of glass",
            |s| 0.04 + 0.96 * (1.0 - s.n.x.abs()).powi(5),
            s.reflectance_of_glass()
        ),
        _ => return None,
    })
}
