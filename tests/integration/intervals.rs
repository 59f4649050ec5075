//! Error estimates: the intervals of pixels contain the truth as often as claimed. The bench of the
//! same name has more seeds, samples and replicates.

#[path = "../../benches/support/chance.rs"]
mod chance;

use chance::{SamplingCase, judge, picture, scenes};

/// Protects: a pixel's mean ± 3.18 standard errors, the t interval of four replicates, contains the
/// truth in 95 % of pixels, under a sampled lamp and behind a lens; over the whole picture the
/// claimed error equals the true one. The seeds are fixed, and so is the result.
#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    for (name, scene) in scenes() {
        let size = [30, 20];
        let reference = picture(
            &scene,
            SamplingCase {
                size,
                samples: 1024,
                replicates: Some(16),
            },
            u64::MAX,
        );
        let tally = judge(
            &scene,
            &reference,
            SamplingCase {
                size,
                samples: 64,
                replicates: None,
            },
            0..12,
        );
        eprintln!(
            "{name}: {:.2} % of {} intervals",
            100.0 * tally.coverage(),
            tally.intervals
        );
        assert!(
            tally.intervals > 6000,
            "{name}: {} pixels are left to chance",
            tally.intervals
        );
        assert!(
            (0.93..0.97).contains(&tally.coverage()),
            "{name}: {} hold the truth",
            tally.coverage()
        );
        let ratio = tally.claimed() / tally.error();
        assert!(
            (0.9..1.1).contains(&ratio),
            "{name}: the claimed error is {ratio} of the one made"
        );
    }
}
