//! The light tree against its own probabilities and against `f64`, for lights of any number, size
//! and distance.

use core::f64::consts::PI;

use raywright_bvh::Aabb;

use super::*;
use crate::hash::splitmix64;

fn number(i: u64) -> f64 {
    (splitmix64(i) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A point in the cube from −1 to 1.
fn light_position(i: u64) -> DVec3 {
    DVec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2)) * 2.0 - 1.0
}

fn unit(i: u64) -> DVec3 {
    light_position(i).normalize_or(DVec3::Y)
}

/// A tree and the slot of each of its lights.
fn tree(bounds: impl Iterator<Item = (LightBounds, f64)>) -> (LightTree, Vec<u32>) {
    let leaf = |(i, (bounds, intensity))| LightLeaf {
        light: LightId::Emitter(i as u32),
        bounds,
        intensity,
    };
    let leaves: Vec<LightLeaf> = bounds.enumerate().map(leaf).collect();
    let mut places = vec![LightTree::NONE; leaves.len()];
    let tree = LightTree::new(leaves, |light, position| places[index(light)] = position);
    (tree, places)
}

fn index(light: LightId) -> usize {
    let LightId::Emitter(i) = light else {
        panic!("{light:?} is no emitter")
    };
    i as usize
}

/// A light that emits in all directions.
fn round(point: DVec3, size: f64) -> LightBounds {
    LightBounds::for_curved_surface(Aabb {
        min: point,
        max: point + DVec3::splat(size),
    })
}

/// Flat, round and narrow lights in turn.
fn mixed(i: u64) -> (LightBounds, f64) {
    let (point, axis) = (light_position(i) * 3.0, unit(i + 1_000_000));
    let space = Aabb {
        min: point,
        max: point + DVec3::splat(0.05 * number(i + 2_000_000)),
    };
    let bounds = match i % 3 {
        0 => LightBounds::for_flat_surface(space, axis),
        1 => LightBounds::for_curved_surface(space),
        _ => LightBounds::for_point_light(point, axis, 1.0),
    };
    (bounds, 0.1 + number(i + 3_000_000))
}

/// Samples a light for one point.
fn sample(tree: &LightTree, receiver: ReceivingPoint, u: f64) -> Option<(LightId, f64)> {
    let LightChoices {
        lights: [light],
        probabilities: [probability],
    } = tree.sample_lights(&[true], &[u], |_| receiver);
    light.map(|light| (light, probability))
}

fn receiver(i: u64) -> ReceivingPoint {
    let normal = if i.is_multiple_of(4) {
        DVec3::ZERO
    } else {
        unit(i + 5_000_000)
    };
    ReceivingPoint {
        point: light_position(i + 4_000_000) * 4.0,
        normal,
    }
}

/// Protects: [`LightTree::sample_lights`] and [`LightTree::probability`] agree on a sampled light's
/// probability to the bit, for counts around full nodes and numbers at both ends of their range.
/// Levels are few, and memory stays within the estimate. A single light is always sampled, and
/// lights at NaN positions form a tree too.
#[test]
fn both_traversals_return_the_same_bits() {
    for count in [1, 2, 3, 7, 8, 9, 63, 64, 65, 511, 513, 100_000] {
        let (tree, places) = tree((0..count).map(mixed));
        assert!(
            tree.bytes() <= LightTree::estimate_bytes(count),
            "{count}: {} bytes",
            tree.bytes()
        );
        assert!(tree.depth() <= 10, "{count}: {} deep", tree.depth());
        let mut drawn = 0;
        for i in 0..4_000 {
            let receiver = receiver(i);
            let u = [
                0.0,
                number(i + 9_000_000),
                number(i + 9_000_000),
                1.0_f64.next_down(),
            ][(i / 4 % 4) as usize];
            let Some((light, probability)) = sample(&tree, receiver, u) else {
                continue;
            };
            let said = tree.probability(places[index(light)], &receiver);
            assert_eq!(
                probability.to_bits(),
                said.to_bits(),
                "{count}: {probability} and {said}"
            );
            assert!(
                probability > 0.0 && probability <= 1.0,
                "{count}: {probability}"
            );
            drawn += 1;
        }
        assert!(
            drawn > 1_000 && (count > 1 || drawn == 4_000),
            "{count}: drew {drawn}"
        );
    }
    let (nowhere, places) = tree((0..20).map(|_| (round(DVec3::NAN, 0.0), 1.0)));
    assert!(
        nowhere.depth() <= 64
            && sample(&nowhere, receiver(0), 0.5).is_none()
            && !places.contains(&LightTree::NONE)
    );
    assert_eq!(
        (LightTree::estimate_bytes(0), LightTree::estimate_bytes(1)),
        (0, 0)
    );
    assert_eq!(
        tree(core::iter::empty())
            .0
            .probability(LightTree::NONE, &receiver(0)),
        0.0
    );
}

/// Protects: points sampled together have the light of each alone, to the bit, in any set of lanes,
/// also if some end levels before others, and if one finds no light.
#[test]
fn points_together_draw_as_each_alone() {
    const N: u64 = 8;
    for count in [0, 1, 2, 8, 9, 65, 5_000] {
        let (tree, _) = tree((0..count).map(mixed));
        let (mut found, mut nothing) = (0, 0);
        for i in 0..500 {
            let index = |lane: usize| N * i + lane as u64;
            let is_used: [bool; N as usize] =
                core::array::from_fn(|lane| !index(lane).is_multiple_of(5));
            let u = core::array::from_fn(|lane| number(index(lane) + 9_000_000));
            let together = tree.sample_lights(&is_used, &u, |lane| receiver(index(lane)));
            for lane in 0..N as usize {
                let alone = is_used[lane]
                    .then(|| sample(&tree, receiver(index(lane)), u[lane]))
                    .flatten();
                let light = together.lights[lane];
                let bits = light.map(|light| (light, together.probabilities[lane].to_bits()));
                assert_eq!(
                    bits,
                    alone.map(|(light, probability)| (light, probability.to_bits())),
                    "{count}: {}",
                    index(lane)
                );
                found += usize::from(light.is_some());
                nothing += usize::from(is_used[lane] && light.is_none());
            }
        }
        assert!(count == 0 || found > 1_000, "{count}: {found}");
        assert!(
            !(2..=100).contains(&count) || nothing > 0,
            "{count}: each finds a light"
        );
    }
}

/// Protects: where all lights can contribute, their probabilities sum to one: at any number, at one
/// position, at distances with squares or differences beyond `f32`, at intensities with shares beyond
/// it, and far from the origin.
#[test]
fn probabilities_sum_to_one_at_any_scale() {
    /// Position of a light by its number.
    type LightSpread = fn(u64) -> DVec3;
    let spreads: [(&str, LightSpread); 8] = [
        ("scattered", |i| light_position(i)),
        ("at one place", |_| DVec3::new(1.0, 2.0, 3.0)),
        ("at the origin", |_| DVec3::ZERO),
        ("10⁻⁶ m apart", |i| light_position(i) * 1e-6),
        ("10⁹ m apart", |i| light_position(i) * 1e9),
        ("pairs of 10⁻⁶ m that are 10⁹ m apart", |i| {
            light_position(i / 2) * 1e9 + light_position(i) * 1e-6
        }),
        ("10⁻³⁰ m apart", |i| light_position(i) * 1e-30),
        ("10⁻³ m apart and 10⁹ m from the origin", |i| {
            DVec3::new(1e9, -1e9, 1e9) + light_position(i) * 1e-3
        }),
    ];
    let intensities: [fn(u64) -> f64; 2] = [
        |i| 0.5 + number(i),
        |i| [1e-100, 1e-30, 1.0, 1e30, 1e300][(i % 5) as usize],
    ];
    for ((name, at), intensity) in spreads
        .iter()
        .flat_map(|spread| intensities.map(|intensity| (*spread, intensity)))
    {
        for count in [1, 2, 7, 8, 9, 65, 700] {
            let (tree, places) = tree((0..count).map(|i| (round(at(i), 0.0), intensity(i))));
            let away = [0.0, 1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e9, 1e15]
                .map(|distance| at(0) + unit(7) * distance);
            for from in away {
                let receiver = ReceivingPoint {
                    point: from,
                    normal: DVec3::ZERO,
                };
                let each = places
                    .iter()
                    .map(|&index| tree.probability(index, &receiver));
                let (sum, minimum) = each.fold((0.0, f64::INFINITY), |(sum, minimum), p| {
                    (sum + p, p.min(minimum))
                });
                assert!(
                    (sum - 1.0_f64).abs() < 1e-9,
                    "{count} {name}, from {from}: {sum}"
                );
                assert!(
                    minimum > 0.0,
                    "{count} {name}, from {from}: one is never drawn"
                );
            }
        }
    }
}

/// Protects: lights are sampled with their stated probability, by χ² up to five standard deviations
/// above its mean, failed samples included.
#[test]
fn draws_follow_the_probabilities() {
    const DRAWN: u64 = 200_000;
    for count in [2, 8, 9, 65, 400] {
        let (tree, places) = tree((0..count).map(mixed));
        for from in [receiver(1), receiver(2), receiver(4)] {
            let mut found = vec![0.0; places.len() + 1];
            for i in 0..DRAWN {
                let drawn = sample(&tree, from, number(i + 11_000_000));
                found[drawn.map_or(places.len(), |(light, _)| index(light))] += 1.0;
            }
            let mut said: Vec<f64> = places
                .iter()
                .map(|&position| tree.probability(position, &from))
                .collect();
            said.push(1.0 - said.iter().sum::<f64>());
            let (mut chi2, mut degrees, mut rare) = (0.0, 0.0, [0.0; 2]);
            for (&found, said) in found.iter().zip(said) {
                let expected = said * DRAWN as f64;
                if expected >= 10.0 {
                    chi2 += (found - expected) * (found - expected) / expected;
                    degrees += 1.0;
                } else {
                    assert!(
                        said > 0.0 || found == 0.0 || found < 1e-6 * DRAWN as f64,
                        "{count}: drew what has no probability"
                    );
                    rare = [rare[0] + found, rare[1] + expected];
                }
            }
            assert!(
                chi2 < degrees + 5.0 * f64::sqrt(2.0 * degrees) + 5.0,
                "{count} from {from:?}: χ² {chi2} of {degrees}"
            );
            let [found, expected] = rare;
            assert!(
                f64::abs(found - expected) <= 5.0 * (expected + 1.0).sqrt(),
                "{count}: {found} of the rare, not {expected}"
            );
        }
    }
}

/// Protects: every light that can contribute by `f64` can be sampled, as close to the horizon and
/// the rim of its cone as `f64` tells angles, among lights of one kind and of all, at any scale and
/// far from the origin. A light alone at its position is not sampled where it cannot contribute.
#[test]
fn what_can_light_can_be_drawn() {
    /// Angles of normals and of emission.
    const CONES: [[f64; 2]; 6] = [
        [0.0, 0.3],
        [0.0, 1e-3],
        [0.0, 0.5 * PI],
        [0.0, 2.5],
        [1.57, 1.57],
        [0.2, 0.7],
    ];
    let mut counts = [0_u32; 3];
    for (scale, origin) in [(1.0, 0.0), (1e-6, 0.0), (1e9, 0.0), (1.0, 1e6), (1e-6, 1e9)] {
        for (count, equal) in [2, 8, 20, 300]
            .into_iter()
            .flat_map(|count: u64| [(count, false), (count, true)])
        {
            // Whether `f64` resolves directions there well.
            let told = origin * 1e-12 < scale;
            let origin = DVec3::new(1.0, -0.7, 0.3) * origin;
            let light = |i: u64| {
                let [normals, emission] = CONES[if equal { 0 } else { (i % 6) as usize }];
                (
                    origin + light_position(i) * scale,
                    unit(i + count * 1000),
                    normals,
                    emission,
                )
            };
            let (tree, places) = tree((0..count).map(|i| {
                let (point, axis, normals, emission) = light(i);
                (
                    LightBounds {
                        bounding_box: Aabb {
                            min: point,
                            max: point,
                        },
                        axis,
                        normal_angle: normals,
                        emission_angle: emission,
                    },
                    1.0,
                )
            }));
            for k in 0..1_500 {
                // One light's rim passes at or near this point, and so does the horizon.
                let (point, axis, normals, emission) = light(k % count);
                let off = [0.0, 1e-9, 1e-6, 1e-5, 1e-4, 1e-2, -1e-3][(k % 7) as usize];
                let target_direction = axis * (normals + emission - off).cos()
                    + axis.any_orthonormal_vector() * (normals + emission - off).sin();
                let from = point
                    + target_direction * (scale * [1e-3, 0.1, 1.0, 1e3, 1e6][(k % 5) as usize]);
                let flat = target_direction.any_orthonormal_vector();
                let normal = [
                    DVec3::ZERO,
                    (flat - target_direction * off).normalize(),
                    unit(k),
                ][(k % 3) as usize];
                for i in 0..count {
                    let (point, axis, normals, emission) = light(i);
                    let direction = (from - point).normalize_or_zero();
                    let facing = -normal.dot(direction);
                    let leaves = axis.dot(direction) - (normals + emission).cos();
                    let received = if normal == DVec3::ZERO { 1.0 } else { facing };
                    let probability = tree.probability(
                        places[i as usize],
                        &ReceivingPoint {
                            point: from,
                            normal,
                        },
                    );
                    let name =
                        format!("{i} of {count} at {scale:e}: off by {leaves:e} and {received:e}");
                    if leaves > 0.0 && received > 0.0 {
                        assert!(probability > 0.0, "{name}");
                        counts[usize::from(leaves.min(received) < 1e-7)] += 1;
                    } else if count == 2
                        && told
                        && point.distance(from) > 1e-2 * scale
                        && leaves.min(received) < -1e-4
                    {
                        assert_eq!(probability, 0.0, "{name}");
                        counts[2] += 1;
                    }
                }
            }
        }
    }
    assert!(counts.iter().all(|&count| count > 1_000), "{counts:?}");
}

/// Protects: importance approximates the contribution. A point that receives light on both sides
/// has no horizon, so that a lamp's size at one distance does not matter; at the point right below
/// one of two lamps, the other lamp, three times as far, has a probability close to its
/// contribution.
#[test]
fn importance_is_about_what_arrives() {
    let ball = |middle: DVec3, half: f64| round(middle - DVec3::splat(half), 2.0 * half);
    let (either, places) = tree(
        [
            (ball(DVec3::X * 3.0, 0.0), 1.0),
            (ball(DVec3::X * -3.0, 0.1), 1.0),
        ]
        .into_iter(),
    );
    let share = either.probability(
        places[0],
        &ReceivingPoint {
            point: DVec3::ZERO,
            normal: DVec3::ZERO,
        },
    );
    assert!((share - 0.5).abs() < 1e-6, "{share}");
    let at = [DVec3::Y, DVec3::new(8.0_f64.sqrt(), 1.0, 0.0)];
    let (lamps, places) = tree(
        at.map(|point| (LightBounds::for_point_light(point, DVec3::NEG_Y, 1.5), 1.0))
            .into_iter(),
    );
    let share = lamps.probability(
        places[1],
        &ReceivingPoint {
            point: DVec3::ZERO,
            normal: DVec3::Y,
        },
    );
    // 1/d² times the cosine at the surface; lights have full strength within their cones.
    let received = 1.0 / 9.0 / 3.0;
    assert!(
        (share - received / (1.0 + received)).abs() < 0.03 && share < 0.1,
        "{share}"
    );
}

/// Protects: the cumulative sum grows by about each importance and not at all at a zero one, under
/// any rounding of sums: no number below one, times the total, selects an entry of zero importance.
#[test]
fn what_has_no_importance_takes_no_room() {
    for i in 0..200_000 {
        let bits = splitmix64(i);
        let importances: [f64; WIDTH] = core::array::from_fn(|k| {
            let exponent = (bits >> (6 * k)) % 48;
            if (bits >> (50 + k)) & 1 == 0 {
                0.0
            } else {
                let importance = (1.0 + number(8 * i + k as u64)) as f32;
                f64::from(importance * 2.0_f32.powi(-(exponent as i32)))
            }
        });
        let sums = cumulative_sums(0.0, &importances);
        for (k, &importance) in importances.iter().enumerate() {
            let grown = sums[k + 1] - sums[k];
            assert!(
                (importance == 0.0) == (grown == 0.0) || (importance > 0.0 && grown >= 0.0),
                "{importances:?}: {sums:?}"
            );
            assert!(
                (grown - importance).abs() <= sums[WIDTH] * 1e-15,
                "{importances:?}: {sums:?}"
            );
        }
        assert!(sums[WIDTH] == 0.0 || 1.0_f64.next_down() * sums[WIDTH] < sums[WIDTH]);
    }
}

/// Protects: lights in rows, columns and layers, whose groups have equal costs, form the same tree
/// after their coordinates are rounded, as those of another precision are.
#[test]
fn rounding_moves_no_light_of_a_regular_arrangement() {
    for [nx, ny, nz] in [[4, 1, 3], [3, 2, 2], [5, 5, 1], [3, 3, 3], [8, 1, 8]] {
        let places = |seed: u64| {
            let light = move |i: u64| {
                let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)].map(|k| k as f64);
                let rounding =
                    |k: u64| (number(9 * i + k + seed) - 0.5) * 1e-7 * (seed as f64).min(1.0);
                let moved = |at: f64, k: u64| at * (1.0 + rounding(k));
                let least = DVec3::new(
                    moved(0.9 * x - 1.5, 0),
                    moved(0.9 * y + 2.0, 1),
                    moved(0.9 * z - 1.0, 2),
                );
                let space = Aabb {
                    min: least,
                    max: least + DVec3::new(0.3, 0.0, 0.3) * (1.0 + rounding(3)),
                };
                (
                    LightBounds::for_flat_surface(space, DVec3::NEG_Y),
                    1.0 + rounding(4),
                )
            };
            tree((0..nx * ny * nz).map(light)).1
        };
        for seed in 1..100 {
            assert_eq!(places(seed), places(0), "{nx} {ny} {nz}, rounding {seed}");
        }
    }
}
