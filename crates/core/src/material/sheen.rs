//! Sheen: upright fibres that reflect at grazing angles ("Production Friendly Microfacet Sheen
//! BRDF", Estevez, Kulla 2017), as in glTF's KHR_materials_sheen.

use core::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use super::albedo::table_position;
use super::layer_fields::layer;
use super::lobe_traits::{Directions, ScatteringLobe, sample_disk};
use super::shading_frame::ShadingFrame;
use crate::number::{Number, Vector3};

/// Least perceptual roughness of sheen. At lower roughness the exponent 1/α would exceed the
/// precision.
const LEAST: f64 = 0.07;

layer! {
    /// Upright fibres on a surface, such as velvet, which reflect at grazing angles.
    Sheen
    /// Colour of the sheen. Its brightness is the strength of the sheen.
    colour: Tint by eval_tint;
    /// Perceptual roughness; α is its square.
    roughness: Share by eval_unit_number;
}

impl<N: Number> Sheen<N> {
    /// Returns the directional albedo of the sheen at a cosine to the normal: the albedo of white
    /// fibres times the strongest channel of the colour.
    pub(super) fn directional_albedo(&self, cosine: N) -> N {
        let share = N::from_lanes(|lane| {
            interpolate_albedo(&ALBEDO, cosine.lane(lane), self.roughness.lane(lane))
                .clamp(0.0, 1.0)
        });
        self.colour.max_element() * share
    }
}

impl<N: Number> ScatteringLobe<N> for Sheen<N> {
    fn importance(&self, cosine: N) -> N {
        self.directional_albedo(cosine)
    }

    fn eval_and_pdf(&self, directions: &Directions<N>) -> (N::Vec3, N) {
        let half = directions
            .normal
            .dot((directions.wo + directions.wi).normalize())
            .min(N::ONE);
        let cosines = |lane: usize| {
            [
                directions.cos_wo.lane(lane),
                directions.cos_wi.lane(lane),
                half.lane(lane),
            ]
        };
        let value = self.colour
            * N::from_lanes(|lane| eval_sheen(self.roughness.lane(lane), cosines(lane)));
        (value, N::from_f64(0.5 / PI))
    }

    fn eval_diffuse(&self, directions: &Directions<N>) -> N::Vec3 {
        self.eval_and_pdf(directions).0
    }

    fn sample(
        &self,
        frame: &ShadingFrame<N>,
        _: N::Vec3,
        _: N::Vec3,
        _: N,
        point: [N; 2],
    ) -> N::Vec3 {
        // The direction is uniform over the hemisphere: zones of equal height have equal areas
        // (Archimedes).
        let [x, y] = sample_disk([N::ONE, point[1]]);
        let height = N::ONE - point[0];
        let across = (N::ONE - height * height).max(N::ZERO).sqrt();
        frame.to_world(N::Vec3::new(x * across, y * across, height))
    }
}

/// Returns the BRDF D·V of white fibres, for the cosines of `wo`, `wi` and the half vector to the
/// normal. D is the density of fibre normals, V their visibility.
///
/// The published BRDF reflects up to 2.5 times the incident light, at grazing views of smooth
/// fibres. Where the albedo for `wo` or for `wi` exceeds 1, the BRDF is divided by the greater of
/// both albedos.
fn eval_sheen(roughness: f64, [out, into, half]: [f64; 3]) -> f64 {
    // The factor 1.02 covers the error of interpolation.
    let maximum = (1.02
        * interpolate_albedo(&PUBLISHED_ALBEDO, out, roughness).max(interpolate_albedo(
            &PUBLISHED_ALBEDO,
            into,
            roughness,
        )))
    .max(1.0);
    eval_published_sheen(roughness, [out, into, half]) / maximum
}

/// Returns the published BRDF D·V of white fibres, for the cosines of `wo`, `wi` and the half
/// vector to the normal.
fn eval_published_sheen(roughness: f64, [out, into, half]: [f64; 3]) -> f64 {
    if !(out > 0.0 && into > 0.0) {
        return 0.0;
    }
    let alpha = roughness.clamp(LEAST, 1.0).powi(2);
    let sine = (1.0 - half * half).max(0.0).sqrt();
    let density = (2.0 + 1.0 / alpha) * libm::pow(sine, 1.0 / alpha) / TAU;
    density / ((1.0 + sheen_lambda(out, alpha) + sheen_lambda(into, alpha)) * 4.0 * out * into)
}

/// Returns the paper's Λ at a cosine: the masking of fibres by each other. The paper fits the
/// parameters of Λ at α = 0 and α = 1; other parameters are interpolated.
fn sheen_lambda(cosine: f64, alpha: f64) -> f64 {
    let share = (1.0 - alpha) * (1.0 - alpha);
    let mix = |rough: f64, smooth: f64| rough + (smooth - rough) * share;
    let (a, b, c) = (
        mix(21.5473, 25.3245),
        mix(3.82987, 3.32435),
        mix(0.19823, 0.16801),
    );
    let (d, e) = (mix(-1.97760, -1.27393), mix(-4.32054, -4.85967));
    let log = |x: f64| a / (1.0 + b * libm::pow(x, c)) + d * x + e;
    if cosine < 0.5 {
        libm::exp(log(cosine))
    } else {
        libm::exp(2.0 * log(0.5) - log(1.0 - cosine))
    }
}

/// Steps of roughness and of cosine in the albedo tables.
const STEPS: usize = 24;
/// Numbers of heights and azimuths of the quadrature points for an entry of an albedo table.
const POINTS: [usize; 2] = [48, 24];

/// A BRDF as a function of the roughness and the three cosines of [`eval_sheen`].
type SheenFunction = fn(f64, [f64; 3]) -> f64;

/// Directional albedos of the published BRDF, by roughness and cosine.
static PUBLISHED_ALBEDO: LazyLock<Vec<f64>> =
    LazyLock::new(|| tabulate_albedo(eval_published_sheen));
/// Directional albedos of the scaled BRDF [`eval_sheen`], by roughness and cosine.
pub(super) static ALBEDO: LazyLock<Vec<f64>> = LazyLock::new(|| tabulate_albedo(eval_sheen));

/// Tabulates the directional albedos of a BRDF at `STEPS` roughnesses and `STEPS` cosines.
fn tabulate_albedo(lobe: SheenFunction) -> Vec<f64> {
    let share = |i: usize| i as f64 / (STEPS - 1) as f64;
    let entry = |i: usize| {
        integrate_albedo(
            lobe,
            cosine_at_table_coordinate(share(i % STEPS)),
            LEAST + (1.0 - LEAST) * share(i / STEPS),
            POINTS,
        )
    };
    (0..STEPS * STEPS).map(entry).collect()
}

/// Returns the cosine at a table coordinate in [0, 1]. Steps are finer towards grazing angles,
/// where sheen is strongest.
fn cosine_at_table_coordinate(share: f64) -> f64 {
    (share * share).max(1e-3)
}

/// Returns the directional albedo of a BRDF at a cosine, by the midpoint rule over the hemisphere.
fn integrate_albedo(
    lobe: SheenFunction,
    cosine: f64,
    roughness: f64,
    [heights, turns]: [usize; 2],
) -> f64 {
    let sine = (1.0 - cosine * cosine).sqrt();
    let mut sum = 0.0;
    for i in 0..heights {
        // Steps are finer towards grazing angles, as in the table.
        let share = (i as f64 + 0.5) / heights as f64;
        let into = share * share;
        let across = (1.0 - into * into).sqrt();
        for j in 0..turns {
            let turn = PI * (j as f64 + 0.5) / turns as f64;
            let between = cosine * into + sine * across * libm::cos(turn);
            let half = (cosine + into) / (2.0 + 2.0 * between).max(1e-12).sqrt();
            sum += lobe(roughness, [cosine, into, half.min(1.0)]) * into * 2.0 * share;
        }
    }
    sum * TAU / (heights * turns) as f64
}

/// Interpolates an albedo table at a cosine and a perceptual roughness.
fn interpolate_albedo(table: &[f64], cosine: f64, roughness: f64) -> f64 {
    let ((i, u), (j, v)) = (
        table_position(cosine.max(0.0).sqrt(), STEPS),
        table_position((roughness - LEAST) / (1.0 - LEAST), STEPS),
    );
    let row =
        |j: usize| table[j * STEPS + i] + (table[j * STEPS + i + 1] - table[j * STEPS + i]) * u;
    row(j) + (row(j + 1) - row(j)) * v
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the table of albedos agrees with a sum of forty times as many points, between its
    /// entries too, and fibres reflect at most the incident light.
    #[test]
    fn albedos_are_integrals() {
        let mut worst = 0.0_f64;
        for roughness in [0.07, 0.15, 0.3, 0.42, 0.6, 0.77, 0.9, 1.0] {
            for cosine in [0.01, 0.03, 0.1, 0.22, 0.4, 0.63, 0.81, 1.0] {
                let requested = integrate_albedo(eval_sheen, cosine, roughness, [400, 120]);
                assert!(requested <= 1.005, "{roughness} at {cosine}: {requested}");
                worst = worst.max(
                    (interpolate_albedo(&ALBEDO, cosine, roughness).clamp(0.0, 1.0) - requested)
                        .abs(),
                );
            }
        }
        assert!(worst < 0.02, "{worst}");
    }
}
