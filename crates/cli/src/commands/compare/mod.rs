//! `compare`: measures of the difference of two pictures, judged by thresholds or by the pictures'
//! noise, with a picture of the differences.

mod display;
mod noise;
mod text;
mod thresholds;

use std::path::{Path, PathBuf};

use raywright_core::display::Display;
use raywright_core::metrics::{ComparedPicture, Comparison, NoiseTestResult, compare, heat_map};
use raywright_core::picture::{DataWindow, Picture};
use raywright_io::output::{PictureMetadata, StoredPicture, write_png};
use raywright_io::{Error, InputFiles};
use serde::Serialize;

use self::display::{ChosenDisplay, DisplayReport};
pub use self::noise::ComparisonPicture;
use self::text::{describe_data_windows, format_data_window, format_table};
use self::thresholds::{Thresholds, list_exceeded_thresholds};
use crate::args::{CompareArgs, DisplayArgs, ExposureChoice};
use crate::console;
use crate::failure::{Exit, Failure};
use crate::session::Session;
use crate::targets::OutputFiles;
use crate::{origin, plan};

/// Runs `compare`: reads two pictures, prints the measures of their difference, and fails if a
/// measure exceeds a threshold.
pub fn run(mut session: Session, args: &CompareArgs) -> Result<(), Failure> {
    if let Some(path) = &args.diff {
        check_diff_target(path, args, &mut session.outputs)?;
    }
    let pair = [
        noise::read_with_standard_errors(&args.picture)?,
        noise::read_with_standard_errors(&args.reference)?,
    ];
    let judgement = ComparisonResult::new(args, &pair)?;
    session.end_early_stage();
    if let Some(path) = &args.diff {
        write_difference_picture(path, &judgement.comparison)?;
    }
    console::print(if args.json {
        judgement.to_json(&pair)
    } else {
        judgement.to_text(args, &pair)
    })?;
    match judgement.exceeded.as_slice() {
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
    Ok(ComparisonResult::new(&args, pair)?.to_json(pair))
}

/// Measures of the difference of two pictures, and their judgement.
struct ComparisonResult {
    /// Measures of the difference.
    comparison: Comparison,
    /// Display settings of linear pictures; `None` if neither picture is linear.
    chosen_display: Option<ChosenDisplay>,
    /// Result of the test for noise, where `--noise` requests it.
    verdict: Option<NoiseTestResult>,
    /// Descriptions of the measures that exceed their thresholds.
    exceeded: Vec<String>,
}

impl ComparisonResult {
    fn new(args: &CompareArgs, pair: &[ComparisonPicture; 2]) -> Result<Self, Failure> {
        let ([picture, reference], names) =
            (pair, [args.picture.as_path(), args.reference.as_path()]);
        refuse_different_windows(
            &picture.stored_picture.picture,
            &reference.stored_picture.picture,
            names,
        )?;
        let exposure = args.exposure.map(ExposureChoice::Stops);
        let flags = DisplayArgs {
            exposure,
            tonemap: args.tonemap,
            gamma: args.gamma,
            quality: None,
        };
        let all_given = args.exposure.is_some() && args.tonemap.is_some() && args.gamma.is_some();
        let shown = ChosenDisplay::choose_display(
            (
                |own_display| plan::apply_display_flags(&flags, own_display),
                all_given,
            ),
            picture,
            reference,
        );
        let display = shown.map(|shown| shown.display).unwrap_or_default();
        let verdict = args
            .noise
            .then(|| noise::test_against_noise(picture, reference, names, args.level))
            .transpose()?;
        let comparison = compare(
            to_compared_picture(&picture.stored_picture),
            to_compared_picture(&reference.stored_picture),
            display,
        )
        .map_err(|cause| {
            Error::invalid_input(
                format_args!("{} and {}", names[0].display(), names[1].display()),
                cause,
            )
        })?;
        let mut beyond = list_exceeded_thresholds(&thresholds_from_args(args), &comparison);
        beyond.extend(
            verdict
                .as_ref()
                .filter(|verdict| verdict.beyond > 0)
                .map(|verdict| format!("noise: {}", noise::describe_noise_test(verdict))),
        );
        Ok(Self {
            comparison,
            chosen_display: shown,
            verdict,
            exceeded: beyond,
        })
    }

    fn to_json(&self, pair: &[ComparisonPicture; 2]) -> String {
        console::format_json(&ComparisonReport {
            format: FORMAT,
            comparison: &self.comparison,
            display: self.chosen_display.map(|shown| shown.to_report()),
            windows: data_windows(pair),
            noise: self.verdict.as_ref(),
            beyond_thresholds: &self.exceeded,
        })
    }

    fn to_text(&self, args: &CompareArgs, pair: &[ComparisonPicture; 2]) -> String {
        let names = [&args.picture, &args.reference].map(|name| name.display().to_string());
        let shown = self
            .chosen_display
            .map(|shown| shown.format_display_row(names.each_ref().map(String::as_str)));
        let parts = [
            describe_data_windows(data_windows(pair)),
            shown,
            self.verdict.as_ref().map(noise::describe_noise_test),
        ];
        format_table(&self.comparison, parts.map(Option::unwrap_or_default))
    }
}

/// Returns the thresholds that the flags set.
fn thresholds_from_args(args: &CompareArgs) -> Thresholds {
    Thresholds {
        max_rmse: args.max_rmse,
        max_relmse: args.max_relmse,
        max_relmse_trimmed: args.max_relmse_trimmed,
        max_flip: args.max_flip,
        min_psnr: args.min_psnr,
        has_any: args.has_threshold(),
    }
}

fn data_windows(pair: &[ComparisonPicture; 2]) -> [Option<DataWindow>; 2] {
    pair.each_ref()
        .map(|judged| judged.stored_picture.picture.window)
}

fn check_diff_target(
    path: &Path,
    args: &CompareArgs,
    outputs: &mut OutputFiles,
) -> Result<(), Failure> {
    let mut inputs = InputFiles::default();
    outputs.add_output_of_type(path, "--diff", ("png", "--diff writes a PNG file"))?;
    inputs.record_read(&args.picture);
    inputs.record_read(&args.reference);
    outputs.check_against_inputs(&inputs)
}

/// Refuses two crops with different data windows, their rectangles in the whole picture, because
/// their pixels do not correspond.
fn refuse_different_windows(
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
    let [one, other] = [one, other].map(format_data_window);
    let names = names.map(|name| name.display().to_string());
    let error = Error::invalid_input(
        names.join(" and "),
        format_args!("the pictures are different crops of larger pictures: {one} and {other}"),
    );
    Err(error
        .with_hint("compare pictures rendered with the same --crop")
        .into())
}

fn to_compared_picture(stored_picture: &StoredPicture) -> ComparedPicture<'_> {
    ComparedPicture {
        picture: &stored_picture.picture,
        encoding: stored_picture.encoding,
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
    let metadata = PictureMetadata {
        software: origin::SOFTWARE.to_owned(),
        command: origin::command_line(),
        ..PictureMetadata::default()
    };
    Ok(write_png(path, &picture, Display::PLAIN, &metadata)?)
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
    noise: Option<&'a NoiseTestResult>,
    /// Descriptions of the measures that exceed their thresholds.
    beyond_thresholds: &'a [String],
}
