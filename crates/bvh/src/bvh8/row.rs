//! Rows of eight spheres or planes. They are tested in f64 lanes, by the operations of
//! [`crate::shapes::Sphere`] and [`crate::shapes::Plane`]. Eight tests in lanes cost about as much
//! as one, so an additional filter would cost more than it saves.

use glam::{DVec3, Vec3};

use super::triangle8::LeafHeader;
use super::{MaskLanes, WIDTH};
use crate::math::simd::{Simd, dot_f64, splat3_f64};
use crate::ray::{Interval, Ray, Side, Visibility};
use crate::scalar::Real;
use crate::shapes::{FAR_RATIO, PreparedRay, Shape, ShapeHit, Sphere};

/// A leaf of up to eight spheres or planes, which are tested in lanes. Unused lanes are NaN and
/// never hit.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(crate) struct PrimitiveRow {
    kind: RowKind,
    pub leaf_header: LeafHeader,
    /// Centres of spheres, or points of planes, as `positions[axis][lane]`.
    positions: [[f32; WIDTH]; 3],
    /// As `radii_or_normals[axis][lane]`: the normals of planes, or the radii of spheres, repeated
    /// for each axis.
    radii_or_normals: [[f32; WIDTH]; 3],
}

/// Kind of the primitives in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RowKind {
    Spheres,
    Planes,
}

/// Hits of one ray with the primitives of a row, or of eight rays with one primitive, one in each
/// lane:
///
/// - `hits`: mask of the lanes with a hit within the range, on an accepted side;
/// - `exits`: mask of the lanes where the ray leaves a solid;
/// - `t`: distances.
#[derive(Clone, Copy)]
pub(crate) struct RowHits<T> {
    pub hits: u32,
    pub exits: u32,
    pub t: T,
}

impl<T: Copy> RowHits<T> {
    /// Copies the hits from registers to arrays.
    #[inline(always)]
    pub(super) fn store_lanes<S: Simd<Floats = T>>(&self, s: S) -> RowHits<[f32; WIDTH]> {
        RowHits {
            hits: self.hits,
            exits: self.exits,
            t: s.to_array(self.t),
        }
    }
}

impl PrimitiveRow {
    /// Creates a row of spheres or planes. `own` gives centre and radius of a sphere, or point and
    /// normal of a plane. The slots (records) of the primitives are consecutive from `first` on.
    pub fn new(
        kind: RowKind,
        first: usize,
        own: impl Iterator<Item = ([Vec3; 2], Visibility)>,
    ) -> Self {
        let mut row = Self::with_primitive_count(kind, first, 0);
        for (lane, ([position, rest], visibility)) in own.take(WIDTH).enumerate() {
            for axis in 0..3 {
                (row.positions[axis][lane], row.radii_or_normals[axis][lane]) =
                    (position[axis], rest[axis]);
            }
            row.leaf_header.set_visibility(lane, visibility);
            row.leaf_header.count += 1;
        }
        row
    }

    /// Creates a row for `count` primitives, whose positions are not set yet. Their slots (records)
    /// are consecutive from `first` on.
    pub(super) fn with_primitive_count(kind: RowKind, first: usize, count: usize) -> Self {
        Self {
            kind,
            leaf_header: LeafHeader::new(first, count),
            positions: [[f32::NAN; WIDTH]; 3],
            radii_or_normals: [[f32::NAN; WIDTH]; 3],
        }
    }

    /// Intersects a ray with all primitives of the row, one primitive in each lane.
    #[inline(always)]
    pub(super) fn intersect<S: Simd>(
        &self,
        s: S,
        prepared_ray: &PreparedRay,
        range: Interval<f32>,
        culls: bool,
    ) -> RowHits<S::Floats> {
        let rays = RayLanes {
            origin: splat3_f64(s, prepared_ray.origin),
            direction: splat3_f64(s, prepared_ray.direction),
            length_squared: s.splat_f64(prepared_ray.length_squared),
            shortened: s.splat_f64(prepared_ray.lower_length_squared),
            inverse_length_squared: s.splat_f64(prepared_ray.inverse_length_squared),
        };
        let ends = [s.splat(range.min), s.splat(Real::next_down(range.max))];
        let sides = [
            self.leaf_header.outside_only_lanes(culls).into(),
            self.leaf_header.inside.into(),
        ];
        // Written out: the closure of a `map` would not be compiled for the instruction set of this
        // function.
        let places = [
            s.widen(&self.positions[0]),
            s.widen(&self.positions[1]),
            s.widen(&self.positions[2]),
        ];
        // Copied: a captured reference would force the ray into memory, and the closure is called
        // only for distant spheres.
        let ([x, y, z], prepared_ray) = (&self.radii_or_normals, *prepared_ray);
        match self.kind {
            RowKind::Spheres => {
                intersect_spheres(s, places, s.widen(x), &rays, ends, sides, move |lane| {
                    self.sphere_in_lane(lane).intersect(
                        &prepared_ray,
                        range,
                        self.accepted_side_in_lane(lane, culls),
                    )
                })
            }
            RowKind::Planes => intersect_planes(
                s,
                places,
                [s.widen(x), s.widen(y), s.widen(z)],
                &rays,
                ends,
                sides,
            ),
        }
    }

    /// Intersects eight rays with the primitive in one lane of the row. A distance t is accepted if
    /// `near < t <= far`. Masks of the result have one bit per ray.
    #[inline(always)]
    pub(super) fn intersect_primitive_in_lane<S: Simd>(
        &self,
        s: S,
        lane: usize,
        lines: &CommonOriginRays8<S>,
        near: f32,
        far: S::Floats,
    ) -> RowHits<S::Floats> {
        let lane = lane & (WIDTH - 1);
        let value_of = |rows: &[[f32; WIDTH]; 3]| {
            Vec3::new(rows[0][lane], rows[1][lane], rows[2][lane]).as_dvec3()
        };
        let only = |side: u8| if side >> lane & 1 == 0 { 0 } else { 0xff };
        let sides = [
            only(self.leaf_header.outside_only_lanes(lines.culls)),
            only(self.leaf_header.inside),
        ];
        let (places, rest, ends) = (
            splat3_f64(s, value_of(&self.positions)),
            value_of(&self.radii_or_normals),
            [s.splat(near), far],
        );
        match self.kind {
            RowKind::Spheres => intersect_spheres(
                s,
                places,
                s.splat_f64(rest.x),
                &lines.rays,
                ends,
                sides,
                |ray| {
                    let range = Interval {
                        min: near,
                        max: s.to_array(far)[ray].next_up(),
                    };
                    self.sphere_in_lane(lane).intersect(
                        &lines.prepared_ray(ray),
                        range,
                        self.accepted_side_in_lane(lane, lines.culls),
                    )
                },
            ),
            RowKind::Planes => {
                intersect_planes(s, places, splat3_f64(s, rest), &lines.rays, ends, sides)
            }
        }
    }

    fn sphere_in_lane(&self, lane: usize) -> Sphere<f32> {
        let at = |axis: usize| self.positions[axis][lane];
        Sphere {
            centre: Vec3::new(at(0), at(1), at(2)),
            radius: self.radii_or_normals[0][lane],
        }
    }

    fn accepted_side_in_lane(&self, lane: usize, culls: bool) -> Side {
        match 1 << lane {
            bit if self.leaf_header.outside_only_lanes(culls) & bit != 0 => Side::Outside,
            bit if self.leaf_header.inside & bit != 0 => Side::Inside,
            _ => Side::Both,
        }
    }
}

/// The rays of a test in lanes: the same ray in all lanes, or eight different rays.
struct RayLanes<S: Simd> {
    origin: [S::Doubles; 3],
    direction: [S::Doubles; 3],
    length_squared: S::Doubles,
    shortened: S::Doubles,
    inverse_length_squared: S::Doubles,
}

#[inline(always)]
fn sub3_f64<S: Simd>(s: S, a: [S::Doubles; 3], b: [S::Doubles; 3]) -> [S::Doubles; 3] {
    [
        s.sub_f64(a[0], b[0]),
        s.sub_f64(a[1], b[1]),
        s.sub_f64(a[2], b[2]),
    ]
}

/// Intersects the ray in each lane with the sphere in that lane. A distance t is accepted if `first
/// < t <= last`. `outside_alone` and `inside_alone` are the masks of lanes whose sphere can be hit
/// from that side only. `test_single` tests one lane by the test for a single sphere.
#[inline(always)]
fn intersect_spheres<S: Simd>(
    s: S,
    centres: [S::Doubles; 3],
    radii: S::Doubles,
    rays: &RayLanes<S>,
    [first, last]: [S::Floats; 2],
    [outside_alone, inside_alone]: [u32; 2],
    test_single: impl Fn(usize) -> Option<ShapeHit<f32>>,
) -> RowHits<S::Floats> {
    let f = sub3_f64(s, rays.origin, centres);
    let (b, room) = (dot_f64(s, f, rays.direction), s.mul_f64(radii, radii));
    let (outside, squared) = (s.sub_f64(dot_f64(s, f, f), room), s.mul_f64(b, b));
    let zero = s.splat_f64(0.0);
    let may_meet = s.at_least_f64(s.sub_f64(squared, s.mul_f64(outside, rays.shortened)), zero);
    if may_meet == 0 {
        return RowHits {
            hits: 0,
            exits: 0,
            t: first,
        };
    }
    let discriminant = s.sub_f64(squared, s.mul_f64(outside, rays.length_squared));
    let hit_lanes = s.at_least_f64(discriminant, zero);
    let root = s.sqrt_f64(discriminant);
    // −0 − b negates every number, including zero.
    let turned = s.sub_f64(s.splat_f64(-0.0), b);
    let near = s.narrow(s.mul_f64(s.sub_f64(turned, root), rays.inverse_length_squared));
    let far = s.narrow(s.mul_f64(s.sub_f64(root, b), rays.inverse_length_squared));
    let entering = hit_lanes & s.less(first, near) & s.at_most(near, last) & !inside_alone;
    let leaving =
        hit_lanes & s.less(first, far) & s.at_most(far, last) & !outside_alone & !entering;
    let hits = RowHits {
        hits: entering | leaving,
        exits: leaving,
        t: s.select(leaving, near, far),
    };
    let far_away =
        may_meet & s.greater_f64(outside, s.mul_f64(room, s.splat_f64(FAR_RATIO * FAR_RATIO)));
    if far_away == 0 {
        return hits;
    }
    let RowHits {
        hits,
        exits: leaving,
        t,
    } = retest_far_spheres(far_away, hits.store_lanes(s), test_single);
    RowHits {
        hits,
        exits: leaving,
        t: s.load(&t),
    }
}

/// Tests the distant spheres in the mask `lanes` one by one. For these the test of a single sphere
/// uses another formula than the test in lanes.
#[cold]
#[inline(never)]
fn retest_far_spheres(
    lanes: u32,
    mut row_hits: RowHits<[f32; WIDTH]>,
    test_single: impl Fn(usize) -> Option<ShapeHit<f32>>,
) -> RowHits<[f32; WIDTH]> {
    for lane in MaskLanes(lanes) {
        let bit = 1 << lane;
        (row_hits.hits, row_hits.exits) = (row_hits.hits & !bit, row_hits.exits & !bit);
        if let Some(hit) = test_single(lane) {
            row_hits.hits |= bit;
            row_hits.exits |= if hit.is_exit() { bit } else { 0 };
            row_hits.t[lane] = hit.t;
        }
    }
    row_hits
}

/// Intersects the ray in each lane with the plane in that lane. The other parameters are those of
/// [`intersect_spheres`].
#[inline(always)]
fn intersect_planes<S: Simd>(
    s: S,
    points: [S::Doubles; 3],
    normals: [S::Doubles; 3],
    rays: &RayLanes<S>,
    [first, last]: [S::Floats; 2],
    [outside_alone, inside_alone]: [u32; 2],
) -> RowHits<S::Floats> {
    let slope = dot_f64(s, normals, rays.direction);
    let t = s.narrow(s.div_f64(dot_f64(s, normals, sub3_f64(s, points, rays.origin)), slope));
    // For a ray in the plane the distance is 0/0 or x/0, which no open range contains.
    let within = s.less(first, t) & s.at_most(t, last) & s.less(t, s.splat(f32::INFINITY));
    let finite = within & s.less(s.splat(f32::NEG_INFINITY), t);
    let against = s.greater_f64(s.splat_f64(0.0), slope);
    RowHits {
        hits: finite & !(outside_alone & !against) & !(inside_alone & against),
        exits: 0,
        t,
    }
}

/// Eight rays with a common origin, one per lane, with the values of [`PreparedRay`] that the tests
/// of rows use.
pub(super) struct CommonOriginRays8<S: Simd> {
    rays: RayLanes<S>,
    origin: DVec3,
    rows: [[f32; WIDTH]; 3],
    culls: bool,
}

impl<S: Simd> CommonOriginRays8<S> {
    /// Prepares eight rays in lanes, by the operations of [`PreparedRay`]. The arrays hold the
    /// components of the directions.
    #[inline(always)]
    pub fn new(s: S, origin: DVec3, [x, y, z]: [&[f32; WIDTH]; 3], culls: bool) -> Self {
        let direction = [s.widen(x), s.widen(y), s.widen(z)];
        let length_squared = dot_f64(s, direction, direction);
        let inverse_length_squared = s.div_f64(s.splat_f64(1.0), length_squared);
        let shortened = s.mul_f64(length_squared, s.splat_f64(PreparedRay::LOWER_BOUND_FACTOR));
        let rays = RayLanes {
            origin: splat3_f64(s, origin),
            direction,
            length_squared,
            shortened,
            inverse_length_squared,
        };
        Self {
            rays,
            origin,
            rows: [*x, *y, *z],
            culls,
        }
    }

    fn prepared_ray(&self, ray: usize) -> PreparedRay {
        let d = Vec3::new(self.rows[0][ray], self.rows[1][ray], self.rows[2][ray]);
        PreparedRay::from_ray(Ray::<f32>::new(self.origin.as_vec3(), d), false)
    }
}
