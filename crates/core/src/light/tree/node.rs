//! A node of the light tree with eight children. The importance of a child at a point is computed in
//! `f32` without branches, for one point or for eight points in SIMD lanes.
//!
//! Building a node avoids the limits of the range of `f32`. Positions are relative to the node's
//! centre in units of its size; intensities are fractions of the node's. Radii and cosines are
//! enlarged to cover rounding: no light that may arrive is excluded.

use core::f64::consts::PI;
use core::ops::Add;

use glam::DVec3;
use raywright_bvh::{LaneFloats, LaneVector, SIMD_WIDTH};

use super::build::LightCluster;
use super::{LightTree, LightTreeChild, ReceivingPoint};

/// Number of children of a node.
pub(super) const WIDTH: usize = SIMD_WIDTH;

/// Bound on the rounding error of a cosine in `f32`: some ten roundings of 2⁻²⁴.
const MARGIN: f32 = 4e-6;
/// Added to the cosine of the angle to a child's axis. The sine computed from the enlarged cosine
/// never belongs to a greater angle than the true angle. Otherwise the angle would be up to 10⁻³
/// too great near cosines of ±1.
const SLACK: f32 = 2e-6;
/// Bound on the rounding error of a position, in units of the node's radius.
const MOVED: f64 = 5e-7;
/// Least fraction of a child's intensity in that of its node: no product of fractions, cosines and
/// distances underflows `f32`.
const FAINTEST: f64 = 1e-20;
/// Distance in units of the node's radius from which on point and node are scaled down together:
/// squared distances would overflow `f32`.
const FAR: f64 = 1e3;

/// A node of the light tree: eight children, each a light or a node. A missing child has zero
/// intensity.
#[derive(Clone, Debug)]
pub(in crate::light) struct LightNode {
    centre: DVec3,
    /// Inverse of the node's unit of length. The unit is the radius of the ball around the node's
    /// box.
    inverse: f64,
    /// Slot of the node in its parent, see [`LightTreeChild`]; [`LightTree::TOP`] for the root.
    pub parent: u32,
    pub(super) children: [LightTreeChild; WIDTH],
    /// Centre of each child's box, relative to the node's centre, in the node's unit of length.
    x: [f32; WIDTH],
    y: [f32; WIDTH],
    z: [f32; WIDTH],
    /// Radius of the ball around each child's box, in the node's unit of length.
    radius: [f32; WIDTH],
    /// Unit axis of each child's cone of normals.
    axis_x: [f32; WIDTH],
    axis_y: [f32; WIDTH],
    axis_z: [f32; WIDTH],
    /// Sine of the half-angle of each child's cone of normals.
    sin_normals: [f32; WIDTH],
    /// Cosine of the half-angle of each child's cone of normals.
    cos_normals: [f32; WIDTH],
    /// Cosine of each child's greatest angle between a normal and a direction of emission, less
    /// [`MARGIN`].
    emission: [f32; WIDTH],
    /// Intensity of each child as a fraction of the node's.
    intensity: [f32; WIDTH],
}

/// Returns centre and radius of the ball around a group's box. The radius includes the rounding
/// error of a centre far from the origin.
fn bounding_sphere(group: &LightCluster) -> (DVec3, f64) {
    let (space, middle) = (
        group.bounds.bounding_box,
        group.bounds.bounding_box.centre(),
    );
    (
        middle,
        0.5 * space.extent().length() + f64::EPSILON * middle.abs().max_element(),
    )
}

/// Returns the approximate mean over a ball of cosines clamped to zero. `middle` is the cosine at
/// the ball's centre, `greatest` the greatest cosine in the ball. The result is `middle`, or half
/// of `greatest` for a ball across the horizon.
///
/// `greatest` alone would overrate balls at the horizon, which receive little or no light: a third
/// more samples of lights on a ball would contribute nothing.
#[inline(always)]
fn approximate_mean_cosine<F: LaneFloats>(middle: F, greatest: F) -> F {
    middle
        .max_or_second(middle.like(0.5) * greatest)
        .min_or_second(middle.like(1.0))
        .max_or_second(middle.like(MARGIN))
}

impl LightNode {
    /// Creates a node without children, for the group `whole`.
    pub(super) fn new(whole: &LightCluster, parent: u32) -> Self {
        /// Least unit of length. Lights at one position have no extent; with this unit, every other
        /// position is far away.
        const LEAST: f64 = 1e-150;
        let (centre, radius) = bounding_sphere(whole);
        let none = [0.0; WIDTH];
        Self {
            centre,
            inverse: 1.0 / radius.max(LEAST),
            parent,
            children: [LightTreeChild::Inner(LightTree::NONE); WIDTH],
            x: none,
            y: none,
            z: none,
            radius: [1.0; WIDTH],
            axis_x: none,
            axis_y: none,
            axis_z: none,
            sin_normals: none,
            cos_normals: none,
            emission: none,
            intensity: none,
        }
    }

    /// Sets the child in a lane: a group of lights within `whole`, the group of the node.
    pub(super) fn set_child(&mut self, lane: usize, group: &LightCluster, whole: &LightCluster) {
        let LightCluster { bounds, intensity } = group;
        let (middle, radius) = bounding_sphere(group);
        let position = ((middle - self.centre) * self.inverse).as_vec3();
        [self.x[lane], self.y[lane], self.z[lane]] = position.to_array();
        self.radius[lane] = (radius * self.inverse * (1.0 + MOVED) + MOVED) as f32;
        [self.axis_x[lane], self.axis_y[lane], self.axis_z[lane]] =
            bounds.axis.as_vec3().to_array();
        let widest = bounds.normal_angle.clamp(0.0, PI);
        (self.sin_normals[lane], self.cos_normals[lane]) =
            (libm::sin(widest) as f32, libm::cos(widest) as f32);
        self.emission[lane] = libm::cos(bounds.emission_angle.clamp(0.0, PI)) as f32 - MARGIN;
        self.intensity[lane] = (intensity / whole.intensity).max(FAINTEST) as f32;
    }

    /// Returns a receiving point in the node's space. `normal` is zero for a point that receives
    /// light on both sides.
    #[inline(always)]
    pub fn local_receiver<F: LaneFloats>(
        &self,
        [x, y, z]: [F::Doubles; 3],
        normal: LaneVector<F>,
    ) -> LocalReceiver<F> {
        let like = normal.x;
        let inverse = like.double_like(self.inverse);
        let (x, y, z) = (
            (x - like.double_like(self.centre.x)) * inverse,
            (y - like.double_like(self.centre.y)) * inverse,
            (z - like.double_like(self.centre.z)) * inverse,
        );
        // Of each component, and then of all three, the greater absolute value.
        let (zero, far) = (like.double_like(0.0), like.double_like(FAR));
        let (size_x, size_y, size_z) = (
            like.select_at_most([x, zero], zero - x, x),
            like.select_at_most([y, zero], zero - y, y),
            like.select_at_most([z, zero], zero - z, z),
        );
        let farthest = like.select_at_most([size_x, size_y], size_y, size_x);
        let farthest = like.select_at_most([farthest, size_z], size_z, farthest);
        let shrink = like.select_at_most([farthest, far], like.double_like(1.0), far / farthest);
        let zero = like.like(0.0);
        LocalReceiver {
            point: LaneVector::new(
                like.narrow_like(x * shrink),
                like.narrow_like(y * shrink),
                like.narrow_like(z * shrink),
            ),
            normal,
            shrink: like.narrow_like(shrink),
            level: zero.select_less(normal.absolute_sum(), zero, like.like(1.0)),
        }
    }

    /// Returns the approximate contribution of each child at a receiving point. Zero only if no
    /// light of the child can arrive.
    #[inline(always)]
    pub fn child_importances(&self, receiver: &ReceivingPoint) -> [f64; WIDTH] {
        let [x, y, z] = receiver.normal.as_vec3().to_array();
        let local = self.local_receiver(receiver.point.to_array(), LaneVector::new(x, y, z));
        let mut importances = [0.0; WIDTH];
        for (i, importance) in importances.iter_mut().enumerate() {
            *importance = self.child_importance(i, &local).into();
        }
        importances
    }

    /// Chooses a child by a uniform number in [0, 1).
    #[inline(always)]
    pub fn choose_child<F: LaneFloats>(
        &self,
        receiver: &LocalReceiver<F>,
        u: F::Doubles,
    ) -> ChosenChild<F> {
        let like = receiver.level;
        let mut importances = [like.double_like(0.0); WIDTH];
        for (i, importance) in importances.iter_mut().enumerate() {
            // A missing child has no importance.
            if self.intensity[i] != 0.0 {
                *importance = self.child_importance(i, receiver).widen();
            }
        }
        let sums = cumulative_sums(like.double_like(0.0), &importances);
        let total = sums[WIDTH];
        let at = u * total;
        let mut chosen = ChosenChild {
            index: like.double_like(0.0),
            at,
            before: sums[0],
            importance: importances[0],
            total,
        };
        // The sums never decrease: the child is the last whose sum is at most the number.
        for i in 1..WIDTH {
            let pair = [sums[i], at];
            chosen.index = like.select_at_most(pair, like.double_like(i as f64), chosen.index);
            chosen.before = like.select_at_most(pair, sums[i], chosen.before);
            chosen.importance = like.select_at_most(pair, importances[i], chosen.importance);
        }
        chosen
    }

    /// Returns the approximate contribution of a child at a receiving point.
    ///
    /// Consider the angles at which light leaves and arrives. Their least value over a ball is the
    /// angle at the ball's centre less the ball's angular radius. The cosine of that least angle is
    /// at most the cosine at the centre plus the sine of the angular radius. This bound is exact at
    /// the horizon, where the cosine is zero.
    #[inline(always)]
    fn child_importance<F: LaneFloats>(&self, i: usize, receiver: &LocalReceiver<F>) -> F {
        let LocalReceiver {
            point,
            normal,
            shrink,
            level,
        } = *receiver;
        let (zero, one) = (level.like(0.0), level.like(1.0));
        let offset = LaneVector::new(
            point.x - level.like(self.x[i]) * shrink,
            point.y - level.like(self.y[i]) * shrink,
            point.z - level.like(self.z[i]) * shrink,
        );
        let radius = level.like(self.radius[i]) * shrink;
        let (squared, radius2) = (offset.dot(offset), radius * radius);
        let inverse = one / radius2.max_or_second(squared).sqrt();
        // From inside the ball around the box, lights may lie in any direction.
        let ball = radius2.select_less(squared, radius * inverse, level.like(2.0));
        let axis = LaneVector::new(
            level.like(self.axis_x[i]),
            level.like(self.axis_y[i]),
            level.like(self.axis_z[i]),
        );
        let cosine = (axis.dot(offset) * inverse + level.like(SLACK)).min_or_second(one);
        let sine = (one - cosine * cosine).max_or_second(zero).sqrt();
        // cos(max(0, a − b)).
        let cos_normals = level.like(self.cos_normals[i]);
        let beyond = cosine * cos_normals + sine * level.like(self.sin_normals[i]);
        let beyond = cos_normals.select_less(cosine, one, beyond);
        let facing = level - normal.dot(offset) * inverse;
        let (leaving, arriving) = (beyond + ball, facing + ball);
        let cosines =
            approximate_mean_cosine(beyond, leaving) * approximate_mean_cosine(facing, arriving);
        let sent = level.like(self.intensity[i]) * cosines * (inverse * inverse);
        let sent = level
            .like(self.emission[i])
            .select_less(leaving, sent, zero);
        level.like(-MARGIN).select_less(arriving, sent, zero)
    }
}

/// A receiving point in the space of a node. Numbers may be SIMD lanes of several points.
pub(in crate::light) struct LocalReceiver<F> {
    /// Position relative to the node's centre, in the node's unit of length, times `shrink`.
    point: LaneVector<F>,
    normal: LaneVector<F>,
    /// Scale of the point and the node, see [`FAR`].
    shrink: F,
    /// 1 for a point that receives light on both sides, which has no horizon; else 0.
    level: F,
}

/// A child of a node, chosen for a point. Numbers may be SIMD lanes of several points. Meaningless
/// unless the total is positive and finite: else no light of the node arrives at the point.
pub(in crate::light) struct ChosenChild<F: LaneFloats> {
    /// Index of the child.
    pub index: F::Doubles,
    /// The chosen place among the importances of all children in a row.
    pub at: F::Doubles,
    /// Sum of the importances of the children before it.
    pub before: F::Doubles,
    pub importance: F::Doubles,
    /// Sum of the importances of all children.
    pub total: F::Doubles,
}

/// Returns the cumulative sums of importances, starting with zero. A zero importance leaves the sum
/// unchanged, and so has the probability zero: pairs and fours are added in an order that preserves
/// this under rounding. Sums are in `f64`: in `f32`, rounding would affect how often faint lights
/// are sampled.
#[inline(always)]
pub(super) fn cumulative_sums<D: Copy + Add<Output = D>>(
    zero: D,
    importances: &[D; WIDTH],
) -> [D; WIDTH + 1] {
    let one = importances;
    let two = [
        one[0] + one[1],
        one[2] + one[3],
        one[4] + one[5],
        one[6] + one[7],
    ];
    let four = [two[0] + two[1], two[2] + two[3]];
    [
        zero,
        one[0],
        two[0],
        two[0] + one[2],
        four[0],
        four[0] + one[4],
        four[0] + two[2],
        four[0] + (two[2] + one[6]),
        four[0] + four[1],
    ]
}
