//! Messages about a scene before its render: effects left out, and shapes that cannot be seen.

use raywright_core::ReadyScene;
use raywright_core::effects::EffectReport;
use raywright_core::scene::Shape;
use raywright_core::settings::Settings;
use raywright_io::{LoadedScene, Warning, WarningCode};

use super::names::object_name;
use crate::commands::explain;
use crate::notes::Notes;

/// Warns of the effects that are left out, and prints all effects in verbose runs.
pub fn note_effects(loaded: &LoadedScene, report: &EffectReport, notes: &mut Notes) {
    notes.print_detail(explain::format_effects(&loaded.source, report, false));
    let names: Vec<&str> = report
        .left_out()
        .map(|finding| finding.effect.name())
        .collect();
    if !names.is_empty() {
        let name = &loaded.source.name;
        notes.add_warning(format!(
            "effects left out: {} (reasons and remedies: raywright explain {name})",
            names.join(", ")
        ));
    }
}

/// Warns of objects that vanish in the chosen precision, because the corners of their triangles
/// coincide.
pub fn note_lost_objects(loaded: &LoadedScene, ready: &ReadyScene, notes: &mut Notes) {
    let [first, others @ ..] = ready.invisible_objects() else {
        return;
    };
    let object = object_name(loaded, *first as usize);
    let more = if others.is_empty() {
        String::new()
    } else {
        format!(" and {} more", others.len())
    };
    notes.add_warning(format!(
        "{object}{more} cannot be seen: so far from the origin, the corners of such small triangles coincide in single \
         precision; move the mesh nearer to the origin, or add --precision reference"
    ));
}

/// Warns of an object so far from all others that the chosen precision does not resolve its shape.
pub fn note_unresolved_objects(loaded: &LoadedScene, ready: &ReadyScene, notes: &mut Notes) {
    let Some(first) = ready
        .first_unresolved_object()
        .filter(|first| !ready.invisible_objects().contains(first))
    else {
        return;
    };
    let object = object_name(loaded, first as usize);
    notes.add_warning(format!(
        "{object} is so far from the rest of the scene that single precision does not resolve a thousandth of its size; move the objects \
         nearer to each other, or add --precision reference"
    ));
}

/// Adds a note if `--wireframe` is given and the scene has shapes without edges, such as spheres.
pub fn note_missing_edges(loaded: &LoadedScene, settings: &Settings, notes: &mut Notes) {
    let objects = loaded.scene.objects.iter().chain(
        loaded
            .scene
            .generators
            .iter()
            .map(|generator| &generator.object),
    );
    let has_edges = |shape: &Shape| matches!(shape, Shape::Mesh(_) | Shape::Triangle { .. });
    let (with_edges, others): (Vec<_>, Vec<_>) =
        objects.partition(|object| has_edges(&object.shape));
    if !settings.wireframe || others.is_empty() {
        return;
    }
    let which = if with_edges.is_empty() {
        "the scene has only shapes without edges, such as spheres"
    } else {
        "the scene also has shapes without edges, such as spheres"
    };
    notes.add_hint(format!(
        "--wireframe draws the edges of triangles, and {which}"
    ));
}

/// Warns of the bias that a clamp causes. The warning is added to the warnings of the statistics
/// too.
pub fn note_clamp_bias(
    loaded: &mut LoadedScene,
    ready: &ReadyScene,
    settings: &Settings,
    notes: &mut Notes,
) {
    let Some(maximum) = settings.clamp else {
        return;
    };
    let message = if ready.is_path_traced() {
        format!(
            "--clamp dims samples brighter than {maximum} to this radiance: pixels with such samples are too dark (bias)"
        )
    } else {
        "--clamp has no effect: it dims samples of path tracing, and this scene is rendered without path tracing".to_owned()
    };
    notes.add_warning(&message);
    loaded.warnings.push(Warning {
        code: WarningCode::Samples,
        message,
    });
}
