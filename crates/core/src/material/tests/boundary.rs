//! The table of rough boundaries against its integrals, and white glass against energy
//! conservation.

use core::f64::consts::TAU;

use super::super::fresnel::fresnel_dielectric_in_air;
use super::super::ggx::{LEAST_ROUGHNESS, sample_wm};
use super::super::lobe_traits::sample_disk;
use super::super::rough_boundary_tables::{
    BoundaryTable, LOSS_STEPS, MOST_INDEX, REFLECTION_STEPS, UNIT, fresnel_albedo,
    single_scattering_loss, smooth_mean_reflectance,
};
use super::super::*;
use super::{NORMAL, WHITE, chi_squared, direction_at, furnace, numbers};
use glam::DVec3;

/// Points of the unit disk that are summed for a table entry: in radius, and around half of the
/// disk.
const POINTS: [usize; 2] = [48, 12];

/// Shares of light at a cosine: reflected by Fresnel's equations, lost with them, and lost where
/// microfacets refract all light that they can. By the midpoint rule over the probability of
/// visible normals, finer towards those at grazing angles to the view.
fn scattering(cosine: f64, roughness: f64, eta: f64, [outwards, around]: [usize; 2]) -> [f64; 3] {
    let alpha = roughness.max(LEAST_ROUGHNESS).powi(2);
    let (a2, wo) = (
        alpha * alpha,
        DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine),
    );
    let smith = |c: f64| (a2 + (1.0 - a2) * c * c).sqrt();
    let (own, mut scattered, mut through, mut clear) = (smith(cosine), 0.0, 0.0, 0.0);
    for k in 0..outwards * around {
        let rest = 1.0 - ((k / around) as f64 + 0.5) / outwards as f64;
        let turn = 0.25 + 0.5 * ((k % around) as f64 + 0.5) / around as f64;
        let wm = sample_wm::<f64>(wo, [alpha; 2], sample_disk([1.0 - rest.powi(3), turn]));
        let cell = 3.0 * rest * rest / (outwards * around) as f64;
        let tilt = wo.dot(wm).clamp(0.0, 1.0);
        let beyond2 = 1.0 - eta * eta * (1.0 - tilt * tilt);
        let beyond = beyond2.max(0.0).sqrt();
        let share = fresnel_dielectric(tilt, (beyond2 > 0.0).then_some(beyond), eta);
        let into = (wm * (2.0 * wo.dot(wm)) - wo).z;
        if into > 0.0 {
            let actual = cell * (cosine + own) * into / (cosine * smith(into) + into * own);
            scattered += actual * share;
            clear += if beyond2 > 0.0 { 0.0 } else { actual };
        }
        let below = wo.z * eta - wm.z * (eta * tilt - beyond);
        if beyond2 > 0.0 && below > 0.0 {
            let actual = cell * 2.0 * below / (below + smith(below));
            through += actual * (1.0 - share);
            clear += actual;
        }
    }
    [scattered, 1.0 - scattered - through, 1.0 - clear]
}

/// Rows of one kind of entry over a table of these steps. Each row ends with the mean of the
/// interpolation between its entries: 8·∫E·s⁷ ds by the fourth root s of the cosine.
fn rows(
    [indices, roughnesses, cosines]: [usize; 3],
    value_of: impl Fn(f64, f64, f64) -> f64,
) -> Vec<u16> {
    let maximum = libm::sqrt(libm::sqrt(0.5 * (MOST_INDEX - 1.0)));
    let share = |i: usize, steps: usize| i as f64 / (steps - 1) as f64;
    let stored = |x: f64| (x.clamp(0.0, 1.0) * UNIT).round() as u16;
    let mut out = Vec::new();
    for i in 0..indices * roughnesses {
        let place = share(i / roughnesses, indices) * maximum / (1.0 + maximum);
        let (index, minimum) = (
            1.0 + 2.0 * (place / (1.0 - place)).powi(4),
            LEAST_ROUGHNESS.sqrt(),
        );
        let roughness = (minimum + share(i % roughnesses, roughnesses) * (1.0 - minimum)).powi(2);
        let row: Vec<u16> = (0..cosines)
            .map(|k| {
                stored(value_of(
                    share(k, cosines).powi(4).max(1e-4),
                    roughness,
                    index,
                ))
            })
            .collect();
        let (step, mut mean) = (1.0 / (cosines - 1) as f64, 0.0);
        for (k, pair) in row.windows(2).enumerate() {
            let [a, b] = [k, k + 1].map(|k| k as f64 * step);
            let [from, to] = [pair[0], pair[1]].map(|x| f64::from(x) / UNIT);
            let slope = (to - from) / step;
            mean += (from - slope * a) * (b.powi(8) - a.powi(8))
                + slope * 8.0 / 9.0 * (b.powi(9) - a.powi(9));
        }
        out.extend(row);
        out.push(stored(mean));
    }
    out
}

fn bytes() -> Vec<u8> {
    let mut all = rows(REFLECTION_STEPS, |cosine, roughness, index| {
        scattering(cosine, roughness, 1.0 / index, POINTS)[0]
    });
    for side in [0, 1] {
        let eta = |index: f64| if side == 0 { 1.0 / index } else { index };
        for selected in [1, 2] {
            all.extend(rows(LOSS_STEPS, |cosine, roughness, index| {
                scattering(cosine, roughness, eta(index), POINTS)[selected]
            }));
        }
    }
    all.into_iter().flat_map(u16::to_le_bytes).collect()
}

/// Protects: the table holds the values of its integrals.
#[test]
fn the_table_of_boundaries_is_its_integrals() {
    let found = bytes();
    assert_eq!(found.len(), BoundaryTable::BYTES);
    super::hold_table(
        "boundary.table",
        include_bytes!("../boundary.table"),
        &found,
    );
}

/// Protects: interpolated values, between the entries too, agree with finer sums, from both sides.
#[test]
fn boundaries_reflect_and_lose_what_is_looked_up() {
    let mut worst = [0.0_f64; 3];
    for point in 0..400 {
        let ([a, b, c], [d, ..]) = (numbers(500_000 + 2 * point), numbers(500_001 + 2 * point));
        let index = if d < 0.3 {
            1.0 + 0.2 * a
        } else {
            1.1 + 2.0 * a
        };
        let (roughness, cosine) = (0.04 + 0.96 * b, 0.02 + 0.98 * c);
        let [scattered, ..] = scattering(cosine, roughness, 1.0 / index, [96, 32]);
        worst[0] = worst[0].max((fresnel_albedo(index, roughness, Some(cosine)) - scattered).abs());
        for (side, eta) in [(1, 1.0 / index), (2, index)] {
            let [_, whole, clear] = scattering(cosine, roughness, eta, [96, 32]);
            let found = single_scattering_loss(eta, roughness, Some(cosine));
            worst[side] = worst[side]
                .max((found[0] - whole).abs())
                .max((found[1] - clear).abs());
        }
    }
    assert!(
        worst[0] < 0.01 && worst[1] < 0.015 && worst[2] < 0.03,
        "{worst:?}"
    );
    for index in [1.001, 1.01, 1.33, 1.5, 10.0, 1000.0] {
        let cell = |k: u32| (f64::from(k) + 0.5) / 1e5;
        let sum = (0..100_000)
            .map(|k| fresnel_dielectric_in_air(cell(k), index) * 2.0 * cell(k) / 1e5)
            .sum::<f64>();
        assert!(
            (smooth_mean_reflectance(index) - sum).abs() < 1e-6,
            "{index}: {} not {sum}",
            smooth_mean_reflectance(index)
        );
    }
}

fn clear(ior: f64, roughness: f64, thin: bool) -> LayeredSurface<f64> {
    let glass = Some(Glass {
        share: 1.0,
        ior,
        reflected: WHITE,
        transmitted: WHITE,
    });
    let dielectric = ((ior - 1.0) / (ior + 1.0)).powi(2);
    let base = MetallicRoughness {
        base: WHITE,
        metallic: 0.0,
        roughness,
        dielectric,
        grazing: 1.0,
        glass,
    };
    LayeredSurface {
        thin,
        ..LayeredSurface::from_base(base, ior)
    }
}

/// Protects: rough glass conserves energy, as a thin wall and as a solid body, viewed from both
/// sides, with a tinted reflection or not. Thin walls once lost up to .69, boundaries up to .62 of
/// it.
#[test]
fn rough_glass_keeps_all() {
    let mut worst = [(0.0_f64, String::new()), (0.0, String::new())];
    for ior in [1.05, 1.33, 1.5, 2.0, 2.42] {
        for roughness in [0.1, 0.25, 0.4, 0.6, 0.8, 0.9, 1.0] {
            for height in [1.0, 0.7, 0.4, 0.15, 0.04] {
                for (thin, outside) in [(true, true), (false, true), (false, false)] {
                    for (specular, strength) in [(1.0, 0.0), (0.4, 0.0), (1.0, 0.7)] {
                        let anisotropy = (strength > 0.0).then(|| Anisotropy {
                            strength,
                            frame: ShadingFrame::from_normal(NORMAL),
                        });
                        let model = LayeredSurface {
                            specular,
                            anisotropy,
                            ..clear(ior, roughness, thin)
                        };
                        let wo = direction_at(NORMAL, height, 0.4);
                        let (scattered, deviation) = super::furnace_of(
                            &model.transport_bsdf(NORMAL, wo, outside),
                            wo,
                            1_500,
                        );
                        let off = (scattered.x - 1.0).abs() - 3.5 * deviation;
                        let worst = &mut worst[usize::from(!outside)];
                        if off > worst.0 {
                            let name = format!(
                                "index {ior}, {roughness} at {height}, thin {thin}, outside {outside}"
                            );
                            *worst = (
                                off,
                                format!(
                                    "{name}, {specular}, combed {strength}: {scattered} ± {deviation}"
                                ),
                            );
                        }
                    }
                }
            }
        }
    }
    assert!(worst[0].0 <= 0.008 && worst[1].0 <= 0.015, "{worst:?}");
    // The boundary without layers returns the same energy as the boundary with layers.
    let base = clear(1.5, 0.8, false).base;
    let (scattered, deviation) = furnace(&base.transport_bsdf(NORMAL, NORMAL, true, true), NORMAL);
    assert!(
        (scattered.x - 1.0).abs() <= 0.006 + 3.0 * deviation,
        "{scattered} ± {deviation}"
    );
}

/// Protects: samples of rough glass follow their density, and its values with multiple scattering
/// are reciprocal, up to the square of the index.
#[test]
fn rough_glass_with_interreflection_is_reciprocal() {
    for (ior, roughness, specular) in [(1.5, 0.9, 1.0), (1.33, 0.5, 0.3), (2.42, 1.0, 1.0)] {
        let model = LayeredSurface {
            specular,
            ..clear(ior, roughness, false)
        };
        for height in [0.9, 0.3] {
            let wo = direction_at(NORMAL, height, 0.4);
            chi_squared(
                "glass, from outside",
                &model.transport_bsdf(NORMAL, wo, true),
                wo,
            );
            chi_squared(
                "wall",
                &LayeredSurface {
                    thin: true,
                    ..model
                }
                .transport_bsdf(NORMAL, wo, true),
                wo,
            );
        }
        for i in 0..400 {
            let ([a, b, c], [d, ..]) = (numbers(2 * i), numbers(2 * i + 1));
            let wo = direction_at(NORMAL, 0.02 + 0.98 * a, TAU * b);
            let wi = direction_at(NORMAL, -0.02 - 0.98 * c, TAU * d);
            let there = model
                .transport_bsdf(NORMAL, wo, true)
                .eval_and_pdf(wo, wi)
                .0
                .x;
            let back = model
                .transport_bsdf(-NORMAL, wi, false)
                .eval_and_pdf(wi, wo)
                .0
                .x;
            assert!(
                (back * ior * ior - there).abs() <= 1e-6 * there.abs(),
                "index {ior}: {there} and {back}"
            );
            assert!(there > 0.0);
        }
    }
}

/// Protects: white paint of any index by Fresnel's equations reflects all incident light, from
/// head-on to 89.9°, smooth or rough, tinted and not.
#[test]
fn exact_paint_sends_back_all() {
    let mut worst = (0.0_f64, String::new());
    for ior in [1.0, 1.001, 1.01, 1.1, 1.5, 2.5, 4.0, 10.0, 100.0, 1000.0] {
        for roughness in [0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.6, 1.0] {
            for height in [1.0, 0.6, 0.25, 0.07, 0.02, 0.001_745] {
                for (specular, colour) in [(1.0, 1.0), (0.5, 1.0), (1.0, 0.3), (1.0, 4.0)] {
                    let dielectric = ((ior - 1.0) / (ior + 1.0_f64)).powi(2);
                    let base = MetallicRoughness {
                        base: WHITE,
                        metallic: 0.0,
                        roughness,
                        dielectric,
                        grazing: 1.0,
                        glass: None,
                    };
                    let model = LayeredSurface {
                        rule: FresnelRule::Exact,
                        specular,
                        specular_colour: WHITE * colour,
                        ..LayeredSurface::from_base(base, ior)
                    };
                    let wo = direction_at(NORMAL, height, 0.4);
                    let (scattered, deviation) =
                        super::furnace_of(&model.transport_bsdf(NORMAL, wo, true), wo, 1_000);
                    let off = (scattered.x - 1.0).abs() - 3.5 * deviation;
                    if off > worst.0 {
                        let name = format!(
                            "index {ior}, roughness {roughness} at {height}, {specular} of {colour}"
                        );
                        worst = (off, format!("{name}: {scattered} ± {deviation}"));
                    }
                }
            }
        }
    }
    assert!(worst.0 <= 0.005, "{worst:?}");
}
