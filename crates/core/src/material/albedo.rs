//! Tabulated directional albedos of GGX microfacets. An entry splits the albedo in two: the energy
//! that white microfacets lose after a single reflection, and the part that scales with Schlick's
//! weight.
//!
//! The tables depend on no scene: they are constants in the file `albedo.table`. A test computes
//! the file anew and compares it byte by byte.
//!
//! Isotropic microfacets have a table by roughness and cosine. Anisotropic microfacets depend on
//! two angles and two roughnesses. A table of equal steps for them would be a hundred times as
//! long. The anisotropic table is therefore coarser, and holds the differences to isotropic
//! microfacets that have the roughness along the view's azimuth. These differences are small and
//! smooth.

use core::array::from_fn;

use glam::DVec3;

use super::fresnel::schlick_weight;
use super::ggx::{Ggx, LEAST_ROUGHNESS};
use crate::number::{Number, Vector3};

/// An entry of a table, two numbers in [0, 1]:
/// - the share of energy that white microfacets lose in a single reflection;
/// - the albedo of microfacets whose reflectance is Schlick's weight: 0 at normal incidence, 1 at
///   grazing incidence.
pub(super) type AlbedoEntry = [f32; 2];

/// Cosine-weighted mean of Schlick's weight over the hemisphere: 2·∫(1 − c)⁵·c dc over the cosine c
/// from 0 to 1.
pub(super) const MEAN_GRAZING: f64 = 1.0 / 21.0;

/// Steps of roughness and of cosine in the isotropic table.
pub(super) const ALBEDO_STEPS: usize = 32;
/// Steps of the anisotropic table: cosine, azimuth, lesser roughness, and strength of the
/// anisotropy.
pub(super) const ANISOTROPIC_STEPS: [usize; 4] = [16, 12, 12, 8];
/// Steps of each coordinate in the table of anisotropic means: lesser roughness, and strength of
/// the anisotropy.
pub(super) const ANISOTROPIC_MEAN_STEPS: usize = 24;
/// Integer that stands for a difference of 1.0 in the anisotropic table.
pub(super) const UNIT: f64 = 32_767.0;

/// Number of entries of the isotropic table.
const ENTRIES: usize = ALBEDO_STEPS * ALBEDO_STEPS;
/// Number of entries of the anisotropic table.
const DIFFERENCES: usize =
    ANISOTROPIC_STEPS[0] * ANISOTROPIC_STEPS[1] * ANISOTROPIC_STEPS[2] * ANISOTROPIC_STEPS[3];
/// Number of entries of the table of anisotropic means.
const MEANS: usize = ANISOTROPIC_MEAN_STEPS * ANISOTROPIC_MEAN_STEPS;

/// The tables of isotropic and anisotropic albedos.
pub(super) struct AlbedoTable {
    /// Entries of isotropic microfacets by perceptual roughness and cosine of the view. Steps are
    /// even in the square root of the roughness and in the fourth root of the cosine: the albedo of
    /// nearly smooth microfacets falls fast towards grazing angles.
    ///
    /// The interpolation error is at most 0.004 at cosines from 0.02 on. Steps even in the
    /// roughness and in the square root of the cosine gave errors up to 0.010.
    pub entries: [AlbedoEntry; ENTRIES],
    /// Cosine-weighted hemispherical means of isotropic albedos, by roughness.
    pub means: [AlbedoEntry; ALBEDO_STEPS],
    /// Cosine-weighted hemispherical means of anisotropic albedos, by the lesser roughness and the
    /// strength of the anisotropy.
    pub anisotropic_means: [AlbedoEntry; MEANS],
    /// Differences of anisotropic to isotropic albedos, in units of 1/[`UNIT`]. Coordinates are
    /// those of [`anisotropic_table_coordinates`]. The interpolation error is at most 0.008.
    pub anisotropic: [[i16; 2]; DIFFERENCES],
}

pub(super) static TABLE: AlbedoTable = AlbedoTable::from_bytes(include_bytes!("albedo.table"));

impl AlbedoTable {
    /// Length of `albedo.table` in bytes.
    pub const BYTES: usize = 8 * (ENTRIES + ALBEDO_STEPS + MEANS) + 4 * DIFFERENCES;

    /// Reads the tables from the bytes of `albedo.table`.
    pub const fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        Self {
            entries: read_f32_pairs(bytes, 0),
            means: read_f32_pairs(bytes, 8 * ENTRIES),
            anisotropic_means: read_f32_pairs(bytes, 8 * (ENTRIES + ALBEDO_STEPS)),
            anisotropic: read_i16_pairs(bytes, 8 * (ENTRIES + ALBEDO_STEPS + MEANS)),
        }
    }
}

/// Reads `COUNT` pairs of little-endian `f32` from byte `from` on.
const fn read_f32_pairs<const COUNT: usize>(bytes: &[u8], from: usize) -> [AlbedoEntry; COUNT] {
    let mut out = [[0.0; 2]; COUNT];
    let mut k = 0;
    while k < 2 * COUNT {
        let position = from + 4 * k;
        out[k / 2][k % 2] = f32::from_le_bytes([
            bytes[position],
            bytes[position + 1],
            bytes[position + 2],
            bytes[position + 3],
        ]);
        k += 1;
    }
    out
}

/// Reads `COUNT` pairs of little-endian `i16` from byte `from` on.
const fn read_i16_pairs<const COUNT: usize>(bytes: &[u8], from: usize) -> [[i16; 2]; COUNT] {
    let mut out = [[0; 2]; COUNT];
    let mut k = 0;
    while k < 2 * COUNT {
        let position = from + 2 * k;
        out[k / 2][k % 2] = i16::from_le_bytes([bytes[position], bytes[position + 1]]);
        k += 1;
    }
    out
}

/// Locates a table coordinate `x` among `steps` even steps over [0, 1]. Returns the index of the
/// lower step, and the fraction in [0, 1] of the distance to the next step. Coordinates outside the
/// range are clamped.
#[inline(always)]
pub(super) fn table_position(x: f64, steps: usize) -> (usize, f64) {
    // Zero for NaN too.
    let x = if x > 0.0 { x.min(1.0) } else { 0.0 } * (steps - 1) as f64;
    let below = (x as usize).min(steps - 2);
    (below, x - below as f64)
}

/// Interpolates linearly between two pairs of numbers: `a` at `share` 0, `b` at `share` 1.
#[inline(always)]
fn lerp_pair(a: [f64; 2], b: [f64; 2], share: f64) -> [f64; 2] {
    [lerp(a[0], b[0], share), lerp(a[1], b[1], share)]
}

/// Interpolates the isotropic table at the cosine of the view and the perceptual roughness. Up to
/// [`LEAST_ROUGHNESS`] the result is exact: a mirror loses no energy.
#[inline(always)]
pub(super) fn look_up_albedo(table: &AlbedoTable, cosine: f64, roughness: f64) -> [f64; 2] {
    if roughness <= LEAST_ROUGHNESS {
        return [0.0, schlick_weight(cosine.max(0.0))];
    }
    let ((i, u), (j, v)) = (
        table_position(cosine.max(0.0).sqrt().sqrt(), ALBEDO_STEPS),
        table_position(roughness.sqrt(), ALBEDO_STEPS),
    );
    let row = |j: usize| {
        let pair = &table.entries[j * ALBEDO_STEPS + i..j * ALBEDO_STEPS + i + 2];
        lerp_pair(pair[0].map(f64::from), pair[1].map(f64::from), u)
    };
    lerp_pair(row(j), row(j + 1), v)
}

/// Greatest number of lanes of a number.
const MOST_LANES: usize = 16;

#[inline(always)]
fn numbers_of_lanes<N: Number>(number: N) -> [f64; MOST_LANES] {
    let mut out = [0.0; MOST_LANES];
    for (lane, out) in out[..N::LANES].iter_mut().enumerate() {
        *out = number.lane(lane);
    }
    out
}

/// Returns the place of a coordinate, at least 0, in steps of the isotropic table.
#[inline(always)]
fn table_coordinate(x: f64) -> f64 {
    (if x < 1.0 { x } else { 1.0 }) * (ALBEDO_STEPS - 1) as f64
}

/// Returns the places of roughnesses in steps of the isotropic table.
#[inline(always)]
fn roughness_coordinates<N: Number>(roughness: N) -> [f64; MOST_LANES] {
    let mut y = numbers_of_lanes(roughness);
    for y in &mut y[..N::LANES] {
        *y = table_coordinate((if *y > 0.0 { *y } else { 0.0 }).sqrt());
    }
    y
}

/// Returns the step below a place of the isotropic table, as an index and as a number.
#[inline(always)]
fn lower_step(place: f64) -> (usize, f64) {
    let step = (place as i32).clamp(0, ALBEDO_STEPS as i32 - 2);
    (step as usize, step.into())
}

/// Interpolates linearly: `a` at `share` 0, `b` at `share` 1.
#[inline(always)]
fn lerp(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}

/// Returns the two coordinates in [0, 1] of the table of anisotropic means, for the greater α,
/// `wide`, and the lesser α, `fine`:
/// - the square root of the lesser roughness, scaled so that [`LEAST_ROUGHNESS`] is at 0;
/// - the strength of the anisotropy.
fn anisotropic_mean_coordinates([wide, fine]: [f64; 2]) -> [f64; 2] {
    let minimum = LEAST_ROUGHNESS.sqrt();
    let strength = ((wide - fine) / (1.0 - fine).max(1e-9)).max(0.0).sqrt();
    [(fine.sqrt().sqrt() - minimum) / (1.0 - minimum), strength]
}

/// Returns the four coordinates in [0, 1] of the anisotropic table, and the perceptual roughness
/// along the azimuth of the direction `v`. `v` is a unit direction in the frame of the microfacets.
/// The azimuth's coordinate is linear in the square root of the roughness.
fn anisotropic_table_coordinates(v: DVec3, [wide, fine]: [f64; 2]) -> ([f64; 4], f64) {
    let (x2, y2) = (v.x * v.x, v.y * v.y);
    let across = x2 + y2;
    let shown2 = if across > 0.0 {
        (wide * wide * x2 + fine * fine * y2) / across
    } else {
        fine * fine
    };
    let roughness = shown2.sqrt().sqrt();
    let ends = [wide, fine].map(|alpha| alpha.sqrt().sqrt());
    let span = ends[0] - ends[1];
    let azimuth = if span > 1e-9 {
        (roughness.sqrt() - ends[1]) / span
    } else {
        0.0
    };
    let [finer, strength] = anisotropic_mean_coordinates([wide, fine]);
    (
        [v.z.abs().sqrt().sqrt(), azimuth, finer, strength],
        roughness,
    )
}

/// Interpolates the anisotropic table for a unit direction in the frame of the microfacets. `alpha`
/// holds α along both axes.
pub(super) fn look_up_anisotropic_albedo(
    table: &AlbedoTable,
    v: DVec3,
    alpha: [f64; 2],
) -> [f64; 2] {
    let (place, roughness) = anisotropic_table_coordinates(v, alpha);
    let steps: [(usize, f64); 4] = from_fn(|k| table_position(place[k], ANISOTROPIC_STEPS[k]));
    let mut sum = look_up_albedo(table, v.z.abs(), roughness);
    for corner in 0..16_usize {
        let (mut index, mut share) = (0, 1.0);
        for (k, &(below, beyond)) in steps.iter().enumerate() {
            let upper = corner >> k & 1;
            index = index * ANISOTROPIC_STEPS[k] + below + upper;
            share *= if upper == 1 { beyond } else { 1.0 - beyond };
        }
        for (sum, &difference) in sum.iter_mut().zip(&table.anisotropic[index]) {
            *sum += share * f64::from(difference) / UNIT;
        }
    }
    sum.map(|x| x.clamp(0.0, 1.0))
}

/// Interpolates the hemispherical mean of the anisotropic albedo, for α along both axes.
fn anisotropic_mean_albedo(table: &AlbedoTable, alpha: [f64; 2]) -> [f64; 2] {
    let [(i, u), (j, v)] =
        anisotropic_mean_coordinates(alpha).map(|x| table_position(x, ANISOTROPIC_MEAN_STEPS));
    let row = |i: usize| {
        let position = i * ANISOTROPIC_MEAN_STEPS + j;
        lerp_pair(
            table.anisotropic_means[position].map(f64::from),
            table.anisotropic_means[position + 1].map(f64::from),
            v,
        )
    };
    lerp_pair(row(i), row(i + 1), u)
}

/// Assumed spread of Schlick's weight, relative to its mean, among the microfacets that reflect
/// towards the viewer.
const SCHLICK_SPREAD: f64 = 0.35;

/// Directional albedo of microfacets, split as in [`AlbedoEntry`]. Multiple scattering must return
/// the energy `multiple_scattering_loss` that white microfacets lose in a single reflection.
/// `schlick_part` is the albedo for Schlick's weight as reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Albedo<N: Number> {
    pub multiple_scattering_loss: N,
    pub schlick_part: N,
}

impl<N: Number> Albedo<N> {
    /// Creates the albedo from a table entry for each SIMD lane.
    #[inline(always)]
    fn from_lanes(entry: impl Fn(usize) -> [f64; 2]) -> Self {
        let both = <N::Vec3 as Vector3<N>>::from_lanes(|lane| {
            let [lost, grazing] = entry(lane);
            DVec3::new(lost, grazing, 0.0)
        });
        Self {
            multiple_scattering_loss: both.x(),
            schlick_part: both.y(),
        }
    }

    /// Returns the albedo of isotropic microfacets, for the cosine of the view and the perceptual
    /// roughness: in each lane the bits of [`look_up_albedo`]. Each step treats all lanes.
    #[inline(always)]
    pub fn at_cosine(cosine: N, roughness: N) -> Self {
        let mut x = numbers_of_lanes(cosine);
        for x in &mut x[..N::LANES] {
            *x = table_coordinate((if *x > 0.0 { *x } else { 0.0 }).sqrt().sqrt());
        }
        let y = roughness_coordinates(roughness);
        let mut corners = [[[0.0_f32; MOST_LANES]; 4]; 2];
        let (mut u, mut v) = ([0.0; MOST_LANES], [0.0; MOST_LANES]);
        for lane in 0..N::LANES {
            let ((i, left), (j, below)) = (lower_step(x[lane]), lower_step(y[lane]));
            (u[lane], v[lane]) = (x[lane] - left, y[lane] - below);
            let lower = j * ALBEDO_STEPS + i;
            let upper = lower + ALBEDO_STEPS;
            let entries = [lower, lower + 1, upper, upper + 1];
            for k in 0..entries.len() {
                let [lost, grazing] = TABLE.entries[entries[k]];
                (corners[0][k][lane], corners[1][k][lane]) = (lost, grazing);
            }
        }
        let mut out = [[0.0; MOST_LANES]; 2];
        for (out, corners) in out.iter_mut().zip(&corners) {
            let [a, b, c, d] = corners;
            for lane in 0..N::LANES {
                let lower = lerp(a[lane].into(), b[lane].into(), u[lane]);
                let upper = lerp(c[lane].into(), d[lane].into(), u[lane]);
                out[lane] = lerp(lower, upper, v[lane]);
            }
        }
        let [lost, grazing] = &mut out;
        for (lane, (lost, grazing)) in lost.iter_mut().zip(grazing).enumerate().take(N::LANES) {
            if roughness.lane(lane) <= LEAST_ROUGHNESS {
                (*lost, *grazing) = (0.0, schlick_weight(cosine.lane(lane).max(0.0)));
            }
        }
        Self::from_columns(&out)
    }

    /// Returns the cosine-weighted hemispherical mean of the albedo of isotropic microfacets.
    #[inline(always)]
    pub fn mean(roughness: N) -> Self {
        let y = roughness_coordinates(roughness);
        let mut out = [[0.0; MOST_LANES]; 2];
        for lane in 0..N::LANES {
            let (j, below) = lower_step(y[lane]);
            let ([lost, grazing], [next_lost, next_grazing]) = (TABLE.means[j], TABLE.means[j + 1]);
            let v = y[lane] - below;
            let is_smooth = roughness.lane(lane) <= LEAST_ROUGHNESS;
            let lost = lerp(lost.into(), next_lost.into(), v);
            let grazing = lerp(grazing.into(), next_grazing.into(), v);
            out[0][lane] = if is_smooth { 0.0 } else { lost };
            out[1][lane] = if is_smooth { MEAN_GRAZING } else { grazing };
        }
        Self::from_columns(&out)
    }

    #[inline(always)]
    fn from_columns([lost, grazing]: &[[f64; MOST_LANES]; 2]) -> Self {
        Self {
            multiple_scattering_loss: N::from_lanes(|lane| lost[lane]),
            schlick_part: N::from_lanes(|lane| grazing[lane]),
        }
    }

    /// Returns the albedo for a direction. `others` holds the SIMD mask of lanes with anisotropic
    /// microfacets, and their distribution. All other lanes have isotropic microfacets of the given
    /// roughness.
    pub fn at_cosine_anisotropic(
        direction: N::Vec3,
        cosine: N,
        roughness: N,
        others: &Option<(N::Mask, Ggx<N>)>,
    ) -> Self {
        let own = Self::at_cosine(cosine, roughness);
        let Some((mask, ggx)) = others else {
            return own;
        };
        let (local, alpha) = (ggx.frame().to_local(direction), ggx.alpha);
        let other = Self::from_lanes(|lane| {
            look_up_anisotropic_albedo(
                &TABLE,
                local.lane(lane),
                alpha.map(|alpha| alpha.lane(lane)),
            )
        });
        Self::select_lanes(*mask, other, own)
    }

    /// Returns the cosine-weighted hemispherical mean of the albedo. `others` is as in
    /// [`Self::at_cosine_anisotropic`].
    pub fn mean_anisotropic(roughness: N, others: &Option<(N::Mask, Ggx<N>)>) -> Self {
        let own = Self::mean(roughness);
        let Some((mask, ggx)) = others else {
            return own;
        };
        let other = Self::from_lanes(|lane| {
            anisotropic_mean_albedo(&TABLE, ggx.alpha.map(|alpha| alpha.lane(lane)))
        });
        Self::select_lanes(*mask, other, own)
    }

    /// Returns `yes` in SIMD lanes where the mask is set, `no` in all other lanes.
    fn select_lanes(mask: N::Mask, yes: Self, no: Self) -> Self {
        Self {
            multiple_scattering_loss: N::select(
                mask,
                yes.multiple_scattering_loss,
                no.multiple_scattering_loss,
            ),
            schlick_part: N::select(mask, yes.schlick_part, no.schlick_part),
        }
    }

    /// Returns the directional albedo of microfacets with any reflectance, given as a function of
    /// the cosine of incidence.
    ///
    /// The function is evaluated at the cosine whose Schlick weight is the mean over the
    /// microfacets. This is exact for mirrors and for Schlick's formula, but too small for
    /// Fresnel's equations. Therefore the mean of the reflectances at a lower and at a higher
    /// weight is used where it is greater. The reflectance of a film rises and falls between these
    /// cosines: with `film_cosine`, the cosine of the direction, the greatest of all is used.
    pub fn albedo_for_reflectance(
        &self,
        reflectance: impl Fn(N) -> N,
        film_cosine: Option<N>,
    ) -> N {
        let scattered = N::ONE - self.multiple_scattering_loss;
        // Reflectance at the mean Schlick weight plus `factor` times its spread.
        let value_of = |factor: f64| {
            let cosine = N::from_lanes(|lane| {
                let weight =
                    (self.schlick_part.lane(lane) / scattered.lane(lane).max(1e-6)).clamp(0.0, 1.0);
                let spread = (SCHLICK_SPREAD * weight).min(1.0 - weight);
                1.0 - libm::pow(weight + factor * spread, 0.2)
            });
            reflectance(cosine)
        };
        let [below, mean, above] = [-1.0, 0.0, 1.0].map(value_of);
        let ends = film_cosine.map_or((below + above) * N::from_f64(0.5), |cosine| {
            below.max(above).max(reflectance(cosine))
        });
        scattered * mean.max(ends)
    }

    /// Returns the directional albedo of microfacets with Schlick's reflectance, from `f0` at
    /// normal incidence to `f90` at grazing incidence.
    #[inline(always)]
    pub fn schlick_albedo(&self, f0: N, f90: N) -> N {
        f0 * (N::ONE - self.multiple_scattering_loss) + (f90 - f0) * self.schlick_part
    }
}
