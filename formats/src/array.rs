//! Arrays of numbers, and the header of an NPY array: element type, order and shape.
//!
//! The header is parsed here, not by a crate, because the header of a damaged or hostile file can contain anything. The
//! crate `npyz` multiplies shapes without checking their size, allocates memory by the length that a header claims for
//! itself, and parses nested brackets twice at each level. Tests read the written headers with `npyz`.

use std::fmt;

/// The largest length of a header, 64 KiB; `NumPy` refuses headers over 10 000 bytes.
const LONGEST: usize = 1 << 16;

/// The largest number of bytes before the numbers.
pub(crate) const LONGEST_START: usize = LONGEST + 12;

/// The numbers of an NPY file, without their meaning.
#[derive(Debug, Clone, PartialEq)]
pub struct NumberArray {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// All numbers; the last axis is the fastest.
    pub values: Vec<f64>,
}

/// The type, order and shape of an array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ArrayHeader {
    pub(crate) element: Element,
    /// Whether the most significant byte is first.
    pub(crate) is_big_endian: bool,
    /// Whether the first axis is the fastest.
    pub(crate) is_fortran: bool,
    pub(crate) shape: Vec<usize>,
    /// Offset of the numbers.
    pub(crate) start: usize,
}

/// The type of an array's elements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Element {
    F16,
    F32,
    F64,
    /// Signed integers of 1, 2, 4 or 8 bytes.
    Signed(usize),
    /// Unsigned integers of 1, 2, 4 or 8 bytes.
    Unsigned(usize),
    /// Truth values of one byte.
    Bool,
    /// Text with this number of UTF-32 characters.
    Unicode(usize),
    /// Text with this number of bytes.
    Bytes(usize),
    /// Pickled Python objects.
    Object,
    /// One object of a class that is not read.
    Class(String),
    /// Complex numbers, dates, records and others, by their name in `NumPy`.
    Other(String),
}

impl Element {
    /// Bytes of an element, if known.
    pub(crate) fn size(&self) -> Option<usize> {
        match *self {
            Self::Bool => Some(1),
            Self::F16 => Some(2),
            Self::F32 => Some(4),
            Self::F64 => Some(8),
            Self::Signed(size) | Self::Unsigned(size) | Self::Bytes(size) => Some(size),
            Self::Unicode(length) => length.checked_mul(4),
            Self::Object | Self::Class(_) | Self::Other(_) => None,
        }
    }

    pub(crate) fn is_float(&self) -> bool {
        matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    pub(crate) fn is_text(&self) -> bool {
        matches!(self, Self::Unicode(_) | Self::Bytes(_))
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::F16 => f.write_str("f2"),
            Self::F32 => f.write_str("f4"),
            Self::F64 => f.write_str("f8"),
            Self::Signed(size) => write!(f, "i{size}"),
            Self::Unsigned(size) => write!(f, "u{size}"),
            Self::Bool => f.write_str("bool"),
            Self::Unicode(length) => write!(f, "U{length}"),
            Self::Bytes(length) => write!(f, "S{length}"),
            Self::Object => f.write_str("objects"),
            Self::Class(class) => write!(f, "an object of {class}"),
            Self::Other(name) => f.write_str(name),
        }
    }
}

/// Displays `(4, 121, 4) f4`.
impl fmt::Display for ArrayHeader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", shape_text(&self.shape), self.element)
    }
}

/// A shape as Python prints it.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    let lengths: Vec<String> = shape.iter().map(usize::to_string).collect();
    match &*lengths {
        [length] => format!("({length},)"),
        lengths => format!("({})", lengths.join(", ")),
    }
}

impl ArrayHeader {
    /// For each axis, the distance between neighbours along it, in numbers.
    pub(crate) fn strides(&self) -> Vec<usize> {
        let mut strides = vec![1; self.shape.len()];
        let mut next = 1;
        let mut set = |axis: usize| {
            strides[axis] = next;
            // This can only saturate if another length is 0, and then there are no numbers to find.
            next = usize::saturating_mul(next, self.shape[axis].max(1));
        };
        match self.is_fortran {
            true => (0..self.shape.len()).for_each(&mut set),
            false => (0..self.shape.len()).rev().for_each(&mut set),
        }
        strides
    }

    /// Converts stored elements to C order.
    pub(crate) fn in_c_order<T: Clone>(&self, stored: Vec<T>) -> Vec<T> {
        if !self.is_fortran || self.shape.len() < 2 {
            return stored;
        }
        let strides = self.strides();
        let offset_of = |index: usize| {
            let axes = self.shape.iter().zip(&strides).rev();
            let walk = axes.fold((index, 0), |(rest, offset), (&length, stride)| {
                (rest / length, offset + rest % length * stride)
            });
            walk.1
        };
        (0..stored.len())
            .map(|index| stored[offset_of(index)].clone())
            .collect()
    }

    /// Parses the header at the beginning of `bytes`.
    ///
    /// # Errors
    /// The error in it, as text.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self, String> {
        let start = bytes.strip_prefix(b"\x93NUMPY");
        let rest = start.ok_or("it does not begin with `\\x93NUMPY`")?;
        let (length, at) = match *rest {
            [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([a, b])), 10),
            [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([a, b, c, d]) as usize, 12),
            [version, _, ..] if version != 1 && version != 2 && version != 3 => {
                return Err(format!("version {version} is not known; 1 to 3 are"));
            }
            _ => return Err("it is cut".to_owned()),
        };
        if length >= LONGEST {
            return Err(format!(
                "it has {length} bytes; at most {} are read",
                LONGEST - 1
            ));
        }
        let text = bytes.get(at..at + length).ok_or("it is cut")?;
        let text = std::str::from_utf8(text).map_err(|_| "it is not UTF-8")?;
        let mut scanner = Scanner { text };
        let (mut descr, mut order, mut shape) = (None, None, None);
        scanner.expect('{')?;
        while !scanner.take('}') {
            let key = scanner.string()?;
            scanner.expect(':')?;
            match key {
                "descr" => descr = Some(scanner.descr()?),
                "fortran_order" => order = Some(scanner.truth()?),
                "shape" => shape = Some(scanner.shape()?),
                other => return Err(format!("`{other}` does not belong in it")),
            }
            if !scanner.take(',') {
                scanner.expect('}')?;
                break;
            }
        }
        let missing = |key: &str| format!("`{key}` is missing");
        let (element, is_big_endian) = descr.ok_or_else(|| missing("descr"))?;
        Ok(Self {
            element,
            is_big_endian,
            is_fortran: order.ok_or_else(|| missing("fortran_order"))?,
            shape: shape.ok_or_else(|| missing("shape"))?,
            start: at + length,
        })
    }

    /// Bytes of all elements; `None` if their size is unknown or the product overflows.
    pub(crate) fn byte_count(&self) -> Option<usize> {
        let mut lengths = self.shape.iter();
        lengths.try_fold(self.element.size()?, |bytes, &length| {
            bytes.checked_mul(length)
        })
    }

    /// The bytes of the header, for little-endian elements in C order, padded to a multiple of 64 bytes as by
    /// `NumPy`.
    pub(crate) fn write(element: &Element, shape: &[usize]) -> Vec<u8> {
        let mark = if element.size() == Some(1) { '|' } else { '<' };
        let element = match element {
            Element::Bool => "b1".to_owned(),
            other => other.to_string(),
        };
        let shape = shape_text(shape);
        let mut text =
            format!("{{'descr': '{mark}{element}', 'fortran_order': False, 'shape': {shape}, }}");
        let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
        text.push_str(&" ".repeat(length - 1 - text.len()));
        text.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        // A shape has few axes: the text is a few hundred bytes at most.
        bytes.extend((length as u16).to_le_bytes());
        bytes.extend(text.bytes());
        bytes
    }
}

/// Parses the Python literals of headers.
struct Scanner<'a> {
    text: &'a str,
}

impl<'a> Scanner<'a> {
    fn take(&mut self, character: char) -> bool {
        self.text = self.text.trim_start();
        let rest = self.text.strip_prefix(character);
        self.text = rest.unwrap_or(self.text);
        rest.is_some()
    }

    fn expect(&mut self, character: char) -> Result<(), String> {
        if self.take(character) {
            return Ok(());
        }
        let found: String = self.text.chars().take(16).collect();
        Err(format!("`{character}` is missing before `{found}`"))
    }

    fn string(&mut self) -> Result<&'a str, String> {
        let quote = if self.take('"') { '"' } else { '\'' };
        if quote == '\'' {
            self.expect('\'')?;
        }
        let (string, rest) = self.text.split_once(quote).ok_or("a string has no end")?;
        self.text = rest;
        Ok(string)
    }

    fn truth(&mut self) -> Result<bool, String> {
        self.text = self.text.trim_start();
        for (word, value) in [("True", true), ("False", false)] {
            if let Some(rest) = self.text.strip_prefix(word) {
                self.text = rest;
                return Ok(value);
            }
        }
        Err("`fortran_order` is neither True nor False".to_owned())
    }

    fn shape(&mut self) -> Result<Vec<usize>, String> {
        self.expect('(')?;
        let mut shape = Vec::new();
        while !self.take(')') {
            self.text = self.text.trim_start();
            let is_digit = |character: char| character.is_ascii_digit();
            let end = self.text.find(|c| !is_digit(c)).unwrap_or(self.text.len());
            let (digits, rest) = self.text.split_at(end);
            let length = digits.parse::<usize>();
            shape.push(length.map_err(|_| {
                let shown: String = self
                    .text
                    .chars()
                    .take_while(|c| !",)".contains(*c))
                    .take(24)
                    .collect();
                format!("`{shown}` in `shape` is not a length")
            })?);
            // Python 2 wrote long integers with an L.
            self.text = rest.strip_prefix('L').unwrap_or(rest);
            if !self.take(',') {
                self.expect(')')?;
                break;
            }
        }
        Ok(shape)
    }

    /// Parses the type, and returns whether it is big-endian. A record is a list, which is skipped.
    fn descr(&mut self) -> Result<(Element, bool), String> {
        if !self.take('[') {
            return element(self.string()?);
        }
        let mut depth = 1usize;
        let mut has_objects = false;
        while depth > 0 {
            let next = self.text.find(['[', ']', '\'', '"']);
            let at = next.ok_or("a list has no end")?;
            self.text = &self.text[at..];
            match self.text.as_bytes()[0] {
                b'[' => depth += 1,
                b']' => depth -= 1,
                _ => {
                    has_objects |= matches!(self.string()?, "|O" | "O");
                    continue;
                }
            }
            self.text = &self.text[1..];
        }
        let records = || Element::Other("records".to_owned());
        Ok((
            if has_objects {
                Element::Object
            } else {
                records()
            },
            false,
        ))
    }
}

/// The type of a string such as `<f8`.
pub(crate) fn element(descr: &str) -> Result<(Element, bool), String> {
    let wrong = || format!("`{descr}` is not a type");
    let rest = descr.strip_prefix(['<', '>', '|', '=']).unwrap_or(descr);
    let kind = rest.chars().next().ok_or_else(wrong)?;
    let digits = &rest[kind.len_utf8()..];
    let size = digits.parse::<usize>();
    let element = match (kind, size) {
        ('f', Ok(2)) => Element::F16,
        ('f', Ok(4)) => Element::F32,
        ('f', Ok(8)) => Element::F64,
        ('i', Ok(size @ (1 | 2 | 4 | 8))) => Element::Signed(size),
        ('u', Ok(size @ (1 | 2 | 4 | 8))) => Element::Unsigned(size),
        ('b', Ok(1)) => Element::Bool,
        ('U', Ok(length)) => Element::Unicode(length),
        ('S' | 'a', Ok(length)) => Element::Bytes(length),
        ('O', _) => Element::Object,
        _ => Element::Other(descr.to_owned()),
    };
    Ok((element, descr.starts_with('>')))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<ArrayHeader, String> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text.bytes());
        ArrayHeader::parse(&bytes)
    }

    #[test]
    fn headers_of_numpy_are_read() {
        let header = of("{'descr': '>f8', 'fortran_order': True, 'shape': (2, 3), }  \n").unwrap();
        assert_eq!(header.element, Element::F64);
        assert!(header.is_big_endian && header.is_fortran);
        assert_eq!(
            (&*header.shape, header.byte_count()),
            (&[2, 3][..], Some(48))
        );
        let scalar = of(r#"{"shape": (), "fortran_order": False, "descr": "<U7"}"#).unwrap();
        assert_eq!(
            (scalar.byte_count(), scalar.to_string()),
            (Some(28), "() U7".to_owned())
        );
        let record = "{'descr': [('a', '<f4', (3,)), ('b]', [('c', '|O')])], \
                      'fortran_order': False, 'shape': (3L,)}";
        assert_eq!(of(record).unwrap().element, Element::Object);
    }

    #[test]
    fn what_is_written_reads_back() {
        for (element, shape) in [
            (Element::F32, vec![4, 121, 4]),
            (Element::Unicode(5), vec![]),
            (Element::Unsigned(1), vec![7]),
            (Element::Bool, vec![2, 3]),
        ] {
            let bytes = ArrayHeader::write(&element, &shape);
            assert_eq!(bytes.len() % 64, 0);
            let header = ArrayHeader::parse(&bytes).unwrap();
            assert_eq!((header.element, header.shape), (element, shape));
            assert_eq!(header.start, bytes.len());
            npyz::NpyHeader::from_reader(&*bytes).unwrap();
        }
    }

    #[test]
    fn what_is_no_header_is_refused_in_words() {
        let good = "'fortran_order': False, 'shape': (1,)";
        for (text, part) in [
            ("".to_owned(), "`{` is missing"),
            (format!("{{'descr': '<f8', {good}"), "`}` is missing"),
            (format!("{{{good}}}"), "`descr` is missing"),
            (
                "{'descr': '<f8', 'shape': (1,), 'fortran_order': 1}".to_owned(),
                "neither",
            ),
            (
                "{'descr': '<f8', 'shape': (-1,)}".to_owned(),
                "not a length",
            ),
            (
                "{'descr': '<f8', 'shape': (99999999999999999999,)}".to_owned(),
                "not a length",
            ),
            (format!("{{'descr': '', {good}}}"), "not a type"),
            ("{'descr': [[[[".to_owned(), "no end"),
            (
                format!("{{'name': '<f8', {good}}}"),
                "`name` does not belong",
            ),
        ] {
            let error = of(&text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
        assert!(
            ArrayHeader::parse(b"\x93NUMPY\x04\x00\0\0")
                .unwrap_err()
                .contains("version 4")
        );
        assert!(
            ArrayHeader::parse(b"\x93NUMPY\x01\x00\x10\0{")
                .unwrap_err()
                .contains("cut")
        );
        let long = ArrayHeader::parse(b"\x93NUMPY\x02\x00\0\0\0\x80").unwrap_err();
        assert!(long.contains("2147483648"), "{long}");
        let huge =
            of("{'descr': '<f8', 'fortran_order': False, 'shape': (4294967295, 4294967295)}");
        assert_eq!(huge.unwrap().byte_count(), None);
    }
}
