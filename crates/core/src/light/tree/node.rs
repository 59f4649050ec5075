//! A node of the light tree with eight children. The importance of all children at a point is
//! computed in `f32` without branches: the compiler vectorises the loop.
//!
//! Building a node avoids the limits of the range of `f32`. Positions are relative to the node's
//! centre in units of its size; intensities are fractions of the node's. Radii and cosines are
//! enlarged to cover rounding: no light that may arrive is excluded.

use core::f64::consts::PI;

use glam::DVec3;

use super::build::LightCluster;
use super::{LightTree, LightTreeChild, ReceivingPoint};

/// Number of children of a node.
pub(super) const WIDTH: usize = 8;

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
pub(super) struct LightNode {
    centre: DVec3,
    /// Inverse of the node's unit of length. The unit is the radius of the ball around the node's
    /// box.
    inverse: f64,
    /// Slot of the node in its parent, see [`LightTreeChild`]; [`LightTree::TOP`] for the root.
    pub parent: u32,
    pub children: [LightTreeChild; WIDTH],
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

/// Returns the greater number, or `b` if either is NaN. This takes a single instruction; `f32::max`
/// takes several.
#[inline(always)]
fn fast_max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn fast_min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
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
fn approximate_mean_cosine(middle: f32, greatest: f32) -> f32 {
    fast_max(fast_min(fast_max(middle, 0.5 * greatest), 1.0), MARGIN)
}

impl LightNode {
    /// Creates a node without children, for the group `whole`.
    pub fn new(whole: &LightCluster, parent: u32) -> Self {
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
    pub fn set_child(&mut self, lane: usize, group: &LightCluster, whole: &LightCluster) {
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

    /// Returns a receiving point in the node's space.
    #[inline(always)]
    fn local_receiver(&self, receiver: &ReceivingPoint) -> LocalReceiver {
        let across = (receiver.point - self.centre) * self.inverse;
        let farthest = across.abs().max_element();
        let shrink = if farthest > FAR { FAR / farthest } else { 1.0 };
        LocalReceiver {
            point: (across * shrink).as_vec3().to_array(),
            normal: receiver.normal.as_vec3().to_array(),
            shrink: shrink as f32,
            level: if receiver.normal == DVec3::ZERO {
                1.0
            } else {
                0.0
            },
        }
    }

    /// Returns the approximate contribution of each child at a receiving point. Zero only if no
    /// light of the child can arrive.
    #[inline(always)]
    pub fn child_importances(&self, receiver: &ReceivingPoint) -> [f32; WIDTH] {
        let local = self.local_receiver(receiver);
        let mut importances = [0.0; WIDTH];
        for (i, importance) in importances.iter_mut().enumerate() {
            *importance = self.child_importance(i, &local);
        }
        importances
    }

    /// Returns [`Self::child_importances`] at several points, as `importances[child][point]`.
    #[inline(always)]
    pub fn importances_at<const N: usize>(
        &self,
        receivers: &[ReceivingPoint; N],
    ) -> [[f32; N]; WIDTH] {
        // As a structure of arrays, which the compiler vectorises over the points.
        let mut locals = [[0.0; N]; 8];
        for (k, receiver) in receivers.iter().enumerate() {
            let LocalReceiver {
                point: [x, y, z],
                normal: [nx, ny, nz],
                shrink,
                level,
            } = self.local_receiver(receiver);
            for (column, number) in locals.iter_mut().zip([x, y, z, nx, ny, nz, shrink, level]) {
                column[k] = number;
            }
        }
        let mut importances = [[0.0; N]; WIDTH];
        for (i, importances) in importances.iter_mut().enumerate() {
            // A missing child has no importance.
            if self.intensity[i] == 0.0 {
                continue;
            }
            for (k, importance) in importances.iter_mut().enumerate() {
                *importance = self.child_importance(
                    i,
                    &LocalReceiver {
                        point: [locals[0][k], locals[1][k], locals[2][k]],
                        normal: [locals[3][k], locals[4][k], locals[5][k]],
                        shrink: locals[6][k],
                        level: locals[7][k],
                    },
                );
            }
        }
        importances
    }

    /// Returns the approximate contribution of a child at a receiving point.
    ///
    /// Consider the angles at which light leaves and arrives. Their least value over a ball is the
    /// angle at the ball's centre less the ball's angular radius. The cosine of that least angle is
    /// at most the cosine at the centre plus the sine of the angular radius. This bound is exact at
    /// the horizon, where the cosine is zero.
    #[inline(always)]
    fn child_importance(&self, i: usize, receiver: &LocalReceiver) -> f32 {
        let LocalReceiver {
            point,
            normal,
            shrink,
            level,
        } = *receiver;
        let (x, y, z) = (
            point[0] - self.x[i] * shrink,
            point[1] - self.y[i] * shrink,
            point[2] - self.z[i] * shrink,
        );
        let radius = self.radius[i] * shrink;
        let (squared, radius2) = (x * x + y * y + z * z, radius * radius);
        let inverse = 1.0 / fast_max(radius2, squared).sqrt();
        // From inside the ball around the box, lights may lie in any direction.
        let ball = if squared <= radius2 {
            2.0
        } else {
            radius * inverse
        };
        let cosine = (self.axis_x[i] * x + self.axis_y[i] * y + self.axis_z[i] * z) * inverse;
        let cosine = fast_min(cosine + SLACK, 1.0);
        let sine = fast_max(1.0 - cosine * cosine, 0.0).sqrt();
        // cos(max(0, a − b)).
        let beyond = cosine * self.cos_normals[i] + sine * self.sin_normals[i];
        let beyond = if cosine > self.cos_normals[i] {
            1.0
        } else {
            beyond
        };
        let facing = level - (normal[0] * x + normal[1] * y + normal[2] * z) * inverse;
        let (leaving, arriving) = (beyond + ball, facing + ball);
        let cosines =
            approximate_mean_cosine(beyond, leaving) * approximate_mean_cosine(facing, arriving);
        let sent = self.intensity[i] * cosines * (inverse * inverse);
        let lit = (leaving > self.emission[i]) & (arriving > -MARGIN);
        if lit { sent } else { 0.0 }
    }
}

/// A receiving point in the space of a node.
struct LocalReceiver {
    /// Position relative to the node's centre, in the node's unit of length, times `shrink`.
    point: [f32; 3],
    normal: [f32; 3],
    /// Scale of the point and the node, see [`FAR`].
    shrink: f32,
    /// 1 for a point that receives light on both sides, which has no horizon; else 0.
    level: f32,
}

/// Returns the cumulative sums of importances, starting with zero. A zero importance leaves the sum
/// unchanged, and so has the probability zero: pairs and fours are added in an order that preserves
/// this under rounding. Sums are in `f64`: in `f32`, rounding would affect how often faint lights
/// are sampled.
#[inline(always)]
pub(super) fn cumulative_sums(importances: &[f32; WIDTH]) -> [f64; WIDTH + 1] {
    let (mut one, mut two) = ([0.0; WIDTH], [0.0; WIDTH / 2]);
    for (one, &importance) in one.iter_mut().zip(importances) {
        *one = importance.into();
    }
    for i in 0..WIDTH / 2 {
        two[i] = one[2 * i] + one[2 * i + 1];
    }
    let four = [two[0] + two[1], two[2] + two[3]];
    [
        0.0,
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
