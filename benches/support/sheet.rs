//! A GLB file of any number of triangles, written without holding it in memory.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a wavy sheet of `side`² squares, of two triangles each, with normals and texture
/// coordinates: one primitive with 32-bit indices.
pub fn write(path: &Path, side: u32) -> io::Result<()> {
    let row = side + 1;
    let (vertices, triangles) = (u64::from(row).pow(2), 2 * u64::from(side).pow(2));
    let sizes = [12 * vertices, 12 * vertices, 8 * vertices, 12 * triangles];
    let offset = |list: usize| sizes[..list].iter().sum::<u64>();
    let view = |list: usize| {
        format!(
            r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#,
            offset(list),
            sizes[list]
        )
    };
    let accessor = |list: usize, kind: &str, component: u32, count: u64| {
        format!(
            r#"{{"bufferView":{list},"type":"{kind}","componentType":{component},"count":{count}}}"#
        )
    };
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3}}]}}],
        "buffers":[{{"byteLength":{}}}],"bufferViews":[{},{},{},{}],"accessors":[{},{},{},{}]}}"#,
        offset(4),
        view(0),
        view(1),
        view(2),
        view(3),
        accessor(0, "VEC3", 5126, vertices),
        accessor(1, "VEC3", 5126, vertices),
        accessor(2, "VEC2", 5126, vertices),
        accessor(3, "SCALAR", 5125, 3 * triangles),
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let mut out = BufWriter::new(File::create(path)?);
    let word = |x: u64| (x as u32).to_le_bytes();
    out.write_all(b"glTF")?;
    for number in [2, 28 + json.len() as u64 + offset(4), json.len() as u64] {
        out.write_all(&word(number))?;
    }
    out.write_all(b"JSON")?;
    out.write_all(json.as_bytes())?;
    out.write_all(&word(offset(4)))?;
    out.write_all(b"BIN\0")?;
    let places =
        || (0..row).flat_map(|j| (0..row).map(move |i| [i, j].map(|x| x as f32 / side as f32)));
    let floats = |out: &mut BufWriter<File>, list: &[f32]| {
        list.iter()
            .try_for_each(|x| out.write_all(&x.to_le_bytes()))
    };
    for [x, y] in places() {
        floats(
            &mut out,
            &[x, 0.05 * (40.0 * x).sin() * (37.0 * y).sin(), y],
        )?;
    }
    for _ in places() {
        floats(&mut out, &[0.0, 1.0, 0.0])?;
    }
    for place in places() {
        floats(&mut out, &place)?;
    }
    for [a, b] in (0..side).flat_map(|j| (0..side).map(move |i| [j * row + i, (j + 1) * row + i])) {
        for index in [a, b, a + 1, a + 1, b, b + 1] {
            out.write_all(&index.to_le_bytes())?;
        }
    }
    out.flush()
}
