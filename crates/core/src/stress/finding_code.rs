//! The kinds of findings, each with a name that stays, and how bad findings are.

use serde::{Serialize, Serializer};

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
    /// Vertices far out of their mesh.
    StrayVertices = "stray-vertices";
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
    /// A light without size in a surface, along which it shines.
    LightInSurface = "light-in-surface";
    /// A light without size behind glass, through which no path meets it.
    LightBehindGlass = "light-behind-glass";
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
