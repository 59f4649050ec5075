//! `info`: what is in a scene or model file, as a table.

use std::collections::BTreeMap;

use glam::DVec3;
use raywright_core::prepare::Extent;
use raywright_core::scene::{LightKind, Model, Pattern, Shape, Sky};
use raywright_core::{Lookup, Scene, Settings, estimate, extent, generate};
use raywright_io::{AnimationInfo, Format, Limits, Loaded, Notation};

use crate::args::InfoArgs;
use crate::console::{self, Verbosity};
use crate::failure::Failure;
use crate::memory;
use crate::scene_input;
use crate::table::{lay_out, short};

/// Prints the table.
pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let loaded = scene_input::read(&args.scene, &args.changes, Limits::default(), Verbosity::Normal)?;
    console::print(lay_out(&rows(&loaded)))
}

fn rows(loaded: &Loaded) -> Vec<[String; 2]> {
    let scene = &loaded.scene;
    let rows = [
        ("file", loaded.source.name.clone()),
        ("format", format(loaded.source.format).to_owned()),
        ("title", scene.title.clone()),
        ("picture", picture(scene)),
        ("parameters", listed(scene.parameters.iter().map(|(name, value)| format!("{name} = {value}")))),
        ("cameras", named(scene.cameras.iter().map(|camera| camera.name.as_str()))),
        ("lights", kinds(scene.lights.iter().map(|light| light_kind(&light.kind)))),
        ("sky", scene.sky.as_ref().map(sky_kind).unwrap_or_default().to_owned()),
        ("objects", kinds(scene.objects.iter().map(|object| shape_kind(&object.shape)))),
        ("generated", generated(scene)),
        ("triangles", triangles(scene)),
        ("materials", kinds(scene.materials.iter().map(|material| model_kind(&material.model)))),
        ("textures", count(scene.textures.len())),
        ("images", images(scene)),
        ("scenes", numbered(&loaded.contents.scenes)),
        ("variants", listed(loaded.contents.variants.iter().cloned())),
        ("animations", listed(loaded.contents.animations.iter().map(animation))),
    ];
    let rows = rows.into_iter().chain(whole(scene)).chain([("hash", loaded.hash.clone())]);
    rows.filter(|(_, text)| !text.is_empty()).map(|(name, text)| [name.to_owned(), text]).collect()
}

/// The extent of everything together, and the memory that a picture would take at the most. Both come from the data: a model of
/// millions of triangles is not built to be told about.
fn whole(scene: &Scene) -> [(&'static str, String); 2] {
    let settings = Settings::of(scene);
    let Extent { bounds, unbounded } = extent(scene, settings.precision);
    let corner = |point: DVec3| point.to_array().map(short).join(", ");
    let box_around =
        if bounds.is_empty() { String::new() } else { format!("{}  to  {}", corner(bounds.min), corner(bounds.max)) };
    let endless = match unbounded {
        0 => String::new(),
        n => format!("{}{n} without end", if box_around.is_empty() { "" } else { ", and " }),
    };
    [("bounds", box_around + &endless), ("memory", memory::listed(&estimate(scene, &settings).parts()))]
}

fn format(format: Format) -> &'static str {
    match format {
        Format::Native(Notation::Toml) => "Raywright scene (TOML)",
        Format::Native(Notation::Json) => "Raywright scene (JSON)",
        Format::Gltf => "glTF 2.0",
        Format::Glb => "glTF 2.0 (binary)",
        Format::Obj => "Wavefront OBJ",
    }
}

fn picture(scene: &Scene) -> String {
    let [width, height] = scene.render.size;
    let samples = match scene.render.pattern {
        None => format!("{} samples", scene.render.samples),
        Some(Pattern::Centre) => "1 sample (centre)".to_owned(),
        Some(Pattern::Corners) => "4 samples (corners)".to_owned(),
    };
    format!("{width}x{height} pixels, {samples}, at most {} ray segments", scene.render.max_depth)
}

/// A count, empty for none, so that the row is left out.
fn count(n: usize) -> String {
    if n == 0 { String::new() } else { n.to_string() }
}

fn listed(items: impl Iterator<Item = String>) -> String {
    items.collect::<Vec<_>>().join(", ")
}

/// The scenes of a file that has several, each by its index and its name.
fn numbered(names: &[String]) -> String {
    let numbered = |(index, name): (usize, &String)| format!("{index} {name}").trim_end().to_owned();
    if names.len() > 1 { listed(names.iter().enumerate().map(numbered)) } else { String::new() }
}

/// `walk (0.71 s)`.
fn animation(info: &AnimationInfo) -> String {
    let name = if info.name.is_empty() { "unnamed" } else { &info.name };
    info.seconds.map_or_else(|| name.to_owned(), |seconds| format!("{name} ({} s)", short(seconds)))
}

/// How many, and the names of those that have one.
fn named<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    let given = listed(names.iter().filter(|name| !name.is_empty()).map(|&name| name.to_owned()));
    if given.is_empty() { count(names.len()) } else { format!("{}: {given}", names.len()) }
}

/// How many in all and of each kind: `6: 5 sphere, 1 plane`; `6 sphere` where there is one kind only.
fn kinds<'a>(kinds: impl Iterator<Item = &'a str>) -> String {
    let mut counts = BTreeMap::<&str, usize>::new();
    kinds.for_each(|kind| *counts.entry(kind).or_default() += 1);
    let total: usize = counts.values().sum();
    let mut counts: Vec<(&str, usize)> = counts.into_iter().collect();
    counts.sort_by_key(|&(_, n)| std::cmp::Reverse(n));
    let several = counts.len() > 1;
    let list = listed(counts.into_iter().map(|(kind, n)| format!("{n} {kind}")));
    if several { format!("{total}: {list}") } else { list }
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

fn sky_kind(sky: &Sky) -> &'static str {
    match sky {
        Sky::Constant(_) => "constant",
        Sky::Gradient { .. } => "gradient",
        Sky::Expression(_) => "expression",
        Sky::Map(_) => "environment picture",
    }
}

fn model_kind(model: &Model) -> &'static str {
    match model {
        Model::Classic(_) => "classic",
        Model::Physical(_) => "physical",
    }
}

/// What generators add: `1000 sphere`.
fn generated(scene: &Scene) -> String {
    let mut counts = BTreeMap::<&str, u64>::new();
    for generator in &scene.generators {
        let alone = Scene { generators: vec![generator.clone()], ..Scene::default() };
        *counts.entry(shape_kind(&generator.object.shape)).or_default() += generate::count(&alone);
    }
    listed(counts.into_iter().map(|(kind, n)| format!("{n} {kind}")))
}

/// Triangles of the meshes, each counted once, and as often as objects show them where that differs.
fn triangles(scene: &Scene) -> String {
    let lookup = Lookup::new(scene);
    let of = |name: &str| lookup.mesh_data(name).map(|data| data.indices.len());
    let meshes: Vec<usize> = scene.meshes.iter().filter_map(|mesh| of(&mesh.name)).collect();
    let stored: usize = meshes.iter().sum();
    let shown = scene.objects.iter().filter_map(|object| match &object.shape {
        Shape::Mesh(name) => of(name),
        _ => None,
    });
    match (meshes.len(), shown.sum::<usize>()) {
        (0, _) => String::new(),
        (n, shown) if shown == stored => format!("{stored} in {n} {}", if n == 1 { "mesh" } else { "meshes" }),
        (n, shown) => format!("{stored} in {n} {}, shown as {shown}", if n == 1 { "mesh" } else { "meshes" }),
    }
}

fn images(scene: &Scene) -> String {
    let described = scene.images.iter().map(|image| match &image.data {
        Some(data) => format!("{} {}x{}", image.name, data.width, data.height),
        None => format!("{} (missing)", image.name),
    });
    match scene.images.len() {
        0 => String::new(),
        n => format!("{n}: {}", listed(described)),
    }
}
