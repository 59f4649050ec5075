//! Numerically hard cases M01, M02, M11: random numbers at the ends of their range, maps from
//! random numbers to directions and points, and uniformity.

use raywright_bvh::stability::prelude::*;
use raywright_bvh::stability::tree_and_scan::draw_shape;

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

/// Greatest f32 below one.
const MAXIMUM: f64 = 1.0 - UNIT_ROUNDOFF;

/// Draws a random number: one of the corners, or any, at most the greatest f32 below one.
fn draw_number(rng: &mut CaseRng) -> f64 {
    let any = f64::from(rng.next_in_unit_interval() as f32);
    let corner = rng.choose(&CORNERS);
    rng.choose(&[any, corner]).min(MAXIMUM)
}

/// Judges case M01: every sampler's numbers must be in [0, 1), even if all high bits of the random
/// word are set. Pixel filters must map these numbers to positions within their radius.
pub(super) fn random_range<R: Real>(trial: &mut Trial<R>) {
    let judge = |x: f64, bits: u64| {
        let is_within = (0.0..=MAXIMUM).contains(&x);
        Verdict::from_condition(is_within, || format!("number {x} of {bits:016x}"))
            .and_then(|| Verdict::from_error(x, MAXIMUM, || "number"))
    };
    trial.judge("words", (301, 10_000), |rng| {
        let word = !(rng.ray_index() as u32);
        [judge(
            sobol_burley::parts::u32_to_f32_norm(word).into(),
            word.into(),
        )]
    });
    trial.judge("", (302, 1_000_000), |rng| {
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
        let [x, y] = sample_2d(address, SamplePurpose::Scatter);
        let index = u64::from(address.index);
        [judge(x.into(), index).and_then(|| judge(y.into(), index))]
    });
    trial.judge("filters", (303, 10_000), |rng| {
        let (filter, number) = (rng.choose(&PixelFilter::ALL), draw_number(rng) as f32);
        let place = f64::from(filter.sampler().sample(number));
        [Verdict::from_error(
            (place - 0.5).abs(),
            filter.radius(),
            || format!("{filter:?} of {:08x}", number.to_bits()),
        )]
    });
}

/// Judges case M02: sampling of hemispheres, cones and the surfaces of random shapes. The random numbers are corners of
/// the unit square and points inside it. Directions must have unit length within two roundings, and
/// densities must be positive.
pub(super) fn sample_mappings<R: Real>(trial: &mut Trial<R>) {
    let roundoff = R::ROUNDOFF.to_f64();
    trial.judge("", (310, 200_000), |rng| {
        let [u, v] = [(); 2].map(|()| draw_number(rng));
        let label = |label: &str| {
            format!(
                "{label} for the random numbers with bits {:016x} and {:016x}",
                u.to_bits(),
                v.to_bits()
            )
        };
        let judge = |d: DVec3, roundoff: f64, density: f64| {
            Verdict::from_error((d.length() - 1.0).abs(), 2.0 * roundoff, || label("length"))
                .and_then(|| {
                    let is_sound = density > 0.0 && density.is_finite();
                    Verdict::from_condition(is_sound, || label("density"))
                })
        };
        [match rng.next_bits() % 3 {
            0 => {
                let d = sample_cosine_hemisphere::<R>([u, v].map(R::from_f64)).to_f64();
                // The square of the height is one minus the first number.
                let off = (d.z * d.z - (1.0 - u)).abs();
                judge(d, roundoff, d.z)
                    .and_then(|| Verdict::from_error(off, 4.0 * roundoff, || label("height")))
            }
            1 => {
                // Cones from a nearly zero angle to a half-space, by the sine of their half-angle.
                let share = rng.choose(&[1e-7, 1e-6, 1e-3, 0.5, 0.999, 1.0 - 1e-9]);
                let centre = rng.sample_direction() / share;
                DirectionCone::new(centre, 1.0, DVec3::ZERO).map_or(Verdict::Skipped, |cone| {
                    judge(
                        cone.sample_normal([u, v]),
                        UNIT_ROUNDOFF,
                        1.0 / cone.solid_angle(),
                    )
                })
            }
            _ => {
                let shape = draw_shape::<R>(rng);
                let sample = shape.sample_area(R::from_f64(u), R::from_f64(v));
                sample.map_or(Verdict::Skipped, |(point, density)| {
                    let is_finite = point.point.is_finite();
                    judge(point.normal, UNIT_ROUNDOFF, density)
                        .and_then(|| Verdict::from_condition(is_finite, || label("point")))
                })
            }
        }]
    });
}

/// Judges case M11: stratification of 65 536 points of the Sobol sequence in two dimensions. The
/// unit square is divided into 65 536 equal rectangles; the number of columns is a power of two.
/// Each rectangle must contain one point. The tested pixels are at both ends of the range of
/// coordinates.
pub(super) fn stratification<R: Real>(trial: &mut Trial<R>) {
    const BITS: u32 = 16;
    trial.judge("", (320, 34), |rng| {
        let pixel = [[0; 2], [65_535; 2]][(rng.ray_index() % 2) as usize];
        let columns = rng.ray_index() as u32 / 2;
        let mut is_taken = vec![false; 1 << BITS];
        let cell = |x: f32, bits: u32| (f64::from(x) * f64::from(1 << bits)) as usize;
        let twice = (0..1 << BITS).find(|&index| {
            let address = SampleAddress {
                pixel,
                index,
                replicate: columns,
                ..SampleAddress::default()
            };
            let [x, y] = sample_2d(address, SamplePurpose::Pixel);
            let cell = cell(x, columns) << (BITS - columns) | cell(y, BITS - columns);
            core::mem::replace(&mut is_taken[cell], true)
        });
        [Verdict::from_condition(twice.is_none(), || {
            format!("sample {twice:?} of the pixel {pixel:?} falls into a cell that an earlier sample fills, in a grid of 2^{columns} columns")
        })]
    });
}
