//! What a scene is given that it does not bring itself, and the sentence that says so.

use crate::prepare::neutral_sky;
use crate::scene::{Colour, ColourInput, Model, Scene};

/// Gives a scene without any light a neutral grey sky. Returns what was done, for the user to read.
pub fn complete(scene: &mut Scene) -> Vec<String> {
    let mut notes = Vec::new();
    if !has_light(scene) {
        scene.sky = Some(neutral_sky());
        notes
            .push("the scene has no light: a neutral grey sky was added (radiance 1 at the zenith, 0.4 at the nadir)".to_owned());
    }
    if scene.cameras.is_empty() {
        notes.push("the scene has no camera: it is framed from slightly above and to the side".to_owned());
    }
    notes
}

fn has_light(scene: &Scene) -> bool {
    let gives = |model: &Model| match model {
        Model::Classic(m) => {
            let emits = m.emission.as_ref().is_some_and(|e| *e != ColourInput::Constant(Colour::BLACK));
            emits || m.ambient.is_some_and(|a| a != Colour::BLACK)
        }
        Model::Physical(m) => m.unlit || m.emission != Colour::BLACK,
    };
    scene.sky.is_some()
        || scene.classic.ambient != Colour::BLACK
        || scene.lights.iter().any(|l| l.colour != Colour::BLACK)
        || scene.materials.iter().any(|m| gives(&m.model))
}
