//! Starts of rays beside edges: on the side to which the ray leaves, of both faces there, whatever map flattens the shape.

use glam::{DAffine3, DMat3, DVec3};
use raywright_bvh::shapes::{
    AnyShape, Cone, Cuboid, Cylinder, Disk, Ends, Hyperboloid, Paraboloid, Placed, Quad, Sphere, Torus, Triangle,
};
use raywright_bvh::{Interval, Precision, Probe, Ray, Real, Reference, Robust, Side, Surface, Vector};

use crate::borders::depth;
use crate::mapped::solved;
use crate::support::{Outcome, Random, Verdict, exact, hex, judge, stored, towards};

type Height = Box<dyn Fn(DVec3) -> f64 + Sync>;
type Edge = Box<dyn Fn(&mut Random) -> DVec3 + Sync>;

/// A shape, a function that is positive outside of it (on its outer side, of an open one), by a formula of its own, and points
/// of its edges.
struct Edged<P: Precision> {
    name: &'static str,
    shape: AnyShape<P::Real>,
    height: Height,
    edge: Edge,
    /// A point and the direction of its axis, of a shape of revolution.
    axis: Option<(DVec3, DVec3)>,
    /// How thick it is where it is thickest, across its thinnest direction; infinite where there is no inside to be thin.
    thick: f64,
}

/// A point of the circle at an offset along an axis.
fn rim(random: &mut Random, centre: DVec3, axis: DVec3, radius: f64) -> DVec3 {
    centre + random.disc(axis.normalize(), 1.0).normalize() * radius
}

fn turned<P: Precision>(name: &'static str, axis: DVec3, radii: [f64; 2]) -> Edged<P> {
    let base = DVec3::new(0.25, -0.5, 0.125);
    let (b, a) = (stored::<P>(base), stored::<P>(axis));
    let [low, high] = radii.map(P::Real::from_f64);
    let shape = if low == high {
        Cylinder { base: b, axis: a, radius: low, ends: Ends::Capped }.into()
    } else {
        Cone { base: b, axis: a, radius: low, top_radius: high }.into()
    };
    let edge = move |random: &mut Random| {
        if random.sign() > 0.0 { rim(random, base + axis, axis, radii[1]) } else { rim(random, base, axis, radii[0]) }
    };
    let height = Box::new(move |p| -depth(p, base, axis, radii));
    Edged {
        name,
        shape,
        height,
        edge: Box::new(edge),
        axis: Some((base, axis)),
        thick: axis.length().min(radii[0].max(radii[1])),
    }
}

/// A point of the border of a polygon.
fn border(corners: &[DVec3], random: &mut Random) -> DVec3 {
    let i = (random.bits() % corners.len() as u64) as usize;
    let share = if random.unit() < 0.3 { 0.0 } else { random.unit() };
    corners[i] + (corners[(i + 1) % corners.len()] - corners[i]) * share
}

fn flat<P: Precision>(name: &'static str, corners: &[DVec3]) -> Edged<P> {
    let (a, normal) = (corners[0], (corners[1] - corners[0]).cross(corners[2] - corners[0]));
    let shape = match *corners {
        [a, b, c] => Triangle { vertices: [a, b, c].map(stored::<P>) }.into(),
        _ => Quad { corners: core::array::from_fn(|i| stored::<P>(corners[i])) }.into(),
    };
    let corners = corners.to_vec();
    Edged {
        name,
        shape,
        height: Box::new(move |p| normal.dot(p - a)),
        edge: Box::new(move |random| border(&corners, random)),
        axis: None,
        thick: f64::INFINITY,
    }
}

/// The ones with edges, of a size about one, in numbers that f32 holds.
fn edged<P: Precision>() -> Vec<Edged<P>> {
    let real = P::Real::from_f64;
    let (min, max) = (DVec3::new(-0.75, -0.5, -1.0), DVec3::new(0.5, 1.0, 0.75));
    let corner = DVec3::new(-0.5, -0.25, 0.125);
    let (eu, ev) = (DVec3::new(1.0, 0.25, 0.0), DVec3::new(0.25, 0.75, 0.5));
    let on_box = move |random: &mut Random| {
        let along = (random.bits() % 3) as usize;
        let mut p = DVec3::from_array(core::array::from_fn(|i| if random.sign() > 0.0 { min[i] } else { max[i] }));
        p[along] = if random.unit() < 0.3 { p[along] } else { random.between(min[along], max[along]) };
        p
    };
    let centre = DVec3::new(0.25, -0.125, 0.5);
    let slanted = DVec3::new(0.5, 1.0, -0.25);
    vec![
        Edged {
            name: "box",
            shape: Cuboid { min: stored::<P>(min), max: stored::<P>(max) }.into(),
            height: Box::new(move |p| (min - p).max(p - max).max_element()),
            edge: Box::new(on_box),
            axis: None,
            thick: 1.0,
        },
        turned("cylinder", slanted, [0.5, 0.5]),
        turned("cone", slanted, [0.75, 0.0]),
        turned("truncated cone", slanted, [0.25, 0.75]),
        turned("flat cone", slanted / 64.0, [0.75, 0.0]),
        turned("needle of a cone", slanted, [1.0 / 256.0, 0.0]),
        Edged {
            name: "disk",
            shape: Disk { centre: stored::<P>(centre), normal: stored::<P>(DVec3::Z), radius: real(0.75) }.into(),
            height: Box::new(move |p| p.z - centre.z),
            edge: Box::new(move |random| rim(random, centre, DVec3::Z, 0.75)),
            axis: None,
            thick: f64::INFINITY,
        },
        flat("quad", &[corner, corner + eu, corner + eu + ev, corner + ev]),
        flat("triangle", &[corner, corner + eu, corner + ev]),
        Edged {
            name: "hyperboloid",
            shape: Hyperboloid { centre: stored::<P>(centre), waist: real(0.5), slope: real(0.5), half_height: real(0.5) }.into(),
            height: Box::new(move |p| {
                let q = p - centre;
                q.x * q.x + q.z * q.z - q.y * q.y - 0.25
            }),
            edge: Box::new(move |random| {
                let end = centre + DVec3::Y * (0.5 * random.sign());
                rim(random, end, DVec3::Y, 0.5_f64.sqrt())
            }),
            axis: Some((centre, DVec3::Y)),
            thick: 0.5,
        },
        Edged {
            name: "paraboloid",
            shape: Paraboloid { apex: stored::<P>(centre), radius: real(0.75), height: real(0.75) }.into(),
            height: Box::new(move |p| {
                let q = p - centre;
                (q.x * q.x + q.z * q.z) / 0.75 - q.y
            }),
            edge: Box::new(move |random| rim(random, centre + DVec3::Y * 0.75, DVec3::Y, 0.75)),
            axis: Some((centre, DVec3::Y)),
            thick: 0.5,
        },
    ]
}

/// A map that flattens by a factor across a direction aslant to everything, turned and moved.
fn flattening(random: &mut Random, by: f64) -> DAffine3 {
    let n = random.direction();
    let squeeze = DMat3::IDENTITY + DMat3::from_cols(n * n.x, n * n.y, n * n.z) * (by - 1.0);
    let turn = DMat3::from_axis_angle(random.direction(), random.between(0.0, 6.0));
    DAffine3 { matrix3: turn * squeeze, translation: exact(random.cube() * random.pick(&[0.0, 0.5, 10.0, 1000.0])) }
}

/// Where a start lies in the shape's space; as precise as it can be, so that the last digit decides.
fn back(map: DAffine3, start: DVec3) -> DVec3 {
    solved(map.matrix3, start - map.translation)
}

/// Whether a map has bent a shape of revolution about its axis so sharply that within the error of a point it curves away by as
/// much: an edge to all intents, but one that no formula knows of.
fn is_crease<P: Precision>(edged: &Edged<P>, map: DAffine3, surface: &Surface<P::Real>) -> bool {
    let Some((centre, axis)) = edged.axis else { return false };
    let (p, error) = (back(map, surface.point.to_f64()), surface.error.to_f64());
    let around = axis.cross(p - centre);
    let step = around * (8.0 * error / (map.matrix3 * around).length());
    let deep = solved(map.matrix3, surface.normal.to_f64() * -error);
    let height = |p| (edged.height)(p);
    // To first order: farther in it curves as well.
    (height(p + step) - height(p)).abs() > 0.02 * 1024.0 * (height(p + deep / 1024.0) - height(p)).abs()
}

/// Rays from hits beside edges, to both sides, under maps that flatten by a factor; as it is without one.
fn starts<P: Precision>(edged: &Edged<P>, by: f64) -> Outcome {
    let Edged { name, shape, height, edge, .. } = edged;
    judge(&format!("starts on the {name}, flattened by {by:e}, in {:?}", P::default()), 420, 50_000, |random| {
        let map = if by == 1.0 { DAffine3::from_translation(random.cube().round()) } else { flattening(random, by) };
        let placed = Placed::<P>::new(*shape, map).expect("an invertible map");
        let off = 10_f64.powf(random.between(-9.0, -0.5));
        let target = map.transform_point3(edge(random) + random.cube() * off);
        let ray = towards::<P>(target + random.direction() * random.pick(&[0.5, 3.0, 30.0]), target);
        let probe = Probe::<P>::new(ray);
        let Some(hit) = placed.intersect(&probe, Interval::positive(), Side::Both) else { return Verdict::Skip };
        let surface = placed.locate(&probe, hit).stored::<P>();
        // A body that is no thicker than the errors of its points has no inside to start in.
        if surface.error.to_f64() > by * edged.thick * THINNEST || is_crease(edged, map, &surface) {
            return Verdict::Skip;
        }
        let normal = surface.normal.to_f64();
        for way in [normal, -normal] {
            let start = surface.spawn(stored::<P>(way)).to_f64();
            let inward = way == -normal;
            let above = height(back(map, start));
            if (above < 0.0) != inward {
                return Verdict::Wrong(format!("{above:e} above, inward {inward}, {surface:?} {map:?}{}", hex::<P>(&ray)));
            }
        }
        Verdict::Right(0.0)
    })
}

/// The greatest share of starts beside the edges of round shapes that may lie in a crease.
const CREASES: f64 = 1.0 / 300.0;

/// The greatest error bound of a start, as a share of how flat the map makes a shape of size one, with which it is judged.
const THINNEST: f64 = 1.0 / 128.0;

fn all_sides<P: Precision>() {
    for edged in edged::<P>().iter().filter(|edged| edged.name != "needle of a cone") {
        let round = edged.axis.is_some();
        // Flatter, a round shape is creases all along, or its tip is, and some starts fail.
        let flattest = if round { 1e-3 } else { 1e-6 };
        for by in [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6].into_iter().filter(|&by| by >= flattest) {
            let outcome = starts(edged, by);
            if !round || by >= 0.1 {
                // Flatter than this, f32 places are no more exact than a box is thick.
                outcome.expect_right(if by >= 1e-4 { 1000 } else { 0 });
                continue;
            }
            // What `is_crease` does not know is left: where a map bends a round wall more sharply than points are exact.
            eprintln!("{}: {} of {}", outcome.case, outcome.wrong, outcome.judged);
            assert!(outcome.wrong_share() < CREASES, "{}: {:?}", outcome.case, outcome.first);
        }
    }
}

/// Protects: a start beside an edge lies on the side to which its ray leaves, however sharp a map makes the edge.
#[test]
fn starts_beside_edges_are_on_the_right_side() {
    all_sides::<Robust>();
    all_sides::<Reference>();
}

/// Protects: the same without any map: the seams of a can and of cones, flat and pointed.
#[test]
fn starts_beside_seams_are_on_the_right_side() {
    fn check<P: Precision>() {
        for Edged { name, shape, height, edge, .. } in &edged::<P>() {
            judge(&format!("starts on the {name} in {:?}", P::default()), 421, 100_000, |random| {
                let target = edge(random) + random.cube() * 10_f64.powf(random.between(-9.0, -0.5));
                let ray = towards::<P>(target + random.direction() * random.pick(&[0.5, 3.0, 30.0]), target);
                let probe = Probe::<P>::new(ray);
                let hit = raywright_bvh::Shape::intersect(shape, &probe, Interval::positive(), Side::Both);
                let Some(hit) = hit else { return Verdict::Skip };
                let surface = raywright_bvh::Shape::surface(shape, &probe, hit);
                let normal = surface.normal.to_f64();
                let above = [normal, -normal].map(|way| height(surface.spawn(stored::<P>(way)).to_f64()));
                Verdict::holds(above[0] > 0.0 && above[1] < 0.0, || format!("{above:?} {surface:?}{}", hex::<P>(&ray)))
            })
            .expect_right(20_000);
        }
    }
    check::<Robust>();
    check::<Reference>();
}

/// Protects: starts far from the origin: one outside a ball or a ring is outside, in f64 too. That the bound counts the centre
/// is judged before storage, whose rounding is as large, by `stated_bounds_hold_far_from_the_origin`.
#[test]
fn far_starts_are_outside() {
    fn check<P: Precision>() {
        let real = P::Real::from_f64;
        for far in [1.0, 1e4, 1e8] {
            judge(&format!("starts on far round shapes in {:?}", P::default()), 422, 40_000, |random| {
                let centre = exact(random.direction() * far);
                // Large enough to be seen among the roundings there.
                let size =
                    if P::Real::ROUNDOFF == real(crate::support::U) { f64::from((far * 1e-3).max(1.0) as f32) } else { 1.0 };
                let (c, axis) = (stored::<P>(centre), stored::<P>(DVec3::Y));
                let ring = random.sign() > 0.0;
                let shape: AnyShape<P::Real> = if ring {
                    Torus { centre: c, axis, major_radius: real(size), minor_radius: real(size * 0.25) }.into()
                } else {
                    Sphere { centre: c, radius: real(size) }.into()
                };
                let ray = towards::<P>(centre + random.direction() * size * 4.0, centre + random.cube() * size);
                let probe = Probe::<P>::new(ray);
                let hit = raywright_bvh::Shape::intersect(&shape, &probe, Interval::positive(), Side::Both);
                let Some(hit) = hit else { return Verdict::Skip };
                let surface = raywright_bvh::Shape::surface(&shape, &probe, hit);
                let above = |p: DVec3| {
                    let q = p - centre;
                    let out = DVec3::new(q.x, 0.0, q.z).length() - size;
                    if ring { (out * out + q.y * q.y).sqrt() - size * 0.25 } else { q.length() - size }
                };
                let normal = surface.normal.to_f64();
                let above = [normal, -normal].map(|way| above(surface.spawn(stored::<P>(way)).to_f64()));
                Verdict::holds(above[0] > 0.0 && above[1] < 0.0, || format!("{above:?} {surface:?}{}", hex::<P>(&ray)))
            })
            .expect_right(8_000);
        }
    }
    check::<Robust>();
    check::<Reference>();
}

/// Protects: rays from the outside of a map's image do not meet it again, however the map is conditioned. That the bound counts
/// the way back is judged by `bounds_count_the_way_back`: under most maps the normal hides it.
#[test]
fn starts_under_ill_conditioned_maps_are_clear() {
    fn check<P: Precision>() {
        for Edged { name, shape, thick, .. } in edged::<P>()
            .into_iter()
            .filter(|e| !matches!(e.name, "hyperboloid" | "paraboloid" | "needle of a cone" | "flat cone"))
        {
            judge(&format!("rays that leave the {name} in {:?}", P::default()), 423, 20_000, |random| {
                let by = 10_f64.powf(random.between(-6.0, -3.0));
                let map = flattening(random, by);
                let placed = Placed::<P>::new(shape, map).expect("an invertible map");
                let target = map.transform_point3(random.cube() * 0.5);
                let ray = towards::<P>(target + random.direction() * random.pick(&[1.0, 30.0]), target);
                let probe = Probe::<P>::new(ray);
                let Some(hit) = placed.intersect(&probe, Interval::positive(), Side::Outside) else { return Verdict::Skip };
                let surface = placed.locate(&probe, hit).stored::<P>();
                if surface.error.to_f64() > by * thick * THINNEST {
                    return Verdict::Skip;
                }
                for _ in 0..20 {
                    let d = exact(random.direction());
                    let d = if surface.normal.to_f64().dot(d) < 0.0 { -d } else { d };
                    let leaving = Ray::new(surface.spawn(stored::<P>(d)), stored::<P>(d));
                    if let Some(again) = placed.intersect(&Probe::<P>::new(leaving), Interval::positive(), Side::Both) {
                        return Verdict::Wrong(format!("{again:?} {surface:?} {map:?}{}", hex::<P>(&leaving)));
                    }
                }
                Verdict::Right(0.0)
            })
            .expect_right(1);
        }
    }
    check::<Robust>();
    check::<Reference>();
}

/// Protects: the normal of a cone's tip, hit exactly, points out of the cone, whichever end the tip is.
#[test]
fn tips_point_outwards() {
    fn check<P: Precision>() {
        let real = P::Real::from_f64;
        for up in [1.0, -1.0] {
            for tip_first in [false, true] {
                // The tip at height `up`, its foot at zero.
                let (base, axis) = if tip_first { (DVec3::Y * up, DVec3::Y * -up) } else { (DVec3::ZERO, DVec3::Y * up) };
                let (low, high) = if tip_first { (0.0, 0.5) } else { (0.5, 0.0) };
                let (base, axis) = (stored::<P>(base), stored::<P>(axis));
                let cone = Cone { base, axis, radius: real(low), top_radius: real(high) };
                let ray = Ray::new(stored::<P>(DVec3::Y * (3.0 * up)), stored::<P>(DVec3::Y * -up));
                let probe = Probe::<P>::new(ray);
                let hit = raywright_bvh::Shape::intersect(&cone, &probe, Interval::positive(), Side::Both).expect("the tip");
                assert_eq!(hit.t.to_f64(), 2.0);
                let surface = raywright_bvh::Shape::surface(&cone, &probe, hit);
                let (normal, point) = (surface.normal.to_f64(), surface.point.to_f64());
                assert!(normal.y * up > 0.4, "{normal} at the tip of {cone:?}");
                // In the robust ones a start is beside the tip, above its wall or below.
                let inside = |p: DVec3| 1.0 - p.y * up - 2.0 * DVec3::new(p.x, 0.0, p.z).length() > 0.0;
                let inward = [normal, -normal].map(|way| inside(surface.spawn(stored::<P>(way)).to_f64()));
                assert!(!P::ROBUST || inward == [false, true], "{inward:?} beside the tip of {cone:?}");
                assert!((point - DVec3::Y * up).length() < 1e-5, "{point} for the tip of {cone:?}");
            }
        }
    }
    check::<raywright_bvh::Fast>();
    check::<Robust>();
    check::<Reference>();
}
