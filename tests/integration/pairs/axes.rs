//! The table of axes: each row is a feature, each entry of a row a value of it. A scene of the net
//! takes one value of every axis.

use raywright::core::effects::{Effect, EffectSet};
use raywright::core::filter::PixelFilter;
use raywright::core::material::FresnelRule;
use raywright::core::scene::{Integrator, SamplePattern};
use raywright::core::settings::{
    Aov, AreaShadows, Background, Crop, LightSampling, MicrofacetEnergy, PrecisionChoice,
    RouletteStart, SamplerKind, Sampling,
};
use raywright::io::{EnvironmentOptions, EnvironmentSource};
use serde_json::{Value, json};

use super::sketch::{Colouring, Sketch};

/// A value of an axis: its name, and what it does to a sketch.
pub type AxisValue = (&'static str, fn(&mut Sketch));

/// An axis: its name and its values. The first value is the plain one.
pub type Axis = (&'static str, &'static [AxisValue]);

/// Values that do not go together: two axes with a prefix of each one's values. A leading `!` stands
/// for all values but the one.
pub const EXCLUDED: &[[(&str, &str); 2]] = &[
    // Layers and alpha are parts of physical materials.
    [("material", "classic"), ("layer", "!no")],
    [("material", "unlit"), ("layer", "!no")],
    [("material", "classic"), ("alpha", "!opaque")],
    [("material", "classic"), ("bumps", "!no")],
    [("material", "unlit"), ("bumps", "!no")],
    [("material", "unlit"), ("glow", "!no")],
    [("material", "classic"), ("colour", "vertex")],
    [("layer", "anisotropy"), ("bumps", "normal")],
    // Expressions can't be turned.
    [("sky", "expression"), ("loading", "turned sky")],
    [("sky", "no"), ("loading", "turned sky")],
    // Lights can't move.
    [("motion", "the body"), ("glow", "even")],
    [("motion", "all"), ("glow", "even")],
    // Denoising and adaptive sampling need several samples at random positions.
    [("ending", "denoised"), ("samples", "!nine")],
    [("ending", "adaptive"), ("samples", "!nine")],
    // Rays of Whitted's integrator divide: long paths take time without end.
    [("integrator", "!path"), ("depth", "unlimited")],
    [("integrator", "whitted"), ("depth", "four")],
];

/// Values that meet in a row although they are more than two: a fault shows only where all of them
/// do.
pub const TOGETHER: &[&[(&str, &str)]] = &[
    // The sign of a normal map on instances that mirror.
    &[
        ("shape", "smooth mesh"),
        ("count", "three"),
        ("transform", "mirrored"),
        ("motion", "no"),
        ("bumps", "normal map"),
        ("alpha", "opaque"),
        ("side", "both"),
        ("camera", "pinhole"),
        ("layers", "all"),
        ("ending", "plain"),
        ("loading", "plain"),
    ],
    // Edges at the time of a ray.
    &[
        ("shape", "flat mesh"),
        ("motion", "the body slides"),
        ("shutter", "whole"),
        ("alpha", "opaque"),
        ("side", "both"),
        ("camera", "pinhole"),
        ("samples", "nine"),
        ("edges", "wireframe"),
        ("ending", "plain"),
        ("without", "nothing"),
        ("loading", "plain"),
    ],
    // Mirrors of what moves.
    &[
        ("shape", "sphere"),
        ("count", "three"),
        ("motion", "the body slides"),
        ("shutter", "whole"),
        ("material", "classic mirror"),
        ("side", "both"),
        ("glow", "no"),
        ("camera", "pinhole"),
        ("samples", "nine"),
        ("integrator", "whitted"),
        ("depth", "two"),
        ("ending", "plain"),
        ("without", "nothing"),
        ("rules", "plain"),
    ],
    // What is seen through a blended body, by a ray that divides, while both move.
    &[
        ("shape", "box"),
        ("count", "three"),
        ("motion", "the body slides"),
        ("shutter", "whole"),
        ("material", "paint"),
        ("alpha", "blend"),
        ("side", "both"),
        ("glow", "no"),
        ("camera", "pinhole"),
        ("samples", "nine"),
        ("integrator", "whitted"),
        ("depth", "two"),
        ("ending", "plain"),
        ("without", "nothing"),
        ("rules", "plain"),
    ],
    // Points of a lens that moves.
    &[
        ("motion", "the camera"),
        ("shutter", "whole"),
        ("camera", "lens"),
        ("samples", "nine"),
        ("ending", "plain"),
        ("without", "nothing"),
    ],
];

/// The axes.
pub const AXES: &[Axis] = &[
    (
        "shape",
        &[
            ("sphere", |s| {
                s.shape(json!({ "sphere": { "centre": [0, 0, 0], "radius": 0.9 } }))
            }),
            ("quad", |s| {
                s.shape(json!({ "quad": { "corner": [-0.8, -0.7, 0.1], "edge_u": [1.6, 0, 0.3], "edge_v": [0, 1.5, 0.2] } }))
            }),
            ("triangle", |s| {
                s.shape(json!({ "triangle": { "vertices": [[-0.9, -0.8, 0], [0.9, -0.6, 0.2], [0, 0.9, 0]] } }))
            }),
            ("disk", |s| {
                s.shape(json!({ "disk": { "centre": [0, 0, 0], "normal": [0.2, 0.3, 1], "radius": 0.9 } }))
            }),
            ("box", |s| {
                s.shape(json!({ "box": { "min": [-0.6, -0.7, -0.5], "max": [0.7, 0.6, 0.5] } }))
            }),
            ("cylinder", |s| {
                s.shape(json!({ "cylinder": { "base": [0, -0.8, 0], "axis": [0.2, 1, 0.1], "radius": 0.5, "height": 1.5 } }))
            }),
            ("cone", |s| {
                s.shape(json!({ "cone": { "base": [0, -0.8, 0], "axis": [0.1, 1, 0], "radius": 0.8, "top_radius": 0.2, "height": 1.5 } }))
            }),
            ("ellipsoid", |s| {
                s.shape(
                    json!({ "ellipsoid": { "centre": [0, 0, 0], "semi_axes": [0.9, 0.5, 0.7] } }),
                )
            }),
            ("hyperboloid", |s| {
                s.shape(json!({ "hyperboloid": { "centre": [0, 0, 0], "waist_radius": 0.4, "c": 0.7, "half_height": 0.8 } }))
            }),
            ("torus", |s| {
                s.shape(json!({ "torus": { "centre": [0, 0, 0], "axis": [0.2, 1, 0.5], "major_radius": 0.65, "minor_radius": 0.25 } }))
            }),
            ("flat mesh", |s| s.mesh(false)),
            ("smooth mesh", |s| s.mesh(true)),
        ],
    ),
    (
        "count",
        &[
            ("one", |_| ()),
            ("the same twice", |s| s.copies = vec![[0.0; 3]; 2]),
            ("three", |s| {
                s.copies = vec![[-0.7, 0.0, 0.0], [0.6, 0.2, -0.4], [0.1, -0.3, 0.7]]
            }),
            ("grid", |s| {
                s.generator = Some(
                    json!({ "grid": { "counts": [3, 2, 2], "origin": [-0.9, -0.5, -0.6], "step": [0.9, 0.9, 0.9] } }),
                )
            }),
            ("crowd", |s| {
                s.generator = Some(
                    json!({ "scatter": { "count": 60, "min": [-1.6, -0.9, -1.6], "max": [1.6, 0.9, 1.0], "seed": 3 } }),
                )
            }),
        ],
    ),
    (
        "transform",
        &[
            ("no", |_| ()),
            ("turned", |s| {
                s.step(json!({ "rotate": { "axis": [1, 2, 3], "degrees": 40 } }))
            }),
            ("stretched", |s| s.step(json!({ "scale": [1.2, 0.6, 0.9] }))),
            ("mirrored", |s| s.step(json!({ "scale": [-1, 1, 1] }))),
            ("sheared", |s| {
                s.step(json!({ "matrix": [[1, 0.3, 0, 0.1], [0, 0.9, 0.2, 0], [0.1, 0, 1, -0.1]] }))
            }),
        ],
    ),
    (
        "motion",
        &[
            ("no", |_| ()),
            ("the body slides", |s| {
                s.end = vec![json!({ "translate": [0.5, 0.2, 0.1] })]
            }),
            ("the body grows", |s| {
                s.end = vec![
                    json!({ "scale": [1.4, 0.8, 1.1] }),
                    json!({ "translate": [-0.3, 0.1, 0] }),
                ]
            }),
            (
                "the camera",
                |s| {
                    s.camera["pose_end"] =
                        json!({ "look_at": { "eye": [0.7, 1.4, 4], "target": [0.1, 0, 0] } })
                },
            ),
            ("all", |s| {
                s.end = vec![json!({ "translate": [0.4, 0, 0.3] })];
                s.camera["pose_end"] =
                    json!({ "look_at": { "eye": [0.9, 1.2, 4], "target": [0.2, 0, 0] } });
            }),
        ],
    ),
    (
        "shutter",
        &[
            ("no", |_| ()),
            ("whole", |s| s.camera["shutter"] = json!([0, 1])),
            ("part", |s| s.camera["shutter"] = json!([0.25, 0.5])),
        ],
    ),
    (
        "material",
        &[
            ("classic paint", |s| {
                s.classic(json!({ "specular": { "model": "blinn", "exponent": 30, "strength": 0.4 }, "rim": { "strength": 0.3, "exponent": 3 } }))
            }),
            ("classic mirror", |s| {
                s.classic(
                    json!({ "local": 0.5, "reflection": { "weight": "0.6 + 0.2*dot(d, n)" } }),
                )
            }),
            ("classic glass", |s| {
                s.classic(json!({ "local": 0.1, "transmission": { "ior": 1.5 }, "shadow_transmittance": 0.6 }))
            }),
            ("classic mixture", |s| {
                s.classic(json!({ "mixture": { "specular_chance": 0.3, "refraction_chance": 0.4, "specular_roughness": 0.3, "ior": 1.4, "absorption": [0.1, 0.5, 0.2] } }))
            }),
            ("paint", |s| s.physical(json!({ "roughness": 0.4 }))),
            ("metal", |s| {
                s.physical(json!({ "metallic": 1, "roughness": 0.2 }))
            }),
            ("glass", |s| {
                s.physical(json!({ "transmission": 1, "roughness": 0, "attenuation_colour": [0.9, 0.5, 0.4], "attenuation_distance": 1 }))
            }),
            ("rough thin glass", |s| {
                s.physical(json!({ "transmission": 0.8, "roughness": 0.3, "thin_walled": true }))
            }),
            ("unlit", |s| s.physical(json!({ "unlit": true }))),
        ],
    ),
    (
        "layer",
        &[
            ("no", |_| ()),
            ("clearcoat", |s| {
                s.model["clearcoat"] = json!({ "factor": 0.8, "roughness": 0.1 })
            }),
            ("sheen", |s| {
                s.model["sheen"] = json!({ "colour": [0.5, 0.4, 0.8] })
            }),
            ("anisotropy", |s| {
                s.model["anisotropy"] = json!({ "strength": 0.7, "rotation": 30 })
            }),
            ("iridescence", |s| {
                s.model["iridescence"] = json!({ "thickness": 350 })
            }),
            ("diffuse transmission", |s| {
                s.model["diffuse_transmission"] =
                    json!({ "factor": 0.6, "colour": [0.8, 0.9, 0.3] })
            }),
            ("dispersion", |s| s.model["dispersion"] = json!(2)),
        ],
    ),
    (
        "colour",
        &[
            ("constant", |_| ()),
            ("checker", |s| {
                s.colouring = Colouring::Input(
                    json!({ "checker": { "even": [0.8, 0.5, 0.2], "odd": 0.1, "size": 0.4 } }),
                )
            }),
            ("place", |s| {
                s.colouring = Colouring::Input(json!(
                    "[0.5 + 0.4*sin(5*p.x), 0.5 + 0.4*noise(3*p), abs(n.y)]"
                ))
            }),
            ("view", |s| {
                s.colouring =
                    Colouring::Input(json!("[abs(dot(d, n)), u*0.5 + 0.2, fract(distance)]"))
            }),
            ("texture", |s| {
                s.colouring = Colouring::Texture(
                    json!({ "filter": "bilinear" }),
                    json!({ "uv_transform": [[3, 0, 0.1], [0, 2, 0]] }),
                )
            }),
            ("mip maps", |s| {
                s.colouring = Colouring::Texture(
                    json!({ "filter": "mipmaps", "wrap_u": "mirrored_repeat" }),
                    json!({ "uv_transform": [[9, 1, 0], [0, 7, 0]] }),
                )
            }),
            ("texture by expression", |s| {
                s.colouring = Colouring::Texture(
                    json!({ "filter": "nearest", "wrap_v": "clamp" }),
                    json!({ "uv": ["p.x*2", "p.y + 0.3*p.z"] }),
                )
            }),
            ("vertex colours", |s| s.colouring = Colouring::Vertices),
        ],
    ),
    (
        "bumps",
        &[
            ("no", |_| ()),
            ("normal map", |s| {
                s.model["normal_texture"] =
                    s.texture("bumps", json!({ "colour_space": "linear" }), json!({}))
            }),
            ("rough spots", |s| {
                s.model["metallic_roughness_texture"] =
                    s.texture("spots", json!({ "colour_space": "linear" }), json!({}))
            }),
        ],
    ),
    (
        "alpha",
        &[
            ("opaque", |_| ()),
            ("blend", |s| {
                s.fields(json!({ "alpha": "blend", "opacity": 0.5 }))
            }),
            ("mask", |s| {
                s.fields(json!({ "alpha": { "mask": { "cutoff": 0.5 } }, "opacity": "0.5 + sin(7*u)*cos(9*v)" }))
            }),
        ],
    ),
    (
        "side",
        &[
            ("both", |_| ()),
            ("outside", |s| s.body["side"] = json!("outside")),
            ("inside", |s| s.body["side"] = json!("inside")),
            ("culled", |s| s.body["side"] = json!("culled")),
            ("without shadow", |s| s.body["casts_shadow"] = json!(false)),
            ("normals outwards", |s| s.body["face_viewer"] = json!(false)),
        ],
    ),
    (
        "glow",
        &[
            ("no", |_| ()),
            ("even", |s| s.model["emission"] = json!([2, 1, 0.5])),
            ("varying", |s| {
                s.model["emission"] = json!("[1 + sin(4*p.y), 0.5, u]")
            }),
        ],
    ),
    (
        "inside",
        &[
            ("nothing", |_| ()),
            ("glass in glass", |s| {
                s.add("materials", json!({ "name": "core", "model": { "physical": { "transmission": 1, "roughness": 0, "ior": 1.33, "priority": 1 } } }));
                s.add("objects", json!({ "shape": { "sphere": { "centre": [0.2, 0, 0.1], "radius": 0.5 } }, "material": "core" }));
            }),
            ("metal", |s| {
                s.add("materials", json!({ "name": "core", "model": { "physical": { "metallic": 1, "roughness": 0.05 } } }));
                s.add("objects", json!({ "shape": { "box": { "min": [-0.2, -0.3, -0.2], "max": [0.3, 0.2, 0.3] } }, "material": "core" }));
            }),
        ],
    ),
    (
        "floor",
        &[
            ("plane", |s| {
                s.floor(
                    json!({ "plane": { "point": [0, -1, 0], "normal": [0, 1, 0] } }),
                    json!([]),
                )
            }),
            ("quad", |s| {
                s.floor(json!({ "quad": { "corner": [-3, -1, 3], "edge_u": [6, 0, 0], "edge_v": [0, 0, -6] } }), json!([]))
            }),
            ("endless tube", |s| {
                s.floor(
                    json!({ "cylinder": { "base": [0, -1, 0], "axis": [1, 0, 0], "radius": 0.5 } }),
                    json!([{ "scale": [1, 2, 3] }, { "translate": [0, 0, -0.5] }]),
                )
            }),
            ("no", |_| ()),
        ],
    ),
    (
        "light",
        &[
            ("sun", |s| {
                s.light(json!({ "directional": { "to_light": [1, 2, 1.5] } }), 2.0)
            }),
            ("no", |_| ()),
            ("point", |s| {
                s.light(json!({ "point": { "position": [1.5, 2.5, 2] } }), 8.0)
            }),
            ("faint point", |s| {
                s.light(json!({ "point": { "position": [1.5, 2.5, 2], "falloff": "none", "range": 6 } }), 2.0)
            }),
            ("spot", |s| {
                s.light(json!({ "spot": { "position": [1, 3, 2], "direction": [-0.3, -1, -0.6], "inner_angle": 15, "outer_angle": 30 } }), 20.0)
            }),
            ("lamp", |s| {
                s.lamp(json!({ "quad": { "corner": [-1, 2.5, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2] } }), 4.0)
            }),
            ("round lamp", |s| {
                s.lamp(
                    json!({ "sphere": { "centre": [1.5, 2, 1], "radius": 0.3 } }),
                    20.0,
                )
            }),
            ("many lamps", |s| {
                for i in 0..12 {
                    let (x, z) = (f64::from(i % 4) - 1.5, f64::from(i / 4) - 1.0);
                    s.lamp(json!({ "disk": { "centre": [x, 2, z], "normal": [0, -1, 0], "radius": 0.15 } }), 6.0);
                }
                s.light(json!({ "point": { "position": [1.5, 2.5, 2] } }), 4.0);
            }),
        ],
    ),
    (
        "sky",
        &[
            ("even", |s| {
                s.parts["sky"] = json!({ "constant": [0.3, 0.4, 0.6] })
            }),
            ("no", |_| ()),
            (
                "gradient",
                |s| s.parts["sky"] = json!({ "gradient": { "bottom": [0.3, 0.2, 0.1], "top": [0.2, 0.4, 0.9], "suns": [{ "direction": [1, 1, 1], "colour": 1, "weight": 5, "exponent": 60 }] } }),
            ),
            (
                "expression",
                |s| s.parts["sky"] = json!({ "expression": "[0.5 + 0.4*d.y, 0.4, max(0, d.x)]" }),
            ),
            ("picture", |s| {
                s.image("sky");
                s.parts["sky"] =
                    json!({ "map": { "image": "sky", "rotation": 40, "strength": 0.8 } });
            }),
            ("studio", |s| {
                s.parts["sky"] = json!({ "studio": { "rotation": 20 } })
            }),
        ],
    ),
    (
        "camera",
        &[
            ("pinhole", |_| ()),
            ("wide", |s| {
                s.camera["projection"] = json!({ "pinhole": { "horizontal_fov": 55 } });
                s.camera["aspect"] = json!(2);
                s.camera["fit"] = json!("contain");
            }),
            ("orthographic", |s| {
                s.camera["projection"] = json!({ "orthographic": { "height": 3 } })
            }),
            (
                "lens",
                |s| s.camera["projection"] = json!({ "thin_lens": { "pinhole": { "vertical_fov": 40 }, "aperture_radius": 0.1, "focus_distance": 4 } }),
            ),
            ("far", |s| {
                s.camera["pose"] =
                    json!({ "look_at": { "eye": [300, 900, 4000], "target": [0, 0, 0] } });
                s.camera["projection"] = json!({ "pinhole": { "vertical_fov": 0.04 } });
            }),
            (
                "within",
                |s| {
                    s.camera["pose"] =
                        json!({ "look_at": { "eye": [0.1, 0.05, 0.2], "target": [0.5, 0, -1] } })
                },
            ),
        ],
    ),
    (
        "samples",
        &[
            ("nine", |s| {
                s.settings(|t| t.sampling = Sampling::General(9))
            }),
            ("one", |s| s.settings(|t| t.sampling = Sampling::General(1))),
            ("five in three", |s| {
                s.settings(|t| (t.sampling, t.replicates) = (Sampling::General(5), Some(3)))
            }),
            // More than a block in each of two replicates, the last one incomplete.
            ("two blocks", |s| {
                s.settings(|t| (t.sampling, t.replicates) = (Sampling::General(37), Some(2)))
            }),
            ("centres", |s| {
                s.settings(|t| t.sampling = Sampling::Pattern(SamplePattern::Centre))
            }),
            ("corners", |s| {
                s.settings(|t| t.sampling = Sampling::Pattern(SamplePattern::Corners))
            }),
        ],
    ),
    (
        "filter",
        &[
            ("box", |_| ()),
            ("tent", |s| s.settings(|t| t.filter = PixelFilter::Tent)),
            ("gaussian", |s| {
                s.settings(|t| t.filter = PixelFilter::Gaussian)
            }),
            ("blackman-harris", |s| {
                s.settings(|t| t.filter = PixelFilter::BlackmanHarris)
            }),
        ],
    ),
    (
        "integrator",
        &[
            ("path", |s| s.settings(|t| t.integrator = Integrator::Path)),
            ("whitted", |s| {
                s.settings(|t| t.integrator = Integrator::Whitted)
            }),
            ("auto", |_| ()),
        ],
    ),
    (
        "depth",
        &[
            ("two", |s| s.settings(|t| t.max_depth = 2)),
            ("one", |s| s.settings(|t| t.max_depth = 1)),
            ("four", |s| s.settings(|t| t.max_depth = 4)),
            ("unlimited", |s| {
                s.settings(|t| t.max_depth = raywright::core::Settings::UNLIMITED)
            }),
        ],
    ),
    (
        "precision",
        &[
            ("robust", |_| ()),
            ("reference", |s| {
                s.settings(|t| t.precision = PrecisionChoice::Reference)
            }),
        ],
    ),
    (
        "layers",
        &[
            ("all", |s| {
                s.settings(|t| t.aovs = Aov::ALL.map(|(_, aov)| aov).to_vec())
            }),
            ("no", |_| ()),
        ],
    ),
    (
        "background",
        &[
            ("sky", |_| ()),
            ("transparent", |s| {
                s.settings(|t| t.background = Background::Transparent)
            }),
        ],
    ),
    (
        "edges",
        &[
            ("no", |_| ()),
            ("wireframe", |s| s.settings(|t| t.wireframe = true)),
        ],
    ),
    (
        "ending",
        &[
            ("plain", |_| ()),
            ("clamped", |s| s.settings(|t| t.clamp = Some(1.5))),
            ("denoised", |s| s.settings(|t| t.denoise = true)),
            // Several tiles, and samples for several rounds.
            ("adaptive", |s| {
                s.settings(|t| {
                    (t.size, t.sampling) = ([20, 4], Sampling::General(32));
                    t.max_error = Some(0.1);
                })
            }),
        ],
    ),
    (
        "crop",
        &[
            ("no", |_| ()),
            ("the middle", |s| {
                s.settings(|t| {
                    let [width, height] = t.size.map(|edge| edge - 2);
                    t.crop = Some(Crop {
                        x: 1,
                        y: 1,
                        width,
                        height,
                    });
                })
            }),
        ],
    ),
    (
        "rungs",
        &[
            ("defaults", |_| ()),
            ("first", |s| {
                s.settings(|t| {
                    (t.light_sampling, t.sampler, t.roulette) = (
                        LightSampling::Lights,
                        SamplerKind::Stratified,
                        RouletteStart::Early,
                    );
                })
            }),
            ("second", |s| {
                s.settings(|t| {
                    (t.light_sampling, t.sampler, t.fresnel) = (
                        LightSampling::Scattering,
                        SamplerKind::Independent,
                        FresnelRule::Exact,
                    );
                })
            }),
            ("third", |s| {
                s.settings(|t| {
                    (t.microfacets, t.area_shadows, t.roulette) = (
                        MicrofacetEnergy::Single,
                        AreaShadows::Hard,
                        RouletteStart::Off,
                    );
                    (t.seed, t.frame) = (7, 3);
                })
            }),
        ],
    ),
    (
        "without",
        &[
            ("nothing", |_| ()),
            ("shadows", |s| {
                s.settings(|t| t.without = EffectSet::from_effects(&[Effect::Shadows]))
            }),
            ("motion", |s| {
                s.settings(|t| t.without = EffectSet::from_effects(&[Effect::Motion]))
            }),
            ("sky and textures", |s| {
                s.settings(|t| {
                    t.without = EffectSet::from_effects(&[
                        Effect::Sky,
                        Effect::MipMaps,
                        Effect::SmoothShading,
                    ])
                })
            }),
        ],
    ),
    (
        "rules",
        &[
            ("plain", |_| ()),
            ("ambient, first occluder", |s| {
                s.parts["classic"] = json!({ "ambient": 0.2, "shadow": "first_in_order" })
            }),
            (
                "constant starts",
                |s| s.parts["classic"] = json!({ "spawn": { "constant": { "offset": 0.001, "along": "normal", "camera_min": 0, "secondary_min": 0.001, "shadow_min": 0.001 } }, "depth_limit": "local_only" }),
            ),
            ("veil", |s| {
                s.parts["render"] = json!({ "veil": [0.01, 0.02, 0.03] })
            }),
        ],
    ),
    (
        "loading",
        &[
            ("plain", |_| ()),
            ("clay", |s| s.options.clay = true),
            ("section", |s| {
                s.options.section = Some("x=0.1".parse().expect("a plane"))
            }),
            ("section by share", |s| {
                s.options.section = Some("-y=40%".parse().expect("a plane"))
            }),
            ("turned sky", |s| {
                s.options.environment = EnvironmentOptions {
                    rotation: Some(70.0),
                    strength: Some(1.5),
                    ..Default::default()
                }
            }),
            ("studio", |s| {
                s.options.environment.source = Some(EnvironmentSource::Studio)
            }),
        ],
    ),
];

/// A constant colour in the form of each colour input: pictures should not tell which.
pub fn even_colour(colouring: &Colouring, colour: [f64; 3]) -> Colouring {
    let [r, g, b] = colour;
    match colouring {
        Colouring::Input(Value::String(_)) => {
            Colouring::Input(json!(format!("[{r} + 0*p.x, {g}, {b} + 0*u]")))
        }
        Colouring::Input(_) => {
            Colouring::Input(json!({ "checker": { "even": colour, "odd": colour } }))
        }
        Colouring::Texture(texture, own) => {
            let mut own = own.clone();
            own["factor"] = json!(colour);
            Colouring::EvenTexture(texture.clone(), own)
        }
        other => other.clone(),
    }
}
