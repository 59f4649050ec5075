//! Importance sampling by brightness: triangles of varying emission, and the excess of a sky.

use super::*;
use crate::scene::{ImageData, PixelData};

/// A triangle above the origin with this emission in cells, `across` along each side, as a light
/// and as geometry.
fn spotted<R: Real>(across: usize, found: &[f64]) -> (Lights<R>, Geometry<R>) {
    let at = |x: f64, y: f64, z: f64| R::Vec3::from_f64(DVec3::new(x, y, z));
    let triangle = Triangle {
        vertices: [at(-0.5, 1.0, -1.0), at(1.5, 1.3, -0.3), at(0.1, 1.6, 1.2)],
    };
    let found: Vec<R::Vec3> = found.iter().map(|&x| at(x, 0.0, 0.0)).collect();
    let (mut list, mut group) = (EmitterList::default(), PrimitiveSet::default());
    list.begin_object();
    list.add_varying_triangle(triangle, &found, false, Side::Both, across);
    group
        .add_shape(triangle.into(), Visibility::default())
        .expect("a shape");
    (
        alone(list, EmitterStrategy::SolidAngle),
        Geometry::new(group, AcceleratorKind::Linear),
    )
}

/// Brightness of cells, a few of which are lit.
fn spots(across: usize) -> Vec<f64> {
    (0..across * across)
        .map(|cell| {
            if cell % 7 == 3 {
                1.0 + cell as f64
            } else {
                0.0
            }
        })
        .collect()
}

/// Protects: samples of a triangle of varying emission follow the density, at sampling and at a
/// ray's hit; each weighs one over the density; and a triangle of uniform emission is sampled by
/// solid angle, as without cells.
#[test]
fn spotted_triangles_are_drawn_by_their_density() {
    let (from, light) = (DVec3::new(0.1, -0.2, 0.05), LightId::Emitter(0));
    for across in [3, 8, 32] {
        let (lights, geometry) = spotted::<f64>(across, &spots(across));
        agrees(
            &format!("{across} cells each way"),
            &lights,
            light,
            from,
            |d| {
                let ray = Ray::new(from, d);
                let hit = geometry.closest(&ray, Interval::positive(), &mut ());
                let light_target = hit.map_or(ShadowRayTarget::Infinity, |hit| {
                    ShadowRayTarget::Surface(geometry.surface(&ray, &hit))
                });
                lights.density(light, from, d, &light_target, 1.0)
            },
        );
        let mut drawn = 0;
        for sample in (0..2_000).filter_map(|i| lights.sample(light, from, numbers(i), 0.125)) {
            let LightDensity::SolidAngle(density) = sample.density else {
                panic!("{:?}", sample.density)
            };
            let again = lights.density(light, from, sample.direction, &sample.target, 0.125);
            assert!(
                (again / density - 1.0).abs() < 1e-9,
                "{again} and {density}"
            );
            assert!(
                (sample.arriving * density - DVec3::ONE).length() < 1e-12,
                "{:?} at {density}",
                sample.arriving
            );
            drawn += 1;
        }
        assert_eq!(drawn, 2_000);
    }
    let whole = [spotted::<f64>(8, &[0.4; 64]).0, spotted::<f64>(1, &[0.4]).0];
    let [first, second] = whole.map(|lights| {
        lights
            .sample(light, from, [0.3, 0.6], 1.0)
            .expect("it shines there")
    });
    assert_eq!(
        (first.direction, first.density),
        (second.direction, second.density)
    );
}

/// A sky with one radiance above the horizon and another below, of which the excess is sampled.
fn halves(above: f32, below: f32) -> Lights<f64> {
    let (width, height) = (32, 16);
    let pixels = (0..width * height)
        .map(|i| [if i < width * height / 2 { above } else { below }; 4])
        .collect();
    let image = std::sync::Arc::new(ImageData {
        width,
        height,
        pixels: PixelData::Linear(pixels),
    });
    let mut lights = under(SkyRadiance {
        kind: sky::SkyKind::Map(sky::EquirectMap::new(image, 0.0, 1.0)),
    });
    lights.sample_bright_excess();
    lights
}

/// Protects: the excess of an image over three quarters of its mean is sampled, by hand: for 1 and
/// 0.9 above and below the horizon 0.2875 and 0.1875, for 1 and 0.2 nothing below; the sky's power
/// among other lights stays that of the whole image.
#[test]
fn of_a_sky_most_of_the_mean_is_left() {
    let density = |lights: &Lights<f64>, y: f64| {
        let direction = DVec3::new(0.6, y, 0.1).normalize();
        lights.density(
            LightId::Sky,
            DVec3::ZERO,
            direction,
            &ShadowRayTarget::Infinity,
            1.0,
        )
    };
    let (near, far) = (halves(1.0, 0.9), halves(1.0, 0.2));
    let ratio = density(&near, 1.0) / density(&near, -1.0);
    assert!((ratio - 0.2875 / 0.1875).abs() < 1e-5, "{ratio}");
    assert!(
        density(&far, 1.0) > 0.15 && density(&far, -1.0) == 0.0,
        "{} above",
        density(&far, 1.0)
    );
    let flux = far.sky_sampler().expect("it is bright").flux();
    assert!(
        (flux / (3.0 * 0.6 * 2.0 * TAU) - 1.0).abs() < 1e-6,
        "{flux}"
    );
    agrees("excess", &near, LightId::Sky, DVec3::ZERO, |d| {
        near.density(
            LightId::Sky,
            DVec3::ZERO,
            d,
            &ShadowRayTarget::Infinity,
            1.0,
        )
    });
}
