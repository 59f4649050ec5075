//! Generators: rules in a scene that stand for many objects.

use glam::DVec3;

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
        GeneratorKind::Scatter { count, min, max, seed } => {
            let (min, extent) = (DVec3::from(min), DVec3::from(max) - DVec3::from(min));
            Box::new((0..u64::from(count)).map(move |i| {
                let unit = |axis: u64| (mix(seed ^ mix(i * 3 + axis)) >> 11) as f64 / (1_u64 << 53) as f64;
                min + extent * DVec3::new(unit(0), unit(1), unit(2))
            }))
        }
    }
}

/// The finaliser of SplitMix64: place i is a function of seed and i alone.
pub(crate) fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

/// The object moved to a place. Its own transform comes first.
fn moved(object: &Object, place: DVec3) -> Object {
    let mut object = object.clone();
    object.transform.push(TransformStep::Translate(place.into()));
    object
}
