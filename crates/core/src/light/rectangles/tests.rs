//! Rectangular lamps in `f32` against the light tree and closed forms in `f64`.

use core::f64::consts::PI;

use glam::Vec3;
use raywright_bvh::Surface;
use raywright_bvh::stability::verdicts::CaseRng;
use serde_json::{Value, json};

use super::*;
use crate::effects::EffectSet;
use crate::light::{Polygon, ShadowRayTarget, add_numbers};
use crate::prepare::PreparedScene;
use crate::scene::Integrator;
use crate::settings::Settings;

/// A scene of `count` rectangles, `scale` times as large, some of which shine from both sides. `shift`
/// moves all of them.
pub(crate) fn lamps(count: u32, scale: f64, shift: f64) -> PreparedScene<f32> {
    lamps_under(json!(null), count, scale, shift)
}

/// The scene of [`lamps`] under a sky.
fn lamps_under(sky: Value, count: u32, scale: f64, shift: f64) -> PreparedScene<f32> {
    let quad = |i: u32| {
        let i = f64::from(i);
        let at = [2.5 * i, 3.0 + 0.2 * i, 0.3 * i].map(|x| (x + shift) * scale);
        let (u, v) = (
            [(0.4 + 0.3 * i) * scale, 0.0, 0.0],
            [0.0, -0.6 * i * scale * 0.1, -0.5 * scale],
        );
        json!({ "material": "lamp", "side": if i % 2.0 == 0.0 { "outside" } else { "both" },
            "shape": { "quad": { "corner": at, "edge_u": v, "edge_v": u } } })
    };
    let scene = serde_json::from_value(json!({
        "format": 1,
        "sky": sky,
        "materials": [{ "name": "lamp", "model": { "physical": { "emission": [5, 4, 3] } } }],
        "objects": (0..count).map(quad).collect::<Vec<_>>(),
    }))
    .expect("a scene");
    let settings = Settings {
        integrator: Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    PreparedScene::new(&scene, &settings, EffectSet::ALL, &()).expect("it can be prepared")
}

/// A point near or far, above and below the lamps, and a unit normal.
fn receiver(rng: &mut CaseRng, scale: f64, shift: f64) -> (Vec3, Vec3) {
    let far = 10_f64.powf(rng.next_uniform(-1.5, 2.5));
    let mut vector = || {
        DVec3::new(
            rng.next_uniform(-1.0, 1.0),
            rng.next_uniform(-1.0, 1.0),
            rng.next_uniform(-1.0, 1.0),
        )
    };
    let (offset, normal) = (vector() * far, vector().normalize());
    let at = DVec3::new(1.2, 3.1, 0.1) + offset + DVec3::splat(shift);
    ((at * scale).as_vec3(), normal.as_vec3())
}

fn lane_vector(v: Vec3) -> LaneVector<f32> {
    LaneVector::new(v.x, v.y, v.z)
}

fn vec3(v: LaneVector<f32>) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

/// Protects: a lamp is chosen as the light tree chooses it; the density of a point is that with which
/// paths that hit the lamp are weighed, so that both weights sum to one; points lie on their lamp, and
/// ends of shadow rays before it, as near as stated. One lamp to eight, tiny, huge, far from the origin,
/// and under a sky, which other numbers choose.
#[test]
fn points_have_the_density_by_which_hits_are_weighed() {
    let sky = json!({ "gradient": { "bottom": [0.2, 0.3, 0.5], "top": [0.6, 0.7, 0.9] } });
    for (count, scale, shift, sky) in [
        (1, 1.0, 0.0, None),
        (2, 1.0, 0.0, None),
        (8, 1.0, 0.0, None),
        (6, 1e-6, 0.0, None),
        (6, 1e8, 0.0, None),
        (6, 1.0, 300.0, None),
        (1, 1.0, 0.0, Some(&sky)),
        (6, 1.0, 0.0, Some(&sky)),
    ] {
        let is_under_sky = sky.is_some();
        let prepared = lamps_under(json!(sky), count, scale, shift);
        let (lights, rng) = (&prepared.lights, &mut CaseRng::new(3, u64::from(count)));
        let tables = lights
            .rectangle_lamps(&prepared.geometry)
            .expect("all lamps are rectangles");
        let (mut seen, mut dark, mut by_area, mut far) = ([0; 8], 0, 0, 0);
        for _ in 0..20_000 {
            let (from, normal) = receiver(rng, scale, shift);
            let [coarse, fine, u, v] = [(); 4].map(|()| rng.next_uniform(0.0, 1.0) as f32);
            let found = tables.sample(
                (lane_vector(from), lane_vector(normal)),
                add_numbers(coarse, fine),
                [u, v],
            );
            let chosen = lights
                .light_sampler()
                .sample::<f32>(from, normal, [coarse, fine]);
            let is_far = matches!(chosen, Some((LightId::Sky, _)));
            assert_eq!(tables.are_chosen([coarse, fine, u, v]), !is_far);
            if is_far {
                far += 1;
                continue;
            }
            let Some((light, probability)) = chosen else {
                assert_eq!(found.density, 0.0);
                dark += 1;
                continue;
            };
            let lamp = found.lamp as usize;
            assert_eq!(light, LightId::Emitter(tables.emitters[lamp]));
            if found.density == 0.0 {
                dark += 1;
                continue;
            }
            seen[lamp] += 1;
            let rectangle = lights
                .emitters
                .rectangle(tables.emitters[lamp])
                .expect("a rectangle");
            let [x, y] = rectangle.edges;
            let lamp_normal = x.cross(y).normalize();
            let size = rectangle.corner.abs().max_element() + x.length() + y.length();
            // The exact point in the sampled direction.
            let (start, direction) = (from.as_dvec3(), found.direction);
            let direction = vec3(direction).as_dvec3();
            let distance = lamp_normal.dot(rectangle.corner - start) / lamp_normal.dot(direction);
            let point = start + direction * distance;
            let height = lamp_normal.dot(start - rectangle.corner);
            let end = tables.surface::<f32>(lamp, found.place);
            let off = (end.point.as_dvec3() - rectangle.corner).dot(lamp_normal);
            assert!(
                off.abs() <= f64::from(end.error),
                "{off:e}: {:e}",
                end.error
            );
            let reach = (end.point.as_dvec3() - start).length();
            // Nothing else is in the scene, so that only a far or near point needs the exact end.
            let gap =
                lamp_normal.dot(vec3(found.end).as_dvec3() - rectangle.corner) * height.signum();
            let least = rectangle.end_distance();
            let is_near = reach < 8.0 * CLEARANCE * f64::from(1 << 18) * least;
            assert!(
                gap > 0.7 * least && found.end_margin > 0.0 || !is_near,
                "{gap:e}: {least:e}"
            );
            assert!(
                gap < CLEARANCE * least || found.end_margin <= 0.0,
                "{gap:e}: {least:e}"
            );
            // Grazing rays magnify rounding in the plane.
            let slope = (height / reach).abs();
            if slope < 1e-3 {
                continue;
            }
            let on_lamp =
                [x, y].map(|edge| (point - rectangle.corner).dot(edge) / edge.length_squared());
            let margin = 3e-7 * (size + reach) / (slope * x.length().min(y.length())) + 1e-5;
            assert!(
                on_lamp
                    .iter()
                    .all(|&share| share > -margin && share < 1.0 + margin),
                "{on_lamp:?} {margin:e} {slope:e}"
            );
            let surface = Surface {
                point: point.as_vec3(),
                above: point.as_vec3(),
                below: point.as_vec3(),
                error: 0.0,
                normal: lamp_normal.as_vec3(),
            };
            let density = lights.density(
                light,
                from,
                direction.as_vec3(),
                &ShadowRayTarget::Surface(surface),
                probability,
            );
            let off = (f64::from(found.density) / density - 1.0).abs();
            // The bound of the module, and that of the hit point's rounding to `f32`.
            let unit = f64::from(f32::EPSILON) / 2.0;
            let bound = unit
                * (64.0
                    + 17.0 * (reach + x.length() + y.length()) / height.abs()
                    + 4.0 * point.abs().max_element() / reach);
            let polygon_angle = probability / density;
            by_area += u32::from(polygon_angle < LEAST);
            // At the threshold both techniques may disagree.
            if (polygon_angle / LEAST - 1.0).abs() > 1e-3 {
                assert!(
                    off < bound,
                    "{off:e} of {bound:e}: {from} to lamp {lamp}, {polygon_angle:e} sr"
                );
            }
        }
        // Coordinates are stored around the lamps, so that a shift takes all receivers to one side.
        assert!(
            shift > 0.0 || seen.iter().filter(|&&n| n > 50).count() == count as usize,
            "{count} lamps at {scale}, {shift}: {seen:?}"
        );
        assert!(dark > 500 && by_area > 500, "{dark} {by_area}");
        assert_eq!(far > 9_000, is_under_sky, "{far}");
    }
}

/// Irradiance vector of a polygon of radiance 1, without its horizon (Lambert).
fn irradiance(corners: [DVec3; 4], from: DVec3) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for k in 0..4 {
        let (a, b) = (
            (corners[k] - from).normalize(),
            (corners[(k + 1) % 4] - from).normalize(),
        );
        let across = a.cross(b);
        sum += across.normalize_or_zero() * (0.5 * across.length().atan2(a.dot(b)));
    }
    sum
}

/// Protects: points of a rectangle are uniform by solid angle: means of their directions are those of
/// Lambert's closed form, seen from near and far, from aside and along an edge.
#[test]
fn directions_to_a_rectangle_have_lamberts_mean() {
    let prepared = lamps(1, 1.0, 0.0);
    let tables = prepared
        .lights
        .rectangle_lamps(&prepared.geometry)
        .expect("a rectangle");
    let rectangle = prepared.lights.emitters.rectangle(0).expect("a rectangle");
    let [x, y] = rectangle.edges;
    let down = if rectangle.is_inside {
        -x.cross(y)
    } else {
        x.cross(y)
    }
    .normalize();
    let corners = [
        rectangle.corner,
        rectangle.corner + x,
        rectangle.corner + x + y,
        rectangle.corner + y,
    ];
    let rng = &mut CaseRng::new(5, 0);
    let (mut large, mut small) = (0, 0);
    for _ in 0..200 {
        let height = 10_f64.powf(rng.next_uniform(-2.0, 2.2));
        let [s, t] = [(); 2].map(|()| rng.next_uniform(-1.0, 2.0));
        let from = (rectangle.corner + x * s + y * t + down * height).as_vec3();
        let expected = irradiance(corners, from.as_dvec3());
        let solid_angle = Polygon::from_quad(corners).solid_angle(from.as_dvec3());
        const SIDE: u32 = 64;
        let mut sum = DVec3::ZERO;
        for i in 0..SIDE * SIDE {
            let place = [i % SIDE, i / SIDE].map(|k| (k as f32 + 0.5) / SIDE as f32);
            let found = tables.sample(
                (lane_vector(from), LaneVector::new(0.0, 0.0, 0.0)),
                0.5,
                place,
            );
            sum += vec3(found.direction).as_dvec3() / f64::from(found.density);
        }
        let mean = sum / f64::from(SIDE * SIDE);
        let expected = expected * if expected.dot(mean) < 0.0 { -1.0 } else { 1.0 };
        let off = (mean - expected).length() / expected.length();
        *(if solid_angle.is_some() {
            &mut large
        } else {
            &mut small
        }) += 1;
        let bound = if solid_angle.is_some() { 1e-3 } else { 1e-2 };
        assert!(
            off < bound,
            "{off:e} from {from}, {solid_angle:?} sr: {mean} for {expected}"
        );
        assert!(solid_angle.is_none_or(|angle| angle < 2.0 * PI));
    }
    assert!(large > 100 && small > 20, "{large} {small}");
}

/// Protects: shadow rays end before a lamp only if nothing lies in the space between: no cover, near or at
/// the end of this space, no other kind of shape; but surfaces in the lamp's plane, behind it, and beyond
/// the space do not count, on either side of a lamp that shines from both.
#[test]
fn a_cover_before_a_lamp_takes_the_exact_end() {
    let quad = |y: f64, r: f64| json!({ "quad": { "corner": [-r, y, -r], "edge_u": [2.0 * r, 0, 0], "edge_v": [0, 0, 2.0 * r] } });
    let is_clear = |cover: Value, side: &str| {
        let scene = serde_json::from_value(json!({
            "format": 1,
            "materials": [{ "name": "lamp", "model": { "physical": { "emission": 4 } } },
                          { "name": "black", "model": { "physical": { "base_colour": 0 } } }],
            "objects": [{ "material": "lamp", "side": side, "shape": quad(3.0, 0.5) },
                        { "material": "black", "shape": cover }],
        }))
        .expect("a scene");
        let settings = Settings {
            integrator: Integrator::Path,
            ..Settings::from_scene(&scene)
        };
        let prepared =
            PreparedScene::<f32>::new(&scene, &settings, EffectSet::ALL, &()).expect("a scene");
        let tables = prepared.lights.rectangle_lamps(&prepared.geometry);
        tables.expect("a lamp").clearance[0] > 0.0
    };
    // Sixteen times 2^-20 of the coordinate and 2^-22 of the edge.
    let space = 16.0 * (3.0 + 0.25) / f64::from(1 << 20);
    // The edges turn so that this quad shines downwards.
    for (gap, both, outside) in [
        (1e-6, false, false),
        (space * 0.9, false, false),
        (space * 1.1, true, true),
        (0.0, true, true),
        (-1e-6, false, true),
        (-1.0, true, true),
    ] {
        for radius in [0.1, 0.5, 4.0] {
            let cover = quad(3.0 - gap, radius);
            assert_eq!(is_clear(cover.clone(), "both"), both, "{gap:e} both");
            assert_eq!(is_clear(cover, "outside"), outside, "{gap:e} {radius}");
        }
        let plane = json!({ "plane": { "point": [0, 3.0 - gap, 0], "normal": [0, 1, 0] } });
        assert_eq!(is_clear(plane, "outside"), outside, "{gap:e} plane");
    }
    for (radius, clear) in [(0.5, true), (1.0, false)] {
        let ball = json!({ "sphere": { "centre": [0, 2, 0], "radius": radius } });
        assert_eq!(is_clear(ball, "outside"), clear, "{radius}");
    }
}

/// Protects: lights of other shapes, more lights than a node has and textured lamps have no
/// tables, so that they are sampled by the tree.
#[test]
fn other_lights_have_no_tables() {
    let prepared = lamps(9, 1.0, 0.0);
    assert!(
        prepared
            .lights
            .rectangle_lamps(&prepared.geometry)
            .is_none()
    );
    let corners = |skew: f64| {
        [
            DVec3::ZERO,
            DVec3::X,
            DVec3::new(1.0 + skew, 0.0, 1.0),
            DVec3::new(skew, 0.0, 1.0),
        ]
    };
    assert!(Rectangle::from_corners(corners(0.0)).is_some());
    assert!(Rectangle::from_corners(corners(1e-5)).is_none());
    assert!(Rectangle::from_corners([DVec3::ZERO; 4]).is_none());
}
