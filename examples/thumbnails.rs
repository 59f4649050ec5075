//! Renders a small picture of every model in a folder, and skips models that can't be read.
//!
//! ```sh
//! cargo run --release --example thumbnails -- models thumbnails
//! ```
#![expect(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "names and errors are this program's result"
)]

use std::path::Path;

use raywright::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [from, to] = words.as_slice() else {
        return Err("usage: thumbnails FOLDER OUT".into());
    };
    std::fs::create_dir_all(to)?;
    let mut files: Vec<_> = std::fs::read_dir(from)?
        .map(|entry| Ok(entry?.path()))
        .collect::<std::io::Result<_>>()?;
    files.sort();
    for file in files.iter().filter(|file| is_model(file)) {
        let Some(name) = file.file_stem() else {
            continue;
        };
        let target = Path::new(to).join(name).with_extension("png");
        match thumbnail(file, &target) {
            Ok(()) => println!("{}", target.display()),
            Err(error) => eprintln!("{error}"),
        }
    }
    Ok(())
}

fn is_model(file: &Path) -> bool {
    let extension = file
        .extension()
        .map(|extension| extension.to_string_lossy().to_lowercase());
    extension.is_some_and(|extension| {
        matches!(extension.as_str(), "glb" | "gltf" | "obj" | "stl" | "ply")
    })
}

fn thumbnail(file: &Path, target: &Path) -> Result<(), Box<dyn std::error::Error>> {
    // Untrusted files: a file beyond a limit is an error, and nothing in a file can make the
    // program panic.
    let options = LoadOptions {
        limits: Limits {
            triangles: 2_000_000,
            ..Limits::default()
        },
        ..LoadOptions::default()
    };
    let loaded = load(&Input::Path(file.into()), &options)?;
    let settings = Settings {
        size: [256, 256],
        sampling: Sampling::General(16),
        denoise: true,
        ..Settings::from_scene(&loaded.scene)
    };
    let rendered = prepare(&loaded.scene, &settings, &())?.render(&());
    write_picture(
        target,
        rendered.final_picture(),
        Display::from_render(&loaded.scene.render),
        &PictureMetadata::default(),
    )?;
    Ok(())
}
