//! `info` for a picture file: its size, its layers and its metadata, which state the estimated
//! error and the origin of the picture.

use std::path::Path;

use raywright_io::output::{PictureFormat, PictureMetadata, StoredPicture, read_picture};
use serde::Serialize;
use serde_json::{Value, json};

use crate::console;
use crate::failure::Failure;
use crate::plan;
use crate::table::format_columns;

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
}

/// Whether a file name has the extension of a picture format.
pub fn is_picture(path: &Path) -> bool {
    PictureFormat::from_path(path).is_ok()
}

/// Runs `info` for a picture file: prints its contents as a table or as JSON.
pub fn run(path: &Path, as_json: bool) -> Result<(), Failure> {
    let stored_picture = read_picture(path, &plan::build_limits(None))?;
    let picture_facts = PictureInfo::from_picture(path, &stored_picture);
    console::print(if as_json {
        console::format_json(&picture_facts)
    } else {
        format_columns(&picture_facts.format_table_rows())
    })
}

impl PictureInfo {
    fn from_picture(path: &Path, stored_picture: &StoredPicture) -> Self {
        let picture = &stored_picture.picture;
        let metadata = stored_picture.metadata();
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
            notation: stored_picture.format_name,
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
        }
    }

    fn format_table_rows(&self) -> Vec<[String; 2]> {
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
        rows.into_iter()
            .filter(|(_, text)| !text.is_empty())
            .map(|(name, text)| [name.to_owned(), text])
            .collect()
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
