//! Detection of shapes that collapse when their coordinates are rounded for storage, because
//! differences of large coordinates lie below the resolution of the scalar. Preparation makes the
//! check, because validation does not know the scalar: an extent lost in `f32` may exist in `f64`.

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

/// The extent that a collapsing shape loses.
struct CollapseLoss {
    /// Path of the shape's field, for the message.
    key: &'static str,
    /// Description of the lost extent, for the message.
    label: &'static str,
    /// Whether the shape's distance from the origin is the cause.
    far: bool,
}

/// Whether a shape collapses if its coordinates, moved by an offset, are rounded.
pub(super) fn collapses(shape: &Shape, offset: DVec3, round: impl Fn(f64) -> f64) -> bool {
    loss(shape, offset, round).is_some()
}

/// Returns the extent that a shape loses if its coordinates, moved by an offset, are rounded.
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

/// Rounds a number to the stored scalar `R`.
pub(crate) fn rounded<R: Real>(x: f64) -> f64 {
    R::from_f64(x).to_f64()
}

/// Returns the translation of an object that is only translated; such a shape is stored in
/// translated coordinates. `None` for a rotated, scaled or moving object, whose shape is stored in
/// its own coordinates.
fn moved_by(object: &Object) -> Option<DVec3> {
    let map = affine(&object.transform);
    (map.matrix3 == DMat3::IDENTITY && ends(object).is_none()).then_some(map.translation)
}

/// Returns a problem for each listed object that collapses when stored, and for each generator's
/// first such object; at most [`MOST`] problems.
pub(crate) fn collapsed<R: Real>(scene: &Scene) -> Vec<Problem> {
    collapsed_about::<R>(
        scene,
        StorageOrigin::from_scene::<R>(scene, &SceneLookup::new(scene)).origin,
    )
}

/// Returns the problems of [`collapsed`] for coordinates relative to an origin.
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

/// Returns the problem of a listed object, if it collapses.
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

/// Returns the problem of a generator's first object that collapses at its position.
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

/// Returns the problem of a collapsing object, with hints. `which` names the object of a generator,
/// `nearer` is a hint about its place. `kept` tells whether the shape survives in double precision.
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
