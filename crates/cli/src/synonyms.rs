//! Advice on flags of other renderers and converters: the equivalent flag of this program.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Flags of other programs, without dashes, and advice on the equivalent flag of this program.
const SYNONYMS: [(&[&str], &str); 21] = [
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
        "use --env FILE for an equirectangular picture around the scene",
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
        &["fps", "frame-rate", "framerate"],
        "use --frames A..B:FPS, such as 0..2:25 for the time from 0 s to 2 s at 25 pictures per second",
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
        &["edges", "show-edges", "wire", "mesh-edges"],
        "use --wireframe to draw the edges of a model's triangles",
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

/// Creates the message for an unknown flag that another program has; `None` for any other error.
pub fn explain_foreign_flag(error: &clap::Error) -> Option<String> {
    let Some(ContextValue::String(argument)) = error.get(ContextKind::InvalidArg) else {
        return None;
    };
    let name = argument
        .trim_start_matches('-')
        .split('=')
        .next()
        .unwrap_or_default()
        .to_ascii_lowercase()
        .replace('_', "-");
    let equivalent = SYNONYMS
        .iter()
        .find(|(names, _)| names.contains(&name.as_str()))
        .map(|(_, equivalent)| equivalent)?;
    (error.kind() == ErrorKind::UnknownArgument)
        .then(|| format!("error: there is no flag `{argument}`\nhelp: {equivalent}"))
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
            explain_foreign_flag(
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
        assert_eq!(
            (message_of("--sampels"), message_of("--spp=x")),
            (None, None)
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
