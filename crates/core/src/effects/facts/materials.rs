//! Facts about the materials that objects use.

use std::collections::{BTreeMap, BTreeSet};

use super::{EffectFacts, MIRROR_ROUGHNESS, record_first_use};
use crate::scene::{
    AlphaMode, Boundary, ClassicMaterial, ClassicRules, Colour, ColourInput, DepthLimit,
    FieldValue, MaterialFields, MaterialModel, Medium, Physical, ScalarFactor, Scene,
    TextureFilter,
};

impl EffectFacts {
    /// Gathers the facts of the materials whose names `used` contains.
    pub(super) fn gather_materials(&mut self, scene: &Scene, used: &BTreeSet<&str>) {
        let mipmap_textures: BTreeMap<&str, usize> = scene
            .textures
            .iter()
            .enumerate()
            .filter(|(_, texture)| texture.filter == TextureFilter::Mipmaps)
            .map(|(i, texture)| (texture.name.as_str(), i))
            .collect();
        for (i, material) in scene
            .materials
            .iter()
            .enumerate()
            .filter(|(_, material)| used.contains(material.name.as_str()))
        {
            match &material.model {
                MaterialModel::Classic(m) => {
                    self.gather_classic(m, &scene.classic, &format!("materials[{i}].model.classic"))
                }
                MaterialModel::Physical(m) => {
                    self.gather_physical(m, &format!("materials[{i}].model.physical"));
                }
            }
            let mut textures = material.textures().filter(|texture| texture.uv.is_none());
            if let Some(filtered) =
                textures.find_map(|texture| mipmap_textures.get(texture.name.as_str()))
            {
                record_first_use(&mut self.mip_maps, true, || {
                    format!("textures[{filtered}].filter")
                });
            }
            let path = || format!("materials[{i}]");
            let is_uniform = material.uniform_emission().is_some();
            record_first_use(&mut self.even_emission, is_uniform, path);
            record_first_use(
                &mut self.varied_emission,
                !is_uniform && material.emits(),
                path,
            );
        }
    }

    /// Gathers the facts of a material's input: its expression, image or checkerboard.
    fn gather_input(&mut self, input: &dyn FieldValue, path: impl Fn() -> String) {
        record_first_use(&mut self.program, input.expression().is_some(), &path);
        record_first_use(&mut self.image, input.texture().is_some(), &path);
        record_first_use(
            &mut self.checker,
            input.checker().is_some_and(|c| c.even != c.odd),
            &path,
        );
    }

    /// Gathers the facts of a weight. Returns whether the weight may differ from zero.
    fn gather_weight(&mut self, weight: &ScalarFactor, path: impl Fn() -> String) -> bool {
        record_first_use(
            &mut self.program,
            matches!(weight, ScalarFactor::Expression(_)),
            path,
        );
        *weight != ScalarFactor::Number(0.0)
    }

    /// Gathers the facts of a classic material at a path of the scene file.
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

    /// Gathers the facts of a medium at a path of the scene file. A medium receives light as a
    /// surface does.
    pub(super) fn gather_medium(&mut self, medium: &Medium, path: &str) {
        let is_clear = medium.coefficients() == [[0.0; 3]; 2];
        for slot in [&mut self.medium, &mut self.lit_surface] {
            record_first_use(slot, !is_clear, || path.to_owned());
        }
        self.gather_weight(&medium.density, || format!("{path}.density"));
    }

    /// Gathers the facts of a physical material at a path of the scene file.
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
        record_first_use(&mut self.absorption, m.absorption().is_some(), || {
            at(match &m.interior {
                Some(_) => "interior",
                None => "attenuation_distance",
            })
        });
        if let Some(medium) = m.scattering_medium() {
            self.gather_medium(medium, &at("interior"));
        }
        if m.boundary == Boundary::None {
            record_first_use(&mut self.nested_body, m.has_priority(), || at("priority"));
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
        record_first_use(&mut self.nested_body, m.has_priority() && plain, || {
            at("priority")
        });
        self.layers.add_material(m, [plain, clear], &at);
        record_first_use(&mut self.diffuse_physical, plain && !all_passes, || {
            at("base_colour")
        });
    }
}

// Layers of physical materials, each with the path of its first use.

/// Function that returns whether a physical material has a layer. The two flags are whether part of
/// the material may be non-metallic, and whether that part may transmit light.
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
pub(in crate::effects) struct LayerFirstUses(BTreeMap<&'static str, String>);

impl LayerFirstUses {
    /// Records the layers of a material. `parts` holds the flags of [`LayerPredicate`]. `at`
    /// returns the path of a material's field in the scene file.
    pub(super) fn add_material(
        &mut self,
        m: &Physical,
        parts: [bool; 2],
        at: &dyn Fn(&str) -> String,
    ) {
        for (key, _) in LAYERS.iter().filter(|(_, has)| has(m, parts)) {
            self.0.entry(key).or_insert_with(|| at(key));
        }
    }

    /// Returns the path in the scene file at which a layer is first used, or `None`.
    pub fn first_use(&self, key: &str) -> Option<&String> {
        self.0.get(key)
    }
}
