//! STL files with known contents, and faults in others.

use raywright_core::scene::{MaterialModel, MeshData};
use raywright_io::{Error, ErrorKind, Input, Limits, LoadOptions, LoadedScene};

use crate::shared::{check_sound, mesh_of, triangle_count};
use crate::written::PolygonMesh;

fn with(bytes: &[u8], limits: Limits) -> Result<LoadedScene, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("test.STL");
    std::fs::write(&path, bytes).expect("a file");
    let loaded = raywright_io::load(
        &Input::Path(path.clone()),
        &LoadOptions {
            limits,
            ..LoadOptions::default()
        },
    )?;
    check_sound(&loaded, &path);
    Ok(loaded)
}

fn read(bytes: &[u8]) -> Result<LoadedScene, Error> {
    with(bytes, Limits::default())
}

fn mesh(loaded: &LoadedScene) -> &MeshData {
    mesh_of(loaded, &loaded.scene.objects[0])
}

/// Protects: no facet, one facet and 10⁵ facets of both kinds are as many flat triangles, in the
/// order and with the corners of the file, without colours if the file has none.
#[test]
fn facets_are_triangles() {
    for (n, triangles) in [(0, 0), (1, 2), (224, 100_352)] {
        let sheet = PolygonMesh::sheet(n);
        let solid = sheet.stl(
            &format!("{:80}", "solid of words, and binary all the same"),
            |_| 0,
        );
        for bytes in [sheet.stl("", |_| 0), solid, sheet.stl_text()] {
            let loaded = read(&bytes).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(triangle_count(&loaded), triangles);
            if triangles == 0 {
                assert!(
                    loaded.warnings[0]
                        .message
                        .contains("no triangles: nothing to see"),
                    "{:?}",
                    loaded.warnings
                );
                continue;
            }
            assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
            let data = mesh(&loaded);
            let corners: Vec<[f32; 3]> = data
                .indices
                .as_flattened()
                .iter()
                .map(|&i| data.positions.offsets()[i as usize])
                .collect();
            let expected: Vec<[f32; 3]> = sheet
                .faces
                .iter()
                .flatten()
                .map(|&i| sheet.positions[i as usize])
                .collect();
            assert!(corners == expected && data.normals.is_empty() && data.colours.is_empty());
            let MaterialModel::Physical(material) = &loaded.scene.materials[0].model else {
                panic!("physical")
            };
            assert!(!material.vertex_colours);
        }
    }
}

/// Protects: keywords in any letter case, on any number of lines, with any line ends, several
/// solids, exponents, loops of four and of no corners, and names equal to keywords.
#[test]
fn words_are_read_as_they_are_written() {
    let facet = |z: &str| {
        format!(
            "facet normal 0 0 1 outer loop vertex 0 0 {z} vertex 1 0 {z} vertex 0 1 {z} endloop endfacet"
        )
    };
    for (text, triangles) in [
        (format!("solid\n{}\nendsolid\n", facet("0")), 1),
        (
            format!(
                "\u{feff}  SOLID facet vertex\r\n{}\r\nEndSolid facet\r\nsolid two\r\n{}\r\nendsolid",
                facet("1"),
                facet("2")
            )
            .to_uppercase(),
            2,
        ),
        (format!("solid mac\r{}\rendsolid mac\r", facet("1.5e+00")), 1),
        (format!("solid\n{}\n", facet("0").replace(' ', "\n\t ")), 1),
        (
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\n"
                .to_owned(),
            2,
        ),
        ("solid\nfacet normal 0 0 1\nouter loop\nendloop\nendfacet\nendsolid\n".to_owned(), 0),
        ("solid nothing\nendsolid nothing\n".to_owned(), 0),
    ] {
        assert_eq!(triangle_count(&read(text.as_bytes()).unwrap_or_else(|e| panic!("{text}: {e}"))), triangles, "{text}");
    }
}

/// Protects: an invalid file is refused with line or number and cause.
#[test]
fn errors_name_place_and_cause() {
    let cut = PolygonMesh::sheet(2).stl("", |_| 0);
    let cases: [(&[u8], &str); 10] = [
        (
            b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 zero 0\n",
            "line 4: vertex: `zero` is no number",
        ),
        (
            b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0,5 0 0\n",
            "`0,5` is no number; export the file again with decimal points",
        ),
        (
            b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n",
            "line 5: the file ends inside a facet",
        ),
        (
            b"solid\nfacet\nouter loop\nvertex 0 0\nvertex 1 1 1\n",
            "line 5: vertex: `vertex` is no number",
        ),
        (
            b"solid\nvertex 0 0 0\n",
            "line 2: vertex: does not belong to a facet; a `facet` line is missing before it",
        ),
        (
            b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0",
            "line 4: the file ends inside a facet",
        ),
        (
            b"solid\nfacet\nfacet\n",
            "line 3: facet: the previous facet has no endfacet",
        ),
        (b"solid\nfect\n", "line 2: `fect` is no keyword of STL"),
        (
            &cut[..133],
            "is a truncated binary STL file with 0 of 8 facets",
        ),
        (b"nothing", "is no STL file"),
    ];
    for (bytes, words) in cases {
        let error = read(bytes).expect_err(words);
        assert!(
            error.to_string().contains(words) && error.to_string().contains("test.STL"),
            "{words}: {error}"
        );
        assert_eq!(error.kind(), ErrorKind::Input);
    }
}

/// Protects: a false count of facets allocates nothing and is reported: a larger count as a
/// truncated file, a smaller one as excess bytes.
#[test]
fn counts_that_lie() {
    let mut bytes = PolygonMesh::sheet(2).stl("", |_| 0);
    for (count, refused) in [
        (u32::MAX, true),
        (9, true),
        (8, false),
        (7, false),
        (0, false),
    ] {
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
        match read(&bytes) {
            Err(error) => assert!(
                refused
                    && error
                        .to_string()
                        .contains("is a truncated binary STL file with 8 of"),
                "{error}"
            ),
            Ok(loaded) => {
                assert!(!refused && triangle_count(&loaded) == count as usize);
                let told = loaded.warnings.iter().any(|warning| {
                    warning.message.contains(&format!(
                        "{} bytes after the stated {count} facets",
                        50 * (8 - count)
                    ))
                });
                assert_eq!(told, count < 8, "{:?}", loaded.warnings);
            }
        }
    }
    let whole = PolygonMesh::sheet(2).stl("", |_| 0);
    for limits in [
        Limits {
            triangles: 7,
            ..Limits::default()
        },
        Limits {
            memory_bytes: 300,
            ..Limits::default()
        },
    ] {
        for bytes in [&whole, &PolygonMesh::sheet(2).stl_text()] {
            assert_eq!(
                with(bytes, limits).expect_err("too many").kind(),
                ErrorKind::Limit
            );
        }
    }
}

/// Protects: a loop of very many corners stays within the memory limit, during triangulation too.
#[test]
fn huge_loops_are_counted() {
    let text = format!(
        "solid\nfacet\nouter loop\n{}endloop\nendfacet\n",
        "vertex 0 0 0\n".repeat(10_000)
    );
    let limits = |memory_bytes| Limits {
        memory_bytes,
        ..Limits::default()
    };
    assert_eq!(
        with(text.as_bytes(), limits(1_500_000))
            .expect_err("too large")
            .kind(),
        ErrorKind::Limit
    );
    assert_eq!(
        triangle_count(&with(text.as_bytes(), limits(3_000_000)).expect("a mesh")),
        9_998
    );
}

/// Protects: facets of zero area are kept, facets with non-finite corners are dropped with a
/// warning, in both kinds.
#[test]
fn odd_facets() {
    let mut sheet = PolygonMesh::sheet(2);
    sheet.faces.push(vec![0, 0, 0]);
    sheet.faces.push(vec![0, 1, 2]);
    for bytes in [sheet.stl("", |_| 0), sheet.stl_text()] {
        assert_eq!(triangle_count(&read(&bytes).expect("a mesh")), 10);
    }
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38] {
        sheet.positions[0][1] = bad;
        for bytes in [sheet.stl("", |_| 0), sheet.stl_text()] {
            let loaded = read(&bytes).expect("a mesh");
            assert_eq!(triangle_count(&loaded), 7, "{bad}");
            assert!(
                loaded.warnings[0]
                    .message
                    .contains("3 triangles with vertices that are not finite"),
                "{:?}",
                loaded.warnings
            );
        }
    }
}

/// Protects: five bits per channel are sRGB codes in the order of each dialect; facets without a
/// colour have the header's colour in Magics, white in VisCAM; two bytes without the marker bit in
/// any facet are no colours.
#[test]
fn colours_of_both_dialects() {
    let facets = vec![[31, 0, 8], [0, 31, 0]];
    let sheet = PolygonMesh {
        facets,
        ..PolygonMesh::sheet(1)
    };
    let red = |colour: [u16; 3]| colour[0] == 31;
    let value_of = |header: &str, attribute: &dyn Fn([u16; 3]) -> u16| {
        let loaded = read(&sheet.stl(header, attribute)).expect("a mesh");
        mesh(&loaded)
            .colours
            .iter()
            .step_by(3)
            .map(|c| c.map(|c| (c * 1e4).round() as i32))
            .collect::<Vec<_>>()
    };
    // 8/31 in sRGB is 0.0542; codes 64 and 255 are 0.0513 and 1.
    assert_eq!(
        value_of("", &|c| if red(c) { 0x8000 | 31 << 10 | 8 } else { 77 }),
        [[10_000, 0, 542, 10_000], [10_000; 4]]
    );
    assert_eq!(
        value_of("COLOR=\u{0}@\u{7f}\u{0}", &|c| if red(c) {
            8 << 10 | 31
        } else {
            0x8000
        })[0],
        [10_000, 0, 542, 10_000]
    );
    assert_eq!(
        value_of("x COLOR=\u{0}@\u{0}\u{0}", &|c| if red(c) {
            0
        } else {
            0x8000
        })[1],
        [0, 513, 0, 10_000]
    );
    assert!(value_of("", &|_| 0x7fff).is_empty());
}

/// Protects: a convention of colours counts only where some facet has a colour by it. The top bit
/// alone in all facets is no colour, words of zeros leave the header's colour to all facets, and a
/// header's text is no colour. Code 127 in sRGB is 0.21223.
#[test]
fn words_without_a_colour_are_no_colours() {
    let sheet = PolygonMesh {
        facets: vec![[31, 0, 0], [0, 0, 0]],
        ..PolygonMesh::sheet(1)
    };
    type Attribute<'a> = &'a dyn Fn([u16; 3]) -> u16;
    let colours = |header: &[u8], attribute: Attribute| {
        let mut bytes = sheet.stl("", attribute);
        bytes[..header.len()].copy_from_slice(header);
        mesh(&read(&bytes).expect("a mesh")).colours.clone()
    };
    let some = |word: u16| move |colour: [u16; 3]| if colour[0] == 31 { word } else { 0 };
    let cases: [(&[u8], Attribute); 6] = [
        (b"STLB CAD 1.0", &|_| 0x8000),
        (b"", &some(0x8000)),
        (b"", &|_| 0),
        (b"part COLOR=none", &|_| 0),
        (b"part COLOR=none", &|_| 0x8000),
        (b"COLOR=red ", &some(0x1f)),
    ];
    for (header, attribute) in cases {
        assert!(colours(header, attribute).is_empty(), "{header:?}");
    }
    let header = b"COLOR=\x7f\x7f\x7f\xff MATERIAL=";
    let without: [Attribute; 2] = [&|_| 0, &|_| 0x8000];
    for attribute in without {
        let found = colours(header, attribute);
        assert!(
            found.len() == 6
                && found
                    .iter()
                    .flatten()
                    .all(|c| (c - 0.21223).abs() < 1e-4 || *c == 1.0),
            "{found:?}"
        );
    }
    let black = colours(header, &some(0x8000));
    assert_eq!(
        black[3],
        [0.0, 0.0, 0.0, 1.0],
        "some facets are marked, one is black"
    );
    assert_eq!(
        colours(b"COLOR=none", &some(0xfc00))[0],
        [1.0, 0.0, 0.0, 1.0]
    );
}

/// Protects: words of other programs, comments, and missing ends of loops and facets are passed
/// over, with a warning for the words and another for the ends.
#[test]
fn texts_of_other_programs_are_read() {
    let corners = "outer loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n";
    let facet = format!("facet normal 0 0 1\n{corners}endloop\nendfacet\n");
    let word = |line: usize, word: &str| {
        format!("line {line}: `{word}` is no keyword of STL; such words are ignored")
    };
    let ends =
        || "facets without `endloop` or `endfacet` end where the next facet begins".to_owned();
    for (text, warning) in [
        (
            facet
                .replace("endloop", "end loop")
                .replace("endfacet", "End Facet"),
            Some(word(7, "end")),
        ),
        (
            facet.replace("endfacet", "endfacet color 0.8 0.1 0.1"),
            Some(word(8, "color")),
        ),
        (
            format!("color 0.8 0.1 0.1\n{facet}"),
            Some(word(2, "color")),
        ),
        (
            facet.replace("facet normal 0 0 1", "facet normal 0 0 1 4 color red"),
            Some(word(2, "4")),
        ),
        (facet.replace("endfacet\n", ""), Some(ends())),
        (facet.replace("endloop\n", ""), Some(ends())),
        (format!("# facet vertex\n{facet}# vertex\n"), None),
        (facet.replace("vertex 1 0 0", "vertex 1 0 0 # vertex"), None),
        (
            facet.replace("normal 0 0 1", "normal -1.#IND 1.#QNAN 0"),
            None,
        ),
    ] {
        for solid in ["solid x", "# made by hand\n#\nsolid x"] {
            let whole = format!("{solid}\n{text}{text}endsolid x\n");
            let loaded = read(whole.as_bytes()).unwrap_or_else(|e| panic!("{whole}: {e}"));
            assert_eq!(triangle_count(&loaded), 2, "{whole}");
            let found: Vec<&str> = loaded.warnings.iter().map(|w| &*w.message).collect();
            assert_eq!(
                found.len(),
                usize::from(warning.is_some()),
                "{whole}: {found:?}"
            );
            if let (Some(warning), false) = (&warning, solid.contains('#')) {
                assert!(found[0].contains(warning), "{whole}: {found:?}");
            }
        }
    }
}
