//! Clay rendering: shapes without their materials.

use std::collections::BTreeMap;
use std::sync::Arc;

use raywright_core::scene::{
    AlphaMode, Colour, Image, ImageData, MaterialModel, MeshSource, Physical, PixelData, Scene,
    TextureRef,
};

/// Base colour of clay: a neutral grey.
const CLAY: f64 = 0.6;

/// Alpha cut-off of a surface that the file blends by an alpha texture. Clay renders this surface
/// as a mask: opaque where alpha is at least the cut-off, otherwise invisible.
const BLEND_CUTOFF: f64 = 0.5;

/// Returns a material as matte and neutral grey clay.
fn make_matte(physical: Physical) -> Physical {
    Physical {
        base_colour: Colour([CLAY; 3]).into(),
        specular: 0.0.into(),
        ..physical
    }
}

/// Replaces every material of a scene by matte grey clay. Uniform emission stays, because it may be
/// the only light. Alpha masks stay unchanged. A blended surface with an alpha texture becomes a
/// mask with cut-off 0.5. Other blended surfaces and glass become opaque.
pub(crate) fn apply_clay(scene: &mut Scene) {
    let mut cutouts = CutoutTextures::default();
    for material in &mut scene.materials {
        let emission = material.uniform_emission().unwrap_or(Colour::BLACK).into();
        let cut = match &material.model {
            MaterialModel::Physical(model) => cutouts.alpha_only_material(model),
            MaterialModel::Classic(_) => Physical::default(),
        };
        material.model = MaterialModel::Physical(Box::new(Physical {
            emission,
            ..make_matte(cut)
        }));
    }
    cutouts.add_to_scene(scene);
    whiten_vertices(scene);
    scene.unread.clear();
}

/// Whitens the vertex colours of all meshes. Masks read the alpha of the vertices alone.
fn whiten_vertices(scene: &mut Scene) {
    for mesh in &mut scene.meshes {
        if let MeshSource::Inline(data) = &mut mesh.source
            && !data.colours.is_empty()
        {
            for colour in &mut Arc::make_mut(data).colours {
                colour[..3].fill(1.0);
            }
        }
    }
}

/// White copies of the textures whose alpha clay needs: the name of each copy, by the name of its
/// original. Clay ignores the colours of the originals.
#[derive(Default)]
struct CutoutTextures(BTreeMap<String, String>);

impl CutoutTextures {
    /// Returns a default material that only cuts shapes out. A mask of `model` is kept, with its
    /// opacity, a white copy of its base colour texture and the alpha of vertices. Blending by the
    /// alpha of that texture becomes a mask (see [`BLEND_CUTOFF`]). Any other material becomes opaque.
    fn alpha_only_material(&mut self, model: &Physical) -> Physical {
        let texture = model.base_colour_texture.as_ref();
        let (alpha, opacity) = match (model.alpha, texture) {
            (AlphaMode::Mask { .. }, _) => (model.alpha, model.opacity.clone()),
            (AlphaMode::Blend, Some(_)) => (
                AlphaMode::Mask {
                    cutoff: BLEND_CUTOFF,
                },
                1.0.into(),
            ),
            _ => return Physical::default(),
        };
        let white = |texture: &TextureRef| TextureRef {
            name: self.register_white_copy(&texture.name),
            factor: Colour::WHITE,
            ..texture.clone()
        };
        Physical {
            alpha,
            opacity,
            base_colour_texture: texture.map(white),
            vertex_colours: model.vertex_colours,
            ..Physical::default()
        }
    }

    fn register_white_copy(&mut self, name: &str) -> String {
        self.0
            .entry(name.to_owned())
            .or_insert_with(|| format!("{name} (white)"))
            .clone()
    }

    /// Adds the white copies of the textures to the scene, each with a white copy of its image. The
    /// copy of an image keeps the alpha of the original.
    fn add_to_scene(self, scene: &mut Scene) {
        for (name, white) in self.0 {
            let Some(texture) = scene
                .textures
                .iter()
                .find(|texture| texture.name == name)
                .cloned()
            else {
                continue;
            };
            let Some(image) = scene
                .images
                .iter()
                .find(|image| image.name == texture.image)
            else {
                continue;
            };
            let data = image
                .data
                .as_deref()
                .map(|data| Arc::new(whiten_image(data)));
            scene.images.push(Image {
                name: white.clone(),
                data,
                ..image.clone()
            });
            scene.textures.push(raywright_core::scene::Texture {
                name: white.clone(),
                image: white,
                ..texture
            });
        }
    }
}

/// Returns a copy of an image with white pixels and the original alpha.
fn whiten_image(data: &ImageData) -> ImageData {
    let pixels = match &data.pixels {
        PixelData::Codes(pixels) => PixelData::Codes(
            pixels
                .iter()
                .map(|&[.., alpha]| [255, 255, 255, alpha])
                .collect(),
        ),
        PixelData::Linear(pixels) => PixelData::Linear(
            pixels
                .iter()
                .map(|&[.., alpha]| [1.0, 1.0, 1.0, alpha])
                .collect(),
        ),
    };
    ImageData { pixels, ..*data }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Protects: every kind of material becomes matte grey, with its uniform emission and its alpha
    /// cut-outs, read from an image or from vertices without colour; glass and surfaces blended by a
    /// constant become opaque.
    #[test]
    fn materials_become_clay() {
        let physical = |name: &str, terms: serde_json::Value| json!({ "name": name, "model": { "physical": terms } });
        let image = json!({ "name": "leaf" });
        let materials = json!([
            physical("metal", json!({ "metallic": 1, "roughness": 0.1, "base_colour": [1, 0.5, 0], "normal_texture": image })),
            physical("glass", json!({ "transmission": 1, "roughness": 0 })),
            physical("mask", json!({ "alpha": { "mask": { "cutoff": 0.3 } }, "opacity": 0.9, "base_colour_texture": image })),
            physical("blend", json!({ "alpha": "blend", "opacity": 0.2, "base_colour_texture": image })),
            physical("pane", json!({ "alpha": "blend", "opacity": 0.2 })),
            physical("lamp", json!({ "emission": [5, 4, 3] })),
            { "name": "classic", "model": { "classic": { "emission": [1, 0, 0] } } },
            physical("leaf", json!({ "alpha": { "mask": { "cutoff": 0.5 } }, "vertex_colours": true })),
        ]);
        let colours = [[0.1, 0.2, 0.3, 0.4]];
        let mesh = json!({ "name": "leaf", "source": { "inline": { "colours": colours } } });
        let mut scene: Scene = serde_json::from_value(json!({ "format": 1, "materials": materials, "meshes": [mesh],
            "images": [{ "name": "leaf", "path": "leaf.png" }], "textures": [{ "name": "leaf", "image": "leaf" }] }))
        .expect("a scene");
        let pixels = PixelData::Codes(vec![[10, 200, 30, 255], [10, 200, 30, 0]]);
        scene.images[0].data = Some(Arc::new(ImageData {
            width: 2,
            height: 1,
            pixels,
        }));
        apply_clay(&mut scene);
        let physicals: Vec<Physical> = scene
            .materials
            .iter()
            .map(|material| match &material.model {
                MaterialModel::Physical(model) => (**model).clone(),
                MaterialModel::Classic(_) => panic!("{} is classic", material.name),
            })
            .collect();
        let clay = make_matte(Physical::default());
        assert_eq!([&physicals[0], &physicals[1], &physicals[4]], [&clay; 3]);
        let alphas =
            [&physicals[2], &physicals[3]].map(|model| (model.alpha, model.opacity.clone()));
        assert_eq!(alphas[0], (AlphaMode::Mask { cutoff: 0.3 }, 0.9.into()));
        assert_eq!(
            alphas[1],
            (
                AlphaMode::Mask {
                    cutoff: BLEND_CUTOFF
                },
                1.0.into()
            )
        );
        let names = [&physicals[2], &physicals[3]].map(|model| {
            model
                .base_colour_texture
                .as_ref()
                .map(|texture| texture.name.clone())
        });
        assert_eq!(names, [(); 2].map(|()| Some("leaf (white)".to_owned())));
        let white = scene
            .images
            .iter()
            .find(|image| image.name == "leaf (white)")
            .and_then(|image| image.data.clone());
        assert_eq!(
            white.map(|data| data.pixels.clone()),
            Some(PixelData::Codes(vec![[255; 4], [255, 255, 255, 0]]))
        );
        assert_eq!(physicals[5].emission, Colour([5.0, 4.0, 3.0]).into());
        assert_eq!(physicals[6].emission, Colour([1.0, 0.0, 0.0]).into());
        assert!(physicals[7].vertex_colours);
        let MeshSource::Inline(data) = &scene.meshes[0].source else {
            panic!("an inline mesh");
        };
        assert_eq!(data.colours, [[1.0, 1.0, 1.0, 0.4]]);
    }
}
