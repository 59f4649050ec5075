//! Numerically hard cases M01, M02, M11: random numbers at the ends of their range, maps from
//! random numbers to directions and points, and uniformity.

use raywright_bvh::stability::prelude::*;
use raywright_bvh::stability::trees::draw_shape;

use crate::filter::PixelFilter;
use crate::light::DirectionCone;
use crate::material::sample_cosine_hemisphere;
use crate::sampler::{SampleAddress, SamplePurpose, sample_2d};
use crate::settings::SamplerKind;

/// Greatest f32 below one.
const MAXIMUM: f64 = 1.0 - UNIT_ROUNDOFF;

/// Draws a random number: any, or one at the ends or in the middle of [0, 1): zero, 2⁻²³, a half,
/// the greatest f32 below one.
fn draw_number(rng: &mut CaseRng) -> f64 {
    let any = f64::from(rng.next_in_unit_interval() as f32);
    let corner = rng.choose(&[0.0, 2.0 * f64::from(f32::EPSILON), 0.5, MAXIMUM]);
    rng.choose(&[any, corner]).min(MAXIMUM)
}

/// Judges a number, which must be in [0, 1), of a random word or of a sample with an index.
fn judge_number(x: f32, of: u32) -> Verdict {
    let label = || format!("number {x} of {of:08x}");
    require(x >= 0.0, label) & within(x.into(), MAXIMUM, label)
}

/// Cases of sampling.
pub(super) fn cases<R: Real>() -> Vec<Case<R>> {
    vec![
        // Every sampler's numbers must be in [0, 1), even if all high bits of the random word are
        // set. Pixel filters must map these numbers to positions within their radius.
        ("M01", |trial| {
            trial.judge("words", (301, 10_000), LIBRARY, |rng, _| {
                let word = !(rng.ray_index() as u32);
                judge_number(sobol_burley::parts::u32_to_f32_norm(word), word)
            });
            trial.judge("", (302, 1_000_000), LIBRARY, |rng, _| {
                use SamplerKind::{Independent, Sobol, Stratified};
                let sampler = rng.choose(&[Sobol, Stratified, Independent]);
                let [x, y, replicate, index] = [(); 4].map(|()| rng.next_bits() as u32);
                let address = SampleAddress {
                    pixel: [x, y],
                    replicate: replicate % 256,
                    index,
                    sampler,
                    ..SampleAddress::default()
                };
                let [x, y] = sample_2d(address, SamplePurpose::Scatter);
                judge_number(x, index) & judge_number(y, index)
            });
            trial.judge("filters", (303, 10_000), LIBRARY, |rng, _| {
                let (filter, number) = (rng.choose(&PixelFilter::ALL), draw_number(rng) as f32);
                let place = f64::from(filter.sampler().sample(number));
                within((place - 0.5).abs(), filter.radius(), || {
                    format!("{filter:?} of {number}")
                })
            });
        }),
        // Sampling of hemispheres, cones and the surfaces of random shapes. The random numbers are
        // corners of the unit square and points inside it. Directions must have unit length within
        // two roundings, and densities must be positive.
        ("M02", |trial| {
            let roundoff = R::ROUNDOFF.to_f64();
            trial.judge("", (310, 200_000), LIBRARY, |rng, _| {
                let [u, v] = [(); 2].map(|()| draw_number(rng));
                let judge = |d: DVec3, roundoff: f64, density: f64| {
                    let label = || format!("{d:?}, density {density} of {u} and {v}");
                    within((d.length() - 1.0).abs(), 2.0 * roundoff, label)
                        & require(density > 0.0 && density.is_finite(), label)
                };
                match rng.next_bits() % 3 {
                    0 => {
                        let d = sample_cosine_hemisphere::<R>([u, v].map(R::from_f64)).to_f64();
                        // The square of the height is one minus the first number.
                        let off = (d.z * d.z - (1.0 - u)).abs();
                        let bound = 4.0 * roundoff * (1.0 - u);
                        judge(d, roundoff, d.z)
                            & within(off, bound, || format!("height of {u} and {v}"))
                    }
                    1 => {
                        // Cones from a nearly zero angle to a half-space, by the sine of their
                        // half-angle.
                        let share = rng.choose(&[1e-7, 1e-6, 1e-3, 0.5, 0.999, 1.0 - 1e-9]);
                        let centre = rng.sample_direction() / share;
                        let Some(cone) = DirectionCone::new(centre, 1.0, DVec3::ZERO) else {
                            return Verdict::Skipped;
                        };
                        judge(
                            cone.sample_normal([u, v]),
                            UNIT_ROUNDOFF,
                            1.0 / cone.solid_angle(),
                        )
                    }
                    _ => {
                        let sample =
                            draw_shape::<R>(rng).sample_area(R::from_f64(u), R::from_f64(v));
                        let Some((point, density)) = sample else {
                            return Verdict::Skipped;
                        };
                        judge(point.normal, UNIT_ROUNDOFF, density)
                            & require(point.point.is_finite(), || format!("point of {u} and {v}"))
                    }
                }
            });
        }),
        // Stratification of 65 536 points of the Sobol sequence in two dimensions. The unit square is
        // divided into 65 536 equal rectangles; the number of columns is a power of two. Each
        // rectangle must contain one point. The tested pixels are at both ends of the range of
        // coordinates.
        ("M11", |trial| {
            const BITS: u32 = 16;
            trial.judge("", (320, 34), LIBRARY, |rng, _| {
                let pixel = [[0; 2], [65_535; 2]][(rng.ray_index() % 2) as usize];
                let columns = rng.ray_index() as u32 / 2;
                let mut is_taken = vec![false; 1 << BITS];
                let twice = (0..1 << BITS).find(|&index| {
                    let address = SampleAddress {
                        pixel,
                        index,
                        replicate: columns,
                        ..SampleAddress::default()
                    };
                    let [x, y] = sample_2d(address, SamplePurpose::Pixel).map(f64::from);
                    let cell = |x: f64, bits: u32| (x * f64::from(1 << bits)) as usize;
                    let cell = cell(x, columns) << (BITS - columns) | cell(y, BITS - columns);
                    core::mem::replace(&mut is_taken[cell], true)
                });
                require(twice.is_none(), || {
                    format!(
                        "a cell with two samples, {twice:?}, of {pixel:?} in 2^{columns} columns"
                    )
                })
            });
        }),
    ]
}
