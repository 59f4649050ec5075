//! Models far from zero look as they do near zero.

use raywright::core::picture::Picture;

use crate::support::Sandbox;

/// A position in map coordinates.
const AT: [f64; 3] = [448_200.25, 4_865_499.5, 20.0];

/// Largest difference of two pictures, relative to the mean.
fn difference(a: &Picture, b: &Picture) -> f64 {
    let mean =
        a.rgb.iter().flatten().map(|&x| f64::from(x)).sum::<f64>() / (3 * a.rgb.len()) as f64;
    let pairs = a.rgb.iter().flatten().zip(b.rgb.iter().flatten());
    pairs.map(|(a, b)| f64::from(a - b).abs()).sum::<f64>() / (3 * a.rgb.len()) as f64 / mean
}

/// Pictures of a scene near zero and at [`AT`], both without a warning about distance.
fn twins(name: &str, of: impl Fn([f64; 3]) -> String, flags: &[&str]) -> [Picture; 2] {
    let sandbox = Sandbox::new();
    [[0.0; 3], AT].map(|at| {
        sandbox.write(name, of(at));
        let run = sandbox.run(
            &[
                &[
                    "render", name, "-o", "o.exr", "-s", "48x36", "--spp", "16", "--aov",
                    "position",
                ],
                flags,
            ]
            .concat(),
        );
        assert_eq!(
            (run.code, run.stderr.contains("so far from")),
            (Some(0), false),
            "{}",
            run.stderr
        );
        sandbox.picture("o.exr")
    })
}

fn looks_alike(name: &str, of: impl Fn([f64; 3]) -> String, flags: &[&str]) {
    let [near, far] = twins(name, of, flags);
    let off = difference(&near, &far);
    assert!(off < 0.01, "{name}: {off} of the mean");
}

/// Translates a point with the scene.
fn point(at: [f64; 3], own: [f64; 3]) -> String {
    let [x, y, z] = [0, 1, 2].map(|i| at[i] + own[i]);
    format!("[{x}, {y}, {z}]")
}

/// Protects: shapes of every kind, meshes inline, rotated, instanced and moving, generators, lamps
/// and lights, materials that depend on position, a camera and an infinite floor look the same at
/// map coordinates, with both integrators.
#[test]
fn scenes_far_from_zero_keep_their_shape() {
    let scene = |at: [f64; 3]| {
        let p = |x: f64, y: f64, z: f64| point(at, [x, y, z]);
        let [x, y, z] = at;
        format!(
            r#"
format = 1
sky.constant = 0.3
[[cameras]]
pose.look_at = {{ eye = {}, target = {} }}
projection.pinhole = {{ vertical_fov = 40 }}
shutter = [0, 1]
[[lights]]
kind.point = {{ position = {} }}
colour = 8
[[materials]]
name = "m"
model.physical = {{ base_colour = 0.7 }}
[[materials]]
name = "stripes"
model.physical = {{ base_colour = "fract(4 * (p.x - {x} + 10)) < 0.5 ? 0.8 : 0.2" }}
[[materials]]
name = "lamp"
model.physical = {{ base_colour = 0, emission = 3 }}
[[meshes]]
name = "own"
source.inline = {{ positions = [{}, {}, {}, {}], indices = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]] }}
[[meshes]]
name = "moved"
source.inline = {{ positions = [[0, 0, 0], [0.4, 0, 0], [0, 0.4, 0], [0, 0, 0.4]], indices = [[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]] }}
"#,
            p(0.5, 1.5, 4.0),
            p(0.0, 0.3, 0.0),
            p(2.0, 3.0, 2.0),
            p(-1.0, 0.0, 0.5),
            p(-0.6, 0.0, 0.7),
            p(-0.8, 0.0, 1.0),
            p(-0.8, 0.5, 0.7),
        ) + &[
            format!(r#"shape.plane = {{ point = {}, normal = [0, 1, 0] }}"#, p(0.0, 0.0, 0.0)) + "\nmaterial = \"stripes\"",
            format!(r#"shape.sphere = {{ centre = {}, radius = 0.3 }}"#, p(0.0, 0.3, 0.0)) + "\nmaterial = \"stripes\"",
            format!(r#"shape.box = {{ min = {}, max = {} }}"#, p(0.4, 0.0, -0.3), p(0.7, 0.4, 0.1))
                + &format!("\nmaterial = \"m\"\ntransform = [{{ translate = [{}, {}, {}] }}, {{ rotate = {{ axis = [0, 1, 0], degrees = 30 }} }}, {{ translate = [{x}, {y}, {z}] }}]", -x, -y, -z),
            format!(r#"shape.torus = {{ centre = {}, axis = [1, 1, 0], major_radius = 0.2, minor_radius = 0.07 }}"#, p(-0.5, 0.4, -0.3)) + "\nmaterial = \"m\"",
            format!(r#"shape.quad = {{ corner = {}, edge_u = [0.5, 0, 0], edge_v = [0, 0, 0.5] }}"#, p(-0.2, 1.3, -0.2)) + "\nmaterial = \"lamp\"",
            "shape.mesh = \"own\"\nmaterial = \"m\"".to_owned(),
            format!("shape.mesh = \"moved\"\nmaterial = \"m\"\ntransform = [{{ translate = {} }}]", p(0.5, 0.0, 0.6)),
            format!("shape.mesh = \"moved\"\nmaterial = \"m\"\ntransform = [{{ translate = {} }}]\ntransform_end = [{{ translate = {} }}]", p(-0.1, 0.0, 0.9), p(0.1, 0.0, 0.9)),
        ]
        .map(|object| format!("[[objects]]\n{object}\n"))
        .concat()
            + &format!(
                "[[generators]]\nkind.grid = {{ counts = [4, 1, 1], origin = {}, step = [0.3, 0, 0] }}\nobject = {{ shape.cylinder = {{ base = [0, 0, 0], axis = [0, 1, 0], radius = 0.08, height = 0.5 }}, material = \"m\" }}\n",
                p(-0.5, 0.0, -0.8)
            )
    };
    for integrator in ["path", "whitted"] {
        looks_alike("far.scene.toml", scene, &["--integrator", integrator]);
    }
}

/// Protects: text and doubles of OBJ, PLY and STL keep the digits that separate a small model's
/// points at map coordinates, and so do the view of the whole model and its ground.
#[test]
fn models_far_from_zero_keep_their_shape() {
    let corners = |at: [f64; 3]| {
        let steps = (0..6).flat_map(|i| {
            let (low, high) = (0.1 * f64::from(i), 0.1 * f64::from(i) + 0.1);
            [
                [0.0, low, -low],
                [0.5, low, -low],
                [0.5, high, -low],
                [0.0, high, -low],
                [0.5, high, -high],
                [0.0, high, -high],
            ]
        });
        steps
            .map(move |own| [0, 1, 2].map(|i| at[i] + own[i]))
            .collect::<Vec<_>>()
    };
    let faces = || {
        (0..6).flat_map(|i| {
            [[0, 1, 2, 3], [3, 2, 4, 5]].map(|face| face.map(|corner| 6 * i + corner))
        })
    };
    let words = |corner: &[f64; 3]| corner.map(|x| x.to_string()).join(" ");
    let obj = |at| {
        let vertices = corners(at)
            .iter()
            .map(|corner| format!("v {}\n", words(corner)))
            .collect::<String>();
        vertices
            + &faces()
                .map(|face| format!("f {}\n", face.map(|i: usize| (i + 1).to_string()).join(" ")))
                .collect::<String>()
    };
    let ply = |number: &'static str| {
        move |at| {
            let head = format!(
                "ply\nformat ascii 1.0\nelement vertex 36\nproperty {number} x\nproperty {number} y\nproperty {number} z\nelement face 12\n\
                 property list uchar int vertex_indices\nend_header\n"
            );
            let vertices = corners(at)
                .iter()
                .map(|corner| words(corner) + "\n")
                .collect::<String>();
            head + &vertices
                + &faces()
                    .map(|face| format!("4 {}\n", face.map(|i: usize| i.to_string()).join(" ")))
                    .collect::<String>()
        }
    };
    let stl = |at| {
        let corners = corners(at);
        let facet = |[a, b, c]: [usize; 3]| {
            let loops = [a, b, c]
                .map(|i| format!("vertex {}\n", words(&corners[i])))
                .concat();
            format!("facet normal 0 0 0\nouter loop\n{loops}endloop\nendfacet\n")
        };
        let facets = faces()
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
            .map(facet)
            .collect::<String>();
        format!("solid far\n{facets}endsolid\n")
    };
    looks_alike("far.obj", obj, &[]);
    looks_alike("far.ply", ply("double"), &[]);
    looks_alike("float.ply", ply("float"), &[]);
    looks_alike("far.stl", stl, &["--up", "y"]);
    // Rotated before framing, and from a view where noise needs twice the samples for agreement.
    looks_alike("turned.stl", stl, &["--up", "z", "--spp", "64"]);
}

/// Protects: a glTF model under a distant node looks as near zero, and the layer of positions has
/// the file's own coordinates.
#[test]
fn nodes_far_from_zero_keep_their_shape() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/cases/reports/far-node.gltf");
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("skipped: shared data not found ({})", path.display());
        return;
    };
    let written = "[448200.25,4865499.5,20]";
    assert!(text.contains(written), "the node's translation");
    let of = |at: [f64; 3]| text.replace(written, &point(at, [0.0; 3]));
    looks_alike("far.gltf", of, &[]);
    let [near, far] = twins("far.gltf", of, &[]);
    for (axis, name) in ["position.X", "position.Y", "position.Z"]
        .into_iter()
        .enumerate()
    {
        let layer = |picture: &Picture| {
            picture
                .layers
                .iter()
                .find(|layer| layer.name == name)
                .expect("the layer")
                .samples
                .clone()
        };
        let (near, far) = (layer(&near), layer(&far));
        // Only pixels entirely on the ball: the mean of a position and a miss is no position.
        let middle = 18 * 48 + 24;
        let expected = (f64::from(near[middle]) + AT[axis]) as f32;
        let step = expected.next_up() - expected;
        assert!(
            (far[middle] - expected).abs() <= step,
            "{name}: {} instead of {expected}",
            far[middle]
        );
    }
}

/// Protects: of two models too far apart for single precision, the unresolved one is named, once;
/// double precision resolves both.
#[test]
fn what_is_too_far_apart_is_named() {
    let sandbox = Sandbox::new();
    let ball = |name: &str, x: f64| {
        format!(
            "[[objects]]\nname = \"{name}\"\nshape.sphere = {{ centre = [{x}, 0, 0], radius = 1 }}\nmaterial = \"m\"\n"
        )
    };
    let head = "format = 1\nsky.constant = 1\n[[materials]]\nname = \"m\"\nmodel.physical = { base_colour = 0.5 }\n";
    sandbox.write(
        "two.scene.toml",
        head.to_owned() + &ball("here", 0.0) + &ball("there", 4e6),
    );
    let run = |precision| {
        sandbox
            .run(&[
                "render",
                "two.scene.toml",
                "-s",
                "8x8",
                "--spp",
                "1",
                "--precision",
                precision,
                "--allow-empty",
                "-v",
                "-o",
                "o.exr",
            ])
            .stderr
    };
    let named = "`there`: it is so far from the rest of the scene";
    assert_eq!(run("robust").matches(named).count(), 1);
    assert_eq!(run("reference").matches(named).count(), 0);
}
