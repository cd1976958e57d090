//! glTF 2.0, as text (`.gltf`) and as GLB.
//!
//! Each animation becomes a clip. Its tracks are the nodes that it moves, their ancestors, and the other joints of
//! their skins; the weights of morph targets are scalars. The parts of a file that are read are checked. Other parts may contain anything, and are written back
//! byte for byte when the file is written with other keys.
//!
//! Reading: `container` splits a GLB into its chunks, and `json` finds values in the text without copying them.
//! `reader` returns the bytes of views and the numbers of accessors, each loaded and decoded once. `nodes` contains the
//! hierarchy, `morphs` the morph targets of meshes, and `channel` the keys of one channel. `animation` makes a clip of
//! one animation. Writing the same file again: `document` keeps it. `bake` replaces the keys of one animation by
//! `edits` of the text and by bytes that `data` appends. `prune` leaves out the keys that were replaced, and `gather`
//! embeds the files beside a `.gltf` in a GLB. Writing clips of any format to a new file: `write_new`.

mod animation;
mod bake;
mod channel;
mod character;
mod compressed;
mod container;
mod data;
mod document;
mod edits;
mod gather;
mod json;
mod key_bytes;
mod matrix;
pub mod meshes;
mod meshopt;
mod morphs;
mod nodes;
mod prune;
pub(crate) mod quantized;
mod reader;
mod schema;
mod skins;
mod uri;
mod whole;
pub mod write_new;
mod written_keys;

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fs::File;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::diagnostic::{Code, Diagnostic, Location};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions, Space};
use crate::gltf::container::Container;
use crate::gltf::document::GltfDocument;
use crate::gltf::json::Json;
use crate::gltf::morphs::Morphs;
use crate::gltf::nodes::Nodes;
use crate::gltf::reader::{GltfReader, MESHOPT};
use crate::gltf::schema::{Asset, Buffer};
use crate::limits::Limits;
use crate::source::Source;
use crate::warnings::Warnings;

/// The glTF format: scenes with animations of nodes.
pub static FORMAT: Format = Format {
    name: "glb",
    summary: "glTF 2.0 animations, as GLB or text",
    extensions: &["gltf"],
    probe: is_gltf,
    numbers_in_line: None,
    is_text: false,
    numbers_repeated_names: true,
    guesses_time_unit: false,
    read: open_gltf,
    read_bytes: |name, bytes, options| read_gltf(name, bytes, None, options),
    write: None,
    write_motion: Some(write_new::write_new),
    features: &[
        Feature::SeveralTracks,
        Feature::Quaternions,
        Feature::TrackNames,
        Feature::ClipName,
        Feature::Skeleton,
        Feature::RestRotations,
        Feature::Translations,
        Feature::Scales,
        Feature::Steps,
        Feature::Lines,
        Feature::Bvh,
        Feature::SeveralClips,
        Feature::TimesPerTrack,
        Feature::TimesPerChannel,
        Feature::UnevenTimes,
    ],
    options: &[
        FormatOption::RawTimes,
        FormatOption::Duplicates,
        FormatOption::AtKeys,
        FormatOption::Quantize,
    ],
};

/// The longest GLB: its header says the length in 32 bits.
const LONGEST_GLB: u64 = u32::MAX as u64;

/// The required extensions that are supported, or that do not concern animations.
const KNOWN: [&str; 9] = [
    MESHOPT[0],
    MESHOPT[1],
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_mesh_quantization",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_materials_unlit",
    "EXT_texture_webp",
];

fn is_gltf(start: &[u8]) -> bool {
    let text = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    let is_object = text.trim_ascii_start().starts_with(b"{");
    start.starts_with(container::MAGIC)
        || is_object && text.windows(7).any(|seven| seven == b"\"asset\"")
}

/// Reads a glTF file; `-` is standard input. Files that it names are read from its folder.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned. Errors of single animations are in
/// [`Loaded::refused`].
pub fn open_gltf(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let (name, bytes, folder) = bytes_of(path, options.limits, options.pipes)?;
    read_gltf(&name, bytes, folder, options)
}

/// The input's name in messages, its bytes, and the folder of the files that it names.
fn bytes_of(
    path: &Path,
    limits: Limits,
    pipes: bool,
) -> Result<(String, Vec<u8>, Option<&Path>), Diagnostic> {
    let mut source = Source::open(path, pipes)?;
    let name = source.name.clone();
    let start = source.reader.fill_buf().unwrap_or_default();
    let limit = match start.starts_with(container::MAGIC) {
        true => limits.file.min(LONGEST_GLB),
        false => limits.file,
    };
    let bytes = source.into_bytes(limit)?;
    let folder = (path.as_os_str() != "-").then(|| path.parent().unwrap_or(Path::new("")));
    Ok((name, bytes, folder))
}

/// The files of a file's buffers, relative to its folder; those of URIs that are refused are left out.
pub(crate) fn buffer_files(path: &Path, limits: Limits) -> Vec<PathBuf> {
    let text = File::open(path).ok();
    let text = text.and_then(|file| container::json_alone(file, limits.file));
    let text = text.unwrap_or_default();
    let Ok(json) = Json::parse("", &text) else {
        return Vec::new();
    };
    let buffers = json.entries("buffers").iter();
    let uris = buffers.filter_map(|raw| json.typed::<Buffer<'_>>(raw, "").ok()?.uri);
    uris.filter(|uri| !uri::is_data(uri))
        .filter_map(|uri| uri::relative(&uri).ok())
        .collect()
}

/// Reads the bytes of a glTF file; `name` is the input's name in messages, and `folder` is the folder of the files
/// that it names.
///
/// # Errors
/// As [`open_gltf`].
pub fn read_gltf(
    name: &str,
    bytes: Vec<u8>,
    folder: Option<&Path>,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    let mut warnings = Warnings::new(name);
    let container = Container::parse(name, bytes, &mut warnings)?;
    let json = Json::parse(name, &container.text)?;
    check_version(&json)?;
    let animations = json.entries("animations").len();
    if animations == 0 {
        let message = "the file has no animations; is it the right one?";
        return Err(json.refuse("/animations", Code::NoAnimations, message));
    }
    let reader = GltfReader::new(&json, &container, folder, options.limits, warnings)?;
    for (at, required) in reader.required().iter().enumerate() {
        if !KNOWN.contains(&required.as_str()) {
            reader.warn(Code::RequiredExtension, &format!("/extensionsRequired/{at}"), || {
                format!("the extension {required} is required and not known; animations are read without it")
            });
        }
    }
    let nodes = Nodes::read(&json)?;
    let morphs = Morphs::read(&reader, &nodes)?;
    let mut loaded = Loaded {
        space: Some(Space::GLTF),
        ..Loaded::default()
    };
    let mut read = Vec::with_capacity(animations);
    let mut faults: HashMap<(Option<Location>, String), usize> = HashMap::new();
    for index in 0..animations {
        match animation::read(index, &reader, (&nodes, &morphs), options) {
            Ok(found) => {
                let (clip, channels) = found.unzip();
                loaded.clips.extend(clip);
                read.push(channels);
            }
            // The memory limit applies to the whole file. The other animations would be refused too, after reading
            // all their data.
            Err(fault) if fault.code == Code::Memory => return Err(fault),
            Err(fault) => {
                read.push(None);
                // If several animations use one damaged buffer, it is reported once.
                match faults.entry((fault.location.clone(), fault.message.clone())) {
                    Entry::Occupied(known) => loaded.refused[*known.get()].count += 1,
                    Entry::Vacant(new) => {
                        new.insert(loaded.refused.len());
                        loaded.refused.push(fault);
                    }
                }
            }
        }
    }
    if loaded.clips.is_empty() && loaded.refused.is_empty() {
        let message = match animations {
            1 => "the only animation moves no node and no morph target: there is nothing to sample"
                .to_owned(),
            _ => format!(
                "none of {animations} animations moves a node or a morph target: there is nothing to sample"
            ),
        };
        return Err(json.refuse("/animations", Code::NoAnimations, message));
    }
    loaded.warnings = reader.warnings.into_inner().into_list();
    loaded.document = Some(Arc::new(GltfDocument {
        name: name.to_owned(),
        container,
        folder: folder.map(Path::to_owned),
        limits: options.limits,
        animations: read,
    }));
    Ok(loaded)
}

/// Reads the skeleton of a file: one clip of the joints at rest, whose document can be written with other animations. The
/// file needs no animations.
///
/// # Errors
/// When the file cannot be opened, is invalid or has no nodes.
pub fn open_skeleton(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let (name, bytes, folder) = bytes_of(path, options.limits, options.pipes)?;
    let mut warnings = Warnings::new(&name);
    let container = Container::parse(&name, bytes, &mut warnings)?;
    let json = Json::parse(&name, &container.text)?;
    check_version(&json)?;
    let reader = GltfReader::new(&json, &container, folder, options.limits, warnings)?;
    let skeleton = character::skeleton(&reader, &Nodes::read(&json)?)?;
    let mut loaded = Loaded::of(skeleton, reader.warnings.into_inner().into_list());
    loaded.document = Some(Arc::new(GltfDocument {
        name,
        container,
        folder: folder.map(Path::to_owned),
        limits: options.limits,
        animations: Vec::new(),
    }));
    Ok(loaded)
}

/// # Errors
/// When the file is of another version of glTF, or of none.
fn check_version(json: &Json<'_>) -> Result<(), Diagnostic> {
    let Some(asset) = json.member("asset")? else {
        let message = "there is no `asset`, which every glTF file has";
        return Err(json.refuse("/asset", Code::Property, message));
    };
    let asset: Asset = json.typed(asset, "/asset")?;
    let least = asset.min_version.as_deref().unwrap_or("2.0");
    if asset.version.starts_with("2.") && least == "2.0" {
        return Ok(());
    }
    let (pointer, version) = match least {
        "2.0" => ("/asset/version", asset.version.as_str()),
        _ => ("/asset/minVersion", least),
    };
    let message = format!("the file is glTF {version}; export it as glTF 2.0");
    Err(json.refuse(pointer, Code::GltfVersion, message))
}
