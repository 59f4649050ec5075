//! Facts about the visible part of a scene: for each feature, the path in the scene file at which
//! it is first used.

mod materials;
mod scene_parts;

use crate::scene::{Camera, Scene};

use materials::LayerFirstUses;

/// Path, in the scene file, of the first use of a feature; `None` if the scene does not use it.
type FirstUsePath = Option<String>;

/// Largest perceptual roughness with which Whitted ray tracing traces a reflection as in a perfect
/// mirror.
pub(crate) const MIRROR_ROUGHNESS: f64 = 0.05;

/// First use of each feature in the visible part of a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct EffectFacts {
    pub ambient: FirstUsePath,
    pub lit_surface: FirstUsePath,
    pub light: FirstUsePath,
    pub shadowing_light: FirstUsePath,
    pub glossy_light: FirstUsePath,
    pub occluder: FirstUsePath,
    pub highlight: FirstUsePath,
    pub rim: FirstUsePath,
    pub reflection: FirstUsePath,
    pub fuzz: FirstUsePath,
    pub refraction: FirstUsePath,
    /// Material that reflects, transmits or diffuses each ray at random, in given proportions.
    pub mixture: FirstUsePath,
    pub absorption: FirstUsePath,
    /// Medium that scatters light, or whose density varies.
    pub medium: FirstUsePath,
    /// Body with a priority, which decides between overlapping bodies.
    pub nested_body: FirstUsePath,
    pub rough_reflection: FirstUsePath,
    pub rough_refraction: FirstUsePath,
    /// Layers of physical materials, such as a clear coat.
    pub layers: LayerFirstUses,
    /// Surface with a physical material that light illuminates.
    pub lit_physical: FirstUsePath,
    pub diffuse_physical: FirstUsePath,
    pub alpha: FirstUsePath,
    pub emission: FirstUsePath,
    pub even_emission: FirstUsePath,
    pub varied_emission: FirstUsePath,
    pub unlit_material: FirstUsePath,
    pub image: FirstUsePath,
    /// Texture that is filtered with mipmaps.
    pub mip_maps: FirstUsePath,
    pub program: FirstUsePath,
    pub checker: FirstUsePath,
    pub vertex_colours: FirstUsePath,
    pub smooth_normals: FirstUsePath,
    pub normal_map: FirstUsePath,
    pub mesh: FirstUsePath,
    pub physical: FirstUsePath,
    pub instance: FirstUsePath,
    pub unbounded_shape: FirstUsePath,
    pub sky: FirstUsePath,
    pub sky_map: FirstUsePath,
    /// Whether the sky is a backdrop without light.
    pub is_sky_dark: bool,
    /// Studio whose ground shows shadows.
    pub ground: FirstUsePath,
    /// First material of an imported file with properties that the scene format cannot represent.
    pub unread_material: FirstUsePath,
    /// Properties that the scene format cannot represent, with the names of the materials.
    pub unread_extensions: String,
    pub lens: FirstUsePath,
    pub motion: FirstUsePath,
    /// Shutter that is open for longer than an instant.
    pub exposure: FirstUsePath,
    /// Whether the shutter opens and closes at the same instant. Then the picture shows that
    /// instant, and no motion is left out.
    pub instant: bool,
}

/// Sets `slot` to `path` if the feature is present and `slot` is empty.
fn record_first_use(slot: &mut FirstUsePath, present: bool, path: impl FnOnce() -> String) {
    if present && slot.is_none() {
        *slot = Some(path());
    }
}

#[cfg(test)]
thread_local! {
    /// Number of scene traversals by this thread.
    pub(super) static WALKS: core::cell::Cell<u32> = const { core::cell::Cell::new(0) };
}

/// Effects that need several facts together; each function returns the path of the cause.
impl EffectFacts {
    /// Returns the path of a surface that lights illuminate; `None` without lights.
    pub fn surface_lit_by_lights(&self) -> Option<&String> {
        self.lit_surface.as_ref().and(self.light.as_ref())
    }

    /// Returns the path of a surface on which highlights of lights are visible.
    pub fn highlighted_surface(&self) -> Option<&String> {
        self.glossy_light.as_ref().and(self.highlight.as_ref())
    }

    /// Returns the path of a light whose shadows are visible on a surface.
    pub fn shadowing_occluder(&self) -> Option<&String> {
        let responsive = self.surface_lit_by_lights().or(self.highlighted_surface());
        responsive
            .and(self.occluder.as_ref())
            .and(self.shadowing_light.as_ref())
    }

    /// Returns the cause `own` of an effect or, under path tracing, the path of a layer that needs
    /// the effect.
    pub fn effect_or_layer_source<'a>(
        &'a self,
        own: &'a FirstUsePath,
        layer: &str,
        paths: bool,
    ) -> Option<&'a String> {
        own.as_ref()
            .or_else(|| self.layers.first_use(layer).filter(|_| paths))
    }

    /// Returns the path of a surface on which the light of emissive surfaces is visible.
    pub fn surface_lit_by_lamps(&self, paths: bool) -> Option<&String> {
        self.lit_surface
            .as_ref()
            .or(self.highlight.as_ref().filter(|_| paths))
    }

    /// Returns the path of a surface on which the light of the sky is visible.
    pub fn surface_lit_by_sky(&self, paths: bool) -> Option<&String> {
        let surface = if paths {
            self.surface_lit_by_lamps(true)
        } else {
            self.lit_physical.as_ref()
        };
        surface.filter(|_| !self.is_sky_dark)
    }

    /// Returns the path of a surface that diffuses light to other surfaces.
    pub fn diffuse_surface(&self, paths: bool) -> Option<&String> {
        if paths {
            self.lit_surface.as_ref()
        } else {
            self.diffuse_physical.as_ref()
        }
    }
}

impl EffectFacts {
    /// Gathers all facts of a scene with this camera.
    pub fn gather(scene: &Scene, camera: Option<&Camera>) -> Self {
        #[cfg(test)]
        WALKS.set(WALKS.get() + 1);
        let mut facts = Self::default();
        facts.gather_objects(scene);
        facts.gather_generators(scene);
        let used_materials = scene
            .objects
            .iter()
            .chain(scene.generators.iter().map(|generator| &generator.object))
            .map(|object| object.material.as_str())
            .collect();
        facts.gather_materials(scene, &used_materials);
        if let Some(air) = &scene.air {
            facts.gather_medium(air, "air");
        }
        facts.gather_unread_extensions(scene, &used_materials);
        facts.gather_lights(scene);
        facts.gather_sky(scene);
        if let Some(camera) = camera {
            facts.gather_camera(camera);
        }
        facts
    }
}
