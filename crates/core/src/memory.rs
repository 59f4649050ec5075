//! What memory a picture takes, part by part.

use raywright_bvh::allocate_fallibly;
pub use raywright_bvh::{Refusal, limit_heap, on_heap_refusal};

/// Bytes, by what takes them.
///
/// Not counted are expressions (a compiled one has about half a KiB, a text in the scene each), the
/// tiles being worked on, one a thread, and what a tree needs while it is being built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Primitives and accelerators; geometry that instances share once.
    pub geometry: u64,
    /// Arrays of the meshes that are shown.
    pub meshes: u64,
    /// What shading looks up: objects, materials, uses of textures, lights.
    pub tables: u64,
    /// Decoded images in use.
    pub textures: u64,
    /// Sums of the picture, and the picture with its layers that is made of them: 128 bytes a pixel
    /// in four replicates without layers, 38 without chance.
    pub film: u64,
}

/// Whether the system gives so many bytes at once. They are given back: it is asked before arrays
/// are made that have no other way to say that there is no room for them, and would end the
/// program.
pub fn is_available(bytes: u64) -> bool {
    let mut room = Vec::<u8>::new();
    let given = usize::try_from(bytes)
        .is_ok_and(|bytes| allocate_fallibly(|| room.try_reserve_exact(bytes).is_ok()));
    // Without this a compiler may leave out memory that nobody uses, and say that it was there.
    core::hint::black_box(&room);
    given
}

impl Memory {
    /// All of it.
    pub fn total(&self) -> u64 {
        self.parts()
            .into_iter()
            .fold(0, |sum, (_, bytes)| sum.saturating_add(bytes))
    }

    /// Each part with its name.
    pub fn parts(&self) -> [(&'static str, u64); 5] {
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

    /// Protects: memory that no system has is said not to be there, and a little is.
    #[test]
    fn the_system_is_asked() {
        assert!(is_available(0) && is_available(1 << 20));
        assert!(!is_available(u64::MAX) && !is_available(1 << 60));
    }
}
