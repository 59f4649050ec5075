//! The gallery shows every shape of the scene format, each visible, lit and shadowed.

use std::collections::BTreeSet;

use raywright::core::scene::Shape;
use raywright::core::settings::{Aov, Sampling};
use raywright::core::{Scene, Settings, prepare};
use raywright::io::{Input, LoadOptions, load};

use crate::support::carried;

/// Number of shape kinds in the format.
const KINDS: usize = 13;

/// Index of each kind; a new kind does not compile until it is counted here and added to the
/// gallery.
fn kind(shape: &Shape) -> usize {
    match shape {
        Shape::Sphere { .. } => 0,
        Shape::Plane { .. } => 1,
        Shape::Disk { .. } => 2,
        Shape::Quad { .. } => 3,
        Shape::Box { .. } => 4,
        Shape::Cylinder { .. } => 5,
        Shape::Cone { .. } => 6,
        Shape::Ellipsoid { .. } => 7,
        Shape::Hyperboloid { .. } => 8,
        Shape::Paraboloid { .. } => 9,
        Shape::Torus { .. } => 10,
        Shape::Triangle { .. } => 11,
        Shape::Mesh(_) => 12,
    }
}

fn gallery() -> Option<Scene> {
    carried("shapes").then(|| {
        load(&Input::Preset("shapes".to_owned()), &LoadOptions::default())
            .unwrap_or_else(|e| panic!("{e}"))
            .scene
    })
}

fn settings(scene: &Scene) -> Settings {
    Settings {
        size: [480, 270],
        sampling: Sampling::General(1),
        aovs: vec![Aov::Object],
        ..Settings::from_scene(scene)
    }
}

/// Protects: every shape of the gallery is present, visible and inside the picture.
#[test]
fn every_shape_is_seen() {
    let Some(scene) = gallery() else { return };
    let kinds: BTreeSet<usize> = scene
        .objects
        .iter()
        .map(|object| kind(&object.shape))
        .collect();
    assert_eq!(
        kinds,
        (0..KINDS).collect(),
        "kinds of shapes in the gallery"
    );
    let picture = prepare(&scene, &settings(&scene), &())
        .unwrap_or_else(|e| panic!("{e}"))
        .render(&())
        .picture;
    let ids = &picture
        .layer("object.id")
        .expect("the layer was asked for")
        .samples;
    for (index, object) in scene.objects.iter().enumerate() {
        let pixels = ids.iter().filter(|&&id| id == index as f32).count();
        assert!(
            pixels >= 50,
            "objects[{index}], {}, has {pixels} pixels",
            object.name
        );
    }
}

/// Protects: the gallery has a light that reaches its shapes, and the physically sensible rules
/// decide where shadows begin.
#[test]
fn light_and_shadow() {
    let Some(mut scene) = gallery() else { return };
    assert_eq!(
        scene.classic,
        Default::default(),
        "the gallery keeps the sensible rules"
    );
    let render = |scene: &Scene| {
        prepare(scene, &settings(scene), &())
            .unwrap_or_else(|e| panic!("{e}"))
            .render(&())
            .picture
            .rgb
    };
    let whole = render(&scene);
    scene
        .objects
        .iter_mut()
        .for_each(|object| object.casts_shadow = false);
    let brighter = render(&scene)
        .iter()
        .zip(&whole)
        .filter(|(bare, whole)| bare[1] > 1.2 * whole[1])
        .count();
    let share = brighter as f64 / whole.len() as f64;
    assert!(
        (0.05..0.5).contains(&share),
        "{:.1} % of the pixels lie in a shadow",
        share * 100.0
    );
}
