//! Tests of animation files.

use super::*;

/// Returns an animation of three uniform grey pictures, at this rate.
fn animation(format: AnimationFormat, rate: f64, alpha: Option<f32>) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let mut animation = AnimationWriter::new(
        &folder.path().join("a"),
        format,
        rate,
        PictureMetadata::default(),
    )
    .expect("a folder to write to");
    for grey in [0.0, 1.0, 0.0] {
        let alpha = alpha.map(|alpha| vec![alpha; 12]);
        let picture = Picture {
            rgb: vec![[grey; 3]; 12],
            alpha,
            ..Picture::new(4, 3)
        };
        animation
            .add_picture(&picture, Display::PLAIN)
            .expect("one size");
    }
    animation.to_bytes().expect("all of them")
}

/// Protects: a GIF has the requested rate, each picture to the nearest hundredth of a second
/// and exactly in total, and repeats for ever; a transparent picture is removed before the
/// next.
#[test]
fn gifs_keep_their_time() {
    for (alpha, dispose) in [
        (None, DisposalMethod::Keep),
        (Some(0.0), DisposalMethod::Background),
    ] {
        let bytes = animation(AnimationFormat::Gif, 30.0, alpha);
        let mut reader = gif::DecodeOptions::new()
            .read_info(bytes.as_slice())
            .expect("a GIF");
        let mut frames = Vec::new();
        while let Some(frame) = reader.read_next_frame().expect("a picture") {
            frames.push((frame.delay, frame.dispose, [frame.width, frame.height]));
        }
        assert_eq!(frames, [3, 4, 3].map(|delay| (delay, dispose, [4, 3])));
        assert_eq!(reader.repeat(), Repeat::Infinite);
    }
}

/// Protects: if the folder of an animation has no room for another picture, the earlier
/// pictures are kept, and the file has the same bytes as with enough room.
#[cfg(unix)]
#[test]
fn a_full_folder_loses_no_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let make = |is_full: bool| {
        let path = folder.path().join("a.apng");
        let format = AnimationFormat::Apng;
        let mut animation =
            AnimationWriter::new(&path, format, 10.0, PictureMetadata::default()).expect("a spool");
        for (i, grey) in [0.2, 0.5, 0.8, 1.0].into_iter().enumerate() {
            if is_full && i == 2 {
                // A file that is readable but not writable.
                let mut png = Vec::new();
                animation.spool.seek(SeekFrom::Start(0)).expect("a file");
                animation.spool.read_to_end(&mut png).expect("a file");
                std::fs::write(&path, &png).expect("a file");
                animation.spool = File::open(&path).expect("a file");
            }
            let rgb = vec![[grey; 3]; 12];
            let picture = Picture {
                rgb,
                ..Picture::new(4, 3)
            };
            animation
                .add_picture(&picture, Display::PLAIN)
                .expect("room");
        }
        animation.to_bytes().expect("all of them")
    };
    assert!(make(true) == make(false));
}

/// Protects: an APNG has the requested rate, repeats for ever, and has the codes of its
/// pictures.
#[test]
fn apngs_keep_their_time() {
    let bytes = animation(AnimationFormat::Apng, 25.0, None);
    let mut reader = Decoder::new(io::Cursor::new(bytes))
        .read_info()
        .expect("a PNG");
    let control = reader.info().animation_control.expect("an animation");
    assert_eq!((control.num_frames, control.num_plays), (3, 0));
    for code in [0, 255, 0] {
        let mut codes = vec![7; 36];
        reader.next_frame(&mut codes).expect("a picture");
        let frame = reader.info().frame_control.expect("its time");
        assert_eq!(
            (
                f64::from(frame.delay_num) / f64::from(frame.delay_den),
                codes
            ),
            (0.04, vec![code; 36])
        );
    }
}

/// Protects: a GIF, which has no partial coverage, omits shadows instead of black spots; an
/// APNG keeps them, and over a background both do.
#[test]
fn shadows_are_no_black_spots() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = Picture {
        alpha: Some(vec![0.4; 12]),
        shadow: Some(vec![0.4; 12]),
        ..Picture::new(4, 3)
    };
    let alpha_of = |format, background: Option<[f64; 3]>| {
        let mut animation = AnimationWriter::new(
            &folder.path().join("a"),
            format,
            10.0,
            PictureMetadata::default(),
        )
        .expect("a spool");
        animation
            .add_picture(
                &picture,
                Display {
                    background,
                    ..Display::PLAIN
                },
            )
            .expect("a picture");
        let mut codes = Vec::new();
        animation
            .for_each_picture(|own, _| {
                codes = own;
                Ok(())
            })
            .expect("codes");
        codes[codes.len() - 1]
    };
    assert_eq!(alpha_of(AnimationFormat::Gif, None), 0);
    assert!(
        (45..60).contains(&alpha_of(AnimationFormat::Apng, None)),
        "{}",
        alpha_of(AnimationFormat::Apng, None)
    );
    for format in [AnimationFormat::Gif, AnimationFormat::Apng] {
        assert!((150..250).contains(&alpha_of(format, Some([1.0; 3]))));
    }
}
