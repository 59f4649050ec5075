//! Findings about images: invalid texels, images used for the wrong purpose, and meshes without the
//! texture coordinates that an image needs.

use super::meshes::UsedMesh;
use super::*;
use crate::scene::{Channel, ColourSpace, Image, ImageData, MaterialFields, PixelData, TextureRef};

impl<'a> SceneFacts<'a> {
    /// Returns the findings about the images that materials in use and the sky read.
    pub fn check_textures(&self) -> Vec<Fault> {
        let mut images = BTreeSet::new();
        let mut findings = Vec::new();
        for (index, material) in self.used_materials() {
            let subject = Subject::Material(index);
            for reference in material.textures() {
                images.extend(self.image(reference).map(|(index, _)| index));
                findings.extend(self.zero_transform_finding(reference, subject));
            }
            let MaterialModel::Physical(m) = &material.model else {
                continue;
            };
            for field in m.fields() {
                let is_colour = field.key.contains("colour") || field.key.starts_with("emission");
                let texture = field.value.texture().filter(|_| !is_colour);
                findings.extend(texture.and_then(|(_, texture)| {
                    self.colour_space_finding(texture, subject, &field.to_string())
                }));
            }
            let coat = m.clearcoat.as_ref();
            let coat = coat.and_then(|coat| coat.normal_texture.as_ref());
            let normals = m.normal_texture.iter().chain(coat);
            findings.extend(normals.filter_map(|reference| self.normal_map_finding(reference)));
        }
        if let Some(Sky::Map(map)) = &self.scene.sky {
            images.extend(self.lookup.images.index_of(&map.image));
        }
        let images = images.into_iter();
        findings.extend(images.flat_map(|index| check_image(index, &self.scene.images[index])));
        findings
    }

    /// Returns the image that a texture reads, with its index.
    fn image(&self, reference: &TextureRef) -> Option<(usize, &'a Image)> {
        let name = &self.lookup.texture(&reference.name)?.image;
        Some((self.lookup.images.index_of(name)?, self.lookup.image(name)?))
    }

    fn image_data(&self, reference: &TextureRef) -> Option<&'a ImageData> {
        self.image(reference)?.1.data.as_deref()
    }

    /// Returns whether a texture reads an image of one colour, which looks the same with any texture
    /// coordinates.
    fn is_uniform(&self, reference: &TextureRef) -> bool {
        let data = self.image_data(reference);
        data.is_some_and(|data| match &data.pixels {
            PixelData::Codes(pixels) => pixels.iter().all(|pixel| *pixel == pixels[0]),
            PixelData::Linear(pixels) => pixels.iter().all(|pixel| *pixel == pixels[0]),
        })
    }

    /// Returns a finding if a texture's `uv_transform` maps all coordinates to one point of an image
    /// of several colours.
    fn zero_transform_finding(&self, reference: &TextureRef, subject: Subject) -> Option<Fault> {
        let rows = reference.uv_transform?;
        let is_zero = rows.iter().all(|row| row[..2] == [0.0; 2]);
        let reason = format!(
            "the `uv_transform` of its texture `{}` multiplies all texture coordinates by zero, so that a single texel covers every surface",
            reference.name
        );
        let remedy =
            "set the scale in the first two columns of `uv_transform`, or remove `uv_transform`";
        (is_zero && self.image_data(reference).is_some() && !self.is_uniform(reference))
            .then(|| NoTextureCoordinates.fault(subject, reason, remedy))
    }

    /// Returns a finding if a map of directions or numbers is read as colours.
    fn colour_space_finding(
        &self,
        reference: &TextureRef,
        subject: Subject,
        slot: &str,
    ) -> Option<Fault> {
        let name = &reference.name;
        // Alpha is a number in any colour space.
        let is_colour = self.lookup.texture(name)?.colour_space == ColourSpace::Srgb
            && reference.channel != Some(Channel::Alpha);
        let has_codes = matches!(self.image_data(reference)?.pixels, PixelData::Codes(_));
        let reason = format!(
            "its `{slot}` needs directions or numbers, but the texture `{name}` is read as sRGB colours"
        );
        let remedy = format!("set `colour_space = \"linear\"` for the texture `{name}`");
        (is_colour && has_codes).then(|| DataReadAsColour.fault(subject, reason, remedy))
    }

    /// Returns a finding if an image used as a normal map holds no normals. In a normal map, blue is
    /// above one half in most texels.
    fn normal_map_finding(&self, reference: &TextureRef) -> Option<Fault> {
        let (index, image) = self.image(reference)?;
        let PixelData::Codes(pixels) = &image.data.as_ref()?.pixels else {
            return None;
        };
        let inwards = pixels.iter().filter(|pixel| pixel[2] < 128).count();
        let finding = NotANormalMap.fault(Subject::Image(index),
            "it is used as a normal map, but most of its directions point into the surface: it probably holds heights or colours",
            "use a map of normals, whose colour is mostly light blue",
        );
        let (count, total) = (inwards as u64, pixels.len() as u64);
        (2 * count > total).then(|| finding.with_count(count, total, "texels", "pointed inwards"))
    }
}

fn check_image(index: usize, image: &Image) -> Vec<Fault> {
    let Some(data) = image.data.as_deref() else {
        return Vec::new();
    };
    let texels = u64::from(data.width) * u64::from(data.height);
    let is_wrong = |pixel: &&[f32; 4]| !pixel.iter().all(|x| x.is_finite() && *x >= 0.0);
    let wrong = match &data.pixels {
        PixelData::Linear(pixels) => pixels.iter().filter(is_wrong).count() as u64,
        PixelData::Codes(_) => 0,
    };
    let mended = "channels of its texels are infinite or NaN; 65504 and 0 are used instead";
    let faults = [
        (image.mended, 3 * texels, "channels", mended),
        (
            wrong,
            texels,
            "texels",
            "it has texels that are negative, infinite or NaN",
        ),
    ];
    let found = faults.into_iter().filter(|(count, ..)| *count > 0);
    let finding = |(count, total, unit, reason): (u64, u64, &'static str, &str)| {
        let remedy = "export the image again, with finite numbers of 0 or more";
        ImageNotLight
            .fault(Subject::Image(index), reason, remedy)
            .with_count(count, total, unit, "had such numbers")
    };
    found.map(finding).collect()
}

impl UsedMesh<'_> {
    /// Returns the first fault of the texture coordinates that the mesh's materials use.
    pub fn check_texture_coordinates(&self) -> Option<Fault> {
        let mut judged = BTreeSet::new();
        self.objects.iter().find_map(|object| {
            let (_, material) = object.material.filter(|(index, _)| judged.insert(*index))?;
            let lacking = self.first_missing_uv_set(material);
            lacking
                .map(|set| self.missing_uv_finding(object, set))
                .or_else(|| self.flat_uv_finding(object, material))
        })
    }

    /// Returns the first set of texture coordinates that a material's images use and the mesh lacks.
    fn first_missing_uv_set(&self, material: &Material) -> Option<u32> {
        let sets: BTreeSet<u32> = material
            .textures()
            .filter(|texture| texture.uv.is_none() && !self.facts.is_uniform(texture))
            .map(|texture| texture.uv_set)
            .collect();
        // Readers put (0, 0) where a file has none.
        sets.into_iter().find(|&set| {
            let uvs = self.data.uvs.get(set as usize);
            uvs.is_none_or(|uvs| uvs.iter().all(|uv| *uv == [0.0; 2]))
        })
    }

    fn missing_uv_finding(&self, object: &ObjectFacts<'_>, set: u32) -> Fault {
        let reason = format!(
            "its material has an image with set {set} of texture coordinates, which the mesh lacks, or which is (0, 0) everywhere: a single texel covers the mesh"
        );
        let triangles = self.data.indices.iter().take(1 << 10);
        let triangles = (0..).zip(triangles.map(|corners| &corners[..]));
        let remedy =
            "export the mesh with texture coordinates, or remove the image from the material";
        let fault = NoTextureCoordinates.fault(object.index, reason, remedy);
        Fault {
            primitive: None,
            ..self.mark_nearest(fault, object, triangles)
        }
    }

    /// Finds triangles whose texture coordinates span no area, so that a normal map has no tangent
    /// direction.
    fn flat_uv_finding(&self, object: &ObjectFacts<'_>, material: &Material) -> Option<Fault> {
        let MaterialModel::Physical(m) = &material.model else {
            return None;
        };
        let texture = m.active_normal_map().filter(|texture| texture.uv.is_none());
        let uvs = self.data.uvs.get(texture?.uv_set as usize);
        let uvs = uvs.filter(|_| self.data.tangents.is_empty())?;
        let is_flat = |triangle: &u32| {
            let corners = self.data.indices[*triangle as usize];
            let uv = |corner: u32| uvs.get(corner as usize).copied().unwrap_or_default();
            let [a, b, c] = corners.map(|corner| uv(corner).map(f64::from));
            (b[0] - a[0]) * (c[1] - a[1]) == (b[1] - a[1]) * (c[0] - a[0])
        };
        let triangles = 0..self.triangle_count() as u32;
        let tally: CountAndFirst = triangles.filter(is_flat).collect();
        let finding = FlatTextureCoordinates.fault(
            object.index,
            "the texture coordinates of triangles with a normal map span no area, so that the map has no tangent directions there",
            "unwrap the mesh again in the modelling program, or export it with tangents",
        );
        let label = (&tally, "had such coordinates");
        let finding = finding.if_seen(2 * tally.count > self.triangle_count());
        (tally.count > 0).then(|| self.with_triangles(finding, object, label))
    }
}
