//! The surface point and texture coordinates of a hit, computed once the hit is known.

use glam::DVec3;

use crate::geometry::Geometry;
use crate::processor::{Loops, widest};
use crate::ray::{Hit, Ray};
use crate::scalar::{Real, Vector};
use crate::shapes::{
    Maps, Parameters, PreparedRay, Shape, ShapeHit, Surface, SurfacePoint, Triangle, Under,
};
use crate::slot::Kind;

/// Number of triangles located together.
const LANES: usize = 8;

impl<R: Real> Geometry<R> {
    /// The surface at a hit, before it is rounded to the stored scalar. The hit must come from a
    /// query of this geometry with the same ray.
    #[inline]
    pub fn located(&self, ray: &Ray<R>, hit: &Hit<R>) -> SurfacePoint {
        // Spheres and planes are inlined here, so that parts of the prepared ray that they do not
        // use are not computed.
        let slot = &self.group.slots[hit.slots[0] as usize];
        match slot.kind {
            Kind::Sphere => {
                self.group.spheres[slot.index as usize].locate(&self.prepare(*ray), own(hit))
            }
            Kind::Plane => {
                self.group.planes[slot.index as usize].locate(&self.prepare(*ray), own(hit))
            }
            _ => self.locate(&self.prepare(*ray), own(hit), hit.slots, None),
        }
    }

    /// The surface at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn surface(&self, ray: &Ray<R>, hit: &Hit<R>) -> Surface<R> {
        self.located(ray, hit).stored()
    }

    /// [`Self::surface`] for many rays, which is faster since triangles are located several at a
    /// time. `out` receives each surface with its index in the list; the order of calls is free.
    #[inline]
    pub fn surfaces<'a>(
        &self,
        hits: impl Iterator<Item = (&'a Ray<R>, &'a Hit<R>)>,
        mut out: impl FnMut(usize, Surface<R>),
    ) {
        let mut waiting = HitLanes::<R>::default();
        for (place, (ray, hit)) in hits.enumerate() {
            let slot = &self.group.slots[hit.slots[0] as usize];
            if slot.kind != Kind::Triangle {
                out(place, self.surface(ray, hit));
                continue;
            }
            waiting.push(place, &self.triangle(slot.index as usize), hit);
            if waiting.len == LANES {
                waiting.locate(&mut out);
            }
        }
        waiting.locate(&mut out);
    }

    /// Texture coordinates at a hit that this geometry returned for the same ray.
    #[inline]
    pub fn parameters(&self, ray: &Ray<R>, hit: &Hit<R>) -> Parameters<R> {
        self.parameters_at(&self.prepare(*ray), own(hit), hit.slots)
    }

    /// World-space corners of the hit triangle at the ray's time, in the order of the hit's
    /// weights; `None` for any other shape.
    pub fn corners(&self, ray: &Ray<R>, hit: &Hit<R>) -> Option<[DVec3; 3]> {
        self.corners_at(ray.time.to_f64(), hit.slots)
    }

    /// Maps a normal from the hit instance's space to the world at the ray's time, without
    /// normalising it: for normals of a mesh under a moving instance. Without an instance the
    /// normal is returned unchanged.
    pub fn normal(&self, ray: &Ray<R>, hit: &Hit<R>, normal: R::Vec3) -> R::Vec3 {
        let (group, slot) = (&self.group, &self.group.slots[hit.slots[0] as usize]);
        if slot.kind != Kind::Instance {
            return normal;
        }
        let mut room = None;
        let (transform, _) = group.shown(
            &group.instances[slot.index as usize],
            ray.time.to_f64(),
            &mut room,
        );
        R::Vec3::from_f64(transform.normal_to_world(normal.to_f64()))
    }

    /// The surface for a ray in this geometry's own space, which lies under `maps`.
    #[inline(never)]
    fn locate(
        &self,
        probe: &PreparedRay,
        hit: ShapeHit<R>,
        [slot, inner]: [u32; 2],
        maps: Under<'_>,
    ) -> SurfacePoint {
        let (group, slot) = (&self.group, &self.group.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            Kind::Sphere => group.spheres[index].locate_under(probe, hit, maps),
            Kind::Triangle => self.triangle(index).locate_under(probe, hit, maps),
            Kind::Plane => group.planes[index].locate_under(probe, hit, maps),
            Kind::Shape => group.shapes[index].locate_under(probe, hit, maps),
            Kind::TransformedShape => group.placed[index].locate_under(probe, hit, maps),
            Kind::Instance => {
                let mut room = None;
                let (transform, part) = group.shown(&group.instances[index], probe.time, &mut room);
                let maps = Maps {
                    map: transform,
                    outer: None,
                };
                transform.located_to_world(&part.locate(
                    &transform.probe_to_object(probe),
                    hit,
                    [inner, inner],
                    Some(maps),
                ))
            }
        }
    }

    fn corners_at(&self, time: f64, [slot, inner]: [u32; 2]) -> Option<[DVec3; 3]> {
        let (group, slot) = (&self.group, &self.group.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            Kind::Triangle => Some(self.triangle(index).vertices.map(Vector::to_f64)),
            Kind::Instance => {
                let mut room = None;
                let (transform, part) = group.shown(&group.instances[index], time, &mut room);
                let corners = part.corners_at(time, [inner, inner])?;
                Some(corners.map(|corner| transform.to_world.transform_point3(corner)))
            }
            Kind::Sphere | Kind::Plane | Kind::Shape | Kind::TransformedShape => None,
        }
    }

    fn parameters_at(
        &self,
        probe: &PreparedRay,
        hit: ShapeHit<R>,
        [slot, inner]: [u32; 2],
    ) -> Parameters<R> {
        let (group, slot) = (&self.group, &self.group.slots[slot as usize]);
        let index = slot.index as usize;
        match slot.kind {
            Kind::Sphere => group.spheres[index].parameters(probe, hit),
            Kind::Triangle => self.triangle(index).parameters(probe, hit),
            Kind::Plane => group.planes[index].parameters(probe, hit),
            Kind::Shape => group.shapes[index].parameters(probe, hit),
            Kind::TransformedShape => group.placed[index].parameters(probe, hit),
            Kind::Instance => {
                let mut room = None;
                let (transform, part) = group.shown(&group.instances[index], probe.time, &mut room);
                let there =
                    part.parameters_at(&transform.probe_to_object(probe), hit, [inner, inner]);
                transform.parameters_to_world(&there)
            }
        }
    }
}

/// Triangle hits in structure-of-arrays layout.
struct HitLanes<R: Real> {
    len: usize,
    /// Indices in the list of hits.
    place: [usize; LANES],
    /// Corners by axis, and the weights of the second and third corner.
    corners: [[[R; LANES]; 3]; 3],
    weights: [[R; LANES]; 2],
}

impl<R: Real> Default for HitLanes<R> {
    fn default() -> Self {
        let none = [R::ZERO; LANES];
        Self {
            len: 0,
            place: [0; LANES],
            corners: [[none; 3]; 3],
            weights: [none; 2],
        }
    }
}

impl<R: Real> HitLanes<R> {
    #[inline(always)]
    fn push(&mut self, place: usize, triangle: &Triangle<R>, hit: &Hit<R>) {
        let lane = self.len;
        self.len += 1;
        self.place[lane] = place;
        for ([x, y, z], corner) in self.corners.iter_mut().zip(triangle.vertices) {
            (x[lane], y[lane], z[lane]) = (corner.x(), corner.y(), corner.z());
        }
        (self.weights[0][lane], self.weights[1][lane]) = (hit.u, hit.v);
    }

    /// Emits the surfaces of all stored hits and clears the list.
    #[inline(always)]
    fn locate(&mut self, out: &mut impl FnMut(usize, Surface<R>)) {
        if self.len == 0 {
            return;
        }
        let located = widest(LocateTriangles(self));
        for lane in 0..self.len {
            let [point, normal] = [located.point, located.normal]
                .map(|[x, y, z]| Vector::new(x[lane], y[lane], z[lane]));
            let surface = Surface {
                point,
                above: point,
                below: point,
                error: located.error[lane],
                normal,
            };
            let inside = located.is_inside[lane];
            out(
                self.place[lane],
                if inside {
                    surface
                } else {
                    self.triangle(lane).located(self.weights(lane)).stored()
                },
            );
        }
        self.len = 0;
    }

    #[inline(always)]
    fn triangle(&self, lane: usize) -> Triangle<R> {
        Triangle {
            vertices: self
                .corners
                .map(|[x, y, z]| Vector::new(x[lane], y[lane], z[lane])),
        }
    }

    #[inline(always)]
    fn weights(&self, lane: usize) -> [f64; 2] {
        // Component by component: `map` would take whole columns, which prevents vectorisation of
        // the loops over lanes.
        [
            self.weights[0][lane].to_f64(),
            self.weights[1][lane].to_f64(),
        ]
    }
}

/// Surfaces of several triangles, rounded to the stored scalar, and whether each is valid: points
/// near an edge of a triangle are not.
struct LocatedLanes<R> {
    point: [[R; LANES]; 3],
    normal: [[R; LANES]; 3],
    error: [R; LANES],
    is_inside: [bool; LANES],
}

struct LocateTriangles<'a, R: Real>(&'a HitLanes<R>);

impl<R: Real> Loops for LocateTriangles<'_, R> {
    type Output = LocatedLanes<R>;
    #[inline(always)]
    fn run(self) -> LocatedLanes<R> {
        let none = [R::ZERO; LANES];
        let mut out = LocatedLanes {
            point: [none; 3],
            normal: [none; 3],
            error: none,
            is_inside: [false; LANES],
        };
        for lane in 0..LANES {
            let corner = |k: usize| {
                let [x, y, z] = &self.0.corners[k];
                DVec3::new(x[lane].to_f64(), y[lane].to_f64(), z[lane].to_f64())
            };
            let (point, is_inside) = Triangle::<R>::located_inside(
                [corner(0), corner(1), corner(2)],
                self.0.weights(lane),
            );
            let surface = point.stored::<R>();
            for ([x, y, z], v) in [
                (&mut out.point, surface.point),
                (&mut out.normal, surface.normal),
            ] {
                (x[lane], y[lane], z[lane]) = (v.x(), v.y(), v.z());
            }
            out.error[lane] = surface.error;
            out.is_inside[lane] = is_inside;
        }
        out
    }
}

/// The part of the hit that a shape uses.
#[inline(always)]
fn own<R: Real>(hit: &Hit<R>) -> ShapeHit<R> {
    ShapeHit {
        t: hit.t,
        u: hit.u,
        v: hit.v,
    }
}
