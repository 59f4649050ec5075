//! Tests of the environment options.

use super::*;
use crate::ErrorKind;
use crate::native::SceneNotation;
use raywright_core::scene::{ColourInput, Light, LightKind, Sun};

fn under(sky: Option<Sky>, options: EnvironmentOptions) -> Result<Scene, Error> {
    let mut scene = Scene {
        sky,
        ..Scene::default()
    };
    apply_environment(
        &mut scene,
        SceneFormat::Glb,
        &options,
        &Folder::for_built_in_scene(1 << 20),
        &Limits::default(),
        &mut Vec::new(),
    )
    .map(|_| scene)
}

fn gradient() -> Sky {
    let sun = Sun {
        direction: [1.0, 2.0, 0.0],
        colour: Colour([1.0; 3]),
        weight: 4.0,
        exponent: 8,
    };
    Sky::Gradient {
        bottom: Colour([0.1, 0.2, 0.3]),
        top: Colour([1.0; 3]),
        suns: vec![sun],
    }
}

/// Protects: each kind of sky is rotated and scaled as a picture is: 90° shows along +z what
/// was along +x.
#[test]
fn skies_are_turned_and_weighed() {
    let options = || EnvironmentOptions {
        rotation: Some(90.0),
        strength: Some(0.5),
        ..EnvironmentOptions::default()
    };
    let Ok(Scene {
        sky: Some(Sky::Gradient { bottom, suns, .. }),
        ..
    }) = under(Some(gradient()), options())
    else {
        panic!("a gradient")
    };
    let expected = [0.0, 2.0, 1.0];
    assert!(
        suns[0]
            .direction
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-12),
        "{:?}",
        suns[0].direction
    );
    assert_eq!((bottom.0, suns[0].weight), ([0.05, 0.1, 0.15], 2.0));
    let map = Sky::Map(SkyMap {
        image: "a".to_owned(),
        rotation: 30.0,
        strength: 3.0,
    });
    let Ok(Scene {
        sky: Some(Sky::Map(map)),
        ..
    }) = under(Some(map), options())
    else {
        panic!("a map")
    };
    assert_eq!((map.rotation, map.strength), (120.0, 1.5));
    let error = under(
        Some(Sky::Expression(ColourInput::Expression("d".to_owned()))),
        options(),
    )
    .expect_err("an expression");
    assert_eq!(error.kind(), ErrorKind::Usage);
    let none = EnvironmentOptions {
        source: Some(EnvironmentSource::None),
        ..options()
    };
    let error = under(None, none).expect_err("no sky").to_string();
    assert!(
        error.contains("the scene has no environment") && error.contains("--env default"),
        "{error}"
    );
}

/// Protects: a scene without light gets a visible environment, with the reason, unless the user
/// chose none: the neutral sky for a native scene, where dim light is enough, and the studio
/// for a model whose own lights are too faint. A model with lights of its own gets the backdrop.
#[test]
fn scenes_that_would_be_black_get_light() {
    let to_light = [0.0, 1.0, 0.0];
    let light = |colour: f64| Light {
        name: String::new(),
        kind: LightKind::Directional { to_light },
        colour: Colour([colour; 3]),
        shadows: true,
        specular: true,
    };
    let (native, studio) = (
        SceneFormat::Native(SceneNotation::Toml),
        Sky::Studio(Studio::default()),
    );
    for (brightness, format, expected) in [
        (None, native, Some((LightShortage::NoLight, neutral_sky()))),
        (
            None,
            SceneFormat::Obj,
            Some((LightShortage::NoLight, studio.clone())),
        ),
        (Some(1e-3), native, None),
        (
            Some(1e-3),
            SceneFormat::Gltf,
            Some((LightShortage::TooDim, studio.clone())),
        ),
        (Some(1.0), SceneFormat::Gltf, None),
    ] {
        let bare = Scene {
            lights: brightness.map(light).into_iter().collect(),
            ..Scene::default()
        };
        let lit = |options: &EnvironmentOptions| {
            let mut scene = bare.clone();
            let added = apply_environment(
                &mut scene,
                format,
                options,
                &Folder::for_built_in_scene(1 << 20),
                &Limits::default(),
                &mut Vec::new(),
            )
            .expect("no file");
            (added, scene.sky, scene.lights.len())
        };
        let (why, mut sky) = expected.unzip();
        if brightness == Some(1.0) {
            // The backdrop alone, without light and ground.
            sky = Some(Sky::Studio(Studio {
                strength: 0.0,
                ground: false,
                ..Studio::default()
            }));
        }
        assert_eq!(
            lit(&EnvironmentOptions::default()),
            (why, sky, bare.lights.len()),
            "{brightness:?}, {format:?}"
        );
        let with = |source| EnvironmentOptions {
            source: Some(source),
            ..EnvironmentOptions::default()
        };
        assert_eq!(
            lit(&with(EnvironmentSource::None)),
            (None, None, bare.lights.len()),
            "{brightness:?}, {format:?}"
        );
        let requested = lit(&with(EnvironmentSource::Studio));
        assert_eq!(
            requested,
            (None, Some(studio.clone()), 0),
            "{brightness:?}, {format:?}"
        );
    }
}

/// Protects: the studio added to a model is rotated and scaled as any sky, and its ground can
/// be omitted.
#[test]
fn a_studio_is_turned_and_weighed() {
    let options = EnvironmentOptions {
        rotation: Some(30.0),
        strength: Some(0.5),
        ground: GroundRule::None,
        ..EnvironmentOptions::default()
    };
    let expected = Studio {
        rotation: 30.0,
        strength: 0.5,
        ground: false,
        backdrop: None,
    };
    assert_eq!(
        under(None, options).expect("a studio").sky,
        Some(Sky::Studio(expected))
    );
}

/// Protects: the neutral sky replaces the scene's sky, and an unreadable file is reported with
/// its path.
#[test]
fn skies_are_replaced() {
    let with = |source| EnvironmentOptions {
        source: Some(source),
        ..EnvironmentOptions::default()
    };
    assert_eq!(
        under(Some(gradient()), with(EnvironmentSource::None))
            .expect("none")
            .sky,
        None
    );
    assert_eq!(
        under(None, with(EnvironmentSource::Default))
            .expect("one")
            .sky,
        Some(neutral_sky())
    );
    let error =
        under(None, with(EnvironmentSource::File("no/such.hdr".into()))).expect_err("no file");
    assert_eq!(error.kind(), ErrorKind::File);
    assert!(error.to_string().contains("no/such.hdr"), "{error}");
    let error =
        under(None, with(EnvironmentSource::File("Cargo.toml".into()))).expect_err("no picture");
    assert_eq!(error.kind(), ErrorKind::Input);
}

/// Protects: a sky by formula becomes an ordinary picture of the sky, which is turned and weighed
/// as one, beside an image of the same name.
#[test]
fn skies_by_formula_are_pictures() {
    for picture in [SkyPicture::Studio, SkyPicture::Outdoor] {
        let options = EnvironmentOptions {
            source: Some(EnvironmentSource::Picture(picture)),
            rotation: Some(40.0),
            strength: Some(2.0),
            ..EnvironmentOptions::default()
        };
        let scene = under(None, options).expect("a sky");
        let Some(Sky::Map(map)) = &scene.sky else {
            panic!("a map")
        };
        assert_eq!((map.rotation, map.strength), (40.0, 2.0));
        let image = raywright_core::SceneLookup::new(&scene)
            .image(&map.image)
            .and_then(|image| image.data.clone());
        assert!(Arc::ptr_eq(&image.expect("an image"), &picture.image()));
        assert!(raywright_core::validate::validate(&scene).is_empty());
    }
}
