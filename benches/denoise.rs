//! Benefit of denoising, scene by scene: the reduction of squared error, how often the interval of
//! a denoised picture contains its error, how much error was added where the picture became worse,
//! and the time. docs/accuracy-reference.md quotes the table.
//!
//! `cargo bench --bench denoise -- 100` takes 100 renders of each scene with 16 and 64 samples; the
//! default is 10, also with 256 samples. `size=96x64` sets their size, and further words select
//! scenes by name or add model files. The truth consists of two renders of `truth=2048` samples
//! each: the product of a picture's differences from both is free of their noise. `cargo bench
//! --bench denoise -- time` measures the time for 1280 x 720 pixels.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/judged.rs"]
mod judged;
#[path = "support/scenes.rs"]
#[expect(dead_code, reason = "scenes get ready otherwise here")]
mod scenes;
#[path = "support/turns.rs"]
mod turns;

use std::path::Path;

use raywright::core::denoise::{DenoiseOutput, denoise};
use raywright::core::film::Film;
use raywright::core::picture::Picture;
use raywright::core::scene::Integrator;
use raywright::core::settings::Sampling;
use raywright::core::{Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

/// Scenes for which the denoiser's parameters were tuned.
const TUNED: [&str; 7] = [
    "cornell",
    "product",
    "many-lights",
    "glossy-box",
    "layers",
    "rough-refraction",
    "depth-of-field",
];

/// Presets in addition to the calibration scenes.
const FURTHER: [&str; 2] = ["rough-refraction", "instances"];

/// Side length in pixels of the blocks in which errors are compared.
const BLOCK: usize = 8;

fn film(scene: &Scene, size: [u32; 2], samples: u32, seed: u64, denoise: bool) -> Film {
    let sampling = Sampling::General(samples);
    let settings = Settings {
        size,
        sampling,
        integrator: Integrator::Path,
        seed,
        denoise,
        ..Settings::from_scene(scene)
    };
    let ready = prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
    let mut film = ready.new_film("");
    let whole = film.full_part();
    ready
        .render_part(&mut film, &whole, &())
        .unwrap_or_else(|e| panic!("{e}"));
    film
}

/// Squared errors of a picture relative to the truth, pixel by pixel, unbiased.
fn errors(picture: &Picture, truth: &[Picture; 2]) -> Vec<f64> {
    let of = |(pixel, colour): (usize, &[f32; 3])| {
        let of = |i: usize| {
            let [a, b] = truth.each_ref().map(|truth| f64::from(truth.rgb[pixel][i]));
            let middle = f64::midpoint(a, b).max(0.0);
            (f64::from(colour[i]) - a) * (f64::from(colour[i]) - b) / (middle * middle + 0.01)
        };
        (0..3).map(of).sum::<f64>() / 3.0
    };
    picture.rgb.iter().enumerate().map(of).collect()
}

fn mean(of: &[f64]) -> f64 {
    of.iter().sum::<f64>() / of.len() as f64
}

/// Sums over blocks.
fn blocks(errors: &[f64], width: usize) -> Vec<f64> {
    let columns = width.div_ceil(BLOCK);
    let mut sums = vec![0.0; columns * (errors.len() / width).div_ceil(BLOCK)];
    for (pixel, error) in errors.iter().enumerate() {
        sums[pixel / width / BLOCK * columns + pixel % width / BLOCK] += error;
    }
    sums
}

/// Results of one scene's renders with a given number of samples.
#[derive(Default)]
struct DenoiseRow {
    before: Vec<f64>,
    after: Vec<f64>,
    claimed: Vec<f64>,
    unknown: usize,
    held: usize,
    brightened: Vec<f64>,
    /// Sums over all renders, block by block.
    worse: [Vec<f64>; 2],
}

impl DenoiseRow {
    fn add(&mut self, film: &Film, truth: &[Picture; 2]) {
        let DenoiseOutput {
            picture,
            error,
            light_change: brightened,
            ..
        } = denoise(film, &()).unwrap_or_else(|e| panic!("{e}"));
        let both = [errors(&film.picture(), truth), errors(&picture, truth)];
        let width = film.size()[0] as usize;
        for (sum, errors) in self.worse.iter_mut().zip(&both) {
            let of = blocks(errors, width);
            sum.resize(of.len(), 0.0);
            sum.iter_mut().zip(of).for_each(|(sum, of)| *sum += of);
        }
        let [before, after] = both.map(|errors| mean(&errors));
        let estimate = error.root_relmse;
        self.unknown += usize::from(error.doubt.is_some());
        self.held += usize::from(
            error.doubt.is_none()
                && (estimate.low..=estimate.high).contains(&after.max(0.0).sqrt()),
        );
        self.before.push(before);
        self.after.push(after);
        self.claimed.push(estimate.value * estimate.value);
        self.brightened.push(brightened);
    }

    fn gain(&self) -> f64 {
        mean(&self.before) / mean(&self.after)
    }

    fn print(&self, name: &str, samples: u32) {
        let [before, after] = &self.worse;
        let added: f64 = before
            .iter()
            .zip(after)
            .map(|(before, after)| (after - before).max(0.0))
            .sum();
        let (sure, root) = (self.before.len() - self.unknown, |of: &[f64]| {
            mean(of).max(0.0).sqrt()
        });
        let held = if sure > 0 {
            format!("{:.1} %", 100.0 * self.held as f64 / sure as f64)
        } else {
            "-".to_owned()
        };
        println!(
            "| {name} | {samples} | {:.4} | {:.4} | {:.2} | {:.4} | {held} | {:.1} % | {:.1} % | {:+.2} % |",
            root(&self.before),
            root(&self.after),
            self.gain(),
            root(&self.claimed),
            100.0 * self.unknown as f64 / self.before.len() as f64,
            100.0 * added / before.iter().sum::<f64>(),
            100.0 * mean(&self.brightened)
        );
    }
}

/// The scenes to judge: the named ones, or all.
fn all(words: &[String]) -> Vec<(String, Scene)> {
    let file = |word: &String| {
        let loaded = load(&Input::Path(word.into()), &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{e}"));
        let name = Path::new(word)
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        (name, loaded.scene)
    };
    let files: Vec<(String, Scene)> = words
        .iter()
        .filter(|word| Path::new(word).is_file())
        .map(file)
        .collect();
    let further = FURTHER.iter().filter(|name| {
        files.is_empty() && (words.is_empty() || words.iter().any(|word| word == *name))
    });
    let mut all: Vec<(String, Scene)> = further
        .filter_map(|&name| Some((name.to_owned(), scenes::preset(name)?)))
        .collect();
    if files.is_empty()
        && (words.is_empty() || words.iter().any(|word| !FURTHER.contains(&word.as_str())))
    {
        all.extend(judged::scenes());
    }
    all.extend(files);
    all
}

fn compare(renders: u64, size: [u32; 2], of_truth: u32, words: &[String]) {
    let counts: &[u32] = if renders > 10 {
        &[16, 64]
    } else {
        &[16, 64, 256]
    };
    println!(
        "{renders} renders of {} x {} pixels each; * were tuned to\n",
        size[0], size[1]
    );
    println!(
        "| scene | samples | root relMSE | denoised | less by | claimed | interval holds | not known | added by blocks that got worse | light |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut gains = vec![[Vec::new(), Vec::new()]; counts.len()];
    for (name, scene) in all(words) {
        let truth =
            [1, 2].map(|seed| film(&scene, size, of_truth, u64::MAX - seed, false).picture());
        let tuned = TUNED.contains(&name.as_str());
        let name = format!("{name}{}", if tuned { " *" } else { "" });
        for (&samples, gains) in counts.iter().zip(&mut gains) {
            let mut row = DenoiseRow::default();
            (0..renders).for_each(|seed| row.add(&film(&scene, size, samples, seed, true), &truth));
            row.print(&name, samples);
            gains[usize::from(tuned)].push(row.gain());
        }
    }
    let middle = |of: &[f64]| {
        (of.iter().map(|gain| gain.max(1e-3).ln()).sum::<f64>() / of.len() as f64).exp()
    };
    for (samples, [others, tuned]) in counts.iter().zip(gains) {
        let all = [&others[..], &tuned].concat();
        println!(
            "\n{samples} samples: less by {:.2} on {} scenes, {:.2} on those not tuned to",
            middle(&all),
            all.len(),
            middle(&others)
        );
    }
}

/// Time for 1280 x 720 pixels: for a scene whose only directly visible emitters are lamps, and for
/// a scene with a noisy sky everywhere.
fn time() {
    for name in ["cornell", "depth-of-field"] {
        let Some(scene) = scenes::preset(name) else {
            continue;
        };
        let film = film(&scene, [1280, 720], 8, 0, true);
        let work = || assert!(denoise(&film, &()).is_ok());
        println!(
            "{}",
            turns::interleaved(
                &format!("{name}, 1280 x 720"),
                5,
                &[turns::Contestant {
                    name: "denoise",
                    work: &work
                }]
            )
        );
    }
}

fn main() {
    if !turns::measuring() {
        return;
    }
    let mut words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with("--"))
        .collect();
    if words.iter().any(|word| word == "time") {
        return time();
    }
    let mut take = |prefix: &str| {
        let place = words.iter().position(|word| word.starts_with(prefix))?;
        Some(words.remove(place)[prefix.len()..].to_owned())
    };
    let of_truth = take("truth=")
        .and_then(|word| word.parse().ok())
        .unwrap_or(2048);
    let size = take("size=").and_then(|word| {
        word.split_once('x')
            .and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]))
    });
    let renders = words
        .iter()
        .position(|word| word.parse::<u64>().is_ok())
        .map(|place| words.remove(place));
    let renders = renders.and_then(|word| word.parse().ok()).unwrap_or(10);
    compare(renders, size.unwrap_or([96, 64]), of_truth, &words);
}
