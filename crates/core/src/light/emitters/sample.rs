//! Sampling of points on emitters, and the density with which sampling returns a hit point.

use glam::DVec3;
use raywright_bvh::shapes::{AnyShape, Sphere};
use raywright_bvh::{Real, Side, Surface, SurfacePoint, Vector};

use super::emission_cells::triangle_to_square;
use super::emitter_point::{EmitterDirection, EmitterPoint, PointDensity, side_sign};
use super::lanes::EmitterLanes;
use super::list::{Emitter, EmitterShape};
use super::{EmitterStrategy, Emitters};
use crate::light::lanes::{
    LANES, LightChoices, LightSampleLanes, ReceivingPointLanes, ShadowRayTargetKind,
};
use crate::light::polygon::PolygonSample;
use crate::light::rectangles::Rectangle;
use crate::light::{DirectionCone, LightDensity, LightId, LightSample, ShadowRayTarget};

/// Query for a point on an emitter: the emitter, the probability of its choice, the receiving
/// point, and two uniform numbers in [0, 1).
#[derive(Clone, Copy, Debug)]
struct EmitterQuery<R: Real> {
    pub emitter: u32,
    pub from: R::Vec3,
    pub position: [f32; 2],
    pub probability: f64,
}

/// Returns the sphere of an emitter, and the cone of directions to that sphere. `None` for other
/// shapes, for a receiving point inside the sphere, and for a sphere that emits only inwards.
fn sphere_and_cone<R: Real>(
    emitter: &Emitter<R>,
    from: DVec3,
) -> Option<(Sphere<R>, DirectionCone)> {
    match &emitter.shape {
        // A sphere that emits only inwards is visible through its near side.
        EmitterShape::Plain(AnyShape::Sphere(ball)) if emitter.side != Side::Inside => Some((
            *ball,
            DirectionCone::new(ball.centre.to_f64(), ball.radius.to_f64(), from)?,
        )),
        _ => None,
    }
}

impl<R: Real> Emitters<R> {
    /// Samples a point of an emitter, for the receiving point `from` and two uniform numbers in [0,
    /// 1). `probability` is that of choosing the emitter. `None` if the point does not contribute.
    pub fn sample(
        &self,
        index: u32,
        from: R::Vec3,
        position: [f32; 2],
        probability: f64,
    ) -> Option<LightSample<R>> {
        let query = EmitterQuery {
            emitter: index,
            from,
            position,
            probability,
        };
        let (emitter, from, position) = (
            &self.list.emitters[index as usize],
            from.to_f64(),
            position.map(f64::from),
        );
        if !self.is_sampled_by_solid_angle(emitter) {
            return self.sample_by_area(&query);
        }
        if let Some(polygon) = emitter.light_polygon() {
            return self.sample_polygon(&query, polygon.sample(from, position));
        }
        match sphere_and_cone(emitter, from) {
            Some((ball, cone)) => self.light_sample_at(
                &query,
                &ball.eval_surface_point(cone.sample_normal(position)),
                PointDensity::SolidAngle(cone.solid_angle()),
            ),
            None => self.sample_by_area(&query),
        }
    }

    /// Samples a point of each emitter among the chosen lights, as [`Self::sample`] does. Polygons
    /// are sampled first, all together in the buffer `lanes`. All other emitters follow one by one.
    pub(in crate::light) fn sample_lanes(
        &self,
        points: &ReceivingPointLanes<'_, R>,
        choices: &LightChoices<LANES>,
        lanes: &mut EmitterLanes<R>,
        out: &mut LightSampleLanes<R>,
    ) {
        let (mut is_flat, mut any) = ([false; LANES], false);
        for (lane, light) in choices.lights.iter().enumerate() {
            if let Some(LightId::Emitter(index)) = *light {
                is_flat[lane] = lanes.has_polygon(lane, index) || {
                    let emitter = &self.list.emitters[index as usize];
                    let polygon = if self.is_sampled_by_solid_angle(emitter) {
                        emitter.light_polygon()
                    } else {
                        None
                    };
                    if let Some(polygon) = &polygon {
                        lanes.set_polygon(lane, index, polygon, emitter);
                    }
                    polygon.is_some()
                };
                any |= is_flat[lane];
            }
        }
        let contributes = if any {
            lanes.sample(points, &choices.probabilities, out)
        } else {
            [None; LANES]
        };
        for (lane, light) in choices.lights.iter().enumerate() {
            let Some(LightId::Emitter(emitter)) = *light else {
                continue;
            };
            let ((from, position), probability) =
                (points.get_lane(lane), choices.probabilities[lane]);
            let sample = match contributes[lane].filter(|_| is_flat[lane]) {
                Some(true) => {
                    out.target_kinds[lane] = ShadowRayTargetKind::Surface;
                    continue;
                }
                Some(false) => None,
                // Polygons of small solid angle are sampled by area.
                None if is_flat[lane] => self.sample_by_area(&EmitterQuery {
                    emitter,
                    from,
                    position,
                    probability,
                }),
                None => self.sample(emitter, from, position, probability),
            };
            sample.iter().for_each(|sample| out.set_lane(lane, sample));
        }
    }

    /// Returns the light sample for a point sampled by solid angle on a polygon. If `sample` is
    /// `None`, a point is sampled by area instead.
    #[inline]
    fn sample_polygon(
        &self,
        query: &EmitterQuery<R>,
        sample: Option<PolygonSample>,
    ) -> Option<LightSample<R>> {
        let Some(PolygonSample { solid_angle, point }) = sample else {
            return self.sample_by_area(query);
        };
        let plane = self.list.emitters[query.emitter as usize].plane?;
        self.light_sample_at(
            query,
            &SurfacePoint::new(point?, plane.normal, plane.error),
            PointDensity::SolidAngle(solid_angle),
        )
    }

    /// Samples a point of an emitter by area: uniformly, or by the emitter's sampling cells.
    fn sample_by_area(&self, query: &EmitterQuery<R>) -> Option<LightSample<R>> {
        let emitter = &self.list.emitters[query.emitter as usize];
        let position = query.position.map(f64::from);
        let (place, denser) = match emitter.cells {
            Some(cells) => self.list.cells.sample_point(cells, position),
            None => (position, 1.0),
        };
        let [u, v] = place.map(R::from_f64);
        let (surface_point, by_area) = match &emitter.shape {
            EmitterShape::Plain(shape) => shape.sample_area(u, v)?,
            EmitterShape::Transformed(placed) => {
                self.list.transformed_shapes[*placed as usize].sample_area(u, v)?
            }
        };
        self.light_sample_at(
            query,
            &surface_point,
            PointDensity::Area(by_area.to_f64() * denser),
        )
    }

    /// Returns the light sample for a point of an emitter; `None` if the point does not contribute.
    #[inline(always)]
    fn light_sample_at(
        &self,
        query: &EmitterQuery<R>,
        surface_point: &SurfacePoint,
        drawn: PointDensity,
    ) -> Option<LightSample<R>> {
        let &EmitterQuery {
            emitter,
            from,
            probability,
            ..
        } = query;
        let emitter = &self.list.emitters[emitter as usize];
        let emitter_point = EmitterPoint::new(
            surface_point,
            side_sign(emitter.side),
            from,
            probability,
            drawn,
        );
        emitter_point.contributes().then(|| LightSample {
            direction: Vector::from_f64(emitter_point.direction),
            arriving: emitter.assumed_radiance() * R::from_f64(emitter_point.weight),
            density: LightDensity::SolidAngle(emitter_point.density),
            target: ShadowRayTarget::Surface(emitter_point.surface),
        })
    }

    /// Returns the density by solid angle with which [`Emitters::sample`] returns a given point of
    /// an emitter. `from` is the receiving point, `probability` the probability of choosing the
    /// emitter.
    pub fn density(
        &self,
        index: u32,
        from: R::Vec3,
        surface: &Surface<R>,
        probability: f64,
    ) -> f64 {
        let (emitter, from) = (&self.list.emitters[index as usize], from.to_f64());
        let facing = EmitterDirection::new(side_sign(emitter.side), from, surface);
        // False for NaN too, where the points coincide.
        let seen = facing.cosine > 0.0;
        if !seen {
            return 0.0;
        }
        if let Some(solid_angle) = self.solid_angle(emitter, from) {
            return probability / solid_angle;
        }
        let point = SurfacePoint::new(
            surface.point.to_f64(),
            surface.normal.to_f64(),
            surface.error.to_f64(),
        );
        let by_area = match &emitter.shape {
            EmitterShape::Plain(shape) => shape.area_density(&point),
            EmitterShape::Transformed(placed) => {
                self.list.transformed_shapes[*placed as usize].area_density(&point)
            }
        };
        let denser = match (&emitter.shape, emitter.cells) {
            (EmitterShape::Plain(AnyShape::Triangle(triangle)), Some(cells)) => {
                self.list.cells.density(
                    cells,
                    triangle_to_square(
                        triangle.vertices.map(Vector::to_f64),
                        surface.point.to_f64(),
                    ),
                )
            }
            _ => 1.0,
        };
        by_area.map_or(0.0, |by_area| {
            facing.squared_distance * (by_area.to_f64() * denser) * probability / facing.cosine
        })
    }

    /// Returns a lamp as a rectangle that is sampled by solid angle; `None` for other lamps.
    pub(in crate::light) fn rectangle(&self, index: u32) -> Option<Rectangle> {
        let emitter = &self.list.emitters[index as usize];
        let (EmitterShape::Plain(AnyShape::Quad(quad)), Some(plane)) =
            (&emitter.shape, emitter.plane)
        else {
            return None;
        };
        if !self.is_sampled_by_solid_angle(emitter) || emitter.varies {
            return None;
        }
        let corners = quad.corners.map(Vector::to_f64);
        let edges = Rectangle::from_corners(corners)?;
        let outwards = side_sign(emitter.side);
        Some(Rectangle {
            corner: corners[0],
            edges,
            radiance: emitter.radiance.to_f64(),
            error: plane.error,
            is_inside: (outwards < 0.0) != (plane.normal.dot(edges[0].cross(edges[1])) < 0.0),
            is_two_sided: outwards == 0.0,
        })
    }

    /// Whether points of an emitter are sampled by solid angle where its shape permits.
    #[inline(always)]
    fn is_sampled_by_solid_angle(&self, emitter: &Emitter<R>) -> bool {
        // Points on the far side of passable surfaces must be sampled too; varying emission is
        // sampled by its cells.
        self.strategy == EmitterStrategy::SolidAngle && !emitter.passable && emitter.cells.is_none()
    }

    /// Returns the solid angle in steradians over which an emitter is sampled uniformly; `None` if
    /// it is sampled by area.
    #[inline]
    fn solid_angle(&self, emitter: &Emitter<R>, from: DVec3) -> Option<f64> {
        if !self.is_sampled_by_solid_angle(emitter) {
            return None;
        }
        match emitter.light_polygon() {
            Some(polygon) => polygon.solid_angle(from),
            None => sphere_and_cone(emitter, from).map(|(_, cone)| cone.solid_angle()),
        }
    }
}
