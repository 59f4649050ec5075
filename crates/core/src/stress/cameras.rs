//! Cameras, and the pixels at which they show a point. The checks find cameras inside a body,
//! without anything in view, out of focus or stretched.

use glam::DVec3;
use raywright_bvh::{Aabb, Ray, Real};

use super::facts::{SceneFacts, finite_point};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::numbers::format_decimal;
use super::ray_survey::RaySurvey;
use crate::camera::{PreparedCamera as Prepared, eye_and_axes};
use crate::scene::{AspectFit, Camera, Projection, Shape};

/// A camera with the size of its picture in pixels.
pub(super) struct CameraView {
    /// Index in the scene's list of cameras; 0 for an automatically framed camera.
    pub index: usize,
    pub subject: FindingSubject,
    pub data: Camera,
    pub size: [u32; 2],
    prepared: Prepared<f64>,
}

impl CameraView {
    pub fn new(index: usize, subject: FindingSubject, data: Camera, size: [u32; 2]) -> Self {
        let prepared = Prepared::new(&data, size);
        Self {
            index,
            subject,
            data,
            size,
            prepared,
        }
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

    /// Returns the distance from the eye to a point, in metres.
    pub fn distance_from_eye(&self, point: DVec3) -> f64 {
        point.distance(self.eye())
    }

    /// Returns a point slightly in front of a visible point: closer to the eye by a hundredth of
    /// the distance.
    pub fn point_in_front_of(&self, point: DVec3) -> DVec3 {
        point.lerp(self.eye(), 0.01)
    }

    /// Returns the distance from the eye to the origins of its rays, in metres. `bounds` is the
    /// bounding box of the scene.
    pub fn eye_to_origin_distance<R: Real>(&self, bounds: &Aabb) -> f64 {
        let prepared = Prepared::<R>::for_scene_bounds(&self.data, self.size, bounds);
        prepared.eye_to_origin_distance().to_f64()
    }

    pub fn eye(&self) -> DVec3 {
        eye_and_axes(&self.data.pose).0
    }

    /// Returns the width that a pixel covers at the distance of a point, in metres.
    fn pixel_width_at(&self, point: DVec3) -> f64 {
        let cone = self.prepared.ray_cone();
        cone.width + cone.spread * point.distance(self.eye())
    }

    /// Returns whether a ball is in view and smaller than a pixel.
    pub fn is_sphere_below_pixel(&self, centre: DVec3, radius: f64) -> bool {
        2.0 * radius < self.pixel_width_at(centre) && self.project_point(centre).is_some()
    }
}

/// Returns a sort key of a position: visible positions come first, then the nearer ones. The first
/// value is true if no camera has the position in view. The second is the distance to the nearest
/// eye, in metres.
pub(super) fn view_distance_key(views: &[CameraView], position: DVec3) -> (bool, f64) {
    let value_of = |view: &CameraView| {
        (
            view.project_point(position).is_none(),
            position.distance(view.eye()),
        )
    };
    let nearer = |a: &(bool, f64), b: &(bool, f64)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
    views
        .iter()
        .map(value_of)
        .min_by(nearer)
        .unwrap_or((true, f64::INFINITY))
}

/// Returns the item whose position is nearest to a camera. Positions in view come first.
pub(super) fn item_nearest_to_camera<T>(
    views: &[CameraView],
    places: impl Iterator<Item = (T, DVec3)>,
) -> Option<(T, DVec3)> {
    places
        .map(|(thing, position)| (view_distance_key(views, position), (thing, position)))
        .min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
        .map(|(_, nearest)| nearest)
}

/// Returns whether a corner or the centre of a box is in view of some camera.
pub(super) fn is_box_in_view(views: &[CameraView], bounds: &Aabb) -> bool {
    let corner = |i: u32| {
        let high = glam::BVec3::new(i & 1 == 1, i & 2 == 2, i & 4 == 4);
        DVec3::select(high, bounds.max, bounds.min)
    };
    (0..8).map(corner).chain([bounds.centre()]).any(|position| {
        views
            .iter()
            .any(|view| view.project_point(position).is_some())
    })
}

/// Returns the findings about the cameras. `surveys` holds the rays of each camera.
pub(super) fn check_cameras(
    scene_facts: &SceneFacts<'_>,
    views: &[CameraView],
    surveys: &[RaySurvey],
) -> Vec<StressFinding> {
    let mut findings = Vec::new();
    for (view, survey) in views.iter().zip(surveys) {
        if survey.hits == 0 && !scene_facts.is_empty() {
            findings.push(nothing_seen_finding(scene_facts, view, survey));
        }
        findings.extend(small_scene_finding(scene_facts, view));
        findings.extend(focus_finding(scene_facts, view, survey));
        findings.extend(aspect_finding(view));
    }
    findings
}

/// Returns the finding about a camera whose rays hit nothing. Rays may pass through surfaces that
/// are hidden from the camera's side.
fn nothing_seen_finding(
    scene_facts: &SceneFacts<'_>,
    view: &CameraView,
    survey: &RaySurvey,
) -> StressFinding {
    let (code, severity) = (FindingCode::NothingSeen, Severity::PictureWrong);
    let most = survey.hidden_backs_hit.iter();
    if let Some((&object, sighting)) = most.max_by_key(|(_, sighting)| sighting.count) {
        let name = scene_facts.objects[object].subject;
        let name = name.display_name(scene_facts.scene);
        let reason = format!(
            "no ray of this camera hits a visible side: the camera looks at {name} from the side that its `side` hides"
        );
        let remedy = format!(
            "set `side = \"both\"` for {name} (in glTF: `doubleSided`), or move the camera to its other side (`pose`, or render with --eye)"
        );
        let predicate = "pass through its hidden side";
        return StressFinding::new(code, severity, view.subject, reason, remedy)
            .with_count(sighting.count, survey.rays, "rays", predicate)
            .with_place(finite_point(sighting.position));
    }
    let reason = "no ray of this camera hits an object: its picture shows only the sky or nothing";
    let remedy = match view.subject {
        FindingSubject::Camera(None) => {
            "check that the scene has objects that are visible (`opacity`, `side`) and not scaled to nothing"
        }
        _ => {
            "turn the camera to the scene (`pose`, or render with --eye and --target), or remove the camera from the file: without a camera, the picture shows the whole scene"
        }
    };
    StressFinding::new(code, severity, view.subject, reason, remedy)
}

/// Returns a finding if the picture's aspect ratio differs from the camera's and the picture is
/// stretched to fit.
fn aspect_finding(view: &CameraView) -> Option<StressFinding> {
    let [width, height] = view.size.map(f64::from);
    let aspect = view.data.aspect?;
    let is_stretched =
        view.data.fit == AspectFit::Stretch && (aspect * height / width - 1.0).abs() > 0.02;
    let reason = format!(
        "its `aspect` is {aspect:.3} but that of the picture is {:.3}, so that everything appears stretched",
        width / height
    );
    let remedy = "remove `aspect` from the camera, or give the picture the same aspect (`render.size`, or render with --size)";
    let (code, severity) = (FindingCode::StretchedPicture, Severity::PictureWrong);
    is_stretched.then(|| StressFinding::new(code, severity, view.subject, reason, remedy))
}

pub(super) fn is_bounded(shape: &Shape) -> bool {
    !matches!(
        shape,
        Shape::Plane { .. } | Shape::Cylinder { height: None, .. }
    )
}

fn small_scene_finding(scene_facts: &SceneFacts<'_>, view: &CameraView) -> Option<StressFinding> {
    let has_plane = scene_facts
        .objects
        .iter()
        .any(|object_facts| !is_bounded(&object_facts.object.shape));
    let size = scene_facts.largest_extent();
    if size == 0.0 || has_plane {
        return None;
    }
    let pixel = view.pixel_width_at(scene_facts.bounds.centre());
    let reason = format!(
        "seen from this camera, the whole scene is only {} pixels wide",
        format_decimal(size / pixel)
    );
    let remedy =
        "move the camera nearer (`pose`, or render with --eye), or narrow its field of view";
    (size < 2.0 * pixel).then(|| {
        StressFinding::new(
            FindingCode::SceneBelowPixel,
            Severity::PictureWrong,
            view.subject,
            reason,
            remedy,
        )
    })
}

/// Returns a finding if the lens is focused in front of all that its rays hit, or behind all objects.
fn focus_finding(
    scene_facts: &SceneFacts<'_>,
    view: &CameraView,
    survey: &RaySurvey,
) -> Option<StressFinding> {
    /// Least depth in view, relative to the depth of the point that is nearest to the eye.
    const SLANT: f64 = 0.8;
    let Projection::ThinLens {
        aperture_radius,
        focus_distance,
        ..
    } = view.data.projection
    else {
        return None;
    };
    if aperture_radius == 0.0
        || scene_facts.bounds.is_empty()
        || scene_facts
            .objects
            .iter()
            .any(|object_facts| !is_bounded(&object_facts.object.shape))
    {
        return None;
    }
    let (eye, frame) = eye_and_axes(&view.data.pose);
    let (centre, half) = (
        scene_facts.bounds.centre(),
        0.5 * scene_facts.bounds.extent(),
    );
    let along = (centre - eye).dot(-frame.z_axis);
    let reach = half.dot(frame.z_axis.abs());
    let depth = |point: DVec3| (point - eye).dot(-frame.z_axis);
    let seen = survey
        .first_hits
        .values()
        .map(|hit| SLANT * depth(hit.position));
    let near = seen
        .reduce(f64::min)
        .map_or(along - reach, |seen| seen.max(along - reach));
    let far = along + reach;
    let sharpest = focus_distance.clamp(near, far);
    // The disc over which a point there is spread, at its own distance.
    let spread = 2.0 * aperture_radius * (sharpest / focus_distance - 1.0).abs();
    let pixels = spread / view.pixel_width_at(eye - frame.z_axis * sharpest);
    let reason = format!(
        "its lens is focused at {focus_distance} metres, but all objects in view lie between {} and {} metres from it: even the sharpest point is blurred over {} pixels",
        format_decimal(near),
        format_decimal(far),
        format_decimal(pixels)
    );
    let remedy = "set `focus_distance` to the distance of the object that should be sharp";
    // A point less than a pixel wide is as sharp as the picture is.
    (sharpest != focus_distance && pixels > 1.0).then(|| {
        StressFinding::new(
            FindingCode::FocusNowhere,
            Severity::PictureWrong,
            view.subject,
            reason,
            remedy,
        )
    })
}
