//! Twin of `shaders/crowd/cubic.wgsl`, `shaders/crowd/sampled.wgsl`, `shaders/crowd/layer_value.wgsl`,
//! `shaders/crowd/layers.wgsl`, `shaders/crowd/plain.wgsl`, `shaders/crowd/plain_arc.wgsl`,
//! `shaders/crowd/plain_cubic.wgsl`, `shaders/crowd/cubic_or_constant.wgsl` and `shaders/crowd/rotations.wgsl`: the same
//! names, the same order.

use glam::Vec4;

use crate::math::canonical::canonical;
use crate::shader::{
    ArcSegment, CHANNELS, CrowdChannel, CrowdEntry, CrowdPosition, FORM_ARC, FORM_CONSTANT,
    FORM_CUBIC, FORM_POLYNOMIAL, ON_KEY, POWERS, PolynomialSegment, TICKS, WEIGHT_UNIT,
};
use crate::twin::Evaluate as _;
use crate::twin::crowd_compact::value_of_keys;
pub(crate) use crate::twin::functions::{cubic, laid_over};

/// The buffers that the kernels over layers read. Entries and positions are those of a window of instances.
#[derive(Clone, Copy)]
pub(crate) struct Layers<'a> {
    pub(crate) entries: &'a [CrowdEntry],
    pub(crate) channels: &'a [CrowdChannel],
    pub(crate) cells: &'a [[f32; 4]],
    pub(crate) positions: &'a [CrowdPosition],
    pub(crate) joints: u32,
    /// Layers of an instance.
    pub(crate) layers: u32,
    /// The largest number of time bases of a clip.
    pub(crate) bases: u32,
    /// The cell of the first mask, and that of the first reference pose.
    pub(crate) masks: u32,
    pub(crate) references: u32,
}

/// The value of a channel at a position of its time base.
#[inline(always)]
pub(crate) fn sampled(
    cells: &[[f32; 4]],
    channel: &CrowdChannel,
    position: CrowdPosition,
) -> [f32; 4] {
    let form = channel.form_and_base >> 24;
    let span = position.span & TICKS;
    let count = channel.count;
    let s = position.parameter;
    let cell = |index: u32| cells[index as usize];
    if form == FORM_CONSTANT {
        return cell(channel.first);
    }
    if form > FORM_POLYNOMIAL {
        return value_of_keys(cells, channel, position);
    }
    if position.span & ON_KEY != 0 {
        return cell(channel.keys + span * count);
    }
    let value = if form == FORM_ARC {
        let first = channel.first + span * count * 2;
        let (middle, tangent) = (cell(first), cell(first + count));
        ArcSegment { middle, tangent }.at(s)
    } else if form == FORM_CUBIC {
        let first = channel.first + span * count * 4;
        let coefficient = |power: u32| Vec4::from_array(cell(first + power * count));
        cubic(
            coefficient(0),
            coefficient(1),
            coefficient(2),
            coefficient(3),
            Vec4::splat(s),
        )
    } else {
        let first = channel.first + span * count * POWERS as u32;
        let coefficient = |power: usize| cell(first + power as u32 * count);
        let coefficients = std::array::from_fn(coefficient);
        PolynomialSegment { coefficients }.at(s)
    };
    value.to_array().map(canonical)
}

impl Layers<'_> {
    fn cell(&self, index: u32) -> [f32; 4] {
        self.cells[index as usize]
    }

    /// The weight of a layer, and the cells of its mask, whose first numbers are the joints' factors of the weight.
    #[inline(always)]
    pub(crate) fn weight_and_mask(&self, entry: &CrowdEntry) -> (f32, &[[f32; 4]]) {
        let mask = self.masks + ((entry.speed_and_modes >> 24) & 0x1f) * self.joints;
        let weight = (entry.clip_and_weight >> 16) as f32 * WEIGHT_UNIT;
        (weight, &self.cells[mask as usize..][..self.joints as usize])
    }

    /// The reference pose of a layer's clip: the channels of each joint.
    #[inline(always)]
    pub(crate) fn references_of(&self, entry: &CrowdEntry) -> &[[f32; 4]] {
        let of_clip = self.joints * CHANNELS;
        let first = self.references + (entry.clip_and_weight & 0xffff) * of_clip;
        &self.cells[first as usize..][..of_clip as usize]
    }

    /// The `kind`th channel of a joint in one layer.
    #[inline(always)]
    pub(crate) fn layer_value(
        &self,
        layer: u32,
        entry: &CrowdEntry,
        joint: u32,
        kind: u32,
    ) -> [f32; 4] {
        let clip = entry.clip_and_weight & 0xffff;
        let channel = &self.channels[((clip * self.joints + joint) * CHANNELS + kind) as usize];
        let index = layer * self.bases + (channel.form_and_base & 0x00ff_ffff);
        sampled(self.cells, channel, self.positions[index as usize])
    }

    /// Blends the layers above the first over its value of a channel.
    #[inline(always)]
    pub(crate) fn over(
        &self,
        instance: u32,
        joint: u32,
        kind: u32,
        mut value: [f32; 4],
    ) -> [f32; 4] {
        let first = instance * self.layers;
        for layer in first + 1..first + self.layers {
            let entry = &self.entries[layer as usize];
            let weight = entry.clip_and_weight >> 16;
            if weight != 0 {
                let modes = entry.speed_and_modes;
                let mask = self.masks + ((modes >> 24) & 0x1f) * self.joints + joint;
                let layer_weight = weight as f32 * WEIGHT_UNIT * self.cell(mask)[0];
                let clip = entry.clip_and_weight & 0xffff;
                let reference = self.references + (clip * self.joints + joint) * CHANNELS + kind;
                let next = self.layer_value(layer, entry, joint, kind);
                let reference = self.cell(reference);
                value = laid_over(kind, modes >> 31 != 0, value, next, reference, layer_weight);
            }
        }
        value
    }

    /// The `kind`th channel of a joint, with all layers.
    #[inline(always)]
    pub(crate) fn layered(&self, instance: u32, joint: u32, kind: u32) -> [f32; 4] {
        let first = instance * self.layers;
        let value = self.layer_value(first, &self.entries[first as usize], joint, kind);
        self.over(instance, joint, kind, value)
    }
}
