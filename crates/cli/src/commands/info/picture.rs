//! `info` for a picture file: its size, its layers and its metadata, which state the estimated
//! error and the origin of the picture. For a film file, also the samples so far.

use std::path::Path;

use raywright_core::RenderOutput;
use raywright_core::picture::Picture;
use raywright_io::output::{
    PictureFormat, PictureMetadata, StoredFilm, is_film, read_film, read_picture,
};
use serde::Serialize;
use serde_json::{Value, json};

use crate::console;
use crate::failure::Failure;
use crate::origin;
use crate::plan;
use crate::table::format_rows;

/// Version of the layout of [`PictureInfo`].
const FORMAT: u32 = 1;

/// Contents of a picture file. An entry is null or empty if the file lacks it.
#[derive(Serialize)]
struct PictureInfo {
    format: u32,
    file: String,
    notation: &'static str,
    /// Width and height in pixels.
    size: [u32; 2],
    /// Offset of the picture in the larger picture from which it was cropped, and size of the
    /// larger picture, in pixels.
    window: Option<Value>,
    layers: Vec<String>,
    software: String,
    error: Option<Value>,
    scene_hash: String,
    seed: Option<u64>,
    settings: String,
    command: String,
    /// Samples of a film: least and greatest number of a pixel, requested number (null where it is
    /// unknown), number of tiles and of those that lack samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    film: Option<Value>,
}

/// Whether a file name has the extension of a picture format, or the file is a film.
pub fn is_picture_or_film(path: &Path) -> bool {
    PictureFormat::from_path(path).is_ok() || is_film(path)
}

/// Runs `info` for a picture or film file: prints its contents as a table or as JSON.
pub fn run(path: &Path, as_json: bool) -> Result<(), Failure> {
    let limits = plan::build_limits(None);
    let picture_facts = if is_film(path) {
        PictureInfo::from_film(path, read_film(path, &limits)?)
    } else {
        let stored = read_picture(path, &limits)?;
        PictureInfo::new(path, stored.format_name, &stored.picture, stored.metadata())
    };
    console::print_report(as_json, &picture_facts, || picture_facts.format_table())
}

impl PictureInfo {
    fn from_film(path: &Path, stored: StoredFilm) -> Self {
        let StoredFilm { film, metadata, .. } = stored;
        let rendered = RenderOutput::from_film_without_denoising(&film);
        let noisy = film.estimate_uncertainty();
        let error = origin::format_error_metadata(noisy.as_ref(), &rendered, &film);
        let metadata = PictureMetadata { error, ..metadata };
        let whole = film.full_part();
        Self {
            film: Some(json!({
                "samples": film.sample_range(&whole).into_inner(),
                "of": film.requested_samples(),
                "tiles": whole.tiles.end,
                "unfinished_tiles": film.unfinished_tiles(&whole),
            })),
            ..Self::new(path, "Raywright film", &rendered.picture, metadata)
        }
    }

    fn new(
        path: &Path,
        notation: &'static str,
        picture: &Picture,
        metadata: PictureMetadata,
    ) -> Self {
        let error = convert_error_to_json(&metadata);
        let PictureMetadata {
            software,
            scene_hash,
            settings,
            seed,
            command,
            ..
        } = metadata;
        Self {
            format: FORMAT,
            file: path.display().to_string(),
            notation,
            size: [picture.width, picture.height],
            window: picture
                .window
                .as_ref()
                .map(|window| json!({ "origin": window.origin, "full": window.full })),
            layers: picture
                .layers
                .iter()
                .map(|layer| layer.name.clone())
                .collect(),
            software,
            error,
            scene_hash,
            seed,
            settings,
            command,
            film: None,
        }
    }

    fn format_table(&self) -> String {
        let [width, height] = self.size;
        let rows = [
            ("file", self.file.clone()),
            ("format", self.notation.to_owned()),
            (
                "picture",
                format!(
                    "{width}x{height} pixels{}",
                    self.window
                        .as_ref()
                        .map(format_data_window)
                        .unwrap_or_default()
                ),
            ),
            (
                "samples",
                self.film.as_ref().map(format_samples).unwrap_or_default(),
            ),
            ("layers", self.layers.join(", ")),
            ("software", self.software.clone()),
            (
                "error",
                self.error.as_ref().map(format_error).unwrap_or_default(),
            ),
            (
                "seed",
                self.seed.map(|seed| seed.to_string()).unwrap_or_default(),
            ),
            ("settings", self.settings.clone()),
            ("command", self.command.clone()),
            ("scene hash", self.scene_hash.clone()),
        ];
        format_rows(rows)
    }
}

/// Formats the offset of a cropped picture and the size of the larger picture, in pixels: ` at 16,
/// 8 of 320x180`.
fn format_data_window(window: &Value) -> String {
    let number = |list: &str, i: usize| &window[list][i];
    format!(
        " at {}, {} of {}x{}",
        number("origin", 0),
        number("origin", 1),
        number("full", 0),
        number("full", 1)
    )
}

/// Converts the error estimate in a file's metadata to JSON, with numbers as numbers; `None` if the
/// file has no estimate.
fn convert_error_to_json(metadata: &PictureMetadata) -> Option<Value> {
    let number = |name: &str| {
        metadata
            .error_value(name)
            .and_then(|text| text.parse::<f64>().ok())
    };
    let estimate = |name: &str| {
        let [low, high] = ["low", "high"].map(|end| number(&format!("{name}_{end}")));
        json!({ "value": number(name), "low": low, "high": high })
    };
    number("root_relmse")?;
    let word = |name: &str| metadata.error_value(name).filter(|text| *text != "none");
    Some(json!({
        "root_relmse": estimate("root_relmse"),
        "rmse": estimate("rmse"),
        "samples": word("samples"),
        "reconstruction": word("reconstruction"),
        "doubt": word("doubt"),
    }))
}

/// Formats the samples of a film for the table.
fn format_samples(film: &Value) -> String {
    let samples = &film["samples"];
    let of = film["of"]
        .as_u64()
        .map(|of| format!(" of {of}"))
        .unwrap_or_default();
    format!(
        "{} to {}{of} a pixel; {} of {} tiles lack samples",
        samples[0], samples[1], film["unfinished_tiles"], film["tiles"]
    )
}

/// Formats the error estimate of a picture file for the table.
fn format_error(error: &Value) -> String {
    let value_of = |name: &str| {
        let estimate = &error[name];
        format!(
            "{} ({} to {})",
            estimate["value"], estimate["low"], estimate["high"]
        )
    };
    let text = |name: &str| error[name].as_str().unwrap_or_default();
    let doubt = match text("doubt") {
        "" => String::new(),
        doubt => format!(", in doubt ({doubt})"),
    };
    let denoised = if text("reconstruction") == "denoised" {
        ", denoised (biased)"
    } else {
        ""
    };
    format!(
        "root relMSE {}, RMSE {}; {} samples{denoised}{doubt}",
        value_of("root_relmse"),
        value_of("rmse"),
        text("samples")
    )
}
