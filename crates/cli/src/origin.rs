//! Origin of a picture, for the metadata of its file: program, scene, settings and command, enough
//! to render the picture again.

use std::ffi::OsString;
use std::sync::OnceLock;

use raywright_core::bvh::AcceleratorKind;
use raywright_core::display::Display;
use raywright_core::film::{ErrorEstimate, Film, Uncertainty};
use raywright_core::ladder::Ladder;
use raywright_core::scene::SamplePattern;
use raywright_core::settings::{PrecisionChoice, Sampling};
use raywright_core::{RenderOutput, Settings};
use raywright_io::output::PictureMetadata;
use raywright_io::report::format_significant_digits;
use raywright_io::{EnvironmentSource, LoadOptions, LoadedScene};
use serde::Serialize;
use serde_json::Value;

use crate::plan::{PicturePlan, RungChoices};

/// Name and version of the program.
pub const SOFTWARE: &str = concat!("Raywright ", env!("CARGO_PKG_VERSION"));

/// Returns metadata that state the program and its command alone.
pub fn program_metadata() -> PictureMetadata {
    PictureMetadata {
        software: SOFTWARE.to_owned(),
        command: command_line(),
        ..PictureMetadata::default()
    }
}

/// Returns the metadata of a picture's file, without its error.
pub fn picture_metadata(
    loaded: &LoadedScene,
    plan: &PicturePlan,
    choices: &RungChoices,
) -> PictureMetadata {
    PictureMetadata {
        scene_hash: loaded.hash.to_string(),
        settings: format_settings(&plan.settings, plan.display)
            + &choices.format_choices(RUNG_PREFIX, WITHOUT_PREFIX).concat(),
        seed: Some(plan.settings.seed),
        ..program_metadata()
    }
}

/// Formats the error of a picture for the metadata of its file: relMSE and RMSE with their
/// intervals, the number of samples, whether the picture is denoised, and the reason to doubt the
/// estimate. Empty without an estimate.
pub fn format_error_metadata(
    noisy: Option<&Uncertainty>,
    rendered: &RenderOutput,
    film: &Film,
) -> String {
    let denoised = rendered.denoise_output();
    let Some(claim) = denoised.map(|denoised| &denoised.error).or(noisy) else {
        return String::new();
    };
    let value_of = |name: &str, estimate: ErrorEstimate| {
        let [value, low, high] = [estimate.value, estimate.low, estimate.high]
            .map(|number| format_significant_digits(number, 3));
        format!("{name}={value} {name}_low={low} {name}_high={high}")
    };
    let samples = film.sample_range(&film.full_part());
    let [least, most] = [samples.start(), samples.end()];
    let samples = if least == most {
        most.to_string()
    } else {
        format!("{least}..{most}")
    };
    let doubt = claim
        .doubt
        .map_or_else(|| "none".to_owned(), |doubt| variant_name(&doubt));
    let reconstruction = if denoised.is_some() {
        "denoised"
    } else {
        "mean"
    };
    format!(
        "{} {} samples={samples} reconstruction={reconstruction} doubt={doubt}",
        value_of("root_relmse", claim.root_relmse),
        value_of("rmse", claim.rmse)
    )
}

/// Returns a text that identifies a scene and all changes that flags make to the scene. The film
/// files of a picture's parts have the same text; films with different texts are not merged.
pub fn format_scene_identity(
    loaded: &LoadedScene,
    options: &LoadOptions,
    choices: &RungChoices,
) -> String {
    let LoadOptions {
        overrides,
        model,
        environment,
        clay,
        section,
        ..
    } = options;
    // The hash of the scene already includes the content of an environment's file.
    let source = environment
        .source
        .as_ref()
        .map(|source| *source == EnvironmentSource::Studio);
    let environment = (
        source,
        environment.ground,
        environment.backdrop,
        environment.rotation,
        environment.strength,
    );
    format!(
        "{} {overrides:?} {model:?} {environment:?} {clay} {section:?}{}",
        loaded.hash,
        format_picture_choices(choices)
    )
}

/// Formats the chosen rungs (quality levels of settings) and switched-off effects on which all
/// parts of a picture must agree. The rungs for the number of samples and for denoising are left
/// out, because parts may differ in them.
fn format_picture_choices(choices: &RungChoices) -> String {
    let of_film = [Ladder::Samples, Ladder::Reconstruction];
    let mut own = choices.clone();
    own.rungs
        .retain(|choice| choice.ladder().changes_pictures() && !of_film.contains(&choice.ladder()));
    own.format_choices(RUNG_PREFIX, WITHOUT_PREFIX).concat()
}

/// Prefix of each chosen rung (quality level of a setting) in a picture's settings text.
const RUNG_PREFIX: &str = " rung:";
/// Prefix of each switched-off effect in a picture's settings text.
const WITHOUT_PREFIX: &str = " without=";

/// Sets the number of rendered samples in a picture's settings text. A number that the text
/// contains already is replaced.
pub fn replace_sample_count(settings: &str, samples: &str) -> String {
    let plain = settings.split(" taken=").next().unwrap_or_default();
    format!("{plain} taken={}", quote_for_shell(samples))
}

/// Words of this run's command line: those of the process, unless an embedding program sets others.
static ARGUMENTS: OnceLock<Vec<OsString>> = OnceLock::new();

/// Sets the command line of this run, whose first word is a program name.
pub fn set_arguments(words: &[OsString]) {
    ARGUMENTS.get_or_init(|| words.to_vec());
}

/// Returns the words of this run's command line.
pub fn run_arguments() -> &'static [OsString] {
    ARGUMENTS.get_or_init(|| std::env::args_os().collect())
}

/// Returns this run's command line, quoted for a shell.
pub fn command_line() -> String {
    format_command(run_arguments().get(1..).unwrap_or_default())
}

/// Formats the command `raywright` with these arguments, quoted for a shell.
pub fn format_command(arguments: &[OsString]) -> String {
    let arguments = arguments
        .iter()
        .map(|argument| quote_for_shell(&argument.to_string_lossy()));
    std::iter::once("raywright".to_owned())
        .chain(arguments)
        .collect::<Vec<_>>()
        .join(" ")
}

/// Puts a word in single quotes if a shell would otherwise split or expand it.
pub fn quote_for_shell(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Formats the settings that determine a picture's pixel values, as `name=value` separated by
/// spaces.
fn format_settings(settings: &Settings, display: Display) -> String {
    let [width, height] = settings.size;
    let samples = match settings.sampling {
        Sampling::General(n) => n.to_string(),
        Sampling::Pattern(SamplePattern::Centre) => "centre".to_owned(),
        Sampling::Pattern(SamplePattern::Corners) => "corners".to_owned(),
    };
    let error = settings
        .max_error
        .map(|error| format!(" max_error={error}"))
        .unwrap_or_default();
    let denoise = if settings.denoise {
        " reconstruction=denoised"
    } else {
        ""
    };
    let crop = settings
        .crop
        .map(|c| format!(" crop={},{},{},{}", c.x, c.y, c.width, c.height))
        .unwrap_or_default();
    let depth = match settings.max_depth {
        Settings::UNLIMITED => "unlimited".to_owned(),
        n => n.to_string(),
    };
    let clamp = settings
        .clamp
        .map(|maximum| format!(" clamp={maximum}"))
        .unwrap_or_default();
    let lines = [
        (settings.wireframe, " wireframe"),
        (settings.edges, " edges"),
    ]
    .map(|(is_drawn, name)| if is_drawn { name } else { "" })
    .concat();
    let background = match display.background {
        None => String::new(),
        Some(colour) => format!(
            " background={}",
            colour
                .map(|value| format_significant_digits(255.0 * value, 5))
                .join(",")
        ),
    };
    format!(
        "size={width}x{height}{crop} samples={samples}{error}{denoise} max_depth={depth}{clamp} integrator={} precision={} exposure={} tone_map={} gamma={}{background}{lines}",
        variant_name(&settings.integrator),
        precision_name(settings.precision),
        display.exposure_stops,
        variant_name(&display.tone_map),
        variant_name(&display.curve),
    )
}

/// Returns the name of an enum variant in scene files.
pub fn variant_name<T: Serialize>(variant: &T) -> String {
    match serde_json::to_value(variant) {
        Ok(Value::String(name)) => name,
        Ok(Value::Object(fields)) => fields.into_iter().map(|(name, _)| name).take(1).collect(),
        _ => String::new(),
    }
}

/// Returns the name of a precision on the command line.
pub fn precision_name(precision: PrecisionChoice) -> &'static str {
    match precision {
        PrecisionChoice::Robust => "robust",
        PrecisionChoice::Reference => "reference",
    }
}

/// Returns the name of an accelerator on the command line.
pub fn accelerator_name(kind: AcceleratorKind) -> &'static str {
    match kind {
        AcceleratorKind::Linear => "linear",
        AcceleratorKind::Tree(_) => "bvh",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: words that a shell would split are quoted, so that the command can be pasted.
    #[test]
    fn words_are_quoted_where_needed() {
        assert_eq!(quote_for_shell("--crop"), "--crop");
        assert_eq!(quote_for_shell("a=0.5,1"), "a=0.5,1");
        assert_eq!(quote_for_shell("my scene.toml"), "'my scene.toml'");
        assert_eq!(quote_for_shell("it's"), r"'it'\''s'");
        assert_eq!(quote_for_shell(""), "''");
    }

    /// Protects: names of variants are the names in scene files.
    #[test]
    fn variants_have_their_file_names() {
        assert_eq!(
            variant_name(&raywright_core::scene::ToneMap::KhronosNeutral),
            "khronos-neutral"
        );
        assert_eq!(
            variant_name(&raywright_core::scene::TransferCurve::Gamma22),
            "2.2"
        );
    }

    /// Protects: the names of accelerators and precisions in picture files and reports.
    #[test]
    fn ways_have_their_own_words() {
        use raywright_core::bvh::BuildQuality;
        let kinds = [
            AcceleratorKind::Linear,
            AcceleratorKind::Tree(BuildQuality::High),
        ];
        assert_eq!(kinds.map(accelerator_name), ["linear", "bvh"]);
        let precisions = [PrecisionChoice::Robust, PrecisionChoice::Reference];
        assert_eq!(precisions.map(precision_name), ["robust", "reference"]);
    }
}
