//! The table of directional albedos against its integrals, and the integrals against an independent
//! Monte Carlo estimate.

use core::f64::consts::{FRAC_PI_2, TAU};

use super::super::albedo::{
    ALBEDO_STEPS, ANISOTROPIC_MEAN_STEPS, ANISOTROPIC_STEPS, Albedo, AlbedoEntry, AlbedoTable,
    TABLE, UNIT, look_up_albedo, look_up_anisotropic_albedo,
};
use super::super::fresnel::schlick_weight;
use super::super::ggx::{LEAST_ROUGHNESS, sample_wm};
use super::super::lobe_traits::sample_disk;
use super::numbers;
use crate::number::{Lanes, Number};
use glam::DVec3;

/// Points of the unit disk that are summed for a table entry: in radius, and around half of the
/// disk. For isotropic microfacets the disk's halves are symmetric.
const OUTWARDS: usize = 40;
const AROUND: usize = 8;
/// Points around the whole unit disk that are summed for anisotropic microfacets.
const ALL_AROUND: usize = 24;
/// Numbers of cosines and azimuths in the sum of a mean over the hemisphere.
const HEMISPHERE: [usize; 2] = [96, 32];

/// The mean over the hemisphere of the interpolation between a row's entries: 8·∫E·s⁷ ds by the
/// fourth root s of the cosine, in closed form over each step. So the mean belongs to the very
/// function that is looked up.
fn mean(row: &[AlbedoEntry]) -> AlbedoEntry {
    let step = 1.0 / (ALBEDO_STEPS - 1) as f64;
    let mut sum = [0.0; 2];
    for (i, pair) in row.windows(2).enumerate() {
        let (a, b) = (i as f64 * step, (i + 1) as f64 * step);
        let (even, rising) = (b.powi(8) - a.powi(8), 8.0 / 9.0 * (b.powi(9) - a.powi(9)));
        for (k, sum) in sum.iter_mut().enumerate() {
            let (from, to) = (f64::from(pair[0][k]), f64::from(pair[1][k]));
            let slope = (to - from) / step;
            *sum += (from - slope * a) * even + slope * rising;
        }
    }
    sum.map(|x| x as f32)
}

/// Smith's √(α² + (1 − α²)·cos²).
fn smith(a2: f64, cosine: f64) -> f64 {
    (a2 + (1.0 - a2) * cosine * cosine).sqrt()
}

/// The directional albedos of GGX microfacets of reflectance one and of Schlick's weight as
/// reflectance, by the cosine of incidence: the mean of reflectance · G₂/G₁ over visible normals,
/// by the midpoint rule over their probability. Steps are finer towards normals at grazing angles
/// to the view, where most of the loss is.
fn single_scattering(cosine: f64, roughness: f64) -> [f64; 2] {
    let alpha = roughness.max(LEAST_ROUGHNESS).powi(2);
    let (a2, wo) = (
        alpha * alpha,
        DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine),
    );
    let (own, mut sum) = (smith(a2, cosine), [0.0; 2]);
    for k in 0..OUTWARDS * AROUND {
        let rest = 1.0 - ((k / AROUND) as f64 + 0.5) / OUTWARDS as f64;
        let turn = 0.25 + 0.5 * ((k % AROUND) as f64 + 0.5) / AROUND as f64;
        let wm = sample_wm::<f64>(wo, [alpha; 2], sample_disk([1.0 - rest.powi(3), turn]));
        let into = (wm * (2.0 * wo.dot(wm)) - wo).z;
        if into > 0.0 {
            let cell = 3.0 * rest * rest / (OUTWARDS * AROUND) as f64;
            let scattered = cell * (cosine + own) * into / (cosine * smith(a2, into) + into * own);
            sum = [
                sum[0] + scattered,
                sum[1] + scattered * schlick_weight(wo.dot(wm)),
            ];
        }
    }
    sum
}

/// [`single_scattering`] for anisotropic microfacets with these α, by direction.
fn anisotropic_scattering(wo: DVec3, [wide, fine]: [f64; 2]) -> [f64; 2] {
    let root = |v: DVec3| (v * DVec3::new(wide, fine, 1.0)).length();
    let (own, mut sum) = (root(wo), [0.0; 2]);
    for k in 0..OUTWARDS * ALL_AROUND {
        let rest = 1.0 - ((k / ALL_AROUND) as f64 + 0.5) / OUTWARDS as f64;
        let turn = ((k % ALL_AROUND) as f64 + 0.5) / ALL_AROUND as f64;
        let wm = sample_wm::<f64>(wo, [wide, fine], sample_disk([1.0 - rest.powi(3), turn]));
        let wi = wm * (2.0 * wo.dot(wm)) - wo;
        if wi.z > 0.0 {
            let cell = 3.0 * rest * rest / (OUTWARDS * ALL_AROUND) as f64;
            let scattered = cell * (wo.z + own) * wi.z / (wo.z * root(wi) + wi.z * own);
            sum = [
                sum[0] + scattered,
                sum[1] + scattered * schlick_weight(wo.dot(wm)),
            ];
        }
    }
    sum
}

fn direction_at(cosine: f64, [x, y]: [f64; 2]) -> DVec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    DVec3::new(sine * x, sine * y, cosine)
}

/// Both α for the table's coordinates: the lesser roughness, and the strength of the anisotropy.
fn alpha(finer: f64, strength: f64) -> [f64; 2] {
    let minimum = LEAST_ROUGHNESS.sqrt();
    let fine = (minimum + finer * (1.0 - minimum)).powi(4);
    [fine + (1.0 - fine) * strength * strength, fine]
}

/// The entry of the anisotropic table at an index.
fn difference(table: &AlbedoTable, index: usize) -> [i16; 2] {
    let mut rest = index;
    let mut share = [0.0; 4];
    for k in (0..4).rev() {
        share[k] = (rest % ANISOTROPIC_STEPS[k]) as f64 / (ANISOTROPIC_STEPS[k] - 1) as f64;
        rest /= ANISOTROPIC_STEPS[k];
    }
    let [wide, fine] = alpha(share[2], share[3]);
    if wide <= fine {
        return [0; 2];
    }
    let [maximum, minimum] = [wide, fine].map(|alpha| alpha.sqrt().sqrt());
    let shown = (minimum + share[1] * (maximum - minimum)).powi(4);
    let y2 = ((wide * wide - shown * shown) / (wide * wide - fine * fine)).clamp(0.0, 1.0);
    let wo = direction_at(share[0].powi(4).max(1e-4), [(1.0 - y2).sqrt(), y2.sqrt()]);
    let [scattered, grazing] = anisotropic_scattering(wo, [wide, fine]);
    // Head-on too, the azimuth's roughness is given, since the direction does not determine it.
    let isotropic = look_up_albedo(table, wo.z, shown.sqrt());
    let stored = |exact: f64, isotropic: f64| ((exact - isotropic) * UNIT).round() as i16;
    [
        stored(1.0 - scattered, isotropic[0]),
        stored(grazing, isotropic[1]),
    ]
}

/// The mean over the hemisphere of the looked-up albedo, by the midpoint rule over azimuths and the
/// fourth root of the cosine.
fn anisotropic_mean(table: &AlbedoTable, index: usize) -> AlbedoEntry {
    let share = |k: usize| k as f64 / (ANISOTROPIC_MEAN_STEPS - 1) as f64;
    let alpha = alpha(
        share(index / ANISOTROPIC_MEAN_STEPS),
        share(index % ANISOTROPIC_MEAN_STEPS),
    );
    let ([heights, turns], mut sum) = (HEMISPHERE, [0.0; 2]);
    for i in 0..heights * turns {
        let root = ((i / turns) as f64 + 0.5) / heights as f64;
        let azimuth = FRAC_PI_2 * ((i % turns) as f64 + 0.5) / turns as f64;
        let entry = look_up_anisotropic_albedo(
            table,
            direction_at(root.powi(4), [libm::cos(azimuth), libm::sin(azimuth)]),
            alpha,
        );
        let cell = 8.0 * root.powi(7) / (heights * turns) as f64;
        sum = [sum[0] + cell * entry[0], sum[1] + cell * entry[1]];
    }
    sum.map(|x| x as f32)
}

/// Computes the whole table.
fn computed() -> Box<AlbedoTable> {
    let share = |i: usize| i as f64 / (ALBEDO_STEPS - 1) as f64;
    let mut table = Box::new(AlbedoTable::from_bytes(&[0; AlbedoTable::BYTES]));
    for (i, entry) in table.entries.iter_mut().enumerate() {
        let [cosine, roughness] = [
            share(i % ALBEDO_STEPS).powi(4).max(1e-4),
            share(i / ALBEDO_STEPS).powi(2),
        ];
        let [all, grazing] = single_scattering(cosine, roughness);
        *entry = [(1.0 - all).max(0.0) as f32, grazing as f32];
    }
    for j in 0..ALBEDO_STEPS {
        table.means[j] = mean(&table.entries[j * ALBEDO_STEPS..(j + 1) * ALBEDO_STEPS]);
    }
    for index in 0..table.anisotropic.len() {
        table.anisotropic[index] = difference(&table, index);
    }
    for index in 0..table.anisotropic_means.len() {
        table.anisotropic_means[index] = anisotropic_mean(&table, index);
    }
    table
}

fn bytes(table: &AlbedoTable) -> Vec<u8> {
    let pairs = table
        .entries
        .iter()
        .chain(&table.means)
        .chain(&table.anisotropic_means);
    let differences = table
        .anisotropic
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes());
    pairs
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .chain(differences)
        .collect()
}

/// Protects: the table holds the values of its integrals.
#[test]
fn the_table_is_its_integrals() {
    super::hold_table(
        "albedo.table",
        include_bytes!("../albedo.table"),
        &bytes(&computed()),
    );
}

/// Protects: directional albedos of single scattering agree with brute force: microfacets sampled
/// by their slopes, visible or not, each weighted by Smith's height-correlated masking-shadowing
/// through Λ. Over roughness, strength, height and azimuth, between the entries.
#[test]
fn albedos_are_those_of_the_microsurface() {
    const COUNT: u64 = 40_000;
    let table = &TABLE;
    for point in 0..120 {
        let ([a, b, c], [turn, ..]) = (numbers(9000 + 2 * point), numbers(9001 + 2 * point));
        let strength = if point % 5 == 0 { 0.0 } else { b };
        let [wide, fine] = alpha(a, strength);
        let wo = direction_at(
            0.05 + 0.95 * c,
            [libm::cos(TAU * turn), libm::sin(TAU * turn)],
        );
        let lambda = |v: DVec3| {
            0.5 * ((1.0 + ((wide * v.x).powi(2) + (fine * v.y).powi(2)) / (v.z * v.z)).sqrt() - 1.0)
        };
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..COUNT {
            let [u, v, _] = numbers(1_000_000 * (point + 1) + i);
            let slope = (u / (1.0 - u)).sqrt();
            let wm = DVec3::new(
                wide * slope * libm::cos(TAU * v),
                fine * slope * libm::sin(TAU * v),
                1.0,
            )
            .normalize();
            let wi = wm * (2.0 * wo.dot(wm)) - wo;
            if wo.dot(wm) > 0.0 && wi.z > 0.0 {
                let weight = wo.dot(wm) / (wo.z * wm.z) / (1.0 + lambda(wo) + lambda(wi));
                (sum, squares) = (sum + weight, squares + weight * weight);
            }
        }
        let mean = sum / COUNT as f64;
        let deviation = ((squares / COUNT as f64 - mean * mean) / COUNT as f64).sqrt();
        let found = if strength == 0.0 {
            look_up_albedo(table, wo.z, fine.sqrt())
        } else {
            look_up_anisotropic_albedo(table, wo, [wide, fine])
        };
        let off = (1.0 - found[0] - mean).abs();
        assert!(
            off <= 0.008 + 4.0 * deviation,
            "α {wide}, {fine}, towards {wo}: {} and {mean} ± {deviation}",
            1.0 - found[0]
        );
    }
}

/// Protects: the albedos of several lanes have the bits of single lookups; also of nearly smooth
/// microfacets, at the ends of the table, and of cosines that are no number or below zero.
#[test]
fn albedos_in_lanes_have_the_bits_of_single_lookups() {
    let roughnesses = [0.0, 0.01, 0.03, 0.031, 0.2, 0.5, 0.999, 1.0, 1.5];
    let cosines = [
        f32::NAN,
        -0.3,
        -0.0,
        0.0,
        1e-9,
        0.01,
        0.3,
        0.77,
        1.0,
        1.000_001,
    ];
    let pairs: Vec<[f32; 2]> = cosines
        .iter()
        .flat_map(|&cosine| roughnesses.map(|roughness| [cosine, roughness]))
        .collect();
    for k in 0..pairs.len() {
        let lane = |lane: usize| pairs[(k + 7 * lane) % pairs.len()];
        let found = Albedo::at_cosine(
            Lanes::<8>::from_lanes(|i| lane(i)[0].into()),
            Lanes::<8>::from_lanes(|i| lane(i)[1].into()),
        );
        for i in 0..8 {
            let [cosine, roughness] = lane(i).map(f64::from);
            let single = look_up_albedo(&TABLE, cosine, roughness).map(|x| x as f32);
            let found = [found.multiple_scattering_loss.0[i], found.schlick_part.0[i]];
            assert_eq!(
                found.map(f32::to_bits),
                single.map(f32::to_bits),
                "{cosine}, {roughness}"
            );
        }
    }
}

/// Protects: the mean albedo half-way between two steps of the table is the mean of both, in every lane.
#[test]
fn mean_albedos_in_lanes_lie_between_their_steps() {
    let place = |place: f64| (place / (ALBEDO_STEPS - 1) as f64).powi(2);
    let mean = |first: f64| {
        let roughness = |lane: usize| place(first + lane as f64);
        Albedo::mean(Lanes::<8>::from_lanes(roughness)).multiple_scattering_loss
    };
    let [below, between, above] = [12.0, 12.5, 13.0].map(mean);
    for i in 0..8 {
        let middle = 0.5 * (below.0[i] + above.0[i]);
        assert!((between.0[i] - middle).abs() < 1e-6, "{i}");
        assert!((above.0[i] - below.0[i]).abs() > 1e-4, "{i}");
    }
}
