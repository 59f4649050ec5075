//! `info`: contents of a scene, model, picture or film file, as a table or as JSON.

mod json;
mod picture;

use std::collections::BTreeMap;
use std::path::Path;

use raywright_core::scene::{LightKind, MaterialModel, SamplePattern, Shape, Sky};
use raywright_core::{Scene, Settings, estimate_scene_memory, generate};
use raywright_io::report::{format_count, format_four_digits, format_memory_parts};
use raywright_io::{AnimationInfo, ExtensionInfo, LoadedScene, SceneFormat, SceneNotation};

use crate::args::InfoArgs;
use crate::console;
use crate::failure::Failure;
use crate::plan;
use crate::session::Session;
use crate::table::format_rows;
use json::{FileInfo, TriangleCounts, count_by_kind};

/// Runs `info`: prints the contents of a file as a table or as JSON.
pub fn run(mut session: Session, args: &InfoArgs) -> Result<(), Failure> {
    if picture::is_picture_or_film(Path::new(&args.scene)) {
        return picture::run(Path::new(&args.scene), args.json);
    }
    let options = plan::build_load_options(&args.changes, None);
    let loaded = session.load(&args.scene, &options)?;
    session.notes.print_kept_messages();
    let info = FileInfo::from_loaded(&loaded);
    console::print_report(args.json, &info, || format_table(&loaded, &info))
}

/// Formats the table: the contents of the JSON as text, and further contents of a scene.
fn format_table(loaded: &LoadedScene, info: &FileInfo) -> String {
    let scene = &loaded.scene;
    let materials = scene.materials.iter();
    let materials = materials.map(|material| material_model_kind(&material.model));
    let rows = [
        ("file", info.file.clone()),
        ("format", info.notation.to_owned()),
        ("title", info.title.clone()),
        ("picture", describe_render_size(scene)),
        (
            "parameters",
            join_items(
                scene
                    .parameters
                    .iter()
                    .map(|(name, value)| format!("{name} = {value}")),
            ),
        ),
        ("cameras", format_named_count(&info.cameras)),
        ("lights", format_kind_counts(&info.lights)),
        ("sky", describe_file_sky(loaded)),
        ("objects", format_kind_counts(&info.objects)),
        ("generated", list_generated_objects(scene)),
        ("triangles", describe_triangles(&info.triangles)),
        ("materials", format_kind_counts(&count_by_kind(materials))),
        ("textures", format_nonzero(scene.textures.len())),
        ("images", list_images(scene)),
        ("scenes", format_indexed_names(&loaded.contents.scenes)),
        (
            "variants",
            join_items(loaded.contents.variants.iter().cloned()),
        ),
        (
            "animations",
            join_items(loaded.contents.animations.iter().map(describe_animation)),
        ),
        (
            "extensions",
            join_items(loaded.contents.extensions.iter().map(describe_extension)),
        ),
    ];
    let hash = ("hash", info.hash.clone());
    let rows = rows
        .into_iter()
        .chain(format_bounds_and_memory(scene, info));
    format_rows(rows.chain([hash]))
}

/// Returns two rows: the bounds of the whole scene, and an upper bound of a render's memory. Both
/// are computed from the scene's data without building an accelerator, which would be slow for
/// models of millions of triangles.
fn format_bounds_and_memory(scene: &Scene, info: &FileInfo) -> [(&'static str, String); 2] {
    let settings = Settings::from_scene(scene);
    let corner = |point: [f64; 3]| point.map(format_four_digits).join(", ");
    let bounds = info
        .bounds
        .map(|[least, most]| format!("{}  to  {}", corner(least), corner(most)));
    let unbounded = match info.unbounded {
        0 => None,
        n => Some(format!("{n} without bounds")),
    };
    let bounds: Vec<String> = bounds.into_iter().chain(unbounded).collect();
    let memory = estimate_scene_memory(scene, &settings).bytes_by_purpose();
    [
        ("bounds", bounds.join(", and ")),
        ("memory", format_memory_parts(&memory)),
    ]
}

fn scene_format_name(format: SceneFormat) -> &'static str {
    match format {
        SceneFormat::Native(SceneNotation::Toml) => "Raywright scene (TOML)",
        SceneFormat::Native(SceneNotation::Json) => "Raywright scene (JSON)",
        SceneFormat::Gltf => "glTF 2.0",
        SceneFormat::Glb => "glTF 2.0 (binary)",
        SceneFormat::Obj => "Wavefront OBJ",
        SceneFormat::Stl => "STL",
        SceneFormat::Ply => "PLY",
    }
}

fn describe_render_size(scene: &Scene) -> String {
    let [width, height] = scene.render.size;
    let samples = match scene.render.pattern {
        None => format!("{} samples", scene.render.samples),
        Some(SamplePattern::Centre) => "1 sample (centre)".to_owned(),
        Some(SamplePattern::Corners) => "4 samples (corners)".to_owned(),
    };
    format!(
        "{width}x{height} pixels, {samples}, paths of at most {} ray segments",
        scene.render.max_depth
    )
}

/// Formats a count; empty for zero, because rows without text are left out of the table.
fn format_nonzero(n: usize) -> String {
    if n == 0 { String::new() } else { n.to_string() }
}

fn join_items(items: impl Iterator<Item = String>) -> String {
    items.collect::<Vec<_>>().join(", ")
}

/// Formats the scenes of a file by index and name; empty for a file with a single scene.
fn format_indexed_names(names: &[String]) -> String {
    let numbered =
        |(index, name): (usize, &String)| format!("{index} {name}").trim_end().to_owned();
    if names.len() > 1 {
        join_items(names.iter().enumerate().map(numbered))
    } else {
        String::new()
    }
}

/// Formats an animation: `walk (0.71 s)`.
fn describe_animation(info: &AnimationInfo) -> String {
    let name = if info.name.is_empty() {
        "unnamed"
    } else {
        &info.name
    };
    info.seconds.map_or_else(
        || name.to_owned(),
        |seconds| format!("{name} ({} s)", format_four_digits(seconds)),
    )
}

/// Formats a glTF extension: `KHR_texture_transform`, or `VENDOR_thing (not read)`.
fn describe_extension(info: &ExtensionInfo) -> String {
    format!(
        "{}{}",
        info.name,
        if info.is_supported { "" } else { " (not read)" }
    )
}

/// Formats the number of items and the names of those that have a name: `3: front, side`.
fn format_named_count(names: &[String]) -> String {
    let given = join_items(names.iter().filter(|name| !name.is_empty()).cloned());
    if given.is_empty() {
        format_nonzero(names.len())
    } else {
        format!("{}: {given}", names.len())
    }
}

/// Formats the total and the count of each kind of item: `6: 5 sphere, 1 plane`; `6 sphere` for a
/// single kind.
fn format_kind_counts(counts: &BTreeMap<&str, usize>) -> String {
    let total: usize = counts.values().sum();
    let mut counts: Vec<_> = counts.iter().collect();
    counts.sort_by_key(|&(_, n)| std::cmp::Reverse(n));
    let several = counts.len() > 1;
    let list = join_items(counts.into_iter().map(|(kind, n)| format!("{n} {kind}")));
    if several {
        format!("{total}: {list}")
    } else {
        list
    }
}

fn shape_kind(shape: &Shape) -> &'static str {
    match shape {
        Shape::Sphere { .. } => "sphere",
        Shape::Plane { .. } => "plane",
        Shape::Disk { .. } => "disk",
        Shape::Quad { .. } => "quad",
        Shape::Box { .. } => "box",
        Shape::Cylinder { .. } => "cylinder",
        Shape::Cone { .. } => "cone",
        Shape::Ellipsoid { .. } => "ellipsoid",
        Shape::Hyperboloid { .. } => "hyperboloid",
        Shape::Paraboloid { .. } => "paraboloid",
        Shape::Torus { .. } => "torus",
        Shape::Triangle { .. } => "triangle",
        Shape::Mesh(_) => "mesh",
    }
}

fn light_kind(kind: &LightKind) -> &'static str {
    match kind {
        LightKind::Directional { .. } => "directional",
        LightKind::Point { .. } => "point",
        LightKind::Spot { .. } => "spot",
    }
}

/// Returns the kind of the sky in the scene file; empty if the file has none, even if the program
/// adds a sky.
fn describe_file_sky(loaded: &LoadedScene) -> String {
    let own = loaded
        .scene
        .sky
        .as_ref()
        .filter(|_| loaded.added_sky.is_none())
        .filter(|sky| !matches!(sky, Sky::Studio(studio) if studio.strength == 0.0));
    own.map(sky_kind).unwrap_or_default().to_owned()
}

fn sky_kind(sky: &Sky) -> &'static str {
    match sky {
        Sky::Constant(_) => "constant",
        Sky::Gradient { .. } => "gradient",
        Sky::Expression(_) => "expression",
        Sky::Map(_) => "environment picture",
        Sky::Studio(_) => "studio",
    }
}

fn material_model_kind(model: &MaterialModel) -> &'static str {
    match model {
        MaterialModel::Classic(_) => "classic",
        MaterialModel::Physical(_) => "physical",
    }
}

/// Formats the number of objects that generators make, by kind: `1000 sphere`.
fn list_generated_objects(scene: &Scene) -> String {
    let mut counts = BTreeMap::<&str, u64>::new();
    for generator in &scene.generators {
        let alone = Scene {
            generators: vec![generator.clone()],
            ..Scene::default()
        };
        *counts
            .entry(shape_kind(&generator.object.shape))
            .or_default() += generate::count_objects(&alone);
    }
    join_items(counts.into_iter().map(|(kind, n)| format!("{n} {kind}")))
}

/// Formats the number of mesh triangles with each mesh counted once, and the number with all
/// instances where the two differ.
fn describe_triangles(triangles: &TriangleCounts) -> String {
    let &TriangleCounts {
        stored,
        shown,
        meshes,
    } = triangles;
    let instances = if shown == stored {
        String::new()
    } else {
        format!(", {shown} shown when each instance is counted")
    };
    match meshes {
        0 => String::new(),
        n => format!("{stored} in {}{instances}", format_count(n, "mesh")),
    }
}

fn list_images(scene: &Scene) -> String {
    let described = scene.images.iter().map(|image| match &image.data {
        Some(data) => format!("{} {}x{}", image.name, data.width, data.height),
        None => format!("{} (missing)", image.name),
    });
    match scene.images.len() {
        0 => String::new(),
        n => format!("{n}: {}", join_items(described)),
    }
}

#[cfg(test)]
mod tests;
