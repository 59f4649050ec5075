//! `compare`: measures of the difference of two pictures, judged by thresholds or by the pictures'
//! noise, with a picture of the differences.

use std::path::{Path, PathBuf};

use raywright_core::display::Display;
use raywright_core::metrics::{
    ComparedPicture, Comparison, CoverageErrors, NoiseTestResult, PictureErrors, PictureWithErrors,
    WorstPixel, compare, heat_map,
};
use raywright_core::picture::{DataWindow, Encoding, Picture};
use raywright_io::output::{
    PictureMetadata, StoredFilm, StoredPicture, read_film, read_picture, write_picture,
};
use raywright_io::report::{format_four_digits, format_significant_digits};
use raywright_io::{Error, InputFiles, Limits};
use serde::Serialize;

use crate::args::{CompareArgs, ThresholdArgs, values};
use crate::failure::{Exit, Failure};
use crate::session::Session;
use crate::table::format_rows;
use crate::{console, origin};

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
            .then(|| test_against_noise(pair, paths, args.level))
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
            .extend(differing.map(|test| format!("noise: {}", describe_noise_test(test))));
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
        let noise = self.noise.as_ref().map(describe_noise_test);
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
    Ok(write_picture(path, &picture, Display::PLAIN, &metadata)?)
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

// `compare --noise`: pictures with their standard errors, and the result of the test for noise as
// text.

/// A picture of a comparison, with the standard errors of its pixels.
pub struct ComparisonPicture {
    /// The picture, with its layers and metadata.
    pub stored_picture: StoredPicture,
    /// Display settings recorded in the picture's file, if any.
    pub display: Option<Display>,
    /// Standard error of each pixel and channel, and the degrees of freedom that all of them have;
    /// `None` for a noiseless picture.
    pub errors: Option<(Vec<[f32; 3]>, f64)>,
}

/// Wraps a linear picture that comes from no picture file.
fn linear_picture(format_name: &'static str, picture: Picture) -> StoredPicture {
    StoredPicture {
        format_name,
        picture,
        encoding: Encoding::Linear,
        has_colour: true,
        texts: Default::default(),
    }
}

/// Returns the standard errors of a picture's layer `stderr` with their degrees of freedom, if it
/// has that layer.
fn standard_errors(picture: &Picture, metadata: &PictureMetadata) -> Option<(Vec<[f32; 3]>, f64)> {
    let layer = |name| picture.layer(name).map(|layer| layer.samples.iter());
    let (green, blue) = (layer("stderr.G")?, layer("stderr.B")?);
    let pixels = layer("stderr.R")?.zip(green).zip(blue);
    let errors = pixels.map(|((&red, &green), &blue)| [red, green, blue]);
    Some((errors.collect(), degrees_of_freedom(metadata)))
}

/// Returns the degrees of freedom of a picture's standard errors, from the picture's metadata. They
/// are one less than the number of replicates (independent renders, each with a share of the
/// samples):
/// - 3 for pictures of at least 64 samples per pixel and for denoised pictures, which have four
///   replicates;
/// - 1 for all other pictures, which have two replicates or, from other programs, an unknown number.
fn degrees_of_freedom(metadata: &PictureMetadata) -> f64 {
    let many = metadata
        .setting("samples")
        .and_then(|samples| samples.parse::<u32>().ok())
        .is_some_and(|samples| samples >= 64);
    if many || metadata.setting("reconstruction").is_some() {
        3.0
    } else {
        1.0
    }
}

/// Returns the display settings recorded in a picture's metadata; `None` if any setting is missing.
fn read_recorded_display(metadata: &PictureMetadata) -> Option<Display> {
    Some(Display {
        tone_map: values::parse_variant(metadata.setting("tone_map")?).ok()?,
        curve: values::parse_variant(metadata.setting("gamma")?).ok()?,
        exposure_stops: metadata.setting("exposure")?.parse().ok()?,
        ..Display::default()
    })
}

impl ComparisonPicture {
    /// Reads a picture file or the picture of a film file. The standard errors come from the film or
    /// from the layer `stderr`.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let limits = Limits::default();
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("film") {
            let StoredFilm { film, display, .. } = read_film(path, &limits)?;
            let errors = film.standard_errors();
            return Ok(Self {
                stored_picture: linear_picture("film", film.picture()),
                display: Some(display),
                errors: errors.map(|(errors, freedom)| (errors, f64::from(freedom))),
            });
        }
        let stored_picture = read_picture(path, &limits)?;
        if !stored_picture.has_colour {
            let layers = &stored_picture.picture.layers;
            let channels: Vec<&str> = layers.iter().map(|layer| layer.name.as_str()).collect();
            let error =
                Error::invalid_input(path.display(), "the picture has no colour channels R, G, B");
            return Err(error
                .with_hint(format!("its channels: {}", channels.join(", ")))
                .into());
        }
        let metadata = stored_picture.metadata();
        Ok(Self {
            errors: standard_errors(&stored_picture.picture, &metadata),
            display: read_recorded_display(&metadata),
            stored_picture,
        })
    }

    /// Wraps a linear picture in memory, with the metadata that its file would have.
    pub fn from_memory(picture: &Picture, display: Display, metadata: &PictureMetadata) -> Self {
        Self {
            errors: standard_errors(picture, metadata),
            display: Some(display),
            stored_picture: linear_picture("memory", picture.clone()),
        }
    }

    fn to_noisy_picture(&self) -> PictureWithErrors<'_> {
        let Picture {
            width, height, rgb, ..
        } = &self.stored_picture.picture;
        let (standard_errors, freedom) = match &self.errors {
            Some((errors, freedom)) => (Some(errors.clone()), *freedom),
            None => (None, 1.0),
        };
        PictureWithErrors {
            width: *width,
            height: *height,
            rgb,
            standard_errors,
            freedom,
        }
    }
}

/// Tests whether two pictures differ by more than their noise. `level` is the probability of a
/// false alarm over all tested blocks of pixels together.
pub fn test_against_noise(
    pair: &[ComparisonPicture; 2],
    paths: [&Path; 2],
    level: f64,
) -> Result<NoiseTestResult, Failure> {
    let refuse = |name: &str, reason: &str, hint: &str| -> Failure {
        Error::invalid_input(name, reason).with_hint(hint).into()
    };
    let names = paths.map(|path| path.display().to_string());
    for (judged, name) in pair.iter().zip(&names) {
        if judged.stored_picture.encoding != Encoding::Linear {
            return Err(refuse(
                name,
                "--noise compares radiance, and this picture stores display values in place of radiance",
                "compare .exr pictures, or film files of --checkpoint",
            ));
        }
    }
    let names = names.join(" and ");
    if pair.iter().all(|judged| judged.errors.is_none()) {
        return Err(refuse(
            &names,
            "neither picture has standard errors",
            "render with -o picture.exr --aov stderr, or compare film files of --checkpoint",
        ));
    }
    let [picture, reference] = pair.each_ref().map(ComparisonPicture::to_noisy_picture);
    raywright_core::metrics::test_against_noise(&picture, &reference, level)
        .map_err(|cause| Error::invalid_input(names, cause).into())
}

/// Formats the result of the test for noise as text for the table.
pub fn describe_noise_test(verdict: &NoiseTestResult) -> String {
    let NoiseTestResult {
        level,
        blocks,
        beyond,
        clearest,
        untested,
    } = verdict;
    let found = if *beyond == 0 {
        "no difference beyond the noise".to_owned()
    } else {
        format!("{beyond} of {blocks} blocks of pixels differ by more than the noise")
    };
    let clearest = clearest.as_ref().filter(|_| *beyond > 0).map(|block| {
        let channel = ["red", "green", "blue"][block.channel.min(2)];
        let share = block
            .share
            .map(|share| format!(", {:+.2} %", 100.0 * share))
            .unwrap_or_default();
        let deviation = if block.deviation.is_finite() {
            format!(
                "{} standard errors",
                format_significant_digits(block.deviation.abs(), 2)
            )
        } else {
            "although neither picture has noise in this block".to_owned()
        };
        let (x, y, edge) = (block.x, block.y, block.edge);
        format!(
            "; the clearest difference is in the block at {x}, {y}, {edge} pixels wide: {channel} differs by {}{share}, {deviation}",
            format_four_digits(block.difference)
        )
    });
    let left = if *untested == 0 {
        String::new()
    } else {
        format!("; {untested} pixels could not be tested, because their value or noise is unknown")
    };
    format!(
        "{found} (expected false alarms: in {} of 100 comparisons){}{left}",
        format_significant_digits(100.0 * level, 2),
        clearest.unwrap_or_default()
    )
}
