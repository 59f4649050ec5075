use super::*;
use crate::light::{Irradiance, SkyRadiance};
use crate::scene::{Colour, Sky, Sun};

fn sky(picture: SkyPicture) -> SkyRadiance<f64> {
    SkyRadiance::from_picture(picture.image(), 0.0, 1.0)
}

/// Returns normals all around, by the golden spiral.
fn normals() -> impl Iterator<Item = DVec3> {
    (0..64).map(|i| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / 64.0;
        let (turn, ring) = (2.4 * f64::from(i), (1.0 - y * y).sqrt());
        DVec3::new(ring * libm::cos(turn), y, ring * libm::sin(turn))
    })
}

/// Protects: the soft boxes and the room light matte surfaces as the three soft lobes over a
/// gradient did that they replaced: by at most an eighth more or less for any normal, and by a
/// twentieth on average.
#[test]
fn matte_surfaces_keep_their_light() {
    let lobe = |azimuth: f64, elevation: f64, weight, exponent| Sun {
        direction: direction_from_angles(azimuth.to_radians(), elevation.to_radians()).to_array(),
        colour: Colour::WHITE,
        weight,
        exponent,
    };
    let lobes = Sky::Gradient {
        bottom: Colour([0.15; 3]),
        top: Colour([0.45; 3]),
        suns: vec![
            lobe(-40.0, 45.0, 3.8, 12),
            lobe(60.0, 15.0, 0.4, 4),
            lobe(155.0, 35.0, 5.0, 30),
        ],
    };
    let lobes = crate::light::prepare_sky::<f64>(
        (Some(&lobes), DVec3::ZERO),
        &crate::SceneLookup::new(&crate::Scene::default()),
        &std::collections::BTreeMap::new(),
    );
    let [before, now] =
        [lobes.expect("a gradient"), sky(SkyPicture::Studio)].map(|sky| Irradiance::new(&sky));
    let ratios: Vec<f64> = normals()
        .map(|n| now.eval(n).x / before.eval(n).x)
        .collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    assert!((mean - 1.0).abs() < 0.05, "{mean}");
    for (normal, ratio) in normals().zip(&ratios) {
        assert!((ratio - 1.0).abs() < 0.125, "{normal}: {ratio}");
    }
}

/// Protects: a mirror in the studio shows dark walls and bright boxes with edges 6° wide.
#[test]
fn soft_boxes_have_edges() {
    let sky = sky(SkyPicture::Studio);
    let at = |azimuth: f64, elevation: f64| {
        let d = direction_from_angles(f64::to_radians(azimuth), f64::to_radians(elevation));
        sky.radiance(DVec3::ZERO, d).x
    };
    let (middle, inside, outside) = (at(-42.0, 42.0), at(-42.0, 19.0), at(-42.0, 9.0));
    assert!(
        middle > 2.4 && inside > 2.0 && outside < 0.2,
        "{middle} {inside} {outside}"
    );
    assert!(at(0.0, 0.0) < 0.14 && at(0.0, -80.0) > 0.2);
}

/// Protects: a white surface in the landscape is bright and not clipped at exposure 0, in the sun
/// and in its shade; the sun gives about two thirds of the light of a surface that faces it.
#[test]
fn sunlight_is_well_exposed() {
    let outdoor = sky(SkyPicture::Outdoor);
    let sun = direction_from_angles(f64::to_radians(-25.0), f64::to_radians(42.0));
    let irradiance = Irradiance::new(&outdoor);
    let [lit, shade] = [sun, DVec3::new(-sun.x, 0.3, -sun.z).normalize()]
        .map(|normal| irradiance.eval(normal).dot(DVec3::splat(1.0 / 3.0)));
    assert!(
        (0.8..1.3).contains(&lit) && (0.25..0.7).contains(&shade),
        "{lit} {shade}"
    );
    assert!(outdoor.radiance(DVec3::ZERO, sun).x > 500.0);
}

/// Protects: each picture is packed in a quarter of its bytes and has light in every direction.
#[test]
fn pictures_are_packed() {
    for picture in [SkyPicture::Studio, SkyPicture::Outdoor] {
        let image = picture.image();
        let PixelData::Linear(pixels) = &image.pixels else {
            panic!("linear")
        };
        assert_eq!(pixels.len() as u32, picture.size()[0] * picture.size()[1]);
        assert_eq!(sky(picture).bytes(), 4 * pixels.len() as u64);
        for pixel in pixels {
            assert!(
                pixel[..3].iter().all(|&c| c > 0.0 && c < 4096.0),
                "{pixel:?}"
            );
        }
    }
}
