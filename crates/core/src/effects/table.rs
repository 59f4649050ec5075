//! Table of effects: name, role, cause in the scene, and treatment by each integrator.

/// Passes the table to another macro. A row is `KIND = NAME, ROLE, SOURCE, TREATMENTS`. `SOURCE`
/// returns the effect's cause from the facts about a scene; its flag is whether path tracing is
/// used. `TREATMENTS` gives the treatment by Whitted ray tracing and by path tracing, and the
/// reason given if the scene does not need the effect. Rows are in the order of reports.
macro_rules! effects {
    ($then:ident) => {
        $then! {
            /// Constant light that reaches every surface, without a source.
            AmbientLight = "ambient light", Switch, |f, _| f.ambient.as_ref(),
                different_in_each(Simulated("a constant light reaches every surface"),
                    LeftOut("constant light without a source has no paths", WHITTED),
                    "no surface has an ambient term");
            /// Lights without size illuminate surfaces.
            DirectLight = "direct light", Switch, |f, _| f.surface_lit_by_lights(),
                same_in_both(Simulated("lights illuminate surfaces"), "no light illuminates a surface");
            /// Occluders between lights and surfaces cast shadows.
            Shadows = "shadows", Switch, |f, _| f.shadowing_occluder(),
                same_in_both(Simulated("a light that casts shadows illuminates a surface, with an occluder between them"),
                    "no light that casts shadows has both a surface and an occluder");
            /// Glossy surfaces show highlights of lights.
            Highlights = "highlights", Switch, |f, _| f.highlighted_surface(),
                same_in_both(Simulated("a light has highlights on a glossy surface"), "no light illuminates a glossy surface");
            /// Surfaces are lit at grazing angles, without a source.
            RimLight = "rim light", Switch, |f, _| f.rim.as_ref(),
                different_in_each(Simulated("a surface is lit at grazing angles"),
                    LeftOut("rim light without a source has no paths", WHITTED),
                    "no surface has a rim term");
            /// Surfaces emit visible light.
            Emission = "emission", Switch, |f, _| f.emission.as_ref(),
                same_in_both(Simulated("a surface emits light"), "no surface emits light");
            /// Surfaces show their base colour without lighting.
            UnlitSurfaces = "unlit surfaces", Scene, |f, _| f.unlit_material.as_ref(),
                same_in_both(Simulated("a material shows its colour as it is"), "every material is lit");
            // Under path tracing alone, a smooth clear coat counts as a mirror reflection, and
            // diffuse transmission as a refraction.
            /// Smooth surfaces reflect as mirrors.
            MirrorReflection = "mirror reflection", Switch, |f, paths| f.effect_or_layer_source(&f.reflection, "clearcoat", paths),
                same_in_both(SimulatedByRays("a smooth surface reflects"), "no smooth surface reflects");
            /// A fixed pattern of directions disturbs reflections.
            FuzzyReflection = "fuzzy reflection", Switch, |f, _| f.fuzz.as_ref(),
                different_in_each(SimulatedByRays("a reflection is disturbed by a fixed pattern"),
                    LeftOut("a pattern of directions is no physical surface", WHITTED),
                    "no reflection is disturbed");
            /// Surfaces transmit and refract light.
            Refraction = "refraction", Switch, |f, paths| f.effect_or_layer_source(&f.refraction, "diffuse_transmission", paths),
                same_in_both(SimulatedByRays("a surface transmits light"), "no surface transmits light");
            /// Materials with an alpha below 1 are partly transparent.
            Transparency = "transparency", Switch, |f, _| f.alpha.as_ref(),
                same_in_both(Simulated("a material has an alpha"), "every material is opaque");
            /// Surfaces follow the metallic-roughness model.
            PhysicalMaterials = "physical materials", Scene, |f, _| f.physical.as_ref(),
                same_in_both(Simulated("a surface follows the metallic-roughness model"), "no surface follows the metallic-roughness model");
            /// Materials read image textures.
            ImageTextures = "image textures", Switch, |f, _| f.image.as_ref(),
                same_in_both(Simulated("a material reads an image"), "no material reads an image");
            /// Textures are averaged over the footprint of a pixel, from reduced images.
            MipMaps = "mip maps", Switch, |f, _| f.mip_maps.as_ref(),
                same_in_both(Simulated("a texture is averaged over the footprint of a pixel"),
                    "no texture uses them: the samples of a pixel average its texels");
            /// Expressions in materials or the sky are evaluated per hit.
            ProceduralTextures = "procedural textures", Scene, |f, _| f.program.as_ref(),
                same_in_both(Simulated("an expression is evaluated per hit"), "no expression is evaluated per hit");
            /// Materials alternate between two colours.
            Checkerboard = "checkerboard", Switch, |f, _| f.checker.as_ref(),
                same_in_both(Simulated("a material alternates between two colours"), "no material alternates between two colours");
            /// Meshes carry vertex colours that a material reads.
            VertexColours = "vertex colours", Switch, |f, _| f.vertex_colours.as_ref(),
                same_in_both(Simulated("a mesh carries colours"), "no mesh carries colours that a material reads");
            /// Meshes carry vertex normals, which are interpolated for shading.
            SmoothShading = "smooth shading", Switch, |f, _| f.smooth_normals.as_ref(),
                same_in_both(Simulated("a mesh carries normals"), "no mesh carries normals");
            /// Images perturb the normals of surfaces.
            NormalMaps = "normal maps", Switch, |f, _| f.normal_map.as_ref(),
                same_in_both(Simulated("an image perturbs the normals of a surface"), "no image perturbs the normals of a surface");
            /// Objects show meshes of triangles.
            TriangleMeshes = "triangle meshes", Scene, |f, _| f.mesh.as_ref(),
                same_in_both(Simulated("an object shows a mesh"), "no object shows a mesh");
            /// Meshes are shown more than once and stored once.
            Instances = "instances", Scene, |f, _| f.instance.as_ref(),
                same_in_both(Simulated("a mesh is shown more than once, and stored once"), "no mesh is shown more than once");
            /// Shapes without bounds, such as planes, are kept beside the tree.
            UnboundedShapes = "unbounded shapes", Scene, |f, _| f.unbounded_shape.as_ref(),
                same_in_both(Simulated("a shape without bounds is kept beside the tree"), "every shape has bounds");
            /// Rays that hit nothing see the sky.
            Sky = "sky", Switch, |f, _| f.sky.as_ref(),
                same_in_both(Simulated("rays that hit nothing see it"), "rays that hit nothing see black");
            /// The sky is an image.
            EnvironmentMap = "environment map", Switch, |f, _| f.sky_map.as_ref(),
                same_in_both(Simulated("the sky is a picture"), "the sky is not a picture");
            /// A studio's ground shows nothing but shadows.
            GroundShadow = "ground shadow", Switch, |f, _| f.ground.as_ref(),
                different_in_each(LeftOut("the studio's backdrop shows no shadows", PATH),
                    Simulated("the scene shadows the ground of the studio's backdrop"),
                    "no studio has a ground");
            /// Surfaces receive light from the sky.
            SkyLight = "sky light", Switch, |f, paths| f.surface_lit_by_sky(paths).and(f.sky.as_ref()),
                different_with_reasons((Simulated("physical materials receive the sky's cosine-weighted average, without occlusion"),
                        "no physical material receives light from a sky"),
                    (Simulated("surfaces sample directions of the sky by its brightness"),
                        "no surface receives light from a sky"));
            /// A camera with an aperture blurs surfaces out of focus.
            DepthOfField = "depth of field", Switch, |f, _| f.lens.as_ref(),
                same_in_both(Conditional(|_, settings| match settings.sampling.is_fixed() {
                    true => LeftOut("every ray of a fixed pattern passes through the centre of the lens", SAMPLES),
                    false => Simulated("the camera has an aperture"),
                }), "the camera is a pinhole");
            /// Objects or the camera move while the shutter is open.
            Motion = "motion", Switch, |f, _| f.motion.as_ref().filter(|_| !f.instant),
                same_in_both(Conditional(|f, settings| match settings.sampling.is_fixed() {
                    _ if f.exposure.is_none() =>
                        LeftOut("the camera has no shutter: the picture is of time 0", "give it `shutter = [0, 1]`"),
                    true => LeftOut("every ray of a fixed pattern has the time at which the shutter opens", SAMPLES),
                    false => Simulated("something moves while the shutter is open"),
                }), "nothing moves while the shutter is open");
            /// Evenly emissive surfaces light other surfaces, with soft shadows.
            SoftShadows = "soft shadows", Switch, |f, paths| f.surface_lit_by_lamps(paths).and(f.even_emission.as_ref()),
                same_in_both(Simulated("an emissive surface lights others: each sample takes one point of it"),
                    "no evenly emissive surface lights another");
            /// Surfaces whose emission varies over them light other surfaces.
            TexturedEmitters = "textured emitters", Scene, |f, paths| f.surface_lit_by_lamps(paths).and(f.varied_emission.as_ref()),
                different_in_each(LeftOut("a surface whose emission varies is visible, but does not light others",
                        "--integrator path, or give it an even emission"),
                    Simulated("a surface whose emission varies lights others: a vertex samples a point of it and its emission there"),
                    "no surface whose emission varies lights another");
            /// Surfaces light each other.
            IndirectLight = "indirect light", Scene, |f, paths| f.diffuse_surface(paths),
                different_with_reasons((LeftOut("physical surfaces light each other", PATH), "no physical surface diffuses light"),
                    (Simulated("surfaces light each other"), "no surface diffuses light"));
            /// Rough surfaces blur their reflections.
            GlossyReflection = "glossy reflection", Scene,
                |f, paths| f.rough_reflection.as_ref().or(f.highlight.as_ref().filter(|_| paths)),
                different_in_each(LeftOut("a rough surface blurs its reflection; only lights and the sky's average are reflected in it", PATH),
                    Simulated("a rough surface blurs its reflection"),
                    "no rough surface reflects");
            /// Rough surfaces blur transmitted light.
            RoughRefraction = "rough refraction", Scene, |f, _| f.rough_refraction.as_ref(),
                different_in_each(LeftOut("a rough surface blurs its refraction; the surface is rendered as a smooth one", PATH),
                    Simulated("a rough surface blurs its refraction"),
                    "no rough surface transmits");
            /// Surfaces reflect, transmit or diffuse each ray by chance.
            MixedScattering = "mixed scattering", Scene, |f, _| f.mixture.as_ref(),
                different_in_each(LeftOut("the other terms of the material replace its mixture", PATH),
                    Simulated("a surface reflects, transmits or diffuses each ray, by chance"),
                    "every surface is shaded by its terms");
            /// Bodies absorb light.
            Absorption = "absorption", Switch, |f, _| f.absorption.as_ref(),
                different_in_each(LeftOut("bodies that absorb light are rendered clear", PATH),
                    Simulated("light is absorbed inside a body"),
                    "no body absorbs light");
            /// Of overlapping bodies, the one with the greatest priority determines refraction and
            /// absorption.
            NestedMedia = "nested media", Switch, |f, _| f.nested_body.as_ref(),
                different_in_each(LeftOut("each boundary refracts light as if air lay on one side", PATH),
                    Simulated("where bodies overlap, the body of greatest priority counts, and light refracts directly from one into another"),
                    "no body of glass has a priority");
            /// Thin walls transmit light without refraction.
            ThinWalls = "thin walls", Layer, |f, _| f.layers.source("thin_walled"),
                different_in_each(Simulated("light passes straight through walls, which reflect none of it"),
                    Simulated("walls transmit light without refraction"),
                    "no wall is thin and clear");
            /// Dielectrics reflect more, less or another colour than their index of refraction
            /// gives.
            TintedReflection = "tinted reflection", Layer, |f, _| f.layers.source("specular"),
                path_tracing_only("a surface reflects more or less than by its index", "every surface reflects by its index");
            /// Metals have a complex index of refraction.
            Conductors = "conductors", Layer, |f, _| f.layers.source("conductor"),
                path_tracing_only("a metal reflects by its complex index", "no metal has a complex index");
            /// Surfaces have a clear coat.
            Clearcoat = "clearcoat", Layer, |f, _| f.layers.source("clearcoat"),
                path_tracing_only("a clear coat lies over a surface", "no surface has a clear coat");
            /// Fibres on surfaces scatter light at grazing angles.
            Sheen = "sheen", Layer, |f, _| f.layers.source("sheen"),
                path_tracing_only("fibres scatter light at grazing angles", "no surface has fibres");
            /// Roughness differs between two directions of a surface.
            Anisotropy = "anisotropy", Layer, |f, _| f.layers.source("anisotropy"),
                path_tracing_only("roughness differs between two directions of a surface", "roughness is the same in every direction");
            /// Light interferes in thin films on surfaces.
            Iridescence = "iridescence", Layer, |f, _| f.layers.source("iridescence"),
                path_tracing_only("light interferes in a thin film", "no surface has a thin film");
            /// Short wavelengths refract more than long ones.
            Dispersion = "dispersion", Layer, |f, _| f.layers.source("dispersion"),
                path_tracing_only("short waves refract more than long ones: each path has one wavelength", "the index of glass is the same for all wavelengths");
            /// Surfaces diffuse light to their other side.
            DiffuseTransmission = "diffuse transmission", Layer, |f, _| f.layers.source("diffuse_transmission"),
                path_tracing_only("light is diffused through a surface to its other side", "no surface diffuses light to its other side");
            /// Materials of an imported file have properties that the scene format cannot
            /// represent.
            MaterialExtensions = "material extensions", Scene, |f, _| f.unread_material.as_ref(),
                same_in_both(UnsupportedExtensions("these materials have extensions that this version does not simulate"),
                    "no material has an extension that is not simulated");
            /// Light reaches matte surfaces by mirrors or through glass.
            Caustics = "caustics", Scene,
                |f, paths| f.diffuse_surface(paths).and(f.refraction.as_ref().or(f.reflection.as_ref())),
                different_in_each(LeftOut("light reaches matte surfaces by mirrors or glass", PATH),
                    Conditional(|f, _| match f.light.is_some() {
                        true => LeftOut("no path hits a light without size, so its light by mirrors or glass on matte surfaces is missing",
                            "give the light a size: an emissive ball, say"),
                        false => Simulated("light reaches matte surfaces by mirrors or glass"),
                    }), "no mirror or glass throws light on a matte surface");
        }
    };
}
pub(super) use effects;
