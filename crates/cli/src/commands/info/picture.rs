//! `info` for a picture file: its size, its layers and its metadata, which state the estimated
//! error and the origin of the picture. For a film file, also the samples so far.

use std::path::Path;

use raywright_core::RenderOutput;
use raywright_core::picture::{DataWindow, Picture};
use raywright_io::output::{
    PictureFormat, PictureMetadata, StoredFilm, is_film, read_film, read_picture,
};
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::table::format_rows;
use crate::{console, origin, plan};

/// Version of the layout of the JSON.
const FORMAT: u32 = 1;

/// Whether a file name has the extension of a picture format, or the file is a film.
pub fn is_picture_or_film(path: &Path) -> bool {
    PictureFormat::from_path(path).is_ok() || is_film(path)
}

/// Runs `info` for a picture or film file: prints its contents as a table or as JSON.
pub fn run(path: &Path, as_json: bool) -> Result<(), Failure> {
    let limits = plan::build_limits(None);
    let (json, rows) = if is_film(path) {
        let StoredFilm { film, metadata, .. } = read_film(path, &limits)?;
        let rendered = RenderOutput::from_film_without_denoising(&film);
        let noisy = film.estimate_uncertainty();
        let error = origin::format_error_metadata(noisy.as_ref(), &rendered, &film);
        let metadata = PictureMetadata { error, ..metadata };
        let whole = film.full_part();
        // Least and greatest number of samples of a pixel, and the requested number, which is null
        // where it is unknown.
        let state = json!({
            "samples": film.sample_range(&whole).into_inner(),
            "of": film.requested_samples(),
            "tiles": whole.tiles.end,
            "unfinished_tiles": film.unfinished_tiles(&whole),
        });
        let picture = (&rendered.picture, &metadata);
        list_contents(path, "Raywright film", picture, Some(state))
    } else {
        let stored = read_picture(path, &limits)?;
        let picture = (&stored.picture, &stored.metadata());
        list_contents(path, stored.format_name, picture, None)
    };
    console::print_report(as_json, &json, || format_rows(rows))
}

/// Lists the contents of a picture: the JSON, and the rows of the table.
fn list_contents(
    path: &Path,
    notation: &str,
    (picture, metadata): (&Picture, &PictureMetadata),
    film: Option<Value>,
) -> (Value, Vec<(&'static str, String)>) {
    let (name, [width, height]) = (path.display().to_string(), [picture.width, picture.height]);
    let layers = picture.layers.iter().map(|layer| layer.name.as_str());
    let layers: Vec<&str> = layers.collect();
    let error = convert_error_to_json(metadata);
    let mut json = json!({
        "format": FORMAT,
        "file": name,
        "notation": notation,
        "size": [width, height],
        "window": picture.window,
        "layers": layers,
        "software": metadata.software,
        "error": error,
        "scene_hash": metadata.scene_hash,
        "seed": metadata.seed,
        "settings": metadata.settings,
        "command": metadata.command,
    });
    let place = picture.window.map(|window| {
        let DataWindow {
            origin: [x, y],
            full: [width, height],
        } = window;
        format!(" at {x}, {y} of {width}x{height}")
    });
    let place = place.unwrap_or_default();
    let rows = vec![
        ("file", name),
        ("format", notation.to_owned()),
        ("picture", format!("{width}x{height} pixels{place}")),
        (
            "samples",
            film.as_ref().map(format_samples).unwrap_or_default(),
        ),
        ("layers", layers.join(", ")),
        ("software", metadata.software.clone()),
        (
            "error",
            error.as_ref().map(format_error).unwrap_or_default(),
        ),
        (
            "seed",
            metadata
                .seed
                .map(|seed| seed.to_string())
                .unwrap_or_default(),
        ),
        ("settings", metadata.settings.clone()),
        ("command", metadata.command.clone()),
        ("scene hash", metadata.scene_hash.clone()),
    ];
    if let Some(film) = film {
        json["film"] = film;
    }
    (json, rows)
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
