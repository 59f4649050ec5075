//! Renders a scene and prints, at each doubling of its samples, the estimated error of the picture
//! so far, with its interval.
//!
//! ```sh
//! cargo run --release --example stages -- scenes/cornell.scene.toml cornell.png
//! ```
#![expect(clippy::print_stdout, reason = "the errors are this program's result")]

use std::path::Path;

use raywright::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [scene, out] = words.as_slice() else {
        return Err("usage: stages SCENE OUT".into());
    };
    let loaded = load(&Input::Path(scene.into()), &LoadOptions::default())?;
    let settings = Settings {
        sampling: Sampling::General(256),
        ..Settings::from_scene(&loaded.scene)
    };
    let ready = prepare(&loaded.scene, &settings, &())?;
    let rendered = ready.render_progressively(&(), |stage| {
        let (samples, picture) = (stage.sample_range(), stage.picture());
        let middle = picture.pixel(picture.width / 2, picture.height / 2);
        let error = stage.error().map(|error| error.root_relmse);
        let error = error.map_or("not known yet".to_owned(), |e| {
            format!("{:.4} ({:.4} to {:.4})", e.value, e.low, e.high)
        });
        println!(
            "{} to {} samples, middle pixel {middle:.3?}, error {error}",
            samples.start(),
            samples.end()
        );
    });
    write_picture(
        Path::new(out),
        rendered.final_picture(),
        Display::from_render(&loaded.scene.render),
        &PictureMetadata::default(),
    )?;
    Ok(())
}
