//! Calibration of error estimates for whole pictures: how often the interval of the root relMSE
//! contains the true error, scene by scene, and how often the interval is flagged as meaningless;
//! and how often the errors of single pixels hold. Scenes are presets, two hard scenes, and those
//! of `benches/calibration/`. docs/accuracy-reference.md quotes the table.
//!
//! `cargo bench --bench calibration -- 1000` takes 1000 renders of each scene, which takes an hour;
//! the default is 100. The truth is the mean of all renders except the one judged. `cargo bench
//! --bench calibration -- 1000 max-error` judges pictures with a target error instead: how often
//! they reach it, and their cost compared with an oracle that knows the sufficient uniform number
//! of samples. Further words select scenes by name. `films=FOLDER` stores the renders of the first
//! mode in a folder and reuses them, so that another evaluation takes seconds.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/judged.rs"]
mod judged;
#[path = "support/turns.rs"]
#[expect(dead_code, reason = "nothing is timed here")]
mod turns;

use std::path::{Path, PathBuf};

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use raywright::core::display::Display;
use raywright::core::film::{Film, Uncertainty};
use raywright::core::metrics::student_factor_95;
use raywright::core::scene::Integrator;
use raywright::core::settings::{Aov, Sampling};
use raywright::core::{ReadyScene, Scene, Settings, prepare};
use raywright::io::Limits;
use raywright::io::output::{PictureMetadata, StoredFilm, read_film, write_film};

/// Scenes and target errors for adaptive sampling: sixteen samples, the minimum, do not suffice for
/// any of them.
const ASKED: [(&str, f64); 15] = [
    ("cornell", 0.08),
    ("glossy-box", 0.12),
    ("many-lights", 0.5),
    ("product", 0.08),
    ("absorption", 0.08),
    ("layers", 0.12),
    ("depth-of-field", 0.15),
    ("caustic", 0.15),
    ("many-lamps", 0.3),
    ("lights-behind-a-lens", 0.45),
    ("window", 0.3),
    ("lamp-pattern", 0.2),
    ("texlamp", 0.15),
    ("louvre", 0.12),
    ("door-ajar", 0.2),
];

/// Samples per pixel of pictures whose intervals are judged: fewer samples have too few replicates
/// for an interval.
const SAMPLES: u32 = 64;

/// One render: its colours, the standard errors of green, the estimated error, and the mean number
/// of samples per pixel.
struct CalibrationRender {
    colours: Vec<[f32; 3]>,
    errors: Vec<f32>,
    claimed: Uncertainty,
    samples: f64,
}

impl CalibrationRender {
    /// Mean of all colours and channels.
    fn mean(&self) -> f64 {
        self.colours
            .iter()
            .flatten()
            .map(|&c| f64::from(c))
            .sum::<f64>()
            / (3.0 * self.colours.len() as f64)
    }
}

impl From<Film> for CalibrationRender {
    fn from(film: Film) -> Self {
        let picture = film.picture();
        let errors = picture
            .layer("stderr.G")
            .unwrap_or_else(|| panic!("it was asked for"))
            .samples
            .clone();
        let (colours, claimed) = (
            picture.rgb,
            film.estimate_uncertainty()
                .unwrap_or_else(|| panic!("two replicates")),
        );
        let samples = film.counters().samples as f64 / colours.len() as f64;
        Self {
            colours,
            errors,
            claimed,
            samples,
        }
    }
}

fn film(scene: &Scene, size: [u32; 2], samples: u32, max_error: Option<f64>, seed: u64) -> Film {
    let settings = Settings {
        size,
        sampling: Sampling::General(samples),
        integrator: Integrator::Path,
        max_error,
        seed,
        aovs: vec![Aov::StandardError],
        ..Settings::from_scene(scene)
    };
    let ready: ReadyScene = prepare(scene, &settings, &()).unwrap_or_else(|e| panic!("{e}"));
    let mut film: Film = ready.new_film("");
    let whole = film.full_part();
    ready
        .render_part(&mut film, &whole, &())
        .unwrap_or_else(|e| panic!("{e}"));
    film
}

/// Renders with consecutive seeds from `first` on, several in parallel.
fn all_of(renders: u64, first: u64, film: impl Fn(u64) -> Film + Sync) -> Vec<CalibrationRender> {
    (first..first + renders)
        .into_par_iter()
        .map(|seed| film(seed).into())
        .collect()
}

/// A film from a file; if the file is missing, from `render`, and then stored in the file.
fn kept(file: &Path, render: impl FnOnce() -> Film) -> Film {
    if let Ok(kept_film) = read_film(file, &Limits::default()) {
        return kept_film.film;
    }
    let mut kept_film = StoredFilm {
        film: render(),
        metadata: PictureMetadata::default(),
        display: Display::default(),
    };
    write_film(file, &mut kept_film).unwrap_or_else(|e| panic!("{e}"));
    kept_film.film
}

/// Root relMSE of a render relative to the truth.
fn error(render: &CalibrationRender, truth: impl Fn(usize, usize) -> f64) -> f64 {
    let of = |(pixel, colour): (usize, &[f32; 3])| {
        (0..3)
            .map(|i| {
                let truth = truth(pixel, i);
                (f64::from(colour[i]) - truth).powi(2) / (truth * truth + 0.01)
            })
            .sum::<f64>()
    };
    (render.colours.iter().enumerate().map(of).sum::<f64>() / (3.0 * render.colours.len() as f64))
        .sqrt()
}

/// Sums of the colours of renders.
fn sum_of(renders: &[CalibrationRender]) -> Vec<[f64; 3]> {
    let mut sum = vec![[0.0; 3]; renders[0].colours.len()];
    for colours in renders.iter().map(|render| &render.colours) {
        sum.iter_mut()
            .zip(colours)
            .for_each(|(sum, c)| (0..3).for_each(|i| sum[i] += f64::from(c[i])));
    }
    sum
}

/// Fraction of pixels whose error, times Student's factor for its replicates, covers the green mean
/// of the other renders, including the variance of that mean; and fraction of pixels with an error
/// estimate of zero. Deterministic pixels are not counted.
fn pixels(renders: &[CalibrationRender], sum: &[[f64; 3]]) -> [String; 2] {
    let n = renders.len() as f64;
    let (mut counted, mut held, mut none) = (0, 0, 0);
    for (pixel, sum) in sum.iter().enumerate() {
        let green = |render: &CalibrationRender| f64::from(render.colours[pixel][1]);
        let mean = sum[1] / n;
        let variance = renders
            .iter()
            .map(|render| (green(render) - mean).powi(2))
            .sum::<f64>()
            / (n - 1.0);
        if renders
            .iter()
            .all(|render| render.colours[pixel][1] == renders[0].colours[pixel][1])
        {
            continue;
        }
        for render in renders {
            let off = (green(render) - mean) * n / (n - 1.0);
            let error = f64::from(render.errors[pixel]);
            let width = student_factor_95(render.claimed.replicates - 1)
                * (error * error + variance / (n - 1.0)).sqrt();
            counted += 1;
            held += usize::from(off.abs() <= width);
            none += usize::from(error == 0.0);
        }
    }
    [percent(held, counted), percent(none, counted)]
}

fn percent(count: usize, of: usize) -> String {
    if of == 0 {
        "-".to_owned()
    } else {
        format!("{:.1} %", 100.0 * count as f64 / of as f64)
    }
}

fn mean(of: impl Iterator<Item = f64> + Clone) -> f64 {
    of.clone().sum::<f64>() / of.count() as f64
}

fn root(of: f64) -> f64 {
    of.sqrt()
}

/// Judges the coverage of intervals.
fn intervals(renders: u64, films: Option<&Path>) {
    println!("{renders} renders of 60 x 40 pixels each\n");
    println!(
        "| scene | samples | root relMSE | claimed | interval holds, of all | flagged | interval holds, of the others | \
         beyond twice, of the others | pixels that carry it | of pixels, interval holds | without width |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for (name, scene) in judged::scenes() {
        let render = |seed| film(&scene, [60, 40], SAMPLES, None, seed);
        let all = all_of(renders, 0, |seed| match films {
            Some(folder) => kept(&folder.join(format!("{name}-{seed}.film")), || render(seed)),
            None => render(seed),
        });
        let (sum, n) = (sum_of(&all), renders as f64);
        // The error of the other renders' mean adds one part in n.
        let of = |render: &CalibrationRender| {
            let others = |pixel: usize, i: usize| {
                (sum[pixel][i] - f64::from(render.colours[pixel][i])) / (n - 1.0)
            };
            error(render, others) * root((n - 1.0) / n)
        };
        let errors: Vec<f64> = all.iter().map(of).collect();
        let judged: Vec<(&CalibrationRender, f64)> =
            all.iter().zip(errors.iter().copied()).collect();
        let sure: Vec<(&CalibrationRender, f64)> = judged
            .iter()
            .copied()
            .filter(|(render, _)| render.claimed.doubt.is_none())
            .collect();
        let holds = |(render, error): &&(&CalibrationRender, f64)| {
            let estimate = render.claimed.root_relmse;
            (estimate.low..=estimate.high).contains(error)
        };
        let beyond = |(render, error): &&(&CalibrationRender, f64)| {
            !(0.5..=2.0).contains(&(error / render.claimed.root_relmse.value))
        };
        let mut pixels: Vec<f64> = all
            .iter()
            .map(|render| render.claimed.root_relmse.carriers)
            .collect();
        pixels.sort_by(f64::total_cmp);
        let [held, none] = self::pixels(&all, &sum);
        println!(
            "| {name} | {SAMPLES} | {:.4} | {:.4} | {} | {} | {} | {} | {:.0} ({:.0} to {:.0}) | {held} | {none} |",
            root(mean(errors.iter().map(|e| e * e))),
            root(mean(
                all.iter()
                    .map(|render| render.claimed.root_relmse.value.powi(2))
            )),
            percent(judged.iter().filter(holds).count(), judged.len()),
            percent(all.len() - sure.len(), all.len()),
            percent(sure.iter().filter(holds).count(), sure.len()),
            percent(sure.iter().filter(beyond).count(), sure.len()),
            pixels[pixels.len() / 2],
            pixels[pixels.len() / 20],
            pixels[pixels.len() - 1 - pixels.len() / 20],
        );
    }
}

/// Uniform number of samples per pixel at which renders of a scene reach an error on average,
/// interpolated between the two nearest powers of two.
fn oracle(scene: &Scene, size: [u32; 2], truth: &[[f64; 3]], requested: f64) -> f64 {
    let (mut before, mut samples) = (f64::INFINITY, 8_u32);
    loop {
        let all = all_of(20, 1_000_000, |seed| film(scene, size, samples, None, seed));
        let now = mean(
            all.iter()
                .map(|render| error(render, |pixel, i| truth[pixel][i])),
        );
        if now <= requested || samples >= 1 << 16 {
            let share = if before.is_finite() {
                (before / requested).ln() / (before / now).ln()
            } else {
                1.0
            };
            return f64::from(samples) * (share - 1.0).exp2();
        }
        (before, samples) = (now, 2 * samples);
    }
}

/// Judges pictures with a target error, and their cost.
fn targets(renders: u64) {
    const SIZE: [u32; 2] = [128, 96];
    println!(
        "{renders} renders of {} x {} pixels each\n",
        SIZE[0], SIZE[1]
    );
    println!(
        "| scene | asked | reached | met | samples | oracle's, the same everywhere | ratio | bias of the mean in its standard errors |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (name, scene) in judged::scenes() {
        let Some(&(_, requested)) = ASKED.iter().find(|(of, _)| *of == name) else {
            continue;
        };
        let truths = all_of(16, 2_000_000, |seed| film(&scene, SIZE, 256, None, seed));
        let truth: Vec<[f64; 3]> = sum_of(&truths)
            .iter()
            .map(|sum| sum.map(|s| s / truths.len() as f64))
            .collect();
        let needed = oracle(&scene, SIZE, &truth, requested);
        let all = all_of(renders, 0, |seed| {
            film(&scene, SIZE, 4096, Some(requested), seed)
        });
        let errors: Vec<f64> = all
            .iter()
            .map(|render| error(render, |pixel, i| truth[pixel][i]))
            .collect();
        let samples = mean(all.iter().map(|render| render.samples));
        let ([brightness, of_truth], [found, spread]) = (brightness(&truths), brightness(&all));
        // Standard error of the renders' mean, and of the truth.
        let unsure = root(1.0 / renders as f64 + (of_truth / spread).powi(2) / truths.len() as f64);
        println!(
            "| {name} | {requested} | {:.4} | {} | {samples:.0} | {needed:.0} | {:.2} | {:.2} ± {unsure:.2} |",
            root(mean(errors.iter().map(|e| e * e))),
            percent(
                errors.iter().filter(|&&error| error <= requested).count(),
                errors.len()
            ),
            samples / needed,
            (found - brightness) / spread,
        );
    }
}

/// Mean brightness of renders, and its standard deviation.
fn brightness(renders: &[CalibrationRender]) -> [f64; 2] {
    let of = mean(renders.iter().map(CalibrationRender::mean));
    [
        of,
        root(mean(
            renders.iter().map(|render| (render.mean() - of).powi(2)),
        )),
    ]
}

fn main() {
    if !turns::measuring() {
        return;
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let renders = arguments
        .iter()
        .find_map(|argument| argument.parse().ok())
        .unwrap_or(100_u64);
    let films = arguments
        .iter()
        .find_map(|argument| argument.strip_prefix("films="))
        .map(PathBuf::from);
    match arguments.iter().any(|argument| argument == "max-error") {
        true => targets(renders),
        false => intervals(renders, films.as_deref()),
    }
}
