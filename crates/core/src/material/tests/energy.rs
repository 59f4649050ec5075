//! White furnaces of whole surfaces over the product of their parameters: no energy is gained.

use super::super::fresnel::fresnel_dielectric_in_air;
use super::super::multiple_scattering::boundary_loss;
use super::super::rough_boundary_tables::UNIT;
use super::super::*;
use super::{NORMAL, WHITE, direction_at, furnace};
use glam::DVec3;

fn body(base: DVec3, share: f64, roughness: f64) -> MetallicRoughness<f64> {
    let glass = (share > 0.0).then_some(Glass {
        share,
        ior: 1.5,
        reflected: WHITE,
        transmitted: base,
    });
    MetallicRoughness {
        base,
        metallic: 0.0,
        roughness,
        dielectric: 0.04,
        grazing: 1.0,
        glass,
    }
}

/// Protects: multiple scattering among microfacets of any reflectance is the sum of its bounces: of
/// light that single scattering lost, each next bounce reflects the mean reflectance, of which the
/// loss-free share leaves and the rest bounces again.
#[test]
fn interreflection_is_the_sum_of_its_bounces() {
    for (f0, f90, lost) in [
        (0.04_f64, 1.0_f64, 0.3_f64),
        (0.5, 1.0, 0.1),
        (0.9, 1.0, 0.45),
        (0.02, 0.5, 0.2),
        (1.0, 1.0, 0.4),
    ] {
        // Cosine-weighted mean of Schlick's formula over the hemisphere.
        let cell = |k: u32| (f64::from(k) + 0.5) / 1e4;
        let mean = (0..10_000)
            .map(|k| (f0 + (f90 - f0) * (1.0 - cell(k)).powi(5)) * 2.0 * cell(k) / 1e4)
            .sum::<f64>();
        let sum = (1..200)
            .map(|k| mean.powi(k + 1) * lost.powi(k - 1) * (1.0 - lost))
            .sum::<f64>();
        let found = super::super::energy::multiple_scattering_factor(f0, f90, lost);
        assert!(
            (found - sum).abs() < 1e-6,
            "{f0} to {f90}, {lost} lost: {found}, not {sum}"
        );
    }
}

/// Protects: what a boundary under a film returns by multiple scattering is at most what single
/// scattering loses, at each tint between the least and the greatest of the film, up to the rounding
/// of the tables.
#[test]
fn losses_over_tints_are_least_at_an_end() {
    for (eta, roughness) in [0.4_f64, 0.7, 0.95, 1.05, 1.5, 2.5]
        .into_iter()
        .flat_map(|eta| [0.1_f64, 0.3, 0.6, 1.0].map(|roughness| (eta, roughness)))
    {
        for cosine in [None, Some(0.05_f64), Some(0.3), Some(0.7), Some(1.0)] {
            let loss = |tints: [f64; 2]| {
                boundary_loss([eta, roughness], tints.map(DVec3::splat), cosine).x
            };
            for ends in [[0.0, 1.0], [0.0, 2.0], [0.5, 1.5], [1.0, 2.0], [0.9, 1.2]] {
                let found = loss(ends);
                for step in 0..=20 {
                    let tint = ends[0] + (ends[1] - ends[0]) * f64::from(step) / 20.0;
                    let lost = loss([tint; 2]);
                    assert!(
                        found <= lost + 1.0 / UNIT,
                        "η {eta}, roughness {roughness}, cosine {cosine:?}, tints {ends:?}: {found}, at {tint} {lost}"
                    );
                }
            }
        }
    }
}

/// Protects: a smooth coat by Fresnel's equations passes what they do not reflect, at the lesser
/// cosine of view and light.
#[test]
fn exact_coats_pass_what_fresnels_equations_leave() {
    for (a, b) in [(1.0, 0.6), (0.5, 0.5), (0.9, 0.2), (0.1, 0.8)] {
        let (wo, wi) = (direction_at(NORMAL, a, 0.4), direction_at(NORMAL, b, 2.0));
        let bare = LayeredSurface {
            rule: FresnelRule::Exact,
            ..LayeredSurface::from_base(
                MetallicRoughness {
                    dielectric: 0.0,
                    ..body(WHITE * 0.5, 0.0, 0.7)
                },
                1.0,
            )
        };
        let coated = LayeredSurface {
            coat: coat(0.0),
            ..bare
        };
        let [bare, coated] =
            [bare, coated].map(|model| model.transport_bsdf(NORMAL, wo, true).eval(wo, wi).x);
        let expected = 1.0 - fresnel_dielectric_in_air(f64::min(a, b), 1.5);
        assert!(
            (coated / bare - expected).abs() < 1e-9,
            "{a}, {b}: {}, not {expected}",
            coated / bare
        );
    }
}

/// Protects: a partly transmissive body returns at most the light that hits its boundary from
/// inside, where all is reflected beyond the critical angle, so that deep paths gain no energy;
/// smooth white bodies return all of it, in closed form.
#[test]
fn bodies_keep_their_light_within() {
    for (base, share) in [
        (1.0, 0.25),
        (1.0, 0.5),
        (1.0, 1.0),
        (0.8, 0.5),
        (0.8, 1.0),
        (0.2, 0.75),
    ] {
        for roughness in [0.0, 0.2, 0.6, 1.0] {
            for height in [1.0, 0.76, 0.73, 0.5, 0.1] {
                let wo = direction_at(NORMAL, height, 0.4);
                let own_base = body(WHITE * base, share, roughness);
                let layered = LayeredSurface::from_base(own_base, 1.5);
                let both = [
                    furnace(&own_base.transport_bsdf(NORMAL, wo, false, true), wo),
                    furnace(&layered.transport_bsdf(NORMAL, wo, false), wo),
                ];
                for (scattered, deviation) in both {
                    let name = format!(
                        "{base}, {share} of it clear, roughness {roughness} at {height}: {scattered} ± {deviation}"
                    );
                    assert!(scattered.x <= 1.0 + 3.0 * deviation + 1e-9, "{name}");
                    // Glass keeps the Fresnel reflectance and transmits the rest; paint reflects
                    // diffusely.
                    let beyond = 1.0 - 2.25 * (1.0 - height * height);
                    let kept =
                        fresnel_dielectric(height, (beyond > 0.0).then(|| f64::sqrt(beyond)), 1.5);
                    let expected = share * (kept + (1.0 - kept) * base) + (1.0 - share) * base;
                    assert!(
                        roughness > 0.0 || (scattered.x - expected).abs() <= 4.0 * deviation + 1e-9,
                        "{name}, not {expected}"
                    );
                }
            }
        }
    }
}

/// A variant of a surface beside its roughness.
type Variant = (&'static str, fn(LayeredSurface<f64>) -> LayeredSurface<f64>);

fn anisotropy_of(strength: f64) -> Option<Anisotropy<f64>> {
    Some(Anisotropy {
        strength,
        frame: ShadingFrame::from_tangent(NORMAL, DVec3::new(0.3, 0.9, -0.2), false),
    })
}

fn coat(roughness: f64) -> Option<Coat<f64>> {
    Some(Coat {
        weight: 1.0,
        roughness,
        normal: NORMAL,
    })
}

fn film(ior: f64, thickness: f64) -> Option<ThinFilm<f64>> {
    Some(ThinFilm {
        share: 1.0,
        ior,
        thickness,
    })
}

const VARIANTS: [Variant; 15] = [
    ("bare", |model| model),
    ("smooth coat", |model| LayeredSurface {
        coat: coat(0.0),
        ..model
    }),
    ("rough coat", |model| LayeredSurface {
        coat: coat(0.4),
        ..model
    }),
    ("velvet", |model| LayeredSurface {
        sheen: Some(Sheen {
            colour: WHITE,
            roughness: 0.5,
        }),
        ..model
    }),
    ("silk", |model| LayeredSurface {
        sheen: Some(Sheen {
            colour: WHITE,
            roughness: 0.1,
        }),
        ..model
    }),
    ("oil", |model| LayeredSurface {
        film: film(1.8, 420.0),
        ..model
    }),
    ("soap", |model| LayeredSurface {
        film: film(1.33, 900.0),
        ..model
    }),
    ("combed", |model| LayeredSurface {
        anisotropy: anisotropy_of(0.8),
        ..model
    }),
    ("leaf", |model| LayeredSurface {
        diffuse_transmission: Some(DiffuseTransmissionLayer {
            share: 0.5,
            colour: WHITE,
        }),
        ..model
    }),
    ("exact", |model| LayeredSurface {
        rule: FresnelRule::Exact,
        ..model
    }),
    ("Schlick", |model| LayeredSurface {
        rule: FresnelRule::Schlick,
        ..model
    }),
    ("gold reflection", |model| LayeredSurface {
        specular_colour: DVec3::new(9.0, 5.0, 1.0),
        ..model
    }),
    ("half a reflection", |model| LayeredSurface {
        specular: 0.5,
        ..model
    }),
    ("oil under a coat", |model| LayeredSurface {
        coat: coat(0.2),
        film: film(1.5, 300.0),
        ..model
    }),
    ("combed leaf under a coat", |model| LayeredSurface {
        coat: coat(0.2),
        anisotropy: anisotropy_of(1.0),
        diffuse_transmission: Some(DiffuseTransmissionLayer {
            share: 0.5,
            colour: WHITE,
        }),
        ..model
    }),
];

/// Every kind of white surface: variants by roughness, metal share, clear share of the rest, and
/// thin or not.
fn surfaces() -> impl Iterator<Item = (String, LayeredSurface<f64>)> {
    VARIANTS.into_iter().flat_map(|(name, variant)| {
        [0.0, 0.05, 0.2, 0.5, 1.0].into_iter().flat_map(move |roughness| {
            [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)].into_iter().flat_map(move |(metallic, clear)| {
                [false, true].into_iter().filter(move |&thin| !thin || clear > 0.0).map(move |thin| {
                    let base = MetallicRoughness { metallic, ..body(WHITE, clear, roughness) };
                    let label = format!("{name}, roughness {roughness}, metal {metallic}, clear {clear}, thin {thin}");
                    (label, variant(LayeredSurface { thin, ..LayeredSurface::from_base(base, 1.5) }))
                })
            })
        })
    })
}

/// Albedo of a surface in its strongest channel, with its standard deviation, from a few samples.
/// If this albedo exceeds the bound, it is computed from more samples.
fn sent(model: &LayeredSurface<f64>, height: f64, outside: bool) -> (f64, f64) {
    let wo = direction_at(NORMAL, height, if height > 0.3 { 0.4 } else { 2.0 });
    let bsdf = model.transport_bsdf(NORMAL, wo, outside);
    let (mean, deviation) = few(&bsdf, wo, 500);
    if mean <= 1.005 + 3.0 * deviation {
        (mean, deviation)
    } else {
        few(&bsdf, wo, 60_000)
    }
}

fn few(bsdf: &LayeredBsdf<f64>, wo: DVec3, count: u64) -> (f64, f64) {
    let (mean, deviation) = super::furnace_of(bsdf, wo, count);
    (mean.max_element(), deviation)
}

/// Protects: no surface gains energy, for the product of its parameters, from both sides and at
/// every angle; glTF's own formula, a rung of its own, does.
#[test]
fn no_surface_makes_light() {
    let mut worst = (0.0, String::new());
    for (name, model) in surfaces() {
        for height in [1.0, 0.7, 0.4, 0.2, 0.08, 0.02] {
            for outside in [true, false] {
                if !outside && (model.base.glass.is_none() || model.thin) {
                    continue;
                }
                let (scattered, deviation) = sent(&model, height, outside);
                if scattered - 3.0 * deviation > worst.0 {
                    worst = (
                        scattered - 3.0 * deviation,
                        format!("{name}, outside {outside} at {height}: {scattered} ± {deviation}"),
                    );
                }
            }
        }
    }
    assert!(worst.0 <= 1.005, "{}", worst.1);
    let literal = LayeredSurface {
        rule: FresnelRule::Model,
        ..LayeredSurface::from_base(body(WHITE, 0.0, 0.0), 1.5)
    };
    assert!(
        sent(&literal, 0.02, true).0 > 1.5,
        "the rung that makes light is no other than the default"
    );
}

/// A stream of numbers in [0, 1).
struct SurfaceRng(u64);

impl SurfaceRng {
    fn next(&mut self) -> f64 {
        self.0 += 1;
        super::numbers(self.0)[0]
    }

    fn chance(&mut self, share: f64) -> bool {
        self.next() < share
    }

    /// A number from 0 to 1, often one of the ends.
    fn unit(&mut self) -> f64 {
        match self.next() {
            x if x < 0.15 => 0.0,
            x if x < 0.4 => 1.0,
            _ => self.next(),
        }
    }

    fn colour(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit())
    }

    /// An index: of low index or of glass, sometimes next to one or very large.
    fn index(&mut self) -> f64 {
        match self.next() {
            x if x < 0.4 => 1.02 + 0.4 * self.next(),
            x if x < 0.5 => 1.0 + 0.02 * self.next(),
            x if x < 0.6 => 1e3_f64.powf(self.next()),
            _ => 1.3 + 1.5 * self.next(),
        }
    }
}

/// A surface with all fields drawn together, and the side of its boundary that is viewed.
fn random_surface(rng: &mut SurfaceRng) -> (LayeredSurface<f64>, bool) {
    let (ior, thin, clear) = (rng.index(), rng.chance(0.25), rng.chance(0.7));
    let roughness = if rng.chance(0.5) {
        0.05 + 0.4 * rng.next()
    } else {
        rng.unit()
    };
    let glass = clear.then(|| Glass {
        share: rng.unit(),
        ior,
        reflected: WHITE,
        transmitted: if rng.chance(0.7) { WHITE } else { rng.colour() },
    });
    let base = MetallicRoughness {
        metallic: if rng.chance(0.6) { 0.0 } else { rng.unit() },
        dielectric: ((ior - 1.0) / (ior + 1.0)).powi(2),
        glass,
        ..body(
            if rng.chance(0.7) { WHITE } else { rng.colour() },
            0.0,
            roughness,
        )
    };
    let specular_colour = match rng.next() {
        x if x < 0.6 => WHITE,
        x if x < 0.8 => rng.colour() * 2.0,
        _ => rng.colour() * 40.0,
    };
    let rules = [
        FresnelRule::Schlick,
        FresnelRule::Conserving,
        FresnelRule::Exact,
    ];
    let model = LayeredSurface {
        thin,
        specular: if rng.chance(0.6) { 1.0 } else { rng.unit() },
        specular_colour,
        conductor: rng
            .chance(0.2)
            .then(|| [rng.colour() * 3.0 + 0.05, rng.colour() * 5.0]),
        diffuse_transmission: rng.chance(0.2).then(|| DiffuseTransmissionLayer {
            share: rng.unit(),
            colour: WHITE,
        }),
        anisotropy: rng
            .chance(0.25)
            .then(|| anisotropy_of(rng.unit()))
            .flatten(),
        film: rng.chance(0.6).then(|| ThinFilm {
            share: rng.unit(),
            ior: if rng.chance(0.1) {
                1e3_f64.powf(rng.next())
            } else {
                1.0 + 4.0 * rng.next().powi(2)
            },
            thickness: 1500.0 * rng.next(),
        }),
        sheen: rng.chance(0.2).then(|| Sheen {
            colour: rng.colour(),
            roughness: rng.unit(),
        }),
        coat: rng.chance(0.25).then(|| Coat {
            weight: rng.unit(),
            roughness: rng.unit(),
            normal: NORMAL,
        }),
        rule: rules[(3.0 * rng.next()) as usize],
        ..LayeredSurface::from_base(base, ior)
    };
    (model, thin || !clear || rng.chance(0.5))
}

/// Protects: no surface gains energy, whatever fields are drawn together, from both sides and at
/// every angle. Single-scattering compensation once divided by a mean that a film of high index
/// over rough glass of low index drove to zero: up to 1e15. `NETS=all` draws fifty times as many.
#[test]
fn random_surfaces_make_no_light() {
    let all = std::env::var("NETS").is_ok_and(|nets| nets == "all");
    let mut wrong = Vec::new();
    let count = if all { 40_000 } else { 800 };
    for index in 0..count {
        let rng = &mut SurfaceRng(index * 1000);
        let (model, outside) = random_surface(rng);
        let height = if rng.chance(0.3) {
            0.02 + 0.2 * rng.next()
        } else {
            1.0 - rng.next()
        };
        let (scattered, deviation) = sent(&model, height.max(0.02), outside);
        let least = scattered - 3.5 * deviation;
        if least.is_nan() || least > 1.01 {
            wrong.push(format!(
                "{index}: {scattered} ± {deviation} at {height}, outside {outside}: {model:?}"
            ));
        }
    }
    assert!(
        wrong.is_empty(),
        "{} of {count}:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}

/// Protects: closed forms of the albedo. White dielectrics, metals and mixtures of both reflect all
/// incident light, rough or smooth, at every angle. A grey base absorbs its share of the light
/// below the microfacets.
#[test]
fn white_surfaces_send_back_all() {
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in [0.0, 0.1, 0.3, 0.6, 1.0] {
            for height in [1.0, 0.6, 0.25, 0.1, 0.03] {
                let wo = direction_at(NORMAL, height, 0.4);
                let own = |base: f64| MetallicRoughness {
                    metallic,
                    ..body(WHITE * base, 0.0, roughness)
                };
                let (all, deviation) =
                    furnace(&own(1.0).transport_bsdf(NORMAL, wo, true, true), wo);
                let name = format!(
                    "metal {metallic}, roughness {roughness} at {height}: {all} ± {deviation}"
                );
                assert!((all.x - 1.0).abs() <= 0.003 + 3.0 * deviation, "{name}");
                if metallic == 0.0 {
                    let (some, spread) =
                        furnace(&own(0.5).transport_bsdf(NORMAL, wo, true, true), wo);
                    let (none, rest) =
                        furnace(&own(0.0).transport_bsdf(NORMAL, wo, true, true), wo);
                    let off = (some.x - 0.5 * (1.0 + none.x)).abs();
                    assert!(
                        off <= 0.003 + 3.0 * (spread + rest),
                        "{name}: grey {some}, black {none}"
                    );
                }
            }
        }
    }
}

/// Protects: closed forms of anisotropic surfaces. White metal of any roughness and strength
/// reflects all incident light, along the tangent, across it and between, and so do white
/// dielectrics and mixtures.
#[test]
fn white_anisotropic_surfaces_reflect_all() {
    let mut worst = (0.0_f64, String::new());
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in [0.0, 0.1, 0.3, 0.6, 0.9] {
            for strength in [0.1, 0.35, 0.7, 1.0] {
                for height in [1.0, 0.6, 0.25, 0.08] {
                    for turn in [0.0, 0.15, 0.25] {
                        let base = MetallicRoughness {
                            metallic,
                            ..body(WHITE, 0.0, roughness)
                        };
                        let model = LayeredSurface {
                            anisotropy: anisotropy_of(strength),
                            ..LayeredSurface::from_base(base, 1.5)
                        };
                        let frame = model.anisotropy.expect("it is combed").frame;
                        let across = f64::sqrt(1.0 - height * height);
                        let [x, y] = [
                            libm::cos(core::f64::consts::TAU * turn),
                            libm::sin(core::f64::consts::TAU * turn),
                        ];
                        let wo = frame.to_world(DVec3::new(across * x, across * y, height));
                        let (scattered, deviation) =
                            super::furnace_of(&model.transport_bsdf(NORMAL, wo, true), wo, 3_000);
                        let off = (scattered.x - 1.0).abs() - 3.5 * deviation;
                        if off > worst.0 {
                            let name = format!(
                                "metal {metallic}, roughness {roughness}, strength {strength} at {height}, {turn}"
                            );
                            worst = (off, format!("{name}: {scattered} ± {deviation}"));
                        }
                    }
                }
            }
        }
    }
    assert!(worst.0 <= 0.005, "{}", worst.1);
}

/// Protects: surfaces are reciprocal, rough metal with multiple scattering too.
#[test]
fn surfaces_are_reciprocal() {
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in [0.1, 0.3, 0.8, 1.0] {
            let model = MetallicRoughness {
                metallic,
                ..body(DVec3::new(0.9, 0.6, 0.2), 0.0, roughness)
            };
            for i in 0..300 {
                let ([a, b, c], [d, ..]) = (super::numbers(2 * i), super::numbers(2 * i + 1));
                let wo = direction_at(NORMAL, 0.01 + 0.99 * a, core::f64::consts::TAU * b);
                let wi = direction_at(NORMAL, 0.01 + 0.99 * c, core::f64::consts::TAU * d);
                let there = model.transport_bsdf(NORMAL, wo, true, true).eval(wo, wi);
                let back = model.transport_bsdf(NORMAL, wi, true, true).eval(wi, wo);
                assert!(
                    (there - back).length() <= 1e-9 * there.length(),
                    "{metallic} {roughness}: {there} and {back}"
                );
            }
        }
    }
}
