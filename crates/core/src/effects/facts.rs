//! Facts about the visible part of a scene: for each feature, the path in the scene file at which
//! it is first used.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use crate::generate::count_generated_objects;
use crate::lookup::SceneLookup;
use crate::motion::{camera_moves, object_transforms_at_ends, shutter_interval};
use crate::scene::{
    AlphaMode, Camera, ClassicMaterial, ClassicRules, Colour, ColourInput, DepthLimit, FieldValue,
    MaterialFields, MaterialModel, Physical, Projection, ScalarFactor, Scene, Shape, Sky,
    TextureFilter,
};

/// Path, in the scene file, of the first use of a feature; `None` if the scene does not use it.
type FirstUsePath = Option<String>;

/// Largest perceptual roughness with which Whitted ray tracing traces a reflection as in a perfect
/// mirror.
pub(crate) const MIRROR_ROUGHNESS: f64 = 0.05;

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

/// Function that returns whether a physical material has a layer. The flags are whether part of the
/// material may be non-metallic, and whether the non-metallic part may transmit light.
type LayerPredicate = fn(&Physical, [bool; 2]) -> bool;

/// Name of each layer over, under or in surfaces, with the function that detects the layer.
const LAYERS: [(&str, LayerPredicate); 9] = [
    ("thin_walled", |m, [_, clear]| m.thin_walled && clear),
    ("specular", |m, [plain, _]| m.has_specular_tint() && plain),
    ("conductor", |m, _| m.active_conductor().is_some()),
    ("clearcoat", |m, _| m.active_clearcoat().is_some()),
    ("sheen", |m, _| m.active_sheen().is_some()),
    ("anisotropy", |m, _| m.active_anisotropy().is_some()),
    ("iridescence", |m, _| m.active_iridescence().is_some()),
    ("dispersion", |m, [_, clear]| {
        m.dispersion > 0.0 && clear && !m.thin_walled
    }),
    ("diffuse_transmission", |m, [plain, _]| {
        m.may_transmit_diffusely() && plain
    }),
];

/// Layers of a scene's materials, each with the path of its first use.
#[derive(Clone, Debug, Default)]
pub(super) struct LayerFirstUses(BTreeMap<&'static str, String>);

impl LayerFirstUses {
    /// Records the layers of a material. `parts` holds the flags of [`LayerPredicate`]. `at`
    /// returns the path of a material's field in the scene file.
    fn add_material(&mut self, m: &Physical, parts: [bool; 2], at: &dyn Fn(&str) -> String) {
        for (key, _) in LAYERS.iter().filter(|(_, has)| has(m, parts)) {
            self.0.entry(key).or_insert_with(|| at(key));
        }
    }

    /// Returns the path in the scene file at which a layer is first used, or `None`.
    pub fn first_use(&self, key: &str) -> Option<&String> {
        self.0.get(key)
    }
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

    pub fn highlighted_surface(&self) -> Option<&String> {
        self.glossy_light.as_ref().and(self.highlight.as_ref())
    }

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
        if paths {
            self.surface_lit_by_lamps(true)
        } else {
            self.lit_physical.as_ref()
        }
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
        let mut effect_facts = Self::default();
        effect_facts.gather_objects(scene);
        for (i, generator) in scene.generators.iter().enumerate() {
            let repeated = matches!(generator.object.shape, Shape::Mesh(_))
                && count_generated_objects(&generator.kind) > 1;
            record_first_use(&mut effect_facts.instance, repeated, || {
                format!("generators[{i}].object.shape.mesh")
            });
        }
        let objects = scene
            .objects
            .iter()
            .chain(scene.generators.iter().map(|generator| &generator.object));
        let reduced = scene
            .textures
            .iter()
            .enumerate()
            .filter(|(_, texture)| texture.filter == TextureFilter::Mipmaps);
        let reduced: BTreeMap<&str, usize> = reduced
            .map(|(i, texture)| (texture.name.as_str(), i))
            .collect();
        let used: BTreeSet<&str> = objects.map(|object| object.material.as_str()).collect();
        for (i, material) in scene
            .materials
            .iter()
            .enumerate()
            .filter(|(_, m)| used.contains(m.name.as_str()))
        {
            match &material.model {
                MaterialModel::Classic(m) => effect_facts.gather_classic(
                    m,
                    &scene.classic,
                    &format!("materials[{i}].model.classic"),
                ),
                MaterialModel::Physical(m) => {
                    effect_facts.gather_physical(m, &format!("materials[{i}].model.physical"))
                }
            }
            let (path, even) = (
                || format!("materials[{i}]"),
                material.uniform_emission().is_some(),
            );
            let mut textures = material.textures().filter(|texture| texture.uv.is_none());
            if let Some(filtered) = textures.find_map(|texture| reduced.get(texture.name.as_str()))
            {
                record_first_use(&mut effect_facts.mip_maps, true, || {
                    format!("textures[{filtered}].filter")
                });
            }
            record_first_use(&mut effect_facts.even_emission, even, path);
            record_first_use(
                &mut effect_facts.varied_emission,
                !even && material.emits(),
                path,
            );
        }
        effect_facts.gather_unread_extensions(scene, &used);
        for (i, light) in scene
            .lights
            .iter()
            .enumerate()
            .filter(|(_, l)| l.colour != Colour::BLACK)
        {
            let path = || format!("lights[{i}]");
            record_first_use(&mut effect_facts.light, true, path);
            record_first_use(&mut effect_facts.shadowing_light, light.shadows, path);
            record_first_use(&mut effect_facts.glossy_light, light.specular, path);
        }
        match &scene.sky {
            None => {}
            Some(Sky::Map(_)) => {
                record_first_use(&mut effect_facts.sky_map, true, || "sky.map".to_owned())
            }
            Some(Sky::Expression(_)) => record_first_use(&mut effect_facts.program, true, || {
                "sky.expression".to_owned()
            }),
            // A studio has no ground below an unbounded object.
            Some(Sky::Studio(studio)) => {
                let ground = studio.ground && effect_facts.unbounded_shape.is_none();
                record_first_use(&mut effect_facts.ground, ground, || {
                    "sky.studio.ground".to_owned()
                });
            }
            Some(Sky::Constant(_) | Sky::Gradient { .. }) => {}
        }
        record_first_use(&mut effect_facts.sky, scene.sky.is_some(), || {
            "sky".to_owned()
        });
        let lens = |c: &Camera| matches!(&c.projection, Projection::ThinLens { aperture_radius, .. } if *aperture_radius > 0.0);
        record_first_use(&mut effect_facts.lens, camera.is_some_and(lens), || {
            "cameras".to_owned()
        });
        record_first_use(
            &mut effect_facts.motion,
            camera.is_some_and(camera_moves),
            || "cameras".to_owned(),
        );
        record_first_use(
            &mut effect_facts.exposure,
            camera.and_then(shutter_interval).is_some(),
            || "cameras".to_owned(),
        );
        effect_facts.instant = effect_facts.exposure.is_none()
            && camera.is_some_and(|camera| camera.shutter.is_some());
        effect_facts
    }

    /// Gathers the properties that the scene format cannot represent, with the materials that have
    /// them.
    fn gather_unread_extensions(&mut self, scene: &Scene, used: &BTreeSet<&str>) {
        const MOST: usize = 3;
        let mut parts: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for part in scene
            .unread
            .iter()
            .filter(|part| used.contains(part.material.as_str()))
        {
            let place = || {
                scene
                    .materials
                    .iter()
                    .position(|material| material.name == part.material)
            };
            if self.unread_material.is_none() {
                self.unread_material = place().map(|i| format!("materials[{i}]"));
            }
            parts.entry(&part.label).or_default().push(&part.material);
        }
        let listed = parts.into_iter().map(|(label, materials)| {
            let names: Vec<String> = materials
                .iter()
                .take(MOST)
                .map(|name| format!("`{name}`"))
                .collect();
            let more = materials.len().saturating_sub(MOST);
            let more = if more > 0 {
                format!(" and {more} more")
            } else {
                String::new()
            };
            format!("{label} of {}{more}", names.join(", "))
        });
        self.unread_extensions = listed.collect::<Vec<_>>().join("; ");
    }

    /// Gathers the facts of all listed objects, and of the object of each generator.
    fn gather_objects(&mut self, scene: &Scene) {
        let lookup = SceneLookup::new(scene);
        let listed = scene
            .objects
            .iter()
            .enumerate()
            .map(|(i, object)| (("objects", i, ""), object));
        let repeated = scene
            .generators
            .iter()
            .enumerate()
            .map(|(i, generator)| (("generators", i, ".object"), &generator.object));
        let mut shown = HashSet::new();
        for ((list, i, within), object) in listed.chain(repeated) {
            let path = || format!("{list}[{i}]{within}");
            record_first_use(&mut self.occluder, object.casts_shadow, path);
            let unbounded = matches!(
                object.shape,
                Shape::Plane { .. } | Shape::Cylinder { height: None, .. }
            );
            record_first_use(&mut self.unbounded_shape, unbounded, || {
                format!("{}.shape", path())
            });
            record_first_use(
                &mut self.motion,
                object_transforms_at_ends(object).is_some(),
                || format!("{}.transform_end", path()),
            );
            let Shape::Mesh(name) = &object.shape else {
                continue;
            };
            record_first_use(&mut self.mesh, true, || format!("{}.shape.mesh", path()));
            // Only objects with the same rule for sides share a stored mesh.
            record_first_use(
                &mut self.instance,
                !shown.insert((name, object.side)),
                || format!("{}.shape.mesh", path()),
            );
            let smooth = lookup
                .mesh_data(name)
                .is_some_and(|data| !data.normals.is_empty());
            record_first_use(&mut self.smooth_normals, smooth, || {
                format!("{}.shape.mesh", path())
            });
        }
    }

    fn gather_input(&mut self, input: &dyn FieldValue, path: impl Fn() -> String) {
        record_first_use(&mut self.program, input.expression().is_some(), &path);
        record_first_use(&mut self.image, input.texture().is_some(), &path);
        record_first_use(
            &mut self.checker,
            input.checker().is_some_and(|c| c.even != c.odd),
            &path,
        );
    }

    fn gather_weight(&mut self, weight: &ScalarFactor, path: impl Fn() -> String) -> bool {
        record_first_use(
            &mut self.program,
            matches!(weight, ScalarFactor::Expression(_)),
            path,
        );
        *weight != ScalarFactor::Number(0.0)
    }

    fn gather_classic(&mut self, m: &ClassicMaterial, rules: &ClassicRules, path: &str) {
        let at = |field: &str| format!("{path}.{field}");
        // A reflecting or transmitting surface may show its local term alone at the end of a path.
        let passes_on = m.reflection.is_some() || m.transmission.is_some();
        let alone = passes_on && rules.depth_limit == DepthLimit::LocalOnly;
        let local = self.gather_weight(&m.local, || at("local")) || alone;
        self.gather_input(&m.colour, || at("colour"));
        let diffuse = self.gather_weight(&m.diffuse, || at("diffuse"));
        record_first_use(
            &mut self.ambient,
            local && m.ambient.unwrap_or(rules.ambient) != Colour::BLACK,
            || match m.ambient {
                Some(_) => at("ambient"),
                None => "classic.ambient".to_owned(),
            },
        );
        record_first_use(&mut self.lit_surface, local && diffuse, || at("diffuse"));
        if let Some(s) = &m.specular {
            let strong = self.gather_weight(&s.strength, || at("specular.strength"));
            record_first_use(
                &mut self.highlight,
                strong && (local || s.on_reflection),
                || at("specular"),
            );
        }
        if let Some(r) = &m.rim {
            let strong = self.gather_weight(&r.strength, || at("rim.strength"));
            record_first_use(&mut self.rim, strong && local, || at("rim"));
        }
        if let Some(r) = &m.reflection {
            let strong = self.gather_weight(&r.weight, || at("reflection.weight"));
            record_first_use(&mut self.reflection, strong, || at("reflection"));
            record_first_use(
                &mut self.fuzz,
                strong && r.fuzz.as_ref().is_some_and(|f| f.amount != 0.0),
                || at("reflection.fuzz"),
            );
        }
        record_first_use(&mut self.refraction, m.transmission.is_some(), || {
            at("transmission")
        });
        if let Some(shadow) = &m.shadow {
            self.gather_weight(shadow, || at("shadow"));
        }
        if let Some(mixture) = &m.mixture {
            let bends = mixture.refraction_chance > 0.0;
            record_first_use(&mut self.mixture, true, || at("mixture"));
            record_first_use(
                &mut self.absorption,
                bends && mixture.absorption != Colour::BLACK,
                || at("mixture.absorption"),
            );
        }
        if let Some(emission) = &m.emission {
            self.gather_input(emission, || at("emission"));
            record_first_use(
                &mut self.emission,
                *emission != ColourInput::Constant(Colour::BLACK),
                || at("emission"),
            );
        }
    }

    fn gather_physical(&mut self, m: &Physical, path: &str) {
        let at = |field: &str| format!("{path}.{field}");
        record_first_use(&mut self.physical, true, || path.to_owned());
        m.fields()
            .into_iter()
            .for_each(|field| self.gather_input(field.value, || at(&field.to_string())));
        record_first_use(&mut self.vertex_colours, m.vertex_colours, || {
            at("vertex_colours")
        });
        record_first_use(&mut self.alpha, m.alpha != AlphaMode::Opaque, || {
            at("alpha")
        });
        record_first_use(&mut self.emission, m.active_emission().is_some(), || {
            at("emission")
        });
        record_first_use(&mut self.unlit_material, m.unlit, || at("unlit"));
        if m.unlit {
            return;
        }
        let textured = m.metallic_roughness_texture.is_some();
        // A varying roughness may have any value somewhere.
        let varies = textured || m.roughness.constant().is_none();
        let smooth = m
            .roughness
            .constant()
            .is_some_and(|roughness| roughness <= MIRROR_ROUGHNESS);
        let plain = textured || m.metallic.constant().is_none_or(|metallic| metallic < 1.0);
        let clear = m.may_transmit() && plain;
        // A surface that transmits all light everywhere diffuses none.
        let all_passes =
            m.may_transmit() && m.transmission == 1.0.into() && m.transmission_texture.is_none();
        record_first_use(&mut self.lit_surface, true, || path.to_owned());
        record_first_use(
            &mut self.normal_map,
            m.active_normal_map().is_some(),
            || at("normal_texture"),
        );
        record_first_use(&mut self.lit_physical, true, || path.to_owned());
        record_first_use(&mut self.highlight, true, || at("roughness"));
        record_first_use(&mut self.reflection, smooth || varies || clear, || {
            at("roughness")
        });
        record_first_use(&mut self.rough_reflection, !smooth, || at("roughness"));
        record_first_use(&mut self.refraction, clear, || at("transmission"));
        record_first_use(&mut self.rough_refraction, clear && !smooth, || {
            at("transmission")
        });
        record_first_use(&mut self.absorption, m.absorption().is_some(), || {
            at("attenuation_distance")
        });
        record_first_use(&mut self.nested_body, m.has_priority() && plain, || {
            at("priority")
        });
        self.layers.add_material(m, [plain, clear], &at);
        record_first_use(&mut self.diffuse_physical, plain && !all_passes, || {
            at("base_colour")
        });
    }
}
