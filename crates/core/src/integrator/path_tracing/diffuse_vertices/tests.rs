//! Whole vertices in lanes against single vertices, and against formulas in `f64`.

use core::f64::consts::PI;

use glam::{DVec3, Vec3};
use raywright_bvh::stability::verdicts::CaseRng;
use raywright_bvh::{RegisterWidth, Surface};

use super::super::light::power_heuristic;
use super::super::roulette::apply_roulette;
use super::*;
use crate::light::{get_lane_vector, rectangle_lamps_scene, set_lane_vector};
use crate::material::ShadingFrame;

/// A surface at a point, whose rays to both sides start beside the point.
fn surface(point: Vec3, normal: Vec3, scale: f32) -> Surface<f32> {
    let beside = normal.any_orthogonal_vector() * (1e-5 * scale);
    Surface {
        point,
        above: point + beside,
        below: point - beside,
        error: 4e-6 * scale,
        normal,
    }
}

fn random_vertices(rng: &mut CaseRng, scale: f32) -> VertexLanes<f32> {
    let mut vertices = VertexLanes::<f32>::new();
    vertices.len = LANES;
    for lane in 0..LANES {
        let mut number = |least: f64, most: f64| rng.next_uniform(least, most) as f32;
        let mut vector = || Vec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0));
        let point = (vector() * 6.0 + Vec3::new(6.0, 0.0, 0.0)) * scale;
        let geometric = vector().normalize();
        let (normal, direction) = (
            (geometric + vector() * 0.3).normalize(),
            vector().normalize(),
        );
        let direction = direction * -1_f32.copysign(direction.dot(geometric));
        let (albedo, throughput) = (vector().abs(), vector().abs());
        for (columns, v) in [
            (&mut vertices.geometric, geometric),
            (&mut vertices.normal, normal),
            (&mut vertices.direction, direction),
            (&mut vertices.base, albedo),
            (&mut vertices.throughput, throughput),
        ] {
            set_lane_vector::<f32>(columns, lane, v);
        }
        let outwards = geometric * number(-1.0, 1.0).signum();
        vertices
            .surface
            .set_lane(lane, &surface(point, outwards, scale));
        vertices.survival_scale[lane] = [f32::INFINITY, 2.0, 0.95][number(0.0, 3.0) as usize];
        for column in vertices
            .numbers
            .iter_mut()
            .chain(&mut vertices.light_numbers)
        {
            column[lane] = number(0.0, 1.0);
        }
    }
    vertices
}

/// The vertex of one lane, in the first.
fn alone(vertices: &VertexLanes<f32>, lane: usize) -> VertexLanes<f32> {
    let mut one = *vertices;
    one.surface.set_lane(0, &vertices.surface.get_lane(lane));
    for (to, from) in [
        (&mut one.geometric, &vertices.geometric),
        (&mut one.normal, &vertices.normal),
        (&mut one.direction, &vertices.direction),
        (&mut one.base, &vertices.base),
        (&mut one.throughput, &vertices.throughput),
    ] {
        to.iter_mut()
            .zip(from)
            .for_each(|(to, from)| to[0] = from[lane]);
    }
    for (to, from) in [
        (&mut one.numbers, &vertices.numbers),
        (&mut one.light_numbers, &vertices.light_numbers),
    ] {
        to.iter_mut()
            .zip(from)
            .for_each(|(to, from)| to[0] = from[lane]);
    }
    one.survival_scale[0] = vertices.survival_scale[lane];
    one
}

/// All bits of a lane.
fn lane_bits(shaded: &ShadedDiffuseLanes, lane: usize) -> Vec<u32> {
    let columns = [
        shaded.start,
        shaded.shadow_direction,
        shaded.reflected,
        shaded.direction,
        shaded.throughput,
    ];
    let single = [
        shaded.lamp,
        shaded.light_density,
        shaded.light_radiance,
        shaded.lamp_place[0],
        shaded.lamp_place[1],
        shaded.shadow_length,
        shaded.density,
    ];
    let masks = [
        shaded.lit,
        shaded.ends_before_lamp,
        shaded.continues,
        shaded.overflows,
    ]
    .map(|mask| mask >> lane & 1);
    columns
        .as_flattened()
        .iter()
        .chain(&single)
        .map(|column| column[lane].to_bits())
        .chain(masks)
        .collect()
}

/// Protects: each instruction set, and a single vertex, give the same bits for every result.
#[test]
fn registers_of_any_width_have_the_bits_of_one_vertex() {
    for count in [1, 6] {
        let prepared = rectangle_lamps_scene(count, 1.0, 0.0);
        let lamps = &prepared
            .lights
            .rectangle_lamps(&prepared.geometry)
            .expect("rectangles");
        let rng = &mut CaseRng::new(11, 0);
        for _ in 0..500 {
            let vertices = &random_vertices(rng, 1.0);
            let bits: Vec<_> = [
                RegisterWidth::Baseline,
                RegisterWidth::Avx2,
                RegisterWidth::Avx512,
            ]
            .into_iter()
            .map(|width| run_in_lanes_of(width, DiffuseVertexTask { vertices, lamps }))
            .collect();
            for lane in 0..LANES {
                let single = lane_bits(&shade(&alone(vertices, lane), lamps, 0.0_f32), 0);
                for found in &bits {
                    assert_eq!(lane_bits(found, lane), single);
                }
            }
        }
    }
}

/// Protects: every result of a vertex is that of the formulas in `f64`: the start is that of other
/// surfaces and off the surface, the shadow ray ends before the lamp, the reflected light has the
/// weight of the power heuristic, and the next ray is that of a matte surface after roulette.
#[test]
fn vertices_follow_the_formulas() {
    for scale in [1e-6, 1.0, 1e8] {
        let prepared = rectangle_lamps_scene(6, f64::from(scale), 0.0);
        let lamps = &prepared
            .lights
            .rectangle_lamps(&prepared.geometry)
            .expect("rectangles");
        let rng = &mut CaseRng::new(13, 0);
        let (mut lit, mut before_lamp, mut continued, mut ended) = (0, 0, 0, 0);
        for _ in 0..2_000 {
            let vertices = &random_vertices(rng, scale);
            let shaded =
                run_in_lanes_of(RegisterWidth::Avx512, DiffuseVertexTask { vertices, lamps });
            for lane in 0..LANES {
                let [geometric, normal, ray, albedo, before] = [
                    &vertices.geometric,
                    &vertices.normal,
                    &vertices.direction,
                    &vertices.base,
                    &vertices.throughput,
                ]
                .map(|columns| get_lane_vector::<f32>(columns, lane));
                let vector = |columns| get_lane_vector::<f32>(columns, lane);
                let surface = vertices.surface.get_lane(lane);
                let (start, usual) = (vector(&shaded.start), surface.spawn_ray_origin(geometric));
                for axis in 0..3 {
                    let outwards = (start[axis] - usual[axis]) * geometric[axis].signum();
                    assert!(
                        (0.0..=2.5e-7 * usual[axis].abs()).contains(&outwards),
                        "{start} beside {usual} along {geometric}"
                    );
                }
                let is_facing = ray.dot(normal) < 0.0;
                if shaded.lit >> lane & 1 != 0 {
                    lit += 1;
                    let place = shaded.lamp_place.map(|column| column[lane]);
                    let lamp = lamps.surface::<f32>(shaded.lamp[lane] as usize, place);
                    let across = (lamp.point - surface.point).as_dvec3();
                    let (direction, length) = (across.normalize(), across.length());
                    assert!(is_facing);
                    // The shadow ray ends beside the point, on the side of the vertex.
                    let ray = vector(&shaded.shadow_direction) * shaded.shadow_length[lane];
                    let beside = (start + ray - lamp.point).as_dvec3();
                    let off = beside.length() / (f64::from(scale) + length);
                    let height = beside.dot(lamp.normal.as_dvec3());
                    let is_before = height * lamp.normal.as_dvec3().dot(-across) > 0.0;
                    let ends_before_lamp = shaded.ends_before_lamp >> lane & 1 != 0;
                    assert!(
                        off < 6e-5 && is_before || !ends_before_lamp,
                        "{off:e} {height:e}"
                    );
                    before_lamp += u32::from(ends_before_lamp);
                    let density = f64::from(shaded.light_density[lane]);
                    let cosine = normal.as_dvec3().dot(direction);
                    let radiance = DVec3::new(5.0, 4.0, 3.0);
                    let share = power_heuristic(density, cosine / PI);
                    let expected = before.as_dvec3()
                        * albedo.as_dvec3()
                        * radiance
                        * (cosine / PI * share / density);
                    let off = (vector(&shaded.reflected).as_dvec3() - expected)
                        .abs()
                        .max_element();
                    // Both points are rounded.
                    let bound = (2e-5 + 1e-4 * f64::from(scale) / (length * cosine))
                        * expected.max_element();
                    assert!(
                        length > 0.0 && off <= bound,
                        "{off:e} of {:e}",
                        expected.max_element()
                    );
                }
                let [_, u, v, u_roulette] = vertices.numbers.map(|column| f64::from(column[lane]));
                let local = DVec3::new(
                    u.sqrt() * (2.0 * PI * v).cos(),
                    u.sqrt() * (2.0 * PI * v).sin(),
                    (1.0 - u).sqrt(),
                );
                let expected = ShadingFrame::<f64>::from_normal(normal.as_dvec3()).to_world(local);
                let direction = vector(&shaded.direction).as_dvec3();
                assert!(
                    (direction - expected).length() < 2e-6,
                    "{direction} for {expected}"
                );
                assert!((f64::from(shaded.density[lane]) - local.z / PI).abs() < 2e-7);
                let survival_scale = f64::from(vertices.survival_scale[lane]);
                let (after, survives) = apply_roulette::<f64>(
                    before.as_dvec3() * albedo.as_dvec3(),
                    survival_scale,
                    u_roulette,
                );
                let continues = shaded.continues >> lane & 1 != 0;
                let height = geometric.as_dvec3().dot(expected);
                if height.abs() > 1e-5 && is_facing {
                    assert_eq!(continues, survives && height > 0.0);
                }
                assert!(continues <= is_facing && shaded.overflows == 0);
                *(if continues {
                    &mut continued
                } else {
                    &mut ended
                }) += 1;
                let off = (vector(&shaded.throughput).as_dvec3() - after)
                    .abs()
                    .max_element();
                assert!(!continues || off <= 1e-6 * after.max_element(), "{off:e}");
            }
        }
        assert!(
            lit > 1_000 && before_lamp > lit / 2 && continued > 1_000 && ended > 1_000,
            "{lit} {before_lamp} {continued} {ended}"
        );
    }
}

/// Protects: the density of scattered directions integrates to one over them, and their mean cosine is
/// two thirds; and a throughput beyond all numbers ends its path as invalid.
#[test]
fn scattered_directions_have_their_density() {
    const SIDE: usize = 256;
    let prepared = rectangle_lamps_scene(1, 1.0, 0.0);
    let lamps = &prepared
        .lights
        .rectangle_lamps(&prepared.geometry)
        .expect("a rectangle");
    let mut vertices = random_vertices(&mut CaseRng::new(17, 0), 1.0);
    for (columns, z) in [
        (&mut vertices.geometric, 1.0),
        (&mut vertices.normal, 1.0),
        (&mut vertices.direction, -1.0),
    ] {
        *columns = [[0.0; LANES], [0.0; LANES], [z; LANES]];
    }
    vertices.survival_scale = [f32::INFINITY; LANES];
    let (mut cosine, mut inverse) = (0.0, 0.0);
    for i in 0..SIDE * SIDE / LANES {
        for lane in 0..LANES {
            let k = i * LANES + lane;
            vertices.numbers[1][lane] = ((k % SIDE) as f32 + 0.5) / SIDE as f32;
            vertices.numbers[2][lane] = ((k / SIDE) as f32 + 0.5) / SIDE as f32;
        }
        let shaded = run_in_lanes_of(
            RegisterWidth::Avx512,
            DiffuseVertexTask {
                vertices: &vertices,
                lamps,
            },
        );
        assert_eq!(shaded.continues, 0xff);
        for lane in 0..LANES {
            let (z, density) = (
                f64::from(shaded.direction[2][lane]),
                f64::from(shaded.density[lane]),
            );
            cosine += z;
            inverse += z / (PI * density);
        }
    }
    let count = (SIDE * SIDE) as f64;
    assert!(
        (cosine / count - 2.0 / 3.0).abs() < 1e-4,
        "{}",
        cosine / count
    );
    assert!((inverse / count - 1.0).abs() < 1e-6, "{}", inverse / count);
    vertices.throughput = [[1e38; LANES]; 3];
    vertices.base = [[10.0; LANES]; 3];
    let shaded = run_in_lanes_of(
        RegisterWidth::Avx512,
        DiffuseVertexTask {
            vertices: &vertices,
            lamps,
        },
    );
    assert_eq!((shaded.continues, shaded.overflows), (0, 0xff));
}
