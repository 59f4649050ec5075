//! Texture coordinates of meshes: coordinates that an image needs and the mesh lacks, and
//! degenerate ones that give a normal map no tangent direction.

use std::collections::{BTreeSet, HashSet};

use super::cameras::item_nearest_to_camera;
use super::count::CountAndFirst;
use super::facts::{ObjectFacts, finite_point};
use super::finding::{FindingCode, Severity, StressFinding};
use super::textures::is_uniform_texture;
use super::used_mesh::UsedMesh;
use crate::scene::{Material, MaterialModel};

impl UsedMesh<'_> {
    /// Returns the first fault of the texture coordinates that the mesh's materials use.
    pub fn check_texture_coordinates(&self) -> Option<StressFinding> {
        let mut judged = HashSet::new();
        self.objects.iter().find_map(|object_facts| {
            let (index, material) = object_facts.material?;
            let is_new = judged.insert(index);
            let lacking = self.first_missing_uv_set(material).filter(|_| is_new);
            match lacking {
                Some(set) => Some(self.missing_uv_finding(object_facts, set)),
                None => {
                    let MaterialModel::Physical(m) = &material.model else {
                        return None;
                    };
                    let texture = m.active_normal_map().filter(|texture| texture.uv.is_none());
                    self.degenerate_uv_finding(object_facts, texture.filter(|_| is_new)?.uv_set)
                }
            }
        })
    }

    /// Returns the first set of texture coordinates that a material's images use and the mesh
    /// lacks. Images of one colour are ignored: they look the same with any coordinates.
    fn first_missing_uv_set(&self, material: &Material) -> Option<u32> {
        let sets: BTreeSet<u32> = material
            .textures()
            .filter(|texture| texture.uv.is_none())
            .filter(|texture| !is_uniform_texture(self.scene_facts, texture))
            .map(|texture| texture.uv_set)
            .collect();
        // Readers put (0, 0) where a file has none.
        sets.into_iter().find(|&set| {
            let uvs = self.data.uvs.get(set as usize);
            uvs.is_none_or(|uvs| uvs.iter().all(|uv| *uv == [0.0; 2]))
        })
    }

    fn missing_uv_finding(&self, object_facts: &ObjectFacts<'_>, set: u32) -> StressFinding {
        let is_there = self
            .data
            .uvs
            .get(set as usize)
            .is_some_and(|uvs| !uvs.is_empty());
        let reason = match (set, is_there) {
            (_, true) => format!(
                "its material has an image with set {set} of texture coordinates, but this set of the mesh is (0, 0) everywhere, so that a single texel covers the mesh"
            ),
            (0, false) => "its material has an image, but the mesh has no texture coordinates: each triangle shows the same corner of the image".to_owned(),
            _ => format!(
                "its material has an image with set {set} of texture coordinates, which the mesh lacks: a single texel covers the mesh"
            ),
        };
        let remedy =
            "export the mesh with texture coordinates, or remove the image from the material";
        let finding = StressFinding::new(
            FindingCode::NoTextureCoordinates,
            Severity::PictureWrong,
            object_facts.subject,
            reason,
            remedy,
        );
        let all = (0..self.triangle_count().min(1 << 10) as u32)
            .map(|triangle| ((), self.triangle_centre(object_facts, triangle)));
        let nearest = item_nearest_to_camera(self.views, all);
        finding.with_place(nearest.and_then(|(_, point)| finite_point(point)))
    }

    /// Finds triangles whose texture coordinates span no area, so that a normal map has no tangent
    /// direction.
    fn degenerate_uv_finding(
        &self,
        object_facts: &ObjectFacts<'_>,
        set: u32,
    ) -> Option<StressFinding> {
        let uvs = self
            .data
            .uvs
            .get(set as usize)
            .filter(|_| self.data.tangents.is_empty())?;
        let is_flat = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| {
                uvs.get(corner as usize)
                    .copied()
                    .unwrap_or_default()
                    .map(f64::from)
            });
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            area == 0.0
        };
        let flat = self
            .data
            .indices
            .iter()
            .enumerate()
            .filter(|(_, corners)| is_flat(corners));
        let tally = CountAndFirst::from_items(flat.map(|(index, _)| index as u32));
        let most = 2 * tally.count > self.triangle_count();
        let severity = if most {
            Severity::PictureWrong
        } else {
            Severity::Harmless
        };
        let reason = "the texture coordinates of triangles with a normal map span no area, so that the map has no tangent directions there";
        let words = (
            reason,
            "unwrap the mesh again in the modelling program, or export it with tangents",
        );
        let label = (&tally, "had such coordinates");
        let kind = (FindingCode::FlatTextureCoordinates, severity);
        (tally.count > 0).then(|| self.triangle_finding(kind, object_facts, label, words))
    }
}
