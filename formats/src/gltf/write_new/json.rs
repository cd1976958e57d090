//! The JSON of a new glTF file, as animations need it. Numbers that name an object are indices in the list of such
//! objects.

use serde::Serialize;
use serde_json::{Map, Value};

/// The whole JSON.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Root {
    pub(super) asset: Asset,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub(super) extensions_used: &'static [&'static str],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub(super) extensions_required: &'static [&'static str],
    pub(super) scene: usize,
    pub(super) scenes: [Scene; 1],
    pub(super) nodes: Vec<Node>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) skins: Vec<Skin>,
    pub(super) animations: Vec<Animation>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
}

#[derive(Serialize)]
pub(super) struct Asset {
    pub(super) version: &'static str,
    pub(super) generator: &'static str,
}

/// The roots of the nodes.
#[derive(Serialize)]
pub(super) struct Scene {
    pub(super) nodes: Vec<usize>,
}

/// A node at rest, relative to its parent.
#[derive(Serialize)]
pub(super) struct Node {
    pub(super) name: String,
    /// Integers, or numbers of f32. Defaults of glTF are left out.
    #[serde(skip_serializing_if = "is_zero")]
    pub(super) translation: [f64; 3],
    #[serde(skip_serializing_if = "is_identity")]
    pub(super) rotation: [f32; 4],
    #[serde(skip_serializing_if = "is_one")]
    pub(super) scale: [f32; 3],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) children: Vec<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) extras: Option<Extras>,
}

/// Data that glTF cannot store otherwise, and that Tumble reads again.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Extras {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) bvh: Option<BvhExtras>,
    /// Whether the node is the origin of the positions of its children.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(super) tumble_origin: bool,
}

/// The BVH data of a joint.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BvhExtras {
    pub(super) channels: String,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) end_sites: Vec<[f32; 3]>,
}

/// The joints of one tree of nodes; `skeleton` is its root.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub(super) inverse_bind_matrices: usize,
    pub(super) skeleton: usize,
    pub(super) joints: Vec<usize>,
}

#[derive(Serialize, Default)]
pub(in crate::gltf) struct Animation {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(in crate::gltf) name: Option<String>,
    pub(in crate::gltf) channels: Vec<Channel>,
    pub(in crate::gltf) samplers: Vec<Sampler>,
    #[serde(skip_serializing_if = "Map::is_empty")]
    pub(in crate::gltf) extras: Map<String, Value>,
}

#[derive(Serialize)]
pub(in crate::gltf) struct Channel {
    pub(in crate::gltf) sampler: usize,
    pub(in crate::gltf) target: Target,
}

#[derive(Serialize)]
pub(in crate::gltf) struct Target {
    pub(in crate::gltf) node: usize,
    pub(in crate::gltf) path: &'static str,
}

#[derive(Serialize)]
pub(in crate::gltf) struct Sampler {
    pub(in crate::gltf) input: usize,
    pub(in crate::gltf) output: usize,
    #[serde(skip_serializing_if = "is_linear")]
    pub(in crate::gltf) interpolation: &'static str,
}

fn is_zero(translation: &[f64; 3]) -> bool {
    translation.map(f64::to_bits) == [0; 3]
}

fn is_identity(rotation: &[f32; 4]) -> bool {
    rotation.map(f32::to_bits) == [0.0f32, 0.0, 0.0, 1.0].map(f32::to_bits)
}

fn is_one(scale: &[f32; 3]) -> bool {
    *scale == [1.0; 3]
}

fn is_linear(interpolation: &&'static str) -> bool {
    *interpolation == "LINEAR"
}

fn is_start(byte_offset: &u64) -> bool {
    *byte_offset == 0
}

/// The component types of f32 and i16.
pub(in crate::gltf) const FLOAT: u32 = 5126;
pub(in crate::gltf) const SHORT: u32 = 5122;

/// The extension of compressed views.
pub(super) const MESHOPT: &str = "EXT_meshopt_compression";

/// `min` and `max` are f32 values with all digits of f64, so that readers that parse them as f64 find them equal to
/// the data.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: usize,
    #[serde(skip_serializing_if = "is_start")]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) min: Option<[f64; 1]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) max: Option<[f64; 1]>,
}

#[derive(Serialize, Clone)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(skip_serializing_if = "is_start")]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) extensions: Option<ViewExtensions>,
}

#[derive(Serialize, Clone)]
pub(super) struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub(super) meshopt: MeshoptView,
}

/// The location of a view's compressed bytes.
#[derive(Serialize, Clone)]
#[serde(rename_all = "camelCase")]
pub(super) struct MeshoptView {
    pub(super) buffer: usize,
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: u64,
    pub(super) mode: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) filter: Option<&'static str>,
    pub(super) count: u64,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) uri: Option<String>,
    pub(super) byte_length: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) extensions: Option<BufferExtensions>,
}

#[derive(Serialize)]
pub(super) struct BufferExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    pub(super) meshopt: Fallback,
}

/// A buffer that is only a substitute for the decoded data, and is empty.
#[derive(Serialize)]
pub(super) struct Fallback {
    pub(super) fallback: bool,
}
