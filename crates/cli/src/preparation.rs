//! Preparation of a loaded scene for rendering. The message of a failure names the file, the parts
//! of the scene that need memory, and helpful flags.

use std::cmp::Reverse;

use raywright_core::prepare::PrepareError;
use raywright_core::settings::Settings;
use raywright_core::{MemoryUse, Observer, ReadyScene, prepare};
use raywright_io::report::format_memory_parts;
use raywright_io::{Error, LoadedScene, SourceInfo, format_bytes};

use crate::failure::{Exit, Failure};

/// Message of a run that was interrupted before any result existed.
pub const NOTHING_KEPT: &str = "interrupted; nothing was written";

/// Prepares a loaded scene for these settings.
///
/// A failure that names the file and the flags that help.
pub fn prepare_loaded(
    loaded: &LoadedScene,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<ReadyScene, Failure> {
    prepare(&loaded.scene, settings, observer)
        .map_err(|error| prepare_failure(&loaded.source, error))
}

/// Converts the error of a preparation to a failure that names the scene's file.
pub fn prepare_failure(source: &SourceInfo, error: PrepareError) -> Failure {
    let name = source.name.as_str();
    match error {
        PrepareError::Cancelled => Failure::new(Exit::Interrupted, NOTHING_KEPT),
        PrepareError::Memory { needed, allowed } => {
            memory_error(name, &needed, Some(allowed)).into()
        }
        PrepareError::OutOfMemory { needed } => memory_error(name, &needed, None).into(),
        PrepareError::Settings(error) => Error::invalid_usage(error.to_string()).into(),
        PrepareError::Collapsed { problems } => source.error_at_problems(problems).into(),
        other => Error::invalid_input(name, other).into(),
    }
}

/// Creates the error for too little memory. The message lists the memory of each part, largest
/// first, with advice on the largest part. `allowed` is the exceeded limit; `None` if the system
/// itself has too little memory.
fn memory_error(name: &str, needed: &MemoryUse, allowed: Option<u64>) -> Error {
    let advice = |part: &str| match part {
        "picture" => "render fewer pixels with --size or --crop",
        "textures" => "use smaller images",
        _ => "show fewer objects or coarser meshes",
    };
    let mut parts = needed.bytes_by_purpose();
    parts.sort_by_key(|&(_, bytes)| Reverse(bytes));
    let [(most, _), ..] = parts;
    let needs = format!(
        "rendering needs about {} of memory ({})",
        format_bytes(needed.total()),
        format_memory_parts(&parts)
    );
    match allowed {
        Some(allowed) => Error::over_limit(
            name,
            format!("{needs}, and the limit is {}", format_bytes(allowed)),
        )
        .with_hint(format!(
            "raise the limit with --max-memory, or {}",
            advice(most)
        )),
        None => Error::over_limit(name, format!("{needs}, which the system does not provide"))
            .with_hint(advice(most)),
    }
}

#[cfg(test)]
mod tests {
    use raywright_core::settings::PrecisionChoice;
    use raywright_io::{Input, LoadOptions, load};

    use super::*;

    struct Stopped;

    impl Observer for Stopped {
        fn is_cancelled(&self) -> bool {
            true
        }
    }

    /// Returns an empty scene.
    fn empty() -> (LoadedScene, Settings) {
        loaded("")
    }

    /// Returns a scene with this TOML text.
    fn loaded(text: &str) -> (LoadedScene, Settings) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("empty.scene.toml");
        std::fs::write(&file, format!("format = 1\n{text}")).expect("a file");
        let loaded = load(&Input::Path(file), &LoadOptions::default()).expect("a scene");
        let settings = Settings {
            size: [8, 8],
            ..Settings::from_scene(&loaded.scene)
        };
        (loaded, settings)
    }

    /// Protects: an object too thin for single precision is refused at its line of the scene,
    /// listed or generated, and double precision renders the object.
    #[test]
    fn what_a_precision_loses_is_refused_by_it_alone() {
        let material = "[[materials]]\nname = \"m\"\nmodel.physical = {}\n";
        let thin = |x: u32| format!("shape.box = {{ min = [0, 0, {x}], max = [1, 2, {x}.01] }}");
        let listed = format!("[[objects]]\nmaterial = \"m\"\n{}\n", thin(300_000));
        let grid = "kind.grid = { counts = [1, 1, 2], origin = [0, 0, 3e5], step = [1, 1, 1] }";
        let generated = format!(
            "[[generators]]\n{grid}\nobject = {{ material = \"m\", {} }}\n",
            thin(0)
        );
        for (scene, line) in [(listed, "scene.toml:7:"), (generated, "scene.toml:7:")] {
            // Most objects lie near zero, so that the library chooses zero as the origin of its
            // coordinates.
            let balls = "[[objects]]\nmaterial = \"m\"\nshape.sphere = { centre = [0, 0, 0], radius = 1 }\n".repeat(3);
            let (loaded, settings) = loaded(&format!("{material}{scene}{balls}"));
            let with = |precision| {
                prepare_loaded(
                    &loaded,
                    &Settings {
                        precision,
                        ..settings.clone()
                    },
                    &(),
                )
            };
            let failure = with(PrecisionChoice::Robust)
                .err()
                .expect("there is nothing to see");
            assert_eq!(failure.exit, Exit::Input);
            let parts = [
                line,
                "the distance between `min` and `max` rounds to zero in single precision",
                "add --precision reference",
            ];
            assert!(
                parts.iter().all(|part| failure.message.contains(part)),
                "{}",
                failure.message
            );
            assert!(with(PrecisionChoice::Reference).is_ok());
        }
    }

    /// Protects: Ctrl-C ends the preparation too, with the exit code and message of an interrupted
    /// run.
    #[test]
    fn preparation_can_be_interrupted() {
        let (loaded, settings) = empty();
        let failure = prepare_loaded(&loaded, &settings, &Stopped)
            .err()
            .expect("it is stopped");
        assert_eq!(
            (failure.exit, failure.message.as_str()),
            (Exit::Interrupted, "error: interrupted; nothing was written")
        );
        assert!(prepare_loaded(&loaded, &settings, &()).is_ok());
    }

    /// Protects: the message about too little memory lists the parts, largest first, with advice
    /// about the largest.
    #[test]
    fn too_little_memory_is_explained() {
        let value_of =
            |needed: MemoryUse| memory_error("a.glb", &needed, Some(1 << 20)).to_string();
        let picture = value_of(MemoryUse {
            geometry: 1 << 20,
            film: 3 << 20,
            ..MemoryUse::default()
        });
        assert_eq!(
            picture,
            "error: a.glb: rendering needs about 4 MiB of memory (picture 3 MiB, geometry 1 MiB), and the limit is 1 MiB\n\
            help: raise the limit with --max-memory, or render fewer pixels with --size or --crop"
        );
        let ends = |needed: MemoryUse, advice: &str| {
            assert!(value_of(needed).ends_with(advice), "{}", value_of(needed))
        };
        ends(
            MemoryUse {
                textures: 2 << 20,
                film: 1,
                ..MemoryUse::default()
            },
            "or use smaller images",
        );
        ends(
            MemoryUse {
                geometry: 2 << 20,
                film: 1,
                ..MemoryUse::default()
            },
            "or show fewer objects or coarser meshes",
        );
        assert_eq!(
            memory_error(
                "a.glb",
                &MemoryUse {
                    film: 3 << 20,
                    ..MemoryUse::default()
                },
                None
            )
            .to_string(),
            "error: a.glb: rendering needs about 3 MiB of memory (picture 3 MiB), which the system does not provide\n\
            help: render fewer pixels with --size or --crop"
        );
    }
}
