//! A first walk over a glTF file's JSON that stores nothing: how much is there, and are its indices 32-bit numbers?

use std::borrow::Cow;
use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};

use crate::Limits;
use crate::import::{Fault, Outcome};

/// Memory that a value may take once it is typed data: a node of two characters, `{}`, becomes some 400 bytes, most values few.
const BYTES_A_VALUE: u64 = 256;

/// Counts the values of a JSON text and looks at its indices. Depth is bounded by serde_json itself, at 128 levels.
///
/// # Errors
/// A fault of kind input for text that is no JSON or an index of more than 32 bits; of kind limit for too many values.
pub(super) fn check(text: &[u8], limits: &Limits) -> Outcome<()> {
    let most = limits.memory_bytes / BYTES_A_VALUE;
    let mut walk = Walk { left: most, too_large: None };
    let mut json = serde_json::Deserializer::from_slice(text);
    let result = Value { walk: &mut walk, index: false }.deserialize(&mut json).and_then(|()| json.end());
    if walk.left == 0 {
        return Err(Fault::limit(format!("has more than {most} JSON values")));
    }
    if let Some(number) = walk.too_large {
        return Err(Fault::input(format!("refers to entry {number}, which no list can have")));
    }
    result.map_err(|e| Fault::input(format!("is no valid JSON: {e}")))
}

struct Walk {
    left: u64,
    too_large: Option<u64>,
}

/// One value; whether the key above it makes it an index.
struct Value<'w> {
    walk: &'w mut Walk,
    index: bool,
}

/// Keys whose numbers are indices or enumerations. Lists under them hold indices, too.
fn is_index(key: &str) -> bool {
    const KEYS: [&str; 25] = [
        "buffer",
        "bufferView",
        "camera",
        "children",
        "componentType",
        "index",
        "indices",
        "input",
        "inverseBindMatrices",
        "joints",
        "light",
        "material",
        "mesh",
        "mode",
        "node",
        "nodes",
        "output",
        "sampler",
        "scene",
        "skeleton",
        "skin",
        "source",
        "target",
        "texCoord",
        "variants",
    ];
    KEYS.contains(&key) || key.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_')
}

impl<'de> DeserializeSeed<'de> for Value<'_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        if self.walk.left <= 1 {
            self.walk.left = 0;
            return Err(serde::de::Error::custom("too many values"));
        }
        self.walk.left -= 1;
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Value<'_> {
    type Value = ();
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }
    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }
    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }
    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }
    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        Ok(())
    }
    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }
    fn visit_u64<E>(self, number: u64) -> Result<(), E> {
        if self.index && number > u64::from(u32::MAX) {
            self.walk.too_large = Some(number);
        }
        Ok(())
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        while seq.next_element_seed(Value { walk: self.walk, index: self.index })?.is_some() {}
        Ok(())
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(key) = map.next_key::<Cow<'de, str>>()? {
            map.next_value_seed(Value { walk: self.walk, index: is_index(&key) })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `gltf::json` would read 2³² as entry 0 and show the wrong mesh.
    #[test]
    fn indices_beyond_32_bits_are_refused() {
        let limits = Limits::default();
        assert!(check(br#"{"nodes":[{"mesh":4294967296}]}"#, &limits).is_err());
        assert!(check(br#"{"meshes":[{"primitives":[{"attributes":{"POSITION":4294967296}}]}]}"#, &limits).is_err());
        assert!(check(br#"{"nodes":[{"translation":[4294967296,0,0]}],"perspective":{"zfar":10000000000}}"#, &limits).is_ok());
    }

    /// Neither depth nor number of values is trusted.
    #[test]
    fn depth_and_number_are_bounded() {
        let limits = Limits { memory_bytes: 1000 * BYTES_A_VALUE, ..Limits::default() };
        let deep = [vec![b'['; 100_000], vec![b']'; 100_000]].concat();
        assert!(check(&deep, &Limits::default()).is_err());
        let many = format!("[{}0]", "0,".repeat(2000));
        assert_eq!(check(many.as_bytes(), &limits).unwrap_err().kind, crate::import::FaultKind::Limit);
        assert!(check(b"[0,0] x", &limits).is_err(), "text after the value");
    }
}
