//! What a check found: how bad it is, where, how often, why, and what to do.

use serde::Serialize;

pub use super::finding_code::{FindingCode, Severity};
use super::numbers::count_with_unit;

use crate::scene::{Scene, Triple};

/// What of a scene a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FindingSubject {
    /// An object by its index, those of generators after the listed ones, one for each generator.
    Object(usize),
    /// A light without size.
    Light(usize),
    /// A camera; none where the scene is framed automatically.
    Camera(Option<usize>),
    /// A material.
    Material(usize),
    /// An image.
    Image(usize),
    /// The sky.
    Sky,
    /// All of it.
    Scene,
}

impl FindingSubject {
    /// Its place in its list; zero where there is none.
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

    /// Whether another one is of the same kind: both objects, both materials.
    pub(super) fn is_same_kind(self, other: Self) -> bool {
        core::mem::discriminant(&self) == core::mem::discriminant(&other)
    }

    /// Its path in the scene's file; empty for all of it.
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

    /// What messages call it: its list with its index, which counts from 0 as all numbers do, and
    /// its name if it has one.
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

/// One thing that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct StressFinding {
    /// What kind.
    pub code: FindingCode,
    /// How bad.
    pub severity: Severity,
    /// What it is about.
    pub subject: FindingSubject,
    /// Other subjects of which the same is found, for the same cause.
    pub others: Vec<FindingSubject>,
    /// A primitive of the subject that has it, the nearest to a camera, where it is about
    /// primitives.
    pub primitive: Option<u32>,
    /// A place of it in the world, the nearest to a camera, where it has one.
    pub place: Option<Triple>,
    /// Where in a picture that is, in pixels from the top left, and the camera's place in the
    /// scene's list; none where no camera sees it.
    pub pixel: Option<([f64; 2], usize)>,
    /// How many.
    pub count: u64,
    /// Of how many; zero where that says nothing.
    pub of: u64,
    /// What is counted, in the plural.
    pub unit: &'static str,
    /// What is so of those that are counted, in the past tense and said after their number.
    pub predicate: &'static str,
    /// What is wrong, in one sentence.
    pub reason: String,
    /// What to do.
    pub remedy: String,
}

impl StressFinding {
    /// One thing of a subject.
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

    /// So many of so many, and what is so of them.
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

    /// How many, in words; none where nothing is counted.
    pub fn count_text(&self) -> Option<String> {
        if self.unit.is_empty() {
            return None;
        }
        let number = if self.of == 0 {
            count_with_unit(self.count, self.unit)
        } else {
            format!("{} of {}", self.count, count_with_unit(self.of, self.unit))
        };
        Some(format!("{number} {}", self.predicate).trim_end().to_owned())
    }

    /// Takes in another one of the same kind and cause, whose subject may be nearer.
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

    /// At a place.
    #[must_use]
    pub fn with_place(self, place: Option<Triple>) -> Self {
        Self { place, ..self }
    }

    /// Of a primitive.
    #[must_use]
    pub fn with_primitive(self, primitive: u32) -> Self {
        Self {
            primitive: Some(primitive),
            ..self
        }
    }
}

/// A check with what it sent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CheckRun {
    /// What was checked.
    pub name: &'static str,
    /// Rays, samples or triangles that it looked at.
    pub looked_at: u64,
    /// What these are.
    pub unit: &'static str,
    /// How many it would have looked at in all.
    pub planned: u64,
}

impl CheckRun {
    /// Whether time ended it.
    pub fn is_cut_short(&self) -> bool {
        self.looked_at < self.planned
    }
}
