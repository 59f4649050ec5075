//! Sampling of a triangle or quad uniformly by solid angle ("Stratified Sampling of Spherical
//! Triangles", Arvo 1995).
//!
//! Each step is a formula without branches. A step runs for all polygons of a batch before the next
//! step: the compiler vectorises these loops. A single polygon runs the same code with one lane.

use glam::DVec3;

use crate::number::{angle_above_axis, sines_and_cosines};

/// Solid angle in steradians below which points are sampled by area instead. Over so small a
/// polygon, distances and cosines hardly differ, and the polygon's angles lose their digits.
pub(super) const LEAST: f64 = 1e-3;

/// Least volume spanned by the unit directions to a triangle's corners. Below this volume, the
/// receiving point counts as lying in the triangle's plane.
const FLAT: f64 = 1e-12;

/// A triangle or quad, given by its corners in order. A triangle repeats its last corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polygon([DVec3; 4]);

/// A point of a polygon, sampled by solid angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PolygonSample {
    /// Solid angle of the whole polygon in steradians.
    pub solid_angle: f64,
    /// The sampled point; `None` if rounding made the point invalid.
    pub point: Option<DVec3>,
}

impl Polygon {
    /// Returns a triangle as a polygon.
    pub fn from_triangle([a, b, c]: [DVec3; 3]) -> Self {
        Self([a, b, c, c])
    }

    /// Returns a quad as a polygon.
    pub fn from_quad(corners: [DVec3; 4]) -> Self {
        Self(corners)
    }

    /// Returns the polygon's solid angle in steradians, seen from `from`. `None` below 10⁻³, and in
    /// the polygon's plane.
    #[inline]
    pub fn solid_angle(&self, from: DVec3) -> Option<f64> {
        let [first, second] = triangle_solid_angles(&corner_directions_and_volumes(
            self.flatten_with_point(from),
        ));
        let solid_angle = first + second;
        (solid_angle >= LEAST).then_some(solid_angle)
    }

    /// Samples a point of the polygon uniformly by the solid angle seen from `from`, for two
    /// uniform numbers in [0, 1). `None` if the polygon looks so small or flat that sampling by
    /// area is better.
    pub(super) fn sample(&self, from: DVec3, [u, v]: [f64; 2]) -> Option<PolygonSample> {
        let drawn = PolygonLanes {
            points_and_corners: self.flatten_with_point(from).map(|x| [x]),
            positions: [[u], [v]],
        }
        .sample();
        drawn.is_large_enough(0).then(|| PolygonSample {
            solid_angle: drawn.solid_angle[0],
            point: drawn.point(0),
        })
    }

    /// Returns the components of the receiving point and then of the four corners.
    #[inline(always)]
    fn flatten_with_point(&self, from: DVec3) -> [f64; 15] {
        let Self([a, b, c, d]) = *self;
        flatten_vectors([from, a, b, c, d])
    }
}

/// Returns the components of all vectors in one array, three per vector.
#[inline(always)]
fn flatten_vectors<const V: usize, const N: usize>(vectors: [DVec3; V]) -> [f64; N] {
    let mut row = [0.0; N];
    for (row, v) in row.as_chunks_mut::<3>().0.iter_mut().zip(vectors) {
        *row = v.to_array();
    }
    row
}

/// Returns the vector at an index of an array of components, three per vector.
#[inline(always)]
fn vector_at<const N: usize>(row: &[f64; N], index: usize) -> DVec3 {
    DVec3::new(row[3 * index], row[3 * index + 1], row[3 * index + 2])
}

/// Returns 16 numbers for a receiving point and four corners, given by their components. The first
/// 12 are the unit directions from the point to the corners. Then follow numerator and denominator
/// of tan(Ω/2) for each of the two triangles, where Ω is the triangle's solid angle.
///
/// The numerator is the volume that the directions to the triangle's corners span. The denominator
/// is 1 plus their pairwise cosines ("The Solid Angle of a Plane Triangle", Van Oosterom, Strackee
/// 1983).
#[inline(always)]
fn corner_directions_and_volumes(point_and_corners: [f64; 15]) -> [f64; 16] {
    let from = vector_at(&point_and_corners, 0);
    // Vector by vector: `map` of an array is not always inlined.
    let (a, b) = (
        (vector_at(&point_and_corners, 1) - from).normalize(),
        (vector_at(&point_and_corners, 2) - from).normalize(),
    );
    let (c, d) = (
        (vector_at(&point_and_corners, 3) - from).normalize(),
        (vector_at(&point_and_corners, 4) - from).normalize(),
    );
    let across = a.dot(c);
    let directions: [f64; 12] = flatten_vectors([a, b, c, d]);
    let mut sides = [0.0; 16];
    sides[..12].copy_from_slice(&directions);
    sides[12] = a.dot(b.cross(c)).abs();
    sides[13] = 1.0 + a.dot(b) + b.dot(c) + across;
    sides[14] = a.dot(c.cross(d)).abs();
    sides[15] = 1.0 + across + c.dot(d) + d.dot(a);
    sides
}

/// Returns the solid angles in steradians of a polygon's two triangles; zero for a missing
/// triangle. `sides` is the result of [`corner_directions_and_volumes`].
#[inline(always)]
fn triangle_solid_angles(sides: &[f64; 16]) -> [f64; 2] {
    // False for NaN too, from a corner.
    let value_of = |i: usize| {
        if sides[i] > FLAT {
            2.0 * angle_above_axis(sides[i], sides[i + 1])
        } else {
            0.0
        }
    };
    [value_of(12), value_of(14)]
}

/// Returns the offset from the receiving point to the sampled point, and the length of this offset.
///
/// A great-circle arc runs from a point on the side between first and third corner to the second
/// corner. It cuts off a part of the spherical triangle whose area has the sine `of_area` and the
/// cosine `beside`. The sampled point lies on this arc, at the fraction given by `v`.
#[inline(always)]
fn offset_to_sample(
    point_and_corners: [f64; 15],
    sides: [f64; 16],
    [is_second, of_area, beside, v]: [f64; 4],
) -> [f64; 4] {
    let select = |first: DVec3, second: DVec3| if is_second > 0.0 { second } else { first };
    let (from, first, second) = (
        vector_at(&point_and_corners, 0),
        vector_at(&point_and_corners, 1),
        vector_at(&point_and_corners, 2),
    );
    let (third, fourth) = (
        vector_at(&point_and_corners, 3),
        vector_at(&point_and_corners, 4),
    );
    let (a, b, c, d) = (
        vector_at(&sides, 0),
        vector_at(&sides, 1),
        vector_at(&sides, 2),
        vector_at(&sides, 3),
    );
    let normal = (select(second, third) - first).cross(select(third, fourth) - first);
    let (b, c) = (select(b, c), select(c, d));
    let (across_b, across_c) = (a.cross(b), a.cross(c));
    // The angle at the first corner enters by its sine and cosine alone.
    let (sine, cosine) = (across_b.cross(across_c).length(), across_b.dot(across_c));
    let both = (sine * sine + cosine * cosine).sqrt();
    let (sine, cosine) = (sine / both, cosine / both);
    let (s, t) = (
        of_area * cosine - beside * sine,
        beside * cosine + of_area * sine,
    );
    let (x, y) = (t - cosine, s + sine * a.dot(b));
    let q = ((y * t - x * s) * cosine - y) / ((y * s + x * t) * sine);
    // For an area of zero this quotient is 0/0, and the arc is the side itself.
    let q = if q < -1.0 { -1.0 } else { q };
    let q = if q < 1.0 { q } else { 1.0 };
    let on_side = a * q + normalize_or_zero(c - a * c.dot(a)) * (1.0 - q * q).sqrt();
    let h = v * (1.0 - on_side.dot(b));
    let rest = h * (2.0 - h);
    let direction = b * (1.0 - h)
        + normalize_or_zero(on_side - b * on_side.dot(b))
            * (if rest > 0.0 { rest } else { 0.0 }).sqrt();
    let distance = normal.dot(first - from) / normal.dot(direction);
    let unit_direction = direction * distance;
    [
        unit_direction.x,
        unit_direction.y,
        unit_direction.z,
        distance,
    ]
}

/// Returns a vector scaled to unit length; zero for a zero vector.
#[inline(always)]
fn normalize_or_zero(v: DVec3) -> DVec3 {
    let inverse = 1.0 / v.length();
    v * if inverse < f64::INFINITY {
        inverse
    } else {
        0.0
    }
}

/// `K` numbers for each of `N` SIMD lanes.
type PolygonColumns<const K: usize, const N: usize> = [[f64; N]; K];

#[inline(always)]
fn get_lane_numbers<const K: usize, const N: usize>(
    columns: &PolygonColumns<K, N>,
    lane: usize,
) -> [f64; K] {
    let mut row = [0.0; K];
    for (number, column) in row.iter_mut().zip(columns) {
        *number = column[lane];
    }
    row
}

#[inline(always)]
fn set_lane_numbers<const K: usize, const N: usize>(
    columns: &mut PolygonColumns<K, N>,
    lane: usize,
    row: [f64; K],
) {
    for (column, number) in columns.iter_mut().zip(row) {
        column[lane] = number;
    }
}

/// Polygons to be sampled, each with its receiving point and two uniform numbers in [0, 1), in SIMD
/// lanes.
#[derive(Clone, Copy)]
pub(super) struct PolygonLanes<const N: usize> {
    points_and_corners: PolygonColumns<15, N>,
    positions: PolygonColumns<2, N>,
}

/// Points sampled on polygons, in SIMD lanes. Meaningless in lanes whose polygon has too small a
/// solid angle.
#[derive(Clone, Copy)]
pub(super) struct PolygonSamples<const N: usize> {
    pub solid_angle: [f64; N],
    from: PolygonColumns<3, N>,
    directions: PolygonColumns<4, N>,
}

impl<const N: usize> PolygonLanes<N> {
    pub fn new() -> Self {
        Self {
            points_and_corners: [[0.0; N]; 15],
            positions: [[0.0; N]; 2],
        }
    }

    /// Sets the polygon of a lane.
    #[inline(always)]
    pub fn set_polygon(&mut self, lane: usize, Polygon(corners): &Polygon) {
        let [_, columns @ ..] = self.points_and_corners.as_chunks_mut::<3>().0 else {
            return;
        };
        for (columns, corner) in columns.iter_mut().zip(corners) {
            set_lane_numbers(columns, lane, corner.to_array());
        }
    }

    /// Sets the receiving point and the uniform numbers of a lane.
    #[inline(always)]
    pub fn set_point(&mut self, lane: usize, from: DVec3, position: [f64; 2]) {
        let [x, y, z, ..] = &mut self.points_and_corners;
        (x[lane], y[lane], z[lane]) = (from.x, from.y, from.z);
        set_lane_numbers(&mut self.positions, lane, position);
    }

    /// Samples a point in each lane, as [`Polygon::sample`] does.
    #[inline(always)]
    pub fn sample(&self) -> PolygonSamples<N> {
        let (mut sides, mut areas, mut seconds, mut solid_angle) =
            ([[0.0; N]; 16], [0.0; N], [0.0; N], [0.0; N]);
        for i in 0..N {
            set_lane_numbers(
                &mut sides,
                i,
                self::corner_directions_and_volumes(get_lane_numbers(&self.points_and_corners, i)),
            );
        }
        for i in 0..N {
            let [first, second] = triangle_solid_angles(&get_lane_numbers(&sides, i));
            solid_angle[i] = first + second;
            let at = self.positions[0][i] * solid_angle[i];
            let is_second = (second > 0.0) & (at >= first);
            areas[i] = if is_second { at - first } else { at };
            seconds[i] = if is_second { 1.0 } else { 0.0 };
        }
        let [sines, cosines] = sines_and_cosines(areas);
        let mut directions = [[0.0; N]; 4];
        for i in 0..N {
            let choice = [seconds[i], sines[i], cosines[i], self.positions[1][i]];
            set_lane_numbers(
                &mut directions,
                i,
                offset_to_sample(
                    get_lane_numbers(&self.points_and_corners, i),
                    get_lane_numbers(&sides, i),
                    choice,
                ),
            );
        }
        PolygonSamples {
            solid_angle,
            from: [
                self.points_and_corners[0],
                self.points_and_corners[1],
                self.points_and_corners[2],
            ],
            directions,
        }
    }
}

impl<const N: usize> PolygonSamples<N> {
    /// Whether the polygon in a lane has a solid angle large enough for this technique.
    #[inline(always)]
    pub fn is_large_enough(&self, lane: usize) -> bool {
        self.solid_angle[lane] >= LEAST
    }

    /// Whether the sampled point in a lane is valid after rounding. The polygon must be large
    /// enough, see [`Self::is_large_enough`].
    #[inline(always)]
    pub fn has_point(&self, lane: usize) -> bool {
        (self.directions[3][lane] > 0.0) & (self.directions[3][lane] < f64::INFINITY)
    }

    /// Returns the sampled point in a lane. Valid only if [`Self::has_point`] is true.
    #[inline(always)]
    pub fn point_unchecked(&self, lane: usize) -> DVec3 {
        let at = |axis: usize| self.from[axis][lane] + self.directions[axis][lane];
        DVec3::new(at(0), at(1), at(2))
    }

    #[inline(always)]
    fn point(&self, lane: usize) -> Option<DVec3> {
        self.has_point(lane).then(|| self.point_unchecked(lane))
    }
}

#[cfg(test)]
mod tests;
