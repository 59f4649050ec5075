//! File names of the pictures of a run.

use std::collections::HashMap;
use std::path::PathBuf;

use raywright_io::output::{AnimationFormat, PictureFormat};
use raywright_io::{Error, Input, InputFiles};

use crate::failure::Failure;
use crate::plan::Shot;
use crate::targets::{self, OutputFiles, OutputTarget};

/// Resolves the outputs of each picture from names with a placeholder for the picture's number,
/// such as `%04d`. Sheets and animations hold all pictures, and their names are skipped. If `count`
/// is absent, the run has a single picture and the names are used unchanged.
pub fn resolve_named_files(
    outputs: &[PathBuf],
    count: Option<usize>,
    all: &mut OutputFiles,
) -> Result<Vec<Vec<OutputTarget>>, Failure> {
    let Some(count) = count else {
        return Ok(vec![targets::resolve_picture_targets(outputs, all)?]);
    };
    let own: Vec<&PathBuf> = outputs
        .iter()
        .filter(|path| AnimationFormat::from_path(path).is_none())
        .collect();
    let numbered =
        |path: &&PathBuf, number: usize| match insert_number(&path.to_string_lossy(), number) {
            Some(name) => Ok(PathBuf::from(name)),
            None if count == 1 => Ok(path.to_path_buf()),
            None => {
                let error = Error::invalid_usage(format_args!(
                    "{count} pictures cannot all be written to the single file {}",
                    path.display()
                ));
                let stem = path.file_stem().unwrap_or_default().to_string_lossy();
                let numbered = path
                    .with_file_name(format!("{stem}-%04d"))
                    .with_extension(path.extension().unwrap_or_default());
                Err(error.with_hint(format!(
                    "number the files: -o {}; or put all pictures on one sheet: --sheet {}",
                    numbered.display(),
                    path.display()
                )))
            }
        };
    let numbered_paths = |number: usize| {
        own.iter()
            .map(|path| numbered(path, number))
            .collect::<Result<Vec<_>, _>>()
    };
    (0..count)
        .map(|number| targets::resolve_picture_targets(&numbered_paths(number)?, all))
        .collect()
}

/// Resolves the output of each picture if the user named none: files are named after scenes and
/// views. The second and each later scene of the same name gets a number. `read` lists the input
/// files known so far.
pub fn resolve_default_files(
    format: PictureFormat,
    inputs: &[Input],
    shots: &[Shot],
    (all, read): (&mut OutputFiles, &InputFiles),
) -> Result<Vec<Vec<OutputTarget>>, Failure> {
    let (mut stems, mut targets): (HashMap<String, usize>, Vec<Vec<OutputTarget>>) =
        Default::default();
    for input in inputs {
        let own = input.file_stem();
        let count = stems.entry(own.clone()).or_default();
        *count += 1;
        let stem = if *count == 1 {
            own
        } else {
            format!("{own}-{count}")
        };
        for Shot { label, .. } in shots {
            let name = if label.is_empty() {
                stem.clone()
            } else {
                format!("{stem}-{label}")
            };
            targets.push(vec![targets::resolve_default_target(
                &name, format, all, read,
            )?]);
        }
    }
    Ok(targets)
}

/// Replaces `%d`, `%4d`, `%04d` or `####` in a name by a number, padded with zeros; `None` without
/// such a placeholder.
fn insert_number(name: &str, number: usize) -> Option<String> {
    const MOST_DIGITS: usize = 20;
    if let Some(start) = name.find("##") {
        let width = name[start..]
            .bytes()
            .take_while(|&byte| byte == b'#')
            .count();
        return (width <= MOST_DIGITS).then(|| {
            format!(
                "{}{number:0width$}{}",
                &name[..start],
                &name[start + width..]
            )
        });
    }
    let (before, rest) = name.split_once('%')?;
    let (digits, after) = rest.split_once('d')?;
    let is_width = digits.bytes().all(|byte| byte.is_ascii_digit());
    let width = if digits.is_empty() {
        Some(0)
    } else {
        digits.parse().ok().filter(|_| is_width)
    };
    width
        .filter(|&width| width <= MOST_DIGITS)
        .map(|width| format!("{before}{number:0width$}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: a number replaces only the placeholder in a name, padded to the placeholder's
    /// digits.
    #[test]
    fn names_are_numbered() {
        assert_eq!(
            insert_number("a-%04d.png", 7).as_deref(),
            Some("a-0007.png")
        );
        assert_eq!(insert_number("%d/%d.png", 12).as_deref(), Some("12/%d.png"));
        assert_eq!(
            insert_number("a%03dx.exr", 12345).as_deref(),
            Some("a12345x.exr")
        );
        assert_eq!(insert_number("a%5d.png", 12).as_deref(), Some("a00012.png"));
        assert_eq!(
            insert_number("a-####.png", 12).as_deref(),
            Some("a-0012.png")
        );
        for name in [
            "a.png",
            "a#.png",
            "100%.png",
            "a%+4d.png",
            "a%0xd.png",
            "a%099d.png",
            &"#".repeat(30),
        ] {
            assert_eq!(insert_number(name, 1), None, "{name}");
        }
    }

    /// Protects: pictures of scenes with the same name have distinct names, in the order of the
    /// scenes.
    #[test]
    fn equal_names_are_told_apart() {
        let inputs = [
            "a/no-such-x.glb",
            "b/no-such-x.glb",
            "b/no-such-y.glb",
            "c/no-such-x.glb",
        ]
        .map(|name| Input::Path(name.into()));
        let found = resolve_default_files(
            PictureFormat::Png,
            &inputs,
            &[Shot::default()],
            (&mut OutputFiles::default(), &InputFiles::default()),
        )
        .expect("names that are free");
        let names = found
            .iter()
            .flatten()
            .filter_map(OutputTarget::path)
            .map(|path| path.display().to_string());
        assert_eq!(
            names.collect::<Vec<_>>(),
            [
                "no-such-x.png",
                "no-such-x-2.png",
                "no-such-y.png",
                "no-such-x-3.png"
            ]
        );
    }
}
