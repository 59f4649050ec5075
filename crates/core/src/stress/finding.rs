//! A finding: the kind of fault, its severity, place, number, reason and remedy.

use glam::DVec3;
use serde::{Serialize, Serializer};

use crate::scene::{Scene, Triple};

/// Severity of a finding, worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The picture differs from what the file describes, or shows nothing.
    PictureWrong,
    /// The picture is right with enough samples, but needs more time or samples than it should.
    SlowOrNoisy,
    /// The fault is not visible.
    Harmless,
}

impl Severity {
    /// All severities, worst first.
    pub const ALL: [Self; 3] = [Self::PictureWrong, Self::SlowOrNoisy, Self::Harmless];

    /// Returns the words for the severity.
    pub const fn description(self) -> &'static str {
        match self {
            Self::PictureWrong => "picture wrong",
            Self::SlowOrNoisy => "slow or noisy",
            Self::Harmless => "harmless",
        }
    }

    /// Returns the severity of a fault that shows in the picture if a camera sees it.
    pub(super) const fn if_seen(is_seen: bool) -> Self {
        match is_seen {
            true => Self::PictureWrong,
            false => Self::Harmless,
        }
    }
}

/// What two findings must have in common for the second to follow from the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scope {
    /// Nothing: the second follows anywhere in the scene.
    Scene,
    /// The subject.
    Subject,
    /// An image: the first finding is about it, and the material or the sky of the second reads it.
    Image,
}

macro_rules! codes {
    ($($(#[$doc:meta])* $variant:ident = $name:literal $(explains $scope:ident [$($code:ident),*])*;)*) => {
        /// Kind of finding. Its name stays the same between versions.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum FindingCode {
            $($(#[$doc])* $variant,)*
        }

        impl FindingCode {
            /// All kinds of finding, ordered by subject.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Returns the name, as used in the text, the JSON and the documentation.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// Returns the kinds that follow from this one, and within which scope.
            pub(super) const fn explains(self) -> &'static [(Scope, &'static [Self])] {
                match self {
                    $(Self::$variant => &[$((Scope::$scope, &[$(Self::$code),*])),*],)*
                }
            }
        }
    };
}

codes! {
    /// Triangles without area.
    DegenerateTriangles = "degenerate-triangles" explains Scene [NothingSeen];
    /// Vertices far away from the rest of their mesh.
    StrayVertices = "stray-vertices";
    /// Triangles that repeat another triangle.
    DuplicateTriangles = "duplicate-triangles";
    /// Edges with a single triangle: in a glass body, or around a missing triangle of an otherwise
    /// closed opaque surface.
    OpenEdges = "open-edges" explains Subject [DepthBelowGlass];
    /// Edges with more than two triangles.
    NonManifoldEdges = "non-manifold-edges";
    /// Triangles whose orientation differs from their neighbours'.
    FlippedTriangles = "flipped-triangles" explains Subject [DepthBelowGlass];
    /// A closed surface that is oriented inwards.
    InsideOut = "inside-out" explains Subject [DepthBelowGlass];
    /// Vertex normals that point to the opposite side of their triangle.
    NormalsAgainstFaces = "normals-against-faces";
    /// A texture on a mesh without texture coordinates for it.
    NoTextureCoordinates = "no-texture-coordinates";
    /// Triangles with a normal map whose texture coordinates span no area.
    FlatTextureCoordinates = "flat-texture-coordinates";
    /// A mesh that degenerates to a point when its coordinates are rounded for storage.
    LostObject = "lost-object" explains Scene [SceneBelowPixel];
    /// A shape that degenerates when its coordinates are rounded for storage.
    LostShape = "lost-shape";
    /// An object that loses fine detail when its coordinates are rounded for storage.
    UnresolvedObject = "unresolved-object" explains Subject [LostTriangles];
    /// Triangles that lose their area when their coordinates are rounded for storage.
    LostTriangles = "lost-triangles";
    /// An object in the same place as another object.
    DuplicateObject = "duplicate-object";
    /// A glass body that rays enter without leaving, or leave without entering.
    OpenBody = "open-body" explains Subject [DepthBelowGlass];
    /// Glass bodies inside each other without priorities.
    NestedGlass = "nested-glass" explains Scene [DepthBelowGlass] explains Subject [OpenBody, ClosedGap];
    /// Two surfaces in one place that are visible in turns, as rounding decides.
    FlickeringSurfaces = "flickering-surfaces";
    /// Overlapping flat surfaces of two objects in one plane.
    CoplanarSurfaces = "coplanar-surfaces";
    /// Rays that hit the surface from which they start.
    SelfHit = "self-hit";
    /// Rays that start behind another surface.
    StartBeyondSurface = "start-beyond-surface";
    /// A gap beside glass that is narrower than the rounding of coordinates.
    ClosedGap = "closed-gap";
    /// A lamp that shines through an opaque object, as rounding closes the gap between them.
    LightThroughCover = "light-through-cover";
    /// Samples that are not finite numbers.
    SamplesNotFinite = "samples-not-finite";
    /// Rays that ended at the limit of transparent surfaces.
    RaysCutShort = "rays-cut-short";
    /// A camera whose rays hit nothing, or a scene without objects.
    NothingSeen = "nothing-seen";
    /// A picture in which every visible surface is black.
    BlackPicture = "black-picture";
    /// Light that paths find only by chance, by way of mirrors and glass.
    LightByChance = "light-by-chance" explains Subject [UnreachedLight, LampBelowPixel];
    /// A light that reaches no visible surface, or a lamp with hardly any area.
    UnreachedLight = "unreached-light";
    /// A light whose range, cone or emitting side holds no surface to light.
    LightMissesScene = "light-misses-scene" explains Subject [UnreachedLight];
    /// A delta light (without size) behind glass, where no path can hit it.
    LightBehindGlass = "light-behind-glass" explains Scene [BlackPicture];
    /// A lamp smaller than a pixel.
    LampBelowPixel = "lamp-below-pixel";
    /// A light that repeats another light.
    DuplicateLight = "duplicate-light";
    /// A sky with points far brighter than the rest.
    SkySpikes = "sky-spikes";
    /// A material that reflects more light than it receives.
    EnergyMade = "energy-made";
    /// A material with values that are not finite numbers.
    ValuesNotNumbers = "values-not-numbers" explains Scene [SamplesNotFinite, BlackPicture];
    /// Glass in a scene whose paths are too short to pass through it.
    DepthBelowGlass = "depth-below-glass";
    /// An image with texels that are negative, infinite or NaN.
    ImageNotLight = "image-not-light" explains Image [ValuesNotNumbers, SamplesNotFinite, BlackPicture, EnergyMade];
    /// An image of numbers that is read as colours.
    DataReadAsColour = "data-read-as-colour";
    /// An image used as a normal map that holds no normals.
    NotANormalMap = "not-a-normal-map";
    /// A camera inside a body.
    CameraInBody = "camera-in-body" explains Subject [BlackPicture];
    /// A lens focused in front of or behind all objects.
    FocusNowhere = "focus-nowhere";
    /// A scene that appears less than two pixels wide.
    SceneBelowPixel = "scene-below-pixel" explains Subject [NothingSeen];
    /// A picture with another aspect ratio than its camera, stretched to fit.
    StretchedPicture = "stretched-picture";
}

impl FindingCode {
    /// Returns a finding of this kind about a single fault without a position.
    pub(super) fn finding(
        self,
        severity: Severity,
        subject: FindingSubject,
        reason: impl Into<String>,
        remedy: impl Into<String>,
    ) -> StressFinding {
        StressFinding {
            code: self,
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
            reason: reason.into(),
            remedy: remedy.into(),
        }
    }

    /// Returns a finding of this kind about an object, which makes the picture wrong.
    pub(super) fn wrong(
        self,
        object: usize,
        reason: impl Into<String>,
        remedy: impl Into<String>,
    ) -> StressFinding {
        let subject = FindingSubject::Object(object);
        self.finding(Severity::PictureWrong, subject, reason, remedy)
    }
}

impl Serialize for FindingCode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// The part of a scene that a finding is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
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
    #[default]
    Scene,
}

impl FindingSubject {
    /// Returns the path in the scene file. Empty for the whole scene and an automatically framed
    /// camera.
    pub fn scene_path(self, scene: &Scene) -> String {
        match self.entry(scene) {
            Some(("generators", index, _)) => format!("generators[{index}].object"),
            Some((list, index, _)) => format!("{list}[{index}]"),
            None if self == Self::Sky => "sky".to_owned(),
            None => String::new(),
        }
    }

    /// Returns the name in messages: the list with the index (from 0), and the subject's own name
    /// if it has one.
    pub fn display_name(self, scene: &Scene) -> String {
        match (self.entry(scene), self) {
            (Some((list, index, Some(name))), _) if !name.is_empty() => {
                format!("{list}[{index}] `{name}`")
            }
            (Some((list, index, _)), _) => format!("{list}[{index}]"),
            (None, Self::Sky) => "the sky".to_owned(),
            (None, Self::Scene) => "the scene".to_owned(),
            (None, _) => "the camera".to_owned(),
        }
    }

    /// Returns the list of the scene, the index there, and the entry's own name.
    fn entry(self, scene: &Scene) -> Option<(&'static str, usize, Option<&String>)> {
        let listed = scene.objects.len();
        Some(match self {
            Self::Object(i) if i >= listed => ("generators", i - listed, None),
            Self::Object(i) => ("objects", i, scene.objects.get(i).map(|o| &o.name)),
            Self::Light(i) => ("lights", i, scene.lights.get(i).map(|l| &l.name)),
            Self::Camera(i) => ("cameras", i?, scene.cameras.get(i?).map(|c| &c.name)),
            Self::Material(i) => ("materials", i, scene.materials.get(i).map(|m| &m.name)),
            Self::Image(i) => ("images", i, scene.images.get(i).map(|image| &image.name)),
            Self::Sky | Self::Scene => return None,
        })
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
    /// Sets the count: `count` of `total` items have the fault that `predicate` describes.
    #[must_use]
    pub(super) fn with_count(
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

    /// Sets the count of rays.
    #[must_use]
    pub(super) fn with_rays(self, count: u64, total: u64, predicate: &'static str) -> Self {
        self.with_count(count, total, "rays", predicate)
    }

    /// Sets the world position. A position that is not finite is none.
    #[must_use]
    pub(super) fn with_place(self, place: impl Into<Option<DVec3>>) -> Self {
        let place = place.into().filter(|place| place.is_finite());
        Self {
            place: place.map(Into::into),
            ..self
        }
    }

    /// Sets the primitive.
    #[must_use]
    pub(super) fn with_primitive(self, primitive: u32) -> Self {
        Self {
            primitive: Some(primitive),
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
}

/// Work of a check, planned and done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CheckRun {
    /// Name of the check.
    pub name: &'static str,
    /// Name of the examined items, in the plural.
    pub unit: &'static str,
    /// Number of rays, samples or materials that were examined.
    pub looked_at: u64,
    /// Number of items to examine in total.
    pub planned: u64,
}

impl CheckRun {
    /// Returns whether fewer items than planned were examined.
    pub fn is_cut_short(&self) -> bool {
        self.looked_at < self.planned
    }
}

/// The number of items, and the first of the items themselves, so that a finding can show their
/// positions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct CountAndFirst<T = u32> {
    pub count: u64,
    pub some: Vec<T>,
}

/// Greatest number of items that are kept.
const KEPT: usize = 1 << 10;

impl<T> Default for CountAndFirst<T> {
    fn default() -> Self {
        Self {
            count: 0,
            some: Vec::new(),
        }
    }
}

impl<T> CountAndFirst<T> {
    pub fn add_item(&mut self, one: T) {
        self.count += 1;
        if self.some.len() < KEPT {
            self.some.push(one);
        }
    }
}

impl<T> FromIterator<T> for CountAndFirst<T> {
    fn from_iter<I: IntoIterator<Item = T>>(all: I) -> Self {
        let mut tally = Self::default();
        all.into_iter().for_each(|one| tally.add_item(one));
        tally
    }
}

/// Returns a count with its unit. `unit` is the plural; for 1 the singular is written.
pub fn count_with_unit(count: u64, unit: &str) -> String {
    let unit = match count {
        1 if unit == "copies" => "copy",
        1 if unit == "glass bodies" => "glass body",
        1 => unit.strip_suffix('s').unwrap_or(unit),
        _ => unit,
    };
    format!("{count} {unit}")
}

/// Returns a number with four digits. Very small and very large numbers have a power of ten.
pub fn format_decimal(x: f64) -> String {
    let trim = |digits: &str| match digits.contains('.') {
        true => digits
            .trim_end_matches('0')
            .trim_end_matches('.')
            .to_owned(),
        false => digits.to_owned(),
    };
    if x == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e6).contains(&x.abs()) {
        let short = format!("{x:.3e}");
        let (digits, power) = short.split_once('e').unwrap_or((&short, "0"));
        return format!("{}e{power}", trim(digits));
    }
    let places = (3.0 - x.abs().log10().floor()).max(0.0) as usize;
    trim(&format!("{x:.places$}"))
}

/// Returns a length in metres with its unit.
pub(super) fn format_metres(x: f64) -> String {
    match format_decimal(x).as_str() {
        "1" => "1 metre".to_owned(),
        digits => format!("{digits} metres"),
    }
}

/// Rounds a number to two digits.
pub(super) fn round_to_two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

/// Rounds a number up to one digit, as a lower limit in messages.
pub(super) fn round_up(x: f64) -> f64 {
    let step = libm::pow(10.0, x.log10().floor());
    (x / step).ceil() * step
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a count counts all items and keeps the first ones up to the limit.
    #[test]
    fn a_count_keeps_the_first() {
        for all in [0, 3, KEPT, KEPT + 7] {
            let tally: CountAndFirst<usize> = (0..all).collect();
            assert_eq!(tally.count, all as u64);
            assert_eq!(tally.some, (0..all.min(KEPT)).collect::<Vec<_>>());
        }
    }

    /// Protects: numbers have four digits without trailing zeros, and a power of ten if they are
    /// very small or large.
    #[test]
    fn numbers_are_short() {
        let of = [0.0, 2.0, 0.012345, -1234.56, 123456.7, 1e-8, 1.5e9].map(format_decimal);
        assert_eq!(
            of,
            ["0", "2", "0.01235", "-1235", "123457", "1e-8", "1.5e9"]
        );
        assert_eq!(
            [1.2e-6, 3.0, 171.0].map(|x| format_decimal(round_up(x))),
            ["2e-6", "3", "200"]
        );
        assert_eq!(
            [format_metres(1.0), format_metres(2.5)],
            ["1 metre", "2.5 metres"]
        );
        assert_eq!(
            [count_with_unit(1, "rays"), count_with_unit(2, "rays")],
            ["1 ray", "2 rays"]
        );
    }
}
