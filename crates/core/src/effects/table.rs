//! Table of effects: name, role, cause in the scene, and treatment by each integrator.

/// Passes the table to another macro. A row is `KIND = NAME, ROLE, SOURCE, READINGS`. The source
/// selects the effect's cause among a scene's facts, under path tracing or not. The readings give
/// the treatment by Whitted ray tracing and by path tracing, and the reason for absence. Rows are
/// in the order of reports.
macro_rules! effects {
    ($then:ident) => {
        $then! {
            /// A constant light that reaches every surface.
            AmbientLight = "ambient light", Switch, |f, _| f.ambient.as_ref(),
                each(Does("a constant light reaches every surface"),
                    Lacks("a constant light that comes from nowhere goes no way", WHITTED),
                    "no surface has an ambient term");
            /// Lights illuminate surfaces.
            DirectLight = "direct light", Switch, |f, _| f.lit_by_lights(),
                both(Does("lights shine on surfaces that answer to them"), "no light meets a surface that answers to it");
            /// An occluder lies between a light and a surface.
            Shadows = "shadows", Switch, |f, _| f.shadowed(),
                both(Does("a light that casts shadows, a surface it shines on and something in between"),
                    "no light that casts shadows meets a surface and an occluder");
            /// Glossy surfaces show highlights of lights.
            Highlights = "highlights", Switch, |f, _| f.highlights(),
                both(Does("a light makes highlights on a glossy surface"), "no light meets a glossy surface");
            /// Light at grazing angles.
            RimLight = "rim light", Switch, |f, _| f.rim.as_ref(),
                each(Does("a surface is lit at grazing angles"),
                    Lacks("light at grazing angles that comes from nowhere goes no way", WHITTED),
                    "no surface has a rim term");
            /// Surfaces emit visible light.
            Emission = "emission", Switch, |f, _| f.emission.as_ref(),
                both(Does("a surface gives off light that is seen"), "no surface gives off light");
            /// Surfaces show their base colour without lighting.
            UnlitSurfaces = "unlit surfaces", Scene, |f, _| f.unlit.as_ref(),
                both(Does("a material shows its colour as it is"), "every material answers to light");
            // A smooth coat reflects as a mirror, and diffuse transmission passes through: under
            // path tracing alone.
            /// Smooth surfaces reflect.
            MirrorReflection = "mirror reflection", Switch, |f, paths| f.with_layer(&f.reflection, "clearcoat", paths),
                both(Traces("a smooth surface reflects"), "no smooth surface reflects");
            /// A fixed pattern disturbs a reflection.
            FuzzyReflection = "fuzzy reflection", Switch, |f, _| f.fuzz.as_ref(),
                each(Traces("a reflection is disturbed by a fixed pattern"),
                    Lacks("a pattern that disturbs directions is no surface", WHITTED),
                    "no reflection is disturbed");
            /// Surfaces transmit and refract light.
            Refraction = "refraction", Switch, |f, paths| f.with_layer(&f.refraction, "diffuse_transmission", paths),
                both(Traces("a surface transmits light"), "no surface transmits light");
            /// Materials with an alpha.
            Transparency = "transparency", Switch, |f, _| f.alpha.as_ref(),
                both(Does("a material has an alpha"), "every material is opaque");
            /// Surfaces that follow the metallic-roughness model.
            PhysicalMaterials = "physical materials", Scene, |f, _| f.physical.as_ref(),
                both(Does("a surface follows the metallic-roughness model"), "no surface follows the metallic-roughness model");
            /// Materials read images.
            ImageTextures = "image textures", Switch, |f, _| f.image.as_ref(),
                both(Does("a material reads an image"), "no material reads an image");
            /// Textures are read from reduced images where a pixel covers many texels.
            MipMaps = "mip maps", Switch, |f, _| f.mip_maps.as_ref(),
                both(Does("a texture asks for the mean over what a pixel covers"),
                    "no texture asks for them: the mean over a pixel is that of its samples");
            /// Expressions that are evaluated per hit.
            ProceduralTextures = "procedural textures", Scene, |f, _| f.program.as_ref(),
                both(Does("an expression is evaluated per hit"), "no expression is evaluated per hit");
            /// Two colours alternate.
            Checkerboard = "checkerboard", Switch, |f, _| f.checker.as_ref(),
                both(Does("a material alternates between two colours"), "no material alternates between two colours");
            /// Meshes carry colours.
            VertexColours = "vertex colours", Switch, |f, _| f.vertex_colours.as_ref(),
                both(Does("a mesh carries colours"), "no mesh carries colours that a material reads");
            /// Meshes carry normals.
            SmoothShading = "smooth shading", Switch, |f, _| f.smooth_normals.as_ref(),
                both(Does("a mesh carries normals"), "no mesh carries normals");
            /// Images change the normals of surfaces.
            NormalMaps = "normal maps", Switch, |f, _| f.normal_map.as_ref(),
                both(Does("an image bends the normals of a surface"), "no image bends the normals of a surface");
            /// Meshes of triangles.
            TriangleMeshes = "triangle meshes", Scene, |f, _| f.mesh.as_ref(),
                both(Does("an object shows a mesh"), "no object shows a mesh");
            /// A mesh is shown more than once and stored once.
            Instances = "instances", Scene, |f, _| f.instance.as_ref(),
                both(Does("a mesh is shown more than once, and stored once"), "no mesh is shown more than once");
            /// Shapes without bounds, kept beside the tree.
            UnboundedShapes = "unbounded shapes", Scene, |f, _| f.unbounded.as_ref(),
                both(Does("a shape without bounds is kept beside the tree"), "every shape has bounds");
            /// Rays that hit nothing see the sky.
            Sky = "sky", Switch, |f, _| f.sky.as_ref(),
                both(Does("rays that hit nothing see it"), "rays that hit nothing see black");
            /// The sky is a picture.
            EnvironmentMap = "environment map", Switch, |f, _| f.sky_map.as_ref(),
                both(Does("the sky is a picture"), "the sky is not a picture");
            /// A ground shows nothing but shadows.
            GroundShadow = "ground shadow", Switch, |f, _| f.ground.as_ref(),
                each(Lacks("the studio's backdrop shows no shadows", PATH),
                    Does("the studio's backdrop is dimmed by what the scene takes of the light on its ground"),
                    "no studio has a ground");
            /// Physical materials receive the sky's cosine-weighted average.
            SkyLight = "sky light", Switch, |f, paths| f.receives(paths).and(f.sky.as_ref()),
                apart((Does("physical materials receive the sky's cosine-weighted average, without occlusion"),
                        "no physical material receives light from a sky"),
                    (Does("surfaces ask directions of the sky, drawn by how bright it is there"),
                        "no surface receives light from a sky"));
            /// A camera with an aperture.
            DepthOfField = "depth of field", Switch, |f, _| f.lens.as_ref(),
                both(Depends(|_, settings| match settings.sampling.is_fixed() {
                    true => Lacks("a fixed pattern sends every ray through the middle of the lens", SAMPLES),
                    false => Does("the camera has an aperture"),
                }), "the camera is a pinhole");
            /// Objects or the camera move while the shutter is open.
            Motion = "motion", Switch, |f, _| f.motion.as_ref().filter(|_| !f.instant),
                both(Depends(|f, settings| match settings.sampling.is_fixed() {
                    _ if f.exposure.is_none() =>
                        Lacks("the camera has no shutter, so everything is seen at time 0", "give it `shutter = [0, 1]`"),
                    true => Lacks("a fixed pattern asks at one time, when the shutter opens", SAMPLES),
                    false => Does("something moves while the shutter is open"),
                }), "nothing moves while the shutter is open");
            /// Emissive surfaces light others.
            SoftShadows = "soft shadows", Switch, |f, paths| f.answers(paths).and(f.even_emission.as_ref()),
                both(Does("an emissive surface lights others: each sample asks one point of it"),
                    "no evenly emissive surface lights another");
            /// Surfaces whose emission varies light others.
            TexturedEmitters = "textured emitters", Scene, |f, paths| f.answers(paths).and(f.varied_emission.as_ref()),
                each(Lacks("a surface whose emission varies is seen, but does not light others",
                        "--integrator path, or give it an even emission"),
                    Does("a surface whose emission varies lights others: each vertex may ask a point of it, and reads what it gives off there"),
                    "no surface whose emission varies lights another");
            /// Surfaces light each other.
            IndirectLight = "indirect light", Scene, |f, paths| f.diffuses(paths),
                apart((Lacks("physical surfaces light each other", PATH), "no physical surface diffuses light"),
                    (Does("surfaces light each other"), "no surface diffuses light"));
            /// Rough surfaces blur their reflections.
            GlossyReflection = "glossy reflection", Scene,
                |f, paths| f.rough_reflection.as_ref().or(f.highlight.as_ref().filter(|_| paths)),
                each(Lacks("a rough surface blurs what it reflects; only lights and the sky's average are reflected in it", PATH),
                    Does("a rough surface blurs what it reflects"),
                    "no rough surface reflects");
            /// Rough surfaces blur transmitted light.
            RoughRefraction = "rough refraction", Scene, |f, _| f.rough_refraction.as_ref(),
                each(Lacks("a rough surface blurs what it transmits; it is shown as a clear one", PATH),
                    Does("a rough surface blurs what it transmits"),
                    "no rough surface transmits");
            /// Surfaces reflect, transmit or diffuse each ray at random.
            MixedScattering = "mixed scattering", Scene, |f, _| f.mixture.as_ref(),
                each(Lacks("its other terms stand for a surface's mixture", PATH),
                    Does("a surface sends each ray one of three ways by chance"),
                    "every surface answers by its terms");
            /// Bodies absorb light.
            Absorption = "absorption", Switch, |f, _| f.absorption.as_ref(),
                each(Lacks("bodies that absorb light are shown clear", PATH),
                    Does("light is absorbed on its way through a body"),
                    "nothing absorbs light on its way");
            /// Where bodies overlap, light is in the body of the greatest priority.
            NestedMedia = "nested media", Switch, |f, _| f.nested.as_ref(),
                each(Lacks("each boundary bends light as from and into air", PATH),
                    Does("where bodies overlap, light is in the one of the greatest priority, and bends from one straight into another"),
                    "no body of glass has a priority");
            /// Walls too thin to refract transmitted light.
            ThinWalls = "thin walls", Layer, |f, _| f.layers.source("thin_walled"),
                each(Does("light goes straight through walls, which reflect none"),
                    Does("walls let light through that they do not bend"),
                    "no wall is thin and clear");
            /// A dielectric reflects more, less or another colour than its index of refraction
            /// gives.
            TintedReflection = "tinted reflection", Layer, |f, _| f.layers.source("specular"),
                for_paths("a surface reflects more or less than its index says", "what reflects goes by its index");
            /// Metals have a complex index of refraction.
            Conductors = "conductors", Layer, |f, _| f.layers.source("conductor"),
                for_paths("a metal reflects by its complex index", "no metal has a complex index");
            /// A clear coat over a surface.
            Clearcoat = "clearcoat", Layer, |f, _| f.layers.source("clearcoat"),
                for_paths("a clear coat lies over a surface", "no surface has a clear coat");
            /// Fibres that catch light at grazing angles.
            Sheen = "sheen", Layer, |f, _| f.layers.source("sheen"),
                for_paths("fibres catch light at grazing angles", "no surface has fibres");
            /// Microfacets are rougher along one direction.
            Anisotropy = "anisotropy", Layer, |f, _| f.layers.source("anisotropy"),
                for_paths("facets are rougher one way", "facets are as rough along every direction");
            /// Thin films cause interference.
            Iridescence = "iridescence", Layer, |f, _| f.layers.source("iridescence"),
                for_paths("light interferes in a thin film", "no surface has a thin film");
            /// Short waves refract more than long ones.
            Dispersion = "dispersion", Layer, |f, _| f.layers.source("dispersion"),
                for_paths("short waves bend more than long ones: paths take one each", "glass bends all light alike");
            /// Light is diffused to the other side of a surface.
            DiffuseTransmission = "diffuse transmission", Layer, |f, _| f.layers.source("diffuse_transmission"),
                for_paths("light is diffused to the other side", "nothing diffuses light to its other side");
            /// Material properties of an imported file without a counterpart in the scene format.
            MaterialExtensions = "material extensions", Scene, |f, _| f.unread.as_ref(),
                both(Unread("what else these materials say is shown; nothing in this version does the rest"),
                    "the file says nothing of materials beyond what is shown");
            /// Light reaches matte surfaces over mirrors or through glass.
            Caustics = "caustics", Scene,
                |f, paths| f.diffuses(paths).and(f.refraction.as_ref().or(f.reflection.as_ref())),
                each(Lacks("light reaches matte surfaces over mirrors or through glass", PATH),
                    Depends(|f, _| match f.light.is_some() {
                        true => Lacks("no path meets a light without size, so its way over mirrors or through glass to matte surfaces is not found",
                            "give the light a size: an emissive ball, say"),
                        false => Does("light reaches matte surfaces over mirrors or through glass"),
                    }), "no mirror or glass sends light onto a matte surface");
        }
    };
}
pub(super) use effects;
