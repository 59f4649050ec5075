//! The one function from scene and settings to the report.

use super::facts::Facts;
use super::{Effect, EffectReport, Status};
use crate::scene::{Integrator, Scene};
use crate::settings::{Sampling, Settings};

/// What the scene and the settings make of every effect.
pub fn detect(scene: &Scene, settings: &Settings) -> EffectReport {
    let facts = Facts::gather(scene, settings);
    let mut list = List::default();
    light_at_a_surface(&mut list, &facts);
    further_segments(&mut list, &facts, settings);
    looks_of_surfaces(&mut list, &facts);
    geometry_and_sky(&mut list, &facts);
    list.lens(&facts.lens, settings);
    emissive_surfaces(&mut list, &facts);
    what_needs_a_path_tracer(&mut list, &facts);
    let because = match settings.integrator {
        Integrator::Whitted => "asked for".to_owned(),
        Integrator::Auto if list.0.iter().any(|e| e.status == Status::LeftOut) => {
            "the only one of this version; what it leaves out is listed".to_owned()
        }
        Integrator::Auto => "the scene is exactly what Whitted ray tracing solves".to_owned(),
    };
    EffectReport { integrator: "whitted", because, effects: list.0 }
}

/// What light does where it first meets a surface.
fn light_at_a_surface(list: &mut List, f: &Facts) {
    list.plain("ambient light", &f.ambient, "a constant light reaches every surface", "no surface has an ambient term");
    let lit = f.lit.as_ref().and(f.light.clone());
    list.plain(
        "direct light",
        &lit,
        "lights shine on surfaces that answer to them",
        "no light meets a surface that answers to it",
    );
    let shadows = lit.as_ref().and(f.shadowing_light.as_ref()).and(f.occluder.as_ref()).and(f.shadowing_light.clone());
    list.plain(
        "shadows",
        &shadows,
        "a light that casts shadows, a surface it shines on and something in between",
        "no light that casts shadows meets a surface and an occluder",
    );
    let highlights = f.glossy_light.as_ref().and(f.highlight.clone());
    list.plain("highlights", &highlights, "a light makes highlights on a glossy surface", "no light meets a glossy surface");
    list.plain("rim light", &f.rim, "a surface is lit at grazing angles", "no surface has a rim term");
    list.plain("emission", &f.emission, "a surface gives off light that is seen", "no surface gives off light");
    list.plain("unlit surfaces", &f.unlit, "a material shows its colour as it is", "every material answers to light");
}

/// What takes a path beyond its first hit.
fn further_segments(list: &mut List, f: &Facts, settings: &Settings) {
    list.traced("mirror reflection", &f.reflection, settings, "a smooth surface reflects", "no smooth surface reflects");
    list.traced(
        "fuzzy reflection",
        &f.fuzz,
        settings,
        "a reflection is disturbed by a fixed pattern",
        "no reflection is disturbed",
    );
    list.traced("refraction", &f.refraction, settings, "a surface transmits light", "no surface transmits light");
    list.plain("transparency", &f.alpha, "a material has an alpha", "every material is opaque");
}

/// What tells one place of a surface from another.
fn looks_of_surfaces(list: &mut List, f: &Facts) {
    list.plain("image textures", &f.image, "a material reads an image", "no material reads an image");
    list.plain("procedural textures", &f.program, "an expression is evaluated per hit", "no expression is evaluated per hit");
    list.plain(
        "checkerboard",
        &f.checker,
        "a material alternates between two colours",
        "no material alternates between two colours",
    );
    list.plain("vertex colours", &f.vertex_colours, "a mesh carries colours", "no mesh carries colours that a material reads");
    list.plain("smooth shading", &f.smooth_normals, "a mesh carries normals", "no mesh carries normals");
}

/// What can be hit, and what is seen and gives light where nothing is.
fn geometry_and_sky(list: &mut List, f: &Facts) {
    list.plain("instances", &f.instance, "a mesh is shown more than once, and stored once", "no mesh is shown more than once");
    list.plain("unbounded shapes", &f.unbounded, "a shape without bounds is kept beside the tree", "every shape has bounds");
    list.plain("sky", &f.sky, "rays that hit nothing see it", "rays that hit nothing see black");
    list.plain("environment map", &f.sky_map, "the sky is a picture", "the sky is not a picture");
    let sky_light = f.lit.as_ref().filter(|path| path.contains("physical")).and(f.sky.clone());
    list.plain(
        "sky light",
        &sky_light,
        "physical materials receive the sky's cosine-weighted average, without occlusion",
        "no physical material receives light from a sky",
    );
}

/// Surfaces that give off light, as others receive it.
fn emissive_surfaces(list: &mut List, f: &Facts) {
    let receiver = |source: &Option<String>| f.lit.as_ref().and(source.clone());
    list.plain(
        "soft shadows",
        &receiver(&f.even_emission),
        "an emissive surface lights others: each sample asks one point of it",
        "no evenly emissive surface lights another",
    );
    list.missing(
        "textured emitters",
        &receiver(&f.varied_emission),
        "a surface whose emission varies is seen, but does not light others",
        "no surface whose emission varies lights another",
        "give it an even emission",
    );
}

/// What Whitted ray tracing does not solve.
fn what_needs_a_path_tracer(list: &mut List, f: &Facts) {
    let path = "needs a path tracer, which this version does not have yet";
    list.missing(
        "indirect light",
        &f.diffuse_physical,
        "physical surfaces light each other",
        "no physical surface diffuses light",
        path,
    );
    list.missing(
        "glossy reflection",
        &f.rough_reflection,
        "a rough surface blurs what it reflects; only lights and the sky's average are reflected in it",
        "no rough surface reflects",
        path,
    );
    list.missing(
        "rough refraction",
        &f.rough_refraction,
        "a rough surface blurs what it transmits; it is shown as a clear one",
        "no rough surface transmits",
        path,
    );
    let caustics = f.diffuse_physical.as_ref().and(f.refraction.as_ref().or(f.reflection.as_ref())).cloned();
    list.missing(
        "caustics",
        &caustics,
        "light reaches matte surfaces over mirrors or through glass",
        "no mirror or glass sends light onto a matte surface",
        path,
    );
}

#[derive(Default)]
struct List(Vec<Effect>);

impl List {
    fn push(&mut self, name: &'static str, status: Status, because: &str, source: Option<String>, hint: Option<String>) {
        self.0.push(Effect { name, status, because: because.to_owned(), source, hint });
    }

    /// Simulated wherever it is present.
    fn plain(&mut self, name: &'static str, source: &Option<String>, present: &str, absent: &str) {
        match source {
            Some(_) => self.push(name, Status::Simulated, present, source.clone(), None),
            None => self.push(name, Status::Absent, absent, None, None),
        }
    }

    /// Needs a second segment.
    fn traced(&mut self, name: &'static str, source: &Option<String>, settings: &Settings, present: &str, absent: &str) {
        match source {
            Some(_) if settings.max_depth < 2 => {
                let because = "every path ends at its first hit (maximum depth 1)";
                self.push(name, Status::LeftOut, because, source.clone(), Some("--max-depth 2 or more".to_owned()));
            }
            _ => self.plain(name, source, present, absent),
        }
    }

    /// A lens needs samples on it.
    fn lens(&mut self, source: &Option<String>, settings: &Settings) {
        match (source, settings.sampling) {
            (Some(_), Sampling::Pattern(_)) => {
                let because = "a fixed pattern sends every ray through the middle of the lens";
                self.push("depth of field", Status::LeftOut, because, source.clone(), Some("--spp 64, say".to_owned()));
            }
            _ => self.plain("depth of field", source, "the camera has an aperture", "the camera is a pinhole"),
        }
    }

    /// Never simulated by this integrator.
    fn missing(&mut self, name: &'static str, source: &Option<String>, present: &str, absent: &str, hint: &str) {
        match source {
            Some(_) => self.push(name, Status::LeftOut, present, source.clone(), Some(hint.to_owned())),
            None => self.push(name, Status::Absent, absent, None, None),
        }
    }
}
