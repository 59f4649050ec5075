//! Preparation of a loaded scene for rendering. Failures are reported with the file's name, the
//! parts that need memory, and flags that help.

use std::cmp::Reverse;

use raywright_core::prepare::PrepareError;
use raywright_core::settings::Settings;
use raywright_core::{Memory, Observer, ReadyScene, prepare};
use raywright_io::{Error, Loaded, SourceInfo, human_bytes};

use crate::failure::{Exit, Failure};
use crate::memory;

/// Message of a run that was interrupted before any result existed.
pub const NOTHING_KEPT: &str = "interrupted; nothing was written";

/// Prepares a loaded scene for these settings.
///
/// A failure that names the file and the flags that help.
pub fn prepare_loaded(
    loaded: &Loaded,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<ReadyScene, Failure> {
    prepare(&loaded.scene, settings, observer).map_err(|error| failed(&loaded.source, error))
}

/// Converts the error of a preparation to a failure that names the scene's file.
pub fn failed(source: &SourceInfo, error: PrepareError) -> Failure {
    let name = source.name.as_str();
    match error {
        PrepareError::Cancelled => Failure::new(Exit::Interrupted, NOTHING_KEPT),
        PrepareError::Memory { needed, allowed } => too_much(name, &needed, Some(allowed)).into(),
        PrepareError::OutOfMemory { needed } => too_much(name, &needed, None).into(),
        PrepareError::Settings(error) => Error::usage(error.to_string()).into(),
        PrepareError::Collapsed { problems } => source.error(problems).into(),
        other => Error::input(name, other).into(),
    }
}

/// Creates the error for too little memory. It lists the memory of each part, largest first, with
/// advice on the largest part. Without a limit, the system has not enough memory.
fn too_much(name: &str, needed: &Memory, allowed: Option<u64>) -> Error {
    let advice = |part: &str| match part {
        "picture" => "render less with --size or --crop",
        "textures" => "give it smaller images",
        _ => "show fewer objects or coarser meshes",
    };
    let mut parts = needed.parts();
    parts.sort_by_key(|&(_, bytes)| Reverse(bytes));
    let [(most, _), ..] = parts;
    let needs = format!(
        "rendering it needs about {} ({})",
        human_bytes(needed.total()),
        memory::listed(&parts)
    );
    match allowed {
        Some(allowed) => Error::limit(
            name,
            format!("{needs}, and the limit is {}", human_bytes(allowed)),
        )
        .with_hint(format!(
            "raise the limit with --max-memory, or {}",
            advice(most)
        )),
        None => Error::limit(
            name,
            format!("{needs}, and the system does not give as much"),
        )
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
    fn empty() -> (Loaded, Settings) {
        loaded("")
    }

    /// Returns a scene with this TOML text.
    fn loaded(text: &str) -> (Loaded, Settings) {
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
            // Most objects lie near zero, so that the coordinates have zero as their origin.
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
                "the distance of `max` from `min` is lost in single precision",
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
        let value_of = |needed: Memory| too_much("a.glb", &needed, Some(1 << 20)).to_string();
        let picture = value_of(Memory {
            geometry: 1 << 20,
            film: 3 << 20,
            ..Memory::default()
        });
        assert_eq!(
            picture,
            "error: a.glb: rendering it needs about 4 MiB (picture 3 MiB, geometry 1 MiB), and the limit is 1 MiB\n\
            help: raise the limit with --max-memory, or render less with --size or --crop"
        );
        let ends = |needed: Memory, advice: &str| {
            assert!(value_of(needed).ends_with(advice), "{}", value_of(needed))
        };
        ends(
            Memory {
                textures: 2 << 20,
                film: 1,
                ..Memory::default()
            },
            "or give it smaller images",
        );
        ends(
            Memory {
                geometry: 2 << 20,
                film: 1,
                ..Memory::default()
            },
            "or show fewer objects or coarser meshes",
        );
        assert_eq!(
            too_much(
                "a.glb",
                &Memory {
                    film: 3 << 20,
                    ..Memory::default()
                },
                None
            )
            .to_string(),
            "error: a.glb: rendering it needs about 3 MiB (picture 3 MiB), and the system does not give as much\n\
            help: render less with --size or --crop"
        );
    }
}
