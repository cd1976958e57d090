//! Edits the text of a file; everything else stays unchanged byte for byte.

use std::collections::BTreeMap;
use std::ops::Range;

use serde_json::value::RawValue;

use crate::gltf::json::Json;

/// The entries of a list that are left out.
#[derive(Default)]
pub(super) struct LeftOut {
    /// In order.
    indices: Vec<usize>,
}

impl FromIterator<usize> for LeftOut {
    fn from_iter<I: IntoIterator<Item = usize>>(indices: I) -> Self {
        let mut indices: Vec<usize> = indices.into_iter().collect();
        indices.sort_unstable();
        indices.dedup();
        Self { indices }
    }
}

impl LeftOut {
    pub(super) fn indices(&self) -> &[usize] {
        &self.indices
    }

    pub(super) fn has(&self, index: usize) -> bool {
        self.indices.binary_search(&index).is_ok()
    }

    /// How many entries before this one are left out.
    pub(super) fn before(&self, index: usize) -> usize {
        self.indices.partition_point(|&left| left < index)
    }
}

/// The changes to make, in any order.
pub(super) struct Edits<'a> {
    json: &'a Json<'a>,
    /// Byte ranges and their replacements. Insertions at the same offset are in their order.
    list: Vec<(Range<usize>, String)>,
    /// Number of entries that were appended to arrays, by the offset of the array's end.
    appended: BTreeMap<usize, usize>,
    /// Entries of top-level arrays that the file does not have.
    missing: BTreeMap<&'static str, Vec<String>>,
}

impl<'a> Edits<'a> {
    pub(super) fn new(json: &'a Json<'a>) -> Self {
        Self {
            json,
            list: Vec::new(),
            appended: BTreeMap::new(),
            missing: BTreeMap::new(),
        }
    }

    pub(super) fn replace(&mut self, value: &RawValue, with: impl ToString) {
        self.list.push((self.json.range(value), with.to_string()));
    }

    /// Appends a member to an object that is not empty.
    pub(super) fn add(&mut self, object: &RawValue, name: &str, value: impl ToString) {
        let end = self.json.range(object).end - 1;
        let member = format!(",\"{name}\":{}", value.to_string());
        self.list.push((end..end, member));
    }

    /// Replaces the member with this value by `with`; `before` is the value of the member before it in `object`.
    pub(super) fn replace_member(
        &mut self,
        object: &RawValue,
        before: Option<&RawValue>,
        value: &RawValue,
        with: String,
    ) {
        let start = match before {
            Some(before) => self.json.range(before).end,
            None => self.json.range(object).start,
        };
        let end = self.json.range(value).end;
        // Between two values of an object there is exactly one name.
        let quote = self.json.text[start..end].find('"').unwrap_or(0);
        self.list.push((start + quote..end, with));
    }

    /// Appends to an array of `count` entries; returns the index of the new one.
    pub(super) fn append(&mut self, array: &RawValue, count: usize, entry: &str) -> usize {
        let end = self.json.range(array).end - 1;
        let appended = self.appended.entry(end).or_default();
        let index = count + *appended;
        *appended += 1;
        let comma = if index == 0 { "" } else { "," };
        self.list.push((end..end, format!("{comma}{entry}")));
        index
    }

    /// Appends to a top-level array; returns the index of the new entry.
    pub(super) fn append_to(&mut self, list: &'static str, entry: String) -> usize {
        if let Some(array) = self.json.array(list) {
            return self.append(array, self.json.entries(list).len(), &entry);
        }
        let entries = self.missing.entry(list).or_default();
        entries.push(entry);
        entries.len() - 1
    }

    /// Removes entries of an array, which keeps at least one.
    pub(super) fn remove_entries(&mut self, entries: &[&RawValue], left: &LeftOut) {
        for &index in left.indices() {
            let range = self.json.range(entries[index]);
            // The comma before it is removed too, or the comma after it if nothing before it is kept.
            let has_kept_before = left.before(index) < index;
            let range = match (has_kept_before, entries.get(index + 1)) {
                (true, _) => self.json.range(entries[index - 1]).end..range.end,
                (false, Some(next)) => range.start..self.json.range(next).start,
                (false, None) => range,
            };
            self.list.push((range, String::new()));
        }
    }

    /// Number of entries of a top-level array, including the appended ones.
    pub(super) fn count(&self, list: &'static str) -> usize {
        let array = self
            .json
            .array(list)
            .map(|array| self.json.range(array).end - 1);
        let appended = array.and_then(|end| self.appended.get(&end));
        let missing = self.missing.get(list).map_or(0, Vec::len);
        self.json.entries(list).len() + appended.copied().unwrap_or(0) + missing
    }

    /// The text with all changes.
    pub(super) fn finish(mut self) -> String {
        let text = self.json.text;
        // The comma is right, because the top object has at least one member, `asset`, which was read.
        let end = text.trim_end().len() - 1;
        for (list, entries) in self.missing {
            let member = format!(",\"{list}\":[{}]", entries.join(","));
            self.list.push((end..end, member));
        }
        self.list.sort_by_key(|(range, _)| range.start);
        let mut edited = String::with_capacity(text.len());
        let mut done = 0;
        for (range, with) in self.list {
            edited += &text[done..range.start];
            edited += &with;
            done = range.end;
        }
        edited + &text[done..]
    }
}
