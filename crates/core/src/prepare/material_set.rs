//! Preparation of all materials of a scene. The results are entries of common tables.

use glam::DVec3;
use raywright_bvh::{Occlusion, Real};

use super::PreparedMedium;
use super::context::PrepareContext;
use super::error::{PrepareError, check_cancelled};
use super::geometry::GeometryNeeds;
use super::inputs::{InputCompiler, InputDependencies};
use super::material::{
    LayeredInputs, MaterialContext, PreparedMaterial, prepare_material, required_tables,
};
use crate::scene::{MOST_UV_SETS, Material, ShadowRule};
use crate::settings::{AreaShadows, MicrofacetEnergy};
use crate::texture::InputTables;

/// The prepared materials of a scene and their common tables.
pub(super) struct MaterialSet<R: Real> {
    /// The materials in the order of the scene.
    pub materials: Vec<PreparedMaterial<R>>,
    /// Layers of the materials that have layers.
    pub layers: Vec<LayeredInputs<R>>,
    /// Media of bodies that scatter light, and the medium of the air.
    pub media: Vec<PreparedMedium>,
    pub air: Option<PreparedMedium>,
    /// Tables of the materials' inputs.
    pub texture_tables: InputTables<R>,
    /// Whether each material reads the texture coordinates of a surface.
    reads_coordinates: Vec<bool>,
}

impl<R: Real> MaterialSet<R> {
    /// Prepares the materials that objects use. `object_materials` holds the index of each
    /// object's material.
    ///
    /// # Errors
    /// Inputs that do not compile, and [`PrepareError::Cancelled`].
    pub fn prepare(
        context: &PrepareContext<'_>,
        object_materials: &[u32],
    ) -> Result<Self, PrepareError> {
        let (scene, settings) = (context.scene, context.settings);
        let mut used = vec![false; scene.materials.len()];
        object_materials
            .iter()
            .for_each(|&material| used[material as usize] = true);
        let mut material_context = MaterialContext {
            layers: Vec::new(),
            media: Vec::new(),
            material: 0,
            is_path_tracing: context.is_path_tracing,
            disabled_effects: settings.without,
            fresnel: settings.fresnel,
            multiple_scattering: settings.microfacets == MicrofacetEnergy::Compensated,
        };
        let mut inputs =
            InputCompiler::new(context.constants, context.lookup, context.origin.origin);
        let mut materials = Vec::with_capacity(scene.materials.len());
        let mut reads_coordinates = Vec::with_capacity(scene.materials.len());
        for (index, material) in scene.materials.iter().enumerate() {
            check_cancelled(context.observer)?;
            let first = inputs.texture_tables.textures.len() as u32;
            inputs.dependencies = InputDependencies::default();
            materials.push(if used[index] {
                prepare_material(material, index, scene, &mut inputs, &mut material_context)?
            } else {
                PreparedMaterial::Unused
            });
            inputs
                .texture_tables
                .material_textures
                .push(first..inputs.texture_tables.textures.len() as u32);
            reads_coordinates.push(inputs.dependencies.coordinates);
        }
        inputs.path = "air".to_owned();
        let air = scene.air.as_ref().filter(|_| context.is_path_tracing);
        let air = air
            .map(|medium| PreparedMedium::new(medium, None, &mut inputs, ""))
            .transpose()?
            .filter(|medium| medium.majorant != DVec3::ZERO);
        required_tables(&material_context.layers).compute_tables();
        Ok(Self {
            materials,
            layers: material_context.layers,
            media: material_context.media,
            air,
            texture_tables: inputs.texture_tables,
            reads_coordinates,
        })
    }

    /// Returns for each material which properties of a hit the geometry must provide.
    pub fn geometry_needs(&self, context: &PrepareContext<'_>) -> Vec<GeometryNeeds> {
        // The order or the distance of occluders matters to some rules of shadows. Shadow rays
        // then visit all occluders.
        let visits_all_occluders = context.scene.classic.shadow == ShadowRule::FirstInOrder
            || self
                .materials
                .iter()
                .any(PreparedMaterial::reads_occluder_distance);
        self.materials
            .iter()
            .zip(&context.scene.materials)
            .zip(&self.reads_coordinates)
            .map(|((prepared, material), &reads_coordinates)| {
                let blocks_light = if context.is_path_tracing {
                    prepared.blocks_straight_rays()
                } else {
                    prepared.is_opaque() && !visits_all_occluders
                };
                GeometryNeeds {
                    needs_uv: reads_coordinates,
                    needs_tangents: prepared.needs_tangents(&self.layers),
                    uv_sets: uv_set_mask(material, reads_coordinates),
                    ..occlusion_needs(prepared, context, blocks_light)
                }
            })
            .collect()
    }

    /// Whether any material absorbs light inside the body that it encloses.
    pub fn has_absorbing_material(&self) -> bool {
        self.materials
            .iter()
            .any(|material| material.absorption().is_some())
    }
}

/// Returns how objects of a material affect shadow rays. `blocks_light` is whether such an object
/// blocks all light. Shadow rays then end at the object without evaluating its material.
fn occlusion_needs<R: Real>(
    material: &PreparedMaterial<R>,
    context: &PrepareContext<'_>,
    blocks_light: bool,
) -> GeometryNeeds {
    // For hard shadows, a ray to a lamp's centre passes through the lamp's own surface.
    let is_lamp_passed = context.settings.area_shadows == AreaShadows::Hard && material.emits();
    GeometryNeeds {
        occlusion: if blocks_light && !is_lamp_passed {
            Occlusion::Opaque
        } else {
            Occlusion::Filtered
        },
        // A path tracer filters each hit by the kind of light: objects without a shadow still
        // block the light of emitters and of the sky.
        without_shadow: if context.is_path_tracing {
            Occlusion::Filtered
        } else {
            Occlusion::None
        },
        needs_uv: false,
        uv_sets: 0,
        needs_tangents: false,
    }
}

/// Returns a bit mask of the sets of texture coordinates that a material reads. Expressions read
/// set 0. Shapes other than meshes have only this set.
fn uv_set_mask(material: &Material, reads_coordinates: bool) -> u8 {
    material
        .uv_sets()
        .into_iter()
        .filter(|&set| (set as usize) < MOST_UV_SETS)
        .fold(u8::from(reads_coordinates), |bits, set| bits | 1 << set)
}
