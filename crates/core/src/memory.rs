//! Memory of a render by purpose, such as geometry or textures.

use raywright_bvh::allocate_fallibly;
pub use raywright_bvh::{
    AllocationRefusal, limit_heap, remaining_heap_bytes, set_heap_refusal_handler,
};

/// Memory of a render in bytes, by purpose. These parts are not counted:
///
/// - expressions: half a KiB when compiled, and their text in the scene;
/// - tiles of the film in progress, one per thread;
/// - temporary memory while an acceleration structure is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryUse {
    /// Primitives and accelerators; geometry shared by instances counts once.
    pub geometry: u64,
    /// Arrays of the meshes that objects show.
    pub meshes: u64,
    /// Tables that are read during shading: objects, materials, texture uses, lights.
    pub tables: u64,
    /// Decoded images in use.
    pub textures: u64,
    /// Sums of the film, and the finished picture with its layers. Without layers, these take 128
    /// bytes per pixel in four replicates (independent parts of the samples). Without random
    /// sampling, they take 38 bytes per pixel.
    pub film: u64,
}

/// Whether the system can allocate this number of bytes at once. The memory of the test is freed
/// again. Callers ask before an allocation whose failure would abort the program.
pub fn can_allocate(bytes: u64) -> bool {
    let mut room = Vec::<u8>::new();
    let given = usize::try_from(bytes)
        .is_ok_and(|bytes| allocate_fallibly(|| room.try_reserve_exact(bytes).is_ok()));
    // Without this line, the compiler may remove the unused allocation and assume that it succeeds.
    core::hint::black_box(&room);
    given
}

impl MemoryUse {
    /// Returns the sum over all purposes in bytes.
    pub fn total(&self) -> u64 {
        self.bytes_by_purpose()
            .into_iter()
            .fold(0, |sum, (_, bytes)| sum.saturating_add(bytes))
    }

    /// Returns the name and the bytes of each purpose.
    pub fn bytes_by_purpose(&self) -> [(&'static str, u64); 5] {
        let Self {
            geometry,
            meshes,
            tables,
            textures,
            film,
        } = *self;
        [
            ("geometry", geometry),
            ("meshes", meshes),
            ("tables", tables),
            ("textures", textures),
            ("picture", film),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: an allocation that no system can serve is reported as unavailable, a small one as
    /// available.
    #[test]
    fn the_system_is_asked() {
        assert!(can_allocate(0) && can_allocate(1 << 20));
        assert!(!can_allocate(u64::MAX) && !can_allocate(1 << 60));
    }
}
