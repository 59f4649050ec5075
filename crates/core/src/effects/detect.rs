//! From what a scene has and the settings to what is found of every effect.

mod list;
mod transport;

use self::list::FindingList;
use self::transport::{what_needs_a_path_tracer, what_paths_find};
use super::facts::{LayerFacts, SceneFacts};
use super::kind::LAYER_EFFECTS;
use super::{Effect, Finding, Status};
use crate::scene::Integrator;
use crate::settings::Settings;

/// The integrator that a scene calls for. One that says nothing has Whitted's, whose pictures take no chance and so no more samples than
/// edges need, where it leaves nothing out that paths find: of classic materials. Physical ones light each other.
pub(super) fn called_for(facts: &SceneFacts) -> Integrator {
    let mut lacks = FindingList::default();
    what_needs_a_path_tracer(&mut lacks, facts);
    let lacks = lacks.0.iter().any(|finding| finding.status == Status::LeftOut) || facts.layers.calls_for_paths();
    if lacks { Integrator::Path } else { Integrator::Whitted }
}

/// What a scene calls for, in the order of [`Effect::ALL`].
pub(super) fn found(facts: &SceneFacts, settings: &Settings, paths: bool) -> Vec<Finding> {
    let mut list = FindingList::default();
    light_at_a_surface(&mut list, facts, paths);
    further_segments(&mut list, facts, settings, paths);
    looks_of_surfaces(&mut list, facts);
    geometry_and_sky(&mut list, facts);
    sky_light(&mut list, facts, paths);
    layers(&mut list, &facts.layers, paths);
    what_files_say_more(&mut list, facts);
    list.lens(&facts.lens, settings);
    list.motion(facts, settings);
    emissive_surfaces(&mut list, facts, paths);
    if paths {
        what_paths_find(&mut list, facts);
    } else {
        what_needs_a_path_tracer(&mut list, facts);
    }
    list.0.sort_by_key(|finding| finding.effect);
    list.0
}

/// What light does where it first meets a surface.
fn light_at_a_surface(list: &mut FindingList, f: &SceneFacts, paths: bool) {
    let absent = "no surface has an ambient term";
    if paths {
        list.missing(Effect::AmbientLight, &f.ambient, "a constant light that comes from nowhere goes no way", absent, LOOKS);
    } else {
        list.plain(Effect::AmbientLight, &f.ambient, "a constant light reaches every surface", absent);
    }
    let lit = f.lit.as_ref().and(f.light.clone());
    list.plain(
        Effect::DirectLight,
        &lit,
        "lights shine on surfaces that answer to them",
        "no light meets a surface that answers to it",
    );
    let highlights = f.glossy_light.as_ref().and(f.highlight.clone());
    let answers = lit.as_ref().or(highlights.as_ref());
    let shadows = answers.and(f.shadowing_light.as_ref()).and(f.occluder.as_ref()).and(f.shadowing_light.clone());
    list.plain(
        Effect::Shadows,
        &shadows,
        "a light that casts shadows, a surface it shines on and something in between",
        "no light that casts shadows meets a surface and an occluder",
    );
    list.plain(
        Effect::Highlights,
        &highlights,
        "a light makes highlights on a glossy surface",
        "no light meets a glossy surface",
    );
    let absent = "no surface has a rim term";
    if paths {
        list.missing(Effect::RimLight, &f.rim, "light at grazing angles that comes from nowhere goes no way", absent, LOOKS);
    } else {
        list.plain(Effect::RimLight, &f.rim, "a surface is lit at grazing angles", absent);
    }
    list.plain(Effect::Emission, &f.emission, "a surface gives off light that is seen", "no surface gives off light");
    list.plain(Effect::UnlitSurfaces, &f.unlit, "a material shows its colour as it is", "every material answers to light");
}

/// What takes a path beyond its first hit.
fn further_segments(list: &mut FindingList, f: &SceneFacts, settings: &Settings, paths: bool) {
    // A smooth coat mirrors, and what is diffused to the other side goes through: for paths alone.
    let further = |own: &Option<String>, layer: Effect| own.clone().or_else(|| f.layers.source(layer).filter(|_| paths));
    let mirrors = further(&f.reflection, Effect::Clearcoat);
    list.traced(Effect::MirrorReflection, &mirrors, settings, "a smooth surface reflects", "no smooth surface reflects");
    let absent = "no reflection is disturbed";
    if paths {
        list.missing(Effect::FuzzyReflection, &f.fuzz, "a pattern that disturbs directions is no surface", absent, LOOKS);
    } else {
        list.traced(Effect::FuzzyReflection, &f.fuzz, settings, "a reflection is disturbed by a fixed pattern", absent);
    }
    let clear = further(&f.refraction, Effect::DiffuseTransmission);
    list.traced(Effect::Refraction, &clear, settings, "a surface transmits light", "no surface transmits light");
    list.plain(Effect::Transparency, &f.alpha, "a material has an alpha", "every material is opaque");
}

/// What tells one place of a surface from another.
fn looks_of_surfaces(list: &mut FindingList, f: &SceneFacts) {
    list.plain(
        Effect::PhysicalMaterials,
        &f.physical,
        "a surface follows the metallic-roughness model",
        "no surface follows the metallic-roughness model",
    );
    list.plain(Effect::ImageTextures, &f.image, "a material reads an image", "no material reads an image");
    list.plain(
        Effect::MipMaps,
        &f.mip_maps,
        "a texture asks for the mean over what a pixel covers",
        "no texture asks for them: the mean over a pixel is that of its samples",
    );
    list.plain(
        Effect::ProceduralTextures,
        &f.program,
        "an expression is evaluated per hit",
        "no expression is evaluated per hit",
    );
    list.plain(
        Effect::Checkerboard,
        &f.checker,
        "a material alternates between two colours",
        "no material alternates between two colours",
    );
    list.plain(
        Effect::VertexColours,
        &f.vertex_colours,
        "a mesh carries colours",
        "no mesh carries colours that a material reads",
    );
    list.plain(Effect::SmoothShading, &f.smooth_normals, "a mesh carries normals", "no mesh carries normals");
    list.plain(
        Effect::NormalMaps,
        &f.normal_map,
        "an image bends the normals of a surface",
        "no image bends the normals of a surface",
    );
}

/// What can be hit, and what is seen and gives light where nothing is.
fn geometry_and_sky(list: &mut FindingList, f: &SceneFacts) {
    list.plain(Effect::TriangleMeshes, &f.mesh, "an object shows a mesh", "no object shows a mesh");
    list.plain(
        Effect::Instances,
        &f.instance,
        "a mesh is shown more than once, and stored once",
        "no mesh is shown more than once",
    );
    list.plain(Effect::UnboundedShapes, &f.unbounded, "a shape without bounds is kept beside the tree", "every shape has bounds");
    list.plain(Effect::Sky, &f.sky, "rays that hit nothing see it", "rays that hit nothing see black");
    list.plain(Effect::EnvironmentMap, &f.sky_map, "the sky is a picture", "the sky is not a picture");
}

/// The sky, as surfaces receive it.
fn sky_light(list: &mut FindingList, f: &SceneFacts, paths: bool) {
    if paths {
        let receiver = f.lit.as_ref().or(f.highlight.as_ref());
        let source = receiver.and(f.sky.clone());
        list.plain(
            Effect::SkyLight,
            &source,
            "surfaces ask directions of the sky, drawn by how bright it is there",
            "no surface receives light from a sky",
        );
        return;
    }
    list.plain(
        Effect::SkyLight,
        &f.lit_physical.as_ref().and(f.sky.clone()),
        "physical materials receive the sky's cosine-weighted average, without occlusion",
        "no physical material receives light from a sky",
    );
}

/// Surfaces that give off light, as others receive it.
fn emissive_surfaces(list: &mut FindingList, f: &SceneFacts, paths: bool) {
    let answers = if paths { f.lit.as_ref().or(f.highlight.as_ref()) } else { f.lit.as_ref() };
    let receiver = |source: &Option<String>| answers.and(source.clone());
    list.plain(
        Effect::SoftShadows,
        &receiver(&f.even_emission),
        "an emissive surface lights others: each sample asks one point of it",
        "no evenly emissive surface lights another",
    );
    let (source, absent) = (receiver(&f.varied_emission), "no surface whose emission varies lights another");
    if paths {
        let because =
            "a surface whose emission varies lights others: each vertex may ask a point of it, and reads what it gives off there";
        list.plain(Effect::TexturedEmitters, &source, because, absent);
    } else {
        let because = "a surface whose emission varies is seen, but does not light others";
        list.missing(Effect::TexturedEmitters, &source, because, absent, "--integrator path, or give it an even emission");
    }
}

/// What to do about what is a look and no light.
const LOOKS: &str = "--integrator whitted";

/// What lies over, under and in surfaces.
fn layers(list: &mut FindingList, f: &LayerFacts, paths: bool) {
    for row in LAYER_EFFECTS {
        let source = f.source(row.effect);
        match row.whitted {
            _ if paths => list.plain(row.effect, &source, row.present, row.absent),
            Some(present) => list.plain(row.effect, &source, present, row.absent),
            None => list.missing(row.effect, &source, row.present, row.absent, "--integrator path"),
        }
    }
}

/// What imported files say that scenes have no words for.
fn what_files_say_more(list: &mut FindingList, f: &SceneFacts) {
    list.missing(
        Effect::MaterialExtensions,
        &f.unread,
        &f.unread_parts,
        "the file says nothing of materials beyond what is shown",
        "what else these materials say is shown; nothing in this version does the rest",
    );
}
