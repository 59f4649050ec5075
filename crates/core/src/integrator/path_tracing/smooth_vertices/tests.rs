//! Smooth vertices against samples of the whole BSDF.

use glam::{DVec3, Vec3};
use raywright_bvh::Ray;
use raywright_bvh::stability::verdicts::CaseRng;
use serde_json::json;

use super::*;
use crate::effects::EffectSet;
use crate::integrator::LightTransport;
use crate::material::{BsdfSample, ShadingFrame, SmoothInterface};
use crate::prepare::{PreparedMaterial, PreparedScene};
use crate::sampler::SampleAddress;
use crate::scene::Scene;
use crate::settings::Settings;

/// Balls of tinted glass and of mirrors, and panes of them whose shading normals lean far to a side.
fn smooth_objects() -> PreparedScene<f32> {
    let smooth = |name: &str, terms: serde_json::Value| json!({ "name": name, "model": { "physical": terms } });
    let names = ["glass", "diamond", "gold", "black"];
    let objects = names.iter().enumerate().flat_map(|(i, name)| {
        let x = 3.0 * i as f64;
        [
            json!({ "shape": { "sphere": { "centre": [x, 0, 0], "radius": 1 } }, "material": name }),
            json!({ "shape": { "mesh": "pane" }, "material": name, "transform": [{ "translate": [x, 0, -3] }] }),
        ]
    });
    let scene: Scene = serde_json::from_value(json!({
        "format": 1,
        "sky": { "constant": [1, 1, 1] },
        "materials": [
            smooth("glass", json!({ "transmission": 1, "roughness": 0, "ior": 1.5, "base_colour": [0.9, 0.8, 0.7] })),
            smooth("diamond", json!({ "transmission": 1, "roughness": 0, "ior": 2.4 })),
            smooth("gold", json!({ "metallic": 1, "roughness": 0, "base_colour": [0.9, 0.6, 0.2] })),
            smooth("black", json!({ "roughness": 0, "base_colour": [0, 0, 0] })),
        ],
        "meshes": [{ "name": "pane", "source": { "inline": {
            "positions": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "indices": [[0, 1, 2], [0, 2, 3]],
            "normals": [[-3, 0, 1], [3, 0, 1], [0, 3, 1], [0, -3, 1]] } } }],
        "objects": objects.collect::<Vec<_>>(),
    }))
    .expect("a scene");
    let settings = Settings {
        integrator: crate::scene::Integrator::Path,
        ..Settings::from_scene(&scene)
    };
    PreparedScene::new(&scene, &settings, EffectSet::ALL, &()).expect("it can be prepared")
}

/// Returns a sample of the whole BSDF of an unlayered surface at a hit, its glass, and the
/// reflectance at the rounded normal, zero for a mirror.
fn sample_bsdf(
    scene: &PreparedScene<f32>,
    interaction: &Interaction<f32>,
    [lobe, u, v, _]: [f32; 4],
) -> (BsdfSample<f32>, Option<Glass<f32>>, f64) {
    let PreparedMaterial::Physical(m) = &scene.materials[interaction.material as usize] else {
        panic!("a physical material");
    };
    let model = m.metallic_roughness_at(&scene.texture_tables.shading_context(interaction));
    let (normal, view) = (interaction.facing_normal(), -interaction.direction);
    let bsdf = model.transport_bsdf(normal, view, interaction.outside, scene.compensates);
    let eta = |glass: &Glass<f32>| glass.eta(interaction.outside);
    let reflectance = model.glass.as_ref().map_or(0.0, |glass| {
        SmoothInterface::new(-view.as_dvec3(), normal.as_dvec3(), eta(glass)).fresnel()
    });
    let sample = bsdf.sample(&ShadingFrame::from_normal(normal), view, [lobe, u, v]);
    (sample, model.glass, reflectance)
}

/// Protects: paths at smooth mirrors and glass go on as samples of the whole BSDF demand: mirrors to
/// the bit; glass by its exact direction and reflectance, which differ from those of the rounded
/// normal by rounding alone; from outside and inside, at grazing angles, beyond the critical angle,
/// below leaning normals; with the same throughput, Russian roulette and counters.
#[test]
fn smooth_surfaces_scatter_as_their_bsdfs() {
    let scene = smooth_objects();
    let mut tracer = PathTracer::new(&scene, 9, false, &());
    let (rng, address) = (&mut CaseRng::new(71, 0), SampleAddress::default());
    let (mut ended, mut turned, mut counts) = (0, 0, [0; 3]);
    for case in 0..40_000 {
        let mut number = |least: f64, most: f64| rng.next_uniform(least, most);
        let mut vector = || DVec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0));
        // Half the rays start in balls; some graze them.
        let place = DVec3::new(
            3.0 * f64::from(case % 4),
            0.0,
            -3.0 * f64::from(case / 4 % 2),
        );
        let origin = place + vector() * if case % 3 == 0 { 0.57 } else { 3.0 };
        let target = place + vector().normalize() * if case % 5 == 0 { 0.999 } else { 0.6 };
        let ray = Ray::<f32>::new(origin.as_vec3(), (target - origin).normalize().as_vec3());
        let mut path = tracer.start_path(ray, address);
        let Some(hit) = tracer.intersect_path_ray(&path) else {
            continue;
        };
        let interaction = Interaction::from_hit(&scene, &path.segment, &hit);
        path.segments_traced = 1 + case % 7;
        path.throughput = Vec3::new(0.5, 0.9, 0.2);
        let scatter = core::array::from_fn(|_| number(0.0, 1.0) as f32);
        let samples = VertexSamples {
            scatter,
            ..VertexSamples::default()
        };
        let (sample, glass, rounded) = sample_bsdf(&scene, &interaction, scatter);
        let through = sample.direction.dot(interaction.facing_normal()) < 0.0;
        let height = interaction.surface.normal.dot(sample.direction);
        let is_valid = (height < 0.0) == (through == interaction.outside) || height == 0.0;
        let before = (path, tracer.counters.reflection, tracer.counters.refraction);
        let PreparedMaterial::Physical(m) = &scene.materials[interaction.material as usize] else {
            panic!("a physical material");
        };
        let model = m.metallic_roughness_at(&scene.texture_tables.shading_context(&interaction));
        let lobe = model
            .smooth_lobe(interaction.outside)
            .expect("it is smooth");
        let lobe = (&lobe, model.glass.as_ref());
        let continues = tracer.scatter_smoothly(&mut path, (&hit, &interaction), lobe, &samples);
        let (path_before, reflection, refraction) = before;
        if let Some(glass) = glass {
            let exact = scene
                .dielectric_interface(&path_before.segment, &hit, &interaction, &glass)
                .fresnel();
            let u = f64::from(scatter[1]);
            if (u < exact) != (u < rounded) {
                turned += 1;
                continue;
            }
        }
        let scale = path_before.survival_scale(scene.roulette);
        let expected = apply_roulette(path_before.throughput * sample.weight, scale, scatter[3]);
        assert_eq!(
            continues,
            sample.is_valid && is_valid && expected.1,
            "{case}"
        );
        if !continues {
            ended += 1;
            continue;
        }
        let direction = path.segment.ray.direction;
        let cosine = direction.dot(interaction.normal).abs();
        let bound = if glass.is_some() { 1e-6 / cosine } else { 0.0 };
        assert!(
            direction.distance(sample.direction) <= bound,
            "{case}: {direction}"
        );
        assert_eq!(path.throughput, expected.0, "{case}");
        assert_eq!(
            path.segment.ray.origin,
            interaction.surface.spawn_ray_origin(direction)
        );
        assert_eq!(path.previous.density, f64::INFINITY);
        assert_eq!(path.address.bounce, 1);
        let counted = [
            tracer.counters.reflection - reflection,
            tracer.counters.refraction - refraction,
        ];
        assert_eq!(counted, [u64::from(!through), u64::from(through)], "{case}");
        counts[if glass.is_none() {
            2
        } else {
            usize::from(through)
        }] += 1;
    }
    assert!(turned < 20, "{turned}");
    assert!(
        ended > 1_000 && counts.iter().all(|&count| count > 3_000),
        "{ended}, {counts:?}"
    );
}
