//! Facts about the parts of a scene other than materials: objects, generators, lights, sky and
//! camera.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use super::{EffectFacts, record_first_use};
use crate::generate::count_generated_objects;
use crate::lookup::{SceneLookup, objects_with_paths};
use crate::motion::{camera_moves, object_transforms_at_ends, shutter_interval};
use crate::scene::{Camera, Colour, Projection, Scene, Shape, Sky};

impl EffectFacts {
    /// Gathers the facts of all listed objects, and of the object of each generator.
    pub(super) fn gather_objects(&mut self, scene: &Scene) {
        let lookup = SceneLookup::new(scene);
        let mut shown = HashSet::new();
        for (path, object) in objects_with_paths(scene) {
            record_first_use(&mut self.occluder, object.casts_shadow, || path.to_string());
            let unbounded = matches!(
                object.shape,
                Shape::Plane { .. } | Shape::Cylinder { height: None, .. }
            );
            record_first_use(&mut self.unbounded_shape, unbounded, || {
                format!("{path}.shape")
            });
            record_first_use(
                &mut self.motion,
                object_transforms_at_ends(object).is_some(),
                || format!("{path}.transform_end"),
            );
            let Shape::Mesh(name) = &object.shape else {
                continue;
            };
            record_first_use(&mut self.mesh, true, || format!("{path}.shape.mesh"));
            // Only objects with the same rule for sides share a stored mesh.
            record_first_use(
                &mut self.instance,
                !shown.insert((name, object.side)),
                || format!("{path}.shape.mesh"),
            );
            let smooth = lookup
                .mesh_data(name)
                .is_some_and(|data| !data.normals.is_empty());
            record_first_use(&mut self.smooth_normals, smooth, || {
                format!("{path}.shape.mesh")
            });
        }
    }

    /// Gathers the generators that place a mesh more than once.
    pub(super) fn gather_generators(&mut self, scene: &Scene) {
        for (i, generator) in scene.generators.iter().enumerate() {
            let repeated = matches!(generator.object.shape, Shape::Mesh(_))
                && count_generated_objects(&generator.kind) > 1;
            record_first_use(&mut self.instance, repeated, || {
                format!("generators[{i}].object.shape.mesh")
            });
        }
    }

    /// Gathers the facts of the lights that are not black.
    pub(super) fn gather_lights(&mut self, scene: &Scene) {
        for (i, light) in scene
            .lights
            .iter()
            .enumerate()
            .filter(|(_, light)| light.colour != Colour::BLACK)
        {
            let path = || format!("lights[{i}]");
            record_first_use(&mut self.light, true, path);
            record_first_use(&mut self.shadowing_light, light.shadows, path);
            record_first_use(&mut self.glossy_light, light.specular, path);
        }
    }

    /// Gathers the facts of the sky. The facts of objects must be gathered before, because a studio
    /// has no ground below an unbounded object.
    pub(super) fn gather_sky(&mut self, scene: &Scene) {
        match &scene.sky {
            Some(Sky::Map(_)) => {
                record_first_use(&mut self.sky_map, true, || "sky.map".to_owned());
            }
            Some(Sky::Expression(_)) => {
                record_first_use(&mut self.program, true, || "sky.expression".to_owned());
            }
            Some(Sky::Studio(studio)) => {
                let ground = studio.ground && self.unbounded_shape.is_none();
                record_first_use(&mut self.ground, ground, || "sky.studio.ground".to_owned());
                self.is_sky_dark = studio.strength == 0.0;
            }
            None | Some(Sky::Constant(_) | Sky::Gradient { .. }) => {}
        }
        record_first_use(&mut self.sky, scene.sky.is_some(), || "sky".to_owned());
    }

    /// Gathers the facts of a camera: lens, motion and shutter.
    pub(super) fn gather_camera(&mut self, camera: &Camera) {
        let path = || "cameras".to_owned();
        let has_lens = matches!(
            &camera.projection,
            Projection::ThinLens { aperture_radius, .. } if *aperture_radius > 0.0
        );
        record_first_use(&mut self.lens, has_lens, path);
        record_first_use(&mut self.motion, camera_moves(camera), path);
        record_first_use(&mut self.exposure, shutter_interval(camera).is_some(), path);
        self.instant = self.exposure.is_none() && camera.shutter.is_some();
    }

    /// Gathers the material properties of imported files that the scene format cannot represent,
    /// with the materials that have them.
    pub(super) fn gather_unread_extensions(&mut self, scene: &Scene, used: &BTreeSet<&str>) {
        const MOST: usize = 3;
        let mut parts: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for part in scene
            .unread
            .iter()
            .filter(|part| used.contains(part.material.as_str()))
        {
            let place = || {
                scene
                    .materials
                    .iter()
                    .position(|material| material.name == part.material)
            };
            if self.unread_material.is_none() {
                self.unread_material = place().map(|i| format!("materials[{i}]"));
            }
            parts.entry(&part.label).or_default().push(&part.material);
        }
        let listed = parts.into_iter().map(|(label, materials)| {
            let names: Vec<String> = materials
                .iter()
                .take(MOST)
                .map(|name| format!("`{name}`"))
                .collect();
            let more = materials.len().saturating_sub(MOST);
            let more = if more > 0 {
                format!(" and {more} more")
            } else {
                String::new()
            };
            format!("{label} of {}{more}", names.join(", "))
        });
        self.unread_extensions = listed.collect::<Vec<_>>().join("; ");
    }
}
