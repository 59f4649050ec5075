//! BSDF tests: samples follow their density, densities integrate to at most one, values are
//! reciprocal and conserve energy.

mod albedo;
mod boundary;
mod energy;
mod lanes;
mod layers;
mod normals;
mod pictures;

use super::albedo::Albedo;
use super::energy::EnergyComplement;
use super::*;
use glam::DVec3;

/// Numbers in [0, 1) by index (SplitMix64).
fn numbers(index: u64) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let mut z = (3 * index + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    })
}

/// Compares a table file of the sources with its computed bytes. If they differ, the computed table
/// is written into the system's folder for temporary files, from which it can replace the file.
#[track_caller]
fn hold_table(name: &str, kept: &[u8], computed: &[u8]) {
    if kept != computed {
        let file = std::env::temp_dir().join(name);
        std::fs::write(&file, computed).expect("the folder for temporary files can be written to");
        panic!(
            "{name} is not what is computed, which is in {}",
            file.display()
        );
    }
}

/// A direction by its cosine to `n` and its azimuth.
fn direction_at(n: DVec3, height: f64, turn: f64) -> DVec3 {
    let across = (1.0 - height * height).sqrt();
    ShadingFrame::<f64>::from_normal(n).to_world(DVec3::new(
        across * turn.cos(),
        across * turn.sin(),
        height,
    ))
}

const NORMAL: DVec3 = DVec3::new(0.48, -0.64, 0.6);
const WHITE: DVec3 = DVec3::ONE;

/// The diffuse lobe below microfacets of index 1.5, viewed at a cosine; white microfacets return
/// all that single scattering loses.
fn diffuse(roughness: f64, interreflected: f64, height: f64) -> Lobe<f64> {
    let energy_complement = EnergyComplement::new([0.04, 1.0, 0.0], roughness)
        .with_view_cosine(height, Albedo::mean(roughness));
    Lobe::Diffuse {
        albedo: WHITE,
        interreflected: WHITE * interreflected,
        energy_complement,
    }
}

fn glossy(roughness: f64, f0: f64) -> Lobe<f64> {
    Lobe::Rough {
        f0: DVec3::splat(f0),
        f90: WHITE,
        roughness,
    }
}

/// Each non-delta lobe alone, and a surface of all of them with a mirror, viewed along `wo`.
fn surfaces(wo: DVec3) -> Vec<(&'static str, Bsdf<f64>)> {
    let value_of = |lobe| Bsdf::<f64>::new(NORMAL).with_lobe(lobe);
    let mirror = Lobe::Mirror {
        f0: DVec3::splat(0.3),
        f90: WHITE,
    };
    vec![
        ("diffuse", value_of(diffuse(0.5, 0.0, NORMAL.dot(wo)))),
        (
            "below white facets",
            value_of(diffuse(0.9, 1.0, NORMAL.dot(wo))),
        ),
        ("glossy", value_of(glossy(0.5, 0.04))),
        ("rough metal", value_of(glossy(0.9, 1.0))),
        ("shiny metal", value_of(glossy(0.3, 1.0))),
        (
            "all",
            value_of(diffuse(0.6, 0.3, NORMAL.dot(wo)))
                .with_lobe(glossy(0.6, 0.5))
                .with_lobe(mirror),
        ),
        (
            "Lambert",
            value_of(Lobe::Lambert(Lambert { albedo: WHITE })),
        ),
        (
            "rough",
            value_of(Lobe::Rough {
                f0: DVec3::splat(0.2),
                f90: DVec3::splat(0.7),
                roughness: 0.4,
            }),
        ),
    ]
}

fn frosted(eta: f64, roughness: f64) -> Bsdf<f64> {
    Bsdf::new(NORMAL).with_lobe(Lobe::Dielectric(Dielectric {
        eta,
        facet_eta: eta,
        share: 1.0,
        reflected: WHITE,
        transmitted: WHITE,
        roughness: Some(roughness),
    }))
}

/// Rough boundaries from either side, which reflect and transmit.
fn boundaries() -> Vec<(&'static str, Bsdf<f64>)> {
    vec![
        ("into glass", frosted(1.0 / 1.5, 0.6)),
        ("out of glass", frosted(1.5, 0.6)),
        ("out of diamond", frosted(2.42, 0.8)),
        (
            "metal and glass",
            frosted(1.0 / 1.5, 0.6).with_lobe(Lobe::Rough {
                f0: WHITE * 0.5,
                f90: WHITE,
                roughness: 0.9,
            }),
        ),
        (
            "into water with paint",
            frosted(1.0 / 1.33, 0.9).with_lobe(Lobe::Lambert(Lambert {
                albedo: WHITE * 0.5,
            })),
        ),
    ]
}

const HEIGHTS: [f64; 3] = [1.0, 0.7, 0.2];

/// Integrates the density over cells of the sphere, `rows` of equal height by `columns`, each by
/// its own midpoint rule.
fn expected<L: BsdfLobe<f64>, const MOST: usize>(
    bsdf: &Bsdf<f64, L, MOST>,
    wo: DVec3,
    [rows, columns]: [usize; 2],
    count: usize,
) -> Vec<f64> {
    let cell = 2.0 * core::f64::consts::TAU / (rows * columns * count * count) as f64;
    let part = |cell: usize, step: usize, cells: usize| {
        (cell as f64 + (step as f64 + 0.5) / count as f64) / cells as f64
    };
    let sum = |row: usize, column: usize| -> f64 {
        let steps = (0..count * count).map(|step| (step / count, step % count));
        let at = |(i, j)| {
            direction_at(
                NORMAL,
                2.0 * part(row, i, rows) - 1.0,
                part(column, j, columns) * core::f64::consts::TAU,
            )
        };
        steps.map(|step| bsdf.pdf(wo, at(step)) * cell).sum()
    };
    (0..rows * columns)
        .map(|index| sum(index / columns, index % columns))
        .collect()
}

/// Tests by χ² over cells of the sphere that samples follow `pdf`. Samples outside the cells are
/// lost by microfacets or belong to a delta lobe.
fn chi_squared<L: BsdfLobe<f64>, const MOST: usize>(
    name: &str,
    bsdf: &Bsdf<f64, L, MOST>,
    wo: DVec3,
) {
    const COUNT: u64 = 60_000;
    const CELLS: [usize; 2] = [40, 24];
    let height = wo.dot(NORMAL);
    // Transmission through a boundary head-on is a narrow peak.
    let expected = expected(
        bsdf,
        wo,
        CELLS,
        if bsdf.is_transmissive() && MOST == MOST_LOBES {
            40
        } else {
            12
        },
    );
    let total: f64 = expected.iter().sum();
    assert!(
        total <= 1.0 + 2e-3,
        "{name} at {height}: the density sums to {total}"
    );
    let mut found = vec![0.0; expected.len()];
    let frame = ShadingFrame::<f64>::from_normal(NORMAL);
    let drawn = (0..COUNT).map(|i| bsdf.sample(&frame, wo, numbers(i)));
    for sampled in drawn.filter(|sampled| sampled.is_valid && !sampled.delta) {
        let d = sampled.direction;
        assert!(
            (d.length() - 1.0).abs() < 1e-12
                && (sampled.density / bsdf.pdf(wo, d) - 1.0).abs() < 1e-12
        );
        let turn = (libm::atan2(d.dot(frame.bitangent), d.dot(frame.tangent))
            / core::f64::consts::TAU)
            .rem_euclid(1.0);
        let place = |share: f64, cells: usize| ((share * cells as f64) as usize).min(cells - 1);
        found[place(0.5 * (1.0 + d.dot(NORMAL)), CELLS[0]) * CELLS[1] + place(turn, CELLS[1])] +=
            1.0;
    }
    // Cells with an expectation below five count together.
    let (mut statistic, mut freedom, mut rest) = (0.0, 0.0, [0.0; 2]);
    let mut count = |found: f64, expected: f64| {
        statistic += (found - expected) * (found - expected) / expected;
        freedom += 1.0;
    };
    for (&found, expected) in found
        .iter()
        .zip(expected.iter().map(|share| share * COUNT as f64))
    {
        if expected >= 5.0 {
            count(found, expected);
        } else {
            rest = [rest[0] + found, rest[1] + expected];
        }
    }
    if rest[1] >= 5.0 {
        count(rest[0], rest[1]);
    }
    // χ² has the mean `freedom` and the standard deviation √(2·freedom); the bound is four of them.
    assert!(
        statistic <= freedom + 4.0 * (2.0_f64 * freedom).sqrt(),
        "{name} at {height}: χ² {statistic} for {freedom} cells"
    );
}

/// The albedo of a surface under white light, and its greatest standard deviation.
fn furnace<L: BsdfLobe<f64>, const MOST: usize>(
    bsdf: &Bsdf<f64, L, MOST>,
    wo: DVec3,
) -> (DVec3, f64) {
    furnace_of(bsdf, wo, 20_000)
}

/// [`furnace`] with a given number of samples.
fn furnace_of<L: BsdfLobe<f64>, const MOST: usize>(
    bsdf: &Bsdf<f64, L, MOST>,
    wo: DVec3,
    count: u64,
) -> (DVec3, f64) {
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    let frame = ShadingFrame::from_normal(NORMAL);
    for weight in (0..count).map(|i| bsdf.sample(&frame, wo, numbers(i)).weight) {
        (sum, squares) = (sum + weight, squares + weight * weight);
    }
    let mean = sum / count as f64;
    let variance = (squares / count as f64 - mean * mean).max(DVec3::ZERO) / count as f64;
    (mean, variance.max_element().sqrt())
}

/// Protects: sampled directions follow the density of `pdf`.
#[test]
fn samples_follow_their_density() {
    for height in HEIGHTS {
        let wo = direction_at(NORMAL, height, 0.4);
        for (name, bsdf) in surfaces(wo).into_iter().chain(boundaries()) {
            chi_squared(name, &bsdf, wo);
        }
    }
}

/// Protects: BRDFs are reciprocal.
#[test]
fn values_are_reciprocal() {
    for i in 0..200 {
        let ([a, b, c], [d, ..]) = (numbers(2 * i), numbers(2 * i + 1));
        let [wo, wi] = [
            direction_at(NORMAL, 0.01 + 0.99 * a, core::f64::consts::TAU * b),
            direction_at(NORMAL, 0.01 + 0.99 * c, core::f64::consts::TAU * d),
        ];
        for ((name, bsdf), (_, back)) in surfaces(wo).into_iter().zip(surfaces(wi)) {
            let (there, back) = (bsdf.eval(wo, wi), back.eval(wi, wo));
            assert!(
                (there - back).length() <= 1e-9 * there.length(),
                "{name}: {there} and {back}"
            );
        }
    }
}

/// Protects: rough boundaries transmit reciprocally, up to the square of the index by which solid
/// angles differ.
#[test]
fn rough_boundaries_are_reciprocal() {
    for eta in [1.5, 1.0 / 1.5, 2.42] {
        let (bsdf, back) = (frosted(eta, 0.7), frosted(1.0 / eta, 0.7));
        let mut some = 0;
        for i in 0..2000 {
            let ([a, b, c], [d, ..]) = (numbers(2 * i), numbers(2 * i + 1));
            let wo = direction_at(NORMAL, 0.01 + 0.99 * a, core::f64::consts::TAU * b);
            let wi = direction_at(NORMAL, -0.01 - 0.99 * c, core::f64::consts::TAU * d);
            // From below, the boundary is the same with the opposite normal.
            let turned = |v: DVec3| -v;
            let (one, other) = (
                bsdf.eval_and_pdf(wo, wi).0.x,
                back.eval_and_pdf(turned(wi), turned(wo)).0.x,
            );
            assert!(
                (other - eta * eta * one).abs() <= 1e-6 * other.abs(),
                "index {eta}: {one} and {other}"
            );
            some += usize::from(one > 0.0);
        }
        assert!(some > 100, "only {some} pairs of directions are joined");
    }
}

/// Protects: white metal of any roughness reflects all incident light, ± 0.5 %, at every angle;
/// rough glass gains no energy.
#[test]
fn m08_white_metal_in_a_white_furnace() {
    let metal = |roughness| MetallicRoughness {
        base: WHITE,
        metallic: 1.0,
        roughness,
        dielectric: 0.04,
        grazing: 1.0,
        glass: None,
    };
    let mean = |bsdf: &Bsdf<f64>, wo: DVec3| {
        let (mean, deviation) = furnace(bsdf, wo);
        (mean.x, deviation)
    };
    for roughness in [0.0, 0.02, 0.05, 0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0] {
        for height in [1.0, 0.8, 0.5, 0.3, 0.12, 0.05] {
            let wo = direction_at(NORMAL, height, 0.4);
            let (scattered, deviation) =
                mean(&metal(roughness).transport_bsdf(NORMAL, wo, true, true), wo);
            assert!(
                (scattered - 1.0).abs() <= 0.005 + 3.0 * deviation,
                "roughness {roughness} at {height}: {scattered} ± {deviation}"
            );
            for eta in [1.5, 1.0 / 1.5] {
                let (scattered, deviation) = mean(&frosted(eta, roughness.max(0.05)), wo);
                assert!(
                    scattered <= 1.0 + 3.0 * deviation && scattered > 0.3,
                    "glass {eta}, {roughness} at {height}: {scattered} ± {deviation}"
                );
            }
        }
    }
}

/// Protects: no lobe gains energy (the white furnace), and the mean weight of samples equals the
/// albedo by quadrature.
#[test]
fn no_lobe_makes_light() {
    const COUNT: u64 = 20_000;
    let glass = Lobe::Dielectric(Dielectric {
        eta: 1.0 / 1.5,
        facet_eta: 1.0 / 1.5,
        share: 1.0,
        reflected: WHITE,
        transmitted: WHITE,
        roughness: None,
    });
    let mirror = Lobe::Mirror {
        f0: DVec3::splat(0.5),
        f90: WHITE,
    };
    for height in HEIGHTS {
        let below = diffuse(0.5, 0.0, height);
        for lobe in [
            below,
            glossy(0.3, 1.0),
            glossy(0.5, 0.04),
            glossy(0.9, 1.0),
            mirror,
            glass,
        ] {
            let (bsdf, wo) = (
                Bsdf::<f64>::new(NORMAL).with_lobe(lobe),
                direction_at(NORMAL, height, 0.4),
            );
            let (mut sum, mut squares) = (0.0, 0.0);
            for weight in (0..COUNT).map(|i| {
                bsdf.sample(&ShadingFrame::from_normal(NORMAL), wo, numbers(i))
                    .weight
                    .x
            }) {
                (sum, squares) = (sum + weight, squares + weight * weight);
            }
            let mean = sum / COUNT as f64;
            let deviation = ((squares / COUNT as f64 - mean * mean).max(0.0) / COUNT as f64).sqrt();
            assert!(
                mean <= 1.0 + 3.0 * deviation + 1e-12,
                "{lobe:?} at {height}: {mean} ± {deviation}"
            );
            if lobe.is_delta() {
                continue;
            }
            let (rows, columns) = (600, 240);
            let cells = (0..rows * columns).map(|i| {
                let (z, turn) = (
                    ((i / columns) as f64 + 0.5) / f64::from(rows),
                    f64::from(i % columns) + 0.5,
                );
                bsdf.eval(
                    wo,
                    direction_at(
                        NORMAL,
                        z,
                        turn / f64::from(columns) * core::f64::consts::TAU,
                    ),
                )
                .x * z
            });
            let albedo = cells.sum::<f64>() * core::f64::consts::TAU / f64::from(rows * columns);
            let off = (mean - albedo).abs();
            assert!(
                off <= 4.0 * deviation + 2e-3,
                "{lobe:?} at {height}: {mean} ± {deviation}, not {albedo}"
            );
        }
    }
}

/// Protects: values equal those by hand. Head-on α² = 1/16, D = 1/(π·α²), and masking-shadowing
/// leaves 1/4; below smooth microfacets of mean reflectance F̄ = 0.04 + 0.96/21, albedo·(1 −
/// f0)²/(π·(1 − F̄)).
#[test]
fn values_head_on() {
    let bsdf = Bsdf::<f64>::new(NORMAL)
        .with_lobe(diffuse(0.0, 0.0, 1.0))
        .with_lobe(glossy(0.5, 0.04));
    let pi = core::f64::consts::PI;
    let (below, above) = (
        0.96 * 0.96 / (1.0 - 0.04 - 0.96 / 21.0) / pi,
        0.04 * 16.0 / (4.0 * pi),
    );
    assert!((bsdf.eval(NORMAL, NORMAL).x - below - above).abs() < 1e-12);
    assert!((bsdf.eval_diffuse(NORMAL, NORMAL).x - below).abs() < 1e-12);
    // Lobes are chosen by their albedo; their densities are cos/π and D/4.
    let chance = 0.96;
    let density = (chance / pi + 0.04 * 16.0 / (4.0 * pi)) / (chance + 0.04);
    assert!((bsdf.pdf(NORMAL, NORMAL) - density).abs() < 1e-12);
}

/// Protects: a reset BSDF has no lobes, and its new normal.
#[test]
fn lists_are_begun_anew() {
    let mut bsdf = Bsdf::<f64>::new(NORMAL)
        .with_lobe(diffuse(0.5, 0.0, 1.0))
        .with_lobe(glossy(0.5, 0.04));
    assert_eq!((bsdf.lobes().len(), bsdf.normal()), (2, NORMAL));
    bsdf.reset(-NORMAL);
    assert_eq!((bsdf.lobes().len(), bsdf.normal()), (0, -NORMAL));
    assert_eq!(bsdf.eval(-NORMAL, -NORMAL), DVec3::ZERO);
}

/// Protects: delta lobes are flagged, have neither value nor density, follow the mirror direction
/// and Snell's law, and glass divides light by the Fresnel reflectance.
#[test]
fn delta_lobes_are_kept_apart() {
    let wo = direction_at(NORMAL, 0.6, 1.0);
    let mirrored = NORMAL * (2.0 * 0.6) - wo;
    let mirror = Bsdf::<f64>::new(NORMAL).with_lobe(Lobe::Mirror {
        f0: DVec3::splat(0.25),
        f90: WHITE,
    });
    let glass = Glass {
        share: 1.0,
        ior: 1.5,
        reflected: WHITE,
        transmitted: WHITE * 0.5,
    }
    .dielectric_lobe(true, 0.5, None);
    let glass = Bsdf::<f64>::new(NORMAL).with_lobe(Lobe::Dielectric(glass));
    for bsdf in [&mirror, &glass] {
        assert_eq!(
            (bsdf.eval(wo, mirrored), bsdf.pdf(wo, mirrored)),
            (DVec3::ZERO, 0.0)
        );
    }
    let sampled = mirror.sample(&ShadingFrame::from_normal(NORMAL), wo, [0.3; 3]);
    assert!(
        sampled.is_valid
            && sampled.delta
            && sampled.density == 0.0
            && (sampled.direction - mirrored).length() < 1e-12
    );
    let schlick = 0.25 + 0.75 * 0.4_f64.powi(5);
    assert!((sampled.weight.x - schlick).abs() < 1e-12);
    let share = fresnel_dielectric(0.6, Some((1.0 - 0.64 / 2.25_f64).sqrt()), 1.0 / 1.5);
    for (u, factor, upwards) in [(share - 1e-9, 1.0, true), (share + 1e-9, 0.5, false)] {
        let sampled = glass.sample(&ShadingFrame::from_normal(NORMAL), wo, [0.0, u, 0.0]);
        assert!(
            sampled.is_valid && sampled.delta && (sampled.weight.x - 0.5 * factor).abs() < 1e-12,
            "{sampled:?}"
        );
        assert_eq!(sampled.direction.dot(NORMAL) > 0.0, upwards);
        let sine = sampled.direction.cross(NORMAL).length();
        assert!(
            (sine - if upwards { 0.8 } else { 0.8 / 1.5 }).abs() < 1e-9,
            "{sine}"
        );
    }
}

/// Protects: a lobe of reflectance zero has the value zero, also for opposite directions, which
/// have no half vector.
#[test]
fn zero_reflectance_reflects_nothing() {
    let bsdf = Bsdf::<f64>::new(NORMAL).with_lobe(Lobe::Rough {
        f0: DVec3::ZERO,
        f90: DVec3::ZERO,
        roughness: 0.5,
    });
    let wo = direction_at(NORMAL, 0.6, 1.0);
    assert_eq!(
        [
            bsdf.eval(wo, -wo),
            bsdf.eval(wo, direction_at(NORMAL, 0.3, 2.0))
        ],
        [DVec3::ZERO; 2]
    );
}

/// Protects: a metal has a coloured reflectance and no diffuse lobe, a dielectric the reverse, and
/// glass takes its share.
#[test]
fn lobes_of_the_metallic_roughness_model() {
    let base = DVec3::new(0.8, 0.4, 0.2);
    let value_of = |metallic, glass| MetallicRoughness {
        base,
        metallic,
        roughness: 0.5,
        dielectric: 0.04,
        grazing: 1.0,
        glass,
    };
    let (metal, matte) = (value_of(1.0, None), value_of(0.0, None));
    assert_eq!(
        (metal.albedo(), metal.f0(), matte.albedo(), matte.f0()),
        (DVec3::ZERO, base, base, DVec3::splat(0.04))
    );
    let glass = Some(Glass {
        share: 0.25,
        ior: 1.5,
        reflected: WHITE,
        transmitted: base,
    });
    let half = value_of(0.5, glass);
    assert_eq!(
        (
            half.glass_share(),
            half.opaque_dielectric_share(),
            half.albedo()
        ),
        (0.125, 0.375, base * 0.375)
    );
    assert_eq!(
        half.transport_bsdf(NORMAL, NORMAL, true, true)
            .lobes()
            .len(),
        4
    );
    assert_eq!(
        value_of(1.0, glass)
            .transport_bsdf(NORMAL, NORMAL, true, true)
            .lobes()
            .len(),
        2
    );
    let inside = half.transport_bsdf(NORMAL, NORMAL, false, true);
    let Some(Lobe::Dielectric(Dielectric { eta, share, .. })) =
        inside.lobes().iter().rev().nth(1).copied()
    else {
        panic!("glass")
    };
    assert_eq!((eta, share), (1.5, 0.125));
}
