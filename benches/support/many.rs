//! Generated files with many items of one kind, which must load in linear time.

use std::fmt::Write as _;

/// Files with their names; the first is the one to load.
pub type Files = Vec<(&'static str, Vec<u8>)>;

/// Name of a kind of item, and a function that writes a file with a given number of items.
pub type SceneFamily = (&'static str, fn(usize) -> Files);

/// Every list of a scene whose items are referred to by name or index, with the references.
pub const FAMILIES: [SceneFamily; 9] = [
    ("meshes of a GLB file", meshes),
    ("materials of a glTF file", materials),
    ("images and textures of a glTF file", images),
    ("lights of a glTF file", lights),
    ("materials of an OBJ file", obj_materials),
    ("objects and materials of a TOML file", names),
    ("parameters of a TOML file", parameters),
    ("objects that share a mesh", shared),
    ("objects of a generator", generated),
];

/// A red pixel.
const PNG: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==";

/// The items 0, 1, … as text, separated by commas.
fn list(n: usize, item: impl Fn(usize) -> String) -> String {
    let mut text = String::new();
    for i in 0..n {
        // Writing to a `String` cannot fail.
        let _ = write!(text, "{}{}", if i > 0 { "," } else { "" }, item(i));
    }
    text
}

/// One triangle of three positions in 36 bytes.
const ACCESSORS: &str = r#""accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],"bufferViews":[{"buffer":0,"byteLength":36}]"#;

fn triangle() -> Vec<u8> {
    [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect()
}

/// A GLB file of a JSON text and the triangle.
fn glb(json: &str) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = triangle();
    let chunk = |kind: u32, data: &[u8]| {
        [
            &(data.len() as u32).to_le_bytes(),
            &kind.to_le_bytes(),
            data,
        ]
        .concat()
    };
    let chunks = [chunk(0x4E4F_534A, &json), chunk(0x004E_4942, &binary)].concat();
    let head = [0x4654_6C67, 2, chunks.len() as u32 + 12].map(u32::to_le_bytes);
    [head.as_flattened(), &chunks].concat()
}

/// Nodes in rows, each with the mesh of its number; `more` is the rest of the file.
fn rows(n: usize, material: impl Fn(usize) -> String, more: &str) -> Files {
    let nodes = list(n, |i| {
        format!(
            r#"{{"name":"node {i}","mesh":{i},"translation":[{},{},0]}}"#,
            i % 300 * 2,
            i / 300 * 2
        )
    });
    let meshes = list(n, |i| {
        format!(
            r#"{{"name":"mesh {i}","primitives":[{{"attributes":{{"POSITION":0}}{}}}]}}"#,
            material(i)
        )
    });
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{nodes}],"meshes":[{meshes}],{more}{ACCESSORS},"buffers":[{{"byteLength":36}}]}}"#,
        list(n, |i| i.to_string())
    );
    vec![("many.glb", glb(&json))]
}

fn meshes(n: usize) -> Files {
    rows(n, |_| String::new(), "")
}

fn materials(n: usize) -> Files {
    let materials = list(n, |i| {
        format!(r#"{{"name":"material {i}","pbrMetallicRoughness":{{"roughnessFactor":0.5}}}}"#)
    });
    rows(
        n,
        |i| format!(r#","material":{i}"#),
        &format!(r#""materials":[{materials}],"#),
    )
}

fn images(n: usize) -> Files {
    let images = list(n, |i| format!(r#"{{"name":"image {i}","uri":"{PNG}"}}"#));
    let textures = list(n, |i| format!(r#"{{"name":"texture {i}","source":{i}}}"#));
    let materials = list(n, |i| {
        format!(r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{i}}}}}}}"#)
    });
    let more = format!(r#""images":[{images}],"textures":[{textures}],"materials":[{materials}],"#);
    rows(n, |i| format!(r#","material":{i}"#), &more)
}

fn lights(n: usize) -> Files {
    let lights = list(n, |i| format!(r#"{{"name":"light {i}","type":"point"}}"#));
    let nodes = list(n, |i| {
        format!(
            r#"{{"extensions":{{"KHR_lights_punctual":{{"light":{i}}}}},"translation":[{i},9,0]}}"#
        )
    });
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{nodes}],"extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[{lights}]}}}}}}"#,
        list(n, |i| i.to_string())
    );
    vec![("many.gltf", json.into_bytes())]
}

fn obj_materials(n: usize) -> Files {
    let (mut obj, mut mtl) = ("mtllib many.mtl\n".to_owned(), String::new());
    for i in 0..n {
        let (x, y) = (i % 300 * 2, i / 300 * 2);
        let _ = write!(
            obj,
            "g group {i}\nv {x} {y} 0\nv {} {y} 0\nv {x} {} 0\nusemtl material {i}\nf -3 -2 -1\n",
            x + 1,
            y + 1
        );
        let _ = write!(
            mtl,
            "newmtl material {i}\nKd 0.5 0.5 0.5\nmap_Kd many.png\n"
        );
        if i % 2 == 1 {
            let _ = writeln!(mtl, "map_Kd -clamp on many{i}.png");
        }
    }
    vec![
        ("many.obj", obj.into_bytes()),
        ("many.mtl", mtl.into_bytes()),
    ]
}

fn names(n: usize) -> Files {
    let mut text = "format = 1\n".to_owned();
    for i in 0..n {
        let _ = write!(
            text,
            "[[materials]]\nname = \"material {i}\"\nmodel.classic = {{ colour = \"p.x\" }}\n"
        );
        let _ = write!(
            text,
            "[[objects]]\nmaterial = \"material {i}\"\nshape.sphere = {{ centre = [{}, {}, 0], radius = 1 }}\n",
            i % 300 * 2,
            i / 300 * 2
        );
    }
    vec![("many.scene.toml", text.into_bytes())]
}

fn parameters(n: usize) -> Files {
    let mut text = "format = 1\n[parameters]\nk0 = 1\n".to_owned();
    for i in 1..n {
        let _ = writeln!(text, "k{i} = \"k{} + 1\"", i - 1);
    }
    vec![("many.scene.toml", text.into_bytes())]
}

fn shared(n: usize) -> Files {
    let mut text = "format = 1\n[[materials]]\nname = \"m\"\nmodel.classic = {}\n[[meshes]]\nname = \"leaf\"\n\
                    source.inline = { positions = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], indices = [[0, 1, 2]] }\n"
        .to_owned();
    for i in 0..n {
        let (x, y) = (i % 300 * 2, i / 300 * 2);
        let _ = write!(
            text,
            "[[objects]]\nmaterial = \"m\"\nshape.mesh = \"leaf\"\ntransform = [{{ translate = [{x}, {y}, 0] }}]\n"
        );
    }
    vec![("many.scene.toml", text.into_bytes())]
}

fn generated(n: usize) -> Files {
    let text = format!(
        "format = 1\n[[materials]]\nname = \"m\"\nmodel.classic = {{}}\n[[generators]]\n\
         kind.grid = {{ counts = [{}, 10, 10], origin = [0, 0, 0], step = [2, 2, 2] }}\n\
         object = {{ material = \"m\", shape.box = {{ min = [0, 0, 0], max = [1, 1, 1] }} }}\n",
        n.div_ceil(100)
    );
    vec![("many.scene.toml", text.into_bytes())]
}
