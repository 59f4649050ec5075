//! Path tracing (Kajiya, "The Rendering Equation", 1986).
//!
//! Each vertex samples one light and one scattered direction. Multiple importance sampling combines
//! both techniques (Veach, Guibas, "Optimally Combining Sampling Techniques for Monte Carlo
//! Rendering", 1995). The estimate is unbiased, except for paths beyond the depth limit.
//!
//! The state of a path is plain numbers ([`PathState`]). The next segment of a path does not depend
//! on the other paths in the wavefront.

mod bsdf_lanes;
mod classic;
mod diffuse_vertices;
mod emission;
mod equiangular;
mod general;
mod ground;
mod index_matched;
mod layered;
mod light;
pub(super) mod media;
mod mixture_material;
mod nested;
mod roulette;
mod scatter;
mod scattering;
mod shade;
mod smooth_vertices;
mod straight_transmittance;
mod transmittance;
mod veiled_hits;
mod vertex_queues;
mod vertices;
mod wavefront;

use raywright_bvh::{Hit, Ray, Real, RegisterWidth, TriangleSlot, Vector};

use media::MediumStack;
use wavefront::Wavefront;

use super::spawn::MinHitDistances;
use super::{CameraRays, FirstHit, LightTransport, MOST_PASSAGES, PathResults, PathSegment};
use crate::counters::Counters;
use crate::interaction::Interaction;
use crate::light::{
    LightSampleLanes, LightUsage, RectangleLamps, ShadowRayTargetKind, get_lane_vector,
};
use crate::observer::Observer;
use crate::prepare::{PreparedScene, PreparedSpawnRule};
use crate::sampler::{SampleAddress, SampleHash};

/// Number of paths in a wavefront. Their state fits in a core's own cache.
const BATCH_PATHS: usize = 256;

/// The path tracer.
pub(crate) struct PathTracer<'a, R: Real> {
    scene: &'a PreparedScene<R>,
    counters: Counters,
    usage: LightUsage,
    /// Whether first hits of camera rays are kept, because picture layers (AOVs) need them.
    keeps_first: bool,
    /// First hit of the current path.
    first_hit: Option<FirstHit>,
    /// Emission and sky that the camera sees directly along the current path, without reflected
    /// light.
    direct: R::Vec3,
    max_depth: u32,
    min_distances: MinHitDistances<R>,
    /// Whether ray queries are given the triangles at the ends of a ray
    /// ([`RayEndTriangles`](raywright_bvh::RayEndTriangles)). These triangles then need no exact intersection test.
    has_triangle_ends: bool,
    /// Whether hits on uniform triangles need no interaction: see [`ObjectRecord::uniform`](crate::prepare::ObjectRecord).
    has_uniform_triangles: bool,
    /// Lamps of matte vertices, which are then shaded by one task (`path_tracing/diffuse_vertices.rs`);
    /// `None` if the lights don't permit this.
    lamps: Option<Box<RectangleLamps>>,
    /// Registers for these vertices, if the processor has them. Results do not depend on the width.
    registers: RegisterWidth,
    /// Media around the camera.
    media: MediumStack,
    wavefront: Wavefront<R>,
}

impl<'a, R: Real> LightTransport<'a, R> for PathTracer<'a, R> {
    const MAX_BATCH: usize = BATCH_PATHS;

    fn new(
        scene: &'a PreparedScene<R>,
        max_depth: u32,
        keeps_first: bool,
        _: &'a dyn Observer,
    ) -> Self {
        let mut tracer = Self {
            scene,
            counters: Counters::default(),
            usage: LightUsage::new(&scene.lights),
            keeps_first,
            first_hit: None,
            direct: Vector::ZERO,
            max_depth,
            min_distances: scene.min_hit_distances(),
            has_triangle_ends: scene.geometry.can_skip_ray_ends()
                && matches!(scene.rules.spawn, PreparedSpawnRule::ErrorBound),
            has_uniform_triangles: has_uniform_triangles(scene),
            lamps: None,
            registers: RegisterWidth::Avx512,
            media: MediumStack::default(),
            wavefront: Wavefront::default(),
        };
        tracer.lamps = tracer.diffuse_vertex_lamps().map(Box::new);
        if scene.tracks_media {
            tracer.media = tracer.find_camera_media();
        }
        tracer
    }

    fn trace(&mut self, rays: CameraRays<'_, R>, out: &mut PathResults<R>) {
        out.clear();
        let mut wavefront = core::mem::take(&mut self.wavefront);
        self.trace_paths(rays, &mut wavefront, out);
        self.wavefront = wavefront;
    }

    fn trace_first_hit(&mut self, ray: Ray<R>) -> Option<FirstHit> {
        self.counters.camera += 1;
        FirstHit::from_ray(self.scene, ray)
    }

    fn take_counters(&mut self) -> Counters {
        core::mem::take(&mut self.counters)
    }

    fn into_light_usage(self) -> LightUsage {
        self.usage
    }
}

/// Density per steradian from which on a lobe counts as a mirror. A lobe of this density is seven
/// times narrower than the sun's disc of 1/14,700 sr. Hardly any direction sampled towards a light
/// falls into it.
const MIRROR_DENSITY: f64 = 1e5;

/// Ratio of the density of a scattered direction to that of a light sample, from which on hardly any
/// light sample falls into the lobe: BSDF sampling then has 99 % of the weight.
const NARROW: f64 = 10.0;

/// Whether hits on uniform triangles need no interaction in a scene. Absorbing media need the
/// distance and the side of every hit, nested media its material, wireframes the triangle's edges,
/// and constant offsets of rays the object's normal.
fn has_uniform_triangles<R: Real>(scene: &PreparedScene<R>) -> bool {
    matches!(scene.rules.spawn, PreparedSpawnRule::ErrorBound)
        && !scene.tracks_media
        && !scene.draws_edges
        && scene.objects.iter().any(|object| object.uniform.is_some())
}

/// State of a path: all data on which its next segment depends.
#[derive(Clone, Copy, Debug)]
struct PathState<R: Real> {
    /// The next ray.
    segment: PathSegment<R>,
    /// Triangle from which the next ray starts, see [`RayEndTriangles`](raywright_bvh::RayEndTriangles).
    start: TriangleSlot,
    /// Throughput of the path (beta).
    throughput: R::Vec3,
    /// Radiance collected so far.
    radiance: R::Vec3,
    /// Address of the next vertex in the sample sequence.
    address: SampleAddress,
    sample_hash: SampleHash,
    /// Segments traced so far.
    segments_traced: u32,
    /// Number of segments that end at index-matched boundaries.
    matched_segments: u32,
    /// Number of surfaces that the path passed straight, without scattering.
    passages: u32,
    /// Whether the path has hit a surface.
    has_hit: bool,
    /// Share of the studio's light that the scene blocks where the camera ray reaches the ground, 0
    /// to 1.
    shadow: R,
    /// Least density by solid angle of the path's scattered directions, except the latest. Small if
    /// a surface reflected the path diffusely.
    min_pdf: f64,
    /// Density by solid angle of the path's latest light sample, and its radiance.
    light_sample: [f64; 2],
    /// Whether the path's latest segment hits lights by chance alone, see [`Counters::narrow`].
    is_narrow: bool,
    /// Media that contain the next ray's origin.
    media: MediumStack,
    /// The vertex at which the next ray starts.
    previous: PreviousVertex<R>,
    /// Wavelength in nanometres, sampled at the first dispersive surface; `None` as long as the
    /// path carries all wavelengths.
    wavelength: Option<f64>,
}

impl<R: Real> PathState<R> {
    /// Keeps density and radiance of the light sample in a lane. Lights without size are never hit.
    #[inline(always)]
    fn record_light_sample(&mut self, lights: &LightSampleLanes<R>, lane: usize) {
        let density = lights.density[lane];
        if lights.target_kinds[lane] != ShadowRayTargetKind::Nothing && density > 0.0 {
            let arriving = get_lane_vector::<R>(&lights.arriving, lane).to_f64();
            self.light_sample = [density, density * arriving.max_element()];
        }
    }
}

/// Uniform numbers in [0, 1) that nearly every vertex of a path needs.
#[derive(Clone, Copy, Debug, Default)]
struct VertexSamples {
    /// Numbers for the choice of a light and of a point on the light.
    light: [f32; 4],
    /// Numbers for the choice of a lobe, the direction, and Russian roulette.
    scatter: [f32; 4],
}

/// Kinds of lights that a vertex samples. A path that hits another light counts in full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LightKinds {
    All,
    /// All but an even sky, which phase functions sample better, see
    /// [`Lights::even_sky_share`](crate::light::Lights::even_sky_share).
    AllButEvenSky,
    /// None of a size.
    None,
}

/// The vertex where the current ray starts: all data needed to compute with which density light
/// sampling would have chosen the ray's direction.
#[derive(Clone, Copy, Debug)]
struct PreviousVertex<R: Real> {
    /// Position of the vertex.
    from: R::Vec3,
    /// Unit normal of the side on which the vertex receives light; zero if the vertex receives
    /// light on both sides.
    normal: R::Vec3,
    /// Density by solid angle of the scattered direction. Infinite for camera rays and delta lobes,
    /// whose directions light sampling cannot choose.
    density: f64,
    /// Lights that the vertex samples.
    lights: LightKinds,
}

impl<R: Real> PathTracer<'_, R> {
    /// Returns the initial state of a camera ray's path.
    #[inline(always)]
    fn start_path(&self, ray: Ray<R>, address: SampleAddress) -> PathState<R> {
        PathState {
            segment: PathSegment {
                ray,
                ..PathSegment::from_camera(self.scene)
            },
            start: TriangleSlot::NONE,
            throughput: Vector::ONE,
            radiance: Vector::ZERO,
            address,
            sample_hash: address.sample_hash(),
            segments_traced: 0,
            matched_segments: 0,
            passages: 0,
            has_hit: false,
            shadow: R::ZERO,
            min_pdf: f64::INFINITY,
            // Without a light sample only delta lobes are narrow.
            light_sample: [f64::MAX / NARROW, 0.0],
            is_narrow: false,
            media: self.media,
            previous: PreviousVertex {
                from: ray.origin,
                normal: ray.direction,
                density: f64::INFINITY,
                lights: LightKinds::All,
            },
            wavelength: None,
        }
    }

    /// Records the first hit of a path's camera ray on a surface that is present there, if picture
    /// layers (AOVs) need it.
    #[inline(always)]
    fn record_first_hit(
        &mut self,
        path: &PathState<R>,
        hit: &Hit<R>,
        interaction: &Interaction<R>,
    ) {
        if self.keeps_first
            && path.segments_traced == 0
            && self.first_hit.is_none()
            && !self.is_absent(path, interaction)
        {
            self.first_hit = Some(FirstHit::new(self.scene, &path.segment, hit));
        }
    }

    /// Continues a path straight through a surface that does not exist at the hit, because of its
    /// alpha or because a nested dielectric hides it. Returns whether the path goes on.
    fn pass_through_surface(
        &mut self,
        path: &mut PathState<R>,
        interaction: &Interaction<R>,
    ) -> bool {
        path.address.bounce += 1;
        let rest = path.segment.direction_error;
        let ray = Ray {
            is_camera_ray: path.segment.ray.is_camera_ray,
            ..self.scene.spawn_straight_ray(interaction)
        };
        path.segment.advance_to_ray(&ray, rest);
        self.count_passed_surface(path)
    }

    /// Counts a surface that a path passed straight. Returns whether the limit on such surfaces
    /// permits the path to go on.
    fn count_passed_surface(&mut self, path: &mut PathState<R>) -> bool {
        path.passages += 1;
        let ends = path.passages > MOST_PASSAGES;
        self.counters.cut_short += u64::from(ends);
        !ends
    }

    /// Whether a path has reached its depth limit. Segments that end at index-matched boundaries do
    /// not count.
    #[inline(always)]
    fn is_at_depth_limit(&self, path: &PathState<R>) -> bool {
        path.segments_traced - path.matched_segments >= self.max_depth
    }
}
