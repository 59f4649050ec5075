//! Compressed geometry and pictures of real files, whole and broken.

use glam::DVec3;
use raywright_core::scene::PixelData;
use raywright_io::LoadedScene;

use crate::shared::{assets, load, world_triangles};

/// Protects: compressed geometry equals the original: Draco's box the unit box with its facets'
/// normals; meshoptimizer's duck, with 12-bit positions, the uncompressed duck to 2⁻¹² of its size,
/// with the same picture.
#[test]
fn compressed_geometry_is_decoded() {
    let Some(folder) = assets("gltf") else { return };
    let cube = load(&folder.join("compressed/Box-Draco/Box_Draco.glb"));
    let (corners, normals) = world_triangles(&cube, &cube.scene.objects[0]);
    assert_eq!(corners.len(), 12);
    for (corners, normals) in corners.iter().zip(&normals) {
        assert!(
            corners
                .iter()
                .flat_map(|c| c.to_array())
                .all(|x| (x.abs() - 0.5).abs() < 1e-3),
            "{corners:?}"
        );
        let facet = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize();
        assert!(
            normals.iter().all(|normal| normal.distance(facet) < 1e-2),
            "{normals:?}, not {facet:?}"
        );
    }
    let area: f64 = corners
        .iter()
        .map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length())
        .sum();
    assert!((area - 6.0).abs() < 1e-2, "{area}");
    let [plain, packed] = [
        "Duck/Duck.glb",
        "compressed/Duck-meshopt/Duck-vp-12-vt-12-vn-12.glb",
    ]
    .map(|file| load(&folder.join(file)));
    let shape = |loaded: &LoadedScene| {
        let (corners, _) = world_triangles(loaded, &loaded.scene.objects[0]);
        let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
        let whole: f64 = corners.iter().map(area).sum();
        let centre = corners
            .iter()
            .map(|t| (t[0] + t[1] + t[2]) * (area(t) / 3.0))
            .sum::<DVec3>()
            / whole;
        let (low, high) = corners
            .iter()
            .flatten()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| {
                (a.min(*p), b.max(*p))
            });
        (corners.len(), whole, [centre, low, high])
    };
    let ((n, area, places), (m, other, packed_places)) = (shape(&plain), shape(&packed));
    let size = places[1].distance(places[2]);
    assert_eq!(n, m);
    assert!((other / area - 1.0).abs() < 1e-2, "{other}, not {area}");
    for (place, other) in places.iter().zip(packed_places) {
        assert!(
            place.distance(other) < size / 4096.0,
            "{other:?}, not {place:?}"
        );
    }
}

/// Protects: compressed data that is truncated, or has false counts, is refused with its position.
#[test]
fn broken_compressed_geometry_is_refused() {
    let Some(folder) = assets("gltf/compressed") else {
        return;
    };
    let here = tempfile::tempdir().unwrap();
    for (file, word) in [
        ("Box-Draco/Box_Draco.glb", "KHR_draco"),
        ("Duck-meshopt/Duck-vp-12-vt-12-vn-12.glb", "EXT_meshopt"),
    ] {
        let bytes = std::fs::read(folder.join(file)).unwrap();
        let path = here.path().join("broken.glb");
        let binary = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize + 8;
        let mut refused = 0;
        for i in 0..200 {
            let mut broken = bytes.clone();
            let position = binary + i * 7919 % (bytes.len() - binary);
            broken[position] ^= 1 << (i % 8);
            std::fs::write(&path, broken).unwrap();
            match crate::shared::try_load(&path) {
                Ok(loaded) => crate::shared::check_sound(&loaded, &path),
                Err(error) => {
                    refused += 1;
                    let text = error.to_string();
                    assert!(
                        text.contains("broken.glb") && text.lines().count() == 1,
                        "{text}"
                    );
                }
            }
        }
        std::fs::write(&path, &bytes[..binary]).unwrap();
        assert!(crate::shared::try_load(&path).is_err());
        let mut empty = bytes.clone();
        empty[binary..].fill(0);
        std::fs::write(&path, empty).unwrap();
        let error = crate::shared::try_load(&path)
            .expect_err("zeros")
            .to_string();
        assert!(refused > 0 && error.contains(word), "{refused}: {error}");
    }
}

/// Protects: pictures in WebP and KTX2 are read, even without a fallback; the balloon's have the
/// declared sizes, its colours, and are opaque.
#[test]
fn pictures_of_extensions_are_read() {
    let Some(folder) = assets("gltf/compressed") else {
        return;
    };
    let balloon = load(&folder.join("CesiumBalloonKTX2/CesiumBalloonKTX2.glb"));
    let sizes: Vec<_> = balloon
        .scene
        .images
        .iter()
        .filter_map(|image| image.data.as_ref())
        .map(|d| [d.width, d.height])
        .collect();
    assert_eq!(
        sizes.iter().filter(|size| **size == [1024; 2]).count(),
        2,
        "{sizes:?}"
    );
    for image in &balloon.scene.images {
        let Some(PixelData::Codes(codes)) = image.data.as_ref().map(|data| &data.pixels) else {
            panic!("codes")
        };
        assert!(
            codes.iter().all(|code| code[3] == 255) && codes.iter().any(|code| code != &codes[0]),
            "{}",
            image.name
        );
    }
    for file in [
        "BoxTexturedWebp/BoxTexturedWebp.gltf",
        "CesiumBoxWebp-LocalTexture/CesiumBoxWebp-LocalTexture.gltf",
    ] {
        let loaded = load(&folder.join(file));
        let picture = loaded.scene.images[0].data.as_ref().expect("decoded");
        assert!(
            picture.width >= 64 && loaded.scene.textures.len() == 1,
            "{file}"
        );
    }
}
