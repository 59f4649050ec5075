//! `compare`: measures of the difference of two pictures, judged by thresholds or by the pictures'
//! noise, with a picture of the differences.

mod noise;

use std::path::{Path, PathBuf};

use raywright_core::display::Display;
use raywright_core::metrics::{
    ComparedPicture, Comparison, CoverageErrors, NoiseTestResult, PictureErrors, WorstPixel,
    compare, heat_map,
};
use raywright_core::picture::{DataWindow, Encoding};
use raywright_io::output::write_png;
use raywright_io::report::format_four_digits;
use raywright_io::{Error, InputFiles};
use serde::Serialize;

use crate::args::{CompareArgs, ThresholdArgs};
use crate::failure::{Exit, Failure};
use crate::session::Session;
use crate::table::format_rows;
use crate::{console, origin};
pub use noise::ComparisonPicture;

/// Runs `compare`: reads two pictures, prints the measures of their difference, and fails if a
/// measure exceeds a threshold.
pub fn run(mut session: Session, args: &CompareArgs) -> Result<(), Failure> {
    let mut inputs = InputFiles::default();
    inputs.record_read(&args.picture);
    inputs.record_read(&args.reference);
    if let Some(path) = &args.diff {
        let kind = ("png", "--diff writes a PNG file");
        session.outputs.add_output_of_type(path, "--diff", kind)?;
        session.outputs.check_against_inputs(&inputs)?;
    }
    let pair = [
        ComparisonPicture::read(&args.picture)?,
        ComparisonPicture::read(&args.reference)?,
    ];
    let report = ComparisonReport::new(args, &pair)?;
    session.end_early_stage();
    if let Some(path) = &args.diff {
        write_difference_picture(path, &report.comparison)?;
    }
    console::print_report(args.json, &report, || report.format_table(args))?;
    match report.beyond_thresholds.as_slice() {
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
pub fn run_embedded(
    args: &CompareArgs,
    [picture, reference]: [PathBuf; 2],
    pair: &[ComparisonPicture; 2],
) -> Result<String, Failure> {
    if args.diff.is_some() {
        return Err(Error::invalid_usage(
            "--diff cannot be used here, because the call returns the comparison and writes no file",
        )
        .into());
    }
    let args = CompareArgs {
        picture,
        reference,
        ..args.clone()
    };
    Ok(console::format_json(&ComparisonReport::new(&args, pair)?))
}

/// Version of the layout of [`ComparisonReport`].
const FORMAT: u32 = 1;

/// Measures of the difference of two pictures, and their judgement, as the JSON of `--json`.
#[derive(Serialize)]
struct ComparisonReport {
    format: u32,
    #[serde(flatten)]
    comparison: Comparison,
    /// Display settings of linear pictures; null if neither picture is linear.
    display: Option<DisplayReport>,
    /// Data window of each picture in a larger picture; null for a whole picture and for a file
    /// without this metadata.
    windows: [Option<DataWindow>; 2],
    /// Result of the test for noise, where `--noise` requests it.
    #[serde(skip_serializing_if = "Option::is_none")]
    noise: Option<NoiseTestResult>,
    /// Descriptions of the measures that exceed their thresholds.
    beyond_thresholds: Vec<String>,
}

impl ComparisonReport {
    fn new(args: &CompareArgs, pair: &[ComparisonPicture; 2]) -> Result<Self, Failure> {
        let paths = [args.picture.as_path(), args.reference.as_path()];
        let names = format!("{} and {}", paths[0].display(), paths[1].display());
        let windows = pair
            .each_ref()
            .map(|judged| judged.stored_picture.picture.window);
        refuse_different_windows(windows, &names)?;
        let chosen = choose_display(args, pair);
        let display = chosen.map(|(display, _)| display).unwrap_or_default();
        let noise = args
            .noise
            .then(|| noise::test_against_noise(pair, paths, args.level))
            .transpose()?;
        let [picture, reference] = pair.each_ref().map(|judged| ComparedPicture {
            picture: &judged.stored_picture.picture,
            encoding: judged.stored_picture.encoding,
        });
        let comparison = compare(picture, reference, display)
            .map_err(|cause| Error::invalid_input(names, cause))?;
        let mut beyond_thresholds = list_exceeded_thresholds(&args.thresholds, &comparison);
        let differing = noise.as_ref().filter(|verdict| verdict.beyond > 0);
        beyond_thresholds
            .extend(differing.map(|test| format!("noise: {}", noise::describe_noise_test(test))));
        Ok(Self {
            format: FORMAT,
            comparison,
            display: chosen.map(DisplayReport::from),
            windows,
            noise,
            beyond_thresholds,
        })
    }

    /// Formats the table of a comparison. Rows without text are left out.
    fn format_table(&self, args: &CompareArgs) -> String {
        let comparison = &self.comparison;
        let errors = &comparison.errors;
        let shown = self.display.as_ref().map(|shown| shown.describe(args));
        let noise = self.noise.as_ref().map(noise::describe_noise_test);
        let identical = if comparison.identical {
            "yes, bit for bit"
        } else {
            "no"
        };
        let rows = [
            ("pixels", describe_pixels(comparison)),
            (
                "place",
                describe_data_windows(self.windows).unwrap_or_default(),
            ),
            ("shown by", shown.unwrap_or_default()),
            ("identical", identical.to_owned()),
            ("RMSE", format_four_digits(errors.rmse)),
            (
                "relMSE",
                format!(
                    "{} ({} without the worst 0.1 % of the pixels)",
                    format_four_digits(errors.relmse),
                    format_four_digits(errors.relmse_trimmed)
                ),
            ),
            ("PSNR", format_psnr(errors.psnr)),
            (
                "FLIP",
                format!(
                    "mean {}, largest {}",
                    format_four_digits(comparison.flip.mean),
                    format_four_digits(comparison.flip.maximum)
                ),
            ),
            ("differ", describe_differing_shares(comparison)),
            (
                "worst",
                errors
                    .worst
                    .as_ref()
                    .map(describe_worst_pixel)
                    .unwrap_or_default(),
            ),
            (
                "coverage",
                describe_coverage(comparison).unwrap_or_default(),
            ),
            ("noise", noise.unwrap_or_default()),
            ("not finite", describe_non_finite(errors.non_finite)),
        ];
        format_rows(rows)
    }
}

/// Refuses two crops with different data windows, their rectangles in the whole picture, because
/// their pixels do not correspond.
fn refuse_different_windows(windows: [Option<DataWindow>; 2], names: &str) -> Result<(), Failure> {
    match windows {
        [Some(one), Some(other)] if one != other => {
            let [one, other] = [one, other].map(format_data_window);
            let error = Error::invalid_input(
                names,
                format_args!(
                    "the pictures are different crops of larger pictures: {one} and {other}"
                ),
            );
            Err(error
                .with_hint("compare pictures rendered with the same --crop")
                .into())
        }
        _ => Ok(()),
    }
}

/// Writes the picture of `--diff`: the FLIP error of each pixel, from black (alike) to pale yellow
/// (largest difference).
fn write_difference_picture(path: &Path, comparison: &Comparison) -> Result<(), Failure> {
    let picture = heat_map(
        comparison.width,
        comparison.height,
        &comparison.flip_map,
        1.0,
    );
    let metadata = origin::program_metadata();
    Ok(write_png(path, &picture, Display::PLAIN, &metadata)?)
}

/// Source of the display settings that no flag gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum DisplaySource {
    /// No source: flags give all settings.
    Flags,
    /// Metadata of the first picture's file.
    Picture,
    /// Metadata of the second picture's file.
    Reference,
    /// The default display, because neither file records a display.
    Default,
}

/// The display settings for linear pictures, and their source.
#[derive(Serialize)]
struct DisplayReport {
    tone_map: String,
    gamma: String,
    exposure: f64,
    from: DisplaySource,
}

impl From<(Display, DisplaySource)> for DisplayReport {
    fn from((display, from): (Display, DisplaySource)) -> Self {
        Self {
            tone_map: origin::variant_name(&display.tone_map),
            gamma: origin::variant_name(&display.curve),
            exposure: display.exposure_stops,
            from,
        }
    }
}

impl DisplayReport {
    /// Describes the display for the table, with the name of its source.
    fn describe(&self, args: &CompareArgs) -> String {
        let source = match self.from {
            DisplaySource::Flags => String::new(),
            DisplaySource::Picture => format!(", from the file {}", args.picture.display()),
            DisplaySource::Reference => format!(", from the file {}", args.reference.display()),
            DisplaySource::Default => {
                ", the default, because neither file records a display".to_owned()
            }
        };
        let Self {
            tone_map,
            gamma,
            exposure,
            ..
        } = self;
        format!("tone map {tone_map}, gamma {gamma}, exposure {exposure}{source}")
    }
}

/// Chooses the display for two pictures; `None` if both hold display values already. Flags come
/// first. If only one picture holds display values, the display recorded in its file takes
/// precedence over the display in the other file.
fn choose_display(
    args: &CompareArgs,
    [picture, reference]: &[ComparisonPicture; 2],
) -> Option<(Display, DisplaySource)> {
    let sides = [
        (reference, DisplaySource::Reference),
        (picture, DisplaySource::Picture),
    ];
    let (linear, shown): (Vec<_>, Vec<_>) = sides
        .into_iter()
        .partition(|(judged, _)| judged.stored_picture.encoding == Encoding::Linear);
    if linear.is_empty() {
        return None;
    }
    let recorded = shown
        .into_iter()
        .chain(linear)
        .find_map(|(judged, source)| Some((judged.display?, source)));
    let (own, source) = recorded.unwrap_or((Display::default(), DisplaySource::Default));
    let display = Display {
        tone_map: args.tonemap.unwrap_or(own.tone_map),
        curve: args.gamma.unwrap_or(own.curve),
        exposure_stops: args.exposure.unwrap_or(own.exposure_stops),
        ..Display::default()
    };
    let has_all = args.exposure.is_some() && args.tonemap.is_some() && args.gamma.is_some();
    Some((
        display,
        if has_all {
            DisplaySource::Flags
        } else {
            source
        },
    ))
}

/// Describes the measures of colour and coverage that exceed the given thresholds. NaN exceeds any
/// threshold.
fn list_exceeded_thresholds(limits: &ThresholdArgs, comparison: &Comparison) -> Vec<String> {
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
        .flat_map(|coverage| list_exceeded_limits(limits, "coverage: ", coverage));
    list_exceeded_limits(limits, "", &colours)
        .into_iter()
        .chain(of_coverage)
        .collect()
}

/// Describes the measures that exceed the given thresholds, for colour or for coverage. `of` is put
/// before the name of each measure.
fn list_exceeded_limits(limits: &ThresholdArgs, of: &str, figures: &CoverageErrors) -> Vec<String> {
    let above_limits = [
        ("RMSE", figures.rmse, limits.max_rmse),
        ("relMSE", figures.relmse, limits.max_relmse),
        (
            "trimmed relMSE",
            figures.relmse_trimmed,
            limits.max_relmse_trimmed,
        ),
        ("mean FLIP", figures.flip, limits.max_flip),
    ];
    let above = above_limits.into_iter().filter_map(|(name, value, limit)| {
        limit
            .filter(|&limit| value > limit || value.is_nan())
            .map(|limit| format!("{of}{name} {} is above {limit}", format_four_digits(value)))
    });
    let psnr = figures.psnr.unwrap_or(f64::INFINITY);
    let below = limits
        .min_psnr
        .filter(|&limit| psnr < limit || psnr.is_nan());
    let below = below.map(|limit| {
        format!(
            "{of}PSNR {} dB is below {limit} dB",
            format_four_digits(psnr)
        )
    });
    let lost = figures.non_finite;
    let lost = (lost > 0
        && (above_limits.iter().any(|(_, _, limit)| limit.is_some()) || limits.min_psnr.is_some()))
    .then(|| format!("{of}{lost} pixels have values that are not finite numbers"));
    above.chain(below).chain(lost).collect()
}

/// Describes the size of the compared pictures and the numbers of their pixels.
fn describe_pixels(comparison: &Comparison) -> String {
    let numbers = match comparison.encoding {
        Encoding::Linear => "linear radiance",
        Encoding::Display => "display values 0 to 1",
    };
    format!("{}x{}, {numbers}", comparison.width, comparison.height)
}

/// Formats a peak signal-to-noise ratio in decibels; `None` is the ratio of equal pictures.
fn format_psnr(psnr: Option<f64>) -> String {
    psnr.map_or("infinite".to_owned(), |psnr| {
        format!("{} dB", format_four_digits(psnr))
    })
}

/// Describes the shares of pixels that differ at all and by more than some display codes; empty if
/// no pixel differs.
fn describe_differing_shares(comparison: &Comparison) -> String {
    let shares: Vec<String> = comparison
        .beyond
        .iter()
        .filter(|beyond| beyond.share > 0.0)
        .map(|beyond| {
            let percent = format_four_digits(100.0 * beyond.share);
            match beyond.codes {
                0 => format!("{percent} % of the pixels"),
                codes => format!("{percent} % by more than {codes}/255"),
            }
        })
        .collect();
    shares.join(", ")
}

/// Describes the pixel with the largest difference: its place, and its colour in both pictures.
fn describe_worst_pixel(worst: &WorstPixel) -> String {
    let colour = |rgb: [f32; 3]| rgb.map(|v| format_four_digits(f64::from(v))).join(" ");
    format!(
        "{}, {}: {} against {}",
        worst.x,
        worst.y,
        colour(worst.picture),
        colour(worst.reference)
    )
}

/// Describes the difference in coverage; `None` if the coverage of no pixel differs.
fn describe_coverage(comparison: &Comparison) -> Option<String> {
    let (largest, errors) = (
        comparison.coverage.filter(|&largest| largest != 0.0)?,
        comparison.coverage_errors?,
    );
    Some(format!(
        "differs by up to {}, RMSE {}, mean FLIP {}",
        format_four_digits(largest),
        format_four_digits(errors.rmse),
        format_four_digits(errors.flip)
    ))
}

/// Describes the number of pixels whose values are not finite; empty for none.
fn describe_non_finite(pixels: usize) -> String {
    if pixels == 0 {
        String::new()
    } else {
        format!("{pixels} pixels, left out of all measures")
    }
}

/// Describes the data windows of two pictures; `None` if neither picture has a window.
fn describe_data_windows(windows: [Option<DataWindow>; 2]) -> Option<String> {
    match windows {
        [None, None] => None,
        [Some(one), Some(_)] => Some(format_data_window(one)),
        [Some(one), None] => Some(format!(
            "{}, compared with an uncropped picture",
            format_data_window(one)
        )),
        [None, Some(other)] => Some(format!(
            "an uncropped picture, compared with {}",
            format_data_window(other)
        )),
    }
}

/// Formats the rectangle of a crop: its left and top edge, and the size of the whole picture.
fn format_data_window(
    DataWindow {
        origin: [x, y],
        full: [width, height],
    }: DataWindow,
) -> String {
    format!("at {x}, {y} of {width}x{height} pixels")
}
