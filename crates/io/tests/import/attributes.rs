//! Vertex attributes of imported meshes, computed by hand: colours of every kind, and normals that
//! a file lacks in part.

use raywright_core::scene::MeshData;

use crate::shared::{check_sound, load, mesh_of};

/// Loads a glTF file of the triangle 0, x, y, whose outside is +z, with another attribute.
fn triangle(
    attribute: &str,
    component: u32,
    kind: &str,
    normalised: bool,
    values: &[u8],
) -> MeshData {
    let corners = [[0.0_f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bytes: Vec<u8> = corners
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    bytes.extend(values);
    // Elements lie at multiples of four bytes.
    let stride = values.len() / 3;
    let text = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "{attribute}": 1 }} }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }},
            {{ "bufferView": 1, "componentType": {component}, "count": 3, "type": "{kind}", "normalized": {normalised} }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }},
            {{ "buffer": 0, "byteOffset": 36, "byteLength": {}, "byteStride": {stride} }}],
        "buffers": [{{ "byteLength": {}, "uri": "a.bin" }}] }}"#,
        values.len(),
        bytes.len()
    );
    written("a.gltf", &text, &bytes)
}

/// Mesh of the first object in a file, from its text and the buffer beside it.
fn written(name: &str, text: &str, buffer: &[u8]) -> MeshData {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.bin"), buffer).unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    let file = load(&path);
    check_sound(&file, &path);
    mesh_of(&file, &file.scene.objects[0]).clone()
}

/// Protects: colours of three numbers are opaque and those of four have their own alpha, in each of
/// the three component types of glTF 2.0 (section 3.7.2.1). Bytes in place of a fourth number are
/// ignored.
#[test]
fn colours_of_three_numbers_are_opaque() {
    let covering = [
        [1.0_f32, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 1.0],
        [0.0, 0.0, 1.0, 0.6],
    ];
    let opaque = covering.map(|[r, g, b, _]| [r, g, b, 1.0]);
    let numbers = covering.as_flattened();
    let kinds: [(u32, Vec<u8>); 3] = [
        (5126, numbers.iter().flat_map(|x| x.to_le_bytes()).collect()),
        (5121, numbers.iter().map(|x| (x * 255.0) as u8).collect()),
        (
            5123,
            numbers
                .iter()
                .flat_map(|x| ((x * 65535.0) as u16).to_le_bytes())
                .collect(),
        ),
    ];
    for (component, values) in kinds {
        for (kind, expected) in [("VEC3", opaque), ("VEC4", covering)] {
            let found = triangle("COLOR_0", component, kind, component != 5126, &values).colours;
            assert_eq!(found, expected, "{component} {kind}");
        }
    }
}

/// Protects: short and missing normals of a file become the mean of the facets around, outward;
/// other normals keep their direction, even inward.
#[test]
fn missing_normals_point_outward() {
    let given = [[0.0_f32; 3], [0.0, 0.0, -2.0], [f32::NAN, 1.0, 0.0]];
    let expected = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]];
    let bytes: Vec<u8> = given
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    assert_eq!(
        triangle("NORMAL", 5126, "VEC3", false, &bytes).normals,
        expected
    );
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nvn 0 0 -2\nf 1//1 2//2 3//1\n";
    let model = written("a.obj", text, &[]);
    assert_eq!(model.normals, expected);
}

/// Protects: the normals of a smoothing group are outward and weight each facet by its area: a
/// floor of area 2 (two triangles) and a wall of area 1/2 meet at x = 0 in (1/2, 0, 2)/√(17/4), and
/// beyond that edge each has its own.
#[test]
fn smooth_normals_point_outward() {
    let text = "s 1\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4\nf 1 4 5\n";
    let model = written("a.obj", text, &[]);
    let length = f32::hypot(0.5, 2.0);
    let edge = [0.5 / length, 0.0, 2.0 / length];
    for (position, normal) in model.positions.offsets().iter().zip(&model.normals) {
        let expected = match position {
            [2.0, _, _] => [0.0, 0.0, 1.0],
            [_, _, 1.0] => [1.0, 0.0, 0.0],
            _ => edge,
        };
        let near = normal
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near, "{normal:?} instead of {expected:?} at {position:?}");
    }
    assert_eq!(model.normals.len(), model.positions.len());
}

/// Protects: adjacent smoothing groups share no normal: a floor and a wall in different groups each
/// keep their own, and in a common group the normals at the edge are averaged.
#[test]
fn smoothing_groups_keep_their_normals() {
    let model = |wall: &str| {
        let text = format!(
            "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\ns 1\nf 1 2 3 4\ns {wall}\nf 1 4 6 5\n"
        );
        written("a.obj", &text, &[])
    };
    let apart = model("2");
    assert!(
        apart
            .normals
            .iter()
            .all(|n| *n == [0.0, 0.0, 1.0] || *n == [1.0, 0.0, 0.0]),
        "{:?}",
        apart.normals
    );
    let edge = |data: &MeshData| {
        data.positions
            .offsets()
            .iter()
            .filter(|p| p[0] == 0.0 && p[2] == 0.0)
            .count()
    };
    assert_eq!((edge(&apart), edge(&model("1"))), (4, 2));
}

/// Protects: a mesh has every set of coordinates up to the largest that its material uses, each at
/// its own index: in a file with only the second set, the first is zeros.
#[test]
fn sets_of_coordinates_keep_their_places() {
    const DOT: &str = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";
    let given = [[0.0_f32, 0.0], [1.0, 0.0], [0.25, 1.0]];
    let corners = [[0.0_f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let numbers = corners.as_flattened().iter().chain(given.as_flattened());
    let bytes: Vec<u8> = numbers.flat_map(|x| x.to_le_bytes()).collect();
    let sets = |given: u32, read: u32| {
        let text = format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
            "images": [{{ "uri": "data:image/png;base64,{DOT}" }}], "textures": [{{ "source": 0 }}],
            "materials": [{{ "pbrMetallicRoughness": {{ "baseColorTexture": {{ "index": 0, "texCoord": {read} }} }} }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "TEXCOORD_{given}": 1 }}, "material": 0 }}] }}],
            "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }},
                {{ "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2" }}],
            "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}, {{ "buffer": 0, "byteOffset": 36, "byteLength": 24 }}],
            "buffers": [{{ "byteLength": 60, "uri": "a.bin" }}] }}"#
        );
        written("a.gltf", &text, &bytes).uvs
    };
    let (given, zeros) = (given.to_vec(), vec![[0.0; 2]; 3]);
    assert_eq!(sets(0, 0), std::slice::from_ref(&given));
    assert_eq!(sets(1, 1), [zeros.clone(), given.clone()]);
    assert_eq!(sets(0, 2), [given, zeros.clone(), zeros]);
}
