//! The parts of glTF 2.0 that are read, with their names in its specification.

use std::borrow::Cow;
use std::fmt;

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::RawValue;

use crate::gltf::json::JsonMembers;
use crate::gltf::whole;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Asset {
    pub(super) version: String,
    pub(super) min_version: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub(super) name: Option<String>,
    #[serde(default)]
    #[serde(deserialize_with = "whole::list")]
    pub(super) children: Vec<usize>,
    /// Column after column.
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) mesh: Option<usize>,
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) skin: Option<usize>,
}

/// The other properties of a node, which are read only if a file contains them.
#[derive(Deserialize)]
pub(super) struct NodeBeside<'a> {
    #[serde(borrow)]
    pub(super) extras: Option<&'a RawValue>,
}

/// The BVH data of the joint that became a node.
#[derive(Deserialize)]
pub(super) struct Extras {
    pub(super) bvh: BvhExtras,
}

/// The mark of a node that is an origin of positions.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct OriginExtras {
    pub(super) tumble_origin: bool,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BvhExtras {
    pub(super) channels: String,
    #[serde(default)]
    pub(super) end_sites: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    #[serde(deserialize_with = "whole::list")]
    pub(super) joints: Vec<usize>,
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) inverse_bind_matrices: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct Texture {
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) source: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    #[serde(deserialize_with = "whole::list")]
    pub(super) nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Mesh<'a> {
    #[serde(borrow)]
    pub(super) primitives: Vec<Primitive<'a>>,
}

/// The parts of a mesh that concern morph targets.
#[derive(Deserialize)]
pub(super) struct MorphMesh<'a> {
    pub(super) primitives: Vec<MorphPrimitive>,
    #[serde(borrow)]
    pub(super) extras: Option<&'a RawValue>,
}

#[derive(Deserialize)]
pub(super) struct MorphPrimitive {
    #[serde(default)]
    pub(super) targets: Vec<IgnoredAny>,
}

/// The names of a mesh's morph targets, as most exporters write them.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct MorphExtras {
    pub(super) target_names: Vec<String>,
}

#[derive(Deserialize)]
pub(super) struct Primitive<'a> {
    pub(super) attributes: Attributes,
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) indices: Option<usize>,
    #[serde(default = "triangles")]
    #[serde(deserialize_with = "whole::whole")]
    pub(super) mode: u32,
    #[serde(borrow, default)]
    pub(super) extensions: JsonMembers<'a>,
}

/// The default mode of a primitive.
fn triangles() -> u32 {
    4
}

#[derive(Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) position: Option<usize>,
    #[serde(rename = "JOINTS_0")]
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) joints: Option<usize>,
    #[serde(rename = "WEIGHTS_0")]
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) weights: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct Animation<'a> {
    pub(super) name: Option<String>,
    #[serde(borrow, default)]
    pub(super) channels: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    pub(super) samplers: Vec<&'a RawValue>,
    #[serde(borrow)]
    pub(super) extras: Option<&'a RawValue>,
}

/// The extras that Tumble writes into an animation and reads again.
#[derive(Deserialize)]
pub(super) struct AnimationExtras {
    /// Why the positions of its joints are unknown.
    pub(super) no_world: Option<String>,
}

impl AnimationExtras {
    /// The name of this member.
    pub(super) const NO_WORLD: &str = "no_world";
}

#[derive(Deserialize)]
pub(super) struct Channel {
    #[serde(deserialize_with = "whole::whole")]
    pub(super) sampler: usize,
    pub(super) target: Target,
}

/// The property of a node that a channel moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum TargetPath {
    Translation,
    Rotation,
    Scale,
    /// The weights of the morph targets of the node's mesh.
    Weights,
}

impl TargetPath {
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "translation" => Self::Translation,
            "rotation" => Self::Rotation,
            "scale" => Self::Scale,
            "weights" => Self::Weights,
            _ => return None,
        })
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation",
            Self::Rotation => "rotation",
            Self::Scale => "scale",
            Self::Weights => "weights",
        }
    }

    /// The type of accessors with its values.
    pub(super) fn kind(self) -> &'static str {
        match self {
            Self::Rotation => "VEC4",
            Self::Translation | Self::Scale => "VEC3",
            Self::Weights => "SCALAR",
        }
    }

    /// The number of numbers of an element of the accessor. A key of weights has an element for each morph target; all
    /// other keys have one element.
    pub(super) fn width(self) -> usize {
        match self {
            Self::Rotation => 4,
            Self::Translation | Self::Scale => 3,
            Self::Weights => 1,
        }
    }
}

impl fmt::Display for TargetPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[derive(Deserialize)]
pub(super) struct Target {
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) node: Option<usize>,
    pub(super) path: String,
    #[serde(default)]
    pub(super) extensions: TargetExtensions,
}

impl Target {
    /// The node and the property that are moved; `None` if anything else is moved.
    pub(super) fn moves(&self) -> Option<(usize, TargetPath)> {
        if self.path == "pointer" {
            let pointer = self.extensions.pointer.as_ref()?;
            let mut parts = pointer.pointer.strip_prefix("/nodes/")?.split('/');
            let node = parts.next()?.parse().ok()?;
            let path = TargetPath::named(parts.next()?)?;
            return parts.next().is_none().then_some((node, path));
        }
        Some((self.node?, TargetPath::named(&self.path)?))
    }
}

#[derive(Deserialize, Default)]
pub(super) struct TargetExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pub(super) pointer: Option<Pointer>,
}

#[derive(Deserialize)]
pub(super) struct Pointer {
    pub(super) pointer: String,
}

#[derive(Deserialize)]
pub(super) struct Sampler {
    #[serde(deserialize_with = "whole::whole")]
    pub(super) input: usize,
    #[serde(deserialize_with = "whole::whole")]
    pub(super) output: usize,
    pub(super) interpolation: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    #[serde(deserialize_with = "whole::whole")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole::whole")]
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    #[serde(deserialize_with = "whole::whole")]
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub(super) struct Sparse {
    #[serde(deserialize_with = "whole::whole")]
    pub(super) count: u64,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    #[serde(deserialize_with = "whole::whole")]
    pub(super) buffer_view: usize,
    #[serde(default)]
    #[serde(deserialize_with = "whole::whole")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole::whole")]
    pub(super) component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    #[serde(deserialize_with = "whole::whole")]
    pub(super) buffer_view: usize,
    #[serde(default)]
    #[serde(deserialize_with = "whole::whole")]
    pub(super) byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView<'a> {
    #[serde(deserialize_with = "whole::whole")]
    pub(super) buffer: usize,
    #[serde(default)]
    #[serde(deserialize_with = "whole::whole")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole::whole")]
    pub(super) byte_length: u64,
    #[serde(default, deserialize_with = "whole::optional")]
    pub(super) byte_stride: Option<usize>,
    #[serde(borrow, default)]
    pub(super) extensions: JsonMembers<'a>,
}

/// `EXT_meshopt_compression` or `KHR_meshopt_compression` of a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct MeshoptView {
    #[serde(deserialize_with = "whole::whole")]
    pub(super) buffer: usize,
    #[serde(default)]
    #[serde(deserialize_with = "whole::whole")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole::whole")]
    pub(super) byte_length: u64,
    #[serde(deserialize_with = "whole::whole")]
    pub(super) byte_stride: usize,
    #[serde(deserialize_with = "whole::whole")]
    pub(super) count: usize,
    pub(super) mode: String,
    pub(super) filter: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer<'a> {
    #[serde(borrow)]
    pub(super) uri: Option<Cow<'a, str>>,
    #[serde(deserialize_with = "whole::whole")]
    pub(super) byte_length: u64,
    #[serde(default)]
    pub(super) extensions: BufferExtensions,
}

#[derive(Deserialize, Default)]
pub(super) struct BufferExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    ext: Option<Fallback>,
    #[serde(rename = "KHR_meshopt_compression")]
    khr: Option<Fallback>,
}

#[derive(Deserialize)]
struct Fallback {
    #[serde(default)]
    fallback: bool,
}

impl BufferExtensions {
    /// Whether the buffer is only a substitute for the data that meshopt decodes, and may be empty.
    pub(super) fn is_fallback(&self) -> bool {
        [&self.ext, &self.khr]
            .into_iter()
            .flatten()
            .any(|extension| extension.fallback)
    }
}
