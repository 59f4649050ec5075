//! Saving of the viewer's picture under a name from the page, in the working folder, by the rules
//! of every other output.

use std::path::{Component, Path, PathBuf};

use raywright_core::RenderOutput;
use raywright_core::display::Display;
use raywright_io::InputFiles;
use raywright_io::output::{
    PictureFormat, PictureMetadata, write_picture_as, write_picture_without_overwriting,
};

use super::shared::SaveRequest;
use crate::commands::render::write;
use crate::failure::Failure;
use crate::targets::OutputFiles;

/// Writes the picture under the requested name. Returns an HTTP status and a message for the page.
pub fn save_picture(
    view_request: &SaveRequest,
    rendered: &RenderOutput,
    display: Display,
    metadata: &PictureMetadata,
    inputs: &InputFiles,
) -> (u16, String) {
    let Some(path) = parse_plain_name(&view_request.name) else {
        return (
            400,
            "give a file name without a folder, such as picture.png".to_owned(),
        );
    };
    let refused = |failure: Failure| (400, failure.message);
    let format = match PictureFormat::from_path(&path) {
        Ok(format) => format,
        Err(error) => return refused(error.into()),
    };
    let mut outputs = OutputFiles::default();
    if let Err(failure) = outputs
        .add_output(&path, "another name")
        .and_then(|()| outputs.check_against_inputs(inputs))
    {
        return refused(failure);
    }
    let name = view_request.name.as_str();
    match path.symlink_metadata() {
        Ok(other_metadata) if !other_metadata.is_file() => {
            return (
                400,
                format!(
                    "{name} is a folder, a link or a device, which is not replaced; choose another name"
                ),
            );
        }
        Ok(_) if !view_request.replace => return (409, format!("{name} exists already")),
        _ => {}
    }
    let picture = write::select_picture_for_format(rendered, format, display);
    let written = match view_request.replace {
        true => write_picture_as(&path, format, &picture, display, metadata),
        // A file created after the check is not replaced.
        false => {
            let is_free = |other: &Path| other == path && other.symlink_metadata().is_err();
            write_picture_without_overwriting(&path, &picture, display, metadata, is_free)
                .map(|_| ())
        }
    };
    match written {
        Ok(()) => (200, format!("wrote {name}")),
        Err(error) => (400, error.to_string()),
    }
}

/// Returns the path of a file name in the working folder. `None` for a name with a folder, and for
/// a name that is invalid on some system.
fn parse_plain_name(name: &str) -> Option<PathBuf> {
    let is_odd = |c: char| c.is_control() || "/\\:*?\"<>|".contains(c);
    if name.len() > 200 || name.starts_with(['.', '-', '~']) || name.contains(is_odd) {
        return None;
    }
    let path = PathBuf::from(name);
    let mut parts = path.components();
    let is_plain = matches!(
        (parts.next(), parts.next()),
        (Some(Component::Normal(_)), None)
    );
    is_plain.then_some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: no name leads outside the working folder, to a hidden file or to a device.
    #[test]
    fn names_have_no_folder() {
        for name in [
            "", ".", "..", "../a.png", "/a.png", "a/b.png", r"a\b.png", "c:a.png", ".a.png",
            "-a.png", "a\n.png", "~a.png",
        ] {
            assert_eq!(parse_plain_name(name), None, "{name}");
        }
        assert_eq!(
            parse_plain_name("a b-1.png"),
            Some(PathBuf::from("a b-1.png"))
        );
        assert_eq!(parse_plain_name(&"a".repeat(201)), None);
    }
}
