//! Furnace test of each material: a ball under a uniform white sky, which may reflect no more light
//! than it receives.

use super::RayDeadline;
use super::facts::SceneFacts;
use super::ray_survey::RaySurvey;
use crate::dispatch::prepare;
use crate::effects::chosen_integrator;
use crate::scene::{
    Camera, ClassicMaterial, Colour, Integrator, Material, MaterialModel, Object, Pose, Projection,
    RenderSettings, Scene, Shape, SideRule, Sky,
};
use crate::settings::{Sampling, Settings};

/// Width and height of the ball's picture in pixels, and samples of each pixel.
const EDGE: u32 = 16;
const SAMPLES: u32 = 64;

/// Greatest ratio of reflected to received light that passes the test. It allows for the noise of
/// the samples.
const MOST: f64 = 1.02;

/// Least share of the rays that hit objects for a value that they find to count.
const SEEN: f64 = 0.001;

/// Result of the furnace test of a material.
#[derive(Clone, Copy, Debug)]
pub(super) struct FurnaceAlbedo {
    /// Index in the scene's list of materials.
    pub material: usize,
    /// Ratio of reflected to received light: the mean of all pixels, in the brightest channel.
    pub albedo: f64,
}

impl FurnaceAlbedo {
    pub fn creates_energy(&self) -> bool {
        self.albedo > MOST
    }
}

/// Measures the materials in use, as many as the time allows. Returns the results, and the number
/// of materials that more time would measure: those whose test cannot be prepared are left out. Classic
/// materials under Whitted's rules are left out: they do not model energy.
///
/// The ball shows other values of an expression than the scene's objects do. A colour above 1 that
/// cameras see is therefore measured too.
pub(super) fn run_furnace_tests(
    scene_facts: &SceneFacts<'_>,
    survey: &RaySurvey,
    settings: &Settings,
    deadline: &RayDeadline<'_>,
) -> (Vec<FurnaceAlbedo>, usize) {
    let by_paths = chosen_integrator(scene_facts.scene, settings) == Integrator::Path;
    let judged = |model: &MaterialModel| match model {
        MaterialModel::Physical(m) => !m.unlit,
        MaterialModel::Classic(_) => by_paths,
    };
    let materials: Vec<_> = scene_facts
        .used_materials()
        .into_iter()
        .filter(|(_, material)| judged(&material.model))
        .collect();
    let (mut measured, mut planned) = (Vec::new(), materials.len());
    for &(index, material) in &materials {
        if deadline.has_passed() {
            break;
        }
        let albedo = |material: &Material| furnace_albedo(scene_facts.scene, material, settings);
        let of_ball = albedo(material);
        let of_seen = || {
            albedo(&with_base_colour(
                material,
                greatest_colour(survey, index)?,
            )?)
        };
        match of_ball.map(|own| own.max(of_seen().unwrap_or(0.0))) {
            Some(albedo) => measured.push(FurnaceAlbedo {
                material: index,
                albedo,
            }),
            None => planned -= 1,
        }
    }
    (measured, planned)
}

/// Returns the greatest base colour above 1 of a material, if more than a few rays see such a value.
fn greatest_colour(survey: &RaySurvey, material: usize) -> Option<f64> {
    let seen = RaySurvey::sighting_count(&survey.colours_above_one, &material) as f64;
    let greatest = survey.greatest_colours.get(&material).copied();
    greatest.filter(|value| value.is_finite() && seen >= SEEN * survey.hits as f64)
}

/// Returns the material with an even grey base colour. `None` for a classic one.
fn with_base_colour(material: &Material, grey: f64) -> Option<Material> {
    let mut material = material.clone();
    let MaterialModel::Physical(m) = &mut material.model else {
        return None;
    };
    (m.base_colour, m.base_colour_texture) = (Colour([grey; 3]).into(), None);
    Some(material)
}

/// Returns the material without its emission and ambient light.
fn without_emission(material: &Material) -> Material {
    let mut material = material.clone();
    match &mut material.model {
        MaterialModel::Physical(m) => {
            (m.emission, m.emission_texture) = (Colour::BLACK.into(), None)
        }
        MaterialModel::Classic(m) => {
            **m = ClassicMaterial {
                emission: None,
                ambient: Some(Colour::BLACK),
                ..(**m).clone()
            }
        }
    }
    material
}

/// Returns the mean radiance of a ball of the material under a uniform white sky of radiance 1, in
/// the brightest channel. Returns `None` if the test scene cannot be prepared.
fn furnace_albedo(scene: &Scene, material: &Material, settings: &Settings) -> Option<f64> {
    let camera = Camera {
        name: String::new(),
        pose: Pose::LookAt {
            eye: [0.0, 0.0, 3.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
        },
        projection: Projection::Orthographic { height: 1.2 },
        aspect: None,
        fit: Default::default(),
        pose_end: None,
        shutter: None,
    };
    let ball = Object {
        name: String::new(),
        shape: Shape::Sphere {
            centre: [0.0; 3],
            radius: 1.0,
        },
        material: material.name.clone(),
        side: SideRule::Both,
        face_viewer: true,
        casts_shadow: true,
        transform: Vec::new(),
        transform_end: None,
    };
    let furnace = Scene {
        format: scene.format,
        t: scene.t,
        parameters: scene.parameters.clone(),
        render: RenderSettings {
            integrator: Integrator::Path,
            ..RenderSettings::default()
        },
        sky: Some(Sky::Constant(Colour::WHITE)),
        images: scene.images.clone(),
        textures: scene.textures.clone(),
        materials: vec![without_emission(material)],
        objects: vec![ball],
        ..Scene::default()
    };
    let settings = Settings {
        size: [EDGE; 2],
        camera: Some(camera),
        sampling: Sampling::General(SAMPLES),
        integrator: Integrator::Path,
        max_depth: 32,
        seed: settings.seed,
        ..Settings::from_scene(&furnace)
    };
    let picture = prepare(&furnace, &settings, &()).ok()?.render(&()).picture;
    let mean = |channel: usize| {
        picture
            .rgb
            .iter()
            .map(|pixel| f64::from(pixel[channel]))
            .sum::<f64>()
            / picture.rgb.len() as f64
    };
    Some((0..3).map(mean).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use raywright_bvh::Aabb;

    use super::*;

    /// Protects: a material whose test cannot be prepared does not count as left out for lack of
    /// time.
    #[test]
    fn a_test_that_cannot_be_prepared_is_not_planned() {
        let scene: Scene = serde_json::from_str(
            r#"{
                "format": 1,
                "materials": [
                    { "name": "paint", "model": { "physical": {} } },
                    { "name": "lost", "model": { "physical": { "base_colour_texture": { "name": "none" } } } }
                ],
                "objects": [
                    { "shape": { "sphere": { "centre": [0, 0, 0], "radius": 1 } }, "material": "paint" },
                    { "shape": { "sphere": { "centre": [2, 0, 0], "radius": 1 } }, "material": "lost" }
                ]
            }"#,
        )
        .expect("a scene");
        let scene_facts = SceneFacts::new(&scene, Aabb::EMPTY);
        let deadline = RayDeadline {
            observer: &(),
            end: None,
        };
        let settings = Settings::from_scene(&scene);
        let (measured, planned) =
            run_furnace_tests(&scene_facts, &RaySurvey::default(), &settings, &deadline);
        assert_eq!((measured.len(), planned), (1, 1));
    }
}
