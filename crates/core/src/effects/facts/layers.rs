//! Layers of physical materials, each with the path of its first use.

use std::collections::BTreeMap;

use crate::scene::Physical;

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
