//! Which pictures a run is asked for, and what their files are called.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use raywright_core::framing::{Silhouette, View};
use raywright_io::output::{AnimationFormat, Format};
use raywright_io::{Error, Input, Inputs};

use crate::args::{RenderArgs, ViewArgs};
use crate::failure::Failure;
use crate::targets::{self, Outputs, Target};

/// One picture of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shot {
    /// What its file is called after where the user named none; empty: after the scene alone.
    pub label: String,
    /// What is written below it on a sheet.
    pub caption: String,
    /// The moment, where it is not the one of all.
    pub at: Option<f64>,
    /// From where it is taken, where that is not from the scene's own camera.
    view: Option<View>,
    /// Degrees further around than the view in force.
    turn: Option<f64>,
}

impl Shot {
    /// From where the picture is taken, where that is not the scene's own camera.
    pub fn seen_from<'a>(&self, silhouette: impl FnOnce() -> &'a Silhouette) -> Option<View> {
        let Some(turn) = self.turn else { return self.view };
        let view = self.view.unwrap_or_else(|| silhouette().front());
        Some(View { azimuth: view.azimuth + turn, ..view })
    }
}

/// The pictures of each scene that the flags ask for: the usual one, which has no label, where they ask for no others.
pub fn shots(args: &ViewArgs) -> Vec<Shot> {
    let numbered =
        |number: usize, caption: String| Shot { label: format!("{number:04}"), caption, view: args.view, ..Shot::default() };
    if let Some(views) = &args.views {
        let shot = |(name, view): &(String, View)| Shot {
            label: name.replace(',', "_"),
            caption: name.clone(),
            view: Some(*view),
            ..Shot::default()
        };
        views.0.iter().map(shot).collect()
    } else if let Some(count) = args.turntable {
        let degrees = (0..count).map(|i| 360.0 * f64::from(i) / f64::from(count));
        degrees.enumerate().map(|(i, turn)| Shot { turn: Some(turn), ..numbered(i, format!("{turn:.0}°")) }).collect()
    } else if let Some(frames) = args.frames {
        let times = frames.times().enumerate();
        times.map(|(i, time)| Shot { at: Some(time), ..numbered(i, format!("{time:.2} s")) }).collect()
    } else {
        vec![Shot { view: args.view, ..Shot::default() }]
    }
}

/// Pictures a second of an animation: those of a film as they say, a turn smoothly, and others slowly enough to be looked at.
pub fn rate(args: &ViewArgs) -> f64 {
    match (args.frames, args.turntable) {
        (Some(frames), _) => frames.rate,
        (None, Some(_)) => 25.0,
        (None, None) => 1.0,
    }
}

/// Whether one picture is asked for, and no file that holds several.
pub fn is_single(args: &RenderArgs, shots: &[Shot]) -> bool {
    let is_usual = shots.iter().all(|shot| shot.label.is_empty());
    let is_animation = |path: &PathBuf| AnimationFormat::of(path).is_some();
    is_usual && args.scenes.len() <= 1 && args.sheet.is_none() && !args.outputs.iter().any(is_animation)
}

/// Flags that mean one picture.
pub fn refuse_what_is_of_one_picture(args: &RenderArgs) -> Result<(), Failure> {
    let film = &args.film;
    let flags = [
        ("--checkpoint", film.checkpoint.is_some()),
        ("--resume", film.resume.is_some()),
        ("--replay", film.replay.is_some()),
        ("--part", film.part.is_some()),
        ("--budget", film.budget.is_some()),
        ("--stats", args.report.stats.is_some()),
        ("-o -", args.outputs.iter().any(|path| path == Path::new("-"))),
    ];
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => {
            let error = Error::usage(format_args!("{flag} is of one picture, and several are asked for"));
            Err(error.with_hint("leave it away, or render the pictures one by one").into())
        }
        None => Ok(()),
    }
}

/// The files of each of so many pictures, by names with a place for its number; those that hold all pictures are none of them. Without a count
/// there is one, and names are taken as they are.
pub fn named(outputs: &[PathBuf], count: Option<usize>, all: &mut Outputs) -> Result<Vec<Vec<Target>>, Failure> {
    let Some(count) = count else { return Ok(vec![targets::pictures(outputs, all)?]) };
    let own: Vec<&PathBuf> = outputs.iter().filter(|path| AnimationFormat::of(path).is_none()).collect();
    let numbered = |path: &&PathBuf, number: usize| match with_number(&path.to_string_lossy(), number) {
        Some(name) => Ok(PathBuf::from(name)),
        None if count == 1 => Ok(path.to_path_buf()),
        None => {
            let error = Error::usage(format_args!("{count} pictures cannot all be {}", path.display()));
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let numbered = path.with_file_name(format!("{stem}-%04d")).with_extension(path.extension().unwrap_or_default());
            Err(error.with_hint(format!(
                "number them: -o {}; or have all on one sheet: --sheet {}",
                numbered.display(),
                path.display()
            )))
        }
    };
    let of = |number: usize| own.iter().map(|path| numbered(path, number)).collect::<Result<Vec<_>, _>>();
    (0..count).map(|number| targets::pictures(&of(number)?, all)).collect()
}

/// The files of each picture where the user named none: after the scenes, of which two may have one name, and the pictures of each.
/// `read` is what is known to be read by then.
pub fn unnamed(
    format: Format,
    inputs: &[Input],
    shots: &[Shot],
    (all, read): (&mut Outputs, &Inputs),
) -> Result<Vec<Vec<Target>>, Failure> {
    let (mut stems, mut targets): (HashMap<String, usize>, Vec<Vec<Target>>) = Default::default();
    for input in inputs {
        let own = input.stem();
        let count = stems.entry(own.clone()).or_default();
        *count += 1;
        let stem = if *count == 1 { own } else { format!("{own}-{count}") };
        for Shot { label, .. } in shots {
            let name = if label.is_empty() { stem.clone() } else { format!("{stem}-{label}") };
            targets.push(vec![targets::unnamed(&name, format, all, read)?]);
        }
    }
    Ok(targets)
}

/// A name with a number in place of `%d` or `%04d`; none where it has no such place.
fn with_number(name: &str, number: usize) -> Option<String> {
    let (before, rest) = name.split_once('%')?;
    let (digits, after) = rest.split_once('d')?;
    let width =
        if digits.is_empty() { 0 } else { digits.strip_prefix('0')?.parse().ok().filter(|&width: &usize| width <= 20)? };
    Some(format!("{before}{number:0width$}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::values;

    /// Protects: numbers stand where a name has a place for them, with as many digits, and nowhere else.
    #[test]
    fn names_are_numbered() {
        assert_eq!(with_number("a-%04d.png", 7).as_deref(), Some("a-0007.png"));
        assert_eq!(with_number("%d/%d.png", 12).as_deref(), Some("12/%d.png"));
        assert_eq!(with_number("a%03dx.exr", 12345).as_deref(), Some("a12345x.exr"));
        for name in ["a.png", "100%.png", "a%4d.png", "a%0xd.png", "a%099d.png"] {
            assert_eq!(with_number(name, 1), None, "{name}");
        }
    }

    /// Protects: pictures of scenes with one name have names of their own, in the order of the scenes.
    #[test]
    fn equal_names_are_told_apart() {
        let inputs =
            ["a/no-such-x.glb", "b/no-such-x.glb", "b/no-such-y.glb", "c/no-such-x.glb"].map(|name| Input::Path(name.into()));
        let found = unnamed(Format::Png, &inputs, &[Shot::default()], (&mut Outputs::default(), &Inputs::default()))
            .expect("names that are free");
        let names = found.iter().flatten().filter_map(Target::path).map(|path| path.display().to_string());
        assert_eq!(names.collect::<Vec<_>>(), ["no-such-x.png", "no-such-x-2.png", "no-such-y.png", "no-such-x-3.png"]);
    }

    /// Protects: each flag makes the pictures that it says, in order, and none asks for the usual one, from the view that is asked for.
    #[test]
    fn flags_make_pictures() {
        let view = Some(View { azimuth: 3.0, elevation: 4.0 });
        for (asked, expected) in [(None, None), (view, view)] {
            let found = shots(&ViewArgs { view: asked, ..ViewArgs::default() });
            assert_eq!(found, [Shot { view: expected, ..Shot::default() }]);
        }
        let views = values::views("front,30,-20,iso").expect("views");
        let found = shots(&ViewArgs { views: Some(views), ..ViewArgs::default() });
        let labels: Vec<_> = found.iter().map(|shot| shot.label.as_str()).collect();
        assert_eq!(labels, ["front", "30_-20", "iso"]);
        assert_eq!(found[1].view, Some(View { azimuth: 30.0, elevation: -20.0 }));
        let turns = shots(&ViewArgs { turntable: Some(4), ..ViewArgs::default() });
        assert_eq!(turns.iter().map(|shot| shot.turn).collect::<Vec<_>>(), [0.0, 90.0, 180.0, 270.0].map(Some));
        let played = ViewArgs { frames: Some(values::frames("0..1:12").expect("moments")), ..ViewArgs::default() };
        let rates = [played, ViewArgs { turntable: Some(4), ..ViewArgs::default() }, ViewArgs::default()].map(|args| rate(&args));
        assert_eq!(rates, [12.0, 25.0, 1.0]);
        let frames = |text: &str| {
            let frames = Some(values::frames(text).expect("moments"));
            shots(&ViewArgs { frames, ..ViewArgs::default() }).iter().filter_map(|shot| shot.at).collect::<Vec<_>>()
        };
        assert_eq!(frames("0..1:4"), [0.0, 0.25, 0.5, 0.75]);
        assert_eq!((frames("-1..0.5:2"), frames("0..0.1:3")), (vec![-1.0, -0.5, 0.0], vec![0.0]));
        for wrong in ["", "1", "0..1", "1..0:5", "0..1:0", "0..1:-2", "0..1e9:25", "a..b:c"] {
            assert!(values::frames(wrong).is_err(), "{wrong}");
        }
        assert!(values::views("front,top,sideways").is_err() && values::views("30").is_err());
    }
}
