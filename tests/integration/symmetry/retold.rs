//! Equivalent descriptions of a scene: objects and triangles in another order, divided meshes, or a
//! mesh of its own for each object.

use std::sync::Arc;

use raywright::bvh::stability::verdicts::CaseRng;
use raywright::core::scene::{
    MaterialModel, Mesh, MeshData, MeshSource, Object, Scene, ShadowRule, Shape,
};

use super::twins::Symmetry;

/// Returns an equivalent scene, for symmetries that apply to any scene.
pub fn retold(symmetry: Symmetry, mut scene: Scene, seed: u64) -> Scene {
    let rng = &mut CaseRng::new(seed, 3);
    match symmetry {
        Symmetry::Reordered => reorder(&mut scene, rng),
        Symmetry::Shuffled => each_mesh(&mut scene, |indices| shuffle(indices, rng)),
        Symmetry::Split => split(&mut scene),
        Symmetry::Copied => copy(&mut scene),
        _ => {}
    }
    scene
}

fn shuffle<T>(list: &mut [T], rng: &mut CaseRng) {
    for last in (1..list.len()).rev() {
        list.swap(last, rng.next_bits() as usize % (last + 1));
    }
}

/// Whether an object's material has a property.
fn is_of(scene: &Scene, object: &Object, property: impl Fn(&MaterialModel) -> bool) -> bool {
    scene
        .materials
        .iter()
        .any(|material| material.name == object.material && property(&material.model))
}

fn shines(scene: &Scene, object: &Object) -> bool {
    scene
        .materials
        .iter()
        .any(|material| material.name == object.material && material.emits())
}

/// Whether rays enter and leave a body, which a division would open.
fn is_body(model: &MaterialModel) -> bool {
    match model {
        MaterialModel::Classic(classic) => {
            classic.transmission.is_some() || classic.mixture.is_some()
        }
        MaterialModel::Physical(physical) => {
            (physical.may_transmit() || physical.may_transmit_diffusely()) && !physical.thin_walled
        }
    }
}

/// Permutes the objects that do not emit, unless the scene's shadows depend on their order.
fn reorder(scene: &mut Scene, rng: &mut CaseRng) {
    if scene.classic.shadow == ShadowRule::FirstInOrder {
        return;
    }
    let places: Vec<usize> = (0..scene.objects.len())
        .filter(|&i| !shines(scene, &scene.objects[i]))
        .collect();
    let mut dealt: Vec<Object> = places.iter().map(|&i| scene.objects[i].clone()).collect();
    shuffle(&mut dealt, rng);
    for (place, object) in places.into_iter().zip(dealt) {
        scene.objects[place] = object;
    }
}

/// Changes the triangles of each mesh that is no lamp.
fn each_mesh(scene: &mut Scene, mut change: impl FnMut(&mut Vec<[u32; 3]>)) {
    let of_lamps: Vec<Shape> = scene
        .objects
        .iter()
        .filter(|object| shines(scene, object))
        .map(|object| object.shape.clone())
        .collect();
    for mesh in &mut scene.meshes {
        if let MeshSource::Inline(data) = &mut mesh.source
            && !of_lamps.contains(&Shape::Mesh(mesh.name.clone()))
        {
            change(&mut Arc::make_mut(data).indices);
        }
    }
}

/// Moves every second triangle of a mesh to an object of its own.
fn split(scene: &mut Scene) {
    let mut objects = Vec::new();
    for object in core::mem::take(&mut scene.objects) {
        let is_whole = shines(scene, &object) || is_of(scene, &object, is_body);
        let mesh = match &object.shape {
            Shape::Mesh(name) if !is_whole => scene.meshes.iter().find(|mesh| mesh.name == *name),
            _ => None,
        };
        let Some(Mesh {
            name,
            source: MeshSource::Inline(data),
            ..
        }) = mesh.cloned()
        else {
            objects.push(object);
            continue;
        };
        for half in 0..2 {
            let part = format!("{name} half {half}");
            if scene.meshes.iter().all(|mesh| mesh.name != part) {
                let indices = data.indices.iter().copied().skip(half).step_by(2).collect();
                let source = MeshSource::Inline(Arc::new(MeshData {
                    indices,
                    ..(*data).clone()
                }));
                scene.meshes.push(Mesh {
                    name: part.clone(),
                    source,
                    model: None,
                });
            }
            objects.push(Object {
                shape: Shape::Mesh(part),
                ..object.clone()
            });
        }
    }
    scene.objects = objects;
}

/// Gives each object a copy of its mesh.
fn copy(scene: &mut Scene) {
    let mut copies = Vec::new();
    for (index, object) in scene.objects.iter_mut().enumerate() {
        let Shape::Mesh(name) = &mut object.shape else {
            continue;
        };
        let Some(mesh) = scene.meshes.iter().find(|mesh| mesh.name == *name) else {
            continue;
        };
        *name = format!("{name} of {index}");
        copies.push(Mesh {
            name: name.clone(),
            ..mesh.clone()
        });
    }
    scene.meshes.extend(copies);
}
