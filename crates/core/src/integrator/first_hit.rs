//! First hits of camera rays. Rays of a common origin are intersected as packets. Picture layers
//! besides the colour (albedo, normal, depth and others) store the data of first hits.

use raywright_bvh::{Hit, Interval, PacketBackoff, Ray, RayPacket, Real, Vector};

use super::PathSegment;
use crate::interaction::Interaction;
use crate::prepare::PreparedScene;

/// Data of a first hit for the picture layers besides the colour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstHit {
    pub albedo: [f64; 3],
    pub normal: [f64; 3],
    /// Geometric unit normal, on the side of the ray.
    pub face: [f64; 3],
    pub position: [f64; 3],
    pub distance: f64,
    pub object: u32,
    pub material: u32,
}

impl FirstHit {
    /// Computes the data of a first hit.
    ///
    /// Not inlined: a picture without these layers costs a check alone. The function computes the
    /// surface point again; the caller's surface point then stays in registers.
    #[inline(never)]
    pub(super) fn new<R: Real>(
        scene: &PreparedScene<R>,
        segment: &PathSegment<R>,
        hit: &Hit<R>,
    ) -> Self {
        let interaction = Interaction::from_hit(scene, segment, hit);
        let context = scene.texture_tables.shading_context(&interaction);
        let albedo = scene.materials[interaction.material as usize].base_colour_at(&context);
        Self {
            albedo: albedo.to_f64().to_array(),
            normal: interaction.normal.to_f64().to_array(),
            face: (interaction.surface.normal.to_f64()
                * if interaction.outside { 1.0 } else { -1.0 })
            .to_array(),
            position: scene.to_world(interaction.surface.point).to_array(),
            distance: interaction.distance.to_f64(),
            object: interaction.object,
            material: interaction.material,
        }
    }

    /// Traces a camera ray to its first visible hit only; `None` for the sky.
    pub(super) fn from_ray<R: Real>(scene: &PreparedScene<R>, ray: Ray<R>) -> Option<Self> {
        let segment = PathSegment {
            ray,
            ..PathSegment::from_camera(scene)
        };
        let mut range = Interval {
            min: scene.min_hit_distances().camera - segment.skipped_distance,
            max: R::INFINITY,
        };
        let hit = loop {
            let hit = scene.geometry.closest(&ray, range, &mut ())?;
            if !scene.is_invisible_at(&segment, &hit) {
                break hit;
            }
            range.min = hit.t;
        };
        Some(Self::new(scene, &segment, &hit))
    }
}

impl<R: Real> PreparedScene<R> {
    /// Whether the surface at a hit is cut out by its alpha, or the boundary of a body without a
    /// surface.
    pub(super) fn is_invisible_at(&self, segment: &PathSegment<R>, hit: &Hit<R>) -> bool {
        let material = self.objects[hit.outermost_id() as usize].material;
        let material = &self.materials[material as usize];
        if material.blocks_straight_rays() {
            return false;
        }
        let interaction = Interaction::from_hit(self, segment, hit);
        material.is_open()
            || material.alpha_at(&self.texture_tables.shading_context(&interaction)) <= R::ZERO
    }

    /// Whether a hit is on the boundary of a body without a surface.
    pub(super) fn is_open_boundary(&self, hit: &Hit<R>) -> bool {
        let material = self.objects[hit.outermost_id() as usize].material;
        self.materials[material as usize].is_open()
    }
}

/// Closest hits of a packet of camera rays. Empty if the rays were intersected one by one.
#[derive(Default)]
pub(super) struct PacketHits<R: Real> {
    directions: Vec<R::Vec3>,
    hits: Vec<Option<Hit<R>>>,
    backoff: PacketBackoff,
}

impl<R: Real> PacketHits<R> {
    /// Returns the hit of a camera ray of the packet, `Some(None)` for the sky. Returns `None` if
    /// the rays were not intersected as a packet.
    #[inline(always)]
    pub fn get_ray_hit(&self, ray: usize) -> Option<&Option<Hit<R>>> {
        self.hits.get(ray)
    }

    /// Intersects camera rays as a packet, if all have the same origin and time. Otherwise the hits
    /// stay empty.
    pub fn intersect_packet(&mut self, scene: &PreparedScene<R>, rays: &[Ray<R>]) {
        let Self {
            directions,
            hits,
            backoff,
        } = self;
        hits.clear();
        let Some(first) = rays.first() else { return };
        if !rays
            .iter()
            .all(|ray| ray.origin == first.origin && ray.time == first.time)
        {
            return;
        }
        directions.clear();
        directions.extend(rays.iter().map(|ray| ray.direction));
        let range = Interval {
            min: scene.min_hit_distances().camera - scene.camera.eye_to_origin_distance(),
            max: R::INFINITY,
        };
        let requested = RayPacket {
            origin: first.origin,
            directions,
            time: first.time,
            culls: first.is_camera_ray,
            range,
        };
        scene.geometry.closest_of_packet(&requested, backoff, hits);
    }
}
