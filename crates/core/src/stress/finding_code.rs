//! Kinds and severities of findings. The name of each kind stays the same between versions.

use serde::{Serialize, Serializer};

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
}

macro_rules! codes {
    ($($(#[$doc:meta])* $variant:ident = $name:literal;)*) => {
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
        }
    };
}

codes! {
    /// Triangles without area.
    DegenerateTriangles = "degenerate-triangles";
    /// Vertices far away from the rest of their mesh.
    StrayVertices = "stray-vertices";
    /// Triangles that repeat another triangle.
    DuplicateTriangles = "duplicate-triangles";
    /// Edges with a single triangle: in a glass body, or around a missing triangle of an otherwise
    /// closed opaque surface.
    OpenEdges = "open-edges";
    /// Edges with more than two triangles.
    NonManifoldEdges = "non-manifold-edges";
    /// Triangles whose orientation differs from their neighbours'.
    FlippedTriangles = "flipped-triangles";
    /// A closed surface that is oriented inwards.
    InsideOut = "inside-out";
    /// Vertex normals that point to the opposite side of their triangle.
    NormalsAgainstFaces = "normals-against-faces";
    /// A texture on a mesh without texture coordinates for it.
    NoTextureCoordinates = "no-texture-coordinates";
    /// Triangles with a normal map whose texture coordinates span no area.
    FlatTextureCoordinates = "flat-texture-coordinates";
    /// A mesh that degenerates to a point when its coordinates are rounded for storage.
    LostObject = "lost-object";
    /// A shape that degenerates when its coordinates are rounded for storage.
    LostShape = "lost-shape";
    /// An object that loses fine detail when its coordinates are rounded for storage.
    UnresolvedObject = "unresolved-object";
    /// Triangles that lose their area when their coordinates are rounded for storage.
    LostTriangles = "lost-triangles";
    /// An object in the same place as another object.
    DuplicateObject = "duplicate-object";
    /// A glass body that rays enter without leaving, or leave without entering.
    OpenBody = "open-body";
    /// Glass bodies inside each other without priorities.
    NestedGlass = "nested-glass";
    /// Two surfaces in one place that are visible in turns, as rounding decides.
    FlickeringSurfaces = "flickering-surfaces";
    /// Overlapping flat surfaces of two objects in one plane.
    CoplanarSurfaces = "coplanar-surfaces";
    /// Rays that pass between two triangles with a common edge or corner.
    Leak = "leak";
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
    /// Pixels brighter than every light.
    BrighterThanLights = "brighter-than-lights";
    /// Light that paths find only by chance, by way of mirrors and glass.
    LightByChance = "light-by-chance";
    /// A light that reaches no visible surface, or a lamp with hardly any area.
    UnreachedLight = "unreached-light";
    /// A light whose range, cone or emitting side holds no surface to light.
    LightMissesScene = "light-misses-scene";
    /// A delta light (without size) behind glass, where no path can hit it.
    LightBehindGlass = "light-behind-glass";
    /// A lamp smaller than a pixel.
    LampBelowPixel = "lamp-below-pixel";
    /// A light that repeats another light.
    DuplicateLight = "duplicate-light";
    /// A sky with points far brighter than the rest.
    SkySpikes = "sky-spikes";
    /// A material that reflects more light than it receives.
    EnergyMade = "energy-made";
    /// A material with values that are not finite numbers.
    ValuesNotNumbers = "values-not-numbers";
    /// Glass in a scene whose paths are too short to pass through it.
    DepthBelowGlass = "depth-below-glass";
    /// An image with texels that are negative, infinite or NaN.
    ImageNotLight = "image-not-light";
    /// An image of numbers that is read as colours.
    DataReadAsColour = "data-read-as-colour";
    /// An image used as a normal map that holds no normals.
    NotANormalMap = "not-a-normal-map";
    /// A camera inside a body.
    CameraInBody = "camera-in-body";
    /// A lens focused in front of or behind all objects.
    FocusNowhere = "focus-nowhere";
    /// A scene that appears less than two pixels wide.
    SceneBelowPixel = "scene-below-pixel";
    /// A picture with another aspect ratio than its camera, stretched to fit.
    StretchedPicture = "stretched-picture";
}

impl Serialize for FindingCode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}
