//! Tests of positions in a plot, of text and of empty lines.

use super::*;

fn point(x: f64, y: f64) -> PlotPoint {
    PlotPoint {
        x,
        y,
        spread: [y, y],
        ..PlotPoint::default()
    }
}

/// Protects: all decades have the same width, over the whole plot area, upwards for greater values.
#[test]
fn scales_are_logarithmic() {
    let scale = DecadeScale::new([2.0, 500.0].into_iter(), 0.0, 300.0);
    assert_eq!(scale.decades().collect::<Vec<_>>(), [0, 1, 2, 3]);
    for (value, at) in [(1.0, 0.0), (10.0, 100.0), (1000.0, 300.0)] {
        assert!((scale.map_value(value) - at).abs() < 1e-9, "{value}");
    }
    // A single value, or none, still spans a decade.
    assert_eq!(
        DecadeScale::new([10.0].into_iter(), 0.0, 1.0).decades,
        [1, 2]
    );
    assert_eq!(
        DecadeScale::new([f64::NAN].into_iter(), 0.0, 1.0).decades,
        [0, 1]
    );
}

/// Protects: no name or file name breaks the SVG.
#[test]
fn words_are_escaped() {
    let plot = Plot {
        title: "a<b & \"c\"".to_owned(),
        ..Plot::default()
    };
    let svg = plot.to_svg();
    assert!(
        svg.contains("a&lt;b &amp; &quot;c&quot;") && !svg.contains("a<b"),
        "{svg}"
    );
    let svg = Plot {
        title: "a\u{1b}[2J\0\u{202e}b\u{2028}".to_owned(),
        ..Plot::default()
    }
    .to_svg();
    assert!(
        svg.contains("a\u{fffd}[2J\u{fffd}\u{fffd}b\u{fffd}"),
        "{svg}"
    );
}

/// Protects: the whole spread of a point lies inside the plot, even where it extends a decade from
/// the point.
#[test]
fn spreads_lie_on_the_area() {
    let points = vec![
        PlotPoint {
            x: 1.0,
            y: 10.0,
            spread: [1.0, 1000.0],
            ..PlotPoint::default()
        },
        point(10.0, 10.0),
    ];
    let svg = Plot {
        lines: vec![PlotLine {
            points,
            ..PlotLine::default()
        }],
        ..Plot::default()
    }
    .to_svg();
    let [left, top, _, bottom] = AREA;
    assert!(
        svg.contains(&format!("d=\"M{left:.1} {bottom:.1}V{top:.1}\"")),
        "{svg}"
    );
}

/// Protects: every line is drawn, marked and named once, an empty line not at all, and no
/// coordinate is NaN.
#[test]
fn lines_are_drawn_and_named() {
    let line = |name: &str, points| PlotLine {
        name: name.to_owned(),
        points,
        ..PlotLine::default()
    };
    let lines = vec![
        line("one", vec![point(1.0, 3.0), point(100.0, 7.0)]),
        line("none", vec![]),
    ];
    let svg = Plot {
        lines,
        ..Plot::default()
    }
    .to_svg();
    assert_eq!(
        (svg.matches(">one<").count(), svg.matches(">none<").count()),
        (1, 0)
    );
    // Two points and the legend's.
    assert_eq!(svg.matches("<circle").count(), 3);
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
}

/// Protects: an upper bound is a downward arrow, explained in the legend; a name is beside its
/// point, with a tooltip and a keyboard focus that explain it; a missing title makes the
/// plot lower.
#[test]
fn bounds_and_names_are_drawn() {
    let bound = PlotPoint {
        is_bound: true,
        ..point(1.0, 10.0)
    };
    let named = PlotPoint {
        name: "n1".to_owned(),
        label: Some("--spp 64".to_owned()),
        ..point(10.0, 30.0)
    };
    let lines = vec![PlotLine {
        points: vec![bound, named],
        ..PlotLine::default()
    }];
    let svg = Plot {
        title: "t".to_owned(),
        lines: lines.clone(),
        ..Plot::default()
    }
    .to_svg();
    assert!(
        svg.matches("v18m-4").count() == 2 && svg.contains(">an upper bound, within noise<"),
        "{svg}"
    );
    assert!(
        svg.contains(">n1</text>") && svg.contains("<title>--spp 64</title>"),
        "{svg}"
    );
    assert!(
        svg.contains("<g tabindex=\"0\" role=\"img\" aria-label=\"--spp 64\">"),
        "{svg}"
    );
    assert!(svg.contains(&format!("height=\"{HEIGHT}\"")), "{svg}");
    let plain = Plot {
        lines: vec![PlotLine {
            points: vec![point(1.0, 3.0)],
            ..PlotLine::default()
        }],
        ..Plot::default()
    }
    .to_svg();
    assert!(
        !plain.contains("upper bound")
            && plain.contains(&format!("height=\"{}\"", HEIGHT - BARE_TOP)),
        "{plain}"
    );
    assert!(!plain.contains("class=\"title\""), "{plain}");
}
