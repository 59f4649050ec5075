//! Up to eight groups of lights side by side: how much of each may arrive at a point, in f32 and
//! without a branch, so that the compiler makes it as many at a time as registers hold.
//!
//! What f32 cannot hold is taken out when the node is built: places are told from the node's middle
//! in units of its size, powers as shares of the node's. What it rounds is given back as room:
//! radii and cosines are wider than they are, so that no light that may arrive is left out.

use core::f64::consts::PI;

use glam::DVec3;

use super::build::Cluster;
use super::{Content, LightTree, Receiver};

/// Groups in a node.
pub(super) const WIDTH: usize = 8;

/// What rounding may take from a cosine in f32: some ten roundings of 2⁻²⁴.
const MARGIN: f32 = 4e-6;
/// By how much a cosine to a group's axis is taken for greater. A sine that is made of it is then
/// never of a greater angle, which a rounded one is by 10⁻³ where the cosine is ±1.
const SLACK: f32 = 2e-6;
/// By how much rounding moves a place, in units of the node.
const MOVED: f64 = 5e-7;
/// The least share of power, so that no product of shares, cosines and distances is zero in f32.
const FAINTEST: f64 = 1e-20;
/// Units of the node from which a point is taken nearer, together with everything: f32 squares its
/// distance otherwise to infinity.
const FAR: f64 = 1e3;

/// A node: eight groups, each a light or a node, those that are missing without power.
#[derive(Clone, Debug)]
pub(super) struct LightNode {
    centre: DVec3,
    /// One over the unit of lengths in the node: the radius of the ball around its box.
    inverse: f64,
    /// Its place in the node above; [`LightTree::TOP`] for the first one.
    pub parent: u32,
    pub content: [Content; WIDTH],
    /// Of the middles of the groups' boxes.
    x: [f32; WIDTH],
    y: [f32; WIDTH],
    z: [f32; WIDTH],
    /// Of the balls around their boxes.
    radius: [f32; WIDTH],
    axis_x: [f32; WIDTH],
    axis_y: [f32; WIDTH],
    axis_z: [f32; WIDTH],
    /// Of the greatest angle between axis and normals.
    sin_normals: [f32; WIDTH],
    cos_normals: [f32; WIDTH],
    /// Cosine of the greatest angle at which light leaves, less [`MARGIN`].
    emission: [f32; WIDTH],
    /// Share of the node's.
    power: [f32; WIDTH],
}

/// The greater one, and the second where one is no number: one instruction. `f32::max` is several.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The ball around a group's box; far from the origin its middle is rounded.
fn ball(group: &Cluster) -> (DVec3, f64) {
    let (space, middle) = (group.bounds.space, group.bounds.space.centre());
    (
        middle,
        0.5 * space.extent().length() + f64::EPSILON * middle.abs().max_element(),
    )
}

/// About the mean over a ball of cosines that are not below zero, by the middle's and the greatest:
/// the middle's, and where the ball crosses the horizon half of the greatest. The greatest itself
/// makes too much of balls at the horizon, of which little or nothing is lit: a third more of the
/// draws over lights on a ball found nothing.
#[inline(always)]
fn mean(middle: f32, greatest: f32) -> f32 {
    greater(lesser(greater(middle, 0.5 * greatest), 1.0), MARGIN)
}

impl LightNode {
    /// Without groups, around all that they will be.
    pub fn new(whole: &Cluster, parent: u32) -> Self {
        /// Lights at one place have no size; with this one every other place is far.
        const LEAST: f64 = 1e-150;
        let (centre, radius) = ball(whole);
        let none = [0.0; WIDTH];
        Self {
            centre,
            inverse: 1.0 / radius.max(LEAST),
            parent,
            content: [Content::Inner(LightTree::NONE); WIDTH],
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
            power: none,
        }
    }

    /// Puts a group in its place.
    pub fn put(&mut self, lane: usize, group: &Cluster, whole: &Cluster) {
        let Cluster { bounds, power } = group;
        let (middle, radius) = ball(group);
        let place = ((middle - self.centre) * self.inverse).as_vec3();
        [self.x[lane], self.y[lane], self.z[lane]] = place.to_array();
        self.radius[lane] = (radius * self.inverse * (1.0 + MOVED) + MOVED) as f32;
        [self.axis_x[lane], self.axis_y[lane], self.axis_z[lane]] =
            bounds.axis.as_vec3().to_array();
        let widest = bounds.normals.clamp(0.0, PI);
        (self.sin_normals[lane], self.cos_normals[lane]) =
            (libm::sin(widest) as f32, libm::cos(widest) as f32);
        self.emission[lane] = libm::cos(bounds.emission.clamp(0.0, PI)) as f32 - MARGIN;
        self.power[lane] = (power / whole.power).max(FAINTEST) as f32;
    }

    /// About how much of each group's light arrives; zero only where none does.
    ///
    /// The least angle at which light of a ball leaves or arrives is the one of its middle less the
    /// one under which the ball is seen. Its cosine is at most the middle's plus the ball's sine,
    /// and where it is zero, at a horizon, it is that.
    #[inline(always)]
    pub fn importances(&self, receiver: &Receiver) -> [f32; WIDTH] {
        let across = (receiver.at - self.centre) * self.inverse;
        let farthest = across.abs().max_element();
        let shrink = if farthest > FAR { FAR / farthest } else { 1.0 };
        let at = (across * shrink).as_vec3();
        let (shrink, normal) = (shrink as f32, receiver.normal.as_vec3());
        // A point that is lit on both sides has no horizon.
        let level = if receiver.normal == DVec3::ZERO {
            1.0
        } else {
            0.0
        };
        let mut importances = [0.0; WIDTH];
        for (i, importance) in importances.iter_mut().enumerate() {
            let (x, y, z) = (
                at.x - self.x[i] * shrink,
                at.y - self.y[i] * shrink,
                at.z - self.z[i] * shrink,
            );
            let radius = self.radius[i] * shrink;
            let (squared, radius2) = (x * x + y * y + z * z, radius * radius);
            let inverse = 1.0 / greater(radius2, squared).sqrt();
            // From within the ball around the box its lights may be anywhere.
            let ball = if squared <= radius2 {
                2.0
            } else {
                radius * inverse
            };
            let cosine = (self.axis_x[i] * x + self.axis_y[i] * y + self.axis_z[i] * z) * inverse;
            let cosine = lesser(cosine + SLACK, 1.0);
            let sine = greater(1.0 - cosine * cosine, 0.0).sqrt();
            // cos(max(0, a − b)).
            let beyond = cosine * self.cos_normals[i] + sine * self.sin_normals[i];
            let beyond = if cosine > self.cos_normals[i] {
                1.0
            } else {
                beyond
            };
            let facing = level - (normal.x * x + normal.y * y + normal.z * z) * inverse;
            let (leaving, arriving) = (beyond + ball, facing + ball);
            let cosines = mean(beyond, leaving) * mean(facing, arriving);
            let sent = self.power[i] * cosines * (inverse * inverse);
            let lit = (leaving > self.emission[i]) & (arriving > -MARGIN);
            *importance = if lit { sent } else { 0.0 };
        }
        importances
    }
}

/// The running sum of importances, from zero on. Where one is zero it does not grow: sums of pairs
/// and fours come in an order in which rounding keeps that, so that what has no importance takes no
/// room. In f64, or what is faint would be drawn by what the sum is rounded to.
#[inline(always)]
pub(super) fn running(importances: &[f32; WIDTH]) -> [f64; WIDTH + 1] {
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
