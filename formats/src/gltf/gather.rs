//! Combines a `.gltf` and its files in one GLB: buffers are gathered in a BIN chunk, and images are embedded.

use std::borrow::Cow;
use std::collections::HashSet;

use serde_json::value::RawValue;

use crate::diagnostic::{Code, Diagnostic, Location};
use crate::gltf::container::{check_length, padding};
use crate::gltf::data::{BufferData, GatheredBuffers};
use crate::gltf::edits::Edits;
use crate::gltf::json::JsonMembers;
use crate::gltf::reader::{GltfReader, MESHOPT};
use crate::gltf::schema::{Buffer, Texture};
use crate::gltf::uri;
use crate::gltf::whole::Whole;

/// Gathers all buffers that can be read, and moves views to their new locations.
///
/// # Errors
/// When a buffer or a view is invalid, or when a GLB cannot store all of them.
pub(super) fn buffers<'a>(
    reader: &GltfReader<'a>,
    edits: &mut Edits<'a>,
) -> Result<BufferData<'a>, Diagnostic> {
    let json = reader.json;
    let mut bytes = Vec::new();
    let mut members = None;
    let mut kept = Vec::new();
    let mut is_first_unnamed = false;
    // For each buffer: its new index, and the offset by which its bytes moved.
    let mut moves: Vec<(usize, usize)> = Vec::new();
    for (index, raw) in json.entries("buffers").iter().enumerate() {
        let pointer = format!("/buffers/{index}");
        let buffer: Buffer<'_> = json.typed(raw, &pointer)?;
        let found = match &buffer.uri {
            Some(_) => stays_outside(reader, reader.buffer(index, &pointer)),
            // A fallback buffer of meshopt: it has no bytes, only the length of the decoded data.
            None => None,
        };
        let Some(found) = found else {
            is_first_unnamed |= index == 0 && buffer.uri.is_none();
            kept.push(raw.get().to_owned());
            moves.push((kept.len(), 0));
            continue;
        };
        bytes.extend_from_slice(padding(bytes.len(), &[0; 3]));
        check_length(json, (bytes.len() + found.len()) as u64)?;
        moves.push((0, bytes.len()));
        bytes.extend_from_slice(found);
        if members.is_none() {
            let buffer_members: JsonMembers<'_> = json.typed(raw, &pointer)?;
            members = Some(others(&buffer_members));
        }
    }
    let members = match members {
        Some(members) => members,
        // In a GLB, a first buffer without a URI is the BIN chunk. The first buffer of the input has no URI and no
        // bytes, and readers would take it for the BIN chunk; therefore a BIN chunk of 4 bytes is written before it.
        None if is_first_unnamed => {
            bytes.extend([0; 4]);
            String::new()
        }
        None => return Ok(BufferData::in_uri(json)),
    };
    for (index, view) in json.entries("bufferViews").iter().enumerate() {
        let pointer = format!("/bufferViews/{index}");
        let members: JsonMembers<'a> = json.typed(view, &pointer)?;
        move_view(reader, edits, (view, &members), &moves, &pointer)?;
        let Some(extensions) = members.get("extensions") else {
            continue;
        };
        let extensions: JsonMembers<'a> = json.typed(extensions, &pointer)?;
        for compressed in MESHOPT.iter().filter_map(|name| extensions.get(name)) {
            let members: JsonMembers<'a> = json.typed(compressed, &pointer)?;
            move_view(reader, edits, (compressed, &members), &moves, &pointer)?;
        }
    }
    Ok(BufferData::gathered(
        GatheredBuffers { members, kept },
        bytes,
    ))
}

/// The result; an error becomes a warning that the URI is kept.
fn stays_outside<T>(reader: &GltfReader<'_>, found: Result<T, Diagnostic>) -> Option<T> {
    found
        .map_err(|fault| {
            let pointer = match fault.location {
                Some(Location::Inside(pointer)) => pointer,
                _ => String::new(),
            };
            reader.warn(Code::StaysOutside, &pointer, || {
                format!("{}; the URI is kept", fault.message)
            });
        })
        .ok()
}

/// The members of a buffer that stay, each with a comma before it.
fn others(members: &JsonMembers<'_>) -> String {
    let stay = members
        .0
        .iter()
        .filter(|(name, _)| name != "uri" && name != "byteLength");
    stay.map(|(name, value)| {
        format!(
            ",{}:{}",
            serde_json::Value::from(name.as_str()),
            value.get()
        )
    })
    .collect()
}

/// Changes the buffer and the offset of a view, or of the compressed data of a view.
fn move_view<'a>(
    reader: &GltfReader<'a>,
    edits: &mut Edits<'a>,
    (object, members): (&RawValue, &JsonMembers<'a>),
    moves: &[(usize, usize)],
    pointer: &str,
) -> Result<(), Diagnostic> {
    let number = |raw: Option<&'a RawValue>| -> Result<usize, Diagnostic> {
        match raw {
            Some(raw) => reader.json.typed(raw, pointer).map(|Whole(number)| number),
            None => Ok(0),
        }
    };
    let (buffer, offset) = (members.get("buffer"), members.get("byteOffset"));
    let old = number(buffer)?;
    let (Some(buffer), Some(&(new, by))) = (buffer, moves.get(old)) else {
        return Ok(());
    };
    if new != old {
        edits.replace(buffer, new);
    }
    let moved = number(offset)?.saturating_add(by);
    match offset {
        _ if by == 0 => {}
        Some(offset) => edits.replace(offset, moved),
        None => edits.add(object, "byteOffset", moved),
    }
    Ok(())
}

/// Embeds the images that are in files.
///
/// # Errors
/// When the entry of an image is invalid, or when a GLB cannot store all of them.
pub(super) fn images<'a>(
    reader: &GltfReader<'a>,
    edits: &mut Edits<'a>,
    data: &mut BufferData<'_>,
) -> Result<(), Diagnostic> {
    let json = reader.json;
    // glTF without extensions has only PNG and JPEG. Other types belong to extensions of textures.
    let textures: Vec<Texture> = json.optional("textures");
    let plain: HashSet<usize> = textures
        .iter()
        .filter_map(|texture| texture.source)
        .collect();
    for (index, image) in json.entries("images").iter().enumerate() {
        let pointer = format!("/images/{index}");
        let members: JsonMembers<'a> = json.typed(image, &pointer)?;
        let Some(uri_index) = members.0.iter().position(|(name, _)| name == "uri") else {
            continue;
        };
        let value = members.0[uri_index].1;
        let uri: Cow<'a, str> = json.typed(value, &pointer)?;
        if uri::is_data(&uri) {
            continue;
        }
        let found = reader.follow(&uri, &pointer).and_then(|bytes| {
            let message =
                || format!("{uri}: neither PNG nor JPEG nor another kind of image that is known");
            let kind = kind(&bytes).ok_or_else(|| json.refuse(&pointer, Code::Uri, message()))?;
            if !["image/png", "image/jpeg"].contains(&kind) && plain.contains(&index) {
                let message = format!(
                    "{uri}: a texture has {kind} as its `source`; glTF allows only PNG and JPEG there"
                );
                return Err(json.refuse(&pointer, Code::Uri, message));
            }
            Ok((bytes, kind))
        });
        let Some((bytes, kind)) = stays_outside(reader, found) else {
            continue;
        };
        check_length(json, data.length_with(bytes.len() as u64))?;
        let view = data.append(edits, &bytes);
        let kind = match members.get("mimeType") {
            Some(_) => String::new(),
            None => format!(",\"mimeType\":\"{kind}\""),
        };
        let before = uri_index.checked_sub(1).map(|before| members.0[before].1);
        edits.replace_member(image, before, value, format!("\"bufferView\":{view}{kind}"));
    }
    Ok(())
}

/// The media type of an image, by its first bytes.
fn kind(image: &[u8]) -> Option<&'static str> {
    let kinds: [(&[u8], &str); 4] = [
        (b"\x89PNG\r\n\x1a\n", "image/png"),
        (b"\xff\xd8\xff", "image/jpeg"),
        (b"\xabKTX 20\xbb", "image/ktx2"),
        (b"DDS ", "image/vnd-ms.dds"),
    ];
    if image.starts_with(b"RIFF") && image.get(8..12) == Some(b"WEBP") {
        return Some("image/webp");
    }
    let known = kinds.iter().find(|(start, _)| image.starts_with(start));
    known.map(|(_, kind)| *kind)
}
