//! Faults of a scene: one type for what readers of the scene, preparation, a render and the checks of
//! `stress` find, and one table of their kinds.

use std::fmt::{self, Display};
use std::ops::Range;

use glam::DVec3;
use serde::{Serialize, Serializer};

use crate::generate::count_generated_objects;
use crate::scene::{Scene, Triple};

/// Severity of a fault, worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The scene cannot be rendered.
    NoPicture,
    /// The picture differs from what the file describes, or shows nothing.
    PictureWrong,
    /// The picture is right with enough samples, but needs more time or samples than it should.
    SlowOrNoisy,
    /// The fault is not visible, or the picture follows from a choice among what the file may mean.
    Harmless,
}

impl Severity {
    /// Returns the words for the severity.
    pub const fn description(self) -> &'static str {
        match self {
            Self::NoPicture => "no picture",
            Self::PictureWrong => "picture wrong",
            Self::SlowOrNoisy => "slow or noisy",
            Self::Harmless => "harmless",
        }
    }
}

/// What two faults must have in common for the second to follow from the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    /// Nothing: the second follows anywhere in the scene.
    Scene,
    /// The subject.
    Subject,
    /// An image: the first fault is about it, and the material or the sky of the second reads it.
    Image,
}

macro_rules! kinds {
    ($($(#[doc = $doc:literal])* $kind:ident = $name:literal $severity:ident $(explains $scope:ident [$($code:ident),*])*;)*) => {
        /// Kind of fault. Its name stays the same between versions.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum FaultKind {
            $($(#[doc = $doc])* $kind,)*
        }

        impl FaultKind {
            /// All kinds, ordered by subject; those of files with the worst first.
            pub const ALL: &'static [Self] = &[$(Self::$kind),*];

            /// Returns the name, as used in the text, the JSON and the documentation.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// Returns the usual severity. A fault may be milder or worse.
            pub const fn severity(self) -> Severity {
                match self {
                    $(Self::$kind => Severity::$severity,)*
                }
            }

            /// Returns the fault in words, as documented.
            pub fn description(self) -> &'static str {
                match self {
                    $(Self::$kind => concat!($($doc),*).trim_start(),)*
                }
            }

            /// Returns the kinds that follow from this one, and within which scope.
            pub(crate) const fn explains(self) -> &'static [(Scope, &'static [Self])] {
                match self {
                    $(Self::$kind => &[$((Scope::$scope, &[$(Self::$code),*])),*],)*
                }
            }
        }
    };
}

kinds! {
    /// a value that breaks a rule of the scene format; `check` and `render` refuse the scene
    Invalid = "invalid" NoPicture;
    /// a camera whose rays hit nothing, or pass through hidden sides alone; a box that hides all
    /// other objects at which the camera is aimed; a scene of which the reader left no object
    NothingSeen = "nothing-seen" PictureWrong;
    /// a texture, a sky or another picture that is missing or unreadable
    Picture = "picture" PictureWrong;
    /// a material or a library of materials that is missing
    Material = "material" PictureWrong;
    /// triangles that the reader left out: no area, too few corners or coordinates that are not
    /// finite
    Geometry = "geometry" PictureWrong;
    /// shapes that a section does not cut, cuts that stay open, and sections that remove everything
    Section = "section" PictureWrong;
    /// points and lines, which are not rendered
    PointsAndLines = "points-and-lines" PictureWrong;
    /// an unknown extension, statement or chunk; an effect that is left out
    Unsupported = "unsupported" PictureWrong;
    /// an animated property that is not supported
    Animation = "animation" PictureWrong;
    /// colours that are probably codes from 0 to 255
    ColourCodes = "colour-codes" PictureWrong;
    /// an invalid camera or light
    CameraOrLight = "camera-or-light" PictureWrong;
    /// more warnings about a file than are listed
    More = "more" PictureWrong;
    /// a number out of range, replaced by another
    Range = "range" Harmless;
    /// a file that breaks a rule of its format and still has a single interpretation
    Format = "format" Harmless;
    /// a choice among several scenes, variants or interpretations
    Choice = "choice" Harmless;
    /// a material or picture that was converted to the closest one that is supported
    Conversion = "conversion" Harmless;
    /// animations exist, and none was requested
    AtRest = "at-rest" Harmless;
    /// triangles without area; picture wrong if no object has any other triangle: the cause is
    /// often a scale of 0
    DegenerateTriangles = "degenerate-triangles" Harmless explains Scene [NothingSeen];
    /// vertices 10,000 times as far from the middle of their mesh as nearly all others; their
    /// triangles are not reported again. Harmless out of view
    StrayVertices = "stray-vertices" PictureWrong;
    /// triangles that repeat another triangle; picture wrong for blended surfaces
    DuplicateTriangles = "duplicate-triangles" Harmless;
    /// edges with a single triangle in a glass body, wrong if three rays pass through and harmless
    /// otherwise; a *seam* if the corners on both sides are less than a ten-thousandth of the
    /// mesh's size apart, wrong from a hundredth of the body's rays on; also single triangles
    /// missing in an otherwise closed opaque surface
    OpenEdges = "open-edges" PictureWrong explains Subject [DepthBelowGlass];
    /// edges of a glass body with three or more triangles; harmless if unseen
    NonManifoldEdges = "non-manifold-edges" PictureWrong;
    /// triangles whose orientation differs from most of their part of the mesh; harmless if unseen
    FlippedTriangles = "flipped-triangles" PictureWrong explains Subject [DepthBelowGlass];
    /// closed surfaces that are oriented inwards, wrong if a camera looks through their hidden side
    /// and harmless otherwise; walls of bubbles in glass that are oriented outwards
    InsideOut = "inside-out" PictureWrong explains Subject [DepthBelowGlass];
    /// vertex normals that point to the opposite side of their triangle; harmless if unseen
    NormalsAgainstFaces = "normals-against-faces" PictureWrong;
    /// an image of several colours on a mesh without texture coordinates for it, or with (0, 0)
    /// everywhere, or with a `uv_transform` of zeros
    NoTextureCoordinates = "no-texture-coordinates" PictureWrong;
    /// triangles with a normal map whose texture coordinates span no area; harmless if few
    FlatTextureCoordinates = "flat-texture-coordinates" PictureWrong;
    /// a mesh that collapses when its coordinates are rounded for storage; harmless out of view
    LostObject = "lost-object" PictureWrong explains Scene [SceneBelowPixel];
    /// a shape that collapses when it is stored; no ray can be traced then
    LostShape = "lost-shape" PictureWrong;
    /// rounding merges points that are a thousandth of the object's size apart; the finding names
    /// the distant object that causes this, and the objects that are stored coarsely. Harmless out
    /// of view, and for a shape that as many rays hit in double precision
    UnresolvedObject = "unresolved-object" PictureWrong;
    /// a listed object in the same place as another, whatever transforms place the two; copies of
    /// generators that coincide with each other, with copies of another generator or with a listed
    /// object. Picture wrong for blended surfaces, lamps and another material in view; slow or
    /// noisy for over 64 copies in one place
    DuplicateObject = "duplicate-object" Harmless;
    /// a glass body that rays enter without leaving, or leave without entering: it is open by its
    /// shape, has `side = "outside"` or `"inside"`, or touches another surface; reported from a
    /// twentieth of its rays on
    OpenBody = "open-body" PictureWrong explains Subject [DepthBelowGlass];
    /// glass inside or across other glass without `priority`, also copies of one generator, from a
    /// tenth of their rays on: one finding with the number of bodies
    NestedGlass = "nested-glass" PictureWrong explains Scene [DepthBelowGlass] explains Subject [OpenBody, ClosedGap];
    /// two surfaces in one place, or too close for the precision there, so that rounding decides
    /// from ray to ray which one is seen; of one material, so that the lower one is in the shadow
    /// of the upper one
    FlickeringSurfaces = "flickering-surfaces" PictureWrong;
    /// surfaces of two objects with different materials in one place, or too close for the precision
    /// there, of which the first in the file hides the other. Harmless if the hidden one is seen
    /// elsewhere; always wrong if one of them emits light
    CoplanarSurfaces = "coplanar-surfaces" PictureWrong;
    /// rays that hit the surface from which they start
    SelfHit = "self-hit" PictureWrong;
    /// rays that a constant offset starts behind another surface
    StartBeyondSurface = "start-beyond-surface" PictureWrong;
    /// a gap beside glass, or glass itself, that is narrower than rounding; an opaque object that
    /// is lost where glass touches it, as the glass is the first of the two in the file; partly
    /// transparent surfaces in one place, of which the picture shows the first alone. Harmless if
    /// unseen
    ClosedGap = "closed-gap" PictureWrong;
    /// a lamp that shines through an opaque object, as rounding closes the gap between the two
    LightThroughCover = "light-through-cover" PictureWrong;
    /// samples that are not finite numbers
    SamplesNotFinite = "samples-not-finite" PictureWrong;
    /// rays that ended at the limit of surfaces that are cut out or partly transparent
    RaysCutShort = "rays-cut-short" PictureWrong;
    /// samples that `--clamp` dims, so that bright pixels are too dark
    SamplesDimmed = "samples-dimmed" PictureWrong;
    /// points at which the density of a medium is below zero, above its `max_density`, or not a number
    DensityOutOfRange = "density-out-of-range" PictureWrong;
    /// surfaces are visible, but no light arrives; the finding names the object in the way, the
    /// light that shines past everything, or a sky by an expression, if one is the cause
    BlackPicture = "black-picture" PictureWrong;
    /// lamps behind glass, or lamps and suns that paths hit only by way of mirrors and glass:
    /// reported if they contribute a hundredth of the light or more, and the expected error with
    /// the scene's number of samples is 0.2 or more (root relMSE, as `render` prints it)
    LightByChance = "light-by-chance" SlowOrNoisy explains Subject [UnreachedLight, LampBelowPixel];
    /// a lamp or a light that hardly any shadow ray of the small picture finds, or a lamp that has
    /// hardly any area
    UnreachedLight = "unreached-light" SlowOrNoisy;
    /// a light whose range, cone or emitting side holds no visible surface, or only a lamp
    LightMissesScene = "light-misses-scene" SlowOrNoisy explains Subject [UnreachedLight];
    /// a light of zero size that most visible surfaces face through glass, where no path can hit it
    LightBehindGlass = "light-behind-glass" PictureWrong explains Scene [BlackPicture];
    /// lamps in view that are smaller than a pixel
    LampBelowPixel = "lamp-below-pixel" SlowOrNoisy;
    /// a light that repeats another light; harmless if the colours differ
    DuplicateLight = "duplicate-light" PictureWrong;
    /// texels of a sky 10,000 times as bright as most of it
    SkySpikes = "sky-spikes" SlowOrNoisy;
    /// a ball of the material under even white light reflects over 1.02 times the light that it
    /// receives. If a thousandth of the cameras' rays find a base colour above 1, as of an
    /// expression or an image, a ball of that colour is measured too
    EnergyMade = "energy-made" PictureWrong;
    /// an expression or image gives no finite number where a camera looks
    ValuesNotNumbers = "values-not-numbers" PictureWrong explains Scene [SamplesNotFinite, BlackPicture];
    /// glass in a scene whose paths have fewer than three segments, or glass in view that lacks a
    /// fifth of its light because paths end there: the small picture is compared with one of longer
    /// paths
    DepthBelowGlass = "depth-below-glass" PictureWrong;
    /// texels that are negative, infinite or NaN, even if the reader has replaced them
    ImageNotLight = "image-not-light" PictureWrong explains Image [ValuesNotNumbers, SamplesNotFinite, BlackPicture, EnergyMade];
    /// a map of normals or numbers, of any layer of a material, that is read as sRGB colours
    DataReadAsColour = "data-read-as-colour" PictureWrong;
    /// a normal map most of whose directions point into the surface
    NotANormalMap = "not-a-normal-map" PictureWrong;
    /// a camera in an opaque body that hides everything else, or below a plane that hides
    /// everything above it; a lens that reaches into an opaque box or ball. Harmless in glass
    CameraInBody = "camera-in-body" PictureWrong explains Subject [BlackPicture];
    /// a lens focused in front of all that is in view or behind all objects, so that every point is
    /// wider than a pixel
    FocusNowhere = "focus-nowhere" PictureWrong;
    /// a scene less than two pixels wide
    SceneBelowPixel = "scene-below-pixel" PictureWrong explains Subject [NothingSeen];
    /// a camera whose `aspect` differs from the picture's, with `fit = "stretch"`
    StretchedPicture = "stretched-picture" PictureWrong;
}

impl FaultKind {
    /// Returns a fault of this kind, at a single place without a position.
    pub fn fault(
        self,
        subject: impl Into<Subject>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Fault {
        Fault {
            kind: self,
            severity: self.severity(),
            subject: subject.into(),
            others: Vec::new(),
            path: String::new(),
            span: None,
            primitive: None,
            place: None,
            pixel: None,
            count: 1,
            of: 0,
            unit: "",
            predicate: "",
            message: message.into(),
            remedy: remedy.into(),
        }
    }

    /// Returns a fault of this kind in a file.
    pub fn in_file(self, file: impl Display, message: impl Display) -> Fault {
        self.fault(Subject::Scene, format!("{file}: {message}"), "")
    }

    /// Returns the kind with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        let mut kinds = Self::ALL.iter().copied();
        kinds.find(|kind| kind.name() == name)
    }
}

impl Serialize for FaultKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// The part of a scene that a fault is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Subject {
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

impl From<usize> for Subject {
    fn from(object: usize) -> Self {
        Self::Object(object)
    }
}

impl Subject {
    /// Returns the subject of an object, given its index among all objects of the prepared scene: there,
    /// each object of a generator counts singly.
    pub fn from_object_index(scene: &Scene, index: usize) -> Self {
        let listed = scene.objects.len();
        let mut next = listed as u64;
        let mut generators = scene.generators.iter();
        let generator = generators.position(|generator| {
            next = next.saturating_add(count_generated_objects(&generator.kind));
            (index as u64) < next
        });
        Self::Object(match generator.filter(|_| index >= listed) {
            Some(generator) => listed + generator,
            None => index,
        })
    }

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

    /// Returns the name in messages, such as "object `lamp`"; without a name of its own, the list with
    /// the index from 0.
    pub fn display_name(self, scene: &Scene) -> String {
        match (self.entry(scene), self) {
            (Some((list, _, Some(name))), _) if !name.is_empty() => {
                format!("{} `{name}`", list.trim_end_matches('s'))
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

/// A fault of a scene, at one or more places. It serializes as its kind, severity, message and
/// remedy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// Kind of fault.
    #[serde(rename = "code")]
    pub kind: FaultKind,
    /// Severity of the fault.
    pub severity: Severity,
    /// Part of the scene with the fault.
    #[serde(skip)]
    pub subject: Subject,
    /// Other subjects with the same fault for the same cause.
    #[serde(skip)]
    pub others: Vec<Subject>,
    /// Path of the faulty value from the root of the scene, such as `objects[3].shape.sphere.radius`,
    /// also of a key that the file omits. Empty for a fault that no single value causes.
    #[serde(skip)]
    pub path: String,
    /// Byte range of the fault within a value that is text; `None` for the whole value.
    #[serde(skip)]
    pub span: Option<Range<usize>>,
    /// Index of a primitive with the fault, such as a triangle of the subject: the nearest one to a
    /// camera. `None` if the fault is not about primitives.
    #[serde(skip)]
    pub primitive: Option<u32>,
    /// World position of the fault in metres, the nearest one to a camera. `None` without a
    /// position.
    #[serde(skip)]
    pub place: Option<Triple>,
    /// Pixel position of the fault in a picture, from the top left, and the index of the camera.
    /// `None` if no camera sees it.
    #[serde(skip)]
    pub pixel: Option<([f64; 2], usize)>,
    /// Number of items with the fault, in units of `unit`.
    #[serde(skip)]
    pub count: u64,
    /// Number of items that were examined; 0 if that number says nothing.
    #[serde(skip)]
    pub of: u64,
    /// Name of the counted items, in the plural. Empty if nothing is counted.
    #[serde(skip)]
    pub unit: &'static str,
    /// Words that follow the count and say what holds for the counted items.
    #[serde(skip)]
    pub predicate: &'static str,
    /// The fault and its effect, in one sentence without a full stop.
    pub message: String,
    /// The remedy. Empty if there is none, or if the message has it.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub remedy: String,
}

impl Fault {
    /// Sets the count: `count` of `total` items have the fault that `predicate` describes.
    #[must_use]
    pub(crate) fn with_count(
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
    pub(crate) fn with_rays(self, count: u64, total: u64, predicate: &'static str) -> Self {
        self.with_count(count, total, "rays", predicate)
    }

    /// Sets the world position. A position that is not finite is none.
    #[must_use]
    pub(crate) fn with_place(self, place: impl Into<Option<DVec3>>) -> Self {
        let place = place.into().filter(|place| place.is_finite());
        Self {
            place: place.map(Into::into),
            ..self
        }
    }

    /// Sets the severity of a fault that shows in the picture if a camera sees it, with words for the
    /// end of the message if none does.
    #[must_use]
    pub(crate) fn if_seen_or(mut self, is_seen: bool, unseen: &str) -> Self {
        self.message += if is_seen { "" } else { unseen };
        self.if_seen(is_seen)
    }

    /// Sets the severity of a fault that shows in the picture if a camera sees it.
    #[must_use]
    pub(crate) fn if_seen(self, is_seen: bool) -> Self {
        self.with_severity(if is_seen {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        })
    }

    /// Sets the severity.
    #[must_use]
    pub(crate) fn with_severity(self, severity: Severity) -> Self {
        Self { severity, ..self }
    }

    /// Returns the names of the subject and of up to three others with the same fault.
    pub fn subject_names(&self, scene: &Scene) -> String {
        const MOST: usize = 3;
        let named = self.others.iter().take(MOST);
        let named = named.map(|other| format!(", {}", other.display_name(scene)));
        let names = self.subject.display_name(scene) + &named.collect::<String>();
        match self.others.len().saturating_sub(MOST) {
            0 => names,
            more => format!("{names} and {more} more"),
        }
    }

    /// Returns the faults for messages of a line: the first of each kind, with the subjects of the
    /// others. The message begins with the names of the subjects and ends with the count.
    pub fn first_of_kinds(faults: impl IntoIterator<Item = Self>, scene: &Scene) -> Vec<Self> {
        let mut firsts: Vec<Self> = Vec::new();
        for fault in faults {
            match firsts.iter_mut().find(|first| first.kind == fault.kind) {
                None => firsts.push(fault),
                Some(first) => {
                    first.others.push(fault.subject);
                    (first.count, first.of) = (first.count + fault.count, first.of + fault.of);
                }
            }
        }
        for first in &mut firsts {
            if first.subject != Subject::Scene {
                first.message = format!("{}: {}", first.subject_names(scene), first.message);
            }
            let count = first.count_text();
            first.message += &count.map_or(String::new(), |count| format!(" ({count})"));
        }
        firsts
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

/// Message and remedy as one sentence.
impl Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        match self.remedy.as_str() {
            "" => Ok(()),
            remedy => write!(f, "; {remedy}"),
        }
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
pub(crate) fn format_metres(x: f64) -> String {
    match format_decimal(x).as_str() {
        "1" => "1 metre".to_owned(),
        digits => format!("{digits} metres"),
    }
}

/// Rounds a number to two digits.
pub(crate) fn round_to_two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

/// Rounds a number up to one digit, as a lower limit in messages.
pub(crate) fn round_up(x: f64) -> f64 {
    let step = libm::pow(10.0, x.log10().floor());
    (x / step).ceil() * step
}

#[cfg(test)]
mod tests {
    use super::*;

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
