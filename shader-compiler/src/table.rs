//! The table of kernels: which files of `shaders/` each is joined from, and what it reads.
//!
//! To add a kernel, write its file and name it in [`kernels`]; a store needs no more than its file.
//! The rest of the compiler walks the table: it writes the bindings and the functions that read them,
//! compiles each kernel, and gives Rust an enum of them, their layouts and their constants.

use std::fs;
use std::path::Path;

use crate::ROOT;

/// A buffer that a kernel reads, and the WGSL function that reads one element of it.
pub(crate) struct Read {
    pub(crate) buffer: &'static str,
    pub(crate) element: &'static str,
    pub(crate) function: &'static str,
}

const fn read(buffer: &'static str, element: &'static str, function: &'static str) -> Read {
    Read {
        buffer,
        element,
        function,
    }
}

/// One kernel, before it is joined.
pub(crate) struct Kernel {
    /// `arc_frames_f32`; the enum's variant is `ArcFramesF32`.
    pub(crate) name: String,
    /// Files below `shaders/`, without `.wgsl`, in the order in which they are joined.
    pub(crate) files: Vec<&'static str>,
    /// The buffers that it reads, bound in this order from 0 on, before the one that `store`
    /// writes. A kernel that declares its own bindings has none here.
    pub(crate) reads: Vec<&'static Read>,
    /// Whether it is compiled for texel buffers too; else it reads storage buffers only.
    pub(crate) has_texels: bool,
    /// Whether it loads elements from storage buffers by vectors of 16 bytes.
    pub(crate) loads_vectors: bool,
    /// Whether its stores bypass the caches, so that the data that it reads stays there.
    pub(crate) streams_results: bool,
    /// Whether it has a variant that converts to half precision as the device does.
    pub(crate) converts: bool,
}

/// The forms of segments, each with what its formula needs.
pub(crate) const FORMS: [(&str, &[&str]); 2] = [
    ("arc", &["math/sine_cosine", "forms/evaluate_arc"]),
    (
        "polynomial",
        &["math/polynomial", "forms/evaluate_polynomial"],
    ),
];

/// How the work over segments is listed: the entry point with the files that it needs, and what
/// it reads beside segments and constants.
pub(crate) const LISTS: [(&str, &[&str], &[Read]); 7] = [
    (
        "frames",
        &[
            "lists/dispatch",
            "lists/item",
            "runs",
            "lists/frame_distance",
        ],
        &[read("items", "Item", "item_at")],
    ),
    (
        "times",
        &[
            "lists/dispatch",
            "lists/item",
            "runs",
            "lists/time_distance",
        ],
        &[
            read("items", "Item", "item_at"),
            read("distances", "f32", "distance_at"),
        ],
    ),
    (
        "samples",
        &["lists/dispatch", "samples"],
        &[read("samples", "ListedSample", "sample_at")],
    ),
    (
        "frames_coalesced",
        &[
            "lists/grid",
            "lists/item",
            "coalesced",
            "lists/frame_distance",
        ],
        &[
            read("items", "Item", "item_at"),
            read("blocks", "Block", "block_at"),
        ],
    ),
    (
        "times_coalesced",
        &[
            "lists/grid",
            "lists/item",
            "coalesced",
            "lists/time_distance",
        ],
        &[
            read("items", "Item", "item_at"),
            read("blocks", "Block", "block_at"),
            read("distances", "f32", "distance_at"),
        ],
    ),
    (
        "frames_spread",
        &["lists/spread", "lists/frame_distance", "lists/near_frame"],
        &[read("items", "SpreadRun", "item_at")],
    ),
    (
        "times_spread",
        &["lists/spread", "lists/time_distance", "lists/near_time"],
        &[
            read("items", "SpreadRun", "item_at"),
            read("distances", "f32", "distance_at"),
        ],
    ),
];

/// The folder of kernels over spread runs, and the file that they need beside a form's.
const SPREAD: &str = "spread";
fn beside_form(form: &str, folder: Option<&str>) -> Option<&'static str> {
    (form == "polynomial" && folder == Some(SPREAD)).then_some("spread/polynomial")
}

/// Kernels for cards, which read storage buffers: the folder with the two files that lead samples through a store,
/// of values of one part and of several.
fn folder_for_cards(list: &str) -> Option<&'static str> {
    let folders = ["coalesced", SPREAD];
    folders
        .into_iter()
        .find(|folder| list.ends_with(&format!("_{folder}")))
}

/// A representation in which rotations are stored.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Store {
    /// The name of a file of `shaders/stores` that has a function `store`.
    pub(crate) name: &'static str,
    /// The files that its line `// Needs: FILE, FILE.` names.
    needed: Vec<&'static str>,
    /// Whether a value has several parts, which neighbours store together.
    has_parts: bool,
}

pub(crate) fn stores() -> Vec<Store> {
    let mut stores = Vec::new();
    let folder = Path::new(ROOT).join("shaders/stores");
    for entry in fs::read_dir(folder).expect("the stores lie there") {
        let path = entry.expect("a file").path();
        let text = fs::read_to_string(&path).expect("WGSL").leak();
        let name = path
            .file_stem()
            .expect("a file's name")
            .display()
            .to_string();
        let is_variant = [WIDE_STORE[1], CONVERTING_STORE].contains(&&*format!("stores/{name}"));
        if text.contains("\nfn store(") && !is_variant {
            let mut lines = text.lines();
            let needed = lines.find_map(|line| line.strip_prefix("// Needs: "));
            let needed = needed.map_or_else(Vec::new, |files| {
                files.trim_end_matches('.').split(", ").collect()
            });
            stores.push(Store {
                name: name.leak(),
                needed,
                has_parts: text.contains("\nfn parts("),
            });
        }
    }
    stores.sort_unstable();
    stores
}

static CLIP: [Read; 2] = [
    read("segments", "Segment", "segment_at"),
    read("constants", "vec4f", "constant_at"),
];

static KEYS: [Read; 3] = [
    read("keys", "vec4u", "key_at"),
    read("samples", "KeySample", "sample_at"),
    read("weights", "TangentWeights", "weights_at"),
];

/// Kernels that evaluate samples straight from keys, each with the files that it needs.
const FROM_KEYS: [(&str, &[&str], usize); 3] = [
    (
        "arcs",
        &[
            "math/sine_cosine",
            "forms/evaluate_arc",
            "from_keys/arc_between",
        ],
        2,
    ),
    (
        "two_keys",
        &[
            "math/sine_cosine",
            "math/polynomial",
            "forms/evaluate_arc",
            "from_keys/arc_between",
            "from_keys/constant_velocity",
        ],
        2,
    ),
    (
        "cubics",
        &["math/vector", "math/norm_squared", "from_keys/small_angle"],
        3,
    ),
];

/// The kernel that prepares arcs: its files.
const PREPARE_ARCS: [&str; 5] = [
    "math/canonical",
    "math/sine_cosine",
    "forms/evaluate_arc",
    "from_keys/arc_between",
    "prepare_arcs",
];

/// The buffers that it reads. Keys are the constants of a clip.
static INTERVALS: [Read; 2] = [
    read("keys", "vec4u", "key_at"),
    read("intervals", "u32", "interval_at"),
];

/// Kernels over evaluated poses.
const POSES: [&str; 6] = [
    "poses/add",
    "poses/blend",
    "poses/mix",
    "poses/smooth",
    "poses/steps",
    "poses/world",
];

/// The files that evaluate the channels of a crowd's joints.
const CHANNELS: [&str; 10] = [
    "math/canonical",
    "math/sine_cosine",
    "math/arc_tangent",
    "math/quaternion",
    "math/polynomial",
    "forms/evaluate_arc",
    "crowd/entry",
    "crowd/cubic",
    "crowd/sampled",
    "crowd/layer_value",
];

/// The same where clips are stored compactly, in part as keys.
const COMPACT_CHANNELS: [&str; 13] = [
    "math/canonical",
    "math/sine_cosine",
    "math/arc_tangent",
    "math/quaternion",
    "math/vector",
    "math/polynomial",
    "forms/evaluate_arc",
    "from_keys/arc_between",
    "from_keys/small_angle",
    "crowd/entry",
    "crowd/cubic",
    "crowd/sampled",
    "crowd/compact",
];

/// The files for one layer of arcs, without a branch, in addition to a file with the curves of translations and scales.
const PLAIN_CHANNELS: [&str; 7] = [
    "math/canonical",
    "math/sine_cosine",
    "forms/evaluate_arc",
    "crowd/entry",
    "crowd/plain_arc",
    "crowd/cubic",
    "crowd/plain",
];

/// The buffers that they read. Cells are constants of segments, keys, masks and reference poses.
static CROWD_READS: [Read; 4] = [
    read("entries", "CrowdEntry", "entry_at"),
    read("channels", "CrowdChannel", "channel_at"),
    read("cells", "vec4f", "cell_at"),
    read("positions", "CrowdPosition", "position_at"),
];

/// Kernels that evaluate the joints of a crowd, each with the files that it needs in addition to the shared ones.
const CROWD_JOINTS: [(&str, &[&str], &[&str]); 6] = [
    ("rotations", &CHANNELS, &["crowd/layers", "crowd/rotations"]),
    (
        "plain_rotations",
        &PLAIN_CHANNELS,
        &["crowd/plain_cubic", "crowd/rotations"],
    ),
    (
        "locals",
        &CHANNELS,
        &[
            "math/matrix",
            "crowd/layers",
            "crowd/transform",
            "crowd/locals",
        ],
    ),
    (
        "plain_locals",
        &PLAIN_CHANNELS,
        &[
            "math/matrix",
            "crowd/plain_cubic",
            "crowd/transform",
            "crowd/locals",
        ],
    ),
    (
        "compact_rotations",
        &COMPACT_CHANNELS,
        &["crowd/layers", "crowd/rotations"],
    ),
    (
        "compact_locals",
        &COMPACT_CHANNELS,
        &[
            "math/matrix",
            "crowd/layers",
            "crowd/transform",
            "crowd/locals",
        ],
    ),
];

/// The files with the arguments of the dispatches of most kernels over a crowd.
const CROWD_ARGUMENTS: [&str; 2] = ["crowd/workgroup", "crowd/dispatch"];

/// Other kernels over a crowd.
const CROWD: [(&str, &[&str]); 7] = [
    ("gather", &["crowd/gather", "crowd"]),
    ("scatter", &["crowd/scatter", "crowd"]),
    (
        "times",
        &[
            "crowd/entry",
            "lists/frame_distance",
            "crowd/time_tables",
            "crowd/time_buffers",
            "crowd/ticks",
            "crowd/span_search",
            "crowd/times",
            "crowd",
        ],
    ),
    (
        "walk",
        &[
            "math/canonical",
            "crowd/affine",
            "crowd/link",
            "crowd/link_buffers",
            "crowd/walk",
            "crowd",
        ],
    ),
    (
        "walk_all",
        &[
            "math/canonical",
            "crowd/affine",
            "crowd/link",
            "crowd/link_buffers",
            "crowd/walk_all",
        ],
    ),
    (
        "skin",
        &["math/canonical", "crowd/affine", "crowd/skin", "crowd"],
    ),
    (
        "half",
        &[
            "math/half",
            "crowd/half_buffers",
            "crowd/any_half",
            "crowd/half",
            "crowd",
        ],
    ),
];

/// The files that kernels over whole instances share: they find positions, and store in either precision.
const WHOLE: [&str; 8] = [
    "crowd/workgroup",
    "lists/frame_distance",
    "crowd/time_tables",
    "crowd/ticks",
    "crowd/span_search",
    "math/half",
    "crowd/any_half",
    "crowd/whole",
];

/// Files of the crowd kernels that evaluate matrices.
const WHOLE_MATRICES: [&str; 5] = [
    "math/matrix",
    "crowd/transform",
    "crowd/affine",
    "crowd/link",
    "crowd/whole_matrices",
];

/// The curves of translations and scales on cards, where instances have one layer.
const WHOLE_CUBIC: [&str; 1] = ["crowd/cubic_or_constant"];

/// Kernels over whole instances, for cards, each with the files that it needs beside those that it shares.
const CROWD_WHOLE: [(&str, &[&[&str]]); 5] = [
    (
        "whole_rotations",
        &[&CHANNELS, &["crowd/layers", "crowd/whole_rotations"]],
    ),
    (
        "plain_whole_rotations",
        &[&PLAIN_CHANNELS, &WHOLE_CUBIC, &["crowd/whole_rotations"]],
    ),
    (
        "whole_matrices",
        &[&CHANNELS, &["crowd/layers"], &WHOLE_MATRICES],
    ),
    (
        "plain_whole_matrices",
        &[&PLAIN_CHANNELS, &WHOLE_CUBIC, &WHOLE_MATRICES],
    ),
    (
        "compact_whole_rotations",
        &[
            &COMPACT_CHANNELS,
            &["crowd/layers", "crowd/whole_rotations"],
        ],
    ),
];

/// The kernels over whole instances for cards whose subgroups vote and shuffle: the files that they share.
const CROWD_SUBGROUPS: [&str; 9] = [
    "crowd/workgroup",
    "math/canonical",
    "math/sine_cosine",
    "forms/evaluate_arc",
    "lists/frame_distance",
    "crowd/entry",
    "crowd/plain_arc",
    "crowd/time_tables",
    "crowd/ticks",
];

/// The kernels over subgroups, each with the files that store its results.
const CROWD_SUBGROUP_STORES: [(&str, &[&str]); 2] = [
    ("subgroup_rotations", &["stores/f32"]),
    ("subgroup_rotations_f16", &["math/half", "stores/f16"]),
];

/// The buffers that they read.
static WHOLE_READS: [Read; 6] = [
    read("entries", "CrowdEntry", "entry_at"),
    read("clips", "CrowdClip", "clip_at"),
    read("time_bases", "CrowdBase", "base_at"),
    read("spans", "CrowdSpan", "span_of"),
    read("channels", "CrowdChannel", "channel_at"),
    read("cells", "vec4f", "cell_at"),
];

/// Kernels over the states of a library's clips, each with the files that it needs beside the entry point.
const MOTION: [(&str, &[&str]); 7] = [
    (
        "joints",
        &[
            "math/sine_cosine",
            "math/arc_tangent",
            "math/quaternion",
            "math/polynomial",
            "forms/evaluate_arc",
            "from_keys/arc_between",
            "lists/frame_distance",
            "crowd/entry",
            "crowd/time_tables",
            "crowd/span_search",
            "crowd/cubic",
            "crowd/sampled",
            "motion/packed",
            "motion/joints",
        ],
    ),
    (
        "walk",
        &[
            "math/sine_cosine",
            "math/arc_tangent",
            "math/quaternion",
            "math/vector",
            "crowd/link",
            "motion/walk",
        ],
    ),
    (
        "differences",
        &[
            "math/sine_cosine",
            "math/arc_tangent",
            "math/quaternion",
            "motion/differences",
        ],
    ),
    ("store", &["motion/store"]),
    ("matrices", &["math/matrix", "motion/matrices"]),
    (
        "tree",
        &[
            "math/sine_cosine",
            "math/arc_tangent",
            "math/quaternion",
            "math/vector",
            "math/rotation_about",
            "motion/tree",
        ],
    ),
    ("pick", &["motion/pick"]),
];

/// The files of the self-test.
const SELF_TEST: [&str; 3] = ["math/sine_cosine", "math/arc_tangent", "self_test"];

/// The files that take the place of `stores/f32` in kernels that read texel buffers: the devices
/// that use these store words of 64 bits.
pub(crate) const WIDE_STORE: [&str; 2] = ["math/wide", "stores/f32_wide"];

/// The file that takes the place of `stores/f16` in kernels of devices whose conversions round as it does.
pub(crate) const CONVERTING_STORE: &str = "stores/f16_converted";

/// Every kernel.
pub(crate) fn kernels() -> Vec<Kernel> {
    let mut kernels = vec![Kernel {
        name: "self_test".to_owned(),
        files: SELF_TEST.to_vec(),
        reads: Vec::new(),
        has_texels: false,
        loads_vectors: false,
        streams_results: false,
        converts: false,
    }];
    for (form, formula) in FORMS {
        for (list, entry, listed) in LISTS {
            for store in stores() {
                let needed = store.needed.clone();
                let mut files = vec!["math/canonical"];
                files.extend([formula, entry].concat());
                files.extend(needed);
                files.push(format!("stores/{}", store.name).leak());
                let folder = folder_for_cards(list);
                files.extend(beside_form(form, folder));
                if let Some(folder) = folder {
                    let file = if store.has_parts { "together" } else { "alone" };
                    files.push(format!("{folder}/{file}").leak());
                }
                kernels.push(Kernel {
                    name: format!("{form}_{list}_{}", store.name),
                    files,
                    reads: CLIP.iter().chain(listed).collect(),
                    has_texels: folder.is_none(),
                    loads_vectors: folder == Some(SPREAD),
                    streams_results: folder.is_some(),
                    converts: folder.is_some() && store.name == "f16",
                });
            }
        }
    }
    for (name, needed, reads) in FROM_KEYS {
        let file = format!("from_keys/{name}").leak();
        let mut files = vec!["math/canonical", "from_keys"];
        files.extend(needed);
        files.extend([&*file, "stores/f32"]);
        kernels.push(Kernel {
            name: format!("from_keys_{name}"),
            files,
            reads: KEYS[..reads].iter().collect(),
            has_texels: true,
            loads_vectors: false,
            streams_results: false,
            converts: false,
        });
    }
    for file in POSES {
        let shared = [
            "math/canonical",
            "math/sine_cosine",
            "math/arc_tangent",
            "math/quaternion",
            "poses",
        ];
        kernels.push(Kernel {
            name: file.replace('/', "_"),
            files: shared.into_iter().chain([file]).collect(),
            reads: Vec::new(),
            has_texels: false,
            loads_vectors: false,
            streams_results: false,
            converts: false,
        });
    }
    for (name, shared, parts) in CROWD_JOINTS {
        kernels.push(Kernel {
            name: format!("crowd_{name}"),
            files: [&CROWD_ARGUMENTS, shared, parts, &["stores/f32", "crowd"]].concat(),
            reads: CROWD_READS.iter().collect(),
            has_texels: true,
            loads_vectors: false,
            streams_results: false,
            converts: false,
        });
    }
    for (name, parts) in CROWD {
        kernels.push(Kernel {
            name: format!("crowd_{name}"),
            files: [&CROWD_ARGUMENTS, parts].concat(),
            reads: Vec::new(),
            has_texels: false,
            loads_vectors: false,
            streams_results: false,
            converts: false,
        });
    }
    for (name, parts) in CROWD_WHOLE {
        kernels.push(Kernel {
            name: format!("crowd_{name}"),
            files: [&WHOLE, &*parts.concat()].concat(),
            reads: Vec::new(),
            has_texels: false,
            loads_vectors: false,
            streams_results: false,
            converts: false,
        });
    }
    for (name, store) in CROWD_SUBGROUP_STORES {
        kernels.push(Kernel {
            name: format!("crowd_{name}"),
            files: [&CROWD_SUBGROUPS, store, &["crowd/subgroup_rotations"]].concat(),
            reads: WHOLE_READS.iter().collect(),
            has_texels: false,
            loads_vectors: true,
            streams_results: false,
            converts: store.contains(&"stores/f16"),
        });
    }
    for (name, parts) in MOTION {
        kernels.push(Kernel {
            name: format!("motion_{name}"),
            files: [&["math/canonical", "motion"], parts].concat(),
            reads: Vec::new(),
            has_texels: false,
            loads_vectors: false,
            streams_results: false,
            converts: false,
        });
    }
    kernels.push(Kernel {
        name: "prepare_arcs".to_owned(),
        files: PREPARE_ARCS.to_vec(),
        reads: INTERVALS.iter().collect(),
        has_texels: false,
        loads_vectors: false,
        streams_results: false,
        converts: false,
    });
    kernels
}
