//! A finding: the fault, its severity, place, number, reason and remedy.

use serde::Serialize;

pub use super::finding_code::{FindingCode, Severity};
use super::numbers::count_with_unit;

use crate::scene::{Scene, Triple};

/// The part of a scene that a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FindingSubject {
    /// An object by its index. Generators follow the listed objects, with one index each.
    Object(usize),
    /// A delta light (point, spot or directional), by its index.
    Light(usize),
    /// A camera by its index; `None` for a scene without cameras, which is framed automatically.
    Camera(Option<usize>),
    /// A material, by its index.
    Material(usize),
    /// An image, by its index.
    Image(usize),
    /// The sky.
    Sky,
    /// The scene as a whole.
    Scene,
}

impl FindingSubject {
    /// Returns the index in the subject's list; 0 for subjects without a list.
    pub(super) fn list_index(self) -> usize {
        match self {
            Self::Object(index)
            | Self::Light(index)
            | Self::Material(index)
            | Self::Image(index) => index,
            Self::Camera(index) => index.unwrap_or(0),
            Self::Sky | Self::Scene => 0,
        }
    }

    /// Returns whether two subjects are of the same kind, such as two objects or two materials.
    pub(super) fn is_same_kind(self, other: Self) -> bool {
        core::mem::discriminant(&self) == core::mem::discriminant(&other)
    }

    /// Returns the path in the scene file. Empty for the whole scene and an automatically framed
    /// camera.
    pub fn scene_path(self, scene: &Scene) -> String {
        let listed = scene.objects.len();
        match self {
            Self::Object(index) if index < listed => format!("objects[{index}]"),
            Self::Object(index) => format!("generators[{}].object", index - listed),
            Self::Light(index) => format!("lights[{index}]"),
            Self::Camera(Some(index)) => format!("cameras[{index}]"),
            Self::Material(index) => format!("materials[{index}]"),
            Self::Image(index) => format!("images[{index}]"),
            Self::Sky => "sky".to_owned(),
            Self::Camera(None) | Self::Scene => String::new(),
        }
    }

    /// Returns the name in messages: the list with the index (from 0), and the subject's own name
    /// if it has one.
    pub fn display_name(self, scene: &Scene) -> String {
        let called = |kind: &str, name: Option<&String>, index: usize| match name {
            Some(name) if !name.is_empty() => format!("{kind}s[{index}] `{name}`"),
            _ => format!("{kind}s[{index}]"),
        };
        let listed = scene.objects.len();
        match self {
            Self::Object(index) if index < listed => {
                called("object", scene.objects.get(index).map(|o| &o.name), index)
            }
            Self::Object(index) => called("generator", None, index - listed),
            Self::Light(index) => called(
                "light",
                scene.lights.get(index).map(|light| &light.name),
                index,
            ),
            Self::Camera(Some(index)) => called(
                "camera",
                scene.cameras.get(index).map(|camera| &camera.name),
                index,
            ),
            Self::Camera(None) => "the camera".to_owned(),
            Self::Material(index) => called(
                "material",
                scene.materials.get(index).map(|material| &material.name),
                index,
            ),
            Self::Image(index) => called(
                "image",
                scene.images.get(index).map(|image| &image.name),
                index,
            ),
            Self::Sky => "the sky".to_owned(),
            Self::Scene => "the scene".to_owned(),
        }
    }
}

/// A fault that a check found, at one or more places.
#[derive(Clone, Debug, PartialEq)]
pub struct StressFinding {
    /// Kind of fault.
    pub code: FindingCode,
    /// Severity of the fault.
    pub severity: Severity,
    /// Part of the scene with the fault.
    pub subject: FindingSubject,
    /// Other subjects with the same fault for the same cause.
    pub others: Vec<FindingSubject>,
    /// Index of a primitive with the fault, such as a triangle of the subject: the nearest one to a
    /// camera. `None` if the finding is not about primitives.
    pub primitive: Option<u32>,
    /// World position of the fault in metres, the nearest one to a camera. `None` without a
    /// position.
    pub place: Option<Triple>,
    /// Pixel position of the fault in a picture, from the top left, and the index of the camera.
    /// `None` if no camera sees it.
    pub pixel: Option<([f64; 2], usize)>,
    /// Number of items with the fault, in units of `unit`.
    pub count: u64,
    /// Number of items that were examined; 0 if that number says nothing.
    pub of: u64,
    /// Name of the counted items, in the plural. Empty if nothing is counted.
    pub unit: &'static str,
    /// Words that follow the count and say what holds for the counted items.
    pub predicate: &'static str,
    /// The fault and its effect, in one sentence.
    pub reason: String,
    /// The remedy.
    pub remedy: String,
}

impl StressFinding {
    /// Creates a finding about a single fault without a position.
    pub fn new(
        code: FindingCode,
        severity: Severity,
        subject: FindingSubject,
        reason: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        let (reason, remedy) = (reason.into(), remedy.into());
        Self {
            code,
            severity,
            subject,
            others: Vec::new(),
            primitive: None,
            place: None,
            pixel: None,
            count: 1,
            of: 0,
            unit: "",
            predicate: "",
            reason,
            remedy,
        }
    }

    /// Sets the count: `count` of `total` items have the fault that `predicate` describes.
    #[must_use]
    pub fn with_count(
        self,
        count: u64,
        total: u64,
        unit: &'static str,
        predicate: &'static str,
    ) -> Self {
        Self {
            count,
            of: total,
            unit,
            predicate,
            ..self
        }
    }

    /// Returns the count as a phrase, or `None` if nothing is counted.
    pub fn count_text(&self) -> Option<String> {
        if self.unit.is_empty() {
            return None;
        }
        let number = if self.of == 0 {
            count_with_unit(self.count, self.unit)
        } else {
            format!("{} of {}", self.count, count_with_unit(self.of, self.unit))
        };
        let predicate = match self.predicate.strip_prefix("are ") {
            Some(rest) if self.count == 1 => format!("is {rest}"),
            _ => self.predicate.to_owned(),
        };
        Some(format!("{number} {predicate}").trim_end().to_owned())
    }

    /// Merges a finding with the same code and cause. The subject whose position is nearer to a
    /// camera becomes the main subject. `nearness` is the sort key of a position; smaller is
    /// nearer.
    pub(super) fn merge<K: PartialOrd>(&mut self, other: Self, nearness: impl Fn(Triple) -> K) {
        let subject = other.subject;
        if self.others.last() == Some(&subject) {
            return;
        }
        self.count += other.count;
        self.of += other.of;
        let is_nearer = match (self.place, other.place) {
            (Some(own), Some(others)) => nearness(others) < nearness(own),
            (own, others) => own.is_none() && others.is_some(),
        };
        if is_nearer {
            self.others.push(self.subject);
            (self.subject, self.primitive) = (subject, other.primitive);
            (self.place, self.pixel) = (other.place, other.pixel);
        } else {
            self.others.push(subject);
        }
    }

    /// Sets the world position.
    #[must_use]
    pub fn with_place(self, place: Option<Triple>) -> Self {
        Self { place, ..self }
    }

    /// Sets the primitive.
    #[must_use]
    pub fn with_primitive(self, primitive: u32) -> Self {
        Self {
            primitive: Some(primitive),
            ..self
        }
    }
}

/// Work of a check, planned and done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CheckRun {
    /// Name of the check.
    pub name: &'static str,
    /// Number of rays, samples or materials that were examined.
    pub looked_at: u64,
    /// Name of the examined items, in the plural.
    pub unit: &'static str,
    /// Number of items to examine in total.
    pub planned: u64,
}

impl CheckRun {
    /// Returns whether fewer items than planned were examined.
    pub fn is_cut_short(&self) -> bool {
        self.looked_at < self.planned
    }
}
