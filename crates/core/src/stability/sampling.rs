//! Numerically hard cases M01, M02, M11: random numbers at the ends of their range, maps from
//! random numbers to directions and points, and uniformity.

use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ellipsoid, Quad, Sphere, Torus, Triangle,
};
use raywright_bvh::stability::verdicts::{
    CaseOutcome, RayCount, UNIT_ROUNDOFF, Verdict, judge_rays, to_scalar,
};
use raywright_bvh::stability::{Measurement, create_treeless_measurement};
use raywright_bvh::{Real, Vector};

use glam::DVec3;

use crate::filter::PixelFilter;
use crate::light::DirectionCone;
use crate::material::sample_cosine_hemisphere;
use crate::sampler::{SampleAddress, SamplePurpose, sample_2d};
use crate::settings::SamplerKind;

/// Random numbers to be tested, at the ends and in the middle of [0, 1): zero, 2⁻²³, a half, the
/// greatest f32 below one, and the greatest 32-bit fraction.
const CORNERS: [f64; 5] = [
    0.0,
    1.0 / 8_388_608.0,
    0.5,
    1.0 - UNIT_ROUNDOFF,
    1.0 - 1.0 / 4_294_967_296.0,
];

/// Returns the measurements of the precisions `robust` and `reference`. They are equal, because the
/// random numbers do not depend on the precision.
fn precision_independent_measurements(outcome: &CaseOutcome) -> Vec<Measurement> {
    ["robust", "reference"]
        .map(|setting| Measurement {
            setting: setting.to_owned(),
            outcome: outcome.clone(),
            textbook: None,
        })
        .to_vec()
}

/// Measures case M01: every sampler's numbers must be in [0, 1), even if all high bits of the
/// random word are set. Pixel filters must map these numbers to positions within their radius.
pub fn measure_random_range(rays: RayCount) -> Vec<Measurement> {
    let maximum = 1.0 - UNIT_ROUNDOFF;
    let words = judge_rays("M01 words", 301, 10_000, rays, |rng| {
        let word = !(rng.ray_index() as u32);
        let x = f64::from(sobol_burley::parts::u32_to_f32_norm(word));
        Verdict::from_error(x, maximum, || format!("word {word:#010x}"))
            .and_then(|| Verdict::from_condition(x >= 0.0, || format!("{x}")))
    });
    let drawn = judge_rays("M01", 302, 1_000_000, rays, |rng| {
        let sampler = rng.choose(&[
            SamplerKind::Sobol,
            SamplerKind::Stratified,
            SamplerKind::Independent,
        ]);
        let mut word = || rng.next_bits() as u32;
        let address = SampleAddress {
            pixel: [word(), word()],
            replicate: word() % 256,
            index: word(),
            sampler,
            ..SampleAddress::default()
        };
        let numbers = sample_2d(address, SamplePurpose::Scatter);
        let is_within = numbers
            .iter()
            .all(|&x| (0.0..=maximum).contains(&f64::from(x)));
        Verdict::from_condition(is_within, || {
            format!("{:08x?} of {address:?}", numbers.map(f32::to_bits))
        })
    });
    let filters = judge_rays("M01 filters", 303, 10_000, rays, |rng| {
        let filter = rng.choose(&PixelFilter::ALL);
        let number = if rng.next_sign() > 0.0 {
            rng.choose(&CORNERS).min(maximum)
        } else {
            rng.next_in_unit_interval()
        } as f32;
        let place = f64::from(filter.sampler().sample(number.min(maximum as f32)));
        Verdict::from_error((place - 0.5).abs(), filter.radius(), || {
            format!("{filter:?} of {:08x}", number.to_bits())
        })
    });
    precision_independent_measurements(&drawn.merge(words).merge(filters))
}

/// Returns one shape of each kind whose surface can be sampled.
fn shapes_with_area_sampling<R: Real>() -> Vec<AnyShape<R>> {
    let (c, axis) = (DVec3::new(0.3, -0.2, 0.1), DVec3::new(0.6, 1.0, -0.3));
    let (x, y) = (DVec3::new(1.5, 0.5, 0.0), DVec3::new(0.25, 0.75, 1.0));
    vec![
        AnyShape::Sphere(Sphere {
            centre: to_scalar::<R>(c),
            radius: R::from_f64(0.7),
        }),
        AnyShape::Triangle(Triangle::new([c, c + x, c + y].map(|p| to_scalar::<R>(p)))),
        AnyShape::Quad(Quad::new(c, x, y)),
        AnyShape::Disk(Disk::new(c, axis, 0.8)),
        AnyShape::Cuboid(Cuboid::new(c, c + 1.0)),
        AnyShape::Cylinder(Cylinder::new(c, axis, 0.5, Some(1.5), true)),
        AnyShape::Cone(Cone::new(c, axis, 0.5, 0.0, 1.5)),
        AnyShape::Ellipsoid(Ellipsoid::new(c, DVec3::new(0.5, 1.0, 0.25))),
        AnyShape::Torus(Torus::new(c, axis, 1.0, 0.3)),
    ]
}

/// Measures case M02: sampling of hemispheres, cones and surfaces. The random numbers are corners
/// of the unit square and points inside it. Directions must have unit length within two roundings,
/// and densities must be positive.
pub fn measure_sample_mappings<R: Real>(rays: RayCount) -> Vec<Measurement> {
    let shapes = shapes_with_area_sampling::<R>();
    let roundoff = R::ROUNDOFF.to_f64();
    let outcome = judge_rays("M02", 310, 200_000, rays, |rng| {
        // Numbers are at most the greatest f32 below one, in every precision.
        let mut number = || {
            if rng.next_sign() > 0.0 {
                rng.choose(&CORNERS).min(1.0 - UNIT_ROUNDOFF)
            } else {
                f64::from(rng.next_in_unit_interval() as f32).min(1.0 - UNIT_ROUNDOFF)
            }
        };
        let [u, v] = [number(), number()];
        let describe = |label: &str| {
            format!(
                "{label} for the random numbers with bits {:016x} and {:016x}",
                u.to_bits(),
                v.to_bits()
            )
        };
        let unit = |label: &str, d: DVec3, bound: f64| {
            Verdict::from_error((d.length() - 1.0).abs(), bound, || describe(label))
        };
        match rng.next_bits() % 3 {
            0 => {
                let d = sample_cosine_hemisphere::<R>([R::from_f64(u), R::from_f64(v)]).to_f64();
                // The square of the height is one minus the first number.
                let off = (d.z * d.z - (1.0 - u)).abs();
                unit("hemisphere", d, 2.0 * roundoff)
                    .and_then(|| Verdict::from_error(off, 4.0 * roundoff, || describe("height")))
                    .and_then(|| Verdict::from_condition(d.z > 0.0, || describe("density")))
            }
            1 => {
                // Cones from a nearly zero angle to a half-space, by the sine of their half-angle.
                let share = rng.choose(&[1e-7, 1e-6, 1e-3, 0.5, 0.999, 1.0 - 1e-9]);
                let Some(cone) =
                    DirectionCone::new(rng.sample_direction() / share, 1.0, DVec3::ZERO)
                else {
                    return Verdict::Skipped;
                };
                let density = 1.0 / cone.solid_angle();
                unit("cone", cone.sample_normal([u, v]), 2.0 * UNIT_ROUNDOFF).and_then(|| {
                    Verdict::from_condition(density > 0.0 && density.is_finite(), || {
                        describe("density of a cone")
                    })
                })
            }
            _ => {
                let shape = rng.choose(&shapes);
                let Some((point, density)) = shape.sample_area(R::from_f64(u), R::from_f64(v))
                else {
                    return Verdict::Skipped;
                };
                let is_sound = density > 0.0 && density.is_finite() && point.point.is_finite();
                unit("normal", point.normal, 2.0 * UNIT_ROUNDOFF).and_then(|| {
                    Verdict::from_condition(is_sound, || describe("density of a point"))
                })
            }
        }
    });
    vec![create_treeless_measurement::<R>(outcome)]
}

/// Measures case M11: stratification of 65 536 points of the Sobol sequence in two dimensions. The
/// unit square is divided into 65 536 equal rectangles; the number of columns is a power of two.
/// Each rectangle must contain one point. The tested pixels are at both ends of the range of
/// coordinates.
pub fn measure_stratification(rays: RayCount) -> Vec<Measurement> {
    const BITS: u32 = 16;
    let outcome = judge_rays("M11", 320, 34, rays, |rng| {
        let pixel = [[0, 0], [65_535, 65_535]][(rng.ray_index() % 2) as usize];
        let columns = rng.ray_index() as u32 / 2;
        let mut is_taken = vec![false; 1 << BITS];
        let cell = |x: f32, bits: u32| (f64::from(x) * f64::from(1 << bits)) as usize;
        let twice = (0..1 << BITS).find(|&index| {
            let [x, y] = sample_2d(
                SampleAddress {
                    pixel,
                    index,
                    replicate: columns,
                    ..SampleAddress::default()
                },
                SamplePurpose::Pixel,
            );
            core::mem::replace(
                &mut is_taken[cell(x, columns) << (BITS - columns) | cell(y, BITS - columns)],
                true,
            )
        });
        Verdict::from_condition(twice.is_none(), || {
            format!(
                "sample {twice:?} of the pixel {pixel:?} falls into a cell that an earlier sample fills, in a grid of 2^{columns} columns"
            )
        })
    });
    precision_independent_measurements(&outcome)
}
