//! From what a scene has and the settings to what is found of every effect.

use super::facts::{Facts, Layers};
use super::kind::LAYER_EFFECTS;
use super::{Effect, Finding, Status};
use crate::scene::Integrator;
use crate::settings::{Sampling, Settings};

/// The integrator that a scene calls for. One that says nothing has Whitted's, whose pictures take no chance and so no more samples than
/// edges need, where it leaves nothing out that paths find: of classic materials. Physical ones light each other.
pub(super) fn called_for(facts: &Facts) -> Integrator {
    let mut lacks = List::default();
    what_needs_a_path_tracer(&mut lacks, facts);
    let lacks = lacks.0.iter().any(|finding| finding.status == Status::LeftOut) || facts.layers.calls_for_paths();
    if lacks { Integrator::Path } else { Integrator::Whitted }
}

/// What a scene calls for, in the order of [`Effect::ALL`].
pub(super) fn found(facts: &Facts, settings: &Settings, paths: bool) -> Vec<Finding> {
    let mut list = List::default();
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
fn light_at_a_surface(list: &mut List, f: &Facts, paths: bool) {
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
fn further_segments(list: &mut List, f: &Facts, settings: &Settings, paths: bool) {
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
fn looks_of_surfaces(list: &mut List, f: &Facts) {
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
fn geometry_and_sky(list: &mut List, f: &Facts) {
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
fn sky_light(list: &mut List, f: &Facts, paths: bool) {
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
fn emissive_surfaces(list: &mut List, f: &Facts, paths: bool) {
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

/// What Whitted ray tracing does not solve, and paths find.
fn what_paths_find(list: &mut List, f: &Facts) {
    list.plain(Effect::IndirectLight, &f.lit, "surfaces light each other", "no surface diffuses light");
    list.plain(
        Effect::GlossyReflection,
        &f.rough_reflection.clone().or(f.highlight.clone()),
        "a rough surface blurs what it reflects",
        "no rough surface reflects",
    );
    list.plain(
        Effect::RoughRefraction,
        &f.rough_refraction,
        "a rough surface blurs what it transmits",
        "no rough surface transmits",
    );
    list.plain(
        Effect::GroundShadow,
        &f.ground,
        "the studio's backdrop is dimmed by what the scene takes of the light on its ground",
        NO_GROUND,
    );
    list.plain(Effect::MixedScattering, &f.mixture, "a surface sends each ray one of three ways by chance", NOT_MIXED);
    list.plain(Effect::Absorption, &f.absorption, "light is absorbed on its way through a body", NOT_ABSORBED);
    list.plain(
        Effect::NestedMedia,
        &f.nested,
        "where bodies overlap, light is in the one of the greatest priority, and bends from one straight into another",
        NOT_NESTED,
    );
    let caustics = f.lit.as_ref().and(f.refraction.as_ref().or(f.reflection.as_ref())).cloned();
    let absent = "no mirror or glass sends light onto a matte surface";
    if f.light.is_some() {
        list.missing(
            Effect::Caustics,
            &caustics,
            "no path meets a light without size, so its way over mirrors or through glass to matte surfaces is not found",
            absent,
            "give the light a size: an emissive ball, say",
        );
    } else {
        list.plain(Effect::Caustics, &caustics, "light reaches matte surfaces over mirrors or through glass", absent);
    }
}

/// What lies over, under and in surfaces.
fn layers(list: &mut List, f: &Layers, paths: bool) {
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
fn what_files_say_more(list: &mut List, f: &Facts) {
    list.missing(
        Effect::MaterialExtensions,
        &f.unread,
        &f.unread_parts,
        "the file says nothing of materials beyond what is shown",
        "what else these materials say is shown; nothing in this version does the rest",
    );
}

/// What Whitted ray tracing does not solve.
fn what_needs_a_path_tracer(list: &mut List, f: &Facts) {
    let path = "--integrator path";
    list.missing(
        Effect::IndirectLight,
        &f.diffuse_physical,
        "physical surfaces light each other",
        "no physical surface diffuses light",
        path,
    );
    list.missing(
        Effect::GlossyReflection,
        &f.rough_reflection,
        "a rough surface blurs what it reflects; only lights and the sky's average are reflected in it",
        "no rough surface reflects",
        path,
    );
    list.missing(
        Effect::RoughRefraction,
        &f.rough_refraction,
        "a rough surface blurs what it transmits; it is shown as a clear one",
        "no rough surface transmits",
        path,
    );
    list.missing(Effect::GroundShadow, &f.ground, "the studio's backdrop shows no shadows", NO_GROUND, path);
    list.missing(Effect::MixedScattering, &f.mixture, "its other terms stand for a surface's mixture", NOT_MIXED, path);
    list.missing(Effect::Absorption, &f.absorption, "bodies that absorb light are shown clear", NOT_ABSORBED, path);
    list.missing(Effect::NestedMedia, &f.nested, "each boundary bends light as from and into air", NOT_NESTED, path);
    let caustics = f.diffuse_physical.as_ref().and(f.refraction.as_ref().or(f.reflection.as_ref())).cloned();
    list.missing(
        Effect::Caustics,
        &caustics,
        "light reaches matte surfaces over mirrors or through glass",
        "no mirror or glass sends light onto a matte surface",
        path,
    );
}

/// Why no shadow lies on a ground.
const NO_GROUND: &str = "no studio has a ground";

/// Why there is no mixed scattering.
const NOT_MIXED: &str = "every surface answers by its terms";

/// Why there is no absorption.
const NOT_ABSORBED: &str = "nothing absorbs light on its way";

/// Why there are no nested media.
const NOT_NESTED: &str = "no body of glass has a priority";

/// Why there is no motion.
const NOTHING_MOVES: &str = "nothing moves while the shutter is open";

#[derive(Default)]
struct List(Vec<Finding>);

impl List {
    fn push(&mut self, effect: Effect, status: Status, because: &str, source: Option<String>, hint: Option<String>) {
        self.0.push(Finding { effect, status, because: because.to_owned(), source, hint });
    }

    /// Simulated wherever it is present.
    fn plain(&mut self, effect: Effect, source: &Option<String>, present: &str, absent: &str) {
        match source {
            Some(_) => self.push(effect, Status::Simulated, present, source.clone(), None),
            None => self.push(effect, Status::Absent, absent, None, None),
        }
    }

    /// Needs a second segment.
    fn traced(&mut self, effect: Effect, source: &Option<String>, settings: &Settings, present: &str, absent: &str) {
        match source {
            Some(_) if settings.max_depth < 2 => {
                let because = "every path ends at its first hit (maximum depth 1)";
                self.push(effect, Status::LeftOut, because, source.clone(), Some("--max-depth 2 or more".to_owned()));
            }
            _ => self.plain(effect, source, present, absent),
        }
    }

    /// A lens needs samples on it.
    fn lens(&mut self, source: &Option<String>, settings: &Settings) {
        match (source, settings.sampling) {
            (Some(_), Sampling::Pattern(_)) => {
                let because = "a fixed pattern sends every ray through the middle of the lens";
                self.push(Effect::DepthOfField, Status::LeftOut, because, source.clone(), Some("--spp 64, say".to_owned()));
            }
            _ => self.plain(Effect::DepthOfField, source, "the camera has an aperture", "the camera is a pinhole"),
        }
    }

    /// Motion needs samples at different times.
    fn motion(&mut self, f: &Facts, settings: &Settings) {
        let (because, hint) = match settings.sampling {
            _ if f.motion.is_none() || f.instant => return self.plain(Effect::Motion, &None, "", NOTHING_MOVES),
            _ if f.exposure.is_none() => {
                ("the camera has no shutter, so everything is seen at time 0", "give it `shutter = [0, 1]`")
            }
            Sampling::Pattern(_) => ("a fixed pattern asks at one time, when the shutter opens", "--spp 64, say"),
            Sampling::General(_) => {
                return self.plain(Effect::Motion, &f.motion, "something moves while the shutter is open", NOTHING_MOVES);
            }
        };
        self.push(Effect::Motion, Status::LeftOut, because, f.motion.clone(), Some(hint.to_owned()));
    }

    /// Never simulated by this integrator.
    fn missing(&mut self, effect: Effect, source: &Option<String>, present: &str, absent: &str, hint: &str) {
        match source {
            Some(_) => self.push(effect, Status::LeftOut, present, source.clone(), Some(hint.to_owned())),
            None => self.push(effect, Status::Absent, absent, None, None),
        }
    }
}
