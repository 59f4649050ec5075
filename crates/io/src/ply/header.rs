//! Header of a PLY file: ASCII lines that list the elements in order, with their properties.

use crate::import::{Fault, Outcome, printable};

/// Largest number of elements, of properties per element and of images: more than any real file
/// has, and few enough for the memory.
const MOST: usize = 1000;
/// Largest length of a header line in bytes.
const LONGEST: usize = 4096;

/// Encoding of the data after the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Number types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl NumberType {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Size in a binary file, in bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Code of the value 1 in number types that store fractions as codes: 255 or 65535.
    pub fn whole(self) -> Option<f32> {
        match self {
            Self::U8 => Some(255.0),
            Self::U16 => Some(65535.0),
            _ => None,
        }
    }

    fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// Property of a PLY element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    /// Number type of the length of a list; `None` for a single number.
    pub count: Option<NumberType>,
    pub number: NumberType,
}

/// A PLY element: a sequence of items with the same properties.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

/// A parsed PLY header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PlyHeader {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Image files of the mesh, from MeshLab's comments.
    pub images: Vec<String>,
    /// Length of the header in bytes and in lines.
    pub bytes: usize,
    pub lines: usize,
}

/// Reads the header of a file.
///
/// # Errors
/// A fault of kind input that names line and cause.
pub(super) fn read(bytes: &[u8]) -> Outcome<PlyHeader> {
    let mut header = PlyHeader {
        encoding: Encoding::Ascii,
        elements: Vec::new(),
        images: Vec::new(),
        bytes: 0,
        lines: 0,
    };
    let mut format = None;
    // Binary data starts right after the last line, and may start with a line-feed byte. Therefore
    // all lines must end as the first line does.
    let end: &[u8] = match bytes.get(3..5) {
        Some([b'\r', next]) if *next != b'\n' => b"\r",
        _ => b"\n",
    };
    loop {
        let rest = bytes.get(header.bytes..).unwrap_or_default();
        let window = rest.get(..rest.len().min(LONGEST)).unwrap_or_default();
        let length = window.windows(end.len()).position(|part| part == end);
        let length = length.ok_or_else(|| {
            Fault::input(format!(
                "line {}: the header has no end_header",
                header.lines + 1
            ))
        })?;
        let line = String::from_utf8_lossy(&window[..length]);
        (header.bytes, header.lines) = (header.bytes + length + end.len(), header.lines + 1);
        let number = header.lines;
        let place = |fault: Fault| fault.with_place(format_args!("line {number}"));
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words.as_slice() {
            ["ply"] if number == 1 => {}
            _ if number == 1 => {
                return Err(Fault::input("is no PLY file: it does not begin with `ply`"));
            }
            ["end_header"] => break,
            ["comment", key, _, ..] if key.eq_ignore_ascii_case("TextureFile") => {
                if header.images.len() >= MOST {
                    return Err(place(Fault::limit(format!("has more than {MOST} images"))));
                }
                header.images.push(
                    line.split_once(key)
                        .map_or("", |(_, name)| name.trim())
                        .to_owned(),
                );
            }
            [] | ["comment" | "obj_info", ..] => {}
            ["format", name, version] => format = Some(encoding(name, version).map_err(place)?),
            ["element", name, count] => header.element(name, count).map_err(place)?,
            ["property", rest @ ..] => header.property(rest).map_err(place)?,
            _ => {
                return Err(place(Fault::input(format!(
                    "`{}` is no line of a PLY header",
                    printable(line.trim())
                ))));
            }
        }
    }
    header.encoding = format.ok_or_else(|| Fault::input("its header has no `format` line"))?;
    Ok(header)
}

fn encoding(name: &str, version: &str) -> Outcome<Encoding> {
    if version != "1.0" {
        return Err(Fault::input(format!(
            "is PLY {}; version 1.0 is read",
            printable(version)
        )));
    }
    match name {
        "ascii" => Ok(Encoding::Ascii),
        "binary_little_endian" => Ok(Encoding::LittleEndian),
        "binary_big_endian" => Ok(Encoding::BigEndian),
        _ => Err(Fault::input(format!(
            "the format `{}` is none of ascii, binary_little_endian and binary_big_endian",
            printable(name)
        ))),
    }
}

impl PlyHeader {
    fn element(&mut self, name: &str, count: &str) -> Outcome<()> {
        let count = count.parse().map_err(|_| {
            Fault::input(format!("`{}` is no number of elements", printable(count)))
        })?;
        if self.elements.iter().any(|element| element.name == name) {
            return Err(Fault::input(format!(
                "there are two elements `{}`",
                printable(name)
            )));
        }
        if self.elements.len() >= MOST {
            return Err(Fault::limit(format!("has more than {MOST} elements")));
        }
        self.elements.push(Element {
            name: name.to_owned(),
            count,
            properties: Vec::new(),
        });
        Ok(())
    }

    fn property(&mut self, words: &[&str]) -> Outcome<()> {
        let element = self
            .elements
            .last_mut()
            .ok_or_else(|| Fault::input("a property of no element"))?;
        let number = |name: &str| {
            NumberType::of(name)
                .ok_or_else(|| Fault::input(format!("`{}` is no type of numbers", printable(name))))
        };
        let (name, count, number) = match *words {
            ["list", count, item, name] => (name, Some(number(count)?), number(item)?),
            [kind, name] => (name, None, number(kind)?),
            _ => {
                return Err(Fault::input(
                    "a property has a type and a name, or is a list of two types and a name",
                ));
            }
        };
        if count.is_some_and(NumberType::is_float) {
            return Err(Fault::input(format!(
                "the list `{}` is counted in fractions",
                printable(name)
            )));
        }
        if element
            .properties
            .iter()
            .any(|property| property.name == name)
        {
            return Err(Fault::input(format!(
                "the element `{}` has two properties `{}`",
                printable(&element.name),
                printable(name)
            )));
        }
        if element.properties.len() >= MOST {
            return Err(Fault::limit(format!(
                "has more than {MOST} properties of one element"
            )));
        }
        element.properties.push(Property {
            name: name.to_owned(),
            count,
            number,
        });
        Ok(())
    }
}
