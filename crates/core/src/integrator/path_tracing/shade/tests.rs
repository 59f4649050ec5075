//! Vertices in columns against values by hand: matte surfaces, with BSDFs in closed form.

use core::f32::consts::PI;

use glam::Vec3;
use raywright_bvh::{Interval, Ray, Surface};

use super::super::bsdf_lanes::BsdfTask;
use super::super::media::MediumStack;
use super::super::{PathState, PreviousVertex, VertexSamples};
use super::*;
use crate::integrator::PathSegment;
use crate::interaction::Interaction;
use crate::light::{LightDensity, LightSample, ShadowRayTarget};
use crate::material::MetallicRoughness;
use crate::sampler::SampleAddress;
use crate::settings::RouletteStart;

/// A surface at a point with this outward normal.
fn surface(point: Vec3, normal: Vec3) -> Surface<f32> {
    Surface {
        point,
        above: point,
        below: point,
        error: 1e-3,
        normal,
    }
}

/// A hit of a ray downwards on a horizontal surface, with a shading normal.
fn interaction(point: Vec3, normal: Vec3) -> Interaction<f32> {
    let direction = -Vec3::Y;
    Interaction {
        surface: surface(point, Vec3::Y),
        normal,
        outside: true,
        direction,
        ..Interaction::PLACEHOLDER
    }
}

/// A path at the surface after `traced` segments, and the numbers of its vertex.
fn path(traced: u32, throughput: Vec3, scatter: [f32; 4]) -> (PathState<f32>, VertexSamples) {
    let (address, light) = (SampleAddress::default(), [0.0; 4]);
    let path = PathState {
        start: raywright_bvh::TriangleSlot::NONE,
        shadow: 0.0,
        segment: PathSegment::from_ray(Ray::new(Vec3::Y, -Vec3::Y)),
        throughput,
        radiance: Vec3::ZERO,
        address,
        sample_hash: address.sample_hash(),
        segments_traced: traced,
        matched_segments: 0,
        passages: 0,
        has_hit: true,
        min_pdf: f64::INFINITY,
        light_sample: [1.0, 0.0],
        is_narrow: false,
        media: MediumStack::default(),
        previous: PreviousVertex {
            lights: super::super::LightKinds::All,
            from: Vec3::Y,
            normal: Vec3::Y,
            density: f64::INFINITY,
        },
        wavelength: None,
    };
    (path, VertexSamples { scatter, light })
}

fn matte(base: Vec3) -> MetallicRoughness<f32> {
    MetallicRoughness {
        base,
        metallic: 0.0,
        roughness: 1.0,
        dielectric: 0.0,
        grazing: 0.0,
        glass: None,
    }
}

/// Shaded vertices, and their responses.
struct ShadedVertices {
    lanes: ShadedLanes<f32>,
    bsdf_lanes: BsdfLanes<f32>,
}

impl ShadedVertices {
    fn ray(&self, lane: usize) -> Ray<f32> {
        Ray::new(
            get_lane_vector::<f32>(&self.lanes.next.origin, lane),
            get_lane_vector::<f32>(&self.bsdf_lanes.direction, lane),
        )
    }
}

/// Vertices and their light samples, one after the other.
struct Vertices {
    vertices: VertexLanes<f32>,
    lights: LightSampleLanes<f32>,
}

impl Vertices {
    fn new() -> Self {
        Self {
            vertices: VertexLanes::new(),
            lights: LightSampleLanes::new(),
        }
    }

    fn push(
        &mut self,
        ((path, samples), interaction): (&(PathState<f32>, VertexSamples), &Interaction<f32>),
        (model, gain): (&MetallicRoughness<f32>, f32),
        light: Option<(&LightSample<f32>, MisStrategy)>,
    ) {
        let index = self.vertices.len as u32;
        let lane = self.vertices.push_vertex(
            index,
            (path, interaction, samples),
            (interaction.normal, LitSides::One, gain),
            RouletteStart::Late,
        );
        self.vertices.set_material_model(lane, model);
        if let Some((sample, strategy)) = light {
            self.lights.set_lane(lane, sample);
            self.vertices.strategy[lane] = strategy;
        }
    }

    fn shade(&self) -> ShadedVertices {
        self.shade_as::<true>()
    }

    fn shade_as<const MATTE: bool>(&self) -> ShadedVertices {
        let (vertices, lights) = (&self.vertices, &self.lights);
        let bsdf_lanes = BsdfTask::<f32, MATTE> {
            vertices,
            lights,
            energy_compensation: true,
        }
        .run();
        ShadedVertices {
            lanes: ShadedLanes::from_vertices(vertices, lights, &bsdf_lanes, 70.0),
            bsdf_lanes,
        }
    }
}

/// A light sample in a direction, with this radiance over its density.
fn light(
    direction: Vec3,
    arriving: Vec3,
    density: LightDensity,
    target: ShadowRayTarget<f32>,
) -> LightSample<f32> {
    LightSample {
        direction,
        arriving,
        density,
        target,
    }
}

#[track_caller]
fn close(found: Vec3, expected: Vec3) {
    assert!(
        (found - expected).abs().max_element() <= 1e-5 * (1.0 + expected.abs().max_element()),
        "{found}, not {expected}"
    );
}

/// Protects: matte surfaces reflect light in closed form, each lane its own: albedo over π times
/// the cosine; delta lights in full times their gain; lights also found by scattering with the
/// weight of the power heuristic, where the other density is the cosine over π. Lights below the
/// surface or the shading normal, and missing lights, give zero. Non-finite light stays so, so that
/// its sample is dropped and counted.
#[test]
fn lights_are_sent_back_in_closed_form() {
    let mut all = Vertices::new();
    let albedos = [Vec3::new(0.8, 0.4, 0.2), Vec3::new(0.1, 0.5, 0.9)];
    let [surface_interaction, tilted] = [
        interaction(Vec3::ZERO, Vec3::Y),
        interaction(Vec3::X, Vec3::new(0.6, 0.8, 0.0)),
    ];
    let (arriving, path) = (Vec3::new(3.0, 2.0, 1.0), path(0, Vec3::ONE, [0.5; 4]));
    let (steep, below) = (Vec3::new(0.0, 0.6, 0.8), Vec3::new(0.8, -0.6, 0.0));
    let by = |direction, density| light(direction, arriving, density, ShadowRayTarget::Infinity);
    let sized = |direction| by(direction, LightDensity::SolidAngle(0.25));
    all.push(
        (&path, &surface_interaction),
        (&matte(albedos[0]), 1.0),
        Some((&sized(steep), MisStrategy::Unweighted)),
    );
    all.push(
        (&path, &surface_interaction),
        (&matte(albedos[1]), 1.0),
        Some((&sized(steep), MisStrategy::PowerHeuristic)),
    );
    all.push(
        (&path, &surface_interaction),
        (&matte(albedos[0]), PI),
        Some((
            &by(steep, LightDensity::Delta),
            MisStrategy::Delta { shines: false },
        )),
    );
    // Above the shading horizon and below the geometric one, and the reverse.
    all.push(
        (&path, &tilted),
        (&matte(albedos[0]), 1.0),
        Some((
            &sized(Vec3::new(0.99, -0.1, 0.0).normalize()),
            MisStrategy::Unweighted,
        )),
    );
    all.push(
        (&path, &tilted),
        (&matte(albedos[0]), 1.0),
        Some((
            &sized(Vec3::new(-0.9, 0.3, 0.0).normalize()),
            MisStrategy::Unweighted,
        )),
    );
    all.push(
        (&path, &tilted),
        (&matte(albedos[0]), 1.0),
        Some((&sized(below), MisStrategy::Unweighted)),
    );
    all.push(
        (&path, &surface_interaction),
        (&matte(albedos[0]), 1.0),
        None,
    );
    let nan = light(
        steep,
        Vec3::new(f32::NAN, 1.0, 1.0),
        LightDensity::SolidAngle(0.25),
        ShadowRayTarget::Infinity,
    );
    all.push(
        (&path, &surface_interaction),
        (&matte(albedos[0]), 1.0),
        Some((&nan, MisStrategy::Unweighted)),
    );
    let shaded = all.shade();
    assert_eq!(
        shaded.lanes.lit.is_lit,
        [true, true, true, false, false, false, false, true]
    );
    let scattered = |lane| get_lane_vector::<f32>(&shaded.lanes.lit.reflected, lane);
    assert!(scattered(7).x.is_nan());
    close(scattered(0), arriving * albedos[0] * (0.6 / PI));
    let (by_light, by_scattering) = (0.25_f32, 0.6 / PI);
    let share = by_light * by_light / (by_light * by_light + by_scattering * by_scattering);
    close(scattered(1), arriving * albedos[1] * (0.6 / PI * share));
    close(scattered(2), arriving * albedos[0] * 0.6);
}

/// Protects: a physical surface without reflectance is shaded as a matte one to the bit: its
/// microfacet lobe, of reflectance zero, contributes nothing at any roughness.
#[test]
fn what_reflects_nothing_is_matte() {
    let mut all = Vertices::new();
    for lane in 0..LANES {
        let part = (lane as f32 + 0.5) / LANES as f32;
        let surface_interaction = interaction(
            Vec3::new(part, 0.0, 0.0),
            Vec3::new(0.3 * part, 0.9, 0.1 - 0.2 * part).normalize(),
        );
        let path = path(
            4,
            Vec3::new(1.0, part, 0.5),
            [part, 1.0 - part, 0.7 * part, 0.3],
        );
        let model = MetallicRoughness {
            roughness: part,
            ..matte(Vec3::new(part, 0.5, 0.9))
        };
        let direction = Vec3::new(0.5 - part, 0.4, part).normalize();
        let lamp = light(
            direction,
            Vec3::new(3.0, 2.0, 1.0),
            LightDensity::SolidAngle(0.25),
            ShadowRayTarget::Infinity,
        );
        assert!(model.is_matte());
        all.push(
            (&path, &surface_interaction),
            (&model, 1.0),
            Some((&lamp, MisStrategy::PowerHeuristic)),
        );
    }
    let glossy = all.shade_as::<false>();
    let matte = all.shade();
    assert!(matte.lanes.lit.is_lit.contains(&true) && matte.lanes.next.continues.contains(&true));
    assert_eq!(
        (matte.lanes.lit.is_lit, matte.lanes.next.continues),
        (glossy.lanes.lit.is_lit, glossy.lanes.next.continues)
    );
    let vectors = |of: &ShadedVertices| {
        [
            of.lanes.lit.reflected,
            of.lanes.next.origin,
            of.bsdf_lanes.direction,
            of.lanes.next.throughput,
        ]
        .map(|v| v.map(|axis| axis.map(f32::to_bits)))
    };
    assert_eq!(
        (vectors(&matte), matte.bsdf_lanes.density.map(f32::to_bits)),
        (
            vectors(&glossy),
            glossy.bsdf_lanes.density.map(f32::to_bits)
        )
    );
    for (metallic, dielectric, grazing) in [(0.1, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.1)] {
        assert!(
            !MetallicRoughness {
                metallic,
                dielectric,
                grazing,
                ..self::matte(Vec3::ONE)
            }
            .is_matte()
        );
    }
}

/// Protects: shadow rays leave the surface on the light's side and end before their target, or are
/// infinite; for infinitely distant delta lights they end at the greatest shadow distance.
#[test]
fn rays_to_lights_aim_at_them() {
    let mut all = Vertices::new();
    let (surface_interaction, path) = (
        interaction(Vec3::new(1.0, 0.0, 0.0), Vec3::Y),
        path(0, Vec3::ONE, [0.5; 4]),
    );
    let (white, arriving) = (matte(Vec3::ONE), Vec3::ONE);
    let lamp = surface(Vec3::new(1.0, 4.0, 3.0), -Vec3::Y);
    let target_direction = Vec3::new(0.0, 0.8, 0.6);
    let strategy = MisStrategy::Unweighted;
    let on_lamp = light(
        target_direction,
        arriving,
        LightDensity::SolidAngle(0.5),
        ShadowRayTarget::Surface(lamp),
    );
    let sky = light(
        target_direction,
        arriving,
        LightDensity::SolidAngle(0.5),
        ShadowRayTarget::Infinity,
    );
    let sun = light(
        target_direction,
        arriving,
        LightDensity::Delta,
        ShadowRayTarget::Infinity,
    );
    all.push(
        (&path, &surface_interaction),
        (&white, 1.0),
        Some((&on_lamp, strategy)),
    );
    all.push(
        (&path, &surface_interaction),
        (&white, 1.0),
        Some((&sky, strategy)),
    );
    all.push(
        (&path, &surface_interaction),
        (&white, 1.0),
        Some((&sun, MisStrategy::Delta { shines: true })),
    );
    let shaded = all.shade();
    for lane in 0..3 {
        let (start, direction) = (
            get_lane_vector::<f32>(&shaded.lanes.shadow.start, lane),
            get_lane_vector::<f32>(&shaded.lanes.shadow.directions, lane),
        );
        assert!(
            start.y > 0.0 && start.distance(surface_interaction.surface.point) < 0.01,
            "{lane}: from {start}"
        );
        assert!(
            direction.distance(target_direction) < 1e-3,
            "{lane}: {direction}"
        );
    }
    assert!(
        (4.9..5.0).contains(&shaded.lanes.shadow.length[0]),
        "{}",
        shaded.lanes.shadow.length[0]
    );
    assert_eq!(
        [shaded.lanes.shadow.length[1], shaded.lanes.shadow.length[2]],
        [f32::INFINITY, 70.0]
    );
    let (ray, range) = surface_interaction
        .surface
        .spawn_ray_to_surface(&lamp)
        .expect("they are apart");
    assert_eq!(
        (ray.origin, range),
        (
            get_lane_vector::<f32>(&shaded.lanes.shadow.start, 0),
            Interval {
                min: 0.0,
                max: shaded.lanes.shadow.length[0]
            }
        )
    );
}

/// Protects: scattered paths continue above the surface with the throughput of Lambert's lobe: the
/// albedo, with a density of cosine over π. Russian roulette uses the brightest channel and its own
/// number, and survivors count for ended paths.
#[test]
fn paths_go_on_by_their_brightness() {
    let (base, surface_interaction) = (
        Vec3::new(0.5, 0.25, 0.125),
        interaction(Vec3::ZERO, Vec3::Y),
    );
    let mut all = Vertices::new();
    // The lobe, the direction and, last, Russian roulette.
    let numbers = |u_roulette| [0.3, 0.04, 0.7, u_roulette];
    for (traced, brightness, u_roulette) in [
        (2, 0.5, 0.99),
        (3, 1.0, 0.99),
        (3, 0.5, 0.49),
        (3, 0.5, 0.51),
        (4, 0.25, 0.24),
        (4, 0.25, 0.26),
        (64, 8.0, 0.47),
        (64, 8.0, 0.48),
    ] {
        all.push(
            (
                &path(traced, Vec3::splat(brightness), numbers(u_roulette)),
                &surface_interaction,
            ),
            (&matte(base), 1.0),
            None,
        );
    }
    let shaded = all.shade();
    assert_eq!(
        shaded.lanes.next.continues,
        [true, true, true, false, true, false, true, false]
    );
    let expected = [
        base * 0.5,
        base,
        base,
        base,
        base,
        base,
        base * 8.0 / 0.475,
        base,
    ];
    for lane in (0..8).filter(|&lane| shaded.lanes.next.continues[lane]) {
        close(
            get_lane_vector::<f32>(&shaded.lanes.next.throughput, lane),
            expected[lane],
        );
        let Ray {
            origin, direction, ..
        } = shaded.ray(lane);
        assert!(origin.y > 0.0 && origin.length() < 0.01, "{origin}");
        // A point of the disk at radius √0.04, raised to the hemisphere.
        assert!((direction.y - 0.96_f32.sqrt()).abs() < 1e-5, "{direction}");
        assert!(
            (shaded.bsdf_lanes.density[lane] - direction.y / PI).abs() < 1e-5,
            "{}",
            shaded.bsdf_lanes.density[lane]
        );
    }
}

/// Protects: paths with an overflowing or NaN throughput are reported, so that their samples are
/// dropped and counted; not those of zero throughput, nor those below the surface.
#[test]
fn paths_that_carry_no_number_are_told() {
    let mut all = Vertices::new();
    let [flat, tilted] =
        [Vec3::Y, Vec3::new(0.8, 0.6, 0.0)].map(|normal| interaction(Vec3::ZERO, normal));
    for carried in [1.0, f32::INFINITY, f32::NAN, 0.0] {
        all.push(
            (&path(0, Vec3::splat(carried), [0.5; 4]), &flat),
            (&matte(Vec3::ONE), 1.0),
            None,
        );
    }
    for turn in [0.0, 0.25, 0.5, 0.75] {
        all.push(
            (
                &path(0, Vec3::splat(f32::NAN), [0.5, 0.9, turn, 0.5]),
                &tilted,
            ),
            (&matte(Vec3::ONE), 1.0),
            None,
        );
    }
    let shaded = all.shade();
    let above: [bool; 4] = core::array::from_fn(|i| {
        get_lane_vector::<f32>(&shaded.bsdf_lanes.direction, 4 + i).y > 0.0
    });
    assert_eq!(
        shaded.lanes.next.continues,
        [true, false, false, false, false, false, false, false]
    );
    assert_eq!(
        (
            &shaded.lanes.next.overflows[..4],
            &shaded.lanes.next.overflows[4..]
        ),
        (&[false, true, true, false][..], &above[..])
    );
    assert!(above.contains(&true) && above.contains(&false), "{above:?}");
}

/// Protects: a shading normal turns no reflection below the geometric surface, from outside and
/// from inside.
#[test]
fn s08_nothing_is_reflected_below_the_surface() {
    let normal = Vec3::new(0.8, 0.6, 0.0);
    let mut all = Vertices::new();
    let inside = Interaction {
        surface: surface(Vec3::ZERO, -Vec3::Y),
        outside: false,
        ..interaction(Vec3::ZERO, normal)
    };
    let turns = [0.0_f32, 0.25, 0.5, 0.75];
    for (surface_interaction, turn) in [interaction(Vec3::ZERO, normal), inside]
        .iter()
        .flat_map(|surface_interaction| turns.map(|turn| (surface_interaction, turn)))
    {
        all.push(
            (
                &path(0, Vec3::ONE, [0.5, 0.9, turn, 0.5]),
                surface_interaction,
            ),
            (&matte(Vec3::ONE), 1.0),
            None,
        );
    }
    let shaded = all.shade();
    for lane in 0..8 {
        let direction = get_lane_vector::<f32>(&shaded.bsdf_lanes.direction, lane);
        assert_eq!(
            shaded.lanes.next.continues[lane],
            direction.y > 0.0,
            "{lane}: {direction}"
        );
    }
    let lost = shaded
        .lanes
        .next
        .continues
        .iter()
        .filter(|&&continues| !continues)
        .count();
    assert!(
        (1..8).contains(&lost)
            && shaded.lanes.next.continues[..4] == shaded.lanes.next.continues[4..],
        "{lost}"
    );
}
