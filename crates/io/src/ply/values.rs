//! The numbers behind a PLY header, one after the other, whatever they are written in.

use super::header::{Element, Encoding, Number, PlyHeader, Property};
use crate::import::{Fault, Outcome, shown};
use crate::text::{no_number, number};

/// What is left of a file's numbers.
pub(super) struct Values<'b> {
    rest: &'b [u8],
    encoding: Encoding,
    /// Line at hand of a text, from 1.
    line: usize,
}

impl<'b> Values<'b> {
    /// All that follows a header.
    pub fn behind(header: &PlyHeader, bytes: &'b [u8]) -> Self {
        Self {
            rest: bytes.get(header.bytes..).unwrap_or_default(),
            encoding: header.encoding,
            line: header.lines + 1,
        }
    }

    /// Bytes that are left, without the blanks at the end of a text.
    pub fn left(&self) -> usize {
        if self.encoding == Encoding::Ascii {
            self.rest.trim_ascii().len()
        } else {
            self.rest.len()
        }
    }

    /// Where the reader is, for messages: a line of a text.
    pub fn place(&self, element: &Element, index: u64) -> String {
        match self.encoding {
            Encoding::Ascii => format!("line {}: {} {index}", self.line, shown(&element.name)),
            _ => format!("{} {index}", shown(&element.name)),
        }
    }

    /// Refuses a count of elements for which there are not enough bytes, before anything is made
    /// for them.
    ///
    /// # Errors
    /// A fault of kind input.
    pub fn expect(&self, element: &Element) -> Outcome<()> {
        let least = |number: Number| {
            if self.encoding == Encoding::Ascii {
                2
            } else {
                number.size()
            }
        };
        let each: usize = element
            .properties
            .iter()
            .map(|property| least(property.count.unwrap_or(property.number)))
            .sum();
        // The last number of a text needs nothing behind it.
        if u128::from(element.count) * each as u128 > self.rest.len() as u128 + 1 {
            let (name, count) = (shown(&element.name), element.count);
            return Err(Fault::input(format!(
                "is cut off: {count} of `{name}` do not fit into the {} bytes left",
                self.rest.len()
            )));
        }
        Ok(())
    }

    /// The next number.
    ///
    /// # Errors
    /// A fault of kind input where there is none.
    pub fn number(&mut self, kind: Number, name: &str) -> Outcome<f64> {
        if self.encoding == Encoding::Ascii {
            let word = String::from_utf8_lossy(self.word()?);
            return parsed(&word, kind).ok_or_else(|| no_number(&shown(name), &word));
        }
        let (bytes, rest) = self
            .rest
            .split_at_checked(kind.size())
            .ok_or_else(cut_off)?;
        self.rest = rest;
        let mut number = [0; 8];
        number[..bytes.len()].copy_from_slice(bytes);
        if self.encoding == Encoding::BigEndian {
            number[..bytes.len()].reverse();
        }
        let [a, b, c, d, ..] = number;
        Ok(match kind {
            Number::I8 => i8::from_le_bytes([a]).into(),
            Number::U8 => a.into(),
            Number::I16 => i16::from_le_bytes([a, b]).into(),
            Number::U16 => u16::from_le_bytes([a, b]).into(),
            Number::I32 => i32::from_le_bytes([a, b, c, d]).into(),
            Number::U32 => u32::from_le_bytes([a, b, c, d]).into(),
            Number::F32 => f32::from_le_bytes([a, b, c, d]).into(),
            Number::F64 => f64::from_le_bytes(number),
        })
    }

    /// How many items a list has, which are all there as far as bytes tell.
    ///
    /// # Errors
    /// A fault of kind input for a negative number, and for more than there can be.
    pub fn count(&mut self, kind: Number, item: Number, name: &str) -> Outcome<usize> {
        let count = self.number(kind, name)?;
        let least = if self.encoding == Encoding::Ascii {
            2
        } else {
            item.size()
        };
        if count < 0.0
            || count.fract() != 0.0
            || count * least as f64 > self.rest.len() as f64 + 1.0
        {
            return Err(Fault::input(format!(
                "{}: {count} items, which are not there",
                shown(name)
            )));
        }
        Ok(count as usize)
    }

    /// Passes over a whole element.
    ///
    /// # Errors
    /// A fault of kind input where the file ends before it does.
    pub fn skip(&mut self, element: &Element) -> Outcome<()> {
        // Of nothing there may be as many as numbers can say.
        for index in 0..if element.properties.is_empty() {
            0
        } else {
            element.count
        } {
            for property in &element.properties {
                self.skip_property(property)
                    .map_err(|fault| fault.at(self.place(element, index)))?;
            }
        }
        Ok(())
    }

    /// Passes over what a property says.
    ///
    /// # Errors
    /// As [`Self::number`].
    pub fn skip_property(&mut self, property: &Property) -> Outcome<()> {
        let Property {
            name,
            count,
            number,
        } = property;
        let items = count.map_or(Ok(1), |count| self.count(count, *number, name))?;
        for _ in 0..items {
            self.number(*number, name)?;
        }
        Ok(())
    }

    /// The next word of a text.
    fn word(&mut self) -> Outcome<&'b [u8]> {
        let blank = self
            .rest
            .iter()
            .take_while(|byte| byte.is_ascii_whitespace());
        // Lines that end by carriage returns alone count as one.
        let (skipped, lines) = blank.fold((0, 0), |(all, lines), &byte| {
            (all + 1, lines + usize::from(byte == b'\n'))
        });
        self.line += lines;
        let start = self.rest.get(skipped..).unwrap_or_default();
        let length = start
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(start.len());
        let (word, rest) = start.split_at(length);
        self.rest = rest;
        if word.is_empty() {
            Err(cut_off())
        } else {
            Ok(word)
        }
    }
}

fn cut_off() -> Fault {
    Fault::input("the file ends here")
}

/// A word as a number of a type. One of single precision is rounded once, as in other formats.
fn parsed(word: &str, kind: Number) -> Option<f64> {
    match kind {
        // As written: a text may have more digits than the type that it names.
        Number::F32 | Number::F64 => number(word).map(|(_, value)| value),
        // Some programs write whole numbers as `255.0`.
        _ => word
            .parse::<i64>()
            .map(|value| value as f64)
            .ok()
            .or_else(|| word.parse().ok().filter(|value: &f64| value.fract() == 0.0)),
    }
}
