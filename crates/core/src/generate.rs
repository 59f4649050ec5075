//! Generators: rules in a scene that stand for many objects.

use glam::{DAffine3, DVec3};

use crate::affine::affine;
use crate::hash::mix;
use crate::motion::ends;
use crate::scene::{GeneratorKind, Object, Scene, TransformStep};

/// One of all the objects of a scene: a listed one, or one that a generator moves to a place. A
/// million of them are a million offsets, and not a million copies of a name, a material's name and
/// a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedObject<'a> {
    pub object: &'a Object,
    /// Where a generator puts it, less the origin about which it stands; none for a listed one
    /// about zero.
    pub place: Option<DVec3>,
}

impl PlacedObject<'_> {
    /// From the object's own space to the world. Its own transform comes first.
    pub fn map(&self) -> DAffine3 {
        let own = affine(&self.object.transform);
        self.placed(own)
    }

    /// The same at both ends of its way, for one that moves: it does so from where a generator puts
    /// it.
    pub fn ends(&self) -> Option<[DAffine3; 2]> {
        ends(self.object).map(|ends| ends.map(|end| self.placed(end)))
    }

    fn placed(&self, own: DAffine3) -> DAffine3 {
        self.place
            .map_or(own, |place| DAffine3::from_translation(place) * own)
    }
}

/// The scene's objects with the generated ones after them.
pub(crate) fn all(scene: &Scene) -> impl Iterator<Item = PlacedObject<'_>> {
    let listed = scene.objects.iter().map(|object| PlacedObject {
        object,
        place: None,
    });
    let made = scene.generators.iter().flat_map(|generator| {
        places(&generator.kind).map(|place| PlacedObject {
            object: &generator.object,
            place: Some(place),
        })
    });
    listed.chain(made)
}

/// The same as they stand about an origin.
pub(crate) fn all_about(scene: &Scene, origin: DVec3) -> impl Iterator<Item = PlacedObject<'_>> {
    let moved = move |shown: PlacedObject<'_>| {
        (origin != DVec3::ZERO).then(|| shown.place.unwrap_or_default() - origin)
    };
    all(scene).map(move |shown| PlacedObject {
        place: moved(shown).or(shown.place),
        ..shown
    })
}

/// The same, each with how many of it there are: generated ones differ in their places alone.
pub(crate) fn counted(scene: &Scene) -> impl Iterator<Item = (&Object, u64)> {
    let listed = scene.objects.iter().map(|object| (object, 1));
    listed.chain(
        scene
            .generators
            .iter()
            .map(|generator| (&generator.object, count_of(&generator.kind))),
    )
}

/// A copy of each of the scene's objects, with the generated ones after them as objects of their
/// own.
pub fn expand(scene: &Scene) -> Vec<Object> {
    all(scene)
        .map(|shown| {
            let mut object = shown.object.clone();
            let place = shown
                .place
                .map(|place| TransformStep::Translate(place.into()));
            object.transform.extend(place);
            object
                .transform_end
                .iter_mut()
                .for_each(|end| end.extend(place));
            object
        })
        .collect()
}

/// How many objects [`expand`] returns.
pub fn count(scene: &Scene) -> u64 {
    counted(scene)
        .map(|(_, count)| count)
        .fold(0, u64::saturating_add)
}

/// How many objects a generator stands for.
pub(crate) fn count_of(kind: &GeneratorKind) -> u64 {
    match kind {
        GeneratorKind::Grid { counts, .. } => counts
            .iter()
            .fold(1, |product, &n| product.saturating_mul(u64::from(n))),
        GeneratorKind::Scatter { count, .. } => u64::from(*count),
    }
}

/// The offsets of a generator's objects, in the order of the objects.
pub(crate) fn places(kind: &GeneratorKind) -> Box<dyn Iterator<Item = DVec3>> {
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
        // Place i is a function of seed and i alone.
        GeneratorKind::Scatter {
            count,
            min,
            max,
            seed,
        } => {
            let (min, extent) = (DVec3::from(min), DVec3::from(max) - DVec3::from(min));
            Box::new((0..u64::from(count)).map(move |i| {
                let unit =
                    |axis: u64| (mix(seed ^ mix(i * 3 + axis)) >> 11) as f64 / (1_u64 << 53) as f64;
                min + extent * DVec3::new(unit(0), unit(1), unit(2))
            }))
        }
    }
}
