//! Points on polygons: several together against one alone, and solid angles and means against
//! closed forms.

use raywright_bvh::{SimdTask, run_widest};

use super::*;
use crate::hash::splitmix64;
use crate::light::LANES;

struct PolygonBatch<'a>(&'a PolygonLanes<LANES>);

impl SimdTask for PolygonBatch<'_> {
    type Output = PolygonSamples<LANES>;
    #[inline(always)]
    fn run(self) -> Self::Output {
        self.0.sample()
    }
}

/// A polygon, a receiving point, and two numbers.
fn query(i: u64) -> (Polygon, DVec3, [f64; 2]) {
    let number = |k: u64| (splitmix64(i * 32 + k) >> 11) as f64 / (1_u64 << 53) as f64;
    let place = |k: u64| DVec3::new(number(k), number(k + 1), number(k + 2)) * 4.0;
    let (a, u, v) = (place(0), place(3) - place(6), place(9) - place(12));
    let polygon = if i.is_multiple_of(3) {
        Polygon::from_triangle([a, a + u, a + v])
    } else {
        Polygon::from_quad([a, a + u, a + u + v, a + v])
    };
    let from = match i % 16 {
        // A corner, and a point in the polygon's plane.
        0 => a,
        1 => a + u * 3.0,
        _ => place(15),
    };
    let position = if i.is_multiple_of(7) {
        [0.0; 2]
    } else {
        [number(18), number(19)]
    };
    (polygon, from, position)
}

/// Protects: polygons sampled together have the point and solid angle of each alone, to the bit, in
/// any set of lanes; the solid angle equals [`Polygon::solid_angle`]; and points lie on their
/// polygons.
#[test]
fn lanes_have_the_points_of_one() {
    let queries: Vec<_> = (0..4_000).map(query).collect();
    let (mut drawn, mut small) = (0, 0);
    for (turn, queries) in queries.chunks(LANES).enumerate() {
        let queries = &queries[..1 + turn % LANES];
        let mut lanes = PolygonLanes::<LANES>::new();
        let put = |(lane, (polygon, from, position)): (usize, &(Polygon, DVec3, [f64; 2]))| {
            lanes.set_polygon(lane, polygon);
            lanes.set_point(lane, *from, *position);
        };
        queries.iter().enumerate().for_each(put);
        let points = run_widest(PolygonBatch(&lanes));
        let sample = |lane| PolygonSample {
            solid_angle: points.solid_angle[lane],
            point: points.point(lane),
        };
        let together: Vec<_> = (0..queries.len())
            .map(|lane| points.is_large_enough(lane).then(|| sample(lane)))
            .collect();
        for (sample, (polygon, from, position)) in together.into_iter().zip(queries) {
            assert_eq!(
                sample,
                polygon.sample(*from, *position),
                "{polygon:?} from {from}"
            );
            assert_eq!(
                sample.map(|sample| sample.solid_angle),
                polygon.solid_angle(*from),
                "{polygon:?} from {from}"
            );
            small += usize::from(sample.is_none());
            let Some(point) = sample.and_then(|sample| sample.point) else {
                continue;
            };
            drawn += 1;
            let Polygon([a, b, c, d]) = *polygon;
            let normal = (b - a).cross(c - a).normalize();
            let size = (c - a).length() + (d - b).length();
            assert!(
                (point - a).dot(normal).abs() < 1e-9 * size,
                "{polygon:?}: {point} off the plane"
            );
            let corners = [a, b, c, d];
            for (first, second) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                let inwards = normal.cross(second - first).dot(point - first);
                assert!(
                    inwards > -1e-6 * size * size,
                    "{polygon:?}: {point} outside"
                );
            }
        }
    }
    assert!(drawn > 1_500 && small > 50, "{drawn} {small}");
}

/// The mean of directions sampled by numbers in even steps.
fn mean(polygon: &Polygon, from: DVec3) -> DVec3 {
    // The first number chooses the triangle, where the direction has a step.
    const STEPS: [u32; 2] = [2048, 16];
    let at = |i: u32, steps: u32| (f64::from(i) + 0.5) / f64::from(steps);
    let numbers =
        (0..STEPS[0] * STEPS[1]).map(|i| [at(i / STEPS[1], STEPS[0]), at(i % STEPS[1], STEPS[1])]);
    let direction = |numbers| {
        let sample = polygon.sample(from, numbers).expect("it is wide");
        (sample.point.expect("a point") - from).normalize()
    };
    numbers.map(direction).sum::<DVec3>() / f64::from(STEPS[0] * STEPS[1])
}

/// Lambert's formula for the integral of directions over a polygon's solid angle: half the angle of
/// each side along its plane's normal.
fn lambert(corners: &[DVec3], from: DVec3) -> DVec3 {
    let directions: Vec<DVec3> = corners
        .iter()
        .map(|corner| (corner - from).normalize())
        .collect();
    let sides = directions.iter().zip(directions.iter().cycle().skip(1));
    sides
        .map(|(a, b)| a.cross(*b).normalize() * (0.5 * a.angle_between(*b)))
        .sum()
}

/// Protects: solid angles in closed form: an eighth of the sphere, a sixth of it, a rectangle
/// before its centre, and a triangle that is half of one. Points are uniform by solid angle: their
/// mean direction is Lambert's integral over the solid angle, also for a quad of two very different
/// halves.
#[test]
fn solid_angles_and_means_in_closed_form() {
    use core::f64::consts::PI;
    let rectangle =
        |x: f64, y: f64| [[-x, -y], [x, -y], [x, y], [-x, y]].map(|[x, y]| DVec3::new(x, y, 1.0));
    let octant = [DVec3::X, DVec3::Y, DVec3::Z];
    let [a, b, c, _] = rectangle(0.4, 1.5);
    let of_rectangle = 4.0 * libm::atan(0.4 * 1.5 / (1.0 + 0.16_f64 + 2.25).sqrt());
    let slanted = [
        DVec3::new(-1.0, -0.5, 1.0),
        DVec3::new(2.0, -0.5, 0.5),
        DVec3::new(2.0, 0.7, 0.5),
        DVec3::new(-1.0, 0.7, 1.0),
    ];
    for (corners, expected) in [
        (&octant[..], Some(0.5 * PI)),
        (&rectangle(1.0, 1.0)[..], Some(4.0 * PI / 6.0)),
        (&rectangle(0.4, 1.5)[..], Some(of_rectangle)),
        (&[a, b, c][..], Some(0.5 * of_rectangle)),
        (&slanted[..], None),
    ] {
        let polygon = match *corners {
            [a, b, c] => Polygon::from_triangle([a, b, c]),
            _ => Polygon::from_quad(core::array::from_fn(|i| corners[i])),
        };
        for from in [DVec3::ZERO, DVec3::new(0.1, 0.2, 0.3)] {
            let found = polygon.solid_angle(from).expect("it is wide");
            if let Some(expected) = expected.filter(|_| from == DVec3::ZERO) {
                assert!(
                    (found - expected).abs() < 1e-12,
                    "{corners:?}: {found}, not {expected}"
                );
            }
            let off = mean(&polygon, from).distance(lambert(corners, from) / found);
            assert!(off < 2e-3, "{corners:?} from {from}: {off} off");
        }
    }
    let small = Polygon::from_triangle(octant.map(|corner| DVec3::ONE * 20.0 + corner));
    assert!(
        small.solid_angle(DVec3::ZERO).is_none() && small.sample(DVec3::ZERO, [0.5; 2]).is_none()
    );
}
