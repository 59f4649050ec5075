//! `info`: contents of a scene, model, picture or film file, as a table or as JSON.

mod picture;

use std::collections::BTreeMap;
use std::path::Path;

use raywright_core::extent::SceneExtent;
use raywright_core::scene::{Image, Parameter, SamplePattern, Shape, Sky};
use raywright_core::topology::SolidSummary;
use raywright_core::{
    Scene, SceneLookup, Settings, estimate_scene_memory, generate, measure_scene_extent,
};
use raywright_io::report::{format_count, format_four_digits, format_memory_parts};
use raywright_io::{AnimationInfo, ExtensionInfo, LoadedScene, SceneFormat, SceneNotation, UpAxis};
use serde::Serialize;
use serde_json::{Value, json};

use crate::args::InfoArgs;
use crate::failure::Failure;
use crate::origin::variant_name;
use crate::scene_input::depends_on_time;
use crate::session::Session;
use crate::table::format_rows;
use crate::{console, plan};

/// Runs `info`: prints the contents of a file as a table or as JSON.
pub fn run(mut session: Session, args: &InfoArgs) -> Result<(), Failure> {
    if picture::is_picture_or_film(Path::new(&args.scene)) {
        return picture::run(Path::new(&args.scene), args.json);
    }
    let options = plan::build_load_options(&args.changes, None);
    let loaded = session.load(&args.scene, &options)?;
    session.notes.print_kept_messages();
    let (json, rows) = list_contents(&loaded);
    console::print_report(args.json, &json, || format_rows(rows))
}

/// Lists the contents of a loaded file: numbers and lists for scripts, and the rows of the table.
fn list_contents(loaded: &LoadedScene) -> (Value, Vec<(&'static str, String)>) {
    let (scene, contents) = (&loaded.scene, &loaded.contents);
    let settings = Settings::from_scene(scene);
    let (notation, triangles) = (
        scene_format_name(loaded.source.format),
        count_triangles(scene),
    );
    let cameras: Vec<&String> = scene.cameras.iter().map(|camera| &camera.name).collect();
    let materials: Vec<&String> = scene.materials.iter().map(|item| &item.name).collect();
    let lights = count_by_kind(scene.lights.iter().map(|light| variant_name(&light.kind)));
    let shapes = scene
        .objects
        .iter()
        .map(|object| variant_name(&object.shape));
    let objects = count_by_kind(shapes);
    let models = scene.materials.iter().map(|item| variant_name(&item.model));
    let SceneExtent { bounds, unbounded } = measure_scene_extent(scene, settings.precision);
    // Least and greatest corner of the box around all bounded shapes.
    // In the axes of the file.
    let bounds = (!bounds.is_empty()).then(|| {
        let corners = [bounds.min.to_array(), bounds.max.to_array()];
        loaded.up.bounds_in_file(corners)
    });
    let mut solid = SolidSummary::from_scene(scene);
    if let (Some(solid), Some([least, most])) = (&mut solid, bounds) {
        solid.size = [0, 1, 2].map(|axis| most[axis] - least[axis]);
    }
    let units = file_units(loaded.source.format);
    // Upper bound of a render's memory.
    let memory = estimate_scene_memory(scene, &settings).bytes_by_purpose();
    let hash = loaded.hash.to_string();
    let animation = |info: &AnimationInfo| json!({ "name": info.name, "seconds": info.seconds });
    let extension = |info: &ExtensionInfo| json!({ "name": info.name, "required": info.required, "read": info.is_supported });
    let parameter = |(name, parameter): (&String, &Parameter)| {
        let range = parameter.range;
        let limits = range.map(|range| [range.min, range.max]);
        json!({ "name": name, "value": parameter.value, "range": limits, "step": range.and_then(|range| range.step) })
    };
    let json = json!({
        "format": 1,
        "file": loaded.source.name,
        "notation": notation,
        "title": scene.title,
        "size": scene.render.size,
        "parameters": scene.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "moves": depends_on_time(loaded),
        "period": scene.period,
        "cameras": cameras,
        "lights": lights,
        "objects": objects,
        "triangles": triangles,
        "materials": materials,
        "textures": scene.textures.len(),
        "images": scene.images.iter().map(describe_image).collect::<Vec<_>>(),
        "scenes": contents.scenes,
        "variants": contents.variants,
        "animations": contents.animations.iter().map(animation).collect::<Vec<_>>(),
        "extensions": contents.extensions.iter().map(extension).collect::<Vec<_>>(),
        "up": loaded.up.name(),
        "units": units,
        "bounds": bounds,
        "solid": solid,
        "memory": memory.iter().copied().collect::<BTreeMap<_, _>>(),
        "hash": hash,
    });
    let rows = vec![
        ("file", loaded.source.name.clone()),
        ("format", notation.to_owned()),
        ("title", scene.title.clone()),
        ("picture", describe_render_size(scene)),
        (
            "parameters",
            join_items(scene.parameters.iter().map(describe_parameter)),
        ),
        ("motion", describe_motion(loaded)),
        ("cameras", format_named_count(&cameras)),
        ("lights", format_kind_counts(&lights)),
        ("sky", describe_file_sky(loaded)),
        ("objects", format_kind_counts(&objects)),
        ("generated", list_generated_objects(scene)),
        ("triangles", describe_triangles(&triangles)),
        ("materials", format_kind_counts(&count_by_kind(models))),
        ("textures", format_nonzero(scene.textures.len())),
        ("images", list_images(scene)),
        ("scenes", format_indexed_names(&contents.scenes)),
        ("variants", contents.variants.join(", ")),
        (
            "animations",
            join_items(contents.animations.iter().map(describe_animation)),
        ),
        (
            "extensions",
            join_items(contents.extensions.iter().map(describe_extension)),
        ),
        ("units", units.map_or_else(String::new, str::to_owned)),
        ("up axis", describe_up_axis(loaded)),
        ("bounds", describe_bounds(bounds, unbounded)),
        (
            "closed",
            solid.as_ref().map_or_else(String::new, ToString::to_string),
        ),
        ("memory", format_memory_parts(&memory)),
        ("hash", hash),
    ];
    (json, rows)
}

/// Formats a parameter: `light = 1 (0 to 3)`.
fn describe_parameter((name, parameter): (&String, &Parameter)) -> String {
    let range = parameter.range.map_or_else(String::new, |range| {
        let [min, max] = [range.min, range.max].map(format_four_digits);
        format!(" ({min} to {max})")
    });
    format!("{name} = {}{range}", parameter.value)
}

/// Describes whether a scene file depends on the time.
fn describe_motion(loaded: &LoadedScene) -> String {
    match (depends_on_time(loaded), loaded.scene.period) {
        (false, _) => String::new(),
        (true, None) => "depends on the time t (--at, --frames)".to_owned(),
        (true, Some(period)) => format!(
            "depends on the time t (--at), and repeats after {} s (--frames all)",
            format_four_digits(period)
        ),
    }
}

/// Describes the box around all bounded shapes, and the number of shapes without bounds.
fn describe_bounds(bounds: Option<[[f64; 3]; 2]>, unbounded: usize) -> String {
    let bounds = bounds.map(|[least, most]| {
        // As many digits as tell the two corners apart.
        let number = |point: [f64; 3], axis: usize| {
            let (size, x) = (most[axis] - least[axis], point[axis]);
            if size > 0.0 && x.abs() > 10.0 * size {
                let places = (3.0 - size.log10().floor()).clamp(0.0, 12.0) as usize;
                format!("{x:.places$}")
            } else {
                format_four_digits(x)
            }
        };
        let corner = |point| [0, 1, 2].map(|axis| number(point, axis)).join(", ");
        format!("{}  to  {}", corner(least), corner(most))
    });
    let unbounded = (unbounded > 0).then(|| format!("{unbounded} without bounds"));
    let parts: Vec<String> = bounds.into_iter().chain(unbounded).collect();
    parts.join(", and ")
}

/// Names the axis that points upwards, if it is not y.
fn describe_up_axis(loaded: &LoadedScene) -> String {
    match (loaded.up, loaded.assumed_up) {
        (UpAxis::Y, _) => String::new(),
        (up, None) => up.name().to_owned(),
        (up, Some(_)) => format!("{} (assumed: the file states none)", up.name()),
    }
}

/// Names the unit of lengths of a model; `None` for a scene file, whose lengths are metres.
fn file_units(format: SceneFormat) -> Option<&'static str> {
    match format {
        SceneFormat::Native(_) => None,
        SceneFormat::Gltf | SceneFormat::Glb => Some("metres"),
        SceneFormat::Stl => Some("none is stated; printers take an STL's as millimetres"),
        SceneFormat::Obj | SceneFormat::Ply => Some("none is stated"),
    }
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
fn format_named_count(names: &[&String]) -> String {
    let given = join_items(
        names
            .iter()
            .filter(|name| !name.is_empty())
            .map(ToString::to_string),
    );
    if given.is_empty() {
        format_nonzero(names.len())
    } else {
        format!("{}: {given}", names.len())
    }
}

/// Formats the total and the count of each kind of item: `6: 5 sphere, 1 plane`; `6 sphere` for a
/// single kind.
fn format_kind_counts(counts: &BTreeMap<String, usize>) -> String {
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

/// Returns the kind of the sky in the scene file; empty if the file has none, even if the program
/// adds a sky.
fn describe_file_sky(loaded: &LoadedScene) -> String {
    let own = loaded
        .scene
        .sky
        .as_ref()
        .filter(|_| loaded.added_sky.is_none())
        .filter(|sky| !matches!(sky, Sky::Studio(studio) if studio.strength == 0.0));
    own.map(sky_kind).unwrap_or_default()
}

fn sky_kind(sky: &Sky) -> String {
    match sky {
        Sky::Map(_) => "environment picture".to_owned(),
        Sky::Studio(_) => "studio".to_owned(),
        other => variant_name(other),
    }
}

/// Formats the number of objects that generators make, by kind: `1000 sphere`.
fn list_generated_objects(scene: &Scene) -> String {
    let mut counts = BTreeMap::<String, u64>::new();
    for generator in &scene.generators {
        let alone = Scene {
            generators: vec![generator.clone()],
            ..Scene::default()
        };
        *counts
            .entry(variant_name(&generator.object.shape))
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

/// Numbers of mesh triangles and of meshes.
#[derive(Serialize)]
struct TriangleCounts {
    /// Number of triangles of all meshes, each mesh counted once.
    stored: usize,
    /// Number of triangles of all listed objects, with each instance of a mesh counted.
    shown: usize,
    meshes: usize,
}

/// Counts the items of each kind.
fn count_by_kind(kinds: impl Iterator<Item = String>) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    kinds.for_each(|kind| *counts.entry(kind).or_default() += 1);
    counts
}

fn count_triangles(scene: &Scene) -> TriangleCounts {
    let lookup = SceneLookup::new(scene);
    let triangle_count = |name: &str| lookup.mesh_data(name).map_or(0, |data| data.indices.len());
    let shown = scene.objects.iter().map(|object| {
        if let Shape::Mesh(name) = &object.shape {
            triangle_count(name)
        } else {
            0
        }
    });
    let stored = scene
        .meshes
        .iter()
        .map(|mesh| triangle_count(&mesh.name))
        .sum();
    TriangleCounts {
        stored,
        shown: shown.sum(),
        meshes: scene.meshes.len(),
    }
}

fn describe_image(image: &Image) -> Value {
    match &image.data {
        Some(data) => {
            json!({ "name": image.name, "width": data.width, "height": data.height, "bytes": data.byte_size() })
        }
        None => json!({ "name": image.name, "missing": true }),
    }
}

#[cfg(test)]
mod tests;
