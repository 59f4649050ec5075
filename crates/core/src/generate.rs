//! Generators: entries of a scene that each stand for many objects. The objects form a grid or are
//! scattered.

use glam::{DAffine3, DVec3};

use crate::affine::affine_from_steps;
use crate::hash::splitmix64;
use crate::motion::object_transforms_at_ends;
use crate::scene::{GeneratorKind, Object, Scene, TransformStep};

/// An object of the scene with its position: a listed object, or one of the objects of a generator.
/// All objects of a generator share the data of one object, so a million of them only take a
/// million offsets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedObject<'a> {
    pub object: &'a Object,
    /// Offset that the generator gives the object, relative to the storage origin. `None` for a
    /// listed object if the storage origin is zero.
    pub position: Option<DVec3>,
}

impl PlacedObject<'_> {
    /// Returns the transform from the object's own space to the world. It is the object's own
    /// transform followed by the generator's offset.
    pub fn object_to_world(&self) -> DAffine3 {
        let own = affine_from_steps(&self.object.transform);
        self.apply_offset(own)
    }

    /// Returns the transforms from the object's own space to the world at time 0 and at time 1 of
    /// its motion; `None` for an object at rest. Both contain the generator's offset.
    pub fn object_to_world_at_ends(&self) -> Option<[DAffine3; 2]> {
        object_transforms_at_ends(self.object).map(|ends| ends.map(|end| self.apply_offset(end)))
    }

    fn apply_offset(&self, own: DAffine3) -> DAffine3 {
        self.position
            .map_or(own, |position| DAffine3::from_translation(position) * own)
    }
}

/// Iterates over the scene's objects: the listed objects, then those of each generator.
pub(crate) fn all_objects(scene: &Scene) -> impl Iterator<Item = PlacedObject<'_>> {
    let listed = scene.objects.iter().map(|object| PlacedObject {
        object,
        position: None,
    });
    let made = scene.generators.iter().flat_map(|generator| {
        generator_offsets(&generator.kind).map(|position| PlacedObject {
            object: &generator.object,
            position: Some(position),
        })
    });
    listed.chain(made)
}

/// Iterates over the scene's objects in the same order. Their positions are relative to `origin`.
pub(crate) fn objects_relative_to(
    scene: &Scene,
    origin: DVec3,
) -> impl Iterator<Item = PlacedObject<'_>> {
    let moved = move |placed_object: PlacedObject<'_>| {
        (origin != DVec3::ZERO).then(|| placed_object.position.unwrap_or_default() - origin)
    };
    all_objects(scene).map(move |placed_object| PlacedObject {
        position: moved(placed_object).or(placed_object.position),
        ..placed_object
    })
}

/// Iterates over the listed objects and one object per generator, each with the number of objects
/// that it represents. The objects of a generator differ only in their offset.
pub(crate) fn objects_with_counts(scene: &Scene) -> impl Iterator<Item = (&Object, u64)> {
    let listed = scene.objects.iter().map(|object| (object, 1));
    listed.chain(
        scene
            .generators
            .iter()
            .map(|generator| (&generator.object, count_generated_objects(&generator.kind))),
    )
}

/// Returns a copy of every object of the scene. Generated objects come last, each with its own
/// transform.
pub fn expand_generators(scene: &Scene) -> Vec<Object> {
    all_objects(scene)
        .map(|placed_object| {
            let mut object = placed_object.object.clone();
            let place = placed_object
                .position
                .map(|position| TransformStep::Translate(position.into()));
            object.transform.extend(place);
            object
                .transform_end
                .iter_mut()
                .for_each(|end| end.extend(place));
            object
        })
        .collect()
}

/// Returns the number of objects that [`expand_generators`] returns.
pub fn count_objects(scene: &Scene) -> u64 {
    objects_with_counts(scene)
        .map(|(_, count)| count)
        .fold(0, u64::saturating_add)
}

/// Returns the number of objects of a generator.
pub(crate) fn count_generated_objects(kind: &GeneratorKind) -> u64 {
    match kind {
        GeneratorKind::Grid { counts, .. } => counts
            .iter()
            .fold(1, |product, &n| product.saturating_mul(u64::from(n))),
        GeneratorKind::Scatter { count, .. } => u64::from(*count),
    }
}

/// Iterates over the offsets of a generator's objects, in the order of the objects.
pub(crate) fn generator_offsets(kind: &GeneratorKind) -> Box<dyn Iterator<Item = DVec3>> {
    match *kind {
        GeneratorKind::Grid {
            counts: [nx, ny, nz],
            origin,
            step,
        } => {
            let (origin, step) = (DVec3::from(origin), DVec3::from(step));
            Box::new((0..nz).flat_map(move |z| {
                (0..ny).flat_map(move |y| {
                    (0..nx).map(move |x| {
                        origin + step * DVec3::new(f64::from(x), f64::from(y), f64::from(z))
                    })
                })
            }))
        }
        // Offset i depends on the seed and i alone.
        GeneratorKind::Scatter {
            count,
            min,
            max,
            seed,
        } => {
            let (min, extent) = (DVec3::from(min), DVec3::from(max) - DVec3::from(min));
            Box::new((0..u64::from(count)).map(move |i| {
                let unit = |axis: u64| {
                    (splitmix64(seed ^ splitmix64(i * 3 + axis)) >> 11) as f64
                        / (1_u64 << 53) as f64
                };
                min + extent * DVec3::new(unit(0), unit(1), unit(2))
            }))
        }
    }
}
