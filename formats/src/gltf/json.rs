//! The JSON of a file. Values are found by their offsets in the text, so that unchanged ones are written back byte
//! for byte. Values that are read have types, and errors contain a JSON pointer.

use std::fmt;
use std::ops::Range;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use crate::diagnostic::{Code, Diagnostic, Location};

/// The top-level arrays that are read or written.
const LISTS: [&str; 6] = [
    "nodes",
    "animations",
    "accessors",
    "bufferViews",
    "buffers",
    "images",
];

/// The names and values of an object in their order; a name may occur twice.
#[derive(Default)]
pub(super) struct JsonMembers<'a>(pub(super) Vec<(String, &'a RawValue)>);

impl<'de: 'a, 'a> Deserialize<'de> for JsonMembers<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;

        impl<'de> Visitor<'de> for InOrder {
            type Value = Vec<(String, &'de RawValue)>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Self::Value, M::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(members)
            }
        }

        deserializer.deserialize_map(InOrder).map(Self)
    }
}

impl<'a> JsonMembers<'a> {
    /// The first value with this name.
    pub(super) fn get(&self, name: &str) -> Option<&'a RawValue> {
        let found = self.0.iter().find(|(member, _)| member == name);
        found.map(|(_, value)| *value)
    }
}

/// One top-level array.
struct TopLevelArray<'a> {
    name: &'static str,
    /// `None` if the file does not have the array.
    array: Option<&'a RawValue>,
    entries: Vec<&'a RawValue>,
}

/// The text of a file, with its arrays split into entries.
pub(super) struct Json<'a> {
    /// The name of the file in messages.
    pub(super) name: &'a str,
    pub(super) text: &'a str,
    members: JsonMembers<'a>,
    lists: Vec<TopLevelArray<'a>>,
}

impl<'a> Json<'a> {
    /// # Errors
    /// When the text is not JSON or not an object, or when one of the arrays is something else.
    pub(super) fn parse(name: &'a str, text: &'a str) -> Result<Self, Diagnostic> {
        let members = serde_json::from_str(text).map_err(|error| Diagnostic {
            location: Some(Location::Text {
                line: error.line() as u64,
                column: error.column().max(1) as u64,
            }),
            ..Diagnostic::new(
                name,
                Code::Json,
                format!("the JSON cannot be read: {}", without_position(&error)),
            )
        })?;
        let mut json = Self {
            name,
            text,
            members,
            lists: Vec::new(),
        };
        for name in LISTS {
            json.take_apart(name)?;
        }
        Ok(json)
    }

    /// Splits one more top-level array into entries.
    ///
    /// # Errors
    /// When the value with this name is not an array.
    pub(super) fn take_apart(&mut self, name: &'static str) -> Result<(), Diagnostic> {
        let array = self.member(name)?;
        let entries = array.map(|raw| self.typed(raw, &format!("/{name}")));
        self.lists.push(TopLevelArray {
            name,
            array,
            entries: entries.transpose()?.unwrap_or_default(),
        });
        Ok(())
    }

    /// A top-level value.
    ///
    /// # Errors
    /// When it occurs twice.
    pub(super) fn member(&self, name: &str) -> Result<Option<&'a RawValue>, Diagnostic> {
        let mut found = self.members.0.iter().filter(|(member, _)| member == name);
        let first = found.next().map(|(_, value)| *value);
        match found.next() {
            Some(_) => {
                let message = format!("`{name}` occurs twice; remove one");
                Err(self.refuse(&format!("/{name}"), Code::Property, message))
            }
            None => Ok(first),
        }
    }

    /// A top-level list, which is ignored if it is not as in glTF.
    pub(super) fn optional<T: Deserialize<'a>>(&self, list: &str) -> Vec<T> {
        let found = self.member(list).ok().flatten();
        let typed = found.and_then(|raw| serde_json::from_str(raw.get()).ok());
        typed.unwrap_or_default()
    }

    /// The entries of a top-level array; none if the file does not have it.
    pub(super) fn entries(&self, list: &str) -> &[&'a RawValue] {
        let list = self.lists.iter().find(|entry| entry.name == list);
        list.map_or(&[], |list| &list.entries)
    }

    /// The text of a top-level array.
    pub(super) fn array(&self, list: &str) -> Option<&'a RawValue> {
        self.lists.iter().find(|entry| entry.name == list)?.array
    }

    /// An entry of a top-level array; `from` is the JSON pointer of the value that names it.
    ///
    /// # Errors
    /// When there is no such entry, or it is not of this type.
    pub(super) fn entry<T: Deserialize<'a>>(
        &self,
        list: &str,
        index: usize,
        from: &str,
    ) -> Result<T, Diagnostic> {
        let entries = self.entries(list);
        match entries.get(index) {
            Some(raw) => self.typed(raw, &format!("/{list}/{index}")),
            None => Err(self.no_such(list, index, entries.len(), from)),
        }
    }

    pub(super) fn no_such(&self, list: &str, index: usize, count: usize, from: &str) -> Diagnostic {
        let message =
            format!("index {index} of {list} does not exist: the list has length {count}");
        self.refuse(from, Code::IndexRange, message)
    }

    /// A value of type `T`.
    ///
    /// # Errors
    /// When the value is of another type, lacks a property or has one twice. Properties that are not read may be
    /// anything.
    pub(super) fn typed<T: Deserialize<'a>>(
        &self,
        raw: &'a RawValue,
        pointer: &str,
    ) -> Result<T, Diagnostic> {
        serde_json::from_str(raw.get()).map_err(|error| {
            let message = format!("does not follow glTF 2.0: {}", without_position(&error));
            self.refuse(pointer, Code::Property, message)
        })
    }

    pub(super) fn refuse(
        &self,
        pointer: &str,
        code: Code,
        message: impl Into<String>,
    ) -> Diagnostic {
        Diagnostic::new(self.name, code, message).inside(pointer)
    }

    /// The range of a value in the text.
    pub(super) fn range(&self, raw: &RawValue) -> Range<usize> {
        // Values are borrowed from the text, so that their addresses give their offsets.
        let start = raw.get().as_ptr() as usize - self.text.as_ptr() as usize;
        start..start + raw.get().len()
    }
}

/// The message of an error without its line and column, which count within one value.
fn without_position(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let end = text.rfind(" at line ").unwrap_or(text.len());
    text[..end].to_owned()
}
