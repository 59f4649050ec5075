//! Sheen: fibres that stand up and catch light at grazing angles ("Production Friendly Microfacet
//! Sheen BRDF", Estevez, Kulla 2017), as glTF's KHR_materials_sheen names it.

use core::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use super::albedo::between;
use super::frame::Frame;
use super::lobe_kind::{LobeKind, Pair, on_disk};
use super::stage::layer;
use crate::number::{Number, Vector3};

/// Least perceptual roughness: below it the exponent 1/α has no more digits.
const LEAST: f64 = 0.07;

layer! {
    /// Fibres on a surface.
    Sheen
    /// Colour, and how much of it there is.
    colour: Tint by tint;
    /// Perceptual roughness; α is its square.
    roughness: Share by share;
}

impl<N: Number> Sheen<N> {
    /// Share of light that white fibres send back in a direction, and the rest of what a colour's
    /// strongest part does.
    pub(super) fn sent(&self, cosine: N) -> N {
        let share = N::of_lanes(|lane| {
            looked_up(&SENT, cosine.lane(lane), self.roughness.lane(lane)).clamp(0.0, 1.0)
        });
        self.colour.max_element() * share
    }
}

impl<N: Number> LobeKind<N> for Sheen<N> {
    fn importance(&self, cosine: N) -> N {
        self.sent(cosine)
    }

    fn eval_and_pdf(&self, pair: &Pair<N>) -> (N::Vec3, N) {
        let half = pair.normal.dot((pair.wo + pair.wi).normalize()).min(N::ONE);
        let cosines = |lane: usize| [pair.out.lane(lane), pair.into.lane(lane), half.lane(lane)];
        let value =
            self.colour * N::of_lanes(|lane| charlie(self.roughness.lane(lane), cosines(lane)));
        (value, N::from_f64(0.5 / PI))
    }

    fn eval_diffuse(&self, pair: &Pair<N>) -> N::Vec3 {
        self.eval_and_pdf(pair).0
    }

    fn sample(&self, frame: &Frame<N>, _: N::Vec3, _: N::Vec3, _: N, point: [N; 2]) -> N::Vec3 {
        // Evenly over the hemisphere: equal heights have equal areas (Archimedes).
        let [x, y] = on_disk([N::ONE, point[1]]);
        let height = N::ONE - point[0];
        let across = (N::ONE - height * height).max(N::ZERO).sqrt();
        frame.to_world(N::Vec3::new(x * across, y * across, height))
    }
}

/// D·V of white fibres. As published, they send back up to two and a half times what comes at
/// grazing views where they are smooth; what would be beyond one is taken away, alike for both
/// directions.
fn charlie(roughness: f64, [out, into, half]: [f64; 3]) -> f64 {
    // A fiftieth more than the table says, which may be as much off.
    let most = (1.02
        * looked_up(&PUBLISHED, out, roughness).max(looked_up(&PUBLISHED, into, roughness)))
    .max(1.0);
    published(roughness, [out, into, half]) / most
}

/// D·V as published.
fn published(roughness: f64, [out, into, half]: [f64; 3]) -> f64 {
    if !(out > 0.0 && into > 0.0) {
        return 0.0;
    }
    let alpha = roughness.clamp(LEAST, 1.0).powi(2);
    let sine = (1.0 - half * half).max(0.0).sqrt();
    let density = (2.0 + 1.0 / alpha) * libm::pow(sine, 1.0 / alpha) / TAU;
    density / ((1.0 + hidden(out, alpha) + hidden(into, alpha)) * 4.0 * out * into)
}

/// Λ of the paper: how much fibres hide of each other, fitted for α = 0 and 1.
fn hidden(cosine: f64, alpha: f64) -> f64 {
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

/// Cosines and roughnesses of the table of albedos, and points by which an entry is summed.
const STEPS: usize = 24;
const POINTS: [usize; 2] = [48, 24];

type Lobe = fn(f64, [f64; 3]) -> f64;

/// Shares that are sent back, as published and as limited.
static PUBLISHED: LazyLock<Vec<f64>> = LazyLock::new(|| table(published));
pub(super) static SENT: LazyLock<Vec<f64>> = LazyLock::new(|| table(charlie));

fn table(lobe: Lobe) -> Vec<f64> {
    let share = |i: usize| i as f64 / (STEPS - 1) as f64;
    let entry = |i: usize| {
        summed(
            lobe,
            cosine_of(share(i % STEPS)),
            LEAST + (1.0 - LEAST) * share(i / STEPS),
            POINTS,
        )
    };
    (0..STEPS * STEPS).map(entry).collect()
}

/// Cosines lie closer towards grazing, where most is sent.
fn cosine_of(share: f64) -> f64 {
    (share * share).max(1e-3)
}

/// The share that is sent back, by a midpoint rule over the hemisphere.
fn summed(lobe: Lobe, cosine: f64, roughness: f64, [heights, turns]: [usize; 2]) -> f64 {
    let sine = (1.0 - cosine * cosine).sqrt();
    let mut sum = 0.0;
    for i in 0..heights {
        // Finer towards grazing, as the cosines.
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

/// What a table has for a cosine and a roughness.
fn looked_up(table: &[f64], cosine: f64, roughness: f64) -> f64 {
    let ((i, u), (j, v)) = (
        between(cosine.max(0.0).sqrt(), STEPS),
        between((roughness - LEAST) / (1.0 - LEAST), STEPS),
    );
    let row =
        |j: usize| table[j * STEPS + i] + (table[j * STEPS + i + 1] - table[j * STEPS + i]) * u;
    row(j) + (row(j + 1) - row(j)) * v
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the table of albedos against a sum of forty times as many points, between its
    /// entries too, and that fibres send back at most what comes.
    #[test]
    fn albedos_are_integrals() {
        let mut worst = 0.0_f64;
        for roughness in [0.07, 0.15, 0.3, 0.42, 0.6, 0.77, 0.9, 1.0] {
            for cosine in [0.01, 0.03, 0.1, 0.22, 0.4, 0.63, 0.81, 1.0] {
                let wanted = summed(charlie, cosine, roughness, [400, 120]);
                assert!(wanted <= 1.005, "{roughness} at {cosine}: {wanted}");
                worst =
                    worst.max((looked_up(&SENT, cosine, roughness).clamp(0.0, 1.0) - wanted).abs());
            }
        }
        assert!(worst < 0.02, "{worst}");
    }
}
