//! Mesh operations of the importers: repair of non-finite values, normals, transforms.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use rayon::iter::{IndexedParallelIterator, IntoParallelRefMutIterator, ParallelIterator};
use raywright_core::display::curve;
use raywright_core::scene::{MeshData, TransferCurve, TransformStep};
use raywright_core::validate::{MAX_COORDINATE, MIN_LENGTH};

use crate::import::Warnings;

/// Whether a transform is invertible. Rays can be traced in a mesh's own space only under an
/// invertible transform.
///
/// The test depends on the angles between the transform's axes, and hardly on its scale.
pub(crate) fn is_invertible(transform: &DAffine3) -> bool {
    let upright = |m: DMat3| {
        let axes = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
        let volume = m.determinant().abs() / (axes[0] * axes[1] * axes[2]);
        axes.iter().all(|length| *length >= MIN_LENGTH) && volume > 1e-9
    };
    upright(transform.matrix3) && upright(transform.matrix3.transpose())
}

/// Converts a transform to the list of steps that a scene object has: a single matrix, or an empty
/// list for the identity.
pub(crate) fn transform_steps(transform: &DAffine3) -> Vec<TransformStep> {
    if *transform == DAffine3::IDENTITY {
        return Vec::new();
    }
    let (m, t) = (transform.matrix3.transpose(), transform.translation);
    let row = |axis: DVec3, t: f64| [axis.x, axis.y, axis.z, t];
    vec![TransformStep::Matrix([
        row(m.x_axis, t.x),
        row(m.y_axis, t.y),
        row(m.z_axis, t.z),
    ])]
}

/// Applies a singular transform to a mesh. Its normals and tangents are dropped, because a singular
/// matrix has no inverse to transform them; triangles then get their facet normals.
pub(crate) fn apply_singular_transform(mesh: &MeshData, transform: &DAffine3) -> MeshData {
    let moved: Vec<DVec3> = mesh
        .positions
        .iter()
        .map(|p| transform.transform_point3(p))
        .collect();
    MeshData {
        positions: moved.into(),
        normals: Vec::new(),
        tangents: Vec::new(),
        ..mesh.clone()
    }
}

/// Drops triangles that have a vertex with non-finite or excessively large coordinates. Each such
/// vertex is moved to the first valid vertex, so that the bounds of the mesh stay finite. Returns
/// the number of dropped triangles.
pub(crate) fn drop_non_finite_triangles(mesh: &mut MeshData) -> usize {
    let unusable: Vec<bool> = mesh
        .positions
        .iter()
        .map(|p| !p.to_array().iter().all(|c| c.abs() <= MAX_COORDINATE))
        .collect();
    if !unusable.contains(&true) {
        return 0;
    }
    let before = mesh.indices.len();
    mesh.indices.retain(|triangle| {
        triangle
            .iter()
            .all(|&i| unusable.get(i as usize) == Some(&false))
    });
    let first = unusable.iter().position(|unusable| !unusable);
    let stand_in = first.map_or_else(<[f32; 3]>::default, |vertex| {
        mesh.positions.offsets()[vertex]
    });
    for (offset, _) in mesh
        .positions
        .offsets_mut()
        .iter_mut()
        .zip(&unusable)
        .filter(|(_, unusable)| **unusable)
    {
        *offset = stand_in;
    }
    before - mesh.indices.len()
}

/// Converts an sRGB colour with channels in 0..1 to linear RGBA with alpha 1. Used for vertex and
/// face colours of formats without colour management. A NaN channel becomes 1.
pub(crate) fn decode_vertex_colour(rgb: [f32; 3]) -> [f32; 4] {
    let linear = |c: f32| {
        if c.is_nan() {
            1.0
        } else {
            curve::decode_transfer(TransferCurve::Srgb, f64::from(c.clamp(0.0, 1.0))) as f32
        }
    };
    let [r, g, b] = rgb.map(linear);
    [r, g, b, 1.0]
}

/// Returns the factor from the channels of all vertex colours of a file, stored as fractions or as
/// codes from 0 to 255, to 0..1. Channels are codes if half of them are above 1, and the largest is
/// far above 1. Other channels above 1 are fractions that a program rounded or made too bright;
/// they are clamped, with a warning.
pub(crate) fn vertex_colour_scale(
    channels: impl Iterator<Item = f32>,
    warnings: &mut Warnings,
) -> f32 {
    let (mut above, mut within, mut largest, mut least_code) = (0_usize, 0_usize, 0.0_f32, 2.0);
    for channel in channels.filter(|channel| *channel > 0.0) {
        *if channel > 1.0 {
            &mut above
        } else {
            &mut within
        } += 1;
        largest = largest.max(channel);
        if channel.fract() != 0.0 {
            least_code = 16.0;
        }
    }
    let whole = if above >= within && largest > least_code {
        255.0
    } else {
        1.0
    };
    if largest > whole {
        warn!(
            warnings,
            Range,
            "colours of vertices or faces reach {largest}; channels above {whole} are clamped"
        );
    }
    1.0 / whole
}

/// Normalises the normals of a mesh. A zero or non-finite normal is replaced by the mean normal of
/// the triangles at the vertex, weighted by area.
pub(crate) fn repair_normals(mesh: &mut MeshData) {
    let mend = |(i, normal): (usize, &mut [f32; 3])| match Vec3::from_array(*normal)
        .as_dvec3()
        .try_normalize()
    {
        Some(unit) => {
            *normal = unit.as_vec3().to_array();
            None
        }
        None => Some(i),
    };
    let lacking: Vec<usize> = mesh
        .normals
        .par_iter_mut()
        .enumerate()
        .with_min_len(1 << 14)
        .filter_map(mend)
        .collect();
    if lacking.is_empty() {
        return;
    }
    let facets = sum_facet_normals(mesh);
    for i in lacking {
        let mean = facets
            .get(i)
            .and_then(|n| n.try_normalize())
            .unwrap_or(DVec3::Y);
        mesh.normals[i] = mean.as_vec3().to_array();
    }
}

/// Returns for each vertex the sum of the normals of its triangles, each weighted by area.
fn sum_facet_normals(mesh: &MeshData) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for triangle in &mesh.indices {
        let corner = |k: usize| {
            mesh.positions
                .offsets()
                .get(triangle[k] as usize)
                .map_or(DVec3::ZERO, |p| Vec3::from_array(*p).as_dvec3())
        };
        let normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
        for &i in triangle {
            if let Some(sum) = sums.get_mut(i as usize) {
                *sum += normal;
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn triangle(positions: Vec<[f32; 3]>) -> MeshData {
        MeshData {
            positions: positions.into(),
            indices: vec![[0, 1, 2], [2, 1, 3]],
            ..MeshData::default()
        }
    }

    /// Protects: an invalid vertex removes its triangles, and no non-finite value remains for the
    /// bounds.
    #[test]
    fn unusable_vertices_go_with_their_triangles() {
        for bad in [f32::NAN, f32::INFINITY, -1e30] {
            let mut mesh = triangle(vec![
                [bad, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [1.0, 1.0, 0.0],
            ]);
            assert_eq!(drop_non_finite_triangles(&mut mesh), 1, "{bad}");
            assert_eq!(mesh.indices, [[2, 1, 3]]);
            assert_eq!(mesh.positions.offsets()[0], [1.0, 0.0, 0.0]);
        }
    }

    /// Protects: a zero normal becomes the mean of its facets' normals; other normals are only
    /// normalised.
    #[test]
    fn normals_without_length_are_made_anew() {
        let mut mesh = triangle(vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
        ]);
        mesh.normals = vec![
            [0.0; 3],
            [0.0, 3.0, 4.0],
            [f32::NAN, 0.0, 0.0],
            [0.0, 0.0, -1.0],
        ];
        repair_normals(&mut mesh);
        assert_eq!(
            mesh.normals,
            [
                [0.0, 0.0, 1.0],
                [0.0, 0.6, 0.8],
                [0.0, 0.0, 1.0],
                [0.0, 0.0, -1.0]
            ]
        );
    }

    /// Protects: the test for singular transforms does not depend on scale.
    #[test]
    fn flatness_does_not_depend_on_scale() {
        let turned = DQuat::from_rotation_y(0.5);
        for size in [1e-9, 1.0, 1e9] {
            let value_of = |scale: DVec3| {
                DAffine3::from_scale_rotation_translation(scale * size, turned, DVec3::ONE)
            };
            assert!(is_invertible(&value_of(DVec3::new(1.0, -2.0, 1e-3))));
            assert!(!is_invertible(&value_of(DVec3::new(1.0, 0.0, 1.0))));
        }
        let sheared =
            DAffine3::from_cols(DVec3::X, DVec3::new(1.0, 1e-12, 0.0), DVec3::Z, DVec3::ZERO);
        assert!(!is_invertible(&sheared));
    }

    /// Protects: transforms are written by rows of the matrix, translation last.
    #[test]
    fn transforms_are_written_by_rows() {
        assert!(transform_steps(&DAffine3::IDENTITY).is_empty());
        let moved = DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0))
            * DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let [TransformStep::Matrix(rows)] = transform_steps(&moved)[..] else {
            panic!("one matrix")
        };
        let rounded = rows.map(|row| row.map(|x| x.round()));
        assert_eq!(
            rounded,
            [
                [0.0, -1.0, 0.0, 1.0],
                [1.0, 0.0, 0.0, 2.0],
                [0.0, 0.0, 1.0, 3.0]
            ]
        );
    }

    /// Protects: a singular transform keeps all attributes except normals, which it cannot map.
    #[test]
    fn what_is_squeezed_has_no_normals() {
        let mut mesh = triangle(vec![
            [0.0; 3],
            [1.0, 2.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 3.0],
        ]);
        mesh.normals = vec![[0.0, 0.0, 1.0]; 4];
        mesh.uvs = vec![vec![[0.5; 2]; 4]];
        let flat = apply_singular_transform(
            &mesh,
            &DAffine3::from_scale_rotation_translation(
                DVec3::new(2.0, 0.0, 1.0),
                DQuat::IDENTITY,
                DVec3::X,
            ),
        );
        assert_eq!(
            (flat.positions.offsets()[3], flat.positions.offsets()[1]),
            ([3.0, 0.0, 3.0], [3.0, 0.0, 0.0])
        );
        assert_eq!(
            (flat.normals.len(), &flat.uvs, &flat.indices),
            (0, &mesh.uvs, &mesh.indices)
        );
    }
}
