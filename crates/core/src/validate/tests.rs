//! Each rule violated once: the problem must be reported at its path.

use crate::fault::Fault;
use crate::scene::*;

use super::{check_mesh_data, validate};

const HERE: [f64; 3] = [0.0; 3];
const ABOVE: [f64; 3] = [0.0, 1.0, 0.0];

/// A valid scene with one of everything.
fn sound() -> Scene {
    let texture = || TextureRef {
        name: "wood".into(),
        uv_set: 0,
        uv_transform: None,
        uv: None,
        factor: Colour::WHITE,
        channel: None,
    };
    let material = Material {
        name: "red".into(),
        model: MaterialModel::Classic(Box::default()),
    };
    let physical = Material {
        name: "oak".into(),
        model: MaterialModel::Physical(Box::new(Physical {
            base_colour_texture: Some(texture()),
            ..Physical::default()
        })),
    };
    Scene {
        cameras: vec![Camera {
            name: "front".into(),
            pose: Pose::LookAt {
                eye: [0.0, 0.0, 5.0],
                target: HERE,
                up: ABOVE,
            },
            projection: Projection::Pinhole(Pinhole {
                vertical_fov: Some(45.0),
                ..Pinhole::default()
            }),
            aspect: None,
            fit: Default::default(),
            pose_end: None,
            shutter: None,
        }],
        sky: Some(Sky::Gradient {
            bottom: Colour::BLACK,
            top: Colour::WHITE,
            suns: vec![],
        }),
        lights: vec![Light {
            name: String::new(),
            kind: LightKind::Directional { to_light: ABOVE },
            colour: Colour::WHITE,
            shadows: true,
            specular: true,
        }],
        images: vec![Image {
            name: "grain".into(),
            path: "grain.png".into(),
            data: None,
            mended: 0,
        }],
        textures: vec![Texture {
            name: "wood".into(),
            image: "grain".into(),
            colour_space: ColourSpace::Srgb,
            filter: TextureFilter::Bilinear,
            wrap_u: WrapMode::Repeat,
            wrap_v: WrapMode::Repeat,
        }],
        materials: vec![material, physical],
        meshes: vec![Mesh {
            name: "leaf".into(),
            source: MeshSource::Inline(std::sync::Arc::new(leaf())),
            model: None,
        }],
        objects: vec![
            ball(1.0),
            Object {
                shape: Shape::Mesh("leaf".into()),
                ..ball(1.0)
            },
        ],
        ..Scene::default()
    }
}

fn leaf() -> MeshData {
    MeshData {
        positions: vec![[0.0_f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into(),
        indices: vec![[0, 1, 2]],
        normals: vec![[0.0, 0.0, 1.0]; 3],
        tangents: vec![[1.0, 0.0, 0.0, 1.0]; 3],
        uvs: vec![vec![[0.0; 2]; 3]],
        colours: vec![[1.0; 4]; 3],
        ..MeshData::default()
    }
}

fn ball(radius: f64) -> Object {
    Object {
        name: String::new(),
        shape: Shape::Sphere {
            centre: HERE,
            radius,
        },
        material: "red".into(),
        side: SideRule::Both,
        face_viewer: true,
        casts_shadow: true,
        transform: Vec::new(),
        transform_end: None,
    }
}

fn broken(break_it: impl FnOnce(&mut Scene)) -> Vec<Fault> {
    let mut scene = sound();
    break_it(&mut scene);
    validate(&scene)
}

/// Returns the single problem caused by a change, as `path: message`.
fn single_problem(break_it: impl FnOnce(&mut Scene)) -> String {
    match broken(break_it).as_slice() {
        [problem] => format!("{}: {}", problem.path, problem.message),
        other => panic!("expected one problem, found {other:#?}"),
    }
}

/// Returns the single problem of a shape, from the path of its kind on.
fn shape(shape: Shape) -> String {
    let problem = single_problem(|scene| scene.objects[0].shape = shape);
    problem
        .strip_prefix("objects[0].shape.")
        .expect("a problem of the shape")
        .to_owned()
}

fn transform(step: TransformStep) -> String {
    single_problem(|scene| scene.objects[0].transform = vec![step])
}

fn classic(classic: ClassicMaterial) -> String {
    single_problem(|scene| scene.materials[0].model = MaterialModel::Classic(Box::new(classic)))
}

fn physical(physical: Physical) -> String {
    single_problem(|scene| scene.materials[1].model = MaterialModel::Physical(Box::new(physical)))
}

/// Protects: a valid scene has no problems.
#[test]
fn a_sound_scene_has_no_problems() {
    assert_eq!(validate(&sound()), []);
    assert_eq!(validate(&Scene::default()), []);
}

/// Protects: an unknown format is the only problem reported for its scene.
#[test]
fn another_format_is_the_only_problem_of_its_scene() {
    assert_eq!(
        single_problem(|scene| (scene.format, scene.objects[0].material) = (2, String::new())),
        "format: this program reads version 1 of the scene format, but this scene has version 2"
    );
}

/// Protects: picture settings have ranges.
#[test]
fn picture_settings_have_ranges() {
    assert_eq!(
        single_problem(|s| s.render.size[0] = 0),
        "render.size[0]: `size[0]` must be from 1 to 65536, not 0"
    );
    assert_eq!(
        single_problem(|s| s.render.size[1] = 65537),
        "render.size[1]: `size[1]` must be from 1 to 65536, not 65537"
    );
    assert_eq!(
        single_problem(|s| s.render.samples = 0),
        "render.samples: `samples` must be from 1 to 65536, not 0"
    );
    assert_eq!(
        single_problem(|s| s.render.max_depth = 65),
        "render.max_depth: `max_depth` must be from 1 to 64, not 65"
    );
    assert_eq!(
        single_problem(|s| s.render.exposure = f64::INFINITY),
        "render.exposure: `exposure` must be from -64 to 64, not inf"
    );
    assert_eq!(
        single_problem(|s| s.render.veil.0[1] = f64::NAN),
        "render.veil: `veil` must be finite, not [0, NaN, 0]"
    );
    let spawn = SpawnRule::Constant(ConstantOffset {
        offset: -1.0,
        along: OffsetDirection::Normal,
        camera_min: 0.0,
        secondary_min: 0.0,
        shadow_min: 0.0,
    });
    assert_eq!(
        single_problem(|s| s.classic.spawn = spawn),
        "classic.spawn.constant.offset: `offset` must not be negative, but is -1"
    );
    assert_eq!(
        single_problem(|s| s.classic.shadow_max_distance = Some(0.0)),
        "classic.shadow_max_distance: `shadow_max_distance` must be above zero, not 0"
    );
    assert!(
        single_problem(|s| _ = s.parameters.insert("pi".into(), 3.0.into()))
            .starts_with("parameters.pi: `pi` cannot be the name")
    );
}

/// Protects: cameras have a defined view and a positive opening.
#[test]
fn cameras_look_somewhere_and_open_somewhat() {
    let pose = |pose| single_problem(|s| s.cameras[0].pose = pose);
    let eye = [1.0, 2.0, 3.0];
    assert!(
        pose(Pose::LookAt {
            eye,
            target: eye,
            up: ABOVE
        })
        .ends_with("`target` equals `eye`, so the camera has no viewing direction")
    );
    assert!(
        pose(Pose::LookAt {
            eye: ABOVE,
            target: HERE,
            up: ABOVE
        })
        .contains("is parallel to the viewing direction")
    );
    assert!(
        pose(Pose::LookAt {
            eye,
            target: HERE,
            up: HERE
        })
        .contains("`up` has length zero")
    );
    let orbit = |distance, elevation| {
        pose(Pose::Orbit {
            target: HERE,
            distance,
            azimuth: 0.0,
            elevation,
        })
    };
    assert!(orbit(0.0, 0.0).contains("`distance` must be above zero"));
    assert!(orbit(1.0, 90.0).contains("`elevation` must be above -90 and below 90"));
    let flat = Pose::Axes {
        eye,
        right: [1.0, 0.0, 0.0],
        up: ABOVE,
        back: [1.0, 1.0, 0.0],
    };
    assert!(pose(flat).contains("lie in a plane"));
    let lens = |vertical_fov, horizontal_fov, focal_length| {
        single_problem(|s| {
            s.cameras[0].projection = Projection::Pinhole(Pinhole {
                vertical_fov,
                horizontal_fov,
                focal_length,
            })
        })
    };
    assert!(lens(None, None, None).contains("has no field of view"));
    assert!(
        lens(Some(1.0), None, Some(1.0)).contains("`vertical_fov` and `focal_length` both set")
    );
    assert!(lens(Some(180.0), None, None).contains("`vertical_fov` must be above 0 and below 180"));
    assert!(lens(None, None, Some(0.0)).contains("`focal_length` must be from"));
    assert!(
        single_problem(|s| s.cameras[0].projection = Projection::Orthographic { height: -1.0 })
            .contains("`height` must be above zero")
    );
    assert!(single_problem(|s| s.cameras[0].aspect = Some(0.0)).contains("`aspect` must be from"));
    assert!(
        single_problem(|s| s.cameras[0].name = "1".into())
            .contains("cannot be the name of a camera")
    );
}

/// Protects: lights and skies must have valid angles, directions and strengths.
#[test]
fn lights_and_skies_are_sensible() {
    let light = |kind| single_problem(|s| s.lights[0].kind = kind);
    let spot = |inner_angle, outer_angle| {
        let (falloff, range) = (Falloff::InverseSquare, Some(1.0));
        light(LightKind::Spot {
            position: HERE,
            direction: ABOVE,
            inner_angle,
            outer_angle,
            falloff,
            range,
        })
    };
    assert!(
        light(LightKind::Directional { to_light: HERE }).contains("`to_light` has length zero")
    );
    assert!(
        light(LightKind::Point {
            position: HERE,
            falloff: Falloff::None,
            range: Some(0.0)
        })
        .contains("`range` must be above zero")
    );
    assert!(spot(30.0, 29.0).contains("`outer_angle` must not be below `inner_angle`"));
    assert!(spot(0.0, 0.0).contains("`outer_angle` must be above 0"));
    assert!(spot(30.0, 91.0).contains("`outer_angle` must be from 0 to 90"));
    assert!(
        single_problem(|s| s.lights[0].colour.0[2] = -1.0)
            .contains("must have no negative channel")
    );
    let checker = CheckerInput {
        checker: Checker {
            even: Colour::BLACK,
            odd: Colour::WHITE,
            size: 1.0,
        },
    };
    assert!(
        single_problem(|s| s.sky = Some(Sky::Expression(ColourInput::Checker(checker))))
            .contains("a sky has no surface")
    );
    let map = SkyMap {
        image: "grian".into(),
        rotation: 0.0,
        strength: 1.0,
    };
    let problems = broken(|s| s.sky = Some(Sky::Map(map)));
    assert_eq!(problems[0].remedy, "did you mean `grain`?");
    let sun = Sun {
        direction: ABOVE,
        colour: Colour::WHITE,
        weight: 1.0,
        exponent: 0,
    };
    let sky = Sky::Gradient {
        bottom: Colour::BLACK,
        top: Colour::WHITE,
        suns: vec![sun],
    };
    assert!(single_problem(|s| s.sky = Some(sky)).starts_with("sky.gradient.suns[0].exponent: "));
}

/// Protects: materials have ranges and expressions that compile.
#[test]
fn materials_have_ranges_and_expressions_that_compile() {
    assert!(
        classic(ClassicMaterial {
            shadow_transmittance: 1.5,
            ..ClassicMaterial::default()
        })
        .contains("must be from 0 to 1, not 1.5")
    );
    let specular = |exponent| ClassicHighlight {
        model: SpecularModel::Blinn,
        exponent,
        strength: ScalarFactor::Number(1.0),
        lit: true,
        shadowed: true,
        on_reflection: false,
    };
    assert!(
        classic(ClassicMaterial {
            specular: Some(specular(0)),
            ..ClassicMaterial::default()
        })
        .contains("`exponent` must be from 1 to 65536")
    );
    assert!(
        classic(ClassicMaterial {
            rim: Some(RimLight {
                strength: ScalarFactor::Number(1.0),
                exponent: 65
            }),
            ..ClassicMaterial::default()
        })
        .contains("from 1 to 64")
    );
    let vector = ScalarFactor::Expression("p".into());
    assert!(
        classic(ClassicMaterial {
            local: vector,
            ..ClassicMaterial::default()
        })
        .starts_with("materials[0].model.classic.local: in the expression of `local`")
    );
    assert!(
        classic(ClassicMaterial {
            local: ScalarFactor::Number(f64::NAN),
            ..ClassicMaterial::default()
        })
        .contains("finite")
    );
    let to_light = ColourInput::Expression("l".into());
    assert!(
        classic(ClassicMaterial {
            colour: to_light,
            ..ClassicMaterial::default()
        })
        .contains("`l` does not exist")
    );
    let reflection = Some(MirrorReflection {
        weight: ScalarFactor::Number(1.0),
        tinted: true,
        fuzz: None,
    });
    let transmission = |ior| {
        Some(Transmission {
            ior,
            choice: TransmissionChoice::Split,
            reflected_tint: Colour::WHITE,
            refracted_tint: Colour::WHITE,
        })
    };
    assert!(
        classic(ClassicMaterial {
            transmission: transmission(0.0),
            ..ClassicMaterial::default()
        })
        .contains("`ior` must be from")
    );
    assert!(
        classic(ClassicMaterial {
            reflection,
            transmission: transmission(1.5),
            ..ClassicMaterial::default()
        })
        .contains("cannot have `reflection` and `transmission`")
    );
    assert!(
        physical(Physical {
            roughness: (-0.1).into(),
            ..Physical::default()
        })
        .contains("`roughness` must be from 0 to 1")
    );
    assert!(
        physical(Physical {
            ior: 0.5.into(),
            ..Physical::default()
        })
        .contains("`ior` must be 0, or from 1 to")
    );
    assert!(
        physical(Physical {
            emission: Colour([-1.0; 3]).into(),
            ..Physical::default()
        })
        .contains("no negative channel")
    );
}

/// Protects: values without a meaning below zero are refused at their path: every colour, weight
/// and strength of a scene, as a number or as an expression that is negative at every hit. Texture
/// coordinates, normal scales and fuzz may have any sign.
#[test]
fn negative_light_is_refused() {
    const RED: Colour = Colour([-1.0, 0.5, 0.5]);
    let refused = |problem: String, path: &str| {
        assert!(
            problem.starts_with(&format!("{path}: ")) && problem.contains("negative"),
            "{path}, not {problem}"
        );
    };
    refused(single_problem(|s| s.render.veil = RED), "render.veil");
    refused(
        single_problem(|s| s.classic.ambient = RED),
        "classic.ambient",
    );
    refused(
        single_problem(|s| s.sky = Some(Sky::Constant(RED))),
        "sky.constant",
    );
    refused(
        single_problem(|s| s.sky = Some(Sky::Expression(RED.into()))),
        "sky.expression",
    );
    refused(
        single_problem(|s| s.sky = Some(Sky::Expression(ColourInput::Expression("-1".into())))),
        "sky.expression",
    );
    let gradient = |bottom, top, colour, weight| {
        let suns = vec![Sun {
            direction: ABOVE,
            colour,
            weight,
            exponent: 1,
        }];
        single_problem(|s| s.sky = Some(Sky::Gradient { bottom, top, suns }))
    };
    refused(
        gradient(RED, Colour::WHITE, Colour::WHITE, 1.0),
        "sky.gradient.bottom",
    );
    refused(
        gradient(Colour::WHITE, RED, Colour::WHITE, 1.0),
        "sky.gradient.top",
    );
    refused(
        gradient(Colour::WHITE, Colour::WHITE, RED, 1.0),
        "sky.gradient.suns[0].colour",
    );
    refused(
        gradient(Colour::WHITE, Colour::WHITE, Colour::WHITE, -1.0),
        "sky.gradient.suns[0].weight",
    );
    let of_classic = |m: ClassicMaterial, key: &str| {
        refused(classic(m), &format!("materials[0].model.classic.{key}"))
    };
    for colour in [RED.into(), ColourInput::Expression("[1, 2 - 3, 1]".into())] {
        of_classic(
            ClassicMaterial {
                colour: colour.clone(),
                ..ClassicMaterial::default()
            },
            "colour",
        );
        of_classic(
            ClassicMaterial {
                emission: Some(colour),
                ..ClassicMaterial::default()
            },
            "emission",
        );
    }
    of_classic(
        ClassicMaterial {
            ambient: Some(RED),
            ..ClassicMaterial::default()
        },
        "ambient",
    );
    for weight in [
        ScalarFactor::Number(-0.5),
        ScalarFactor::Expression("1 - 2".into()),
    ] {
        of_classic(
            ClassicMaterial {
                local: weight.clone(),
                ..ClassicMaterial::default()
            },
            "local",
        );
        of_classic(
            ClassicMaterial {
                diffuse: weight.clone(),
                ..ClassicMaterial::default()
            },
            "diffuse",
        );
        of_classic(
            ClassicMaterial {
                shadow: Some(weight.clone()),
                ..ClassicMaterial::default()
            },
            "shadow",
        );
        of_classic(
            ClassicMaterial {
                rim: Some(RimLight {
                    strength: weight.clone(),
                    exponent: 1,
                }),
                ..ClassicMaterial::default()
            },
            "rim.strength",
        );
        let reflection = Some(MirrorReflection {
            weight,
            tinted: true,
            fuzz: None,
        });
        of_classic(
            ClassicMaterial {
                reflection,
                ..ClassicMaterial::default()
            },
            "reflection.weight",
        );
    }
    let mixture = |m: Mixture| ClassicMaterial {
        mixture: Some(m),
        ..ClassicMaterial::default()
    };
    of_classic(
        mixture(Mixture {
            specular_colour: RED,
            ..Mixture::default()
        }),
        "mixture.specular_colour",
    );
    of_classic(
        mixture(Mixture {
            absorption: RED,
            ..Mixture::default()
        }),
        "mixture.absorption",
    );
    let checker = Checker {
        even: Colour::WHITE,
        odd: RED,
        size: 1.0,
    };
    of_classic(
        ClassicMaterial {
            colour: ColourInput::Checker(CheckerInput { checker }),
            ..ClassicMaterial::default()
        },
        "colour.checker.odd",
    );
    let of_physical = |m: Physical, key: &str| {
        refused(physical(m), &format!("materials[1].model.physical.{key}"))
    };
    of_physical(
        Physical {
            base_colour: RED.into(),
            ..Physical::default()
        },
        "base_colour",
    );
    of_physical(
        Physical {
            emission: ColourInput::Expression("-t - 1".into()),
            ..Physical::default()
        },
        "emission",
    );
    of_physical(
        Physical {
            roughness: NumberInput::Expression("-1".into()),
            ..Physical::default()
        },
        "roughness",
    );
    let texture = |factor: Colour, uv: Option<[ScalarFactor; 2]>| {
        let texture = TextureRef {
            name: "wood".into(),
            uv_set: 0,
            uv_transform: None,
            uv,
            factor,
            channel: None,
        };
        Physical {
            base_colour_texture: Some(texture),
            ..Physical::default()
        }
    };
    of_physical(texture(RED, None), "base_colour_texture.factor");
    let signed = Physical {
        normal_scale: -1.0,
        ..texture(
            Colour::WHITE,
            Some([
                ScalarFactor::Number(-1.0),
                ScalarFactor::Expression("-2".into()),
            ]),
        )
    };
    assert_eq!(
        broken(|s| s.materials[1].model = MaterialModel::Physical(Box::new(signed))),
        []
    );
}

/// Protects: the problem of an expression names its place in the text.
#[test]
fn an_expression_s_problem_says_where_in_the_text() {
    let classic = ClassicMaterial {
        colour: ColourInput::Expression("1 + bad".into()),
        ..ClassicMaterial::default()
    };
    let problems = broken(|s| s.materials[0].model = MaterialModel::Classic(Box::new(classic)));
    assert_eq!(problems[0].span, Some(4..7));
}

/// Protects: names are unique and references exist.
#[test]
fn names_are_unique_and_references_exist() {
    assert_eq!(
        single_problem(|s| s.materials[1].name = "red".into()),
        "materials[1].name: the name `red` is already used by `materials[0]`; rename one of the two"
    );
    assert_eq!(
        single_problem(|s| s.objects[1].shape = Shape::Mesh("laef".into())),
        "objects[1].shape.mesh: unknown mesh `laef`"
    );
    assert_eq!(
        single_problem(|s| s.objects[0].material = "rde".into()),
        "objects[0].material: unknown material `rde`"
    );
    assert_eq!(
        single_problem(|s| s.textures[0].image = "x".into()),
        "textures[0].image: unknown image `x`"
    );
    assert_eq!(
        single_problem(|s| s.textures[0].name = "x".into()),
        "materials[1].model.physical.base_colour_texture.name: unknown texture `wood`"
    );
    assert_eq!(
        single_problem(|s| s.images[0].path = String::new()),
        "images[0].path: `path` must name a file"
    );
    assert_eq!(
        broken(|s| s.materials[1].name = String::new())[0].message,
        "`name` must not be empty"
    );
    let hints = broken(|s| s.objects[0].material = "rde".into());
    assert_eq!(hints[0].remedy, "did you mean `red`?");
}

/// Protects: sizes and lengths of directions must be above zero.
#[test]
fn sizes_are_above_zero_and_directions_lead_somewhere() {
    assert_eq!(
        shape(Shape::Sphere {
            centre: HERE,
            radius: -1.0
        }),
        "sphere.radius: `radius` must be above zero, not -1"
    );
    assert!(
        shape(Shape::Sphere {
            centre: HERE,
            radius: f64::NAN
        })
        .contains("from 1e-15 to 1e15, not NaN")
    );
    assert!(
        shape(Shape::Sphere {
            centre: [0.0, f64::INFINITY, 0.0],
            radius: 1.0
        })
        .contains("three finite numbers")
    );
    assert!(
        shape(Shape::Sphere {
            centre: [0.0, 1e20, 0.0],
            radius: 1.0
        })
        .contains("within 1e15")
    );
    assert!(
        shape(Shape::Plane {
            point: HERE,
            normal: HERE
        })
        .starts_with("plane.normal: `normal` has length zero")
    );
    assert!(
        shape(Shape::Disk {
            centre: HERE,
            normal: ABOVE,
            radius: 0.0
        })
        .starts_with("disk.radius")
    );
    assert!(
        shape(Shape::Quad {
            corner: HERE,
            edge_u: ABOVE,
            edge_v: [0.0, -3.0, 0.0]
        })
        .contains("no area")
    );
    assert!(
        shape(Shape::Box {
            min: HERE,
            max: [1.0, 0.0, 1.0]
        })
        .contains("`max` must be above `min`")
    );
    let cylinder = |height| Shape::Cylinder {
        base: HERE,
        axis: ABOVE,
        radius: 1.0,
        height,
        caps: true,
    };
    assert!(shape(cylinder(Some(0.0))).starts_with("cylinder.height"));
    assert_eq!(broken(|s| s.objects[0].shape = cylinder(None)), []);
    let cone = |top_radius| Shape::Cone {
        base: HERE,
        axis: ABOVE,
        radius: 1.0,
        top_radius,
        height: 1.0,
    };
    assert!(shape(cone(-1.0)).starts_with("cone.top_radius"));
    assert_eq!(broken(|s| s.objects[0].shape = cone(0.0)), []);
    assert!(
        shape(Shape::Ellipsoid {
            centre: HERE,
            semi_axes: [1.0, 0.0, 1.0]
        })
        .starts_with("ellipsoid.semi_axes[1]")
    );
    assert!(
        shape(Shape::Hyperboloid {
            centre: HERE,
            waist_radius: 1.0,
            c: 0.0,
            half_height: 1.0
        })
        .starts_with("hyperboloid.c")
    );
    assert!(
        shape(Shape::Paraboloid {
            apex: HERE,
            radius: 1.0,
            height: -1.0
        })
        .starts_with("paraboloid.height")
    );
    let torus = Shape::Torus {
        centre: HERE,
        axis: ABOVE,
        major_radius: 1.0,
        minor_radius: 1.0,
    };
    assert!(shape(torus).starts_with("torus.minor_radius: `minor_radius` must be below"));
    assert!(
        shape(Shape::Triangle {
            vertices: [HERE, ABOVE, [0.0, 2.0, 0.0]]
        })
        .contains("no area")
    );
    assert!(
        shape(Shape::Triangle {
            vertices: [HERE, ABOVE, HERE]
        })
        .contains("no area")
    );
}

/// Protects: numbers in a message are short whatever their size.
#[test]
fn lists_have_no_rows_of_zeros() {
    let list = super::check::format_list;
    assert_eq!(list(&[1e-30, 1.0, -1e8]), "[1e-30, 1, -1e8]");
    assert_eq!(
        list(&[0.0, 0.25, f64::NAN, 1e-6, 999_999.5]),
        "[0, 0.25, NaN, 0.000001, 999999.5]"
    );
}

/// Protects: transforms must be invertible and not too extreme.
#[test]
fn transforms_leave_something_to_see() {
    assert!(transform(TransformStep::Scale([1.0, 0.0, 1.0])).contains("may be zero"));
    assert!(transform(TransformStep::Scale([1.0, f64::NAN, 1.0])).contains("from 1e-15"));
    assert!(
        transform(TransformStep::Rotate {
            axis: HERE,
            degrees: 1.0
        })
        .contains("`axis` has length zero")
    );
    assert!(transform(TransformStep::Translate([f64::NAN; 3])).contains("three finite numbers"));
    let flat = [
        [1.0, 2.0, 3.0, 0.0],
        [2.0, 4.0, 6.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ];
    assert!(transform(TransformStep::Matrix(flat)).contains("is singular"));
    let shrunk = single_problem(|scene| {
        scene.objects[0].transform = vec![TransformStep::Scale([1e-15; 3]); 30]
    });
    assert!(
        shrunk.starts_with("objects[0].transform: the steps of `transform` together"),
        "{shrunk}"
    );
    let tiny = [
        [1e-9, 0.0, 0.0, 5.0],
        [0.0, 1e-9, 0.0, 0.0],
        [0.0, 0.0, 1e-9, 0.0],
    ];
    assert_eq!(
        broken(|s| s.objects[0].transform = vec![TransformStep::Matrix(tiny)]),
        []
    );
}

/// Protects: generators need valid positions and a valid object.
#[test]
fn generators_have_places_and_sound_objects() {
    let generator = |kind, object| broken(|s| s.generators = vec![Generator { kind, object }]);
    let grid = |counts| GeneratorKind::Grid {
        counts,
        origin: HERE,
        step: ABOVE,
    };
    let scatter = |count, max| GeneratorKind::Scatter {
        count,
        min: HERE,
        max,
        seed: 0,
    };
    assert_eq!(generator(grid([1, 2, 3]), ball(1.0)), []);
    assert_eq!(
        generator(grid([1, 0, 3]), ball(1.0))[0].path,
        "generators[0].kind.grid.counts[1]"
    );
    assert_eq!(generator(scatter(1, HERE), ball(1.0)), []);
    assert_eq!(
        generator(scatter(0, HERE), ball(1.0))[0].path,
        "generators[0].kind.scatter.count"
    );
    assert_eq!(
        generator(scatter(1, [0.0, -1.0, 0.0]), ball(1.0))[0].path,
        "generators[0].kind.scatter.max"
    );
    assert_eq!(
        generator(scatter(1, HERE), ball(-1.0))[0].path,
        "generators[0].object.shape.sphere.radius"
    );
}

/// Protects: mesh arrays must be finite and match each other.
#[test]
fn mesh_arrays_are_finite_and_fit_each_other() {
    let problem = |break_it: fn(&mut MeshData)| {
        let mut data = leaf();
        break_it(&mut data);
        check_mesh_data(&data)
            .iter()
            .map(|(path, message)| format!("{path}: {message}"))
            .collect::<Vec<_>>()
            .join("\n")
    };
    assert_eq!(check_mesh_data(&leaf()), []);
    assert_eq!(check_mesh_data(&MeshData::default()), []);
    assert!(problem(|mesh| mesh.indices[0][2] = 3).starts_with(
        "indices[0]: an index of this triangle is too large: the mesh has 3 vertices"
    ));
    assert!(
        problem(|mesh| mesh.positions.offsets_mut()[1][0] = f32::NAN).starts_with("positions[1]: ")
    );
    assert!(
        problem(|mesh| mesh.positions.offsets_mut()[2][0] = f32::INFINITY)
            .starts_with("positions[2]: ")
    );
    assert!(
        problem(|mesh| mesh.normals.truncate(2)).starts_with(
            "normals: `normals` must have one entry for each of the 3 positions, not 2"
        )
    );
    assert!(problem(|mesh| mesh.uvs[0].push([0.0; 2])).starts_with("uvs[0]: "));
    assert!(problem(|mesh| mesh.colours[1][3] = -1.0).starts_with("colours[1]: "));
    assert!(problem(|mesh| mesh.uvs = vec![vec![]; 9]).starts_with("uvs: "));
    let scene = broken(|s| {
        s.meshes[0].source = MeshSource::Inline(std::sync::Arc::new(MeshData {
            indices: vec![[9; 3]],
            ..leaf()
        }))
    });
    assert_eq!(scene[0].path, "meshes[0].source.inline.indices[0]");
}

/// Protects: the number of reported problems is limited.
#[test]
fn a_flood_of_problems_is_cut_off() {
    assert_eq!(broken(|s| s.objects = vec![ball(-1.0); 5000]).len(), 100);
}

/// Protects: the intensity of a light may grow with the square of its distance; that of a light
/// without falloff may not.
#[test]
fn intensities_go_with_the_square_of_the_distance() {
    let with = |falloff, colour| {
        broken(|s| {
            s.lights[0].kind = LightKind::Point {
                position: [0.0, 1e15, 0.0],
                falloff,
                range: None,
            };
            s.lights[0].colour = Colour([colour; 3]);
        })
    };
    assert_eq!(with(Falloff::InverseSquare, 3e30), []);
    assert_eq!(
        with(Falloff::InverseSquare, 2e37)[0].message,
        "`colour` must have no channel above 1e37"
    );
    assert_eq!(
        with(Falloff::None, 3e30)[0].message,
        "`colour` must have no channel above 1e30"
    );
}
