//! Limits on the resources that a file may use.

/// Upper limits for loading. Input beyond a limit gives an error of kind
/// [`ErrorKind::Limit`](crate::ErrorKind::Limit), instead of a crash or swapping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of a native scene's text. Parsing takes about thirty times that memory.
    pub text_bytes: u64,
    /// Bytes of any other single file: a model, a buffer, an image.
    pub file_bytes: u64,
    /// Objects of a scene, including the objects of generators and every instance.
    pub objects: u64,
    /// Triangles of all meshes together, each mesh counted once.
    pub triangles: u64,
    /// Pixels of an image.
    pub image_pixels: u64,
    /// Bytes of everything loaded; `--max-memory`.
    pub memory_bytes: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            text_bytes: 64 << 20,
            file_bytes: 1 << 30,
            objects: 16_000_000,
            triangles: 100_000_000,
            image_pixels: 1 << 28,
            memory_bytes: 8 << 30,
        }
    }
}

/// Formats a number of bytes for people: `64 MiB`, `1.5 GiB`, `300 bytes`.
pub fn format_bytes(bytes: u64) -> String {
    const UNITS: [(&str, u32); 3] = [("GiB", 30), ("MiB", 20), ("KiB", 10)];
    match UNITS.iter().find(|(_, shift)| bytes >> shift > 0) {
        Some((unit, shift)) => {
            let tenths = ((bytes as f64 / (1u64 << shift) as f64) * 10.0).round();
            format!("{} {unit}", tenths / 10.0)
        }
        None if bytes == 1 => "1 byte".to_owned(),
        None => format!("{bytes} bytes"),
    }
}

#[cfg(test)]
mod tests {
    use super::format_bytes;

    /// Protects: sizes are formatted with a short number and unit.
    #[test]
    fn sizes_read_as_a_person_writes_them() {
        let cases = [
            (0, "0 bytes"),
            (1, "1 byte"),
            (1023, "1023 bytes"),
            (1536, "1.5 KiB"),
            (64 << 20, "64 MiB"),
            (1 << 30, "1 GiB"),
        ];
        for (bytes, text) in cases {
            assert_eq!(format_bytes(bytes), text);
        }
    }
}
