//! Error estimates of noisy and denoised renders, compared with the truth: how often an estimate is
//! missing, and how often existing estimates hold. docs/accuracy-reference.md quotes the table.
//!
//! `cargo bench --bench claims -- 100` takes 100 renders of 48 x 32 pixels, with 16 and with 64
//! samples each. `samples=16,64,256` selects other numbers, and names select scenes among
//! `benches/calibration/` and the presets. The truth is the mean of all renders of a scene except
//! the one judged, weighted by samples, and its own variance is subtracted. `films=FOLDER` stores
//! films in a folder and reuses them, so that another evaluation takes seconds.
#![expect(clippy::print_stdout, reason = "the table is this program's result")]

#[path = "support/judged.rs"]
mod judged;
#[path = "support/turns.rs"]
#[expect(dead_code, reason = "nothing is timed here")]
mod turns;

use std::path::{Path, PathBuf};

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use raywright::core::denoise::denoise;
use raywright::core::display::Display;
use raywright::core::film::{Film, Uncertainty};
use raywright::core::metrics::student_factor_95;
use raywright::core::scene::Integrator;
use raywright::core::settings::Sampling;
use raywright::core::{Scene, Settings, prepare};
use raywright::io::Limits;
use raywright::io::output::{PictureMetadata, StoredFilm, read_film, write_film};

const SIZE: [u32; 2] = [48, 32];

/// One render: the noisy and the denoised picture, the error estimate of each, and the standard
/// errors of the noisy picture's pixels.
struct ClaimRender {
    samples: f64,
    pictures: [Vec<[f32; 3]>; 2],
    claims: [Uncertainty; 2],
    errors: Vec<[f32; 3]>,
}

impl From<Film> for ClaimRender {
    fn from(film: Film) -> Self {
        let denoised = denoise(&film, &()).unwrap_or_else(|e| panic!("{e}"));
        let noisy = film
            .estimate_uncertainty()
            .unwrap_or_else(|| panic!("four replicates"));
        let (errors, _) = film
            .standard_errors()
            .unwrap_or_else(|| panic!("four replicates"));
        let pictures = [film.picture().rgb, denoised.picture.rgb];
        let samples = film.counters().samples as f64 / pictures[0].len() as f64;
        Self {
            samples,
            pictures,
            claims: [noisy, denoised.error],
            errors,
        }
    }
}

fn render(scene: &Scene, samples: u32, seed: u64) -> Film {
    let sampling = Sampling::General(samples);
    let settings = Settings {
        size: SIZE,
        sampling,
        integrator: Integrator::Path,
        seed,
        denoise: true,
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

/// A film from a file; if the file is missing, rendered and then stored in the file.
fn film(file: Option<PathBuf>, scene: &Scene, samples: u32, seed: u64) -> Film {
    let Some(file) = file else {
        return render(scene, samples, seed);
    };
    if let Ok(kept_film) = read_film(&file, &Limits::default()) {
        return kept_film.film;
    }
    let film = render(scene, samples, seed);
    let mut kept_film = StoredFilm {
        film,
        metadata: PictureMetadata::default(),
        display: Display::default(),
    };
    write_film(&file, &mut kept_film).unwrap_or_else(|e| panic!("{e}"));
    kept_film.film
}

/// Pooled statistics of a scene's renders: per pixel and channel the sum of samples, and the
/// variance of one sample.
struct Truth {
    samples: f64,
    sums: Vec<[f64; 3]>,
    variances: Vec<[f64; 3]>,
}

impl Truth {
    fn new(renders: &[ClaimRender]) -> Self {
        let samples = renders.iter().map(|render| render.samples).sum::<f64>();
        let pixels = renders[0].errors.len();
        let each = |of: &dyn Fn(usize, usize) -> f64| -> Vec<[f64; 3]> {
            (0..pixels)
                .map(|pixel| core::array::from_fn(|i| of(pixel, i)))
                .collect()
        };
        let colour =
            |render: &ClaimRender, pixel: usize, i: usize| f64::from(render.pictures[0][pixel][i]);
        let sums = each(&|pixel, i| {
            renders
                .iter()
                .map(|render| render.samples * colour(render, pixel, i))
                .sum()
        });
        let apart = |render: &ClaimRender, pixel: usize, i: usize| {
            colour(render, pixel, i) - sums[pixel][i] / samples
        };
        let variances = each(&|pixel, i| {
            let squares = renders
                .iter()
                .map(|render| render.samples * apart(render, pixel, i).powi(2));
            squares.sum::<f64>() / (renders.len() - 1) as f64
        });
        Self {
            samples,
            sums,
            variances,
        }
    }

    /// The mean of the other renders, and its variance.
    fn without(&self, render: &ClaimRender, pixel: usize, i: usize) -> [f64; 2] {
        let others = self.samples - render.samples;
        let sum = self.sums[pixel][i] - render.samples * f64::from(render.pictures[0][pixel][i]);
        [sum / others, self.variances[pixel][i] / others]
    }

    /// Squared error of one of a render's pictures, relative to the truth.
    fn error(&self, render: &ClaimRender, index: usize) -> f64 {
        let of = |pixel: usize, i: usize| {
            let [truth, variance] = self.without(render, pixel, i);
            ((f64::from(render.pictures[index][pixel][i]) - truth).powi(2) - variance)
                / (truth * truth + 0.01)
        };
        let pixels = self.sums.len();
        (0..pixels)
            .map(|pixel| (0..3).map(|i| of(pixel, i)).sum::<f64>())
            .sum::<f64>()
            / (3 * pixels) as f64
    }

    /// Counts of varying pixels: those whose standard error covers the truth, those with an error
    /// estimate of zero, and all.
    fn pixels(&self, renders: &[&ClaimRender]) -> [usize; 3] {
        let mut counts = [0; 3];
        for render in renders {
            let factor = student_factor_95(render.claims[0].replicates - 1);
            for (pixel, error) in render
                .errors
                .iter()
                .enumerate()
                .filter(|(pixel, _)| self.variances[*pixel][1] > 0.0)
            {
                let [truth, variance] = self.without(render, pixel, 1);
                let width = factor * (f64::from(error[1]).powi(2) + variance).sqrt();
                let holds = (f64::from(render.pictures[0][pixel][1]) - truth).abs() <= width;
                counts[0] += usize::from(holds);
                counts[1] += usize::from(error[1] == 0.0);
                counts[2] += 1;
            }
        }
        counts
    }
}

fn percent(count: usize, of: usize) -> String {
    if of == 0 {
        "-".to_owned()
    } else {
        format!("{:.1} %", 100.0 * count as f64 / of as f64)
    }
}

/// True error, estimated error where known, fraction without an estimate, and fraction of estimates
/// that hold.
fn judge(truth: &Truth, renders: &[&ClaimRender], index: usize) -> String {
    let squares: Vec<f64> = renders
        .iter()
        .map(|render| truth.error(render, index))
        .collect();
    let claims = || {
        renders
            .iter()
            .map(|render| render.claims[index])
            .zip(&squares)
    };
    let known = claims().filter(|(claim, _)| claim.doubt.is_none()).count();
    let holds = |(claim, square): &(Uncertainty, &f64)| {
        claim.doubt.is_none()
            && (claim.root_relmse.low..=claim.root_relmse.high).contains(&square.max(0.0).sqrt())
    };
    let claimed = claims()
        .filter(|(claim, _)| claim.doubt.is_none())
        .map(|(claim, _)| claim.root_relmse.value.powi(2));
    let value = if known == 0 {
        "-".to_owned()
    } else {
        format!("{:.4}", (claimed.sum::<f64>() / known as f64).sqrt())
    };
    let error = (squares.iter().sum::<f64>() / squares.len() as f64)
        .max(0.0)
        .sqrt();
    let flagged = percent(renders.len() - known, renders.len());
    format!(
        "{error:.4} | {value} | {flagged} | {known} | {}",
        percent(claims().filter(holds).count(), known)
    )
}

fn main() {
    if !turns::measuring() {
        return;
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let named = |prefix: &str| {
        arguments
            .iter()
            .find_map(|argument| argument.strip_prefix(prefix))
    };
    let renders = arguments
        .iter()
        .find_map(|argument| argument.parse().ok())
        .unwrap_or(100_u64);
    let counts: Vec<u32> = named("samples=")
        .unwrap_or("16,64")
        .split(',')
        .filter_map(|count| count.parse().ok())
        .collect();
    let folder = named("films=").map(Path::new);
    println!(
        "{renders} renders of {} x {} pixels each\n",
        SIZE[0], SIZE[1]
    );
    println!(
        "| scene | samples | root relMSE | claimed | flagged | known | held | denoised | claimed | not known | known | held | of pixels, held | claim 0 |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (name, scene) in judged::scenes() {
        let file = |samples, seed| {
            folder.map(|folder| folder.join(format!("{name}-{samples}-{seed}.film")))
        };
        let all: Vec<(u32, u64)> = counts
            .iter()
            .flat_map(|&count| (1..=renders).map(move |seed| (count, seed)))
            .collect();
        let all: Vec<ClaimRender> = all
            .into_par_iter()
            .map(|(samples, seed)| film(file(samples, seed), &scene, samples, seed).into())
            .collect();
        let truth = Truth::new(&all);
        for (of_count, samples) in all.chunks(renders as usize).zip(&counts) {
            let of_count: Vec<&ClaimRender> = of_count.iter().collect();
            let [held, none, varying] = truth.pixels(&of_count);
            let [noisy, denoised] = [0, 1].map(|index| judge(&truth, &of_count, index));
            println!(
                "| {name} | {samples} | {noisy} | {denoised} | {} | {} |",
                percent(held, varying),
                percent(none, varying)
            );
        }
    }
}
