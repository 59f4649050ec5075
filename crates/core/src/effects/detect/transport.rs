//! Light that comes over other surfaces and through bodies: what paths find, and Whitted's rules leave out.

use super::super::Effect;
use super::super::facts::SceneFacts;
use super::list::FindingList;

/// What Whitted ray tracing does not solve, and paths find.
pub(super) fn what_paths_find(list: &mut FindingList, f: &SceneFacts) {
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

/// What Whitted ray tracing does not solve.
pub(super) fn what_needs_a_path_tracer(list: &mut FindingList, f: &SceneFacts) {
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
