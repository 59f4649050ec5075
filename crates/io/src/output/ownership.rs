//! Recognition of PNG and OpenEXR pictures that this program wrote. A picture under a name that the
//! user did not choose may replace only such a picture.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Seek};
use std::path::Path;

use png::{Decoder, Transformations};

use super::metadata::{PROGRAM, is_program_entry};
use super::read::{EXR, PNG, read_picture};
use crate::limits::Limits;

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
    let latin = info
        .uncompressed_latin1_text
        .iter()
        .map(|chunk| (chunk.keyword.clone(), chunk.text.clone()));
    let utf8 = info
        .utf8_text
        .iter()
        .filter_map(|chunk| Some((chunk.keyword.clone(), chunk.get_text().ok()?)));
    let packed = info
        .compressed_latin1_text
        .iter()
        .map(|chunk| (chunk.keyword.clone(), String::new()));
    Some(latin.chain(utf8).chain(packed).collect())
}

#[cfg(test)]
mod tests {
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
