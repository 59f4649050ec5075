//! Findings about cameras: without anything in view, out of focus, stretched, inside a body, or
//! behind a body that hides everything else.

use super::*;
use crate::camera::{PreparedCamera, eye_and_axes};
use crate::framing::{FIELD_OF_VIEW, Silhouette};
use crate::scene::{AspectFit, Camera, Projection};

/// Share of a camera's rays that begin inside a body from which on a lens in the body shows.
const SHARE: f64 = 0.002;
/// Greatest difference of the aspects of a camera and its picture, relative to either.
const ASPECT: f64 = 0.02;
/// Least depth in view, relative to the depth of the point that is nearest to the eye.
const SLANT: f64 = 0.8;
/// A point counts as behind a body if it is further behind it than this share of its distance.
const NEAR: f64 = 1e-3;

impl SceneFacts<'_> {
    /// Returns the findings about the cameras. `surveys` holds the rays of each camera.
    pub fn check_cameras(&self, surveys: &[RaySurvey]) -> Vec<Fault> {
        let of_view = |(view, survey)| {
            let check = CameraCheck {
                facts: self,
                view,
                survey,
            };
            let enclosing = check.enclosing_body_finding();
            let mut findings = match enclosing.is_some() {
                // What is behind an opaque body is not seen.
                true => Vec::new(),
                false => check.glass_findings(),
            };
            findings.extend(enclosing);
            findings.extend(check.nothing_seen_finding());
            findings.extend(check.small_scene_finding());
            findings.extend(check.focus_finding());
            findings.extend(check.aspect_finding());
            findings.extend(check.lens_findings());
            findings.extend(check.hiding_body_finding());
            findings
        };
        self.views.iter().zip(surveys).flat_map(of_view).collect()
    }
}

/// Checks of a camera by its rays.
struct CameraCheck<'a> {
    facts: &'a SceneFacts<'a>,
    view: &'a CameraView,
    survey: &'a RaySurvey,
}

impl CameraCheck<'_> {
    fn wrong(
        &self,
        kind: FaultKind,
        reason: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Fault {
        kind.fault(self.view.subject, reason, remedy)
    }

    /// Returns whether the scene has objects without end.
    fn has_endless_objects(&self) -> bool {
        self.facts.objects.iter().any(ObjectFacts::is_endless)
    }

    /// Returns the finding that the camera's rays hit nothing. Rays may pass through surfaces that
    /// are hidden from the camera's side.
    fn nothing_seen_finding(&self) -> Option<Fault> {
        let (facts, survey) = (self.facts, self.survey);
        if survey.hits > 0 || facts.objects.is_empty() {
            return None;
        }
        let backs = survey.of(|event| match event {
            RayEvent::HiddenBack(object) => Some(object),
            _ => None,
        });
        if let Some((object, at)) = backs.into_iter().max_by_key(|(_, at)| at.count) {
            let name = facts.object_name(object);
            let finding = self.wrong(
                NothingSeen,
                format!("no ray of this camera hits a visible side: the camera looks at {name} from the side that its `side` hides"),
                format!("set `side = \"both\"` for {name} (in glTF: `doubleSided`), or move the camera to its other side (`pose`, or render with --eye)"),
            );
            let finding = finding.with_rays(at.count, survey.rays, "pass through its hidden side");
            return Some(finding.with_place(at.position));
        }
        let remedy = match self.view.subject {
            Subject::Camera(None) => {
                "check that the scene has objects that are visible (`opacity`, `side`) and not scaled to nothing"
            }
            _ => {
                "turn the camera to the scene (`pose`, or render with --eye and --target), or remove the camera from the file: without a camera, the picture shows the whole scene"
            }
        };
        let reason =
            "no ray of this camera hits an object: its picture shows only the sky or nothing";
        Some(self.wrong(NothingSeen, reason, remedy))
    }

    fn small_scene_finding(&self) -> Option<Fault> {
        let size = self.facts.largest_extent();
        let pixel = self.view.pixel_width_at(self.facts.bounds.centre());
        let is_small = size > 0.0 && size < 2.0 * pixel && !self.has_endless_objects();
        let width = format_decimal(size / pixel);
        let reason = format!("seen from this camera, the whole scene is only {width} pixels wide");
        let remedy =
            "move the camera nearer (`pose`, or render with --eye), or narrow its field of view";
        is_small.then(|| self.wrong(SceneBelowPixel, reason, remedy))
    }

    /// Returns a finding if the lens is focused in front of all that its rays hit, or behind all
    /// objects.
    fn focus_finding(&self) -> Option<Fault> {
        let Projection::ThinLens {
            aperture_radius,
            focus_distance,
            ..
        } = self.view.data.projection
        else {
            return None;
        };
        let bounds = &self.facts.bounds;
        if aperture_radius == 0.0 || bounds.is_empty() || self.has_endless_objects() {
            return None;
        }
        let (eye, frame) = eye_and_axes(&self.view.data.pose);
        let depth = |point: DVec3| (point - eye).dot(-frame.z_axis);
        let along = depth(bounds.centre());
        let reach = 0.5 * bounds.extent().dot(frame.z_axis.abs());
        let seen = self.survey.first_hits().into_iter();
        let seen = seen
            .map(|(_, at)| SLANT * depth(at.position))
            .reduce(f64::min);
        let near = seen.map_or(along - reach, |seen| seen.max(along - reach));
        let far = along + reach;
        let sharpest = focus_distance.clamp(near, far);
        // The disc over which a point there is spread, at its own distance.
        let spread = 2.0 * aperture_radius * (sharpest / focus_distance - 1.0).abs();
        let pixels = spread / self.view.pixel_width_at(eye - frame.z_axis * sharpest);
        let [from, to, blur] = [near, far, pixels].map(format_decimal);
        let reason = format!(
            "its lens is focused at {focus_distance} metres, but all objects in view lie between {from} and {to} metres from it: even the sharpest point is blurred over {blur} pixels"
        );
        let remedy = "set `focus_distance` to the distance of the object that should be sharp";
        // A point less than a pixel wide is as sharp as the picture is.
        (sharpest != focus_distance && pixels > 1.0)
            .then(|| self.wrong(FocusNowhere, reason, remedy))
    }

    /// Returns a finding if the picture's aspect ratio differs from the camera's and the picture is
    /// stretched to fit.
    fn aspect_finding(&self) -> Option<Fault> {
        let [width, height] = self.view.size.map(f64::from);
        let aspect = self.view.data.aspect?;
        let is_stretched = self.view.data.fit == AspectFit::Stretch
            && (aspect * height / width - 1.0).abs() > ASPECT;
        let reason = format!(
            "its `aspect` is {aspect:.3} but that of the picture is {:.3}, so that everything appears stretched",
            width / height
        );
        let remedy = "remove `aspect` from the camera, or give the picture the same aspect (`render.size`, or render with --size)";
        is_stretched.then(|| self.wrong(StretchedPicture, reason, remedy))
    }

    /// Returns the findings about bodies of glass around the camera.
    fn glass_findings(&self) -> Vec<Fault> {
        let around = self.survey.of(|event| match event {
            RayEvent::AroundCamera(object) => Some(object),
            _ => None,
        });
        let finding = |(object, at): (usize, Sighting)| {
            let body = self.facts.object_name(object);
            let finding = self.wrong(
                CameraInBody,
                format!("it is inside {body}, which is transparent: everything is seen from inside that body"),
                "move the camera out of the body, unless it should be inside",
            );
            let predicate = "leave the body without entering it";
            let finding = finding.with_severity(Harmless);
            finding.with_rays(at.count, self.survey.rays, predicate)
        };
        around.into_iter().map(finding).collect()
    }

    /// Returns the bodies whose inside rays hit first.
    fn insides(&self) -> Vec<(usize, Sighting)> {
        self.survey.of(|event| match event {
            RayEvent::FirstHitInside(object) => Some(object),
            _ => None,
        })
    }

    /// Finds an opaque body around the camera whose inside fills the whole picture, although the
    /// scene has other objects.
    fn enclosing_body_finding(&self) -> Option<Fault> {
        let (facts, survey) = (self.facts, self.survey);
        // Below an endless floor, rays beyond the horizon hit nothing.
        let fills_view = |(object, at): &(usize, Sighting)| {
            at.count == survey.rays
                || facts.objects[*object].is_endless() && at.count == survey.hits
        };
        let (object, at) = self.insides().into_iter().find(fills_view)?;
        let body = &facts.objects[object];
        // A lamp around the camera may be the sky over an endless ground.
        let is_hidden = |other: &&ObjectFacts<'_>| match body.is_endless() {
            false => !body.emits_light() || !other.is_endless(),
            true => {
                let centre = other.centre();
                centre.is_some_and(|centre| hides_point(body, self.view.eye(), centre))
            }
        };
        let mut others = facts.objects.iter().filter(|other| other.index != object);
        others.find(is_hidden)?;
        let has_inside = facts.is_closed_body(body) || body.is_endless();
        if !body.is_opaque() || !has_inside {
            return None;
        }
        let name = facts.object_name(object);
        let (reason, remedy) = match body.object.shape {
            Shape::Plane { .. } => (
                format!(
                    "it is behind {name}, on the side away from its `normal`, and sees no other object"
                ),
                "move the camera to the other side of the plane (`pose`, or render with --eye)",
            ),
            _ => (
                format!(
                    "it is inside {name} and sees nothing but that body's inside, although the scene has other objects"
                ),
                "move the camera out of the body (`pose`, or render with --eye)",
            ),
        };
        let finding = self.wrong(CameraInBody, reason, remedy);
        Some(finding.with_rays(at.count, survey.rays, "hit its inside first"))
    }

    /// Finds opaque boxes and balls into which a lens reaches, with the eye outside.
    fn lens_findings(&self) -> Vec<Fault> {
        let Projection::ThinLens {
            aperture_radius, ..
        } = self.view.data.projection
        else {
            return Vec::new();
        };
        let mut bodies = self.insides();
        bodies.retain(|(object, at)| {
            let body = &self.facts.objects[*object];
            let is_seen = at.count as f64 > SHARE * self.survey.rays as f64;
            let is_shown = matches!(body.object.side, SideRule::Both | SideRule::Outside);
            let is_shape = matches!(body.object.shape, Shape::Box { .. } | Shape::Sphere { .. });
            let eye = self.view.eye();
            let is_around = body
                .bounds
                .is_none_or(|b| b.min.cmplt(eye).all() && b.max.cmpgt(eye).all());
            is_seen && is_shape && is_shown && body.is_opaque() && !is_around
        });
        let finding = |(object, at): (usize, Sighting)| {
            let body = self.facts.object_name(object);
            let finding = self.wrong(
                CameraInBody,
                format!("its lens, {aperture_radius} metres in radius, reaches into {body}, which is opaque and lies as a veil over the picture"),
                "move the camera away from the body (`pose`, or render with --eye), or set a smaller `aperture_radius`",
            );
            finding.with_rays(at.count, self.survey.rays, "begin inside that body")
        };
        bodies.into_iter().map(finding).collect()
    }

    /// Finds a box that hides all objects at which the camera is aimed.
    fn hiding_body_finding(&self) -> Option<Fault> {
        let hit = self.survey.first_hits();
        let &[(object, at)] = hit.as_slice() else {
            return None;
        };
        let own = &self.facts.objects[object];
        let is_hidden = |other: &ObjectFacts<'_>| {
            other.centre().is_some_and(|centre| {
                let is_in_view = self.view.project_point(centre).is_some();
                is_in_view && hides_point(own, self.view.eye(), centre)
            })
        };
        let others = self.facts.objects.iter();
        let others = others.filter(|other| other.index != object && !other.emits_light());
        let mut hidden = others.map(is_hidden).peekable();
        let is_inside = self.survey.count(RayEvent::FirstHitInside(object)) > 0;
        let is_box = matches!(own.object.shape, Shape::Box { .. }) && own.is_opaque();
        if !is_box || is_inside || hidden.peek().is_none() || !hidden.all(|hidden| hidden) {
            return None;
        }
        let name = self.facts.object_name(object);
        let finding = self.wrong(
            NothingSeen,
            format!("{name} hides all other objects, at which this camera is aimed"),
            format!("move the camera to the other side of {name} (`pose`, or render with --eye), or remove {name}"),
        );
        let predicate = "hit that object, and none another one";
        Some(finding.with_rays(at.count, self.survey.rays, predicate))
    }
}

/// Returns whether a point is on the other side of a plane or a box than the eye.
fn hides_point(body: &ObjectFacts<'_>, eye: DVec3, point: DVec3) -> bool {
    let to_object = body.object_to_world.inverse();
    let [eye, point] = [eye, point].map(|p| to_object.transform_point3(p));
    match body.object.shape {
        Shape::Plane { point: own, normal } => {
            let normal = DVec3::from(normal).normalize_or_zero();
            let [from, to] = [eye, point].map(|p| (p - DVec3::from(own)).dot(normal));
            from * to < 0.0 && to.abs() > NEAR * from.abs()
        }
        Shape::Box { min, max } => {
            let [low, high] = [min, max].map(|corner| (DVec3::from(corner) - eye) / (point - eye));
            let enters = low.min(high).max_element();
            let leaves = low.max(high).min_element();
            enters < leaves && enters > 0.0 && leaves < 1.0 - NEAR
        }
        _ => false,
    }
}

// Cameras with the size of their picture, and the pixels at which they show a point.

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
