//! Cameras: within bodies, with nothing in view or nothing sharp, and where in their pictures
//! things are.

use glam::DVec3;
use raywright_bvh::{Aabb, Ray, Real};

use super::facts::{SceneFacts, SurfaceKind};
use super::finding::{FindingCode, FindingSubject, Severity, StressFinding};
use super::numbers::format_decimal;
use super::ray_survey::RaySurvey;
use crate::camera::{PreparedCamera as Prepared, eye_and_axes};
use crate::scene::{AspectFit, Camera, Projection, Shape};

/// A camera with its picture.
pub(super) struct CameraView {
    /// Its place in the scene's list, and what messages call it.
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

    /// Where a point is in its picture.
    pub fn project_point(&self, point: DVec3) -> Option<[f64; 2]> {
        let pixel = self.prepared.project_to_pixel(point)?;
        let is_inside = (0..2).all(|axis| (0.0..f64::from(self.size[axis])).contains(&pixel[axis]));
        is_inside.then_some(pixel)
    }

    /// The ray through the middle of the lens to a place of its picture.
    pub fn ray_through_pixel(&self, [x, y]: [f64; 2]) -> Ray<f64> {
        self.prepared.generate_ray(x, y, [0.5; 2])
    }

    /// From its eye, in metres.
    pub fn distance_from_eye(&self, point: DVec3) -> f64 {
        point.distance(self.eye())
    }

    /// A place on the way to a point that it sees, a hundredth of the way before it.
    pub fn in_front_of(&self, point: DVec3) -> DVec3 {
        point.lerp(self.eye(), 0.01)
    }

    /// How far in front of its eye its rays start in a scene of these bounds, in metres.
    pub fn skipped_distance<R: Real>(&self, bounds: &Aabb) -> f64 {
        let prepared = Prepared::<R>::for_scene_bounds(&self.data, self.size, bounds);
        prepared.skipped_distance().to_f64()
    }

    pub fn eye(&self) -> DVec3 {
        eye_and_axes(&self.data.pose).0
    }

    /// How wide a pixel is at a point.
    fn pixel_width_at(&self, point: DVec3) -> f64 {
        let cone = self.prepared.ray_cone();
        cone.width + cone.spread * point.distance(self.eye())
    }

    /// Whether a ball is in view and smaller than a pixel.
    pub fn is_sphere_below_pixel(&self, centre: DVec3, radius: f64) -> bool {
        2.0 * radius < self.pixel_width_at(centre) && self.project_point(centre).is_some()
    }
}

/// How near a place is to the cameras: what is in view of one before what is not, then by distance.
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

/// Of things in places the one that is nearest to a camera.
pub(super) fn item_nearest_to_camera<T>(
    views: &[CameraView],
    places: impl Iterator<Item = (T, DVec3)>,
) -> Option<(T, DVec3)> {
    places
        .map(|(thing, position)| (view_distance_key(views, position), (thing, position)))
        .min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
        .map(|(_, nearest)| nearest)
}

/// Whether a corner or the middle of a box is in view.
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

/// What is wrong with the cameras, by what rays of each saw.
pub(super) fn check_cameras(
    scene_facts: &SceneFacts<'_>,
    views: &[CameraView],
    surveys: &[RaySurvey],
) -> Vec<StressFinding> {
    let mut findings = Vec::new();
    for (view, survey) in views.iter().zip(surveys) {
        if survey.hits == 0 && !scene_facts.is_empty() {
            let reason = "no ray of it meets anything: its picture shows the sky or nothing";
            let remedy = match view.subject {
                FindingSubject::Camera(None) => {
                    "look whether objects are hidden, or nothing is left of them"
                }
                _ => {
                    "turn it to the scene (`pose`, or render with --eye and --target), or leave it out: a scene without a camera is shown whole"
                }
            };
            findings.push(StressFinding::new(
                FindingCode::NothingSeen,
                Severity::PictureWrong,
                view.subject,
                reason,
                remedy,
            ));
        }
        findings.extend(cameras_in_bodies(scene_facts, view, survey));
        findings.extend(small_scene_finding(scene_facts, view));
        findings.extend(focus_finding(scene_facts, view));
        findings.extend(aspect_finding(view));
    }
    findings
}

/// A picture of another shape than the camera's, over which it is stretched.
fn aspect_finding(view: &CameraView) -> Option<StressFinding> {
    let [width, height] = view.size.map(f64::from);
    let aspect = view.data.aspect?;
    let is_stretched =
        view.data.fit == AspectFit::Stretch && (aspect * height / width - 1.0).abs() > 0.02;
    let reason = format!(
        "its `aspect` is {aspect:.3} and the picture's {:.3}, so that everything is stretched",
        width / height
    );
    let remedy =
        "remove `aspect`, or give the picture that shape with `render.size`, or render with --size";
    let (code, severity) = (FindingCode::StretchedPicture, Severity::PictureWrong);
    is_stretched.then(|| StressFinding::new(code, severity, view.subject, reason, remedy))
}

/// Bodies that a camera is in: of glass, or so that it sees nothing else.
fn cameras_in_bodies(
    scene_facts: &SceneFacts<'_>,
    view: &CameraView,
    survey: &RaySurvey,
) -> Vec<StressFinding> {
    let mut findings = Vec::new();
    for (&object, sighting) in &survey.within {
        let body = scene_facts.objects[object]
            .subject
            .display_name(scene_facts.scene);
        let reason = format!(
            "it is within {body}, which light goes through: everything is seen from inside of it"
        );
        findings.push(
            StressFinding::new(
                FindingCode::CameraInBody,
                Severity::Harmless,
                view.subject,
                reason,
                "move it out, unless it is meant to be in there",
            )
            .with_count(
                sighting.count,
                survey.rays,
                "rays",
                "left it without entering it",
            ),
        );
    }
    let alone = survey
        .first_within
        .iter()
        .find(|(_, sighting)| sighting.count == survey.rays);
    let others = |object: usize| {
        scene_facts
            .objects
            .iter()
            .enumerate()
            .any(|(index, object_facts)| index != object && is_bounded(&object_facts.object.shape))
    };
    let encloses = |object: usize| {
        scene_facts.objects[object].matter == SurfaceKind::Opaque
            && may_contain_point(scene_facts, object, view.eye())
    };
    if let Some((&object, sighting)) =
        alone.filter(|(object, _)| others(**object) && encloses(**object))
    {
        let body = scene_facts.objects[object]
            .subject
            .display_name(scene_facts.scene);
        let reason = format!(
            "it is within {body} and sees nothing but its inside, though there are other objects"
        );
        findings.push(
            StressFinding::new(
                FindingCode::CameraInBody,
                Severity::PictureWrong,
                view.subject,
                reason,
                "move it out of there",
            )
            .with_count(sighting.count, survey.rays, "rays", "met its inside first"),
        );
    }
    findings
}

/// Whether a point may be within an object, which is a body and no sheet.
fn may_contain_point(scene_facts: &SceneFacts<'_>, object: usize, point: DVec3) -> bool {
    let own = scene_facts.objects[object].object;
    match &own.shape {
        Shape::Sphere { .. }
        | Shape::Box { .. }
        | Shape::Ellipsoid { .. }
        | Shape::Torus { .. }
        | Shape::Cone { .. } => true,
        Shape::Cylinder { height, caps, .. } => height.is_some() && *caps,
        Shape::Mesh(_) => scene_facts.mesh_of_object(own).is_some_and(|(_, data)| {
            let map = scene_facts.objects[object].map;
            let bounds = Aabb::from_points(
                data.positions
                    .iter()
                    .map(|position| map.transform_point3(position)),
            );
            point.cmpgt(bounds.min).all() && point.cmplt(bounds.max).all()
        }),
        _ => false,
    }
}

fn is_bounded(shape: &Shape) -> bool {
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
    let reason = format!("all of the scene is {:.2} pixels wide in it", size / pixel);
    let remedy = "move it nearer (`pose`, or render with --eye), or narrow its field of view";
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

/// A lens that is sharp before or behind everything.
fn focus_finding(scene_facts: &SceneFacts<'_>, view: &CameraView) -> Option<StressFinding> {
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
    let [near, far] = [along - reach, along + reach];
    let sharpest = focus_distance.clamp(near, far);
    // The disc over which a point there is spread, at its own distance.
    let spread = 2.0 * aperture_radius * (sharpest / focus_distance - 1.0).abs();
    let pixels = spread / view.pixel_width_at(eye - frame.z_axis * sharpest);
    let reason = format!(
        "its lens is sharp at {focus_distance} metres, and everything lies between {} and {} metres: the sharpest point there is {} pixels wide",
        format_decimal(near),
        format_decimal(far),
        format_decimal(pixels)
    );
    let remedy = "set `focus_distance` to the distance of what is to be sharp";
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
