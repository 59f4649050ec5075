//! Detection of shapes that collapse when their coordinates are rounded for storage: an extent such
//! as the height of a box becomes zero. Preparation makes the check. Validation cannot, because it
//! does not know whether coordinates are stored in `f32` or `f64`.

use glam::{DMat3, DVec3};
use raywright_bvh::Real;

use crate::affine::affine_from_steps;
use crate::fault::{Fault, FaultKind, Subject};
use crate::generate::generator_offsets;
use crate::lookup::SceneLookup;
use crate::motion::object_transforms_at_ends;
use crate::scene::{Generator, Object, Scene, Shape};
use crate::shape::shape_origin;
use crate::storage_origin::StorageOrigin;
use crate::validate::{MAX_PROBLEMS, do_edges_span_no_area, format_list};

/// An extent of a shape, such as the height of a box, that becomes zero when the shape's
/// coordinates are rounded for storage.
struct LostExtent {
    /// Path of the shape's field, for the message.
    key: &'static str,
    /// Description of the lost extent, for the message.
    label: &'static str,
    /// Whether the cause is the shape's distance from the storage origin. Otherwise the shape
    /// itself is too flat.
    caused_by_distance: bool,
}

/// Whether a shape collapses if `offset` is added to its coordinates and they are rounded by
/// `round`.
pub(super) fn shape_collapses(shape: &Shape, offset: DVec3, round: impl Fn(f64) -> f64) -> bool {
    find_lost_extent(shape, offset, round).is_some()
}

/// Returns the extent that a shape loses if `offset` is added to its coordinates and they are
/// rounded by `round`; `None` if it loses none.
fn find_lost_extent(
    shape: &Shape,
    offset: DVec3,
    round: impl Fn(f64) -> f64,
) -> Option<LostExtent> {
    let stored = |p: DVec3| (p + offset).to_array().map(&round).into();
    let flat =
        |[a, b, c]: [DVec3; 3]| a == b || b == c || c == a || do_edges_span_no_area(b - a, c - a);
    let far = |key, label| {
        Some(LostExtent {
            key,
            label,
            caused_by_distance: true,
        })
    };
    match *shape {
        Shape::Box { min, max } if !DVec3::cmplt(stored(min.into()), stored(max.into())).all() => {
            far("box.max", "the distance between `min` and `max`")
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
            far("triangle.vertices", "the distance between the corners")
        }
        Shape::Torus {
            major_radius,
            minor_radius,
            ..
        } if round(minor_radius) >= round(major_radius) => Some(LostExtent {
            key: "torus.minor_radius",
            label: "the difference between `minor_radius` and `major_radius`",
            caused_by_distance: false,
        }),
        _ => None,
    }
}

/// Rounds a number to the stored scalar `R`.
pub(crate) fn round_to_scalar<R: Real>(x: f64) -> f64 {
    R::from_f64(x).to_f64()
}

/// Returns the translation of an object whose transform is only a translation. The shape of such an
/// object is stored in translated coordinates. `None` for a rotated, scaled or moving object, whose
/// shape is stored in its own coordinates.
fn pure_translation(object: &Object) -> Option<DVec3> {
    let map = affine_from_steps(&object.transform);
    (map.matrix3 == DMat3::IDENTITY && object_transforms_at_ends(object).is_none())
        .then_some(map.translation)
}

/// Returns the problems of objects that collapse when stored: one for each listed object, and one
/// for the first collapsing object of each generator. At most [`MAX_PROBLEMS`] problems.
pub(crate) fn find_collapsed_objects<R: Real>(scene: &Scene) -> Vec<Fault> {
    collapsed_relative_to::<R>(
        scene,
        StorageOrigin::from_scene::<R>(scene, &SceneLookup::new(scene)).origin,
    )
}

/// Returns the problems of [`find_collapsed_objects`] for coordinates relative to an origin.
pub(super) fn collapsed_relative_to<R: Real>(scene: &Scene, origin: DVec3) -> Vec<Fault> {
    let objects = scene.objects.iter().enumerate();
    let listed =
        objects.filter_map(|(i, object)| Some((i, listed_object_problem::<R>(object, origin)?)));
    let generators = scene.generators.iter().zip(scene.objects.len()..);
    let generated = generators
        .filter_map(|(generator, i)| Some((i, generated_object_problem::<R>(generator, origin)?)));
    let named = |(index, fault): (usize, Fault)| {
        let subject = Subject::Object(index);
        Fault {
            subject,
            path: subject.scene_path(scene) + &fault.path,
            ..fault
        }
    };
    listed
        .chain(generated)
        .map(named)
        .take(MAX_PROBLEMS)
        .collect()
}

/// Returns the problem of a listed object, if it collapses.
fn listed_object_problem<R: Real>(object: &Object, origin: DVec3) -> Option<Fault> {
    let offset = pure_translation(object)
        .map_or_else(|| -shape_origin(&object.shape), |offset| offset - origin);
    let loss = find_lost_extent(&object.shape, offset, round_to_scalar::<R>)?;
    let nearer = loss
        .caused_by_distance
        .then_some("move the object nearer to the rest of the scene");
    Some(collapse_problem::<R>(
        &loss,
        "",
        nearer,
        !shape_collapses(&object.shape, offset, |x| x),
    ))
}

/// Returns the problem of a generator's first object that collapses at its position.
fn generated_object_problem<R: Real>(generator: &Generator, origin: DVec3) -> Option<Fault> {
    let object = &generator.object;
    let placed = matches!(
        object.shape,
        Shape::Box { .. } | Shape::Quad { .. } | Shape::Triangle { .. }
    );
    let Some(own) = pure_translation(object).filter(|_| placed) else {
        return listed_object_problem::<R>(object, origin);
    };
    let own = own - origin;
    let lost = |(i, position)| {
        Some((
            i,
            position,
            find_lost_extent(&object.shape, position + own, round_to_scalar::<R>)?,
        ))
    };
    let (index, position, loss) = generator_offsets(&generator.kind)
        .enumerate()
        .find_map(lost)?;
    let which = format!(
        " of the generator's object {index}, at {}",
        format_list(&position.to_array())
    );
    let nearer = Some("make the object larger, move the generator nearer to the rest of the scene");
    Some(collapse_problem::<R>(
        &loss,
        &which,
        nearer,
        !shape_collapses(&object.shape, position + own, |x| x),
    ))
}

/// Returns the problem of a collapsing object, with hints. `which` describes an object of a
/// generator. `nearer` is a hint that proposes another position. `kept` is whether the shape
/// survives in double precision.
fn collapse_problem<R: Real>(
    loss: &LostExtent,
    which: &str,
    nearer: Option<&str>,
    kept: bool,
) -> Fault {
    let stored = if R::ROUNDOFF == R::from_f64(f64::ROUNDOFF) {
        "double"
    } else {
        "single"
    };
    let hints = nearer
        .into_iter()
        .chain(kept.then_some("add --precision reference"));
    let message = format!(
        "{} rounds to zero in {stored} precision, so nothing is visible{which}",
        loss.label
    );
    Fault {
        path: format!(".shape.{}", loss.key),
        ..FaultKind::LostShape.fault(
            Subject::Scene,
            message,
            hints.collect::<Vec<_>>().join(", or "),
        )
    }
}

#[cfg(test)]
mod tests;
