//! Emitters chosen by their power.

use super::*;
use glam::{DVec3, Vec3};
use raywright_bvh::shapes::{AnyShape, Quad, Sphere, Triangle};
use raywright_bvh::{AcceleratorKind, Geometry, PrimitiveSet, TriangleSlot, Visibility};

/// Spheres of area one with these powers.
fn lights(powers: &[f64]) -> Emitters<f32> {
    let ball = Sphere {
        centre: Vec3::ZERO,
        radius: 1.0,
    };
    let mut list = EmitterList::default();
    for &power in powers {
        list.add_shape(
            ball.into(),
            EmissionEstimate::from_uniform_emission(Vec3::new(power as f32, 0.0, 0.0)),
            Side::Outside,
            Some(1.0),
        );
    }
    Emitters::new(list)
}

/// Number of picks, evenly spread over the first `share` of [0, 1), that sample the emitter of this
/// power.
fn drawn(lights: &Emitters<f32>, power: f32, share: f64, picks: u32) -> u32 {
    let pick = |i: u32| {
        let cells = share * f64::from(i) / f64::from(picks) * f64::from(1 << 23);
        [
            (cells.floor() / f64::from(1 << 23)) as f32,
            cells.fract() as f32,
        ]
    };
    let radiance = |lights: &Emitters<f32>, pick| {
        lights
            .sample_emitter(pick)
            .map(|(index, _)| lights.list.emitters[index as usize].radiance.x)
            .expect("there are emitters")
    };
    (0..picks)
        .filter(|&i| radiance(lights, pick(i)) == power)
        .count() as u32
}

/// Protects: an emitter without power is never sampled, a nearly powerless one does not disturb the
/// others, and without any power the list is empty instead of NaN.
#[test]
fn m10_powers_of_any_size_are_drawn_in_their_share() {
    assert!(
        [lights(&[]), lights(&[0.0, 0.0])]
            .iter()
            .all(|none| none.is_empty() && none.sample_emitter([0.5; 2]).is_none())
    );
    let all = [0.0, 1e-30, 1.0, 1e30];
    for turn in 0..4 {
        let mut powers = all;
        powers.rotate_left(turn);
        let lights = lights(&powers);
        assert_eq!((lights.len(), lights.powered_count()), (4, 3));
        assert_eq!(drawn(&lights, 0.0, 1.0, 10_000), 0);
        assert!(drawn(&lights, 1e30, 1.0, 10_000) >= 9_999);
        let pick = [[0.0; 2], [0.5; 2], [1.0_f32.next_down(); 2]]
            .map(|pick| lights.sample_emitter(pick).expect("three give off light").1);
        assert!(pick.iter().all(|p| *p > 0.0 && *p <= 1.0), "{pick:?}");
    }
}

/// Protects: an emitter is sampled with its stated probability, also below a step of `f32`.
#[test]
fn faint_emitters_are_drawn_as_often_as_they_should() {
    let lights = lights(&[f64::from(2.0_f32.powi(-30)), 1.0]);
    let (_, probability) = lights
        .sample_emitter([0.0; 2])
        .expect("both give off light");
    let share = 2.0_f64.powi(-30) / (1.0 + 2.0_f64.powi(-30));
    assert!(
        (probability / share - 1.0).abs() < 1e-9,
        "{probability} instead of {share}"
    );
    // One of 128 picks within the first step.
    let found = drawn(&lights, 2.0_f32.powi(-30), 1.0 / f64::from(1 << 23), 12_800);
    assert!((99..=101).contains(&found), "{found} instead of 100");
}

/// Protects: a flat emitter's radiance, density and bounds, seen from the front and the back, are
/// non-zero exactly on emissive sides; its power is π · area for each such side.
#[test]
fn each_side_shines_or_does_not() {
    let quad: AnyShape<f32> =
        Quad::new(DVec3::new(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0).into();
    for (side, shines) in [
        (Side::Outside, [true, false]),
        (Side::Inside, [false, true]),
        (Side::Both, [true, true]),
    ] {
        let mut list = EmitterList::<f32>::default();
        list.add_shape(
            quad,
            EmissionEstimate::from_uniform_emission(Vec3::X),
            side,
            None,
        );
        let lamp = Emitters::new(list);
        let sides = f64::from(u8::from(shines[0]) + u8::from(shines[1]));
        assert!(
            (lamp.power(0) - sides * PI * 4.0).abs() < 1e-9,
            "{side:?}: {}",
            lamp.power(0)
        );
        let surface = Surface {
            point: Vec3::ZERO,
            above: Vec3::ZERO,
            below: Vec3::ZERO,
            error: 0.0,
            normal: Vec3::Z,
        };
        for (from, shines) in [Vec3::Z, Vec3::NEG_Z].into_iter().zip(shines) {
            let radiance = lamp.radiance(
                0,
                &EmissionPoint {
                    surface,
                    uv: [0.0; 2],
                    direction: -from,
                },
            );
            assert_eq!(
                radiance,
                if shines { Vec3::X } else { Vec3::ZERO },
                "{side:?} from {from}"
            );
            assert_eq!(
                lamp.sample(0, from, [0.5; 2], 1.0).is_some(),
                shines,
                "{side:?} from {from}"
            );
            assert_eq!(
                lamp.density(0, from, &surface, 1.0) > 0.0,
                shines,
                "{side:?} from {from}"
            );
            assert_eq!(
                lamp.bounds(0)
                    .expect("it has an end")
                    .may_emit(from.as_dvec3()),
                shines,
                "{side:?} from {from}"
            );
        }
    }
}

/// Protects: each emitter knows its triangles in the geometry, both halves of a quad, and those of
/// no other object; a sphere has none.
#[test]
fn emitters_know_their_triangles() {
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    let square = [
        corner(0.0, 0.0),
        corner(1.0, 0.0),
        corner(1.0, 1.0),
        corner(0.0, 1.0),
    ];
    let [a, b, c, d] = square;
    let triangles = [[a, b, c], [a, c, d], [a, b, d]];
    let ball = Sphere {
        centre: Vec3::ONE,
        radius: 0.5,
    };
    let even = EmissionEstimate::from_uniform_emission(Vec3::ONE);
    let (mut group, mut list) = (PrimitiveSet::<f32>::default(), EmitterList::default());
    group.add_mesh(triangles, Visibility::default()).unwrap();
    list.begin_object();
    group.add_mesh(triangles, Visibility::default()).unwrap();
    list.begin_object();
    list.add_quad_halves(Quad { corners: square }, Vec3::ONE, Side::Both);
    list.add_shape(
        AnyShape::Triangle(Triangle::new(triangles[2])),
        even,
        Side::Both,
        None,
    );
    group.add_sphere(ball, Visibility::default()).unwrap();
    list.begin_object();
    list.add_shape(AnyShape::Sphere(ball), even, Side::Both, None);
    let mut emitters = Emitters::new(list);
    let geometry = Geometry::new(group, AcceleratorKind::default());
    emitters.find_triangles(&geometry);
    let none = TriangleSlot::NONE;
    let slot = |primitive: u32| {
        let own = geometry
            .triangle_slots()
            .find(|&(_, object, own)| (object, own) == (1, primitive));
        own.expect("a triangle").0
    };
    let [mut halves, third, sphere] = [0, 2, 3].map(|emitter| emitters.triangles(emitter));
    let mut own = [slot(0), slot(1)];
    let order = |slot: &TriangleSlot| format!("{slot:?}");
    halves.sort_by_key(order);
    own.sort_by_key(order);
    assert_eq!((halves, third, sphere), (own, [slot(2), none], [none; 2]));
}
