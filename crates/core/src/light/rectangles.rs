//! Rectangular lamps, at most eight, as tables that SIMD lanes look up: each lane samples the lamp that
//! it chose. There may be distant lights too, which other vertices choose. The computations are in
//! `f32`. Shadow rays to a lamp before which nothing lies end a little before it, outside its box. Other
//! shadow rays end at the exact place in f64, as those to other lamps do: a cover of a lamp may be as near
//! to it.
//!
//! **Error of densities.** Let U = 2⁻²⁴, h the height of the receiving point above the lamp's plane, r its
//! distance from the sampled point, e the sum of both edges, and D ≤ r + e its distance from the corner.
//! Corners are `f32` and exact. Each coordinate in the lamp's frame is a product with a rounded unit vector:
//! one U of the difference from the corner, one of the vector, three of products and sums, so 5 U D.
//! - By area the density is r³ / (A h), that of the hit h² / (A c³), where c is the cosine of the stored
//!   direction. The height has an error of 5 U D. The offset to the point, of which c is taken, leaves the
//!   plane by U (D + 3 e + 2 r): the difference, products with rounded axes and their sum, the last sum and
//!   the direction's rounding. So the ratio is off by 5 U D / h + 3 U (D + 3 e + 2 r) / h ≤ U (14 r + 17 e) / h.
//! - The solid angle is an integral of h / r³. At the angle a from the normal, errors of 5 U D of all three
//!   coordinates change it by at most |1 − 3 cos² a| + 3 √2 sin a cos a ≤ 3.1 times 5 U D / h, relatively:
//!   U 15.5 (r + e) / h.
//!
//! So a density has a relative error of at most 64 U, for its own arithmetic, and 17 U (r + e) / h.

use core::f32::consts::FRAC_1_PI;
use core::ops::Range;

use glam::DVec3;
use raywright_bvh::{
    Aabb, Geometry, LaneAngles, LaneFloats, LaneVector, Real, SIMD_WIDTH, Surface, SurfacePoint,
};

use super::polygon::LEAST;
use super::tree::LightNode;
use super::{LightId, Lights, add_numbers};

/// Distance of a shadow ray's end from its lamp: per unit of the lamp's greatest coordinate, and of its
/// longest edge. The lamp's box is padded by half of it ([`Aabb::to_padded`]), so that the ray does not
/// enter it; rounding of the end takes at most a quarter.
const END_DISTANCE: [f64; 2] = [1.0 / (1 << 20) as f64, 1.0 / (1 << 22) as f64];
/// The same per unit of the ray's length: four units of rounding, of its direction and length.
const END_BY_LENGTH: f32 = 1.0 / (1 << 22) as f32;
/// Height of the space before a lamp that must be empty, over the part of the distance without the length.
const CLEARANCE: f64 = 16.0;
/// Greatest deviation of a lamp from a rectangle, per unit of its edges.
const SKEW: f64 = 1e-6;
/// Least and greatest length of an edge in metres: no product of three lengths leaves the range of
/// `f32`.
const LENGTHS: Range<f64> = 1e-9..1e9;

/// A rectangular lamp of uniform emission.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rectangle {
    pub corner: DVec3,
    /// The edges from the corner.
    pub edges: [DVec3; 2],
    pub radiance: DVec3,
    /// Bound on the error of later intersection tests.
    pub error: f64,
    /// Whether the emitting side is that from which the edges, in their order, turn clockwise.
    pub is_inside: bool,
    pub is_two_sided: bool,
}

impl Rectangle {
    /// Returns the rectangle of four corners in order; `None` for other quads.
    pub fn from_corners([a, b, c, d]: [DVec3; 4]) -> Option<[DVec3; 2]> {
        let (x, y) = (b - a, d - a);
        let (length, other) = (x.length(), y.length());
        let is_right = x.dot(y).abs() <= SKEW * length * other;
        let is_closed = (a + x + y - c).length() <= SKEW * length.min(other);
        let has_range = LENGTHS.contains(&length) && LENGTHS.contains(&other);
        (is_right && is_closed && has_range).then_some([x, y])
    }

    /// Distance of a shadow ray's end from the lamp, without the part by the ray's length.
    fn end_distance(&self) -> f64 {
        let ([x, y], a) = (self.edges, self.corner);
        let scale = a.abs().max((a + x).abs()).max((a + y).abs());
        let scale = scale.max((a + x + y).abs()).max_element();
        scale * END_DISTANCE[0] + x.length().max(y.length()) * END_DISTANCE[1] + self.error
    }
}

/// One number for each lamp.
type LampColumn = [f32; SIMD_WIDTH];

/// Tables of rectangular lamps.
#[derive(Clone, Debug)]
pub(crate) struct RectangleLamps {
    /// The node of the light tree that chooses a lamp; `None` for a single lamp.
    node: Option<LightNode>,
    /// Probability of choosing a distant light instead of a lamp.
    far_share: f64,
    /// Emitters of the lamps; unused entries repeat one of them.
    pub emitters: [u32; SIMD_WIDTH],
    corner: [LampColumn; 3],
    /// Unit vectors along the edges.
    axes: [[LampColumn; 3]; 2],
    /// Lengths of the edges.
    lengths: [LampColumn; 2],
    /// Unit normal of the emitting side.
    normal: [LampColumn; 3],
    radiance: [LampColumn; 3],
    /// The lamps in f64, for the exact ends of shadow rays.
    rectangles: [Rectangle; SIMD_WIDTH],
    /// Distance of the ends of other shadow rays, without the part by the ray's length.
    end_distance: LampColumn,
    /// Height of the empty space before a lamp; zero if something lies in it.
    clearance: LampColumn,
    /// 1 for a lamp that emits from both sides, else 0.
    two_sided: LampColumn,
}

/// A lamp chosen for a point and a point sampled on the lamp. Numbers may be SIMD lanes.
pub(crate) struct RectangleSample<F> {
    /// Index of the lamp.
    pub lamp: F,
    /// Unit direction to the point.
    pub direction: LaneVector<F>,
    /// Density by solid angle, times the probability of the lamp. Zero if no light arrives.
    pub density: F,
    pub radiance: LaneVector<F>,
    /// Distances of the point from the lamp's corner along both edges, per length of the edge.
    pub place: [F; 2],
    /// End of a shadow ray before the lamp.
    pub end: LaneVector<F>,
    /// Positive if nothing can lie between this end and the lamp.
    pub end_margin: F,
    /// Unit normal of the lamp on the side of the receiving point.
    pub normal: LaneVector<F>,
}

impl<R: Real> Lights<R> {
    /// Returns the tables of the nearby lights; `None` unless all are rectangles that one node of the light
    /// tree chooses from.
    pub(crate) fn rectangle_lamps(&self, geometry: &Geometry<R>) -> Option<RectangleLamps> {
        let none = [0.0; SIMD_WIDTH];
        let (node, children) = self.light_sampler.single_node()?;
        let Some(LightId::Emitter(any)) = children.into_iter().flatten().next() else {
            return None;
        };
        let mut lamps = RectangleLamps {
            node: node.cloned(),
            far_share: self.light_sampler.far_share(),
            emitters: [any; SIMD_WIDTH],
            corner: [none; 3],
            axes: [[none; 3]; 2],
            lengths: [[1.0; SIMD_WIDTH]; 2],
            normal: [none; 3],
            radiance: [none; 3],
            rectangles: [Rectangle::default(); SIMD_WIDTH],
            end_distance: none,
            clearance: none,
            two_sided: none,
        };
        for (lane, child) in children.into_iter().enumerate() {
            let Some(light) = child else { continue };
            let LightId::Emitter(emitter) = light else {
                return None;
            };
            lamps.emitters[lane] = emitter;
            let rectangle = self.emitters.rectangle(emitter)?;
            lamps.set_lamp(lane, &rectangle);
            let end = rectangle.end_distance();
            lamps.end_distance[lane] = end as f32;
            if self.is_clear(geometry, emitter, (&rectangle, CLEARANCE * end)) {
                lamps.clearance[lane] = (CLEARANCE * end) as f32;
            }
        }
        Some(lamps)
    }

    /// Whether nothing but the lamp itself lies at most `height` before it, on each side that shines.
    /// What is nearer than the exact end of a shadow ray does not count.
    fn is_clear(
        &self,
        geometry: &Geometry<R>,
        emitter: u32,
        (rectangle, height): (&Rectangle, f64),
    ) -> bool {
        let [x, y] = rectangle.edges;
        let (side_x, side_y) = (x.normalize() * height, y.normalize() * height);
        let outwards = x.cross(y).normalize() * if rectangle.is_inside { -1.0 } else { 1.0 };
        let least = rectangle.error;
        let is_empty = |normal: DVec3| {
            let low = rectangle.corner - side_x - side_y + normal * least;
            let (x, y) = (x + side_x * 2.0, y + side_y * 2.0);
            let face = [low, low + x, low + y, low + x + y];
            let opposite = face.map(|corner| corner + normal * (height - least));
            let space = Aabb::from_points(face.into_iter().chain(opposite));
            !geometry.visit_box(&space, &mut |object, primitive, corners| {
                let heights =
                    corners.map(|corners| corners.map(|p| normal.dot(p - rectangle.corner)));
                let is_beside = heights.is_some_and(|heights| {
                    heights.iter().all(|&at| at <= least) || heights.iter().all(|&at| at >= height)
                });
                !is_beside && self.emitters.emitter_index_of(object, primitive) != Some(emitter)
            })
        };
        is_empty(outwards) && (!rectangle.is_two_sided || is_empty(-outwards))
    }
}

impl RectangleLamps {
    fn set_lamp(&mut self, lane: usize, rectangle: &Rectangle) {
        let [x, y] = rectangle.edges;
        let a = rectangle.corner;
        let outwards = if rectangle.is_inside { -1.0 } else { 1.0 };
        let [along_x, along_y] = &mut self.axes;
        for (columns, vector) in [
            (&mut self.corner, a),
            (along_x, x.normalize()),
            (along_y, y.normalize()),
            (&mut self.normal, x.cross(y).normalize() * outwards),
            (&mut self.radiance, rectangle.radiance),
        ] {
            for (column, number) in columns.iter_mut().zip(vector.to_array()) {
                column[lane] = number as f32;
            }
        }
        for (column, edge) in self.lengths.iter_mut().zip(rectangle.edges) {
            column[lane] = edge.length() as f32;
        }
        self.rectangles[lane] = *rectangle;
        self.two_sided[lane] = f32::from(u8::from(rectangle.is_two_sided));
    }

    /// Whether a lamp is chosen for a point, not a distant light, by its numbers for the light.
    #[inline(always)]
    pub fn are_chosen(&self, [coarse, fine, ..]: [f32; 4]) -> bool {
        add_numbers(coarse, fine) >= self.far_share
    }

    /// Returns the surface of a lamp at a sampled place, at which a shadow ray ends.
    #[inline(always)]
    pub fn surface<R: Real>(&self, lamp: usize, [a, b]: [f32; 2]) -> Surface<R> {
        let rectangle = &self.rectangles[lamp % SIMD_WIDTH];
        let [x, y] = rectangle.edges;
        let point = rectangle.corner + x * f64::from(a) + y * f64::from(b);
        SurfacePoint::new(point, x.cross(y).normalize(), rectangle.error).to_scalar()
    }

    /// Chooses a lamp as the light tree does, with the bits of its choice and probability. Returns the
    /// lamp's index and its probability, zero if no light arrives.
    #[inline(always)]
    fn choose<F: LaneFloats>(
        &self,
        from: LaneVector<F>,
        normal: LaneVector<F>,
        u: F::Doubles,
    ) -> [F; 2] {
        let like = from.x;
        let near_share = like.double_like(1.0 - self.far_share);
        let Some(node) = &self.node else {
            return [like.like(0.0), like.narrow_like(near_share)];
        };
        let u = (u - like.double_like(self.far_share)) / near_share;
        let receiver =
            node.local_receiver([from.x.widen(), from.y.widen(), from.z.widen()], normal);
        let chosen = node.choose_child(&receiver, u);
        let zero = like.double_like(0.0);
        // Zero for a sum of zero and for NaN.
        let probability =
            like.select_at_most([chosen.total, zero], zero, chosen.importance / chosen.total);
        let probability = like.narrow_like(probability * near_share);
        let zero = like.like(0.0);
        [
            like.narrow_like(chosen.index),
            zero.select_less(probability, probability, zero),
        ]
    }

    /// Samples a lamp and a point of the lamp for the receiving point `from` with the unit `normal`,
    /// by three uniform numbers in [0, 1): the first for the lamp.
    #[inline(always)]
    pub fn sample<F: LaneFloats>(
        &self,
        (from, normal): (LaneVector<F>, LaneVector<F>),
        u_lamp: F::Doubles,
        position: [F; 2],
    ) -> RectangleSample<F> {
        let [lamp, probability] = self.choose(from, normal, u_lamp);
        let (zero, one) = (lamp.like(0.0), lamp.like(1.0));
        let axes = [
            LaneVector::lookup(lamp, &self.axes[0]),
            LaneVector::lookup(lamp, &self.axes[1]),
        ];
        let lamp_normal = LaneVector::lookup(lamp, &self.normal);
        // The difference of stored coordinates keeps the digits of a point near the lamp.
        let corner = LaneVector::lookup(lamp, &self.corner);
        let to_corner = corner - from;
        let lengths = [lamp.lookup(&self.lengths[0]), lamp.lookup(&self.lengths[1])];
        let height = -lamp_normal.dot(to_corner);
        let seen = RectangleView::new(
            [to_corner.dot(axes[0]), to_corner.dot(axes[1])],
            height.abs(),
            lengths,
        );
        let [a, b] = seen.sample(position);
        let along = axes[0] * a + axes[1] * b;
        let offset = to_corner + along;
        let squared = offset.dot(offset);
        let inverse = one / squared.sqrt();
        let direction = offset * inverse;
        // The cosine at the lamp; negative behind a lamp that emits from one side.
        let side = zero.select_less(lamp.lookup(&self.two_sided), height.abs(), height);
        let cosine = side * inverse;
        let by_area = squared / (lengths[0] * lengths[1] * cosine);
        let even = seen
            .is_large()
            .select_less(zero, by_area, one / seen.solid_angle);
        let density = zero.select_less(cosine, even * probability, zero);
        let density = density.select_less(lamp.like(f32::INFINITY), density, zero);
        let before = lamp.lookup(&self.end_distance) + squared * inverse * lamp.like(END_BY_LENGTH);
        let normal = lamp_normal * one.flip_sign(height);
        RectangleSample {
            lamp,
            direction,
            density,
            radiance: LaneVector::lookup(lamp, &self.radiance),
            place: [a / lengths[0], b / lengths[1]],
            end: corner + along + normal * before,
            end_margin: lamp.lookup(&self.clearance) - before,
            normal,
        }
    }
}

/// A rectangle as seen from a point, in a frame along its edges with the point as origin.
struct RectangleView<F> {
    /// Coordinates of the sides along both edges.
    low: [F; 2],
    high: [F; 2],
    /// Distance of the point from the rectangle's plane.
    height: F,
    solid_angle: F,
}

impl<F: LaneFloats> RectangleView<F> {
    #[inline(always)]
    fn new([x, y]: [F; 2], height: F, lengths: [F; 2]) -> Self {
        let (low, high) = ([x, y], [x + lengths[0], y + lengths[1]]);
        // Solid angles of the two triangles ("The Solid Angle of a Plane Triangle", Van Oosterom,
        // Strackee 1983). Their numerator is a product, which keeps its digits for far lamps.
        let squared = height * height;
        let (xx, yy) = (x * high[0] + squared, y * high[1] + squared);
        let (x0, x1, y0, y1) = (x * x, high[0] * high[0], y * y, high[1] * high[1]);
        let (a, b) = ((x0 + y0 + squared).sqrt(), (x1 + y0 + squared).sqrt());
        let (c, d) = ((x1 + y1 + squared).sqrt(), (x0 + y1 + squared).sqrt());
        let across = x * high[0] + yy;
        let volume = height * lengths[0] * lengths[1];
        let ac = a * c + across;
        let first = ac * b + (xx + y0) * c + (x1 + yy) * a;
        let second = ac * d + (x0 + yy) * c + (xx + y1) * a;
        let solid_angle = (volume.angle_from(first) + volume.angle_from(second)) * x.like(2.0);
        Self {
            low,
            high,
            height,
            solid_angle,
        }
    }

    /// Returns a number that is negative if points are sampled by area, not by solid angle.
    #[inline(always)]
    fn is_large(&self) -> F {
        self.solid_angle - self.solid_angle.like(LEAST as f32)
    }

    /// Samples a point uniformly by solid angle ("An Area-Preserving Parametrization for Spherical
    /// Rectangles", Ureña, Fajardo, King 2013), or by area if the rectangle looks small. Returns its
    /// distances from the first corner along both edges.
    #[inline(always)]
    fn sample(&self, [u, v]: [F; 2]) -> [F; 2] {
        let (zero, one) = (u.like(0.0), u.like(1.0));
        let (low, high) = (self.low, self.high);
        let tiny = u.like(1e-30);
        let squared = self.height * self.height + tiny;
        // Cosines between the plane's normal and those of the planes through the point and each side.
        let (n0, n1) = (-side_cosine(low[1], squared), side_cosine(high[0], squared));
        let (n2, n3) = (side_cosine(high[1], squared), -side_cosine(low[0], squared));
        let (g0, g1) = (arc_sine(n0 * n1), arc_sine(n1 * n2));
        let (g2, g3) = (arc_sine(n2 * n3), arc_sine(n3 * n0));
        let turns = (u * (g0 + g1 + g2 + g3) - g2 - g3) * u.like(0.5 * FRAC_1_PI) + u.like(0.5);
        let turns = turns.max_or_second(zero).min_or_second(one);
        let [cosine, sine] = turns.cos_sin_turns();
        let sine = sine.abs().max_or_second(u.like(1e-12)).flip_sign(sine);
        let across = (cosine * n0 - n2) / sine;
        let upright = one / (across * across + n0 * n0 + tiny).sqrt();
        let rest = (one - upright) * (one + upright);
        let x = self.height * upright / rest.max_or_second(u.like(1e-14)).sqrt();
        let x = x
            .flip_sign(across)
            .max_or_second(low[0])
            .min_or_second(high[0]);
        let beside = x * x + squared;
        let (h0, h1) = (side_cosine(low[1], beside), side_cosine(high[1], beside));
        let h = h0 + v * (h1 - h0);
        let rest = ((one - h) * (one + h)).max_or_second(u.like(1e-14));
        let y = h * (beside / rest).sqrt();
        let y = y.max_or_second(low[1]).min_or_second(high[1]);
        let is_large = self.is_large();
        [
            is_large.select_less(zero, u * (high[0] - low[0]), x - low[0]),
            is_large.select_less(zero, v * (high[1] - low[1]), y - low[1]),
        ]
    }
}

/// Returns `a` divided by the distance of a point at `a` along an axis from the origin, which lies
/// beside the axis by the root of `squared`.
#[inline(always)]
fn side_cosine<F: LaneFloats>(a: F, squared: F) -> F {
    a / (a * a + squared).sqrt()
}

/// Returns the arc sine of a number from −1 to 1.
#[inline(always)]
fn arc_sine<F: LaneFloats>(sine: F) -> F {
    let one = sine.like(1.0);
    let rest = ((one - sine) * (one + sine)).max_or_second(sine.like(0.0));
    sine.angle_from(rest.sqrt())
}

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::lamps as lamps_scene;
