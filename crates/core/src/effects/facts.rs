//! Facts about the visible part of a scene: for each feature, the path of its first use in the
//! scene file.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use crate::generate::count_of;
use crate::lookup::SceneLookup;
use crate::motion::{camera_moves, ends, exposure};
use crate::scene::{
    AlphaMode, Camera, Classic, ClassicRules, Colour, ColourInput, DepthLimit, FieldValue, Filter,
    MaterialFields, Model, Physical, Projection, Scene, Shape, Sky, Weight,
};

/// Path, in the scene file, of the first use of a feature; `None` if the scene does not use it.
type EffectPath = Option<String>;

/// Perceptual roughness up to which Whitted shading traces a reflection as a mirror's.
pub(crate) const MIRROR_ROUGHNESS: f64 = 0.05;

#[derive(Clone, Debug, Default)]
pub(super) struct EffectFacts {
    pub ambient: EffectPath,
    pub lit: EffectPath,
    pub light: EffectPath,
    pub shadowing_light: EffectPath,
    pub glossy_light: EffectPath,
    pub occluder: EffectPath,
    pub highlight: EffectPath,
    pub rim: EffectPath,
    pub reflection: EffectPath,
    pub fuzz: EffectPath,
    pub refraction: EffectPath,
    /// Surfaces that reflect, transmit or diffuse each ray at random, in the given proportions.
    pub mixture: EffectPath,
    pub absorption: EffectPath,
    /// Bodies with a priority, which decides between overlapping bodies.
    pub nested: EffectPath,
    pub rough_reflection: EffectPath,
    pub rough_refraction: EffectPath,
    /// Layers over, under and in surfaces.
    pub layers: LayerFacts,
    /// Physical surfaces that light illuminates.
    pub lit_physical: EffectPath,
    pub diffuse_physical: EffectPath,
    pub alpha: EffectPath,
    pub emission: EffectPath,
    pub even_emission: EffectPath,
    pub varied_emission: EffectPath,
    pub unlit: EffectPath,
    pub image: EffectPath,
    /// Filter of a texture with mipmaps.
    pub mip_maps: EffectPath,
    pub program: EffectPath,
    pub checker: EffectPath,
    pub vertex_colours: EffectPath,
    pub smooth_normals: EffectPath,
    pub normal_map: EffectPath,
    pub mesh: EffectPath,
    pub physical: EffectPath,
    pub instance: EffectPath,
    pub unbounded: EffectPath,
    pub sky: EffectPath,
    pub sky_map: EffectPath,
    /// Studio whose ground shows shadows.
    pub ground: EffectPath,
    /// First material of an imported file with properties that the scene format cannot represent.
    pub unread: EffectPath,
    /// Properties that the scene format cannot represent, with the names of the materials.
    pub unread_parts: String,
    pub lens: EffectPath,
    pub motion: EffectPath,
    /// Shutter that is open for some time.
    pub exposure: EffectPath,
    /// Whether the shutter opens and closes at the same instant: the picture shows that instant,
    /// and no motion is left out.
    pub instant: bool,
}

/// Function that returns whether a physical material has a layer. The flags are whether a part of
/// the material may be non-metallic, and whether a non-metallic part may transmit.
type HasLayer = fn(&Physical, [bool; 2]) -> bool;

/// Keys of the layers over, under and in surfaces, each with the function that detects it.
const LAYERS: [(&str, HasLayer); 9] = [
    ("thin_walled", |m, [_, clear]| m.thin_walled && clear),
    ("specular", |m, [plain, _]| m.tints_reflections() && plain),
    ("conductor", |m, _| m.metal().is_some()),
    ("clearcoat", |m, _| m.coat().is_some()),
    ("sheen", |m, _| m.fibres().is_some()),
    ("anisotropy", |m, _| m.active_anisotropy().is_some()),
    ("iridescence", |m, _| m.film().is_some()),
    ("dispersion", |m, [_, clear]| {
        m.dispersion > 0.0 && clear && !m.thin_walled
    }),
    ("diffuse_transmission", |m, [plain, _]| {
        m.may_diffuse_through() && plain
    }),
];

/// Layers of a scene's materials, each with the path of its first use.
#[derive(Clone, Debug, Default)]
pub(super) struct LayerFacts(BTreeMap<&'static str, String>);

impl LayerFacts {
    /// Adds the layers of a material. `parts` are the flags of [`HasLayer`]; `at` returns the path
    /// of a field.
    fn gather(&mut self, m: &Physical, parts: [bool; 2], at: &dyn Fn(&str) -> String) {
        for (key, _) in LAYERS.iter().filter(|(_, has)| has(m, parts)) {
            self.0.entry(key).or_insert_with(|| at(key));
        }
    }

    /// Returns the path of a layer's first use, or `None`.
    pub fn source(&self, key: &str) -> Option<&String> {
        self.0.get(key)
    }
}

fn record(slot: &mut EffectPath, present: bool, path: impl FnOnce() -> String) {
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
    pub fn lit_by_lights(&self) -> Option<&String> {
        self.lit.as_ref().and(self.light.as_ref())
    }

    pub fn highlights(&self) -> Option<&String> {
        self.glossy_light.as_ref().and(self.highlight.as_ref())
    }

    pub fn shadowed(&self) -> Option<&String> {
        let responsive = self.lit_by_lights().or(self.highlights());
        responsive
            .and(self.occluder.as_ref())
            .and(self.shadowing_light.as_ref())
    }

    /// Returns the cause `own` of an effect or, under path tracing, the path of a layer that needs
    /// the effect.
    pub fn with_layer<'a>(
        &'a self,
        own: &'a EffectPath,
        layer: &str,
        paths: bool,
    ) -> Option<&'a String> {
        own.as_ref()
            .or_else(|| self.layers.source(layer).filter(|_| paths))
    }

    /// Returns the path of a surface on which the light of emissive surfaces is visible.
    pub fn lit_by(&self, paths: bool) -> Option<&String> {
        self.lit
            .as_ref()
            .or(self.highlight.as_ref().filter(|_| paths))
    }

    /// Returns the path of a surface on which the light of the sky is visible.
    pub fn receives(&self, paths: bool) -> Option<&String> {
        if paths {
            self.lit_by(true)
        } else {
            self.lit_physical.as_ref()
        }
    }

    /// Returns the path of a surface that diffuses light to other surfaces.
    pub fn diffuses(&self, paths: bool) -> Option<&String> {
        if paths {
            self.lit.as_ref()
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
        effect_facts.objects(scene);
        for (i, generator) in scene.generators.iter().enumerate() {
            let repeated =
                matches!(generator.object.shape, Shape::Mesh(_)) && count_of(&generator.kind) > 1;
            record(&mut effect_facts.instance, repeated, || {
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
            .filter(|(_, texture)| texture.filter == Filter::Mipmaps);
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
                Model::Classic(m) => effect_facts.classic(
                    m,
                    &scene.classic,
                    &format!("materials[{i}].model.classic"),
                ),
                Model::Physical(m) => {
                    effect_facts.physical(m, &format!("materials[{i}].model.physical"))
                }
            }
            let (path, even) = (
                || format!("materials[{i}]"),
                material.even_emission().is_some(),
            );
            let mut textures = material.textures().filter(|texture| texture.uv.is_none());
            if let Some(filtered) = textures.find_map(|texture| reduced.get(texture.name.as_str()))
            {
                record(&mut effect_facts.mip_maps, true, || {
                    format!("textures[{filtered}].filter")
                });
            }
            record(&mut effect_facts.even_emission, even, path);
            record(
                &mut effect_facts.varied_emission,
                !even && material.emits(),
                path,
            );
        }
        effect_facts.unread(scene, &used);
        for (i, light) in scene
            .lights
            .iter()
            .enumerate()
            .filter(|(_, l)| l.colour != Colour::BLACK)
        {
            let path = || format!("lights[{i}]");
            record(&mut effect_facts.light, true, path);
            record(&mut effect_facts.shadowing_light, light.shadows, path);
            record(&mut effect_facts.glossy_light, light.specular, path);
        }
        match &scene.sky {
            None => {}
            Some(Sky::Map(_)) => record(&mut effect_facts.sky_map, true, || "sky.map".to_owned()),
            Some(Sky::Expression(_)) => record(&mut effect_facts.program, true, || {
                "sky.expression".to_owned()
            }),
            // A studio has no ground below an unbounded object.
            Some(Sky::Studio(studio)) => {
                let ground = studio.ground && effect_facts.unbounded.is_none();
                record(&mut effect_facts.ground, ground, || {
                    "sky.studio.ground".to_owned()
                });
            }
            Some(Sky::Constant(_) | Sky::Gradient { .. }) => {}
        }
        record(&mut effect_facts.sky, scene.sky.is_some(), || {
            "sky".to_owned()
        });
        let lens = |c: &Camera| matches!(&c.projection, Projection::ThinLens { aperture_radius, .. } if *aperture_radius > 0.0);
        record(&mut effect_facts.lens, camera.is_some_and(lens), || {
            "cameras".to_owned()
        });
        record(
            &mut effect_facts.motion,
            camera.is_some_and(camera_moves),
            || "cameras".to_owned(),
        );
        record(
            &mut effect_facts.exposure,
            camera.and_then(exposure).is_some(),
            || "cameras".to_owned(),
        );
        effect_facts.instant = effect_facts.exposure.is_none()
            && camera.is_some_and(|camera| camera.shutter.is_some());
        effect_facts
    }

    /// Gathers the properties that the scene format cannot represent, with the materials that have
    /// them.
    fn unread(&mut self, scene: &Scene, used: &BTreeSet<&str>) {
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
            if self.unread.is_none() {
                self.unread = place().map(|i| format!("materials[{i}]"));
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
        self.unread_parts = listed.collect::<Vec<_>>().join("; ");
    }

    /// Gathers the facts of all listed objects, and of the object of each generator.
    fn objects(&mut self, scene: &Scene) {
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
            record(&mut self.occluder, object.casts_shadow, path);
            let unbounded = matches!(
                object.shape,
                Shape::Plane { .. } | Shape::Cylinder { height: None, .. }
            );
            record(&mut self.unbounded, unbounded, || {
                format!("{}.shape", path())
            });
            record(&mut self.motion, ends(object).is_some(), || {
                format!("{}.transform_end", path())
            });
            let Shape::Mesh(name) = &object.shape else {
                continue;
            };
            record(&mut self.mesh, true, || format!("{}.shape.mesh", path()));
            // Only objects with the same rule for sides share a stored mesh.
            record(
                &mut self.instance,
                !shown.insert((name, object.side)),
                || format!("{}.shape.mesh", path()),
            );
            let smooth = lookup
                .mesh_data(name)
                .is_some_and(|data| !data.normals.is_empty());
            record(&mut self.smooth_normals, smooth, || {
                format!("{}.shape.mesh", path())
            });
        }
    }

    fn input(&mut self, input: &dyn FieldValue, path: impl Fn() -> String) {
        record(&mut self.program, input.expression().is_some(), &path);
        record(&mut self.image, input.texture().is_some(), &path);
        record(
            &mut self.checker,
            input.checker().is_some_and(|c| c.even != c.odd),
            &path,
        );
    }

    fn weight(&mut self, weight: &Weight, path: impl Fn() -> String) -> bool {
        record(
            &mut self.program,
            matches!(weight, Weight::Expression(_)),
            path,
        );
        *weight != Weight::Number(0.0)
    }

    fn classic(&mut self, m: &Classic, rules: &ClassicRules, path: &str) {
        let at = |field: &str| format!("{path}.{field}");
        // A reflecting or transmitting surface may show its local term alone at the end of a path.
        let passes_on = m.reflection.is_some() || m.transmission.is_some();
        let alone = passes_on && rules.depth_limit == DepthLimit::LocalOnly;
        let local = self.weight(&m.local, || at("local")) || alone;
        self.input(&m.colour, || at("colour"));
        let diffuse = self.weight(&m.diffuse, || at("diffuse"));
        record(
            &mut self.ambient,
            local && m.ambient.unwrap_or(rules.ambient) != Colour::BLACK,
            || match m.ambient {
                Some(_) => at("ambient"),
                None => "classic.ambient".to_owned(),
            },
        );
        record(&mut self.lit, local && diffuse, || at("diffuse"));
        if let Some(s) = &m.specular {
            let strong = self.weight(&s.strength, || at("specular.strength"));
            record(
                &mut self.highlight,
                strong && (local || s.on_reflection),
                || at("specular"),
            );
        }
        if let Some(r) = &m.rim {
            let strong = self.weight(&r.strength, || at("rim.strength"));
            record(&mut self.rim, strong && local, || at("rim"));
        }
        if let Some(r) = &m.reflection {
            let strong = self.weight(&r.weight, || at("reflection.weight"));
            record(&mut self.reflection, strong, || at("reflection"));
            record(
                &mut self.fuzz,
                strong && r.fuzz.as_ref().is_some_and(|f| f.amount != 0.0),
                || at("reflection.fuzz"),
            );
        }
        record(&mut self.refraction, m.transmission.is_some(), || {
            at("transmission")
        });
        if let Some(shadow) = &m.shadow {
            self.weight(shadow, || at("shadow"));
        }
        if let Some(mixture) = &m.mixture {
            let bends = mixture.refraction_chance > 0.0;
            record(&mut self.mixture, true, || at("mixture"));
            record(
                &mut self.absorption,
                bends && mixture.absorption != Colour::BLACK,
                || at("mixture.absorption"),
            );
        }
        if let Some(emission) = &m.emission {
            self.input(emission, || at("emission"));
            record(
                &mut self.emission,
                *emission != ColourInput::Constant(Colour::BLACK),
                || at("emission"),
            );
        }
    }

    fn physical(&mut self, m: &Physical, path: &str) {
        let at = |field: &str| format!("{path}.{field}");
        record(&mut self.physical, true, || path.to_owned());
        m.fields()
            .into_iter()
            .for_each(|field| self.input(field.value, || at(&field.to_string())));
        record(&mut self.vertex_colours, m.vertex_colours, || {
            at("vertex_colours")
        });
        record(&mut self.alpha, m.alpha != AlphaMode::Opaque, || {
            at("alpha")
        });
        record(&mut self.emission, m.gives_off().is_some(), || {
            at("emission")
        });
        record(&mut self.unlit, m.unlit, || at("unlit"));
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
        record(&mut self.lit, true, || path.to_owned());
        record(&mut self.normal_map, m.bent_by().is_some(), || {
            at("normal_texture")
        });
        record(&mut self.lit_physical, true, || path.to_owned());
        record(&mut self.highlight, true, || at("roughness"));
        record(&mut self.reflection, smooth || varies || clear, || {
            at("roughness")
        });
        record(&mut self.rough_reflection, !smooth, || at("roughness"));
        record(&mut self.refraction, clear, || at("transmission"));
        record(&mut self.rough_refraction, clear && !smooth, || {
            at("transmission")
        });
        record(&mut self.absorption, m.absorption().is_some(), || {
            at("attenuation_distance")
        });
        record(&mut self.nested, m.is_nested() && plain, || at("priority"));
        self.layers.gather(m, [plain, clear], &at);
        record(&mut self.diffuse_physical, plain && !all_passes, || {
            at("base_colour")
        });
    }
}
