//! Header of a PLY file: ASCII lines that list the elements in order, with their properties.

use crate::import::{Fault, FaultPlace, ImportResult, Warnings, sanitise_text};

/// Largest number of elements, of properties per element and of images. No real file has as many,
/// and their memory is small.
const MAX_DECLARATIONS: usize = 1000;
/// Largest length of a header line in bytes.
const MAX_LINE_BYTES: usize = 4096;

/// Encoding of the data after the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlyEncoding {
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
    fn from_name(name: &str) -> Option<Self> {
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

    /// Returns the integer that stands for the value 1 if this number type stores fractions: 255 or
    /// 65535; `None` for number types that store the value itself.
    pub fn unorm_max(self) -> Option<f32> {
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
pub(super) struct PlyProperty {
    pub name: String,
    /// Number type of a list's length; `None` if the property is a single number.
    pub count: Option<NumberType>,
    pub number: NumberType,
}

/// A PLY element: a sequence of items with the same properties.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PlyElement {
    pub name: String,
    pub count: u64,
    pub properties: Vec<PlyProperty>,
}

impl PlyElement {
    /// Returns the number of items to read. Items without properties take no bytes. A file can
    /// claim any number of such items, so that they are not counted through.
    pub fn item_count(&self) -> u64 {
        match self.properties.is_empty() {
            true => 0,
            false => self.count,
        }
    }
}

/// A parsed PLY header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PlyHeader {
    pub encoding: PlyEncoding,
    pub elements: Vec<PlyElement>,
    /// Names of the mesh's image files, from comments that MeshLab writes.
    pub images: Vec<String>,
    /// Length of the header in bytes.
    pub bytes: usize,
    /// Length of the header in lines.
    pub lines: usize,
}

/// Reads the header of a file.
///
/// # Errors
/// A fault of kind input that names line and cause.
pub(super) fn read_header(bytes: &[u8], warnings: &mut Warnings) -> ImportResult<PlyHeader> {
    let mut header = PlyHeader {
        encoding: PlyEncoding::Ascii,
        elements: Vec::new(),
        images: Vec::new(),
        bytes: 0,
        lines: 0,
    };
    // Binary data starts right after the last line, and may start with a line-feed byte. Therefore
    // all lines must end as the first line does.
    let end: &[u8] = match bytes.get(3..5) {
        Some([b'\r', next]) if *next != b'\n' => b"\r",
        _ => b"\n",
    };
    let (mut format, mut unknown_line) = (None, None);
    loop {
        let rest = bytes.get(header.bytes..).unwrap_or_default();
        let window = rest
            .get(..rest.len().min(MAX_LINE_BYTES))
            .unwrap_or_default();
        let length = window.windows(end.len()).position(|part| part == end);
        let length = length
            .ok_or_else(|| fault!("line {}: the header has no end_header", header.lines + 1))?;
        let line = String::from_utf8_lossy(&window[..length]);
        (header.bytes, header.lines) = (header.bytes + length + end.len(), header.lines + 1);
        let number = header.lines;
        match line.trim_ascii() {
            "ply" if number == 1 => {}
            _ if number == 1 => {
                return Err(fault!("is no PLY file: it does not begin with `ply`"));
            }
            "end_header" => break,
            line => header
                .read_line(line, &mut format, &mut unknown_line)
                .with_place(format_args!("line {number}"))?,
        }
    }
    header.encoding = format.ok_or_else(|| fault!("its header has no `format` line"))?;
    match unknown_line {
        Some(line) if header.elements.is_empty() => return Err(Fault::invalid_input(line)),
        Some(line) => warn!(warnings, Format, "{line}; such lines are read as comments"),
        None => {}
    }
    Ok(header)
}

/// Whether the words of a header line, which has no meaning, may be a misspelt declaration.
fn resembles_declaration(words: &[&str]) -> bool {
    match *words {
        ["format" | "element" | "property", ..] => true,
        [_, kind, ..] if kind == "list" || NumberType::from_name(kind).is_some() => true,
        [_, _, count] => count.parse::<u64>().is_ok(),
        _ => false,
    }
}

fn parse_encoding(name: &str, version: &str) -> ImportResult<PlyEncoding> {
    if version != "1.0" {
        return Err(fault!(
            "is PLY version {}, but only version 1.0 is supported",
            sanitise_text(version)
        ));
    }
    match name {
        "ascii" => Ok(PlyEncoding::Ascii),
        "binary_little_endian" => Ok(PlyEncoding::LittleEndian),
        "binary_big_endian" => Ok(PlyEncoding::BigEndian),
        _ => Err(fault!(
            "the format `{}` is none of ascii, binary_little_endian and binary_big_endian",
            sanitise_text(name)
        )),
    }
}

impl PlyHeader {
    /// Reads a line between the first and the last. A line that lacks the word `comment` is stored
    /// in `unknown_line`, with its number, if it is the first.
    fn read_line(
        &mut self,
        line: &str,
        format: &mut Option<PlyEncoding>,
        unknown_line: &mut Option<String>,
    ) -> ImportResult<()> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words.as_slice() {
            ["comment", key, _, ..] if key.eq_ignore_ascii_case("TextureFile") => {
                if self.images.len() >= MAX_DECLARATIONS {
                    return Err(Fault::over_limit(format!(
                        "has more than {MAX_DECLARATIONS} images (lines `comment TextureFile`)"
                    )));
                }
                let name = line.split_once(key).map_or("", |(_, name)| name.trim());
                self.images.push(name.to_owned());
            }
            [] | ["comment" | "obj_info", ..] => {}
            ["format", name, version] => *format = Some(parse_encoding(name, version)?),
            ["element", name, count] => self.add_element(name, count)?,
            ["property", rest @ ..] => self.add_property(rest)?,
            words => {
                let message = format!(
                    "`{}` is not a valid line of a PLY header",
                    sanitise_text(line)
                );
                if resembles_declaration(words) {
                    return Err(Fault::invalid_input(message));
                }
                unknown_line.get_or_insert(format!("line {}: {message}", self.lines));
            }
        }
        Ok(())
    }

    fn add_element(&mut self, name: &str, count: &str) -> ImportResult<()> {
        let count = count.parse().map_err(|_| {
            fault!(
                "the number of elements is `{}`, but must be a whole number",
                sanitise_text(count)
            )
        })?;
        if self.elements.iter().any(|element| element.name == name) {
            return Err(fault!(
                "the element `{}` is declared twice",
                sanitise_text(name)
            ));
        }
        if self.elements.len() >= MAX_DECLARATIONS {
            return Err(Fault::over_limit(format!(
                "has more than {MAX_DECLARATIONS} elements"
            )));
        }
        self.elements.push(PlyElement {
            name: name.to_owned(),
            count,
            properties: Vec::new(),
        });
        Ok(())
    }

    fn add_property(&mut self, words: &[&str]) -> ImportResult<()> {
        let element = self
            .elements
            .last_mut()
            .ok_or_else(|| fault!("a property stands before the first element"))?;
        let number = |name: &str| {
            NumberType::from_name(name).ok_or_else(|| {
                fault!(
                    "`{}` is not a number type of PLY, such as int, uchar or float",
                    sanitise_text(name)
                )
            })
        };
        let (name, count, number) = match *words {
            ["list", count, item, name] => (name, Some(number(count)?), number(item)?),
            [kind, name] => (name, None, number(kind)?),
            _ => {
                return Err(fault!(
                    "expected `property TYPE NAME` or `property list COUNT_TYPE ITEM_TYPE NAME`"
                ));
            }
        };
        if count.is_some_and(NumberType::is_float) {
            return Err(fault!(
                "the length of the list `{}` has a floating-point type, but needs an integer type",
                sanitise_text(name)
            ));
        }
        if element
            .properties
            .iter()
            .any(|property| property.name == name)
        {
            return Err(fault!(
                "the element `{}` declares the property `{}` twice",
                sanitise_text(&element.name),
                sanitise_text(name)
            ));
        }
        if element.properties.len() >= MAX_DECLARATIONS {
            return Err(Fault::over_limit(format!(
                "an element has more than {MAX_DECLARATIONS} properties"
            )));
        }
        element.properties.push(PlyProperty {
            name: name.to_owned(),
            count,
            number,
        });
        Ok(())
    }
}
