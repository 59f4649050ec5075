//! Embree 4 through its C interface, loaded at run time.

use std::ffi::{CString, c_char, c_void};

use glam::{Affine3A, Vec3};
use raywright_bvh::Ray;

use super::InstanceHit;

type RtcHandle = *mut c_void;
type RtcQuery = unsafe extern "C" fn(RtcHandle, RtcHandle, RtcHandle);

unsafe extern "C" {
    fn dlopen(file: *const c_char, flags: i32) -> RtcHandle;
    fn dlsym(library: RtcHandle, name: *const c_char) -> RtcHandle;
}

#[repr(C, align(16))]
struct RtcRay {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instance: u32,
    /// Some builds have several levels of instances.
    rest: [u32; 4],
}

/// Default arguments of a query.
#[repr(C)]
struct Arguments {
    flags: u32,
    features: u32,
    pointers: [RtcHandle; 3],
    rest: [u64; 2],
}

/// A scene of instances.
pub struct Embree {
    scene: RtcHandle,
    closest: RtcQuery,
    any: RtcQuery,
}

/// A function of the library.
///
/// # Safety
/// `F` is the type of the function.
unsafe fn function<F: Copy>(library: RtcHandle, name: &str) -> F {
    let text = CString::new(name).unwrap_or_default();
    // SAFETY: the library is open, and the caller guarantees the type of the function.
    unsafe {
        let found = dlsym(library, text.as_ptr());
        assert!(!found.is_null(), "no {name}");
        std::mem::transmute_copy(&found)
    }
}

impl Embree {
    pub fn new(file: &str, mesh: &[[Vec3; 3]], maps: &[Affine3A]) -> Self {
        const TRIANGLES: u32 = 0;
        const INSTANCE: u32 = 121;
        const FLOAT3: u32 = 0x9003;
        const UINT3: u32 = 0x5003;
        const COLUMNS: u32 = 0x9234;
        let text = CString::new(file).unwrap_or_default();
        // SAFETY: types, numbers and the order of calls follow Embree's manual; buffers have the
        // sizes that were requested.
        unsafe {
            let library = dlopen(text.as_ptr(), 2);
            assert!(!library.is_null(), "{file} can't be loaded");
            let new_scene: unsafe extern "C" fn(RtcHandle) -> RtcHandle =
                function(library, "rtcNewScene");
            let new_geometry: unsafe extern "C" fn(RtcHandle, u32) -> RtcHandle =
                function(library, "rtcNewGeometry");
            let new_buffer: unsafe extern "C" fn(
                RtcHandle,
                u32,
                u32,
                u32,
                usize,
                usize,
            ) -> *mut u8 = function(library, "rtcSetNewGeometryBuffer");
            let show: unsafe extern "C" fn(RtcHandle, RtcHandle) =
                function(library, "rtcSetGeometryInstancedScene");
            let place: unsafe extern "C" fn(RtcHandle, u32, u32, *const f32) =
                function(library, "rtcSetGeometryTransform");
            let commit: unsafe extern "C" fn(RtcHandle) = function(library, "rtcCommitGeometry");
            let attach: unsafe extern "C" fn(RtcHandle, RtcHandle) -> u32 =
                function(library, "rtcAttachGeometry");
            let commit_scene: unsafe extern "C" fn(RtcHandle) = function(library, "rtcCommitScene");
            let device = function::<unsafe extern "C" fn(*const c_char) -> RtcHandle>(
                library,
                "rtcNewDevice",
            )(c"threads=1".as_ptr());
            let (part, geometry) = (new_scene(device), new_geometry(device, TRIANGLES));
            let corners = new_buffer(geometry, 1, 0, FLOAT3, 12, mesh.len() * 3);
            std::ptr::copy_nonoverlapping(mesh.as_ptr().cast::<u8>(), corners, size_of_val(mesh));
            let indices: Vec<u32> = (0..mesh.len() as u32 * 3).collect();
            let to = new_buffer(geometry, 0, 0, UINT3, 12, mesh.len());
            std::ptr::copy_nonoverlapping(
                indices.as_ptr().cast::<u8>(),
                to,
                size_of_val(indices.as_slice()),
            );
            commit(geometry);
            attach(part, geometry);
            commit_scene(part);
            let scene = new_scene(device);
            for map in maps {
                let instance = new_geometry(device, INSTANCE);
                show(instance, part);
                place(instance, 0, COLUMNS, map.to_cols_array().as_ptr());
                commit(instance);
                attach(scene, instance);
            }
            commit_scene(scene);
            let error = function::<unsafe extern "C" fn(RtcHandle) -> i32>(
                library,
                "rtcGetDeviceError",
            )(device);
            assert_eq!(error, 0, "Embree's error");
            Self {
                scene,
                closest: function(library, "rtcIntersect1"),
                any: function(library, "rtcOccluded1"),
            }
        }
    }

    pub fn ask(&self, ray: &Ray<f32>, any: bool) -> InstanceHit {
        const NONE: u32 = u32::MAX;
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let ray = RtcRay {
            origin,
            near: 0.0,
            direction,
            time: 0.0,
            far: f32::INFINITY,
            mask: NONE,
            id: 0,
            flags: 0,
        };
        let mut requested = RtcRayHit {
            ray,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: NONE,
            geometry: NONE,
            instance: NONE,
            rest: [0; 4],
        };
        let none = std::ptr::null_mut();
        let mut arguments = Arguments {
            flags: 0,
            features: NONE,
            pointers: [none; 3],
            rest: [0; 2],
        };
        let query = if any { self.any } else { self.closest };
        // SAFETY: an aligned ray with room for a hit, and arguments in the library's layout.
        unsafe {
            query(
                self.scene,
                (&raw mut requested).cast(),
                (&raw mut arguments).cast(),
            )
        };
        match () {
            () if any => (requested.ray.far < 0.0).then_some((0.0, 0, 0)),
            () => (requested.geometry != NONE).then_some((
                requested.ray.far,
                requested.instance,
                requested.primitive,
            )),
        }
    }
}
