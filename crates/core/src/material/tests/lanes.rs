//! Shading in lanes against shading of a single path, to the bit, whatever the neighbouring lanes
//! hold.

use super::super::albedo::Albedo;
use super::super::energy::EnergyComplement;
use super::super::*;
use super::numbers;
use crate::number::{Lanes, Mask, Number, Vector3};
use glam::DVec3;

/// Kinds of lobes; every combination is tried.
const KINDS: u32 = 4;
const CASES: usize = 4096;

/// Inputs of a lane. Every number is an `f32`; some are extremes of their range.
#[derive(Clone, Copy, Debug)]
struct Case {
    normal: DVec3,
    wo: DVec3,
    wi: DVec3,
    colours: [DVec3; 4],
    metallic: f64,
    roughness: f64,
    dielectric: f64,
    share: f64,
    ior: f64,
    outside: bool,
    drawn: [f64; 3],
}

/// A direction by its cosine to `n` and its azimuth in turns, rounded to `f32`.
fn direction_at(n: DVec3, height: f64, turn: f64) -> DVec3 {
    let across = (1.0 - height * height).max(0.0).sqrt();
    let turn = core::f64::consts::TAU * turn;
    let v = ShadingFrame::<f64>::from_normal(n).to_world(DVec3::new(
        across * libm::cos(turn),
        across * libm::sin(turn),
        height,
    ));
    v.as_vec3().as_dvec3()
}

impl Case {
    fn of(index: usize) -> Self {
        let mut position = 16 * index as u64;
        let mut next = || {
            position += 1;
            numbers(position).map(|x| f64::from(x as f32))
        };
        let [a, b, kind] = next();
        let normal = direction_at(DVec3::Z, 2.0 * a - 1.0, b);
        // Head-on, grazing, exactly along the surface, below the surface, and any height above it.
        let height = |[how, x, _]: [f64; 3]| match (how * 8.0) as u32 {
            0 => 1.0,
            1 => 1e-4 * x,
            2 => 0.0,
            3 => -x,
            _ => x,
        };
        let ([turn_o, turn_i, _], [how_o, how_i, how_l]) = (next(), [next(), next(), next()]);
        let wo = direction_at(normal, height(how_o), turn_o);
        let wi = match (how_l[0] * 12.0) as u32 {
            0 => wo,
            1 => -wo,
            _ => direction_at(normal, height(how_i), turn_i),
        };
        let end = |[how, x, _]: [f64; 3]| [0.0, 1.0, x, x, x, x][(how * 6.0) as usize];
        let colours = [0; 4].map(|_| {
            let [r, g, b] = [end(next()), end(next()), end(next())];
            if kind < 0.1 {
                DVec3::ZERO
            } else {
                DVec3::new(r, g, b)
            }
        });
        let ior = f64::from(1.0 + next()[0] as f32);
        let drawn =
            [0; 3].map(|_| [0.0, next()[0], next()[0], next()[0]][(next()[1] * 4.0) as usize]);
        let [metallic, roughness, share] = [0; 3].map(|_| end(next()));
        Self {
            normal,
            wo,
            wi,
            colours,
            metallic,
            roughness,
            dielectric: 0.04,
            share,
            ior,
            outside: next()[0] < 0.5,
            drawn,
        }
    }
}

/// Results of functions, to be compared lane by lane.
struct Outcome<N: Number> {
    numbers: Vec<N>,
    vectors: Vec<N::Vec3>,
    masks: Vec<N::Mask>,
}

impl<N: Number> Outcome<N> {
    /// Bits of the results, lane after lane; every NaN has the same bits.
    fn lanes(&self) -> Vec<Vec<u32>> {
        let bits = |x: f64| {
            if x.is_nan() {
                u32::MAX
            } else {
                (x as f32).to_bits()
            }
        };
        let lane = |lane: usize| {
            let vectors = self
                .vectors
                .iter()
                .flat_map(|v| v.lane(lane).to_array().map(bits));
            let masks = self.masks.iter().map(|mask| mask.lane(lane).into());
            self.numbers
                .iter()
                .map(|x| bits(x.lane(lane)))
                .chain(vectors)
                .chain(masks)
                .collect()
        };
        (0..N::LANES).map(lane).collect()
    }

    // Each group of results is computed in its own function: a compiler takes many minutes over all
    // of them in a single function.

    #[inline(never)]
    fn values(&mut self, bsdf: &Bsdf<N>, wo: N::Vec3, wi: N::Vec3) {
        self.vectors.push(bsdf.eval(wo, wi));
    }

    #[inline(never)]
    fn values_of_both_sides(&mut self, bsdf: &Bsdf<N>, wo: N::Vec3, wi: N::Vec3) {
        self.vectors.push(bsdf.eval_and_pdf(wo, wi).0);
    }

    #[inline(never)]
    fn rough(
        &mut self,
        model: &MetallicRoughness<N>,
        normal: N::Vec3,
        [wo, wi]: [N::Vec3; 2],
        drawn: [N; 3],
    ) {
        let bsdf = model.rough_bsdf(normal, wo, true);
        let (value, density) = bsdf.eval_and_pdf(wo, wi);
        let sampled = bsdf.sample(&ShadingFrame::from_normal(normal), wo, drawn);
        self.numbers.extend([density, sampled.density]);
        self.vectors.extend([
            value,
            bsdf.eval_diffuse(wo, wi),
            sampled.direction,
            sampled.weight,
        ]);
        self.masks.push(model.is_rough());
    }

    #[inline(never)]
    fn densities(&mut self, bsdf: &Bsdf<N>, wo: N::Vec3, wi: N::Vec3) {
        self.numbers.push(bsdf.pdf(wo, wi));
        self.vectors.push(bsdf.eval_diffuse(wo, wi));
    }

    #[inline(never)]
    fn samples(&mut self, bsdf: &Bsdf<N>, frame: &ShadingFrame<N>, wo: N::Vec3, drawn: [N; 3]) {
        let sampled = bsdf.sample(frame, wo, drawn);
        self.numbers.push(sampled.density);
        self.vectors.extend([sampled.direction, sampled.weight]);
        self.masks.extend([sampled.is_valid, sampled.delta]);
    }

    #[inline(never)]
    fn frames(&mut self, normal: N::Vec3, wi: N::Vec3, outside: N::Mask) -> ShadingFrame<N> {
        let (frame, along) = (
            ShadingFrame::from_normal(normal),
            ShadingFrame::<N>::from_tangent(normal, wi, outside),
        );
        self.vectors.extend([
            frame.tangent,
            frame.bitangent,
            along.tangent,
            along.bitangent,
        ]);
        frame
    }

    #[inline(never)]
    fn reflectances(&mut self, model: &MetallicRoughness<N>, colour: N::Vec3, cosine: N) {
        self.numbers
            .extend([model.glass_share(), schlick_weight(cosine)]);
        self.vectors.extend([
            model.albedo(),
            model.f0(),
            model.mirror_lobe().reflectance(cosine),
            schlick(colour, cosine),
        ]);
        self.vectors.push(environment_reflectance(
            colour,
            model.roughness,
            cosine.max(N::ZERO),
        ));
    }
}

/// Bits of the results of every function, lane after lane. The first result is the mask of the
/// lanes in which the set's lobes reflect light.
fn outcome<N: Number>(set: u32, first: usize) -> Vec<Vec<u32>> {
    let at = |lane: usize| Case::of((first + lane) % CASES);
    let number = |of: fn(&Case) -> f64| N::from_lanes(|lane| of(&at(lane)));
    let vector = |of: fn(&Case) -> DVec3| <N::Vec3 as Vector3<N>>::from_lanes(|lane| of(&at(lane)));
    let (normal, wo, wi) = (vector(|c| c.normal), vector(|c| c.wo), vector(|c| c.wi));
    let [first_colour, second, third, fourth] = [
        vector(|c| c.colours[0]),
        vector(|c| c.colours[1]),
        vector(|c| c.colours[2]),
        vector(|c| c.colours[3]),
    ];
    let (roughness, share) = (number(|c| c.roughness), number(|c| c.share));
    let drawn = [
        number(|c| c.drawn[0]),
        number(|c| c.drawn[1]),
        number(|c| c.drawn[2]),
    ];
    let mut outside = N::Mask::default();
    (0..N::LANES)
        .filter(|&lane| at(lane).outside)
        .for_each(|lane| outside.set_lane(lane));
    let glass = Glass {
        share: number(|c| c.drawn[2]),
        ior: N::f64_from_lanes(|lane| at(lane).ior),
        reflected: third,
        transmitted: fourth,
    };
    let dielectric = Lobe::Dielectric(glass.dielectric_lobe(outside, share, None));
    let layer = [
        number(|c| c.dielectric * c.drawn[0]),
        number(|c| c.drawn[1]),
        number(|c| c.drawn[2]),
    ];
    let energy_complement = EnergyComplement::new(layer, roughness)
        .with_view_cosine(normal.dot(wo), Albedo::mean(roughness));
    let kinds = [
        Lobe::Diffuse {
            albedo: first_colour,
            interreflected: second,
            energy_complement,
        },
        Lobe::Rough {
            f0: second,
            f90: Vector3::ONE,
            roughness,
        },
        Lobe::Mirror {
            f0: third,
            f90: fourth,
        },
        dielectric,
    ];
    let chosen = (0..KINDS)
        .filter(|kind| set >> kind & 1 == 1)
        .map(|kind| kinds[kind as usize]);
    let list = chosen.fold(Bsdf::new(normal), Bsdf::with_lobe);
    let model = MetallicRoughness {
        base: first_colour,
        metallic: number(|c| c.metallic),
        roughness,
        dielectric: number(|c| c.dielectric * c.drawn[1]),
        grazing: number(|c| c.drawn[1]),
        glass: (set & 1 == 1).then_some(glass),
    };
    let mut found = Outcome {
        numbers: Vec::new(),
        vectors: Vec::new(),
        masks: Vec::new(),
    };
    let frame = found.frames(normal, wi, outside);
    found.reflectances(&model, second, normal.dot(wo));
    let mut lists = vec![list, model.local_bsdf(normal, wo)];
    if set < 2 {
        // Functions that depend on the set only by the presence of glass.
        let further = Bsdf::new(normal)
            .with_lobe(Lobe::Lambert(Lambert {
                albedo: first_colour,
            }))
            .with_lobe(Lobe::Rough {
                f0: second,
                f90: third,
                roughness,
            })
            .with_lobe(Lobe::Dielectric(glass.dielectric_lobe(
                outside,
                share,
                Some(roughness),
            )));
        lists.extend([further, model.transport_bsdf(normal, wo, outside, true)]);
        found.values_of_both_sides(&further, wo, wi);
        found.rough(&model, normal, [wo, wi], drawn);
        let curved = NormalMap::<N> {
            normal,
            along: wi,
            mirrored: outside,
            code: second,
            geometric: wo,
            outside,
            direction: -wo,
        };
        found.vectors.push(curved.perturbed_normal());
    }
    for bsdf in lists {
        found.densities(&bsdf, wo, wi);
        found.values(&bsdf, wo, wi);
        found.samples(&bsdf, &frame, wo, drawn);
    }
    found.lanes()
}

/// Protects: four lanes give the bits of one, in every function of shading and for all combinations
/// of lobes, including directions that are grazing, below the surface or opposite, roughness 0 and
/// 1, and colours without one channel or without any.
#[test]
fn lanes_have_the_bits_of_one() {
    const N: usize = 4;
    for set in 0..1 << KINDS {
        for first in (0..CASES).step_by(N) {
            for (lane, found) in outcome::<Lanes<N>>(set, first).into_iter().enumerate() {
                let alone = outcome::<f32>(set, first + lane).remove(0);
                assert_eq!(
                    found,
                    alone,
                    "lobes {set:04b}, lane {lane}: {:?}",
                    Case::of(first + lane)
                );
            }
        }
    }
}

/// Protects: a rough opaque surface has the same bits by its two fixed lobes as by the list of
/// lobes that it needs.
#[test]
fn rough_surfaces_are_what_they_are_by_all_lobes() {
    let mut rough = 0;
    for case in (0..CASES).map(Case::of) {
        let number = |x: f64| x as f32;
        let [normal, wo, wi] = [case.normal, case.wo, case.wi].map(|v| v.as_vec3());
        let (base, metallic, roughness) = (
            case.colours[0].as_vec3(),
            number(case.metallic),
            number(case.roughness),
        );
        let model = MetallicRoughness {
            base,
            metallic,
            roughness,
            dielectric: number(case.dielectric * case.drawn[1]),
            grazing: number(case.drawn[1]),
            glass: None,
        };
        if !model.is_rough() {
            continue;
        }
        rough += 1;
        for compensated in [false, true] {
            let (two, all) = (
                model.rough_bsdf(normal, wo, compensated),
                model.transport_bsdf(normal, wo, case.outside, compensated),
            );
            let bits = |v: glam::Vec3| {
                v.to_array().map(|x| {
                    if x.is_nan() {
                        u32::MAX
                    } else {
                        (x + 0.0).to_bits()
                    }
                })
            };
            let told = |(value, density): (glam::Vec3, f32)| {
                (bits(value), bits(glam::Vec3::splat(density)))
            };
            assert_eq!(
                told(two.eval_and_pdf(wo, wi)),
                told(all.eval_and_pdf(wo, wi)),
                "{case:?}"
            );
            assert_eq!(
                bits(two.eval_diffuse(wo, wi)),
                bits(all.eval_diffuse(wo, wi)),
                "{case:?}"
            );
            let (frame, drawn) = (ShadingFrame::from_normal(normal), case.drawn.map(number));
            let [a, b] = [two.sample(&frame, wo, drawn), all.sample(&frame, wo, drawn)];
            assert_eq!(
                (a.is_valid, a.delta, bits(a.direction), bits(a.weight)),
                (b.is_valid, b.delta, bits(b.direction), bits(b.weight))
            );
        }
    }
    assert!(rough > CASES / 2, "{rough}");
}

/// Protects: glass does not count as a rough opaque surface.
#[test]
fn glass_is_not_rough() {
    use glam::DVec3;
    let glass = Glass {
        share: 1.0,
        ior: 1.5,
        reflected: DVec3::ONE,
        transmitted: DVec3::ONE,
    };
    let model = |glass| MetallicRoughness::<f64> {
        base: DVec3::ONE,
        metallic: 0.0,
        roughness: 0.5,
        dielectric: 0.04,
        grazing: 1.0,
        glass,
    };
    assert!(model(None).is_rough() && !model(Some(glass)).is_rough());
}

/// Protects: the cases above cover every kind they claim; many reflect light, and some reflect
/// none.
#[test]
fn cases_meet_what_may_differ() {
    let all: Vec<Case> = (0..CASES).map(Case::of).collect();
    let count = |of: &dyn Fn(&Case) -> bool| all.iter().filter(|case| of(case)).count();
    for (name, found) in [
        ("below the surface", count(&|c| c.normal.dot(c.wo) < -0.01)),
        (
            "grazing",
            count(&|c| (1e-6..1e-3).contains(&c.normal.dot(c.wo))),
        ),
        ("opposite", count(&|c| c.wi == -c.wo)),
        ("back where it came from", count(&|c| c.wi == c.wo)),
        ("a mirror", count(&|c| c.roughness == 0.0)),
        ("matte", count(&|c| c.roughness == 1.0)),
        ("black", count(&|c| c.colours == [DVec3::ZERO; 4])),
        ("outside", count(&|c| c.outside)),
        ("inside", count(&|c| !c.outside)),
    ] {
        assert!(found > CASES / 100, "{name}: {found} cases");
    }
    let sent = |set| {
        (0..CASES)
            .filter(|&i| outcome::<f32>(set, i)[0].iter().rev().nth(3) == Some(&1))
            .count()
    };
    assert!(
        (CASES / 4..CASES).contains(&sent(0b1111)),
        "{} send light",
        sent(0b1111)
    );
}
