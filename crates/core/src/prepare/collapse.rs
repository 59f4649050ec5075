//! Detection of shapes that lose their extent when their coordinates are stored: differences of
//! large numbers below the resolution of the stored scalar. Preparation checks this, because it
//! knows the scalar: an extent lost in `f32` may exist in `f64`.

use glam::{DMat3, DVec3};
use raywright_bvh::Real;

use crate::affine::affine;
use crate::generate::places;
use crate::lookup::SceneLookup;
use crate::motion::ends;
use crate::origin::StorageOrigin;
use crate::scene::{Generator, Object, Scene, Shape};
use crate::shape::own_origin;
use crate::validate::{MOST, Problem, list, no_area};

/// The lost extent of a shape that would vanish.
struct CollapseLoss {
    /// Path of the field within the shape.
    key: &'static str,
    /// Description of the lost extent.
    label: &'static str,
    /// Whether the cause is the shape's distance from the origin.
    far: bool,
}

/// Whether a shape moved by an offset vanishes under rounding of its coordinates.
pub(super) fn collapses(shape: &Shape, offset: DVec3, round: impl Fn(f64) -> f64) -> bool {
    loss(shape, offset, round).is_some()
}

fn loss(shape: &Shape, offset: DVec3, round: impl Fn(f64) -> f64) -> Option<CollapseLoss> {
    let stored = |p: DVec3| (p + offset).to_array().map(&round).into();
    let flat = |[a, b, c]: [DVec3; 3]| a == b || b == c || c == a || no_area(b - a, c - a);
    let far = |key, label| {
        Some(CollapseLoss {
            key,
            label,
            far: true,
        })
    };
    match *shape {
        Shape::Box { min, max } if !DVec3::cmplt(stored(min.into()), stored(max.into())).all() => {
            far("box.max", "the distance of `max` from `min`")
        }
        Shape::Quad {
            corner,
            edge_u,
            edge_v,
        } => {
            let corner = DVec3::from(corner);
            let corners = [
                corner,
                corner + DVec3::from(edge_u),
                corner + DVec3::from(edge_v),
            ];
            if flat(corners.map(stored)) {
                far("quad.corner", "the size of the quad at its `corner`")
            } else {
                None
            }
        }
        Shape::Triangle { vertices } if flat(vertices.map(|p| stored(p.into()))) => {
            far("triangle.vertices", "the distance of the corners")
        }
        Shape::Torus {
            major_radius,
            minor_radius,
            ..
        } if round(minor_radius) >= round(major_radius) => Some(CollapseLoss {
            key: "torus.minor_radius",
            label: "the difference of `minor_radius` from `major_radius`",
            far: false,
        }),
        _ => None,
    }
}

/// A number rounded to the stored scalar.
pub(crate) fn rounded<R: Real>(x: f64) -> f64 {
    R::from_f64(x).to_f64()
}

/// The translation that is applied to a shape's own numbers. `None`: the shape is rotated, scaled
/// or moving, and keeps its own space.
fn moved_by(object: &Object) -> Option<DVec3> {
    let map = affine(&object.transform);
    (map.matrix3 == DMat3::IDENTITY && ends(object).is_none()).then_some(map.translation)
}

/// The listed objects, and the first object of each generator, that vanish when stored; at most a
/// hundred.
pub(crate) fn collapsed<R: Real>(scene: &Scene) -> Vec<Problem> {
    collapsed_about::<R>(
        scene,
        StorageOrigin::from_scene::<R>(scene, &SceneLookup::new(scene)).origin,
    )
}

/// [`collapsed`] for coordinates relative to an origin.
pub(super) fn collapsed_about<R: Real>(scene: &Scene, origin: DVec3) -> Vec<Problem> {
    let objects = scene.objects.iter().enumerate();
    let listed =
        objects.filter_map(|(i, object)| listed::<R>(&format!("objects[{i}]"), object, origin));
    let generators = scene.generators.iter().enumerate();
    let generated = generators.filter_map(|(i, generator)| {
        generated::<R>(&format!("generators[{i}].object"), generator, origin)
    });
    listed.chain(generated).take(MOST).collect()
}

fn listed<R: Real>(path: &str, object: &Object, origin: DVec3) -> Option<Problem> {
    let offset =
        moved_by(object).map_or_else(|| -own_origin(&object.shape), |offset| offset - origin);
    let loss = loss(&object.shape, offset, rounded::<R>)?;
    let nearer = loss
        .far
        .then_some("move it nearer to the rest of the scene");
    Some(problem::<R>(
        path,
        &loss,
        "",
        nearer,
        !collapses(&object.shape, offset, |x| x),
    ))
}

/// The first object of a generator that vanishes at its position.
fn generated<R: Real>(path: &str, generator: &Generator, origin: DVec3) -> Option<Problem> {
    let object = &generator.object;
    let placed = matches!(
        object.shape,
        Shape::Box { .. } | Shape::Quad { .. } | Shape::Triangle { .. }
    );
    let Some(own) = moved_by(object).filter(|_| placed) else {
        return listed::<R>(path, object, origin);
    };
    let own = own - origin;
    let lost = |(i, position)| {
        Some((
            i,
            position,
            loss(&object.shape, position + own, rounded::<R>)?,
        ))
    };
    let (index, position, loss) = places(&generator.kind).enumerate().find_map(lost)?;
    let which = format!(
        " of the generator's object {index}, at {}",
        list(&position.to_array())
    );
    let nearer = Some("make it larger, put the generator's places nearer to the rest of the scene");
    Some(problem::<R>(
        path,
        &loss,
        &which,
        nearer,
        !collapses(&object.shape, position + own, |x| x),
    ))
}

/// `kept`: whether the shape survives in double precision.
fn problem<R: Real>(
    path: &str,
    loss: &CollapseLoss,
    which: &str,
    nearer: Option<&str>,
    kept: bool,
) -> Problem {
    let stored = if R::ROUNDOFF == R::from_f64(f64::ROUNDOFF) {
        "double"
    } else {
        "single"
    };
    let hints = nearer
        .into_iter()
        .chain(kept.then_some("add --precision reference"));
    let hint = hints.collect::<Vec<_>>().join(", or ");
    Problem {
        path: format!("{path}.shape.{}", loss.key),
        message: format!(
            "{} is lost in {stored} precision, so there is nothing to see{which}",
            loss.label
        ),
        hint: (!hint.is_empty()).then_some(hint),
        within: None,
    }
}

#[cfg(test)]
mod tests;
