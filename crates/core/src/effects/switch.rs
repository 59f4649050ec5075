//! Removal of effects. The causes of switched-off effects are removed from the scene, so that later
//! stages need no special case.

use std::sync::Arc;

use super::{Effect, EffectSet};
use crate::scene::{
    Camera, ClassicMaterial, Colour, FieldValue, MaterialFields, MaterialModel, MeshSource,
    Physical, Projection, Scene, Sky, TextureFilter, physical_fields,
};

/// Returns the scene and the camera without the causes of the effects in `off`. `SkyLight`,
/// `SoftShadows`, `Motion` and the mirror reflection of physical materials have no cause of their
/// own to remove. Preparation leaves them out if they are not simulated.
pub(crate) fn remove_effects(
    scene: &Scene,
    camera: &Option<Camera>,
    off: EffectSet,
) -> (Scene, Option<Camera>) {
    let (mut scene, mut camera) = (scene.clone(), camera.clone());
    if off.has(Effect::AmbientLight) {
        scene.classic.ambient = Colour::BLACK;
    }
    if off.has(Effect::DirectLight) {
        scene.lights.clear();
    }
    for light in &mut scene.lights {
        light.shadows &= !off.has(Effect::Shadows);
        light.specular &= !off.has(Effect::Highlights);
    }
    let generated = scene
        .generators
        .iter_mut()
        .map(|generator| &mut generator.object);
    for object in scene.objects.iter_mut().chain(generated) {
        object.casts_shadow &= !off.has(Effect::Shadows);
    }
    for material in &mut scene.materials {
        match &mut material.model {
            MaterialModel::Classic(m) => remove_from_classic(m, off),
            MaterialModel::Physical(m) => remove_from_physical(m, off),
        }
    }
    if off.has(Effect::MipMaps) {
        let filtered = scene
            .textures
            .iter_mut()
            .filter(|texture| texture.filter == TextureFilter::Mipmaps);
        filtered.for_each(|texture| texture.filter = TextureFilter::Bilinear);
    }
    if off.has(Effect::SmoothShading) {
        for mesh in &mut scene.meshes {
            if let MeshSource::Inline(data) = &mut mesh.source {
                Arc::make_mut(data).normals.clear();
            }
        }
    }
    let is_map = matches!(scene.sky, Some(Sky::Map(_)));
    if off.has(Effect::Sky) || off.has(Effect::EnvironmentMap) && is_map {
        scene.sky = None;
    }
    clear_field_if(&mut scene.air, off.has(Effect::ScatteringMedia));
    if let Some(Sky::Studio(studio)) = &mut scene.sky {
        studio.ground &= !off.has(Effect::GroundShadow);
    }
    if off.has(Effect::DepthOfField)
        && let Some(Camera {
            projection: Projection::ThinLens {
                aperture_radius, ..
            },
            ..
        }) = &mut camera
    {
        *aperture_radius = 0.0;
    }
    (scene, camera)
}

fn remove_from_classic(m: &mut ClassicMaterial, off: EffectSet) {
    clear_field_if(&mut m.rim, off.has(Effect::RimLight));
    clear_field_if(&mut m.specular, off.has(Effect::Highlights));
    clear_field_if(&mut m.emission, off.has(Effect::Emission));
    clear_field_if(&mut m.reflection, off.has(Effect::MirrorReflection));
    clear_field_if(&mut m.transmission, off.has(Effect::Refraction));
    if let Some(mixture) = m.mixture.as_mut().filter(|_| off.has(Effect::Absorption)) {
        mixture.absorption = Colour::BLACK;
    }
    clear_field_if(&mut m.ambient, off.has(Effect::AmbientLight));
    if let Some(reflection) = &mut m.reflection {
        clear_field_if(&mut reflection.fuzz, off.has(Effect::FuzzyReflection));
    }
    core::iter::once(&mut m.colour)
        .chain(&mut m.emission)
        .for_each(|input| flatten_input(input, off));
}

/// Defines a function that resets the fields of a physical material whose effects are switched off.
macro_rules! switches {
    ($(#[$meta:meta])* $Name:ident
     $($(#[$of:meta])* $key:ident: $Type:ty = $default:expr, $bounds:expr $(, $effect:ident)?;)*) => {
        fn remove_from_physical(m: &mut Physical, off: EffectSet) {
            m.change_values(&mut |value| flatten_input(value, off));
            let default = Physical::default();
            $($(if off.has(Effect::$effect) {
                m.$key = default.$key;
            })?)*
        }
    };
}
physical_fields!(switches);

fn flatten_input(input: &mut dyn FieldValue, off: EffectSet) {
    input.make_constant(
        off.has(Effect::ImageTextures),
        off.has(Effect::Checkerboard),
    );
}

fn clear_field_if<T>(slot: &mut Option<T>, off: bool) {
    if off {
        *slot = None;
    }
}
