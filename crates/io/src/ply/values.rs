//! Reading of the numbers that follow a PLY header, in each of the three encodings.

use super::header::{NumberType, PlyElement, PlyEncoding, PlyHeader, PlyProperty};
use crate::import::{Fault, ImportResult, sanitise_text};
use crate::text::{not_a_number_fault, parse_number_prefix, split_lines};

/// The part of a PLY file that is not read yet.
pub(super) struct ValueStream<'b> {
    rest: &'b [u8],
    encoding: PlyEncoding,
    /// Current line of an ASCII file, from 1.
    line: usize,
    /// Whether an ASCII file has as many lines as items, so that each item has its own line.
    has_item_lines: bool,
    /// First line with more numbers than the header names.
    pub surplus_line: Option<usize>,
}

impl<'b> ValueStream<'b> {
    /// Creates the stream of the data after the header.
    pub fn after_header(header: &PlyHeader, bytes: &'b [u8]) -> Self {
        let rest = bytes.get(header.bytes..).unwrap_or_default();
        let items = header.elements.iter().map(PlyElement::item_count);
        let lines = || split_lines(rest).filter(|line| !line.trim_ascii().is_empty());
        Self {
            rest,
            encoding: header.encoding,
            line: header.lines + 1,
            has_item_lines: header.encoding == PlyEncoding::Ascii
                && items.fold(0, u64::saturating_add) == lines().count() as u64,
            surplus_line: None,
        }
    }

    /// Returns the number of bytes that are not read yet, without the white space at the end of an
    /// ASCII file.
    pub fn remaining_bytes(&self) -> usize {
        if self.encoding == PlyEncoding::Ascii {
            self.rest.trim_ascii().len()
        } else {
            self.rest.len()
        }
    }

    /// Describes the current position for messages: the element's name and the index of its item;
    /// in an ASCII file also the line.
    fn describe_position(&self, element: &PlyElement, index: u64) -> String {
        match self.encoding {
            PlyEncoding::Ascii => format!(
                "line {}: {} {index}",
                self.line,
                sanitise_text(&element.name)
            ),
            _ => format!("{} {index}", sanitise_text(&element.name)),
        }
    }

    /// Refuses an element with more items than the remaining bytes can hold. Called before any
    /// allocation.
    ///
    /// # Errors
    ///
    /// A fault of kind input if the element has too many items.
    pub fn check_item_count(&self, element: &PlyElement) -> ImportResult<()> {
        let least = |number: NumberType| {
            if self.encoding == PlyEncoding::Ascii {
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
        // The last number of an ASCII file needs no separator.
        if u128::from(element.count) * each as u128 > self.rest.len() as u128 + 1 {
            let (name, count) = (sanitise_text(&element.name), element.count);
            return Err(fault!(
                "is truncated: {count} items of `{name}` do not fit into the remaining {} bytes",
                self.rest.len()
            ));
        }
        Ok(())
    }

    /// Reads the next number. `name` is the name of its property, for messages.
    ///
    /// # Errors
    /// A fault of kind input where no number follows.
    pub fn read_number(&mut self, kind: NumberType, name: &str) -> ImportResult<f64> {
        if self.encoding == PlyEncoding::Ascii {
            let word = String::from_utf8_lossy(self.read_word()?);
            return parse_number(&word, kind)
                .ok_or_else(|| not_a_number_fault(&sanitise_text(name), &word));
        }
        let (bytes, rest) = self
            .rest
            .split_at_checked(kind.size())
            .ok_or_else(truncation_fault)?;
        self.rest = rest;
        let mut number = [0; 8];
        number[..bytes.len()].copy_from_slice(bytes);
        if self.encoding == PlyEncoding::BigEndian {
            number[..bytes.len()].reverse();
        }
        let [a, b, c, d, ..] = number;
        Ok(match kind {
            NumberType::I8 => i8::from_le_bytes([a]).into(),
            NumberType::U8 => a.into(),
            NumberType::I16 => i16::from_le_bytes([a, b]).into(),
            NumberType::U16 => u16::from_le_bytes([a, b]).into(),
            NumberType::I32 => i32::from_le_bytes([a, b, c, d]).into(),
            NumberType::U32 => u32::from_le_bytes([a, b, c, d]).into(),
            NumberType::F32 => f32::from_le_bytes([a, b, c, d]).into(),
            NumberType::F64 => f64::from_le_bytes(number),
        })
    }

    /// Reads the length of a list. The remaining bytes can hold this number of items.
    ///
    /// # Errors
    ///
    /// A fault of kind input for a negative or fractional length, and for a length that the
    /// remaining bytes cannot hold.
    pub fn read_list_length(
        &mut self,
        kind: NumberType,
        item: NumberType,
        name: &str,
    ) -> ImportResult<usize> {
        let count = self.read_number(kind, name)?;
        let minimum = if self.encoding == PlyEncoding::Ascii {
            2
        } else {
            item.size()
        };
        if count < 0.0
            || count.fract() != 0.0
            || count * minimum as f64 > self.rest.len() as f64 + 1.0
        {
            return Err(fault!(
                "{}: the list length {count} is negative, not a whole number, or more than the remaining data can hold",
                sanitise_text(name)
            ));
        }
        Ok(count as usize)
    }

    /// Reads the items of an element by a function that reads one item. Numbers after an item that
    /// has its own line are skipped.
    ///
    /// # Errors
    /// The faults of `read_item`, with the position.
    pub fn read_items(
        &mut self,
        element: &PlyElement,
        mut read_item: impl FnMut(&mut Self) -> ImportResult<()>,
    ) -> ImportResult<()> {
        for index in 0..element.item_count() {
            read_item(self)
                .map_err(|fault| fault.with_place(self.describe_position(element, index)))?;
            if self.has_item_lines {
                let mut lines = self.rest.splitn(2, |byte| matches!(byte, b'\r' | b'\n'));
                let surplus = lines.next().unwrap_or_default();
                self.rest = self.rest.get(surplus.len()..).unwrap_or_default();
                if !surplus.trim_ascii().is_empty() {
                    self.surplus_line.get_or_insert(self.line);
                }
            }
        }
        Ok(())
    }

    /// Skips all items of an element.
    ///
    /// # Errors
    /// A fault of kind input if the file ends inside the element.
    pub fn skip_element(&mut self, element: &PlyElement) -> ImportResult<()> {
        self.read_items(element, |values| {
            let mut properties = element.properties.iter();
            properties.try_for_each(|property| values.skip_property(property))
        })
    }

    /// Skips the value of a property, which may be a list.
    ///
    /// # Errors
    /// As [`Self::read_number`].
    pub fn skip_property(&mut self, property: &PlyProperty) -> ImportResult<()> {
        let PlyProperty {
            name,
            count,
            number,
        } = property;
        let items = count.map_or(Ok(1), |count| self.read_list_length(count, *number, name))?;
        for _ in 0..items {
            self.read_number(*number, name)?;
        }
        Ok(())
    }

    /// Returns the next word of an ASCII file.
    fn read_word(&mut self) -> ImportResult<&'b [u8]> {
        let blank = self
            .rest
            .iter()
            .take_while(|byte| byte.is_ascii_whitespace());
        // In a file whose lines end in carriage returns alone, all lines count as a single line.
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
            Err(truncation_fault())
        } else {
            Ok(word)
        }
    }
}

fn truncation_fault() -> Fault {
    fault!("the file ends before the next number")
}

/// Parses a word of an ASCII file as a number of the type `kind`. A float is parsed in double
/// precision, so that it is rounded to single precision only once, as in other formats.
fn parse_number(word: &str, kind: NumberType) -> Option<f64> {
    match kind {
        // The number is used as written, because it may have more digits than its declared type
        // holds.
        NumberType::F32 | NumberType::F64 => parse_number_prefix(word).map(|(_, value)| value),
        // Some programs write whole numbers as `255.0`.
        _ => word
            .parse::<i64>()
            .map(|value| value as f64)
            .ok()
            .or_else(|| word.parse().ok().filter(|value: &f64| value.fract() == 0.0)),
    }
}
