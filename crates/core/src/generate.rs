//! Generators: rules in a scene that stand for many objects.

use glam::DVec3;

use crate::hash::mix;
use crate::scene::{GeneratorKind, Object, Scene, TransformStep};

/// The scene's objects with the generated ones after them.
pub fn expand(scene: &Scene) -> Vec<Object> {
    let mut objects = scene.objects.clone();
    for generator in &scene.generators {
        objects.extend(places(&generator.kind).map(|place| moved(&generator.object, place)));
    }
    objects
}

/// How many objects [`expand`] returns.
pub fn count(scene: &Scene) -> u64 {
    scene.generators.iter().map(|g| count_of(&g.kind)).fold(scene.objects.len() as u64, u64::saturating_add)
}

/// How many objects a generator stands for.
pub(crate) fn count_of(kind: &GeneratorKind) -> u64 {
    match kind {
        GeneratorKind::Grid { counts, .. } => counts.iter().fold(1, |product, &n| product.saturating_mul(u64::from(n))),
        GeneratorKind::Scatter { count, .. } => u64::from(*count),
    }
}

fn places(kind: &GeneratorKind) -> Box<dyn Iterator<Item = DVec3>> {
    match *kind {
        GeneratorKind::Grid { counts: [nx, ny, nz], origin, step } => {
            let (origin, step) = (DVec3::from(origin), DVec3::from(step));
            Box::new((0..nz).flat_map(move |z| {
                (0..ny)
                    .flat_map(move |y| (0..nx).map(move |x| origin + step * DVec3::new(f64::from(x), f64::from(y), f64::from(z))))
            }))
        }
        // Place i is a function of seed and i alone.
        GeneratorKind::Scatter { count, min, max, seed } => {
            let (min, extent) = (DVec3::from(min), DVec3::from(max) - DVec3::from(min));
            Box::new((0..u64::from(count)).map(move |i| {
                let unit = |axis: u64| (mix(seed ^ mix(i * 3 + axis)) >> 11) as f64 / (1_u64 << 53) as f64;
                min + extent * DVec3::new(unit(0), unit(1), unit(2))
            }))
        }
    }
}

/// The object moved to a place. Its own transform comes first.
fn moved(object: &Object, place: DVec3) -> Object {
    let mut object = object.clone();
    object.transform.push(TransformStep::Translate(place.into()));
    object
}
