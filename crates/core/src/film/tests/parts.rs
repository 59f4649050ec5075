//! Parts of a picture: rendered in any order, stopped, continued and merged to the bits of a single
//! render.

use core::sync::atomic::{AtomicU32, Ordering};
use std::collections::HashMap;
use std::sync::Mutex;
use std::thread::{ThreadId, current, yield_now};
use std::time::{Duration, Instant};

use proptest::prelude::*;

use super::{in_order, layers, ready, rendered, settings};
use crate::effects::Effect;
use crate::film::{Film, FilmHeader, FilmMergeError, FilmPart};
use crate::filter::PixelFilter;
use crate::material::FresnelRule;
use crate::picture::Picture;
use crate::scene::{Integrator, SamplePattern};
use crate::settings::{
    AreaShadows, Background, Crop, LightSampling, MicrofacetEnergy, PrecisionChoice, RouletteStart,
    SamplerKind, Sampling, Settings,
};
use crate::{Observer, ReadyScene};

fn part(ready: &ReadyScene, tile: u32, replicate: u32) -> Film {
    let mut film = ready.new_film("scene");
    let part = FilmPart {
        tiles: tile..tile + 1,
        step: 1,
        replicates: replicate..replicate + 1,
        selected_tiles: None,
    };
    ready
        .render_part(&mut film, &part, &())
        .unwrap_or_else(|e| panic!("{e}"));
    film
}

fn bits(picture: &Picture) -> Vec<u32> {
    let layers = picture
        .alpha
        .iter()
        .chain(picture.layers.iter().map(|layer| &layer.samples));
    picture
        .rgb
        .iter()
        .flatten()
        .chain(layers.flatten())
        .map(|x| x.to_bits())
        .collect()
}

/// Settings with everything that a film can hold.
fn full() -> Settings {
    Settings {
        aovs: layers(),
        background: Background::Transparent,
        ..settings(6)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Protects: the union of parts equals a single render to the bit, layers, errors and counters
    /// included, however tiles and replicates are divided, in any order of the parts, and where
    /// parts are unions themselves.
    #[test]
    fn any_parts_make_the_picture_of_one_run(
        owners in proptest::collection::vec(0_usize..5, 48),
        order in Just((0..5).collect::<Vec<usize>>()).prop_shuffle(),
    ) {
        let ready = ready(&full());
        let whole = rendered(&ready);
        let tiles = whole.full_part().tiles.end;
        let mut groups: Vec<Vec<Film>> = vec![Vec::new(); 5];
        for (unit, &owner) in owners.iter().enumerate() {
            groups[owner].push(part(&ready, unit as u32 % tiles, unit as u32 / tiles));
        }
        prop_assert_eq!(owners.len() as u32, tiles * whole.full_part().replicates.end);
        let parts: Vec<Film> = groups.iter().filter(|group| !group.is_empty()).map(|g| Film::merge(g).expect("parts")).collect();
        let shuffled: Vec<Film> = order.iter().filter_map(|&i| parts.get(i).cloned()).collect();
        let merged = Film::merge(&shuffled).expect("parts");
        prop_assert_eq!(merged.unfinished_pixels(), 0);
        prop_assert_eq!(merged.counters(), whole.counters());
        prop_assert!(bits(&merged.picture()) == bits(&whole.picture()));
        for (x, y) in (0..7).flat_map(|y| (0..11).map(move |x| (x, y))) {
            let (found, expected) = (merged.pixel_variance(x, y).expect("six samples"), whole.pixel_variance(x, y).expect("six samples"));
            for i in 0..3 {
                prop_assert!((found[i] - expected[i]).abs() <= expected[i] * 4.0 * f64::from(f32::EPSILON));
            }
        }
    }
}

/// Stops after this many tiles.
struct StopAfter(AtomicU32);

impl Observer for StopAfter {
    fn progress(&self, done: u64, total: u64) {
        assert!(done <= total);
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
    fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) == 0
    }
}

/// Protects: a render that is stopped repeatedly ends with the bits of a single render. Pixels that
/// lack samples are reported and have the mean of their present ones; after the first replicate
/// every pixel has samples.
#[test]
fn a_stopped_render_goes_on() {
    let ready = ready(&full());
    let whole = rendered(&ready);
    let mut film = ready.new_film("scene");
    let mut steps = 0;
    while film.unfinished_pixels() > 0 {
        let before = film.counters().samples;
        let stop_after = StopAfter(AtomicU32::new(5));
        in_order(|| ready.render_part(&mut film, &whole.full_part(), &stop_after))
            .expect("its own film");
        assert!(film.counters().samples > before);
        steps += 1;
        let empty = film
            .picture()
            .layer("samples.N")
            .expect("asked for")
            .samples
            .iter()
            .filter(|&&n| n == 0.0)
            .count();
        assert_eq!(
            empty == 0,
            5 * steps >= 12,
            "after {steps} steps {empty} pixels have no samples"
        );
    }
    assert_eq!(steps, 48_u32.div_ceil(5));
    assert_eq!(film.counters(), whole.counters());
    assert_eq!(bits(&film.picture()), bits(&whole.picture()));
    // No work is left, and none is repeated.
    ready
        .render_part(&mut film, &whole.full_part(), &())
        .expect("its own film");
    assert_eq!(film.counters(), whole.counters());
}

/// Protects: a single call of `render` reports the missing samples of a stopped picture.
#[test]
fn a_stopped_picture_says_how_much_is_missing() {
    let rendered = in_order(|| ready(&settings(6)).render(&StopAfter(AtomicU32::new(13))));
    // One tile, of 9 pixels, has two of its replicates, and the others one.
    assert_eq!(
        (
            rendered.finished,
            rendered.unfinished,
            rendered.counters.samples
        ),
        (false, 77, 77 * 2 + 9 * 2)
    );
    let finished = ready(&settings(6)).render(&());
    assert_eq!(
        (
            finished.finished,
            finished.unfinished,
            finished.counters.samples
        ),
        (true, 0, 77 * 6)
    );
}

/// Protects: where one tile is ahead of another, layers are means over the present samples of each
/// pixel.
#[test]
fn layers_of_uneven_tiles() {
    let ready = ready(&Settings {
        aovs: layers(),
        ..settings(6)
    });
    let first = FilmPart {
        replicates: 0..1,
        ..ready.new_film("scene").full_part()
    };
    let mut film = ready.new_film("scene");
    ready
        .render_part(&mut film, &first, &())
        .expect("its own film");
    let before = film.picture();
    ready
        .render_part(
            &mut film,
            &FilmPart {
                tiles: 0..1,
                step: 1,
                replicates: 1..2,
                selected_tiles: None,
            },
            &(),
        )
        .expect("its own film");
    for (ahead, before) in film.picture().layers.iter().zip(&before.layers) {
        // The first tile has the first three pixels of a row; the last row belongs to another tile.
        assert_eq!(
            ahead.samples[3..11],
            before.samples[3..11],
            "{}",
            ahead.name
        );
        assert_eq!(ahead.samples[66..], before.samples[66..], "{}", ahead.name);
        assert_eq!(
            ahead.name == "samples.N",
            ahead.samples[..3] == [4.0; 3],
            "{}",
            ahead.name
        );
    }
}

/// Protects: samples never count twice, and a film of another picture or scene is refused, with the
/// name of the difference.
#[test]
fn what_does_not_belong_together_is_refused() {
    let own = ready(&settings(6));
    let [a, b] = [part(&own, 1, 2), part(&own, 3, 2)];
    assert_eq!(Film::merge(&[]).map(|_| ()), Err(FilmMergeError::Nothing));
    let overlap = FilmMergeError::Overlap {
        part: 2,
        tile: 1,
        replicate: 2,
    };
    assert_eq!(
        Film::merge(&[a.clone(), b.clone(), a.clone()]).map(|_| ()),
        Err(overlap)
    );
    let other = |change: fn(&mut Settings)| {
        let mut settings = settings(6);
        change(&mut settings);
        part(&ready(&settings), 3, 2)
    };
    let foreign = |film: Film| match Film::merge(&[a.clone(), film]) {
        Err(FilmMergeError::Foreign { part: 1, label }) => label,
        other => panic!("not refused as foreign: {:?}", other.map(|_| ())),
    };
    assert_eq!(foreign(other(|s| s.seed = 1)), "seed");
    assert_eq!(foreign(other(|s| s.frame = 1)), "frame");
    assert_eq!(
        foreign(other(|s| s.sampling = Sampling::General(7))),
        "number of samples"
    );
    assert_eq!(
        foreign(other(|s| s.replicates = Some(3))),
        "number of replicates"
    );
    assert_eq!(foreign(other(|s| s.tile_size = 4)), "size of tiles");
    assert_eq!(foreign(other(|s| s.size[0] = 12)), "size");
    assert_eq!(
        foreign(other(|s| s.crop = Some(Crop {
            x: 0,
            y: 0,
            width: 10,
            height: 7
        }))),
        "crop"
    );
    assert_eq!(foreign(other(|s| s.camera = None)), "camera");
    assert_eq!(
        foreign(other(|s| s.filter = PixelFilter::Tent)),
        "pixel filter"
    );
    assert_eq!(foreign(other(|s| s.max_depth += 1)), "maximum depth");
    assert_eq!(foreign(other(|s| s.clamp = Some(1.0))), "clamp");
    assert_eq!(
        foreign(other(|s| s.integrator = Integrator::Whitted)),
        "integrator"
    );
    assert_eq!(
        foreign(other(|s| s.precision = PrecisionChoice::Reference)),
        "precision"
    );
    assert_eq!(
        foreign(other(|s| s.background = Background::Transparent)),
        "background"
    );
    assert_eq!(foreign(other(|s| s.wireframe = true)), "wireframe");
    assert_eq!(foreign(other(|s| s.aovs = layers())), "list of layers");
    assert_eq!(
        foreign(other(|s| s.light_sampling = LightSampling::Lights)),
        "light sampling"
    );
    assert_eq!(
        foreign(other(|s| s.fresnel = FresnelRule::Exact)),
        "Fresnel rule"
    );
    assert_eq!(
        foreign(other(|s| s.microfacets = MicrofacetEnergy::Single)),
        "rule of microfacets"
    );
    assert_eq!(
        foreign(other(|s| s.area_shadows = AreaShadows::Hard)),
        "shadows of lamps"
    );
    assert_eq!(
        foreign(other(|s| s.roulette = RouletteStart::Off)),
        "Russian roulette"
    );
    assert_eq!(
        foreign(other(|s| s.sampler = SamplerKind::Independent)),
        "sampler"
    );
    assert_eq!(
        foreign(other(
            |s| s.without = [Effect::Shadows].into_iter().collect()
        )),
        "list of effects switched off"
    );
    assert_eq!(
        foreign(other(
            |s| s.sampling = Sampling::Pattern(SamplePattern::Corners)
        )),
        "pattern of samples"
    );
    assert_eq!(foreign(own.new_film("another scene")), "scene");
    // The manner of computation does not matter.
    let alike = other(|s| {
        (s.accelerator, s.output) = (
            raywright_bvh::AcceleratorKind::Linear,
            crate::display::OutputFormat::Sixteen,
        )
    });
    assert!(Film::merge(&[a, alike]).is_ok());
    let mut strange = ready(&Settings {
        seed: 1,
        ..settings(6)
    })
    .new_film("scene");
    let refused = own.render_part(
        &mut strange,
        &FilmPart {
            tiles: 0..1,
            step: 1,
            replicates: 0..1,
            selected_tiles: None,
        },
        &(),
    );
    assert_eq!(
        refused,
        Err(FilmMergeError::Foreign {
            part: 0,
            label: "seed".to_owned()
        })
    );
}

/// Protects: a film holds no tile and no replicate outside its picture, beside those inside.
#[test]
fn nothing_is_held_beyond_the_picture() {
    let film = rendered(&ready(&settings(6)));
    let FilmPart {
        tiles, replicates, ..
    } = film.full_part();
    for tile in 0..tiles.end + 2 {
        for replicate in 0..replicates.end + 2 {
            let expected = if tiles.contains(&tile) && replicates.contains(&replicate) {
                2 - replicate / 2
            } else {
                0
            };
            assert_eq!(
                film.samples_drawn(tile, replicate),
                expected,
                "{tile} {replicate}"
            );
        }
    }
}

/// Protects: an invalid header is refused before any allocation, and the message names the invalid
/// part.
#[test]
fn headers_that_make_no_sense_are_refused() {
    let header = serde_json::to_value(rendered(&ready(&settings(6))).header()).expect("JSON");
    let refused = |place: &str, value: serde_json::Value| {
        let mut changed = header.clone();
        *changed
            .pointer_mut(place)
            .unwrap_or_else(|| panic!("no {place}")) = value;
        let header: FilmHeader = serde_json::from_value(changed).expect("a header");
        header
            .bytes()
            .map(|_| ())
            .map_err(|error| error.to_string())
    };
    // Of six samples in four replicates the first two have two each, the others one.
    assert_eq!(
        [
            refused("/drawn/0", 2.into()),
            refused("/drawn/47", 1.into())
        ],
        [Ok(()), Ok(())]
    );
    let wrong = |label: &str| {
        Err(format!(
            "the {label} in the header of the film is invalid: the file is damaged; restore it from a copy or render the film again"
        ))
    };
    assert_eq!(refused("/drawn/0", 3.into()), wrong("number of samples"));
    assert_eq!(refused("/drawn/47", 2.into()), wrong("number of samples"));
    assert_eq!(
        refused("/drawn", vec![0; 47].into()),
        wrong("list of tiles")
    );
    assert_eq!(
        refused("/plan/samples", 0.into()),
        wrong("number of samples")
    );
    assert_eq!(
        refused("/plan/replicates", 5.into()),
        wrong("number of samples")
    );
    assert_eq!(refused("/plan/tile_size", 0.into()), wrong("size of tiles"));
    assert_eq!(refused("/plan/crop/width", 0.into()), wrong("size"));
    assert_eq!(refused("/plan/crop/x", u32::MAX.into()), wrong("size"));
}

/// Protects: shares of a picture contain each of its tiles once, spread over the picture; shares of
/// a share are shares.
#[test]
fn shares_are_the_whole() {
    let whole_part = ready(&settings(6)).new_film("scene").full_part();
    let tiles = |part: &FilmPart| {
        part.tiles
            .clone()
            .step_by(part.step as usize)
            .collect::<Vec<u32>>()
    };
    assert_eq!(
        tiles(&whole_part.clone().split_into_nth_subset(1, 5)),
        [1, 6, 11]
    );
    assert_eq!(
        tiles(
            &whole_part
                .clone()
                .split_into_nth_subset(1, 5)
                .split_into_nth_subset(1, 2)
        ),
        [6]
    );
    assert_eq!(
        tiles(&whole_part.clone().split_into_nth_subset(0, 1)),
        tiles(&whole_part)
    );
    for total in [1, 2, 5, 12, 30] {
        let mut all: Vec<u32> = (0..total)
            .flat_map(|index| tiles(&whole_part.clone().split_into_nth_subset(index, total)))
            .collect();
        all.sort_unstable();
        assert_eq!(all, tiles(&whole_part), "{total} shares");
    }
}

/// Film of a picture whose number of samples grows step by step.
fn grown(counts: &[u32], replicates: Option<u32>) -> Result<Film, FilmMergeError> {
    let value_of = |samples| {
        ready(&Settings {
            replicates,
            ..Settings {
                sampling: Sampling::General(samples),
                ..full()
            }
        })
    };
    let mut film = value_of(counts[0]).new_film("scene");
    for &samples in counts {
        let ready = value_of(samples);
        let mut next = ready.new_film("scene");
        next.continue_from(film)?;
        let part = next.full_part();
        ready.render_part(&mut next, &part, &())?;
        film = next;
    }
    Ok(film)
}

/// Protects: adding samples later gives the bits of taking all at once, layers and errors included,
/// whether or not blocks of sums are full in between, with one, two or four replicates.
#[test]
fn more_samples_later_are_more_samples_at_once() {
    let series: [&[u32]; 6] = [
        &[1, 2, 3, 7],
        &[1, 5, 17, 40, 41],
        &[3, 16, 33],
        &[9, 63],
        &[16, 32, 160],
        &[30, 70, 75, 300],
    ];
    for (counts, replicates) in series
        .iter()
        .flat_map(|counts| [Some(1), None].map(|replicates| (*counts, replicates)))
    {
        let all = counts[counts.len() - 1];
        let (step, once) = (
            grown(counts, replicates).expect("more"),
            grown(&[all], replicates).expect("a picture"),
        );
        assert_eq!(step.counters(), once.counters(), "{counts:?}");
        assert!(
            bits(&step.picture()) == bits(&once.picture()),
            "{counts:?} in {replicates:?} replicates"
        );
        for (x, y) in (0..7).flat_map(|y| (0..11).map(move |x| (x, y))) {
            let (found, expected) = (
                step.pixel_variance(x, y).expect("samples"),
                once.pixel_variance(x, y).expect("samples"),
            );
            (0..3).for_each(|i| {
                assert!(
                    (found[i] - expected[i]).abs() <= 1e-5 * expected[i],
                    "{counts:?}: {found:?} {expected:?}"
                )
            });
        }
    }
}

/// Protects: a film whose replicate would lose samples is refused, with the least number of samples
/// that continues it: 63 samples are 32 and 31, and 64 are four times 16.
#[test]
fn fewer_samples_are_refused() {
    let refused = |counts: &[u32]| grown(counts, None).map(|_| ());
    assert_eq!(
        refused(&[63, 64]),
        Err(FilmMergeError::Samples {
            has: 63,
            requested: 64,
            least: 125
        })
    );
    assert_eq!(
        refused(&[40, 20]),
        Err(FilmMergeError::Samples {
            has: 40,
            requested: 20,
            least: 40
        })
    );
    assert_eq!(
        refused(&[5, 8]),
        Err(FilmMergeError::Samples {
            has: 5,
            requested: 8,
            least: 9
        })
    );
    assert_eq!(refused(&[40, 80]), Ok(()));
    let mut film = ready(&Settings {
        seed: 1,
        ..settings(6)
    })
    .new_film("scene");
    let foreign = film.continue_from(ready(&settings(6)).new_film("scene"));
    assert_eq!(
        foreign,
        Err(FilmMergeError::Foreign {
            part: 0,
            label: "seed".to_owned()
        })
    );
}

/// Has enough as soon as every pixel has samples.
struct EnoughEverywhere;

impl Observer for EnoughEverywhere {
    fn has_enough_samples(&self, everywhere: bool) -> bool {
        everywhere
    }
}

/// Protects: an observer with the least demand gets a whole pass, the first four samples of one
/// replicate, and then the render ends.
#[test]
fn a_pass_comes_before_enough() {
    let ready = ready(&settings(200));
    let mut film = ready.new_film("scene");
    let part = film.full_part();
    in_order(|| ready.render_part(&mut film, &part, &EnoughEverywhere)).expect("its own film");
    assert_eq!(
        (
            film.sample_range(&part),
            film.counters().samples,
            film.unfinished_pixels()
        ),
        (4..=4, 77 * 4, 77)
    );
    let before = bits(&film.picture());
    in_order(|| ready.render_part(&mut film, &part, &EnoughEverywhere)).expect("its own film");
    assert!(
        bits(&film.picture()) == before,
        "everywhere is something already"
    );
    ready
        .render_part(&mut film, &part, &())
        .expect("its own film");
    assert!(bits(&film.picture()) == bits(&rendered(&ready).picture()));
}

/// Waits within a tile until another thread works on a tile, too.
#[derive(Default)]
struct PairingObserver(Mutex<HashMap<ThreadId, u32>>);

impl PairingObserver {
    /// Returns the threads that called more than once: before a tile, and then within it.
    fn at_work(&self) -> usize {
        self.0
            .lock()
            .expect("no panic")
            .values()
            .filter(|&&requested| requested > 1)
            .count()
    }
}

impl Observer for PairingObserver {
    fn is_cancelled(&self) -> bool {
        *self
            .0
            .lock()
            .expect("no panic")
            .entry(current().id())
            .or_default() += 1;
        let start = Instant::now();
        while self.at_work() == 1 && start.elapsed() < Duration::from_secs(20) {
            yield_now();
        }
        false
    }
}

/// Protects: tiles are rendered in parallel, and no thread holds a lock that another needs while it
/// works on a tile.
#[test]
fn tiles_are_rendered_side_by_side() {
    let observer = PairingObserver::default();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build()
        .expect("two threads");
    pool.install(|| ready(&settings(6)).render(&observer));
    assert_eq!(observer.at_work(), 2);
}
