//! Renders a model from all sides: loaded once, prepared once, and only the camera turns.
//!
//! ```sh
//! cargo run --release --example turntable -- scenes/models/armillary.glb spin 12
//! ```
//!
//! writes spin-0.png to spin-11.png. Each has the bits of a separate render.

use std::path::Path;

use raywright::core::framing::{FIELD_OF_VIEW, Silhouette, ViewAngles};
use raywright::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [model, stem, count] = words.as_slice() else {
        return Err("usage: turntable MODEL STEM COUNT".into());
    };
    let count: u32 = count.parse()?;
    let loaded = load(&Input::Path(model.into()), &LoadOptions::default())?;
    let silhouette = Silhouette::from_scene(&loaded.scene);
    let from = |turn: u32| {
        let azimuth = 360.0 * f64::from(turn) / f64::from(count);
        silhouette.frame_camera(
            ViewAngles {
                azimuth,
                elevation: 20.0,
            },
            FIELD_OF_VIEW,
            16.0 / 9.0,
        )
    };

    let (size, sampling) = ([640, 360], Sampling::General(16));
    let settings = Settings {
        size,
        sampling,
        camera: Some(from(0)),
        denoise: true,
        ..Settings::from_scene(&loaded.scene)
    };
    let mut ready = prepare(&loaded.scene, &settings, &())?;
    for turn in 0..count {
        let camera = from(turn);
        // Another camera may need other effects; then the scene is prepared again.
        if !ready.replace_camera(&loaded.scene, &camera) {
            ready = prepare(
                &loaded.scene,
                &Settings {
                    camera: Some(camera),
                    ..settings.clone()
                },
                &(),
            )?;
        }
        let path = format!("{stem}-{turn}.png");
        let display = Display::from_render(&loaded.scene.render);
        write_picture(
            Path::new(&path),
            ready.render(&()).final_picture(),
            display,
            &PictureMetadata::default(),
        )?;
    }
    Ok(())
}
