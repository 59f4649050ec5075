//! Output files of a run, checked before its work begins: a long render must not end with "no such
//! folder", and no output may overwrite an input.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use raywright_io::masking::mask_to_one_line;
use raywright_io::output::{self, OutputPath, PictureFormat, is_film, is_own_picture};
use raywright_io::{Error, ErrorKind, InputFiles, OverwrittenInput};

use crate::args::values::join_alternatives;
use crate::failure::{Exit, Failure};

/// Destination of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OutputTarget {
    /// PNG on standard output.
    Stdout,
    /// A file named by the user; an existing file is replaced.
    File(PathBuf, PictureFormat),
    /// A file named after the scene, because the user named no output. Only a picture made by this
    /// program is replaced.
    Unnamed(PathBuf, PictureFormat),
}

impl OutputTarget {
    /// Whether the output's format holds layers, which EXR alone does.
    pub fn has_layers(&self) -> bool {
        matches!(
            self,
            Self::File(_, PictureFormat::Exr) | Self::Unnamed(_, PictureFormat::Exr)
        )
    }

    /// Whether the output's format holds coverage, which all formats but JPEG do.
    pub fn has_coverage(&self) -> bool {
        !matches!(self, Self::File(_, PictureFormat::Jpeg { .. }))
    }

    /// Returns the path of the file; `None` for standard output.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Stdout => None,
            Self::File(path, _) | Self::Unnamed(path, _) => Some(path),
        }
    }
}

/// All output files of a run. Each is compared with the other outputs and with the inputs. A file
/// that would be written twice, or would overwrite an input, is refused.
#[derive(Debug, Default)]
pub struct OutputFiles {
    all: Vec<OutputFile>,
    /// Index of each output in `all`, by its path. The map keeps the comparison of all outputs fast
    /// in runs with thousands of outputs.
    by_path: HashMap<PathBuf, usize>,
    /// Index of each output in `all`, by the identity of an existing file.
    by_fingerprint: HashMap<u64, usize>,
    /// Requested quality of JPEG files, 1 to 100.
    quality: Option<u8>,
}

#[derive(Debug)]
struct OutputFile {
    /// Path as the user wrote it.
    path: PathBuf,
    /// Flag with which the user can name another file, for the hint of an error.
    flag: &'static str,
    /// Absolute path with which outputs and inputs are compared.
    place: OutputPath,
    /// Identity of the file that existed at the start of the run, if any.
    fingerprint: Option<u64>,
}

impl OutputFiles {
    /// Creates an empty list, with the requested quality of JPEG files, 1 to 100.
    pub fn with_quality(quality: Option<u8>) -> Self {
        Self {
            quality,
            ..Self::default()
        }
    }

    /// Adds an output file. `flag` is the flag with which the user can name another file.
    ///
    /// # Errors
    ///
    /// The file cannot be created, or is an output already.
    pub fn add_output(&mut self, path: &Path, flag: &'static str) -> Result<(), Failure> {
        let place = OutputPath::resolve(path)?;
        let fingerprint = place.file_fingerprint();
        if let Some(other) = self.find_output(&place, fingerprint) {
            let message = match without_current_dir(&other.path) == without_current_dir(path) {
                true => format!("{} is named twice as output", path.display()),
                false => format!(
                    "{} and {} are the same file, named twice as output",
                    other.path.display(),
                    path.display()
                ),
            };
            return Err(Failure::usage(
                message,
                format_args!("name another file with {flag}"),
            ));
        }
        let index = self.all.len();
        self.by_path.insert(place.lookup_key(), index);
        fingerprint.map(|fingerprint| self.by_fingerprint.insert(fingerprint, index));
        self.all.push(OutputFile {
            path: path.to_owned(),
            flag,
            place,
            fingerprint,
        });
        Ok(())
    }

    /// Adds an output file as [`OutputFiles::add_output`] does. Refuses a name without the extension
    /// of its content, which `label` describes.
    pub fn add_output_of_type(
        &mut self,
        path: &Path,
        flag: &'static str,
        (extension, label): (&str, &str),
    ) -> Result<(), Failure> {
        let own = path.extension().unwrap_or_default();
        Failure::refuse_if(
            !own.eq_ignore_ascii_case(extension),
            format_args!(
                "{}: {label}; use a name that ends in .{extension}",
                path.display()
            ),
            format_args!("{flag} {}", path.with_extension(extension).display()),
        )?;
        self.add_output(path, flag)
    }

    /// Adds the film file of `--checkpoint` as [`OutputFiles::add_output`] does. Refuses an existing
    /// file that is a film neither by its name nor by its content.
    pub fn add_checkpoint(&mut self, path: &Path) -> Result<(), Failure> {
        Failure::refuse_if(
            path.is_file() && path.extension() != Some("film".as_ref()) && !is_film(path),
            format_args!(
                "{}: this file exists and is no film, which alone --checkpoint replaces",
                path.display()
            ),
            format_args!("--checkpoint {}", path.with_extension("film").display()),
        )?;
        self.add_output(path, "--checkpoint")
    }

    /// Returns the output that has this path or is the same existing file.
    fn find_output(&self, place: &OutputPath, fingerprint: Option<u64>) -> Option<&OutputFile> {
        let by_file = || fingerprint.and_then(|fingerprint| self.by_fingerprint.get(&fingerprint));
        let index = self.by_path.get(&place.lookup_key()).or_else(by_file)?;
        self.all
            .get(*index)
            .filter(|other| other.place.is_same_file(place))
    }

    /// Refuses outputs that would overwrite an input of the run, or another file named in the
    /// scene.
    pub fn check_against_inputs(&self, inputs: &InputFiles) -> Result<(), Failure> {
        let places = self
            .all
            .iter()
            .map(|output| (&output.place, output.fingerprint));
        let Some((i, clash)) = inputs.find_conflicting_output(places) else {
            return Ok(());
        };
        let OutputFile {
            path, flag, place, ..
        } = &self.all[i];
        let path = path.display();
        let message = match &clash {
            OverwrittenInput::Read(file) if file.file_name() != place.file_name() => {
                format!(
                    "cannot write {path}: it is the same file as {}, which this run reads",
                    file.display()
                )
            }
            OverwrittenInput::Read(_) => format!("cannot write {path}: this run reads it"),
            OverwrittenInput::Named(_) => {
                format!("cannot write {path}: the scene names this file as an input")
            }
        };
        Err(Failure::usage(
            message,
            format_args!("name another file with {flag}"),
        ))
    }

    /// Whether the file of any output exists already.
    pub fn has_existing_file(&self) -> bool {
        self.all.iter().any(|output| output.path.exists())
    }

    /// Returns the paths that are neither an output nor an input of the run.
    pub fn beside<'a>(&'a self, inputs: &'a InputFiles) -> FreePaths<'a> {
        FreePaths {
            outputs: self,
            inputs,
        }
    }
}

/// Paths that the program may choose itself for a file: no output and no input of the run.
#[derive(Clone, Copy)]
pub struct FreePaths<'a> {
    outputs: &'a OutputFiles,
    pub inputs: &'a InputFiles,
}

impl FreePaths<'_> {
    /// Whether a path is free. A path where no file can be created passes; the later write reports
    /// the error.
    pub fn has(self, path: &Path) -> bool {
        OutputPath::resolve(path).map_or(true, |place| {
            let is_output = self.outputs.find_output(&place, place.file_fingerprint());
            is_output.is_none() && self.inputs.find_overwritten_input(&place).is_none()
        })
    }

    /// Writes the file of an interrupted run beside its path, under a new name that replaces no
    /// file. Returns the new name.
    pub fn write_partial_file(self, path: &Path, bytes: &[u8]) -> Result<String, Error> {
        let partial = output::partial_picture_path(path);
        let is_free = |other: &Path| self.has(other);
        let name = output::write_new_file(&partial, bytes, is_free)?;
        Ok(printable_path(&name))
    }
}

/// Formats a path for a message of a single line, without control characters.
pub fn printable_path(path: &Path) -> String {
    mask_to_one_line(&path.display().to_string())
}

/// Resolves the names of `-o` to outputs, and adds them to the output files. Each has a known
/// format and a writable folder, and none is named twice.
pub fn resolve_picture_targets(
    named: &[PathBuf],
    outputs: &mut OutputFiles,
) -> Result<Vec<OutputTarget>, Failure> {
    let mut targets = Vec::with_capacity(named.len());
    for path in named {
        let target = if path == Path::new("-") {
            OutputTarget::Stdout
        } else {
            let format = match (PictureFormat::from_path(path)?, outputs.quality) {
                (PictureFormat::Jpeg { .. }, Some(quality)) => PictureFormat::Jpeg { quality },
                (format, _) => format,
            };
            outputs.add_output(path, "-o")?;
            OutputTarget::File(path.clone(), format)
        };
        if target == OutputTarget::Stdout && targets.contains(&target) {
            return Err(Error::invalid_usage("`-o -` is given twice, but standard output takes a single picture; leave out one of the two").into());
        }
        targets.push(target);
    }
    Ok(targets)
}

/// Selects the content of a report's file by the extension of its name. Fails with a usage error for
/// an extension without content.
pub fn select_by_extension<T: Copy>(path: &Path, kinds: &[(&str, T)]) -> Result<T, Failure> {
    let own = path.extension().unwrap_or_default();
    let mut kind = kinds
        .iter()
        .filter(|(extension, _)| own.eq_ignore_ascii_case(extension));
    if let Some((_, kind)) = kind.next() {
        return Ok(*kind);
    }
    let names: Vec<String> = kinds.iter().map(|(name, _)| format!(".{name}")).collect();
    Err(Failure::usage(
        format_args!(
            "{}: the extension of this name is no known output format",
            path.display()
        ),
        format_args!("use a name that ends in {}", join_alternatives(&names)),
    ))
}

/// Resolves the default output, which is named after the scene. Its path has to be free or to hold
/// a picture made by this program.
pub fn resolve_default_target(
    stem: &str,
    format: PictureFormat,
    outputs: &mut OutputFiles,
    inputs: &InputFiles,
) -> Result<OutputTarget, Failure> {
    let path = PathBuf::from(format!(
        "{stem}.{}",
        if format == PictureFormat::Exr {
            "exr"
        } else {
            "png"
        }
    ));
    outputs.add_output(&path, "-o")?;
    outputs.check_against_inputs(inputs)?;
    if path.exists() && !is_own_picture(&path) {
        let name = path.display();
        let message = format!(
            "cannot write {name}: a file of this name exists and is no picture made by this program"
        );
        let error = Failure::new(Exit::from(ErrorKind::File), message);
        return Err(error.with_hint(format_args!(
            "name the picture with -o; -o {name} replaces that file"
        )));
    }
    Ok(OutputTarget::Unnamed(path, format))
}

/// Removes the components `.` from a path, so that two spellings of a path compare equal.
fn without_current_dir(path: &Path) -> PathBuf {
    path.components()
        .filter(|part| *part != std::path::Component::CurDir)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(named: &[PathBuf]) -> Result<Vec<OutputTarget>, Failure> {
        resolve_picture_targets(named, &mut OutputFiles::default())
    }

    /// Protects: two spellings of a path are one file.
    #[test]
    fn the_same_file_twice_is_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (plain, detour) = (folder.path().join("a.png"), folder.path().join("./a.png"));
        assert!(check(&[plain.clone(), folder.path().join("b.png")]).is_ok());
        assert!(check(&[plain, detour]).is_err());
        assert!(check(&["-".into(), "-".into()]).is_err());
        let (one, link) = (
            folder.path().join("one.png"),
            folder.path().join("link.png"),
        );
        std::fs::write(&one, "mine").expect("a file");
        std::fs::hard_link(&one, &link).expect("a link");
        assert!(check(&[one, link]).is_err());
    }

    /// Protects: the check whether a folder is writable leaves no file behind.
    #[test]
    fn checking_leaves_no_trace() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        check(&[folder.path().join("a.png")]).expect("a fresh folder can be written to");
        assert_eq!(
            std::fs::read_dir(folder.path()).expect("a folder").count(),
            0
        );
    }

    /// Protects: a file that the user did not name never overwrites an input or an output of the
    /// run.
    #[test]
    fn unnamed_files_keep_clear() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("wood.png"), "wood").expect("a file");
        let mut inputs = InputFiles::default();
        inputs.record_read(&at("wood.png"));
        let mut outputs = OutputFiles::default();
        resolve_picture_targets(&[at("a.png")], &mut outputs).expect("a name that is free");
        let free = ["a.png", "wood.png", "./wood.png", "b.png"]
            .map(|name| outputs.beside(&inputs).has(&at(name)));
        assert_eq!(free, [false, false, false, true]);
        outputs.check_against_inputs(&inputs).expect("another file");
        outputs
            .add_output(&at("wood.png"), "-o")
            .expect("a file like another");
        let refused = outputs.check_against_inputs(&inputs).expect_err("an input");
        assert_eq!(refused.exit, Exit::Usage);
    }

    /// Protects: an EXR picture holds layers; a PNG, named or not, and standard output do not.
    #[test]
    fn layers_need_a_named_exr() {
        let file = |format| OutputTarget::File("a".into(), format);
        let targets = [
            OutputTarget::Stdout,
            file(PictureFormat::Png),
            file(PictureFormat::Exr),
            OutputTarget::Unnamed("a.png".into(), PictureFormat::Png),
        ];
        assert_eq!(
            targets.map(|target| target.has_layers()),
            [false, false, true, false]
        );
    }
}
