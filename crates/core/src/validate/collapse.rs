//! Shapes whose extent is lost where coordinates are stored in f32, as all precisions but `reference` do: the difference of
//! two large numbers that f32 does not tell apart.

use glam::{DMat3, DVec3};

use super::check::{Check, list};
use crate::affine::affine;
use crate::generate::{count_of, places};
use crate::scene::{Generator, Object, Shape};

/// What becomes of a shape that would be nothing.
struct Loss {
    /// Path within the shape.
    key: &'static str,
    /// What is lost.
    what: &'static str,
    /// Whether that is a matter of where the shape is.
    far: bool,
}

/// Objects of a generator that are looked at one by one, a tenth of a second's worth; loading refuses far fewer. Beyond it only
/// preparation sees what is lost.
const MOST_PLACES: u64 = 100_000_000;

const STORED: &str = "in single precision, so there is nothing to see";

/// Sine of the angle between the edges of a figure below which it has no area.
const FLAT: f64 = 1e-12;

/// Whether two edges that have a length span none between them.
pub(super) fn no_area(u: DVec3, v: DVec3) -> bool {
    let (u, v) = (u.normalize_or_zero(), v.normalize_or_zero());
    u != DVec3::ZERO && v != DVec3::ZERO && u.cross(v).length() < FLAT
}

/// Whether rounding coordinates leaves nothing of a shape moved by an offset.
pub(crate) fn collapses(shape: &Shape, offset: DVec3, round: impl Fn(f64) -> f64) -> bool {
    loss(shape, offset, round).is_some()
}

fn loss(shape: &Shape, offset: DVec3, round: impl Fn(f64) -> f64) -> Option<Loss> {
    let stored = |p: DVec3| (p + offset).to_array().map(&round).into();
    let flat = |[a, b, c]: [DVec3; 3]| a == b || b == c || c == a || no_area(b - a, c - a);
    let far = |key, what| Some(Loss { key, what, far: true });
    match *shape {
        Shape::Box { min, max } if !DVec3::cmplt(stored(min.into()), stored(max.into())).all() => {
            far("box.max", "the distance of `max` from `min`")
        }
        Shape::Quad { corner, edge_u, edge_v } => {
            let corner = DVec3::from(corner);
            let corners = [corner, corner + DVec3::from(edge_u), corner + DVec3::from(edge_v)];
            if flat(corners.map(stored)) { far("quad.corner", "the size of the quad at its `corner`") } else { None }
        }
        Shape::Triangle { vertices } if flat(vertices.map(|p| stored(p.into()))) => {
            far("triangle.vertices", "the distance of the corners")
        }
        Shape::Torus { major_radius, minor_radius, .. } if round(minor_radius) >= round(major_radius) => {
            Some(Loss { key: "torus.minor_radius", what: "the difference of `minor_radius` from `major_radius`", far: false })
        }
        _ => None,
    }
}

fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

/// As preparation has it: only a shape that is not just moved keeps a space of its own. None: it does.
fn moved_by(object: &Object) -> Option<DVec3> {
    let map = affine(&object.transform);
    (map.matrix3 == DMat3::IDENTITY).then_some(map.translation)
}

/// A listed object, which has no other problem.
pub(super) fn listed(check: &mut Check<'_>, object: &Object) {
    let Some(loss) = loss(&object.shape, moved_by(object).unwrap_or_default(), single) else { return };
    let message = format!("{} is lost {STORED}", loss.what);
    check.inside("shape", |check| {
        check.inside(loss.key, |check| {
            if loss.far { check.advise(message, "move it nearer to the origin") } else { check.report(message) }
        });
    });
}

/// The objects of a generator, which has no other problem, each where it lands: the first that is lost is named.
pub(super) fn generated(check: &mut Check<'_>, generator: &Generator) {
    let Some(own) = moved_by(&generator.object).filter(|_| count_of(&generator.kind) <= MOST_PLACES) else {
        return check.inside("object", |check| listed(check, &generator.object));
    };
    let shape = &generator.object.shape;
    if !matches!(shape, Shape::Box { .. } | Shape::Quad { .. } | Shape::Triangle { .. }) {
        return check.inside("object", |check| listed(check, &generator.object));
    }
    let lost = places(&generator.kind).enumerate().find_map(|(i, place)| Some((i, place, loss(shape, place + own, single)?)));
    if let Some((index, place, loss)) = lost {
        let message = format!("{} is lost {STORED} of the generator's object {index}, at {}", loss.what, list(&place.to_array()));
        let hint = "make it larger, or put the generator's places nearer to the origin";
        check.inside("object.shape", |check| check.inside(loss.key, |check| check.advise(message, hint)));
    }
}
