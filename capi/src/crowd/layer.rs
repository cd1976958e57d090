//! A layer of an instance: the clip that it plays, and its time, speed and weight.

use tumble::WrapMode;
use tumble::crowd::{CrowdLayer, LayerBlend};

use crate::arguments::{SizedStructure, flag, option};
use crate::result::Failure;

/// The clip that a layer of an instance plays, and its time, speed, wrap mode and weight. If all members except
/// `size`, `instance` and `layer` are 0, the layer stands still at the start of the first clip, with weight 0.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleCrowdLayer {
    /// `sizeof(TumbleCrowdLayer)`.
    pub size: usize,
    /// The index of the instance, from 0.
    pub instance: usize,
    /// The index of the layer in the instance, from 0. Each layer is blended over the layers with lower indices.
    pub layer: usize,
    /// The index of the clip in the library, from 0.
    pub clip: usize,
    /// The layer's current time in ticks of the clip. Outside the clip `wrap` applies.
    pub time: i64,
    /// The speed: ticks of the clip for each tick of the clock. 1: as keyed, 0: the layer stands still, negative:
    /// backwards. Its magnitude is below 128; it is rounded to a multiple of 2^-16.
    pub speed: f32,
    /// The weight with which the layer is blended over the layers below, 0 to 1, rounded to a multiple of 2^-15. The
    /// weight of layer 0 is ignored.
    pub weight: f32,
    /// The motion outside the clip: a `TumbleWrap`, but not `TUMBLE_WRAP_EXTRAPOLATE`.
    pub wrap: u32,
    /// 1: the clip's difference from its reference pose is added to the layers below. 0: the layers below are
    /// interpolated towards the clip.
    pub additive: u32,
    /// The number of a mask, from `tumble_crowd_library_push_mask`; 0: all joints take part.
    pub mask: usize,
}

// SAFETY: `repr(C)`, the size is the first member, and zero bits are valid numbers.
unsafe impl SizedStructure for TumbleCrowdLayer {
    const FIRST_SIZE: usize = size_of::<Self>();
}

impl TumbleCrowdLayer {
    /// The instance, the layer and its new state; `index` is the change's index for messages.
    pub(crate) fn change(&self, index: usize) -> Result<(usize, usize, CrowdLayer), Failure> {
        let plays = CrowdLayer::new(self.clip)
            .at(self.time)
            .with_speed(self.speed)
            .with_wrap(option(
                self.wrap,
                &WrapMode::ALL,
                &format!("layers[{index}].wrap"),
            )?)
            .with_weight(self.weight)
            .with_blend(
                match flag(self.additive, &format!("layers[{index}].additive"))? {
                    true => LayerBlend::Additive,
                    false => LayerBlend::Over,
                },
            )
            .with_mask(self.mask.checked_sub(1));
        Ok((self.instance, self.layer, plays))
    }

    /// The state of a layer as a structure for C.
    pub(crate) fn new(instance: usize, layer: usize, plays: CrowdLayer) -> Self {
        let wrap = WrapMode::ALL.iter().position(|&wrap| wrap == plays.wrap);
        Self {
            size: size_of::<Self>(),
            instance,
            layer,
            clip: plays.clip,
            time: plays.time,
            speed: plays.speed,
            weight: plays.weight,
            wrap: wrap.unwrap_or(0) as u32,
            additive: u32::from(plays.blend == LayerBlend::Additive),
            mask: plays.mask.map_or(0, |mask| mask + 1),
        }
    }
}
