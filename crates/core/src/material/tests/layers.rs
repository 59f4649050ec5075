//! Layered surfaces: samples against densities, reciprocity, energy conservation, and closed forms.

use super::super::thin_film::thin_film_reflectance;
use super::super::*;
use super::{NORMAL, WHITE, chi_squared, direction_at, furnace, numbers};
use crate::number::{Lanes, Mask, Number, Vector3};
use glam::DVec3;

fn matte(base: DVec3, roughness: f64) -> MetallicRoughness<f64> {
    MetallicRoughness {
        base,
        metallic: 0.0,
        roughness,
        dielectric: 0.04,
        grazing: 1.0,
        glass: None,
    }
}

fn clear(roughness: f64, ior: f64) -> LayeredSurface<f64> {
    let glass = Some(Glass {
        share: 1.0,
        ior,
        reflected: WHITE,
        transmitted: WHITE,
    });
    let dielectric = ((ior - 1.0) / (ior + 1.0)).powi(2);
    LayeredSurface::from_base(
        MetallicRoughness {
            dielectric,
            glass,
            ..matte(WHITE, roughness)
        },
        ior,
    )
}

/// An arbitrary oblique frame about the normal.
fn askew() -> ShadingFrame<f64> {
    ShadingFrame::from_tangent(NORMAL, DVec3::new(0.3, 0.9, -0.2), false)
}

/// Each layer alone, and all of them together.
fn layers() -> Vec<(&'static str, LayeredSurface<f64>)> {
    let paint = LayeredSurface::from_base(matte(WHITE * 0.8, 0.6), 1.5);
    let metal = |roughness: f64| {
        LayeredSurface::from_base(
            MetallicRoughness {
                metallic: 1.0,
                ..matte(WHITE, roughness)
            },
            1.5,
        )
    };
    let coat = |roughness: f64| {
        Some(Coat {
            weight: 1.0,
            roughness,
            normal: NORMAL,
        })
    };
    let sheen = |roughness: f64| {
        Some(Sheen {
            colour: WHITE,
            roughness,
        })
    };
    let anisotropy = |strength: f64| {
        Some(Anisotropy {
            strength,
            frame: askew(),
        })
    };
    let film = Some(ThinFilm {
        share: 1.0,
        ior: 1.8,
        thickness: 420.0,
    });
    let diffused = Some(DiffuseTransmissionLayer {
        share: 0.4,
        colour: DVec3::new(0.9, 1.0, 0.2),
    });
    let curved = Coat {
        weight: 0.7,
        roughness: 0.3,
        normal: direction_at(NORMAL, 0.93, 2.0),
    };
    vec![
        (
            "rough coat",
            LayeredSurface {
                coat: coat(0.4),
                ..paint
            },
        ),
        (
            "smooth coat",
            LayeredSurface {
                coat: coat(0.0),
                ..paint
            },
        ),
        (
            "bent coat",
            LayeredSurface {
                coat: Some(curved),
                ..paint
            },
        ),
        (
            "coated metal",
            LayeredSurface {
                coat: coat(0.25),
                ..metal(0.5)
            },
        ),
        (
            "velvet",
            LayeredSurface {
                sheen: sheen(0.5),
                ..paint
            },
        ),
        (
            "rough velvet",
            LayeredSurface {
                sheen: sheen(1.0),
                ..paint
            },
        ),
        (
            "brushed metal",
            LayeredSurface {
                anisotropy: anisotropy(0.7),
                ..metal(0.3)
            },
        ),
        (
            "combed paint",
            LayeredSurface {
                anisotropy: anisotropy(1.0),
                ..paint
            },
        ),
        ("oil on paint", LayeredSurface { film, ..paint }),
        ("tempered steel", LayeredSurface { film, ..metal(0.4) }),
        (
            "no reflection",
            LayeredSurface {
                specular: 0.0,
                ..paint
            },
        ),
        (
            "gold reflection",
            LayeredSurface {
                specular_colour: DVec3::new(9.0, 5.0, 1.0),
                ..paint
            },
        ),
        (
            "gold",
            LayeredSurface {
                conductor: Some([DVec3::new(0.143, 0.375, 1.44), DVec3::new(3.98, 2.39, 1.60)]),
                ..metal(0.4)
            },
        ),
        (
            "exact paint",
            LayeredSurface {
                rule: FresnelRule::Exact,
                ..paint
            },
        ),
        (
            "leaf",
            LayeredSurface {
                diffuse_transmission: diffused,
                ..paint
            },
        ),
        (
            "frosted wall",
            LayeredSurface {
                thin: true,
                ..clear(0.5, 1.5)
            },
        ),
        (
            "soapy wall",
            LayeredSurface {
                thin: true,
                film: Some(ThinFilm {
                    share: 1.0,
                    ior: 1.33,
                    thickness: 300.0,
                }),
                ..clear(0.4, 1.5)
            },
        ),
        (
            "oil on glass",
            LayeredSurface {
                film,
                ..clear(0.6, 1.5)
            },
        ),
        (
            "Schlick's glass",
            LayeredSurface {
                rule: FresnelRule::Schlick,
                ..clear(0.6, 1.5)
            },
        ),
        (
            "all",
            LayeredSurface {
                coat: coat(0.3),
                sheen: Some(Sheen {
                    colour: WHITE * 0.5,
                    roughness: 0.6,
                }),
                anisotropy: anisotropy(0.5),
                film: Some(ThinFilm {
                    share: 0.5,
                    ior: 1.4,
                    thickness: 350.0,
                }),
                diffuse_transmission: diffused,
                ..LayeredSurface::from_base(
                    MetallicRoughness {
                        metallic: 0.3,
                        ..matte(WHITE * 0.9, 0.5)
                    },
                    1.5,
                )
            },
        ),
    ]
}

/// Protects: sampled directions follow the density of `pdf`, which integrates to at most one, for
/// each layer and all together.
#[test]
fn layers_are_drawn_by_their_density() {
    for (name, model) in layers() {
        for height in [1.0, 0.7, 0.2] {
            let wo = direction_at(NORMAL, height, 0.4);
            for outside in [true, false] {
                if outside || model.base.glass.is_some() && !model.thin {
                    chi_squared(name, &model.transport_bsdf(NORMAL, wo, outside), wo);
                }
            }
        }
    }
}

/// Protects: layers are reciprocal, above the surface and through thin walls and leaves.
#[test]
fn layers_are_reciprocal() {
    for (name, model) in layers() {
        let mut through = 0;
        for i in 0..300 {
            let ([a, b, c], [d, ..]) = (numbers(2 * i), numbers(2 * i + 1));
            let wo = direction_at(NORMAL, 0.05 + 0.95 * a, core::f64::consts::TAU * b);
            let wi = direction_at(NORMAL, 0.05 + 0.95 * c, core::f64::consts::TAU * d);
            if name == "bent coat" {
                // A coat whose normal was bent uses the cosine to its own normal on both sides.
                continue;
            }
            let there = model.transport_bsdf(NORMAL, wo, true).eval(wo, wi);
            let back = model.transport_bsdf(NORMAL, wi, true).eval(wi, wo);
            assert!(
                (there - back).length() <= 1e-9 * there.length(),
                "{name}: {there} and {back}"
            );
            if model.thin || name == "leaf" {
                let below = wi - NORMAL * (2.0 * wi.dot(NORMAL));
                let there = model
                    .transport_bsdf(NORMAL, wo, true)
                    .eval_and_pdf(wo, below)
                    .0;
                let back = model
                    .transport_bsdf(-NORMAL, below, true)
                    .eval_and_pdf(below, wo)
                    .0;
                assert!(
                    (there - back).length() <= 1e-9 * there.length(),
                    "{name} through: {there} and {back}"
                );
                through += usize::from(there.x > 0.0);
            }
        }
        assert!(!model.thin || through > 100, "{name}: {through}");
    }
}

/// Protects: no layer gains energy in the white furnace, at any roughness and angle; smooth walls
/// and coats over white metal keep all of it, to half a per cent.
#[test]
fn m08_layers_make_no_light() {
    for (name, model) in layers() {
        for roughness in [0.0, 0.1, 0.3, 0.6, 1.0] {
            for height in [1.0, 0.8, 0.5, 0.25, 0.08] {
                let wo = direction_at(NORMAL, height, 0.4);
                let model = LayeredSurface {
                    base: MetallicRoughness {
                        roughness,
                        ..model.base
                    },
                    ..model
                };
                let (scattered, deviation) = furnace(&model.transport_bsdf(NORMAL, wo, true), wo);
                let maximum = 1.005 + 3.0 * deviation;
                assert!(
                    scattered.max_element() <= maximum,
                    "{name}, roughness {roughness} at {height}: {scattered} ± {deviation}"
                );
                assert!(scattered.min_element() >= 0.0, "{name}: {scattered}");
            }
        }
    }
    for height in [1.0, 0.6, 0.2, 0.05] {
        let wo = direction_at(NORMAL, height, 0.4);
        let wall = LayeredSurface {
            thin: true,
            ..clear(0.0, 1.5)
        };
        let metal = LayeredSurface::from_base(
            MetallicRoughness {
                metallic: 1.0,
                ..matte(WHITE, 0.0)
            },
            1.5,
        );
        let coated = LayeredSurface {
            coat: Some(Coat {
                weight: 1.0,
                roughness: 0.0,
                normal: NORMAL,
            }),
            ..metal
        };
        let anisotropy = LayeredSurface {
            anisotropy: Some(Anisotropy {
                strength: 0.3,
                frame: askew(),
            }),
            ..metal
        };
        let filmed = LayeredSurface {
            film: Some(ThinFilm {
                share: 1.0,
                ior: 1.4,
                thickness: 400.0,
            }),
            ..clear(0.0, 1.5)
        };
        for (name, model) in [
            ("wall", wall),
            ("coated mirror", coated),
            ("film on glass", filmed),
            ("combed", anisotropy),
        ] {
            let (scattered, deviation) = furnace(&model.transport_bsdf(NORMAL, wo, true), wo);
            let off = (scattered - DVec3::ONE).abs().max_element();
            assert!(
                scattered.max_element() <= 1.005 + 3.0 * deviation
                    && off <= 0.005 + 3.0 * deviation,
                "{name} at {height}: {scattered} ± {deviation}"
            );
        }
    }
}

/// Protects: a factor on the dielectric reflectance acts the same in the metallic-roughness model
/// and in a layered surface, by values and densities, rough and smooth; a factor of zero leaves
/// Lambert's lobe at every angle.
#[test]
fn factors_of_reflections_are_those_of_layers() {
    for (metallic, specular, roughness) in [
        (0.0, 0.0, 1.0),
        (0.0, 0.3, 0.4),
        (0.4, 0.5, 0.3),
        (1.0, 0.2, 0.5),
        (0.3, 0.6, 0.0),
    ] {
        let base = MetallicRoughness {
            metallic,
            ..matte(WHITE * 0.7, roughness)
        };
        let layered = LayeredSurface {
            specular,
            ..LayeredSurface::from_base(base, 1.5)
        };
        let own_base = MetallicRoughness {
            dielectric: base.dielectric * specular,
            grazing: specular,
            ..base
        };
        let wo = direction_at(NORMAL, 0.35, 0.3);
        let [found, expected] = [
            layered.transport_bsdf(NORMAL, wo, true).lobes().len(),
            own_base
                .transport_bsdf(NORMAL, wo, true, true)
                .lobes()
                .len(),
        ];
        assert!(found <= expected, "{found} and {expected}");
        for i in 0..200 {
            let [a, b, c] = numbers(i);
            let wi = direction_at(NORMAL, a, core::f64::consts::TAU * b);
            let (expected, bsdf) = (
                layered.transport_bsdf(NORMAL, wo, true),
                own_base.transport_bsdf(NORMAL, wo, true, true),
            );
            let apart = (expected.eval(wo, wi) - bsdf.eval(wo, wi))
                .abs()
                .max_element();
            assert!(
                apart <= 1e-12 * expected.eval(wo, wi).max_element(),
                "{metallic} {specular}: {apart:e}"
            );
            assert!(
                (expected.pdf(wo, wi) - bsdf.pdf(wo, wi)).abs() <= 1e-12 * expected.pdf(wo, wi)
            );
            let frame = ShadingFrame::from_normal(NORMAL);
            let [bsdf_sample, other] = [
                expected.sample(&frame, wo, [a, b, c]),
                bsdf.sample(&frame, wo, [a, b, c]),
            ];
            assert_eq!(
                (bsdf_sample.is_valid, bsdf_sample.delta),
                (other.is_valid, other.delta)
            );
            assert!(
                (bsdf_sample.direction - other.direction).length() < 1e-9
                    && (bsdf_sample.weight - other.weight).length() < 1e-9
            );
            if specular == 0.0 {
                let lambert = 0.7 / core::f64::consts::PI;
                assert!(
                    (bsdf.eval(wo, wi) - WHITE * lambert).abs().max_element() < 1e-15,
                    "{:?}",
                    bsdf.eval(wo, wi)
                );
                assert!(
                    (expected.eval(wo, wi) - WHITE * lambert)
                        .abs()
                        .max_element()
                        < 1e-15,
                    "{:?}",
                    expected.eval(wo, wi)
                );
            }
        }
    }
}

/// Protects: a coat, sheen, film, anisotropy or tint of factor zero has no effect on values or
/// samples.
#[test]
fn factors_of_zero_are_absent() {
    for base in [
        matte(WHITE * 0.7, 0.4),
        MetallicRoughness {
            metallic: 0.6,
            ..matte(WHITE * 0.7, 0.3)
        },
    ] {
        let plain = LayeredSurface::from_base(base, 1.5);
        let wo = direction_at(NORMAL, 0.5, 0.3);
        let absent = [
            LayeredSurface {
                coat: Some(Coat {
                    weight: 0.0,
                    roughness: 0.3,
                    normal: NORMAL,
                }),
                ..plain
            },
            LayeredSurface {
                sheen: Some(Sheen {
                    colour: DVec3::ZERO,
                    roughness: 0.3,
                }),
                ..plain
            },
            LayeredSurface {
                film: Some(ThinFilm {
                    share: 0.0,
                    ior: 1.8,
                    thickness: 400.0,
                }),
                ..plain
            },
            LayeredSurface {
                anisotropy: Some(Anisotropy {
                    strength: 0.0,
                    frame: ShadingFrame::from_normal(NORMAL),
                }),
                ..plain
            },
            LayeredSurface {
                diffuse_transmission: Some(DiffuseTransmissionLayer {
                    share: 0.0,
                    colour: WHITE,
                }),
                ..plain
            },
        ];
        let common = base.transport_bsdf(NORMAL, wo, true, true);
        for i in 0..50 {
            let [a, b, _] = numbers(i);
            let wi = direction_at(NORMAL, a, core::f64::consts::TAU * b);
            let expected = plain.transport_bsdf(NORMAL, wo, true);
            assert!(
                (common.eval(wo, wi) - expected.eval(wo, wi))
                    .abs()
                    .max_element()
                    <= 1e-9 * common.eval(wo, wi).x
            );
            assert!((common.pdf(wo, wi) - expected.pdf(wo, wi)).abs() <= 1e-9 * common.pdf(wo, wi));
            for (k, model) in absent.iter().enumerate() {
                let bsdf = model.transport_bsdf(NORMAL, wo, true);
                assert_eq!(
                    (bsdf.eval(wo, wi), bsdf.pdf(wo, wi)),
                    (expected.eval(wo, wi), expected.pdf(wo, wi)),
                    "{k}"
                );
            }
        }
    }
}

/// Protects: closed forms head-on. A thin wall of index 1.5 reflects 2·0.04/1.04 and transmits
/// 0.96/1.04 straight; a coat's highlight is 0.04·D/4 over 0.96 of the layers below.
#[test]
fn values_head_on() {
    let wall = LayeredSurface {
        thin: true,
        ..clear(0.0, 1.5)
    }
    .transport_bsdf(NORMAL, NORMAL, true);
    let share = 2.0 * 0.04 / 1.04;
    for (u, direction) in [(share - 1e-9, NORMAL), (share + 1e-9, -NORMAL)] {
        let sampled = wall.sample(&ShadingFrame::from_normal(NORMAL), NORMAL, [0.0, u, 0.0]);
        assert!(
            sampled.is_valid
                && sampled.delta
                && (sampled.weight - DVec3::ONE).abs().max_element() < 1e-12,
            "{sampled:?}"
        );
        assert!(sampled.direction.distance(direction) < 1e-12);
    }
    // At 60°, by Fresnel's equations: cosine inside √(2/3), R⊥ = ((½ − 1.5·c)/(½ + 1.5·c))², R∥ =
    // ((0.75 − c)/(0.75 + c))².
    let c = f64::sqrt(2.0 / 3.0);
    let r = 0.5 * (((0.5 - 1.5 * c) / (0.5 + 1.5 * c)).powi(2) + ((0.75 - c) / (0.75 + c)).powi(2));
    let wo = direction_at(NORMAL, 0.5, 1.0);
    let wall = LayeredSurface {
        thin: true,
        ..clear(0.0, 1.5)
    }
    .transport_bsdf(NORMAL, wo, true);
    let share = 2.0 * r / (1.0 + r);
    let (below, above) = (
        wall.sample(
            &ShadingFrame::from_normal(NORMAL),
            wo,
            [0.0, share - 1e-9, 0.0],
        ),
        wall.sample(
            &ShadingFrame::from_normal(NORMAL),
            wo,
            [0.0, share + 1e-9, 0.0],
        ),
    );
    assert!(
        below.direction.dot(NORMAL) > 0.0 && above.direction.distance(-wo) < 1e-12,
        "{below:?} {above:?}"
    );
    let pi = core::f64::consts::PI;
    let coat = Some(Coat {
        weight: 1.0,
        roughness: 0.5,
        normal: NORMAL,
    });
    let painted = LayeredSurface {
        specular: 0.0,
        coat,
        ..LayeredSurface::from_base(matte(WHITE, 1.0), 1.5)
    }
    .transport_bsdf(NORMAL, NORMAL, true);
    let scattered = super::super::energy::directional_albedo(0.04, 0.5, 1.0);
    let expected = 0.04 * 16.0 / (4.0 * pi) + (1.0 - scattered) / pi;
    assert!(
        (painted.eval(NORMAL, NORMAL).x - expected).abs() < 1e-9,
        "{} not {expected}",
        painted.eval(NORMAL, NORMAL).x
    );
    // Microfacets of α = ¼ lose a twelfth of it below the surface or to each other.
    assert!((scattered - 0.0366).abs() < 2e-4, "{scattered}");
}

/// Protects: a conductor's reflectance agrees with complex arithmetic, without and with strong
/// absorption, at indices below one, head-on to grazing; without absorption it equals a
/// dielectric's.
#[test]
fn s16_conductors_reflect_by_complex_indices() {
    // (a + bi)/(c + di), √(a + bi) with the root's real part above zero.
    let divided = |[a, b]: [f64; 2], [c, d]: [f64; 2]| {
        let square = c * c + d * d;
        [(a * c + b * d) / square, (b * c - a * d) / square]
    };
    let root = |[a, b]: [f64; 2]| {
        let length = a.hypot(b).sqrt();
        let angle = 0.5 * libm::atan2(b, a);
        [length * angle.cos(), length * angle.sin()]
    };
    for [n, k] in [
        [0.143, 3.98],
        [1.44, 1.6],
        [2.9, 3.1],
        [0.05, 10.0],
        [1.5, 0.0],
        [0.2, 0.01],
    ] {
        for cosine in [1.0, 0.9, 0.5, 0.2, 0.05, 1e-3, 0.0] {
            let square = [n * n - k * k, 2.0 * n * k];
            let inner = root([square[0] - (1.0 - cosine * cosine), square[1]]);
            let across = divided(
                [cosine - inner[0], -inner[1]],
                [cosine + inner[0], inner[1]],
            );
            let scaled = [square[0] * cosine, square[1] * cosine];
            let along = divided(
                [scaled[0] - inner[0], scaled[1] - inner[1]],
                [scaled[0] + inner[0], scaled[1] + inner[1]],
            );
            let expected =
                0.5 * (across[0].powi(2) + across[1].powi(2) + along[0].powi(2) + along[1].powi(2));
            let found = fresnel_conductor(cosine, [n, k]);
            assert!(
                (found - expected).abs() <= 1e-9 && (0.0..=1.0).contains(&found),
                "{n} + {k}i at {cosine}: {found}, not {expected}"
            );
        }
    }
    let inside = (1.0 - (1.0 - 0.36) / 2.25_f64).sqrt();
    assert!(
        (fresnel_conductor(0.6, [1.5, 0.0]) - fresnel_dielectric(0.6, Some(inside), 1.0 / 1.5))
            .abs()
            < 1e-12
    );
}

/// Protects: brushed metal's highlight is wider along the tangent, and follows its formula head-on:
/// D(h) = 1/(π·αx·αy·(…)²).
#[test]
fn anisotropic_highlights_are_wider_along_the_tangent() {
    let frame = askew();
    let metal = MetallicRoughness {
        metallic: 1.0,
        ..matte(WHITE, 0.3)
    };
    let model = LayeredSurface {
        anisotropy: Some(Anisotropy {
            strength: 0.8,
            frame,
        }),
        multiple_scattering: false,
        ..LayeredSurface::from_base(metal, 1.5)
    };
    let [ax, ay] = [0.09 + 0.91 * 0.64, 0.09];
    let bsdf = model.transport_bsdf(NORMAL, NORMAL, true);
    for (along, own) in [(frame.tangent, ax), (frame.bitangent, ay)] {
        let half = (NORMAL * 0.95 + along * (1.0 - 0.95_f64.powi(2)).sqrt()).normalize();
        let wi = half * (2.0 * half.dot(NORMAL)) - NORMAL;
        let (hz, hx) = (half.dot(NORMAL), half.dot(along));
        let density =
            1.0 / (core::f64::consts::PI * ax * ay * ((hx / own).powi(2) + hz * hz).powi(2));
        let (ix, iz) = (wi.dot(along), wi.dot(NORMAL));
        let expected = density * 0.5 / (iz + ((own * ix).powi(2) + iz * iz).sqrt());
        let found = bsdf.eval(NORMAL, wi).x;
        assert!(
            (found / expected - 1.0).abs() < 1e-9,
            "{found} not {expected}"
        );
    }
}

/// Protects: a film colours a mirror, and a film of zero thickness does not.
#[test]
fn films_colour_mirrors() {
    let metal = MetallicRoughness {
        metallic: 1.0,
        ..matte(WHITE * 0.6, 0.0)
    };
    let filmed = |thickness: f64| {
        let film = Some(ThinFilm {
            share: 1.0,
            ior: 1.5,
            thickness,
        });
        let model: LayeredSurface<f64> = LayeredSurface {
            film,
            multiple_scattering: false,
            ..LayeredSurface::from_base(metal, 1.5)
        };
        let bsdf = model.transport_bsdf(NORMAL, NORMAL, true);
        bsdf.sample(&ShadingFrame::from_normal(NORMAL), NORMAL, [0.0; 3])
            .weight
    };
    assert!(
        (filmed(0.0) - DVec3::splat(0.6)).abs().max_element() < 1e-3,
        "{}",
        filmed(0.0)
    );
    let expected = DVec3::from(thin_film_reflectance(1.0, 1.5, 420.0, [0.6; 3]));
    assert!((filmed(420.0) - expected).abs().max_element() < 1e-9);
    assert!(
        expected.max_element() - expected.min_element() > 0.1,
        "{expected}"
    );
}

/// Results of a layered surface in lanes, as bits; every NaN has the same bits.
fn outcome<N: Number>(index: usize, first: usize) -> Vec<Vec<u32>> {
    let (_, model) = layers().swap_remove(index);
    let place = |lane: usize| numbers((first + lane) as u64);
    let vector = |of: &dyn Fn(usize) -> DVec3| {
        <N::Vec3 as Vector3<N>>::from_lanes(|lane| of(lane).as_vec3().as_dvec3())
    };
    let number = |of: &dyn Fn(usize) -> f64| N::from_lanes(|lane| f64::from(of(lane) as f32));
    let normal = vector(&|_| NORMAL);
    let direction = |lane: usize, position: usize| {
        direction_at(
            NORMAL,
            0.02 + 0.98 * place(lane + position)[0],
            6.0 * place(lane + position)[1],
        )
    };
    let (wo, wi) = (
        vector(&|lane| direction(lane, 0)),
        vector(&|lane| {
            direction(lane, 7)
                * if (first + lane).is_multiple_of(3) {
                    -1.0
                } else {
                    1.0
                }
        }),
    );
    let mut outside = N::Mask::default();
    (0..N::LANES)
        .filter(|&lane| place(lane)[2] < 0.7)
        .for_each(|lane| outside.set_lane(lane));
    let colour = |c: DVec3| vector(&|lane| c * place(lane)[0]);
    let base = MetallicRoughness {
        base: colour(model.base.base),
        metallic: number(&|lane| model.base.metallic * place(lane)[2]),
        roughness: number(&|lane| {
            if place(lane)[1] < 0.2 {
                0.0
            } else {
                place(lane)[1]
            }
        }),
        dielectric: number(&|_| model.base.dielectric),
        grazing: number(&|_| model.base.grazing),
        glass: model.base.glass.map(|glass| Glass {
            share: number(&|lane| glass.share * place(lane)[0]),
            ior: N::f64_from_lanes(|_| glass.ior),
            reflected: vector(&|_| glass.reflected),
            transmitted: colour(glass.transmitted),
        }),
    };
    let frame = askew();
    let across = ShadingFrame {
        tangent: vector(&|_| frame.tangent),
        bitangent: vector(&|_| frame.bitangent),
        normal,
    };
    let layered = LayeredSurface {
        specular: number(&|lane| model.specular * place(lane)[1]),
        specular_colour: vector(&|_| model.specular_colour),
        conductor: model
            .conductor
            .map(|[n, k]| [vector(&|_| n), vector(&|_| k)]),
        thin: model.thin,
        diffuse_transmission: model
            .diffuse_transmission
            .map(|d| DiffuseTransmissionLayer {
                share: number(&|lane| d.share * place(lane)[1]),
                colour: vector(&|_| d.colour),
            }),
        anisotropy: model.anisotropy.map(|c| Anisotropy {
            strength: number(&|lane| c.strength * place(lane)[2]),
            frame: across,
        }),
        film: model.film.map(|f| ThinFilm {
            share: number(&|lane| f.share * place(lane)[2]),
            ior: N::f64_from_lanes(|_| f.ior),
            thickness: number(&|lane| f.thickness * place(lane)[0]),
        }),
        sheen: model.sheen.map(|s| Sheen {
            colour: colour(s.colour),
            roughness: number(&|lane| s.roughness * place(lane)[1]),
        }),
        coat: model.coat.map(|c| Coat {
            weight: number(&|lane| c.weight * place(lane)[1]),
            roughness: number(&|lane| c.roughness * place(lane)[2]),
            normal: vector(&|_| c.normal),
        }),
        rule: model.rule,
        ..LayeredSurface::from_base(base, N::f64_from_lanes(|_| model.ior))
    };
    let bsdf = lobes(&layered, normal, wo, outside);
    let drawn = [
        number(&|lane| place(lane)[1]),
        number(&|lane| place(lane)[2]),
        number(&|lane| place(lane)[0]),
    ];
    let (sampled, (value, diffuse)) = (drawn_by(&bsdf, normal, wo, drawn), values(&bsdf, wo, wi));
    let (numbers, masks) = (
        [density(&bsdf, wo, wi), sampled.density],
        [sampled.is_valid, sampled.delta],
    );
    let vectors = [value, diffuse, sampled.direction, sampled.weight];
    let bits = |x: f64| {
        if x.is_nan() {
            u32::MAX
        } else {
            (x as f32 + 0.0).to_bits()
        }
    };
    let lane = |lane: usize| {
        let vectors = vectors
            .iter()
            .flat_map(|v| v.lane(lane).to_array().map(bits));
        let masks = masks.iter().map(|mask| mask.lane(lane).into());
        numbers
            .iter()
            .map(|x| bits(x.lane(lane)))
            .chain(vectors)
            .chain(masks)
            .collect()
    };
    (0..N::LANES).map(lane).collect()
}

// Each group of results is computed in its own function: a compiler takes minutes over all of them
// in a single function.

#[inline(never)]
fn lobes<N: Number>(
    layered: &LayeredSurface<N>,
    normal: N::Vec3,
    wo: N::Vec3,
    outside: N::Mask,
) -> LayeredBsdf<N> {
    layered.transport_bsdf(normal, wo, outside)
}

#[inline(never)]
fn drawn_by<N: Number>(
    bsdf: &LayeredBsdf<N>,
    normal: N::Vec3,
    wo: N::Vec3,
    drawn: [N; 3],
) -> BsdfSample<N> {
    bsdf.sample(&ShadingFrame::from_normal(normal), wo, drawn)
}

#[inline(never)]
fn density<N: Number>(bsdf: &LayeredBsdf<N>, wo: N::Vec3, wi: N::Vec3) -> N {
    bsdf.pdf(wo, wi)
}

#[inline(never)]
fn values<N: Number>(bsdf: &LayeredBsdf<N>, wo: N::Vec3, wi: N::Vec3) -> (N::Vec3, N::Vec3) {
    // Below an opaque surface the value has no meaning. An opaque lane beside a transmissive lane
    // has zero there.
    let value = bsdf.eval_and_pdf(wo, wi).0;
    let told = if bsdf.is_transmissive() {
        !N::Mask::default()
    } else {
        bsdf.normal().dot(wi).greater_than(N::ZERO)
    };
    (
        N::Vec3::select(told, value, N::Vec3::ZERO),
        bsdf.eval_diffuse(wo, wi),
    )
}

/// Protects: layers shaded in `f32` agree with `f64` up to rounding.
#[test]
fn single_precision_agrees() {
    let value = |bits: u32| f64::from(f32::from_bits(bits));
    let (mut worst, mut some) = (0.0_f64, 0);
    for index in 0..layers().len() {
        for first in 0..400 {
            let (single, double) = (outcome::<f32>(index, first), outcome::<f64>(index, first));
            // Only results for given directions are compared. A sampled direction may fall on
            // either side of a choice between lobes.
            for k in [0, 2, 3, 4] {
                let (a, b) = (value(single[0][k]), value(double[0][k]));
                worst = worst.max((a - b).abs() / (1e-3 + a.abs().max(b.abs())));
                some += usize::from(b > 0.0);
            }
        }
    }
    assert!(worst < 5e-3, "{worst}");
    assert!(some > 5_000, "{some}");
}

/// Layers whose results in a lane differ from the results of the same case alone.
fn dependent() -> Vec<&'static str> {
    const CASES: usize = 960;
    const N: usize = 4;
    let differs = |index: usize| {
        let alone: Vec<Vec<u32>> = (0..CASES)
            .map(|first| outcome::<f32>(index, first).remove(0))
            .collect();
        (0..CASES)
            .step_by(N)
            .any(|first| outcome::<Lanes<N>>(index, first) != alone[first..first + N])
    };
    layers()
        .iter()
        .enumerate()
        .filter(|&(index, _)| differs(index))
        .map(|(_, (name, _))| *name)
        .collect()
}

/// Protects: four lanes give the bits of one for every layer, whatever the neighbouring lanes hold:
/// smooth or rough, viewed from outside or inside, anisotropic, filmed and coated in any strength.
#[test]
fn lanes_have_the_bits_of_one() {
    assert_eq!(dependent(), [""; 0]);
}
