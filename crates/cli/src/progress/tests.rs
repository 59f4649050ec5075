//! Progress displays: when a line is due, what it says, and where each display is used.

use super::*;

/// Protects: the estimate is proportional to the elapsed time, rounded up so that `0 s` never
/// appears before the end.
#[test]
fn time_left_is_in_proportion() {
    let line = |label, elapsed, done, total| {
        WorkProgress {
            elapsed,
            reports: 1,
            done,
            total,
        }
        .format_line(label)
    };
    assert_eq!(
        line("rendering", Duration::from_secs(10), 1, 4),
        "rendering: 25 %, 30 s left"
    );
    assert_eq!(
        line("rendering", Duration::from_millis(10), 3, 4),
        "rendering: 75 %, 1 s left"
    );
    assert_eq!(
        line("rendering", Duration::from_secs(10), 0, 4),
        "rendering: 0 %"
    );
    assert_eq!(
        line("rendering", Duration::from_secs(7200), 1, 2),
        "rendering: 50 %, 2 h 0 min left"
    );
    assert_eq!(
        line("rendering", Duration::from_secs(200), 1, 2),
        "rendering: 50 %, 3 min 20 s left"
    );
}

/// Protects: the displayed share of a render with a target error never falls, although the
/// number of samples grows during the render. The time left is computed from the displayed
/// share.
#[test]
fn progress_never_runs_backwards() {
    let progress = Progress::hidden().with_work_pieces(2);
    let shares = [(1, 4), (2, 4), (2, 16), (9, 16), (10, 16)].map(|(done, total)| {
        progress.report(done, total);
        progress.share.load(Ordering::Relaxed) as f64 / SHARE_UNITS
    });
    assert_eq!(shares, [0.125, 0.25, 0.25, 0.28125, 0.3125]);
}

/// Protects: the first few of many reports give no estimate of the time left; it appears with
/// the sixteenth report or a twentieth of the work.
#[test]
fn no_time_is_told_by_one_piece() {
    let line = |reports, done| {
        WorkProgress {
            elapsed: Duration::from_secs(8),
            reports,
            done,
            total: 100_000,
        }
        .format_line("rendering")
    };
    assert_eq!(line(1, 1), "rendering: 0 %");
    assert_eq!(line(15, 4999), "rendering: 4 %");
    assert_eq!(line(16, 1000), "rendering: 1 %, 13 min 12 s left");
    assert_eq!(line(1, 5000), "rendering: 5 %, 2 min 32 s left");
}

/// Protects: quiet runs and the style `none` show nothing; only a terminal has a bar,
/// everything else has lines.
#[test]
fn the_display_suits_the_place() {
    use ProgressStyle::{Auto, None, Plain};
    let kind = |style, verbosity, terminal| match ProgressDisplay::new(
        "rendering",
        style,
        verbosity,
        terminal,
    ) {
        ProgressDisplay::Nothing => "nothing",
        ProgressDisplay::Bar(_) => "bar",
        ProgressDisplay::Lines(_) => "lines",
    };
    for style in [Auto, None, Plain] {
        assert_eq!(kind(style, Verbosity::Quiet, true), "nothing");
        assert_eq!(kind(style, Verbosity::Quiet, false), "nothing");
    }
    for verbosity in [Verbosity::Normal, Verbosity::Verbose] {
        let kinds = [(Auto, true), (Auto, false), (Plain, true), (None, true)];
        assert_eq!(
            kinds.map(|(style, terminal)| kind(style, verbosity, terminal)),
            ["bar", "lines", "lines", "nothing"]
        );
    }
}

/// Protects: a line appears only when due and before the work ends; the end itself prints no
/// line.
#[test]
fn the_end_is_no_line() {
    let lines = || ProgressDisplay::Lines(Mutex::new(LineSchedule::new()));
    let second = Duration::from_secs(1);
    let work = |elapsed, done| WorkProgress {
        elapsed,
        reports: 1,
        done,
        total: 2,
    };
    assert_eq!(
        lines().report("loading", work(second, 1)),
        Some("loading: 50 %, 1 s left".to_owned())
    );
    assert_eq!(lines().report("loading", work(second, 2)), None);
    assert_eq!(lines().report("loading", work(second / 2, 1)), None);
    assert_eq!(
        ProgressDisplay::Nothing.report("loading", work(second, 1)),
        None
    );
}

/// Protects: a thousand reports within a minute make a handful of lines, each pause twice the
/// last.
#[test]
fn lines_become_rarer() {
    let mut pace = LineSchedule::new();
    let lines: Vec<u64> = (0..6000)
        .map(|n| 10 * n)
        .filter(|&n| pace.is_due(Duration::from_millis(n)))
        .collect();
    assert_eq!(lines, [1000, 3000, 7000, 15000, 31000]);
}

/// Protects: lines come at 1 s and then after pauses of 2, 4, 8, 16, 32 and again 32 seconds.
#[test]
fn pauses_grow_up_to_half_a_minute() {
    let mut pace = LineSchedule::new();
    let due: Vec<u64> = (0..130)
        .filter(|&second| pace.is_due(Duration::from_secs(second)))
        .collect();
    assert_eq!(due, [1, 3, 7, 15, 31, 63, 95, 127]);
}
