//! False and true alarms of `compare --noise`: pairs of pictures of a scene with different seeds,
//! which differ by noise alone, and pairs in which one picture is brighter by half a percent in a
//! tenth of its area.
//!
//! `cargo bench --bench noise -- 1000` judges 1000 pairs of each scene, the default; each pair has
//! two new pictures. Further words select scenes by name.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use raywright::core::metrics::{PictureWithErrors, test_against_noise};
use raywright::core::scene::Integrator;
use raywright::core::settings::Sampling;
use raywright::core::{Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

/// Scenes with even noise, with rare light, and with edges.
const SCENES: [&str; 4] = ["cornell", "product", "many-lights", "glossy-box"];

/// Samples per pixel.
const SAMPLES: u32 = 64;

/// Size of the pictures that differ by noise alone, and of the few pictures with a planted bias.
const SMALL: [u32; 2] = [64, 48];
const LARGE: [u32; 2] = [640, 480];
const BIASED_PAIRS: u64 = 4;

/// Significance levels of the tests.
const LEVELS: [f64; 2] = [0.05, 0.01];

/// Factor of the planted bias.
const BIAS: f32 = 1.005;

/// Colours, standard errors, and degrees of freedom.
struct NoiseSide {
    size: [u32; 2],
    rgb: Vec<[f32; 3]>,
    errors: Vec<[f32; 3]>,
    freedom: u32,
}

impl NoiseSide {
    fn render(scene: &Scene, size: [u32; 2], seed: u64) -> Self {
        let (sampling, integrator) = (Sampling::General(SAMPLES), Integrator::Path);
        let settings = Settings {
            size,
            sampling,
            integrator,
            seed,
            ..Settings::from_scene(scene)
        };
        let ready = prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
        let mut film = ready.new_film("");
        let whole = film.full_part();
        ready
            .render_part(&mut film, &whole, &())
            .unwrap_or_else(|e| panic!("{e}"));
        let (errors, freedom) = film
            .standard_errors()
            .unwrap_or_else(|| panic!("four replicates"));
        Self {
            size,
            rgb: film.picture().rgb,
            errors,
            freedom,
        }
    }

    /// The picture, brighter in the middle: within the root of a tenth of each edge.
    fn biased(mut self) -> Self {
        let [width, height] = self.size;
        let inside = |at: u32, of: u32| {
            (f64::from(at) + 0.5 - 0.5 * f64::from(of)).abs() < 0.5 * 0.1_f64.sqrt() * f64::from(of)
        };
        for (i, pixel) in (0..).zip(&mut self.rgb) {
            if inside(i % width, width) && inside(i / width, height) {
                *pixel = pixel.map(|channel| channel * BIAS);
            }
        }
        self
    }

    fn noisy(&self) -> PictureWithErrors<'_> {
        let [width, height] = self.size;
        let standard_errors = Some(self.errors.clone());
        PictureWithErrors {
            width,
            height,
            rgb: &self.rgb,
            standard_errors,
            freedom: f64::from(self.freedom),
        }
    }

    /// Whether both pictures differ beyond noise, at each level.
    fn differs(&self, other: &Self) -> [bool; LEVELS.len()] {
        let judged = |level| {
            test_against_noise(&self.noisy(), &other.noisy(), level)
                .unwrap_or_else(|e| panic!("{e}"))
        };
        LEVELS.map(|level| judged(level).beyond > 0)
    }
}

/// Number of pairs with an alarm at each level.
fn alarms(pairs: u64, differ: impl Fn(u64) -> [bool; LEVELS.len()] + Sync) -> [u64; LEVELS.len()] {
    let add = |a: [u64; 2], b: [u64; 2]| [a[0] + b[0], a[1] + b[1]];
    (0..pairs)
        .into_par_iter()
        .map(|pair| differ(pair).map(u64::from))
        .reduce(Default::default, add)
}

fn main() {
    // Cargo adds a flag.
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with('-'))
        .collect();
    let pairs = words
        .first()
        .and_then(|word| word.parse().ok())
        .unwrap_or(1000);
    let chosen = |name: &&str| words.len() < 2 || words[1..].iter().any(|word| word == name);
    println!(
        "{:12} {:>6} {:>8} {:>8} {:>22}",
        "scene", "pairs", "at 0.05", "at 0.01", "biased, at 0.05, 0.01"
    );
    for name in SCENES.into_iter().filter(chosen) {
        let loaded = load(&Input::Preset(name.to_owned()), &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{e}"));
        let scene = &loaded.scene;
        let [often, rarely] = alarms(pairs, |pair| {
            NoiseSide::render(scene, SMALL, 2 * pair).differs(&NoiseSide::render(
                scene,
                SMALL,
                2 * pair + 1,
            ))
        });
        let found = alarms(BIASED_PAIRS, |pair| {
            NoiseSide::render(scene, LARGE, 2 * pair)
                .biased()
                .differs(&NoiseSide::render(scene, LARGE, 2 * pair + 1))
        });
        println!(
            "{name:12} {pairs:>6} {often:>8} {rarely:>8} {:>22}",
            format!("{}, {} of {BIASED_PAIRS}", found[0], found[1])
        );
    }
}
