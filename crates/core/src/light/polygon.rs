//! The solid angle under which a triangle or a quad is seen, drawn evenly ("Stratified Sampling of Spherical Triangles", Arvo 1995).
//!
//! Each step is one formula over numbers, without a branch. For several polygons at a time, [`PolygonBatch::draw`] computes a step of all of them
//! before the next one of any, in loops that the compiler turns into vectors; libm's functions go one by one between.

use core::array::from_fn;

use glam::DVec3;
use raywright_bvh::{Loops, widest};

/// Below so many steradians points are drawn by area: distances and slants differ too little to matter, and the angles of so
/// small a triangle keep too few digits.
const LEAST: f64 = 1e-3;

/// Least volume that directions to three corners span: in the plane of a triangle they are dependent.
const FLAT: f64 = 1e-12;

/// Polygons that are drawn from at a time.
pub(super) const LANES: usize = 8;

/// A polygon of one or two triangles: its corners in order, of a triangle the last one twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polygon([DVec3; 4]);

/// A point drawn on a polygon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PolygonSample {
    /// Steradians of the whole polygon.
    pub solid_angle: f64,
    /// None where rounding leaves none.
    pub point: Option<DVec3>,
}

impl Polygon {
    /// A triangle.
    pub fn triangle([a, b, c]: [DVec3; 3]) -> Self {
        Self([a, b, c, c])
    }

    /// A quad.
    pub fn quad(corners: [DVec3; 4]) -> Self {
        Self(corners)
    }

    /// Its solid angle as `from` sees it; none where it is small, and from its own plane.
    #[inline]
    pub fn solid_angle(&self, from: DVec3) -> Option<f64> {
        let [first, second] = angles(&sides(self.row(from)));
        let solid_angle = first + second;
        (solid_angle >= LEAST).then_some(solid_angle)
    }

    /// Draws a point of it as `from` sees it, by two numbers in [0, 1); none where it is seen as so small, or so flat, that its points are
    /// better drawn by area.
    pub(super) fn draw(&self, from: DVec3, position: [f64; 2]) -> Option<PolygonSample> {
        let seen = self.row(from);
        let sides = sides(seen);
        let (solid_angle, choice) = choice(&sides, position)?;
        Some(PolygonSample { solid_angle, point: point(from, offset(seen, sides, choice)) })
    }

    /// The point that sees it, and its corners.
    #[inline(always)]
    fn row(&self, from: DVec3) -> [f64; 15] {
        let Self([a, b, c, d]) = *self;
        row([from, a, b, c, d])
    }
}

/// Numbers of vectors one after the other.
#[inline(always)]
fn row<const V: usize, const N: usize>(vectors: [DVec3; V]) -> [f64; N] {
    from_fn(|i| vectors[i / 3][i % 3])
}

/// A vector of a row.
#[inline(always)]
fn vector<const N: usize>(row: &[f64; N], place: usize) -> DVec3 {
    DVec3::new(row[3 * place], row[3 * place + 1], row[3 * place + 2])
}

/// Of what a point sees of four corners: the directions to them, and of both triangles the volume that its three directions span and the
/// number beside it in "The Solid Angle of a Plane Triangle" (Van Oosterom, Strackee 1983).
#[inline(always)]
fn sides(seen: [f64; 15]) -> [f64; 16] {
    let from = vector(&seen, 0);
    let [a, b, c, d]: [DVec3; 4] = from_fn(|corner| (vector(&seen, 1 + corner) - from).normalize());
    let across = a.dot(c);
    let directions: [f64; 12] = row([a, b, c, d]);
    let mut sides = [0.0; 16];
    sides[..12].copy_from_slice(&directions);
    sides[12] = a.dot(b.cross(c)).abs();
    sides[13] = 1.0 + a.dot(b) + b.dot(c) + across;
    sides[14] = a.dot(c.cross(d)).abs();
    sides[15] = 1.0 + across + c.dot(d) + d.dot(a);
    sides
}

/// The solid angles of both triangles; zero of one that is not there.
#[inline(always)]
fn angles(sides: &[f64; 16]) -> [f64; 2] {
    // Also false for NaN, from a corner.
    [12, 14].map(|i| if sides[i] > FLAT { 2.0 * libm::atan2(sides[i], sides[i + 1]) } else { 0.0 })
}

/// The solid angle of both triangles, and what [`offset`] takes of two numbers in [0, 1); none where it is small.
#[inline(always)]
fn choice(sides: &[f64; 16], [u, v]: [f64; 2]) -> Option<(f64, [f64; 4])> {
    let [first, second] = angles(sides);
    let solid_angle = first + second;
    let at = u * solid_angle;
    let is_second = second > 0.0 && at >= first;
    let area = if is_second { at - first } else { at };
    (solid_angle >= LEAST).then(|| {
        let (sine, cosine) = libm::sincos(area);
        (solid_angle, [f64::from(u8::from(is_second)), sine, cosine, v])
    })
}

/// The point that an [`offset`] leads to.
#[inline(always)]
fn point(from: DVec3, [x, y, z, distance]: [f64; 4]) -> Option<DVec3> {
    (distance > 0.0 && distance.is_finite()).then(|| from + DVec3::new(x, y, z))
}

/// Of a point that sees a polygon: the way to the point that leaves an area, whose sine and cosine are known, on one side of the arc from it to
/// the second corner, and a share `v` of what is left along that arc.
#[inline(always)]
fn offset(seen: [f64; 15], sides: [f64; 16], [is_second, of_area, beside, v]: [f64; 4]) -> [f64; 4] {
    let select = |first: DVec3, second: DVec3| if is_second > 0.0 { second } else { first };
    let [from, first, second, third, fourth]: [DVec3; 5] = from_fn(|i| vector(&seen, i));
    let [a, b, c, d]: [DVec3; 4] = from_fn(|i| vector(&sides, i));
    let normal = (select(second, third) - first).cross(select(third, fourth) - first);
    let (b, c) = (select(b, c), select(c, d));
    let (across_b, across_c) = (a.cross(b), a.cross(c));
    // Of the angle between both arcs only sine and cosine are asked, which take no angle.
    let (sine, cosine) = (across_b.cross(across_c).length(), across_b.dot(across_c));
    let both = (sine * sine + cosine * cosine).sqrt();
    let (sine, cosine) = (sine / both, cosine / both);
    let (s, t) = (of_area * cosine - beside * sine, beside * cosine + of_area * sine);
    let (x, y) = (t - cosine, s + sine * a.dot(b));
    let q = ((y * t - x * s) * cosine - y) / ((y * s + x * t) * sine);
    // Where the area is nothing this is nothing by nothing, and the arc the side itself.
    let q = if q < -1.0 { -1.0 } else { q };
    let q = if q < 1.0 { q } else { 1.0 };
    let on_side = a * q + unit(c - a * c.dot(a)) * (1.0 - q * q).sqrt();
    let h = v * (1.0 - on_side.dot(b));
    let rest = h * (2.0 - h);
    let direction = b * (1.0 - h) + unit(on_side - b * on_side.dot(b)) * (if rest > 0.0 { rest } else { 0.0 }).sqrt();
    let distance = normal.dot(first - from) / normal.dot(direction);
    let way = direction * distance;
    [way.x, way.y, way.z, distance]
}

/// The unit vector of a direction; zero where it has none.
#[inline(always)]
fn unit(v: DVec3) -> DVec3 {
    let inverse = 1.0 / v.length();
    v * if inverse < f64::INFINITY { inverse } else { 0.0 }
}

/// A number in each lane, so many of them.
type Columns<const K: usize> = [[f64; LANES]; K];

#[inline(always)]
fn lane<const K: usize>(columns: &Columns<K>, lane: usize) -> [f64; K] {
    from_fn(|k| columns[k][lane])
}

#[inline(always)]
fn put<const K: usize>(columns: &mut Columns<K>, lane: usize, row: [f64; K]) {
    for (column, number) in columns.iter_mut().zip(row) {
        column[lane] = number;
    }
}

/// [`sides`] in every lane.
struct Sides<'a>(&'a Columns<15>);

impl Loops for Sides<'_> {
    type Output = Columns<16>;
    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut out = [[0.0; LANES]; 16];
        for i in 0..LANES {
            put(&mut out, i, sides(lane(self.0, i)));
        }
        out
    }
}

/// [`offset`] in every lane.
struct Offsets<'a>(&'a Columns<15>, &'a Columns<16>, &'a Columns<4>);

impl Loops for Offsets<'_> {
    type Output = Columns<4>;
    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut out = [[0.0; LANES]; 4];
        for i in 0..LANES {
            put(&mut out, i, offset(lane(self.0, i), lane(self.1, i), lane(self.2, i)));
        }
        out
    }
}

/// Polygons to be drawn from together, each as a point sees it and with two numbers in [0, 1).
#[derive(Default)]
pub(super) struct PolygonBatch {
    seen: Columns<15>,
    positions: [[f64; 2]; LANES],
    len: usize,
}

impl PolygonBatch {
    pub fn is_full(&self) -> bool {
        self.len == LANES
    }

    /// Adds a polygon, unless it is full.
    #[inline]
    pub fn push(&mut self, polygon: &Polygon, from: DVec3, position: [f64; 2]) {
        if !self.is_full() {
            put(&mut self.seen, self.len, polygon.row(from));
            self.positions[self.len] = position;
            self.len += 1;
        }
    }

    /// What [`Polygon::draw`] gives of each, in their order; leaves none.
    pub fn draw(&mut self) -> impl Iterator<Item = Option<PolygonSample>> {
        let Self { seen, positions, len } = self;
        let mut samples = [None; LANES];
        let count = core::mem::take(len);
        let sides = widest(Sides(seen));
        let mut choices = [[0.0; LANES]; 4];
        for (i, (&position, sample)) in positions.iter().zip(&mut samples).enumerate().take(count) {
            if let Some((solid_angle, choice)) = choice(&lane(&sides, i), position) {
                put(&mut choices, i, choice);
                *sample = Some(PolygonSample { solid_angle, point: None });
            }
        }
        let offsets = widest(Offsets(seen, &sides, &choices));
        for (i, sample) in samples.iter_mut().enumerate() {
            if let Some(sample) = sample {
                let from = DVec3::new(seen[0][i], seen[1][i], seen[2][i]);
                sample.point = point(from, lane(&offsets, i));
            }
        }
        samples.into_iter().take(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::mix;

    /// A polygon, a point that sees it, and two numbers.
    fn query(i: u64) -> (Polygon, DVec3, [f64; 2]) {
        let number = |k: u64| (mix(i * 32 + k) >> 11) as f64 / (1_u64 << 53) as f64;
        let place = |k: u64| DVec3::new(number(k), number(k + 1), number(k + 2)) * 4.0;
        let (a, u, v) = (place(0), place(3) - place(6), place(9) - place(12));
        let polygon =
            if i.is_multiple_of(3) { Polygon::triangle([a, a + u, a + v]) } else { Polygon::quad([a, a + u, a + u + v, a + v]) };
        let from = match i % 16 {
            // A corner, and a place in its plane.
            0 => a,
            1 => a + u * 3.0,
            _ => place(15),
        };
        let position = if i.is_multiple_of(7) { [0.0; 2] } else { [number(18), number(19)] };
        (polygon, from, position)
    }

    /// Protects: several polygons together give each the point and solid angle that it has alone, to the bit, whichever lanes are used; the solid
    /// angle is the one that is told of a polygon by itself; and points lie on their polygons.
    #[test]
    fn lanes_have_the_points_of_one() {
        let queries: Vec<_> = (0..4_000).map(query).collect();
        let (mut drawn, mut small) = (0, 0);
        let mut batch = PolygonBatch::default();
        for (turn, queries) in queries.chunks(LANES).enumerate() {
            let queries = &queries[..1 + turn % LANES];
            queries.iter().for_each(|(polygon, from, position)| batch.push(polygon, *from, *position));
            let together: Vec<_> = batch.draw().collect();
            assert_eq!(together.len(), queries.len());
            for (sample, (polygon, from, position)) in together.into_iter().zip(queries) {
                assert_eq!(sample, polygon.draw(*from, *position), "{polygon:?} from {from}");
                assert_eq!(sample.map(|sample| sample.solid_angle), polygon.solid_angle(*from), "{polygon:?} from {from}");
                small += usize::from(sample.is_none());
                let Some(point) = sample.and_then(|sample| sample.point) else { continue };
                drawn += 1;
                let Polygon([a, b, c, d]) = *polygon;
                let normal = (b - a).cross(c - a).normalize();
                let size = (c - a).length() + (d - b).length();
                assert!((point - a).dot(normal).abs() < 1e-9 * size, "{polygon:?}: {point} off the plane");
                let corners = [a, b, c, d];
                for (first, second) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                    let inwards = normal.cross(second - first).dot(point - first);
                    assert!(inwards > -1e-6 * size * size, "{polygon:?}: {point} outside");
                }
            }
        }
        assert!(drawn > 1_500 && small > 50, "{drawn} {small}");
    }
}
