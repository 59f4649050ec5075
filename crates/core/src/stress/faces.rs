//! Flat faces of objects, as polygons.

use super::*;

/// Number of sides of the polygon that approximates a disk.
const SIDES: u32 = 24;
/// A flat face.
pub(super) struct FlatFace {
    pub object: usize,
    pub normal: DVec3,
    /// Corners in order. A plane, which has no corners, has a single point of the plane instead.
    pub corners: Vec<DVec3>,
    pub bounds: Aabb,
    pub is_endless: bool,
    /// Whether the face belongs to no closed body.
    pub is_sheet: bool,
}

impl FlatFace {
    /// Returns a face in object space.
    fn new(normal: DVec3, corners: Vec<DVec3>, is_sheet: bool) -> Self {
        Self {
            object: 0,
            normal,
            bounds: Aabb::EMPTY,
            is_endless: corners.len() == 1,
            corners,
            is_sheet,
        }
    }

    pub fn from_triangle(corners @ [a, b, c]: [DVec3; 3], is_sheet: bool) -> Self {
        Self::new((b - a).cross(c - a), corners.into(), is_sheet)
    }

    /// Returns the face of an object in world space. `None` if it is not finite.
    pub fn place(mut self, object: &ObjectFacts<'_>) -> Option<Self> {
        let map = object.object_to_world;
        self.object = object.index;
        self.normal = (map.matrix3.inverse().transpose() * self.normal).normalize();
        self.corners
            .iter_mut()
            .for_each(|corner| *corner = map.transform_point3(*corner));
        let bounds = Aabb::from_points(self.corners.iter().copied());
        let is_finite =
            self.normal.is_finite() && self.corners.iter().all(|corner| corner.is_finite());
        self.bounds = match self.is_endless {
            true => Aabb {
                min: DVec3::NEG_INFINITY,
                max: DVec3::INFINITY,
            },
            false => bounds,
        };
        is_finite.then_some(self)
    }

    /// Returns two numbers that coplanar faces have in common. The first depends on the direction
    /// of the normal without its sign, the second is the signed distance of the plane from the
    /// origin.
    pub fn plane_key(&self) -> [f64; 2] {
        // Directions that are no multiples of each other have other products with it, but for rare
        // ones.
        let tilt = self.normal.dot(DVec3::new(0.539_134, 0.617_291, 0.573_008));
        [tilt.abs(), self.normal.dot(self.corners[0]) * tilt.signum()]
    }

    /// Returns the corners, counter-clockwise about a normal.
    pub fn outline(&self, normal: DVec3) -> Vec<DVec3> {
        let mut corners = self.corners.clone();
        if signed_double_area(&corners, normal) < 0.0 {
            corners.reverse();
        }
        corners
    }

    /// Returns whether two parallel faces belong to closed bodies on opposite sides of their plane.
    pub fn is_back_to_back(&self, other: &Self) -> bool {
        !self.is_sheet && !other.is_sheet && self.normal.dot(other.normal) < 0.0
    }

    /// Returns whether the bounding boxes of two faces are apart within their plane.
    pub fn is_apart(&self, other: &Self) -> bool {
        // Of parallel faces, the coordinates across the plane differ by rounding alone.
        let across = self.normal.abs().max_position();
        let (a, b) = (&self.bounds, &other.bounds);
        let mut along = (0..3).filter(|&axis| axis != across);
        along.any(|axis| a.min[axis] >= b.max[axis] || b.min[axis] >= a.max[axis])
    }
}

/// Returns the flat faces of a shape other than a mesh, in object space.
pub(super) fn shape_faces(shape: &Shape) -> Vec<FlatFace> {
    let v = DVec3::from_array;
    let sheet = |normal, corners| vec![FlatFace::new(normal, corners, true)];
    match *shape {
        Shape::Plane { point, normal } => sheet(v(normal), vec![v(point)]),
        Shape::Disk {
            centre,
            normal,
            radius,
        } => {
            let (x, y) = v(normal).normalize().any_orthonormal_pair();
            let corner = |i: u32| {
                let (sin, cos) = libm::sincos(f64::from(i) / f64::from(SIDES) * TAU);
                v(centre) + (x * cos + y * sin) * radius
            };
            sheet(v(normal), (0..SIDES).map(corner).collect())
        }
        Shape::Quad {
            corner,
            edge_u,
            edge_v,
        } => {
            let (c, a, b) = (v(corner), v(edge_u), v(edge_v));
            sheet(a.cross(b), vec![c, c + a, c + a + b, c + b])
        }
        Shape::Triangle { vertices } => vec![FlatFace::from_triangle(vertices.map(v), true)],
        Shape::Box { min, max } => {
            let ends = [v(min), v(max)];
            let side = |index: usize| {
                let (axis, end) = (index / 2, index % 2);
                let corner = |[i, j]: [usize; 2]| {
                    let mut corner = ends[end];
                    for (offset, end) in [(1, i), (2, j)] {
                        corner[(axis + offset) % 3] = ends[end][(axis + offset) % 3];
                    }
                    corner
                };
                let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(corner);
                let sign = if end == 1 { 1.0 } else { -1.0 };
                FlatFace::new(DVec3::AXES[axis] * sign, corners.into(), false)
            };
            (0..6).map(side).collect()
        }
        _ => Vec::new(),
    }
}

/// Returns twice the area of a polygon, negative if it is clockwise about the normal.
pub(super) fn signed_double_area(corners: &[DVec3], normal: DVec3) -> f64 {
    let edges = corners.windows(2);
    let area = |pair: &[DVec3]| {
        (pair[0] - corners[0])
            .cross(pair[1] - corners[0])
            .dot(normal)
    };
    edges.map(area).sum()
}

/// Clips a convex polygon by the edges of another convex polygon ("Reentrant Polygon Clipping",
/// Sutherland, Hodgman 1974).
pub(super) fn clip_polygon(mut corners: Vec<DVec3>, by: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    for (i, &from) in by.iter().enumerate() {
        let inwards = normal.cross(by[(i + 1) % by.len()] - from);
        let inside = |corner: DVec3| inwards.dot(corner - from);
        let mut kept = Vec::with_capacity(corners.len() + 1);
        for (j, &corner) in corners.iter().enumerate() {
            let next = corners[(j + 1) % corners.len()];
            let (here, there) = (inside(corner), inside(next));
            if here >= 0.0 {
                kept.push(corner);
            }
            if here * there < 0.0 {
                kept.push(corner + (next - corner) * (here / (here - there)));
            }
        }
        corners = kept;
    }
    corners
}
