//! Benchmark of a user's scene. Camera rays, and a bounce ray from each hit, are intersected by
//! linear scan and by BVH.

use glam::DVec3;
use raywright_bvh::{Geometry, Interval, Ray, Real, Vector};
use serde::Serialize;

use super::generated::HashedRandom;
use super::measure::{BenchedGeometry, ScanTreeTiming, measure_scan_and_tree, time_builds};
use super::{BenchError, BenchOptions, SEEDS};
use crate::camera::PreparedCamera;
use crate::framing::{FIELD_OF_VIEW, Silhouette, ViewAngles};
use crate::lookup::SceneLookup;
use crate::prepare::build_geometry;
use crate::scene::Scene;
use crate::settings::Settings;
use crate::storage_origin::{StorageOrigin, camera_relative_to};

/// Largest number of camera rays.
const CAMERA_RAYS: u32 = 1 << 15;

/// Times of closest-hit queries by linear scan and by BVH on a user's scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneComparison {
    /// Times for camera rays through a regular grid of pixel centres, which are coherent.
    pub camera: ScanTreeTiming,
    /// Times for rays from the hits of the camera rays, cosine-weighted about the normal, which are
    /// incoherent. `None` without hits.
    pub bounce: Option<ScanTreeTiming>,
}

/// Times closest-hit queries by linear scan and by BVH on a validated scene, with rays of the
/// settings' camera and with bounce rays. `on_row` is called with each finished result.
///
/// # Errors
/// See [`BenchError`].
pub fn compare_scene(
    scene: &Scene,
    settings: &Settings,
    options: &BenchOptions,
    on_row: &mut dyn FnMut(&ScanTreeTiming),
) -> Result<SceneComparison, BenchError> {
    let lookup = SceneLookup::new(scene);
    let build = |kind| {
        time_builds(
            options,
            || (),
            |()| build_geometry::<f32>(scene, &lookup, kind, &()),
        )
    };
    let [scan, tree] = options.accelerator_kinds().map(build);
    let pair = [
        BenchedGeometry {
            geometry: scan.0?.geometry,
            build: scan.1,
        },
        BenchedGeometry {
            geometry: tree.0?.geometry,
            build: tree.1,
        },
    ];
    let tree = &pair[1].geometry;
    if tree.is_empty() {
        return Err(BenchError::Empty);
    }
    let origin = StorageOrigin::from_scene::<f32>(scene, &lookup).origin;
    let rays = camera_rays(tree, settings, origin);
    let camera = measure_scan_and_tree(&pair, &rays, options)?;
    on_row(&camera);
    let bounced = bounce_rays(tree, &rays);
    let bounce = match bounced.as_slice() {
        [] => None,
        rays => Some(measure_scan_and_tree(&pair, rays, options)?),
    };
    bounce.iter().for_each(on_row);
    Ok(SceneComparison { camera, bounce })
}

/// Returns camera rays through the pixel centres of every n-th column and row. The step n is chosen
/// to limit the number of rays. Ray origins are relative to `origin`.
fn camera_rays(geometry: &Geometry<f32>, settings: &Settings, origin: DVec3) -> Vec<Ray<f32>> {
    let [width, height] = settings.size;
    let aspect = f64::from(width) / f64::from(height);
    let camera = settings
        .camera
        .as_ref()
        .map(|camera| camera_relative_to(origin, camera))
        .unwrap_or_else(|| {
            let silhouette = Silhouette::from_box(&geometry.bounded_primitives_box());
            silhouette.frame_camera(ViewAngles::DEFAULT, FIELD_OF_VIEW, aspect)
        });
    let camera = PreparedCamera::<f32>::new(&camera, settings.size);
    let pixels = u64::from(width) * u64::from(height);
    let step = (1..)
        .find(|s| u64::from(CAMERA_RAYS) * s * s >= pixels)
        .unwrap_or(1) as usize;
    let centres = |n: u32| {
        (0..n)
            .step_by(step)
            .map(|i| f32::from_f64(f64::from(i) + 0.5))
    };
    centres(height)
        .flat_map(|y| centres(width).map(move |x| (x, y)))
        .map(|(x, y)| camera.generate_ray(x, y, [0.5; 2]))
        .collect()
}

/// Returns a bounce ray from each hit, cosine-weighted about the normal on the side of the incoming
/// ray.
fn bounce_rays(geometry: &Geometry<f32>, rays: &[Ray<f32>]) -> Vec<Ray<f32>> {
    let numbers = HashedRandom { seed: SEEDS[1] };
    let bounce = |(i, ray): (usize, &Ray<f32>)| {
        let hit = geometry.closest(ray, Interval::positive(), &mut ())?;
        let surface = geometry.surface(ray, &hit);
        let normal = if surface.normal.dot(ray.direction) > 0.0 {
            -surface.normal
        } else {
            surface.normal
        };
        // A point of the unit sphere that touches the surface has a cosine-distributed direction.
        // The factor excludes the zero vector.
        let direction = normal + glam::Vec3::from_f64(numbers.unit_direction(i as u64, 0)) * 0.999;
        let direction = direction.normalize();
        Some(Ray::new(surface.spawn_ray_origin(direction), direction).with_time(ray.time))
    };
    rays.iter().enumerate().filter_map(bounce).collect()
}

#[cfg(test)]
mod tests {
    use raywright_bvh::BuildQuality;

    use super::*;
    use crate::scene::Object;

    const HASTY: BenchOptions = BenchOptions {
        repeats: 1,
        sample_seconds: 1e-4,
        build: BuildQuality::Fast,
    };

    fn compare_scene(
        scene: &Scene,
        on_row: &mut dyn FnMut(&ScanTreeTiming),
    ) -> Result<SceneComparison, BenchError> {
        super::compare_scene(scene, &Settings::from_scene(scene), &HASTY, on_row)
    }

    /// A sphere among `count` others on a plane, seen from the front.
    fn scene(count: usize) -> Scene {
        let mut objects = vec![
            r#"{"shape": {"plane": {"point": [0, -1, 0], "normal": [0, 1, 0]}}, "material": "m"}"#
                .to_owned(),
        ];
        for i in 0..count {
            let x = i as f64 * 0.1;
            objects.push(format!(r#"{{"shape": {{"sphere": {{"centre": [{x}, 0, 0], "radius": 0.5}}}}, "material": "m"}}"#));
        }
        let objects: Vec<Object> = objects
            .iter()
            .map(|o| serde_json::from_str(o).unwrap())
            .collect();
        let mut scene: Scene = serde_json::from_str(
            r#"{"format": 1, "render": {"size": [500, 400]}, "cameras": [{"name": "c", "pose": {"look_at": {"eye": [0, 0, 5],
                "target": [0, 0, 0]}}, "projection": {"pinhole": {"vertical_fov": 40}}}],
                "materials": [{"name": "m", "model": {"classic": {}}}]}"#,
        )
        .unwrap();
        scene.objects = objects;
        scene
    }

    /// Protects: both sets of rays are measured, within their limit, and bounces start only at
    /// hits.
    #[test]
    fn camera_and_bounce_rays() {
        let scene = scene(30);
        let mut heard = 0;
        let comparison = compare_scene(&scene, &mut |_| heard += 1).unwrap();
        let bounce = comparison.bounce.expect("the camera sees something");
        assert_eq!((heard, comparison.camera.primitives), (2, 31));
        assert!(
            comparison.camera.tree.rays <= CAMERA_RAYS as usize
                && bounce.tree.rays <= comparison.camera.tree.rays
        );
        assert!(
            comparison.camera.hit_share > 0.1
                && comparison.camera.hit_share < 1.0
                && bounce.hit_share < 1.0
        );
        assert_eq!(comparison.camera.scan.unwrap().tests_per_ray, 31.0);
    }

    /// Protects: bounces leave the surface: none from a single sphere seen from outside hits it
    /// again.
    #[test]
    fn bounces_leave_the_surface() {
        let mut scene = scene(1);
        scene.objects.remove(0);
        let comparison = compare_scene(&scene, &mut |_| ()).unwrap();
        assert_eq!(
            comparison.bounce.expect("the camera sees it").hit_share,
            0.0
        );
    }

    /// Protects: a scene without objects is an error with a message, not a table of NaN.
    #[test]
    fn nothing_to_hit() {
        let mut scene = scene(0);
        scene.objects.clear();
        assert_eq!(compare_scene(&scene, &mut |_| ()), Err(BenchError::Empty));
    }
}
