//! Readers of mesh and ray files, for the examples. The harness of ray kernels writes these files
//! (`benches/README.md`).

use glam::Vec3;

fn read_words(file: &str) -> Vec<[u8; 4]> {
    let bytes = std::fs::read(file).unwrap_or_else(|e| panic!("{file}: {e}"));
    bytes
        .chunks_exact(4)
        .map(|word| [word[0], word[1], word[2], word[3]])
        .collect()
}

/// Reads the triangles of a mesh file: two u32, the numbers of corners and of triangles, then three
/// f32 per corner and three u32 per triangle, little endian.
pub fn read_mesh(file: &str) -> Vec<[Vec3; 3]> {
    let words = read_words(file);
    let whole = |position: usize| u32::from_le_bytes(words[position]) as usize;
    let (corners, triangles) = (whole(0), whole(1));
    let corner = |i: usize| {
        Vec3::from_array([0, 1, 2].map(|axis| f32::from_le_bytes(words[2 + 3 * i + axis])))
    };
    let triangle = |i: usize| [0, 1, 2].map(|side| corner(whole(2 + 3 * corners + 3 * i + side)));
    (0..triangles).map(triangle).collect()
}

/// Reads the rays of a file: eight f32 per ray, little endian.
pub fn read_rays(file: &str) -> Vec<[f32; 8]> {
    let words = read_words(file);
    words
        .chunks_exact(8)
        .map(|ray| core::array::from_fn(|i| f32::from_le_bytes(ray[i])))
        .collect()
}
