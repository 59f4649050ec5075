//! A mesh written in every format that can represent it: both kinds of STL, all three of PLY, OBJ.

use std::path::{Path, PathBuf};

/// A mesh of polygons.
#[derive(Clone, Default)]
pub struct PolygonMesh {
    pub positions: Vec<[f32; 3]>,
    pub faces: Vec<Vec<u32>>,
    /// Normals of vertices; empty: not written.
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub colours: Vec<[u8; 3]>,
    /// Colours of faces, with 5 bits per channel.
    pub facets: Vec<[u16; 3]>,
}

/// Encodings of PLY.
pub const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

impl PolygonMesh {
    /// A bumpy sheet of n × n squares, each of two triangles, with coordinates that few decimal
    /// digits represent exactly.
    pub fn sheet(n: u32) -> Self {
        let corner = |i: u32| {
            let (x, y) = (i % (n + 1), i / (n + 1));
            [
                x as f32 / 4.0,
                y as f32 / 4.0,
                ((x * 7 + y * 5) % 11) as f32 / 16.0,
            ]
        };
        let square = |i: u32| {
            let a = i / n * (n + 1) + i % n;
            [vec![a, a + 1, a + n + 1], vec![a + 1, a + n + 2, a + n + 1]]
        };
        Self {
            positions: (0..(n + 1) * (n + 1)).map(corner).collect(),
            faces: (0..n * n).flat_map(square).collect(),
            ..Self::default()
        }
    }

    /// Adds colours to all vertices.
    pub fn coloured(mut self) -> Self {
        self.colours = (0..self.positions.len())
            .map(|i| [i * 37, i * 91, 255 - i].map(|code| code as u8))
            .collect();
        self
    }

    pub fn obj(&self) -> Vec<u8> {
        let mut out = String::from("# written\n");
        for (i, [x, y, z]) in self.positions.iter().enumerate() {
            let colour = self
                .colours
                .get(i)
                .map(|[r, g, b]| format!(" {r} {g} {b}"))
                .unwrap_or_default();
            out += &format!("v {x} {y} {z}{colour}\n");
        }
        self.uvs
            .iter()
            .for_each(|[u, v]| out += &format!("vt {u} {v}\n"));
        self.normals
            .iter()
            .for_each(|[x, y, z]| out += &format!("vn {x} {y} {z}\n"));
        for face in &self.faces {
            let corner = |i: &u32| match (self.uvs.is_empty(), self.normals.is_empty()) {
                (true, true) => format!(" {}", i + 1),
                (true, false) => format!(" {0}//{0}", i + 1),
                (false, true) => format!(" {0}/{0}", i + 1),
                (false, false) => format!(" {0}/{0}/{0}", i + 1),
            };
            out += &format!("f{}\n", face.iter().map(corner).collect::<String>());
        }
        out.into_bytes()
    }

    /// Encodes as PLY with more header lines.
    pub fn ply(&self, encoding: &str, comment: &str) -> Vec<u8> {
        let mut out = format!(
            "ply\nformat {encoding} 1.0\n{comment}element vertex {}\n",
            self.positions.len()
        );
        let mut properties = |names: &[&str], kind: &str, there: bool| {
            names
                .iter()
                .filter(|_| there)
                .for_each(|name| out += &format!("property {kind} {name}\n"));
        };
        properties(&["x", "y", "z"], "float", true);
        properties(&["nx", "ny", "nz"], "float", !self.normals.is_empty());
        properties(&["u", "v"], "float", !self.uvs.is_empty());
        properties(&["red", "green", "blue"], "uchar", !self.colours.is_empty());
        out += &format!(
            "element face {}\nproperty list uchar int vertex_indices\n",
            self.faces.len()
        );
        let own = !self.facets.is_empty();
        ["red", "green", "blue"]
            .iter()
            .filter(|_| own)
            .for_each(|name| out += &format!("property float {name}\n"));
        let mut data = Numbers {
            encoding: encoding.to_owned(),
            out: (out + "end_header\n").into_bytes(),
        };
        for i in 0..self.positions.len() {
            self.positions[i].iter().for_each(|&c| data.float(c));
            self.normals
                .get(i)
                .into_iter()
                .flatten()
                .for_each(|&c| data.float(c));
            self.uvs
                .get(i)
                .into_iter()
                .flatten()
                .for_each(|&c| data.float(c));
            self.colours
                .get(i)
                .into_iter()
                .flatten()
                .for_each(|&code| data.byte(code));
            data.end();
        }
        for (i, face) in self.faces.iter().enumerate() {
            data.byte(face.len() as u8);
            face.iter().for_each(|&vertex| data.int(vertex));
            self.facets
                .get(i)
                .into_iter()
                .flatten()
                .for_each(|&five| data.float(f32::from(five) / 31.0));
            data.end();
        }
        data.out
    }

    /// Encodes as binary STL; `attribute` gives the two bytes of a facet from its colour.
    pub fn stl(&self, header: &str, attribute: impl Fn([u16; 3]) -> u16) -> Vec<u8> {
        let mut out = header.as_bytes().to_vec();
        out.resize(80, 0);
        out.extend((self.faces.len() as u32).to_le_bytes());
        for (i, face) in self.faces.iter().enumerate() {
            let corners = face
                .iter()
                .flat_map(|&vertex| self.positions[vertex as usize]);
            out.extend(
                [0.0; 3]
                    .into_iter()
                    .chain(corners)
                    .flat_map(f32::to_le_bytes),
            );
            out.extend(
                self.facets
                    .get(i)
                    .map_or(0, |&colour| attribute(colour))
                    .to_le_bytes(),
            );
        }
        out
    }

    pub fn stl_text(&self) -> Vec<u8> {
        let mut out = String::from("solid a facet of words\n");
        for face in &self.faces {
            let corner = |&vertex: &u32| {
                let [x, y, z] = self.positions[vertex as usize];
                format!("      vertex {x} {y} {z}\n")
            };
            let corners: String = face.iter().map(corner).collect();
            out += &format!(
                "  facet normal 0 0 0\n    outer loop\n{corners}    endloop\n  endfacet\n"
            );
        }
        (out + "endsolid a facet of words\n").into_bytes()
    }
}

struct Numbers {
    encoding: String,
    out: Vec<u8>,
}

impl Numbers {
    fn put(&mut self, text: String, mut little: Vec<u8>) {
        if self.encoding == "binary_big_endian" {
            little.reverse();
        }
        self.out.extend(if self.encoding == "ascii" {
            (text + " ").into_bytes()
        } else {
            little
        });
    }

    fn float(&mut self, value: f32) {
        self.put(value.to_string(), value.to_le_bytes().to_vec());
    }

    fn int(&mut self, value: u32) {
        self.put(value.to_string(), value.to_le_bytes().to_vec());
    }

    fn byte(&mut self, value: u8) {
        self.put(value.to_string(), vec![value]);
    }

    fn end(&mut self) {
        self.out.extend((self.encoding == "ascii").then_some(b'\n'));
    }
}

/// Writes small files of both formats, of every kind, to a folder.
pub fn models(folder: &Path) -> Vec<PathBuf> {
    let facets = vec![
        [31, 0, 0],
        [3, 9, 27],
        [0, 0, 0],
        [1, 2, 3],
        [31, 31, 31],
        [30, 20, 10],
        [0, 31, 0],
        [5, 5, 5],
    ];
    let sheet = PolygonMesh {
        facets,
        ..PolygonMesh::sheet(2).coloured()
    };
    let plain = PolygonMesh {
        facets: Vec::new(),
        ..sheet.clone()
    };
    let own = |colour: [u16; 3]| 0x8000 | colour[0] << 10 | colour[1] << 5 | colour[2];
    let mut files = vec![
        ("words.stl", sheet.stl_text()),
        (
            "solid.stl",
            sheet.stl("solid, and binary all the same", own),
        ),
        (
            "magics.stl",
            sheet.stl("COLOR=\u{1}\u{2}\u{3}\u{4} of a part", |colour| {
                own(colour) & 0x7fff
            }),
        ),
    ];
    for (name, encoding) in ["words.ply", "little.ply", "big.ply"]
        .into_iter()
        .zip(ENCODINGS)
    {
        files.push((name, sheet.ply(encoding, "comment of words\n")));
        files.push((
            ["plain", name].concat().leak(),
            plain.ply(encoding, "obj_info more\ncomment TextureFile two.png\n"),
        ));
    }
    let write = |(name, bytes): (&str, Vec<u8>)| {
        std::fs::write(folder.join(name), bytes).expect("a file");
        folder.join(name)
    };
    files.into_iter().map(write).collect()
}
