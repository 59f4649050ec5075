//! Cameras with the size of their picture, and the pixels at which they show a point.

use super::*;
use crate::camera::{PreparedCamera, eye_and_axes};
use crate::framing::{FIELD_OF_VIEW, Silhouette};
use crate::scene::Camera;

/// Greatest number of cameras that are checked: the first ones of the scene.
const CAMERAS: usize = 8;
/// Least separation of distinguishable surfaces, in units of the rounding error.
const ROUNDINGS: f64 = 4.0;

/// A camera with the size of its picture in pixels.
pub(super) struct CameraView {
    /// Index in the scene's list of cameras; 0 for an automatically framed camera.
    pub index: usize,
    pub subject: Subject,
    pub data: Camera,
    pub size: [u32; 2],
    prepared: PreparedCamera<f64>,
}

impl CameraView {
    /// Returns the cameras to check, each with the picture size of the settings. Without cameras,
    /// the scene is framed automatically.
    pub fn list(scene: &Scene, settings: &Settings) -> Vec<Self> {
        let size = settings.size;
        let view = |index, subject, data: Camera| Self {
            prepared: PreparedCamera::new(&data, size),
            index,
            subject: Subject::Camera(subject),
            data,
            size,
        };
        if scene.cameras.is_empty() {
            let framed = || {
                let silhouette = Silhouette::from_scene(scene);
                let aspect = f64::from(size[0]) / f64::from(size[1]);
                silhouette.frame_camera(silhouette.default_view(), FIELD_OF_VIEW, aspect)
            };
            return vec![view(
                0,
                None,
                settings.camera.clone().unwrap_or_else(framed),
            )];
        }
        let cameras = scene.cameras.iter().enumerate().take(CAMERAS);
        cameras
            .map(|(index, camera)| view(index, Some(index), camera.clone()))
            .collect()
    }

    /// Returns the pixel at which a world point appears, or `None` outside the picture.
    pub fn project_point(&self, point: DVec3) -> Option<[f64; 2]> {
        let pixel = self.prepared.project_to_pixel(point)?;
        let is_inside = (0..2).all(|axis| (0.0..f64::from(self.size[axis])).contains(&pixel[axis]));
        is_inside.then_some(pixel)
    }

    /// Returns the ray from the middle of the lens through a position in the picture, in pixels.
    pub fn ray_through_pixel(&self, [x, y]: [f64; 2]) -> Ray<f64> {
        self.prepared.generate_ray(x, y, [0.5; 2])
    }

    /// Returns rays through the middles of a grid of cells of the picture.
    pub fn grid_rays(&self, [width, height]: [u32; 2]) -> Vec<Ray<f64>> {
        let ray = |i: u32| {
            let cells = [(i % width, width), (i / width, height)];
            let at = |axis: usize| {
                let (cell, total) = cells[axis];
                (f64::from(cell) + 0.5) / f64::from(total) * f64::from(self.size[axis])
            };
            self.ray_through_pixel([at(0), at(1)])
        };
        (0..width * height).map(ray).collect()
    }

    pub fn distance_from_eye(&self, point: DVec3) -> f64 {
        point.distance(self.eye())
    }

    pub fn eye(&self) -> DVec3 {
        eye_and_axes(&self.data.pose).0
    }

    /// Returns the width that a pixel covers at the distance of a point, in metres.
    pub fn pixel_width_at(&self, point: DVec3) -> f64 {
        let cone = self.prepared.ray_cone();
        cone.width + cone.spread * self.distance_from_eye(point)
    }

    /// Returns the length of the camera's ray to a position. Rays of a distant camera start near the
    /// scene.
    fn ray_length(&self, position: DVec3, precision: PrecisionChoice, bounds: &Aabb) -> f64 {
        fn skipped<R: Real>(view: &CameraView, bounds: &Aabb) -> f64 {
            let camera = PreparedCamera::<R>::for_scene_bounds(&view.data, view.size, bounds);
            camera.eye_to_origin_distance().to_f64()
        }
        let skipped = match precision {
            PrecisionChoice::Robust => skipped::<f32>(self, bounds),
            PrecisionChoice::Reference => skipped::<f64>(self, bounds),
        };
        (self.distance_from_eye(position) - skipped).abs()
    }
}

impl SceneFacts<'_> {
    /// Returns a sort key of a position: visible positions come first, then the nearer ones. The
    /// first value is 1 if no camera has the position in view. The second is the distance to the
    /// nearest eye, in metres.
    pub fn view_distance_key(&self, position: DVec3) -> (u8, f64) {
        view_distance_key(&self.views, position)
    }

    /// Returns the item whose position is nearest to a camera. Positions in view come first.
    pub fn nearest_to_camera<T>(
        &self,
        places: impl IntoIterator<Item = (T, DVec3)>,
    ) -> Option<(T, DVec3)> {
        nearest_to_camera(&self.views, places)
    }

    /// Returns whether some camera has a position in its picture.
    pub fn is_in_view(&self, position: DVec3) -> bool {
        self.view_distance_key(position).0 == 0
    }

    /// Returns whether a ray of the cameras crosses an object, or a corner or the centre of its box
    /// is in view.
    pub fn is_object_in_view(&self, survey: &RaySurvey, object: &ObjectFacts<'_>) -> bool {
        survey.count(RayEvent::Crossed(object.index)) > 0
            || object.bounds.is_none_or(|bounds| {
                let corners = bounds.corners().into_iter();
                corners
                    .chain([bounds.centre()])
                    .any(|position| self.is_in_view(position))
            })
    }

    pub fn unit_roundoff(&self) -> f64 {
        0.5 * match self.settings.precision {
            PrecisionChoice::Robust => f64::from(f32::EPSILON),
            PrecisionChoice::Reference => f64::EPSILON,
        }
    }

    /// Returns the least separation at which the precision distinguishes two surfaces at a position
    /// in the cameras' pictures, in metres. It covers the rounding of the ray's length and of the
    /// position.
    pub fn min_separation_at(&self, position: DVec3) -> f64 {
        let views = self.views.iter();
        let views = views.filter(|view| view.project_point(position).is_some());
        let rays =
            views.map(|view| view.ray_length(position, self.settings.precision, &self.bounds));
        let reach = position.abs().max_element() + rays.fold(0.0, f64::max);
        ROUNDINGS * self.unit_roundoff() * reach
    }
}

fn view_distance_key(views: &[CameraView], position: DVec3) -> (u8, f64) {
    let keys = views.iter().map(|view| {
        let is_out = view.project_point(position).is_none();
        (u8::from(is_out), view.distance_from_eye(position))
    });
    keys.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
        .unwrap_or((1, f64::INFINITY))
}

/// Returns the item whose position is nearest to a camera, as [`SceneFacts::nearest_to_camera`].
pub(super) fn nearest_to_camera<T>(
    views: &[CameraView],
    places: impl IntoIterator<Item = (T, DVec3)>,
) -> Option<(T, DVec3)> {
    let places = places.into_iter();
    let keyed = places.map(|place| (view_distance_key(views, place.1), place));
    keyed
        .min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
        .map(|(_, nearest)| nearest)
}
