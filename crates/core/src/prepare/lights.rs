//! Preparation of a scene's lights: delta lights, area lights and the sky, with their samplers.

use raywright_bvh::{Aabb, Geometry, Real};

use super::context::PrepareContext;
use super::emitters::list_emitters;
use super::error::PrepareError;
use super::material_set::MaterialSet;
use crate::effects::Effect;
use crate::light::{
    DeltaLight, EmitterList, EmitterStrategy, Emitters, Irradiance, Lights, SkyRadiance,
};
use crate::settings::{LightSampling, Settings};
use crate::storage_origin::light_relative_to;

/// Prepares the lights of a scene. Samplers are built only for a path tracer.
///
/// # Errors
/// [`PrepareError::Cancelled`].
pub(super) fn prepare_lights<R: Real>(
    context: &PrepareContext<'_>,
    materials: &MaterialSet<R>,
    sky: SkyRadiance<R>,
    geometry: &Geometry<R>,
) -> Result<Lights<R>, PrepareError> {
    let emitters = prepare_emitters(context, materials)?;
    let bounds: Aabb = geometry.bounded_primitives_box();
    let mut lights = Lights::new(
        prepare_delta_lights(context),
        Emitters::new(emitters),
        sky,
        &bounds,
    );
    if context.is_path_tracing {
        lights.emitters.strategy = EmitterStrategy::SolidAngle;
        lights.emitters.find_triangles(geometry);
        if context.simulated.has(Effect::SkyLight) {
            build_sky_sampler(&mut lights, context.settings);
        }
        lights.build_light_sampler();
    }
    Ok(lights)
}

/// Lists the area lights of a scene; none if no effect needs area lights.
fn prepare_emitters<R: Real>(
    context: &PrepareContext<'_>,
    materials: &MaterialSet<R>,
) -> Result<EmitterList<R>, PrepareError> {
    let requested = context.emitter_filter();
    if !(requested.uniform || requested.varying) {
        return Ok(EmitterList::default());
    }
    list_emitters::<R>(
        (context.scene, context.origin.origin),
        context.lookup,
        (&materials.materials, &materials.texture_tables),
        requested,
        context.observer,
    )
}

/// Returns the delta lights of a scene. Lights whose effect is switched off are left out, so no
/// loop visits them.
fn prepare_delta_lights<R: Real>(context: &PrepareContext<'_>) -> Vec<DeltaLight<R>> {
    let simulated = context.simulated;
    if !(simulated.has(Effect::DirectLight) || simulated.has(Effect::Highlights)) {
        return Vec::new();
    }
    context
        .scene
        .lights
        .iter()
        .map(|light| light_relative_to(context.origin.origin, light))
        .map(|light| DeltaLight::new(&light, simulated.has(Effect::Shadows)))
        .collect()
}

/// Builds the sampler of the sky in the form that the settings' sampling strategy needs.
pub(super) fn build_sky_sampler<R: Real>(lights: &mut Lights<R>, settings: &Settings) {
    lights.build_sky_sampler();
    if settings.light_sampling == LightSampling::Both {
        lights.sample_bright_excess();
    }
}

/// Returns the cosine-weighted mean of the sky's radiance; `None` if the integrator does not read
/// it.
pub(super) fn prepare_irradiance<R: Real>(
    context: &PrepareContext<'_>,
    sky: &SkyRadiance<R>,
) -> Option<Irradiance<R>> {
    let is_needed =
        context.simulated.has(Effect::SkyLight) && !context.is_path_tracing && !sky.is_black();
    is_needed.then(|| Irradiance::new(sky))
}
