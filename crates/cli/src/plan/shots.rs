//! Shots: the pictures that a run makes of each scene, by view, by angle of a turntable, or by time
//! of the animation.

use raywright_core::framing::{Silhouette, ViewAngles};

use crate::args::ViewArgs;

/// A picture of a scene: its view, its time and its labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shot {
    /// Suffix of the default file name; empty: none.
    pub label: String,
    /// Caption on a contact sheet.
    pub caption: String,
    /// Time in the animation in seconds; `None`: the time of `--at`.
    pub at: Option<f64>,
    /// View of the whole scene; `None`: the scene's own camera.
    view: Option<ViewAngles>,
    /// Rotation of a turntable in degrees, added to the azimuth of the view.
    turntable_degrees: Option<f64>,
}

impl Shot {
    /// Returns the view of the picture; `None` stands for the scene's own camera. `silhouette`
    /// returns the scene's silhouette. A turntable without a view starts at the front of the scene,
    /// which is found from the silhouette.
    pub fn resolve_view<'a>(
        &self,
        silhouette: impl FnOnce() -> &'a Silhouette,
    ) -> Option<ViewAngles> {
        let Some(turn) = self.turntable_degrees else {
            return self.view;
        };
        let view = self.view.unwrap_or_else(|| silhouette().default_view());
        Some(ViewAngles {
            azimuth: view.azimuth + turn,
            ..view
        })
    }
}

/// Lists the pictures of each scene for these flags: a single picture without label, or the
/// pictures of `--views`, `--turntable` or `--frames`.
pub(super) fn list_shots(args: &ViewArgs) -> Vec<Shot> {
    let numbered = |number: usize, caption: String| Shot {
        label: format!("{number:04}"),
        caption,
        view: args.view,
        ..Shot::default()
    };
    if let Some(views) = &args.views {
        let shot = |(name, view): &(String, ViewAngles)| Shot {
            label: name.replace(',', "_"),
            caption: name.clone(),
            view: Some(*view),
            ..Shot::default()
        };
        views.0.iter().map(shot).collect()
    } else if let Some(count) = args.turntable {
        let degrees = (0..count).map(|i| 360.0 * f64::from(i) / f64::from(count));
        degrees
            .enumerate()
            .map(|(i, turn)| Shot {
                turntable_degrees: Some(turn),
                ..numbered(i, format!("{turn:.0}°"))
            })
            .collect()
    } else if let Some(frames) = args.frames {
        let times = frames.picture_times().enumerate();
        times
            .map(|(i, time)| Shot {
                at: Some(time),
                ..numbered(i, format!("{time:.2} s"))
            })
            .collect()
    } else {
        vec![Shot {
            view: args.view,
            ..Shot::default()
        }]
    }
}

/// Returns the pictures per second of an animation file: the rate of `--frames`, or 25 for a
/// turntable. Other series have a rate of 1, so that each picture can be looked at.
pub(super) fn frame_rate(args: &ViewArgs) -> f64 {
    match (args.frames, args.turntable) {
        (Some(frames), _) => frames.rate,
        (None, Some(_)) => 25.0,
        (None, None) => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::values;

    /// Protects: each flag makes its pictures in order; without such flags, the default picture has
    /// the requested view.
    #[test]
    fn flags_make_pictures() {
        let view = Some(ViewAngles {
            azimuth: 3.0,
            elevation: 4.0,
        });
        for (requested, expected) in [(None, None), (view, view)] {
            let found = list_shots(&ViewArgs {
                view: requested,
                ..ViewArgs::default()
            });
            assert_eq!(
                found,
                [Shot {
                    view: expected,
                    ..Shot::default()
                }]
            );
        }
        let views = values::parse_views("front,30,-20,iso").expect("views");
        let found = list_shots(&ViewArgs {
            views: Some(views),
            ..ViewArgs::default()
        });
        let labels: Vec<_> = found.iter().map(|shot| shot.label.as_str()).collect();
        assert_eq!(labels, ["front", "30_-20", "iso"]);
        assert_eq!(
            found[1].view,
            Some(ViewAngles {
                azimuth: 30.0,
                elevation: -20.0
            })
        );
        let turns = list_shots(&ViewArgs {
            turntable: Some(4),
            ..ViewArgs::default()
        });
        assert_eq!(
            turns
                .iter()
                .map(|shot| shot.turntable_degrees)
                .collect::<Vec<_>>(),
            [0.0, 90.0, 180.0, 270.0].map(Some)
        );
        let played = ViewArgs {
            frames: Some(values::parse_frame_times("0..1:12").expect("moments")),
            ..ViewArgs::default()
        };
        let rates = [
            played,
            ViewArgs {
                turntable: Some(4),
                ..ViewArgs::default()
            },
            ViewArgs::default(),
        ]
        .map(|args| frame_rate(&args));
        assert_eq!(rates, [12.0, 25.0, 1.0]);
        let frames = |text: &str| {
            let frames = Some(values::parse_frame_times(text).expect("moments"));
            list_shots(&ViewArgs {
                frames,
                ..ViewArgs::default()
            })
            .iter()
            .filter_map(|shot| shot.at)
            .collect::<Vec<_>>()
        };
        assert_eq!(frames("0..1:4"), [0.0, 0.25, 0.5, 0.75]);
        assert_eq!(
            (frames("-1..0.5:2"), frames("0..0.1:3")),
            (vec![-1.0, -0.5, 0.0], vec![0.0])
        );
        for wrong in [
            "",
            "1",
            "0..1",
            "1..0:5",
            "0..1:0",
            "0..1:-2",
            "0..1e9:25",
            "a..b:c",
            "all",
            "all:0",
            "0..inf:25",
        ] {
            assert!(values::parse_frame_times(wrong).is_err(), "{wrong}");
        }
        assert!(
            values::parse_views("front,top,sideways").is_err()
                && values::parse_views("30").is_err()
        );
    }
}
