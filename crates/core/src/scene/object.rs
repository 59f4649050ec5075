//! Objects as in a scene file: shapes with material, transform and visibility rules; and generators
//! of many objects.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::Triple;

/// An object that rays can hit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Name for messages. It need not be unique.
    #[serde(default)]
    pub name: String,
    /// Geometry of the object.
    pub shape: Shape,
    /// Name of the object's material.
    pub material: String,
    /// Sides of the surface that rays can hit.
    #[serde(default)]
    pub side: SideRule,
    /// Whether the normal is turned to the side of the ray for shading. If false, the normal always
    /// points outwards.
    #[serde(default = "default_true")]
    pub face_viewer: bool,
    /// Whether the object casts shadows.
    #[serde(default = "default_true")]
    pub casts_shadow: bool,
    /// Affine transform: steps in the order of their application. Empty: no transform.
    #[serde(default)]
    pub transform: Vec<TransformStep>,
    /// Transform at time 1 of a moving object, as a complete list of steps; `transform` is the
    /// transform at time zero. The entries of the two matrices are interpolated linearly, so every
    /// point moves along a straight line at constant speed. A turning object shrinks on its path:
    /// halfway, its size is multiplied by the cosine of half the angle. None: the object stands
    /// still. Motion is visible only if the camera has a `shutter`.
    #[serde(default)]
    pub transform_end: Option<Vec<TransformStep>>,
}

fn default_true() -> bool {
    true
}

/// Sides of a surface that rays can hit. The outside is the side of the outward normal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SideRule {
    /// Both sides.
    #[default]
    Both,
    /// The outside alone.
    Outside,
    /// The inside alone, as for a room.
    Inside,
    /// Back-face culling, as for single-sided glTF materials. Camera rays hit only the outside, and
    /// only the outside emits light. All other rays hit both sides: a wall that the camera does not
    /// see from behind still blocks light.
    Culled,
}

/// One step of an affine transform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TransformStep {
    /// Moves the object by a vector.
    Translate(Triple),
    /// Scales the object along the axes. No factor may be zero.
    Scale(Triple),
    /// Rotates the object about an axis through the origin, counter-clockwise as seen from the tip
    /// of the axis.
    Rotate {
        /// Direction of the axis; any length above zero.
        axis: Triple,
        /// Angle in degrees.
        degrees: f64,
    },
    /// Three rows of a 3×4 matrix: linear part and translation.
    Matrix([[f64; 4]; 3]),
}

/// Geometry of an object. Radii, sizes and the lengths of directions are above zero.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A sphere. u runs about +y, from −x over +z, +x and −z; v from 0 at the top to 1 at the
    /// bottom.
    Sphere {
        /// Centre.
        centre: Triple,
        /// Radius.
        radius: f64,
    },
    /// An infinite plane. u and v are distances in metres from `point`. On a floor they run along x
    /// and z. On any other plane, u runs along x projected to the plane, and v along u's direction
    /// × normal.
    Plane {
        /// Any point of the plane.
        point: Triple,
        /// Outward normal; any length.
        normal: Triple,
    },
    /// A flat disk. u runs about the normal, v from 0 at the centre to 1 at the rim.
    Disk {
        /// Centre.
        centre: Triple,
        /// Outward normal; any length.
        normal: Triple,
        /// Radius.
        radius: f64,
    },
    /// A parallelogram; its outside is edge_u × edge_v. u runs along edge_u, v along edge_v, from 0
    /// to 1.
    Quad {
        /// A corner.
        corner: Triple,
        /// From the corner along the first edge.
        edge_u: Triple,
        /// From the corner along the second edge.
        edge_v: Triple,
    },
    /// An axis-parallel box. On each face u runs to the right and v down, seen from outside, from 0
    /// to 1; v runs along +z on the top and along −z on the bottom.
    Box {
        /// Least corner.
        min: Triple,
        /// Greatest corner, above the least in every axis.
        max: Triple,
    },
    /// A cylinder. u runs about the axis. v runs from 0 at the far end to 1 at the base; without a
    /// height, v is the distance in metres from the base. On a cap, v runs from 0 at the centre to
    /// 1 at the rim.
    Cylinder {
        /// A point of the axis; with a height, the centre of the base.
        base: Triple,
        /// Direction of the axis; any length.
        axis: Triple,
        /// Radius.
        radius: f64,
        /// Length along the axis. None: infinite.
        #[serde(default)]
        height: Option<f64>,
        /// Whether a finite cylinder has caps.
        #[serde(default = "default_true")]
        caps: bool,
    },
    /// A cone or, with a top radius, a truncated cone, closed at its ends. u runs about the axis. v
    /// runs from 0 at the top to 1 at the base; on a cap, from 0 at the centre to 1 at the rim.
    Cone {
        /// Centre of the base.
        base: Triple,
        /// Direction from the base to the tip; any length.
        axis: Triple,
        /// Radius of the base.
        radius: f64,
        /// Radius at the top. At 0 the cone has a tip.
        #[serde(default)]
        top_radius: f64,
        /// Height along the axis.
        height: f64,
    },
    /// A sphere scaled along the axes. u and v are as on the sphere.
    Ellipsoid {
        /// Centre.
        centre: Triple,
        /// Half-lengths along x, y, z.
        semi_axes: Triple,
    },
    /// A hyperboloid of one sheet about y: (x/a)² − (y/c)² + (z/a)² = 1, open at its ends. u runs
    /// about +y, v from 0 at the upper rim to 1 at the lower rim.
    Hyperboloid {
        /// Centre.
        centre: Triple,
        /// Radius a of the waist.
        waist_radius: f64,
        /// Constant c of the equation, in world units. Far from the waist, the radius grows by a/c
        /// for each unit of height.
        c: f64,
        /// Greatest distance in y from the centre.
        half_height: f64,
    },
    /// A paraboloid about y, open at the top: y = (x² + z²)·height/radius² relative to its lowest
    /// point. u runs about +y; v falls linearly with the height, from 1 at the apex to 0 at the
    /// rim.
    Paraboloid {
        /// Lowest point.
        apex: Triple,
        /// Radius of the rim.
        radius: f64,
        /// Height of the rim above the apex.
        height: f64,
    },
    /// A torus. u runs about the axis, v about the tube: v is ½ on the outer side, and ¼ on the
    /// side to which the axis points.
    Torus {
        /// Centre.
        centre: Triple,
        /// Axis of symmetry; any length.
        axis: Triple,
        /// Distance from the centre to the middle of the tube.
        major_radius: f64,
        /// Radius of the tube, below `major_radius`.
        minor_radius: f64,
    },
    /// A single triangle, counter-clockwise as seen from outside. u and v are the barycentric
    /// weights of the second and the third corner.
    Triangle {
        /// Corners.
        vertices: [Triple; 3],
    },
    /// A mesh by its name. Objects with the same mesh share its triangles. u and v are the mesh's
    /// first set of texture coordinates. Without such a set, u and v are the barycentric weights of
    /// each triangle's second and third corner.
    Mesh(String),
}

/// A rule that makes many copies of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Generator {
    /// Positions of the copies.
    pub kind: GeneratorKind,
    /// The repeated object. Each copy is moved by its position.
    pub object: Object,
}

/// Positions of the copies that a generator makes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum GeneratorKind {
    /// The points of a regular grid.
    Grid {
        /// Number of points along x, y, z.
        counts: [u32; 3],
        /// First point.
        origin: Triple,
        /// Distance between neighbours along x, y, z.
        step: Triple,
    },
    /// Uniformly random points of a box.
    Scatter {
        /// Number of copies.
        count: u32,
        /// Least corner.
        min: Triple,
        /// Greatest corner.
        max: Triple,
        /// Seed of the random points. The same seed gives the same positions.
        #[serde(default)]
        seed: u64,
    },
}

// Models in their own files, as in a scene file.

/// A glTF, GLB or OBJ file. Its objects, materials and lights become part of the scene, under names
/// that begin with the model's name. Models with the same file, scene, variant and time share their
/// meshes, materials and images.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// Prefix of the names of the model's items. Empty: the file's name without its extension.
    #[serde(default)]
    pub name: String,
    /// Path relative to the scene's folder.
    pub file: String,
    /// Name of a scene of a glTF or GLB file; if no scene has this name, its index. None: the
    /// file's default scene.
    #[serde(default)]
    pub scene: Option<String>,
    /// Name of a material variant of a glTF or GLB file. None: the default materials.
    #[serde(default)]
    pub variant: Option<String>,
    /// Seconds after the start of the animations of a glTF or GLB file. None: at rest.
    #[serde(default)]
    pub time: Option<f64>,
    /// Transform of the model: steps in the order of their application. Empty: the model stays
    /// where its file places it.
    #[serde(default)]
    pub transform: Vec<TransformStep>,
    /// Materials of the scene that replace materials of the file. The keys are the names of the
    /// replaced materials.
    #[serde(default)]
    pub materials: BTreeMap<String, String>,
}
