//! Table of effects: name, role, cause in the scene, and treatment by each integrator.

/// Passes the table of effects to another macro. Rows are in the order of reports. A row is `KIND =
/// NAME, ROLE, SOURCE, TREATMENTS`:
///
/// - `SOURCE` is a function of the facts about a scene. It returns the path of what causes the
///   effect. Its second argument is whether path tracing is used.
/// - `TREATMENTS` are the treatments by Whitted ray tracing and by path tracing, with the reason
///   given if the scene does not need the effect.
macro_rules! effects {
    ($then:ident) => {
        $then! {
            /// Constant light that reaches every surface, without a source.
            AmbientLight = "ambient light", Switch, |f, _| f.ambient.as_ref(),
                treatment_by_each_integrator(Simulated("a constant light reaches every surface"),
                    LeftOut("ambient light has no source, so no path can carry it", WHITTED),
                    "no surface has an ambient term");
            /// Lights without size illuminate surfaces.
            DirectLight = "direct light", Switch, |f, _| f.surface_lit_by_lights(),
                same_treatment_by_both_integrators(Simulated("lights illuminate surfaces"), "no light illuminates a surface");
            /// Occluders between lights and surfaces cast shadows.
            Shadows = "shadows", Switch, |f, _| f.shadowing_occluder(),
                same_treatment_by_both_integrators(Simulated("a light that casts shadows illuminates a surface, with an occluder between them"),
                    "no surface is lit by a light that casts shadows, or nothing can block the light");
            /// Glossy surfaces show highlights of lights.
            Highlights = "highlights", Switch, |f, _| f.highlighted_surface(),
                same_treatment_by_both_integrators(Simulated("a light causes highlights on a glossy surface"), "no light illuminates a glossy surface");
            /// Surfaces are lit at grazing angles, without a source.
            RimLight = "rim light", Switch, |f, _| f.rim.as_ref(),
                treatment_by_each_integrator(Simulated("a surface is lit at grazing angles"),
                    LeftOut("rim light has no source, so no path can carry it", WHITTED),
                    "no surface has a rim term");
            /// Surfaces emit visible light.
            Emission = "emission", Switch, |f, _| f.emission.as_ref(),
                same_treatment_by_both_integrators(Simulated("a surface emits light"), "no surface emits light");
            /// Surfaces show their base colour without lighting.
            UnlitSurfaces = "unlit surfaces", Scene, |f, _| f.unlit_material.as_ref(),
                same_treatment_by_both_integrators(Simulated("a material shows its base colour without lighting"), "every material is shaded by light");
            // Under path tracing alone, a smooth clear coat counts as a mirror reflection, and
            // diffuse transmission as a refraction.
            /// Smooth surfaces reflect as mirrors.
            MirrorReflection = "mirror reflection", Switch, |f, paths| f.effect_or_layer_source(&f.reflection, "clearcoat", paths),
                same_treatment_by_both_integrators(SimulatedByRays("a smooth surface reflects"), "no smooth surface reflects");
            /// A fixed pattern of directions disturbs reflections.
            FuzzyReflection = "fuzzy reflection", Switch, |f, _| f.fuzz.as_ref(),
                treatment_by_each_integrator(SimulatedByRays("a reflection is disturbed by a fixed pattern"),
                    LeftOut("the fixed pattern of directions has no physical counterpart; use roughness instead", WHITTED),
                    "no reflection is disturbed");
            /// Surfaces transmit and refract light.
            Refraction = "refraction", Switch, |f, paths| f.effect_or_layer_source(&f.refraction, "diffuse_transmission", paths),
                same_treatment_by_both_integrators(SimulatedByRays("a surface transmits light"), "no surface transmits light");
            /// Materials with an alpha below 1 are partly transparent.
            Transparency = "transparency", Switch, |f, _| f.alpha.as_ref(),
                same_treatment_by_both_integrators(Simulated("a material has an alpha below 1"), "every material is opaque");
            /// Surfaces follow the metallic-roughness model.
            PhysicalMaterials = "physical materials", Scene, |f, _| f.physical.as_ref(),
                same_treatment_by_both_integrators(Simulated("a surface follows the metallic-roughness model"), "no surface follows the metallic-roughness model");
            /// Materials read image textures.
            ImageTextures = "image textures", Switch, |f, _| f.image.as_ref(),
                same_treatment_by_both_integrators(Simulated("a material reads an image"), "no material reads an image");
            /// Textures are averaged over the footprint of a pixel, from reduced images.
            MipMaps = "mip maps", Switch, |f, _| f.mip_maps.as_ref(),
                same_treatment_by_both_integrators(Simulated("a texture is averaged over the footprint of a pixel"),
                    "no texture uses mip maps: the samples of a pixel average its texels");
            /// Expressions in materials or the sky are evaluated per hit.
            ProceduralTextures = "procedural textures", Scene, |f, _| f.program.as_ref(),
                same_treatment_by_both_integrators(Simulated("an expression is evaluated per hit"), "no expression is evaluated per hit");
            /// Materials alternate between two colours.
            Checkerboard = "checkerboard", Switch, |f, _| f.checker.as_ref(),
                same_treatment_by_both_integrators(Simulated("a material alternates between two colours"), "no material alternates between two colours");
            /// Meshes carry vertex colours that a material reads.
            VertexColours = "vertex colours", Switch, |f, _| f.vertex_colours.as_ref(),
                same_treatment_by_both_integrators(Simulated("a mesh carries colours"), "no mesh carries colours that a material reads");
            /// Meshes carry vertex normals, which are interpolated for shading.
            SmoothShading = "smooth shading", Switch, |f, _| f.smooth_normals.as_ref(),
                same_treatment_by_both_integrators(Simulated("a mesh carries normals"), "no mesh carries normals");
            /// Images perturb the normals of surfaces.
            NormalMaps = "normal maps", Switch, |f, _| f.normal_map.as_ref(),
                same_treatment_by_both_integrators(Simulated("an image perturbs the normals of a surface"), "no image perturbs the normals of a surface");
            /// Objects show meshes of triangles.
            TriangleMeshes = "triangle meshes", Scene, |f, _| f.mesh.as_ref(),
                same_treatment_by_both_integrators(Simulated("an object shows a mesh"), "no object shows a mesh");
            /// Meshes are shown more than once and stored once.
            Instances = "instances", Scene, |f, _| f.instance.as_ref(),
                same_treatment_by_both_integrators(Simulated("a mesh is shown more than once but stored once"), "no mesh is shown more than once");
            /// Shapes without bounds, such as planes, are kept beside the tree.
            UnboundedShapes = "unbounded shapes", Scene, |f, _| f.unbounded_shape.as_ref(),
                same_treatment_by_both_integrators(Simulated("a shape without bounds is kept beside the tree"), "every shape has bounds");
            /// Rays that hit nothing see the sky.
            Sky = "sky", Switch, |f, _| f.sky.as_ref(),
                same_treatment_by_both_integrators(Simulated("rays that hit nothing see the sky"), "the scene has no sky: rays that hit nothing are black");
            /// The sky is an image.
            EnvironmentMap = "environment map", Switch, |f, _| f.sky_map.as_ref(),
                same_treatment_by_both_integrators(Simulated("the sky is a picture"), "the sky is not a picture");
            /// A studio's ground shows nothing but shadows.
            GroundShadow = "ground shadow", Switch, |f, _| f.ground.as_ref(),
                treatment_by_each_integrator(LeftOut("the studio's backdrop shows no shadows", PATH),
                    Simulated("the scene casts shadows on the ground of the studio's backdrop"),
                    "no studio has a ground");
            /// Surfaces receive light from the sky.
            SkyLight = "sky light", Switch, |f, paths| f.surface_lit_by_sky(paths).and(f.sky.as_ref()),
                treatments_with_reasons((Simulated("physical materials receive the sky's cosine-weighted average, without occlusion"),
                        "no physical material receives light from a sky"),
                    (Simulated("surfaces sample directions of the sky by its brightness"),
                        "no surface receives light from a sky"));
            /// A camera with an aperture blurs surfaces out of focus.
            DepthOfField = "depth of field", Switch, |f, _| f.lens.as_ref(),
                same_treatment_by_both_integrators(Conditional(|_, settings| match settings.sampling.is_fixed() {
                    true => LeftOut("every ray of a fixed pattern passes through the centre of the lens", SAMPLES),
                    false => Simulated("the camera has an aperture"),
                }), "the camera is a pinhole");
            /// Objects or the camera move while the shutter is open.
            Motion = "motion", Switch, |f, _| f.motion.as_ref().filter(|_| !f.instant),
                same_treatment_by_both_integrators(Conditional(|f, settings| match settings.sampling.is_fixed() {
                    _ if f.exposure.is_none() =>
                        LeftOut("the camera has no shutter, so the picture shows the scene at time 0", "add `shutter = [0, 1]` to the camera"),
                    true => LeftOut("every ray of a fixed pattern has the time at which the shutter opens", SAMPLES),
                    false => Simulated("something moves while the shutter is open"),
                }), "nothing moves while the shutter is open");
            /// Evenly emissive surfaces light other surfaces, with soft shadows.
            SoftShadows = "soft shadows", Switch, |f, paths| f.surface_lit_by_lamps(paths).and(f.even_emission.as_ref()),
                same_treatment_by_both_integrators(Simulated("an emissive surface illuminates other surfaces: each sample takes a point on the emissive surface"),
                    "no surface with uniform emission illuminates another surface");
            /// Surfaces whose emission varies over them light other surfaces.
            TexturedEmitters = "textured emitters", Scene, |f, paths| f.surface_lit_by_lamps(paths).and(f.varied_emission.as_ref()),
                treatment_by_each_integrator(LeftOut("Whitted ray tracing shows a surface whose emission varies, but does not let it illuminate other surfaces",
                        "--integrator path, or give the surface a uniform emission"),
                    Simulated("a surface whose emission varies illuminates other surfaces: each vertex samples a point on it"),
                    "no surface whose emission varies illuminates another surface");
            /// Surfaces light each other.
            IndirectLight = "indirect light", Scene, |f, paths| f.diffuse_surface(paths),
                treatments_with_reasons((LeftOut("physical surfaces light each other", PATH), "no physical surface diffuses light"),
                    (Simulated("surfaces light each other"), "no surface diffuses light"));
            /// Rough surfaces blur their reflections.
            GlossyReflection = "glossy reflection", Scene,
                |f, paths| f.rough_reflection.as_ref().or(f.highlight.as_ref().filter(|_| paths)),
                treatment_by_each_integrator(LeftOut("a rough surface blurs its reflection; in it, Whitted ray tracing reflects only lights and the average of the sky", PATH),
                    Simulated("a rough surface blurs its reflection"),
                    "no rough surface reflects");
            /// Rough surfaces blur transmitted light.
            RoughRefraction = "rough refraction", Scene, |f, _| f.rough_refraction.as_ref(),
                treatment_by_each_integrator(LeftOut("a rough surface blurs its refraction; Whitted ray tracing renders it as smooth", PATH),
                    Simulated("a rough surface blurs its refraction"),
                    "no rough surface transmits");
            /// Surfaces reflect, transmit or diffuse each ray by chance.
            MixedScattering = "mixed scattering", Scene, |f, _| f.mixture.as_ref(),
                treatment_by_each_integrator(LeftOut("Whitted ray tracing shades with the material's other terms instead of its mixture", PATH),
                    Simulated("a surface reflects, transmits or diffuses each ray, by chance"),
                    "no material is a mixture that chooses among reflection, transmission and diffusion");
            /// Bodies absorb light.
            Absorption = "absorption", Switch, |f, _| f.absorption.as_ref(),
                treatment_by_each_integrator(LeftOut("Whitted ray tracing renders bodies that absorb light as clear", PATH),
                    Simulated("light is absorbed inside a body"),
                    "no body absorbs light");
            /// Light is scattered inside bodies or by the air.
            ScatteringMedia = "scattering media", Switch, |f, _| f.medium.as_ref(),
                path_tracing_only_treatment("light is scattered on its way through a body or the air", "no body and no air scatters light");
            /// Of overlapping bodies, the one with the greatest priority determines refraction and
            /// absorption.
            NestedMedia = "nested media", Switch, |f, _| f.nested_body.as_ref(),
                treatment_by_each_integrator(LeftOut("Whitted ray tracing refracts light at each boundary as if one side were air", PATH),
                    Simulated("where bodies overlap, the body with the greatest priority counts; light refracts directly from one body into the next"),
                    "no body of glass has a priority");
            /// Thin walls transmit light without refraction.
            ThinWalls = "thin walls", Layer, |f, _| f.layers.first_use("thin_walled"),
                treatment_by_each_integrator(Simulated("light passes straight through thin walls, which reflect nothing"),
                    Simulated("thin walls transmit light without refraction"),
                    "no surface is a thin wall that transmits light");
            /// Dielectrics reflect more, less or another colour than their index of refraction
            /// gives.
            TintedReflection = "tinted reflection", Layer, |f, _| f.layers.first_use("specular"),
                path_tracing_only_treatment("a surface reflects more or less light than its index of refraction gives", "every surface reflects as its index of refraction gives");
            /// Metals have a complex index of refraction.
            Conductors = "conductors", Layer, |f, _| f.layers.first_use("conductor"),
                path_tracing_only_treatment("a metal reflects by its complex index of refraction", "no metal has a complex index of refraction");
            /// Surfaces have a clear coat.
            Clearcoat = "clearcoat", Layer, |f, _| f.layers.first_use("clearcoat"),
                path_tracing_only_treatment("a clear coat lies over a surface", "no surface has a clear coat");
            /// Fibres on surfaces scatter light at grazing angles.
            Sheen = "sheen", Layer, |f, _| f.layers.first_use("sheen"),
                path_tracing_only_treatment("fibres scatter light at grazing angles", "no surface has fibres");
            /// Roughness differs between two directions of a surface.
            Anisotropy = "anisotropy", Layer, |f, _| f.layers.first_use("anisotropy"),
                path_tracing_only_treatment("roughness differs between two directions of a surface", "roughness is the same in every direction");
            /// Light interferes in thin films on surfaces.
            Iridescence = "iridescence", Layer, |f, _| f.layers.first_use("iridescence"),
                path_tracing_only_treatment("light interferes in a thin film", "no surface has a thin film");
            /// Short wavelengths refract more than long ones.
            Dispersion = "dispersion", Layer, |f, _| f.layers.first_use("dispersion"),
                path_tracing_only_treatment("short wavelengths refract more than long ones: each path has a single wavelength", "the index of refraction is the same for all wavelengths");
            /// Surfaces diffuse light to their other side.
            DiffuseTransmission = "diffuse transmission", Layer, |f, _| f.layers.first_use("diffuse_transmission"),
                path_tracing_only_treatment("light is diffused through a surface to its other side", "no surface diffuses light to its other side");
            /// Materials of an imported file have properties that the scene format cannot
            /// represent.
            MaterialExtensions = "material extensions", Scene, |f, _| f.unread_material.as_ref(),
                same_treatment_by_both_integrators(UnsupportedExtensions("remove the extensions, or accept the difference: this version does not simulate them"),
                    "no material has an extension that is not simulated");
            /// Light reaches matte surfaces by mirrors or through glass.
            Caustics = "caustics", Scene,
                |f, paths| f.diffuse_surface(paths).and(f.refraction.as_ref().or(f.reflection.as_ref())),
                treatment_by_each_integrator(LeftOut("Whitted ray tracing finds no light that reaches matte surfaces by mirrors or through glass", PATH),
                    Conditional(|f, _| match f.light.is_some() {
                        true => LeftOut("no path can hit a light without size, so its light that reaches matte surfaces by mirrors or through glass is missing",
                            "replace the light by an emissive surface, such as a small sphere"),
                        false => Simulated("light reaches matte surfaces by mirrors or glass"),
                    }), "no light can reach a matte surface by a mirror or through glass");
        }
    };
}
pub(super) use effects;
