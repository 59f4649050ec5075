//! Environment maps near their poles, decoding of their codes, and packing of their texels.

use super::map::{pack_rgbe, unpack_rgbe};
use super::*;
use glam::{DVec3, Vec3};

/// An image of one column; each row holds its index.
fn rows<R: Real>(height: u32) -> EquirectMap<R> {
    let pixels = PixelData::Linear((0..height).map(|row| [row as f32; 4]).collect());
    EquirectMap::new(
        Arc::new(ImageData {
            width: 1,
            height,
            pixels,
        }),
        R::ZERO,
        R::ONE,
    )
}

/// Protects: image coordinates close to the poles keep their digits, where an arc cosine in `f32`
/// moves in steps of 3.5e-4.
#[test]
fn s19_directions_near_the_poles_find_their_row() {
    const ROWS: u32 = 1 << 20;
    let (narrow, wide) = (rows::<f32>(ROWS), rows::<f64>(ROWS));
    for angle in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
        for turn in [0.3_f64, 2.0, 4.0] {
            for pole in [1.0, -1.0] {
                let ring = f64::sin(angle);
                let d = DVec3::new(ring * turn.cos(), pole * f64::cos(angle), ring * turn.sin())
                    .as_vec3();
                let exact = d.as_dvec3().normalize();
                let v = f64::atan2(exact.x.hypot(exact.z), exact.y) / core::f64::consts::PI;
                let row = (v * f64::from(ROWS) - 0.5).clamp(0.0, f64::from(ROWS - 1));
                let found = f64::from(narrow.radiance(equirectangular_coordinates::<f32>(d)).x);
                // A few roundings of v in `f32`.
                let allowed = 4.0 * f64::from(ROWS) * v * f64::from(f32::EPSILON) + 1e-6 * row;
                assert!(
                    (found - row).abs() <= allowed,
                    "{angle:e} from {pole}: row {found}, not {row}"
                );
                assert!(
                    (wide.radiance(equirectangular_coordinates::<f64>(exact)).x - row).abs()
                        <= 1e-6
                );
            }
        }
    }
    for pole in [Vec3::Y, Vec3::NEG_Y] {
        let edge = if pole.y > 0.0 { 0.0 } else { (ROWS - 1) as f32 };
        assert_eq!(
            narrow.radiance(equirectangular_coordinates::<f32>(pole)),
            Vec3::splat(edge)
        );
    }
}

/// Protects: an 8-bit image is decoded with all digits of the reference precision.
#[test]
fn codes_are_decoded_in_the_precision_that_reads_them() {
    for code in 1..=255_u8 {
        let image = Arc::new(ImageData {
            width: 1,
            height: 1,
            pixels: PixelData::Codes(vec![[code; 4]]),
        });
        let c = f64::from(code) / 255.0;
        let linear = if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        };
        let found = EquirectMap::<f64>::new(image, 0.0, 1.0)
            .radiance(equirectangular_coordinates::<f64>(DVec3::Z))
            .y;
        assert!(
            (found - linear).abs() < 1e-15,
            "{code}: {found}, not {linear}"
        );
    }
}

/// Protects: the direction of an image's rotation. Each column holds its index, and a quarter turn
/// shows along +z the column that lay along +x: the middle one.
#[test]
fn a_quarter_turn_brings_what_was_along_x_to_z() {
    const COLUMNS: u32 = 64;
    let pixels = PixelData::Linear((0..COLUMNS).map(|column| [column as f32; 4]).collect());
    let data = ImageData {
        width: COLUMNS,
        height: 1,
        pixels,
    };
    let image = crate::scene::Image {
        name: "stars".to_owned(),
        path: String::new(),
        data: Some(Arc::new(data)),
        mended: 0,
    };
    let along = |rotation: f64, d: DVec3| {
        let map = crate::scene::SkyMap {
            image: "stars".to_owned(),
            rotation,
            strength: 1.0,
        };
        let scene = crate::Scene {
            images: vec![image.clone()],
            ..crate::Scene::default()
        };
        let sky = prepare_sky_radiance::<f64>(
            (Some(&SkyData::Map(map)), DVec3::ZERO),
            &SceneLookup::new(&scene),
            &BTreeMap::new(),
        );
        sky.expect("the image is there").radiance(DVec3::ZERO, d).x
    };
    // The direction lies between two columns, and their indices are interpolated.
    let middle = f64::from(COLUMNS) / 2.0 - 0.5;
    assert!(
        (along(0.0, DVec3::X) - middle).abs() < 1e-9
            && (along(90.0, DVec3::Z) - middle).abs() < 1e-9
    );
    assert!((along(-90.0, DVec3::NEG_Z) - middle).abs() < 1e-9);
    assert!(
        (along(0.0, DVec3::Z) - middle - 16.0).abs() < 1e-9,
        "{}",
        along(0.0, DVec3::Z)
    );
}

/// Protects: an image's strength scales its power as its radiance, for every kind of pixel.
#[test]
fn strength_is_part_of_the_power() {
    for pixels in [
        PixelData::Linear(vec![[0.5, 1.0, 2.0, 1.0]; 8]),
        PixelData::Codes(vec![[20, 120, 250, 255]; 8]),
    ] {
        let image = Arc::new(ImageData {
            width: 4,
            height: 2,
            pixels,
        });
        let power = |strength: f64| {
            let sky = SkyRadiance {
                kind: SkyKind::Map(EquirectMap::new(Arc::clone(&image), 0.0, strength)),
            };
            let actual = sky.radiance(DVec3::ZERO, DVec3::X);
            let sampler = crate::light::SkySampler::new(&sky).expect("it shines");
            // A constant image, so the power is the radiance over the sphere.
            assert!(
                (sampler.flux() / (4.0 * core::f64::consts::PI * (actual.x + actual.y + actual.z))
                    - 1.0)
                    .abs()
                    < 1e-9
            );
            sampler.flux()
        };
        assert!((power(3.0) / power(1.0) - 3.0).abs() < 1e-12);
    }
}

/// Protects: texels are packed only if they unpack to the same bits, for any value.
#[test]
fn packed_texels_keep_their_bits() {
    let whole = |mantissas: [u8; 3], exponent: i32| {
        mantissas.map(|m| f32::from(m) * 2.0_f32.powi(exponent))
    };
    for exponent in -110..=119 {
        for mantissas in [[255, 0, 1], [128, 255, 64], [1, 1, 1], [0, 3, 0], [0, 0, 0]] {
            let colour = whole(mantissas, exponent);
            let texel = pack_rgbe(colour).unwrap_or_else(|| panic!("{mantissas:?}·2^{exponent}"));
            assert_eq!(
                unpack_rgbe(texel).map(f32::to_bits),
                colour.map(f32::to_bits)
            );
        }
    }
    let odd = [1.0, 0.1, 0.0];
    let more = [1.0, 1.0 / 512.0, 0.0];
    for colour in [
        odd,
        more,
        [-1.0, 1.0, 1.0],
        [-0.0, 1.0, 1.0],
        [f32::NAN, 1.0, 1.0],
        [f32::INFINITY, 1.0, 1.0],
        [1e-45, 0.0, 0.0],
    ] {
        assert_eq!(pack_rgbe(colour), None, "{colour:?}");
    }
}

/// Protects: a sky of packed texels has the same bits as a sky of unpacked ones.
#[test]
fn packed_skies_are_the_same() {
    let texel = |i: u32| {
        [
            (i * 37 % 256) as f32 / 64.0,
            (i * 91 % 256) as f32 / 64.0,
            (i % 4) as f32,
            1.0,
        ]
    };
    let map = |alpha: bool, odd: f32| {
        let mut pixels: Vec<[f32; 4]> = (0..32).map(texel).collect();
        pixels[31][3] = if alpha { 0.3 } else { 1.0 };
        pixels.extend(vec![[odd; 4]; 32]);
        EquirectMap::<f32>::new(
            Arc::new(ImageData {
                width: 8,
                height: 8,
                pixels: PixelData::Linear(pixels),
            }),
            0.1,
            1.3,
        )
    };
    // One texel in the lower half that can't be packed keeps all texels unpacked.
    let (narrow, wide) = (map(true, 1.0), map(true, 0.1));
    assert_eq!(
        (narrow.packed_texels.len(), wide.packed_texels.len()),
        (64, 0)
    );
    for (i, j) in (0..40).flat_map(|i| (0..15).map(move |j| (i, j))) {
        let place = [i as f32 / 40.0, j as f32 / 40.0];
        assert_eq!(narrow.radiance(place), wide.radiance(place), "{place:?}");
    }
}

/// Protects: many directions evaluated together have the bits of each alone, for packed and
/// unpacked images, and for skies without an image.
#[test]
fn many_looks_show_what_one_shows() {
    let pixels = |unit: f32| {
        PixelData::Linear(
            (0..15 * 8)
                .map(|i| [i as f32 * unit, 7.0 * unit, (i % 5) as f32 * unit, 1.0])
                .collect(),
        )
    };
    let map = |unit: f32, turn: f32| {
        let image = ImageData {
            width: 15,
            height: 8,
            pixels: pixels(unit),
        };
        EquirectMap::new(Arc::new(image), turn, 1.5)
    };
    assert!(!map(0.25, 0.0).packed_texels.is_empty() && map(0.1, 0.0).packed_texels.is_empty());
    let sun = |i: u8| SunLobe {
        direction: Vec3::new(0.6, 0.8, 0.1 * f32::from(i)).normalize(),
        colour: Vec3::new(3.0, 0.1 * f32::from(i), 7.3),
        exponent: [0, 1, 4, 12, 30][usize::from(i)],
    };
    let [bottom, top] = [Vec3::new(0.15, 0.3, 1.7), Vec3::new(0.45, 0.1, 0.9)];
    let gradients = [0, 1, 5].map(|suns| {
        SkyKind::Gradient(GradientSky {
            bottom,
            top,
            suns: (0..suns).map(sun).collect(),
        })
    });
    let others = [
        SkyKind::Black,
        SkyKind::Constant(Vec3::splat(0.3)),
        SkyKind::Map(map(0.25, 0.0)),
        SkyKind::Map(map(0.1, 0.7)),
    ];
    for kind in others.into_iter().chain(gradients) {
        let sky = SkyRadiance::<f32> { kind };
        for count in [0, 1, 15, 16, 17, 333] {
            let direction = |i: usize| {
                let [turn, height] = [0.731 * i as f64, libm::cos(1.1 * i as f64)];
                let ring = (1.0 - height * height).sqrt();
                DVec3::new(ring * libm::cos(turn), height, ring * libm::sin(turn)).as_vec3()
            };
            let mut sky_samples = Vec::new();
            sky.eval_rays(
                (0..count).map(|i| (Vec3::ONE, direction(i))),
                &mut sky_samples,
            );
            assert_eq!(sky_samples.len(), count);
            for (i, sky_sample) in sky_samples.into_iter().enumerate() {
                let (place, radiance) = (
                    sky.image_coordinates(direction(i)),
                    sky.radiance(Vec3::ONE, direction(i)),
                );
                assert_eq!(
                    (
                        sky_sample.image_coordinates.map(f32::to_bits),
                        sky_sample.radiance
                    ),
                    (place.map(f32::to_bits), radiance),
                    "{i} of {count}"
                );
            }
        }
    }
}
