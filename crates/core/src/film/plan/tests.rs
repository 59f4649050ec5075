//! Replicates, tiles and passes cover everything exactly once.

use super::*;
use crate::scene::{SamplePattern, Scene};
use crate::settings::Sampling;

impl FilmPlan {
    /// Returns the plan with a requested number of replicates.
    fn with_division(self, requested: Option<u32>) -> Self {
        Self {
            asked: requested,
            ..self
        }
    }
}

fn plan(sampling: Sampling) -> FilmPlan {
    FilmPlan::new(
        &Settings {
            sampling,
            ..Settings::from_scene(&Scene::default())
        },
        true,
        false,
    )
}

/// Protects: every sample belongs to one replicate. Replicates differ by at most one sample, the
/// first is the largest, none exceeds its 16-bit count, and there are never more replicates than
/// samples.
#[test]
fn samples_are_spread_evenly_over_replicates() {
    for n in [
        1,
        7,
        8,
        9,
        16,
        63,
        64,
        1023,
        65_536,
        262_140,
        262_141,
        1_000_000,
        u32::MAX,
    ] {
        let plan = plan(Sampling::General(n));
        let each: Vec<u32> = (0..plan.replicates)
            .map(|r| plan.replicate_samples(r))
            .collect();
        assert_eq!(each.iter().sum::<u32>(), n);
        assert!(
            each.is_sorted_by(|a, b| a >= b) && each[0] - each[each.len() - 1] <= 1,
            "{n}: {each:?}"
        );
        assert!(
            (1..=MAX_REPLICATE_SAMPLES).contains(&each[0]),
            "{n}: {}",
            each[0]
        );
        assert_eq!(
            plan.replicates,
            if n <= 262_140 {
                default_replicates(n)
            } else {
                n.div_ceil(MAX_REPLICATE_SAMPLES)
            }
        );
    }
    for (requested, samples, given) in [(4, 3, 3), (4, 4, 4), (0, 4, 1), (5, 7, 5)] {
        let sampling = Sampling::General(samples);
        let settings = Settings {
            sampling,
            replicates: Some(requested),
            ..Settings::from_scene(&Scene::default())
        };
        assert_eq!(
            FilmPlan::new(&settings, true, false).replicates,
            given,
            "{requested} asked for of {samples} samples"
        );
    }
    for pattern in [SamplePattern::Centre, SamplePattern::Corners] {
        let plan = plan(Sampling::Pattern(pattern));
        assert_eq!(
            (plan.replicates, plan.replicate_samples(0)),
            (1, pattern.sample_count())
        );
    }
}

/// Protects: in a picture to be denoised of fewer than 64 samples, two replicates take each of the
/// first points of a net once, and a film of more samples begins with the same points. All other
/// replicates have nets of their own, and no film continues one of other nets.
#[test]
fn replicates_to_be_denoised_share_nets() {
    let plan = |samples, denoise, max_error| {
        let settings = Settings {
            sampling: Sampling::General(samples),
            denoise,
            max_error,
            ..Settings::from_scene(&Scene::default())
        };
        FilmPlan::new(&settings, true, false)
    };
    for samples in [8, 16, 24, 56] {
        let plan = plan(samples, true, None);
        let mut points: Vec<(u32, u32)> = (0..4)
            .flat_map(|r| (0..samples / 4).map(move |index| (r, index)))
            .map(|(r, index)| plan.net_and_index(r, index))
            .collect();
        points.sort_unstable();
        let all = (0..2).flat_map(|net| (0..samples / 2).map(move |index| (net, index)));
        assert!(points.into_iter().eq(all), "{samples}");
    }
    for own in [
        plan(64, true, None),
        plan(16, true, Some(0.1)),
        plan(16, false, None),
    ] {
        assert_eq!(own.net_and_index(1, 3), (1, 3));
    }
    let [few, more, many] = [8, 16, 64].map(|samples| plan(samples, true, None));
    assert!(more.can_continue_film(&few) && !many.can_continue_film(&more));
    let [less, last] = [61, 62].map(|samples| plan(samples, true, None));
    assert_eq!(less.least_samples_to_continue(&last), Some(62));
    assert_eq!(many.least_samples_to_continue(&last), None);
}

/// Protects: tiles cover each pixel of the film once, whether or not their edge divides the
/// picture's, for pictures of one pixel, one row, or prime sizes.
#[test]
fn f09_tiles_cover_the_film_once() {
    for (picture, size) in [[65, 33], [1, 1], [1, 97], [101, 1], [61, 53]]
        .into_iter()
        .flat_map(|p| [1, 7, 32, 1000].map(|s| (p, s)))
    {
        let settings = Settings {
            size: picture,
            tile_size: size,
            ..Settings::from_scene(&Scene::default())
        };
        let plan = FilmPlan::new(&settings, false, false);
        let mut covered = vec![0; plan.pixel_count()];
        for tile in (0..plan.tile_count()).map(|index| plan.tile_rect(index)) {
            for y in tile.y..tile.y + tile.height {
                (tile.x..tile.x + tile.width)
                    .for_each(|x| covered[(y * picture[0] + x) as usize] += 1);
            }
        }
        assert!(
            covered.len() as u32 == picture[0] * picture[1] && covered.iter().all(|&n| n == 1),
            "{picture:?} in tiles of {size}"
        );
    }
}

/// Protects: passes follow each other without a gap, start with few samples, and end at full blocks
/// from the second on; a pattern is a single pass.
#[test]
fn passes_take_all_samples_in_order() {
    let passes = |plan: &FilmPlan| {
        let (mut drawn, mut ends) = (0, Vec::new());
        while let Some((pass, samples)) = plan.next_sample_range(plan.replicate_samples(0), drawn) {
            assert_eq!((pass, samples.start), (ends.len() as u32, drawn));
            drawn = samples.end;
            ends.push(drawn);
        }
        ends
    };
    let general = |n| {
        passes(&FilmPlan {
            replicates: 1,
            ..plan(Sampling::General(n))
        })
    };
    assert_eq!(general(1), [1]);
    assert_eq!(general(20), [4, 16, 20]);
    assert_eq!(general(200), [4, 16, 32, 64, 128, 192, 200]);
    assert_eq!(
        passes(&plan(Sampling::Pattern(SamplePattern::Corners))),
        [4]
    );
    // A pass that starts in between ends where the regular passes end.
    assert_eq!(
        plan(Sampling::General(400)).next_sample_range(100, 70),
        Some((4, 70..100))
    );
}

/// Protects: the least number of samples that continues a film equals the result of an exhaustive
/// search, for any division; it is also found for numbers beyond an exhaustive search.
#[test]
fn the_fewest_samples_that_go_on() {
    for requested in [None, Some(1), Some(2), Some(3), Some(5), Some(16)] {
        let value_of = |n| {
            plan(Sampling::General(1))
                .with_division(requested)
                .with_samples(n)
        };
        for (fewer, more) in (1..90).flat_map(|fewer| (1..90).map(move |more| (fewer, more))) {
            let found =
                (fewer.max(more)..).find(|&n| value_of(n).can_continue_film(&value_of(fewer)));
            assert_eq!(
                value_of(more).least_samples_to_continue(&value_of(fewer)),
                found,
                "{requested:?}, {fewer}, {more}"
            );
        }
    }
    let value_of = |n, replicates| FilmPlan {
        samples: n,
        replicates,
        asked: Some(replicates),
        ..plan(Sampling::General(1))
    };
    // Its replicates hold 60,000 samples each.
    assert_eq!(
        value_of(70_000, 60_000).least_samples_to_continue(&value_of(60_000, 1)),
        Some(59_999 * 60_000 + 1)
    );
    assert_eq!(
        value_of(80_000, 80_000).least_samples_to_continue(&value_of(60_000, 1)),
        None
    );
}
