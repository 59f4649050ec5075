//! Atomic writing of files: the content is written to a temporary file in the same folder, which is
//! then renamed.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, BufRead, BufReader, Seek, Write};
use std::path::{Path, PathBuf};

use png::{Decoder, Transformations};
use same_file::Handle;

use super::metadata::{PROGRAM, is_program_entry};
use super::output_path::{TEMPORARY, folder_of, resolve_links};
use super::read::{EXR, PNG, png_texts, read_picture};
use crate::error::Error;
use crate::hash::SceneHash;
use crate::limits::Limits;

/// Existing files that a write may replace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ReplaceRule {
    /// Any file, because the user named it.
    AnyFile,
    /// Only pictures of this program.
    ProgramPictures,
}

/// Writes a file atomically: at any time, its name refers to the complete old content or to the
/// complete new content. A failure leaves no temporary file. A device or a pipe is written
/// directly. A write-protected file is not replaced.
///
/// # Errors
/// Of kind [`File`](crate::ErrorKind::File) if the file cannot be written.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_bytes(path, bytes, ReplaceRule::AnyFile).map_err(|cause| Error::unwritable(path, &cause))
}

/// Writes bytes to a file atomically. Fails with `AlreadyExists` if the existing file may not be
/// replaced.
pub(super) fn write_bytes(path: &Path, bytes: &[u8], replace: ReplaceRule) -> io::Result<()> {
    write_stream(path, replace, |out| out.write_all(bytes))
}

/// Writes a file atomically with the content that the function `write` produces. Fails with
/// `AlreadyExists` if the existing file may not be replaced.
pub(super) fn write_stream(
    path: &Path,
    replace: ReplaceRule,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    // If the path is a symbolic link, the link stays, and its target is replaced or created.
    let target = resolve_links(path)?;
    let metadata = fs::metadata(&target).ok();
    let is_protected = metadata
        .as_ref()
        .is_some_and(|metadata| metadata.permissions().readonly());
    match &metadata {
        Some(_)
            if replace == ReplaceRule::ProgramPictures
                && (is_protected || !is_own_picture(&target)) =>
        {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        Some(metadata) if metadata.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Some(metadata) if !metadata.is_file() => {
            return write(&mut fs::OpenOptions::new().write(true).open(path)?);
        }
        Some(_) if is_protected => return Err(io::ErrorKind::PermissionDenied.into()),
        _ => {}
    }
    let mut file = create_temporary_file(&target, metadata.as_ref())?;
    write(&mut file)?;
    // Some file systems report a full disk only on this call.
    file.as_file().sync_all()?;
    let persisted = match replace {
        ReplaceRule::AnyFile => file.persist(&target),
        // The existing file may have changed during the write. Therefore it is checked now.
        ReplaceRule::ProgramPictures if is_own_picture(&target) => file.persist(&target),
        ReplaceRule::ProgramPictures => file.persist_noclobber(&target),
    };
    persisted.map(|_| ()).map_err(|failure| failure.error)
}

/// Number of temporary files of killed programs that a write removes.
const MOST_ABANDONED: u32 = 8;

/// Returns a path for a temporary file of a target. The name is derived from the target's name, so
/// that a later write of the target finds the file of a killed program. Programs that write the
/// target at the same time have different numbers.
fn temporary_path(target: &Path, number: u32) -> PathBuf {
    let mut hash = SceneHash::default();
    hash.add_bytes(target.file_name().unwrap_or_default().as_encoded_bytes());
    folder_of(target).join(format!("{TEMPORARY}{hash:.16}-{number}.tmp"))
}

/// Removes a temporary file that no program writes. The program that writes the file locks it, and
/// the system removes the lock of a killed program.
fn remove_abandoned_file(path: &Path) {
    if path
        .symlink_metadata()
        .is_ok_and(|metadata| metadata.is_file())
        && let Ok(file) = fs::OpenOptions::new().write(true).open(path)
        && file.try_lock().is_ok()
        && has_path(&file, path)
    {
        // The number of a file that cannot be removed is not used.
        let _ = fs::remove_file(path);
    }
}

/// Whether a path leads to this file, and not to another that has taken its name.
fn has_path(file: &fs::File, path: &Path) -> bool {
    let own = file.try_clone().and_then(Handle::from_file);
    own.is_ok_and(|own| Handle::from_path(path).is_ok_and(|named| named == own))
}

/// Creates a locked temporary file beside the target, and removes those of killed programs.
fn create_temporary_file(
    target: &Path,
    replaced: Option<&fs::Metadata>,
) -> io::Result<tempfile::NamedTempFile> {
    (0..MOST_ABANDONED).for_each(|number| remove_abandoned_file(&temporary_path(target, number)));
    let mut number = 0;
    loop {
        match create_file(&temporary_path(target, number), replaced) {
            Ok(file) => {
                // Without locks in the file system, no other program removes the file.
                let _ = file.as_file().lock();
                if has_path(file.as_file(), file.path()) {
                    return Ok(file);
                }
                // Another program removed the file before it was locked. Its name may be in use.
                file.into_temp_path().keep()?;
            }
            Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists => {}
            Err(cause) => return Err(cause),
        }
        number += 1;
    }
}

/// Creates a temporary file. A new file gets the user's default mode; a replacement gets the owner
/// and mode of the replaced file before any byte is written.
fn create_file(
    path: &Path,
    replaced: Option<&fs::Metadata>,
) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder
        .prefix(path.file_name().unwrap_or_default())
        .rand_bytes(0);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default. A replacement stays private until it has the mode
        // of the old file.
        let mode = if replaced.is_some() { 0o600 } else { 0o666 };
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    let file = builder.tempfile_in(folder_of(path))?;
    #[cfg(unix)]
    if let Some(replaced) = replaced {
        copy_ownership(file.as_file(), replaced)?;
    }
    #[cfg(not(unix))]
    let _ = replaced;
    Ok(file)
}

/// Copies owner, group and mode of the file `other` to `file`. Only root may change the owner. If
/// owner or group cannot be copied, the set-ID and sticky bits of the mode are cleared. If the
/// group cannot be copied, the mode gives the file's present group the rights of all other users.
#[cfg(unix)]
fn copy_ownership(file: &fs::File, other: &fs::Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let mut mode = other.mode() & 0o7777;
    let metadata = file.metadata()?;
    if metadata.uid() != other.uid() && fchown(file, Some(other.uid()), None).is_err() {
        mode &= 0o777;
    }
    if metadata.gid() != other.gid() && fchown(file, None, Some(other.gid())).is_err() {
        mode &= 0o707 | (mode & 0o007) << 3;
    }
    file.set_permissions(fs::Permissions::from_mode(mode))
}

// Recognition of PNG and OpenEXR pictures that this program wrote. A picture under a name that the
// user did not choose may replace only such a picture.

/// Whether a regular file is a complete, unedited PNG or OpenEXR picture that this program wrote.
/// The file must decode to its end, and must have the text entries of this program. An entry of
/// another program means that the picture was edited.
pub fn is_own_picture(path: &Path) -> bool {
    // Reading a pipe would block.
    if !path.is_file() {
        return false;
    }
    let Ok(file) = fs::File::open(path) else {
        return false;
    };
    let mut file = BufReader::new(file);
    let texts = match file.fill_buf() {
        Ok(start) if start.starts_with(PNG) => read_png_texts(file),
        Ok(start) if start.starts_with(EXR) => read_picture(path, &Limits::default())
            .ok()
            .map(|stored_picture| stored_picture.texts),
        _ => None,
    };
    texts.is_some_and(|texts| are_texts_of_this_program(&texts))
}

fn are_texts_of_this_program(texts: &BTreeMap<String, String>) -> bool {
    let software = texts
        .iter()
        .find(|(name, _)| name.eq_ignore_ascii_case("software"))
        .map(|(_, text)| text.as_str());
    let ours = software
        .and_then(|text| text.strip_prefix(PROGRAM))
        .is_some_and(|version| version.starts_with(' '));
    ours && texts.len() > 1 && texts.keys().all(|name| is_program_entry(name))
}

/// Reads the text entries of a PNG, if the whole file can be decoded. Rows are decoded one by one,
/// so that pictures of any size are accepted.
fn read_png_texts(file: impl BufRead + Seek) -> Option<BTreeMap<String, String>> {
    let mut decoder = Decoder::new(file);
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().ok()?;
    while reader.next_row().ok()?.is_some() {}
    reader.finish().ok()?;
    let info = reader.info();
    let packed = info
        .compressed_latin1_text
        .iter()
        .map(|chunk| (chunk.keyword.clone(), String::new()));
    let mut texts = png_texts(info);
    texts.extend(packed);
    Some(texts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// Protects: a new file and a replaced one hold exactly the bytes, and no other file is left in
    /// the folder.
    #[test]
    fn writes_and_replaces_whole_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write_atomically(&path, b"one, and longer").unwrap();
        write_atomically(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    /// Protects: a file is never written in place, so that a concurrent reader of the old file
    /// reads all of it.
    #[test]
    fn an_open_file_keeps_its_bytes() {
        use std::io::Read;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write_atomically(&path, b"old").unwrap();
        let mut open = fs::File::open(&path).unwrap();
        write_atomically(&path, b"new").unwrap();
        let mut text = String::new();
        open.read_to_string(&mut text).unwrap();
        assert_eq!(
            (text.as_str(), fs::read(&path).unwrap().as_slice()),
            ("old", b"new".as_slice())
        );
    }

    /// Protects: where only a picture of this program may be replaced, a foreign file, a folder and
    /// a link to either stay unchanged and no file is left beside them; a free name is written.
    #[test]
    fn foreign_files_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("foreign.png"), "mine").unwrap();
        fs::create_dir(at("folder.png")).unwrap();
        for name in ["foreign.png", "folder.png"] {
            let error = write_bytes(&at(name), b"new", ReplaceRule::ProgramPictures).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::AlreadyExists, "{name}");
        }
        write_bytes(&at("new.png"), b"new", ReplaceRule::ProgramPictures).unwrap();
        assert_eq!(
            (
                fs::read(at("foreign.png")).unwrap(),
                fs::read(at("new.png")).unwrap()
            ),
            (b"mine".to_vec(), b"new".to_vec())
        );
        assert_eq!(
            names(folder.path()),
            ["folder.png", "foreign.png", "new.png"]
        );
    }

    /// Protects: a write-protected file is left unchanged, even if the folder would allow its
    /// replacement.
    #[test]
    fn write_protected_files_are_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        fs::write(&path, "old").unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        let error = write_atomically(&path, b"new").unwrap_err();
        assert!(error.to_string().contains("permission denied"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
    }

    /// Protects: a missing folder and a folder under the final name are errors of kind `File` that
    /// leave no file behind.
    #[test]
    fn failures_leave_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no/such/a.bin");
        let error = write_atomically(&missing, b"x").unwrap_err();
        assert_eq!(error.kind(), crate::ErrorKind::File);
        assert!(
            error.to_string().contains("no such file or folder")
                && error.to_string().contains("a.bin"),
            "{error}"
        );
        fs::create_dir(folder.path().join("taken")).unwrap();
        let error = write_atomically(&folder.path().join("taken"), b"x").unwrap_err();
        assert!(
            error.to_string().contains("the path is a folder"),
            "{error}"
        );
        assert_eq!(names(folder.path()), ["taken"]);
    }

    /// Protects: a write removes the temporary files that killed programs left of the same name, in
    /// whatever order they were killed; those of a live program, of another name, and files that
    /// are no files of ours stay.
    #[test]
    fn files_of_killed_programs_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let (path, other) = (folder.path().join("a.bin"), folder.path().join("b.bin"));
        let [abandoned, live, further, taken] = [0, 1, 2, 3].map(|i| temporary_path(&path, i));
        let foreign = temporary_path(&other, 0);
        for file in [&abandoned, &live, &further, &foreign] {
            fs::write(file, "part").unwrap();
        }
        fs::create_dir(&taken).unwrap();
        let writer = fs::File::open(&live).unwrap();
        writer.lock().unwrap();
        for content in [b"one", b"two"] {
            write_atomically(&path, content).unwrap();
            assert_eq!(fs::read(&path).unwrap(), content);
            let exists = [&abandoned, &live, &further, &taken, &foreign].map(|file| file.exists());
            assert_eq!(exists, [false, true, false, true, true]);
        }
        drop(writer);
        write_atomically(&path, b"three").unwrap();
        assert!(!live.exists() && foreign.exists());
    }

    /// Protects: a write removes the temporary file of a killed program that named the folder in
    /// another way.
    #[test]
    fn files_of_killed_programs_are_found_by_any_path() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(temporary_path(&folder.path().join("a.bin"), 0), "part").unwrap();
        write_atomically(&folder.path().join("./a.bin"), b"whole").unwrap();
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    /// Protects: any number of programs write a file at the same time; each leaves a whole file,
    /// and none leaves a temporary one.
    #[test]
    fn many_writers_do_not_disturb_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        std::thread::scope(|scope| {
            for writer in 0..12 {
                let path = &path;
                scope.spawn(move || {
                    for _ in 0..10 {
                        write_atomically(path, &[writer; 1000]).unwrap();
                    }
                });
            }
        });
        let bytes = fs::read(&path).unwrap();
        assert!(bytes.len() == 1000 && bytes.iter().all(|byte| *byte == bytes[0]));
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    /// Protects: a failed rename removes the temporary file and keeps the old content.
    #[cfg(unix)]
    #[test]
    fn an_old_file_survives_a_failure() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        fs::write(&path, "old").unwrap();
        let too_long = folder.path().join("x".repeat(300));
        assert!(write_atomically(&too_long, b"new").is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    /// Protects: a link stays a link and its target is replaced; the new file has the default
    /// permissions.
    #[cfg(unix)]
    #[test]
    fn links_and_permissions_are_kept() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (real, link, plain) = (
            folder.path().join("real"),
            folder.path().join("link"),
            folder.path().join("plain"),
        );
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_atomically(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
        fs::write(&plain, "plain").unwrap();
        // A link without a target: the target is created.
        let (ahead, made) = (folder.path().join("ahead"), folder.path().join("made"));
        std::os::unix::fs::symlink("made", &ahead).unwrap();
        write_atomically(&ahead, b"new").unwrap();
        assert!(
            fs::symlink_metadata(&ahead).unwrap().is_symlink()
                && fs::symlink_metadata(&made).unwrap().is_file()
        );
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&real), mode(&plain));
    }

    /// Protects: a replacement has the mode, owner and group of the old file, also behind a link;
    /// during the write, no further user can read it.
    #[cfg(unix)]
    #[test]
    fn the_mode_is_kept() {
        use std::os::unix::fs::{MetadataExt, PermissionsExt};
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("a.bin"), folder.path().join("link"));
        std::os::unix::fs::symlink("a.bin", &link).unwrap();
        for mode in [0o600, 0o640, 0o666, 0o604, 0o200, 0o755] {
            fs::write(&path, "old").unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            let before = fs::metadata(&path).unwrap();
            let unfinished = || {
                fs::read_dir(folder.path())
                    .unwrap()
                    .map(|entry| entry.unwrap())
                    .find(|entry| entry.file_name().to_string_lossy().starts_with(TEMPORARY))
            };
            write_stream(&link, ReplaceRule::AnyFile, |out| {
                let meanwhile = unfinished().unwrap().metadata().unwrap().mode();
                assert_eq!(
                    meanwhile & 0o777 & !mode,
                    0,
                    "{meanwhile:o} while {mode:o} is replaced"
                );
                out.write_all(b"new")
            })
            .unwrap();
            let after = fs::metadata(&path).unwrap();
            assert_eq!(
                (after.mode(), after.uid(), after.gid()),
                (before.mode(), before.uid(), before.gid()),
                "{mode:o}"
            );
            fs::remove_file(&path).unwrap();
        }
    }

    /// Protects: a device is written to, not replaced by a file.
    #[cfg(unix)]
    #[test]
    fn devices_are_written_to_directly() {
        use std::os::unix::fs::FileTypeExt;
        write_atomically(Path::new("/dev/null"), b"x").unwrap();
        assert!(
            fs::metadata("/dev/null")
                .unwrap()
                .file_type()
                .is_char_device()
        );
    }
}

#[cfg(test)]
mod ownership_tests {
    use raywright_core::display::Display;
    use raywright_core::picture::Picture;

    use super::super::{PictureMetadata, encode_exr, encode_png};
    use super::*;

    fn metadata() -> PictureMetadata {
        PictureMetadata {
            software: "Raywright 0.1.0".into(),
            command: "raywright render".into(),
            ..PictureMetadata::default()
        }
    }

    fn png(metadata: &PictureMetadata) -> Vec<u8> {
        encode_png(&Picture::new(7, 5), Display::PLAIN, metadata).unwrap()
    }

    fn owns(bytes: &[u8]) -> bool {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        fs::write(&path, bytes).unwrap();
        is_own_picture(&path)
    }

    /// Protects: pictures of this program are recognised in both formats, and nothing else is: no
    /// picture without its entries, none with a text of another program, no folder and no missing
    /// file.
    #[test]
    fn only_pictures_of_ours_are_ours() {
        assert!(owns(&png(&metadata())));
        assert!(owns(&encode_exr(&Picture::new(7, 5), &metadata()).unwrap()));
        let other = |software: &str| PictureMetadata {
            software: software.into(),
            ..metadata()
        };
        for software in ["", "GIMP 2.10", "Raywrighter 2", "Raywright"] {
            assert!(!owns(&png(&other(software))), "{software:?}");
            assert!(
                !owns(&encode_exr(&Picture::new(7, 5), &other(software)).unwrap()),
                "{software:?}"
            );
        }
        assert!(
            !owns(&png(&PictureMetadata {
                command: String::new(),
                ..metadata()
            })),
            "anyone may write one text"
        );
        assert!(!owns(&png(&PictureMetadata::default())));
        assert!(!owns(b"") && !owns(b"Software\0Raywright 0.1.0"));
        let edited = |keyword: &str| {
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
            for (name, text) in [
                ("Software", "Raywright 0.1.0"),
                ("Raywright command", "x"),
                (keyword, "x"),
            ] {
                encoder.add_text_chunk(name.into(), text.into()).unwrap();
            }
            encoder
                .write_header()
                .unwrap()
                .write_image_data(&[0])
                .unwrap();
            bytes
        };
        assert!(owns(&edited("Raywright seed")));
        assert!(
            !owns(&edited("date:modify")),
            "another program has worked on it"
        );
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_own_picture(folder.path()) && !is_own_picture(&folder.path().join("none.png")));
    }

    /// Protects: a truncated or damaged picture of this program is never replaced.
    #[test]
    fn damaged_pictures_are_not_ours() {
        for bytes in [
            png(&metadata()),
            encode_exr(&Picture::new(7, 5), &metadata()).unwrap(),
        ] {
            assert!(owns(&bytes));
            assert!(!owns(&bytes[..bytes.len() - 1]));
            assert!(!owns(&bytes[..bytes.len() / 2]));
        }
        let mut bytes = png(&metadata());
        let data = bytes.windows(4).position(|name| name == b"IDAT").unwrap() + 8;
        bytes[data] ^= 0x20;
        assert!(!owns(&bytes), "its checksum is wrong");
    }
}
