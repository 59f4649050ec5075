//! What importers do to meshes beyond reading them: repair what is not finite, make normals, apply transforms.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use raywright_core::scene::{MeshData, TransformStep};
use raywright_core::validate::{FARTHEST, SMALLEST};

/// Whether a transform can be undone; rays are traced in a mesh's own space.
///
/// Scale itself does not matter much, only how flat the axes lie.
pub(crate) fn is_invertible(transform: &DAffine3) -> bool {
    let upright = |m: DMat3| {
        let axes = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
        let volume = m.determinant().abs() / (axes[0] * axes[1] * axes[2]);
        axes.iter().all(|length| *length >= SMALLEST) && volume > 1e-9
    };
    upright(transform.matrix3) && upright(transform.matrix3.transpose())
}

/// A transform as a scene writes it; none for the identity.
pub(crate) fn transform_steps(transform: &DAffine3) -> Vec<TransformStep> {
    if *transform == DAffine3::IDENTITY {
        return Vec::new();
    }
    let (m, t) = (transform.matrix3.transpose(), transform.translation);
    let row = |axis: DVec3, t: f64| [axis.x, axis.y, axis.z, t];
    vec![TransformStep::Matrix([row(m.x_axis, t.x), row(m.y_axis, t.y), row(m.z_axis, t.z)])]
}

/// A mesh with its vertices moved by a transform that flattens it. Its normals would need the inverse, so facets take over.
pub(crate) fn squeezed(mesh: &MeshData, transform: &DAffine3) -> MeshData {
    let moved = |p: &[f32; 3]| {
        let p = transform.transform_point3(DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2])));
        p.as_vec3().to_array()
    };
    MeshData { positions: mesh.positions.iter().map(moved).collect(), normals: Vec::new(), ..mesh.clone() }
}

/// Drops triangles with a vertex that is not finite or absurdly far away, and gives such vertices the place of another, so
/// that bounds stay finite. Returns how many triangles went.
pub(crate) fn drop_unusable(mesh: &mut MeshData) -> usize {
    let usable = |p: &[f32; 3]| p.iter().all(|c| f64::from(c.abs()) <= FARTHEST);
    if mesh.positions.iter().all(usable) {
        return 0;
    }
    let before = mesh.indices.len();
    let positions = &mesh.positions;
    mesh.indices.retain(|triangle| triangle.iter().all(|&i| positions.get(i as usize).is_some_and(usable)));
    let stand_in = mesh.positions.iter().copied().find(usable).unwrap_or_default();
    for position in mesh.positions.iter_mut().filter(|p| !usable(p)) {
        *position = stand_in;
    }
    before - mesh.indices.len()
}

/// Brings normals to unit length; one that has none (zero, not usable) becomes the mean of its facets' normals.
pub(crate) fn mend_normals(mesh: &mut MeshData) {
    let unit = |n: &[f32; 3]| Vec3::from_array(*n).as_dvec3().try_normalize().map(|n| n.as_vec3().to_array());
    let mended: Vec<Option<[f32; 3]>> = mesh.normals.iter().map(unit).collect();
    let facets = if mended.contains(&None) { facet_means(mesh) } else { Vec::new() };
    let fallback = |i: usize| facets.get(i).and_then(|n| n.try_normalize()).unwrap_or(DVec3::Y).as_vec3().to_array();
    mesh.normals = mended.into_iter().enumerate().map(|(i, normal)| normal.unwrap_or_else(|| fallback(i))).collect();
}

/// For each vertex the sum of its facets' normals, weighted by area.
fn facet_means(mesh: &MeshData) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for triangle in &mesh.indices {
        let corner = |k: usize| mesh.positions.get(triangle[k] as usize).map_or(DVec3::ZERO, |p| Vec3::from_array(*p).as_dvec3());
        let normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
        for &i in triangle {
            if let Some(sum) = sums.get_mut(i as usize) {
                *sum += normal;
            }
        }
    }
    sums
}
