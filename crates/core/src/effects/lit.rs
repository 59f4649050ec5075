//! Scenes without any light, which models often are: how to tell, and what to put there.

use super::facts::Facts;
use crate::scene::{Colour, Scene, Sky};

/// The sky of a scene without any light: neutral, 1 at the zenith and 0.4 at the nadir.
pub fn neutral_sky() -> Sky {
    Sky::Gradient { bottom: Colour([0.4; 3]), top: Colour([1.0; 3]), suns: Vec::new() }
}

/// Whether anything in a scene gives light: without, a picture of it is black, and a neutral sky is what a user wants.
pub fn has_light(scene: &Scene) -> bool {
    let facts = Facts::gather(scene, None);
    [facts.sky, facts.light, facts.ambient, facts.emission, facts.unlit].iter().any(Option::is_some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Classic, ColourInput, Material, Model, Object, Physical, Shape, SideRule};

    fn scene(model: Model) -> Scene {
        let shape = Shape::Sphere { centre: [0.0; 3], radius: 1.0 };
        let object = Object {
            name: String::new(),
            shape,
            material: "only".to_owned(),
            side: SideRule::Both,
            face_viewer: true,
            casts_shadow: true,
            transform: Vec::new(),
            transform_end: None,
        };
        let material = Material { name: "only".to_owned(), model };
        Scene { materials: vec![material], objects: vec![object], ..Scene::default() }
    }

    /// What gives light is seen wherever it hides; what only could, because nothing shows it, does not count.
    #[test]
    fn light_is_found_where_it_is() {
        let dark = scene(Model::Classic(Box::default()));
        assert!(!has_light(&dark));
        assert!(has_light(&Scene { sky: Some(neutral_sky()), ..dark.clone() }));
        let glow = Classic { emission: Some(ColourInput::default()), ..Classic::default() };
        let glowing = scene(Model::Classic(Box::new(glow)));
        assert!(has_light(&glowing));
        assert!(!has_light(&Scene { objects: Vec::new(), ..glowing }));
        assert!(has_light(&scene(Model::Physical(Box::new(Physical { unlit: true, ..Physical::default() })))));
        let mut ambient = dark;
        ambient.classic.ambient = Colour([0.0, 0.1, 0.0]);
        assert!(has_light(&ambient));
    }
}
