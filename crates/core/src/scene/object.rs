//! What can be hit: shapes with their material, transform and visibility rules, and generators of
//! many of them.

use serde::{Deserialize, Serialize};

use super::Triple;

/// One thing that can be hit.
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
    /// Which sides of it can be hit.
    #[serde(default)]
    pub side: SideRule,
    /// Whether its normal points outwards always, or is turned against the ray for shading.
    #[serde(default = "yes")]
    pub face_viewer: bool,
    /// Whether it stands in the way of light.
    #[serde(default = "yes")]
    pub casts_shadow: bool,
    /// Affine transform: steps in the order in which they are applied; empty: none.
    #[serde(default)]
    pub transform: Vec<TransformStep>,
    /// Where it is at time 1 if it moves, by steps of its own; `transform` is where it is at
    /// time 0. Between them each entry of the map runs linearly: every point goes along a straight
    /// line at a constant speed, and what turns shrinks on the way, halfway by the cosine of half
    /// the angle. None: it stands still. Rays have times where the camera has a `shutter`.
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
    /// Either.
    #[default]
    Both,
    /// Only rays that arrive from outside.
    Outside,
    /// Only rays that arrive from inside: a room.
    Inside,
    /// Either, but rays of the camera see only the outside, and only that gives off light:
    /// back-face culling, as of glTF's materials with one side. A wall that the camera looks
    /// through from behind still stops light.
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
    /// Turns about an axis through the origin, counter-clockwise seen from its tip.
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
    /// All points at a distance from a centre. u runs about +y, from −x over +z, +x and −z; v from
    /// 0 at the top to 1 at the bottom.
    Sphere {
        /// Centre.
        centre: Triple,
        /// Radius.
        radius: f64,
    },
    /// An infinite plane. u and v are metres from its point: along x and z on a floor; elsewhere u
    /// along x, as far as the plane allows it, and v along that direction × normal.
    Plane {
        /// Any point of it.
        point: Triple,
        /// The outside; any length.
        normal: Triple,
    },
    /// A flat round plate. u runs about the normal, v from 0 at the centre to 1 at the rim.
    Disk {
        /// Centre.
        centre: Triple,
        /// The outside; any length.
        normal: Triple,
        /// Radius.
        radius: f64,
    },
    /// A parallelogram; its outside is edge_u × edge_v. u runs along edge_u, v along edge_v, from 0
    /// to 1.
    Quad {
        /// One corner.
        corner: Triple,
        /// From the corner along the first edge.
        edge_u: Triple,
        /// From the corner along the second edge.
        edge_v: Triple,
    },
    /// An axis-parallel box. On each face u runs to the right and v down as it is seen from
    /// outside, from 0 to 1; v along +z on the top and along −z on the bottom.
    Box {
        /// Least corner.
        min: Triple,
        /// Greatest corner, above the least in every axis.
        max: Triple,
    },
    /// A round tube about an axis. u runs about the axis; v down it, from 0 at the far end to 1 at
    /// the base, or in metres from the base without a height; on an end from 0 at its centre to 1
    /// at its rim.
    Cylinder {
        /// A point of the axis; with a height, the centre of one end.
        base: Triple,
        /// Direction of the axis; any length.
        axis: Triple,
        /// Radius.
        radius: f64,
        /// Length along the axis; none: infinite.
        #[serde(default)]
        height: Option<f64>,
        /// Whether a finite one is closed at its ends.
        #[serde(default = "yes")]
        caps: bool,
    },
    /// A cone or, with a top radius, a truncated one; closed at its ends. u runs about the axis; v
    /// from 0 at the top to 1 at the base, on an end from 0 at its centre to 1 at its rim.
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
    /// A sphere scaled along the axes. u and v are those of the sphere.
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
        /// |y| up to which it reaches.
        half_height: f64,
    },
    /// A paraboloid about y from its lowest point: y = (x² + z²)·height/radius², open at the top. u
    /// runs about +y, v from 0 at the rim to 1 at the apex, with the height.
    Paraboloid {
        /// Lowest point.
        apex: Triple,
        /// Radius of the rim.
        radius: f64,
        /// Height of the rim above the apex.
        height: f64,
    },
    /// A ring with a round section. u runs about the axis, v about the tube: ½ on its outer side, ¼
    /// on the side to which the axis points.
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
    /// A single triangle, counter-clockwise seen from outside. u and v are the weights of its
    /// second and third corner.
    Triangle {
        /// Corners.
        vertices: [Triple; 3],
    },
    /// A mesh by name; objects that name the same mesh share it. u and v are its own first set;
    /// without one, each triangle's.
    Mesh(String),
}

/// A rule that makes many objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Generator {
    /// The rule.
    pub kind: GeneratorKind,
    /// The object that is repeated; its shape is moved by each place's offset.
    pub object: Object,
}

/// Where a generator puts its objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum GeneratorKind {
    /// At the points of a regular grid.
    Grid {
        /// Points along x, y, z.
        counts: [u32; 3],
        /// First point.
        origin: Triple,
        /// Distance between neighbours along x, y, z.
        step: Triple,
    },
    /// At random points of a box, uniformly.
    Scatter {
        /// How many.
        count: u32,
        /// Least corner.
        min: Triple,
        /// Greatest corner.
        max: Triple,
        /// Seed; the same seed makes the same places.
        #[serde(default)]
        seed: u64,
    },
}
