//! Rectangular lamps, at most eight, as tables that SIMD lanes look up: each lane samples the lamp that
//! it chose. The computations are in `f32`. With U = 2⁻²⁴, the density of a point has a relative error of
//! at most 64 U, and 8 U times the ratio of distance and coordinates to the height above the lamp's
//! plane. Shadow rays end at the exact place in f64, as those to other lamps do: a cover of a lamp may be as
//! near to it.

use core::f32::consts::FRAC_1_PI;
use core::ops::Range;

use glam::DVec3;
use raywright_bvh::{LaneAngles, LaneFloats, LaneVector, Real, SIMD_WIDTH, Surface, SurfacePoint};

use super::polygon::LEAST;
use super::tree::LightNode;
use super::{LightId, Lights};

/// Greatest deviation of a lamp from a rectangle, per unit of its edges.
const SKEW: f64 = 1e-6;
/// Least and greatest length of an edge in metres: no product of three lengths leaves the range of
/// `f32`.
const LENGTHS: Range<f64> = 1e-9..1e9;

/// A rectangular lamp of uniform emission.
#[derive(Clone, Copy, Debug)]
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
}

/// One number for each lamp.
type LampColumn = [f32; SIMD_WIDTH];

/// Tables of rectangular lamps.
#[derive(Clone, Debug)]
pub(crate) struct RectangleLamps {
    /// The node of the light tree that chooses a lamp; `None` for a single lamp.
    node: Option<LightNode>,
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
    /// The lamps in f64, for the ends of shadow rays.
    frames: [LampFrame; SIMD_WIDTH],
    /// 1 for a lamp that emits from both sides, else 0.
    two_sided: LampColumn,
}

/// A lamp in f64.
#[derive(Clone, Copy, Debug, Default)]
struct LampFrame {
    corner: DVec3,
    /// Unit vectors along the edges.
    axes: [DVec3; 2],
    normal: DVec3,
    /// Bound on the error of later intersection tests.
    error: f64,
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
    /// Distances of the point from the lamp's corner along both edges, in metres.
    pub place: [F; 2],
}

impl<R: Real> Lights<R> {
    /// Returns the tables of the lights; `None` unless all are rectangles that one node of the light
    /// tree chooses from.
    pub(crate) fn rectangle_lamps(&self) -> Option<RectangleLamps> {
        let none = [0.0; SIMD_WIDTH];
        let (node, children) = self.light_sampler.single_node()?;
        let Some(LightId::Emitter(any)) = children.into_iter().flatten().next() else {
            return None;
        };
        let mut lamps = RectangleLamps {
            node: node.cloned(),
            emitters: [any; SIMD_WIDTH],
            corner: [none; 3],
            axes: [[none; 3]; 2],
            lengths: [[1.0; SIMD_WIDTH]; 2],
            normal: [none; 3],
            radiance: [none; 3],
            frames: [LampFrame::default(); SIMD_WIDTH],
            two_sided: none,
        };
        for (lane, child) in children.into_iter().enumerate() {
            let Some(light) = child else { continue };
            let LightId::Emitter(emitter) = light else {
                return None;
            };
            lamps.emitters[lane] = emitter;
            lamps.set_lamp(lane, &self.emitters.rectangle(emitter)?);
        }
        Some(lamps)
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
        let axes = [x.normalize(), y.normalize()];
        self.frames[lane] = LampFrame {
            corner: a,
            axes,
            normal: axes[0].cross(axes[1]).normalize(),
            error: rectangle.error,
        };
        self.two_sided[lane] = f32::from(u8::from(rectangle.is_two_sided));
    }

    /// Returns the surface of a lamp at a sampled place, at which a shadow ray ends.
    #[inline(always)]
    pub fn surface<R: Real>(&self, lamp: usize, place: [f32; 2]) -> Surface<R> {
        let frame = &self.frames[lamp % SIMD_WIDTH];
        let [a, b] = place.map(f64::from);
        let point = frame.corner + frame.axes[0] * a + frame.axes[1] * b;
        SurfacePoint::new(point, frame.normal, frame.error).to_scalar()
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
        let Some(node) = &self.node else {
            return [like.like(0.0), like.like(1.0)];
        };
        let receiver =
            node.local_receiver([from.x.widen(), from.y.widen(), from.z.widen()], normal);
        let chosen = node.choose_child(&receiver, u);
        let zero = like.double_like(0.0);
        // Zero for a sum of zero and for NaN.
        let probability =
            like.select_at_most([chosen.total, zero], zero, chosen.importance / chosen.total);
        let probability = like.narrow_like(probability);
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
        RectangleSample {
            lamp,
            direction,
            density,
            radiance: LaneVector::lookup(lamp, &self.radiance),
            place: [a, b],
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
