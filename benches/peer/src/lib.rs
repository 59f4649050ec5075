//! Raywright's tree as a peer of a harness that traces the same rays with several kernels: the four
//! functions that the harness loads from a shared library. `benches/README.md` says how to run it.
//!
//! A variant is a precision, `robust` or `reference`, and after a colon the name of a kernel or of
//! a build quality, in any order. With `together`, consecutive rays with a common origin and range
//! are traced as packets.
#![expect(unsafe_code, reason = "a C interface: pointers come from the harness")]

use std::ffi::{CStr, c_char};

use glam::Vec3;
use raywright_bvh::{
    AcceleratorKind, BuildQuality, Geometry, Interval, Kernel, PacketBackoff, PrimitiveSet, Ray,
    RayPacket, Real, Vector, Visibility,
};

/// A ray of the harness.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RayIn {
    origin: [f32; 3],
    min: f32,
    direction: [f32; 3],
    max: f32,
}

/// A hit of the harness; a miss has the greatest primitive number.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct HitOut {
    t: f32,
    primitive: u32,
}

trait Peer {
    fn closest(&self, rays: &[RayIn], hits: &mut [HitOut]);
    fn any(&self, rays: &[RayIn], hits: &mut [u8]);
}

fn ray<R: Real>(ray: &RayIn) -> (Ray<R>, Interval<R>) {
    let wide = |v: [f32; 3]| Vector::from_f64(Vec3::from_array(v).as_dvec3());
    let range = Interval {
        min: R::from_f32(ray.min),
        max: R::from_f32(ray.max),
    };
    (Ray::new(wide(ray.origin), wide(ray.direction)), range)
}

impl<R: Real> Peer for Geometry<R> {
    fn closest(&self, rays: &[RayIn], hits: &mut [HitOut]) {
        for (requested, hit) in rays.iter().zip(hits) {
            let (ray, range) = ray::<R>(requested);
            let found_hit = self.closest(&ray, range, &mut ());
            *hit = found_hit.map_or(
                HitOut {
                    t: 0.0,
                    primitive: u32::MAX,
                },
                |h| HitOut {
                    t: h.t.to_f32(),
                    primitive: h.primitive,
                },
            );
        }
    }

    fn any(&self, rays: &[RayIn], hits: &mut [u8]) {
        for (requested, hit) in rays.iter().zip(hits) {
            let (ray, range) = ray::<R>(requested);
            *hit = self.occluded(&ray, range, &mut |_| true, &mut ()).into();
        }
    }
}

/// Traces rays with a common origin as packets.
struct PacketPeer<R: Real>(Geometry<R>);

impl<R: Real> Peer for PacketPeer<R> {
    fn closest(&self, rays: &[RayIn], mut hits: &mut [HitOut]) {
        let alike = |a: &RayIn, b: &RayIn| (a.origin, a.min, a.max) == (b.origin, b.min, b.max);
        let (mut directions, mut found_hits, mut backoff) =
            (Vec::new(), Vec::new(), PacketBackoff::default());
        for rays in rays.chunk_by(alike) {
            let (first, range) = ray::<R>(&rays[0]);
            directions.clear();
            directions.extend(rays.iter().map(|requested| ray::<R>(requested).0.direction));
            let requested = RayPacket {
                origin: first.origin,
                directions: &directions,
                time: first.time,
                culls: false,
                range,
            };
            self.0
                .closest_of_packet(&requested, &mut backoff, &mut found_hits);
            let (these, rest) = hits.split_at_mut(rays.len());
            for (hit, found_hit) in these.iter_mut().zip(&found_hits) {
                *hit = found_hit.map_or(
                    HitOut {
                        t: 0.0,
                        primitive: u32::MAX,
                    },
                    |h| HitOut {
                        t: h.t.to_f32(),
                        primitive: h.primitive,
                    },
                );
            }
            hits = rest;
        }
    }

    fn any(&self, rays: &[RayIn], hits: &mut [u8]) {
        Peer::any(&self.0, rays, hits);
    }
}

fn build<R: Real + 'static>(
    triangles: impl Iterator<Item = [Vec3; 3]>,
    variant: &str,
    bytes: &mut u64,
) -> Option<Box<dyn Peer>> {
    let mut group = PrimitiveSet::<R>::default();
    let corners = triangles.map(|corners| corners.map(|p| Vector::from_f64(p.as_dvec3())));
    group.add_mesh(corners, Visibility::default()).ok()?;
    let named = |name: &str| {
        variant
            .split(':')
            .any(|part| part.eq_ignore_ascii_case(name))
    };
    let quality = BuildQuality::ALL
        .into_iter()
        .find(|quality| named(&format!("{quality:?}")))
        .unwrap_or_default();
    let kind = if named("scan") {
        AcceleratorKind::Linear
    } else {
        AcceleratorKind::Tree(quality)
    };
    // As many threads as the harness allows for this one.
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .ok()?;
    let mut geometry = pool.install(|| Geometry::new(group, kind));
    if let Some(kernel) = Kernel::available()
        .into_iter()
        .find(|kernel| named(&format!("{kernel:?}")))
    {
        geometry.set_kernel(kernel);
    }
    *bytes = geometry.memory_bytes() as u64;
    if named("together") {
        Some(Box::new(PacketPeer(geometry)))
    } else {
        Some(Box::new(geometry))
    }
}

/// Builds a tree over a mesh; null if the mesh or the variant is refused.
///
/// # Safety
/// `variant` is a C string, `places` points to three numbers for each of `vertices`, `indices`
/// points to three indices below `vertices` for each of `triangles`, and one number may be written
/// at `bytes`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn peer_build(
    variant: *const c_char,
    places: *const f32,
    vertices: u32,
    indices: *const u32,
    triangles: u32,
    bytes: *mut u64,
) -> *mut std::ffi::c_void {
    // SAFETY: the caller guarantees these conditions.
    let (variant, places, indices, bytes) = unsafe {
        (
            CStr::from_ptr(variant).to_string_lossy(),
            std::slice::from_raw_parts(places.cast::<[f32; 3]>(), vertices as usize),
            std::slice::from_raw_parts(indices.cast::<[u32; 3]>(), triangles as usize),
            &mut *bytes,
        )
    };
    let corners = indices
        .iter()
        .map(|corners| corners.map(|i| Vec3::from_array(places[i as usize])));
    let peer = if variant.split(':').any(|part| part == "reference") {
        build::<f64>(corners, &variant, bytes)
    } else {
        build::<f32>(corners, &variant, bytes)
    };
    peer.map_or(std::ptr::null_mut(), |peer| {
        Box::into_raw(Box::new(peer)).cast()
    })
}

/// The closest hit of each ray.
///
/// # Safety
/// `peer` comes from [`peer_build`] and was not freed; `rays` points to `count` rays, and `hits` to
/// room for as many hits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn peer_closest(
    peer: *const std::ffi::c_void,
    rays: *const RayIn,
    count: usize,
    hits: *mut HitOut,
) {
    // SAFETY: the caller guarantees these conditions.
    unsafe {
        let peer = &**peer.cast::<Box<dyn Peer>>();
        peer.closest(
            std::slice::from_raw_parts(rays, count),
            std::slice::from_raw_parts_mut(hits, count),
        );
    }
}

/// Whether each ray has a hit: 1 or 0.
///
/// # Safety
/// As for [`peer_closest`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn peer_any(
    peer: *const std::ffi::c_void,
    rays: *const RayIn,
    count: usize,
    hits: *mut u8,
) {
    // SAFETY: the caller guarantees these conditions.
    unsafe {
        let peer = &**peer.cast::<Box<dyn Peer>>();
        peer.any(
            std::slice::from_raw_parts(rays, count),
            std::slice::from_raw_parts_mut(hits, count),
        );
    }
}

/// Frees a tree from [`peer_build`].
///
/// # Safety
/// `peer` comes from [`peer_build`] and is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn peer_free(peer: *mut std::ffi::c_void) {
    // SAFETY: the caller guarantees these conditions.
    drop(unsafe { Box::from_raw(peer.cast::<Box<dyn Peer>>()) });
}
