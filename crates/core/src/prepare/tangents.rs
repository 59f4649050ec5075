//! Generation of tangents. They are needed for meshes whose file has none, but whose material has a
//! normal map or anisotropy. The algorithm is MikkTSpace, which is also used by programs that bake
//! normal maps (Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008).

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};
use glam::Vec3;
use raywright_bvh::Real;

use super::error::{PrepareError, check_cancelled};
use super::geometry::BuiltGeometry;
use crate::generate::all_objects;
use crate::lookup::SceneLookup;
use crate::observer::Observer;
use crate::scene::{Material, MaterialModel, MeshData, Scene, Shape};

/// Tangents of a mesh for the three corners of each triangle, in the format of
/// [`MeshData::tangents`].
pub(crate) type CornerTangents = Vec<[[f32; 4]; 3]>;

/// Key of generated tangents: the index of the set of texture coordinates, and the linear part of
/// their transform as the bits of four `f64`.
pub(super) type TangentKey = (u32, [u64; 4]);

/// Returns the key of the tangents to be generated for a mesh with a material. `None` if the mesh
/// has tangents or the material needs none.
pub(super) fn tangent_key(material: Option<&Material>, data: &MeshData) -> Option<TangentKey> {
    let MaterialModel::Physical(model) = &material?.model else {
        return None;
    };
    let image = model.tangent_texture();
    // Anisotropy without an image follows the first set of coordinates.
    let requested =
        data.tangents.is_empty() && (image.is_some() || model.active_anisotropy().is_some());
    let map = image
        .and_then(|image| image.uv_transform)
        .unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let [[a, b, _], [c, d, _]] = map;
    requested.then(|| {
        (
            image.map_or(0, |image| image.uv_set),
            [a, b, c, d].map(f64::to_bits),
        )
    })
}

/// Generates the missing tangents and stores their indices in the objects. Objects with the same
/// mesh and key share them.
///
/// # Errors
/// [`PrepareError::Cancelled`], checked between meshes.
pub(super) fn generate_missing_tangents<R: Real>(
    scene: &Scene,
    built: &mut BuiltGeometry<R>,
    observer: &dyn Observer,
) -> Result<Vec<CornerTangents>, PrepareError> {
    let lookup = SceneLookup::new(scene);
    let (mut tables, mut places) = (Vec::new(), HashMap::new());
    let bumpy = built
        .objects
        .iter_mut()
        .zip(all_objects(scene))
        .filter(|(record, _)| record.needs_tangents);
    for (record, placed_object) in bumpy {
        let (Some(mesh), Shape::Mesh(name)) = (&mut record.mesh, &placed_object.object.shape)
        else {
            continue;
        };
        let material = lookup
            .material(&placed_object.object.material)
            .map(|(_, material)| material);
        let Some(data) = lookup.mesh_data(name) else {
            continue;
        };
        let Some(tangent_key) = tangent_key(material, data) else {
            continue;
        };
        let known = places.get(&(mesh.mesh, tangent_key)).copied();
        let index = match known {
            Some(index) => index,
            None => {
                check_cancelled(observer)?;
                tables.push(generate_mesh_tangents(data, tangent_key));
                let index = tables.len() as u32 - 1;
                places.insert((mesh.mesh, tangent_key), index);
                index
            }
        };
        mesh.tangents = Some(index);
    }
    Ok(tables)
}

/// Generates the tangents of a mesh.
fn generate_mesh_tangents(data: &MeshData, (set, map): TangentKey) -> CornerTangents {
    let largest = data
        .positions
        .offsets()
        .as_flattened()
        .iter()
        .fold(0.0_f32, |largest, x| largest.max(x.abs()));
    // Scaling by a power of two keeps all digits of the coordinates, and keeps products of edges
    // within the range of `f32`.
    let exponent = if largest > 0.0 {
        libm::ilogbf(largest)
    } else {
        0
    };
    let mut mesh = TangentMesh {
        data,
        set: set as usize,
        map: map.map(f64::from_bits),
        scale: libm::ldexp(1.0, -exponent),
        out: vec![[[0.0; 4]; 3]; data.indices.len()],
    };
    // The generation never fails for a valid mesh. A corner without a tangent later gets any
    // direction perpendicular to its normal.
    let _ = generate_tangents::<_, PortableMath>(&mut mesh);
    mesh.out
}

/// Floating-point functions for the MikkTSpace library, with the same results on every platform.
struct PortableMath;

impl Ops for PortableMath {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }
    fn acos(x: f32) -> f32 {
        libm::acos(f64::from(x)) as f32
    }
}

/// Adapter of a mesh to the interface of the MikkTSpace library.
struct TangentMesh<'a> {
    data: &'a MeshData,
    set: usize,
    map: [f64; 4],
    scale: f64,
    out: CornerTangents,
}

impl TangentMesh<'_> {
    fn vertex_index(&self, face: usize, corner: usize) -> usize {
        self.data.indices[face][corner] as usize
    }
}

impl Geometry<PortableMath> for TangentMesh<'_> {
    fn num_faces(&self) -> usize {
        self.data.indices.len()
    }
    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }
    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.data.positions.offsets()[self.vertex_index(face, corner)]
            .map(|x| (f64::from(x) * self.scale) as f32)
    }
    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        match self.data.normals.get(self.vertex_index(face, corner)) {
            Some(normal) => *normal,
            None => {
                let [a, b, c] = [0, 1, 2]
                    .map(|corner| Vec3::from_array(self.position(face, corner)).as_dvec3());
                (b - a)
                    .cross(c - a)
                    .normalize_or_zero()
                    .as_vec3()
                    .to_array()
            }
        }
    }
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // Texture coordinates at the corners of a triangle whose mesh has none.
        const WEIGHTS: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let [u, v] = match self.data.uvs.get(self.set).filter(|set| !set.is_empty()) {
            Some(set) => set[self.vertex_index(face, corner)],
            None if self.set == 0 => WEIGHTS[corner],
            None => [0.0; 2],
        };
        let ([u, v], [a, b, c, d]) = ([u, v].map(f64::from), self.map);
        // The top of an image is at v = 0, but the library assumes that v grows upwards.
        [(a * u + b * v) as f32, -(c * u + d * v) as f32]
    }
    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(tangent) = tangent {
            self.out[face][corner] = tangent.tangent_encoded();
        }
    }
}
