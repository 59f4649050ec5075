//! Objects: shapes with material, transform and visibility rules, and generators of many objects.

use serde::{Deserialize, Serialize};

use super::Triple;

/// An object that rays can hit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Name for messages; need not be unique.
    #[serde(default)]
    pub name: String,
    /// Its geometry.
    pub shape: Shape,
    /// Name of its material.
    pub material: String,
    /// Which sides can be hit.
    #[serde(default)]
    pub side: SideRule,
    /// Whether the normal is turned against the ray for shading; otherwise it always points
    /// outwards.
    #[serde(default = "yes")]
    pub face_viewer: bool,
    /// Whether the object blocks light.
    #[serde(default = "yes")]
    pub casts_shadow: bool,
    /// Affine transform: steps in the order of their application; empty: none.
    #[serde(default)]
    pub transform: Vec<TransformStep>,
    /// Transform at time 1 of a moving object, as its own list of steps; `transform` holds at time
    /// 0. Each entry of the map is interpolated linearly: every point moves along a straight line
    /// at constant speed, and a turning object shrinks on its path, halfway by the cosine of half
    /// the angle. None: the object stands still. Rays have times where the camera has a `shutter`.
    #[serde(default)]
    pub transform_end: Option<Vec<TransformStep>>,
}

fn yes() -> bool {
    true
}

/// Which sides of a surface can be hit; the outside is where the outward normal points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SideRule {
    /// Both sides.
    #[default]
    Both,
    /// The outside only.
    Outside,
    /// The inside only, as for a room.
    Inside,
    /// Both sides, but camera rays hit only the outside, and only the outside emits light:
    /// back-face culling, as for single-sided glTF materials. A wall that the camera sees through
    /// from behind still blocks light.
    Culled,
}

/// One step of an affine transform.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TransformStep {
    /// Moves by a vector.
    Translate(Triple),
    /// Scales along the axes; no factor may be zero.
    Scale(Triple),
    /// Rotates about an axis through the origin, counter-clockwise seen from the axis's tip.
    Rotate {
        /// Axis; any length above zero.
        axis: Triple,
        /// Angle.
        degrees: f64,
    },
    /// Three rows of a 3×4 matrix: linear part and translation.
    Matrix([[f64; 4]; 3]),
}

/// Geometry. Radii and sizes are above zero, directions longer than zero.
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
    /// An infinite plane. u and v are metres from its point. On a floor they run along x and z.
    /// Elsewhere u runs along x, projected to the plane, and v along that direction × normal.
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
    /// A cylinder. u runs about the axis. v runs from 0 at the far end to 1 at the base, or in
    /// metres from the base without a height; on a cap, from 0 at its centre to 1 at its rim.
    Cylinder {
        /// A point of the axis; with a height, the centre of the base.
        base: Triple,
        /// Direction of the axis; any length.
        axis: Triple,
        /// Radius.
        radius: f64,
        /// Length along the axis; none: infinite.
        #[serde(default)]
        height: Option<f64>,
        /// Whether a finite cylinder has caps.
        #[serde(default = "yes")]
        caps: bool,
    },
    /// A cone or, with a top radius, a truncated cone; closed at its ends. u runs about the axis; v
    /// from 0 at the top to 1 at the base, on a cap from 0 at its centre to 1 at its rim.
    Cone {
        /// Centre of the base.
        base: Triple,
        /// From the base to the tip; any length.
        axis: Triple,
        /// Radius of the base.
        radius: f64,
        /// Radius at the other end; 0: a tip.
        #[serde(default)]
        top_radius: f64,
        /// Length along the axis.
        height: f64,
    },
    /// A sphere scaled along the axes, with the u and v of the sphere.
    Ellipsoid {
        /// Centre.
        centre: Triple,
        /// Half-lengths along x, y, z.
        semi_axes: Triple,
    },
    /// A hyperboloid of one sheet about y: (x/a)² − (y/c)² + (z/a)² = 1, open at its ends. u runs
    /// about +y, v from 0 at the upper rim to 1 at the lower.
    Hyperboloid {
        /// Centre.
        centre: Triple,
        /// Radius a of the waist.
        waist_radius: f64,
        /// Slope constant c.
        c: f64,
        /// Greatest |y| relative to the centre.
        half_height: f64,
    },
    /// A paraboloid about y from its lowest point: y = (x² + z²)·height/radius², open at the top. u
    /// runs about +y; v runs with the height, from 0 at the rim to 1 at the apex.
    Paraboloid {
        /// Lowest point.
        apex: Triple,
        /// Radius of the rim.
        radius: f64,
        /// Height of the rim above the apex.
        height: f64,
    },
    /// A torus. u runs about the axis, v about the tube: ½ on its outer side, ¼ on the side to
    /// which the axis points.
    Torus {
        /// Centre.
        centre: Triple,
        /// Axis of symmetry; any length.
        axis: Triple,
        /// Distance from the centre to the middle of the tube.
        major_radius: f64,
        /// Radius of the tube, below the major one.
        minor_radius: f64,
    },
    /// A single triangle, counter-clockwise seen from outside. u and v are the barycentric weights
    /// of the second and third corner.
    Triangle {
        /// Corners.
        vertices: [Triple; 3],
    },
    /// A mesh by name; objects that name the same mesh share it. u and v are the mesh's first set;
    /// without one, each triangle's weights.
    Mesh(String),
}

/// A rule that makes many objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Generator {
    /// The rule.
    pub kind: GeneratorKind,
    /// The repeated object; each copy is moved by its offset.
    pub object: Object,
}

/// Positions of a generator's objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum GeneratorKind {
    /// At the points of a regular grid.
    Grid {
        /// Number of points along x, y, z.
        counts: [u32; 3],
        /// First point.
        origin: Triple,
        /// Distance between neighbours along x, y, z.
        step: Triple,
    },
    /// At random points of a box, uniformly.
    Scatter {
        /// Number of objects.
        count: u32,
        /// Least corner.
        min: Triple,
        /// Greatest corner.
        max: Triple,
        /// Seed; the same seed gives the same positions.
        #[serde(default)]
        seed: u64,
    },
}
