//! Arguments of `compare`.

use std::path::PathBuf;

use clap::Args;
use raywright_core::scene::{ToneMap, TransferCurve};

use super::{names, values};

/// Arguments of `compare`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "\
Two .exr pictures are compared as linear radiance, all other pairs as display values. FLIP always compares display values.

Thresholds apply to colours and, if a picture has coverage, to coverage too.

Exit code: 0 no given threshold is exceeded, 1 a threshold or the noise is exceeded, 3 the pictures cannot be compared.

Examples:
  raywright compare got.png expected.png
  raywright compare got.exr expected.exr --max-rmse 0.001 --diff d.png
  raywright compare got.exr expected.film --noise")]
pub struct CompareArgs {
    /// Picture to judge, .png, .exr or .film
    #[arg(value_name = "A")]
    pub picture: PathBuf,

    /// Picture to compare with, of the same size
    #[arg(value_name = "B")]
    pub reference: PathBuf,

    /// Fail if the root mean square error is above X
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::parse_non_negative, help_heading = "Thresholds")]
    pub max_rmse: Option<f64>,

    /// Fail if relMSE, the mean of (A - B)² / (B² + 0.01), is above X
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::parse_non_negative, help_heading = "Thresholds")]
    pub max_relmse: Option<f64>,

    /// Fail if relMSE without the worst 0.1 % of the pixels is above X
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::parse_non_negative, help_heading = "Thresholds")]
    pub max_relmse_trimmed: Option<f64>,

    /// Fail if the mean FLIP difference, from 0 (alike) to 1, is above X
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = values::parse_non_negative, help_heading = "Thresholds")]
    pub max_flip: Option<f64>,

    /// Fail if the peak signal-to-noise ratio, in decibels, is below DB
    #[arg(long, value_name = "DB", allow_hyphen_values = true, value_parser = values::parse_number, help_heading = "Thresholds")]
    pub min_psnr: Option<f64>,

    /// Fail if the pictures differ by more than their noise. The noise is read from the layer
    /// stderr of an .exr or from a .film; a picture without either counts as noiseless. Blocks of
    /// all sizes are tested, from 16 pixels wide to the whole picture
    #[arg(long, help_heading = "Thresholds")]
    pub noise: bool,

    /// Probability of a false alarm of --noise, over all tested blocks together
    #[arg(long, value_name = "P", allow_hyphen_values = true, value_parser = values::parse_significance_level, default_value = "0.01", requires = "noise", help_heading = "Thresholds")]
    pub level: f64,

    /// Write a picture of the differences, .png: black where the pictures are alike, lighter where
    /// an observer would notice more difference
    #[arg(long, value_name = "FILE")]
    pub diff: Option<PathBuf>,

    /// Brighten .exr pictures by this many stops before the perceptual comparison [default: as
    /// their files say, or 0]
    #[arg(long, value_name = "STOPS", value_parser = values::parse_number, allow_hyphen_values = true, help_heading = "Display of .exr")]
    pub exposure: Option<f64>,

    /// Tone map of .exr pictures in the perceptual comparison [default: as their files say, or
    /// khronos-neutral]
    #[arg(long, value_name = "NAME", value_parser = names::variant_parser::<ToneMap>(), help_heading = "Display of .exr")]
    pub tonemap: Option<ToneMap>,

    /// Transfer curve of .exr pictures in the perceptual comparison [default: as their files say,
    /// or srgb]
    #[arg(long, value_name = "CURVE", value_parser = names::variant_parser::<TransferCurve>(), help_heading = "Display of .exr")]
    pub gamma: Option<TransferCurve>,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

impl CompareArgs {
    /// Whether a flag sets a threshold for a measure of difference; `--noise` sets none.
    pub fn has_threshold(&self) -> bool {
        [
            self.max_rmse,
            self.max_relmse,
            self.max_relmse_trimmed,
            self.max_flip,
            self.min_psnr,
        ]
        .iter()
        .any(Option::is_some)
    }
}
