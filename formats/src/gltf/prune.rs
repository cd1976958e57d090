//! Leaves out what a written file no longer uses: the keys that samples have replaced, with their accessors, buffer
//! views and bytes. Only data of animations is left out. Everything else keeps its bytes; indices and offsets of
//! the remaining data change where something before it is left out.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use serde_json::value::RawValue;

use crate::diagnostic::Diagnostic;
use crate::gltf::edits::{Edits, LeftOut};
use crate::gltf::json::{Json, JsonMembers};
use crate::gltf::reader::MESHOPT;
use crate::gltf::schema::{Accessor, Animation, Buffer, BufferView, MeshoptView, Sampler};
use crate::gltf::uri;
use crate::gltf::whole::Whole;

/// Extensions that compress meshes or place them, whose accessors and views are known here.
const DRACO: &str = "KHR_draco_mesh_compression";
const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// The starts of the names of extensions that refer to no accessor, view or buffer.
const WITHOUT_DATA: [&str; 11] = [
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_mesh_quantization",
    "KHR_animation_pointer",
    "KHR_node_",
    "KHR_xmp",
    "EXT_texture_",
    "MSFT_",
    "VRM",
    "EXT_lights_",
];

/// A place in the text that has the index of an entry of a list.
struct Reference<'a> {
    value: &'a RawValue,
    index: usize,
}

/// The indices that a file's parts refer to.
#[derive(Default)]
struct References<'a> {
    accessors: Vec<Reference<'a>>,
    /// By accessors, with the index of the accessor.
    views_of_accessors: Vec<(usize, Reference<'a>)>,
    /// By anything else, and by the parts of sparse accessors.
    views: Vec<Reference<'a>>,
    buffers: Vec<(usize, Reference<'a>)>,
    /// The largest number in an extension that is not known: entries up to it keep their indices.
    pinned: Option<usize>,
}

/// A text, and the bytes that are left out of its BIN chunk.
type PrunedText = (String, Cut);

/// Removes the objects that the animations of `before`, the original file, used and that `text`, the file with other
/// keys, does not use. Returns the new text, and the bytes to leave out of the BIN chunk of `length` bytes. If the file
/// has parts that glTF does not define, their references are unknown, so nothing is removed.
pub(super) fn prune(before: &Json<'_>, text: String, length: usize) -> PrunedText {
    let pruned = without_unused(before, &text, length, |json| unused_samplers(before, json));
    pruned.ok().flatten().unwrap_or((text, Cut::default()))
}

/// As [`prune`], for a text in which other animations replace those of the original file.
pub(super) fn prune_replaced(before: &Json<'_>, text: String, length: usize) -> PrunedText {
    let pruned = without_unused(before, &text, length, |_| Ok(Vec::new()));
    pruned.ok().flatten().unwrap_or((text, Cut::default()))
}

/// See [`prune`]; `None` if everything is used. `left_samplers` has the samplers of each animation of the text that its
/// channels used before and do not use now.
fn without_unused(
    before: &Json<'_>,
    text: &str,
    length: usize,
    left_samplers: impl Fn(&Json<'_>) -> Result<Vec<LeftOut>, Diagnostic>,
) -> Result<Option<PrunedText>, Diagnostic> {
    let mut json = Json::parse(before.name, text)?;
    for list in ["meshes", "skins"] {
        json.take_apart(list)?;
    }
    let json = &json;
    let mut edits = Edits::new(json);
    let left_samplers = left_samplers(json)?;
    remove_samplers(json, &left_samplers, &mut edits)?;
    let references = References::of(json, &left_samplers)?;
    let used: BTreeSet<usize> = references.accessors.iter().map(|it| it.index).collect();
    let is_free = |index: &usize| references.pinned.is_none_or(|pinned| *index > pinned);
    let old = accessors_of_animations(before)?.into_iter();
    let accessors: LeftOut = old
        .filter(|it| !used.contains(it))
        .filter(is_free)
        .collect();
    if accessors.indices().is_empty() {
        return Ok(None);
    }
    let (mut kept_views, mut left_views) = (BTreeSet::new(), BTreeSet::new());
    kept_views.extend(references.views.iter().map(|view| view.index));
    for (accessor, view) in &references.views_of_accessors {
        match accessors.has(*accessor) {
            true => left_views.insert(view.index),
            false => kept_views.insert(view.index),
        };
    }
    let unused = left_views.difference(&kept_views).copied();
    let views: LeftOut = unused.filter(is_free).collect();
    let layout = Layout::of(json, &references, &accessors, &views)?;
    let cut = layout.cut(length);
    layout.move_bytes(json, &cut, &mut edits)?;
    let buffers = unused_buffers(json, &references, &views, &is_free)?;
    let all = |list: &[Reference<'_>], left: &LeftOut, edits: &mut Edits<'_>| {
        list.iter()
            .for_each(|reference| reference.renumber(left, edits));
    };
    all(&references.accessors, &accessors, &mut edits);
    all(&references.views, &views, &mut edits);
    for (accessor, view) in &references.views_of_accessors {
        if !accessors.has(*accessor) {
            view.renumber(&views, &mut edits);
        }
    }
    for (view, buffer) in &references.buffers {
        if !views.has(*view) {
            buffer.renumber(&buffers, &mut edits);
        }
    }
    edits.remove_entries(json.entries("accessors"), &accessors);
    edits.remove_entries(json.entries("bufferViews"), &views);
    edits.remove_entries(json.entries("buffers"), &buffers);
    Ok(Some((edits.finish(), cut)))
}

/// The accessors of the keys of all animations.
fn accessors_of_animations(json: &Json<'_>) -> Result<BTreeSet<usize>, Diagnostic> {
    let mut found = BTreeSet::new();
    for (index, raw) in json.entries("animations").iter().enumerate() {
        let pointer = format!("/animations/{index}");
        let animation: Animation<'_> = json.typed(raw, &pointer)?;
        for raw in animation.samplers {
            let sampler: Sampler = json.typed(raw, &pointer)?;
            found.extend([sampler.input, sampler.output]);
        }
    }
    Ok(found)
}

/// The samplers that the channels of an animation name.
fn samplers_of_channels<'a>(
    json: &Json<'a>,
    animation: &Animation<'a>,
) -> Result<Vec<Reference<'a>>, Diagnostic> {
    let mut found = Vec::new();
    for raw in &animation.channels {
        let members: JsonMembers<'a> = json.typed(raw, "/animations")?;
        found.extend(Reference::member(json, &members, "sampler")?);
    }
    Ok(found)
}

/// For each animation, the samplers that channels used before and do not use now.
fn unused_samplers(before: &Json<'_>, json: &Json<'_>) -> Result<Vec<LeftOut>, Diagnostic> {
    fn used<'a>(json: &Json<'a>, raw: &'a RawValue) -> Result<BTreeSet<usize>, Diagnostic> {
        let animation: Animation<'a> = json.typed(raw, "/animations")?;
        let references = samplers_of_channels(json, &animation)?;
        Ok(references.iter().map(|it| it.index).collect())
    }
    let pairs = before
        .entries("animations")
        .iter()
        .zip(json.entries("animations"));
    pairs
        .map(|(old, new)| {
            let (old, new) = (used(before, old)?, used(json, new)?);
            Ok(old.difference(&new).copied().collect())
        })
        .collect()
}

fn remove_samplers<'a>(
    json: &Json<'a>,
    left: &[LeftOut],
    edits: &mut Edits<'_>,
) -> Result<(), Diagnostic> {
    for (raw, left) in json.entries("animations").iter().zip(left) {
        let animation: Animation<'a> = json.typed(raw, "/animations")?;
        for reference in samplers_of_channels(json, &animation)? {
            reference.renumber(left, edits);
        }
        edits.remove_entries(&animation.samplers, left);
    }
    Ok(())
}

/// The buffers in URIs that only left-out views refer to.
fn unused_buffers(
    json: &Json<'_>,
    references: &References<'_>,
    views: &LeftOut,
    is_free: &impl Fn(&usize) -> bool,
) -> Result<LeftOut, Diagnostic> {
    let (mut kept, mut left) = (BTreeSet::new(), BTreeSet::new());
    for (view, buffer) in &references.buffers {
        match views.has(*view) {
            true => left.insert(buffer.index),
            false => kept.insert(buffer.index),
        };
    }
    let mut unused = Vec::new();
    for index in left.difference(&kept).copied().filter(is_free) {
        let buffer: Buffer<'_> = json.entry("buffers", index, "/buffers")?;
        if buffer.uri.as_deref().is_some_and(uri::is_data) {
            unused.push(index);
        }
    }
    Ok(unused.into_iter().collect())
}

impl<'a> Reference<'a> {
    /// The index in a member of an object, if the object has it.
    fn member(
        json: &Json<'a>,
        members: &JsonMembers<'a>,
        name: &str,
    ) -> Result<Option<Self>, Diagnostic> {
        members
            .get(name)
            .map(|value| Self::of(json, value))
            .transpose()
    }

    fn of(json: &Json<'a>, value: &'a RawValue) -> Result<Self, Diagnostic> {
        let Whole(index) = json.typed(value, "")?;
        Ok(Self { value, index })
    }

    /// Writes the index that the entry has without those that are left out.
    fn renumber(&self, left: &LeftOut, edits: &mut Edits<'_>) {
        let before = left.before(self.index);
        if before > 0 {
            edits.replace(self.value, self.index - before);
        }
    }
}

impl<'a> References<'a> {
    /// The references in a file, without those of samplers that are left out.
    fn of(json: &Json<'a>, left_samplers: &[LeftOut]) -> Result<Self, Diagnostic> {
        let mut found = Self::default();
        let none = LeftOut::default();
        for (index, raw) in json.entries("animations").iter().enumerate() {
            let animation: Animation<'a> = json.typed(raw, "/animations")?;
            let left = left_samplers.get(index).unwrap_or(&none);
            for (index, raw) in animation.samplers.iter().enumerate() {
                if left.has(index) {
                    continue;
                }
                let members: JsonMembers<'a> = json.typed(raw, "/animations")?;
                for name in ["input", "output"] {
                    found
                        .accessors
                        .extend(Reference::member(json, &members, name)?);
                }
            }
        }
        found.add_meshes(json)?;
        for raw in json.entries("skins") {
            let members: JsonMembers<'a> = json.typed(raw, "/skins")?;
            let matrices = Reference::member(json, &members, "inverseBindMatrices")?;
            found.accessors.extend(matrices);
        }
        for raw in json.entries("nodes") {
            let members: JsonMembers<'a> = json.typed(raw, "/nodes")?;
            if let Some(instancing) = extension(json, &members, INSTANCING)? {
                found.add_accessors(json, instancing.get("attributes"))?;
            }
        }
        for raw in json.entries("images") {
            let members: JsonMembers<'a> = json.typed(raw, "/images")?;
            found
                .views
                .extend(Reference::member(json, &members, "bufferView")?);
        }
        for (index, raw) in json.entries("accessors").iter().enumerate() {
            let members: JsonMembers<'a> = json.typed(raw, "/accessors")?;
            let view = Reference::member(json, &members, "bufferView")?;
            found
                .views_of_accessors
                .extend(view.map(|view| (index, view)));
            let Some(sparse) = members.get("sparse") else {
                continue;
            };
            let sparse: JsonMembers<'a> = json.typed(sparse, "/accessors")?;
            for part in ["indices", "values"]
                .iter()
                .filter_map(|part| sparse.get(part))
            {
                let part: JsonMembers<'a> = json.typed(part, "/accessors")?;
                let view = Reference::member(json, &part, "bufferView")?;
                found
                    .views_of_accessors
                    .extend(view.map(|view| (index, view)));
            }
        }
        for (index, raw) in json.entries("bufferViews").iter().enumerate() {
            let members: JsonMembers<'a> = json.typed(raw, "/bufferViews")?;
            let buffer = Reference::member(json, &members, "buffer")?;
            found.buffers.extend(buffer.map(|buffer| (index, buffer)));
            for name in MESHOPT {
                if let Some(compressed) = extension(json, &members, name)? {
                    let buffer = Reference::member(json, &compressed, "buffer")?;
                    found.buffers.extend(buffer.map(|buffer| (index, buffer)));
                }
            }
        }
        if json.text.contains("\"extensions\"") {
            found.pinned = largest_in_unknown(json.text);
        }
        Ok(found)
    }

    fn add_meshes(&mut self, json: &Json<'a>) -> Result<(), Diagnostic> {
        for raw in json.entries("meshes") {
            let members: JsonMembers<'a> = json.typed(raw, "/meshes")?;
            let Some(primitives) = members.get("primitives") else {
                continue;
            };
            let primitives: Vec<&'a RawValue> = json.typed(primitives, "/meshes")?;
            for raw in primitives {
                let members: JsonMembers<'a> = json.typed(raw, "/meshes")?;
                self.accessors
                    .extend(Reference::member(json, &members, "indices")?);
                self.add_accessors(json, members.get("attributes"))?;
                if let Some(targets) = members.get("targets") {
                    let targets: Vec<&'a RawValue> = json.typed(targets, "/meshes")?;
                    for target in targets {
                        self.add_accessors(json, Some(target))?;
                    }
                }
                if let Some(draco) = extension(json, &members, DRACO)? {
                    self.views
                        .extend(Reference::member(json, &draco, "bufferView")?);
                }
            }
        }
        Ok(())
    }

    /// Adds the accessors that are the members of an object.
    fn add_accessors(
        &mut self,
        json: &Json<'a>,
        object: Option<&'a RawValue>,
    ) -> Result<(), Diagnostic> {
        let Some(object) = object else {
            return Ok(());
        };
        let members: JsonMembers<'a> = json.typed(object, "/meshes")?;
        for (_, value) in &members.0 {
            self.accessors.push(Reference::of(json, value)?);
        }
        Ok(())
    }
}

/// The members of an extension of an object, if it has it.
fn extension<'a>(
    json: &Json<'a>,
    members: &JsonMembers<'a>,
    name: &str,
) -> Result<Option<JsonMembers<'a>>, Diagnostic> {
    let Some(extensions) = members.get("extensions") else {
        return Ok(None);
    };
    let extensions: JsonMembers<'a> = json.typed(extensions, "/extensions")?;
    let found = extensions.get(name);
    found
        .map(|found| json.typed(found, "/extensions"))
        .transpose()
}

/// The part of the file in which a value stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Surroundings {
    /// glTF itself, or an extension that is known.
    Known,
    /// An object whose members are extensions.
    Extensions,
    /// An extension that is not known.
    Unknown,
}

impl Surroundings {
    /// The surroundings of the member `name` of an object in these.
    fn of_member(self, name: &str) -> Self {
        match self {
            Self::Known if name == "extensions" => Self::Extensions,
            Self::Known => Self::Known,
            Self::Extensions => {
                let is_known = MESHOPT.contains(&name)
                    || [DRACO, INSTANCING].contains(&name)
                    || WITHOUT_DATA.iter().any(|start| name.starts_with(start));
                if is_known { Self::Known } else { Self::Unknown }
            }
            Self::Unknown => Self::Unknown,
        }
    }
}

/// The largest whole number in extensions that are not known, which may be the index of an accessor, a view or a buffer.
///
/// The text is valid JSON. It is read once, token by token: a file may be nested deeper than a thread's stack.
fn largest_in_unknown(text: &str) -> Option<usize> {
    let mut open = Vec::new();
    let mut here = Surroundings::Known;
    let mut largest = None;
    let mut rest = text.trim_ascii_start();
    while let Some(first) = rest.bytes().next() {
        let length = match first {
            b'"' => string_length(rest),
            b'{' | b'[' | b'}' | b']' | b',' | b':' => 1,
            _ => {
                let end = |byte: u8| b"{[}],:\"".contains(&byte) || byte.is_ascii_whitespace();
                rest.bytes().position(end).unwrap_or(rest.len())
            }
        };
        let (token, after) = rest.split_at(length);
        rest = after.trim_ascii_start();
        match first {
            b'{' | b'[' => open.push(here),
            b'}' | b']' => drop(open.pop()),
            b',' => here = open.last().copied().unwrap_or(Surroundings::Known),
            b'"' if rest.starts_with(':') => {
                let name: String = serde_json::from_str(token).unwrap_or_default();
                here = here.of_member(&name);
            }
            _ if here == Surroundings::Unknown => {
                let number = serde_json::from_str(token).ok();
                largest = largest.max(number.map(|Whole(number)| number));
            }
            _ => {}
        }
    }
    largest
}

/// The length of the string at the start of a JSON text, with its quotation marks.
fn string_length(text: &str) -> usize {
    let mut is_escaped = false;
    let mut bytes = text.bytes().skip(1);
    let end = bytes.position(|byte| {
        let ends = byte == b'"' && !is_escaped;
        is_escaped = byte == b'\\' && !is_escaped;
        ends
    });
    end.map_or(text.len(), |end| end + 2)
}

/// Where accessors and views lie in the BIN chunk.
struct Layout<'a> {
    views: BTreeMap<usize, PlacedView<'a>>,
    /// Accessors that stay in views that lose others, with the start of each in its buffer.
    moved: Vec<MovedAccessor<'a>>,
    freed: Vec<Range<u64>>,
    used: Vec<Range<u64>>,
}

/// A view that stays.
struct PlacedView<'a> {
    range: Range<u64>,
    members: JsonMembers<'a>,
    /// The offset of its compressed data, if that is in the BIN chunk.
    compressed: Option<(&'a RawValue, u64)>,
    is_in_bin: bool,
}

/// An accessor that stays in a view that becomes shorter.
struct MovedAccessor<'a> {
    offset: Option<&'a RawValue>,
    view: usize,
    start: u64,
}

impl<'a> Layout<'a> {
    fn of(
        json: &Json<'a>,
        references: &References<'a>,
        accessors: &LeftOut,
        left_views: &LeftOut,
    ) -> Result<Self, Diagnostic> {
        let mut layout = Self {
            views: BTreeMap::new(),
            moved: Vec::new(),
            freed: Vec::new(),
            used: Vec::new(),
        };
        let has_bin = json.entries("buffers").first();
        let has_bin = has_bin.map(|raw| json.typed::<Buffer<'a>>(raw, "/buffers/0"));
        let has_bin = has_bin
            .transpose()?
            .is_some_and(|buffer| buffer.uri.is_none());
        // Views of which only a part is removed. This requires that only plain accessors refer to them.
        let mut parted: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let (mut is_losing, mut is_whole) = (BTreeSet::new(), BTreeSet::new());
        is_whole.extend(references.views.iter().map(|view| view.index));
        for (accessor, view) in &references.views_of_accessors {
            parted.entry(view.index).or_default().push(*accessor);
            if accessors.has(*accessor) {
                is_losing.insert(view.index);
            }
        }
        for (index, raw) in json.entries("bufferViews").iter().copied().enumerate() {
            let pointer = format!("/bufferViews/{index}");
            let view: BufferView<'a> = json.typed(raw, &pointer)?;
            let members: JsonMembers<'a> = json.typed(raw, &pointer)?;
            let range = view.byte_offset..view.byte_offset.saturating_add(view.byte_length);
            let is_in_bin = has_bin && view.buffer == 0;
            let mut compressed = None;
            let mut ranges: Vec<Range<u64>> = Vec::new();
            ranges.extend(is_in_bin.then(|| range.clone()));
            for name in MESHOPT {
                let Some(raw) = view.extensions.get(name) else {
                    continue;
                };
                let data: MeshoptView = json.typed(raw, &pointer)?;
                if has_bin && data.buffer == 0 {
                    ranges
                        .push(data.byte_offset..data.byte_offset.saturating_add(data.byte_length));
                    let members: JsonMembers<'a> = json.typed(raw, &pointer)?;
                    let offset = members.get("byteOffset");
                    compressed = offset.map(|raw| (raw, data.byte_offset));
                }
            }
            if left_views.has(index) {
                layout.freed.extend(ranges);
                continue;
            }
            let is_plain = is_in_bin && ranges.len() == 1 && compressed.is_none();
            let losing = is_losing.contains(&index) && !is_whole.contains(&index) && is_plain;
            let parts = parted.get(&index).filter(|_| losing);
            let spans = parts.map(|parts| {
                let spans = parts.iter().map(|&accessor| {
                    let raw = json.entries("accessors")[accessor];
                    span_of(raw, &view).map(|span| (accessor, raw, span))
                });
                spans.collect::<Option<Vec<_>>>()
            });
            match spans.flatten() {
                Some(spans) => {
                    for (accessor, raw, span) in spans {
                        if accessors.has(accessor) {
                            layout.freed.push(span);
                            continue;
                        }
                        let members: JsonMembers<'a> = json.typed(raw, "/accessors")?;
                        layout.moved.push(MovedAccessor {
                            offset: members.get("byteOffset"),
                            view: index,
                            start: span.start,
                        });
                        layout.used.push(span);
                    }
                }
                None => layout.used.extend(ranges),
            }
            layout.views.insert(
                index,
                PlacedView {
                    range,
                    members,
                    compressed,
                    is_in_bin,
                },
            );
        }
        Ok(layout)
    }

    /// The bytes to leave out of a BIN chunk of this length: whole words, so that everything stays aligned.
    fn cut(&self, length: usize) -> Cut {
        let (freed, used) = (joined(&self.freed), joined(&self.used));
        let mut cut = Cut::default();
        let mut add = |range: Range<u64>| {
            let start = range.start.max(cut.end()).next_multiple_of(4);
            let end = range.end.min(length as u64) / 4 * 4;
            if start < end {
                cut.push(start..end);
            }
        };
        let mut first = 0;
        for freed in freed {
            let mut start = freed.start;
            while first < used.len() && used[first].end <= freed.start {
                first += 1;
            }
            for used in used[first..]
                .iter()
                .take_while(|used| used.start < freed.end)
            {
                add(start..used.start.max(start));
                start = start.max(used.end);
            }
            add(start..freed.end.max(start));
        }
        cut
    }

    /// Writes the offsets and the lengths that views, accessors and the buffer have after the cut.
    fn move_bytes(
        &self,
        json: &Json<'a>,
        cut: &Cut,
        edits: &mut Edits<'_>,
    ) -> Result<(), Diagnostic> {
        if cut.ranges.is_empty() {
            return Ok(());
        }
        for view in self.views.values() {
            if let Some((raw, offset)) = view.compressed
                && cut.moved(offset) != offset
            {
                edits.replace(raw, cut.moved(offset));
            }
            if !view.is_in_bin {
                continue;
            }
            let (start, end) = (cut.moved(view.range.start), cut.moved(view.range.end));
            if start != view.range.start
                && let Some(raw) = view.members.get("byteOffset")
            {
                edits.replace(raw, start);
            }
            if end - start != view.range.end - view.range.start
                && let Some(raw) = view.members.get("byteLength")
            {
                edits.replace(raw, end - start);
            }
        }
        for accessor in &self.moved {
            let Some(view) = self.views.get(&accessor.view) else {
                continue;
            };
            let old = accessor.start - view.range.start;
            let new = cut.moved(accessor.start) - cut.moved(view.range.start);
            if let Some(raw) = accessor.offset.filter(|_| new != old) {
                edits.replace(raw, new);
            }
        }
        let Some(buffer) = json.entries("buffers").first() else {
            return Ok(());
        };
        let members: JsonMembers<'a> = json.typed(buffer, "/buffers/0")?;
        if let Some(raw) = members.get("byteLength") {
            let Whole::<u64>(length) = json.typed(raw, "/buffers/0")?;
            edits.replace(raw, cut.moved(length));
        }
        Ok(())
    }
}

/// The bytes of an accessor in its buffer; `None` if they are not known.
fn span_of(raw: &RawValue, view: &BufferView<'_>) -> Option<Range<u64>> {
    let accessor: Accessor = serde_json::from_str(raw.get()).ok()?;
    let component = match accessor.component_type {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        _ => return None,
    };
    let width = match accessor.kind.as_str() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        _ => return None,
    };
    if accessor.sparse.is_some() {
        return None;
    }
    let element: u64 = component * width;
    let stride = view.byte_stride.map_or(element, |stride| stride as u64);
    let length = accessor
        .count
        .checked_sub(1)?
        .checked_mul(stride)?
        .checked_add(element)?;
    let start = view.byte_offset.checked_add(accessor.byte_offset)?;
    let end = start.checked_add(length)?;
    (end <= view.byte_offset.checked_add(view.byte_length)?).then_some(start..end)
}

/// The ranges in order; those that overlap or touch are one.
fn joined(ranges: &[Range<u64>]) -> Vec<Range<u64>> {
    let mut ranges = ranges.to_vec();
    ranges.sort_unstable_by_key(|range| (range.start, range.end));
    let mut joined: Vec<Range<u64>> = Vec::with_capacity(ranges.len());
    for range in ranges {
        match joined.last_mut() {
            Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
            _ => joined.push(range),
        }
    }
    joined
}

/// Ranges of bytes that are left out, in order, each with the number of bytes that are left out before it.
#[derive(Default)]
pub(super) struct Cut {
    ranges: Vec<(Range<u64>, u64)>,
}

impl Cut {
    fn push(&mut self, range: Range<u64>) {
        let before = self.ranges.last();
        let before = before.map_or(0, |(last, before)| before + last.end - last.start);
        self.ranges.push((range, before));
    }

    fn end(&self) -> u64 {
        self.ranges.last().map_or(0, |(range, _)| range.end)
    }

    /// Where a byte is after the cut.
    fn moved(&self, offset: u64) -> u64 {
        let count = self
            .ranges
            .partition_point(|(range, _)| range.start < offset);
        match count.checked_sub(1).map(|last| &self.ranges[last]) {
            Some((range, before)) => offset - before - (range.end.min(offset) - range.start),
            None => offset,
        }
    }

    /// The parts of some bytes that stay.
    pub(super) fn kept<'a>(&self, parts: &[&'a [u8]]) -> Vec<&'a [u8]> {
        let mut kept = Vec::with_capacity(parts.len() + self.ranges.len());
        let (mut start, mut next) = (0, 0);
        for part in parts {
            let end = start + part.len() as u64;
            let mut from = start;
            while let Some((range, _)) = self.ranges.get(next).filter(|it| it.0.start < end) {
                if range.start > from {
                    kept.push(&part[(from - start) as usize..(range.start - start) as usize]);
                }
                from = range.end.min(end);
                if range.end > end {
                    break;
                }
                next += 1;
            }
            if from < end {
                kept.push(&part[(from - start) as usize..]);
            }
            start = end;
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole words of the freed ranges are cut, without the parts that other data use.
    #[test]
    fn what_is_used_is_never_cut() {
        let layout = |freed: &[Range<u64>], used: &[Range<u64>]| Layout {
            views: BTreeMap::new(),
            moved: Vec::new(),
            freed: freed.to_vec(),
            used: used.to_vec(),
        };
        type Ranges<'a> = &'a [[u64; 2]];
        let cases: [(Ranges<'_>, Ranges<'_>, Ranges<'_>); 5] = [
            (&[[8, 20]], &[], &[[8, 20]]),
            (&[[5, 19]], &[], &[[8, 16]]),
            (&[[0, 40]], &[[0, 100]], &[]),
            (
                &[[0, 40]],
                &[[10, 12], [20, 24]],
                &[[0, 8], [12, 20], [24, 40]],
            ),
            (
                &[[0, 8], [4, 16], [90, 200]],
                &[[12, 13]],
                &[[0, 12], [92, 100]],
            ),
        ];
        for (freed, used, expected) in cases {
            let [freed, used] = [freed, used].map(|all| all.iter().map(|&[start, end]| start..end));
            let cut = layout(&freed.collect::<Vec<_>>(), &used.collect::<Vec<_>>()).cut(100);
            let found = cut
                .ranges
                .into_iter()
                .map(|(range, _)| [range.start, range.end]);
            assert_eq!(found.collect::<Vec<_>>(), expected);
        }
        let both = layout(&[8..16, 40..48], &[]).cut(60);
        let moved = [0, 8, 12, 16, 20, 48, 60].map(|offset| both.moved(offset));
        assert_eq!(moved, [0, 8, 8, 8, 12, 32, 44]);
        // The chunk may be written in two parts that are divided anywhere.
        let bytes: Vec<u8> = (0..60).collect();
        let left: Vec<u8> = [0..8, 16..40, 48..60].into_iter().flatten().collect();
        for end in 0..=60 {
            let (one, other) = bytes.split_at(end);
            assert_eq!(both.kept(&[one, &[], other]).concat(), left, "{end}");
        }
        let many: Vec<&[u8]> = bytes.chunks(3).collect();
        assert_eq!(both.kept(&many).concat(), left);
    }

    #[test]
    fn numbers_in_unknown_extensions_may_be_indices() {
        for (text, largest) in [
            (r#"{"a":7,"extras":{"X":{"a":8}}}"#, None),
            (r#"{"extensions":{"KHR_lights_punctual":{"a":7}}}"#, None),
            (
                r#"{"extensions":{"X":{"a":7,"b":[1,9,"12"]},"VRM":{"a":20}},"c":30}"#,
                Some(9),
            ),
            (r#"[{"a":[]},{"ext\u0065nsions" : {"X":3}},4]"#, Some(3)),
            (
                r#"{"extensions":{"VRM":{"extensions":{"\"{\\":[{"extensions":{"VRM":5}},-6,1.5]}}}}"#,
                Some(5),
            ),
            // A whole number may be written with a point and an exponent.
            (r#"{"extensions":{"X":[1,2.0e1]}}"#, Some(20)),
        ] {
            assert!(serde_json::from_str::<serde_json::Value>(text).is_ok());
            assert_eq!(largest_in_unknown(text), largest, "{text}");
        }
    }
}
