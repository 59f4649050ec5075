//! Cameras: within bodies, with nothing in view or nothing sharp, and where in their pictures
//! things are.

use glam::DVec3;
use raywright_bvh::Aabb;

use super::facts::{Matter, SceneFacts};
use super::finding::{Code, Finding, Severity, Subject};
use super::ray_survey::RaySurvey;
use crate::camera::{Camera as Prepared, axes};
use crate::scene::{Camera, Fit, Projection, Shape};

/// A camera with its picture.
pub(super) struct View {
    /// Its place in the scene's list, and what messages call it.
    pub index: usize,
    pub subject: Subject,
    pub data: Camera,
    pub size: [u32; 2],
    prepared: Prepared<f64>,
}

impl View {
    pub fn new(index: usize, subject: Subject, data: Camera, size: [u32; 2]) -> Self {
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
    pub fn pixel_of(&self, point: DVec3) -> Option<[f64; 2]> {
        let pixel = self.prepared.pixel_of(point)?;
        let is_inside = (0..2).all(|axis| (0.0..f64::from(self.size[axis])).contains(&pixel[axis]));
        is_inside.then_some(pixel)
    }

    fn eye(&self) -> DVec3 {
        axes(&self.data.pose).0
    }

    /// How wide a pixel is at a point.
    fn pixel_at(&self, point: DVec3) -> f64 {
        let cone = self.prepared.cone();
        cone.width + cone.spread * point.distance(self.eye())
    }

    /// Whether a ball is in view and smaller than a pixel.
    pub fn sees_within_pixel(&self, centre: DVec3, radius: f64) -> bool {
        2.0 * radius < self.pixel_at(centre) && self.pixel_of(centre).is_some()
    }
}

/// What is wrong with the cameras, by what rays of each saw.
pub(super) fn check(facts: &SceneFacts<'_>, views: &[View], seen: &[RaySurvey]) -> Vec<Finding> {
    let mut found = Vec::new();
    for (view, seen) in views.iter().zip(seen) {
        if seen.hits == 0 && !facts.objects.is_empty() {
            let why = "no ray of it meets anything: its picture shows the sky or nothing";
            let remedy = "turn it to the scene with --eye and --target, or leave it out: a scene without a camera is shown whole";
            found.push(Finding::new(
                Code::NothingSeen,
                Severity::PictureWrong,
                view.subject,
                why,
                remedy,
            ));
        }
        found.extend(within_bodies(facts, view, seen));
        found.extend(too_small(facts, view));
        found.extend(unfocused(facts, view));
        let [width, height] = view.size.map(f64::from);
        if let Some(aspect) = view.data.aspect.filter(|aspect| {
            view.data.fit == Fit::Stretch && (aspect * height / width - 1.0).abs() > 0.02
        }) {
            let why = format!(
                "its `aspect` is {aspect:.3} and the picture's {:.3}, so that everything is stretched",
                width / height
            );
            let remedy = "leave `aspect` away, or give the picture that shape with --size";
            found.push(Finding::new(
                Code::StretchedPicture,
                Severity::Harmless,
                view.subject,
                why,
                remedy,
            ));
        }
    }
    found
}

/// Bodies that a camera is in: of glass, or so that it sees nothing else.
fn within_bodies(facts: &SceneFacts<'_>, view: &View, seen: &RaySurvey) -> Vec<Finding> {
    let mut found = Vec::new();
    for (&object, sighting) in &seen.within {
        let body = facts.objects[object].subject.words(facts.scene);
        let why = format!(
            "it is within {body}, which light goes through: everything is seen from inside of it"
        );
        found.push(
            Finding::new(
                Code::CameraInBody,
                Severity::Harmless,
                view.subject,
                why,
                "move it out, unless it is meant to be in there",
            )
            .counted(sighting.count, seen.rays, "rays"),
        );
    }
    let alone = seen
        .first_within
        .iter()
        .find(|(_, sighting)| sighting.count == seen.rays);
    let others = |object: usize| {
        facts
            .objects
            .iter()
            .enumerate()
            .any(|(index, own)| index != object && is_bounded(&own.object.shape))
    };
    let encloses = |object: usize| {
        facts.objects[object].matter == Matter::Opaque && is_around(facts, object, view.eye())
    };
    if let Some((&object, sighting)) =
        alone.filter(|(object, _)| others(**object) && encloses(**object))
    {
        let body = facts.objects[object].subject.words(facts.scene);
        let why = format!(
            "it is within {body} and sees nothing but its inside, though there are other objects"
        );
        found.push(
            Finding::new(
                Code::CameraInBody,
                Severity::PictureWrong,
                view.subject,
                why,
                "move it out of there",
            )
            .counted(sighting.count, seen.rays, "rays"),
        );
    }
    found
}

/// Whether a point may be within an object, which is a body and no sheet.
fn is_around(facts: &SceneFacts<'_>, object: usize, point: DVec3) -> bool {
    let own = facts.objects[object].object;
    match &own.shape {
        Shape::Sphere { .. }
        | Shape::Box { .. }
        | Shape::Ellipsoid { .. }
        | Shape::Torus { .. }
        | Shape::Cone { .. } => true,
        Shape::Cylinder { height, caps, .. } => height.is_some() && *caps,
        Shape::Mesh(_) => facts.mesh(own).is_some_and(|(_, data)| {
            let map = facts.objects[object].map;
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

fn too_small(facts: &SceneFacts<'_>, view: &View) -> Option<Finding> {
    let has_plane = facts
        .objects
        .iter()
        .any(|own| !is_bounded(&own.object.shape));
    if facts.diagonal() == 0.0 || has_plane {
        return None;
    }
    let (size, pixel) = (facts.diagonal(), view.pixel_at(facts.bounds.centre()));
    let why = format!("all of the scene is {:.2} pixels wide in it", size / pixel);
    let remedy = "move it nearer with --eye, or narrow its field of view";
    (size < 2.0 * pixel).then(|| {
        Finding::new(
            Code::SceneBelowPixel,
            Severity::PictureWrong,
            view.subject,
            why,
            remedy,
        )
    })
}

/// A lens that is sharp before or behind everything.
fn unfocused(facts: &SceneFacts<'_>, view: &View) -> Option<Finding> {
    let Projection::ThinLens {
        aperture_radius,
        focus_distance,
        ..
    } = view.data.projection
    else {
        return None;
    };
    if aperture_radius == 0.0
        || facts.bounds.is_empty()
        || facts
            .objects
            .iter()
            .any(|own| !is_bounded(&own.object.shape))
    {
        return None;
    }
    let (eye, frame) = axes(&view.data.pose);
    let (centre, half) = (facts.bounds.centre(), 0.5 * facts.bounds.extent());
    let along = (centre - eye).dot(-frame.z_axis);
    let reach = half.dot(frame.z_axis.abs());
    let [near, far] = [along - reach, along + reach];
    let why = format!(
        "its lens is sharp at {focus_distance}, and everything lies between {near:.3} and {far:.3}"
    );
    let remedy = "set `focus_distance` to the distance of what is to be sharp";
    (focus_distance < near || focus_distance > far).then(|| {
        Finding::new(
            Code::FocusNowhere,
            Severity::Harmless,
            view.subject,
            why,
            remedy,
        )
    })
}
