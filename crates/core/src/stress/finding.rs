//! What a check found: how bad it is, where, how often, why, and what to do.

use serde::{Serialize, Serializer};

use crate::scene::{Scene, Triple};

/// How bad a finding is, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The picture shows something else than the file says, or nothing.
    PictureWrong,
    /// The picture is right once it has enough samples, or takes longer than it should.
    SlowOrNoisy,
    /// Nothing of it is seen.
    Harmless,
}

impl Severity {
    /// All of them, the worst first.
    pub const ALL: [Self; 3] = [Self::PictureWrong, Self::SlowOrNoisy, Self::Harmless];

    /// The words for it.
    pub const fn description(self) -> &'static str {
        match self {
            Self::PictureWrong => "picture wrong",
            Self::SlowOrNoisy => "slow or noisy",
            Self::Harmless => "harmless",
        }
    }
}

macro_rules! codes {
    ($($(#[$doc:meta])* $variant:ident = $name:literal;)*) => {
        /// What is found, by a name that stays.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum FindingCode {
            $($(#[$doc])* $variant,)*
        }

        impl FindingCode {
            /// Every kind of finding, family by family.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The name.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

codes! {
    /// Triangles without area.
    DegenerateTriangles = "degenerate-triangles";
    /// Triangles that are there again.
    DuplicateTriangles = "duplicate-triangles";
    /// Triangles next to a line.
    SliverTriangles = "sliver-triangles";
    /// Edges of a body of glass that have one triangle.
    OpenEdges = "open-edges";
    /// Edges at which more than two triangles meet.
    NonManifoldEdges = "non-manifold-edges";
    /// Neighbours of which one is turned over.
    FlippedTriangles = "flipped-triangles";
    /// A closed mesh whose outside is within.
    InsideOut = "inside-out";
    /// Vertex normals that point to the other side than the triangles.
    NormalsAgainstFaces = "normals-against-faces";
    /// Triangles that reading has left out.
    DroppedTriangles = "dropped-triangles";
    /// A texture on a mesh without coordinates for it.
    NoTextureCoordinates = "no-texture-coordinates";
    /// Triangles all of whose corners read one place of a normal map.
    FlatTextureCoordinates = "flat-texture-coordinates";
    /// A mesh that is empty once its coordinates are stored.
    LostObject = "lost-object";
    /// A shape that is empty once its coordinates are stored.
    LostShape = "lost-shape";
    /// An object whose fine detail is lost when its coordinates are stored.
    UnresolvedObject = "unresolved-object";
    /// Triangles without area once their coordinates are stored.
    LostTriangles = "lost-triangles";
    /// A scene or an object of an unlikely size.
    ExtremeScale = "extreme-scale";
    /// An object in the same place as another object.
    DuplicateObject = "duplicate-object";
    /// A body of glass that rays enter and do not leave.
    OpenBody = "open-body";
    /// Bodies of glass within each other without priorities.
    NestedGlass = "nested-glass";
    /// Two surfaces in one place, of which now one and now the other is seen.
    FlickeringSurfaces = "flickering-surfaces";
    /// Flat surfaces of two objects in one plane.
    CoplanarSurfaces = "coplanar-surfaces";
    /// Rays that pass between two triangles with a common edge.
    Leak = "leak";
    /// Rays that meet the surface that they leave.
    SelfHit = "self-hit";
    /// Rays that start beyond another surface.
    StartBeyondSurface = "start-beyond-surface";
    /// A gap that storing closes.
    ClosedGap = "closed-gap";
    /// A lamp that shines through an opaque object.
    LightThroughCover = "light-through-cover";
    /// Samples that are no numbers.
    SamplesNotFinite = "samples-not-finite";
    /// Rays that ended at the limit of surfaces that they may pass.
    RaysCutShort = "rays-cut-short";
    /// No camera ray meets anything.
    NothingSeen = "nothing-seen";
    /// What is seen is black.
    BlackPicture = "black-picture";
    /// Pixels brighter than every light.
    BrighterThanLights = "brighter-than-lights";
    /// Lamps that are met by chance alone.
    LightByChance = "light-by-chance";
    /// A lamp from which nothing arrives.
    UnreachedLight = "unreached-light";
    /// A lamp that shines past everything.
    LightMissesScene = "light-misses-scene";
    /// A lamp smaller than a pixel.
    LampBelowPixel = "lamp-below-pixel";
    /// A light that is there again.
    DuplicateLight = "duplicate-light";
    /// A sky with points far brighter than the rest.
    SkySpikes = "sky-spikes";
    /// A material that sends back more light than it gets.
    EnergyMade = "energy-made";
    /// A material with values that are no numbers.
    ValuesNotNumbers = "values-not-numbers";
    /// A material with values outside their range.
    ValuesOutOfRange = "values-out-of-range";
    /// An object that is nowhere there.
    InvisibleObject = "invisible-object";
    /// Glass through which no path has segments to come.
    DepthBelowGlass = "depth-below-glass";
    /// A body that absorbs everything within a hair, or nothing within its size.
    AbsorptionOutOfScale = "absorption-out-of-scale";
    /// An image of one colour.
    UniformImage = "uniform-image";
    /// An image with numbers that light can't have.
    ImageNotLight = "image-not-light";
    /// An image that could not be read.
    MissingImage = "missing-image";
    /// An image of numbers that is read as colours.
    DataReadAsColour = "data-read-as-colour";
    /// A normal map that holds no normals.
    NotANormalMap = "not-a-normal-map";
    /// A camera within a body.
    CameraInBody = "camera-in-body";
    /// A lens that is sharp where nothing is.
    FocusNowhere = "focus-nowhere";
    /// A scene that is smaller than a pixel.
    SceneBelowPixel = "scene-below-pixel";
    /// A picture that is wider or narrower than the camera's.
    StretchedPicture = "stretched-picture";
}

impl Serialize for FindingCode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

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

/// A number of what is named in the plural.
pub fn count_with_unit(count: u64, unit: &str) -> String {
    let unit = match count {
        1 if unit == "copies" => "copy",
        1 if unit == "glass bodies" => "glass body",
        1 => unit.strip_suffix('s').unwrap_or(unit),
        _ => unit,
    };
    format!("{count} {unit}")
}

/// A number with four digits, written out where it is of a usual size.
pub fn format_decimal(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e6).contains(&size) {
        let short = format!("{x:.3e}");
        let (digits, power) = short.split_once('e').unwrap_or((&short, "0"));
        return format!("{}e{power}", trim_zeros(digits));
    }
    let places = (3.0 - size.log10().floor()).max(0.0) as usize;
    trim_zeros(&format!("{x:.places$}")).to_owned()
}

/// A number of metres in words.
pub(super) fn metres(x: f64) -> String {
    with_metres(&format_decimal(x))
}

/// A number that is written already, of metres.
pub(super) fn with_metres(digits: &str) -> String {
    match digits {
        "1" => "1 metre".to_owned(),
        _ => format!("{digits} metres"),
    }
}

fn trim_zeros(digits: &str) -> &str {
    if digits.contains('.') {
        digits.trim_end_matches('0').trim_end_matches('.')
    } else {
        digits
    }
}

/// A number with one digit, rounded up: a distance from which on something holds.
pub(super) fn round_up_to_digit(x: f64) -> String {
    let step = libm::pow(10.0, x.log10().floor());
    format_decimal((x / step).ceil() * step)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: numbers have four digits and no zeros behind them, and powers of ten where they
    /// are very small or large.
    #[test]
    fn numbers_are_short() {
        let of = [0.0, 2.0, 0.012345, -1234.56, 123456.7, 1e-8, 1.5e9].map(format_decimal);
        assert_eq!(
            of,
            ["0", "2", "0.01235", "-1235", "123457", "1e-8", "1.5e9"]
        );
        assert_eq!(
            [1.2e-6, 3.0, 171.0].map(round_up_to_digit),
            ["2e-6", "3", "200"]
        );
        assert_eq!([metres(1.0), metres(2.5)], ["1 metre", "2.5 metres"]);
        assert_eq!(
            [count_with_unit(1, "rays"), count_with_unit(2, "rays")],
            ["1 ray", "2 rays"]
        );
    }
}
