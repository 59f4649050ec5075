//! Findings about materials: values that are not numbers, and more reflected than received light. The
//! latter is found by a furnace test: a ball under a uniform white sky may reflect no more light than
//! it receives.

use super::*;
use crate::dispatch::prepare;
use crate::effects::chosen_integrator;
use crate::scene::{
    Camera, ClassicMaterial, Colour, Integrator, Object, Pose, Projection, RenderSettings,
};
use crate::settings::Sampling;

/// Width and height of the ball's picture in pixels, and samples of each pixel.
const EDGE: u32 = 16;
const SAMPLES: u32 = 64;
/// Greatest ratio of reflected to received light that passes the test. It allows for the noise of
/// the samples.
const MOST: f64 = 1.02;
/// Least share of the rays that hit objects for a value that they find to count.
const SEEN: f64 = 0.001;

impl SceneFacts<'_> {
    /// Returns findings about values that are not finite numbers.
    pub fn not_number_findings(&self, survey: &RaySurvey) -> Vec<Fault> {
        let found = survey.of(|event| match event {
            RayEvent::NotNumber(material, key) => Some((material, key)),
            _ => None,
        });
        let finding = |((material, key), at): ((usize, &str), Sighting)| {
            let finding = ValuesNotNumbers.fault(Subject::Material(material),
                format!("its `{key}` is NaN or infinite at some points of the surface, where its expression or image gives such a value"),
                "look for a division by zero, a root or logarithm of a negative number, and for numbers that are too large",
            );
            let predicate = "that hit an object found such a value";
            finding
                .with_rays(at.count, survey.hits, predicate)
                .with_place(at.position)
        };
        found.into_iter().map(finding).collect()
    }

    /// Measures the materials in use, as many as the time allows. Returns the findings, the number of
    /// measured materials, and the number that more time would measure: those whose test cannot be
    /// prepared are left out. Classic materials under Whitted's rules are left out: they do not model
    /// energy.
    ///
    /// The ball shows other values of an expression than the scene's objects do. A colour above 1
    /// that cameras see is therefore measured too.
    pub fn run_furnace_tests(
        &self,
        survey: &RaySurvey,
        deadline: &RayDeadline<'_>,
    ) -> (Vec<Fault>, [u64; 2]) {
        let by_paths = chosen_integrator(self.scene, self.settings) == Integrator::Path;
        let mut materials = self.used_materials();
        materials.retain(|_, material| match &material.model {
            MaterialModel::Physical(m) => !m.unlit,
            MaterialModel::Classic(_) => by_paths,
        });
        let (mut findings, mut measured, mut planned) = (Vec::new(), 0, materials.len() as u64);
        for (index, material) in materials {
            if deadline.has_passed() {
                break;
            }
            let colour = survey.events.get(&RayEvent::ColourAboveOne(index));
            let Some(own) = self.furnace_albedo(material) else {
                planned -= 1;
                continue;
            };
            let is_seen = |at: &&Sighting| {
                at.value.is_finite() && at.count as f64 >= SEEN * survey.hits as f64
            };
            let of_seen = colour.filter(is_seen).and_then(|at| {
                let mut material = material.clone();
                if let MaterialModel::Physical(m) = &mut material.model {
                    (m.base_colour, m.base_colour_texture) = (Colour([at.value; 3]).into(), None);
                }
                self.furnace_albedo(&material)
            });
            let albedo = own.max(of_seen.unwrap_or(0.0));
            measured += 1;
            if albedo > MOST {
                findings.push(energy_finding(index, albedo, colour));
            }
        }
        (findings, [measured, planned])
    }

    /// Returns the mean radiance of a ball of the material, without its emission and ambient light,
    /// under a uniform white sky of radiance 1, in the brightest channel. Returns `None` if the test
    /// scene cannot be prepared.
    fn furnace_albedo(&self, material: &Material) -> Option<f64> {
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
        let scene = self.scene;
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
            materials: vec![material],
            objects: vec![ball],
            ..Scene::default()
        };
        let settings = Settings {
            size: [EDGE; 2],
            camera: Some(camera),
            sampling: Sampling::General(SAMPLES),
            integrator: Integrator::Path,
            max_depth: 32,
            seed: self.settings.seed,
            ..Settings::from_scene(&furnace)
        };
        let picture = prepare(&furnace, &settings, &()).ok()?.render(&()).picture;
        let pixels = picture.rgb.iter();
        let sum: DVec3 = pixels.map(|pixel| DVec3::from(pixel.map(f64::from))).sum();
        Some(sum.max_element() / picture.rgb.len() as f64)
    }
}

/// Returns the finding about a material of an albedo above 1. `colour` holds the rays that find a
/// base colour above 1.
fn energy_finding(material: usize, albedo: f64, colour: Option<&Sighting>) -> Fault {
    let values = colour.map_or(String::new(), |at| {
        format!(" (`base_colour` is up to {:.3})", at.value)
    });
    let reason = format!(
        "under even light it reflects {albedo:.3} times the light that it receives{values}: it glows, and between two such surfaces light grows without end"
    );
    let remedy = "reduce its colours, weights and factors to at most 1";
    let subject = Subject::Material(material);
    let finding = EnergyMade.fault(subject, reason, remedy);
    finding.with_place(colour.map(|at| at.position))
}

#[cfg(test)]
mod tests {
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
        let settings = Settings::from_scene(&scene);
        let facts = SceneFacts::new(&scene, &settings, Aabb::EMPTY);
        let deadline = RayDeadline {
            observer: &(),
            end: None,
        };
        let (_, numbers) = facts.run_furnace_tests(&RaySurvey::default(), &deadline);
        assert_eq!(numbers, [1, 1]);
    }
}
