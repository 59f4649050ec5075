//! Advice on unknown names: the closest known name, and for flags of other renderers and converters
//! the equivalent flag of this program.

use clap::error::{ContextKind, ContextValue, ErrorKind};
use raywright_core::suggest::most_similar_word;
use raywright_io::Error;

/// Creates the error for an unknown name. The hint is the closest known name or, if no name is
/// close, the list of known names. `label` is the kind of name, such as `camera`.
pub fn unknown_name_error(label: &str, name: &str, known: &[&str]) -> Error {
    let error = Error::invalid_usage(format_args!("there is no {label} `{name}`"));
    match most_similar_word(name, known.iter().copied()) {
        Some(candidate) => error.with_hint(format!("did you mean `{candidate}`?")),
        None if known.is_empty() => error,
        None => error.with_hint(format!("known: {}", known.join(", "))),
    }
}

/// Flags of other programs, without dashes, and advice on the equivalent flag of this program.
const SYNONYMS: [(&[&str], &str); 23] = [
    (
        &[
            "orthographic",
            "orthogonal",
            "parallel",
            "parallel-projection",
        ],
        "use --ortho for a view without perspective",
    ),
    (
        &["orbit", "rotate", "spin"],
        "use --turntable N for N pictures from a full circle around the model",
    ),
    (
        &["samples", "sample", "n-samples", "aa"],
        "use --spp N for the samples per pixel",
    ),
    (
        &[
            "width",
            "height",
            "resolution",
            "res",
            "dimensions",
            "geometry",
        ],
        "use --size 640x360 for width and height",
    ),
    (
        &["transparent", "alpha", "rgba"],
        "use --background transparent for pictures with alpha",
    ),
    (
        &["bg", "background-color", "background-colour"],
        "use --background COLOUR, such as white or #e6b219",
    ),
    (
        &["hdri", "hdr", "environment", "envmap", "ibl", "skybox"],
        "use --env studio, --env outdoor, or --env FILE for an equirectangular picture around the scene",
    ),
    (
        &["time", "timestamp"],
        "use --at T for a time in the animation, or --budget T to limit the time of the render",
    ),
    (
        &["timeout", "time-limit", "max-time"],
        "use --budget T to limit the time of the render, such as 90s or 5min",
    ),
    (
        &["frame-rate", "framerate"],
        "use --fps N for the pictures per second of an animation file, or --frames A..B:FPS for the pictures of an animation",
    ),
    (
        &["animation-time", "frame"],
        "use --at T for the time in the animation, in seconds",
    ),
    (
        &["jobs", "cores", "cpus", "n-threads", "j"],
        "use --threads N for the number of threads",
    ),
    (
        &["noise", "noise-threshold", "noise-level", "tolerance"],
        "use --max-error E, such as 0.05, to end the render at this estimated error",
    ),
    (
        &["depth", "bounces", "max-bounces", "path-length"],
        "use --max-depth N for the largest number of ray segments in a path",
    ),
    (
        &["out", "outfile", "output-file", "filename", "o"],
        "use -o FILE for the picture to write",
    ),
    (
        &["format", "output-format", "type"],
        "the extension sets the format: -o picture.png, .jpg, .webp or .exr",
    ),
    (
        &["compression", "jpeg-quality"],
        "use --quality Q, from 1 to 100, for .jpg pictures",
    ),
    (
        &["overwrite", "force", "yes", "y", "f"],
        "no flag is needed: a file that -o names is replaced",
    ),
    (
        &["gpu", "device", "cuda", "cpu"],
        "no flag is needed: the program renders on the CPU alone",
    ),
    (
        &["show-edges", "wire", "mesh-edges"],
        "use --wireframe to draw the edges of a model's triangles, or --edges for creases and outlines alone",
    ),
    (
        &["cut", "clip", "cross-section", "cutting-plane", "slice"],
        "use --section AXIS=VALUE to cut models along an axis, such as x=0.3 (in units of the file) or x=50%",
    ),
    (
        &["denoiser", "oidn", "optix"],
        "use --denoise to filter noise out of the picture",
    ),
    (
        &[
            "camera-position",
            "camera-pos",
            "position",
            "look-at",
            "lookat",
            "focal-point",
        ],
        "use --eye X,Y,Z for the camera's position and --target X,Y,Z for the point that the camera looks at",
    ),
];

/// Commands of other programs, and advice on the equivalent command of this program.
const COMMANDS: [(&[&str], &str); 4] = [
    (
        &[
            "serve", "server", "show", "open", "gui", "viewer", "preview",
        ],
        "use `raywright view FILE` to look at a scene in the browser",
    ),
    (
        &["convert", "export", "draw", "image", "picture"],
        "use `raywright render FILE -o picture.png`",
    ),
    (&["diff"], "use `raywright compare A B`"),
    (
        &["validate", "verify", "lint"],
        "use `raywright check FILE`",
    ),
];

/// Returns the message for a flag or a command of another program, and for one that resembles none
/// of this program, although the parser guesses one; `None` for any other error.
pub fn explain_foreign_name(error: &clap::Error) -> Option<String> {
    use ContextKind::{InvalidArg, InvalidSubcommand, SuggestedArg, SuggestedSubcommand};
    let (kind, known, [context, guess], list) = match error.kind() {
        ErrorKind::UnknownArgument => (
            "flag",
            &SYNONYMS[..],
            [InvalidArg, SuggestedArg],
            "`raywright COMMAND --help` lists the flags of a command",
        ),
        ErrorKind::InvalidSubcommand => (
            "command",
            &COMMANDS[..],
            [InvalidSubcommand, SuggestedSubcommand],
            "`raywright --help` lists the commands",
        ),
        _ => return None,
    };
    let Some(ContextValue::String(typed)) = error.get(context) else {
        return None;
    };
    let word = typed.trim_start_matches('-').split('=').next()?;
    let name = word.to_ascii_lowercase().replace('_', "-");
    let found = known
        .iter()
        .find(|(names, _)| names.contains(&name.as_str()));
    let advice = match (found, error.get(guess)) {
        (Some((_, advice)), _) => advice,
        (None, None) => return None,
        (None, Some(guesses)) => {
            let guesses = guesses.to_string();
            let words = guesses.split(", ").map(|word| word.trim_start_matches('-'));
            if most_similar_word(word, words).is_some() {
                return None;
            }
            list
        }
    };
    Some(format!(
        "error: there is no {kind} `{typed}`\nhelp: {advice}"
    ))
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;
    use crate::args::Arguments;

    /// Protects: another program's flag leads to the equivalent flag, in any spelling, and an
    /// unknown flag is left to the parser's own advice.
    #[test]
    fn flags_of_other_programs_lead_to_ours() {
        let message_of = |word: &str| {
            explain_foreign_name(
                &Arguments::try_parse_from(["raywright", "render", "a.glb", word]).expect_err(word),
            )
        };
        assert_eq!(
            message_of("--samples").as_deref(),
            Some(
                "error: there is no flag `--samples`\nhelp: use --spp N for the samples per pixel"
            )
        );
        assert_eq!(
            message_of("--max_bounces"),
            message_of("--max-bounces")
                .map(|message| message.replace("max-bounces", "max_bounces"))
        );
        assert!(
            message_of("--width=300").is_some_and(|message| message.contains("--size 640x360"))
        );
        assert_eq!((message_of("--camra"), message_of("--spp=x")), (None, None));
        // The parser would guess `--turntable`.
        assert_eq!(
            message_of("--frobnicate").as_deref(),
            Some(
                "error: there is no flag `--frobnicate`\nhelp: `raywright COMMAND --help` lists the flags of a command"
            )
        );
    }

    /// Protects: no flag of this program is explained as another program's, and each recommended
    /// flag exists.
    #[test]
    fn synonyms_name_flags_that_exist() {
        let command = Arguments::command();
        let render = command
            .get_subcommands()
            .find(|command| command.get_name() == "render")
            .expect("a command");
        let ours: Vec<&str> = render
            .get_arguments()
            .filter_map(|argument| argument.get_long())
            .collect();
        for (names, here) in SYNONYMS {
            assert!(names.iter().all(|name| !ours.contains(name)), "{names:?}");
            let flags = here
                .split([' ', ','])
                .filter_map(|word| word.strip_prefix("--"));
            flags.for_each(|flag| assert!(ours.contains(&flag), "--{flag}"));
        }
    }
}
