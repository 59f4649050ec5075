//! `compare`: measures of the difference of two pictures, judged by thresholds or by the pictures'
//! noise, with a picture of the differences.

mod display;
mod noise;

use std::path::{Path, PathBuf};

use raywright_core::display::Display;
use raywright_core::metrics::{
    ComparedPicture, Comparison, CoverageErrors, NoiseVerdict, PictureErrors, compare, heat_map,
};
use raywright_core::picture::{DataWindow, Encoding, Picture};
use raywright_io::output::{Metadata, PictureFormat, StoredPicture, write_png};
use raywright_io::{Error, InputFiles};
use serde::Serialize;

use self::display::{ChosenDisplay, DisplayReport};
pub use self::noise::JudgedPicture;
use crate::args::{CompareArgs, DisplayArgs, Exposure};
use crate::console;
use crate::failure::{Exit, Failure};
use crate::table::{format_short, lay_out};
use crate::targets::OutputFiles;
use crate::{origin, plan};

/// Runs `compare`: reads two pictures, prints the measures of their difference, and fails if a
/// measure exceeds a threshold.
pub fn run(args: &CompareArgs) -> Result<(), Failure> {
    if let Some(path) = &args.diff {
        check_difference_target(path, args)?;
    }
    let pair = [noise::read(&args.picture)?, noise::read(&args.reference)?];
    let judgement = Judgement::of(args, &pair)?;
    if let Some(path) = &args.diff {
        write_difference(path, &judgement.comparison)?;
    }
    console::print(if args.json {
        judgement.json(&pair)
    } else {
        judgement.text(args, &pair)
    })?;
    match judgement.beyond.as_slice() {
        [] => Ok(()),
        beyond => Err(Failure::new(
            Exit::Failed,
            format_args!(
                "{} differs from {}: {}",
                args.picture.display(),
                args.reference.display(),
                beyond.join("; ")
            ),
        )),
    }
}

/// Returns the JSON of `compare` for two pictures in memory with these names. A measure beyond a
/// threshold is listed in the JSON and is no failure.
pub fn embedded(
    args: &CompareArgs,
    [picture, reference]: [PathBuf; 2],
    pair: &[JudgedPicture; 2],
) -> Result<String, Failure> {
    if args.diff.is_some() {
        return Err(Error::usage(
            "--diff writes a picture, and the comparison is handed over here",
        )
        .into());
    }
    let args = CompareArgs {
        picture,
        reference,
        ..args.clone()
    };
    Ok(Judgement::of(&args, pair)?.json(pair))
}

/// Measures of the difference of two pictures, and their judgement.
struct Judgement {
    comparison: Comparison,
    shown: Option<ChosenDisplay>,
    verdict: Option<NoiseVerdict>,
    /// Descriptions of the measures that exceed their thresholds.
    beyond: Vec<String>,
}

impl Judgement {
    fn of(args: &CompareArgs, pair: &[JudgedPicture; 2]) -> Result<Self, Failure> {
        let ([picture, reference], names) =
            (pair, [args.picture.as_path(), args.reference.as_path()]);
        refuse_other_places(
            &picture.stored_picture.picture,
            &reference.stored_picture.picture,
            names,
        )?;
        let exposure = args.exposure.map(Exposure::Stops);
        let flags = DisplayArgs {
            exposure,
            tonemap: args.tonemap,
            gamma: args.gamma,
            quality: None,
        };
        let all_given = args.exposure.is_some() && args.tonemap.is_some() && args.gamma.is_some();
        let shown = ChosenDisplay::of(
            (|own_display| plan::shown(&flags, own_display), all_given),
            picture,
            reference,
        );
        let display = shown.map(|shown| shown.display).unwrap_or_default();
        let verdict = args
            .noise
            .then(|| noise::judge(picture, reference, names, args.level))
            .transpose()?;
        let comparison = compare(
            side(&picture.stored_picture),
            side(&reference.stored_picture),
            display,
        )
        .map_err(|cause| {
            Error::input(
                format_args!("{} and {}", names[0].display(), names[1].display()),
                cause,
            )
        })?;
        let mut beyond = beyond(args, &comparison);
        beyond.extend(
            verdict
                .as_ref()
                .filter(|verdict| verdict.beyond > 0)
                .map(|verdict| format!("noise: {}", noise::described(verdict))),
        );
        Ok(Self {
            comparison,
            shown,
            verdict,
            beyond,
        })
    }

    fn json(&self, pair: &[JudgedPicture; 2]) -> String {
        console::json(&ComparisonReport {
            format: FORMAT,
            comparison: &self.comparison,
            display: self.shown.map(|shown| shown.report()),
            windows: windows(pair),
            noise: self.verdict.as_ref(),
            beyond_thresholds: &self.beyond,
        })
    }

    fn text(&self, args: &CompareArgs, pair: &[JudgedPicture; 2]) -> String {
        let names = [&args.picture, &args.reference].map(|name| name.display().to_string());
        let shown = self
            .shown
            .map(|shown| shown.described(names.each_ref().map(String::as_str)));
        let parts = [
            place(windows(pair)),
            shown,
            self.verdict.as_ref().map(noise::described),
        ];
        text(&self.comparison, parts.map(Option::unwrap_or_default))
    }
}

fn windows(pair: &[JudgedPicture; 2]) -> [Option<DataWindow>; 2] {
    pair.each_ref()
        .map(|judged| judged.stored_picture.picture.window)
}

fn check_difference_target(path: &Path, args: &CompareArgs) -> Result<(), Failure> {
    if PictureFormat::from_path(path)? != PictureFormat::Png {
        return Err(Error::usage(format_args!(
            "{}: the difference picture is a .png",
            path.display()
        ))
        .into());
    }
    let (mut outputs, mut inputs) = (OutputFiles::default(), InputFiles::default());
    outputs.add(path, "--diff")?;
    inputs.read(&args.picture);
    inputs.read(&args.reference);
    outputs.keep_clear_of(&inputs)
}

/// Refuses crops with different data windows, whose pixels do not correspond.
fn refuse_other_places(
    picture: &Picture,
    reference: &Picture,
    names: [&Path; 2],
) -> Result<(), Failure> {
    let (Some(one), Some(other)) = (picture.window, reference.window) else {
        return Ok(());
    };
    if one == other {
        return Ok(());
    }
    let [one, other] = [one, other].map(window_text);
    let names = names.map(|name| name.display().to_string());
    let error = Error::input(
        names.join(" and "),
        format_args!("the pictures are parts of other places: {one} and {other}"),
    );
    Err(error.with_hint("compare pictures of one --crop").into())
}

/// Describes the data windows of two pictures; `None` if neither picture has a window.
fn place(windows: [Option<DataWindow>; 2]) -> Option<String> {
    match windows {
        [None, None] => None,
        [Some(one), Some(_)] => Some(window_text(one)),
        [Some(one), None] => Some(format!(
            "{} against one that says no place",
            window_text(one)
        )),
        [None, Some(other)] => Some(format!(
            "one that says no place against {}",
            window_text(other)
        )),
    }
}

fn window_text(
    DataWindow {
        origin: [x, y],
        full: [width, height],
    }: DataWindow,
) -> String {
    format!("{x}, {y} of {width}x{height}")
}

fn side(stored_picture: &StoredPicture) -> ComparedPicture<'_> {
    ComparedPicture {
        picture: &stored_picture.picture,
        encoding: stored_picture.encoding,
    }
}

/// Writes the picture of `--diff`: the FLIP error of each pixel, from black (alike) to pale yellow
/// (largest difference).
fn write_difference(path: &Path, comparison: &Comparison) -> Result<(), Failure> {
    let picture = heat_map(
        comparison.width,
        comparison.height,
        &comparison.flip_map,
        1.0,
    );
    let metadata = Metadata {
        software: origin::SOFTWARE.to_owned(),
        command: origin::command_line(),
        ..Metadata::default()
    };
    Ok(write_png(path, &picture, Display::PLAIN, &metadata)?)
}

/// Describes the measures of colour and coverage that exceed the given thresholds. NaN exceeds any
/// threshold.
fn beyond(args: &CompareArgs, comparison: &Comparison) -> Vec<String> {
    let PictureErrors {
        non_finite,
        rmse,
        relmse,
        relmse_trimmed,
        psnr,
        ..
    } = comparison.errors;
    let colours = CoverageErrors {
        non_finite,
        rmse,
        relmse,
        relmse_trimmed,
        psnr,
        flip: comparison.flip.mean,
    };
    let of_coverage = comparison
        .coverage_errors
        .iter()
        .flat_map(|coverage| beyond_in(args, "coverage: ", coverage));
    beyond_in(args, "", &colours)
        .into_iter()
        .chain(of_coverage)
        .collect()
}

/// Describes the measures that exceed the given thresholds, for colour or for coverage. `of` is put
/// before the name of each measure.
fn beyond_in(args: &CompareArgs, of: &str, figures: &CoverageErrors) -> Vec<String> {
    let above = [
        ("RMSE", figures.rmse, args.max_rmse),
        ("relMSE", figures.relmse, args.max_relmse),
        (
            "trimmed relMSE",
            figures.relmse_trimmed,
            args.max_relmse_trimmed,
        ),
        ("mean FLIP", figures.flip, args.max_flip),
    ];
    let above = above.into_iter().filter_map(|(name, value, limit)| {
        limit
            .filter(|&limit| value > limit || value.is_nan())
            .map(|limit| format!("{of}{name} {} is above {limit}", format_short(value)))
    });
    let psnr = figures.psnr.unwrap_or(f64::INFINITY);
    let below = args.min_psnr.filter(|&limit| psnr < limit || psnr.is_nan());
    let below =
        below.map(|limit| format!("{of}PSNR {} dB is below {limit} dB", format_short(psnr)));
    let lost = figures.non_finite;
    let lost = (lost > 0 && args.has_threshold())
        .then(|| format!("{of}{lost} pixels are not finite numbers"));
    above.chain(below).chain(lost).collect()
}

/// Version of the layout of [`ComparisonReport`].
const FORMAT: u32 = 1;

#[derive(Serialize)]
struct ComparisonReport<'a> {
    format: u32,
    #[serde(flatten)]
    comparison: &'a Comparison,
    /// Display settings of linear pictures; null if neither picture is linear.
    display: Option<DisplayReport>,
    /// Data window of each picture in a larger picture; null for a whole picture and for a file
    /// without this metadata.
    windows: [Option<DataWindow>; 2],
    /// Result of the test for noise, where `--noise` requests it.
    #[serde(skip_serializing_if = "Option::is_none")]
    noise: Option<&'a NoiseVerdict>,
    /// Descriptions of the measures that exceed their thresholds.
    beyond_thresholds: &'a [String],
}

fn coverage(comparison: &Comparison) -> Option<String> {
    let (largest, errors) = (
        comparison.coverage.filter(|&largest| largest != 0.0)?,
        comparison.coverage_errors?,
    );
    Some(format!(
        "differs by up to {}, RMSE {}, mean FLIP {}",
        format_short(largest),
        format_short(errors.rmse),
        format_short(errors.flip)
    ))
}

fn text(comparison: &Comparison, [place, shown, noise]: [String; 3]) -> String {
    let errors = &comparison.errors;
    let numbers = match comparison.encoding {
        Encoding::Linear => "linear radiance",
        Encoding::Display => "display values 0 to 1",
    };
    let colour = |rgb: [f32; 3]| rgb.map(|v| format_short(f64::from(v))).join(" ");
    let worst = match &errors.worst {
        Some(w) => format!(
            "{}, {}: {} against {}",
            w.x,
            w.y,
            colour(w.picture),
            colour(w.reference)
        ),
        None => String::new(),
    };
    let beyond = comparison.beyond.iter().filter(|beyond| beyond.share > 0.0);
    let beyond = beyond.map(|b| match b.codes {
        0 => format!("{} % of the pixels", format_short(100.0 * b.share)),
        codes => format!(
            "{} % by more than {codes}/255",
            format_short(100.0 * b.share)
        ),
    });
    let beyond: Vec<String> = beyond.collect();
    let rows = [
        (
            "pixels",
            format!("{}x{}, {numbers}", comparison.width, comparison.height),
        ),
        ("place", place),
        ("shown by", shown),
        (
            "identical",
            if comparison.identical {
                "yes, bit for bit"
            } else {
                "no"
            }
            .to_owned(),
        ),
        ("RMSE", format_short(errors.rmse)),
        (
            "relMSE",
            format!(
                "{} ({} without the worst 0.1 %)",
                format_short(errors.relmse),
                format_short(errors.relmse_trimmed)
            ),
        ),
        (
            "PSNR",
            errors.psnr.map_or("infinite".to_owned(), |psnr| {
                format!("{} dB", format_short(psnr))
            }),
        ),
        (
            "FLIP",
            format!(
                "mean {}, largest {}",
                format_short(comparison.flip.mean),
                format_short(comparison.flip.maximum)
            ),
        ),
        ("differ", beyond.join(", ")),
        ("worst", worst),
        ("coverage", coverage(comparison).unwrap_or_default()),
        ("noise", noise),
        (
            "not finite",
            if errors.non_finite == 0 {
                String::new()
            } else {
                format!("{} pixels, left out", errors.non_finite)
            },
        ),
    ];
    let rows: Vec<[String; 2]> = rows
        .into_iter()
        .filter(|(_, text)| !text.is_empty())
        .map(|(name, text)| [name.to_owned(), text])
        .collect();
    lay_out(&rows)
}
