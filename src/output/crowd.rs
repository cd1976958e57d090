//! The values that a crowd's evaluation stores, and their sizes.

use crate::names::names;

/// The values that are stored for every joint of every instance, `[instance][joint]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CrowdValues {
    /// The rotation in the parent's frame, `x y z w`.
    Rotations,
    /// The transform in the parent's frame, `T R S`: three rows of four numbers of a matrix for column vectors. The
    /// last column is the translation.
    Local,
    /// The transform in the model's frame, as a matrix of the same layout.
    Model,
    /// The transform in the model's frame times the inverse bind matrix, for skinning of vertices.
    Skinning,
}

names! {
    CrowdValues, "kind of values",
    Rotations => "rotations",
    Local => "local",
    Model => "model",
    Skinning => "skinning",
}

/// Matrices of a crowd in a buffer that become those of a later stage, in place. The application may have changed
/// them before.
#[cfg(feature = "vulkan")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CrowdStage {
    /// [`CrowdValues::Local`] become [`CrowdValues::Model`], as by
    /// [`CrowdLibrary::local_to_model`](crate::crowd::CrowdLibrary::local_to_model).
    LocalToModel,
    /// [`CrowdValues::Model`] become [`CrowdValues::Skinning`], as by
    /// [`CrowdLibrary::model_to_skinning`](crate::crowd::CrowdLibrary::model_to_skinning).
    ModelToSkinning,
    /// [`CrowdValues::Local`] become [`CrowdValues::Skinning`], by both.
    LocalToSkinning,
}

#[cfg(feature = "vulkan")]
names! {
    CrowdStage, "stage of a crowd",
    LocalToModel => "local-to-model",
    ModelToSkinning => "model-to-skinning",
    LocalToSkinning => "local-to-skinning",
}

#[cfg(feature = "vulkan")]
impl CrowdStage {
    /// The values that it stores, in 32 bits.
    #[must_use]
    pub fn output(self) -> CrowdOutput {
        match self {
            Self::LocalToModel => CrowdValues::Model.into(),
            Self::ModelToSkinning | Self::LocalToSkinning => CrowdValues::Skinning.into(),
        }
    }
}

/// The values that a crowd's evaluation stores, and their precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct CrowdOutput {
    /// The values of every joint.
    pub values: CrowdValues,
    /// Whether numbers are stored in 16 bits, rounded to nearest, instead of 32.
    pub is_half: bool,
}

impl From<CrowdValues> for CrowdOutput {
    fn from(values: CrowdValues) -> Self {
        Self {
            values,
            is_half: false,
        }
    }
}

impl CrowdOutput {
    /// Output of these values in 16 bits.
    #[must_use]
    pub fn half(values: CrowdValues) -> Self {
        Self {
            values,
            is_half: true,
        }
    }

    /// Number of vectors of four numbers for each joint.
    #[must_use]
    pub fn vector_count(self) -> usize {
        match self.values {
            CrowdValues::Rotations => 1,
            _ => 3,
        }
    }

    /// Number of bytes for each joint.
    #[must_use]
    pub fn bytes(self) -> usize {
        self.vector_count() * if self.is_half { 8 } else { 16 }
    }
}

/// A step of a frame, over all instances or over one: the CPU and devices take the same steps in the same order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrameStep {
    /// The position of each layer in its clip.
    Positions,
    /// Rotations of joints, layers over layers.
    Rotations,
    /// Rotations, translations and scales as matrices in the parent's frame.
    Locals,
    /// Matrices in the model's frame, parents first.
    Walk,
    /// Products with the inverse bind matrices.
    Skin,
    /// Rounding to 16 bits.
    Half,
}

impl FrameStep {
    /// The steps of an output, in their order.
    pub(crate) fn of(output: CrowdOutput) -> impl Iterator<Item = Self> {
        use CrowdValues::{Model, Rotations, Skinning};
        let walks = matches!(output.values, Model | Skinning);
        let joints = match output.values {
            Rotations => Self::Rotations,
            _ => Self::Locals,
        };
        [
            Some(Self::Positions),
            Some(joints),
            walks.then_some(Self::Walk),
            (output.values == Skinning).then_some(Self::Skin),
            output.is_half.then_some(Self::Half),
        ]
        .into_iter()
        .flatten()
    }
}

#[cfg(feature = "vulkan")]
impl FrameStep {
    /// The steps of a stage, in their order: some of those of its output.
    pub(crate) fn of_stage(stage: CrowdStage) -> impl Iterator<Item = Self> {
        Self::of(stage.output()).filter(move |step| match step {
            Self::Walk => stage != CrowdStage::ModelToSkinning,
            Self::Skin => true,
            Self::Positions | Self::Rotations | Self::Locals | Self::Half => false,
        })
    }
}

/// The maximum number of changes that are listed, for a crowd with `entries` entries. If more entries changed, all
/// entries from the first to the last that changed are written.
pub(crate) fn listed_changes(entries: usize) -> usize {
    entries.div_ceil(4)
}
