//! Spheres and planes eight at a time, by the operations of their own tests ([`crate::shapes::Sphere`], [`crate::shapes::Plane`]) in
//! lanes of f64. One of them alone costs less than a filter in front of it would; eight cost about as much as one.

use glam::{DVec3, Vec3};

use super::WIDTH;
use super::triangle8::LeafHeader;
use crate::math::simd::{Simd, dot_f64, splat3_f64};
use crate::ray::{Interval, Ray, Side, Visibility};
use crate::shapes::{FAR, Plane, PreparedRay, Shape, Sphere};

/// A ray with what these tests need of a [`PreparedRay`], by its operations.
#[derive(Clone, Copy)]
pub(super) struct RayF64 {
    origin: DVec3,
    direction: DVec3,
    length_squared: f64,
    shortened: f64,
    inverse_length_squared: f64,
}

impl From<&PreparedRay> for RayF64 {
    #[inline(always)]
    fn from(probe: &PreparedRay) -> Self {
        let PreparedRay { origin, direction, length_squared, shortened, inverse_length_squared, .. } = *probe;
        Self { origin, direction, length_squared, shortened, inverse_length_squared }
    }
}

impl RayF64 {
    /// Of a ray in the world.
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Self::from(&PreparedRay::of(Ray::<f32>::new(origin.into(), direction.into()), false))
    }

    /// What a probe of the same ray says to a sphere.
    fn probe(self) -> PreparedRay {
        let Self { origin, direction, length_squared, shortened, inverse_length_squared } = self;
        let ray = Ray::<f32>::new(origin.as_vec3(), direction.as_vec3());
        PreparedRay { origin, direction, length_squared, shortened, inverse_length_squared, ..PreparedRay::of(ray, false) }
    }
}

/// Up to eight spheres or planes. What is not there is no number, and is never hit.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub(crate) struct Row {
    kind: Kind,
    pub facts: LeafHeader,
    /// Of a sphere the centre, of a plane the point; `places[axis][lane]`.
    places: [[f32; WIDTH]; 3],
    /// Of a sphere the radius first, of a plane the normal.
    rest: [[f32; WIDTH]; 3],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Spheres,
    Planes,
}

/// What a row says of a ray: which lanes it hits within the range, on an accepted side, which of those as it leaves a body, and where.
#[derive(Clone, Copy)]
pub(super) struct LaneHits<S: Simd> {
    pub hits: u32,
    pub leaving: u32,
    pub t: S::Floats,
}

/// The same in memory.
#[derive(Clone, Copy)]
pub(crate) struct SphereHits {
    pub hits: u8,
    pub leaving: u8,
    pub t: [f32; WIDTH],
}

impl<S: Simd> LaneHits<S> {
    #[inline(always)]
    pub fn roots(&self, s: S) -> SphereHits {
        SphereHits { hits: self.hits as u8, leaving: self.leaving as u8, t: s.to_array(self.t) }
    }
}

impl Row {
    /// Of spheres, whose slots follow the first one.
    pub fn of_spheres(first: usize, spheres: impl Iterator<Item = (Sphere<f32>, Visibility)>) -> Self {
        let mut row = Self::empty(Kind::Spheres, first);
        for (lane, (sphere, visibility)) in spheres.take(WIDTH).enumerate() {
            row.set(lane, sphere.centre, visibility);
            row.rest[0][lane] = sphere.radius;
        }
        row
    }

    /// Of planes, whose slots follow the first one.
    pub fn of_planes(first: usize, planes: impl Iterator<Item = (Plane<f32>, Visibility)>) -> Self {
        let mut row = Self::empty(Kind::Planes, first);
        for (lane, (plane, visibility)) in planes.take(WIDTH).enumerate() {
            row.set(lane, plane.point, visibility);
            (0..3).for_each(|axis| row.rest[axis][lane] = plane.normal[axis]);
        }
        row
    }

    /// Room for so many spheres, the first of which is at a place.
    pub(super) fn room(first: usize, count: usize) -> Self {
        let mut row = Self::empty(Kind::Spheres, first);
        row.facts.count = count as u8;
        row
    }

    /// The same among places that begin later by so much.
    pub(super) fn moved(mut self, places: u32) -> Self {
        self.facts.first += places;
        self
    }

    fn empty(kind: Kind, first: usize) -> Self {
        let facts = LeafHeader { first: first as u32, ..LeafHeader::default() };
        Self { kind, facts, places: [[f32::NAN; WIDTH]; 3], rest: [[f32::NAN; WIDTH]; 3] }
    }

    fn set(&mut self, lane: usize, place: Vec3, visibility: Visibility) {
        (0..3).for_each(|axis| self.places[axis][lane] = place[axis]);
        self.facts.set(lane, visibility);
        self.facts.count += 1;
    }

    /// Where a ray hits them.
    #[inline(always)]
    pub(super) fn hits<S: Simd>(&self, s: S, line: &RayF64, range: Interval<f32>, culls: bool) -> LaneHits<S> {
        match self.kind {
            Kind::Spheres => self.spheres(s, line, range, culls),
            Kind::Planes => self.planes(s, line, range, culls),
        }
    }

    #[inline(always)]
    fn spheres<S: Simd>(&self, s: S, line: &RayF64, range: Interval<f32>, culls: bool) -> LaneHits<S> {
        let [x, y, z] = splat3_f64(s, line.origin);
        let [cx, cy, cz] = self.widened_places(s);
        let f = [s.sub_f64(x, cx), s.sub_f64(y, cy), s.sub_f64(z, cz)];
        let r = s.widen(&self.rest[0]);
        let (b, room) = (dot_f64(s, f, splat3_f64(s, line.direction)), s.mul_f64(r, r));
        let (outside, squared) = (s.sub_f64(dot_f64(s, f, f), room), s.mul_f64(b, b));
        let zero = s.splat_f64(0.0);
        let may_meet = s.at_least_f64(s.sub_f64(squared, s.mul_f64(outside, s.splat_f64(line.shortened))), zero);
        if may_meet == 0 {
            return LaneHits { hits: 0, leaving: 0, t: s.splat(0.0) };
        }
        let discriminant = s.sub_f64(squared, s.mul_f64(outside, s.splat_f64(line.length_squared)));
        let met = s.at_least_f64(discriminant, zero);
        let (root, inverse) = (s.sqrt_f64(discriminant), s.splat_f64(line.inverse_length_squared));
        // Taken from −0, every number has its sign turned, zero too.
        let turned = s.sub_f64(s.splat_f64(-0.0), b);
        let near = s.narrow(s.mul_f64(s.sub_f64(turned, root), inverse));
        let far = s.narrow(s.mul_f64(s.sub_f64(root, b), inverse));
        let (first, last) = (s.splat(range.min), s.splat(range.max));
        let entering = met & s.less(first, near) & s.less(near, last) & !u32::from(self.facts.inside);
        let leaving = met & s.less(first, far) & s.less(far, last) & !u32::from(self.facts.outside_alone(culls)) & !entering;
        let hits = LaneHits { hits: entering | leaving, leaving, t: s.select(leaving, near, far) };
        let far_away = may_meet & s.greater_f64(outside, s.mul_f64(room, s.splat_f64(FAR * FAR)));
        if far_away == 0 {
            return hits;
        }
        let SphereHits { hits, leaving, t } = self.far_away(far_away, (*line, culls), range, hits.roots(s));
        LaneHits { hits: hits.into(), leaving: leaving.into(), t: s.load(&t) }
    }

    /// Spheres so far away that their test takes another form: one by one.
    #[cold]
    #[inline(never)]
    fn far_away(&self, mut lanes: u32, (line, culls): (RayF64, bool), range: Interval<f32>, mut roots: SphereHits) -> SphereHits {
        let probe = line.probe();
        while lanes != 0 {
            let (lane, bit) = (lanes.trailing_zeros() as usize & (WIDTH - 1), (lanes & lanes.wrapping_neg()) as u8);
            lanes &= lanes - 1;
            (roots.hits, roots.leaving) = (roots.hits & !bit, roots.leaving & !bit);
            if let Some(hit) = self.sphere(lane).intersect(&probe, range, self.side(lane, culls)) {
                roots.hits |= bit;
                roots.leaving |= if hit.leaves() { bit } else { 0 };
                roots.t[lane] = hit.t;
            }
        }
        roots
    }

    #[inline(always)]
    fn planes<S: Simd>(&self, s: S, line: &RayF64, range: Interval<f32>, culls: bool) -> LaneHits<S> {
        let normal = [s.widen(&self.rest[0]), s.widen(&self.rest[1]), s.widen(&self.rest[2])];
        let slope = dot_f64(s, normal, splat3_f64(s, line.direction));
        let [x, y, z] = splat3_f64(s, line.origin);
        let [px, py, pz] = self.widened_places(s);
        let way = [s.sub_f64(px, x), s.sub_f64(py, y), s.sub_f64(pz, z)];
        let t = s.narrow(s.div_f64(dot_f64(s, normal, way), slope));
        // A ray in the plane gives 0/0 or x/0: neither lies in an open range.
        let within = s.less(s.splat(range.min), t) & s.less(t, s.splat(range.max)) & s.less(t, s.splat(f32::INFINITY));
        let finite = within & s.less(s.splat(f32::NEG_INFINITY), t);
        let against = s.greater_f64(s.splat_f64(0.0), slope) as u8;
        LaneHits { hits: self.facts.accepted(finite as u8, against, culls).into(), leaving: 0, t }
    }

    /// One by one: a closure would not have the instructions of the function that it is in.
    #[inline(always)]
    fn widened_places<S: Simd>(&self, s: S) -> [S::Doubles; 3] {
        [s.widen(&self.places[0]), s.widen(&self.places[1]), s.widen(&self.places[2])]
    }
}

/// Eight rays from one point, as [`RayF64`] has one.
pub(super) struct RaysF64<S: Simd> {
    origin: DVec3,
    direction: [S::Doubles; 3],
    length_squared: S::Doubles,
    shortened: S::Doubles,
    inverse_length_squared: S::Doubles,
    rows: [[f32; WIDTH]; 3],
    culls: bool,
}

impl<S: Simd> RaysF64<S> {
    /// By the operations of a probe, in lanes.
    #[inline(always)]
    pub fn new(s: S, origin: DVec3, [x, y, z]: [&[f32; WIDTH]; 3], culls: bool) -> Self {
        let direction = [s.widen(x), s.widen(y), s.widen(z)];
        let length_squared = dot_f64(s, direction, direction);
        let inverse_length_squared = s.div_f64(s.splat_f64(1.0), length_squared);
        let shortened = s.mul_f64(length_squared, s.splat_f64(PreparedRay::SHORTER));
        Self { origin, direction, length_squared, shortened, inverse_length_squared, rows: [*x, *y, *z], culls }
    }

    fn probe(&self, ray: usize) -> PreparedRay {
        let d = Vec3::new(self.rows[0][ray], self.rows[1][ray], self.rows[2][ray]);
        PreparedRay::of(Ray::<f32>::new(self.origin.as_vec3(), d), false)
    }
}

impl Row {
    /// Where eight rays hit one of them, up to `far`: a bit a ray.
    #[inline(always)]
    pub(super) fn lane<S: Simd>(&self, s: S, lane: usize, lines: &RaysF64<S>, near: f32, far: S::Floats) -> LaneHits<S> {
        let (lane, first) = (lane & (WIDTH - 1), s.splat(near));
        let of = |rows: &[[f32; WIDTH]; 3]| Vec3::new(rows[0][lane], rows[1][lane], rows[2][lane]);
        let (bit, place, rest) = (1 << lane, of(&self.places).as_dvec3(), of(&self.rest));
        let only = |side: u8| if side & bit != 0 { 0xff } else { 0 };
        let (outside, inside) = (only(self.facts.outside_alone(lines.culls)), only(self.facts.inside));
        if self.kind == Kind::Planes {
            let normal = rest.as_dvec3();
            let slope = dot_f64(s, splat3_f64(s, normal), lines.direction);
            let t = s.narrow(s.div_f64(s.splat_f64(normal.dot(place - lines.origin)), slope));
            let counts =
                s.less(first, t) & s.at_most(t, far) & s.less(t, s.splat(f32::INFINITY)) & s.less(s.splat(f32::NEG_INFINITY), t);
            let against = s.greater_f64(s.splat_f64(0.0), slope);
            return LaneHits { hits: counts & !(outside & !against) & !(inside & against), leaving: 0, t };
        }
        let (f, r) = (lines.origin - place, f64::from(rest.x));
        let room = r * r;
        let beyond = f.dot(f) - room;
        let b = dot_f64(s, splat3_f64(s, f), lines.direction);
        let squared = s.mul_f64(b, b);
        let may_meet = s.at_least_f64(s.sub_f64(squared, s.mul_f64(s.splat_f64(beyond), lines.shortened)), s.splat_f64(0.0));
        if may_meet == 0 {
            return LaneHits { hits: 0, leaving: 0, t: first };
        }
        if beyond > room * (FAR * FAR) {
            return self.lane_far_away(s, lane, lines, may_meet, near, far);
        }
        let discriminant = s.sub_f64(squared, s.mul_f64(s.splat_f64(beyond), lines.length_squared));
        let met = s.at_least_f64(discriminant, s.splat_f64(0.0));
        let root = s.sqrt_f64(discriminant);
        let turned = s.sub_f64(s.splat_f64(-0.0), b);
        let enter = s.narrow(s.mul_f64(s.sub_f64(turned, root), lines.inverse_length_squared));
        let leave = s.narrow(s.mul_f64(s.sub_f64(root, b), lines.inverse_length_squared));
        let entering = met & s.less(first, enter) & s.at_most(enter, far) & !inside;
        let leaving = met & s.less(first, leave) & s.at_most(leave, far) & !outside & !entering;
        LaneHits { hits: entering | leaving, leaving, t: s.select(leaving, enter, leave) }
    }

    /// Rays from so far away that their test takes another form: one by one.
    #[cold]
    #[inline(never)]
    fn lane_far_away<S: Simd>(
        &self,
        s: S,
        lane: usize,
        lines: &RaysF64<S>,
        mut asked: u32,
        near: f32,
        far: S::Floats,
    ) -> LaneHits<S> {
        let (mut roots, far) = (SphereHits { hits: 0, leaving: 0, t: [0.0; WIDTH] }, s.to_array(far));
        while asked != 0 {
            let ray = asked.trailing_zeros() as usize & (WIDTH - 1);
            asked &= asked - 1;
            let range = Interval { min: near, max: far[ray].next_up() };
            if let Some(hit) = self.sphere(lane).intersect(&lines.probe(ray), range, self.side(lane, lines.culls)) {
                roots.hits |= 1 << ray;
                roots.leaving |= u8::from(hit.leaves()) << ray;
                roots.t[ray] = hit.t;
            }
        }
        LaneHits { hits: roots.hits.into(), leaving: roots.leaving.into(), t: s.load(&roots.t) }
    }

    fn sphere(&self, lane: usize) -> Sphere<f32> {
        let at = |axis: usize| self.places[axis][lane];
        Sphere { centre: Vec3::new(at(0), at(1), at(2)), radius: self.rest[0][lane] }
    }

    fn side(&self, lane: usize, culls: bool) -> Side {
        match 1 << lane {
            bit if self.facts.outside_alone(culls) & bit != 0 => Side::Outside,
            bit if self.facts.inside & bit != 0 => Side::Inside,
            _ => Side::Both,
        }
    }
}
